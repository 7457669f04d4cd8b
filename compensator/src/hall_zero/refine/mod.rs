//! The origin from every sample on both flanks and across the zero, with its uncertainty.
//!
//! Four local polynomials are fitted: V1 and V2 in a window around each flank's crossing of one
//! voltage level. They give x1, x2 with V1(x1) = V1(x2) = level, and the mid voltage
//! (V2(x1) + V2(x2))/2. A fifth, of V2 around the zero, gives the origin: V2(origin) = mid. This
//! is the patent's construction (steps 2–4) with the noise of hundreds of samples averaged
//! instead of the tolerance bands δ. The windows do not overlap, so the five fits are
//! independent and the law of propagation (GUM 5.1.2) has no cross terms between them.
//!
//! A voltage sampled later than the position belongs to a point a little further on: V(x − vτ).
//! Each fit therefore has the travel per sample as one more column, so that both directions of
//! travel agree; what is left is the value at standstill. In a sweep of one direction only, the
//! lag cannot be told from a shift of the origin; [`ZeroEstimate::lag_samples`] is then `None`.
//!
//! The degree of the polynomials rises until a higher one improves the fit no more than chance
//! would. The residuals are then held against the noise, which is estimated apart from any model
//! from neighbouring samples; a fit that stays well above it is refused.
//!
//! | symbol | name here |
//! |---|---|
//! | x1, x2 | [`Flank::position`] of `left`, `right` |
//! | g1, g2 (dV1/dx) | [`Flank::slope_v_per_m`] |
//! | h0 (dV2/dx at the origin) | [`ZeroEstimate::centre_slope_v_per_m`] |
//!
//! Absent: drift of the voltages during the sweep, anything that moves the curves along x.

mod coarse;
mod error;
mod symmetry;
mod window;

use core::time::Duration;

use units::{Metres, MetresPerSecond, Volts};

use super::profile::profile;
use super::{Sensor, Settings};
use crate::hall_zero::{HallPoint, HallSeries};
use crate::uncertainty::{combine, rms};

pub(in crate::hall_zero) use coarse::crossing;
use coarse::{Coarse, WINDOW_SHARE, bin_count};
pub use error::{RefineError, Side};
use symmetry::check_symmetry;
use window::{Data, Window, lag};

/// The voltage of V1 at which the flanks are cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Level {
    /// This far below the peak.
    BelowPeak(Volts),
    /// Where the flatter of the two flanks is steepest.
    Steepest,
}

/// Points a window must have beyond the coefficients of its polynomial.
const SPARE_POINTS: usize = 6;

/// How to refine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RefineOptions {
    /// Where the flanks are cut.
    pub level: Level,
    /// Half width of each window; chosen from the distance of the flanks if `None`.
    pub half_window: Option<Metres>,
    /// Lowest degree tried.
    pub degree_min: usize,
    /// Highest degree tried.
    pub degree_max: usize,
    /// Residuals beyond this many scatters are left out.
    pub outlier_threshold: f64,
    /// Largest share of them, 0 to 1.
    pub outlier_share_max: f64,
    /// Largest ratio of residuals to noise.
    pub excess_max: f64,
}

impl Default for RefineOptions {
    fn default() -> Self {
        Self {
            level: Level::Steepest,
            half_window: None,
            degree_min: 3,
            degree_max: 6,
            outlier_threshold: 6.0,
            outlier_share_max: 0.2,
            excess_max: 2.0,
        }
    }
}

impl RefineOptions {
    /// The flanks of a search are cut at this share of Vc below the peak.
    pub(in crate::hall_zero) const CUT_SHARE: f64 = 0.7;

    /// For the samples of a search: the flanks are cut at 0.7 Vc below the peak, so that the
    /// search has covered both sides of the cut (it went down to Vc).
    pub fn for_search(settings: &Settings) -> Self {
        Self {
            level: Level::BelowPeak(settings.vc * Self::CUT_SHARE),
            ..Self::default()
        }
    }

    /// Samples that each window must have: the coefficients of its polynomial, the lag, and a few to spare.
    pub(super) fn samples_min(&self) -> usize {
        self.degree_max + 2 + SPARE_POINTS
    }

