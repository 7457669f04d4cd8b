//! The clock that both ends of the wire share: the lines of its side channel.
//!
//! Frames and bytes pass the kernel; over a Unix socket beside them a participant (a
//! controller, a test program) and the emulator agree on the time. One line is one message;
//! times are nanoseconds of the machine's clock; `ID` is the number that the participant
//! gave a port when it attached it.
//!
//! | participant says | the emulator answers | meaning |
//! |---|---|---|
//! | `hello 1 PID NAME` | `welcome NOW` | takes part; 1 is the version |
//! | `attach ID ENDPOINT` | `attached` | has opened this terminal or interface |
//! | `detach ID` | nothing | has closed it |
//! | `idle UNTIL ENTRY…` | `go NOW ENTRY…` | has sent these and waits until then, or until something comes |
//! | `on CPU` | nothing | computes on this processor now, or on `any`: better both on one |
//! | `do WORDS` | `done TEXT` | a hand at the machine, before anything sent later |
//! | `bye` | nothing | takes part no longer |
//!
//! Whatever cannot be is answered by `refused TEXT`. `UNTIL` may be `never`. Who only says
//! `do` need not say `hello`.
//!
//! An `ENTRY` is `ID:UNITS` (frames on SocketCAN, bytes on a serial line), `ID:baud=RATE` and
//! `ID:break=0|1` for what is done to a line, or, from the emulator, `ID:look` for a port whose
//! state has changed. Entries stand in the order in which they happened. `ID:later` behind `UNTIL` says
//! that bytes on that line end no wait: they come with the next `go`, as `ID:UNITS@TIME`. From a
//! participant that is what it has sent already and counts as sent at that time only, a SYNC, unless
//! `ID:recall` comes before it.

use core::fmt;
use std::path::PathBuf;

use units::Time;

use super::{LineControl, Port, Ports};

/// The version of these lines.
pub const VERSION: u32 = 1;
/// A line is never longer; a peer that sends more does not use this protocol.
pub const LINE_MAX: usize = 1 << 20;

/// Where the side channel of a clock is that a command line names as `lockstep:PATH`.
///
/// # Errors
/// When it names something else.
///
/// # Example
///
/// ```
/// use std::path::PathBuf;
/// use wire::lockstep::path_of;
///
/// assert_eq!(path_of("lockstep:/run/clock"), Ok(PathBuf::from("/run/clock")));
/// assert!(path_of("lockstep:").is_err(), "no path");
/// ```
pub fn path_of(clock: &str) -> Result<PathBuf, &'static str> {
    let path = clock.strip_prefix("lockstep:").filter(|it| !it.is_empty());
    path.map(PathBuf::from).ok_or("expected lockstep:PATH")
}

/// Something that passed a port, in order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Passed {
    /// So many frames (SocketCAN) or bytes (terminals).
    Units(usize),
    /// So many, at another time than now: from the emulator bytes that came earlier and ended no wait, from a
    /// participant what is sent only then.
    At {
        /// Frames or bytes.
        units: usize,
        /// When.
        at: Time,
    },
    /// What was to be sent later on this port is not sent.
    Recall,
    /// Done to the line, not sent over it.
    Control(LineControl),
    /// The port's state has changed: look at it.
    Look,
}

/// What passed, and where.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Entry {
    /// The participant's number of the port.
    pub port: Port,
    /// What.
    pub passed: Passed,
}

/// What a participant says.
///
/// # Example
///
/// ```
/// use units::Time;
/// use wire::lockstep::{Entry, Passed, Request};
/// use wire::{Port, Ports};
///
/// let frame = Entry { port: Port(0), passed: Passed::Units(1) };
/// let (until, unhurried) = (Time(1_500_000), Ports::NONE);
/// let idle = Request::Idle { until, unhurried, sent: vec![frame] };
/// assert_eq!(idle.to_string(), "idle 1500000 0:1");
/// assert_eq!(Request::parse("idle 1500000 0:1"), Ok(idle));
/// assert!(Request::parse("idle 5 0").is_err(), "what passed is not said");
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Request {
    /// Takes part.
    Hello {
        /// Of these lines.
        version: u32,
        /// Its process, 0 when it does not say.
        pid: u32,
        /// What messages call it.
        name: String,
    },
    /// Has opened a port.
    Attach {
        /// Its number for it.
        port: Port,
        /// The terminal's path, or the interface's name.
        endpoint: String,
    },
    /// Has closed a port.
    Detach {
        /// Its number for it.
        port: Port,
    },
    /// Has nothing left to do.
    Idle {
        /// At the latest until then.
        until: Time,
        /// What comes on these ends no wait.
        unhurried: Ports,
        /// What it has sent since it last said so.
        sent: Vec<Entry>,
    },
    /// Computes on this processor now; `None` for any. Whoever only waits for the other is woken
    /// much faster on the same one.
    On {
        /// Its number.
        cpu: Option<u32>,
    },
    /// A hand at the machine.
    Do {
        /// What it does.
        words: String,
    },
    /// Takes part no longer.
    Bye,
}

