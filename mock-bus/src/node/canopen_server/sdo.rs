//! The SDO server (CiA 301, 7.2.4.3): which request moves which transfer where.
//!
//! One transfer at a time; a new initiate request replaces a transfer that still runs. The
//! block transfers are in `block.rs`.

use std::time::Duration;

use units::Time;
use wire::canopen::Object;
use wire::canopen::sdo::{
    AbortCode, BlockSegment, Expedited, SEGMENT_BYTES, SdoRequest, SdoResponse, Segment,
};

use super::block::{BlockDownload, BlockUpload};
use super::exchange::{Objects, Refusal, Reply, size_error};

const NO_OBJECT: Object = Object::new(0, 0);

#[derive(Clone, Debug, Default)]
enum Transfer {
    #[default]
    Idle,
    Upload {
        object: Object,
        data: Vec<u8>,
        sent: usize,
        toggle: bool,
    },
    Download {
        object: Object,
        announced: Option<usize>,
        data: Vec<u8>,
        toggle: bool,
    },
    BlockUpload(BlockUpload),
    BlockDownload(BlockDownload),
}

impl Transfer {
    fn object(&self) -> Object {
        match self {
            Self::Idle => NO_OBJECT,
            Self::Upload { object, .. } | Self::Download { object, .. } => *object,
            Self::BlockUpload(block) => block.object,
            Self::BlockDownload(block) => block.object,
        }
    }
}

/// The server's only transfer and its time limit.
#[derive(Clone, Debug)]
pub(super) struct SdoServer {
    transfer: Transfer,
    timeout: Duration,
    deadline: Time,
    /// Requests that were not 8 bytes long: ignored (CiA 301 has no answer to them).
    pub(super) short_requests: u64,
}

impl SdoServer {
    pub(super) fn new(timeout: Duration) -> Self {
        Self {
            transfer: Transfer::Idle,
            timeout,
            deadline: Time::NEVER,
            short_requests: 0,
        }
    }

    pub(super) fn reset(&mut self) {
        *self = Self::new(self.timeout);
    }

    pub(super) fn deadline(&self) -> Time {
        self.deadline
    }

    /// The object of the transfer that runs.
    pub(super) fn object(&self) -> Object {
        self.transfer.object()
    }

    /// Whether a download is ready to take the segments of a block.
    pub(super) fn takes_block_segments(&self) -> bool {
        matches!(&self.transfer, Transfer::BlockDownload(block) if block.takes_segments())
    }

    pub(super) fn handle(
        &mut self,
        now: Time,
        payload: &[u8],
        objects: &mut impl Objects,
        out: &mut Vec<Reply>,
    ) {
        let Ok(bytes) = <[u8; 8]>::try_from(payload) else {
            self.short_requests += 1;
            return;
        };
        let result = self.dispatch(bytes, objects, out);
        self.finish(result, out);
        let busy = !matches!(self.transfer, Transfer::Idle);
        self.deadline = if busy {
            self.next_deadline(now)
        } else {
            Time::NEVER
        };
    }

    /// A block's confirmation is due after half the time, so that the client can still repeat.
    fn next_deadline(&self, now: Time) -> Time {
        match self.transfer {
            Transfer::BlockDownload(_) => now + self.timeout / 2,
            _ => now + self.timeout,
        }
    }

    /// The client fell silent: confirm what came of a block, else abort (0x05040000).
    pub(super) fn handle_timeout(&mut self, now: Time, out: &mut Vec<Reply>) {
        if now < self.deadline {
            return;
        }
        if let Transfer::BlockDownload(block) = &mut self.transfer
            && let Some(reply) = block.confirm_late()
        {
            out.push(Reply::Response(reply));
            self.deadline = now + self.timeout / 2;
            return;
        }
        let refusal = Err((self.transfer.object(), AbortCode::TimedOut));
        self.finish(refusal, out);
        self.deadline = Time::NEVER;
    }

