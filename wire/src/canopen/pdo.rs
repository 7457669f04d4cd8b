//! Process data objects: their parameters and their payload (CiA 301, 7.2.2 and 7.5.2.35-38).

use super::Object;

/// One entry of a mapping parameter: which object, how many bits.
///
/// # Example
///
/// ```
/// use wire::canopen::pdo::MappedObject;
///
/// let actual_position = MappedObject::new(0x6064, 0, 32);
/// assert_eq!(actual_position.raw(), 0x6064_0020);
/// assert_eq!(MappedObject::from_raw(0x6041_0010).object.to_string(), "0x6041:00");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct MappedObject {
    /// The object.
    pub object: Object,
    /// Its length in bits.
    pub bits: u8,
}

impl MappedObject {
    /// The object at `index` and `sub`, `bits` long.
    pub const fn new(index: u16, sub: u8, bits: u8) -> Self {
        Self {
            object: Object::new(index, sub),
            bits,
        }
    }

    /// The value of 0x1600.. or 0x1A00.. sub 1..n.
    pub const fn raw(self) -> u32 {
        (self.object.index as u32) << 16 | (self.object.sub as u32) << 8 | self.bits as u32
    }

    /// From the value of 0x1600.. or 0x1A00.. sub 1..n.
    pub const fn from_raw(raw: u32) -> Self {
        Self {
            object: Object::new((raw >> 16) as u16, (raw >> 8) as u8),
            bits: raw as u8,
        }
    }
}

/// The COB-ID entry of a communication parameter (sub 1).
///
/// # Example
///
/// ```
/// use wire::canopen::pdo::PdoCobId;
///
/// let switched_off = PdoCobId::valid(0x181).disabled();
/// assert_eq!(switched_off.0, 0xC000_0181);
/// assert_eq!((switched_off.is_valid(), switched_off.cob_id()), (false, 0x181));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct PdoCobId(pub u32);

impl PdoCobId {
    const INVALID: u32 = 1 << 31;
    const NO_REMOTE: u32 = 1 << 30;

    /// A PDO in use, which remote frames may not ask for (bit 30).
    pub const fn valid(cob_id: u16) -> Self {
        Self(cob_id as u32 | Self::NO_REMOTE)
    }

    /// The same, switched off (bit 31).
    pub const fn disabled(self) -> Self {
        Self(self.0 | Self::INVALID)
    }

    /// Whether the PDO is in use.
    pub const fn is_valid(self) -> bool {
        self.0 & Self::INVALID == 0
    }

    /// The 11-bit identifier.
    pub const fn cob_id(self) -> u16 {
        (self.0 & 0x7FF) as u16
    }
}

/// When a PDO is sent or taken over (sub 2).
///
/// # Example
///
/// ```
/// use wire::canopen::pdo::Transmission;
///
/// assert_eq!(Transmission::from_raw(1), Transmission::Synchronous(1));
/// assert_eq!(Transmission::Event.raw(), 255);
/// assert_eq!(Transmission::from_raw(252), Transmission::Unknown(252));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Transmission {
    /// At the next SYNC after a change.
    SynchronousAcyclic,
    /// At every n-th SYNC, 1 to 240.
    Synchronous(u8),
    /// On an event of the device profile (255).
    Event,
    /// Reserved, remote or manufacturer's values.
    Unknown(u8),
}

impl Transmission {
    /// From the object's value.
    pub const fn from_raw(raw: u8) -> Self {
        match raw {
            0 => Self::SynchronousAcyclic,
            1..=240 => Self::Synchronous(raw),
            255 => Self::Event,
            other => Self::Unknown(other),
        }
    }

    /// The object's value.
    pub const fn raw(self) -> u8 {
        match self {
            Self::SynchronousAcyclic => 0,
            Self::Synchronous(n) => n,
            Self::Event => 255,
            Self::Unknown(raw) => raw,
        }
    }
}