/// What the emulator says.
///
/// # Example
///
/// ```
/// use units::Time;
/// use wire::lockstep::Reply;
///
/// assert_eq!(Reply::parse("go 135100"), Ok(Reply::Go { now: Time(135_100), sent: vec![] }));
/// assert_eq!(Reply::Refused("no port".into()).to_string(), "refused no port");
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Reply {
    /// The participant takes part; the present time.
    Welcome(Time),
    /// The port was found.
    Attached,
    /// Time has passed.
    Go {
        /// The present time.
        now: Time,
        /// What has been sent to the participant, all of it at `now`.
        sent: Vec<Entry>,
    },
    /// It was done; what came of it.
    Done(String),
    /// Not possible, and why.
    Refused(String),
}

/// A line that means nothing.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{line}` is not a message of the lockstep clock (version {VERSION})")]
pub struct Unintelligible {
    /// The line, shortened.
    pub line: String,
}

fn unintelligible(line: &str) -> Unintelligible {
    const SHOWN: usize = 80;
    Unintelligible {
        line: line.chars().take(SHOWN).collect(),
    }
}

impl Request {
    /// Reads a line without its end.
    ///
    /// # Errors
    /// When it is none of these.
    pub fn parse(line: &str) -> Result<Self, Unintelligible> {
        let wrong = || unintelligible(line);
        let (word, rest) = line.split_once(' ').unwrap_or((line, ""));
        Ok(match word {
            "hello" => {
                let mut parts = rest.splitn(3, ' ');
                let mut number = || parts.next().and_then(|it| it.parse().ok());
                let version = number().ok_or_else(wrong)?;
                let pid = number().ok_or_else(wrong)?;
                let name = parts.next().ok_or_else(wrong)?.to_owned();
                Self::Hello { version, pid, name }
            }
            "attach" => {
                let (port, endpoint) = rest.split_once(' ').ok_or_else(wrong)?;
                Self::Attach {
                    port: parse_port(port).ok_or_else(wrong)?,
                    endpoint: endpoint.to_owned(),
                }
            }
            "detach" => Self::Detach {
                port: parse_port(rest).ok_or_else(wrong)?,
            },
            "idle" => {
                let mut words = rest.split(' ').peekable();
                let until = words.next().and_then(parse_time).ok_or_else(wrong)?;
                let mut unhurried = Ports::NONE;
                while let Some(port) = words.peek().and_then(|word| word.strip_suffix(":later")) {
                    unhurried.insert(parse_port(port).ok_or_else(wrong)?);
                    words.next();
                }
                let sent = words.map(parse_entry).collect::<Option<_>>();
                Self::Idle {
                    until,
                    unhurried,
                    sent: sent.ok_or_else(wrong)?,
                }
            }
            "on" if rest == "any" => Self::On { cpu: None },
            "on" => Self::On {
                cpu: Some(rest.parse().map_err(|_| wrong())?),
            },
            "do" => Self::Do {
                words: rest.to_owned(),
            },
            "bye" => Self::Bye,
            _ => return Err(wrong()),
        })
    }
}

