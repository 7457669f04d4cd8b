//! One attempt at one transfer: payload in, verdict out; no time in it.

use core::time::Duration;

use super::download::Download;
use super::upload::Upload;
use super::verdict::{Oddity, Verdict};
use super::{Direction, Job, Timeouts};
use wire::canopen::Object;
use wire::canopen::sdo::{AbortCode, SdoRequest, SdoResponse};

#[derive(Debug)]
enum Machine {
    Upload(Upload),
    Download(Download),
}

#[derive(Debug)]
pub(super) struct Transfer {
    object: Object,
    machine: Machine,
}

impl Transfer {
    pub(super) fn begin(job: &Job) -> (Self, SdoRequest) {
        let object = job.object;
        let (machine, request) = match &job.direction {
            Direction::Read => {
                let (upload, request) = Upload::begin(object, job.method);
                (Machine::Upload(upload), request)
            }
            Direction::Write(data) => {
                let (download, request) = Download::begin(object, data, job.method);
                (Machine::Download(download), request)
            }
        };
        (Self { object, machine }, request)
    }

    pub(super) const fn object(&self) -> Object {
        self.object
    }

    pub(super) fn handle(&mut self, payload: &[u8; 8]) -> Verdict {
        // Segments of a block have no command specifier; only an abort (sequence 0 does not
        // exist) can be told from them.
        let segment_phase = match &self.machine {
            Machine::Upload(upload) => upload.takes_block_segments(),
            Machine::Download(_) => false,
        };
        if segment_phase && payload[0] != 0x80 {
            return match &mut self.machine {
                Machine::Upload(upload) => upload.handle_block_segment(payload),
                Machine::Download(_) => Verdict::Ignore(Oddity::Unexpected),
            };
        }
        let Ok(response) = SdoResponse::parse(payload) else {
            return Verdict::Ignore(Oddity::Unexpected);
        };
        if response.object().is_some_and(|named| named != self.object) {
            return Verdict::Ignore(Oddity::Mismatched);
        }
        if let SdoResponse::Abort { code, .. } = response {
            let no_block = code == AbortCode::UnknownCommand && self.initiates_block();
            return if no_block {
                Verdict::FallBack
            } else {
                Verdict::Aborted(code)
            };
        }
        match &mut self.machine {
            Machine::Upload(upload) => upload.handle(payload, response),
            Machine::Download(download) => download.handle(payload, response),
        }
    }

    const fn initiates_block(&self) -> bool {
        match &self.machine {
            Machine::Upload(upload) => upload.initiates_block(),
            Machine::Download(download) => download.initiates_block(),
        }
    }

    /// The next payload that goes out without being asked for: segments of a block write.
    pub(super) fn pull(&mut self) -> Option<[u8; 8]> {
        match &mut self.machine {
            Machine::Upload(_) => None,
            Machine::Download(download) => download.pull(),
        }
    }

    /// Silence: what may be sent to make the server repeat itself, if anything may.
    pub(super) fn stall(&mut self) -> Option<SdoRequest> {
        match &mut self.machine {
            Machine::Upload(upload) => upload.stall(),
            Machine::Download(_) => None,
        }
    }

    pub(super) const fn awaited(&self) -> &'static str {
        match &self.machine {
            Machine::Upload(upload) => upload.awaited(),
            Machine::Download(download) => download.awaited(),
        }
    }

    pub(super) const fn patience(&self, timeouts: &Timeouts) -> Duration {
        match &self.machine {
            Machine::Upload(upload) if upload.takes_block_segments() => timeouts.block_segment,
            Machine::Upload(_) | Machine::Download(_) => timeouts.response,
        }
    }
}
