//! The communication profile area 0x1000-0x1FFF of an emulated node (CiA 301, 7.5.2).

use serde::{Deserialize, Serialize};
use wire::canopen::pdo::MappedObject;
use wire::canopen::{Function, NodeId};

use super::dictionary::{Access, Bounds, Dictionary, Entry, Kind, Mapping};
use super::errors::HISTORY;

/// The most objects one PDO maps here.
pub(super) const MAPPED_MAX: u8 = 8;
/// The most producers one node watches.
const WATCHED_MAX: usize = 4;
/// "save", read as a number (CiA 301, 7.5.2.13).
pub(super) const SAVE: i64 = 0x6576_6173;
/// "load", read as a number (CiA 301, 7.5.2.14).
pub(super) const LOAD: i64 = 0x6461_6F6C;

/// The identity object 0x1018.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Identity {
    /// 0x1018:01.
    pub vendor_id: u32,
    /// 0x1018:02.
    pub product_code: u32,
    /// 0x1018:03.
    pub revision: u32,
    /// 0x1018:04.
    pub serial_number: u32,
}

impl Default for Identity {
    fn default() -> Self {
        Self {
            vendor_id: 0x0000_07FF,
            product_code: 0x0042_0001,
            revision: 0x0001_0000,
            serial_number: 1,
        }
    }
}

/// The power-on values of one PDO.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PdoDefault {
    /// Sub 1: identifier and the bits 29 to 31.
    pub cob_id: u32,
    /// Sub 2.
    pub transmission: u8,
    /// Sub 3, in 100 µs.
    pub inhibit_100us: u16,
    /// Sub 5, in milliseconds.
    pub event_timer_ms: u16,
    /// 0x1600.. or 0x1A00...
    pub mapping: Vec<MappedObject>,
}

/// What a device says about itself besides its application objects.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Description {
    /// 0x1000.
    pub device_type: u32,
    /// 0x1008.
    pub device_name: String,
    /// 0x1009.
    pub hardware_version: String,
    /// 0x100A.
    pub software_version: String,
    /// 0x1018.
    pub identity: Identity,
    /// 0x1017 at power-on.
    pub heartbeat_ms: u16,
    /// 0x1400.. and 0x1600...
    pub rpdos: Vec<PdoDefault>,
    /// 0x1800.. and 0x1A00...
    pub tpdos: Vec<PdoDefault>,
}

/// Adds everything of 0x1000-0x1FFF.
pub(super) fn insert(dictionary: &mut Dictionary, node: NodeId, device: &Description) {
    use Kind::{U8, U16, U32};
    let device_type = Entry::constant(U32, i64::from(device.device_type));
    dictionary.insert(0x1000, 0, device_type);
    dictionary.insert(0x1001, 0, Entry::read_only(U8, 0).mapped(Mapping::Transmit));
    dictionary.insert(0x1003, 0, history_count());
    for sub in 1..=HISTORY {
        dictionary.insert(0x1003, sub as u8, Entry::read_only(U32, 0));
    }
    let sync = Entry::read_write(U32, 0x80).bounded(Bounds::OneOf(&[0x80]));
    dictionary.insert(0x1005, 0, sync);
    dictionary.insert(0x1006, 0, Entry::read_write(U32, 0));
    dictionary.insert(0x1008, 0, Entry::text(&device.device_name));
    dictionary.insert(0x1009, 0, Entry::text(&device.hardware_version));
    dictionary.insert(0x100A, 0, Entry::text(&device.software_version));
    let signature = || Entry::read_write(U32, 1);
    dictionary.insert_array(0x1010, vec![signature()]);
    dictionary.insert_array(0x1011, vec![signature()]);
    let emergency = i64::from(node.cob_id(Function::Emergency));
    dictionary.insert(0x1014, 0, Entry::constant(U32, emergency));
    dictionary.insert(0x1015, 0, Entry::read_write(U16, 0));
    dictionary.insert_array(0x1016, vec![Entry::read_write(U32, 0); WATCHED_MAX]);
    let heartbeat = Entry::read_write(U16, i64::from(device.heartbeat_ms));
    dictionary.insert(0x1017, 0, heartbeat);
    insert_identity(dictionary, &device.identity);
    dictionary.insert(0x1019, 0, Entry::read_write(U8, 0));
    let behaviour = Entry::read_write(U8, 0).bounded(Bounds::Between(0, 2));
    dictionary.insert_array(0x1029, vec![behaviour]);
    insert_pdos(dictionary, device);
}

fn history_count() -> Entry {
    Entry::read_write(Kind::U8, 0).bounded(Bounds::OneOf(&[0]))
}

fn insert_identity(dictionary: &mut Dictionary, identity: &Identity) {
    let numbers = [
        identity.vendor_id,
        identity.product_code,
        identity.revision,
        identity.serial_number,
    ];
    let entries = numbers.map(|number| Entry::constant(Kind::U32, i64::from(number)));
    dictionary.insert_array(0x1018, entries.to_vec());
}

fn insert_pdos(dictionary: &mut Dictionary, device: &Description) {
    for (number, pdo) in (0..).zip(&device.rpdos) {
        insert_parameters(dictionary, 0x1400 + number, pdo);
        insert_mapping(dictionary, 0x1600 + number, pdo);
    }
    for (number, pdo) in (0..).zip(&device.tpdos) {
        insert_parameters(dictionary, 0x1800 + number, pdo);
        insert_mapping(dictionary, 0x1A00 + number, pdo);
    }
}

/// Sub 4 is reserved and absent; sub 0 is the highest sub-index.
fn insert_parameters(dictionary: &mut Dictionary, index: u16, pdo: &PdoDefault) {
    use Kind::{U8, U16, U32};
    dictionary.insert(index, 0, Entry::constant(U8, 5));
    let cob_id = Entry::read_write(U32, i64::from(pdo.cob_id));
    dictionary.insert(index, 1, cob_id);
    let transmission = Entry::read_write(U8, i64::from(pdo.transmission));
    dictionary.insert(index, 2, transmission);
    let inhibit = Entry::read_write(U16, i64::from(pdo.inhibit_100us));
    dictionary.insert(index, 3, inhibit);
    let timer = Entry::read_write(U16, i64::from(pdo.event_timer_ms));
    dictionary.insert(index, 5, timer);
}

fn insert_mapping(dictionary: &mut Dictionary, index: u16, pdo: &PdoDefault) {
    let count = Entry::number(Kind::U8, Access::ReadWrite, pdo.mapping.len() as i64);
    dictionary.insert(index, 0, count);
    for sub in 1..=MAPPED_MAX {
        let mapped = pdo.mapping.get(usize::from(sub) - 1);
        let raw = mapped.map_or(0, |mapped| mapped.raw());
        dictionary.insert(index, sub, Entry::read_write(Kind::U32, i64::from(raw)));
    }
}
