//! Machines of three axes that are corrected throughout their volume, from a small one for optics to a portal of five
//! metres.

use crate::axis::{Build, Moves, write_watch};
use crate::bus;
use crate::detectors;
use crate::draft::{Draft, Draw};

/// An axis of a machine tool or a measuring machine.
const SLIDE: Build = Build {
    travel_mm: (50.0, 5000.0),
    speed_mm_per_s: (2.0, 1000.0),
    acceleration_mm_per_s2: (5.0, 10_000.0),
    resolution_nm: (5.0, 500.0),
    noise_um: (0.02, 2.0),
    error_ppm: (10.0, 200.0),
};

/// What of a machine follows from how large it is.
pub struct Volume {
    pub edges_mm: [f64; 3],
    /// The slides go so far beyond it.
    pub margin_mm: f64,
    size_um: f64,
    pub limit_um: f64,
    shortest_mm: f64,
}

pub fn machine(text: &str, draw: &mut Draw) -> String {
    let draft = &mut Draft::of(text);
    let longest_mm = draw.size(SLIDE.travel_mm);
    let edges_mm = [(); 3].map(|()| (longest_mm * draw.even(0.3, 1.0)).max(50.0));
    let margin_mm = longest_mm * draw.size((0.005, 0.05));
    let slides = edges_mm.map(|edge| {
        let mut moves = Moves::of_travel(&SLIDE, edge + 2.0 * margin_mm, draw);
        moves.soft_min_mm = -margin_mm;
        moves
    });
    let error_um = slides.iter().map(|it| it.error_um).fold(10.0, f64::max);
    let window_um = slides.iter().map(|it| it.window_um).fold(0.0, f64::max);
    let size_um = (error_um * draw.size((1.5, 5.0))).min(margin_mm * 900.0);
    let volume = Volume {
        edges_mm,
        margin_mm,
        size_um,
        limit_um: (error_um * draw.size((0.02, 0.3))).max(2.0 * window_um),
        shortest_mm: edges_mm.into_iter().fold(f64::INFINITY, f64::min),
    };
    for (name, moves) in ["x", "y", "z"].into_iter().zip(&slides) {
        moves.write(draft, name, draw);
        write_cyclic(draft, name, moves, &volume, draw);
    }
    let sync_ms = bus::write(draft, &[2.0, 4.0, 5.0, 10.0], draw);
    bus::write_rate(draft, "laser", draw);
    volume.write(draft, draw);
    write_zero(draft, &slides, margin_mm, draw);
    write_runs(draft, &volume, draw);
    detectors::write(draft, &volume, sync_ms, draw);
    for module in ["beams_x", "beams_y", "beams_z", "roll_and_heat"] {
        write_watch(draft, &format!("analog.{module}"), draw);
    }
    draft.text()
}

/// Its acceleration comes within some milliseconds, or within a second where a portal must not swing.
fn write_cyclic(draft: &mut Draft, name: &str, moves: &Moves, volume: &Volume, draw: &mut Draw) {
    let section = &format!("axis.{name}.cyclic");
    let jerk = moves.acceleration_mm_per_s2 / draw.size((0.002, 2.0));
    draft.set(section, "jerk_mm_per_s3", jerk.max(1.0));
    draft.set(section, "deviation_limit_um", moves.lag_um);
    draft.set(section, "correction_limit_um", volume.size_um * 1.2);
    draft.set(section, "correction_rate_um_per_s", 5000.0);
}

impl Volume {
    fn write(&self, draft: &mut Draft, draw: &mut Draw) {
        draft.set("volumetric", "high_mm", self.edges_mm);
        let limits = "volumetric.compensation";
        draft.set(limits, "size_limit_um", self.size_um);
        draft.set(limits, "rate_limit_um_per_s", draw.size((10.0, 5000.0)));
        let displaced_um = self.size_um * draw.size((0.05, 0.8));
        draft.set(limits, "displacement_max_um", displaced_um);
        for (bend, edge) in [(500.0, 0), (400.0, 1), (300.0, 2)] {
            let high = self.edges_mm[edge];
            draft.exchange(
                &format!("high_mm = {bend:?}"),
                &format!("high_mm = {high:?}"),
            );
        }
    }
}

fn write_zero(draft: &mut Draft, slides: &[Moves; 3], margin_mm: f64, draw: &mut Draw) {
    let zero = "volumetric.zero";
    let slowest = slides.iter().map(|it| it.speed_max_mm_per_s);
    let slowest = slowest.fold(f64::INFINITY, f64::min);
    let speed = slowest * draw.size((0.1, 1.0));
    let longest_mm = slides.iter().map(|it| it.travel_mm).fold(0.0, f64::max);
    draft.set(zero, "search_speed_mm_per_s", speed);
    let limit_s = draw.even(5.0, 60.0) + longest_mm / speed * draw.size((1.2, 4.0));
    draft.set(zero, "time_limit_s", limit_s);
    let index = [(); 3].map(|()| draw.even(-0.9, 2.0) * margin_mm);
    draft.set(zero, "index_mm", index);
}

fn write_runs(draft: &mut Draft, volume: &Volume, draw: &mut Draw) {
    let step = volume.shortest_mm / f64::from(draw.whole(6, 20));
    draft.set("volumetric.calibrate", "step_mm", step);
    draft.set("volumetric.reference", "step_mm", step / 2.0);
    let run = "volumetric.calibrate";
    draft.set(run, "settle_ms", draw.size((20.0, 20_000.0)));
    draft.set(run, "average_samples", draw.size((5.0, 5000.0)) as u32);
    // Across all of it, or along one of its axes.
    let [x, y, z] = volume.edges_mm;
    let whole = ([0.0; 3], [x, y, z]);
    let middle = [x / 2.0, y / 2.0, z / 2.0];
    let along = |at: usize| {
        let (mut from, mut to) = (middle, middle);
        from[at] = 0.1 * volume.edges_mm[at];
        to[at] = 0.9 * volume.edges_mm[at];
        (from, to)
    };
    let (from, to) = draw.of(&[whole, along(0), along(1), along(2)]);
    let verify = "volumetric.verify";
    draft.set(verify, "from_mm", from);
    draft.set(verify, "to_mm", to);
    draft.set(verify, "limit_um", volume.limit_um);
    let laser = "instrument.laser";
    let uncertain = volume.limit_um * 1e3 * draw.size((0.005, 0.3));
    draft.set(laser, "instrument_standard_uncertainty_nm", uncertain);
    draft.set(laser, "dead_path_mm", draw.size((1.0, 3000.0)));
}
