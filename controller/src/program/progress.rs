//! Progress bars with the time left.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use machine::{Observer, Stage};

/// One bar for the procedure that runs.
pub(crate) struct Bars {
    current: Option<(Stage, ProgressBar)>,
    hidden: bool,
}

impl Bars {
    /// Drawn on stderr, and only where that is a terminal.
    pub(crate) const fn new(hidden: bool) -> Self {
        Self {
            current: None,
            hidden,
        }
    }

    fn start(&self, stage: Stage, axis: &str, total: u64) -> ProgressBar {
        let target = if self.hidden {
            ProgressDrawTarget::hidden()
        } else {
            ProgressDrawTarget::stderr()
        };
        let bar = ProgressBar::with_draw_target(Some(total), target);
        let template = "  {msg:<14} [{bar:32}] {pos:>4}/{len:<4} {eta:>4} left";
        let style = ProgressStyle::with_template(template).expect("the template is constant");
        bar.set_style(style.progress_chars("=> "));
        bar.set_message(format!("{} {axis}", stage.text()));
        bar.enable_steady_tick(Duration::from_millis(200));
        bar
    }
}

impl Bars {
    /// A line on stderr, above a bar that is drawn there.
    fn say(&self, line: &str) {
        match &self.current {
            Some((_, bar)) if !bar.is_finished() => bar.suspend(|| eprintln!("{line}")),
            _ => eprintln!("{line}"),
        }
    }
}

impl Observer for Bars {
    fn progress(&mut self, stage: Stage, axis: &str, done: u64, total: u64) {
        let running =
            matches!(&self.current, Some((shown, bar)) if *shown == stage && !bar.is_finished());
        if !running {
            self.current = Some((stage, self.start(stage, axis, total)));
        }
        let Some((_, bar)) = &self.current else {
            return;
        };
        bar.set_position(done);
        if done >= total {
            bar.finish_and_clear();
        }
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
        if let Some((_, bar)) = &self.current {
            bar.finish_and_clear();
        }
    }
}
