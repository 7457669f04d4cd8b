//! A Python program in a process of its own, its output read line by line with a deadline.

use std::io::{BufRead, BufReader, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::thread::JoinHandle;
use std::time::Duration;

use serde_json::Value;

/// Longer than anything that the programs themselves wait for.
const PATIENCE: Duration = Duration::from_secs(120);
const HELP: &str = "run tests/run, or set TRUESTAGE_PEERS_PYTHON";

/// A running program; killed when dropped.
pub(crate) struct Peer {
    name: &'static str,
    child: Child,
    input: Option<ChildStdin>,
    lines: Receiver<String>,
    errors: Option<JoinHandle<String>>,
}

impl Peer {
    /// Starts a program of this folder.
    pub(crate) fn start(name: &'static str, arguments: &[&str]) -> Self {
        let mut child = Command::new(interpreter())
            // No compiled modules beside the sources.
            .arg("-B")
            .arg(package().join("peers").join(name))
            .args(arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap_or_else(|error| panic!("{}: {error}; {HELP}", interpreter().display()));
        let (sender, lines) = mpsc::channel();
        let output = BufReader::new(child.stdout.take().expect("its output is piped"));
        std::thread::spawn(move || {
            // Ends with the program, or when the test is over and nobody listens.
            for line in output.lines().map_while(Result::ok) {
                if sender.send(line).is_err() {
                    break;
                }
            }
        });
        let mut errors = child.stderr.take().expect("its errors are piped");
        let errors = std::thread::spawn(move || {
            let mut text = Vec::new();
            let _ = errors.read_to_end(&mut text);
            String::from_utf8_lossy(&text).into_owned()
        });
        let input = child.stdin.take();
        Self {
            name,
            child,
            input,
            lines,
            errors: Some(errors),
        }
    }

    /// Hands it its whole standard input.
    pub(crate) fn feed(&mut self, text: &str) {
        let written = self
            .input
            .take()
            .map(|mut input| input.write_all(text.as_bytes()));
        assert!(
            matches!(written, Some(Ok(()))),
            "{} takes no input",
            self.name
        );
    }

    /// Its next report.
    pub(crate) fn report(&self) -> Value {
        let line = match self.lines.recv_timeout(PATIENCE) {
            Ok(line) => line,
            Err(RecvTimeoutError::Timeout) => {
                panic!("{} said nothing for {PATIENCE:?}", self.name)
            }
            Err(RecvTimeoutError::Disconnected) => {
                panic!("{} ended without a report", self.name)
            }
        };
        serde_json::from_str(&line).unwrap_or_else(|error| panic!("{}: {error}: {line}", self.name))
    }

    /// Closes its input and takes its last report; it must then end well.
    pub(crate) fn finish(mut self) -> Value {
        drop(self.input.take());
        let report = self.report();
        let more = self.lines.recv_timeout(PATIENCE);
        assert_eq!(
            more,
            Err(RecvTimeoutError::Disconnected),
            "{} goes on",
            self.name
        );
        let status = self.child.wait().expect("a child can be waited for");
        assert!(status.success(), "{} ended with {status}", self.name);
        report
    }

    /// Ends it; what it has written to its standard error.
    fn kill(&mut self) -> String {
        // It may have ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
        let errors = self.errors.take().map(JoinHandle::join);
        errors.and_then(Result::ok).unwrap_or_default()
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        let errors = self.kill();
        if std::thread::panicking() {
            eprintln!("{}'s standard error:\n{errors}", self.name);
        }
    }
}

/// Whether the Python of the peers has these packages.
pub(crate) fn can_import(packages: &str) -> bool {
    let mut python = Command::new(interpreter());
    let ended = python.arg("-c").arg(format!("import {packages}")).output();
    ended.is_ok_and(|it| it.status.success())
}

/// Python with the packages of `requirements.txt`.
fn interpreter() -> PathBuf {
    if let Some(named) = std::env::var_os("TRUESTAGE_PEERS_PYTHON") {
        return PathBuf::from(named);
    }
    let usual = package().join("../target/peers-venv/bin/python");
    assert!(usual.exists(), "no Python for the peers: {HELP}");
    usual
}

fn package() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}
