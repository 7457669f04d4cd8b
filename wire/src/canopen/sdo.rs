//! Service data objects: expedited, segmented and block transfer (CiA 301, 7.2.4).
//!
//! A request is what the client sends, a response what the server sends. The segments of a
//! block carry no command specifier, so whoever is in a block phase reads them as
//! [`BlockSegment`]; everything else has one meaning by its first byte alone.

use super::{Object, WireError};

pub use super::sdo_abort::AbortCode;

/// The most bytes one segment carries.
pub const SEGMENT_BYTES: usize = 7;
/// The most segments a block may have.
pub const BLOCK_SIZE_MAX: u8 = 127;

/// Up to four bytes of expedited data.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Expedited {
    bytes: [u8; 4],
    len: u8,
    size_indicated: bool,
}

impl Expedited {
    /// `None` when `data` is empty or has more than 4 bytes.
    pub fn new(data: &[u8]) -> Option<Self> {
        if data.is_empty() || data.len() > 4 {
            return None;
        }
        let mut bytes = [0; 4];
        bytes[..data.len()].copy_from_slice(data);
        Some(Self {
            bytes,
            len: data.len() as u8,
            size_indicated: true,
        })
    }

    /// The data; four bytes when the sender did not indicate their number.
    pub fn data(&self) -> &[u8] {
        &self.bytes[..usize::from(self.len)]
    }

    /// Whether the sender said how many bytes are meant.
    pub const fn size_indicated(&self) -> bool {
        self.size_indicated
    }

    fn parse(command: u8, bytes: [u8; 4]) -> Self {
        let size_indicated = command & 0x01 != 0;
        let unused = if size_indicated {
            command >> 2 & 0x03
        } else {
            0
        };
        Self {
            bytes,
            len: 4 - unused,
            size_indicated,
        }
    }

    const fn flags(&self) -> u8 {
        0x02 | if self.size_indicated {
            (4 - self.len) << 2 | 0x01
        } else {
            0
        }
    }
}

/// Data of one ordinary segment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Segment {
    /// Alternates from segment to segment, starting with `false`.
    pub toggle: bool,
    /// Whether no segment follows.
    pub last: bool,
    bytes: [u8; 7],
    len: u8,
}

impl Segment {
    /// `None` when `data` has more than 7 bytes.
    pub fn new(toggle: bool, last: bool, data: &[u8]) -> Option<Self> {
        let mut bytes = [0; 7];
        bytes.get_mut(..data.len())?.copy_from_slice(data);
        Some(Self {
            toggle,
            last,
            bytes,
            len: data.len() as u8,
        })
    }

    /// The data, 0 to 7 bytes.
    pub fn data(&self) -> &[u8] {
        &self.bytes[..usize::from(self.len)]
    }

    fn parse(payload: &[u8; 8]) -> Self {
        let [command, bytes @ ..] = *payload;
        let len = 7 - (command >> 1 & 0x07);
        Self {
            toggle: command & 0x10 != 0,
            last: command & 0x01 != 0,
            bytes,
            len,
        }
    }

    fn emit(&self, specifier: u8) -> [u8; 8] {
        let toggle = u8::from(self.toggle) << 4;
        let command = specifier | toggle | (7 - self.len) << 1 | u8::from(self.last);
        let mut payload = [command; 8];
        payload[1..].copy_from_slice(&self.bytes);
        payload
    }
}

/// One segment of a block: 7 bytes always, the end message says how many of the last count.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BlockSegment {
    /// 1 to 127, restarting with each block.
    pub sequence: u8,
    /// Whether this is the transfer's last segment.
    pub last: bool,
    /// The data.
    pub data: [u8; 7],
}

impl BlockSegment {
    /// The payload on the wire.
    pub fn emit(&self) -> [u8; 8] {
        let mut payload = [self.sequence & 0x7F | u8::from(self.last) << 7; 8];
        payload[1..].copy_from_slice(&self.data);
        payload
    }

    /// From the payload on the wire.
    ///
    /// # Errors
    /// When the length is not 8.
    pub fn parse(payload: &[u8]) -> Result<Self, WireError> {
        let [head, data @ ..] = eight(payload, "SDO block segment")?;
        Ok(Self {
            sequence: head & 0x7F,
            last: head & 0x80 != 0,
            data,
        })
    }
}

