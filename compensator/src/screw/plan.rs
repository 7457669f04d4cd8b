//! Which strokes to measure a screw at: what they can tell before any is made.
//!
//! Source: the patent's test step takes, for a lead 2a, the strokes a/2, a and 3a/2, each 10 to 30 times. Three
//! strokes half a turn apart leave one degree of freedom for the slope and cannot tell it from a periodic error.
//! Strokes spread over the travel, at many different places of the turn, tell both apart: [`spread`] takes the
//! fewest equal steps that show every harmonic asked for and leave [`FREEDOM`] degrees of freedom to judge it by.

use units::{Approach, Metres};

use super::error::FitError;
use super::fit::Leak;
use super::observe::observable;
use super::problem::Problem;
use super::strata::Variances;
use super::{BASE, Stroke};

/// Degrees of freedom that a plan leaves: uncertainties are then widened by a seventh.
pub const FREEDOM: usize = 10;

/// The patent's repetitions.
pub const REPETITIONS: core::ops::RangeInclusive<u32> = 10..=30;

/// Steps are whole multiples of this.
const STEP_M: f64 = 1e-6;

/// What strokes can tell.
#[derive(Clone, Debug, PartialEq)]
pub struct StrokePlan {
    /// The strokes, increasing, each to be made from both sides.
    pub strokes: Vec<Metres>,
    /// Harmonics that they show.
    pub observable: Vec<u32>,
    /// Those of the harmonics asked for that they do not.
    pub unobservable: Vec<u32>,
    /// Degrees of freedom for slope and harmonics.
    pub degrees_of_freedom: usize,
    /// Standard uncertainty of the slope for a standard deviation of 1 of the screw's own error at a
    /// stroke, not widened; 1/m.
    pub slope_per_stroke_error: f64,
    /// What each harmonic does to the slope when the model lacks it.
    pub leaks: Vec<Leak>,
}

/// The patent's strokes for a lead.
///
/// # Example
///
/// ```
/// use compensator::screw::plan::patent_strokes;
/// use units::Metres;
///
/// let strokes = patent_strokes(Metres::from_mm(2.0)).map(|it| it.mm());
/// assert_eq!(strokes, [0.5, 1.0, 1.5]);
/// ```
pub fn patent_strokes(lead: Metres) -> [Metres; 3] {
    [0.25, 0.5, 0.75].map(|share| lead * share)
}

/// What different `strokes`, made from both sides, tell of a screw of this lead.
///
/// # Errors
/// When there are no two different strokes or the lead is none.
pub fn judge(strokes: &[Metres], lead: Metres, harmonics_max: u32) -> Result<StrokePlan, FitError> {
    if !(lead.is_finite() && lead > Metres::ZERO) {
        return Err(FitError::Lead { seen: lead });
    }
    let mut sorted: Vec<Metres> = strokes.to_vec();
    sorted.sort_by(|a, b| a.value().total_cmp(&b.value()));
    sorted.dedup();
    if sorted.len() < 2 {
        return Err(FitError::OneStroke);
    }
    let rows: Vec<Stroke> = [Approach::Forward, Approach::Reverse]
        .into_iter()
        .flat_map(|approach| {
            sorted.iter().map(move |&stroke| Stroke {
                approach,
                stroke,
                deviation: Metres::ZERO,
            })
        })
        .collect();
    let (seen, unseen) = match observable(&rows, Some(lead), harmonics_max) {
        Ok(told) => told,
        Err(FitError::Periodic { .. }) => (Vec::new(), (1..=harmonics_max).collect()),
        Err(error) => return Err(error),
    };
    let problem = Problem::new(&rows, Some(lead));
    // Each stroke counts once, whatever the side.
    let unit = Variances {
        stroke: 1.0,
        side: 0.0,
        repeat: 1e-12,
    };
    let fit = problem.solve(&seen, &unit)?;
    let leak = |number: u32| {
        Ok(Leak {
            number,
            slope_per_amplitude: problem.leak(number, &seen, &unit)?,
        })
    };
    let leaks = (1..=harmonics_max)
        .map(leak)
        .collect::<Result<_, FitError>>()?;
    let parameters = BASE + 2 * seen.len();
    Ok(StrokePlan {
        degrees_of_freedom: (sorted.len() + 1).saturating_sub(parameters),
        slope_per_stroke_error: fit.cofactor[parameters + 1].sqrt(),
        strokes: sorted,
        observable: seen,
        unobservable: unseen,
        leaks,
    })
}

