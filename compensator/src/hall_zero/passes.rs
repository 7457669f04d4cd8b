//! The origin from passes over both flanks, alternately forward and in reverse.
//!
//! Each pass gives an origin of its own ([`refine`]): within one pass the stage does not turn, stop or start,
//! so that lost motion and what changes from stop to stop shift its curves as a whole and leave them smooth.
//! Between passes both show, and are known for the origin instead of guessed from the noise:
//!
//! - lost motion, with what the voltages lag the position at the speed of the passes, is the difference of
//!   both directions; their mean, in which it has no part, is the origin;
//! - the scatter of the passes of one direction is what a pass repeats to (GUM 4.2, type A), noise of the
//!   sensors included, with few degrees of freedom: the standard uncertainty is widened so that twice its
//!   size is exceeded as rarely as that of a normal distribution (GUM G.3).
//!
//! | symbol | name here |
//! |---|---|
//! | n passes, s | number of passes, [`Passes::scatter`] |
//! | ν = n − 2 | [`Passes::degrees_of_freedom`] |
//! | t(ν) | [`student_limit`] |
//!
//! Absent: what moves the curves along x in all passes alike.

use units::{Approach, Metres, Volts};

use super::refine::{Flank, Passes, RefineError, RefineOptions, ZeroEstimate, refine};
use super::series::{HallPoint, HallSeries};
use crate::significance::student_limit;
use crate::uncertainty::rms;

/// A normal distribution exceeds twice its standard deviation with this probability.
const BEYOND_TWICE: f64 = 0.0455;

/// This share of its span a sweep goes back before that is a turn.
const TURN: f64 = 0.1;

/// What was read on one way over both flanks.
#[derive(Clone, Debug, PartialEq)]
pub struct Pass {
    /// In which direction.
    pub approach: Approach,
    /// Both voltages, in the order taken.
    pub points: Vec<HallPoint>,
}

impl Pass {
    /// The sweep as passes in one direction each: a turn is where it goes back by more than a tenth of its span.
    pub fn all_of(sweep: &HallSeries) -> Vec<Self> {
        let points = sweep.points();
        let places = || points.iter().map(|it| it.position.value());
        let span =
            places().fold(f64::NEG_INFINITY, f64::max) - places().fold(f64::INFINITY, f64::min);
        let (mut begin, mut extreme, mut direction) = (0, 0, 0.0);
        let mut passes = Vec::new();
        let mut push = |from: usize, to: usize, direction: f64| {
            let approach = if direction < 0.0 {
                Approach::Reverse
            } else {
                Approach::Forward
            };
            passes.push(Self {
                approach,
                points: points[from..=to].to_vec(),
            });
        };
        for (at, place) in places().enumerate() {
            let off = place - points[extreme].position.value();
            let goes_on = off * direction > 0.0;
            if goes_on {
                extreme = at;
            } else if off.abs() > span * TURN {
                if direction != 0.0 {
                    push(begin, extreme, direction);
                    begin = extreme;
                }
                (direction, extreme) = (off.signum(), at);
            }
        }
        push(begin, points.len() - 1, direction);
        passes
    }
}

/// Finds the origin in `passes`, of which there must be at least two in each direction.
///
/// # Errors
/// As [`refine`], for any pass; [`RefineError::TooFewPasses`].
pub fn refine_passes(
    passes: &[Pass],
    options: &RefineOptions,
) -> Result<ZeroEstimate, RefineError> {
    let refined = |approach: Approach| -> Result<Vec<ZeroEstimate>, RefineError> {
        let passes = passes.iter().filter(|it| it.approach == approach);
        let all: Vec<_> = passes
            .map(|it| refine(&it.points, options))
            .collect::<Result<_, _>>()?;
        let seen = all.len();
        (seen >= 2)
            .then_some(all)
            .ok_or(RefineError::TooFewPasses { approach, seen })
    };
    let (forward, reverse) = (refined(Approach::Forward)?, refined(Approach::Reverse)?);
    let all: Vec<ZeroEstimate> = forward.iter().chain(&reverse).copied().collect();
    let (at_forward, at_reverse) = (mean_origin(&forward), mean_origin(&reverse));
    let rest = forward
        .iter()
        .map(|it| it.origin - at_forward)
        .chain(reverse.iter().map(|it| it.origin - at_reverse));
    let squares: f64 = rest.map(|it| it.value() * it.value()).sum();
    let degrees_of_freedom = all.len() - 2;
    let scatter = (squares / degrees_of_freedom as f64).sqrt();
    let of_mean = (1.0 / forward.len() as f64 + 1.0 / reverse.len() as f64).sqrt() / 2.0;
    let origin = (at_forward + at_reverse) / 2.0;
    let of_origin = Metres(scatter * of_mean);
    let told = Passes {
        lost_motion: at_forward - at_reverse,
        scatter: Metres(scatter),
        of_origin,
        degrees_of_freedom,
    };
    let standard_uncertainty = of_origin * widening(degrees_of_freedom);
    Ok(together(&all, origin, standard_uncertainty, told))
}

/// So many times a standard deviation with few degrees of freedom is a standard uncertainty of which twice is
/// exceeded as rarely as that of a normal distribution.
pub(super) fn widening(degrees_of_freedom: usize) -> f64 {
    student_limit(BEYOND_TWICE, degrees_of_freedom) / 2.0
}

fn each(all: &[ZeroEstimate], of: impl Fn(&ZeroEstimate) -> f64) -> Vec<f64> {
    all.iter().map(of).collect()
}

fn mean(all: &[ZeroEstimate], of: impl Fn(&ZeroEstimate) -> f64) -> f64 {
    all.iter().map(of).sum::<f64>() / all.len() as f64
}

fn mean_origin(all: &[ZeroEstimate]) -> Metres {
    Metres(mean(all, |it| it.origin.value()))
}

/// An origin with what all passes say of the curves.
fn together(
    all: &[ZeroEstimate],
    origin: Metres,
    standard_uncertainty: Metres,
    passes: Passes,
) -> ZeroEstimate {
    let volts = |of: fn(&ZeroEstimate) -> Volts| Volts(mean(all, |it| of(it).value()));
    let noise = |of: fn(&ZeroEstimate) -> Volts| Volts(rms(&each(all, |it| of(it).value())));
    let flank = |of: fn(&ZeroEstimate) -> &Flank| Flank {
        position: Metres(mean(all, |it| of(it).position.value())),
        standard_uncertainty: Metres(
            rms(&each(all, |it| of(it).standard_uncertainty.value())) / (all.len() as f64).sqrt(),
        ),
        slope_v_per_m: mean(all, |it| of(it).slope_v_per_m),
        slope_sensor: Volts(mean(all, |it| of(it).slope_sensor.value())),
    };
    ZeroEstimate {
        origin,
        standard_uncertainty,
        p0_patent: None,
        peak_max: volts(|it| it.peak_max),
        level: volts(|it| it.level),
        left: flank(|it| &it.left),
        right: flank(|it| &it.right),
        mid_voltage: volts(|it| it.mid_voltage),
        centre_slope_v_per_m: mean(all, |it| it.centre_slope_v_per_m),
        noise_peak: noise(|it| it.noise_peak),
        noise_slope: noise(|it| it.noise_slope),
        residual_rms_peak: noise(|it| it.residual_rms_peak),
        residual_rms_slope: noise(|it| it.residual_rms_slope),
        points: all.iter().map(|it| it.points).sum(),
        outlier_share: mean(all, |it| it.outlier_share),
        lag_samples: None,
        passes: Some(passes),
    }
}

#[cfg(test)]
#[path = "passes_tests.rs"]
mod tests;
