//! What a commissioning engineer brings: a laser interferometer whose optics are set up for one
//! line of the tool's way at a time.
//!
//! The head, and what is not on the tool, stand with the workpiece; the target is mounted at a
//! tool offset of its own. With b the beam's direction and P the target's place in the
//! workpiece's frame, the counter sees this one-way path:
//!
//! | optics | path |
//! |---|---|
//! | linear: a corner cube on the tool | D + b·(P − P₀) |
//! | straightness: a Wollaston prism on the tool before a straightedge of two mirrors | 2·sin(φ/2) · (u − σ·b₀)·(P − P₀), each of its two beams being split off by φ/2 |
//! | angular: two corner cubes on the tool, s = d·(b₀ × a) apart | b·(P₁ − P₂) |
//!
//! | symbol | name |
//! |---|---|
//! | b₀, b | the line's direction; the beam's, off it by the hand that set it up |
//! | D | dead path |
//! | u, σ | the direction across that is measured; the straightedge's slope against the line |
//! | φ | `prism_divergence_deg` |
//! | a, d | the direction about which a tilt is measured; `angular_separation_mm` |
//!
//! P₀ is where the target stood when the line was set up. Absent: tilt limits of targets, errors
//! of the straightedge's flatness and of the separation, a prism turned about the beam, bending
//! of the beam by gradients in the air.

use core::time::Duration;

use units::portable::{hypot, sin};
use units::{Metres, Radians, Time};

use super::config::LaserConfig;
use super::rigid::{Vector, add, minus, times};
use super::truth::{LineTruth, Point};
use crate::random::Stream;

/// The optics before the laser's head.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LineOptics {
    /// Displacement along the line.
    Linear,
    /// Displacement in a direction across the line.
    Straightness {
        /// Which; its part along the line counts for nothing.
        across: [f64; 3],
    },
    /// Tilt about a direction across the line, right-handed.
    Angular {
        /// Which; its part along the line counts for nothing.
        about: [f64; 3],
    },
}

/// How a line is set up: from where the tool stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineSetUp {
    /// The optics.
    pub optics: LineOptics,
    /// The line's direction, of any length but none.
    pub along: [f64; 3],
    /// The target's place from the machine's zero, with all axes at 0: as the tool point's.
    pub tool_offset: Point,
}

/// What the interferometer looks at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::plant) struct Sighting {
    /// One way, in metres of air.
    pub(in crate::plant) path_m: f64,
    /// Its rate of change.
    pub(in crate::plant) speed_m_per_s: f64,
    /// Whether the beam comes back.
    pub(in crate::plant) is_lit: bool,
}

/// A line as it is set up.
#[derive(Clone, Debug)]
struct Line {
    optics: Optics,
    beam: Vector,
    offset_m: Vector,
    start_m: Vector,
    since: Time,
    truth: LineTruth,
}

/// The optics, ready to be reckoned with.
#[derive(Clone, Copy, Debug)]
enum Optics {
    Linear,
    /// What the path changes by, per metre of the target's way.
    Straightness(Vector),
    /// From the one corner cube to the other.
    Angular(Vector),
}

#[derive(Clone, Debug)]
pub(super) struct Laser {
    config: LaserConfig,
    dead_path_m: f64,
    hand: Stream,
    line: Option<Line>,
}

impl Laser {
    pub(super) fn new(config: &LaserConfig, dead_path_m: f64, seed: u64) -> Self {
        Self {
            config: config.clone(),
            dead_path_m,
            hand: Stream::new(seed, "line set up"),
            line: None,
        }
    }

    /// `target` tells where a target of a tool offset stands now. What is no direction sets
    /// nothing up.
    pub(super) fn set_up(
        &mut self,
        set_up: &LineSetUp,
        target: impl Fn(Vector) -> Vector,
        now: Time,
    ) {
        self.line = None;
        // The hand draws as much whatever it is asked for.
        let mut draw = |urad: f64| self.hand.between(-urad, urad) * 1e-6;
        let lean = [(); 2].map(|()| draw(self.config.misalignment_urad));
        let slope = draw(self.config.straightedge_slope_urad);
        let Some(along) = unit(set_up.along) else {
            return;
        };
        let Some(optics) = self.optics(&set_up.optics, along, slope) else {
            return;
        };
        let [first, second] = across(along);
        let leans = add(times(first, lean[0]), times(second, lean[1]));
        let offset_m = set_up.tool_offset.map(Metres::value);
        self.line = unit(add(along, leans)).map(|beam| Line {
            optics,
            beam,
            offset_m,
            start_m: target(offset_m),
            since: now,
            truth: LineTruth {
                misalignment: Radians(hypot(lean[0], lean[1])),
                slope: Radians(slope),
            },
        });
    }