    fn finish(&mut self, result: Result<(), Refusal>, out: &mut Vec<Reply>) {
        if let Err((object, code)) = result {
            out.push(Reply::Response(SdoResponse::Abort { object, code }));
            self.transfer = Transfer::Idle;
        }
    }

    fn dispatch(
        &mut self,
        bytes: [u8; 8],
        objects: &mut impl Objects,
        out: &mut Vec<Reply>,
    ) -> Result<(), Refusal> {
        const ABORT: u8 = 0x80;
        if self.takes_block_segments() && bytes[0] != ABORT {
            return self.block_segment(&bytes, out);
        }
        match SdoRequest::parse(&bytes) {
            Ok(request) => self.request(request, objects, out),
            Err(_) => Err((self.transfer.object(), AbortCode::UnknownCommand)),
        }
    }

    fn block_segment(&mut self, bytes: &[u8; 8], out: &mut Vec<Reply>) -> Result<(), Refusal> {
        if let Transfer::BlockDownload(block) = &mut self.transfer
            && let Ok(segment) = BlockSegment::parse(bytes)
        {
            let reply = block.segment(segment)?;
            out.extend(reply.map(Reply::Response));
        }
        Ok(())
    }

    fn request(
        &mut self,
        request: SdoRequest,
        objects: &mut impl Objects,
        out: &mut Vec<Reply>,
    ) -> Result<(), Refusal> {
        match request {
            SdoRequest::UploadInitiate { object } => self.upload(object, objects, out),
            SdoRequest::UploadSegment { toggle } => self.upload_segment(toggle, out),
            SdoRequest::DownloadExpedited { object, data } => {
                self.download_expedited(object, data, objects, out)
            }
            SdoRequest::DownloadInitiate { object, size } => {
                self.download(object, size, objects, out)
            }
            SdoRequest::DownloadSegment(segment) => self.download_segment(segment, objects, out),
            SdoRequest::Abort { .. } => {
                self.transfer = Transfer::Idle;
                Ok(())
            }
            SdoRequest::BlockDownloadInitiate { object, size, crc } => {
                let (block, reply) = BlockDownload::start(object, size, crc, objects)?;
                self.transfer = Transfer::BlockDownload(block);
                out.push(Reply::Response(reply));
                Ok(())
            }
            SdoRequest::BlockDownloadEnd { unused, crc } => {
                self.block_download_end(unused, crc, objects, out)
            }
            SdoRequest::BlockUploadInitiate {
                object,
                block_size,
                protocol_switch,
                crc,
            } => {
                let data = objects.read(object).map_err(|code| (object, code))?;
                if protocol_switch > 0 && data.len() <= usize::from(protocol_switch) {
                    return self.upload_data(object, data, out);
                }
                let (block, reply) = BlockUpload::start(object, data, block_size, crc)?;
                self.transfer = Transfer::BlockUpload(block);
                out.push(Reply::Response(reply));
                Ok(())
            }
            SdoRequest::BlockUploadStart
            | SdoRequest::BlockUploadAcknowledge { .. }
            | SdoRequest::BlockUploadEndConfirm => self.block_upload(request, out),
        }
    }

    fn unexpected(&self) -> Refusal {
        (self.transfer.object(), AbortCode::UnknownCommand)
    }

    fn upload(
        &mut self,
        object: Object,
        objects: &mut impl Objects,
        out: &mut Vec<Reply>,
    ) -> Result<(), Refusal> {
        let data = objects.read(object).map_err(|code| (object, code))?;
        self.upload_data(object, data, out)
    }

    fn upload_data(
        &mut self,
        object: Object,
        data: Vec<u8>,
        out: &mut Vec<Reply>,
    ) -> Result<(), Refusal> {
        self.transfer = Transfer::Idle;
        let response = if let Some(data) = Expedited::new(&data) {
            SdoResponse::UploadExpedited { object, data }
        } else {
            let size = Some(data.len() as u32);
            self.transfer = Transfer::Upload {
                object,
                data,
                sent: 0,
                toggle: false,
            };
            SdoResponse::UploadInitiate { object, size }
        };
        out.push(Reply::Response(response));
        Ok(())
    }

