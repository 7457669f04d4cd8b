//! Voltages that jump from one sample to the next: a wire that came off while the axis was searching.
//!
//! Magnets do not jump. A voltage that changes at once by far more than the travel explains, and stays there, has another
//! cause, and both values tell which: an exchanged pair, the opposite sign, or nothing at all.

use core::fmt;

use units::{Metres, Volts};

use super::{HallPoint, Sensor, Settings};

/// Samples before a jump, and after it, that must lie together: one alone is a disturbance.
const HELD: usize = 3;
/// Distances below this are noise of the encoder.
const QUANTUM_M: f64 = 2e-6;
/// A voltage may change so many times faster than nine in ten pairs of neighbours do.
const STEEPER: f64 = 5.0;
/// A jump is larger than this share of Vc0.
const VC0_SHARE: f64 = 0.5;
/// How near two voltages are that count as the same, as a share of the jump.
const SAME_SHARE: f64 = 0.2;

/// A jump, and what it looks like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jump {
    /// Where.
    pub position: Metres,
    /// The sensor that jumped, or jumped farther.
    pub sensor: Sensor,
    /// Its voltage before.
    pub from: Volts,
    /// Its voltage after.
    pub to: Volts,
    /// What it looks like.
    pub cause: JumpCause,
}

/// What both values of a jump look like.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JumpCause {
    /// Each sensor shows what the other one showed.
    Swapped,
    /// The sign changed.
    Inverted,
    /// Nothing is left.
    Open,
    /// Anything else.
    Loose,
}

impl fmt::Display for Jump {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} jumped from {:.4} V to {:.4} V at {:.3} mm from one sample to the next: ",
            self.sensor,
            self.from.value(),
            self.to.value(),
            self.position.mm()
        )?;
        f.write_str(match self.cause {
            JumpCause::Swapped => "the two inputs were swapped",
            JumpCause::Inverted => "its polarity was inverted",
            JumpCause::Open => "its wire is open",
            JumpCause::Loose => "a loose contact",
        })
    }
}

/// A voltage of a sensor along the samples.
struct Curve {
    sensor: Sensor,
    volts: Vec<f64>,
    /// Nine in ten pairs of neighbours are less steep, V/m.
    steep: f64,
}

impl Curve {
    fn of(sensor: Sensor, points: &[HallPoint]) -> Self {
        let volts: Vec<f64> = points
            .iter()
            .map(|point| match sensor {
                Sensor::Peak => point.peak.value(),
                Sensor::Slope => point.slope.value(),
            })
            .collect();
        let mut slopes: Vec<f64> = volts
            .windows(2)
            .zip(points.windows(2))
            .map(|(volts, points)| (volts[1] - volts[0]).abs() / (apart(points) + QUANTUM_M))
            .collect();
        slopes.sort_by(f64::total_cmp);
        let steep = slopes.get(slopes.len() * 9 / 10).copied().unwrap_or(0.0);
        Self {
            sensor,
            volts,
            steep,
        }
    }

    /// How far it jumps behind sample `at`, 0 when it does not.
    fn jump(&self, at: usize, points: &[HallPoint], settings: &Settings) -> f64 {
        let after = &self.volts[at + 1..];
        let jump = after[0] - self.volts[at];
        let travelled = self.steep * (apart(&points[at..at + 2]) + QUANTUM_M);
        let allowed =
            10.0 * settings.noise.value() + STEEPER * travelled + VC0_SHARE * settings.vc0.value();
        let before = &self.volts[..=at];
        let stood = before.len() > HELD
            && before[at - HELD..]
                .iter()
                .all(|volts| (volts - self.volts[at]).abs() < jump.abs() / 4.0);
        let stays = stood
            && after.len() > HELD
            && after[1..=HELD]
                .iter()
                .all(|volts| (volts - after[0]).abs() < jump.abs() / 4.0);
        if jump.abs() > allowed && stays {
            jump
        } else {
            0.0
        }
    }
}

fn apart(pair: &[HallPoint]) -> f64 {
    (pair[1].position - pair[0].position).abs().value()
}

