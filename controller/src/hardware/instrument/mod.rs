//! Displacement instruments: `[instrument.NAME]`.

mod certificate;
pub(crate) mod nd287;
mod off;
pub(crate) mod umd2;

#[cfg(all(test, feature = "program"))]
pub(crate) use certificate::tests::comparator;

use core::time::Duration;

use compensator::length_correction::{self, Cosine};
use drivers::device::{DisplacementInstrument, Environment};
use machine::Patience;
use schemars::JsonSchema;
use serde::Deserialize;
use units::{Metres, Radians};

use super::bus::{SerialLine, Wiring};
use super::certificate::{Beyond, Certificate};
use crate::certificate::{CertificateConfig, Figures};
use crate::config::judge::Judge;
pub(crate) use nd287::Nd287Config;
pub(crate) use off::SwitchedOff;
pub(crate) use umd2::Umd2Config;

/// Standard uncertainty of an angle that somebody set with a beam finder and a card.
const fn by_card() -> f64 {
    0.2
}

/// A displacement instrument, by what `device` calls it.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(tag = "device", rename_all = "lowercase")]
pub enum InstrumentDevice {
    /// A µMD1 or µMD2 interferometer interface.
    Umd2(Umd2Config),
    /// A HEIDENHAIN ND 287 position display over the encoder of a comparator.
    ///
    /// The display is set to 8 data bits, no parity and 1 stop bit, to millimetres or inches, to one input,
    /// its actual value and no scaling. Its scale stands at the machine's temperature: nothing is corrected
    /// for the expansion of either.
    Nd287(Nd287Config),
}

/// What a family of displacement instruments is to a machine.
pub(crate) trait Family {
    /// Judges what its keys must keep to together.
    fn check(&self, _judge: &mut Judge<'_>, _line: Option<&SerialLine>) {}

    /// Its driver; the configuration has been checked.
    fn driver(
        &self,
        common: &InstrumentConfig,
        patience: Patience,
    ) -> Box<dyn DisplacementInstrument>;

    /// How many readings it gives in a second.
    fn readings_per_s(&self) -> f64;

    /// What its counter counts.
    fn count(&self) -> Count;

    /// Which corrections its readings get, but for the angle of the line that it measures along.
    fn corrections(&self) -> length_correction::Settings;

    /// Which corrections they would get if none was switched off.
    fn every_correction(&self) -> length_correction::Settings {
        self.corrections()
    }

    /// A sensor of its surroundings that shows the very same digits for longer is broken; `None` for an
    /// instrument without such sensors.
    fn environment_frozen(&self) -> Option<Duration>;

    /// What it can be set up with besides linear optics.
    fn optics(&self) -> OpticsConfig {
        OpticsConfig::default()
    }

    /// Its certificates.
    fn certificates(&self) -> Vec<Certificate<&CertificateConfig>> {
        Vec::new()
    }

    /// Likewise, to be read.
    fn certificates_mut(&mut self) -> Vec<Certificate<&mut CertificateConfig>> {
        Vec::new()
    }

    /// What its sensors say, with what their certificates correct.
    fn certified(&self, seen: &Environment) -> Environment {
        *seen
    }

    /// Readings of its sensors that nobody has calibrated them at.
    fn beyond_certified(&self, _seen: &Environment) -> Vec<Beyond> {
        Vec::new()
    }

    /// What the certificate of its scale says, if it has one.
    fn scale(&self) -> Option<&Figures> {
        None
    }
}

/// What a counter counts: one that slips is wrong by a multiple of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Count {
    /// How long it is.
    pub length: Metres,
    /// What many of them are called.
    pub name: &'static str,
    /// What happened when it slipped, and what to do.
    pub slipped: &'static str,
}

impl InstrumentDevice {
    fn family(&self) -> &dyn Family {
        match self {
            Self::Umd2(family) => family,
            Self::Nd287(family) => family,
        }
    }

    fn family_mut(&mut self) -> &mut dyn Family {
        match self {
            Self::Umd2(family) => family,
            Self::Nd287(family) => family,
        }
    }
}

