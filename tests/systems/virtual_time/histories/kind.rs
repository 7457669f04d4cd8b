//! The kinds of machine that histories are played on.

use service::{Coordinate, Speed};
use tests::{Edit, LINEAR, ROTARY, Shipped, VOLUMETRIC};
use units::{Metres, MetresPerSecond, Radians, RadiansPerSecond};

use super::judge::AxisFacts;

/// A machine and its requests.
#[derive(Clone, Copy, Debug)]
pub(super) struct Kind {
    pub(super) name: &'static str,
    pub(super) shipped: Shipped,
    pub(super) axes: &'static [AxisFacts],
    /// The speed of its file.
    pub(super) speed: f64,
    /// Where it is sent.
    pub(super) targets: (f64, f64),
    /// Where a search, a calibration or a verification may lead, in the drive's coordinates or, without a
    /// zero, from where it stands.
    pub(super) search: (f64, f64),
    /// How far a move may pass its target to arrive from the other side.
    pub(super) approach: f64,
    pub(super) turns: bool,
    /// Its axes follow paths together.
    pub(super) follows_paths: bool,
    pub(super) edit: fn(String) -> String,
}

const MM: f64 = 1e-3;
const DEG: f64 = core::f64::consts::PI / 180.0;
/// The adapter hands frames over every millisecond, and a drive looks at them as often.
const AT_ONCE: f64 = 0.002;

/// The linear stage; fewer passes and a faster search, so that a zero takes less time.
pub(super) const LINEAR_STAGE: Kind = Kind {
    name: "linear",
    shipped: LINEAR,
    axes: &[AxisFacts {
        name: "x",
        node: "drive",
        number: 0,
        following_error: 0.5 * MM,
        acceleration: 5000.0 * MM,
        friction: 2.0,
        reaction: AT_ONCE,
        jerk: f64::INFINITY,
        search_speed: 50.0 * MM,
        standing_speed: 0.5 * MM,
        per_unit: MM,
        unit: "mm",
    }],
    speed: 50.0 * MM,
    targets: (0.0, 60.0 * MM),
    search: (-80.0 * MM, 80.0 * MM),
    approach: 1.0 * MM,
    turns: false,
    follows_paths: false,
    edit: |text| {
        text.edit("speed_mm_per_s = 200.0", "speed_mm_per_s = 50.0")
            .edit(
                "reference_speed_mm_per_s = 20.0",
                "reference_speed_mm_per_s = 50.0",
            )
    },
};

/// The rotary table.
pub(super) const ROTARY_TABLE: Kind = Kind {
    name: "rotary",
    shipped: ROTARY,
    axes: &[AxisFacts {
        name: "c",
        node: "drive",
        number: 0,
        following_error: 600.0 / 3600.0 * DEG,
        acceleration: 180.0 * DEG,
        friction: 60.0 * DEG,
        reaction: AT_ONCE,
        jerk: f64::INFINITY,
        search_speed: 60.0 * DEG,
        standing_speed: 0.5 * DEG,
        per_unit: DEG,
        unit: "deg",
    }],
    speed: 30.0 * DEG,
    targets: (0.0, 360.0 * DEG),
    search: (-400.0 * DEG, 400.0 * DEG),
    approach: 0.0,
    turns: true,
    follows_paths: false,
    // Offsets as planned: a search for them in every history would take a quarter of its time.
    edit: |text| {
        text.edit("placements = 4 ", "offsets = [0, 73, 162, 232] ")
            .edit("optimise = \"worst\"", "")
    },
};

const fn slide(name: &'static str, node: &'static str, number: usize) -> AxisFacts {
    AxisFacts {
        name,
        node,
        number,
        following_error: 0.5 * MM,
        acceleration: 1000.0 * MM,
        friction: 1.0,
        // The machine hears at a SYNC, its drives at the next, and they reach a set-point one later.
        reaction: 3.0 * 0.010 + AT_ONCE,
        jerk: 20_000.0 * MM,
        search_speed: 20.0 * MM,
        standing_speed: 0.5 * MM,
        per_unit: MM,
        unit: "mm",
    }
}

/// Three axes that follow paths together.
pub(super) const THREE_AXES: Kind = Kind {
    name: "volumetric",
    shipped: VOLUMETRIC,
    axes: &[
        slide("x", "drive_x", 0),
        slide("y", "drive_y", 1),
        slide("z", "drive_z", 2),
    ],
    speed: 200.0 * MM,
    targets: (0.0, 80.0 * MM),
    search: (-560.0 * MM, 560.0 * MM),
    approach: 1.0 * MM,
    turns: false,
    follows_paths: true,
    // The detectors are read no more often than their ages allow, so that time passes quickly.
    edit: |text| {
        text.edit("sync_period_ms = 2.0", "sync_period_ms = 10.0")
            .edit("every_syncs = 10", "every_syncs = 5")
    },
};

impl Kind {
    pub(super) fn edited(&self, text: String) -> String {
        (self.edit)(text)
    }

    pub(super) fn target(&self, place: f64) -> Coordinate {
        match self.turns {
            true => Radians(place).into(),
            false => Metres(place).into(),
        }
    }

    pub(super) fn speed_of(&self, speed: f64) -> Speed {
        match self.turns {
            true => RadiansPerSecond(speed).into(),
            false => MetresPerSecond(speed).into(),
        }
    }

    /// The way from `here` to `target`, the shorter one round a turn.
    pub(super) fn way(&self, here: f64, target: f64) -> f64 {
        const TURN: f64 = core::f64::consts::TAU;
        let way = target - here;
        match self.turns {
            true => (way + TURN / 2.0).rem_euclid(TURN) - TURN / 2.0,
            false => way,
        }
    }

    /// The other way round to the same place, where it is longer by `slack` at most; else `way` itself.
    pub(super) fn way_around(&self, way: f64, slack: f64) -> f64 {
        const TURN: f64 = core::f64::consts::TAU;
        if self.turns && TURN - 2.0 * way.abs() <= 2.0 * slack {
            way - TURN.copysign(way)
        } else {
            way
        }
    }

    pub(super) fn text(&self, place: f64) -> String {
        let axis = &self.axes[0];
        format!("{:.3} {}", place / axis.per_unit, axis.unit)
    }
}