impl fmt::Display for Request {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Hello { version, pid, name } => write!(f, "hello {version} {pid} {name}"),
            Self::Attach { port, endpoint } => write!(f, "attach {} {endpoint}", port.0),
            Self::Detach { port } => write!(f, "detach {}", port.0),
            Self::Idle {
                until,
                unhurried,
                sent,
            } => {
                write_time(f, "idle", *until)?;
                let mut ports = unhurried.iter();
                ports.try_for_each(|port| write!(f, " {}:later", port.0))?;
                write_entries(f, sent)
            }
            Self::On { cpu: None } => f.write_str("on any"),
            Self::On { cpu: Some(cpu) } => write!(f, "on {cpu}"),
            Self::Do { words } => write!(f, "do {words}"),
            Self::Bye => f.write_str("bye"),
        }
    }
}

impl Reply {
    /// Reads a line without its end.
    ///
    /// # Errors
    /// When it is none of these.
    pub fn parse(line: &str) -> Result<Self, Unintelligible> {
        let wrong = || unintelligible(line);
        let (word, rest) = line.split_once(' ').unwrap_or((line, ""));
        Ok(match word {
            "welcome" => Self::Welcome(parse_time(rest).ok_or_else(wrong)?),
            "attached" => Self::Attached,
            "go" => {
                let mut words = rest.split(' ');
                let now = words.next().and_then(parse_time).ok_or_else(wrong)?;
                let sent = words.map(parse_entry).collect::<Option<_>>();
                Self::Go {
                    now,
                    sent: sent.ok_or_else(wrong)?,
                }
            }
            "done" => Self::Done(rest.to_owned()),
            "refused" => Self::Refused(rest.to_owned()),
            _ => return Err(wrong()),
        })
    }
}

impl fmt::Display for Reply {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Welcome(now) => write!(f, "welcome {}", now.nanos()),
            Self::Attached => f.write_str("attached"),
            Self::Go { now, sent } => {
                write_time(f, "go", *now)?;
                write_entries(f, sent)
            }
            Self::Done(text) => write!(f, "done {text}"),
            Self::Refused(text) => write!(f, "refused {text}"),
        }
    }
}

fn parse_port(text: &str) -> Option<Port> {
    text.parse().ok().map(Port)
}

fn parse_time(text: &str) -> Option<Time> {
    match text {
        "never" => Some(Time::NEVER),
        text => text.parse().ok().map(Time),
    }
}

fn parse_entry(text: &str) -> Option<Entry> {
    let (port, passed) = text.split_once(':')?;
    let passed = match passed.split_once('=') {
        Some(("baud", rate)) => Passed::Control(LineControl::Baud(rate.parse().ok()?)),
        Some(("break", "0")) => Passed::Control(LineControl::Break(false)),
        Some(("break", "1")) => Passed::Control(LineControl::Break(true)),
        Some(_) => return None,
        None if passed == "look" => Passed::Look,
        None if passed == "recall" => Passed::Recall,
        None => parse_units(passed)?,
    };
    Some(Entry {
        port: parse_port(port)?,
        passed,
    })
}

fn parse_units(text: &str) -> Option<Passed> {
    let Some((units, at)) = text.split_once('@') else {
        return text.parse().ok().map(Passed::Units);
    };
    let (units, at) = (units.parse().ok()?, Time(at.parse().ok()?));
    Some(Passed::At { units, at })
}

fn write_time(f: &mut fmt::Formatter<'_>, word: &str, time: Time) -> fmt::Result {
    match time {
        Time::NEVER => write!(f, "{word} never"),
        time => write!(f, "{word} {}", time.nanos()),
    }
}

fn write_entries(f: &mut fmt::Formatter<'_>, entries: &[Entry]) -> fmt::Result {
    entries.iter().try_for_each(|entry| write!(f, " {entry}"))
}

