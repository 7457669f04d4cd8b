//! The picture on a terminal, and the keys.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant};

use ratatui::DefaultTerminal;
use ratatui::crossterm::event::{self, Event, KeyCode, KeyEvent, KeyModifiers};
use serde_json::json;
use signal_hook::consts::{SIGHUP, SIGTERM};

use super::board::Board;
use super::draw::{Looks, draw};
use super::feed::Heard;
use crate::Failure;
use crate::program::exchange::ask;
use crate::program::output::Ended;

/// From one picture to the next, unless a key comes: as fast as an eye follows.
const REFRESH: Duration = Duration::from_millis(100);

/// What a key asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Asked {
    Leave,
    Stop { mode: &'static str },
}

/// Shows what is heard until somebody leaves, or `until`.
pub(super) fn show(at: &str, heard: &Receiver<Heard>, until: Instant) -> Ended {
    let ended = Arc::new(AtomicBool::new(false));
    for signal in [SIGHUP, SIGTERM] {
        signal_hook::flag::register(signal, Arc::clone(&ended)).map_err(no_terminal)?;
    }
    let mut terminal = ratatui::try_init().map_err(no_terminal)?;
    let shown = watch(&mut terminal, at, heard, &|| {
        Instant::now() >= until || ended.load(Ordering::Relaxed)
    });
    ratatui::restore();
    shown.map_err(no_terminal)?;
    Ok(None)
}

#[expect(clippy::needless_pass_by_value, reason = "map_err gives it")]
fn no_terminal(error: io::Error) -> Failure {
    Failure::Usage {
        what: format!("nothing can be drawn on this terminal: {error}"),
        help: "`truestage monitor | cat` prints lines".into(),
    }
}

fn watch(
    terminal: &mut DefaultTerminal,
    at: &str,
    heard: &Receiver<Heard>,
    is_over: &dyn Fn() -> bool,
) -> io::Result<()> {
    // https://no-color.org: any value that is not empty.
    let colours = std::env::var_os("NO_COLOR").is_none_or(|it| it.is_empty());
    let mut board = Board::new(at);
    while !is_over() {
        heard.try_iter().for_each(|it| board.hear(it));
        terminal.draw(|frame| draw(frame, &board, Looks::new(colours)))?;
        if !event::poll(REFRESH)? {
            continue;
        }
        if let Event::Key(key) = event::read()? {
            match asked(key) {
                Some(Asked::Leave) => return Ok(()),
                Some(Asked::Stop { mode }) => board.answer = stop(at, mode),
                None => board.answer.clear(),
            }
        }
    }
    Ok(())
}

/// As on the page of the service, Escape is STOP: a hand that is in a hurry finds it.
fn asked(key: KeyEvent) -> Option<Asked> {
    if !key.is_press() {
        return None;
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
        Err(failure) => failure.to_string().replace('\n', " "),
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
        assert_eq!(plain(KeyCode::Char('c')), None);
        assert_eq!(plain(KeyCode::Enter), None);
    }
}
