//! Rotary tables, from a worm gear to an air bearing with a direct drive.

use crate::axis::write_watch;
use crate::bus;
use crate::draft::{Draft, Draw};

const TURN_ARCSEC: f64 = 1_296_000.0;
const DRIVE: &str = "rotary.c";
/// What a drive holds in 32 bits, nearly.
const REGISTER: f64 = 2.1e9;

/// What a table is.
struct Table {
    counts: f64,
    speed: f64,
    speed_max: f64,
    acceleration: f64,
    quick_stop: f64,
    window: f64,
    tolerance: f64,
}

impl Table {
    fn drawn(draw: &mut Draw) -> Self {
        let acceleration = draw.size((1.0, 5000.0));
        let quick_stop = acceleration * draw.size((1.0, 5.0));
        // From half a degree in a second to 500 turns a minute, reached within some seconds.
        let speed = draw.size((0.5, 3000.0)).min(acceleration * 20.0);
        let speed_max = speed * draw.size((1.0, 5.0));
        // From a tenth of a degree's thousandth to a thousandth of a second of arc.
        let most = REGISTER * 360.0 / quick_stop.max(speed_max);
        let counts = draw.size((3.6e5, 1.3e9)).min(most).floor();
        let window = TURN_ARCSEC / counts * draw.size((2.2, 20.0));
        Self {
            counts,
            speed,
            speed_max,
            acceleration,
            quick_stop,
            window,
            tolerance: window * draw.size((2.0, 50.0)),
        }
    }

    fn write(&self, draft: &mut Draft, draw: &mut Draw) {
        let lag = (self.speed * 3.6 * draw.size((1.0, 10.0))).max(self.window * 10.0);
        let turn_s = 360.0 / self.speed + self.speed / self.acceleration;
        let timeout_s = draw.even(2.0, 60.0) + turn_s * draw.size((1.2, 10.0));
        for (key, value) in [
            ("speed_deg_per_s", self.speed),
            ("speed_max_deg_per_s", self.speed_max),
            ("acceleration_deg_per_s2", self.acceleration),
            ("quick_stop_deceleration_deg_per_s2", self.quick_stop),
            ("following_error_limit_arcsec", lag),
            ("position_window_arcsec", self.window),
            ("move_timeout_s", timeout_s),
        ] {
            draft.set(DRIVE, key, value);
        }
        draft.set(DRIVE, "counts_per_turn", self.counts as u32);
        let late_ms = draw.size((10.0, 500.0)) as u32;
        draft.set(DRIVE, "following_error_timeout_ms", late_ms);
        let stands_ms = draw.size((5.0, 500.0)) as u32;
        draft.set(DRIVE, "position_window_time_ms", stands_ms);
        write_watch(draft, DRIVE, draw);
        let index = self.speed_max * draw.size((0.05, 1.0));
        draft.set("rotary.c.zero", "index_speed_deg_per_s", index.max(1e-3));
    }
}

pub fn table(text: &str, draw: &mut Draw) -> String {
    let draft = &mut Draft::of(text);
    let table = Table::drawn(draw);
    table.write(draft, draw);
    let sync_ms = bus::write(draft, &[1.0, 2.0, 4.0, 5.0, 10.0, 20.0], draw);
    write_plate(draft, &table, sync_ms, draw);
    // No gear is wrong by more than some degrees, which is also the most that is taken.
    let size = (table.tolerance * draw.size((2.0, 100.0))).min(1e4);
    draft.set("rotary.c.compensation", "size_limit_arcsec", size);
    draft.text()
}

/// A plate or a polygon, read from placement to placement.
fn write_plate(draft: &mut Draft, table: &Table, sync_ms: f64, draw: &mut Draw) {
    let run = "rotary.c.calibrate";
    let lines = draw.of(&[36, 72, 180, 360, 720]);
    let passes = draw.whole(1, 16);
    // Each line has the time of some SYNCs.
    let fastest = 360.0 / f64::from(lines) / (sync_ms * 1e-3) / 4.0;
    let speed = (fastest * draw.size((0.05, 1.0))).min(table.speed_max);
    draft.set(run, "lines", lines);
    // Few placements leave more of the noise in some harmonics, which whoever takes few allows for.
    let placements = draw.whole(3, 8);
    draft.set(run, "placements", placements);
    let amplified = 24.0 / f64::from(placements);
    draft.set(run, "amplification_limit", amplified);
    draft.set(run, "passes", passes);
    // A placement must not take longer than a night.
    draft.set(run, "speed_deg_per_s", speed.max(0.4).min(table.speed_max));
    let closure = table.tolerance * draw.size((0.1, 1.0));
    draft.set(run, "closure_limit_arcsec", closure);
    // The mean of all passes shows what is to be reached, and one of them need not.
    let mean = table.tolerance * draw.size((0.05, 0.4));
    let noise = mean * (2.0 * f64::from(passes)).sqrt();
    draft.set(run, "reading_noise_arcsec", noise);
    let verify = "rotary.c.verify";
    draft.set(verify, "offset_lines", f64::from(lines / 2) + 0.5);
    draft.set(verify, "passes", passes);
    draft.set(verify, "tolerance_arcsec", table.tolerance);
}
