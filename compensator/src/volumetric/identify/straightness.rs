//! Straightness of measured sideways deviations, by a stated reference line.
//!
//! Source: ISO 230-1: straightness is what is left after a reference line is taken out; the
//! error of straightness is the distance between the highest and the lowest deviation from it.

use units::{Metres, Radians};

use crate::least_squares::{LeastSquaresError, polynomial};

/// The line that is taken out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReferenceLine {
    /// That of the least sum of squares, all positions counting alike.
    LeastSquares,
    /// That through the first and the last deviation.
    EndPoints,
}

/// A straightness and the line taken out of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Straightness {
    /// Deviations from the line, in the order given.
    pub deviations: Vec<Metres>,
    /// The slope of the line.
    pub slope: Radians,
    /// Its value at position zero.
    pub offset: Metres,
    /// Highest less lowest deviation.
    pub error: Metres,
}

/// Takes the reference line out of sideways deviations at increasing positions.
///
/// # Errors
/// When there are fewer than two, lengths differ, or a value is not finite.
///
/// # Example
///
/// ```
/// use compensator::volumetric::identify::{ReferenceLine, straightness};
/// use units::Metres;
///
/// let positions = [0.0, 0.1, 0.2].map(Metres);
/// let deviations = [0.0, 4.0, 2.0].map(Metres::from_um);
/// let seen = straightness(&positions, &deviations, ReferenceLine::EndPoints)?;
/// assert!((seen.slope.value() - 10e-6).abs() < 1e-15, "the line taken out");
/// assert!((seen.error.um() - 3.0).abs() < 1e-9);
/// # Ok::<(), compensator::least_squares::LeastSquaresError>(())
/// ```
pub fn straightness(
    positions: &[Metres],
    deviations: &[Metres],
    line: ReferenceLine,
) -> Result<Straightness, LeastSquaresError> {
    let x: Vec<f64> = positions.iter().map(|it| it.value()).collect();
    let y: Vec<f64> = deviations.iter().map(|it| it.value()).collect();
    let ends = |values: &[f64]| [values[0], values[values.len() - 1]];
    let fit = match line {
        ReferenceLine::EndPoints if x.len() >= 2 && x.len() == y.len() => {
            polynomial(&ends(&x), &ends(&y), 1)?
        }
        ReferenceLine::EndPoints | ReferenceLine::LeastSquares => polynomial(&x, &y, 1)?,
    };
    let (offset, slope) = (fit.coefficients[0], fit.coefficients[1]);
    let left = x.iter().zip(&y).map(|(x, y)| y - (offset + slope * x));
    let deviations: Vec<Metres> = left.map(Metres).collect();
    let value = |it: &Metres| it.value();
    let highest = deviations.iter().map(value).fold(f64::MIN, f64::max);
    let lowest = deviations.iter().map(value).fold(f64::MAX, f64::min);
    Ok(Straightness {
        deviations,
        slope: Radians(slope),
        offset: Metres(offset),
        error: Metres(highest - lowest),
    })
}
