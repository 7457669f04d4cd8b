//! One exchange after the other: the steps of a command, and readings of the state in between.

use core::time::Duration;
use units::{Coordinate, Time};
use wire::copley::{Command, Parameter, Reply, Request};

use super::link::LinkEvent;
use super::script::{Script, Step, Wanted};
use super::{Activity, CopleyAxis, Purpose};
use crate::device::{DeviceError, LineUse, Seen, Urgency};

/// How often a step whose answer was lost is asked again, where that changes nothing.
const RETRIES: u32 = 2;

impl<Q: Coordinate> CopleyAxis<Q> {
    /// Begins a list of exchanges, before anything else.
    pub(super) fn run(&mut self, now: Time, steps: Vec<Step>, urgency: Urgency) {
        self.script = Script::new(steps, urgency, now);
        // A look that has not been sent yet can wait.
        if !matches!(self.purpose, Purpose::Nothing) && self.link_waits() {
            self.link.cancel();
            self.purpose = Purpose::Nothing;
        }
        if urgency == Urgency::Stop {
            self.link.hurry();
        }
    }

    fn link_waits(&self) -> bool {
        matches!(self.link.line_use(), LineUse::Wants { .. }) && self.link.is_open()
    }

    /// The next look begins now, and all of it comes after this moment.
    pub(super) fn look_anew(&mut self, now: Time) {
        if let Purpose::Look(_) = self.purpose {
            self.purpose = Purpose::Nothing;
            self.link.cancel();
        }
        self.look.round.clear();
        self.look.due = now;
    }

    /// Gives the link its next exchange.
    fn feed(&mut self, now: Time) {
        if !self.link.is_free() {
            return;
        }
        if let Some(step) = self.script.steps.front() {
            let (command, urgency, since) = (step.command, self.script.urgency, self.script.since);
            self.purpose = Purpose::Step;
            self.ask(command, urgency, since);
        } else if self.look.active && self.look.due <= now {
            self.ask_look(now);
        }
    }

    pub(super) fn ask(&mut self, command: Command, urgency: Urgency, since: Time) {
        let address = self.settings.address;
        self.link.ask(Request { address, command }, urgency, since);
    }

    pub(super) fn pump(&mut self, now: Time) {
        while let Some(event) = self.link.poll_event() {
            match event {
                LinkEvent::Opened => self.opened(now),
                LinkEvent::Reply(reply) => {
                    self.look.heard = now;
                    self.told_silence = false;
                    match core::mem::replace(&mut self.purpose, Purpose::Nothing) {
                        Purpose::Nothing => {}
                        Purpose::Step => self.step_answered(now, reply),
                        Purpose::Look(parameter) => self.look_answered(now, parameter, &reply),
                    }
                }
                LinkEvent::Lost => match core::mem::replace(&mut self.purpose, Purpose::Nothing) {
                    Purpose::Nothing => {}
                    Purpose::Step => self.step_lost(now),
                    Purpose::Look(_) => self.look_lost(now),
                },
                LinkEvent::Failed { waited } => self.link_failed(waited),
            }
            self.feed(now);
        }
        self.feed(now);
    }

    fn link_failed(&mut self, waited: Duration) {
        self.look.active = false;
        self.kept = false;
        self.purpose = Purpose::Nothing;
        if !matches!(self.activity, Activity::Idle) {
            let awaited = "an answer from the amplifier with address 0, at the line's rate or, \
                           after a BREAK, at 9600 bit/s";
            let error = DeviceError::Timeout {
                device: self.name(),
                awaited,
                waited,
                seen: Seen::Nothing,
            };
            self.finish(Err(error));
        }
    }

    pub(super) fn step_answered(&mut self, now: Time, reply: Reply) {
        let Some(step) = self.script.steps.front().copied() else {
            return;
        };
        match (step.wanted, reply) {
            (_, Reply::Error(_)) if step.optional => {}
            (_, Reply::Error(code)) => {
                let error = DeviceError::RefusedByAmplifier {
                    device: self.name(),
                    parameter: step.parameter(),
                    code,
                    step: step.text,
                };
                return self.finish(Err(error));
            }
            (Wanted::Ok, _) => {}
            (Wanted::Value, Reply::Value(value)) => {
                if let Some(parameter) = step.parameter() {
                    self.script.keep(parameter, value);
                }
            }
            (Wanted::Exactly(expected), reply) => {
                if reply.number() != Some(expected) {
                    return self.other_than_written(step, expected, reply);
                }
            }
            // The link lets no other reply through.
            (Wanted::Value, Reply::Ok | Reply::Register(_)) => {}
        }
        self.script.steps.pop_front();
        self.script.failures = 0;
        if self.script.steps.is_empty() {
            self.script_done(now);
        }
    }

    /// Perhaps only the answer's digits are wrong: it is read once more.
    fn other_than_written(&mut self, step: Step, expected: i64, reply: Reply) {
        self.script.failures += 1;
        if self.script.failures <= 1 {
            return;
        }
        let seen = match reply {
            Reply::Value(value) => value,
            Reply::Ok | Reply::Register(_) | Reply::Error(_) => String::new(),
        };
        let error = DeviceError::ParameterReadBack {
            device: self.name(),
            parameter: step.parameter().unwrap_or(Parameter(0)),
            expected,
            seen,
            step: step.text,
        };
        self.finish(Err(error));
    }

    pub(super) fn step_lost(&mut self, now: Time) {
        let Some(step) = self.script.steps.front().copied() else {
            return;
        };
        self.script.failures += 1;
        if step.repeatable && self.script.failures <= RETRIES {
            return;
        }
        match self.activity {
            Activity::Motion(_) if !step.repeatable => self.start_unanswered(now),
            Activity::Homing(_) if !step.repeatable => self.homing_unanswered(now),
            Activity::Power(_) => self.power_unanswered(now, step),
            Activity::Idle
            | Activity::Starting(_)
            | Activity::Motion(_)
            | Activity::Halt(_)
            | Activity::Homing(_) => {
                let attempts = self.script.failures;
                let error = self.unanswered(step.text, attempts);
                self.finish(Err(error));
            }
        }
    }

    pub(super) const fn unanswered(&self, step: &'static str, attempts: u32) -> DeviceError {
        DeviceError::Unanswered {
            device: self.name(),
            step,
            attempts,
        }
    }
}
