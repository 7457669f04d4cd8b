//! Thrift's compact protocol (thrift.apache.org, "Thrift Compact protocol encoding"), as far as the metadata of a Parquet
//! file need it: structs of integers, texts, lists and structs.

/// The types of fields and of the items of lists.
const I32: u8 = 5;
const I64: u8 = 6;
const BINARY: u8 = 8;
const LIST: u8 = 9;
const STRUCT: u8 = 12;
/// So many items have their count in the head of a list.
const SHORT: usize = 15;

/// A struct that is being written; its fields come in the order of their numbers.
#[derive(Default)]
pub(super) struct Struct {
    bytes: Vec<u8>,
    last: u8,
}

impl Struct {
    /// Whole, with its end.
    pub(super) fn end(mut self) -> Vec<u8> {
        self.bytes.push(0);
        self.bytes
    }

    fn field(&mut self, number: u8, of: u8) {
        // The next field is never far.
        self.bytes.push(((number - self.last) << 4) | of);
        self.last = number;
    }

    pub(super) fn i32(mut self, number: u8, value: i32) -> Self {
        self.field(number, I32);
        varint(&mut self.bytes, zigzag(value.into()));
        self
    }

    pub(super) fn i64(mut self, number: u8, value: i64) -> Self {
        self.field(number, I64);
        varint(&mut self.bytes, zigzag(value));
        self
    }

    pub(super) fn text(mut self, number: u8, value: &str) -> Self {
        self.field(number, BINARY);
        text(&mut self.bytes, value);
        self
    }

    pub(super) fn inner(mut self, number: u8, value: Self) -> Self {
        self.field(number, STRUCT);
        self.bytes.extend(value.end());
        self
    }

    pub(super) fn structs(mut self, number: u8, values: Vec<Self>) -> Self {
        self.field(number, LIST);
        list(&mut self.bytes, STRUCT, values.len());
        for value in values {
            self.bytes.extend(value.end());
        }
        self
    }

    pub(super) fn i32s(mut self, number: u8, values: &[i32]) -> Self {
        self.field(number, LIST);
        list(&mut self.bytes, I32, values.len());
        for value in values {
            varint(&mut self.bytes, zigzag((*value).into()));
        }
        self
    }

    pub(super) fn texts(mut self, number: u8, values: &[&str]) -> Self {
        self.field(number, LIST);
        list(&mut self.bytes, BINARY, values.len());
        for value in values {
            text(&mut self.bytes, value);
        }
        self
    }
}

fn list(bytes: &mut Vec<u8>, of: u8, count: usize) {
    if count < SHORT {
        bytes.push(((count as u8) << 4) | of);
    } else {
        bytes.push(0xF0 | of);
        varint(bytes, count as u64);
    }
}

fn text(bytes: &mut Vec<u8>, value: &str) {
    varint(bytes, value.len() as u64);
    bytes.extend(value.as_bytes());
}

/// Small numbers are short, whatever their sign.
const fn zigzag(value: i64) -> u64 {
    ((value << 1) ^ (value >> 63)) as u64
}

/// Seven bits at a time, the lowest first.
pub(super) fn varint(bytes: &mut Vec<u8>, mut value: u64) {
    while value >= 0x80 {
        bytes.push(value as u8 | 0x80);
        value >>= 7;
    }
    bytes.push(value as u8);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_are_written_as_the_protocol_has_them() {
        let inner = Struct::default().i32(1, 1);
        let whole = Struct::default()
            .i32(1, -1)
            .i64(3, 300)
            .text(4, "ab")
            .inner(5, inner)
            .i32s(6, &[0, 2]);
        // Field 1, i32: −1 is 1; field 3, i64: 600 in two bytes; a text; a struct; a list of two.
        let expected = [
            0x15, 0x01, 0x26, 0xD8, 0x04, 0x18, 0x02, b'a', b'b', 0x1C, 0x15, 0x02, 0x00, 0x19,
            0x25, 0x00, 0x04, 0x00,
        ];
        assert_eq!(whole.end(), expected);
    }

    #[test]
    fn a_long_list_has_its_count_behind_its_head() {
        let list = Struct::default().i32s(2, &[0; 200]).end();
        assert_eq!(list[..4], [0x29, 0xF5, 0xC8, 0x01]);
        assert_eq!(list.len(), 4 + 200 + 1);
    }
}
