//! The person at the terminal, who turns the plate of a rotary table, or sets up the lines of a
//! laser interferometer.

use std::fs::File;
use std::io::{self, IsTerminal, Read, stdin};
use std::os::fd::AsFd;
use std::path::{Path, PathBuf};

use compensator::volumetric::Axis;
use drivers::transport::live::OpenError;
use drivers::transport::lockstep::lend_hand;
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use nix::sys::termios::{FlushArg, tcflush};

use crate::Failure;
use crate::program::output::Output;
use crate::rotary::{Operator, PlateMove, PlateTask};
use crate::volumetric::{LineOperator, LineOptics, LineTask};

/// Asks on stderr and waits for Enter on stdin; the machine lives on meanwhile.
#[derive(Debug)]
pub(crate) struct Terminal {
    answers: Answers,
    output: Output,
}

/// Who says that it has been done.
#[derive(Debug)]
enum Answers {
    /// A person, by Enter.
    Keyboard(File),
    /// The hand of the emulated machine whose socket this is: it does it at once.
    Hand(PathBuf),
    /// Somebody else sees to it, and nothing is waited for.
    Nobody,
}

impl Terminal {
    /// # Errors
    /// When nobody can answer, before anything moves.
    pub(crate) fn new(yes: bool, hand: Option<&Path>, output: Output) -> Result<Self, Failure> {
        let answers = match (yes, hand) {
            (true, _) => Answers::Nobody,
            (false, Some(socket)) => Answers::Hand(socket.to_owned()),
            (false, None) if stdin().is_terminal() => {
                let own = stdin().as_fd().try_clone_to_owned();
                Answers::Keyboard(File::from(own.map_err(|error| gone(&error))?))
            }
            (false, None) => {
                return Err(Failure::Usage {
                    what:
                        "somebody must do what is asked for meanwhile (turn the plate, set lines up, go on \
                         with a job), and there is no terminal to ask at; nothing was moved"
                            .into(),
                    help:
                        "run it in a terminal, or with --yes if that is done without waiting for \
                         it"
                        .into(),
                });
            }
        };
        Ok(Self { answers, output })
    }

    /// Asks for what `text` says, which a hand does by `words`.
    fn ask_for(&mut self, text: &str, words: &str) -> Result<(), Failure> {
        self.output.note(&format!("> {text}"));
        let answers = match &self.answers {
            Answers::Nobody => return Ok(()),
            Answers::Hand(socket) => return self.lend_hand(socket, words),
            Answers::Keyboard(answers) => answers,
        };
        // What was typed before is no answer to this: a hand may be in the machine.
        tcflush(answers, FlushArg::TCIFLUSH).map_err(|errno| gone(&errno.into()))?;
        self.output.note(
            "  the drives of this run are switched off, which is not a safe stop: make the machine \
             safe first; press Enter when it is done, Ctrl-C to stop (what was read is kept)",
        );
        Ok(())
    }

    fn lend_hand(&self, socket: &Path, words: &str) -> Result<(), Failure> {
        let done = lend_hand(socket, words).map_err(OpenError::from)?;
        self.output.note(&format!("  hand: {done}"));
        Ok(())
    }

    /// Asks for what a job waits for; the axis is held under power meanwhile. An emulated machine's hand has nothing
    /// to do.
    pub(crate) fn ask_to_go_on(&mut self, text: &str) -> Result<(), Failure> {
        self.output.note(&format!("> {text}"));
        let Answers::Keyboard(answers) = &self.answers else {
            return Ok(());
        };
        // What was typed before is no answer to this: a hand may be in the machine.
        tcflush(answers, FlushArg::TCIFLUSH).map_err(|errno| gone(&errno.into()))?;
        self.output.note(
            "  the axis holds its place under power and moves as soon as you press Enter: be out of its way \
             first; Ctrl-C stops it (what was reached is kept)",
        );
        Ok(())
    }

