//! What is said of calibrations that make a platform worse: by x, y and angle first, then by its screws, whose
//! calibrations they are ([`compensator::platform::worse`]).

use compensator::platform::worse::{Dimension, Mistake, POSES_MIN, Part, Unit, mistakes};
use compensator::platform::{Platform, Pose};
use units::Metres;

use crate::platform::config::PARTS;
use crate::platform::state::difference;
use crate::worse::likely_cause;

/// A pose that was verified.
#[derive(Clone, Copy, Debug)]
pub(super) struct Judged {
    pub(super) target: Pose,
    /// By what the calibrations say that it would be off without them.
    pub(super) said: Pose,
    /// By what it would have been.
    pub(super) was: Pose,
}

/// Where a platform may be how far off, and what its screws are called.
pub(super) struct Permitted<'a> {
    pub(super) kinematics: &'a Platform,
    pub(super) screws: Vec<&'a str>,
    pub(super) tolerance: Metres,
    /// Where an error of the angle counts as a length.
    pub(super) edge: Metres,
}

impl Permitted<'_> {
    /// What probably is wrong, for a person.
    pub(super) fn cause(&self, judged: &[Judged]) -> String {
        if judged.len() < POSES_MIN {
            return format!(
                "{} poses are too few to tell why: verify at {POSES_MIN} or more (`poses` of [platform.verify])",
                judged.len()
            );
        }
        let coordinates = self.coordinates(judged);
        let by_coordinate = said_of(&coordinates, &PARTS);
        let screws = || {
            let names: Vec<String> = self.screws.iter().map(|it| format!("screw {it}")).collect();
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            said_of(&self.strokes(judged), &names)
        };
        let told = by_coordinate.or_else(screws);
        told.unwrap_or_else(|| unexplained(&coordinates))
    }

    /// x, y and the angle, each with its own tolerance.
    fn coordinates(&self, judged: &[Judged]) -> Vec<Part> {
        type Coordinate = fn(&Pose) -> f64;
        let length = self.tolerance.value();
        // Without an edge the angle is not judged.
        let angle = match self.edge.value() {
            edge if edge > 0.0 => length / edge,
            _ => f64::INFINITY,
        };
        let each: [(Dimension, f64, Coordinate); 3] = [
            (Dimension::Length, length, |it| it.x.value()),
            (Dimension::Length, length, |it| it.y.value()),
            (Dimension::Angle, angle, |it| it.angle.value()),
        ];
        let part = |(dimension, tolerance, of): (Dimension, f64, Coordinate)| Part {
            dimension,
            tolerance,
            said: judged.iter().map(|it| of(&it.said)).collect(),
            was: judged.iter().map(|it| of(&it.was)).collect(),
        };
        each.map(part).to_vec()
    }

    /// The same as strokes: what each screw would have to be off by.
    fn strokes(&self, judged: &[Judged]) -> Vec<Part> {
        let part = |screw: usize| {
            let stroke = |target: Pose, error: Pose| {
                let none = Pose::default();
                // The pose that is off by `error`: target − (0 − error).
                let there = difference(target, difference(none, error));
                let strokes = |pose| self.kinematics.strokes(pose)[screw].value();
                strokes(there) - strokes(target)
            };
            Part {
                dimension: Dimension::Length,
                tolerance: self.tolerance.value(),
                said: judged.iter().map(|it| stroke(it.target, it.said)).collect(),
                was: judged.iter().map(|it| stroke(it.target, it.was)).collect(),
            }
        };
        (0..self.screws.len()).map(part).collect()
    }
}

/// What mistakes of these parts explain; `None` where none does.
fn said_of(parts: &[Part], names: &[&str]) -> Option<String> {
    let found = mistakes(parts);
    let turned: Vec<usize> = found
        .iter()
        .filter_map(|it| match it {
            Mistake::Sign { part } => Some(*part),
            Mistake::Exchanged { .. } | Mistake::Scale { .. } => None,
        })
        .collect();
    let mut told = Vec::new();
    if !turned.is_empty() {
        told.push(format!(
            "what is left of {} is twice what they take away: its SIGN is wrong, or screw or camera count the other \
             way round",
            listed(&turned, names)
        ));
    }
    told.extend(found.iter().filter_map(|it| other_than_sign(it, names)));
    (!told.is_empty()).then(|| told.join("; "))
}

fn other_than_sign(mistake: &Mistake, names: &[&str]) -> Option<String> {
    match mistake {
        Mistake::Sign { .. } => None,
        Mistake::Exchanged { parts, turned } => {
            let [a, b] = parts.map(|it| names[it]);
            let sign = match turned {
                [false, false] => String::new(),
                [true, true] => ", both with the other sign".to_owned(),
                [true, false] => format!(", {a} with the other sign"),
                [false, true] => format!(", {b} with the other sign"),
            };
            Some(format!("{a} and {b} are EXCHANGED{sign}"))
        }
        Mistake::Scale {
            parts,
            factor,
            unit,
        } => {
            let parts = listed(parts, names);
            let probably = unit.map_or(String::new(), |it| format!(" ({})", unit_in_words(it)));
            // What was, over what is said: a large factor is said of too small figures.
            let (size, times) = match factor.abs() > 1.0 {
                true => ("small", factor.abs()),
                false => ("large", 1.0 / factor.abs()),
            };
            let sign = if *factor < 0.0 {
                ", with the other sign"
            } else {
                ""
            };
            Some(format!(
                "{parts} by {times:.1} times too {size}{sign}: a UNIT or a scale is wrong{probably}"
            ))
        }
    }
}

