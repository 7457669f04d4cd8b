//! One request to a service that keeps a machine, and its answer: HTTP/1.1, a connection for each.

use std::env;
use std::ffi::OsString;
use std::io::{self, BufRead, BufReader, Read, Write};
use std::os::unix::net::UnixStream;
use std::sync::mpsc::sync_channel;
use std::thread;
use std::time::Duration;

use serde_json::Value;

use crate::Failure;
pub(crate) use crate::program::plain::plain;
use crate::program::secure;

/// The longest that an answer may take: a service answers within a tick.
const PATIENCE: Duration = Duration::from_secs(10);
/// The longest that a person waits who wants to know whether the machine stops, or what it does.
const URGENT: Duration = Duration::from_secs(2);
/// More than any answer has, in bytes.
const ANSWER_MAX: u64 = 16 << 20;
/// The token of a lease, as `POST /v1/lease` gave it.
const LEASE: &str = "TRUESTAGE_LEASE";
/// What a service beyond this computer knows this program by, as `truestage token` printed it.
const TOKEN: &str = "TRUESTAGE_TOKEN";
/// A device, a bus, or a service in their place that is gone.
pub(crate) const LOST: u8 = 4;

trait Stream: Read + Write + Send {}

impl<S: Read + Write + Send> Stream for S {}

fn connect(at: &str) -> io::Result<Box<dyn Stream>> {
    match at.split_once(':') {
        Some(("unix", path)) => {
            let stream = UnixStream::connect(path)?;
            stream.set_read_timeout(Some(PATIENCE))?;
            Ok(Box::new(stream))
        }
        Some(("tcp", address)) => {
            let stream = secure::open(address, PATIENCE)?;
            stream.set_read_timeout(Some(PATIENCE))?;
            Ok(Box::new(stream))
        }
        Some(("tls", address)) => Ok(Box::new(secure::connect(address, PATIENCE)?)),
        Some(("https", rest)) => {
            let address = rest.trim_start_matches('/').trim_end_matches('/');
            Ok(Box::new(secure::connect(address, PATIENCE)?))
        }
        _ => Err(io::Error::new(
            io::ErrorKind::InvalidInput,
            "write unix:PATH, tcp:127.0.0.1:PORT or https://HOST:PORT",
        )),
    }
}

/// One request over HTTP, and the JSON of its answer.
pub(crate) fn ask(at: &str, method: &str, path: &str, body: &str) -> Result<Value, Failure> {
    let stream = connect(at).map_err(|error| Failure::Usage {
        what: format!("no service answers at {at}: {error}"),
        help: "start one with `truestage serve`, or say where it is with --at".into(),
    })?;
    exchange(stream, at, (method, path), body)
}

/// What `asked` comes to, in two seconds at most: also where the service takes a connection and says nothing, or too slowly.
/// What has been sent is not taken back.
pub(crate) fn urgently<T: Send + 'static>(
    at: &str,
    asked: impl FnOnce(&str) -> Result<T, Failure> + Send + 'static,
) -> Result<T, Failure> {
    let (answer, answered) = sync_channel(1);
    let service = at.to_owned();
    // It is left behind where it hangs: the program ends.
    thread::spawn(move || answer.send(asked(&service)));
    answered
        .recv_timeout(URGENT)
        .unwrap_or_else(|_| Err(silent(at, URGENT)))
}

/// Nothing is known of the drives of a service that does not answer.
fn silent(at: &str, limit: Duration) -> Failure {
    Failure::Kept {
        said: format!(
            "the service at {at} does not answer: use the emergency stop; nothing was heard for {} s, and nothing is \
             known of the drives. What was asked for may still be done when it goes on",
            limit.as_secs()
        ),
        exit_code: LOST,
    }
}

/// An answer without an end, from its first line on. A service that lives says so every three seconds; one that says
/// nothing for [`PATIENCE`] is lost.
pub(crate) fn follow(at: &str, path: &str) -> Result<impl BufRead + use<>, Failure> {
    let gone = |error: io::Error| gone(at, path, &error);
    let stream = connect(at).map_err(gone)?;
    let (host, rights) = (host_of(at), rights()?);
    // HTTP/1.0: the answer comes as it is, not in chunks.
    let request =
        format!("GET {path} HTTP/1.0\r\nhost: {host}\r\n{rights}accept: text/event-stream\r\n\r\n");
    let answer = Answer::to(stream, &request).map_err(gone)?;
    if answer.is_good() {
        return Ok(answer.body);
    }
    let (status, body) = answer.whole().map_err(gone)?;
    Err(refusal(at, &status, &body))
}

/// An answer whose head has come.
struct Answer {
    status: String,
    body: BufReader<Box<dyn Stream>>,
}

impl Answer {
    fn to(mut stream: Box<dyn Stream>, request: &str) -> io::Result<Self> {
        stream.write_all(request.as_bytes())?;
        let mut body = BufReader::new(stream);
        let mut head = String::new();
        // To the empty line, or as far as it goes.
        while body.read_line(&mut head)? > 0 && !head.ends_with("\r\n\r\n") {}
        if head.is_empty() {
            let what = "it hung up without an answer";
            return Err(io::Error::new(io::ErrorKind::UnexpectedEof, what));
        }
        let status = head.split(' ').nth(1).unwrap_or_default().to_owned();
        Ok(Self { status, body })
    }

