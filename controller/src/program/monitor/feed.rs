//! What the service says, as it says it: a thread that keeps the stream of events, and finds it again.

use std::io::{self, BufRead};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread;
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::Failure;
use crate::program::exchange::{ask, follow as open};

/// As often as an eye reads a number.
const SAMPLE_MS: u32 = 250;
/// How often the machine itself is asked for: that a lease has run out is no event.
const LOOK_EVERY: Duration = Duration::from_secs(2);
/// From one attempt to reach a service to the next.
const RETRY: Duration = Duration::from_secs(1);
/// A reader that is slower than so many is waited for; the service tells which events its ring has lost meanwhile.
const AHEAD: usize = 64;

/// What is heard of a machine.
pub(super) enum Heard {
    /// What the machine is.
    Machine(Value),
    /// What its axes are.
    Axes(Value),
    /// What runs there are.
    Runs(Value),
    /// What happened.
    Event(Value),
    /// A stream that was there is at its end.
    Ended,
    /// Nothing can be heard, and why.
    Lost(Failure),
}

/// What is asked for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wanted {
    /// Events after the one of this number.
    pub(super) after: u64,
    /// All that a picture needs besides events, again and again.
    pub(super) picture: bool,
}

/// Whoever listened has gone.
struct Gone;

/// Follows the service at `at` until nobody listens.
pub(super) fn follow(at: &str, wanted: Wanted) -> Receiver<Heard> {
    let (heard, listener) = sync_channel(AHEAD);
    let mut feed = Feed {
        at: at.to_owned(),
        wanted,
        started: Value::Null,
        looked: Instant::now(),
        heard,
    };
    thread::spawn(move || while feed.once().is_ok() {});
    listener
}

struct Feed {
    at: String,
    wanted: Wanted,
    /// When the service that was heard last began.
    started: Value,
    looked: Instant,
    heard: SyncSender<Heard>,
}

impl Feed {
    /// One connection from its beginning to its end.
    fn once(&mut self) -> Result<(), Gone> {
        let heard = match self.connected() {
            Ok(never) => match never {},
            Err(End::Gone) => return Err(Gone),
            Err(End::Stream) => Heard::Ended,
            Err(End::Lost(failure)) => Heard::Lost(failure),
        };
        self.tell(heard)?;
        thread::sleep(RETRY);
        Ok(())
    }

    fn connected(&mut self) -> Result<core::convert::Infallible, End> {
        let machine = self.look()?;
        if !self.started.is_null() && self.started != machine["started"] {
            // Its events count from 1 again, and all of them are new.
            self.wanted.after = 0;
        }
        self.started = machine["started"].clone();
        let sample = match self.wanted.picture {
            true => format!("&sample_ms={SAMPLE_MS}"),
            false => String::new(),
        };
        let path = format!("/v1/events?after={}{sample}", self.wanted.after);
        let mut stream = open(&self.at, &path)?;
        loop {
            let message = next_message(&mut stream)?;
            self.take(&message)?;
        }
    }

    /// What the machine is, and for a picture all else that there is to know.
    fn look(&mut self) -> Result<Value, End> {
        let machine = self.look_at_machine()?;
        if self.wanted.picture {
            self.tell(Heard::Axes(ask(&self.at, "GET", "/v1/axes", "")?))?;
            self.tell(Heard::Runs(ask(&self.at, "GET", "/v1/runs", "")?))?;
        }
        Ok(machine)
    }

    fn look_at_machine(&mut self) -> Result<Value, End> {
        let machine = ask(&self.at, "GET", "/v1/machine", "")?;
        self.looked = Instant::now();
        self.tell(Heard::Machine(machine.clone()))?;
        Ok(machine)
    }

