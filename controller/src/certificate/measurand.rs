//! What can be certified of what measures, and which values of that can be.

use super::unit::Dimension;

/// What a certificate is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Measurand {
    /// The vacuum wavelength of a laser.
    Wavelength,
    /// What a thermometer reads.
    Temperature,
    /// What a barometer reads.
    Pressure,
    /// What a hygrometer reads.
    Humidity,
    /// What a scale or a comparator reads, from its zero.
    Length,
}

/// Readings and corrections beyond these are of another unit, or of something else.
pub(super) struct Possible {
    pub(super) readings: (f64, f64),
    pub(super) correction: f64,
}

impl Measurand {
    /// For people.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Wavelength => "vacuum wavelength",
            Self::Temperature => "temperature",
            Self::Pressure => "pressure",
            Self::Humidity => "relative humidity",
            Self::Length => "length",
        }
    }

    pub(super) const fn is_stated_in(self, dimension: Dimension) -> bool {
        matches!(
            (self, dimension),
            (Self::Wavelength, Dimension::Length | Dimension::Frequency)
                | (Self::Temperature, Dimension::Temperature)
                | (Self::Pressure, Dimension::Pressure)
                | (Self::Humidity, Dimension::Ratio)
                | (Self::Length, Dimension::Length)
        )
    }

    /// `None` of a laser, which is one value: `result` judges it.
    pub(super) const fn possible(self) -> Option<Possible> {
        let (readings, correction) = match self {
            Self::Wavelength => return None,
            Self::Temperature => ((-60.0, 150.0), 5.0),
            Self::Pressure => ((10e3, 200e3), 10e3),
            Self::Humidity => ((0.0, 1.0), 0.2),
            Self::Length => ((-100.0, 100.0), 1e-3),
        };
        Some(Possible {
            readings,
            correction,
        })
    }

    /// One of it for the screen, in SI units of the certificate's figures.
    pub(crate) const fn unit(self) -> (&'static str, f64) {
        match self {
            Self::Wavelength => ("nm", 1e9),
            Self::Temperature => ("°C", 1.0),
            Self::Pressure => ("hPa", 1e-2),
            Self::Humidity => ("%", 1e2),
            Self::Length => ("mm", 1e3),
        }
    }

    /// A difference of it for the screen.
    #[cfg(feature = "program")]
    pub(crate) const fn small_unit(self) -> (&'static str, f64) {
        match self {
            Self::Wavelength => ("fm", 1e15),
            Self::Temperature => ("mK", 1e3),
            Self::Pressure => ("Pa", 1.0),
            Self::Humidity => ("%", 1e2),
            Self::Length => ("nm", 1e9),
        }
    }
}
