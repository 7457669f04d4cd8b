//! SDO client for one server (CiA 301, 7.2.4): expedited, segmented and block transfers.
//!
//! What the wire does to it, and what it does then:
//!
//! - A frame that is short, for another object, of an unexpected kind or a repetition of the
//!   one before is ignored and counted; the wait goes on and is not prolonged.
//! - A wrong toggle bit, sequence, checksum or size ends the transfer: an abort with the right
//!   code, index and sub-index goes out.
//! - A response that does not come in time ends it the same way, with 0x05040000.
//!
//! **Late replies.** `60 index sub` that answers a write given up long ago looks exactly like
//! the answer to a second write of the same object. Therefore nothing starts after an own abort
//! before two things have happened. (After an abort by the server only the second.) First the line is *drained*: everything the server says is
//! discarded for [`Timeouts::late_reply`] after a time-out ([`Timeouts::quiet`] after another
//! abort), longer while it keeps talking. Then a *fence* is sent: a read of a mandatory object
//! (0x1000, 0x1001 or 0x1018:00) that is neither the suspect object nor the next one. A server
//! answers in the order it was asked, and frames of one identifier stay in order, so its answer
//! proves that no older answer is under way. Only a bus that re-orders frames of one identifier
//! over more than the drain time defeats this; whoever fears it reads back what was written.
//!
//! **Retries** restart a whole transfer, after abort, drain and fence; a single request is
//! never sent again. Also retried, after a pause: what a busy server refused (0x08000022,
//! 0x08000021, 0x060A0023). Only reads and writes that the caller calls idempotent are retried.
//!
//! Absent: the SDO manager's dynamic channels, and network indication (remote access).

mod download;
mod transfer;
mod types;
mod upload;
mod verdict;

#[cfg(test)]
mod property_tests;
#[cfg(test)]
mod tests;

use std::collections::VecDeque;

use transfer::Transfer;
use units::Time;
use verdict::{Oddity, Verdict};
use wire::can::CanFrame;
use wire::canopen::sdo::{AbortCode, SdoRequest, SdoResponse};
use wire::canopen::{Function, NodeId, Object};

pub use types::{Busy, Counters, Method, Retry, SdoFailure, Timeouts};

/// The longest value that is read; a server that announces or sends more is cut off.
pub const TRANSFER_BYTES_MAX: usize = 1 << 20;

/// Mandatory objects (CiA 301, 7.5.2) that a fence may read; one is always free.
const FENCES: [Object; 3] = [
    Object::new(0x1000, 0),
    Object::new(0x1001, 0),
    Object::new(0x1018, 0),
];

#[derive(Clone, Debug)]
pub(super) enum Direction {
    Read,
    Write(Vec<u8>),
}

#[derive(Clone, Debug)]
pub(super) struct Job {
    object: Object,
    direction: Direction,
    method: Method,
    may_retry: bool,
    attempts: u32,
}

#[derive(Debug)]
enum State {
    Idle,
    Transfer {
        transfer: Transfer,
        deadline: Time,
    },
    /// Everything is discarded until `until`, which each frame puts off, up to `limit`.
    Drain {
        until: Time,
        limit: Time,
    },
    Fence {
        object: Object,
        deadline: Time,
    },
}

/// The client side of one server's default SDO channel.
#[derive(Debug)]
pub struct SdoClient {
    node: NodeId,
    timeouts: Timeouts,
    retry: Retry,
    state: State,
    job: Option<Job>,
    /// An object whose answer may still come, though nobody waits for it any more.
    suspect: Option<Object>,
    /// The payload that was taken last, to recognise its repetition.
    taken: Option<[u8; 8]>,
    outbox: VecDeque<SdoRequest>,
    outcome: Option<Result<Vec<u8>, SdoFailure>>,
    counters: Counters,
}