/// A displacement instrument, and which corrections its readings get.
///
/// On three axes (`[volumetric]`) it is brought along for a calibration and set up for one line
/// after the other, by a person who is asked for it; `correct_dead_path`, `correct_cosine` and
/// `correct_material` then concern linear optics only, `dead_path_mm` is the path at the line's
/// start, and `instrument_standard_uncertainty_nm` is that of a path counted.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[schemars(extend("unevaluatedProperties" = false))]
pub struct InstrumentConfig {
    /// What it is.
    #[serde(flatten)]
    pub device: InstrumentDevice,
    /// The line that it is on.
    #[schemars(extend("x-range" = "a `[serial.NAME]`"))]
    pub line: String,
    /// `true` when the instrument counts down while the axis moves forward, as when the path of a beam
    /// shortens.
    #[schemars(extend("x-own" = true))]
    pub reverse: bool,
    /// Whether readings are corrected for the angle between measuring line and travel.
    pub correct_cosine: bool,
    /// Angle between measuring line (a beam, a scale) and travel.
    #[schemars(extend("x-magnitude" = [0.0, 100]))]
    pub misalignment_mrad: f64,
    /// Standard uncertainty of `misalignment_mrad`, known or not; by default what a beam finder and a card
    /// leave.
    #[serde(default = "by_card")]
    #[schemars(range(min = 0.0, max = 100.0))]
    pub misalignment_standard_uncertainty_mrad: f64,
    /// Of one reading, as far as averaging does not take it away (polarisation mixing, electronics); enters
    /// the uncertainty of the table.
    #[schemars(range(min = 0.0, max = 1000000.0))]
    pub instrument_standard_uncertainty_nm: f64,
}

impl InstrumentConfig {
    /// Judges what its keys must keep to together.
    pub(crate) fn check(&self, judge: &mut Judge<'_>, wiring: Wiring<'_>) {
        judge.known("line", &self.line, wiring.serial, "serial");
        self.device
            .family()
            .check(judge, wiring.serial.get(&self.line));
    }

    /// Its driver; the configuration has been checked.
    pub(crate) fn driver(&self, patience: Patience) -> Box<dyn DisplacementInstrument> {
        self.device.family().driver(self, patience)
    }

    /// How many readings it gives in a second.
    pub(crate) fn readings_per_s(&self) -> f64 {
        self.device.family().readings_per_s()
    }

    /// What its counter counts.
    pub(crate) fn count(&self) -> Count {
        self.device.family().count()
    }

    /// A sensor of its surroundings that shows the very same digits for longer is broken; `None` for an
    /// instrument without such sensors.
    pub(crate) fn environment_frozen(&self) -> Option<Duration> {
        self.device.family().environment_frozen()
    }

    /// What it can be set up with besides linear optics.
    pub(crate) fn optics(&self) -> OpticsConfig {
        self.device.family().optics()
    }

    /// Which corrections its readings get.
    pub(crate) fn corrections(&self) -> length_correction::Settings {
        length_correction::Settings {
            cosine: self.correct_cosine.then(|| self.cosine()),
            ..self.device.family().corrections()
        }
    }

    /// Which corrections they would get if none was switched off.
    pub(crate) fn every_correction(&self) -> length_correction::Settings {
        length_correction::Settings {
            cosine: Some(self.cosine()),
            ..self.device.family().every_correction()
        }
    }

    /// Which corrections are switched off that would change its readings.
    pub(crate) fn switched_off(&self) -> Vec<SwitchedOff> {
        off::switched_off(&self.corrections(), &self.every_correction())
    }

    /// The same of an instrument that reads lines of three axes: they are measured as warm as they are, and thermometers
    /// do the rest.
    pub(crate) fn switched_off_of_lines(&self) -> Vec<SwitchedOff> {
        let mut off = self.switched_off();
        off.retain(|it| it.key != off::MATERIAL);
        off
    }

    fn cosine(&self) -> Cosine {
        Cosine {
            angle: Radians(self.misalignment_mrad * 1e-3),
            u_angle: Radians(self.misalignment_standard_uncertainty_mrad * 1e-3),
        }
    }
}

/// What an instrument can be set up with besides linear optics.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OpticsConfig {
    /// Straightness optics: a displacement across the line is so many times the path counted, 1 /
    /// (2 sin φ/2) of a prism that parts its beams by φ; without it no line is measured with them.
    #[schemars(range(min = 1.0, max = 10000.0))]
    pub straightness_factor: Option<f64>,
    /// Angular optics: how far their two reflectors are apart; the sine of a tilt is the path
    /// counted over it; without it no line is measured with them.
    #[schemars(range(min = 1.0, max = 1000.0))]
    pub angular_separation_mm: Option<f64>,
}
