//! Why there is no model, or no correction at a moment.

use units::{Celsius, Metres, MetresPerSecond, Radians};

use super::ErrorName;
use crate::volumetric::Axis;
use crate::volumetric::inverse::LIPSCHITZ_MAX;

/// Why a machine cannot be compensated.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ModelError {
    /// A limit that is not usable.
    #[error("volumetric model: the limits must be positive and the slope at most {LIPSCHITZ_MAX}, \
             seen {:.3} um, slope {}, {} m/s", size.um(), slope, rate.value())]
    Limits {
        /// Limit of size.
        size: Metres,
        /// Limit of slope.
        slope: f64,
        /// Limit of rate.
        rate: MetresPerSecond,
    },
    /// A tool, displacement, roll or coefficient that is negative or not a number, or a temperature
    /// range that is not usable.
    #[error("volumetric model: {what} is not usable")]
    NotUsable {
        /// What.
        what: &'static str,
    },
    /// A function that does not reach over the volume.
    #[error("volumetric model: {function} is known from {} to {} mm, but the volume extends from \
             {} to {} mm",
        units::Short(first.mm()), units::Short(last.mm()), units::Short(low.mm()),
        units::Short(high.mm()))]
    NotCovered {
        /// Which function.
        function: ErrorName,
        /// Its first node.
        first: Metres,
        /// Its last node.
        last: Metres,
        /// The volume's low end.
        low: Metres,
        /// The volume's high end.
        high: Metres,
    },
    /// A function whose effect alone exceeds the limit.
    #[error("volumetric model: {function} alone moves the tool by up to {:.3} um, the limit is \
             {:.3} um; millimetres taken for micrometres, or degrees for arc-seconds?",
        seen.um(), limit.um())]
    TooLarge {
        /// Which function.
        function: ErrorName,
        /// Its largest effect on the tool.
        seen: Metres,
        /// The limit.
        limit: Metres,
    },
    /// Steeper than the limit allows.
    #[error("volumetric model: the deviation may change by {:.1} um per mm, the limit is {:.1}; \
             {function} contributes most", seen * 1e3, limit * 1e3)]
    TooSteep {
        /// The bound of the slope.
        seen: f64,
        /// The limit.
        limit: f64,
        /// What contributes most.
        function: ErrorName,
    },
    /// From a slope of 1 on there may be no command, or several, for a target.
    #[error(
        "volumetric model: the deviation may change by {seen:.3} per command; from 1 on the \
         correction has no unique inverse; {function} contributes most"
    )]
    NotContracting {
        /// The bound of the slope.
        seen: f64,
        /// What contributes most.
        function: ErrorName,
    },
}

/// Why there is no correction under these circumstances.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ConditionsError {
    /// A tool offset beyond the largest that the model was proven for.
    #[error("tool offset along {axis}: {} mm, at most {} mm are permitted", units::Short(seen.mm()),
        units::Short(limit.mm()))]
    Tool {
        /// Along which direction.
        axis: Axis,
        /// The offset.
        seen: Metres,
        /// The largest.
        limit: Metres,
    },
    /// Another number of temperatures than of channels.
    #[error("{seen} temperatures for {expected} channels")]
    Temperatures {
        /// Temperatures given.
        seen: usize,
        /// Channels known.
        expected: usize,
    },
    /// A temperature for which the coefficients are not known.
    #[error("temperature channel {channel}: {seen}, known from {low} to {high}")]
    Temperature {
        /// Which channel, from 0.
        channel: usize,
        /// The temperature.
        seen: Celsius,
        /// The lowest known.
        low: Celsius,
        /// The highest known.
        high: Celsius,
    },
    /// A temperature difference across a guide for which its bending is not known.
    #[error(
        "axis {axis}: the temperature difference across its guide is {seen:.2} K away from that at \
         calibration, its bending is known up to {limit:.2} K; is a thermometer out of order?"
    )]
    Gradient {
        /// Whose guide.
        axis: Axis,
        /// The difference, in kelvin.
        seen: f64,
        /// The largest known.
        limit: f64,
    },
    /// A displacement of a slider larger than plausible.
    #[error("axis {axis}: the detectors report {:.3} um, at most {:.3} um is plausible",
        seen.um(), limit.um())]
    Displacement {
        /// Whose slider.
        axis: Axis,
        /// The displacement.
        seen: Metres,
        /// The largest believed.
        limit: Metres,
    },
    /// A roll larger than plausible.
    #[error("axis {axis}: the detectors report a roll of {:.2} arcsec, at most {:.2} arcsec is \
             plausible",
        seen.arcsec(), limit.arcsec())]
    Roll {
        /// Whose slider.
        axis: Axis,
        /// The roll.
        seen: Radians,
        /// The largest believed.
        limit: Radians,
    },
}
