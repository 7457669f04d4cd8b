//! The service beyond this computer: TLS, tokens, roles.

use std::fs;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use rustls::crypto::ring::default_provider;
use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{CertificateDer, ServerName};
use rustls::{ClientConfig, ClientConnection, RootCertStore, StreamOwned};
use serde_json::{Value, json};
use service::{Access, AccessFiles, Edge, Listen, add_token};
use tests::LINEAR;

use crate::contract::questions::stage_with_a_reader;
use crate::stage::Stage;

/// Of `localhost` and 127.0.0.1, until 2126: docs/service.md has the command that made them.
const CERTIFICATE: &str = include_str!("tls/cert.pem");
const KEY: &str = include_str!("tls/key.pem");
/// Nothing here takes so long.
const LATE: Duration = Duration::from_secs(60);

/// What a service is opened to the network by, and the tokens of three people.
struct Files {
    folder: tempfile::TempDir,
    tokens: [String; 3],
}

const ROLES: [&str; 3] = ["viewer", "operator", "commissioner"];

impl Files {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("tokens.toml");
        let token = |role| add_token(&path, &format!("our {role}"), role, "today").unwrap();
        let tokens = ROLES.map(token);
        for (name, text) in [("cert.pem", CERTIFICATE), ("key.pem", KEY)] {
            let path = folder.path().join(name);
            fs::write(&path, text).unwrap();
            fs::set_permissions(&path, fs::Permissions::from_mode(0o600)).unwrap();
        }
        Self { folder, tokens }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn given(&self) -> AccessFiles {
        AccessFiles {
            certificate: Some(self.path("cert.pem")),
            key: Some(self.path("key.pem")),
            tokens: Some(self.path("tokens.toml")),
            everywhere: false,
        }
    }
}

fn on_a_stage(body: impl FnOnce(&Stage, &Files)) {
    let folder = tempfile::tempdir().unwrap();
    let stage = Stage::new(tests::rigs()[0], (LINEAR, 51), folder.path(), |text| text);
    body(&stage, &Files::new());
    stage.end();
}

struct Answer {
    status: u16,
    head: String,
    body: String,
}

impl Answer {
    fn read(stream: &mut impl Read) -> Self {
        let mut said = String::new();
        stream.read_to_string(&mut said).unwrap();
        let (head, body) = said.split_once("\r\n\r\n").unwrap();
        let status = head.split(' ').nth(1).unwrap().parse().unwrap();
        Self {
            status,
            head: head.to_lowercase(),
            body: body.to_owned(),
        }
    }

    fn json(&self) -> Value {
        serde_json::from_str(&self.body).unwrap()
    }
}

fn request(line: &str, headers: &str, body: &Value) -> String {
    let body = match body {
        Value::Null => String::new(),
        body => body.to_string(),
    };
    let length = body.len();
    format!(
        "{line} HTTP/1.1\r\nhost: localhost\r\n{headers}connection: close\r\ncontent-length: {length}\r\n\r\n{body}"
    )
}

fn bearer(token: &str) -> String {
    format!("authorization: Bearer {token}\r\n")
}

/// A service that listens with TLS, and what is asked of it.
struct Net<'a> {
    stage: &'a Stage,
    at: SocketAddr,
    config: Arc<ClientConfig>,
    _edge: Edge,
}

impl<'a> Net<'a> {
    fn new(stage: &'a Stage, files: &Files) -> Self {
        let access = Access::open(files.given()).unwrap();
        let any = ["tls:127.0.0.1:0".parse().unwrap()];
        let edge = Edge::open(stage.desk.clone(), &any, &access).unwrap();
        let Listen::Tls(at) = edge.places()[0] else {
            panic!("it is TLS")
        };
        let mut roots = RootCertStore::empty();
        let known = CertificateDer::from_pem_slice(CERTIFICATE.as_bytes()).unwrap();
        roots.add(known).unwrap();
        let builder = ClientConfig::builder_with_provider(Arc::new(default_provider()));
        let builder = builder.with_safe_default_protocol_versions().unwrap();
        let config = builder.with_root_certificates(roots).with_no_client_auth();
        Self {
            stage,
            at,
            config: Arc::new(config),
            _edge: edge,
        }
    }

    fn ask(&self, line: &str, headers: &str, body: &Value) -> Answer {
        let _passing = self.stage.gate.pass();
        let name = ServerName::try_from("localhost").unwrap();
        let connection = ClientConnection::new(Arc::clone(&self.config), name).unwrap();
        let stream = TcpStream::connect(self.at).unwrap();
        stream.set_read_timeout(Some(LATE)).unwrap();
        let mut stream = StreamOwned::new(connection, stream);
        stream
            .write_all(request(line, headers, body).as_bytes())
            .unwrap();
        Answer::read(&mut stream)
    }
}

