//! Progress on standard error: a bar on a terminal, a line every few seconds elsewhere.

use super::account::{Account, Sign};

/// Goes to the begin of the line, which is then not broken at the edge of the screen.
const BEGIN: &str = "\r\x1b[?7l";
/// Clears the rest of the line, and breaks lines again.
const END: &str = "\x1b[K\x1b[?7h";

/// How progress is shown.
pub(in crate::program) enum Display {
    Nothing,
    Lines(Account),
    Bar(Bar),
}

/// A line of a terminal that is drawn again and again.
#[derive(Default)]
pub(in crate::program) struct Bar {
    account: Account,
    is_drawn: bool,
}

impl Display {
    pub(in crate::program) fn lines() -> Self {
        Self::Lines(Account::default())
    }

    pub(in crate::program) fn bar() -> Self {
        Self::Bar(Bar::default())
    }

    /// Takes note of `sign`, and returns what is to be written for it.
    pub(super) fn take(&mut self, sign: Sign) -> String {
        match self {
            Self::Nothing => String::new(),
            Self::Lines(account) => {
                let line = account.take(sign);
                line.map_or_else(String::new, |line| line + "\n")
            }
            Self::Bar(bar) => {
                bar.account.take(sign);
                match bar.account.bar() {
                    Some(line) => {
                        bar.is_drawn = true;
                        format!("{BEGIN}{line}{END}")
                    }
                    None => self.clear(),
                }
            }
        }
    }

    /// Clears what is drawn: the next sign draws it again.
    pub(super) fn clear(&mut self) -> String {
        match self {
            Self::Bar(bar) if bar.is_drawn => {
                bar.is_drawn = false;
                format!("{BEGIN}{END}")
            }
            Self::Nothing | Self::Lines(_) | Self::Bar(_) => String::new(),
        }
    }
}

#[cfg(test)]
mod tests {
    use machine::Stage;
    use units::Time;

    use super::*;

    fn steps(done: u64) -> Sign {
        Sign::Progress {
            stage: Stage::Calibrate,
            axis: "x".into(),
            done,
            total: 4,
        }
    }

    #[test]
    fn a_bar_is_drawn_in_one_line_and_cleared_at_its_end() {
        let mut display = Display::bar();
        assert_eq!(display.take(Sign::Lives(Time::ZERO)), "");
        display.take(steps(0));
        display.take(Sign::Lives(Time::from_seconds(3.0)));
        let shown = display.take(steps(1));
        assert_eq!(
            shown,
            "\r\x1b[?7l  calibrate x    [========>                       ]    1/4      9s left\x1b[K\x1b[?7h"
        );
        assert_eq!(display.take(steps(4)), "\r\x1b[?7l\x1b[K\x1b[?7h");
        assert_eq!(display.clear(), "", "nothing is drawn any more");
    }

    #[test]
    fn nothing_is_drawn_without_a_reader() {
        let mut display = Display::Nothing;
        assert_eq!(display.take(steps(1)) + &display.clear(), "");
    }
}