/// What the client sends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(
    missing_docs,
    reason = "the fields are the standard's: object, size, toggle, crc"
)]
pub enum SdoRequest {
    /// Read an object.
    UploadInitiate { object: Object },
    /// Read its next segment.
    UploadSegment { toggle: bool },
    /// Write up to 4 bytes at once.
    DownloadExpedited { object: Object, data: Expedited },
    /// Announce a segmented write.
    DownloadInitiate { object: Object, size: Option<u32> },
    /// Write the next segment.
    DownloadSegment(Segment),
    /// Announce a block write.
    BlockDownloadInitiate {
        object: Object,
        size: Option<u32>,
        crc: bool,
    },
    /// End a block write; `unused` bytes of the last segment do not count.
    BlockDownloadEnd { unused: u8, crc: u16 },
    /// Ask for a block read with blocks of `block_size` segments.
    BlockUploadInitiate {
        object: Object,
        block_size: u8,
        protocol_switch: u8,
        crc: bool,
    },
    /// Start the first block.
    BlockUploadStart,
    /// Confirm segments up to `sequence`; ask for `block_size` more.
    BlockUploadAcknowledge { sequence: u8, block_size: u8 },
    /// Confirm the end of a block read.
    BlockUploadEndConfirm,
    /// Give up.
    Abort { object: Object, code: AbortCode },
}

/// What the server sends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(
    missing_docs,
    reason = "the fields are the standard's: object, size, toggle, crc"
)]
pub enum SdoResponse {
    /// The whole value, up to 4 bytes.
    UploadExpedited { object: Object, data: Expedited },
    /// A segmented read starts.
    UploadInitiate { object: Object, size: Option<u32> },
    /// The next segment of a read.
    UploadSegment(Segment),
    /// A write was started or, expedited, done.
    DownloadInitiate { object: Object },
    /// A written segment was taken.
    DownloadSegment { toggle: bool },
    /// A block write may start with blocks of `block_size` segments.
    BlockDownloadInitiate {
        object: Object,
        block_size: u8,
        crc: bool,
    },
    /// Segments up to `sequence` were taken.
    BlockDownloadAcknowledge { sequence: u8, block_size: u8 },
    /// The block write is done.
    BlockDownloadEndConfirm,
    /// A block read starts.
    BlockUploadInitiate {
        object: Object,
        size: Option<u32>,
        crc: bool,
    },
    /// The block read ends; `unused` bytes of the last segment do not count.
    BlockUploadEnd { unused: u8, crc: u16 },
    /// The server gives up.
    Abort { object: Object, code: AbortCode },
}

fn eight(payload: &[u8], message: &'static str) -> Result<[u8; 8], WireError> {
    let seen = payload.len();
    <[u8; 8]>::try_from(payload).map_err(|_| WireError::Length {
        message,
        expected: 8,
        seen,
    })
}

fn object_of(payload: &[u8; 8]) -> Object {
    Object::new(u16::from_le_bytes([payload[1], payload[2]]), payload[3])
}

const fn tail(payload: &[u8; 8]) -> [u8; 4] {
    [payload[4], payload[5], payload[6], payload[7]]
}

fn with_object(command: u8, object: Object, tail: [u8; 4]) -> [u8; 8] {
    let [low, high] = object.index.to_le_bytes();
    let [a, b, c, d] = tail;
    [command, low, high, object.sub, a, b, c, d]
}

const fn plain(command: u8, first: u8, second: u8) -> [u8; 8] {
    [command, first, second, 0, 0, 0, 0, 0]
}

fn end_of_block(command: u8, unused: u8, crc: u16) -> [u8; 8] {
    let [low, high] = crc.to_le_bytes();
    plain(command | (unused & 0x07) << 2, low, high)
}

fn optional_size(size: Option<u32>) -> [u8; 4] {
    size.unwrap_or(0).to_le_bytes()
}

