//! One request to a service that keeps a machine, and its answer: HTTP/1.1, a connection for each.

use std::io::{self, Read, Write};
use std::net::TcpStream;
use std::os::unix::net::UnixStream;
use std::time::Duration;

use serde_json::Value;

use crate::Failure;

/// The longest that an answer may take: a service answers within a tick.
const PATIENCE: Duration = Duration::from_secs(10);
/// More than any answer has, in bytes.
const ANSWER_MAX: u64 = 16 << 20;

trait Stream: Read + Write {}

impl<S: Read + Write> Stream for S {}

fn connect(at: &str) -> io::Result<Box<dyn Stream>> {
    match at.split_once(':') {
        Some(("unix", path)) => {
            let stream = UnixStream::connect(path)?;
            stream.set_read_timeout(Some(PATIENCE))?;
            Ok(Box::new(stream))
        }
        Some(("tcp", address)) => {
            let stream = TcpStream::connect(address)?;
            stream.set_read_timeout(Some(PATIENCE))?;
            Ok(Box::new(stream))
        }
        _ => Err(io::Error::new(
            io::ErrorKind::InvalidInput,
            "write unix:PATH or tcp:127.0.0.1:PORT",
        )),
    }
}

/// One request over HTTP, and the JSON of its answer.
pub(crate) fn ask(at: &str, method: &str, path: &str, body: &str) -> Result<Value, Failure> {
    let said = exchange(at, method, path, body);
    let said = said.map_err(|error| Failure::Usage {
        what: format!("no service answers at {at}: {error}"),
        help: "start one with `truestage serve`, or say where it is with --at".into(),
    })?;
    let (head, body) = said.split_once("\r\n\r\n").unwrap_or((&said, ""));
    let status = head.split(' ').nth(1).unwrap_or_default();
    let answer: Value = serde_json::from_str(body).unwrap_or_default();
    if status.starts_with('2') {
        return Ok(answer);
    }
    Err(refusal(at, status, &answer))
}

/// The problem that the service answered with, in its words.
fn refusal(at: &str, status: &str, answer: &Value) -> Failure {
    let of = |name: &str| plain(answer[name].as_str().unwrap_or_default());
    match exit_code_of(answer) {
        Some(exit_code) => Failure::Kept {
            said: of("detail"),
            exit_code,
        },
        None => Failure::Usage {
            what: format!("{at} answered {status}, which is no answer of a service of truestage"),
            help: "say with --at where `truestage serve` listens".into(),
        },
    }
}

/// What a problem or a cause would have ended a verb with.
pub(crate) fn exit_code_of(said: &Value) -> Option<u8> {
    said["exit_code"]
        .as_u64()
        .and_then(|it| u8::try_from(it).ok())
}

fn exchange(at: &str, method: &str, path: &str, body: &str) -> io::Result<String> {
    let mut stream = connect(at)?;
    let host = at.strip_prefix("tcp:").unwrap_or("localhost");
    let length = body.len();
    write!(
        stream,
        "{method} {path} HTTP/1.1\r\nhost: {host}\r\nconnection: close\r\ncontent-length: {length}\r\n\r\n{body}"
    )?;
    let mut said = String::new();
    stream.take(ANSWER_MAX).read_to_string(&mut said)?;
    Ok(said)
}

/// Nothing that a terminal would obey, but for the ends of lines.
pub(crate) fn plain(text: &str) -> String {
    text.chars()
        .filter(|it| !it.is_control() || *it == '\n')
        .collect()
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn a_refusal_is_told_in_the_words_of_the_service_and_ends_as_there() {
        let answer = json!({"detail": "axis x has no zero; find it\u{1b}[2J", "exit_code": 3});
        let failure = refusal("unix:s", "409", &answer);
        assert_eq!(failure.to_string(), "axis x has no zero; find it[2J");
        assert_eq!(failure.exit_code(), 3);
        let failure = refusal("tcp:127.0.0.1:80", "404", &Value::Null);
        assert!(failure.to_string().contains("404"), "{failure}");
        assert_eq!(failure.exit_code(), 2);
    }

    #[test]
    fn a_service_that_is_not_there_is_told_with_what_to_do() {
        for at in ["unix:/nowhere/at/all", "nonsense"] {
            let failure = ask(at, "GET", "/v1/machine", "").unwrap_err();
            assert_eq!(failure.exit_code(), 2);
            let said = failure.to_string();
            assert!(
                said.contains(at) && said.contains("truestage serve"),
                "{said}"
            );
        }
    }
}