    /// How fast both flanks, `distance` apart, may be passed so that each window gets twice the samples that
    /// it must have when one is taken every `sampling`. The flanks are further apart where they were found
    /// than where they are cut: half of the samples may be missing for that and for what is left out.
    pub(in crate::hall_zero) fn fastest_pass(
        &self,
        distance: Metres,
        sampling: Duration,
    ) -> MetresPerSecond {
        let samples = 2.0 * self.samples_min() as f64;
        MetresPerSecond(self.window(distance).value() / (samples * sampling.as_secs_f64()))
    }

    /// How wide the window around each flank is where the flanks are `distance` apart.
    pub(in crate::hall_zero) fn window(&self, distance: Metres) -> Metres {
        self.half_window
            .map_or(distance * WINDOW_SHARE, |half| half * 2.0)
    }
}

/// The crossing of one flank.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flank {
    /// Where V1 passes the level.
    pub position: Metres,
    /// Its standard uncertainty.
    pub standard_uncertainty: Metres,
    /// dV1/dx there in V/m.
    pub slope_v_per_m: f64,
    /// V2 there.
    pub slope_sensor: Volts,
}

/// What passes tell beyond the origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Passes {
    /// The origin seen forward less that seen in reverse: lost motion, and what the voltages lag at the
    /// speed of the passes.
    pub lost_motion: Metres,
    /// Standard deviation of the origin of a single pass.
    pub scatter: Metres,
    /// Standard deviation of the origin of all passes, not widened for being known from few.
    pub of_origin: Metres,
    /// Of these deviations.
    pub degrees_of_freedom: usize,
}

/// An origin and everything it rests on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ZeroEstimate {
    /// The origin in raw encoder coordinates.
    pub origin: Metres,
    /// Its standard uncertainty from the noise of the samples.
    pub standard_uncertainty: Metres,
    /// Where the patent's search ended, if there was one.
    pub p0_patent: Option<Metres>,
    /// V1 at its maximum (mean of the highest part of the profile).
    pub peak_max: Volts,
    /// The level at which the flanks were cut.
    pub level: Volts,
    /// Left flank.
    pub left: Flank,
    /// Right flank.
    pub right: Flank,
    /// V2 at the origin.
    pub mid_voltage: Volts,
    /// dV2/dx at the origin in V/m.
    pub centre_slope_v_per_m: f64,
    /// Noise of one sample of V1, from neighbours.
    pub noise_peak: Volts,
    /// Noise of one sample of V2, from neighbours.
    pub noise_slope: Volts,
    /// Residuals of V1 in its windows (rms).
    pub residual_rms_peak: Volts,
    /// Residuals of V2 in its windows (rms).
    pub residual_rms_slope: Volts,
    /// Samples used in all windows.
    pub points: usize,
    /// Share of samples in the windows left out as wild.
    pub outlier_share: f64,
    /// By how many sample periods the voltages lag the position; `None` when all samples were
    /// taken in one direction.
    pub lag_samples: Option<f64>,
    /// What passes in both directions told; `None` for samples of one sweep.
    pub passes: Option<Passes>,
}

