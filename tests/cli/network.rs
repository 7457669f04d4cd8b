//! A machine that is asked from another computer: certificate, token, role.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::process::Command;

use nix::sys::signal::Signal;

use crate::programs::{Bench, Ended, Process, live_rigs, program, truestage};

/// Of `localhost` and 127.0.0.1.
const CERTIFICATE: &str = include_str!("../service/tls/cert.pem");
const KEY: &str = include_str!("../service/tls/key.pem");
/// Of the same names, and of another key.
const OTHER: &str = include_str!("../service/tls/other.pem");

/// A verb as somebody on another computer runs it.
fn from_afar(bench: &Bench, words: &[&str], token: &str) -> Ended {
    let mut command = Command::new(program("truestage"));
    command
        .current_dir(bench.folder())
        .arg("--json")
        .args(words);
    command.env("TRUESTAGE_CA", "cert.pem");
    command.env("TRUESTAGE_TOKEN", token);
    Process::start(&mut command).end()
}

fn token_of(bench: &Bench, name: &str, role: &str) -> String {
    let made = truestage(bench.folder(), &["token", name, "--role", role]).with_code(0);
    made["token"].as_str().expect("a token").to_owned()
}

/// The port that the system has chosen.
fn port_of(bench: &Bench, service: &mut Process) -> String {
    let lease = bench.records().join("lease");
    let port = || {
        let said = fs::read_to_string(&lease).ok()?;
        let line = said.lines().find(|it| it.contains("listening at tls:"))?;
        Some(line.rsplit_once(':')?.1.to_owned())
    };
    service.wait_until(|| port().is_some());
    port().expect("it was there just now")
}

#[test]
fn a_machine_is_asked_from_another_computer_with_a_token_and_a_certificate() {
    for rig in live_rigs() {
        let bench = Bench::new(rig);
        let open = ["serve", "machine.toml", "--listen", "tcp:0.0.0.0:0"];
        let refused = bench.run(&open);
        assert_eq!(refused.code, Some(2), "{refused:?}");
        for what in ["--tls-cert", "--tokens", "truestage token"] {
            assert!(refused.said.contains(what), "{refused:?}");
        }
        for (name, text) in [("cert.pem", CERTIFICATE), ("key.pem", KEY)] {
            let path = bench.folder().join(name);
            fs::write(&path, text).expect("a file can be written");
            fs::set_permissions(&path, fs::Permissions::from_mode(0o640)).expect("it is ours");
        }
        let anna = token_of(&bench, "anna", "operator");
        let mut service = bench.start(&[
            "serve",
            "machine.toml",
            "--listen",
            "tls:127.0.0.1:0",
            "--listen",
            "unix:truestage.sock",
            "--tls-cert",
            "cert.pem",
            "--tls-key",
            "key.pem",
            "--tokens",
            "tokens.toml",
        ]);
        let at = format!("https://localhost:{}", port_of(&bench, &mut service));
        let status = from_afar(&bench, &["status", "--at", &at], &anna).with_code(0);
        assert_eq!(status["machine"]["state"], "running", "{status}");
        from_afar(&bench, &["stop", "--at", &at], &anna).with_code(0);
        let events = ["monitor", "--all", "--for", "1s", "--at", &at];
        assert_eq!(from_afar_lines(&bench, &events, &anna), Some(0));
        let stranger = from_afar(&bench, &["stop", "--at", &at], "0a1b");
        assert_eq!(stranger.code, Some(3), "{stranger:?}");
        assert!(stranger.said.contains("truestage token"), "{stranger:?}");
        // Somebody else's certificate: no token is told to who has it.
        fs::write(bench.folder().join("cert.pem"), OTHER).expect("a file can be written");
        let other = from_afar(&bench, &["status", "--at", &at], &anna);
        assert_eq!(other.code, Some(2), "{other:?}");
        assert!(other.said.contains("TRUESTAGE_CA"), "{other:?}");
        // On the machine's own computer nobody needs one, and verbs ask there.
        bench.run(&["status"]).with_code(0);
        bench.run(&["zero", "machine.toml"]).with_code(0);
        service.signal(Signal::SIGTERM);
        assert_eq!(service.end().code, Some(0));
        let journal = bench.records().join("service/journal.jsonl");
        let journal = fs::read_to_string(journal).expect("it is there");
        let stop = journal.lines().find(|it| it.contains(r#""kind":"stop""#));
        assert!(
            stop.is_some_and(|it| it.contains(r#""by":"anna""#)),
            "{journal}"
        );
    }
}

/// The exit code of a verb that prints many objects.
fn from_afar_lines(bench: &Bench, words: &[&str], token: &str) -> Option<i32> {
    let mut command = Command::new(program("truestage"));
    command.current_dir(bench.folder()).args(words);
    command.env("TRUESTAGE_CA", "cert.pem");
    command.env("TRUESTAGE_TOKEN", token);
    command.output().expect("it can be started").status.code()
}
