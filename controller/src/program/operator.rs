//! The person at the terminal, who turns the plate of a rotary table, or sets up the lines of a
//! laser interferometer.

use std::fs::File;
use std::io::{self, IsTerminal, Read, stdin};
use std::os::fd::AsFd;
use std::path::{Path, PathBuf};
use std::time::Duration;

use compensator::rotary::Sighted;
use compensator::volumetric::Axis;
use drivers::transport::live::OpenError;
use drivers::transport::lockstep::lend_hand;
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use nix::sys::termios::{FlushArg, tcflush};
use units::Radians;

use crate::Failure;
use crate::program::output::Output;
use crate::rotary::sighted::{Asked, Person, Question};
use crate::rotary::{Operator, PlateMove, PlateTask};
use crate::runs::DriveState;
use crate::volumetric::{LineOperator, LineOptics, LineTask};

/// How a question is answered here.
const ENTER: &str = "you press Enter";

/// Asks on stderr and waits for Enter on stdin; the machine lives on meanwhile.
#[derive(Debug)]
pub(crate) struct Terminal {
    answers: Answers,
    output: Output,
    /// Whether the run has drives, which it switches off.
    is_driven: bool,
    /// What was typed or answered, and not taken yet.
    typed: String,
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
        Ok(Self::over(answers, output, true))
    }

    const fn over(answers: Answers, output: Output, is_driven: bool) -> Self {
        Self {
            answers,
            output,
            is_driven,
            typed: String::new(),
        }
    }

    /// One at which a plate is read.
    ///
    /// # Errors
    /// When nobody can answer, before anything moves.
    pub(crate) fn of_reader(
        hand: Option<&Path>,
        output: Output,
        is_driven: bool,
    ) -> Result<Self, Failure> {
        if hand.is_none() && !stdin().is_terminal() {
            return Err(Failure::Usage {
                what: "a person reads the lines of the plate, and there is no terminal to ask at"
                    .into(),
                help: "run it in a terminal, or give what was read with --readings FILE".into(),
            });
        }
        Ok(Self {
            is_driven,
            ..Self::new(false, hand, output)?
        })
    }

    /// Asks for what `text` says, which a hand does by `words`.
    fn ask_for(&mut self, text: &str, words: &str) -> Result<(), Failure> {
        self.output.must_say(&format!("> {text}"));
        let answers = match &self.answers {
            Answers::Nobody => return Ok(()),
            Answers::Hand(socket) => return self.lend_hand(socket, words),
            Answers::Keyboard(answers) => answers,
        };
        // What was typed before is no answer to this: a hand may be in the machine.
        tcflush(answers, FlushArg::TCIFLUSH).map_err(|errno| gone(&errno.into()))?;
        let drives = match self.is_driven {
            true => DriveState::Off.warning(ENTER),
            false => {
                "this run has no drives, which is not a safe stop: make the machine safe first"
                    .to_owned()
            }
        };
        self.output.must_say(&format!(
            "  {drives}; press Enter when it is done, Ctrl-C to stop (what was read is kept)"
        ));
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
        self.output.must_say(&format!("> {text}"));
        let Answers::Keyboard(answers) = &self.answers else {
            return Ok(());
        };
        // What was typed before is no answer to this: a hand may be in the machine.
        tcflush(answers, FlushArg::TCIFLUSH).map_err(|errno| gone(&errno.into()))?;
        let drives = DriveState::Holding.warning(ENTER);
        self.output.must_say(&format!(
            "  {drives}; Ctrl-C stops it (what was reached is kept)"
        ));
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

impl Terminal {
    /// Asks for the plate in the words of `text`.
    pub(crate) fn ask_for_plate(&mut self, task: &PlateTask, text: &str) -> Result<(), Failure> {
        if let (PlateMove::TurnBy(0.0), Answers::Hand(_)) = (task.by, &self.answers) {
            // A hand that took it up would not put it down in the same place.
            self.output.must_say(&format!("> {text}"));
            return Ok(());
        }
        let words = match task.by {
            PlateMove::Fix | PlateMove::FixAt { .. } => format!("fix-plate {}", task.offset),
            PlateMove::TurnBy(_) | PlateMove::TurnFrom { .. } => {
                format!("place-plate {}", task.offset)
            }
        };
        self.ask_for(text, &words)
    }

    /// Asks for a line in the words of `text`.
    pub(crate) fn ask_for_line(&mut self, task: &LineTask, text: &str) -> Result<(), Failure> {
        self.ask_for(text, &line_words(task))
    }
}

impl Operator for Terminal {
    fn ask(&mut self, task: &PlateTask) -> Result<(), Failure> {
        self.ask_for_plate(task, &task.text())
    }

    fn is_done(&mut self) -> Result<bool, Failure> {
        self.has_entered()
    }
}

impl Person for Terminal {
    fn tell(&mut self, text: &str) {
        self.output.must_say(text);
    }

    fn question(&mut self, question: &Question) -> Result<(), Failure> {
        self.output.must_say(&format!("? {}", question.text));
        self.typed.clear();
        match &self.answers {
            Answers::Nobody => Err(Failure::Usage {
                what: "nobody is there to answer".into(),
                help: "leave --yes out".into(),
            }),
            Answers::Hand(socket) => {
                self.typed = hands_answer(socket, question)? + "\n";
                Ok(())
            }
            // What was typed before must not turn the table; where nothing turns, several lines may be
            // pasted at once.
            Answers::Keyboard(answers) if question.turns => forget_what_was_typed(answers),
            Answers::Keyboard(_) => Ok(()),
        }
    }

    fn answer(&mut self) -> Result<Option<String>, Failure> {
        if let Answers::Keyboard(answers) = &mut self.answers {
            take_typed(answers, &mut self.typed)?;
        }
        let Some((line, rest)) = self.typed.split_once('\n') else {
            return Ok(None);
        };
        let (line, rest) = (line.to_owned(), rest.to_owned());
        self.typed = rest;
        Ok(Some(line))
    }

    fn refuse(&mut self, why: &str) -> Result<(), Failure> {
        self.output.must_say(&format!("  not taken: {why}"));
        self.typed.clear();
        match &self.answers {
            // Lines that were pasted behind it would be taken for others.
            Answers::Keyboard(answers) => forget_what_was_typed(answers),
            Answers::Hand(_) => Err(Failure::Usage {
                what: why.to_owned(),
                help: "the emulated machine's hand answers the same question alike".into(),
            }),
            Answers::Nobody => Err(Failure::Usage {
                what: why.to_owned(),
                help: "leave --yes out, and answer at a terminal".into(),
            }),
        }
    }

    fn wait(&mut self, at_most: Duration) {
        let Answers::Keyboard(answers) = &self.answers else {
            return;
        };
        let limit = PollTimeout::try_from(at_most).unwrap_or(PollTimeout::MAX);
        let mut fds = [PollFd::new(answers.as_fd(), PollFlags::POLLIN)];
        // Whatever ended it: whoever waits looks again.
        let _ = poll(&mut fds, limit);
    }
}

/// What was typed before is no answer to this.
fn forget_what_was_typed(answers: &File) -> Result<(), Failure> {
    tcflush(answers, FlushArg::TCIFLUSH).map_err(|errno| gone(&errno.into()))
}

/// Adds what has been typed since; a terminal gives whole lines.
fn take_typed(answers: &mut File, typed: &mut String) -> Result<(), Failure> {
    let mut fds = [PollFd::new(answers.as_fd(), PollFlags::POLLIN)];
    if typed.contains('\n') || poll(&mut fds, PollTimeout::ZERO).unwrap_or(0) == 0 {
        return Ok(());
    }
    let mut bytes = [0; 256];
    match answers.read(&mut bytes) {
        Ok(0) => Err(gone(&io::ErrorKind::UnexpectedEof.into())),
        Ok(length) => {
            typed.push_str(&String::from_utf8_lossy(&bytes[..length]));
            Ok(())
        }
        Err(error) => Err(gone(&error)),
    }
}

/// What the hand of an emulated machine reads.
fn hands_answer(socket: &Path, question: &Question) -> Result<String, Failure> {
    let Asked::Line {
        line,
        value,
        nominal,
    } = question.asked
    else {
        // It closes what it has read.
        return Ok(String::new());
    };
    let seen = lend_hand(socket, &format!("read-line {line}")).map_err(OpenError::from)?;
    let seen: serde_json::Value = serde_json::from_str(&seen).unwrap_or_default();
    let angle = seen["angle_deg"].as_f64();
    let typed = match value {
        Sighted::ToLine => seen["to_line_arcsec"]
            .as_f64()
            .map(|it| format!("{it}arcsec")),
        Sighted::Angle => angle.map(|it| format!("{it}deg")),
        Sighted::Deviation => angle.map(|it| {
            let away = Radians::from_degrees(it) - nominal;
            format!("{}arcsec", (away - away.whole_turns()).arcsec())
        }),
    };
    Ok(typed.unwrap_or_else(|| "none".to_owned()))
}

impl LineOperator for Terminal {
    fn ask_line(&mut self, task: &LineTask) -> Result<(), Failure> {
        self.ask_for_line(task, &task.text())
    }

    fn is_set_up(&mut self) -> Result<bool, Failure> {
        self.has_entered()
    }

    fn pack_up(&mut self) -> Result<(), Failure> {
        self.output
            .must_say("> the interferometer is no longer needed and may be packed up");
        match &self.answers {
            Answers::Hand(socket) => self.lend_hand(socket, "take-line-away"),
            Answers::Keyboard(_) | Answers::Nobody => Ok(()),
        }
    }

    fn tell(&mut self, text: &str) {
        self.output.must_say(&format!("> {text}"));
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
        type_in(keyboard, terminal, "\n");
    }

    fn type_in(keyboard: &mut File, terminal: &Terminal, text: &str) {
        keyboard.write_all(text.as_bytes()).unwrap();
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
        let answers = Answers::Keyboard(File::from(pty.slave));
        let mut terminal = Terminal::over(answers, Output::new(true, "test"), true);
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

    fn answered(terminal: &mut Terminal) -> String {
        loop {
            if let Some(text) = terminal.answer().unwrap() {
                return text;
            }
            terminal.wait(Duration::from_millis(PATIENCE_MS.into()));
        }
    }

    #[test]
    fn values_are_taken_one_by_one_and_none_that_was_typed_before_a_question_turns_the_table() {
        let pty = openpty(None, None).unwrap();
        let mut keyboard = File::from(pty.master);
        let answers = Answers::Keyboard(File::from(pty.slave));
        let mut terminal = Terminal::over(answers, Output::new(true, "test"), false);
        let question = |turns| Question {
            asked: Asked::Close,
            text: "close?".into(),
            turns,
            by_hand: false,
        };
        terminal.question(&question(false)).unwrap();
        assert_eq!(terminal.answer().unwrap(), None);
        // Pasted at once, where nothing turns.
        type_in(&mut keyboard, &terminal, "1.5arcsec\n-2arcsec\n");
        assert_eq!(answered(&mut terminal), "1.5arcsec");
        terminal.question(&question(false)).unwrap();
        assert_eq!(answered(&mut terminal), "-2arcsec");
        enter(&mut keyboard, &terminal);
        terminal.question(&question(true)).unwrap();
        assert_eq!(terminal.answer().unwrap(), None, "an early Enter counted");
        type_in(&mut keyboard, &terminal, "none\n");
        assert_eq!(answered(&mut terminal), "none");
    }
}