    pub(crate) fn has_entered(&mut self) -> Result<bool, Failure> {
        let Answers::Keyboard(answers) = &mut self.answers else {
            return Ok(true);
        };
        let mut fds = [PollFd::new(answers.as_fd(), PollFlags::POLLIN)];
        // A signal only makes the next look come sooner.
        if poll(&mut fds, PollTimeout::ZERO).unwrap_or(0) == 0 {
            return Ok(false);
        }
        // A terminal gives whole lines.
        let mut line = [0; 256];
        match answers.read(&mut line) {
            Ok(0) => Err(gone(&io::ErrorKind::UnexpectedEof.into())),
            Ok(length) => Ok(line[..length].contains(&b'\n')),
            Err(error) => Err(gone(&error)),
        }
    }
}

impl Operator for Terminal {
    fn ask(&mut self, task: &PlateTask) -> Result<(), Failure> {
        let words = match task.by {
            PlateMove::Fix => format!("fix-plate {}", task.offset),
            PlateMove::TurnBy(_) | PlateMove::TurnFrom { .. } => {
                format!("place-plate {}", task.offset)
            }
        };
        self.ask_for(&task.text(), &words)
    }

    fn is_done(&mut self) -> Result<bool, Failure> {
        self.has_entered()
    }
}

impl LineOperator for Terminal {
    fn ask_line(&mut self, task: &LineTask) -> Result<(), Failure> {
        self.ask_for(&task.text(), &line_words(task))
    }

    fn is_set_up(&mut self) -> Result<bool, Failure> {
        self.has_entered()
    }

    fn pack_up(&mut self) -> Result<(), Failure> {
        self.output
            .note("> the interferometer is no longer needed and may be packed up");
        match &self.answers {
            Answers::Hand(socket) => self.lend_hand(socket, "take-line-away"),
            Answers::Keyboard(_) | Answers::Nobody => Ok(()),
        }
    }
}

/// How an emulated machine's hand is told to set a line up.
fn line_words(task: &LineTask) -> String {
    let unit = |axis: Axis| Axis::ALL.map(|it| f64::from(u8::from(it == axis)));
    let way = task.end - task.start;
    let along = [way.x, way.y, way.z].map(|it| it.value());
    let tool_mm = [task.tool.x, task.tool.y, task.tool.z].map(|it| it.mm());
    let optics = match task.optics {
        LineOptics::Linear => "\"linear\"".to_owned(),
        LineOptics::Straightness { across } => {
            format!("\"straightness\", side = {:?}", unit(across))
        }
        LineOptics::Angular { about } => format!("\"angular\", side = {:?}", unit(about)),
    };
    format!("set-up-line along = {along:?}, tool_mm = {tool_mm:?}, optics = {optics}")
}

fn gone(why: &io::Error) -> Failure {
    Failure::Usage {
        what: format!("the terminal was closed ({why}); the placements that were read are kept"),
        help: "continue with --resume".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nix::pty::openpty;
    use std::io::Write;

    const PATIENCE_MS: u16 = 10_000;

    /// Enter, and what the kernel needs to bring it to the other end.
    fn enter(keyboard: &mut File, terminal: &Terminal) {
        keyboard.write_all(b"\n").unwrap();
        let Answers::Keyboard(answers) = &terminal.answers else {
            panic!("it has a keyboard")
        };
        let mut fds = [PollFd::new(answers.as_fd(), PollFlags::POLLIN)];
        let ready = poll(&mut fds, PollTimeout::from(PATIENCE_MS));
        assert_eq!(ready, Ok(1), "Enter did not arrive");
    }

    #[test]
    fn what_was_typed_before_it_was_asked_for_is_no_answer() {
        let pty = openpty(None, None).unwrap();
        let mut keyboard = File::from(pty.master);
        let mut terminal = Terminal {
            answers: Answers::Keyboard(File::from(pty.slave)),
            output: Output::new(true),
        };
        let task = PlateTask {
            axis: "c".into(),
            plate: "A7".into(),
            lines: 360,
            step: (2, 4),
            offset: 73.0,
            by: PlateMove::TurnBy(73.0),
        };
        enter(&mut keyboard, &terminal);
        terminal.ask(&task).unwrap();
        assert!(!terminal.is_done().unwrap(), "an early Enter counted");
        enter(&mut keyboard, &terminal);
        assert!(terminal.is_done().unwrap());
        assert!(!terminal.is_done().unwrap(), "one Enter counted twice");
    }
}
