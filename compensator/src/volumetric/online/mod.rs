//! What the machine's own detectors say while it works: the patent's parts, each on its own.
//!
//! Source: CN1214003A, first to tenth aspect. A beam runs parallel to each axis through a
//! detector on the slider and ends on a detector at the end of travel.
//!
//! | symbol | name here |
//! |---|---|
//! | x_c, y_c, z_c | positions by the scales, [`Point`](super::Point) |
//! | y_bc(x_c), z_bc(x_c) … | readings of the slider's detector, [`BeamDetector::read`], [`SpotCamera::read`] |
//! | y_br(x_c), z_br(x_c) … | [`BeamReference::slider`] |
//! | y_ce(x), z_ce(x); y_re(x), z_re(x) | readings at the end of travel; [`BeamReference::end`] |
//! | D_y(x_c), D_z(x_c) …; D_ye(x) … | [`Displacement`]; [`BeamReference::beam_shift`] |
//! | F_xy, F_xz … | [`Influences`] |
//! | E_x, E_y, E_z | [`Influences::errors`] |
//! | α, y_1, y_2, x_1, x_2, h, L, φ | [`Roll`], [`RollOptics`] |
//! | first, second state memory | [`Memories`], [`StateRecorder`] |
//!
//! Signs. The patent reads where the beam meets a detector that moves with the slider: a slider
//! that strays by +δ sees the spot at −δ, so that its E may be added to the command as it is.
//! Here every reading of a slider's detector counts the *slider's* displacement from its beam,
//! positive in the machine's direction (the detector's calibration has that sign), and readings
//! at the end of travel count the *beam's*. So D and E are deviations (actual − target), like
//! everything in this package, and the compensation is −E.
//!
//! [`AxisMonitor`] puts the parts of one axis together, [`RollMonitor`] those of its roll.
//! [`Feed`] keeps every value that comes from outside without a jump, whatever happens to the
//! detector; [`Offset`] brings the sum onto the axes within limits of size, rate and slope.
//!
//! Absent: reading the channels (drivers), positions along the axes (the scales are right, or
//! their error is in the model's tables).

mod beam;
mod eye;
mod feed;
mod influence;
mod jump;
mod lever;
mod memory;
mod monitor;
mod offset;
mod reference;
mod roll;
mod roll_monitor;
mod spot;
mod stuck;
mod temperature;
mod trouble;

pub use beam::{
    BeamDetector, BeamDetectorSettings, BeamLook, Layout, RatioCurve, Sample, SettingsError,
};
pub use eye::{Eye, Shown};
pub use feed::{Feed, FeedSettings, FeedStatus, Reaction};
pub use influence::{Influence, Influences, MovingState};
pub use jump::JumpWatch;
pub use lever::DetectorLever;
pub use memory::{Coverage, Memories, MemoryError, RecorderSettings, StateMap, StateRecorder};
pub use monitor::{AxisMonitor, EndOfTravel};
pub use offset::{Offset, OffsetLimits};
pub use reference::{BeamDrift, BeamReference, DriftError};
pub use roll::{Roll, RollError, RollOptics};
pub use roll_monitor::RollMonitor;
pub use spot::{Spot, SpotCamera, SpotSettings, Unplaced};
pub use stuck::StuckWatch;
pub use temperature::{TemperatureChannel, TemperatureSettings};
pub use trouble::Trouble;

use units::Metres;

/// Sideways displacements of one axis, along its two other directions in the order x, y, z.
pub type Displacement = [Metres; 2];

#[cfg(test)]
mod day_tests;
#[cfg(test)]
mod tests;