/// The fewest equal steps from `first` that reach `last` but for a step, show all harmonics and leave
/// [`FREEDOM`] degrees of freedom; if none shows all, those that show most.
///
/// # Errors
/// As [`judge`], and when the travel is none.
pub fn spread(
    (first, last): (Metres, Metres),
    lead: Metres,
    harmonics_max: u32,
) -> Result<StrokePlan, FitError> {
    let least = FREEDOM + BASE - 1 + 2 * harmonics_max as usize;
    let mut best: Option<StrokePlan> = None;
    for count in least..=3 * least {
        let step = ((last - first).value() / (count - 1) as f64 / STEP_M).floor() * STEP_M;
        if step < STEP_M {
            return Err(FitError::OneStroke);
        }
        let stroke = |at: usize| {
            let metres = first.value() + at as f64 * step;
            // As a person writes it: whole nanometres.
            Metres((metres * 1e9).round() / 1e9)
        };
        let strokes: Vec<Metres> = (0..count).map(stroke).collect();
        let plan = judge(&strokes, lead, harmonics_max)?;
        let shows_all = plan.unobservable.is_empty();
        if best
            .as_ref()
            .is_none_or(|it| plan.unobservable.len() < it.unobservable.len())
        {
            best = Some(plan);
        }
        if shows_all {
            break;
        }
    }
    best.ok_or(FitError::OneStroke)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mm(values: &[f64]) -> Vec<Metres> {
        values.iter().copied().map(Metres::from_mm).collect()
    }

    #[test]
    fn the_patents_strokes_cannot_tell_a_periodic_error_from_the_slope() {
        let lead = Metres::from_mm(2.0);
        let plan = judge(&patent_strokes(lead), lead, 4).unwrap();
        assert_eq!(plan.degrees_of_freedom, 1);
        assert_eq!(plan.unobservable, [1, 2, 3, 4]);
        // ±A at strokes 1 mm apart: 2 µm/mm for 1 µm; the slope of three points is that of their ends.
        assert!((plan.leaks[0].slope_per_amplitude * 1e-3 - 2.0).abs() < 1e-9);
        assert!((plan.slope_per_stroke_error * 1e-3 - 2.0_f64.sqrt()).abs() < 1e-6);
    }

    #[test]
    fn strokes_that_are_spread_show_every_harmonic_whatever_lead_and_travel() {
        for lead_mm in [1.0, 2.0, 5.0, 10.0] {
            for travel_leads in [2.0, 2.5, 7.3, 40.0] {
                for harmonics in 0..=6 {
                    let lead = Metres::from_mm(lead_mm);
                    let last = lead * travel_leads;
                    let plan = spread((Metres::ZERO, last), lead, harmonics).unwrap();
                    let told = format!("{lead_mm} {travel_leads} {harmonics}");
                    assert!(plan.unobservable.is_empty(), "{told}");
                    assert!(plan.degrees_of_freedom >= FREEDOM, "{told}");
                    let end = plan.strokes.last().copied().unwrap();
                    assert!(end < last + Metres(1e-9) && end > last * 0.9, "{told}");
                    for leak in &plan.leaks {
                        // The patent's strokes: 4/lead.
                        assert!(leak.slope_per_amplitude * lead_mm * 1e-3 < 1.0, "{told}");
                    }
                }
            }
        }
    }

    #[test]
    fn steps_of_a_share_of_the_lead_show_few_harmonics() {
        let every: Vec<f64> = (0..21).map(|i| -2.5 + 0.25 * f64::from(i)).collect();
        let plan = judge(&mm(&every), Metres::from_mm(2.0), 4).unwrap();
        assert_eq!(plan.unobservable, [4]);
        assert_eq!(plan.degrees_of_freedom, 21 + 1 - 3 - 6);
    }

    #[test]
    fn what_is_no_plan_is_refused() {
        let lead = Metres::from_mm(2.0);
        assert_eq!(judge(&mm(&[1.0, 1.0]), lead, 1), Err(FitError::OneStroke));
        let none = judge(&mm(&[1.0, 2.0]), Metres::ZERO, 1);
        assert!(matches!(none, Err(FitError::Lead { .. })));
        let backwards = (Metres::from_mm(2.0), Metres::ZERO);
        assert_eq!(spread(backwards, lead, 1), Err(FitError::OneStroke));
    }
}
