//! What certificates say of devices: of what they are, and readings that they are not of.

use core::fmt;

use crate::certificate::{Figures, Measurand};

/// What of an instrument a certificate is of (its key), what that measures, and the certificate.
pub(crate) type Certificate<C> = (&'static str, Measurand, C);

/// A reading that nobody has calibrated the sensor at: the correction of the nearest end is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Beyond {
    of: &'static str,
    measurand: Measurand,
    reading: f64,
    range: (f64, f64),
}

impl Beyond {
    /// `None` where it was calibrated at such readings.
    pub(crate) fn of(
        of: &'static str,
        measurand: Measurand,
        reading: f64,
        figures: &Figures,
    ) -> Option<Self> {
        let range = figures.range().filter(|_| !figures.covers(reading))?;
        Some(Self {
            of,
            measurand,
            reading,
            range,
        })
    }
}

impl fmt::Display for Beyond {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (unit, per) = self.measurand.unit();
        let shown = |it: f64| units::Short((it * per * 1e4).round() / 1e4);
        let (low, high) = self.range;
        write!(
            f,
            "{}: it reads {} {unit}, its certificate is of {} to {} {unit}; the correction of the nearer end is made, \
             and how uncertain that is nobody has certified",
            self.of,
            shown(self.reading),
            shown(low),
            shown(high)
        )
    }
}
