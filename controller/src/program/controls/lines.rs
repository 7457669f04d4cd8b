//! Straight lines between places, as controls draw them: how many are needed, and how far they are from the curve.

use units::portable::{log10, powi};

use super::correction::Measure;
use crate::Failure;

/// How many pieces an interval between calibrated places is cut into at most.
const PARTS_MAX: usize = 64;
/// Where a line is compared with the curve.
const LOOKS: usize = 16;

/// A table of a control that draws straight lines and holds the ends.
pub(super) struct Lines {
    pub(super) places: Vec<f64>,
    pub(super) values: Vec<f64>,
}

impl Lines {
    pub(super) fn new(places: Vec<f64>, value: impl Fn(f64) -> f64) -> Self {
        let values = places.iter().map(|it| value(*it)).collect();
        Self { places, values }
    }

    fn at(&self, place: f64) -> f64 {
        let after = self.places.partition_point(|it| *it <= place);
        if after == 0 || after == self.places.len() {
            return self.values[after.min(self.values.len() - 1)];
        }
        let (x, y) = (
            &self.places[after - 1..=after],
            &self.values[after - 1..=after],
        );
        y[0] + (place - x[0]) / (x[1] - x[0]) * (y[1] - y[0])
    }

    /// How far they are from `curve` at most, looked at between the places and at `corners`, also beyond the ends.
    pub(super) fn off(&self, curve: impl Fn(f64) -> f64, corners: &[f64]) -> f64 {
        let between = self.places.windows(2).flat_map(|pair| {
            let (from, width) = (pair[0], pair[1] - pair[0]);
            (0..=LOOKS).map(move |it| from + width * it as f64 / LOOKS as f64)
        });
        let all = between.chain(corners.iter().copied());
        let off = all.map(|it| (self.at(it) - curve(it)).abs());
        off.fold(0.0, f64::max)
    }
}

/// Which places a table has.
#[derive(Clone, Copy)]
pub(super) struct Wanted {
    /// As somebody has typed it.
    pub(super) step: Option<f64>,
    /// As many as the control keeps.
    pub(super) max: usize,
    pub(super) measure: Measure,
}

impl Wanted {
    /// As few lines through `places(parts)` as are near enough to `curve`, with `parts`: into how many pieces the
    /// interval between two calibrated places is cut. The finest there is room for where none is.
    ///
    /// # Errors
    /// When not even the calibrated places have room.
    pub(super) fn lines(
        &self,
        places: impl Fn(usize) -> Vec<f64>,
        curve: impl Fn(f64) -> f64,
        corners: &[f64],
    ) -> Result<(Lines, usize), Failure> {
        let mut best: Option<(Lines, f64, usize)> = None;
        let mut parts = 1;
        while parts <= PARTS_MAX {
            let places = places(parts);
            if places.len() > self.max {
                break;
            }
            let lines = Lines::new(places, &curve);
            let off = lines.off(&curve, corners);
            let is_enough = off <= self.measure.harmless() || self.step.is_some();
            let is_no_better = best
                .as_ref()
                .is_some_and(|(_, before, _)| off > 0.9 * before);
            if is_no_better {
                break;
            }
            best = Some((lines, off, parts));
            if is_enough {
                break;
            }
            parts *= 2;
        }
        best.map(|(lines, _, parts)| (lines, parts))
            .ok_or_else(|| self.no_room("say a larger distance with --step".into()))
    }

    /// Before any place is made: a step that somebody mistypes must not fill the memory.
    ///
    /// # Errors
    /// When there is no room for so many `values`; `least` is a step that would do.
    pub(super) fn require_room(&self, values: usize, least: f64) -> Result<(), Failure> {
        if values <= self.max {
            return Ok(());
        }
        let (least, unit) = (self.measure.place(least), self.measure.place_unit());
        Err(self.no_room(format!("say --step {} ({unit})", self.rounded_up(least))))
    }

