//! How a drive proves at a start that it has kept its zero.

use drivers::device::ReferenceProof;
use schemars::JsonSchema;
use serde::Deserialize;
use wire::canopen::Object;

use super::CHECKED;
use crate::config::judge::Judge;

/// How a drive proves at a start that it has kept its zero, so that its axis is not zeroed again after a restart.
/// Which drive can do what, its manual says; CiA 402 has no object for it.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct KeptZeroConfig {
    /// `"mark"`: a number is written into `object` at zeroing, which the drive loses with its power. `"homed_bit"`: bit
    /// `bit` of `object` is 1 as long as the drive is homed. `"absolute_encoder"`: the encoder is absolute over the whole
    /// travel and the drive keeps its origin without power; its position (0x6064) must still lie beside that of its encoder
    /// in `object` as at the zero.
    pub by: KeptZeroName,
    /// For `"mark"` one of 32 bits that means nothing to the drive and is not stored, such as a variable for users; for
    /// `"homed_bit"` such as a statusword with a bit of the manufacturer's; for `"absolute_encoder"` the encoder's own
    /// position, which no homing changes: 0x6063 of some drives.
    #[schemars(extend("x-range" = "index:sub-index, such as `\"0x2F00:01\"`"))]
    pub object: String,
    /// From 0, the lowest. Of the statusword only 8, 14 and 15 are the manufacturer's; bit 12 says so in homing mode only.
    #[schemars(range(min = 0, max = 31))]
    pub bit: Option<u8>,
}

/// What the proof is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum KeptZeroName {
    /// A number written into an object.
    Mark,
    /// A bit that says so.
    HomedBit,
    /// An encoder that needs no reference.
    AbsoluteEncoder,
}

/// Where the identity and the parameters of communication of a node end (CiA 301): none of them is free.
const FIRST_OF_MANUFACTURER: u16 = 0x2000;
/// And where the objects of profiles begin.
const FIRST_OF_PROFILES: u16 = 0x6000;

impl KeptZeroConfig {
    /// Whether it asks for an encoder that needs no reference.
    pub(crate) fn is_absolute(&self) -> bool {
        self.by == KeptZeroName::AbsoluteEncoder
    }

    pub(crate) fn check(&self, judge: &mut Judge<'_>) {
        const OBJECT: &str = "kept_zero.object";
        const BIT: &str = "kept_zero.bit";
        let seen = object(&self.object);
        match seen {
            None => judge.say(
                OBJECT,
                format!("`{}` is no object", self.object),
                "give index and sub-index as the drive's manual has them, such as \"0x2F00:01\"",
            ),
            Some(it) if self.by == KeptZeroName::AbsoluteEncoder && !may_be_encoder(it) => judge.say(
                OBJECT,
                format!("{it} is not an encoder's own position"),
                "give 0x6063, where the drive does not count that with its homing, or an object of the manufacturer's",
            ),
            Some(it) if self.by == KeptZeroName::Mark && !is_manufacturers(it) => judge.say(
                OBJECT,
                format!("{it} has a meaning of its own, and a mark would change it"),
                "give an object of the manufacturer's (0x2000 to 0x5FFF) that is free for users",
            ),
            Some(_) => {}
        }
        match (self.bit, self.by == KeptZeroName::HomedBit) {
            (None, true) => judge.say(BIT, "is missing", "give the number of the bit, 0 to 31"),
            (Some(_), false) => judge.say(BIT, "is for `by = \"homed_bit\"` only", "remove it"),
            (Some(bit @ 32..), true) => judge.say(BIT, format!("{bit} is no bit"), "give 0 to 31"),
            (Some(bit), true) if seen == Some(STATUSWORD) && !OF_MANUFACTURER.contains(&bit) => {
                judge.say(
                    BIT,
                    format!("{bit} of the statusword means something else in CiA 402, whatever the drive is homed by"),
                    "give the bit that the manufacturer has for it (8, 14 or 15), or another proof",
                );
            }
            _ => {}
        }
    }

    /// What the driver is told; the configuration has been checked.
    pub(crate) fn proof(&self) -> ReferenceProof {
        let object = object(&self.object).expect(CHECKED);
        match self.by {
            KeptZeroName::Mark => ReferenceProof::Mark(object),
            KeptZeroName::HomedBit => ReferenceProof::HomedBit {
                object,
                bit: self.bit.expect(CHECKED),
            },
            KeptZeroName::AbsoluteEncoder => ReferenceProof::AbsoluteEncoder(object),
        }
    }
}

const STATUSWORD: Object = Object::new(0x6041, 0);
/// The bits of it that CiA 402 leaves to the manufacturer.
const OF_MANUFACTURER: [u8; 3] = [8, 14, 15];

const INCREMENTS: Object = Object::new(0x6063, 0);

fn may_be_encoder(object: Object) -> bool {
    object == INCREMENTS || is_manufacturers(object)
}

fn is_manufacturers(object: Object) -> bool {
    (FIRST_OF_MANUFACTURER..FIRST_OF_PROFILES).contains(&object.index)
}

/// `0x2F00:01`, or `0x2F00` for its sub-index 0; both numbers hexadecimal, as manuals write them.
fn object(text: &str) -> Option<Object> {
    let (index, sub) = text.split_once(':').unwrap_or((text, "0"));
    let index = index.strip_prefix("0x")?;
    let sub = sub.strip_prefix("0x").unwrap_or(sub);
    let is_plain = |it: &str| !it.starts_with('+');
    if !is_plain(index) || !is_plain(sub) {
        return None;
    }
    let index = u16::from_str_radix(index, 16).ok()?;
    Some(Object::new(index, u8::from_str_radix(sub, 16).ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn objects_are_written_as_in_manuals() {
        assert_eq!(object("0x2F00:01"), Some(Object::new(0x2F00, 1)));
        assert_eq!(object("0x2f00:0x1F"), Some(Object::new(0x2F00, 31)));
        assert_eq!(object("0x6041"), Some(STATUSWORD));
        for wrong in [
            "",
            "2F00:01",
            "0x2F00:",
            "0x12345:00",
            "0x2F00:100",
            "0x+2F0:1",
            "0x2F00:1:2",
        ] {
            assert_eq!(object(wrong), None, "{wrong}");
        }
    }
}
