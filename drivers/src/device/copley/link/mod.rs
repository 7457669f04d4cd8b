//! One exchange at a time with one amplifier, on a line that others share.
//!
//! Replies carry neither a number nor a name, so only the order says what they answer. When a
//! reply is missing, the line is left alone until it has been quiet for a while; then the
//! amplifier's serial number is asked as a *fence*: amplifiers answer in the order they are
//! asked, so whatever comes before the serial number is old, and is thrown away. Only then is the
//! exchange given up as lost, and the line given back: no other device ever hears a late reply
//! in place of its own. A stop does not wait for any of this; what follows it does.
//!
//! A command that was not understood (`e 33`) was not carried out and is sent again, twice at
//! most. Nothing else is ever sent again from here.

mod fence;

use core::time::Duration;
use std::collections::VecDeque;

use units::Time;
use wire::Payload;
use wire::copley::{Address, CR, Command, ErrorCode, LINE_MAX, Reply, Request};

use super::finding::{Finding, Found, span};
use super::settings::CopleyTimeouts;
use crate::device::serial_line::{AssembledLine, LineAssembler};
use crate::device::{LineUse, Urgency};

/// Replies are reckoned with so many bytes.
const REPLY_BYTES: usize = 24;
/// How often a command that was not understood is sent again.
const RESENDS: u32 = 2;
/// How often the fence is asked before the amplifier is looked for again.
const FENCES: u32 = 2;
/// The line must fall quiet within so many times the wait.
const NOISE_MAX: u32 = 10;

/// What came of the link's work.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum LinkEvent {
    /// The amplifier at the cable answers at the line's rate, for the first time or again.
    Opened,
    /// The answer to what was asked.
    Reply(Reply),
    /// What was asked was not answered; whether it was done is not known.
    Lost,
    /// Nobody answers on this line.
    Failed { waited: Duration },
}

/// What follows when the line is clean again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Then {
    /// The exchange before is told to be lost.
    TellLost,
    /// This is asked.
    Ask(Request, Urgency),
    Nothing,
}

#[derive(Clone, Copy, Debug)]
enum State {
    Closed,
    /// Waits for its turn to look for the amplifier.
    Seeking {
        since: Time,
    },
    /// Its turn has come; `since` as before.
    Beginning {
        since: Time,
        then: Then,
    },
    Finding {
        finding: Finding,
        since: Time,
        then: Then,
    },
    Free,
    /// Waits for its turn to ask.
    Waiting {
        request: Request,
        urgency: Urgency,
        since: Time,
    },
    /// `deadline` is known once the clock is.
    Asked {
        request: Request,
        urgency: Urgency,
        resends: u32,
        deadline: Option<Time>,
    },
    /// Until nothing has been heard for a while.
    Quiet {
        until: Option<Time>,
        limit: Time,
        then: Then,
    },
    Fencing {
        fences: u32,
        deadline: Option<Time>,
        then: Then,
    },
}

/// Counters for a person who looks for trouble.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct LinkCounts {
    pub(super) exchanges: u64,
    pub(super) lost: u64,
    pub(super) late: u64,
    pub(super) mismatched: u64,
    pub(super) damaged: u64,
    pub(super) resent: u64,
    pub(super) searches: u64,
}

/// The line as one amplifier's driver sees it.
#[derive(Debug)]
pub(super) struct Link {
    address: Address,
    baud: u32,
    timeouts: CopleyTimeouts,
    state: State,
    lines: LineAssembler,
    outbox: VecDeque<Payload>,
    events: VecDeque<LinkEvent>,
    /// The serial number, once known: the fence.
    serial: Option<i64>,
    /// A stop waits: nothing is waited for beyond the reply under way.
    hurried: bool,
    /// An exchange was given up without a fence behind it.
    suspect: bool,
    pub(super) counts: LinkCounts,
}

impl Link {
    pub(super) const fn new(address: Address, baud: u32, timeouts: CopleyTimeouts) -> Self {
        Self {
            address,
            baud,
            timeouts,
            state: State::Closed,
            lines: LineAssembler::new(CR, LINE_MAX),
            outbox: VecDeque::new(),
            events: VecDeque::new(),
            serial: None,
            hurried: false,
            suspect: false,
            counts: LinkCounts {
                exchanges: 0,
                lost: 0,
                late: 0,
                mismatched: 0,
                damaged: 0,
                resent: 0,
                searches: 0,
            },
        }
    }

    /// Looks for the amplifier as soon as it is our turn; forgets everything before.
    pub(super) fn open(&mut self, now: Time) {
        self.outbox.clear();
        self.events.clear();
        self.lines.clear();
        self.serial = None;
        self.hurried = false;
        self.suspect = false;
        self.state = State::Seeking { since: now };
    }

