//! Finding the amplifier at the cable, at whatever rate it is, and bringing it to the line's.
//!
//! Asked first at the line's own rate: it may be there since the last session, and then nothing
//! is disturbed. Otherwise a BREAK brings it to 9600 bit/s (guide, p. 7), and `s r0x90` from there
//! to the line's rate. Its `ok` comes at the new rate before the host has changed, so that it is
//! not waited for; the rate is read instead, after the 100 ms for which the amplifier may be deaf
//! (p. 42). All of it is about the amplifier at the cable, whichever axis asks.

use core::time::Duration;
use std::collections::VecDeque;

use units::Time;
use wire::copley::{Address, BAUD_AT_RESET, Bank, Command, Parameter, Reply, Request};
use wire::{LineControl, Payload};

use super::settings::CopleyTimeouts;

/// Longer than any byte at 9600 bit/s.
const BREAK: Duration = Duration::from_millis(20);
/// After a BREAK and after a change of our own rate.
const REST: Duration = Duration::from_millis(5);
/// The amplifier's after a change of its rate (p. 42).
const DEAF: Duration = Duration::from_millis(110);
/// How often one rate is tried before the next: what an amplifier heard at a wrong rate spoils
/// the first command at the right one.
const TRIES: u32 = 3;
/// The amplifier's rate is only about the one that was set (p. 42).
const RATE_TOLERANCE_PERCENT: i64 = 5;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    /// The rate was set; the question follows.
    Resting { rate: u32, tries: u32 },
    /// Asked for its rate.
    Probing { rate: u32, tries: u32 },
    /// The line is held low.
    Breaking,
    /// The new rate was sent.
    Switching,
}

/// How it went.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Found {
    NotYet,
    Yes,
    No,
}

/// The search under way; it holds the line.
#[derive(Clone, Copy, Debug)]
pub(super) struct Finding {
    rate: u32,
    stage: Stage,
    wake: Time,
    deadline: Time,
    /// It was asked at every rate that it can be at.
    asked_everywhere: bool,
}

impl Finding {
    /// Begins at the line's own rate. `since` when this axis has wanted to: while it waited for its
    /// turn another one has looked for the same amplifier, so that time counts, and each rate is
    /// tried once at least.
    pub(super) fn begin(
        now: Time,
        since: Time,
        rate: u32,
        timeouts: &CopleyTimeouts,
        out: &mut VecDeque<Payload>,
    ) -> Self {
        let mut finding = Self {
            rate,
            stage: Stage::Resting { rate, tries: 0 },
            wake: now,
            deadline: since + timeouts.find,
            asked_everywhere: false,
        };
        finding.try_rate(now, rate, REST, out);
        finding
    }

    pub(super) const fn poll_timeout(&self) -> Time {
        self.wake
    }

    fn try_rate(&mut self, now: Time, rate: u32, rest: Duration, out: &mut VecDeque<Payload>) {
        out.push_back(Payload::Control(LineControl::Baud(rate)));
        self.stage = Stage::Resting { rate, tries: 0 };
        self.wake = now + rest;
    }

    fn say(&self, command: Command, rate: u32, out: &mut VecDeque<Payload>) -> Duration {
        let request = Request {
            address: Address::GATEWAY,
            command,
        };
        let bytes = request.emit();
        let span = span(bytes.len(), rate);
        out.push_back(Payload::Bytes(bytes));
        span
    }

    /// A line that came in.
    pub(super) fn line(
        &mut self,
        now: Time,
        line: &[u8],
        timeouts: &CopleyTimeouts,
        out: &mut VecDeque<Payload>,
    ) -> Found {
        let Stage::Probing { rate, .. } = self.stage else {
            return Found::NotYet;
        };
        let answer = Reply::parse(line).ok().and_then(|reply| reply.number());
        let wanted = i64::from(rate);
        let fits = answer
            .is_some_and(|seen| (seen - wanted).abs() * 100 <= wanted * RATE_TOLERANCE_PERCENT);
        if !fits {
            return Found::NotYet;
        }
        if rate == self.rate {
            return Found::Yes;
        }
        let switch = Command::Set {
            bank: Bank::Ram,
            parameter: Parameter::BAUD,
            value: self.rate.into(),
        };
        let span = self.say(switch, rate, out);
        self.stage = Stage::Switching;
        self.wake = now + span + timeouts.drain;
        Found::NotYet
    }

    /// What is due at `now`.
    pub(super) fn handle_timeout(
        &mut self,
        now: Time,
        timeouts: &CopleyTimeouts,
        out: &mut VecDeque<Payload>,
    ) -> Found {
        if now < self.wake {
            return Found::NotYet;
        }
        match self.stage {
            Stage::Resting { rate, tries } => {
                let ask = Command::Get {
                    bank: Bank::Ram,
                    parameter: Parameter::BAUD,
                };
                let span = self.say(ask, rate, out) * 2;
                self.stage = Stage::Probing { rate, tries };
                self.wake = now + span + timeouts.reply;
            }
            Stage::Probing { rate, tries } if tries + 1 < TRIES => {
                let tries = tries + 1;
                self.stage = Stage::Resting { rate, tries };
            }
            Stage::Probing { .. } if self.asked_everywhere && now >= self.deadline => {
                return Found::No;
            }
            Stage::Probing { rate, .. } if rate == self.rate => {
                out.push_back(Payload::Control(LineControl::Break(true)));
                self.stage = Stage::Breaking;
                self.wake = now + BREAK;
            }
            Stage::Probing { .. } => {
                let rate = self.rate;
                self.try_rate(now, rate, REST, out);
            }
            Stage::Breaking => {
                out.push_back(Payload::Control(LineControl::Break(false)));
                self.asked_everywhere = true;
                self.try_rate(now, BAUD_AT_RESET, REST, out);
            }
            Stage::Switching => {
                let rate = self.rate;
                self.try_rate(now, rate, DEAF, out);
            }
        }
        Found::NotYet
    }
}

/// How long `bytes` take at `rate`.
pub(super) fn span(bytes: usize, rate: u32) -> Duration {
    const BITS_PER_BYTE: u64 = 10;
    let bits = BITS_PER_BYTE * bytes as u64;
    Duration::from_nanos(bits * 1_000_000_000 / u64::from(rate.max(1)))
}
