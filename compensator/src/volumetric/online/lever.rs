//! What a detector sees of its slide's tilts: it sits beside the slide's zero, on a lever.
//!
//! Source: rigid bodies: a small rotation ω moves what sits at r by ω × r. What rolls is known by
//! the roll detectors, what a bending guide tilts by thermometers (see
//! [`ThermalBend`]); the slide's own place is its displacement without both.
//!
//! Absent: tilts that nobody knows. Those of the tables are in the references already.

use units::{Celsius, Metres, Radians};

use super::Displacement;
use crate::volumetric::model::ThermalBend;
use crate::volumetric::point::cross;
use crate::volumetric::{Axis, Point};

/// Where the detector on a slide sits, and what tilts that slide.
#[derive(Clone, Debug)]
pub struct DetectorLever {
    axis: Axis,
    place: Point,
    /// The guides of this axis that bend.
    bends: Vec<ThermalBend>,
    /// The temperatures at which no guide bends beyond its tables.
    references: Vec<Celsius>,
}

impl DetectorLever {
    /// A detector on the slide of `axis`, at `place` with all axes at 0, as seen from the machine's
    /// zero; of `bends` those of its guide count, beyond what they are at the temperatures
    /// `references`.
    pub fn new(axis: Axis, place: Point, bends: &[ThermalBend], references: &[Celsius]) -> Self {
        let own = bends.iter().filter(|it| it.axis == axis);
        Self {
            axis,
            place,
            bends: own.copied().collect(),
            references: references.to_vec(),
        }
    }

    /// On whose slide it sits.
    pub fn axis(&self) -> Axis {
        self.axis
    }

    /// What the detector sees of tilts with the axis at `position`, as a displacement. `roll` is
    /// that of the slide beyond its reference. A bend by a temperature that is not there counts for
    /// nothing. Allocates nothing.
    pub fn seen(&self, position: Metres, roll: Radians, temperatures: &[Celsius]) -> Displacement {
        let kelvin = |at: usize| {
            let pair = temperatures.get(at).zip(self.references.get(at));
            pair.map_or(0.0, |(now, reference)| (*now - *reference).value())
        };
        let mut turn = [0.0; 3];
        turn[self.axis.index()] = roll.value();
        for bend in &self.bends {
            let own = bend.slide_turn(position, kelvin);
            for (sum, turn) in turn.iter_mut().zip(own) {
                *sum += turn.value();
            }
        }
        let moved = cross(turn, self.place.array());
        self.axis.others().map(|it| Metres(moved[it.index()]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bend(axis: Axis, towards: Axis) -> ThermalBend {
        ThermalBend {
            axis,
            towards,
            over: 0,
            under: Some(1),
            bow: Metres::from_um(4.0),
            u: Metres(0.0),
            low: Metres(0.0),
            high: Metres(0.4),
            gradient_max: 5.0,
            is_watched: true,
        }
    }

    #[track_caller]
    fn check(lever: &DetectorLever, at: f64, roll: f64, celsius: [f64; 2], um: [f64; 2]) {
        let seen = lever.seen(Metres(at), Radians(roll), &celsius.map(Celsius));
        for (seen, expected) in seen.iter().zip(um) {
            assert!((seen.um() - expected).abs() < 1e-9, "{} um", seen.um());
        }
    }

    /// About x: y goes to z. 20 urad at (0, 15, 25) mm: -0.5 um along y, +0.3 um along z.
    #[test]
    fn a_roll_is_seen_on_both_levers() {
        let place = Point::from_mm(0.0, 15.0, 25.0);
        let lever = DetectorLever::new(Axis::X, place, &[], &[]);
        check(&lever, 0.1, 20e-6, [20.0, 20.0], [-0.5, 0.3]);
    }

    /// s' = 4h(a + b - 2q)/L² = 40 urad/K at the beginning, nothing in the middle. z bends to y: its
    /// direction turns to y, about -x, and a place 25 mm up goes to +y.
    #[test]
    fn a_bending_guide_tilts_its_detector_by_what_it_is_warmer_than_at_the_calibration() {
        let place = Point::from_mm(0.0, 15.0, 25.0);
        let references = [Celsius(21.0), Celsius(20.0)];
        let bends = [bend(Axis::Z, Axis::Y), bend(Axis::X, Axis::Z)];
        let lever = DetectorLever::new(Axis::Z, place, &bends, &references);
        check(&lever, 0.0, 0.0, [21.0, 20.0], [0.0, 0.0]);
        check(&lever, 0.0, 0.0, [22.5, 20.5], [0.0, 1.0]);
        check(&lever, 0.2, 0.0, [22.5, 20.5], [0.0, 0.0]);
        check(&lever, 0.4, 0.0, [22.5, 20.5], [0.0, -1.0]);
    }
}
