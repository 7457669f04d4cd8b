//! Corrections that a configuration switches off although they would change what an instrument reads.

use compensator::length_correction::Settings;
use units::{Metres, Short};

use crate::config::judge::Finding;

/// n − 1 of air in a workshop: so much longer a path counts that is not corrected for air (Edlén, Ciddor: 271.4 ppm
/// at 20 °C and 1013.25 hPa).
const AIR_PPM: f64 = 271.4;
/// By how much a degree changes that.
const AIR_PPM_PER_KELVIN: f64 = 0.95;

/// The key of the correction for the expansion of what is measured.
pub(super) const MATERIAL: &str = "correct_material";

/// A correction that is switched off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SwitchedOff {
    /// What its readings are not corrected for.
    pub(crate) name: &'static str,
    /// The key that says so.
    pub(crate) key: &'static str,
    effect: Effect,
}

/// What is read wrong for want of it.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Effect {
    /// So many ppm of a length.
    Length { ppm: f64 },
    /// So many ppm of a length for each kelvin that something is not at 20 °C.
    PerKelvin { ppm: f64 },
    /// A length for each kelvin by which the air changes.
    Drift { um_per_kelvin: f64 },
}

impl SwitchedOff {
    /// The warning where it is switched off; `whose` calibration is `length` long.
    pub(crate) fn warned(&self, instrument: &str, whose: &str, length: Metres) -> Finding {
        Finding {
            key: format!("instrument.{instrument}.{}", self.key),
            cause: format!(
                "{whose}: readings are NOT CORRECTED for {}, {}",
                self.name,
                self.told(length)
            ),
            help: "switch it on; a calibration made without says so, and is foreign afterwards"
                .into(),
        }
    }

    /// What it comes to over `length`.
    fn told(&self, length: Metres) -> String {
        let of_length = |ppm: f64| {
            let um = Short((length.um() * ppm * 1e-6 * 1e3).round() / 1e3);
            format!("{um} µm over {} mm", Short(length.mm()))
        };
        match self.effect {
            Effect::Length { ppm } => format!("wrong by {}", of_length(ppm)),
            Effect::PerKelvin { ppm } => {
                format!("wrong by {} for each kelvin off 20 °C", of_length(ppm))
            }
            Effect::Drift { um_per_kelvin } => format!(
                "they drift by {} µm for each kelvin of the air",
                Short((um_per_kelvin * 1e3).round() / 1e3)
            ),
        }
    }
}

/// What `every` corrects and `made` does not.
pub(super) fn switched_off(made: &Settings, every: &Settings) -> Vec<SwitchedOff> {
    let air = (every.air && !made.air).then_some(SwitchedOff {
        name: "air",
        key: "correct_air",
        effect: Effect::Length { ppm: AIR_PPM },
    });
    // Without the air's index there is nothing to correct the dead path by: that is told of the air.
    let path = every
        .dead_path
        .filter(|_| made.air && made.dead_path.is_none());
    let path = path.filter(|it| it.length != Metres::ZERO);
    let path = path.map(|it| SwitchedOff {
        name: "dead path",
        key: "correct_dead_path",
        effect: Effect::Drift {
            um_per_kelvin: it.length.um() * AIR_PPM_PER_KELVIN * 1e-6,
        },
    });
    let material = every.material_expansion;
    let material = material.filter(|_| made.material_expansion.is_none());
    let material = material.map(|it| SwitchedOff {
        name: "material",
        key: MATERIAL,
        effect: Effect::PerKelvin {
            ppm: it.per_kelvin * 1e6,
        },
    });
    let angle = every.cosine.filter(|_| made.cosine.is_none());
    let angle = angle.filter(|it| it.angle.value() != 0.0);
    let angle = angle.map(|it| SwitchedOff {
        name: "angle of the beam",
        key: "correct_cosine",
        effect: Effect::Length {
            ppm: it.angle.value() * it.angle.value() / 2.0 * 1e6,
        },
    });
    [air, path, material, angle].into_iter().flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Edit;
    use crate::config::parse;

    const LINEAR: &str = include_str!("../../../../configs/machines/linear.toml");

    fn off(text: &str) -> Vec<(&'static str, String)> {
        let config = parse(text, "m").unwrap().config;
        let off = config.instrument["laser"].switched_off();
        off.iter()
            .map(|it| (it.key, it.told(Metres::from_mm(60.0))))
            .collect()
    }

    #[test]
    fn what_is_switched_off_is_told_with_what_it_comes_to() {
        assert_eq!(off(LINEAR), []);
        let path = LINEAR.edit("correct_dead_path = true", "correct_dead_path = false");
        let says = "they drift by 0.095 µm for each kelvin of the air";
        assert_eq!(off(&path), [("correct_dead_path", says.to_owned())]);
        let text = LINEAR
            .edit("correct_air = true", "correct_air = false")
            .edit("correct_material = true", "correct_material = false")
            .edit("misalignment_mrad = 0.0", "misalignment_mrad = 2.0");
        let expected = [
            ("correct_air", "wrong by 16.284 µm over 60 mm"),
            (
                "correct_material",
                "wrong by 0.69 µm over 60 mm for each kelvin off 20 °C",
            ),
            ("correct_cosine", "wrong by 0.12 µm over 60 mm"),
        ];
        let told = off(&text);
        let told: Vec<_> = told.iter().map(|(key, it)| (*key, it.as_str())).collect();
        assert_eq!(told, expected);
    }
}
