//! Objects that a configuration names: `"0x6066"`, or one entry of it, `"0x1A00:01"`.

use core::fmt;
use core::str::FromStr;

use serde::{Deserialize, Serialize};
use wire::canopen::Object;

use super::dictionary::Value;

/// An object with all its entries, or one entry.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct NamedObject {
    /// Its index.
    pub index: u16,
    /// Its only entry that is meant; all of them when absent.
    pub sub: Option<u8>,
}

/// A text that names no object.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` names no object; objects are \"0x6066\" or \"0x1A00:01\"")]
pub struct NoObject(String);

impl NamedObject {
    /// All entries of an index.
    pub const fn whole(index: u16) -> Self {
        Self { index, sub: None }
    }

    /// Whether `object` is meant.
    pub fn means(self, object: Object) -> bool {
        self.index == object.index && self.sub.is_none_or(|sub| sub == object.sub)
    }
}

impl FromStr for NamedObject {
    type Err = NoObject;

    fn from_str(text: &str) -> Result<Self, NoObject> {
        let refuse = || NoObject(text.to_owned());
        let (index, sub) = match text.split_once(':') {
            Some((index, sub)) => (index, Some(sub)),
            None => (text, None),
        };
        let index = index.strip_prefix("0x").ok_or_else(refuse)?;
        let index = u16::from_str_radix(index, 16).map_err(|_| refuse())?;
        let sub = sub.map(|sub| u8::from_str_radix(sub, 16));
        let sub = sub.transpose().map_err(|_| refuse())?;
        Ok(Self { index, sub })
    }
}

impl TryFrom<String> for NamedObject {
    type Error = NoObject;

    fn try_from(text: String) -> Result<Self, NoObject> {
        text.parse()
    }
}

impl fmt::Display for NamedObject {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.sub {
            Some(sub) => write!(f, "0x{:04X}:{sub:02X}", self.index),
            None => write!(f, "0x{:04X}", self.index),
        }
    }
}

impl From<NamedObject> for String {
    fn from(object: NamedObject) -> Self {
        object.to_string()
    }
}

/// An object whose written values are rounded or cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ChangedWrite {
    /// Which object.
    pub object: NamedObject,
    /// Values become multiples of this, rounded down.
    #[serde(default = "one")]
    pub step: i64,
    /// Values become this at most.
    pub maximum: Option<i64>,
}

const fn one() -> i64 {
    1
}

impl ChangedWrite {
    /// Returns what `value` becomes.
    pub(super) fn apply(self, value: i64) -> i64 {
        let step = self.step.max(1);
        let most = self.maximum.unwrap_or(i64::MAX);
        value.min(most).div_euclid(step) * step
    }

    /// Returns what a written value becomes.
    pub(super) fn apply_to(self, value: Value) -> Value {
        match value {
            Value::Integer(number) => Value::Integer(self.apply(number)),
            bytes @ Value::Bytes(_) => bytes,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check_name(text: &str, expected: Option<(u16, Option<u8>)>) {
        let parsed = text.parse::<NamedObject>();
        let seen = parsed.clone().ok().map(|object| (object.index, object.sub));
        assert_eq!(seen, expected, "{text}");
        if let Ok(object) = parsed {
            assert_eq!(object.to_string(), text);
        }
    }

    #[test]
    fn names_of_objects_are_read_and_written() {
        check_name("0x6066", Some((0x6066, None)));
        check_name("0x1A00:01", Some((0x1A00, Some(1))));
        for wrong in ["6066", "0x", "0x6066:", "0x16066", "0x6066:100", ""] {
            check_name(wrong, None);
        }
    }

    #[test]
    fn written_values_are_rounded_down_and_cut() {
        let change = ChangedWrite {
            object: NamedObject::whole(0x6085),
            step: 7,
            maximum: Some(100),
        };
        let seen = [6, 7, 20, 100, 5000, -1].map(|value| change.apply(value));
        assert_eq!(seen, [0, 7, 14, 98, 98, -7]);
    }
}
