//! What a calibration depends on in a configuration: a text of named values, and its hash.
//!
//! A change of any of these values makes calibrations foreign; a change of this program must not. So
//! the text names its values itself, in the words of the configuration file, and nothing in it is
//! taken from the names or the order of Rust types. It has a version in its first line. A version that
//! was ever published stays as it is, and its hash stays good: calibrations carry it.

mod text;
mod version_1;
mod version_2;

use super::model::MachineConfig;

/// BLAKE3 of what a calibration depends on, in hexadecimal: as it is written today, and as earlier
/// programs wrote it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ConfigHash {
    current: String,
    earlier: Vec<String>,
}

impl ConfigHash {
    /// Of `config`.
    pub fn of(config: &MachineConfig) -> Self {
        let hash = |text: String| blake3::hash(text.as_bytes()).to_hex().to_string();
        Self {
            current: hash(version_2::text(config)),
            earlier: vec![hash(version_1::text(config))],
        }
    }

    /// As records and journals of today carry it.
    pub fn as_str(&self) -> &str {
        &self.current
    }

    /// Whether a record or journal that carries `recorded` was made with the same values, by this
    /// program or an earlier one.
    pub fn is(&self, recorded: &str) -> bool {
        self.current == recorded || self.earlier.iter().any(|it| it == recorded)
    }

    /// What to show and compare beside `recorded`: the same where both were made with the same values,
    /// else today's.
    pub fn beside<'a>(&'a self, recorded: &'a str) -> &'a str {
        if self.is(recorded) {
            recorded
        } else {
            &self.current
        }
    }

    /// One that only `text` agrees with.
    #[cfg(test)]
    pub(crate) fn only(text: &str) -> Self {
        Self {
            current: text.to_owned(),
            earlier: Vec::new(),
        }
    }
}

#[cfg(test)]
mod tests;
