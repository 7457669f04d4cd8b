//! Instrument against encoder, point by point (fault classes 26 and 31).
//!
//! Deviation = measured − encoder. From one point to the next it changes by what a stage can
//! do; what goes beyond is no stage but the instrument: a wrong scale when it is there from the
//! first step on, a jump of the fringe count when it comes later. A jump of few fringes is no
//! larger than a stage's own deviation, and shows only against the run before: there the stage
//! repeats to tens of nanometres, while a counter that has slipped stays slipped by a whole
//! number of half wavelengths.

use compensator::error_table::{Change, Shifts, Slip, find_slip, slip_at_start};
use units::{Approach, Metres};

use crate::config::Count;
use crate::failure::Failure;
use crate::linear::PointEntry;
use crate::store::ClosureEntry;

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

/// What the datum's place read, in reverse and then forward, in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct DatumReadings {
    pub(super) forward_m: f64,
    pub(super) reverse_m: Option<f64>,
}

impl DatumReadings {
    pub(super) const fn forward(forward_m: f64) -> Self {
        Self {
            forward_m,
            reverse_m: None,
        }
    }

    /// By how much each has changed since `before`.
    fn changes(&self, before: &Self) -> Vec<Change> {
        let change = |approach, now_m: f64, before_m: f64| Change {
            size: Metres(now_m - before_m),
            approach,
            is_after_turn: true,
        };
        let reverse = self.reverse_m.zip(before.reverse_m);
        let reverse = reverse.map(|(now, before)| change(Approach::Reverse, now, before));
        let forward = change(Approach::Forward, self.forward_m, before.forward_m);
        reverse.into_iter().chain([forward]).collect()
    }
}

/// A whole run, and its datum before and after it.
#[derive(Clone, Debug)]
pub(super) struct WholeRun {
    pub(super) points: Vec<PointEntry>,
    pub(super) start: DatumReadings,
    pub(super) end: DatumReadings,
}

impl WholeRun {
    /// What is kept of its datum.
    pub(super) const fn closure(&self, run: u32) -> ClosureEntry {
        ClosureEntry {
            run,
            start_m: self.start.forward_m,
            closure_m: self.end.forward_m,
        }
    }
}

/// A target no further from the datum is at its place.
const AT_THE_DATUM_M: f64 = 1e-9;

impl WholeRun {
    /// What the datum's place reads more than before the run, with the first reading, where the run begins and
    /// ends there.
    fn shifts(&self) -> Option<(Shifts, &PointEntry)> {
        let [first, .., last] = &self.points[..] else {
            return None;
        };
        let is_there = |it: &PointEntry, approach: Approach| {
            it.side() == approach
                && it.target_m.abs() <= AT_THE_DATUM_M
                && !is_shaken(Metres(it.scatter_m))
        };
        if !(is_there(first, Approach::Forward) && is_there(last, Approach::Reverse)) {
            return None;
        }
        let (before, after) = (self.start.reverse_m?, self.end.reverse_m?);
        let forward = self.start.forward_m;
        let shifts = Shifts {
            first: Metres(deviation(first) - forward),
            last: Metres(deviation(last) - before),
            reverse: Metres(after - before),
            forward: Metres(self.end.forward_m - forward),
        };
        Some((shifts, first))
    }
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

/// Whether the stage had turned on the way to the point at `place`.
fn is_after_turn(points: &[PointEntry], place: usize) -> bool {
    let before = place.checked_sub(1).map(|it| points[it].approach);
    before != Some(points[place].approach)
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
        Err(self.fringe_jump(jump, point.run, &last, point))
    }

    /// Judges a whole run against the run before: the same targets in the same order, and the
    /// datum's place before and after them, so that a slip on the way from run to run shows too.
    ///
    /// # Errors
    /// When the count slipped in one of them.
    pub(super) fn compare(&self, before: &WholeRun, run: &WholeRun) -> Result<(), Failure> {
        let count_m = self.plausible.count.length.value();
        let quiet = |point: &PointEntry| point.scatter_m < count_m;
        let pairs: Vec<(usize, f64)> = before
            .points
            .iter()
            .zip(&run.points)
            .enumerate()
            .filter(|(_, (a, b))| quiet(a) && quiet(b))
            .map(|(place, (a, b))| (place, deviation(b) - deviation(a)))
            .collect();
        let Some((last, _)) = pairs.last() else {
            return Ok(());
        };
        let start = run.start.changes(&before.start);
        let started = start.len();
        // Between a run and one that was continued later the datum was set anew.
        let shared = if run.start == before.end { started } else { 0 };
        let changes = pairs.iter().map(|(place, size_m)| Change {
            size: Metres(*size_m),
            approach: run.points[*place].side(),
            is_after_turn: is_after_turn(&run.points, *place),
        });
        let all: Vec<Change> = start
            .into_iter()
            .chain(changes)
            .chain(run.end.changes(&before.end))
            .collect();
        let Some(slip) = find_slip(&all, shared, self.plausible.count.length) else {
            return Ok(());
        };
        let point = |at: usize| {
            let place = pairs.get(at.saturating_sub(started));
            &run.points[place.map_or(*last, |(place, _)| *place)]
        };
        let (from, to) = (point(slip.at - 1), point(slip.at));
        // Nothing was read between the datum and the first reading.
        if slip.at == started {
            let run = to.run - u32::from(slip.is_in_the_earlier_run);
            return Err(self.datum_slip(slip.counts, run));
        }
        Err(self.slipped(&slip, from, to))
    }

    /// Judges the first run of a measurement, which has none before it, by what the datum's place read before and
    /// after it and, where its targets are there, at its first and last reading.
    ///
    /// # Errors
    /// When the count slipped between the datum and the first reading.
    pub(super) fn judge_start(&self, run: &WholeRun) -> Result<(), Failure> {
        let Some((shifts, first)) = run.shifts() else {
            return Ok(());
        };
        let Some(counts) = slip_at_start(&shifts, self.plausible.count.length) else {
            return Ok(());
        };
        Err(self.datum_slip(counts, first.run))
    }

    fn datum_slip(&self, counts: i64, run: u32) -> Failure {
        Failure::DatumSlip {
            axis: self.axis.clone(),
            jump: Metres(counts as f64 * self.plausible.count.length.value()),
            counts,
            of: self.plausible.count,
            run,
        }
    }

    fn slipped(&self, slip: &Slip, from: &PointEntry, to: &PointEntry) -> Failure {
        let run = to.run - u32::from(slip.is_in_the_earlier_run);
        let jump_m = slip.counts as f64 * self.plausible.count.length.value();
        self.fringe_jump(jump_m, run, from, to)
    }

    fn fringe_jump(&self, jump_m: f64, run: u32, from: &PointEntry, to: &PointEntry) -> Failure {
        let count = jump_m / self.plausible.count.length.value();
        Failure::FringeJump {
            axis: self.axis.clone(),
            jump: Metres(jump_m),
            counts: count.round() as i64,
            of: self.plausible.count,
            run,
            from: Metres(from.target_m),
            to: Metres(to.target_m),
        }
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
}
