//! How often one caller may ask.

use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// So many callers are told apart before those who have been quiet are forgotten.
const CALLERS_MAX: usize = 1024;

/// So many requests a second, and so many at once after a pause.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rate {
    pub(super) a_second: f64,
    pub(super) at_once: f64,
}

/// What each caller has left: it fills up with time, and each request takes one.
#[derive(Debug)]
pub(super) struct Rates {
    rate: Rate,
    callers: Mutex<HashMap<String, Left>>,
}

#[derive(Clone, Copy, Debug)]
struct Left {
    count: f64,
    at: Instant,
}

impl Rates {
    pub(super) fn new(rate: Rate) -> Self {
        Self {
            rate,
            callers: Mutex::default(),
        }
    }

    /// Takes one of `caller`'s requests at `now`.
    ///
    /// # Errors
    /// When none is left: after how long there is one again.
    pub(super) fn take(&self, caller: &str, now: Instant) -> Result<(), Duration> {
        let mut callers = self.callers.lock().unwrap_or_else(PoisonError::into_inner);
        if callers.len() >= CALLERS_MAX && !callers.contains_key(caller) {
            callers.retain(|_, left| self.filled(*left, now) < self.rate.at_once);
            if callers.len() >= CALLERS_MAX {
                // So many that all ask at once are no callers of a machine: they share what one has.
                callers.clear();
            }
        }
        let new = Left {
            count: self.rate.at_once,
            at: now,
        };
        let left = callers.entry(caller.to_owned()).or_insert(new);
        let count = self.filled(*left, now);
        let taken = if count >= 1.0 { 1.0 } else { 0.0 };
        *left = Left {
            count: count - taken,
            at: now,
        };
        match taken > 0.0 {
            true => Ok(()),
            false => Err(Duration::from_secs_f64((1.0 - count) / self.rate.a_second)),
        }
    }

    fn filled(&self, left: Left, now: Instant) -> f64 {
        let seconds = now.saturating_duration_since(left.at).as_secs_f64();
        (left.count + seconds * self.rate.a_second).min(self.rate.at_once)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE: Rate = Rate {
        a_second: 10.0,
        at_once: 3.0,
    };

    #[test]
    fn who_asks_too_often_waits_and_nobody_else_does() {
        let (rates, begun) = (Rates::new(RATE), Instant::now());
        for _ in 0..3 {
            assert_eq!(rates.take("anna", begun), Ok(()));
        }
        let wait = rates.take("anna", begun).unwrap_err();
        assert!((wait.as_secs_f64() - 0.1).abs() < 1e-9, "{wait:?}");
        assert_eq!(rates.take("otto", begun), Ok(()));
        let later = begun + Duration::from_millis(101);
        assert_eq!(rates.take("anna", later), Ok(()));
        assert!(rates.take("anna", later).is_err());
        // In the long run it is the rate, whatever is tried meanwhile.
        let granted = (0..10_000u32).filter(|ms| {
            rates
                .take("anna", later + Duration::from_millis((*ms).into()))
                .is_ok()
        });
        let granted = granted.count();
        assert!((99..=101).contains(&granted), "{granted}");
    }

    #[test]
    fn callers_that_are_invented_do_not_fill_the_memory() {
        let (rates, begun) = (Rates::new(RATE), Instant::now());
        for caller in 0..10 * CALLERS_MAX {
            let _ = rates.take(&caller.to_string(), begun);
        }
        assert!(rates.callers.lock().unwrap().len() <= CALLERS_MAX);
    }
}