#[test]
fn without_a_token_that_is_known_nobody_is_let_in_and_is_told_what_to_do() {
    on_a_stage(|stage, files| {
        let net = Net::new(stage, files);
        let hash = fs::read_to_string(files.path("tokens.toml")).unwrap();
        let hash = hash.split("sha256 = \"").nth(1).unwrap()[..64].to_owned();
        for headers in [
            String::new(),
            bearer("0a1b"),
            bearer(&hash),
            "authorization: Digest x\r\n".into(),
            "truestage-client: our commissioner\r\n".into(),
        ] {
            for line in ["GET /v1/machine", "POST /v1/stop", "GET /", "GET /metrics"] {
                let answer = net.ask(line, &headers, &Value::Null);
                assert_eq!(answer.status, 401, "{line} {headers}");
                let problem = answer.json();
                assert_eq!(problem["code"], "unauthorized", "{problem}");
                let help = problem["help"].as_str().unwrap();
                assert!(help.contains("truestage token"), "{problem}");
                for scheme in ["bearer", "basic"] {
                    let asked = format!("www-authenticate: {scheme} ");
                    assert!(answer.head.contains(&asked), "{}", answer.head);
                }
            }
        }
        let events = stage.desk.events(0);
        assert!(
            events.iter().all(|it| it.kind != "stop"),
            "nothing was stopped"
        );
    });
}

#[test]
fn each_role_may_do_its_own_and_what_those_before_it_may() {
    on_a_stage(|stage, files| {
        let net = Net::new(stage, files);
        let run = |kind: &str| json!({"kind": kind});
        // What is asked, and how many of the three roles are let in, from the last one on.
        let cases = [
            ("GET /v1/machine", Value::Null, 3),
            ("GET /metrics", Value::Null, 3),
            ("POST /v1/stop", Value::Null, 3),
            ("POST /v1/motions", json!({"targets": {"x": "1mm"}}), 2),
            ("POST /v1/jog", json!({"axis": "x", "speed": "1mm/s"}), 2),
            ("POST /v1/axes/x/disable", Value::Null, 2),
            ("POST /v1/lease", json!({"name": "anna"}), 2),
            ("DELETE /v1/lease", Value::Null, 2),
            ("POST /v1/runs", run("zero"), 2),
            ("POST /v1/runs", run("verify"), 2),
            ("POST /v1/runs", run("calibrate"), 1),
            ("POST /v1/calibrations/0a/activate", Value::Null, 1),
            ("POST /v1/runs", run("second_memory"), 1),
            ("POST /v1/calibrations/rollback", json!({"axis": "x"}), 1),
            ("POST /v1/calibrations/clear", json!({"axis": "x"}), 1),
            // What is not there yet is for those who may do everything.
            ("POST /v1/anything", Value::Null, 1),
        ];
        for (line, body, let_in) in cases {
            for (at, token) in files.tokens.iter().enumerate() {
                let answer = net.ask(line, &bearer(token), &body);
                let is_let_in = at + let_in >= ROLES.len();
                let role = ROLES[at];
                assert_eq!(
                    answer.status != 403,
                    is_let_in,
                    "{line} {role}: {}",
                    answer.body
                );
                assert_ne!(answer.status, 401, "{line} {role}");
                if !is_let_in {
                    let problem = answer.json();
                    let cause = problem["cause"].as_str().unwrap();
                    let needed = ROLES[ROLES.len() - let_in];
                    // Which run it is, is asked only of those who may have one.
                    let is_any_run = line == "POST /v1/runs" && role == "viewer";
                    assert!(cause.contains(needed) || is_any_run, "{problem}");
                    assert!(cause.ends_with(role), "{problem}");
                }
            }
        }
    });
}

