//! The object dictionary (CiA 301, 7.4): typed values with access rights and ranges.
//!
//! Every entry has three values: the factory's, the one it takes at power-on (what "save" in
//! 0x1010 stored), and the present one.

use wire::canopen::Object;
use wire::canopen::sdo::AbortCode;

/// The data type of an entry (CiA 301, 7.4.7).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "the names are the standard's types")]
pub enum Kind {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    /// VISIBLE_STRING.
    Text,
    /// OCTET_STRING or DOMAIN of at most `max` bytes.
    Octets {
        max: usize,
    },
}

impl Kind {
    /// Its length in bytes, `None` where it varies.
    pub const fn bytes(self) -> Option<usize> {
        match self {
            Self::I8 | Self::U8 => Some(1),
            Self::I16 | Self::U16 => Some(2),
            Self::I32 | Self::U32 => Some(4),
            Self::Text | Self::Octets { .. } => None,
        }
    }

    /// The number that is left of `value` in this type: it wraps as the hardware's would.
    pub const fn wrap(self, value: i64) -> i64 {
        match self {
            Self::I8 => value as i8 as i64,
            Self::U8 => value as u8 as i64,
            Self::I16 => value as i16 as i64,
            Self::U16 => value as u16 as i64,
            Self::I32 => value as i32 as i64,
            Self::U32 => value as u32 as i64,
            Self::Text | Self::Octets { .. } => value,
        }
    }

    fn length_error(self, seen: usize) -> Option<AbortCode> {
        let (least, most) = match self {
            Self::Octets { max } => (0, max),
            Self::Text => (0, 255),
            _ => (self.bytes().unwrap_or(0), self.bytes().unwrap_or(0)),
        };
        if seen > most {
            Some(AbortCode::LengthTooHigh)
        } else {
            (seen < least).then_some(AbortCode::LengthTooLow)
        }
    }
}

/// Who may do what by SDO (CiA 301, table 42).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "the names are the standard's")]
pub enum Access {
    Constant,
    ReadOnly,
    WriteOnly,
    ReadWrite,
}

/// Into which PDOs an entry can be mapped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "each is a direction of a PDO")]
pub enum Mapping {
    Never,
    Transmit,
    Receive,
    Both,
}

/// Which numbers an entry takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bounds {
    /// All of its type.
    Any,
    /// From the first to the second, both included.
    Between(i64, i64),
    /// These only.
    OneOf(&'static [i64]),
}

impl Bounds {
    fn check(self, value: i64) -> Result<(), AbortCode> {
        match self {
            Self::Between(_, high) if value > high => Err(AbortCode::ValueTooHigh),
            Self::Between(low, _) if value < low => Err(AbortCode::ValueTooLow),
            Self::OneOf(known) if !known.contains(&value) => Err(AbortCode::InvalidValue),
            Self::Any | Self::Between(..) | Self::OneOf(_) => Ok(()),
        }
    }
}

/// The content of an entry.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Value {
    /// Of every number type; a REAL32 is kept as its bits.
    Integer(i64),
    /// Of strings and domains.
    Bytes(Vec<u8>),
}

/// One entry of the dictionary.
#[derive(Clone, Debug)]
pub struct Entry {
    kind: Kind,
    access: Access,
    mapping: Mapping,
    bounds: Bounds,
    factory: Value,
    power_on: Value,
    value: Value,
}

impl Entry {
    fn new(kind: Kind, access: Access, value: Value) -> Self {
        Self {
            kind,
            access,
            mapping: Mapping::Never,
            bounds: Bounds::Any,
            factory: value.clone(),
            power_on: value.clone(),
            value,
        }
    }

    /// A number with the given access rights.
    pub fn number(kind: Kind, access: Access, value: i64) -> Self {
        Self::new(kind, access, Value::Integer(kind.wrap(value)))
    }

    /// A number that only the device changes.
    pub fn read_only(kind: Kind, value: i64) -> Self {
        Self::number(kind, Access::ReadOnly, value)
    }

    /// A parameter.
    pub fn read_write(kind: Kind, value: i64) -> Self {
        Self::number(kind, Access::ReadWrite, value)
    }

    /// A number that nobody changes.
    pub fn constant(kind: Kind, value: i64) -> Self {
        Self::number(kind, Access::Constant, value)
    }

    /// A string that nobody changes.
    pub fn text(text: &str) -> Self {
        let bytes = Value::Bytes(text.as_bytes().to_vec());
        Self::new(Kind::Text, Access::Constant, bytes)
    }

    /// Bytes of any meaning, at most `max`.
    pub fn octets(access: Access, max: usize, bytes: Vec<u8>) -> Self {
        Self::new(Kind::Octets { max }, access, Value::Bytes(bytes))
    }

    /// The same entry, mappable.
    #[must_use]
    pub fn mapped(mut self, mapping: Mapping) -> Self {
        self.mapping = mapping;
        self
    }

