//! Instrument against encoder, point by point (fault classes 26 and 31).
//!
//! Deviation = measured − encoder. From one point to the next it changes by what a stage can
//! do; what goes beyond is no stage but the instrument: a wrong scale when it is there from the
//! first step on, a jump of the fringe count when it comes later. A jump of few fringes is no
//! larger than a stage's own deviation, and shows only against the run before: there the stage
//! repeats to tens of nanometres, while a counter that has slipped stays slipped by a whole
//! number of half wavelengths.

use units::Metres;

use crate::config::Count;
use crate::failure::Failure;
use crate::linear::PointEntry;
use crate::store::ClosureEntry;

/// Points on either side of a jump that make it believable.
const SIDE: usize = 3;
/// A jump is this near to a whole number of half wavelengths, in half wavelengths.
const NEAR: f64 = 0.25;
/// Samples of a stage at rest lie within nanometres; these are of one that is shaken.
const SHAKEN: Metres = Metres(2.5e-6);

/// What a stage can do, and what the instrument counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Plausible {
    /// Largest relative change of the deviation along the axis.
    pub(super) slope: f64,
    /// Largest change without travel. Lost motion, cyclic error and noise are part of the
    /// deviation, so that this is the largest deviation that will be corrected.
    pub(super) step: Metres,
    /// Largest relative difference of instrument and encoder believed, in millionths.
    pub(super) scale_limit_ppm: f64,
    /// What the instrument's counter counts.
    pub(super) count: Count,
}

/// Whether samples of one reading that scatter so much say nothing of the place.
pub(super) fn is_shaken(scatter: Metres) -> bool {
    scatter > SHAKEN
}

/// A whole run, and its datum's place before and after it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Run<'a> {
    pub(super) points: &'a [PointEntry],
    pub(super) closure: ClosureEntry,
}

/// The check of one measurement.
#[derive(Debug)]
pub(super) struct CrossCheck {
    axis: String,
    plausible: Plausible,
    steps: usize,
    last: Option<PointEntry>,
}

const fn deviation(point: &PointEntry) -> f64 {
    point.measured_m - point.encoder_m
}

impl CrossCheck {
    pub(super) fn new(axis: &str, plausible: Plausible) -> Self {
        Self {
            axis: axis.to_owned(),
            plausible,
            steps: 0,
            last: None,
        }
    }

    /// Judges a point against the one before it. A point whose own samples lie far apart says
    /// nothing of the count: vibration is for the fit to judge.
    ///
    /// # Errors
    /// When the instrument went another way than the encoder, beyond what a stage can do.
    pub(super) fn take(&mut self, point: &PointEntry) -> Result<(), Failure> {
        if is_shaken(Metres(point.scatter_m)) {
            return Ok(());
        }
        let Some(last) = self.last.replace(*point) else {
            return Ok(());
        };
        self.steps += 1;
        let travel = point.encoder_m - last.encoder_m;
        let jump = deviation(point) - deviation(&last);
        let Plausible {
            slope,
            step,
            scale_limit_ppm,
            ..
        } = self.plausible;
        let slope = slope.max(scale_limit_ppm * 1e-6);
        if jump.abs() <= slope * travel.abs() + step.value() {
            return Ok(());
        }
        if self.steps == 1 {
            let ratio = (point.measured_m - last.measured_m) / travel;
            let travel = travel.abs();
            return Err(scale_mismatch(&self.axis, travel, ratio, scale_limit_ppm));
        }
        Err(self.fringe_jump(jump, &last, point))
    }

    /// Judges a whole run against the run before: the same targets in the same order, and the
    /// datum's place before and after them, so that a slip on the way from run to run shows too.
    ///
    /// # Errors
    /// When the count slipped in one of them.
    pub(super) fn compare(&self, before: &Run<'_>, run: &Run<'_>) -> Result<(), Failure> {
        let count_m = self.plausible.count.length.value();
        let quiet = |point: &PointEntry| point.scatter_m < count_m;
        let (places, changes): (Vec<usize>, Vec<f64>) = before
            .points
            .iter()
            .zip(run.points)
            .enumerate()
            .filter(|(_, (a, b))| quiet(a) && quiet(b))
            .map(|(place, (a, b))| (place, deviation(b) - deviation(a)))
            .unzip();
        let Some(last) = places.len().checked_sub(1) else {
            return Ok(());
        };
        // The datum is one place, but it bounds the run: it counts as much as a side needs.
        let start = [run.closure.start_m - before.closure.start_m; SIDE];
        let end = [run.closure.closure_m - before.closure.closure_m; SIDE];
        let changes = [&start, changes.as_slice(), &end].concat();
        let Some(slip) = find_slip(&changes, SIDE, count_m) else {
            return Ok(());
        };
        // Up to there both runs agree or differ alike: the slip is in the later run when the
        // change comes, in the earlier one when it goes; the place is the same.
        let point = |at: usize| &run.points[places[at.saturating_sub(SIDE).min(last)]];
        let (from, to) = (point(slip.at - 1), point(slip.at));
        Err(self.fringe_jump(slip.jump_m * slip.sign(), from, to))
    }

