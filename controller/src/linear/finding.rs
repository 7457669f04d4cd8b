//! What is said of magnets that are elsewhere than configured.

use core::fmt;

use compensator::hall_zero::Mistake;
use units::{Metres, Short};

/// Magnets that are elsewhere, for an operator.
#[derive(Clone, Debug, PartialEq)]
pub struct PatternFinding {
    pub(super) axis: String,
    pub(super) mistake: Mistake,
    /// From the limit switch, by the encoder.
    pub(super) seen: Metres,
    /// From the limit switch, by the configuration.
    pub(super) configured: Metres,
    /// Nanometres a count, by the configuration.
    pub(super) resolution_nm: f64,
}

impl fmt::Display for PatternFinding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (seen, configured) = (self.seen.mm(), self.configured.mm());
        let axis = &self.axis;
        match self.mistake {
            Mistake::Scale { factor } => write!(
                f,
                "the magnet pattern is passed at another distance from the limit switch than configured, \
                 {seen:.2} mm by the encoder in place of {configured:.2} mm: resolution is probably \
                 `resolution_nm = {}` in [axis.{axis}] (it is {}); where the encoder is known to be right, \
                 `negative_limit_mm = {:.2}` in [axis.{axis}.zero]",
                three_digits(self.resolution_nm * factor),
                Short(self.resolution_nm),
                -seen
            ),
            Mistake::Direction => write!(
                f,
                "the magnet pattern is passed in the other direction, {seen:.2} mm from the limit switch that was \
                 taken for the negative one, in place of {configured:.2} mm: direction is probably inverted, \
                 `resolution_nm = {}` in [axis.{axis}]",
                Short(-self.resolution_nm)
            ),
        }
    }
}

/// The place of a limit switch is known to no more.
fn three_digits(value: f64) -> Short {
    Short(format!("{value:.2e}").parse().unwrap_or(value))
}
