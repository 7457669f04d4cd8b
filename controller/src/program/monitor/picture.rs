//! The picture on a terminal, and the keys.

use std::io;
use std::os::fd::AsFd;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;
use std::time::{Duration, Instant};

use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use ratatui::DefaultTerminal;
use ratatui::crossterm::event::{self, Event, KeyCode, KeyEvent, KeyModifiers};
use serde_json::json;
use signal_hook::consts::{SIGINT, SIGQUIT, SIGTERM};

use super::board::Board;
use super::draw::{Looks, draw};
use super::feed::Heard;
use super::words::one_line;
use crate::Failure;
use crate::program::exchange::ask;
use crate::program::output::Ended;

/// From one picture to the next, unless a key comes: as fast as an eye follows.
const REFRESH: Duration = Duration::from_millis(100);

/// How long what became of a key is shown.
const ANSWER_SHOWN: Duration = Duration::from_secs(5);

/// What a key asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Asked {
    Leave,
    Stop { mode: &'static str },
}

/// Shows what is heard until somebody leaves, or `until`.
pub(super) fn show(at: &str, heard: &Receiver<Heard>, until: Instant) -> Ended {
    // Not SIGHUP: who sends that has taken the terminal away already.
    let signal = Arc::new(AtomicUsize::new(0));
    for number in [SIGINT, SIGQUIT, SIGTERM] {
        let value = usize::try_from(number).expect("signals are positive");
        signal_hook::flag::register_usize(number, Arc::clone(&signal), value)
            .map_err(no_terminal)?;
    }
    let is_over = || Instant::now() >= until || signal.load(Ordering::Relaxed) != 0;
    let shown =
        ratatui::try_init().and_then(|mut it| Picture::of(at).watch(&mut it, heard, &is_over));
    // Also after a start that failed half-way.
    let _ = ratatui::try_restore();
    shown.map_err(no_terminal)?;
    if let Ok(number @ 1..) = i32::try_from(signal.load(Ordering::Relaxed)) {
        // The terminal is as it was; now it ends as the signal means.
        signal_hook::low_level::emulate_default_handler(number).map_err(no_terminal)?;
    }
    Ok(None)
}

#[expect(clippy::needless_pass_by_value, reason = "map_err gives it")]
fn no_terminal(error: io::Error) -> Failure {
    Failure::Usage {
        what: format!("nothing can be drawn on this terminal: {error}"),
        help: "`truestage monitor | cat` prints lines".into(),
    }
}

struct Picture {
    board: Board,
    heard_at: Instant,
    answered_at: Instant,
    /// What became of stops. Each is asked for by a thread of its own: a service that hangs does not hold the keys up.
    answers: (Sender<String>, Receiver<String>),
}

impl Picture {
    fn of(at: &str) -> Self {
        let now = Instant::now();
        Self {
            board: Board::new(at),
            heard_at: now,
            answered_at: now,
            answers: channel(),
        }
    }

    fn watch(
        &mut self,
        terminal: &mut DefaultTerminal,
        heard: &Receiver<Heard>,
        is_over: &dyn Fn() -> bool,
    ) -> io::Result<()> {
        // https://no-color.org: any value that is not empty.
        let colours = std::env::var_os("NO_COLOR").is_none_or(|it| it.is_empty());
        while !is_over() && !is_hung_up() {
            self.listen(heard);
            terminal.draw(|frame| draw(frame, &self.board, Looks::new(colours)))?;
            if event::poll(REFRESH)?
                && let Event::Key(key) = event::read()?
            {
                match asked(key) {
                    Some(Asked::Leave) => return Ok(()),
                    Some(Asked::Stop { mode }) => self.stop(mode),
                    None => {}
                }
            }
        }
        Ok(())
    }

    fn listen(&mut self, heard: &Receiver<Heard>) {
        for it in heard.try_iter() {
            self.heard_at = Instant::now();
            self.board.hear(it);
        }
        self.board.silent_for(self.heard_at.elapsed());
        for answer in self.answers.1.try_iter() {
            (self.board.answer, self.answered_at) = (answer, Instant::now());
        }
        if self.answered_at.elapsed() > ANSWER_SHOWN {
            self.board.answer.clear();
        }
    }

    fn stop(&mut self, mode: &'static str) {
        self.board.answer = format!("a {mode} stop is asked for");
        self.answered_at = Instant::now();
        let (at, told) = (self.board.at.clone(), self.answers.0.clone());
        thread::spawn(move || told.send(stop(&at, mode)));
    }
}

/// A terminal that has gone away without a signal has no more keys, and reading them would never end.
fn is_hung_up() -> bool {
    let input = io::stdin();
    let mut fds = [PollFd::new(input.as_fd(), PollFlags::empty())];
    let gone = PollFlags::POLLHUP | PollFlags::POLLERR;
    let looked = poll(&mut fds, PollTimeout::ZERO);
    looked.is_ok() && fds[0].revents().is_some_and(|it| it.intersects(gone))
}

/// As on the page of the service, Escape is STOP: a hand that is in a hurry finds it. Whatever comes together with an
/// Escape looks like a key with Alt, and is one.
fn asked(key: KeyEvent) -> Option<Asked> {
    if !key.is_press() {
        return None;
    }
    if key.modifiers.contains(KeyModifiers::ALT) {
        return Some(Asked::Stop { mode: "controlled" });
    }
    match key.code {
        KeyCode::Char('c') if key.modifiers.contains(KeyModifiers::CONTROL) => Some(Asked::Leave),
        KeyCode::Char('q') => Some(Asked::Leave),
        KeyCode::Esc | KeyCode::Char('s') => Some(Asked::Stop { mode: "controlled" }),
        KeyCode::Char('S') => Some(Asked::Stop { mode: "quick" }),
        _ => None,
    }
}

fn stop(at: &str, mode: &str) -> String {
    match ask(at, "POST", "/v1/stop", &json!({"mode": mode}).to_string()) {
        Ok(_) => format!("a {mode} stop is under way"),
        Err(failure) => one_line(&failure.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_stop_and_leave_and_others_do_nothing() {
        let key = |code, modifiers| asked(KeyEvent::new(code, modifiers));
        let plain = |code| key(code, KeyModifiers::NONE);
        let controlled = Some(Asked::Stop { mode: "controlled" });
        assert_eq!(plain(KeyCode::Esc), controlled);
        assert_eq!(plain(KeyCode::Char('s')), controlled);
        assert_eq!(
            key(KeyCode::Char('S'), KeyModifiers::SHIFT),
            Some(Asked::Stop { mode: "quick" })
        );
        assert_eq!(plain(KeyCode::Char('q')), Some(Asked::Leave));
        assert_eq!(
            key(KeyCode::Char('c'), KeyModifiers::CONTROL),
            Some(Asked::Leave)
        );
        // Pressed so fast behind an Escape that both came as one.
        assert_eq!(key(KeyCode::Char('q'), KeyModifiers::ALT), controlled);
        assert_eq!(plain(KeyCode::Char('c')), None);
        assert_eq!(plain(KeyCode::Enter), None);
    }
}
