//! Account of a procedure that runs: a line every few seconds of the machine's clock, and a bar.

use core::time::Duration;

use machine::Stage;
use units::Time;

/// From line to line, when nothing is late. Signs come twice a second, so that no silence is longer than five.
const EVERY: Duration = Duration::from_secs(4);

/// The length of a bar.
const BAR: u64 = 32;

/// What an observer is told.
#[derive(Clone, Debug)]
pub(in crate::program) enum Sign {
    /// The machine lives.
    Lives(Time),
    /// Steps of a stage are done.
    Progress {
        stage: Stage,
        axis: String,
        done: u64,
        total: u64,
    },
    /// Something begins that takes so long.
    Begins {
        stage: Stage,
        axis: String,
        takes: Duration,
    },
}

/// What is being done, and since when.
struct Task {
    stage: Stage,
    axis: String,
    begun: Time,
    measure: Measure,
}

/// By what it is known how far it has come.
enum Measure {
    Steps {
        first: u64,
        done: u64,
        total: u64,
        /// When the last one was done.
        at: Time,
    },
    Takes(Duration),
}

/// Keeps account of what is done.
#[derive(Default)]
pub(in crate::program) struct Account {
    /// The first sign of life, and the last one.
    lived: Option<(Time, Time)>,
    /// When the last line was said.
    told: Time,
    task: Option<Task>,
}

impl Account {
    /// Takes note of `sign`; the line that is now to be said.
    pub(super) fn take(&mut self, sign: Sign) -> Option<String> {
        match sign {
            Sign::Lives(now) => self.lives(now),
            Sign::Begins { stage, axis, takes } => {
                self.begin(stage, axis, Measure::Takes(takes));
                None
            }
            Sign::Progress {
                stage,
                axis,
                done,
                total,
            } => {
                self.note(stage, axis, [done, total]);
                None
            }
        }
    }

    /// The bar of what is being done, without the end of its line.
    pub(super) fn bar(&self) -> Option<String> {
        let now = self.now();
        self.task.as_ref().map(|task| task.bar(now))
    }

    fn now(&self) -> Time {
        self.lived.map_or(Time::ZERO, |it| it.1)
    }

    fn begin(&mut self, stage: Stage, axis: String, measure: Measure) {
        self.task = Some(Task {
            stage,
            axis,
            begun: self.now(),
            measure,
        });
    }

    fn note(&mut self, stage: Stage, axis: String, [seen, of]: [u64; 2]) {
        let now = self.now();
        if seen >= of {
            self.task = None;
            return;
        }
        let same = self.task.as_mut();
        let same = same.filter(|it| it.stage == stage && it.axis == axis);
        if let Some(Task {
            measure: Measure::Steps {
                done, total, at, ..
            },
            ..
        }) = same
            && *done <= seen
        {
            (*done, *total, *at) = (seen, of, now);
            return;
        }
        let steps = Measure::Steps {
            first: seen,
            done: seen,
            total: of,
            at: now,
        };
        self.begin(stage, axis, steps);
    }

    fn lives(&mut self, now: Time) -> Option<String> {
        let Some((first, last)) = &mut self.lived else {
            self.lived = Some((now, now));
            self.told = now;
            return None;
        };
        *last = now;
        let first = *first;
        if now < self.told + EVERY {
            return None;
        }
        self.told = now;
        let since = now.since(first).as_secs_f64();
        let what = self
            .task
            .as_ref()
            .map_or_else(|| "at work".into(), |it| it.text(now));
        Some(format!("  at {since:.0} s: {what}"))
    }
}

impl Task {
    fn text(&self, now: Time) -> String {
        let name = format!("{} {}", self.stage.text(), self.axis);
        let left = self.left(now);
        let left = left.map_or_else(String::new, |it| {
            format!(", {:.0} s left", it.as_secs_f64())
        });
        match &self.measure {
            Measure::Steps { done, total, .. } => format!("{name}, {done} of {total} done{left}"),
            Measure::Takes(_) => format!("{name}{left}"),
        }
    }

