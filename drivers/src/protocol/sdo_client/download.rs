//! Writing: expedited and segmented (CiA 301, 7.2.4.3.3 and .4), block (7.2.4.3.9 to .12).

use super::Method;
use super::verdict::{Oddity, Verdict};
use wire::canopen::Object;
use wire::canopen::sdo::{
    AbortCode, BLOCK_SIZE_MAX, BlockSegment, Expedited, SEGMENT_BYTES, SdoRequest, SdoResponse,
    Segment, block_crc,
};

/// How often in a row the server may take not a single segment of a sub-block.
const REPEATS_WITHOUT_PROGRESS_MAX: u8 = 8;

#[derive(Debug)]
pub(super) enum Download {
    Expedited,
    Initiate {
        data: Vec<u8>,
    },
    Segments {
        data: Vec<u8>,
        sent: usize,
        toggle: bool,
    },
    BlockInitiate {
        data: Vec<u8>,
    },
    Block(Block),
    BlockEnd,
}

#[derive(Debug)]
pub(super) struct Block {
    data: Vec<u8>,
    crc: bool,
    /// Bytes the server confirmed.
    confirmed: usize,
    /// Segments of the present sub-block: how many there are, how many went out.
    planned: u8,
    sent: u8,
    repeats: u8,
    acknowledged: Option<[u8; 8]>,
}

fn size_of(data: &[u8]) -> Option<u32> {
    u32::try_from(data.len()).ok()
}

impl Download {
    pub(super) fn begin(object: Object, data: &[u8], method: Method) -> (Self, SdoRequest) {
        let size = size_of(data);
        let owned = data.to_vec();
        match (method, Expedited::new(data)) {
            (Method::Auto, Some(data)) => (
                Self::Expedited,
                SdoRequest::DownloadExpedited { object, data },
            ),
            (Method::Auto, None) => (
                Self::Initiate { data: owned },
                SdoRequest::DownloadInitiate { object, size },
            ),
            (Method::Block, _) => (
                Self::BlockInitiate { data: owned },
                SdoRequest::BlockDownloadInitiate {
                    object,
                    size,
                    crc: true,
                },
            ),
        }
    }

    pub(super) const fn initiates_block(&self) -> bool {
        matches!(self, Self::BlockInitiate { .. })
    }

    pub(super) const fn awaited(&self) -> &'static str {
        match self {
            Self::Expedited | Self::Initiate { .. } => "answer to a write",
            Self::Segments { .. } => "confirmation of a segment",
            Self::BlockInitiate { .. } => "answer to a block write",
            Self::Block(_) => "confirmation of a block",
            Self::BlockEnd => "confirmation of a block write's end",
        }
    }

    pub(super) fn handle(&mut self, payload: &[u8; 8], response: SdoResponse) -> Verdict {
        match (&mut *self, response) {
            (Self::Expedited, SdoResponse::DownloadInitiate { .. }) => Verdict::Done(Vec::new()),
            (Self::Initiate { data }, SdoResponse::DownloadInitiate { .. }) => {
                let data = core::mem::take(data);
                let segment = segment_at(&data, 0, false);
                *self = Self::Segments {
                    sent: segment.data().len(),
                    data,
                    toggle: false,
                };
                Verdict::Send(SdoRequest::DownloadSegment(segment))
            }
            (
                Self::Segments { data, sent, toggle },
                SdoResponse::DownloadSegment { toggle: confirmed },
            ) => next_segment(data, sent, toggle, confirmed),
            (
                Self::BlockInitiate { data },
                SdoResponse::BlockDownloadInitiate {
                    block_size, crc, ..
                },
            ) => {
                let mut block = Block {
                    data: core::mem::take(data),
                    crc,
                    confirmed: 0,
                    planned: 0,
                    sent: 0,
                    repeats: 0,
                    acknowledged: None,
                };
                let valid = block.plan(block_size);
                *self = Self::Block(block);
                if valid {
                    Verdict::Wait
                } else {
                    Verdict::Break(AbortCode::InvalidBlockSize)
                }
            }
            (
                Self::Block(block),
                SdoResponse::BlockDownloadAcknowledge {
                    sequence,
                    block_size,
                },
            ) => {
                let verdict = block.acknowledge(payload, sequence, block_size);
                if let Verdict::Send(_) = verdict {
                    *self = Self::BlockEnd;
                }
                verdict
            }
            (Self::BlockEnd, SdoResponse::BlockDownloadEndConfirm) => Verdict::Done(Vec::new()),
            (
                Self::Expedited
                | Self::Initiate { .. }
                | Self::Segments { .. }
                | Self::BlockInitiate { .. }
                | Self::Block(_)
                | Self::BlockEnd,
                _,
            ) => Verdict::Ignore(Oddity::Unexpected),
        }
    }

    /// The next segment of a sub-block.
    pub(super) fn pull(&mut self) -> Option<[u8; 8]> {
        match self {
            Self::Block(block) => block.pull(),
            Self::Expedited
            | Self::Initiate { .. }
            | Self::Segments { .. }
            | Self::BlockInitiate { .. }
            | Self::BlockEnd => None,
        }
    }
}