    fn optics(&self, optics: &LineOptics, along: Vector, slope: f64) -> Option<Optics> {
        Some(match optics {
            LineOptics::Linear => Optics::Linear,
            LineOptics::Straightness { across } => {
                let direction = unit(without(*across, along))?;
                let half_angle = 0.5 * self.config.prism_divergence_deg.to_radians();
                let per_metre = 2.0 * sin(half_angle);
                let seen = minus(direction, times(along, slope));
                Optics::Straightness(times(seen, per_metre))
            }
            LineOptics::Angular { about } => {
                let axis = unit(without(*about, along))?;
                let apart_m = self.config.angular_separation_mm * 1e-3;
                Optics::Angular(times(cross(along, axis), apart_m))
            }
        })
    }

    pub(super) fn take_away(&mut self) {
        self.line = None;
    }

    /// Whether a line is set up.
    pub(super) const fn is_set_up(&self) -> bool {
        self.line.is_some()
    }

    /// What is seen now, `None` while no line is set up. `target` tells where a target of a tool
    /// offset is; `soon` the same a moment later, and how much later.
    pub(super) fn sighting(
        &self,
        target: impl Fn(Vector) -> Vector,
        (soon, later_s): (impl Fn(Vector) -> Vector, f64),
        now: Time,
    ) -> Option<Sighting> {
        let line = self.line.as_ref()?;
        let path_m = self.path_m(line, &target);
        Some(Sighting {
            path_m,
            speed_m_per_s: (self.path_m(line, &soon) - path_m) / later_s,
            is_lit: self.is_lit(line, target(line.offset_m), now),
        })
    }

    fn path_m(&self, line: &Line, target: &impl Fn(Vector) -> Vector) -> f64 {
        let way = || minus(target(line.offset_m), line.start_m);
        match line.optics {
            Optics::Linear => self.dead_path_m + dot(line.beam, way()),
            Optics::Straightness(seen) => dot(seen, way()),
            Optics::Angular(apart) => {
                let half = times(apart, 0.5);
                let one = target(add(line.offset_m, half));
                let other = target(minus(line.offset_m, half));
                dot(line.beam, minus(one, other))
            }
        }
    }

    /// Hands are in the beam for a while; the target leaves it sideways, or runs into the optics.
    fn is_lit(&self, line: &Line, target_m: Vector, now: Time) -> bool {
        let hands = Duration::from_secs_f64(self.config.set_up_ms * 1e-3);
        let way = minus(target_m, line.start_m);
        let forward_m = dot(line.beam, way);
        let aside = without(way, line.beam);
        now >= line.since + hands
            && dot(aside, aside).sqrt() <= self.config.lateral_max_mm * 1e-3
            && forward_m > -self.dead_path_m
    }

    pub(super) fn truth(&self) -> Option<LineTruth> {
        self.line.as_ref().map(|line| line.truth)
    }
}

fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: Vector, b: Vector) -> Vector {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// What of `v` is across the unit vector `along`.
fn without(v: Vector, along: Vector) -> Vector {
    minus(v, times(along, dot(v, along)))
}

fn unit(v: Vector) -> Option<Vector> {
    /// Shorter than this it points nowhere.
    const SHORTEST: f64 = 1e-6;
    let length = dot(v, v).sqrt();
    (length > SHORTEST).then(|| times(v, 1.0 / length))
}

/// Two directions across a unit vector and across each other.
fn across(along: Vector) -> [Vector; 2] {
    // Of the machine's directions, the one farthest from the line.
    let mut farthest = [0.0; 3];
    let least = (0..3).min_by(|a, b| along[*a].abs().total_cmp(&along[*b].abs()));
    farthest[least.unwrap_or(0)] = 1.0;
    let second = cross(along, farthest);
    let second = times(second, 1.0 / dot(second, second).sqrt());
    [cross(second, along), second]
}
