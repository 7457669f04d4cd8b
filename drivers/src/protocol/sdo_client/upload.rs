//! Reading: expedited and segmented (CiA 301, 7.2.4.3.5 and .6), block (7.2.4.3.13 to .15).

use super::verdict::{Oddity, Verdict};
use super::{Method, TRANSFER_BYTES_MAX};
use wire::canopen::Object;
use wire::canopen::sdo::{
    AbortCode, BLOCK_SIZE_MAX, BlockSegment, SEGMENT_BYTES, SdoRequest, SdoResponse, Segment,
    block_crc,
};

/// How often in a row the server may be asked to repeat without a new segment coming of it.
const REPEATS_WITHOUT_PROGRESS_MAX: u8 = 8;

#[derive(Debug)]
pub(super) enum Upload {
    Initiate,
    Segments(Segments),
    BlockInitiate,
    Block(Block),
    BlockEnd(Block),
}

#[derive(Debug)]
pub(super) struct Segments {
    size: Option<u32>,
    data: Vec<u8>,
    toggle: bool,
    previous: Option<Segment>,
}

#[derive(Debug)]
pub(super) struct Block {
    size: Option<u32>,
    crc: bool,
    data: Vec<u8>,
    /// The last segment of this sub-block that came in order.
    sequence: u8,
    /// No sub-block was acknowledged yet.
    first: bool,
    repeats: u8,
    /// The last payload taken, to recognise its repetition after the end.
    taken: [u8; 8],
}

impl Upload {
    pub(super) const fn begin(object: Object, method: Method) -> (Self, SdoRequest) {
        match method {
            Method::Auto => (Self::Initiate, SdoRequest::UploadInitiate { object }),
            Method::Block => (
                Self::BlockInitiate,
                SdoRequest::BlockUploadInitiate {
                    object,
                    block_size: BLOCK_SIZE_MAX,
                    protocol_switch: 0,
                    crc: true,
                },
            ),
        }
    }

    pub(super) const fn takes_block_segments(&self) -> bool {
        matches!(self, Self::Block(_))
    }

    pub(super) const fn initiates_block(&self) -> bool {
        matches!(self, Self::BlockInitiate)
    }

    pub(super) const fn awaited(&self) -> &'static str {
        match self {
            Self::Initiate => "answer to a read",
            Self::Segments(_) => "segment",
            Self::BlockInitiate => "answer to a block read",
            Self::Block(_) => "segment of a block",
            Self::BlockEnd(_) => "end of a block read",
        }
    }

    pub(super) fn handle(&mut self, payload: &[u8; 8], response: SdoResponse) -> Verdict {
        match (&mut *self, response) {
            // A server may answer a block read in the ordinary way (7.2.4.3.13).
            (Self::Initiate | Self::BlockInitiate, SdoResponse::UploadExpedited { data, .. }) => {
                Verdict::Done(data.data().to_vec())
            }
            (Self::Initiate | Self::BlockInitiate, SdoResponse::UploadInitiate { size, .. }) => {
                if too_big(size) {
                    return Verdict::Break(AbortCode::OutOfMemory);
                }
                *self = Self::Segments(Segments {
                    size,
                    data: Vec::new(),
                    toggle: false,
                    previous: None,
                });
                Verdict::Send(SdoRequest::UploadSegment { toggle: false })
            }
            (Self::Segments(segments), SdoResponse::UploadSegment(segment)) => {
                segments.take(segment)
            }
            (Self::BlockInitiate, SdoResponse::BlockUploadInitiate { size, crc, .. }) => {
                if too_big(size) {
                    return Verdict::Break(AbortCode::OutOfMemory);
                }
                *self = Self::Block(Block {
                    size,
                    crc,
                    data: Vec::new(),
                    sequence: 0,
                    first: true,
                    repeats: 0,
                    taken: *payload,
                });
                Verdict::Send(SdoRequest::BlockUploadStart)
            }
            (Self::BlockEnd(block), SdoResponse::BlockUploadEnd { unused, crc }) => {
                block.end(payload, unused, crc)
            }
            (
                Self::Initiate
                | Self::Segments(_)
                | Self::BlockInitiate
                | Self::Block(_)
                | Self::BlockEnd(_),
                _,
            ) => Verdict::Ignore(Oddity::Unexpected),
        }
    }

    pub(super) fn handle_block_segment(&mut self, payload: &[u8; 8]) -> Verdict {
        let (Self::Block(block), Ok(segment)) = (&mut *self, BlockSegment::parse(payload)) else {
            return Verdict::Ignore(Oddity::Unexpected);
        };
        let (verdict, ended) = block.take(payload, segment);
        if ended && let Self::Block(block) = core::mem::replace(self, Self::BlockInitiate) {
            *self = Self::BlockEnd(block);
        }
        verdict
    }

    /// Silence within a block: confirm what came, so that the server repeats the rest.
    ///
    /// Only while it is certain that the server had our last message: when segments of this
    /// sub-block came, or none of any. Otherwise "0 segments" would be taken for an answer to
    /// the wrong sub-block.
    pub(super) fn stall(&mut self) -> Option<SdoRequest> {
        let Self::Block(block) = self else {
            return None;
        };
        if block.sequence == 0 && !block.first || block.repeats >= REPEATS_WITHOUT_PROGRESS_MAX {
            return None;
        }
        block.repeats += 1;
        Some(block.acknowledge())
    }
}

