//! A calibration that is verified at once: what was stored is told, whatever becomes of its verification.

use std::path::PathBuf;

use serde_json::Value;

use super::CalibrateArgs;
use super::output::{Ended, Output, with_counters};
use crate::Failure;
use crate::run::CalibrateOptions;
use crate::runs::Told;

/// A verification, and what it fails by.
pub(crate) type Verified = (Told, Option<Failure>);

/// Prints what was `made`, and how its verification `ended`, if there was one; with what the devices counted.
pub(crate) fn tried(
    made: Option<Told>,
    ended: Result<(Option<Verified>, Value), Failure>,
    output: Output,
) -> Ended {
    let Some(mut told) = made else {
        return ended.and(Ok(None));
    };
    let (verified, counters) = match ended {
        Ok(ended) => ended,
        Err(failure) => return output.bad_result(&told.text, told.value, failure),
    };
    let Some((then, bad)) = verified else {
        return output.told(told, counters);
    };
    told.append_verified(then);
    match bad {
        None => output.told(told, counters),
        Some(failure) => {
            output.bad_result(&told.text, with_counters(told.value, counters), failure)
        }
    }
}

/// Whether what was made is used, in the words of its kind: `what` is made ready.
pub(crate) fn used(what: &str, is_in_use: bool) -> String {
    match is_in_use {
        true => format!("{what} stored and activated"),
        false => format!("{what} stored; what was used before is used still"),
    }
}

impl CalibrateArgs {
    /// What becomes of what is found, before it is.
    pub(super) const fn then(&self) -> &'static str {
        match self.no_activate {
            true => "what was found is stored, and not used",
            false => "what was found is stored and used from then on",
        }
    }

    /// How it is made, by this journal if it goes on with one.
    pub(super) fn options(&self, resume: Option<PathBuf>) -> CalibrateOptions {
        CalibrateOptions {
            resume,
            accept_drift: self.accept_drift,
            aside: self.no_activate,
        }
    }
}