    /// A step to type: a little larger, in three digits; of a turn one that it can be divided by.
    fn rounded_up(&self, step: f64) -> String {
        match self.measure {
            Measure::Length => {
                let digit = powi(10.0, log10(step).floor() as i32 - 2);
                units::Short((step / digit).ceil() * digit).to_string()
            }
            Measure::Angle => {
                const THOUSANDTHS: usize = 360_000;
                let mut all = (step * 1e3).ceil().max(1.0) as usize..=THOUSANDTHS;
                let whole = all.find(|it| THOUSANDTHS.is_multiple_of(*it));
                units::Short(whole.unwrap_or(THOUSANDTHS) as f64 / 1e3).to_string()
            }
        }
    }

    fn no_room(&self, help: String) -> Failure {
        Failure::Usage {
            what: format!(
                "this table would have more than {} values, which is what there is room for",
                self.max
            ),
            help,
        }
    }

    /// Equal steps from `first` over `last`, of the smallest distance in `places` or of the step asked for.
    ///
    /// # Errors
    /// When the step asked for is none.
    pub(super) fn step(&self, places: &[f64]) -> Result<f64, Failure> {
        let smallest = places.windows(2).map(|pair| pair[1] - pair[0]);
        let range = places[places.len() - 1] - places[0];
        match self.step.map(|it| self.measure.typed(it)) {
            None => Ok(smallest.fold(range, f64::min)),
            Some(step) if step > 0.0 && step <= range => Ok(step),
            Some(_) => Err(Failure::Usage {
                what: format!(
                    "--step {}: it must be above zero and at most the calibrated range of {} {unit}",
                    units::Short(self.step.unwrap_or_default()),
                    units::Short(self.measure.place(range)),
                    unit = self.measure.place_unit()
                ),
                help: format!("write it in {}", self.measure.place_unit()),
            }),
        }
    }
}

/// As many equal steps of `step` as reach from `first` to `last`, rounding apart.
pub(super) fn steps(first: f64, last: f64, step: f64) -> usize {
    const ROUNDING: f64 = 1e-6;
    ((last - first) / step - ROUNDING).ceil().max(1.0) as usize
}

/// Each interval between `places` in `parts` pieces.
pub(super) fn cut(places: &[f64], parts: usize) -> Vec<f64> {
    let within = places.windows(2).flat_map(|pair| {
        let (from, width) = (pair[0], pair[1] - pair[0]);
        (0..parts).map(move |it| from + width * it as f64 / parts as f64)
    });
    within.chain(places.last().copied()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_gets_as_many_lines_as_it_needs_and_a_straight_one_no_more() {
        let places = [0.0, 0.01, 0.02];
        let wanted = |max| Wanted {
            step: None,
            max,
            measure: Measure::Length,
        };
        let curve = |it: f64| 0.1 * it * it;
        let (lines, parts) = wanted(1000)
            .lines(|parts| cut(&places, parts), curve, &[])
            .unwrap();
        // h²/8 of a curvature of 0.2: 10 nm at h = 0.63 mm.
        assert_eq!((lines.places.len(), parts), (2 * 16 + 1, 16));
        assert!(lines.off(curve, &[]) < 10e-9);
        let straight = wanted(1000).lines(|parts| cut(&places, parts), |it| 2.0 * it, &[]);
        assert_eq!(straight.unwrap().0.places, places);
        let (few, _) = wanted(5)
            .lines(|parts| cut(&places, parts), curve, &[])
            .unwrap();
        assert_eq!(few.places.len(), 5, "what there is room for");
        assert!(
            wanted(2)
                .lines(|parts| cut(&places, parts), curve, &[])
                .is_err()
        );
    }

    #[test]
    fn steps_reach_the_end() {
        assert_eq!(steps(0.0, 0.06, 0.003), 20);
        assert_eq!(steps(0.0, 0.061, 0.003), 21);
        assert_eq!(steps(0.0, 0.001, 0.003), 1);
    }
}
