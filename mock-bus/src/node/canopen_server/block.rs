//! Block transfers of the SDO server (CiA 301, 7.2.4.3.9 to 7.2.4.3.16).

use wire::canopen::Object;
use wire::canopen::sdo::{
    AbortCode, BLOCK_SIZE_MAX, BlockSegment, SEGMENT_BYTES, SdoRequest, SdoResponse, block_crc,
};

use super::exchange::{Objects, Refusal, Reply, size_error};

/// The server sends.
#[derive(Clone, Debug)]
pub(super) struct BlockUpload {
    pub(super) object: Object,
    data: Vec<u8>,
    crc: bool,
    block_size: u8,
    phase: UploadPhase,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum UploadPhase {
    /// The client has not yet said "start".
    Initiated,
    /// Segments from byte `first` on were sent, `segments` of them.
    Sent { first: usize, segments: u8 },
    /// All data is confirmed, the end message was sent.
    Ended,
}

const fn check_block_size(object: Object, block_size: u8) -> Result<(), Refusal> {
    if block_size == 0 || block_size > BLOCK_SIZE_MAX {
        Err((object, AbortCode::InvalidBlockSize))
    } else {
        Ok(())
    }
}

impl BlockUpload {
    pub(super) fn start(
        object: Object,
        data: Vec<u8>,
        block_size: u8,
        crc: bool,
    ) -> Result<(Self, SdoResponse), Refusal> {
        check_block_size(object, block_size)?;
        let size = Some(data.len() as u32);
        let block = Self {
            object,
            data,
            crc,
            block_size,
            phase: UploadPhase::Initiated,
        };
        let crc = true;
        Ok((
            block,
            SdoResponse::BlockUploadInitiate { object, size, crc },
        ))
    }

    /// One request of the client; `true` when the transfer is over.
    pub(super) fn step(
        &mut self,
        request: SdoRequest,
        out: &mut Vec<Reply>,
    ) -> Result<bool, Refusal> {
        match (self.phase, request) {
            (UploadPhase::Initiated, SdoRequest::BlockUploadStart) => self.send_block(0, out),
            (
                UploadPhase::Sent { first, segments },
                SdoRequest::BlockUploadAcknowledge {
                    sequence,
                    block_size,
                },
            ) => {
                if sequence > segments {
                    return Err((self.object, AbortCode::InvalidSequence));
                }
                check_block_size(self.object, block_size)?;
                self.block_size = block_size;
                self.confirmed(first + usize::from(sequence) * SEGMENT_BYTES, sequence, out);
            }
            (UploadPhase::Ended, SdoRequest::BlockUploadEndConfirm) => return Ok(true),
            _ => return Err((self.object, AbortCode::UnknownCommand)),
        }
        Ok(false)
    }

    fn confirmed(&mut self, bytes: usize, sequence: u8, out: &mut Vec<Reply>) {
        let whole_empty_value = self.data.is_empty() && sequence == 1;
        if bytes >= self.data.len() && (!self.data.is_empty() || whole_empty_value) {
            self.phase = UploadPhase::Ended;
            out.push(Reply::Response(self.end_message()));
        } else {
            self.send_block(bytes, out);
        }
    }

    fn end_message(&self) -> SdoResponse {
        let rest = self.data.len() % SEGMENT_BYTES;
        let unused = match (self.data.is_empty(), rest) {
            (true, _) => SEGMENT_BYTES,
            (false, 0) => 0,
            (false, rest) => SEGMENT_BYTES - rest,
        };
        let crc = if self.crc { block_crc(&self.data) } else { 0 };
        SdoResponse::BlockUploadEnd {
            unused: unused as u8,
            crc,
        }
    }

