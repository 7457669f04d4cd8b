//! What the observer is told, now or when there is time for it.

use core::time::Duration;

use units::{LengthOrAngle, Time};

use crate::observer::{Observer, Silent};

/// So many warnings are kept for later: as many as anybody reads.
const WARNINGS_HELD: usize = 32;

/// From one sign of life to the next.
const SIGNS: Duration = Duration::from_millis(500);

/// The observer, and the warnings for which there is no time now: whoever takes them may make their
/// writer wait.
pub(crate) struct Notices {
    pub(crate) observer: Box<dyn Observer>,
    held_back: Option<Vec<String>>,
    /// When the observer hears the next time that the machine lives.
    next_sign: Time,
}

impl Default for Notices {
    fn default() -> Self {
        Self {
            observer: Box::new(Silent),
            held_back: None,
            next_sign: Time::ZERO,
        }
    }
}

impl Notices {
    /// Tells the observer, or keeps it for later while a loop must not wait for him.
    pub(crate) fn warn(&mut self, text: String) {
        match &mut self.held_back {
            None => self.observer.warning(&text),
            Some(held) if held.len() < held.capacity() => held.push(text),
            Some(_) => {}
        }
    }

    /// Tells the observer now and then that the machine lives, also while a loop must not wait.
    pub(crate) fn lives(&mut self, now: Time) {
        if now >= self.next_sign {
            self.next_sign = now + SIGNS;
            self.observer.lives(now);
        }
    }

    /// Nothing is told from now on.
    pub(crate) fn hold_back(&mut self) {
        self.held_back = Some(Vec::with_capacity(WARNINGS_HELD));
    }

    /// What was held back is told, and all that follows.
    pub(crate) fn let_go(&mut self) {
        for text in self.held_back.take().unwrap_or_default() {
            self.observer.warning(&text);
        }
    }

    /// The stop of `axis` ended before it was seen to stand.
    pub(crate) fn warn_restless(&mut self, axis: &str, speed: Option<LengthOrAngle>) {
        let seen = match speed {
            Some(speed) => {
                format!("is still moving, at {speed:+.1}/s, and its drive has no torque")
            }
            None => "said nothing of its place since its drive was switched off".to_owned(),
        };
        self.observer.warning(&format!(
            "axis {axis} {seen}: make sure that it stands still before you reach in"
        ));
    }

    /// The operator must not read "stopped" of an axis that did not say so. `why`: what is known of that.
    pub(crate) fn warn_unconfirmed(&mut self, axis: &str, why: &str, stops_itself: bool) {
        let itself = match stops_itself {
            true => "its drive watches our heartbeat, and stops by itself once it does not hear it",
            false => {
                "nothing is known by which its drive would stop by itself: switch off its power"
            }
        };
        self.observer.warning(&format!(
            "axis {axis} did not confirm that it stopped: {why}; {itself}; make sure that it stands still before you \
             reach in"
        ));
    }
}