    /// The same entry, taking only some numbers.
    #[must_use]
    pub fn bounded(mut self, bounds: Bounds) -> Self {
        self.bounds = bounds;
        self
    }

    fn bytes(&self) -> Vec<u8> {
        match (&self.value, self.kind.bytes()) {
            (Value::Integer(number), Some(length)) => number.to_le_bytes()[..length].to_vec(),
            (Value::Integer(_), None) => Vec::new(),
            (Value::Bytes(bytes), _) => bytes.clone(),
        }
    }

    fn parse(&self, data: &[u8]) -> Result<Value, AbortCode> {
        if let Some(code) = self.kind.length_error(data.len()) {
            return Err(code);
        }
        if self.kind.bytes().is_none() {
            return Ok(Value::Bytes(data.to_vec()));
        }
        let mut raw = [0; 8];
        raw[..data.len()].copy_from_slice(data);
        let number = self.kind.wrap(i64::from_le_bytes(raw));
        self.bounds.check(number)?;
        Ok(Value::Integer(number))
    }
}

/// Index and sub-index of an entry, in the order of the dictionary.
type Key = (u16, u8);

/// All entries of a device, in the order of their keys.
#[derive(Clone, Debug, Default)]
pub struct Dictionary {
    entries: Vec<(Key, Entry)>,
    places: Places,
}

/// Where each entry lies: a device looks up dozens of its own at every frame. An open table, at
/// most half of it in use; a slot holds a place plus one, or 0.
#[derive(Clone, Debug, Default)]
struct Places {
    slots: Vec<u16>,
}

impl Places {
    fn of(entries: &[(Key, Entry)]) -> Self {
        let mut places = Self {
            slots: vec![0; (2 * entries.len()).next_power_of_two()],
        };
        for (place, (key, _)) in (1..).zip(entries) {
            let mut slot = places.first_slot(*key);
            while places.slots[slot] != 0 {
                slot = places.next_slot(slot);
            }
            places.slots[slot] = place;
        }
        places
    }

    fn find(&self, key: Key, entries: &[(Key, Entry)]) -> Option<usize> {
        if self.slots.is_empty() {
            return None;
        }
        let mut slot = self.first_slot(key);
        loop {
            let place = usize::from(self.slots[slot]).checked_sub(1)?;
            if entries[place].0 == key {
                return Some(place);
            }
            slot = self.next_slot(slot);
        }
    }

    /// Multiplicative hashing (D. E. Knuth, The Art of Computer Programming 3, 6.4).
    fn first_slot(&self, (index, sub): Key) -> usize {
        let key = u32::from(index) << 8 | u32::from(sub);
        (key.wrapping_mul(0x9E37_79B1) >> 16) as usize & (self.slots.len() - 1)
    }

    fn next_slot(&self, slot: usize) -> usize {
        (slot + 1) & (self.slots.len() - 1)
    }
}

impl Dictionary {
    /// Adds or replaces the entry at `index` and `sub`.
    pub fn insert(&mut self, index: u16, sub: u8, entry: Entry) {
        let key = (index, sub);
        match self.entries.binary_search_by_key(&key, |(key, _)| *key) {
            Ok(place) => self.entries[place].1 = entry,
            Err(place) => {
                self.entries.insert(place, (key, entry));
                self.places = Places::of(&self.entries);
            }
        }
    }

    fn get(&self, key: Key) -> Option<&Entry> {
        let place = self.places.find(key, &self.entries)?;
        Some(&self.entries[place].1)
    }

    fn get_mut(&mut self, key: Key) -> Option<&mut Entry> {
        let place = self.places.find(key, &self.entries)?;
        Some(&mut self.entries[place].1)
    }

    /// Adds a record or array: sub-index 0 says how many entries follow.
    pub fn insert_array(&mut self, index: u16, entries: Vec<Entry>) {
        self.insert(index, 0, Entry::constant(Kind::U8, entries.len() as i64));
        for (sub, entry) in (1..).zip(entries) {
            self.insert(index, sub, entry);
        }
    }

    /// Whether anything lives at `index` and `sub`.
    pub fn contains(&self, object: Object) -> bool {
        self.get((object.index, object.sub)).is_some()
    }

    /// The number at `index` and `sub`.
    ///
    /// # Panics
    /// When there is none: a device asks only for objects it inserted itself.
    pub fn integer(&self, index: u16, sub: u8) -> i64 {
        let value = self.get((index, sub)).map(|entry| &entry.value);
        let Some(Value::Integer(number)) = value else {
            panic!("the device has no number {}", Object::new(index, sub));
        };
        *number
    }

