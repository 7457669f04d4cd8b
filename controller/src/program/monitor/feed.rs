//! What the service says, as it says it: a thread that keeps the stream of events, and finds it again.

use std::io::{self, BufRead};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread;
use std::time::Duration;

use serde_json::Value;

use crate::Failure;
use crate::program::exchange::{ask, follow as open};

/// As often as an eye reads a number.
const SAMPLE_MS: u32 = 250;
/// From one attempt to reach a service to the next.
const RETRY: Duration = Duration::from_secs(1);
/// A reader that is slower than so many is waited for; the service leaves out what its ring has lost meanwhile.
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
    /// Nothing can be heard, and why.
    Lost(String),
}

/// What is asked for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wanted {
    /// Events after the one of this number.
    pub(super) after: u64,
    /// The axes as well, again and again.
    pub(super) axes: bool,
}

/// Whoever listened has gone.
struct Gone;

/// Follows the service at `at` until nobody listens.
pub(super) fn follow(at: &str, wanted: Wanted) -> Receiver<Heard> {
    let (heard, listener) = sync_channel(AHEAD);
    let mut feed = Feed {
        at: at.to_owned(),
        wanted,
        heard,
    };
    thread::spawn(move || while feed.once().is_ok() {});
    listener
}

struct Feed {
    at: String,
    wanted: Wanted,
    heard: SyncSender<Heard>,
}

impl Feed {
    /// One connection from its beginning to its end.
    fn once(&mut self) -> Result<(), Gone> {
        match self.connected() {
            Err(End::Gone) => Err(Gone),
            Err(End::Lost(why)) => {
                self.tell(Heard::Lost(why))?;
                thread::sleep(RETRY);
                Ok(())
            }
            Ok(never) => match never {},
        }
    }

    fn connected(&mut self) -> Result<core::convert::Infallible, End> {
        let machine = self.whole()?;
        // One that was started again counts from one.
        let newest = machine["newest_event"].as_u64().unwrap_or_default();
        if self.wanted.after > newest {
            self.wanted.after = 0;
        }
        let sample = match self.wanted.axes {
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

    /// All there is to know at the moment.
    fn whole(&mut self) -> Result<Value, End> {
        let machine = ask(&self.at, "GET", "/v1/machine", "")?;
        self.tell(Heard::Machine(machine.clone()))?;
        self.tell(Heard::Axes(ask(&self.at, "GET", "/v1/axes", "")?))?;
        self.tell(Heard::Runs(ask(&self.at, "GET", "/v1/runs", "")?))?;
        Ok(machine)
    }

    fn take(&mut self, message: &Message) -> Result<(), End> {
        let Ok(data) = serde_json::from_str::<Value>(&message.data) else {
            return Ok(());
        };
        match message.event.as_str() {
            "sample" => self.tell(Heard::Axes(data))?,
            // What an event changes of the machine itself is not in it.
            "machine" | "lease" => {
                let machine = ask(&self.at, "GET", "/v1/machine", "")?;
                self.tell(Heard::Machine(machine))?;
                self.event(data)?;
            }
            _ => self.event(data)?,
        }
        Ok(())
    }

    fn event(&mut self, event: Value) -> Result<(), End> {
        if let Some(id) = event["id"].as_u64() {
            self.wanted.after = id;
        }
        Ok(self.tell(Heard::Event(event))?)
    }

    fn tell(&self, heard: Heard) -> Result<(), Gone> {
        self.heard.send(heard).map_err(|_| Gone)
    }
}

/// Why a connection is over.
enum End {
    Gone,
    Lost(String),
}

impl From<Gone> for End {
    fn from(_: Gone) -> Self {
        Self::Gone
    }
}

impl From<Failure> for End {
    fn from(failure: Failure) -> Self {
        Self::Lost(failure.to_string())
    }
}

impl From<io::Error> for End {
    fn from(error: io::Error) -> Self {
        Self::Lost(error.to_string())
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
        let mut stream = ":\n\nid: 7\nevent: axis\ndata: {\"a\":1}\n\n: alive\n\nevent:sample\r\ndata:[]\r\n\r\n".as_bytes();
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
        assert_eq!(ended.kind(), io::ErrorKind::UnexpectedEof);
    }
}
