//! The hash that binds records to what they depend on.

/// BLAKE3 of what a calibration depends on, in hexadecimal: as it is written today, and as earlier
/// programs wrote it.
///
/// # Example
///
/// ```
/// use machine::records::ConfigHash;
///
/// let earlier = ConfigHash::of_texts("scale 10 nm", &[]);
/// let now = ConfigHash::of_texts("scale 0.00001 mm", &["scale 10 nm".to_owned()]);
/// assert!(now.is(earlier.as_str()), "the same values, written otherwise");
/// assert!(!now.is(ConfigHash::of_texts("scale 20 nm", &[]).as_str()));
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ConfigHash {
    current: String,
    earlier: Vec<String>,
}

impl ConfigHash {
    /// Of the text of today, and of those that earlier programs wrote of the same values.
    pub fn of_texts(current: &str, earlier: &[String]) -> Self {
        let hash = |text: &str| blake3::hash(text.as_bytes()).to_hex().to_string();
        Self {
            current: hash(current),
            earlier: earlier.iter().map(|it| hash(it)).collect(),
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

    /// One that only `recorded` agrees with: what was read from a record, to compare others with.
    pub fn recorded(recorded: &str) -> Self {
        Self {
            current: recorded.to_owned(),
            earlier: Vec::new(),
        }
    }
}
