//! Which writes to the communication area are allowed when (CiA 301, 7.5.2.35-38, 7.5.2.19).

use wire::canopen::Object;
use wire::canopen::pdo::{MappedObject, PdoCobId};
use wire::canopen::sdo::AbortCode;

use super::communication::{LOAD, MAPPED_MAX, SAVE};
use super::dictionary::{Dictionary, Value};

/// The kind of PDO parameter that lives at an index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Area {
    /// 0x1400.. (`false`) or 0x1800.. (`true`) with the PDO's number.
    Parameters {
        transmit: bool,
        number: u16,
    },
    /// 0x1600.. or 0x1A00...
    Mapping {
        transmit: bool,
        number: u16,
    },
    Other,
}

impl Area {
    pub(super) const fn of(index: u16) -> Self {
        let number = index & 0x1FF;
        match index & 0xFE00 {
            0x1400 => Self::Parameters {
                transmit: false,
                number,
            },
            0x1600 => Self::Mapping {
                transmit: false,
                number,
            },
            0x1800 => Self::Parameters {
                transmit: true,
                number,
            },
            0x1A00 => Self::Mapping {
                transmit: true,
                number,
            },
            _ => Self::Other,
        }
    }
}

/// The index of a PDO's communication parameters.
pub(super) const fn parameters_index(transmit: bool, number: u16) -> u16 {
    number + if transmit { 0x1800 } else { 0x1400 }
}

/// The index of a PDO's mapping.
pub(super) const fn mapping_index(transmit: bool, number: u16) -> u16 {
    number + if transmit { 0x1A00 } else { 0x1600 }
}

/// Whether `value`, already checked by its entry, may be written now.
pub(super) fn check(
    dictionary: &Dictionary,
    object: Object,
    value: &Value,
) -> Result<(), AbortCode> {
    let Value::Integer(value) = *value else {
        return Ok(());
    };
    match (Area::of(object.index), object.index, object.sub) {
        (Area::Parameters { .. }, ..) => check_parameter(dictionary, object, value),
        (Area::Mapping { transmit, number }, _, 0) => {
            check_disabled(dictionary, transmit, number)?;
            check_count(dictionary, transmit, number, value)
        }
        (Area::Mapping { transmit, number }, ..) => {
            check_disabled(dictionary, transmit, number)?;
            check_mapping_is_open(dictionary, object.index)?;
            check_mapped(dictionary, transmit, value as u32)
        }
        (Area::Other, 0x1010, 1) => signature(value == SAVE),
        (Area::Other, 0x1011, 1) => signature(value == LOAD),
        (Area::Other, 0x1016, _) => check_consumer(dictionary, object, value as u32),
        (Area::Other, ..) => Ok(()),
    }
}

fn signature(matches: bool) -> Result<(), AbortCode> {
    if matches {
        Ok(())
    } else {
        Err(AbortCode::CannotStore)
    }
}

/// Identifiers that PDOs must not take (CiA 301, table 40).
const fn is_restricted(cob_id: u16) -> bool {
    matches!(cob_id, 0..=0x80 | 0x101..=0x180 | 0x581..=0x5FF | 0x601..=0x67F | 0x6E0..)
}

fn check_parameter(dictionary: &Dictionary, object: Object, value: i64) -> Result<(), AbortCode> {
    const EXTENDED: u32 = 1 << 29;
    const IDENTIFIER: u32 = 0x3FFF_FFFF;
    let old = PdoCobId(dictionary.integer(object.index, 1) as u32);
    let refused = match object.sub {
        1 => {
            let new = PdoCobId(value as u32);
            let moved = old.0 & IDENTIFIER != new.0 & IDENTIFIER;
            new.0 & EXTENDED != 0
                || (new.is_valid() && is_restricted(new.cob_id()))
                || (old.is_valid() && new.is_valid() && moved)
        }
        // Remote-requested transmission (252, 253) is not supported; 241-251 are reserved.
        2 => (241..=253).contains(&value),
        3 if old.is_valid() => return Err(AbortCode::DeviceState),
        _ => false,
    };
    if refused {
        Err(AbortCode::InvalidValue)
    } else {
        Ok(())
    }
}

/// The mapping must not change while the PDO exists (bit 31 of its COB-ID is 0).
fn check_disabled(dictionary: &Dictionary, transmit: bool, number: u16) -> Result<(), AbortCode> {
    let cob_id = dictionary.integer(parameters_index(transmit, number), 1);
    if PdoCobId(cob_id as u32).is_valid() {
        Err(AbortCode::DeviceState)
    } else {
        Ok(())
    }
}

/// Entries can only be written after sub 0 was set to 0.
fn check_mapping_is_open(dictionary: &Dictionary, index: u16) -> Result<(), AbortCode> {
    if dictionary.integer(index, 0) == 0 {
        Ok(())
    } else {
        Err(AbortCode::ReadOnly)
    }
}

fn check_mapped(dictionary: &Dictionary, transmit: bool, raw: u32) -> Result<(), AbortCode> {
    let mapped = MappedObject::from_raw(raw);
    if raw == 0 || (!transmit && is_dummy(mapped)) {
        return Ok(());
    }
    if mapped.bits > 64 {
        return Err(AbortCode::PdoTooLong);
    }
    dictionary.check_mapping(mapped.object, mapped.bits, transmit)
}

/// A static data type mapped into an RPDO: these bits are skipped (CiA 301, 7.4.7).
pub(super) const fn is_dummy(mapped: MappedObject) -> bool {
    let right_length = match mapped.object.index {
        0x0002 | 0x0005 => mapped.bits == 8,
        0x0003 | 0x0006 => mapped.bits == 16,
        0x0004 | 0x0007 => mapped.bits == 32,
        _ => false,
    };
    right_length && mapped.object.sub == 0
}

fn check_count(
    dictionary: &Dictionary,
    transmit: bool,
    number: u16,
    count: i64,
) -> Result<(), AbortCode> {
    if count > i64::from(MAPPED_MAX) {
        return Err(AbortCode::PdoTooLong);
    }
    let mut bits = 0;
    for sub in 1..=count as u8 {
        let raw = dictionary.integer(mapping_index(transmit, number), sub) as u32;
        if raw == 0 {
            return Err(AbortCode::NotMappable);
        }
        check_mapped(dictionary, transmit, raw)?;
        bits += u32::from(MappedObject::from_raw(raw).bits);
    }
    if bits > 64 {
        Err(AbortCode::PdoTooLong)
    } else {
        Ok(())
    }
}

/// A producer may be watched by one entry only (0x06040043).
fn check_consumer(dictionary: &Dictionary, object: Object, raw: u32) -> Result<(), AbortCode> {
    let producer = |raw: u32| (raw >> 16) & 0xFF;
    let watches = |raw: u32| raw & 0xFFFF != 0 && producer(raw) != 0;
    let entries = dictionary.integer(0x1016, 0) as u8;
    let twice = (1..=entries).filter(|sub| *sub != object.sub).any(|sub| {
        let other = dictionary.integer(0x1016, sub) as u32;
        watches(other) && producer(other) == producer(raw)
    });
    if watches(raw) && twice {
        Err(AbortCode::ParameterIncompatible)
    } else {
        Ok(())
    }
}