impl SdoClient {
    /// A client of `node`, without retries.
    pub const fn new(node: NodeId, timeouts: Timeouts) -> Self {
        Self {
            node,
            timeouts,
            retry: Retry::Never,
            state: State::Idle,
            job: None,
            suspect: None,
            taken: None,
            outbox: VecDeque::new(),
            outcome: None,
            counters: Counters {
                stale: 0,
                mismatched: 0,
                short: 0,
                unexpected: 0,
                duplicated: 0,
                late: 0,
                aborts_sent: 0,
                retries: 0,
            },
        }
    }

    /// Sets how often reads and idempotent writes are repeated.
    #[must_use]
    pub const fn with_retry(mut self, retry: Retry) -> Self {
        self.retry = retry;
        self
    }

    /// Begins to read `object`.
    ///
    /// # Errors
    /// When a transfer runs.
    pub fn read(&mut self, now: Time, object: Object, method: Method) -> Result<(), Busy> {
        self.begin(now, object, Direction::Read, method, true)
    }

    /// Begins to write `object`. It is never written twice.
    ///
    /// # Errors
    /// When a transfer runs.
    pub fn write(
        &mut self,
        now: Time,
        object: Object,
        data: &[u8],
        method: Method,
    ) -> Result<(), Busy> {
        self.begin(now, object, Direction::Write(data.to_vec()), method, false)
    }

    /// Begins to write `object`, where writing the same value twice does no harm: a failed transfer
    /// is repeated as [`SdoClient::with_retry`] allows.
    ///
    /// # Errors
    /// When a transfer runs.
    pub fn write_idempotent(
        &mut self,
        now: Time,
        object: Object,
        data: &[u8],
        method: Method,
    ) -> Result<(), Busy> {
        self.begin(now, object, Direction::Write(data.to_vec()), method, true)
    }

    fn begin(
        &mut self,
        now: Time,
        object: Object,
        direction: Direction,
        method: Method,
        may_retry: bool,
    ) -> Result<(), Busy> {
        if self.job.is_some() || self.outcome.is_some() {
            return Err(Busy);
        }
        self.job = Some(Job {
            object,
            direction,
            method,
            may_retry,
            attempts: 0,
        });
        if matches!(self.state, State::Idle) {
            self.advance(now);
        }
        Ok(())
    }

    /// Whether a transfer runs or its outcome waits to be taken.
    pub const fn is_busy(&self) -> bool {
        self.job.is_some() || self.outcome.is_some()
    }

    /// Gives the running transfer up; the server is told, and no outcome comes.
    pub fn cancel(&mut self, now: Time) {
        self.outcome = None;
        let Some(job) = self.job.take() else { return };
        if let State::Transfer { .. } = self.state {
            self.outbox.clear();
            self.abort(now, job.object, AbortCode::General);
        }
    }

    /// The server booted anew: whatever was under way is void on both sides, nothing older can
    /// come any more, and no outcome comes.
    pub fn server_restarted(&mut self) {
        self.outcome = None;
        self.job = None;
        self.suspect = None;
        self.outbox.clear();
        self.state = State::Idle;
    }

    /// The node whose server this is the client of.
    pub const fn node(&self) -> NodeId {
        self.node
    }

    /// What was ignored so far.
    pub const fn counters(&self) -> Counters {
        self.counters
    }

    /// How the last transfer ended, once; the data of a read, nothing for a write.
    pub const fn poll_outcome(&mut self) -> Option<Result<Vec<u8>, SdoFailure>> {
        self.outcome.take()
    }

    /// When [`SdoClient::handle_timeout`] wants to be called.
    pub const fn poll_timeout(&self) -> Time {
        match self.state {
            State::Idle => Time::NEVER,
            State::Transfer { deadline, .. } | State::Fence { deadline, .. } => deadline,
            State::Drain { until, .. } => until,
        }
    }