impl fmt::Display for Entry {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let port = self.port.0;
        match self.passed {
            Passed::Units(units) => write!(f, "{port}:{units}"),
            Passed::At { units, at } => write!(f, "{port}:{units}@{}", at.nanos()),
            Passed::Control(LineControl::Baud(rate)) => write!(f, "{port}:baud={rate}"),
            Passed::Control(LineControl::Break(on)) => write!(f, "{port}:break={}", u8::from(on)),
            Passed::Look => write!(f, "{port}:look"),
            Passed::Recall => write!(f, "{port}:recall"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[track_caller]
    fn check_request(line: &str, expected: &Request) {
        assert_eq!(Request::parse(line).as_ref(), Ok(expected));
        assert_eq!(expected.to_string(), line);
    }

    #[track_caller]
    fn check_reply(line: &str, expected: &Reply) {
        assert_eq!(Reply::parse(line).as_ref(), Ok(expected));
        assert_eq!(expected.to_string(), line);
    }

    const fn entry(port: u8, passed: Passed) -> Entry {
        Entry {
            port: Port(port),
            passed,
        }
    }

    #[test]
    fn requests_have_their_lines() {
        check_request(
            "hello 1 4711 truestage verify",
            &Request::Hello {
                version: 1,
                pid: 4711,
                name: "truestage verify".to_owned(),
            },
        );
        check_request(
            "attach 0 /dev/pts/3",
            &Request::Attach {
                port: Port(0),
                endpoint: "/dev/pts/3".to_owned(),
            },
        );
        check_request("detach 2", &Request::Detach { port: Port(2) });
        check_request(
            "idle 1500000 0:22 1:baud=9600 1:break=1 1:4",
            &Request::Idle {
                until: Time(1_500_000),
                unhurried: Ports::NONE,
                sent: vec![
                    entry(0, Passed::Units(22)),
                    entry(1, Passed::Control(LineControl::Baud(9600))),
                    entry(1, Passed::Control(LineControl::Break(true))),
                    entry(1, Passed::Units(4)),
                ],
            },
        );
        let until = Time::NEVER;
        let (units, at) = (6, Time(5_000_000));
        let mut unhurried = Ports::NONE;
        check_request(
            "idle never",
            &Request::Idle {
                until,
                unhurried,
                sent: vec![],
            },
        );
        unhurried.insert(Port(1));
        unhurried.insert(Port(3));
        check_request(
            "idle never 1:later 3:later 0:22 0:recall 0:6@5000000",
            &Request::Idle {
                until,
                unhurried,
                sent: vec![
                    entry(0, Passed::Units(22)),
                    entry(0, Passed::Recall),
                    entry(0, Passed::At { units, at }),
                ],
            },
        );
        check_request(
            "do turn-plate 73",
            &Request::Do {
                words: "turn-plate 73".to_owned(),
            },
        );
        check_request("on 3", &Request::On { cpu: Some(3) });
        check_request("on any", &Request::On { cpu: None });
        check_request("bye", &Request::Bye);
    }

    #[test]
    fn replies_have_their_lines() {
        check_reply("welcome 0", &Reply::Welcome(Time::ZERO));
        check_reply("attached", &Reply::Attached);
        check_reply(
            "go 135100 0:27 2:look",
            &Reply::Go {
                now: Time(135_100),
                sent: vec![entry(0, Passed::Units(27)), entry(2, Passed::Look)],
            },
        );
        let (units, at) = (232, Time(5_300));
        let early = entry(1, Passed::At { units, at });
        check_reply(
            "go 135100 1:232@5300 0:27",
            &Reply::Go {
                now: Time(135_100),
                sent: vec![early, entry(0, Passed::Units(27))],
            },
        );
        check_reply("done {\"x\":1}", &Reply::Done("{\"x\":1}".to_owned()));
        check_reply("refused no port", &Reply::Refused("no port".to_owned()));
    }

    #[test]
    fn nonsense_is_named_and_cut_short() {
        for line in [
            "",
            "hello",
            "hello one 2 x",
            "idle",
            "idle 5 0",
            "idle 5 0:x",
            "idle 5  0:1",
            "idle 5 300:1",
            "idle 5 0:break=2",
            "idle 5 0:1 1:later",
            "go 5 1:later",
            "go 5 1:4@",
            "go",
            "attach 0",
            "detach x",
        ] {
            assert!(Request::parse(line).is_err(), "{line}");
            assert!(Reply::parse(line).is_err(), "{line}");
        }
        let error = Request::parse(&"x".repeat(500)).unwrap_err().to_string();
        assert!(error.len() < 200, "{error}");
    }

    proptest! {
        #[test]
        fn any_text_is_read_or_refused(line in ".{0,60}") {
            if let Ok(request) = Request::parse(&line) {
                prop_assert_eq!(Request::parse(&request.to_string()), Ok(request));
            }
            if let Ok(reply) = Reply::parse(&line) {
                prop_assert_eq!(Reply::parse(&reply.to_string()), Ok(reply));
            }
        }
    }
}
