//! Optics of an interferometer along a line: units of the configuration become SI here.

use compensator::length_correction;
use units::Metres;

use crate::config::{InstrumentConfig, OpticsConfig};

/// How far the two reflectors of the angular optics are apart; `None` without such optics.
pub(crate) fn angular_separation(optics: &OpticsConfig) -> Option<Metres> {
    optics.angular_separation_mm.map(Metres::from_mm)
}

/// Which corrections counted paths get. Two beams of one length, as angular and straightness
/// optics have, have no dead path, and neither the beam's lean nor the machine's growth matters.
pub(crate) fn line_corrections(
    instrument: &InstrumentConfig,
    has_two_beams: bool,
) -> length_correction::Settings {
    let usual = instrument.corrections();
    if !has_two_beams {
        return usual;
    }
    length_correction::Settings {
        dead_path: None,
        cosine: None,
        material_expansion: None,
        ..usual
    }
}