    /// Changes the number at `index` and `sub` whatever a master may do there; it wraps to its
    /// type.
    ///
    /// # Panics
    /// When there is no such entry: a device sets only objects it inserted itself.
    pub fn set_integer(&mut self, index: u16, sub: u8, value: i64) {
        let entry = self.get_mut((index, sub));
        let entry = entry.unwrap_or_else(|| panic!("no object {}", Object::new(index, sub)));
        let value = entry.kind.wrap(value);
        match &mut entry.value {
            Value::Integer(present) => *present = value,
            present @ Value::Bytes(_) => *present = Value::Integer(value),
        }
    }

    /// Makes `value` the factory, the power-on and the present value of a number.
    pub fn set_factory(&mut self, index: u16, sub: u8, value: i64) {
        self.set_integer(index, sub, value);
        if let Some(entry) = self.get_mut((index, sub)) {
            entry.factory = entry.value.clone();
            entry.power_on = entry.value.clone();
        }
    }

    fn entry(&self, object: Object) -> Result<&Entry, AbortCode> {
        let Object { index, sub } = object;
        self.get((index, sub)).ok_or_else(|| {
            if self.entries.iter().any(|(key, _)| key.0 == index) {
                AbortCode::NoSuchSubIndex
            } else {
                AbortCode::NoSuchObject
            }
        })
    }

    /// What an SDO upload reads.
    ///
    /// # Errors
    /// No such object or sub-index, write only.
    pub fn read(&self, object: Object) -> Result<Vec<u8>, AbortCode> {
        let entry = self.entry(object)?;
        match entry.access {
            Access::WriteOnly => Err(AbortCode::WriteOnly),
            Access::Constant | Access::ReadOnly | Access::ReadWrite => Ok(entry.bytes()),
        }
    }

    /// Whether a download of `size` bytes may begin.
    ///
    /// # Errors
    /// No such object or sub-index, read only, wrong length.
    pub fn check_download(&self, object: Object, size: Option<usize>) -> Result<(), AbortCode> {
        let entry = self.entry(object)?;
        if matches!(entry.access, Access::Constant | Access::ReadOnly) {
            return Err(AbortCode::ReadOnly);
        }
        let wrong = size.and_then(|size| entry.kind.length_error(size));
        wrong.map_or(Ok(()), Err)
    }

    /// What an SDO download of `data` would write.
    ///
    /// # Errors
    /// As [`Dictionary::check_download`], and numbers out of bounds.
    pub fn check_value(&self, object: Object, data: &[u8]) -> Result<Value, AbortCode> {
        self.check_download(object, Some(data.len()))?;
        self.entry(object)?.parse(data)
    }

    /// The present value at `object`; the number 0 where there is none.
    pub fn value(&self, object: Object) -> Value {
        let entry = self.get((object.index, object.sub));
        entry.map_or(Value::Integer(0), |entry| entry.value.clone())
    }

    /// Takes a value that [`Dictionary::check_value`] gave.
    pub fn put(&mut self, object: Object, value: Value) {
        if let Some(entry) = self.get_mut((object.index, object.sub)) {
            entry.value = value;
        }
    }

    /// The length in bytes of the entry at `object`, `None` where there is none or it varies.
    pub fn length(&self, object: Object) -> Option<usize> {
        self.entry(object).ok()?.kind.bytes()
    }

    /// Whether `object` may stand in a PDO of this direction with this many bits.
    ///
    /// # Errors
    /// No such object or sub-index; not mappable, or not with this length (0x06040041).
    pub fn check_mapping(&self, object: Object, bits: u8, transmit: bool) -> Result<(), AbortCode> {
        let entry = self.entry(object)?;
        let direction = match entry.mapping {
            Mapping::Both => true,
            Mapping::Transmit => transmit,
            Mapping::Receive => !transmit,
            Mapping::Never => false,
        };
        let fits = entry.kind.bytes().map(|bytes| bytes * 8) == Some(usize::from(bits));
        if direction && fits {
            Ok(())
        } else {
            Err(AbortCode::NotMappable)
        }
    }

    /// 0x1010: the present parameters become the power-on values.
    pub fn store(&mut self) {
        for (_, entry) in &mut self.entries {
            if entry.access == Access::ReadWrite {
                entry.power_on = entry.value.clone();
            }
        }
    }

    /// 0x1011: the factory values become the power-on values; the next reset makes them valid.
    pub fn restore_factory(&mut self) {
        for (_, entry) in &mut self.entries {
            entry.power_on = entry.factory.clone();
        }
    }

    /// All entries take their power-on values (power-on, NMT "reset node").
    pub fn reset_all(&mut self) {
        for (_, entry) in &mut self.entries {
            entry.value = entry.power_on.clone();
        }
    }

    /// The communication profile area takes its power-on values (NMT "reset communication").
    pub fn reset_communication(&mut self) {
        let communication = 0x1000..0x2000;
        for ((index, _), entry) in &mut self.entries {
            if communication.contains(index) {
                entry.value = entry.power_on.clone();
            }
        }
    }
}
