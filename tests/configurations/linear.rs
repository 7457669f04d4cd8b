//! Linear stages, calibrated and verified with a laser, and gantries of two such sides.

use crate::axis::{GANTRY, HEAVY, LINEAR_MOTOR, Moves, PIEZO, SCREW};
use crate::bus;
use crate::draft::{Draft, Draw};
use crate::hall;

pub fn stage(text: &str, draw: &mut Draw) -> String {
    let draft = &mut Draft::of(text);
    let build = draw.of(&[&PIEZO, &LINEAR_MOTOR, &SCREW, &GANTRY, &HEAVY]);
    let mut moves = Moves::drawn(build, draw);
    let sync_ms = bus::write(draft, &[1.0, 2.0, 4.0, 5.0, 10.0, 20.0], draw);
    let plan = Plan::drawn(&mut moves, draw);
    moves.write(draft, "x", draw);
    hall::write(draft, ("x", "hall"), &moves, (sync_ms, f64::INFINITY), draw);
    bus::write_rate(draft, "laser", draw);
    plan.write(draft, draw);
    draft.text()
}

/// Neither steps, in mm, nor what a zero may be off by, in µm, can be finer.
const FINEST: f64 = 1e-3;

/// What is measured of a stage, and how well.
struct Plan {
    /// How far a run turns round beyond its ends, and how far a stop is approached.
    overrun_mm: f64,
    start_mm: f64,
    end_mm: f64,
    step_mm: f64,
    size_um: f64,
    tolerance_um: f64,
}

impl Plan {
    fn drawn(moves: &mut Moves, draw: &mut Draw) -> Self {
        // Limits for errors are some times what they are, and far more than the axis scatters.
        let size_um = (moves.error_um + 10.0 * moves.noise_um) * draw.size((1.2, 5.0));
        let overrun_mm = (moves.travel_mm * draw.size((0.005, 0.05))).max(1e-3);
        let margin_mm = 1.01 * (overrun_mm + size_um * 1e-3);
        moves.soft_min_mm = -margin_mm - moves.travel_mm * draw.even(0.0, 0.5);
        // A part of the travel where it works, or all of it.
        let (first, last) = (
            moves.soft_min_mm + margin_mm,
            moves.soft_max_mm() - margin_mm,
        );
        let length_mm = (last - first) * draw.of(&[0.2, 0.5, 1.0, 1.0]);
        let start_mm = first + (last - first - length_mm) * draw.even(0.0, 1.0);
        // What an axis is to be within is more than it scatters, and less than its errors.
        let scatter_um = (4.0 * moves.noise_um).max(2.0 * moves.window_um);
        Self {
            overrun_mm,
            start_mm,
            end_mm: start_mm + length_mm,
            step_mm: (length_mm / f64::from(draw.whole(5, 60))).max(FINEST),
            size_um,
            tolerance_um: scatter_um.max(size_um * draw.size((0.02, 0.5))),
        }
    }

    fn write(&self, draft: &mut Draft, draw: &mut Draw) {
        let between = draw.even(0.3, 0.7) * self.step_mm;
        for (section, start, end) in [
            ("axis.x.calibrate", self.start_mm, self.end_mm),
            (
                "axis.x.verify",
                self.start_mm + between,
                self.end_mm - between,
            ),
        ] {
            draft.set(section, "start_mm", start);
            draft.set(section, "end_mm", end);
            draft.set(section, "overrun_mm", self.overrun_mm);
            // Two samples where nothing shakes, a minute's where air is to be averaged away.
            draft.set(section, "settle_ms", draw.size((5.0, 5000.0)) as u32);
            let samples = draw.size((1.0, 5000.0)) as u32;
            draft.set(section, "average_samples", samples);
            draft.set(section, "runs", draw.whole(2, 10));
        }
        draft.set("axis.x.calibrate", "step_mm", self.step_mm);
        let closure = (self.tolerance_um * draw.size((0.1, 1.0))).max(FINEST);
        draft.set("axis.x.calibrate", "closure_limit_um", closure);
        let ppm = draw.size((200.0, 20_000.0));
        draft.set("axis.x.calibrate", "scale_limit_ppm", ppm);
        let short = self.tolerance_um * 1e3 * draw.size((0.01, 0.3));
        draft.set(
            "axis.x.calibrate",
            "short_period_standard_uncertainty_nm",
            short,
        );
        draft.set("axis.x.verify", "targets", draw.whole(5, 30));
        draft.set("axis.x.verify", "accuracy_tolerance_um", self.tolerance_um);
        self.write_limits(draft, draw);
        self.write_laser(draft, draw);
    }

    fn write_limits(&self, draft: &mut Draft, draw: &mut Draw) {
        let section = "axis.x.compensation";
        draft.set(section, "size_limit_um", self.size_um);
        draft.set(section, "slope_limit", draw.size((1e-5, 0.1)));
        draft.set(section, "approach_mm", self.overrun_mm);
        draft.set(section, "rate_limit_um_per_s", draw.size((1.0, 1e5)));
    }

    fn write_laser(&self, draft: &mut Draft, draw: &mut Draw) {
        let laser = "instrument.laser";
        let uncertain = self.tolerance_um * 1e3 * draw.size((0.01, 0.3));
        draft.set(laser, "instrument_standard_uncertainty_nm", uncertain);
        draft.set(laser, "dead_path_mm", draw.size((1.0, 3000.0)));
        draft.set(laser, "optics_factor", draw.of(&[1, 2]));
        draft.set(laser, "sample_rate_hz", draw.of(&[152.59, 305.18, 610.35]));
        draft.set(laser, "expansion_per_kelvin", draw.even(0.0, 25e-6));
    }
}

pub fn gantry(text: &str, draw: &mut Draw) -> String {
    let draft = &mut Draft::of(text);
    let build = draw.of(&[&LINEAR_MOTOR, &SCREW, &GANTRY, &HEAVY]);
    let mut moves = Moves::drawn(build, draw);
    moves.soft_min_mm = -moves.travel_mm * draw.even(0.02, 0.5);
    let sync_ms = bus::write(draft, &[1.0, 2.0, 4.0, 5.0, 10.0, 20.0], draw);
    let distance_mm = draw.size((100.0, 4000.0));
    // A stage bears being turned by some milliradians.
    let turn_mrad = draw.size((1.0, 20.0));
    let search_max_mm = 0.99 * turn_mrad * 1e-3 * distance_mm;
    for side in [("x1", "hall_1"), ("x2", "hall_2")] {
        moves.write(draft, side.0, draw);
        hall::write(draft, side, &moves, (sync_ms, search_max_mm), draw);
    }
    let beam = "gantry.beam";
    draft.set(beam, "distance_mm", distance_mm);
    let uncertain = distance_mm * draw.size((1e-4, 1e-2));
    draft.set(beam, "distance_standard_uncertainty_mm", uncertain);
    draft.set(beam, "turn_limit_mrad", turn_mrad);
    let switch_um = draw.size((1.0, 50.0));
    draft.set(beam, "reference_standard_uncertainty_um", switch_um);
    let ppm = draw.size((10.0, 5000.0));
    draft.set(beam, "scale_standard_uncertainty_ppm", ppm);
    draft.text()
}