    fn fringe_jump(&self, jump_m: f64, from: &PointEntry, to: &PointEntry) -> Failure {
        let count = jump_m / self.plausible.count.length.value();
        Failure::FringeJump {
            axis: self.axis.clone(),
            jump: Metres(jump_m),
            counts: count.round() as i64,
            of: self.plausible.count,
            run: to.run,
            from: Metres(from.target_m),
            to: Metres(to.target_m),
        }
    }
}

/// Where a row of changes from run to run has its step.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Slip {
    at: usize,
    before_m: f64,
    jump_m: f64,
}

impl Slip {
    /// A slip in the run before shows as a change that goes away: 0 … 0 became s … s there, so
    /// that the first part differs by s and the rest not at all.
    fn sign(&self) -> f64 {
        let after_m = self.before_m + self.jump_m;
        if after_m.abs() < self.before_m.abs() {
            -1.0
        } else {
            1.0
        }
    }
}

/// The step of a whole number of half wavelengths in `changes`, if that explains them. The first and
/// last `repeated` are one reading each, which says nothing of how the readings scatter.
fn find_slip(changes: &[f64], repeated: usize, half_wavelength_m: f64) -> Option<Slip> {
    let candidates = (SIDE..changes.len().saturating_sub(SIDE - 1)).map(|at| {
        let (before, after) = changes.split_at(at);
        let (before_m, after_m) = (median(before), median(after));
        let rest: Vec<f64> = before
            .iter()
            .map(|change| (change - before_m).abs())
            .chain(after.iter().map(|change| (change - after_m).abs()))
            .collect();
        let slip = Slip {
            at,
            before_m,
            jump_m: after_m - before_m,
        };
        (slip, rest)
    });
    let total = |rest: &[f64]| rest.iter().sum::<f64>();
    let (slip, rest) = candidates.min_by(|a, b| total(&a.1).total_cmp(&total(&b.1)))?;
    let count = slip.jump_m / half_wavelength_m;
    let whole = count.round() != 0.0 && (count - count.round()).abs() < NEAR;
    // What grows slowly is drift: it leaves a rest in proportion to itself.
    let scatter = median(&rest[repeated..rest.len() - repeated]);
    let quiet = 1.5 * scatter < 0.25 * slip.jump_m.abs();
    (whole && quiet).then_some(slip)
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let middle = sorted.len() / 2;
    if sorted.len().is_multiple_of(2) {
        (sorted[middle - 1] + sorted[middle]) / 2.0
    } else {
        sorted[middle]
    }
}

/// Judges instrument against encoder over the longest travel of a run (fault class 31).
pub(super) fn judge_scale(
    axis: &str,
    limit_ppm: f64,
    points: &[PointEntry],
) -> Result<(), Failure> {
    let by_encoder = |a: &&PointEntry, b: &&PointEntry| a.encoder_m.total_cmp(&b.encoder_m);
    let lowest = points.iter().min_by(by_encoder).expect("a run has points");
    let highest = points.iter().max_by(by_encoder).expect("a run has points");
    let travel = highest.encoder_m - lowest.encoder_m;
    let ratio = (highest.measured_m - lowest.measured_m) / travel;
    // Written so that NaN is refused too.
    if ((ratio - 1.0) * 1e6).abs() <= limit_ppm {
        return Ok(());
    }
    Err(scale_mismatch(axis, travel, ratio, limit_ppm))
}

fn scale_mismatch(axis: &str, travel_m: f64, ratio: f64, limit_ppm: f64) -> Failure {
    Failure::ScaleMismatch {
        axis: axis.to_owned(),
        travel: Metres(travel_m),
        ppm: (ratio - 1.0) * 1e6,
        limit_ppm,
        cause: likely_cause(ratio),
    }
}

