//! What nobody should do to a service, all at once.

use core::time::Duration;
use std::collections::VecDeque;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::thread;
use std::time::Instant;

/// So many connections are held.
const HELD: usize = 900;
/// So large a body is sent.
const LARGE: usize = 10_000_000;

/// Floods the service at `address` until `until`: connections that say nothing, half a request or a stream that nobody
/// reads, bodies of 10 MB, and requests as fast as they are answered. What is refused or closed is tried again.
pub fn flood(address: SocketAddr, until: Instant) {
    let host = "host: 127.0.0.1\r\n";
    let half = format!("POST /v1/motions HTTP/1.1\r\n{host}");
    let large = format!("POST /v1/motions HTTP/1.1\r\n{host}content-length: {LARGE}\r\n\r\n");
    let stream = format!("GET /v1/events?sample_ms=5 HTTP/1.1\r\n{host}\r\n");
    let ask = format!("GET /v1/axes HTTP/1.1\r\n{host}connection: close\r\n\r\n");
    let zeros = vec![b' '; LARGE];
    let connect = || TcpStream::connect_timeout(&address, Duration::from_secs(1)).ok();
    thread::scope(|scope| {
        scope.spawn(|| {
            let mut held = VecDeque::new();
            for text in ["", &half, &stream].iter().cycle() {
                if let Some(mut stream) = connect() {
                    let _ = stream.write_all(text.as_bytes());
                    held.push_back(stream);
                }
                if held.len() >= HELD {
                    held.pop_front();
                    thread::park_timeout(Duration::from_millis(1));
                }
                if Instant::now() > until {
                    return;
                }
            }
        });
        scope.spawn(|| {
            while Instant::now() < until {
                if let Some(mut stream) = connect() {
                    let _ = stream.set_write_timeout(Some(Duration::from_secs(1)));
                    let written = stream.write_all(large.as_bytes());
                    let _ = written.and_then(|()| stream.write_all(&zeros));
                }
            }
        });
        for _ in 0..2 {
            scope.spawn(|| {
                while Instant::now() < until {
                    if let Some(mut stream) = connect() {
                        let _ = stream.set_read_timeout(Some(Duration::from_secs(1)));
                        let _ = stream.write_all(ask.as_bytes());
                        let _ = stream.read_to_end(&mut Vec::new());
                    }
                }
            });
        }
    });
}