impl SdoRequest {
    /// The payload on the wire.
    pub fn emit(&self) -> [u8; 8] {
        match *self {
            Self::UploadInitiate { object } => with_object(0x40, object, [0; 4]),
            Self::UploadSegment { toggle } => plain(0x60 | u8::from(toggle) << 4, 0, 0),
            Self::DownloadExpedited { object, data } => {
                with_object(0x20 | data.flags(), object, data.bytes)
            }
            Self::DownloadInitiate { object, size } => {
                with_object(0x20 | u8::from(size.is_some()), object, optional_size(size))
            }
            Self::DownloadSegment(segment) => segment.emit(0x00),
            Self::BlockDownloadInitiate { object, size, crc } => {
                let command = 0xC0 | u8::from(crc) << 2 | u8::from(size.is_some()) << 1;
                with_object(command, object, optional_size(size))
            }
            Self::BlockDownloadEnd { unused, crc } => end_of_block(0xC1, unused, crc),
            Self::BlockUploadInitiate {
                object,
                block_size,
                protocol_switch,
                crc,
            } => {
                let command = 0xA0 | u8::from(crc) << 2;
                with_object(command, object, [block_size, protocol_switch, 0, 0])
            }
            Self::BlockUploadStart => plain(0xA3, 0, 0),
            Self::BlockUploadAcknowledge {
                sequence,
                block_size,
            } => plain(0xA2, sequence, block_size),
            Self::BlockUploadEndConfirm => plain(0xA1, 0, 0),
            Self::Abort { object, code } => with_object(0x80, object, code.raw().to_le_bytes()),
        }
    }

    /// From the payload on the wire.
    ///
    /// # Errors
    /// When the length is not 8 or the command specifier is no client's.
    pub fn parse(payload: &[u8]) -> Result<Self, WireError> {
        const MESSAGE: &str = "SDO request";
        let payload = eight(payload, MESSAGE)?;
        let command = payload[0];
        let object = object_of(&payload);
        let size = u32::from_le_bytes(tail(&payload));
        Ok(match command >> 5 {
            0 => Self::DownloadSegment(Segment::parse(&payload)),
            1 if command & 0x02 != 0 => Self::DownloadExpedited {
                object,
                data: Expedited::parse(command, tail(&payload)),
            },
            1 => Self::DownloadInitiate {
                object,
                size: (command & 0x01 != 0).then_some(size),
            },
            2 => Self::UploadInitiate { object },
            3 => Self::UploadSegment {
                toggle: command & 0x10 != 0,
            },
            4 => Self::Abort {
                object,
                code: AbortCode::from_raw(size),
            },
            5 => match command & 0x03 {
                0 => Self::BlockUploadInitiate {
                    object,
                    block_size: payload[4],
                    protocol_switch: payload[5],
                    crc: command & 0x04 != 0,
                },
                1 => Self::BlockUploadEndConfirm,
                2 => Self::BlockUploadAcknowledge {
                    sequence: payload[1],
                    block_size: payload[2],
                },
                _ => Self::BlockUploadStart,
            },
            6 if command & 0x01 == 0 => Self::BlockDownloadInitiate {
                object,
                size: (command & 0x02 != 0).then_some(size),
                crc: command & 0x04 != 0,
            },
            6 => Self::BlockDownloadEnd {
                unused: command >> 2 & 0x07,
                crc: u16::from_le_bytes([payload[1], payload[2]]),
            },
            _ => {
                return Err(WireError::Command {
                    message: MESSAGE,
                    seen: command,
                });
            }
        })
    }
}

impl SdoResponse {
    /// The payload on the wire.
    pub fn emit(&self) -> [u8; 8] {
        match *self {
            Self::UploadExpedited { object, data } => {
                with_object(0x40 | data.flags(), object, data.bytes)
            }
            Self::UploadInitiate { object, size } => {
                with_object(0x40 | u8::from(size.is_some()), object, optional_size(size))
            }
            Self::UploadSegment(segment) => segment.emit(0x00),
            Self::DownloadInitiate { object } => with_object(0x60, object, [0; 4]),
            Self::DownloadSegment { toggle } => plain(0x20 | u8::from(toggle) << 4, 0, 0),
            Self::BlockDownloadInitiate {
                object,
                block_size,
                crc,
            } => with_object(0xA0 | u8::from(crc) << 2, object, [block_size, 0, 0, 0]),
            Self::BlockDownloadAcknowledge {
                sequence,
                block_size,
            } => plain(0xA2, sequence, block_size),
            Self::BlockDownloadEndConfirm => plain(0xA1, 0, 0),
            Self::BlockUploadInitiate { object, size, crc } => {
                let command = 0xC0 | u8::from(crc) << 2 | u8::from(size.is_some()) << 1;
                with_object(command, object, optional_size(size))
            }
            Self::BlockUploadEnd { unused, crc } => end_of_block(0xC1, unused, crc),
            Self::Abort { object, code } => with_object(0x80, object, code.raw().to_le_bytes()),
        }
    }