fn likely_cause(ratio: f64) -> &'static str {
    let near = |value: f64| (ratio / value - 1.0).abs() < 0.02;
    match ratio {
        _ if near(-1.0) => "the sign is turned: set `reverse` of the instrument",
        _ if near(2.0) || near(0.5) => "a factor of two: check `optics_factor` and `resolution_nm`",
        _ if near(4.0) || near(0.25) => {
            "a factor of four: check `optics_factor` and `resolution_nm`"
        }
        _ if near(25.4) || near(1.0 / 25.4) => "inch taken for millimetres: check `resolution_nm`",
        _ if near(1e3) || near(1e-3) => "a factor of 1000: check the units of `resolution_nm`",
        _ if ratio.abs() < 0.02 => "the instrument does not follow: reflector on the stage?",
        _ => "check `resolution_nm`, the optics and the alignment, or the fringe counter slipped",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::EnvironmentRecord;

    const HALF: f64 = 316.4e-9;

    #[track_caller]
    fn check(changes: &[f64], expected: Option<(usize, f64)>) {
        let changes: Vec<f64> = changes.iter().map(|nm| nm * 1e-9).collect();
        let seen = find_slip(&changes, 0, HALF).map(|slip| (slip.at, slip.sign() * slip.jump_m));
        match (seen, expected) {
            (None, None) => {}
            (Some((at, jump)), Some((wanted_at, wanted))) => {
                assert_eq!(at, wanted_at);
                assert!((jump - wanted * HALF).abs() < 0.1 * HALF, "{jump}");
            }
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_step_of_whole_half_wavelengths_is_found_where_it_is() {
        let s = 316.4;
        check(
            &[5.0, -9.0, 12.0, s + 3.0, s - 20.0, s, s + 8.0],
            Some((3, 1.0)),
        );
        check(
            &[5.0, -9.0, 12.0, 7.0, -2.0 * s, -2.0 * s, 4.0 - 2.0 * s],
            Some((4, -2.0)),
        );
    }

    /// A stage that repeats to 250 nm puts its datum a half wavelength off now and then.
    #[test]
    fn a_datum_that_scatters_like_its_points_is_no_slip() {
        let points = [
            310.0, -180.0, 40.0, -260.0, 400.0, 20.0, -90.0, 210.0, -330.0, 150.0,
        ];
        let row = |start: f64, points: &[f64]| -> Vec<f64> {
            let all = [&[start; SIDE], points, &[30.0; SIDE]].concat();
            all.iter().map(|nm| nm * 1e-9).collect()
        };
        assert_eq!(find_slip(&row(383.0, &points), SIDE, HALF), None);
        let calm = points.map(|nm| nm / 10.0);
        assert!(find_slip(&row(316.0, &calm), SIDE, HALF).is_some());
    }

    fn point(approach: char, encoder_mm: f64, measured_mm: f64) -> PointEntry {
        PointEntry {
            run: 1,
            approach,
            target_m: encoder_mm * 1e-3,
            set_point_m: encoder_mm * 1e-3,
            encoder_m: encoder_mm * 1e-3,
            measured_m: measured_mm * 1e-3,
            scatter_m: 1e-9,
            at_s: 0.0,
            environment: EnvironmentRecord::default(),
        }
    }

    fn judge(scale_limit_ppm: f64, points: &[PointEntry]) -> Result<(), Failure> {
        let plausible = Plausible {
            slope: 0.01,
            step: Metres::from_um(50.0),
            count: Count {
                length: Metres(HALF),
                name: "half wavelengths",
                slipped: "fringes were lost",
            },
            scale_limit_ppm,
        };
        let mut check = CrossCheck::new("x", plausible);
        points.iter().try_for_each(|point| check.take(point))
    }

    /// The limit in the refusal is the one in the file, whichever check finds the scale wrong.
    #[test]
    fn a_wrong_scale_is_refused_by_the_figure_of_the_configuration() {
        for (limit_ppm, factor) in [(1000.0, 2.0), (1000.0, 25.4), (20_000.0, 1.1)] {
            let points = [point('+', 0.0, 0.0), point('+', 3.0, 3.0 * factor)];
            let limit = format!("the limit is {limit_ppm:.0} ppm");
            for refused in [
                judge(limit_ppm, &points),
                judge_scale("x", limit_ppm, &points),
            ] {
                let text = refused.unwrap_err().to_string();
                assert!(text.contains(&limit), "{text}");
            }
        }
        let points = [point('+', 0.0, 0.0), point('+', 3.0, 3.0 * 1.04)];
        assert!(judge(50_000.0, &points).is_ok(), "a scale within its limit");
    }

    #[test]
    fn lost_motion_at_the_turn_is_no_slip_of_the_count() {
        let turn = [
            point('+', 0.0, 0.0),
            point('+', 3.0, 3.001),
            point('-', 3.0, 3.021),
            point('-', 0.0, 0.02),
        ];
        judge(1000.0, &turn).unwrap_or_else(|failure| panic!("{failure}"));
        let slipped = [turn[0], turn[1], point('+', 6.0, 6.3)];
        assert!(matches!(
            judge(1000.0, &slipped),
            Err(Failure::FringeJump { .. })
        ));
    }

    #[test]
    fn a_slip_in_the_run_before_shows_where_the_change_goes_away() {
        let s = 316.4;
        check(&[s, s - 8.0, s + 9.0, s, 3.0, -4.0, 6.0], Some((4, 1.0)));
    }

    #[test]
    fn noise_single_outliers_and_drift_are_no_slips() {
        check(&[20.0, -30.0, 15.0, 5.0, -22.0, 31.0, -8.0], None);
        check(&[5.0, 9.0, 316.0, 5.0, -3.0, 4.0, 2.0, 1.0], None);
        let ramp: Vec<f64> = (0..20).map(|k| f64::from(k) * 33.0).collect();
        check(&ramp, None);
        check(&[10.0, 5.0], None);
    }
}