    fn upload_segment(&mut self, toggle: bool, out: &mut Vec<Reply>) -> Result<(), Refusal> {
        let Transfer::Upload {
            object,
            data,
            sent,
            toggle: expected,
        } = &mut self.transfer
        else {
            return Err(self.unexpected());
        };
        if toggle != *expected {
            return Err((*object, AbortCode::ToggleNotAlternated));
        }
        let end = data.len().min(*sent + SEGMENT_BYTES);
        let last = end == data.len();
        let segment = Segment::new(toggle, last, &data[*sent..end]);
        let segment = segment.expect("a segment is cut to at most 7 bytes");
        (*sent, *expected) = (end, !toggle);
        if last {
            self.transfer = Transfer::Idle;
        }
        out.push(Reply::Response(SdoResponse::UploadSegment(segment)));
        Ok(())
    }

    fn download_expedited(
        &mut self,
        object: Object,
        data: Expedited,
        objects: &mut impl Objects,
        out: &mut Vec<Reply>,
    ) -> Result<(), Refusal> {
        self.transfer = Transfer::Idle;
        let mut bytes = data.data();
        if !data.size_indicated() {
            // Without a size the entry's own length says how many of the four bytes count.
            bytes = &bytes[..objects.length(object).unwrap_or(4).min(4)];
        }
        objects
            .write(object, bytes)
            .map_err(|code| (object, code))?;
        out.push(Reply::Response(SdoResponse::DownloadInitiate { object }));
        Ok(())
    }

    fn download(
        &mut self,
        object: Object,
        size: Option<u32>,
        objects: &mut impl Objects,
        out: &mut Vec<Reply>,
    ) -> Result<(), Refusal> {
        let announced = size.map(|size| size as usize);
        let checked = objects.check_download(object, announced);
        checked.map_err(|code| (object, code))?;
        self.transfer = Transfer::Download {
            object,
            announced,
            data: Vec::new(),
            toggle: false,
        };
        out.push(Reply::Response(SdoResponse::DownloadInitiate { object }));
        Ok(())
    }

    fn download_segment(
        &mut self,
        segment: Segment,
        objects: &mut impl Objects,
        out: &mut Vec<Reply>,
    ) -> Result<(), Refusal> {
        let Transfer::Download {
            object,
            announced,
            data,
            toggle,
        } = &mut self.transfer
        else {
            return Err(self.unexpected());
        };
        let object = *object;
        if segment.toggle != *toggle {
            return Err((object, AbortCode::ToggleNotAlternated));
        }
        *toggle = !*toggle;
        data.extend_from_slice(segment.data());
        if let Some(code) = size_error(*announced, data.len(), segment.last) {
            return Err((object, code));
        }
        if segment.last {
            objects.write(object, data).map_err(|code| (object, code))?;
            self.transfer = Transfer::Idle;
        }
        let toggle = segment.toggle;
        out.push(Reply::Response(SdoResponse::DownloadSegment { toggle }));
        Ok(())
    }

    fn block_download_end(
        &mut self,
        unused: u8,
        crc: u16,
        objects: &mut impl Objects,
        out: &mut Vec<Reply>,
    ) -> Result<(), Refusal> {
        let Transfer::BlockDownload(block) = &mut self.transfer else {
            return Err(self.unexpected());
        };
        let object = block.object;
        let data = block.end(unused, crc)?;
        objects.write(object, data).map_err(|code| (object, code))?;
        self.transfer = Transfer::Idle;
        out.push(Reply::Response(SdoResponse::BlockDownloadEndConfirm));
        Ok(())
    }

    fn block_upload(&mut self, request: SdoRequest, out: &mut Vec<Reply>) -> Result<(), Refusal> {
        let Transfer::BlockUpload(block) = &mut self.transfer else {
            return Err(self.unexpected());
        };
        if block.step(request, out)? {
            self.transfer = Transfer::Idle;
        }
        Ok(())
    }
}
