//! The person at the terminal, who turns the plate of a rotary table.

use std::io::{BufRead, IsTerminal, stdin};
use std::os::fd::AsFd;

use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use truestage::Failure;
use truestage::cycle::rotary::{Operator, PlateTask};

use super::output::Output;

/// Asks on stderr and waits for Enter on stdin; the machine lives on meanwhile.
#[derive(Debug)]
pub(super) struct Terminal {
    /// Somebody else sees to it that the plate is turned: nothing is waited for.
    yes: bool,
    output: Output,
}

impl Terminal {
    /// # Errors
    /// When nobody can answer, before anything moves.
    pub(super) fn new(yes: bool, output: Output) -> Result<Self, Failure> {
        if yes || stdin().is_terminal() {
            return Ok(Self { yes, output });
        }
        Err(Failure::Usage {
            what: "somebody must turn the plate, and there is no terminal to ask at; nothing was \
                   moved"
                .into(),
            help: "run it in a terminal, or with --yes where the plate is turned without being \
                   waited for"
                .into(),
        })
    }
}

impl Operator for Terminal {
    fn ask(&mut self, task: &PlateTask) -> Result<(), Failure> {
        self.output.note(&format!("> {}", task.text()));
        if !self.yes {
            self.output.note(
                "  the drive is switched off, which is no safe stop: make the machine safe first; \
                 Enter when it is done, Ctrl-C to stop (what was read is kept)",
            );
        }
        Ok(())
    }

    fn is_done(&mut self) -> Result<bool, Failure> {
        if self.yes {
            return Ok(true);
        }
        let stdin = stdin();
        let mut fds = [PollFd::new(stdin.as_fd(), PollFlags::POLLIN)];
        // A signal only makes the next look come sooner.
        if poll(&mut fds, PollTimeout::ZERO).unwrap_or(0) == 0 {
            return Ok(false);
        }
        let mut line = String::new();
        match stdin.lock().read_line(&mut line) {
            Ok(0) | Err(_) => Err(Failure::Usage {
                what: "the terminal is gone; the placements that were read are kept".into(),
                help: "continue with --resume".into(),
            }),
            Ok(_) => Ok(true),
        }
    }
}
