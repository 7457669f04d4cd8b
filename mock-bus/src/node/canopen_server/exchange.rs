//! What transfers ask of the dictionary and answer to the client.

use wire::canopen::Object;
use wire::canopen::sdo::{AbortCode, BlockSegment, SdoResponse};

/// What the server reads and writes.
pub(super) trait Objects {
    /// Bytes of the entry, `None` where there is none or its length varies.
    fn length(&self, object: Object) -> Option<usize>;
    fn read(&mut self, object: Object) -> Result<Vec<u8>, AbortCode>;
    fn check_download(&mut self, object: Object, size: Option<usize>) -> Result<(), AbortCode>;
    fn write(&mut self, object: Object, data: &[u8]) -> Result<(), AbortCode>;
}

/// What the server sends; segments of blocks have no command specifier.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Reply {
    Response(SdoResponse),
    Segment(BlockSegment),
}

/// An abort that ends a transfer, and the object it names.
pub(super) type Refusal = (Object, AbortCode);

/// Whether `received` bytes contradict the announced size.
pub(super) fn size_error(
    announced: Option<usize>,
    received: usize,
    complete: bool,
) -> Option<AbortCode> {
    let announced = announced?;
    if received > announced {
        Some(AbortCode::LengthTooHigh)
    } else {
        (complete && received < announced).then_some(AbortCode::LengthTooLow)
    }
}