#[test]
fn an_operator_answers_with_words_and_what_is_read_of_a_calibration_is_said_by_a_commissioner() {
    let folder = tempfile::tempdir().unwrap();
    let stage = stage_with_a_reader(tests::rigs()[0], folder.path());
    let files = Files::new();
    let net = Net::new(&stage, &files);
    let [_, operator, commissioner] = files.tokens.each_ref().map(|it| bearer(it));
    let begin = |kind: &str| {
        let body = json!({"kind": kind, "start": true});
        let begun = net.ask("POST /v1/runs", &commissioner, &body);
        assert_eq!(begun.status, 201, "{}", begun.body);
        begun.json()["id"].as_str().unwrap().to_owned()
    };
    let until = |id: &str, reached: &dyn Fn(&Value) -> bool| {
        let _passing = stage.gate.wait_for_an_end();
        let look = || net.ask(&format!("GET /v1/runs/{id}"), &operator, &Value::Null);
        let mut looks = core::iter::repeat_with(|| look().json()).take(10_000);
        looks.find(reached).expect("it comes so far")
    };
    let zero = begin("zero");
    until(&zero, &|run| run["state"] == "done");
    let id = begin("calibrate");
    let line = format!("POST /v1/runs/{id}/answers");
    let plate = until(&id, &|run| run["question"]["what"] == "turn_plate");
    let answer = json!({"question": plate["question"]["number"], "answer": "done"});
    assert_eq!(net.ask(&line, &operator, &answer).status, 200);
    let read = until(&id, &|run| run["question"]["what"] == "read_line");
    let answer = json!({"question": read["question"]["number"], "answer": "1arcsec"});
    let refused = net.ask(&line, &operator, &answer);
    assert_eq!(refused.status, 403, "{}", refused.body);
    let cause = refused.json()["cause"].to_string();
    assert!(
        cause.contains("role commissioner, and your token is that of an operator"),
        "{cause}"
    );
    assert_eq!(net.ask(&line, &commissioner, &answer).status, 200);
    let pause = format!("POST /v1/runs/{id}/pause");
    assert_eq!(net.ask(&pause, &operator, &Value::Null).status, 200);
    drop(net);
    stage.end();
}

#[test]
fn who_does_something_is_the_owner_of_the_token_whatever_he_calls_himself() {
    on_a_stage(|stage, files| {
        let net = Net::new(stage, files);
        let headers = bearer(&files.tokens[1]) + "truestage-client: somebody else\r\n";
        assert_eq!(net.ask("POST /v1/stop", &headers, &Value::Null).status, 200);
        let body = json!({"name": "somebody else"});
        assert_eq!(net.ask("POST /v1/lease", &headers, &body).status, 200);
        let events = stage.desk.events(0);
        let of = |kind: &str, name: &str| {
            let event = events.iter().rfind(|it| it.kind == kind).unwrap();
            event.data[name].clone()
        };
        assert_eq!(of("stop", "by"), "our operator");
        assert_eq!(of("lease", "name"), "our operator");
    });
}

#[test]
fn plain_http_is_told_to_speak_tls_and_a_page_from_elsewhere_is_kept_out() {
    on_a_stage(|stage, files| {
        let net = Net::new(stage, files);
        let mut stream = TcpStream::connect(net.at).unwrap();
        stream.set_read_timeout(Some(LATE)).unwrap();
        stream
            .write_all(request("GET /", "", &Value::Null).as_bytes())
            .unwrap();
        let answer = Answer::read(&mut stream);
        assert_eq!(answer.status, 400);
        assert!(answer.body.contains("https://"), "{}", answer.body);
        let token = bearer(&files.tokens[1]);
        for (origin, status) in [
            ("https://localhost", 200),
            ("http://localhost", 403),
            ("https://evil.example", 403),
        ] {
            let headers = format!("{token}origin: {origin}\r\n");
            let answer = net.ask("POST /v1/stop", &headers, &Value::Null);
            assert_eq!(answer.status, status, "{origin}");
        }
    });
}

fn unix_with_tokens(stage: &Stage, files: &Files) -> (Edge, PathBuf) {
    let given = AccessFiles {
        everywhere: true,
        ..files.given()
    };
    let access = Access::open(given).unwrap();
    let path = files.path("socket");
    let place = Listen::Unix(path.clone());
    let edge = Edge::open(stage.desk.clone(), &[place], &access).unwrap();
    (edge, path)
}

fn ask_unix(stage: &Stage, path: &Path, text: &str) -> Answer {
    let _passing = stage.gate.pass();
    let mut stream = UnixStream::connect(path).unwrap();
    stream.set_read_timeout(Some(LATE)).unwrap();
    stream.write_all(text.as_bytes()).unwrap();
    Answer::read(&mut stream)
}

#[test]
fn where_it_is_asked_for_a_unix_socket_needs_a_token_too() {
    on_a_stage(|stage, files| {
        let (_edge, path) = unix_with_tokens(stage, files);
        let ask = |headers: &str| {
            let text = request("GET /v1/machine", headers, &Value::Null);
            ask_unix(stage, &path, &text).status
        };
        assert_eq!(ask(""), 401);
        assert_eq!(ask(&bearer(&files.tokens[0])), 200);
    });
}

