//! Who asks: other processes.

use core::time::Duration;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpListener;
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::thread;
use std::time::Instant;

/// As long as a program that only answers waits for what is said.
const PATIENCE: Duration = Duration::from_millis(20);

/// A program that has nothing to do with any machine: it says where it listens, hears a little of whatever is said, answers
/// and hangs up.
pub(crate) fn elsewhere() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    println!("{}", listener.local_addr().unwrap());
    for stream in listener.incoming() {
        let Ok(mut stream) = stream else {
            continue;
        };
        let _ = stream.set_read_timeout(Some(PATIENCE));
        let _ = stream.read(&mut [0; 4096]);
        let _ = stream.write_all(b"HTTP/1.1 200 OK\r\ncontent-length: 0\r\n\r\n");
    }
}

/// Ten at 100 Hz each, and a stream of events with a sample at every SYNC.
pub(crate) fn clients(socket: &Path, span: Duration) {
    let until = Instant::now() + span;
    thread::scope(|scope| {
        for _ in 0..10 {
            scope.spawn(|| {
                let mut stream = BufReader::new(UnixStream::connect(socket).unwrap());
                let mut due = Instant::now();
                while due < until {
                    stream
                        .get_mut()
                        .write_all(b"GET /v1/axes HTTP/1.1\r\nhost: x\r\n\r\n")
                        .unwrap();
                    hear(&mut stream);
                    due += Duration::from_millis(10);
                    thread::park_timeout(due.saturating_duration_since(Instant::now()));
                }
            });
        }
        scope.spawn(|| {
            let mut stream = UnixStream::connect(socket).unwrap();
            stream
                .write_all(b"GET /v1/events?sample_ms=5 HTTP/1.1\r\nhost: x\r\n\r\n")
                .unwrap();
            for line in BufReader::new(stream).lines() {
                let _ = line;
                if Instant::now() > until {
                    break;
                }
            }
        });
    });
}

/// One answer with its length in its head.
fn hear(stream: &mut impl BufRead) {
    let (mut line, mut length) = (String::new(), 0);
    while line != "\r\n" {
        line.clear();
        assert!(stream.read_line(&mut line).unwrap() > 0, "it hung up");
        if let Some(said) = line.to_lowercase().strip_prefix("content-length:") {
            length = said.trim().parse().unwrap();
        }
    }
    stream.read_exact(&mut vec![0; length]).unwrap();
}