    fn bar(&self, now: Time) -> String {
        let Measure::Steps { done, total, .. } = &self.measure else {
            return format!("  {}", self.text(now));
        };
        let name = format!("{} {}", self.stage.text(), self.axis);
        let filled = usize::try_from(done * BAR / (*total).max(1)).unwrap_or(0);
        let mut bar = "=".repeat(filled) + ">";
        bar.truncate(BAR as usize);
        let left = self.left(now);
        let left = left.map_or_else(String::new, |left| {
            format!(" {:>4} left", format!("{:.0}s", left.as_secs_f64()))
        });
        format!("  {name:<14} [{bar:<32}] {done:>4}/{total:<4}{left}")
    }

    /// How much longer it takes, if it goes on as it went; `None` where that is not known, or has proved wrong.
    fn left(&self, now: Time) -> Option<Duration> {
        let gone = now.since(self.begun);
        match &self.measure {
            Measure::Takes(takes) => Some(takes.saturating_sub(gone)),
            Measure::Steps {
                first,
                done,
                total,
                at,
            } => {
                let behind = done.checked_sub(*first).filter(|it| *it > 0)?;
                let each = at.since(self.begun).as_secs_f64() / behind as f64;
                let all = Duration::from_secs_f64(each * (total - done) as f64);
                all.checked_sub(now.since(*at))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn steps(stage: Stage, done: u64, total: u64) -> Sign {
        let axis = "x".to_owned();
        Sign::Progress {
            stage,
            axis,
            done,
            total,
        }
    }

    /// What is said from one time to another, in half seconds.
    fn said(account: &mut Account, from_s: f64, to_s: f64) -> Vec<String> {
        let first = (from_s * 2.0) as u32;
        let signs = first..=(to_s * 2.0) as u32;
        let times = signs.map(|it| Time::from_seconds(100.0 + f64::from(it) / 2.0));
        times
            .filter_map(|it| account.take(Sign::Lives(it)))
            .collect()
    }

    #[test]
    fn a_line_comes_every_few_seconds_with_what_is_left() {
        let mut it = Account::default();
        assert_eq!(said(&mut it, 0.0, 5.0), ["  at 4 s: at work"]);
        assert_eq!(it.take(steps(Stage::Calibrate, 0, 10)), None);
        assert_eq!(
            said(&mut it, 5.5, 9.0),
            ["  at 8 s: calibrate x, 0 of 10 done"]
        );
        it.take(steps(Stage::Calibrate, 2, 10));
        // Two in four seconds; the ninth second is gone when the line is said at the twelfth.
        assert_eq!(
            said(&mut it, 9.5, 13.0),
            ["  at 12 s: calibrate x, 2 of 10 done, 13 s left"]
        );
        // Nothing comes to its end for long: nobody knows what is left.
        let late = said(&mut it, 13.5, 40.0);
        assert_eq!(late.last().unwrap(), "  at 40 s: calibrate x, 2 of 10 done");
        it.take(steps(Stage::Calibrate, 10, 10));
        assert_eq!(said(&mut it, 40.5, 44.0), ["  at 44 s: at work"]);
    }

    #[test]
    fn what_takes_a_known_time_says_what_is_left_of_it() {
        let mut it = Account::default();
        said(&mut it, 0.0, 3.0);
        let (stage, axis) = (Stage::Job, "volume".to_owned());
        let takes = Duration::from_secs(10);
        it.take(Sign::Begins { stage, axis, takes });
        let expected = [
            "  at 4 s: run volume, 9 s left",
            "  at 8 s: run volume, 5 s left",
        ];
        assert_eq!(said(&mut it, 3.5, 8.0), expected);
    }

    #[test]
    fn another_stage_and_one_that_begins_anew_count_from_their_own_beginning() {
        let mut it = Account::default();
        said(&mut it, 0.0, 0.5);
        it.take(steps(Stage::Zero, 0, 4));
        said(&mut it, 1.0, 2.5);
        it.take(steps(Stage::Zero, 2, 4));
        it.take(steps(Stage::Verify, 1, 4));
        assert_eq!(said(&mut it, 3.0, 4.0), ["  at 4 s: verify x, 1 of 4 done"]);
        it.take(steps(Stage::Verify, 0, 4));
        assert_eq!(said(&mut it, 4.5, 8.0), ["  at 8 s: verify x, 0 of 4 done"]);
    }
}
