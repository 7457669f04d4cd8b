//! What follows a reply that did not come.

use units::Time;
use wire::Payload;
use wire::copley::{Address, Bank, Command, ErrorCode, Parameter, Reply, Request};

use super::{Link, NOISE_MAX, State, Then};
use crate::device::Urgency;

impl Link {
    /// A stop is next: clean-up waits until it has gone.
    pub(in crate::device::copley) fn hurry(&mut self) {
        match self.state {
            State::Asked { .. } => self.hurried = true,
            State::Quiet { then, .. } | State::Fencing { then, .. } => {
                self.suspect = true;
                self.state = State::Free;
                if then != Then::Nothing {
                    self.tell_lost();
                }
            }
            State::Closed
            | State::Seeking { .. }
            | State::Beginning { .. }
            | State::Finding { .. }
            | State::Free
            | State::Waiting { .. } => {}
        }
    }

    pub(super) fn reply_missing(&mut self, now: Time, urgency: Urgency) {
        if core::mem::take(&mut self.hurried) || urgency == Urgency::Stop {
            self.suspect = true;
            self.state = State::Free;
            self.tell_lost();
        } else {
            self.be_quiet(now, Then::TellLost);
        }
    }

    pub(super) fn be_quiet(&mut self, now: Time, then: Then) {
        self.lines.clear();
        self.state = State::Quiet {
            until: Some(now + self.timeouts.quiet),
            limit: now + self.timeouts.quiet * NOISE_MAX,
            then,
        };
    }

    pub(super) fn fence_request(&self) -> Request {
        match self.serial {
            Some(_) => Request {
                address: self.address,
                command: Command::Get {
                    bank: Bank::Flash,
                    parameter: Parameter::SERIAL_NUMBER,
                },
            },
            None => Request {
                address: Address::GATEWAY,
                command: Command::Get {
                    bank: Bank::Ram,
                    parameter: Parameter::BAUD,
                },
            },
        }
    }

    pub(super) fn ask_fence(&mut self, fences: u32, then: Then) {
        self.lines.clear();
        let bytes = self.fence_request().emit();
        self.outbox.push_back(Payload::Bytes(bytes));
        self.state = State::Fencing {
            fences,
            deadline: None,
            then,
        };
    }

    pub(super) fn fence(&mut self, then: Then, line: &[u8]) {
        let reply = Reply::parse(line);
        let unreachable = reply == Ok(Reply::Error(ErrorCode::CanFailed));
        let fits = match (self.serial, &reply) {
            (Some(serial), Ok(reply)) => reply.number() == Some(serial),
            // Before the serial number is known, a number is all that can be told.
            (None, Ok(reply)) => reply.number().is_some(),
            (_, Err(_)) => false,
        };
        if fits || unreachable {
            self.clean(then);
        } else {
            self.counts.late += 1;
        }
    }

    /// Nothing old is under way any more.
    fn clean(&mut self, then: Then) {
        self.suspect = false;
        self.state = State::Free;
        match then {
            Then::Nothing => {}
            Then::TellLost => self.tell_lost(),
            Then::Ask(request, urgency) => self.send(request, urgency, 0),
        }
    }
}