    /// The next frame to send.
    pub fn poll_transmit(&mut self) -> Option<CanFrame> {
        let payload = match self.outbox.pop_front() {
            Some(request) => request.emit(),
            None => match &mut self.state {
                State::Transfer { transfer, .. } => transfer.pull()?,
                State::Idle | State::Drain { .. } | State::Fence { .. } => return None,
            },
        };
        Some(CanFrame::standard(
            self.node.cob_id(Function::SdoRequest),
            &payload,
        ))
    }

    /// Takes a frame; those of other nodes and other kinds are not touched.
    /// Says whether it was this server's.
    pub fn handle_frame(&mut self, now: Time, frame: &CanFrame) -> bool {
        if frame.standard_id() != Some(self.node.cob_id(Function::SdoResponse)) {
            return false;
        }
        match <[u8; 8]>::try_from(frame.data()) {
            Ok(payload) => self.handle_payload(now, &payload),
            Err(_) => self.counters.short += 1,
        }
        true
    }

    fn handle_payload(&mut self, now: Time, payload: &[u8; 8]) {
        match &mut self.state {
            State::Idle => self.counters.stale += 1,
            State::Drain { until, limit } => {
                self.counters.late += 1;
                *until = (now + self.timeouts.quiet).max(*until).min(*limit);
            }
            State::Fence { object, .. } => {
                if answers_fence(payload, *object) {
                    self.suspect = None;
                    self.state = State::Idle;
                    self.advance(now);
                } else {
                    self.counters.late += 1;
                }
            }
            State::Transfer { transfer, .. } => {
                let verdict = transfer.handle(payload);
                self.obey(now, verdict, Some(payload));
            }
        }
    }

    /// Acts on deadlines that have passed.
    pub fn handle_timeout(&mut self, now: Time) {
        if now < self.poll_timeout() {
            return;
        }
        match &mut self.state {
            State::Idle => {}
            State::Drain { .. } => {
                self.state = State::Idle;
                self.advance(now);
            }
            State::Fence { object, .. } => {
                let object = *object;
                self.time_out(now, object, "answer to the first read after a lost reply");
            }
            State::Transfer { transfer, .. } => {
                let awaited = transfer.awaited();
                match transfer.stall() {
                    Some(acknowledge) => {
                        self.obey(now, Verdict::Send(acknowledge), None);
                    }
                    None => {
                        let object = transfer.object();
                        self.time_out(now, object, awaited);
                    }
                }
            }
        }
    }

    /// With a job and nothing in the way: fence first if a late reply is possible, else start.
    fn advance(&mut self, now: Time) {
        let Some(job) = &mut self.job else { return };
        job.attempts += 1;
        if let Some(suspect) = self.suspect {
            let object = FENCES
                .into_iter()
                .find(|fence| *fence != suspect && *fence != job.object)
                .expect("three fences, two excluded");
            self.outbox.push_back(SdoRequest::UploadInitiate { object });
            let deadline = now + self.timeouts.response;
            self.state = State::Fence { object, deadline };
            // The transfer itself counts the attempt when the fence lets it through.
            job.attempts -= 1;
            return;
        }
        let (transfer, request) = Transfer::begin(job);
        self.taken = None;
        self.outbox.push_back(request);
        let deadline = now + transfer.patience(&self.timeouts);
        self.state = State::Transfer { transfer, deadline };
    }