    fn take(&mut self, message: &Message) -> Result<(), Gone> {
        let Ok(data) = serde_json::from_str::<Value>(&message.data) else {
            return Ok(());
        };
        // That the machine's thread ticks is no event.
        if message.event == "alive" {
            return Ok(());
        }
        if message.event == "sample" {
            self.tell(Heard::Axes(data))?;
            return match self.looked.elapsed() > LOOK_EVERY {
                true => gone(self.look_at_machine()),
                false => Ok(()),
            };
        }
        if let Some(id) = data["id"].as_u64() {
            self.wanted.after = id;
        }
        // First of all: the last event of a service that ends is followed by nothing that could be asked for.
        self.tell(Heard::Event(data))?;
        match message.event.as_str() {
            // What they change of the machine itself is not in them.
            "machine" | "lease" if self.wanted.picture => gone(self.look_at_machine()),
            // What was missed may have changed anything.
            "gap" if self.wanted.picture => gone(self.look()),
            _ => Ok(()),
        }
    }

    fn tell(&self, heard: Heard) -> Result<(), Gone> {
        self.heard.send(heard).map_err(|_| Gone)
    }
}

/// A look that fails is no end of a stream that still has something to say: that comes by itself.
fn gone(looked: Result<Value, End>) -> Result<(), Gone> {
    match looked {
        Err(End::Gone) => Err(Gone),
        Ok(_) | Err(End::Stream | End::Lost(_)) => Ok(()),
    }
}

/// Why a connection is over.
enum End {
    /// Nobody listens.
    Gone,
    /// The service has closed it.
    Stream,
    Lost(Failure),
}

impl From<Gone> for End {
    fn from(_: Gone) -> Self {
        Self::Gone
    }
}

impl From<Failure> for End {
    fn from(failure: Failure) -> Self {
        Self::Lost(failure)
    }
}

impl From<io::Error> for End {
    fn from(error: io::Error) -> Self {
        match error.kind() {
            io::ErrorKind::UnexpectedEof | io::ErrorKind::ConnectionReset => Self::Stream,
            _ => Self::Lost(Failure::Kept {
                said: format!("the service says nothing any more: {error}"),
                exit_code: crate::program::exchange::LOST,
            }),
        }
    }
}

/// One message of the stream.
#[derive(Debug, Default, PartialEq, Eq)]
struct Message {
    event: String,
    data: String,
}

/// The next message of a stream of Server-Sent Events (HTML Living Standard, 9.2.6): lines to an empty one; comments
/// keep the connection alive.
fn next_message(stream: &mut impl BufRead) -> io::Result<Message> {
    let mut message = Message::default();
    loop {
        let mut line = String::new();
        if stream.read_line(&mut line)? == 0 {
            let what = "the service has closed its stream of events";
            return Err(io::Error::new(io::ErrorKind::UnexpectedEof, what));
        }
        let line = line.trim_end_matches(['\n', '\r']);
        let (field, value) = line.split_once(':').unwrap_or((line, ""));
        let value = value.strip_prefix(' ').unwrap_or(value);
        match field {
            "event" => value.clone_into(&mut message.event),
            "data" => message.data += value,
            "" if line.is_empty() && message != Message::default() => return Ok(message),
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_are_read_to_their_empty_line_and_comments_are_passed_over() {
        let said = ":\n\nid: 7\nevent: axis\ndata: {\"a\":1}\n\n: alive\n\nevent:sample\r\ndata:[]\r\n\r\n";
        let mut stream = said.as_bytes();
        let first = next_message(&mut stream).unwrap();
        assert_eq!(
            (first.event.as_str(), first.data.as_str()),
            ("axis", "{\"a\":1}")
        );
        let second = next_message(&mut stream).unwrap();
        assert_eq!(
            (second.event.as_str(), second.data.as_str()),
            ("sample", "[]")
        );
        let ended = next_message(&mut stream).unwrap_err();
        assert!(matches!(End::from(ended), End::Stream));
        let silent = io::Error::from(io::ErrorKind::WouldBlock);
        assert!(matches!(End::from(silent), End::Lost(it) if it.exit_code() == 4));
    }
}