/// The little-endian unsigned value of `bits` bits that starts `bit_offset` bits into `payload`;
/// `None` when the payload is too short or more than 64 bits are asked for.
///
/// # Example
///
/// ```
/// use wire::canopen::pdo::{extract, sign_extend};
///
/// // A statusword and a position.
/// let payload = [0x37, 0x16, 0xFE, 0xFF, 0xFF, 0xFF];
/// assert_eq!(extract(&payload, 0, 16), Some(0x1637));
/// assert_eq!(extract(&payload, 16, 32).map(|raw| sign_extend(raw, 32)), Some(-2));
/// assert_eq!(extract(&payload, 32, 32), None, "beyond its end");
/// ```
#[inline]
pub fn extract(payload: &[u8], bit_offset: usize, bits: u8) -> Option<u64> {
    let end = bit_offset + usize::from(bits);
    if payload.len() > 8 || end > payload.len() * 8 || bits > 64 {
        return None;
    }
    let mut bytes = [0; 8];
    bytes[..payload.len()].copy_from_slice(payload);
    let shifted = u64::from_le_bytes(bytes) >> bit_offset.min(63);
    Some(shifted & mask(bits))
}

/// Writes the low `bits` of `value` at `bit_offset`; `None` (and nothing written) when it
/// does not fit.
///
/// # Example
///
/// ```
/// use wire::canopen::pdo::insert;
///
/// let mut payload = [0; 8];
/// let (controlword, target) = (0x0F, -2_i64);
/// assert_eq!(insert(&mut payload, 0, 16, controlword), Some(()));
/// assert_eq!(insert(&mut payload, 16, 32, target.cast_unsigned()), Some(()));
/// assert_eq!(payload, [0x0F, 0, 0xFE, 0xFF, 0xFF, 0xFF, 0, 0]);
/// assert_eq!(insert(&mut payload, 48, 32, 0), None, "80 bits");
/// ```
#[inline]
pub fn insert(payload: &mut [u8; 8], bit_offset: usize, bits: u8, value: u64) -> Option<()> {
    if bit_offset + usize::from(bits) > 64 || bits == 0 {
        return None;
    }
    let hole = mask(bits) << bit_offset;
    let old = u64::from_le_bytes(*payload) & !hole;
    *payload = (old | (value & mask(bits)) << bit_offset).to_le_bytes();
    Some(())
}

/// Reads `value`, `bits` long, as two's complement.
pub const fn sign_extend(value: u64, bits: u8) -> i64 {
    let unused = 64 - bits as u32;
    ((value << unused) as i64) >> unused
}

const fn mask(bits: u8) -> u64 {
    if bits >= 64 {
        u64::MAX
    } else {
        (1 << bits) - 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_mapping_entry_reads_as_drive_manuals_write_it() {
        assert_eq!(MappedObject::new(0x6064, 0, 32).raw(), 0x6064_0020);
        assert_eq!(
            MappedObject::from_raw(0x6041_0010),
            MappedObject::new(0x6041, 0, 16)
        );
    }

    #[test]
    fn a_disabled_pdo_keeps_its_identifier() {
        let cob = PdoCobId::valid(0x181).disabled();
        assert_eq!(cob.0, 0xC000_0181);
        assert!(!cob.is_valid());
        assert_eq!(cob.cob_id(), 0x181);
    }

    #[test]
    fn statusword_and_position_are_taken_apart() {
        let payload = [0x37, 0x16, 0xFE, 0xFF, 0xFF, 0xFF];
        assert_eq!(extract(&payload, 0, 16), Some(0x1637));
        assert_eq!(
            extract(&payload, 16, 32).map(|raw| sign_extend(raw, 32)),
            Some(-2)
        );
        assert_eq!(extract(&payload, 32, 32), None);
    }

    proptest! {
        #[test]
        fn what_is_inserted_is_extracted(value: u64, offset in 0usize..64, bits in 1u8..=64) {
            let mut payload = [0xA5; 8];
            if insert(&mut payload, offset, bits, value).is_some() {
                let back = extract(&payload, offset, bits).unwrap();
                prop_assert_eq!(back, value & mask(bits));
            }
        }
    }
}
