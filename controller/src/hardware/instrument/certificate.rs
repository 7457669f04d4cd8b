//! What certificates say of an instrument and of its sensors.

use compensator::budget::{Contribution, Correlation, Evaluation};
use compensator::length_correction::Source;
use drivers::device::Environment;
use machine::records::CertificateRecord;
use units::Metres;

use super::InstrumentConfig;
use crate::certificate::{CertificateConfig, Measurand, Named};
use crate::hardware::certificate::{Beyond, Certificate};

impl InstrumentConfig {
    /// Its certificates.
    pub(crate) fn certificates(&self) -> Vec<Certificate<&CertificateConfig>> {
        self.device.family().certificates()
    }

    /// Likewise, to be read; `name` is the instrument's.
    pub(crate) fn certificates_mut(&mut self, name: &str) -> Vec<Named<'_>> {
        let own = self.device.family_mut().certificates_mut().into_iter();
        let named = own.map(|(of, measurand, config)| Named {
            key: format!("instrument.{name}.certificate.{of}"),
            measurand,
            config,
        });
        named.collect()
    }

    /// What its sensors say, with what their certificates correct.
    pub(crate) fn certified(&self, seen: &Environment) -> Environment {
        self.device.family().certified(seen)
    }

    /// Readings of its sensors that nobody has calibrated them at.
    pub(crate) fn beyond_certified(&self, seen: &Environment) -> Vec<Beyond> {
        self.device.family().beyond_certified(seen)
    }

    /// What is added to a displacement from its datum, by the certificate of its scale.
    pub(crate) fn scale_correction(&self, displacement: Metres) -> Metres {
        let Some(scale) = self.device.family().scale() else {
            return Metres::ZERO;
        };
        let sign = self.counts();
        let read = displacement.value() * sign;
        Metres((scale.correction(read) - scale.correction(0.0)) * sign)
    }

    /// A displacement that its scale was not calibrated at.
    pub(crate) fn scale_beyond(&self, displacement: Metres) -> Option<Beyond> {
        let scale = self.device.family().scale()?;
        let read = displacement.value() * self.counts();
        Beyond::of("scale", Measurand::Length, read, scale)
    }

    /// What the certificate of its scale leaves uncertain, the same everywhere.
    pub(crate) fn scale_contribution(&self) -> Option<Contribution> {
        let u = self.device.family().scale()?.u();
        let name = "scale, by its certificate";
        Some(Contribution::new(
            name,
            Evaluation::B,
            (u, "m"),
            Correlation::CommonOffset,
        ))
    }

    /// The contribution with the name of the certificate that it comes from, if there is one.
    pub(crate) fn named(&self, (source, mut made): (Source, Contribution)) -> Contribution {
        let of = match source {
            Source::Wavelength => "wavelength",
            Source::AirTemperature => "air_temperature",
            Source::Pressure => "pressure",
            Source::Humidity => "humidity",
            Source::MaterialTemperature => "material_temperature",
            Source::AirEquation
            | Source::CarbonDioxide
            | Source::DeadPath
            | Source::Cosine
            | Source::ExpansionCoefficient => return made,
        };
        if self.certificates().iter().any(|it| it.0 == of) {
            made.name += ", by its certificate";
        }
        made
    }

    const fn counts(&self) -> f64 {
        if self.reverse { -1.0 } else { 1.0 }
    }

    /// What records say of its certificates.
    pub(crate) fn certificate_records(&self) -> Vec<CertificateRecord> {
        let own = self.certificates().into_iter();
        let records = own.filter_map(|(of, _, it)| Some(it.certified.as_ref()?.record(of)));
        records.collect()
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::certificate::{Figures, Point};
    use crate::hardware::instrument::InstrumentDevice;
    use crate::hardware::instrument::nd287::{Nd287CertificatesConfig, Nd287Config};

    const LINEAR: &str = include_str!("../../../../configs/machines/linear.toml");

    /// A comparator whose scale shows 1 µm too little at 0 and at -10 mm, 4 µm too much at 10 mm.
    pub(crate) fn comparator(reverse: bool) -> InstrumentConfig {
        let config = crate::config::parse(LINEAR, "m").unwrap().config;
        let point = |reading, correction| Point {
            reading,
            correction,
            u: 1e-7,
        };
        let figures = vec![point(-0.01, 1e-6), point(0.0, 1e-6), point(0.01, -4e-6)];
        let scale = CertificateConfig::of(Figures::Table(figures));
        InstrumentConfig {
            device: InstrumentDevice::Nd287(Nd287Config {
                poll_period_ms: 100.0,
                signal_period_um: 4.0,
                speed_max_mm_per_s: 500.0,
                scale_standard_uncertainty_ppm: 0.5,
                certificate: Nd287CertificatesConfig { scale: Some(scale) },
            }),
            reverse,
            correct_cosine: false,
            ..config.instrument["laser"].clone()
        }
    }

    /// What is added where the axis is at `mm`, in micrometres.
    #[track_caller]
    fn check(reverse: bool, mm: f64, expected: f64) {
        let seen = comparator(reverse)
            .scale_correction(Metres::from_mm(mm))
            .um();
        assert!(
            (seen - expected).abs() < 1e-9,
            "reverse {reverse}, {mm} mm: {seen} µm"
        );
    }

    #[test]
    fn a_scale_that_shows_too_much_is_corrected_to_less_whichever_way_it_counts() {
        for reverse in [false, true] {
            check(reverse, 0.0, 0.0);
        }
        check(false, 10.0, -5.0);
        check(false, 5.0, -2.5);
        check(false, -10.0, 0.0);
        // The axis is at -10 mm where it shows 10 mm, which are 9.995 mm from its zero.
        check(true, -10.0, 5.0);
        check(true, 10.0, 0.0);
    }
}
