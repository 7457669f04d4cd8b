//! Three linear axes: where the tool really is, and the command that puts it right (system S4).
//!
//! Source: CN1214003A (priority 1996): the error compensation device for numerically controlled
//! machines. Beams and detectors on every axis say sideways displacements while the machine
//! works; the errors made of them are added to the commanded position all the time. Behind it
//! stands the rigid-body model with its 21 error functions (see [`model`]).
//!
//! | module | what it answers |
//! |---|---|
//! | [`online`] | what do the machine's own detectors say now (the patent's parts)? |
//! | [`model`] | what do 21 error functions, tool, temperatures and detectors make of a command? |
//! | [`identify`] | which error functions made these measured deviations, and how sure is that? |
//! | [`function`] | one error function of a position, as a table or a spline |
//!
//! Sign: deviation = actual − target, of the tool as seen from the workpiece; compensation =
//! −deviation; the exact inverse is the command `c` with `c + deviation(c) = target`.
//!
//! Absent: rotary axes, elastic and dynamic deformation, storage.

mod find;
pub mod function;
pub mod identify;
mod inverse;
pub mod model;
pub mod online;
mod point;
mod polynomial;
mod reference_series;
mod series;
mod state_series;

pub use point::{Axis, Point, Volume, VolumeError};
pub use polynomial::Polynomial;
pub use reference_series::{GivenReference, ReferenceFault, ReferenceOf, ReferenceSeries};
pub use series::{VolumeFault, VolumeLine, VolumePoint, VolumeSeries};
pub use state_series::{StateFault, StatePoint, StateSeries, StateValue};

use units::Metres;

/// A position for which there is no correction.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum NoCorrection {
    /// Outside the calibrated volume, or not a number.
    #[error("axis {axis}: {} mm is outside the calibrated {} to {} mm; nothing is corrected there",
        units::Short(seen.mm()), units::Short(low.mm()), units::Short(high.mm()))]
    Outside {
        /// Which axis.
        axis: Axis,
        /// The position asked for.
        seen: Metres,
        /// Lowest position calibrated.
        low: Metres,
        /// Highest position calibrated.
        high: Metres,
    },
    /// The deviation exceeds its limit, or is not a number.
    #[error(
        "the deviation along {axis} is {:.3} um, the limit {:.3} um; a wrong temperature, a \
         misaligned detector, or the tables of another machine?", seen.um(), limit.um()
    )]
    TooLarge {
        /// Along which direction.
        axis: Axis,
        /// The deviation.
        seen: Metres,
        /// The limit.
        limit: Metres,
    },
}
