//! How far a procedure has come: a bar with the time left on a terminal, a line every few seconds elsewhere.

mod account;
mod lines;

use core::time::Duration;
use std::io::IsTerminal as _;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use machine::{Observer, Stage};
use units::Time;

use account::Sign;
use lines::Lines;
pub(in crate::program) use lines::settle;

/// What is shown of the procedure that runs.
pub(crate) struct Bars(Shown);

/// Where it is shown.
enum Shown {
    /// A bar on standard error.
    Terminal(Option<(Stage, ProgressBar)>),
    /// Lines there.
    Lines(Lines),
    /// Warnings, and nothing else.
    Hidden,
    /// Nothing at all.
    Nowhere,
}

impl Bars {
    /// On standard error: bars where that is a terminal, unless they `are_hidden`, and lines where it is none.
    pub(crate) fn new(are_hidden: bool) -> Self {
        Self(match (std::io::stderr().is_terminal(), are_hidden) {
            (false, _) => Shown::Lines(Lines::new()),
            (true, true) => Shown::Hidden,
            (true, false) => Shown::Terminal(None),
        })
    }

    /// Nothing is shown.
    pub(crate) const fn none() -> Self {
        Self(Shown::Nowhere)
    }

    /// Of an emulated machine that lives as fast as the computer goes: bars, or nothing.
    pub(crate) fn of_demonstration(are_hidden: bool) -> Self {
        Self(match are_hidden || !std::io::stderr().is_terminal() {
            true => Shown::Hidden,
            false => Shown::Terminal(None),
        })
    }

    /// A line on stderr, above a bar that is drawn there.
    fn say(&self, line: String) {
        match &self.0 {
            Shown::Nowhere => {}
            Shown::Lines(lines) => lines.say(line),
            Shown::Terminal(Some((_, bar))) if !bar.is_finished() => {
                bar.suspend(|| eprintln!("{line}"));
            }
            Shown::Terminal(_) | Shown::Hidden => eprintln!("{line}"),
        }
    }
}

fn bar_of(stage: Stage, axis: &str, total: u64) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(total), ProgressDrawTarget::stderr());
    let template = "  {msg:<14} [{bar:32}] {pos:>4}/{len:<4} {eta:>4} left";
    let style = ProgressStyle::with_template(template).expect("the template is constant");
    bar.set_style(style.progress_chars("=> "));
    bar.set_message(format!("{} {axis}", stage.text()));
    bar.enable_steady_tick(Duration::from_millis(200));
    bar
}

impl Observer for Bars {
    fn progress(&mut self, stage: Stage, axis: &str, done: u64, total: u64) {
        let shown = match &mut self.0 {
            Shown::Hidden | Shown::Nowhere => return,
            Shown::Lines(lines) => {
                let axis = axis.to_owned();
                return lines.note(Sign::Progress {
                    stage,
                    axis,
                    done,
                    total,
                });
            }
            Shown::Terminal(shown) => shown,
        };
        let running = matches!(shown, Some((of, bar)) if *of == stage && !bar.is_finished());
        if !running {
            *shown = Some((stage, bar_of(stage, axis, total)));
        }
        let Some((_, bar)) = shown else {
            return;
        };
        bar.set_position(done);
        if done >= total {
            bar.finish_and_clear();
        }
    }

    fn begins(&mut self, stage: Stage, axis: &str, takes: Duration) {
        if let Shown::Lines(lines) = &self.0 {
            let axis = axis.to_owned();
            lines.note(Sign::Begins { stage, axis, takes });
        }
    }

    fn lives(&mut self, now: Time) {
        if let Shown::Lines(lines) = &self.0 {
            lines.note(Sign::Lives(now));
        }
    }

    fn warning(&mut self, text: &str) {
        self.say(format!("warning: {text}"));
    }

    fn waiting(&mut self, text: &str) {
        self.say(format!("  {text}"));
    }
}

impl Drop for Bars {
    fn drop(&mut self) {
        if let Shown::Terminal(Some((_, bar))) = &self.0 {
            bar.finish_and_clear();
        }
    }
}