impl Segments {
    fn take(&mut self, segment: Segment) -> Verdict {
        if segment.toggle != self.toggle {
            return if self.previous == Some(segment) {
                Verdict::Ignore(Oddity::Duplicated)
            } else {
                Verdict::Break(AbortCode::ToggleNotAlternated)
            };
        }
        self.data.extend_from_slice(segment.data());
        self.previous = Some(segment);
        self.toggle = !self.toggle;
        if let Some(code) = too_long(&self.data, self.size) {
            return Verdict::Break(code);
        }
        if !segment.last {
            return Verdict::Send(SdoRequest::UploadSegment {
                toggle: self.toggle,
            });
        }
        if self
            .size
            .is_some_and(|size| self.data.len() < size as usize)
        {
            return Verdict::Break(AbortCode::LengthTooLow);
        }
        Verdict::Done(core::mem::take(&mut self.data))
    }
}

impl Block {
    fn take(&mut self, payload: &[u8; 8], segment: BlockSegment) -> (Verdict, bool) {
        if segment.sequence == 0 {
            return (Verdict::Ignore(Oddity::Unexpected), false);
        }
        if segment.sequence <= self.sequence || *payload == self.taken {
            return (Verdict::Ignore(Oddity::Duplicated), false);
        }
        let in_order = segment.sequence == self.sequence + 1;
        if in_order {
            self.data.extend_from_slice(&segment.data);
            self.sequence = segment.sequence;
            self.repeats = 0;
            self.taken = *payload;
            // The last segment may be padded with up to 7 bytes.
            let certain = self.data.len().saturating_sub(SEGMENT_BYTES);
            if let Some(code) = too_long(&self.data[..certain], self.size) {
                return (Verdict::Break(code), false);
            }
        }
        if !segment.last && segment.sequence != BLOCK_SIZE_MAX {
            return (Verdict::Wait, false);
        }
        if !in_order {
            if self.repeats >= REPEATS_WITHOUT_PROGRESS_MAX {
                return (Verdict::Break(AbortCode::InvalidSequence), false);
            }
            self.repeats += 1;
        }
        let acknowledge = self.acknowledge();
        (Verdict::Send(acknowledge), in_order && segment.last)
    }

    const fn acknowledge(&mut self) -> SdoRequest {
        let sequence = self.sequence;
        if sequence > 0 {
            self.first = false;
        }
        self.sequence = 0;
        SdoRequest::BlockUploadAcknowledge {
            sequence,
            block_size: BLOCK_SIZE_MAX,
        }
    }

    fn end(&mut self, payload: &[u8; 8], unused: u8, crc: u16) -> Verdict {
        // A repeated last segment with sequence 65, 69, ... looks like an end message.
        if *payload == self.taken {
            return Verdict::Ignore(Oddity::Duplicated);
        }
        let Some(len) = self.data.len().checked_sub(usize::from(unused)) else {
            return Verdict::Break(AbortCode::LengthMismatch);
        };
        self.data.truncate(len);
        if let Some(code) = too_long(&self.data, self.size) {
            return Verdict::Break(code);
        }
        if self.size.is_some_and(|size| len < size as usize) {
            return Verdict::Break(AbortCode::LengthTooLow);
        }
        if self.crc && block_crc(&self.data) != crc {
            return Verdict::Break(AbortCode::CrcMismatch);
        }
        let data = core::mem::take(&mut self.data);
        Verdict::DoneAfter(SdoRequest::BlockUploadEndConfirm, data)
    }
}

fn too_big(size: Option<u32>) -> bool {
    size.is_some_and(|size| size as usize > TRANSFER_BYTES_MAX)
}

fn too_long(data: &[u8], size: Option<u32>) -> Option<AbortCode> {
    if size.is_some_and(|size| data.len() > size as usize) {
        Some(AbortCode::LengthTooHigh)
    } else if data.len() > TRANSFER_BYTES_MAX {
        Some(AbortCode::OutOfMemory)
    } else {
        None
    }
}
