//! Are the numbers of a linear series in the unit that its columns name?
//!
//! No stage is a tenth longer than its encoder says, so that measured positions over targets have a
//! slope near 1 and stay near a line. A column in another unit has a slope near a power of ten, or
//! near 25.4; one that holds deviations a slope near 0. The slope is the median over many pairs of
//! points, half a range apart (an incomplete Theil-Sen estimate), so that single wild readings,
//! which the fit names, do not decide.
//!
//! Absent: both columns in one wrong unit, which nothing in the numbers tells.

use super::{LinearSeries, Measurement};
use crate::uncertainty::{median, robust_sigma};

/// The largest relative difference of instrument and encoder that is a stage's, and the largest
/// scatter about the line, as a share of the range.
const BELIEVED: f64 = 0.1;

/// Why a series is of no stage. Both numbers are ratios.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Unbelievable {
    /// The measured positions grow otherwise than the targets.
    Slope { slope: f64, cause: &'static str },
    /// They lie too far off a line, as a share of the range.
    Scatter { share: f64 },
}

/// Judges `series`; series of one target are believed.
pub(super) fn judge(series: &LinearSeries) -> Result<(), Unbelievable> {
    let mut points: Vec<Measurement> = series.measurements().to_vec();
    points.sort_by(|a, b| a.target.value().total_cmp(&b.target.value()));
    let half = points.len() / 2;
    let slopes: Vec<f64> = points
        .iter()
        .zip(&points[half..])
        .filter(|(low, high)| high.target > low.target)
        .map(|(low, high)| (high.measured - low.measured) / (high.target - low.target))
        .collect();
    let Some(slope) = median(&slopes) else {
        return Ok(());
    };
    // Written so that NaN is refused too.
    let is_a_stage = (slope - 1.0).abs() <= BELIEVED;
    if !is_a_stage {
        let cause = likely_cause(slope);
        return Err(Unbelievable::Slope { slope, cause });
    }
    let range = (points[points.len() - 1].target - points[0].target).value();
    let deviations: Vec<f64> = points.iter().map(|it| it.deviation().value()).collect();
    let middle = median(&deviations).unwrap_or(0.0);
    let off: Vec<f64> = deviations.iter().map(|it| it - middle).collect();
    let share = robust_sigma(&off).unwrap_or(0.0) / range;
    if share <= BELIEVED {
        Ok(())
    } else {
        Err(Unbelievable::Scatter { share })
    }
}

fn likely_cause(slope: f64) -> &'static str {
    let near = |value: f64| (slope / value - 1.0).abs() < 0.05;
    match slope {
        _ if near(1e3) => "is `measured_mm` in micrometres, or `target_mm` in metres?",
        _ if near(1e-3) => "is `target_mm` in micrometres, or `measured_mm` in metres?",
        _ if near(1e6) => "is `measured_mm` in nanometres?",
        _ if near(1e-6) => "is `target_mm` in nanometres?",
        _ if near(10.0) || near(0.1) => "is one of the columns in centimetres?",
        _ if near(25.4) || near(1.0 / 25.4) => "is one of the columns in inches?",
        _ if near(-1.0) => "is the sign of the instrument reversed?",
        _ if near(2.0) || near(0.5) || near(4.0) || near(0.25) => {
            "is the optics' factor of the interferometer wrong?"
        }
        _ if slope.abs() < 0.05 => {
            "does it hold deviations? `measured_mm` is the position that the instrument measured"
        }
        _ => "are the columns what their names say?",
    }
}

#[cfg(test)]
mod tests {
    use super::super::LinearFault;
    use super::*;
    use crate::data::{DataError, Fault};

    /// Three runs over 60 mm with deviations of micrometres, each column times its factor.
    fn csv(target_factor: f64, measured: impl Fn(f64, f64) -> f64) -> String {
        let mut text = String::from("run,approach,target_mm,measured_mm\n");
        for run in 1..=3 {
            for step in 0..=10 {
                let target = f64::from(step) * 6.0;
                let deviation = 0.004 * (target / 9.0).sin() + 1e-5 * f64::from(run);
                let measured = measured(target, deviation);
                text += &format!("{run},+,{},{measured}\n", target * target_factor);
            }
        }
        text
    }

    #[track_caller]
    fn check_refused(text: &str, said: &str) {
        let error = LinearSeries::from_csv(text, "data.csv").unwrap_err();
        let DataError { line, fault, .. } = &error;
        assert!(matches!(
            fault,
            Fault::Own(LinearFault::OtherUnit { .. } | LinearFault::Scattered { .. })
        ));
        assert_eq!(*line, 2);
        assert!(error.to_string().contains(said), "{error}");
    }

    #[test]
    fn columns_in_another_unit_than_their_name_are_refused_with_the_likely_cause() {
        let sum = |target, deviation| target + deviation;
        check_refused(
            &csv(1.0, |t, d| sum(t, d) * 1e3),
            "`measured_mm` in micrometres",
        );
        check_refused(&csv(1e3, sum), "`target_mm` in micrometres");
        check_refused(&csv(1.0, |t, d| sum(t, d) / 25.4), "inches");
        check_refused(&csv(1.0, |t, d| -sum(t, d)), "sign of the instrument");
        check_refused(&csv(1.0, |t, d| 2.0 * sum(t, d)), "factor");
        check_refused(&csv(1.0, |_, d| d), "does it hold deviations?");
        check_refused(&csv(1.0, |t, d| 1.3 * t + d), "what their names say");
        check_refused(
            &csv(1.0, |t, d| t + d + 15.0 * (0.35 * t).sin()),
            "off a line",
        );
    }

    #[test]
    fn what_a_stage_can_do_is_believed_single_wild_readings_and_an_offset_included() {
        let fine = csv(1.0, |t, d| t + d);
        let wild = csv(1.0, |t, d| if t == 30.0 { 3e4 } else { t + d });
        let poor = csv(1.0, |t, d| 1.03 * t + d * 100.0);
        let offset = csv(1.0, |t, d| t + d + 250.0);
        for text in [fine, wild, poor, offset] {
            LinearSeries::from_csv(&text, "data.csv").unwrap_or_else(|error| panic!("{error}"));
        }
    }
}
