//! The rotation of a stage with two zero points side by side.
//!
//! Source: CN101551226A, description: a rotation of the stage is held by the exact places of two of its points.
//! Two pairs of magnets and sensors, across the travel from each other, give a zero point each. Where both sides
//! show the same coordinate, the side whose zero point lies further back is ahead:
//!
//! ```text
//! angle = (z_other - z_ahead) / d
//! ```
//!
//! | symbol | name here |
//! |---|---|
//! | z_ahead, z_other | [`ZeroEstimate::origin`] of the side that is ahead at positive angles, and of the other one |
//! | d | [`Base::distance`] |
//!
//! Absent: the angle's own second order (tan against its argument: 3e-7 of an angle of a milliradian).

use units::{Metres, Radians};

use super::ZeroEstimate;
use super::passes::widening;
use crate::budget::combine_shares;

/// What a rotation is counted by: how far both zero points are from each other, across the travel, and the encoders.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Base {
    /// From the one to the other.
    pub distance: Metres,
    /// Its standard uncertainty.
    pub standard_uncertainty: Metres,
    /// Standard uncertainty of a short length by an encoder, as a share of it: each side's zero point lies so far
    /// from where its coordinate is 0 by its own one.
    pub scale: f64,
}

/// How far a stage is turned where both sides show the same coordinate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rotation {
    /// Positive where the side that was called ahead is so.
    pub angle: Radians,
    /// Its standard uncertainty, widened so that twice its size is exceeded as rarely as that of a normal
    /// distribution.
    pub standard_uncertainty: Radians,
    /// How well that is known; `None` for infinitely many.
    pub degrees_of_freedom: Option<f64>,
}

/// The rotation that two zero points tell, both in coordinates of which nothing was changed between them.
///
/// # Example
///
/// ```
/// use compensator::hall_zero::{Base, HallPoint, RefineOptions, refine, rotation};
/// use units::{Metres, Volts};
///
/// // Two noiseless sides whose zero points lie 20 µm apart, on a base of 400 mm.
/// let side = |zero_mm: f64| {
///     let there = (-400..=400).chain((-400..=400).rev());
///     let points: Vec<HallPoint> = there
///         .map(|step| {
///             let mm = 0.0025 * f64::from(step);
///             let (slope, peak) = (2.0 * mm).sin_cos();
///             let position = Metres::from_mm(mm + zero_mm);
///             HallPoint { position, peak: Volts(2.0 + 0.9 * peak), slope: Volts(2.5 + 0.7 * slope) }
///         })
///         .collect();
///     refine(&points, &RefineOptions { excess_max: f64::INFINITY, ..RefineOptions::default() })
/// };
/// let (distance, standard_uncertainty) = (Metres::from_mm(400.0), Metres::from_mm(0.1));
/// let base = Base { distance, standard_uncertainty, scale: 0.0 };
/// let turned = rotation(&side(0.0)?, &side(0.02)?, base);
/// assert!((turned.angle.value() * 1e6 - 50.0).abs() < 0.01, "20 um over 400 mm are 50 urad");
/// assert!((turned.standard_uncertainty.value() * 1e6 - 0.0125).abs() < 0.001, "0.1 mm of the base");
/// # Ok::<(), compensator::hall_zero::RefineError>(())
/// ```
#[must_use]
pub fn rotation(ahead: &ZeroEstimate, other: &ZeroEstimate, base: Base) -> Rotation {
    let angle = (other.origin - ahead.origin) / base.distance;
    let of_base = base.standard_uncertainty * angle.abs();
    let of_scale = |side: &ZeroEstimate| (side.origin.abs() * base.scale, None);
    let shares = [
        of_side(ahead),
        of_side(other),
        (of_base, None),
        of_scale(ahead),
        of_scale(other),
    ];
    let combined = combine_shares(shares);
    // Truncated to a whole number, as GUM G.4.1 has it.
    let widened = combined
        .degrees_of_freedom
        .map_or(1.0, |it| widening((it as usize).max(1)));
    let u = combined.standard_uncertainty * widened / base.distance;
    Rotation {
        angle: Radians(angle),
        standard_uncertainty: Radians(u),
        degrees_of_freedom: combined.degrees_of_freedom,
    }
}

/// What one side's zero point adds, and how well that is known. It is not the widened uncertainty of that side:
/// both together are known better than each, and are widened once.
fn of_side(side: &ZeroEstimate) -> (Metres, Option<f64>) {
    match side.passes {
        Some(passes) => (passes.of_origin, Some(passes.degrees_of_freedom as f64)),
        None => (side.standard_uncertainty, None),
    }
}

#[cfg(test)]
#[path = "rotation_tests.rs"]
mod tests;