    fn send_block(&mut self, first: usize, out: &mut Vec<Reply>) {
        let total = self.data.len().max(1);
        let mut segments = 0;
        let mut start = first;
        while start < total && segments < self.block_size {
            let end = self.data.len().min(start + SEGMENT_BYTES);
            let mut data = [0; SEGMENT_BYTES];
            data[..end - start].copy_from_slice(&self.data[start..end]);
            segments += 1;
            start += SEGMENT_BYTES;
            out.push(Reply::Segment(BlockSegment {
                sequence: segments,
                last: start >= total,
                data,
            }));
        }
        self.phase = UploadPhase::Sent { first, segments };
    }
}

/// The server receives.
#[derive(Clone, Debug)]
pub(super) struct BlockDownload {
    pub(super) object: Object,
    announced: Option<usize>,
    crc: bool,
    data: Vec<u8>,
    phase: DownloadPhase,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum DownloadPhase {
    /// The segment after `last_good` of this block is awaited.
    Segments { last_good: u8 },
    /// All segments came; the end message is awaited.
    AwaitingEnd,
}

impl BlockDownload {
    pub(super) fn start(
        object: Object,
        size: Option<u32>,
        crc: bool,
        objects: &mut impl Objects,
    ) -> Result<(Self, SdoResponse), Refusal> {
        let announced = size.map(|size| size as usize);
        let checked = objects.check_download(object, announced);
        checked.map_err(|code| (object, code))?;
        let block = Self {
            object,
            announced,
            crc,
            data: Vec::new(),
            phase: DownloadPhase::Segments { last_good: 0 },
        };
        let reply = SdoResponse::BlockDownloadInitiate {
            object,
            block_size: BLOCK_SIZE_MAX,
            crc: true,
        };
        Ok((block, reply))
    }

    pub(super) fn takes_segments(&self) -> bool {
        matches!(self.phase, DownloadPhase::Segments { .. })
    }

    /// One segment. Out of sequence it is dropped: the confirmation at the block's end names
    /// the last good one, and the client repeats from there.
    pub(super) fn segment(
        &mut self,
        segment: BlockSegment,
    ) -> Result<Option<SdoResponse>, Refusal> {
        let DownloadPhase::Segments { last_good } = self.phase else {
            return Ok(None);
        };
        if segment.sequence == 0 {
            return Err((self.object, AbortCode::InvalidSequence));
        }
        let in_sequence = segment.sequence == last_good + 1;
        if in_sequence {
            self.data.extend_from_slice(&segment.data);
            self.phase = DownloadPhase::Segments {
                last_good: segment.sequence,
            };
            self.check_excess()?;
        }
        if !segment.last && segment.sequence < BLOCK_SIZE_MAX {
            return Ok(None);
        }
        let complete = segment.last && in_sequence;
        Ok(Some(self.confirm(complete)))
    }

    /// More than the announced bytes, beyond what the last segment may leave unused.
    fn check_excess(&self) -> Result<(), Refusal> {
        let surely = self.data.len() - (SEGMENT_BYTES - 1);
        size_error(self.announced, surely, false).map_or(Ok(()), |code| Err((self.object, code)))
    }

    fn confirm(&mut self, complete: bool) -> SdoResponse {
        let sequence = match self.phase {
            DownloadPhase::Segments { last_good } => last_good,
            DownloadPhase::AwaitingEnd => 0,
        };
        self.phase = if complete {
            DownloadPhase::AwaitingEnd
        } else {
            DownloadPhase::Segments { last_good: 0 }
        };
        SdoResponse::BlockDownloadAcknowledge {
            sequence,
            block_size: BLOCK_SIZE_MAX,
        }
    }

    /// The block's last segment was lost: confirm what came, once something came.
    pub(super) fn confirm_late(&mut self) -> Option<SdoResponse> {
        match self.phase {
            DownloadPhase::Segments { last_good: 0 } | DownloadPhase::AwaitingEnd => None,
            DownloadPhase::Segments { .. } => Some(self.confirm(false)),
        }
    }

    pub(super) fn end(&mut self, unused: u8, crc: u16) -> Result<&[u8], Refusal> {
        let refuse = |code| (self.object, code);
        if self.phase != DownloadPhase::AwaitingEnd {
            return Err(refuse(AbortCode::UnknownCommand));
        }
        let length = self.data.len().saturating_sub(usize::from(unused));
        self.data.truncate(length);
        if let Some(code) = size_error(self.announced, length, true) {
            return Err((self.object, code));
        }
        if self.crc && block_crc(&self.data) != crc {
            return Err((self.object, AbortCode::CrcMismatch));
        }
        Ok(&self.data)
    }
}