fn segment_at(data: &[u8], from: usize, toggle: bool) -> Segment {
    let end = data.len().min(from + SEGMENT_BYTES);
    Segment::new(toggle, end == data.len(), &data[from..end]).expect("at most 7 bytes")
}

fn next_segment(data: &[u8], sent: &mut usize, toggle: &mut bool, confirmed: bool) -> Verdict {
    if confirmed != *toggle {
        // A confirmation says nothing but its toggle bit: before the second segment nothing
        // can have been repeated, after it the old toggle is the repetition.
        return if *sent <= SEGMENT_BYTES && !*toggle {
            Verdict::Break(AbortCode::ToggleNotAlternated)
        } else {
            Verdict::Ignore(Oddity::Duplicated)
        };
    }
    if *sent == data.len() {
        return Verdict::Done(Vec::new());
    }
    *toggle = !*toggle;
    let segment = segment_at(data, *sent, *toggle);
    *sent += segment.data().len();
    Verdict::Send(SdoRequest::DownloadSegment(segment))
}

impl Block {
    /// Starts a sub-block; an empty value still has one segment.
    fn plan(&mut self, block_size: u8) -> bool {
        let rest = self.data.len() - self.confirmed;
        let segments = rest.div_ceil(SEGMENT_BYTES).max(1);
        self.planned = u8::try_from(segments).map_or(block_size, |few| few.min(block_size));
        self.sent = 0;
        (1..=BLOCK_SIZE_MAX).contains(&block_size)
    }

    fn pull(&mut self) -> Option<[u8; 8]> {
        if self.sent == self.planned {
            return None;
        }
        let from = self.confirmed + usize::from(self.sent) * SEGMENT_BYTES;
        let end = self.data.len().min(from + SEGMENT_BYTES);
        let mut data = [0; SEGMENT_BYTES];
        data[..end - from].copy_from_slice(&self.data[from..end]);
        self.sent += 1;
        let segment = BlockSegment {
            sequence: self.sent,
            last: end == self.data.len(),
            data,
        };
        Some(segment.emit())
    }

    fn acknowledge(&mut self, payload: &[u8; 8], sequence: u8, block_size: u8) -> Verdict {
        if self.sent < self.planned && self.acknowledged.as_ref() == Some(payload) {
            return Verdict::Ignore(Oddity::Duplicated);
        }
        if sequence > self.sent {
            return Verdict::Break(AbortCode::InvalidSequence);
        }
        self.acknowledged = Some(*payload);
        let everything = self.data.len().div_ceil(SEGMENT_BYTES).max(1) * SEGMENT_BYTES;
        self.confirmed += usize::from(sequence) * SEGMENT_BYTES;
        if self.confirmed >= everything {
            let unused = (everything - self.data.len()) as u8;
            let crc = if self.crc { block_crc(&self.data) } else { 0 };
            return Verdict::Send(SdoRequest::BlockDownloadEnd { unused, crc });
        }
        self.repeats = if sequence == 0 { self.repeats + 1 } else { 0 };
        if self.repeats > REPEATS_WITHOUT_PROGRESS_MAX {
            return Verdict::Break(AbortCode::InvalidSequence);
        }
        if self.plan(block_size) {
            Verdict::Wait
        } else {
            Verdict::Break(AbortCode::InvalidBlockSize)
        }
    }
}
