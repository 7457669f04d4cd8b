//! This program's own exit codes ([`crate::Failure::exit_code`]).

use super::Advice;

/// All of them.
pub(super) const CODES: &[u8] = &[0, 2, 3, 4, 5, 129, 130, 143];

/// What an exit code means; `None` for one that this program does not give.
pub(super) const fn of(code: u8) -> Option<(&'static str, Advice)> {
    Some(match code {
        0 => (
            "done",
            Advice {
                cause: "what was asked for has been done. What was judged is within its tolerance; a measurement as found \
                        (`verify --uncompensated`) and figures of a file (`iso230`) are results, and not judged",
                next: "read the result: it says NOT WITHIN where a stage as found is beyond the tolerance",
            },
        ),
        2 => (
            "usage or configuration",
            Advice {
                cause: "a word of the command line, the machine's file or a data file cannot be what it is; nothing moved",
                next: "read the line that begins with `error:`; `truestage check machine.toml` judges the whole file",
            },
        ),
        3 => (
            "refused for safety",
            Advice {
                cause: "what was asked for could do harm: no zero, beyond soft limits or calibration, a lease of somebody \
                        else, a calibration of another stage",
                next: "do what the message asks for first; do not work around it",
            },
        ),
        4 => (
            "device or bus",
            Advice {
                cause: "a device was silent, refused or said that something is wrong, or the bus did not carry; axes that moved \
                        were stopped",
                next: "`truestage scan machine.toml` shows who answers; then look at the named device, its power, its cable",
            },
        ),
        5 => (
            "out of tolerance",
            Advice {
                cause: "all worked, and the result is not good enough: scatter, closure, deviation or a fit beyond its limit",
                next: "look at the page of the run (`truestage report`); mend the cause that it shows, then measure again",
            },
        ),
        129 | 143 => (
            "stopped by a signal",
            Advice {
                cause: "another program or the end of the session asked this one to end; axes were stopped first",
                next: "a calibration that was interrupted goes on with --resume",
            },
        ),
        130 => (
            "stopped by Ctrl-C",
            Advice {
                cause: "somebody pressed Ctrl-C; axes were stopped first",
                next: "a calibration that was interrupted goes on with --resume",
            },
        ),
        _ => return None,
    })
}
