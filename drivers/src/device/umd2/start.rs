//! Waiting for good samples in a row.

use units::Time;

use super::{NAME, State, Umd2};
use crate::device::{Alarm, DeviceError, Seen};

impl Umd2 {
    pub(super) const fn start_again(&mut self, since: Time, fault: Option<Alarm>) {
        let good = 0;
        self.state = State::Starting { since, good, fault };
    }

    /// What its samples say is the cause, where they do.
    pub(super) fn start_ended(&mut self, now: Time, since: Time, good: u32, fault: Option<Alarm>) {
        let waited = now.since(since);
        if waited >= self.settings.start_timeout {
            self.state = State::Idle;
            self.outcome = Some(Err(match fault {
                Some(alarm) => DeviceError::Alarmed {
                    device: NAME,
                    step: "start",
                    alarm,
                },
                None => DeviceError::Timeout {
                    device: NAME,
                    awaited: "good samples in a row",
                    waited,
                    seen: Seen::Samples(good),
                },
            }));
        }
    }
}