    pub(super) fn close(&mut self) {
        self.outbox.clear();
        self.events.clear();
        self.state = State::Closed;
    }

    pub(super) const fn is_open(&self) -> bool {
        !matches!(
            self.state,
            State::Closed | State::Seeking { .. } | State::Beginning { .. } | State::Finding { .. }
        )
    }

    /// Whether the amplifier at the cable is being looked for, or is going to be.
    pub(super) const fn is_searching(&self) -> bool {
        matches!(
            self.state,
            State::Seeking { .. } | State::Beginning { .. } | State::Finding { .. }
        )
    }

    pub(super) const fn is_free(&self) -> bool {
        matches!(self.state, State::Free)
    }

    /// What the fence is from now on.
    pub(super) const fn set_serial(&mut self, serial: i64) {
        self.serial = Some(serial);
    }

    /// Wants to ask; only on a free link.
    pub(super) fn ask(&mut self, request: Request, urgency: Urgency, since: Time) {
        assert!(self.is_free());
        self.state = State::Waiting {
            request,
            urgency,
            since,
        };
    }

    /// Takes back what has not been sent yet.
    pub(super) fn cancel(&mut self) {
        if let State::Waiting { .. } = self.state {
            self.state = State::Free;
        }
    }

    pub(super) const fn line_use(&self) -> LineUse {
        match self.state {
            State::Closed | State::Free => LineUse::Idle,
            State::Seeking { since } => LineUse::Wants {
                urgency: Urgency::Command,
                since,
            },
            State::Waiting { urgency, since, .. } => LineUse::Wants { urgency, since },
            State::Beginning { .. }
            | State::Finding { .. }
            | State::Asked { .. }
            | State::Quiet { .. }
            | State::Fencing { .. } => LineUse::Holds,
        }
    }

    /// Being asked is being given the turn.
    pub(super) fn poll_transmit(&mut self) -> Option<Payload> {
        match self.state {
            State::Seeking { since } => {
                let then = Then::Nothing;
                self.state = State::Beginning { since, then };
            }
            State::Waiting {
                request, urgency, ..
            } if self.suspect && urgency != Urgency::Stop => {
                self.state = State::Quiet {
                    until: None,
                    limit: Time::NEVER,
                    then: Then::Ask(request, urgency),
                };
            }
            State::Waiting {
                request, urgency, ..
            } => self.send(request, urgency, 0),
            State::Closed
            | State::Beginning { .. }
            | State::Finding { .. }
            | State::Free
            | State::Asked { .. }
            | State::Quiet { .. }
            | State::Fencing { .. } => {}
        }
        self.outbox.pop_front()
    }

    fn send(&mut self, request: Request, urgency: Urgency, resends: u32) {
        self.counts.exchanges += 1;
        self.hurried = false;
        self.lines.clear();
        self.outbox.push_back(Payload::Bytes(request.emit()));
        self.state = State::Asked {
            request,
            urgency,
            resends,
            deadline: None,
        };
    }

    pub(super) fn poll_event(&mut self) -> Option<LinkEvent> {
        self.events.pop_front()
    }

    pub(super) fn poll_timeout(&self) -> Time {
        match self.state {
            State::Closed | State::Seeking { .. } | State::Free | State::Waiting { .. } => {
                Time::NEVER
            }
            State::Beginning { .. } => Time::ZERO,
            State::Finding { finding, .. } => finding.poll_timeout(),
            State::Asked { deadline, .. }
            | State::Quiet {
                until: deadline, ..
            }
            | State::Fencing { deadline, .. } => deadline.unwrap_or(Time::ZERO),
        }
    }

    /// Bytes that came in on the line; those of others' exchanges are nobody's here.
    pub(super) fn handle(&mut self, now: Time, bytes: &[u8]) {
        if self.line_use() != LineUse::Holds {
            return;
        }
        if let State::Quiet { until, limit, .. } = &mut self.state {
            let quiet = now + self.timeouts.quiet;
            *until = Some(quiet.min(*limit));
        }
        for byte in bytes {
            match self.lines.push(*byte) {
                None => {}
                Some(AssembledLine::Overlong) => self.line(now, b"?"),
                Some(AssembledLine::Whole(line)) => self.line(now, &line),
            }
        }
    }

