//! Drives of linear axes as they are built, from piezos to gantries.

use crate::draft::{Draft, Draw};

/// A way of building an axis, with the range of each of its figures.
pub struct Build {
    pub travel_mm: (f64, f64),
    pub speed_mm_per_s: (f64, f64),
    pub acceleration_mm_per_s2: (f64, f64),
    pub resolution_nm: (f64, f64),
    /// How well it repeats.
    pub noise_um: (f64, f64),
    /// Its errors before they are corrected, by its travel.
    pub error_ppm: (f64, f64),
}

/// A piezo with a capacitive sensor or a scale, open or in a flexure guide.
pub const PIEZO: Build = Build {
    travel_mm: (0.1, 1.0),
    speed_mm_per_s: (0.01, 20.0),
    acceleration_mm_per_s2: (10.0, 30_000.0),
    resolution_nm: (0.1, 2.0),
    noise_um: (0.001, 0.01),
    error_ppm: (300.0, 10_000.0),
};

/// A linear motor on rolling or air bearings, for wafers and optics.
pub const LINEAR_MOTOR: Build = Build {
    travel_mm: (20.0, 1000.0),
    speed_mm_per_s: (0.1, 2000.0),
    acceleration_mm_per_s2: (100.0, 30_000.0),
    resolution_nm: (1.0, 50.0),
    noise_um: (0.01, 1.0),
    error_ppm: (5.0, 200.0),
};

/// A ball or lead screw with a rotary encoder or a scale.
pub const SCREW: Build = Build {
    travel_mm: (5.0, 800.0),
    speed_mm_per_s: (0.01, 200.0),
    acceleration_mm_per_s2: (10.0, 5000.0),
    resolution_nm: (10.0, 1000.0),
    noise_um: (0.1, 5.0),
    error_ppm: (10.0, 500.0),
};

/// A gantry or a large machine tool with linear motors or racks.
pub const GANTRY: Build = Build {
    travel_mm: (500.0, 6000.0),
    speed_mm_per_s: (10.0, 3000.0),
    acceleration_mm_per_s2: (50.0, 30_000.0),
    resolution_nm: (10.0, 1000.0),
    noise_um: (0.1, 20.0),
    error_ppm: (5.0, 100.0),
};

/// A table of some tons that must not shake, as in a measuring machine or a telescope's test stand.
pub const HEAVY: Build = Build {
    travel_mm: (100.0, 3000.0),
    speed_mm_per_s: (0.05, 100.0),
    acceleration_mm_per_s2: (0.5, 100.0),
    resolution_nm: (1.0, 200.0),
    noise_um: (0.02, 5.0),
    error_ppm: (2.0, 50.0),
};

/// Nobody builds an axis that takes longer from end to end.
const CROSSING_MAX_S: f64 = 1800.0;
/// Nobody lets an axis gather speed for longer.
const RAMP_MAX_S: f64 = 30.0;
/// What a drive counts in 32 bits, nearly.
const COUNTS: f64 = 2.1e9;

/// What an axis is.
pub struct Moves {
    pub travel_mm: f64,
    pub soft_min_mm: f64,
    pub speed_mm_per_s: f64,
    pub speed_max_mm_per_s: f64,
    pub acceleration_mm_per_s2: f64,
    pub quick_stop_mm_per_s2: f64,
    pub resolution_nm: f64,
    pub noise_um: f64,
    pub window_um: f64,
    pub lag_um: f64,
    /// Its errors before they are corrected.
    pub error_um: f64,
}

impl Moves {
    pub fn drawn(build: &Build, draw: &mut Draw) -> Self {
        let travel_mm = draw.size(build.travel_mm);
        Self::of_travel(build, travel_mm, draw)
    }

    pub fn of_travel(build: &Build, travel_mm: f64, draw: &mut Draw) -> Self {
        let acceleration = draw.size(build.acceleration_mm_per_s2);
        // A speed that is reached within half of the travel, and takes it to the other end in good time.
        let fastest = (acceleration * travel_mm)
            .sqrt()
            .min(acceleration * RAMP_MAX_S);
        let slowest = travel_mm / CROSSING_MAX_S;
        let speed = draw.size(build.speed_mm_per_s).max(slowest).min(fastest);
        let quick_stop = acceleration * draw.size((1.0, 5.0));
        // What the drive's registers can hold.
        let finest = (travel_mm * 1.5e6 / COUNTS).max(quick_stop * 1e6 / COUNTS);
        let resolution_nm = draw.size(build.resolution_nm).max(finest);
        // An axis repeats no better than some part of a count, and stands within what it repeats to.
        let noise_um = draw.size(build.noise_um).max(resolution_nm * 3e-4);
        let window_um = (noise_um * draw.even(2.0, 6.0)).max(resolution_nm * 2.5e-3);
        // A servo lags behind by some milliseconds of its way.
        let lag_um = (speed * draw.size((1.0, 5.0))).max(window_um * 10.0);
        Self {
            travel_mm,
            soft_min_mm: -travel_mm / 2.0,
            speed_mm_per_s: speed,
            speed_max_mm_per_s: speed * draw.size((1.0, 5.0)),
            acceleration_mm_per_s2: acceleration,
            quick_stop_mm_per_s2: quick_stop,
            resolution_nm,
            noise_um,
            window_um,
            lag_um,
            error_um: travel_mm * 1e-3 * draw.size(build.error_ppm),
        }
    }

    pub fn soft_max_mm(&self) -> f64 {
        self.soft_min_mm + self.travel_mm
    }

    /// How long the whole travel takes, in seconds, nearly.
    pub fn crossing_s(&self) -> f64 {
        self.travel_mm / self.speed_mm_per_s + self.speed_mm_per_s / self.acceleration_mm_per_s2
    }

    pub fn write(&self, draft: &mut Draft, name: &str, draw: &mut Draw) {
        let section = &format!("axis.{name}");
        for (key, value) in [
            ("resolution_nm", self.resolution_nm),
            ("soft_min_mm", self.soft_min_mm),
            ("soft_max_mm", self.soft_max_mm()),
            ("speed_mm_per_s", self.speed_mm_per_s),
            ("speed_max_mm_per_s", self.speed_max_mm_per_s),
            ("acceleration_mm_per_s2", self.acceleration_mm_per_s2),
            (
                "quick_stop_deceleration_mm_per_s2",
                self.quick_stop_mm_per_s2,
            ),
            ("following_error_limit_um", self.lag_um),
            ("position_window_um", self.window_um),
        ] {
            draft.set(section, key, value);
        }
        let timeout_s = draw.even(2.0, 60.0) + self.crossing_s() * draw.size((1.2, 10.0));
        draft.set(section, "move_timeout_s", timeout_s);
        let stands_ms = draw.size((5.0, 500.0)) as u32;
        draft.set_if_there(section, "position_window_time_ms", stands_ms);
        let late_ms = draw.size((10.0, 500.0)) as u32;
        draft.set_if_there(section, "following_error_timeout_ms", late_ms);
        write_watch(draft, section, draw);
    }
}

/// How a node on CAN is watched, and watches its controller.
pub fn write_watch(draft: &mut Draft, section: &str, draw: &mut Draw) {
    let heartbeat_ms = draw.size((20.0, 500.0)) as u32;
    let lost_ms = heartbeat_ms * draw.whole(2, 5);
    draft.set_if_there(section, "heartbeat_producer_ms", heartbeat_ms);
    draft.set_if_there(section, "heartbeat_consumer_ms", lost_ms);
    let alone_ms = draw.size((200.0, 2000.0)) as u32;
    draft.set_if_there(section, "watch_master_ms", alone_ms);
}
