//! Tells the service manager (systemd) that the machine is there, that its thread ticks, and that the service
//! ends: the protocol of sd_notify(3).
//!
//! What is told comes from a thread of its own, but only of what the machine's thread has published: without
//! a new tick there is no watchdog message, whatever else in this process still runs. Absent: reloading,
//! descriptors that a manager hands over.

use core::time::Duration;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver};
use std::thread::{self, Thread};
use std::time::Instant;

use sd_notify::NotifyState;

use crate::desk::Desk;
use crate::snapshot::{Fixed, Snapshot};
use crate::view::MachineState;

/// A manager that reads nothing holds the thread that tells up for no longer at the end.
const LAST_WORD: Duration = Duration::from_secs(1);
/// The longest time between two looks at what the machine's thread has published.
const LOOK_EVERY: Duration = Duration::from_millis(100);

type Tell = dyn Fn(&[NotifyState<'_>]) -> io::Result<()> + Send;

/// Who started this service and watches it.
pub struct Manager {
    tell: Box<Tell>,
    watchdog: Option<Duration>,
}

impl Manager {
    /// The one that `NOTIFY_SOCKET` names; there may be none.
    pub fn of_environment() -> Option<Self> {
        std::env::var_os("NOTIFY_SOCKET")?;
        Some(Self {
            tell: Box::new(sd_notify::notify),
            watchdog: sd_notify::watchdog_enabled(),
        })
    }

    /// Tells what people are shown as the state of the service.
    pub fn say(&self, text: &str) {
        // Whoever cannot be told says so when the service is ready.
        let _ = (self.tell)(&[NotifyState::Status(&one_line(text))]);
    }

    /// Tells that the service is ready, and goes on telling about it.
    pub(crate) fn watch(self, desk: Desk) -> io::Result<Watch> {
        let first = desk.snapshot();
        let mut news = News::new(self.watchdog);
        let text = status(&first, desk.fixed());
        (self.tell)(&[NotifyState::Ready, NotifyState::Status(&text)])?;
        news.text = text;
        Watch::start(self, desk, news)
    }
}

/// The thread that tells.
#[derive(Debug)]
pub(crate) struct Watch {
    over: Arc<AtomicBool>,
    thread: Thread,
    /// Closed when the thread has ended.
    ended: Receiver<()>,
}

impl Watch {
    fn start(manager: Manager, desk: Desk, mut news: News) -> io::Result<Self> {
        let over = Arc::new(AtomicBool::new(false));
        let seen = Arc::clone(&over);
        let begin = Instant::now();
        let (open, ended) = mpsc::channel();
        let thread = thread::Builder::new()
            .name("manager".into())
            .spawn(move || {
                let _open = open;
                let Manager { tell, watchdog } = manager;
                let every = look_every(watchdog);
                loop {
                    let is_last = seen.load(Ordering::Acquire);
                    let snapshot = desk.snapshot();
                    let text = status(&snapshot, desk.fixed());
                    let is_ending = is_last || snapshot.state == MachineState::Ending;
                    let told = news.since(begin.elapsed(), snapshot.ticks, text, is_ending);
                    if !told.is_empty() {
                        // A manager that is gone must not end the service; the next look tries again.
                        let _ = tell(&told);
                    }
                    if is_last {
                        return;
                    }
                    thread::park_timeout(every);
                }
            })?;
        let thread = thread.thread().clone();
        Ok(Self {
            over,
            thread,
            ended,
        })
    }

    /// The machine's thread has ended.
    pub(crate) fn finish(self) {
        self.over.store(true, Ordering::Release);
        self.thread.unpark();
        // Nothing is ever sent: either the thread has ended, or it is left behind.
        let _ = self.ended.recv_timeout(LAST_WORD);
    }
}

/// A message that is due must not wait for half a watchdog period more.
fn look_every(watchdog: Option<Duration>) -> Duration {
    watchdog.map_or(LOOK_EVERY, |it| (it / 8).min(LOOK_EVERY))
}

/// What has been told, and so what is new.
struct News {
    /// Half of the watchdog's period.
    beat_every: Option<Duration>,
    beaten: Option<Duration>,
    ticks: u64,
    text: String,
    has_ended: bool,
}

impl News {
    fn new(watchdog: Option<Duration>) -> Self {
        Self {
            beat_every: watchdog.map(|it| it / 2),
            beaten: None,
            ticks: 0,
            text: String::new(),
            has_ended: false,
        }
    }

    /// What is to be told `now`, when the machine's thread has done so many ticks.
    fn since(
        &mut self,
        now: Duration,
        ticks: u64,
        text: String,
        is_ending: bool,
    ) -> Vec<NotifyState<'_>> {
        let mut told = Vec::new();
        if is_ending && !self.has_ended {
            self.has_ended = true;
            told.push(NotifyState::Stopping);
        }
        if self.is_beat_due(now) && ticks != self.ticks {
            self.beaten = Some(now);
            self.ticks = ticks;
            told.push(NotifyState::Watchdog);
        }
        if text != self.text {
            self.text = text;
            told.push(NotifyState::Status(&self.text));
        }
        told
    }

    fn is_beat_due(&self, now: Duration) -> bool {
        let since = |beaten| now.saturating_sub(beaten);
        self.beat_every
            .is_some_and(|every| self.beaten.is_none_or(|it| since(it) >= every))
    }
}

/// The machine in a line: its state with what caused it, and its axes.
fn status(snapshot: &Snapshot, fixed: &Fixed) -> String {
    let state = match snapshot.state {
        MachineState::Starting => "starting",
        MachineState::Running => "running",
        MachineState::ErrorStop => "stopped by a failure, reset it",
        MachineState::Ending => "ending",
    };
    let cause = snapshot.cause.iter().map(|it| format!(": {}", it.cause));
    let axes = fixed.axes.iter().zip(&snapshot.axes);
    let axes = axes.map(|(axis, sample)| format!("; {} {:?}", axis.name, sample.state));
    let parts: Vec<_> = [state.to_owned()]
        .into_iter()
        .chain(cause)
        .chain(axes)
        .collect();
    one_line(&parts.concat())
}

/// Each line of a message is a message of its own.
pub(crate) fn one_line(text: &str) -> String {
    text.split(char::is_control).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD: Duration = Duration::from_millis(1000);

    /// What is told at a moment in ms and a count of ticks, as text.
    #[track_caller]
    fn check(news: &mut News, (ms, ticks): (u64, u64), text: &str, expected: &[&str]) {
        let now = Duration::from_millis(ms);
        let told = news.since(now, ticks, text.to_owned(), text == "ending");
        let told: Vec<_> = told.iter().map(ToString::to_string).collect();
        assert_eq!(told, expected, "{ms} ms, {ticks} ticks");
    }

    fn running(watchdog: Option<Duration>) -> News {
        let mut news = News::new(watchdog);
        news.text = "running".into();
        news
    }

    #[test]
    fn the_watchdog_is_told_at_half_its_period_while_ticks_come() {
        let mut news = running(Some(PERIOD));
        check(&mut news, (0, 7), "running", &["WATCHDOG=1"]);
        check(&mut news, (499, 300), "running", &[]);
        check(&mut news, (500, 301), "running", &["WATCHDOG=1"]);
        check(&mut news, (999, 600), "running", &[]);
        check(&mut news, (1007, 601), "running", &["WATCHDOG=1"]);
    }

    #[test]
    fn a_thread_that_hangs_is_not_vouched_for() {
        let mut news = running(Some(PERIOD));
        check(&mut news, (0, 7), "running", &["WATCHDOG=1"]);
        for ms in (500..60_000).step_by(125) {
            check(&mut news, (ms, 7), "running", &[]);
        }
        check(&mut news, (60_000, 8), "running", &["WATCHDOG=1"]);
    }

    #[test]
    fn what_people_see_and_the_end_are_told_once() {
        let mut news = running(None);
        check(&mut news, (0, 7), "running", &[]);
        check(&mut news, (1, 8), "stopped", &["STATUS=stopped"]);
        check(&mut news, (2, 9), "stopped", &[]);
        let ended = ["STOPPING=1", "STATUS=ending"];
        check(&mut news, (3, 10), "ending", &ended);
        check(&mut news, (4, 10), "ending", &[]);
    }

    #[test]
    fn looks_come_often_enough_for_the_shortest_watchdog() {
        assert_eq!(look_every(None), LOOK_EVERY);
        assert_eq!(look_every(Some(Duration::from_secs(10))), LOOK_EVERY);
        let short = Duration::from_millis(80);
        assert_eq!(look_every(Some(short)), Duration::from_millis(10));
    }

    /// A cause quotes devices: what they say must not become a message.
    #[test]
    fn nothing_that_is_quoted_becomes_a_message() {
        assert_eq!(one_line("node 4\nSTOPPING=1\u{1b}"), "node 4 STOPPING=1 ");
    }
}
