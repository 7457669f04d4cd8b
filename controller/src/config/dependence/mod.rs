//! What a calibration depends on in a configuration: a text of named values, and its hash.
//!
//! A change of any of these values makes calibrations foreign; a change of this program must not. So
//! the text names its values itself, in the words of the configuration file, and nothing in it is
//! taken from the names or the order of Rust types. It has a version in its first line. A version that
//! was ever published stays as it is, and its hash stays good: calibrations carry it.

pub(crate) mod devices;
pub(crate) mod text;
mod version_1;
mod version_2;
mod version_3;
mod version_4;

use machine::records::ConfigHash;

use super::model::MachineConfig;

/// The hash of what a calibration depends on in `config`.
pub(crate) fn hash_of(config: &MachineConfig) -> ConfigHash {
    let mut texts = vec![version_2::text(config), version_1::text(config)];
    texts.splice(0..0, version_3::text(config));
    let fourth = version_4::text(config, &texts[0]);
    texts.splice(0..0, fourth);
    ConfigHash::of_texts(&texts[0], &texts[1..])
}

#[cfg(test)]
mod tests;
