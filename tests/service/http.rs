//! A client over HTTP, as anybody writes one: a connection for each request, JSON, problems.

use core::time::Duration;
use std::io::{BufRead, BufReader, Read, Write};
use std::os::unix::fs::MetadataExt;
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde_json::{Value, json};
use service::{
    Access, AnswerRequest, AxisView, CalibrationView, Caller, ChosenView, Edge, Event, JogRequest,
    LeaseRequest, Leased, Listen, MachineView, MotionView, MoveRequest, Problem, RunRequest,
    RunView, StopMode,
};

use crate::client::Client;
use crate::stage::{Gate, Stage};

/// The longest that an answer may take beyond what it is held back for.
const LATE: Duration = Duration::from_secs(60);

/// An answer.
#[derive(Debug)]
pub(crate) struct Answer {
    pub(crate) status: u16,
    pub(crate) head: String,
    pub(crate) body: Vec<u8>,
}

impl Answer {
    pub(crate) fn json(&self) -> Value {
        let read = serde_json::from_slice(&self.body);
        read.unwrap_or_else(|error| panic!("{error}: {self:?}"))
    }

    /// What it says, or the problem that it is. That everybody here is one user is not part of any name.
    fn read<T: serde::de::DeserializeOwned>(&self) -> Result<T, Problem> {
        let said = nameless(&String::from_utf8_lossy(&self.body));
        let value: Value =
            serde_json::from_str(&said).unwrap_or_else(|error| panic!("{error}: {self:?}"));
        if self.status < 400 {
            return Ok(
                serde_json::from_value(value).unwrap_or_else(|error| panic!("{error}: {self:?}"))
            );
        }
        assert!(self.head.contains("application/problem+json"), "{self:?}");
        let problem: Problem =
            serde_json::from_value(value).unwrap_or_else(|error| panic!("{error}: {self:?}"));
        assert_eq!(problem.code.status(), self.status);
        Err(problem)
    }
}

/// Asks over HTTP, on a Unix socket.
pub(crate) struct Http {
    path: PathBuf,
    gate: Arc<Gate>,
    _edge: Edge,
    _folder: tempfile::TempDir,
}

impl Http {
    pub(crate) fn of(stage: &Stage) -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder can be made");
        let path = folder.path().join("socket");
        let edge = Edge::open(
            stage.desk.clone(),
            &[Listen::Unix(path.clone())],
            &Access::default(),
        );
        Self {
            path,
            gate: Arc::clone(&stage.gate),
            _edge: edge.unwrap_or_else(|error| panic!("{error}")),
            _folder: folder,
        }
    }

    pub(crate) fn socket(&self) -> &Path {
        &self.path
    }

    /// Sends `head` and `body` as they are.
    pub(crate) fn send(&self, head: &str, body: &[u8]) -> UnixStream {
        let mut stream = UnixStream::connect(&self.path).expect("it listens");
        stream.set_read_timeout(Some(LATE)).expect("a time");
        let length = body.len();
        let head =
            format!("{head}\r\nhost: x\r\nconnection: close\r\ncontent-length: {length}\r\n\r\n");
        // A service that has heard enough may close before all is sent.
        let _ = stream
            .write_all(head.as_bytes())
            .and_then(|()| stream.write_all(body));
        stream
    }

    /// One request and its answer.
    pub(crate) fn ask(&self, head: &str, body: &[u8]) -> Answer {
        self.ask_and_wait(head, body, Duration::ZERO)
    }

    /// One request and its answer, which may be held back for `wait`.
    fn ask_and_wait(&self, head: &str, body: &[u8], wait: Duration) -> Answer {
        let _passing = self.gate.pass_for(wait);
        let mut bytes = Vec::new();
        let mut stream = self.send(head, body);
        stream.set_read_timeout(Some(wait + LATE)).expect("a time");
        stream.read_to_end(&mut bytes).expect("an answer");
        let end = bytes
            .windows(4)
            .position(|it| it == b"\r\n\r\n")
            .expect("a head");
        let head = String::from_utf8_lossy(&bytes[..end]).to_lowercase();
        let status = head.split(' ').nth(1).and_then(|it| it.parse().ok());
        let body = bytes[end + 4..].to_vec();
        let body = match head.contains("transfer-encoding: chunked") {
            true => unchunked(&body),
            false => body,
        };
        Answer {
            status: status.expect("a status"),
            head,
            body,
        }
    }

    pub(crate) fn post(&self, who: &Caller, path: &str, more: &str, body: &Value) -> Answer {
        let lease = who.lease.as_ref();
        let lease = lease.map_or(String::new(), |it| format!("\r\ntruestage-lease: {it}"));
        let name = &who.name;
        let head = format!("POST {path} HTTP/1.1\r\ntruestage-client: {name}{lease}{more}");
        self.ask(&head, body.to_string().as_bytes())
    }

    fn get<T: serde::de::DeserializeOwned>(&self, path: &str) -> Result<T, Problem> {
        self.ask(&format!("GET {path} HTTP/1.1"), b"").read()
    }

    fn wait<T: serde::de::DeserializeOwned>(
        &self,
        path: &str,
        wait: Duration,
    ) -> Result<T, Problem> {
        let head = format!("GET {path}?wait_s={} HTTP/1.1", wait.as_secs_f64());
        self.ask_and_wait(&head, b"", wait).read()
    }

    /// The events of a stream up to number `last`.
    pub(crate) fn stream(&self, head: &str, last: u64) -> Vec<Event> {
        let _passing = self.gate.pass();
        let lines = BufReader::new(self.send(head, b"")).lines();
        let mut events: Vec<Event> = Vec::new();
        for line in lines {
            let line = line.expect("an event in time");
            if let Some(data) = line.strip_prefix("data: ")
                && let Ok(event) = serde_json::from_str::<Event>(&nameless(data))
            {
                let is_last = event.id >= last;
                events.push(event);
                if is_last {
                    break;
                }
            }
        }
        events
    }
}

