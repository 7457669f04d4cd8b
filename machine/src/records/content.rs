//! What one calibration says: a head that all kinds share, and the content of its kind.
//!
//! In the file the keys of head and content stand side by side, and `kind` says which content it is.

use serde::de::{DeserializeOwned, Error as _};
use serde::{Deserialize, Deserializer, Serialize};
use serde_json::{Map, Value};

use super::head::RecordHead;
use super::sound::Judged;

/// What calibrations of one kind say: a plain struct with `deny_unknown_fields`, every key with its
/// unit.
pub trait Content: Serialize + DeserializeOwned {
    /// Its name in files and messages.
    const KIND: &'static str;

    /// How much it holds, in a few words.
    fn summary(&self) -> String;

    /// Whether it can be so, judged whole where it enters.
    ///
    /// # Errors
    /// Naming the first thing that cannot be so.
    fn judge(&self) -> Judged;
}

/// One calibration of one axis: a signed statement of what was measured, with what, when,
/// on which machine, and how well.
#[derive(Clone, Debug, PartialEq)]
pub struct CalibrationRecord<C> {
    /// Whose it is and where it comes from.
    pub head: RecordHead,
    /// What it says.
    pub content: C,
}

#[derive(Serialize)]
struct Written<'a, C> {
    #[serde(flatten)]
    head: &'a RecordHead,
    kind: &'static str,
    #[serde(flatten)]
    content: &'a C,
}

impl<C: Content> Serialize for CalibrationRecord<C> {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let (head, content) = (&self.head, &self.content);
        let kind = C::KIND;
        Written {
            head,
            kind,
            content,
        }
        .serialize(serializer)
    }
}

#[derive(Deserialize)]
struct Read {
    #[serde(flatten)]
    head: RecordHead,
    kind: String,
    /// What the head does not know must be known to the content.
    #[serde(flatten)]
    content: Map<String, Value>,
}

impl<'de, C: Content> Deserialize<'de> for CalibrationRecord<C> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let Read {
            head,
            kind,
            content,
        } = Read::deserialize(deserializer)?;
        if kind != C::KIND {
            let expected = C::KIND;
            return Err(D::Error::custom(format!(
                "the kind is `{kind}`, expected `{expected}`"
            )));
        }
        let content = C::deserialize(Value::Object(content)).map_err(D::Error::custom)?;
        Ok(Self { head, content })
    }
}

impl<C: Content> CalibrationRecord<C> {
    /// As it lies in its file.
    pub fn bytes(&self) -> Vec<u8> {
        let mut bytes = serde_json::to_vec_pretty(self).expect("plain data always serialises");
        bytes.push(b'\n');
        bytes
    }

    pub(super) fn judge(&self) -> Judged {
        self.head.judge()?;
        self.content.judge()
    }
}

/// What a list of calibrations shows of one, of whatever kind.
#[derive(Clone, Debug, PartialEq)]
pub struct Glance {
    /// Whose it is and where it comes from.
    pub head: RecordHead,
    /// What its content is called.
    pub kind: &'static str,
    /// How much that holds.
    pub summary: String,
}

/// What a file says at a glance, and whether it can be so.
type Parse = fn(&[u8]) -> Result<(Glance, Judged), serde_json::Error>;

/// A kind of content that a store knows: one of a list, for reading a calibration of unknown kind.
#[derive(Clone, Copy, Debug)]
pub struct ContentKind {
    pub(super) name: &'static str,
    pub(super) parse: Parse,
}

impl ContentKind {
    /// That of `C`.
    pub const fn of<C: Content>() -> Self {
        Self {
            name: C::KIND,
            parse: glance::<C>,
        }
    }

    /// What it is called in files and messages.
    pub const fn name(&self) -> &'static str {
        self.name
    }
}

fn glance<C: Content>(bytes: &[u8]) -> Result<(Glance, Judged), serde_json::Error> {
    let record: CalibrationRecord<C> = serde_json::from_slice(bytes)?;
    let judged = record.judge();
    let glance = Glance {
        kind: C::KIND,
        summary: record.content.summary(),
        head: record.head,
    };
    Ok((glance, judged))
}