    fn is_good(&self) -> bool {
        self.status.starts_with('2')
    }

    /// Its status, and all of its body.
    fn whole(self) -> io::Result<(String, String)> {
        let mut body = String::new();
        self.body.take(ANSWER_MAX).read_to_string(&mut body)?;
        Ok((self.status, body))
    }
}

fn host_of(at: &str) -> &str {
    let of = |kind| at.strip_prefix(kind);
    let host = of("tcp:").or_else(|| of("tls:")).or_else(|| of("https:"));
    host.map_or("localhost", |it| it.trim_matches('/'))
}

/// The same of a service that has begun what this program waits for: one that is not there any more has ended meanwhile.
pub(crate) fn ask_on(at: &str, method: &str, path: &str, body: &str) -> Result<Value, Failure> {
    let stream = connect(at).map_err(|error| gone(at, path, &error))?;
    exchange(stream, at, (method, path), body)
}

fn gone(at: &str, path: &str, error: &io::Error) -> Failure {
    if let io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut = error.kind() {
        return silent(at, PATIENCE);
    }
    Failure::Kept {
        said: format!(
            "the service at {at} has ended before {path} was answered ({error}); without it the drives stop and are \
             switched off: see its messages for the cause, start it again and zero the machine"
        ),
        exit_code: LOST,
    }
}

fn exchange(
    stream: Box<dyn Stream>,
    at: &str,
    (method, path): (&str, &str),
    body: &str,
) -> Result<Value, Failure> {
    let (host, rights) = (host_of(at), rights()?);
    let length = body.len();
    let request = format!(
        "{method} {path} HTTP/1.1\r\nhost: {host}\r\nconnection: close\r\n{rights}content-length: {length}\r\n\r\n{body}"
    );
    let answer = Answer::to(stream, &request).map_err(|error| gone(at, path, &error))?;
    let is_good = answer.is_good();
    let whole = answer.whole();
    let (status, body) = whole.map_err(|error| gone(at, path, &error))?;
    match is_good {
        true => Ok(serde_json::from_str(&body).unwrap_or_default()),
        false => Err(refusal(at, &status, &body)),
    }
}

/// The problem that the service answered with, in its words.
fn refusal(at: &str, status: &str, body: &str) -> Failure {
    let answer: Value = serde_json::from_str(body).unwrap_or_default();
    let of = |name: &str| plain(answer[name].as_str().unwrap_or_default());
    match exit_code_of(&answer) {
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

/// What proves who this program acts for, and that he holds the machine's lease. From the environment: everybody on the
/// computer can read the words of a command line.
fn rights() -> Result<String, Failure> {
    let lease = header(
        "truestage-lease: ",
        LEASE,
        "POST /v1/lease",
        env::var_os(LEASE),
    )?;
    let token = header(
        "authorization: Bearer ",
        TOKEN,
        "truestage token",
        env::var_os(TOKEN),
    )?;
    Ok(lease + &token)
}

fn header(
    begin: &str,
    variable: &str,
    giver: &str,
    token: Option<OsString>,
) -> Result<String, Failure> {
    let Some(token) = token.filter(|it| !it.is_empty()) else {
        return Ok(String::new());
    };
    match token.to_str() {
        Some(token) if token.bytes().all(|it| it.is_ascii_graphic()) => {
            Ok(format!("{begin}{token}\r\n"))
        }
        _ => Err(Failure::Usage {
            what: format!("{variable} in the environment is no token"),
            help: format!("take the one that {giver} gave, or leave it out"),
        }),
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn a_refusal_is_told_in_the_words_of_the_service_and_ends_as_there() {
        let answer = json!({"detail": "axis x has no zero; find it\u{1b}[2J", "exit_code": 3});
        let failure = refusal("unix:s", "409", &answer.to_string());
        assert_eq!(failure.to_string(), "axis x has no zero; find it[2J");
        assert_eq!(failure.exit_code(), 3);
        let failure = refusal("tcp:127.0.0.1:80", "404", "<html>");
        assert!(failure.to_string().contains("404"), "{failure}");
        assert_eq!(failure.exit_code(), 2);
    }

    #[test]
    fn a_token_adds_one_header_and_nothing_else() {
        let of =
            |token: Option<&str>| header("truestage-lease: ", LEASE, "", token.map(Into::into));
        assert_eq!(of(None).unwrap(), "");
        assert_eq!(of(Some("0a1b")).unwrap(), "truestage-lease: 0a1b\r\n");
        let refused = of(Some("x\r\nhost: y")).unwrap_err();
        assert!(refused.to_string().contains("TRUESTAGE_LEASE"), "{refused}");
    }

    #[test]
    fn a_service_that_has_gone_meanwhile_is_no_mistake_of_the_command_line() {
        let failure = ask_on("unix:/nowhere/at/all", "GET", "/v1/runs/r1-1", "").unwrap_err();
        assert_eq!(failure.exit_code(), 4);
        assert!(failure.to_string().contains("r1-1"), "{failure}");
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