const fn unit_in_words(unit: Unit) -> &'static str {
    match unit {
        Unit::InchesForMillimetres => "inches taken for mm",
        Unit::MillimetresForInches => "mm taken for inches",
        Unit::MillimetresForMicrometres => "mm taken for µm",
        Unit::MicrometresForMillimetres => "µm taken for mm",
    }
}

/// `x, y and theta`.
fn listed(parts: &[usize], names: &[&str]) -> String {
    let names: Vec<&str> = parts.iter().map(|it| names[*it]).collect();
    match names.split_last() {
        Some((last, before)) if !before.is_empty() => format!("{} and {last}", before.join(", ")),
        _ => names.concat(),
    }
}

/// Each part that is off by itself, where no mistake explains it.
fn unexplained(parts: &[Part]) -> String {
    let mut told: Vec<(String, Vec<usize>)> = Vec::new();
    for (at, part) in parts.iter().enumerate().filter(|it| it.1.is_off()) {
        let pairs: Vec<(f64, f64)> = part.said.iter().copied().zip(part.left()).collect();
        let cause = likely_cause(&pairs);
        match told.iter_mut().find(|it| it.0 == cause) {
            Some((_, parts)) => parts.push(at),
            None => told.push((cause, vec![at])),
        }
    }
    match told.as_slice() {
        [(cause, _)] => cause.clone(),
        [] => likely_cause(&[]),
        _ => {
            let each = told.iter();
            let each = each.map(|(cause, parts)| format!("{}: {cause}", listed(parts, &PARTS)));
            each.collect::<Vec<_>>().join("; ")
        }
    }
}

#[cfg(test)]
mod tests {
    use units::Radians;

    use super::*;

    /// Errors of a platform that look like nothing else: x, y in micrometres, the angle in arc seconds.
    fn error(at: u32) -> [f64; 3] {
        let at = f64::from(at);
        [
            20.0 * (1.3 * at).sin() + 4.0,
            35.0 * (2.1 * at + 1.0).cos(),
            60.0 * (0.7 * at + 2.0).sin() * (1.9 * at).cos(),
        ]
    }

    fn pose([x, y, angle]: [f64; 3]) -> Pose {
        Pose {
            x: Metres::from_um(x),
            y: Metres::from_um(y),
            angle: Radians::from_arcsec(angle),
        }
    }

    /// What is told of calibrations that say `said` of these errors.
    fn told(said: impl Fn([f64; 3]) -> [f64; 3]) -> String {
        let mm = Metres::from_mm;
        let kinematics = Platform::uvw(mm(80.0), mm(80.0), mm(5.0)).unwrap();
        let permitted = Permitted {
            kinematics: &kinematics,
            screws: vec!["u", "v", "w"],
            tolerance: Metres::from_um(2.0),
            edge: mm(100.0),
        };
        let judged: Vec<Judged> = (0..20)
            .map(|at| {
                let place = 1e3 * (f64::from(at) / 10.0 - 1.0);
                let was = error(at);
                Judged {
                    target: pose([place, -place, 100.0]),
                    said: pose(said(was)),
                    was: pose(was.map(|it| it + 0.3 * f64::from(at * 7 % 5))),
                }
            })
            .collect();
        permitted.cause(&judged)
    }

    #[track_caller]
    fn check(said: impl Fn([f64; 3]) -> [f64; 3], expected: &str) {
        let told = told(said);
        assert!(told.contains(expected), "{told}");
    }

    #[test]
    fn a_mistake_in_a_coordinate_is_named_by_it_whatever_the_others_are() {
        check(|[x, y, angle]| [-x, y, angle], "left of x is twice");
        check(|[x, y, angle]| [x, -y, angle], "left of y is twice");
        check(|[x, y, angle]| [x, y, -angle], "left of theta is twice");
        check(|it| it.map(|it| -it), "left of x, y and theta is twice");
        check(|[x, y, angle]| [y, x, angle], "x and y are EXCHANGED");
        check(
            |[x, y, angle]| [-y, x, angle],
            "x and y are EXCHANGED, y with the other sign",
        );
        check(
            |[x, y, angle]| [25.4 * x, 25.4 * y, angle],
            "x and y by 25.4 times too large: a UNIT or a scale is wrong (mm taken for inches)",
        );
        check(
            |it| it.map(|it| it / 25.4),
            "x, y and theta by 25.4 times too small: a UNIT or a scale is wrong (inches taken for mm)",
        );
    }

    #[test]
    fn a_mistake_in_one_screw_that_moves_two_coordinates_is_named_by_the_screw() {
        // Of half of x and angle together each, the one screw says the opposite.
        let lever = 80e3 / 206_264.8;
        check(
            |[x, y, angle]| {
                let (u, v) = (x + lever * angle, x - lever * angle);
                let u = -u;
                [(u + v) / 2.0, y, (u - v) / 2.0 / lever]
            },
            "of screw ",
        );
    }

    #[test]
    fn what_has_nothing_to_do_with_it_is_no_sign_and_few_poses_tell_nothing() {
        let told = told(|[x, y, angle]| [300.0 * (x * 17.0).sin(), y, angle]);
        assert!(
            !told.contains("SIGN") && told.contains("ANOTHER stage"),
            "{told}"
        );
    }
}