/// Finds the origin in `points`, given in the order taken.
///
/// # Errors
/// When a flank, the peak or the centre is not covered, a curve is not smooth within its noise,
/// or too many samples are wild; with place and values.
///
/// # Example
///
/// ```
/// use compensator::hall_zero::{HallPoint, RefineOptions, refine};
/// use units::{Metres, Volts};
///
/// // Noiseless curves about an origin at 0.3 mm, there and back.
/// let there = (-400..=400).chain((-400..=400).rev());
/// let points: Vec<HallPoint> = there
///     .map(|step| {
///         let mm = 0.0025 * f64::from(step);
///         let (slope, peak) = (2.0 * mm).sin_cos();
///         let position = Metres::from_mm(mm + 0.3);
///         HallPoint { position, peak: Volts(2.0 + 0.9 * peak), slope: Volts(2.5 + 0.7 * slope) }
///     })
///     .collect();
/// let options = RefineOptions { excess_max: f64::INFINITY, ..RefineOptions::default() };
/// let zero = refine(&points, &options)?;
/// assert!((zero.origin.mm() - 0.3).abs() < 1e-6, "{} mm", zero.origin.mm());
/// # Ok::<(), compensator::hall_zero::RefineError>(())
/// ```
pub fn refine(points: &[HallPoint], options: &RefineOptions) -> Result<ZeroEstimate, RefineError> {
    let data = Data::new(points)?;
    let coarse = Coarse::find(points, options)?;
    let (flanks, half_window) = ([coarse.left, coarse.right], coarse.half_window);
    let [peak_left, peak_right] = data.windows(Sensor::Peak, flanks, half_window, options)?;
    let [slope_left, slope_right] = data.windows(Sensor::Slope, flanks, half_window, options)?;
    let [centre] = data.windows(Sensor::Slope, [coarse.centre], half_window, options)?;
    let fits = [&peak_left, &peak_right, &slope_left, &slope_right, &centre];
    let points_left_out: usize = fits.iter().map(|w| w.left_out).sum();
    let used: usize = fits.iter().map(|w| w.residuals().len()).sum();
    let share = points_left_out as f64 / (used + points_left_out) as f64;
    if share > options.outlier_share_max {
        let limit = options.outlier_share_max;
        return Err(RefineError::TooManyOutliers { share, limit });
    }
    let x1 = peak_left.solve(Sensor::Peak, coarse.level)?;
    let x2 = peak_right.solve(Sensor::Peak, coarse.level)?;
    let (at_left, at_right) = (slope_left.value(x1), slope_right.value(x2));
    let mid = (at_left + at_right) / 2.0;
    let origin = centre.solve(Sensor::Slope, mid)?;
    let (g1, g2, h0) = (
        peak_left.slope(x1),
        peak_right.slope(x2),
        centre.slope(origin),
    );
    let u_level = |w: &Window, x| w.standard_uncertainty(x);
    // d mid = ½(ε1 + h1·dx1 + ε2 + h2·dx2), dx = −ε_level/g;  d origin = (d mid − ε0)/h0.
    let u_mid = 0.5
        * combine(&[
            u_level(&slope_left, x1),
            u_level(&slope_right, x2),
            slope_left.slope(x1) / g1 * u_level(&peak_left, x1),
            slope_right.slope(x2) / g2 * u_level(&peak_right, x2),
        ]);
    let u_origin = combine(&[u_mid, u_level(&centre, origin)]) / h0.abs();
    check_symmetry(&coarse.bins, origin, x2 - x1)?;
    let flank = |w: &Window, x: f64, slope_sensor: f64| Flank {
        position: Metres(x),
        standard_uncertainty: Metres(w.standard_uncertainty(x) / w.slope(x).abs()),
        slope_v_per_m: w.slope(x),
        slope_sensor: Volts(slope_sensor),
    };
    let residuals = |ws: &[&Window]| {
        Volts(rms(&ws
            .iter()
            .flat_map(|w| w.residuals().iter().copied())
            .collect::<Vec<f64>>()))
    };
    Ok(ZeroEstimate {
        origin: Metres(origin),
        standard_uncertainty: Metres(u_origin),
        p0_patent: None,
        peak_max: Volts(coarse.peak),
        level: Volts(coarse.level),
        left: flank(&peak_left, x1, at_left),
        right: flank(&peak_right, x2, at_right),
        mid_voltage: Volts(mid),
        centre_slope_v_per_m: h0,
        noise_peak: Volts(data.noise_peak),
        noise_slope: Volts(data.noise_slope),
        residual_rms_peak: residuals(&fits[..2]),
        residual_rms_slope: residuals(&fits[2..]),
        points: used,
        outlier_share: share,
        lag_samples: lag(&fits),
        passes: None,
    })
}

/// Finds the origin in sweeps measured elsewhere, cutting the flanks where they are steepest.
///
/// # Errors
/// As [`refine`].
pub fn fit_hall(series: &HallSeries) -> Result<ZeroEstimate, RefineError> {
    refine(series.points(), &RefineOptions::default())
}

/// The zero of the art before the patent (CN101067726A): where V2 passes a fixed voltage, a
/// machine constant found once. It moves with every drift of sensor 2; kept for comparison.
///
/// `None` when the sweep does not pass the voltage with enough samples around it.
pub fn single_threshold_zero(
    points: &[HallPoint],
    threshold: Volts,
    half_window: Metres,
) -> Option<Metres> {
    let bins = profile(points, bin_count(points.len()));
    let at = crossing(bins.iter().map(|b| (b.x, b.slope)), threshold.value())?;
    let data = Data::new(points).ok()?;
    let options = RefineOptions {
        excess_max: f64::INFINITY,
        ..RefineOptions::default()
    };
    let [window] = data
        .windows(Sensor::Slope, [at], half_window.value(), &options)
        .ok()?;
    window
        .solve(Sensor::Slope, threshold.value())
        .ok()
        .map(Metres)
}

#[cfg(test)]
mod tests;