    /// From the payload on the wire.
    ///
    /// # Errors
    /// When the length is not 8 or the command specifier is no server's.
    pub fn parse(payload: &[u8]) -> Result<Self, WireError> {
        const MESSAGE: &str = "SDO response";
        let payload = eight(payload, MESSAGE)?;
        let command = payload[0];
        let object = object_of(&payload);
        let size = u32::from_le_bytes(tail(&payload));
        Ok(match command >> 5 {
            0 => Self::UploadSegment(Segment::parse(&payload)),
            1 => Self::DownloadSegment {
                toggle: command & 0x10 != 0,
            },
            2 if command & 0x02 != 0 => Self::UploadExpedited {
                object,
                data: Expedited::parse(command, tail(&payload)),
            },
            2 => Self::UploadInitiate {
                object,
                size: (command & 0x01 != 0).then_some(size),
            },
            3 => Self::DownloadInitiate { object },
            4 => Self::Abort {
                object,
                code: AbortCode::from_raw(size),
            },
            5 => match command & 0x03 {
                0 => Self::BlockDownloadInitiate {
                    object,
                    block_size: payload[4],
                    crc: command & 0x04 != 0,
                },
                1 => Self::BlockDownloadEndConfirm,
                2 => Self::BlockDownloadAcknowledge {
                    sequence: payload[1],
                    block_size: payload[2],
                },
                _ => {
                    return Err(WireError::Command {
                        message: MESSAGE,
                        seen: command,
                    });
                }
            },
            6 if command & 0x01 == 0 => Self::BlockUploadInitiate {
                object,
                size: (command & 0x02 != 0).then_some(size),
                crc: command & 0x04 != 0,
            },
            6 => Self::BlockUploadEnd {
                unused: command >> 2 & 0x07,
                crc: u16::from_le_bytes([payload[1], payload[2]]),
            },
            _ => {
                return Err(WireError::Command {
                    message: MESSAGE,
                    seen: command,
                });
            }
        })
    }

    /// The object this response names, where its kind names one.
    pub const fn object(&self) -> Option<Object> {
        match *self {
            Self::UploadExpedited { object, .. }
            | Self::UploadInitiate { object, .. }
            | Self::DownloadInitiate { object }
            | Self::BlockDownloadInitiate { object, .. }
            | Self::BlockUploadInitiate { object, .. }
            | Self::Abort { object, .. } => Some(object),
            Self::UploadSegment(_)
            | Self::DownloadSegment { .. }
            | Self::BlockDownloadAcknowledge { .. }
            | Self::BlockDownloadEndConfirm
            | Self::BlockUploadEnd { .. } => None,
        }
    }
}

