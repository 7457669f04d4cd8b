//! Progress of a procedure as people see it: a bar with the time left on a terminal, a line every few seconds elsewhere.

use core::time::Duration;

use machine::{Observer, Stage};
use units::Time;

use crate::program::paint::is_dumb;
use crate::program::streams::{self, Display, Sign};

/// What is shown of the procedure that runs.
pub(crate) struct Bars {
    /// Whether warnings are said.
    speaks: bool,
}

impl Bars {
    /// On standard error: bars where that is a terminal, unless they `are_hidden`, and lines where it is none.
    pub(crate) fn new(are_hidden: bool) -> Self {
        match (streams::is_err_terminal() && !is_dumb(), are_hidden) {
            (false, _) => Self::on(Display::lines()),
            (true, true) => Self::on(Display::Nothing),
            (true, false) => Self::on(Display::bar()),
        }
    }

    /// Nothing is shown.
    pub(crate) fn none() -> Self {
        Self { speaks: false }
    }

    /// Of an emulated machine that lives as fast as the computer goes: bars, or nothing.
    pub(crate) fn of_demonstration(are_hidden: bool) -> Self {
        match are_hidden || !streams::is_err_terminal() || is_dumb() {
            true => Self::on(Display::Nothing),
            false => Self::on(Display::bar()),
        }
    }

    fn on(display: Display) -> Self {
        streams::display(display);
        Self { speaks: true }
    }

    fn say(&self, line: &str) {
        if self.speaks {
            streams::say(line);
        }
    }
}

impl Observer for Bars {
    fn progress(&mut self, stage: Stage, axis: &str, done: u64, total: u64) {
        let axis = axis.to_owned();
        streams::note(Sign::Progress {
            stage,
            axis,
            done,
            total,
        });
    }

    fn begins(&mut self, stage: Stage, axis: &str, takes: Duration) {
        let axis = axis.to_owned();
        streams::note(Sign::Begins { stage, axis, takes });
    }

    fn lives(&mut self, now: Time) {
        streams::note(Sign::Lives(now));
    }

    fn warning(&mut self, text: &str) {
        self.say(&format!("warning: {text}"));
    }

    fn waiting(&mut self, text: &str) {
        self.say(&format!("  {text}"));
    }
}

impl Drop for Bars {
    fn drop(&mut self) {
        streams::display(Display::Nothing);
    }
}