    fn obey(&mut self, now: Time, verdict: Verdict, payload: Option<&[u8; 8]>) {
        let State::Transfer { transfer, deadline } = &mut self.state else {
            return;
        };
        let object = transfer.object();
        match verdict {
            Verdict::Ignore(oddity) => self.count(oddity, payload),
            Verdict::Wait => {
                self.taken = payload.copied();
                *deadline = now + transfer.patience(&self.timeouts);
            }
            Verdict::Send(request) => {
                self.taken = payload.copied().or(self.taken);
                *deadline = now + transfer.patience(&self.timeouts);
                self.outbox.push_back(request);
            }
            Verdict::Done(data) => self.finish(Ok(data)),
            Verdict::DoneAfter(request, data) => {
                self.outbox.push_back(request);
                self.finish(Ok(data));
            }
            Verdict::FallBack => {
                if let Some(job) = &mut self.job {
                    job.method = Method::Auto;
                    job.attempts -= 1;
                }
                self.state = State::Idle;
                self.advance(now);
            }
            Verdict::Aborted(code) => {
                // Some servers repeat an abort: it must not hit the next transfer.
                self.suspect = Some(object);
                self.state = if types::is_busy(code) {
                    let until = now + self.timeouts.quiet;
                    State::Drain {
                        until,
                        limit: until + self.timeouts.late_reply,
                    }
                } else {
                    State::Idle
                };
                self.fail(now, SdoFailure::Aborted { object, code });
            }
            Verdict::Break(code) => {
                self.abort(now, object, code);
                let attempts = self.attempts();
                self.fail(
                    now,
                    SdoFailure::Protocol {
                        object,
                        code,
                        attempts,
                    },
                );
            }
        }
    }

    fn count(&mut self, oddity: Oddity, payload: Option<&[u8; 8]>) {
        let repeated = payload.is_some() && payload == self.taken.as_ref();
        match oddity {
            _ if repeated => self.counters.duplicated += 1,
            Oddity::Duplicated => self.counters.duplicated += 1,
            Oddity::Mismatched => self.counters.mismatched += 1,
            Oddity::Unexpected => self.counters.unexpected += 1,
        }
    }

    fn time_out(&mut self, now: Time, silent: Object, awaited: &'static str) {
        let fencing = matches!(self.state, State::Fence { .. });
        self.outbox.clear();
        let suspect = self.suspect;
        self.abort(now, silent, AbortCode::TimedOut);
        if fencing {
            // The older transfer stays the suspect; the fence itself is harmless.
            self.suspect = suspect;
            if let Some(job) = &mut self.job {
                job.attempts += 1;
            }
        }
        let object = self.job.as_ref().map_or(silent, |job| job.object);
        let failure = SdoFailure::TimedOut {
            object,
            awaited,
            waited: self.timeouts.response,
            attempts: self.attempts(),
        };
        self.fail(now, failure);
    }

    fn attempts(&self) -> u32 {
        self.job.as_ref().map_or(1, |job| job.attempts)
    }

    /// Tells the server that its transfer is over, and begins to drain.
    fn abort(&mut self, now: Time, object: Object, code: AbortCode) {
        self.outbox.push_back(SdoRequest::Abort { object, code });
        self.counters.aborts_sent += 1;
        self.suspect = Some(object);
        let calm = match code {
            AbortCode::TimedOut => self.timeouts.late_reply,
            _ => self.timeouts.quiet,
        };
        let limit = now + calm + self.timeouts.late_reply * 4;
        self.state = State::Drain {
            until: now + calm,
            limit,
        };
    }

    fn fail(&mut self, now: Time, failure: SdoFailure) {
        let again = failure.is_transient()
            && self
                .job
                .as_ref()
                .is_some_and(|job| job.may_retry && job.attempts < self.retry.attempts());
        if !again {
            self.job = None;
            self.outcome = Some(Err(failure));
            return;
        }
        self.counters.retries += 1;
        if matches!(self.state, State::Idle) {
            self.advance(now);
        }
    }

    fn finish(&mut self, result: Result<Vec<u8>, SdoFailure>) {
        self.job = None;
        self.state = State::Idle;
        self.outcome = Some(result);
    }
}

/// Whether a payload is the expedited value of the fence's object, or its refusal.
fn answers_fence(payload: &[u8; 8], fence: Object) -> bool {
    match SdoResponse::parse(payload) {
        Ok(SdoResponse::UploadExpedited { object, .. } | SdoResponse::Abort { object, .. }) => {
            object == fence
        }
        Ok(_) | Err(_) => false,
    }
}