/// The checksum of a block transfer: CRC-16/XMODEM over the data (CiA 301, 7.2.4.3.16).
///
/// ```
/// assert_eq!(wire::canopen::sdo::block_crc(b"123456789"), 0x31C3, "XMODEM's check value");
/// ```
pub fn block_crc(data: &[u8]) -> u16 {
    data.iter().fold(0, |crc, byte| {
        (0..8).fold(crc ^ u16::from(*byte) << 8, |crc, _| {
            if crc & 0x8000 != 0 {
                crc << 1 ^ 0x1021
            } else {
                crc << 1
            }
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const DEVICE_TYPE: Object = Object::new(0x1000, 0);

    #[track_caller]
    fn check_request(request: SdoRequest, bytes: [u8; 8]) {
        assert_eq!(request.emit(), bytes);
        assert_eq!(SdoRequest::parse(&bytes), Ok(request));
    }

    #[track_caller]
    fn check_response(response: SdoResponse, bytes: [u8; 8]) {
        assert_eq!(response.emit(), bytes);
        assert_eq!(SdoResponse::parse(&bytes), Ok(response));
    }

    #[test]
    fn expedited_transfers_have_the_standards_bytes() {
        let mode = Object::new(0x6060, 0);
        let data = Expedited::new(&[1]).unwrap();
        check_request(
            SdoRequest::DownloadExpedited { object: mode, data },
            [0x2F, 0x60, 0x60, 0, 1, 0, 0, 0],
        );
        let data = Expedited::new(&0x0002_0192_u32.to_le_bytes()).unwrap();
        check_response(
            SdoResponse::UploadExpedited {
                object: DEVICE_TYPE,
                data,
            },
            [0x43, 0x00, 0x10, 0, 0x92, 0x01, 0x02, 0x00],
        );
        let object = DEVICE_TYPE;
        check_request(
            SdoRequest::UploadInitiate { object },
            [0x40, 0, 0x10, 0, 0, 0, 0, 0],
        );
        check_response(
            SdoResponse::DownloadInitiate { object },
            [0x60, 0, 0x10, 0, 0, 0, 0, 0],
        );
    }

    #[test]
    fn segmented_transfers_have_the_standards_bytes() {
        let name = Object::new(0x1008, 0);
        check_response(
            SdoResponse::UploadInitiate {
                object: name,
                size: Some(10),
            },
            [0x41, 0x08, 0x10, 0, 10, 0, 0, 0],
        );
        check_request(
            SdoRequest::UploadSegment { toggle: true },
            [0x70, 0, 0, 0, 0, 0, 0, 0],
        );
        let segment = Segment::new(true, true, b"xyz").unwrap();
        check_response(
            SdoResponse::UploadSegment(segment),
            [0x19, b'x', b'y', b'z', 0, 0, 0, 0],
        );
        check_response(
            SdoResponse::DownloadSegment { toggle: true },
            [0x30, 0, 0, 0, 0, 0, 0, 0],
        );
    }

    #[test]
    fn block_transfers_have_the_standards_bytes() {
        let object = Object::new(0x1F50, 1);
        check_request(
            SdoRequest::BlockDownloadInitiate {
                object,
                size: Some(300),
                crc: true,
            },
            [0xC6, 0x50, 0x1F, 1, 0x2C, 1, 0, 0],
        );
        check_response(
            SdoResponse::BlockDownloadInitiate {
                object,
                block_size: 127,
                crc: true,
            },
            [0xA4, 0x50, 0x1F, 1, 127, 0, 0, 0],
        );
        check_request(
            SdoRequest::BlockUploadInitiate {
                object,
                block_size: 127,
                protocol_switch: 0,
                crc: true,
            },
            [0xA4, 0x50, 0x1F, 1, 127, 0, 0, 0],
        );
        check_response(
            SdoResponse::BlockUploadEnd {
                unused: 3,
                crc: 0x1234,
            },
            [0xCD, 0x34, 0x12, 0, 0, 0, 0, 0],
        );
        check_request(SdoRequest::BlockUploadStart, [0xA3, 0, 0, 0, 0, 0, 0, 0]);
        let acknowledge = SdoRequest::BlockUploadAcknowledge {
            sequence: 5,
            block_size: 127,
        };
        check_request(acknowledge, [0xA2, 5, 127, 0, 0, 0, 0, 0]);
    }

    #[test]
    fn an_abort_names_object_and_reason() {
        let abort = SdoRequest::Abort {
            object: DEVICE_TYPE,
            code: AbortCode::TimedOut,
        };
        check_request(abort, [0x80, 0, 0x10, 0, 0, 0, 4, 5]);
        assert_eq!(AbortCode::from_raw(0x0602_0000), AbortCode::NoSuchObject);
        assert_eq!(AbortCode::from_raw(7).raw(), 7);
    }

    #[test]
    fn an_expedited_reply_without_size_has_four_bytes() {
        let reply = SdoResponse::parse(&[0x42, 0, 0x10, 0, 1, 2, 3, 4]).unwrap();
        let SdoResponse::UploadExpedited { data, .. } = reply else {
            panic!("{reply:?}")
        };
        assert_eq!(data.data(), [1, 2, 3, 4]);
        assert!(!data.size_indicated());
    }

    #[test]
    fn short_payloads_are_refused() {
        assert!(SdoResponse::parse(&[0x43, 0, 0x10]).is_err());
        assert!(BlockSegment::parse(&[1, 2]).is_err());
    }

    /// The catalogue's check value of CRC-16/XMODEM.
    #[test]
    fn the_block_checksum_is_xmodem() {
        assert_eq!(block_crc(b"123456789"), 0x31C3);
    }

    proptest! {
        #[test]
        fn what_parses_is_emitted_to_a_message_that_parses_the_same(bytes: [u8; 8]) {
            if let Ok(request) = SdoRequest::parse(&bytes) {
                prop_assert_eq!(SdoRequest::parse(&request.emit()), Ok(request));
            }
            if let Ok(response) = SdoResponse::parse(&bytes) {
                prop_assert_eq!(SdoResponse::parse(&response.emit()), Ok(response));
            }
        }
    }
}