    fn line(&mut self, now: Time, line: &[u8]) {
        match &mut self.state {
            State::Finding { finding, .. } => {
                let found = finding.line(now, line, &self.timeouts, &mut self.outbox);
                self.found(now, found);
            }
            State::Asked {
                request,
                urgency,
                resends,
                ..
            } => {
                let (request, urgency, resends) = (*request, *urgency, *resends);
                self.answer(request, urgency, resends, line);
            }
            State::Fencing { then, .. } => {
                let then = *then;
                self.fence(then, line);
            }
            State::Quiet { .. } => self.counts.late += 1,
            State::Closed
            | State::Seeking { .. }
            | State::Beginning { .. }
            | State::Free
            | State::Waiting { .. } => {}
        }
    }

    fn answer(&mut self, request: Request, urgency: Urgency, resends: u32, line: &[u8]) {
        let Ok(reply) = Reply::parse(line) else {
            // Perhaps ours, damaged: it will be missing.
            self.counts.damaged += 1;
            return;
        };
        match reply {
            Reply::Error(ErrorCode::Syntax) if resends < RESENDS => {
                self.counts.resent += 1;
                self.send(request, urgency, resends + 1);
            }
            // The one at the cable speaks for a node that it cannot reach.
            Reply::Error(ErrorCode::CanFailed) => {
                self.state = State::Free;
                self.tell_lost();
            }
            reply if fits(request.command, &reply) => {
                self.state = State::Free;
                self.events.push_back(LinkEvent::Reply(reply));
            }
            Reply::Ok | Reply::Value(_) | Reply::Register(_) | Reply::Error(_) => {
                self.counts.mismatched += 1;
            }
        }
    }

    fn tell_lost(&mut self) {
        self.counts.lost += 1;
        self.events.push_back(LinkEvent::Lost);
    }

    fn found(&mut self, now: Time, found: Found) {
        let State::Finding { since, then, .. } = self.state else {
            return;
        };
        match found {
            Found::NotYet => {}
            Found::Yes => {
                self.suspect = false;
                self.hurried = false;
                self.state = State::Free;
                self.events.push_back(LinkEvent::Opened);
                if then != Then::Nothing {
                    self.tell_lost();
                }
            }
            Found::No => {
                self.state = State::Closed;
                let waited = now.since(since);
                self.events.push_back(LinkEvent::Failed { waited });
            }
        }
    }

    /// Acts on deadlines, and gives a deadline to what has just been sent.
    pub(super) fn handle_timeout(&mut self, now: Time) {
        if now < self.poll_timeout() {
            return;
        }
        match self.state {
            State::Closed | State::Seeking { .. } | State::Free | State::Waiting { .. } => {}
            State::Beginning { since, then } => self.begin_finding(now, since, then),
            State::Finding { .. } => self.advance_finding(now),
            State::Asked {
                request,
                deadline: None,
                ..
            } => self.await_until(now + self.reply_time(&request)),
            State::Asked { urgency, .. } => self.reply_missing(now, urgency),
            State::Quiet {
                until: None, then, ..
            } => self.be_quiet(now, then),
            State::Quiet { then, .. } => self.ask_fence(0, then),
            State::Fencing { deadline: None, .. } => {
                let fence = self.fence_request();
                self.await_until(now + self.reply_time(&fence));
            }
            State::Fencing { fences, then, .. } if fences + 1 < FENCES => {
                self.ask_fence(fences + 1, then);
            }
            State::Fencing { then, .. } => self.begin_finding(now, now, then),
        }
    }

    const fn await_until(&mut self, at: Time) {
        if let State::Asked { deadline, .. } | State::Fencing { deadline, .. } = &mut self.state {
            *deadline = Some(at);
        }
    }

    fn begin_finding(&mut self, now: Time, since: Time, then: Then) {
        self.counts.searches += 1;
        self.lines.clear();
        let finding = Finding::begin(now, since, self.baud, &self.timeouts, &mut self.outbox);
        self.state = State::Finding {
            finding,
            since,
            then,
        };
    }

    fn advance_finding(&mut self, now: Time) {
        self.lines.clear();
        if let State::Finding { finding, .. } = &mut self.state {
            let found = finding.handle_timeout(now, &self.timeouts, &mut self.outbox);
            self.found(now, found);
        }
    }

    fn reply_time(&self, request: &Request) -> Duration {
        span(request.emit().len() + REPLY_BYTES, self.baud) + self.timeouts.reply
    }
}

/// Whether a reply can answer a command: what cannot is older.
const fn fits(command: Command, reply: &Reply) -> bool {
    match (command, reply) {
        (_, Reply::Error(_))
        | (Command::Set { .. } | Command::Trajectory(_) | Command::Reset, Reply::Ok)
        | (Command::Get { .. }, Reply::Value(_)) => true,
        (_, Reply::Ok | Reply::Value(_) | Reply::Register(_)) => false,
    }
}