/// Finds the first jump in `points`, given in the order taken.
pub(super) fn find(points: &[HallPoint], settings: &Settings) -> Option<Jump> {
    let curves = [Sensor::Peak, Sensor::Slope].map(|sensor| Curve::of(sensor, points));
    (0..points.len().saturating_sub(1)).find_map(|at| {
        let jumps = curves
            .each_ref()
            .map(|curve| curve.jump(at, points, settings));
        let (curve, jump) = match jumps[0].abs() >= jumps[1].abs() {
            true => (&curves[0], jumps[0]),
            false => (&curves[1], jumps[1]),
        };
        (jump != 0.0).then(|| {
            let (from, to) = (curve.volts[at], curve.volts[at + 1]);
            Jump {
                position: points[at + 1].position,
                sensor: curve.sensor,
                from: Volts(from),
                to: Volts(to),
                cause: cause(&points[at], &points[at + 1], from, to),
            }
        })
    })
}

fn cause(before: &HallPoint, after: &HallPoint, from: f64, to: f64) -> JumpCause {
    let tolerance = SAME_SHARE * (to - from).abs();
    let is_same = |a: f64, b: f64| (a - b).abs() < tolerance;
    let exchanged = is_same(after.peak.value(), before.slope.value())
        && is_same(after.slope.value(), before.peak.value());
    if exchanged {
        JumpCause::Swapped
    } else if is_same(to, -from) {
        JumpCause::Inverted
    } else if is_same(to, 0.0) {
        JumpCause::Open
    } else {
        JumpCause::Loose
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hall_zero::rig::Magnets;

    /// From -1 mm to 1 mm, changed by `change` from 0.4 mm on.
    #[track_caller]
    fn check(change: fn([f64; 2]) -> [f64; 2], expected: Option<(Sensor, JumpCause)>) {
        let points: Vec<HallPoint> = (-200..=200)
            .map(|step| {
                let um = 5.0 * f64::from(step);
                let volts = Magnets::IDEAL.volts(um * 1e-3);
                let [peak, slope] = if um >= 400.0 { change(volts) } else { volts };
                HallPoint {
                    position: Metres::from_um(um),
                    peak: Volts(peak),
                    slope: Volts(slope),
                }
            })
            .collect();
        let seen = find(&points, &Settings::default());
        assert_eq!(seen.map(|jump| (jump.sensor, jump.cause)), expected);
    }

    #[test]
    fn a_jump_is_named_by_both_its_voltages() {
        check(|volts| volts, None);
        check(
            |[peak, slope]| [-peak, slope],
            Some((Sensor::Peak, JumpCause::Inverted)),
        );
        check(
            |[peak, slope]| [peak, -slope],
            Some((Sensor::Slope, JumpCause::Inverted)),
        );
        check(
            |[_, slope]| [0.01, slope],
            Some((Sensor::Peak, JumpCause::Open)),
        );
        check(
            |[peak, _]| [peak, 7.0],
            Some((Sensor::Slope, JumpCause::Loose)),
        );
    }

    #[test]
    fn exchanged_inputs_are_told_from_a_loose_wire() {
        let points: Vec<HallPoint> = (0..200)
            .map(|step| {
                let (peak, slope) = if step < 100 { (1.5, 3.1) } else { (3.1, 1.5) };
                HallPoint {
                    position: Metres::from_um(f64::from(step)),
                    peak: Volts(peak),
                    slope: Volts(slope),
                }
            })
            .collect();
        let jump = find(&points, &Settings::default()).expect("both jump");
        assert_eq!(jump.cause, JumpCause::Swapped);
        assert!(jump.to_string().contains("inputs were swapped"), "{jump}");
    }

    #[test]
    fn a_single_wild_sample_is_no_jump() {
        for wild in [0, 1, 100, 199] {
            let points: Vec<HallPoint> = (0..200)
                .map(|step| HallPoint {
                    position: Metres::from_um(f64::from(step)),
                    peak: Volts(if step == wild { 0.0 } else { 2.0 }),
                    slope: Volts(2.5),
                })
                .collect();
            assert_eq!(find(&points, &Settings::default()), None, "sample {wild}");
        }
    }
}