/// The user of this process, as names are followed by him.
pub(crate) fn user() -> String {
    let made = tempfile::tempfile().and_then(|it| it.metadata());
    format!(" (uid {})", made.expect("a file can be made").uid())
}

fn nameless(said: &str) -> String {
    said.split(user().as_str()).collect()
}

fn key_header(key: Option<&str>) -> String {
    key.map_or(String::new(), |it| format!("\r\nidempotency-key: {it}"))
}

fn unchunked(mut bytes: &[u8]) -> Vec<u8> {
    let mut whole = Vec::new();
    while let Some(end) = bytes.windows(2).position(|it| it == b"\r\n") {
        let length = String::from_utf8_lossy(&bytes[..end]).into_owned();
        let length = usize::from_str_radix(length.trim(), 16).unwrap_or(0);
        let begin = end + 2;
        whole.extend_from_slice(&bytes[begin..(begin + length).min(bytes.len())]);
        bytes = bytes.get(begin + length + 2..).unwrap_or_default();
    }
    whole
}

impl Client for Http {
    fn interface(&self) -> &'static str {
        "HTTP"
    }

    fn begin(
        &self,
        who: &Caller,
        request: &MoveRequest,
        key: Option<&str>,
    ) -> Result<String, Problem> {
        let answer = self.post(who, "/v1/motions", &key_header(key), &json!(request));
        Ok(answer.read::<MotionView>()?.id)
    }

    fn motion(&self, id: &str, wait: Duration) -> Result<MotionView, Problem> {
        self.wait(&format!("/v1/motions/{id}"), wait)
    }

    fn jog(&self, who: &Caller, request: &JogRequest) -> Result<String, Problem> {
        let answer = self.post(who, "/v1/jog", "", &json!(request));
        Ok(answer.read::<MotionView>()?.id)
    }

    fn renew(&self, who: &Caller, id: &str) -> Result<(), Problem> {
        let answer = self.post(who, &format!("/v1/motions/{id}/renew"), "", &json!({}));
        answer.read::<MotionView>().map(|_| ())
    }

    fn stop(&self, who: &Caller, mode: StopMode) -> Result<(), Problem> {
        let answer = self.post(who, "/v1/stop", "", &json!({"mode": mode}));
        answer.read::<Value>().map(|_| ())
    }

    fn reset(&self, who: &Caller) -> Result<(), Problem> {
        let answer = self.post(who, "/v1/reset", "", &json!({}));
        answer.read::<MachineView>().map(|_| ())
    }

    fn power(&self, who: &Caller, axis: &str, on: bool) -> Result<(), Problem> {
        let verb = if on { "enable" } else { "disable" };
        let answer = self.post(who, &format!("/v1/axes/{axis}/{verb}"), "", &json!({}));
        answer.read::<AxisView>().map(|_| ())
    }

    fn plan_once(
        &self,
        who: &Caller,
        request: &RunRequest,
        key: Option<&str>,
    ) -> Result<String, Problem> {
        let answer = self.post(who, "/v1/runs", &key_header(key), &json!(request));
        Ok(answer.read::<RunView>()?.id)
    }

    fn start(&self, who: &Caller, id: &str) -> Result<(), Problem> {
        let answer = self.post(who, &format!("/v1/runs/{id}/start"), "", &json!({}));
        answer.read::<RunView>().map(|_| ())
    }

    fn abort(&self, who: &Caller, id: &str) -> Result<(), Problem> {
        let answer = self.post(who, &format!("/v1/runs/{id}/abort"), "", &json!({}));
        answer.read::<RunView>().map(|_| ())
    }

    fn pause(&self, who: &Caller, id: &str) -> Result<(), Problem> {
        let answer = self.post(who, &format!("/v1/runs/{id}/pause"), "", &json!({}));
        answer.read::<RunView>().map(|_| ())
    }

    fn resume(&self, who: &Caller, id: &str) -> Result<(), Problem> {
        let answer = self.post(who, &format!("/v1/runs/{id}/resume"), "", &json!({}));
        answer.read::<RunView>().map(|_| ())
    }

    fn answer(&self, who: &Caller, id: &str, answer: &AnswerRequest) -> Result<(), Problem> {
        let path = format!("/v1/runs/{id}/answers");
        let answer = self.post(who, &path, "", &json!(answer));
        answer.read::<RunView>().map(|_| ())
    }

    fn runs(&self) -> Vec<RunView> {
        self.get("/v1/runs").expect("runs are always told")
    }

    fn run(&self, id: &str, wait: Duration) -> Result<RunView, Problem> {
        self.wait(&format!("/v1/runs/{id}"), wait)
    }

    fn lease(&self, who: &Caller, request: &LeaseRequest) -> Result<Leased, Problem> {
        self.post(who, "/v1/lease", "", &json!(request)).read()
    }

    fn release(&self, who: &Caller) -> Result<(), Problem> {
        let lease = who.lease.clone().unwrap_or_default();
        let head = format!("DELETE /v1/lease HTTP/1.1\r\ntruestage-lease: {lease}");
        self.ask(&head, b"").read::<Value>().map(|_| ())
    }

    fn calibrations(&self) -> Vec<CalibrationView> {
        self.get("/v1/calibrations").expect("they can be read")
    }

    fn activate(&self, who: &Caller, id: &str) -> Result<ChosenView, Problem> {
        let answer = self.post(
            who,
            &format!("/v1/calibrations/{id}/activate"),
            "",
            &json!({}),
        );
        answer.read()
    }

    fn rollback(&self, who: &Caller, axis: &str) -> Result<ChosenView, Problem> {
        let answer = self.post(who, "/v1/calibrations/rollback", "", &json!({"axis": axis}));
        answer.read()
    }

    fn clear(&self, who: &Caller, of: &str) -> Result<ChosenView, Problem> {
        let answer = self.post(who, "/v1/calibrations/clear", "", &json!({"axis": of}));
        answer.read()
    }

    fn axis(&self, name: &str) -> Result<AxisView, Problem> {
        self.get(&format!("/v1/axes/{name}"))
    }

    fn machine(&self) -> MachineView {
        self.get("/v1/machine").expect("it is there")
    }

    fn events(&self, after: u64) -> Vec<Event> {
        let newest = self.machine().newest_event;
        if newest <= after {
            return Vec::new();
        }
        self.stream(&format!("GET /v1/events?after={after} HTTP/1.1"), newest)
    }
}