/// Sent at once, on one connection: however slow the computer is, they come faster than ten a second.
#[test]
fn whoever_tries_tokens_is_soon_told_to_wait_and_nobody_else_is() {
    on_a_stage(|stage, files| {
        let (_edge, path) = unix_with_tokens(stage, files);
        let attempt = "GET /v1/machine HTTP/1.1\r\nhost: x\r\nauthorization: Bearer 0a1b\r\n\r\n";
        let last = request("GET /v1/machine", &bearer("0a1b"), &Value::Null);
        let _passing = stage.gate.pass();
        let mut stream = UnixStream::connect(&path).unwrap();
        stream.set_read_timeout(Some(LATE)).unwrap();
        stream
            .write_all((attempt.repeat(200) + &last).as_bytes())
            .unwrap();
        let mut said = String::new();
        stream.read_to_string(&mut said).unwrap();
        let of = |status: &str| said.matches(&format!("HTTP/1.1 {status} ")).count();
        assert_eq!(of("401") + of("429"), 201);
        assert!(
            of("401") >= 20 && of("429") >= 20,
            "{} {}",
            of("401"),
            of("429")
        );
        assert!(said.to_lowercase().contains("retry-after: 1"));
        let good = request("GET /v1/machine", &bearer(&files.tokens[0]), &Value::Null);
        assert_eq!(ask_unix(stage, &path, &good).status, 200);
    });
}

#[test]
fn what_is_missing_or_open_to_others_is_refused_before_anything_is_listened_to() {
    let files = Files::new();
    let refused = |given: AccessFiles| Access::open(given).unwrap_err().to_string();
    let said = refused(AccessFiles {
        key: None,
        ..files.given()
    });
    assert!(said.contains("--tls-key"), "{said}");
    let said = refused(AccessFiles {
        certificate: Some(files.path("tokens.toml")),
        ..files.given()
    });
    assert!(
        said.contains("tokens.toml") && said.contains("certificate"),
        "{said}"
    );
    let said = refused(AccessFiles {
        tokens: None,
        everywhere: true,
        ..files.given()
    });
    assert!(said.contains("--tokens"), "{said}");
    for name in ["key.pem", "tokens.toml"] {
        let path = files.path(name);
        fs::set_permissions(&path, fs::Permissions::from_mode(0o644)).unwrap();
        let said = refused(files.given());
        let command = format!("chmod 640 {}", path.display());
        assert!(said.contains(&command), "{said}");
        fs::set_permissions(&path, fs::Permissions::from_mode(0o600)).unwrap();
    }
    assert!(Access::open(files.given()).is_ok());
}

/// Asks as a viewer until the file of tokens has been read again: within a second.
fn wait_for(net: &Net<'_>, token: &str, status: u16) {
    let begun = Instant::now();
    loop {
        let answer = net.ask("GET /v1/machine", &bearer(token), &Value::Null);
        if answer.status == status {
            return;
        }
        assert!(begun.elapsed() < LATE, "{} {}", answer.status, answer.body);
        thread::park_timeout(Duration::from_millis(100));
    }
}

#[test]
fn a_slip_in_the_file_of_tokens_takes_the_stop_from_nobody_and_is_told() {
    on_a_stage(|stage, files| {
        let net = Net::new(stage, files);
        let path = files.path("tokens.toml");
        let good = fs::read_to_string(&path).unwrap();
        fs::write(&path, format!("{good}\n[[token]]\nname = \"otto\"\n")).unwrap();
        wait_for(&net, &files.tokens[0], 503);
        for (token, role) in files.tokens.iter().zip(ROLES) {
            let stop = net.ask("POST /v1/stop", &bearer(token), &Value::Null);
            assert_eq!(stop.status, 200, "{role}: {}", stop.body);
            for line in ["GET /v1/machine", "POST /v1/reset"] {
                let other = net.ask(line, &bearer(token), &Value::Null);
                assert_eq!(other.status, 503, "{line} {role}: {}", other.body);
            }
        }
        let stranger = net.ask("POST /v1/stop", &bearer("0a1b"), &Value::Null);
        assert_eq!(stranger.status, 503, "{}", stranger.body);
        let warnings = || {
            let _passing = stage.gate.pass();
            let events = stage.desk.events(0).into_iter();
            let warnings = events.filter(|it| it.kind == "warning");
            let texts = warnings.map(|it| it.data["text"].as_str().unwrap().to_owned());
            texts
                .filter(|it| it.contains("the file of tokens"))
                .collect::<Vec<_>>()
        };
        let wait_for_warnings = |count: usize| {
            let begun = Instant::now();
            while warnings().len() < count {
                assert!(begun.elapsed() < LATE, "{:?}", warnings());
                thread::park_timeout(Duration::from_millis(20));
            }
        };
        wait_for_warnings(1);
        fs::write(&path, &good).unwrap();
        wait_for(&net, &files.tokens[0], 200);
        wait_for_warnings(2);
        let told = warnings();
        assert_eq!(told.len(), 2, "once each: {told:?}");
        assert!(
            told[0].contains("tokens.toml:") && told[0].contains("missing field"),
            "{told:?}"
        );
        assert!(told[1].contains("can be used again"), "{told:?}");
    });
}
