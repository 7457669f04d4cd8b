//! SDO expedited upload round trips on SocketCAN: our client, a raw ping-pong, the server of all.
//!
//! `sdo server INTERFACE` answers every request of every node until it is ended.
//! `sdo ours INTERFACE COUNT` reads by `SdoClient` over `Live`; `sdo raw INTERFACE COUNT` writes
//! and reads 16 bytes on a blocking socket, without looking at them: the kernel's share. Both
//! print the seconds taken as one JSON object.

use std::time::Instant;

use drivers::protocol::sdo_client::{Method, SdoClient, Timeouts};
use drivers::transport::Transport;
use drivers::transport::clock::Clock;
use drivers::transport::live::Live;
use nix::unistd::{read, write};
use socketcan::{CanFilter, CanSocket, Socket as _, SocketOptions as _};
use units::Time;
use wire::canopen::{NodeId, Object};
use wire::{Input, Payload, Port};

const PORT: Port = Port(0);
const NODE: NodeId = NodeId::new(2).expect("1 to 127");
const REQUEST: u32 = 0x600;
const RESPONSE: u32 = 0x580;
/// All nodes, and nothing but standard data frames.
const EVERY_NODE: u32 = 0xC000_0780;
const ONE_NODE: u32 = 0xC000_07FF;
const DEVICE_TYPE: Object = Object::new(0x1000, 0);
const VALUE: [u8; 4] = 0x0002_0192_u32.to_le_bytes();
const WARM_UP: u32 = 200;

/// The kernel's `struct can_frame`.
type Frame = [u8; 16];

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    match words[..] {
        ["server", interface] => serve(interface),
        ["ours", interface, count] => report(ours(interface, count.parse().unwrap())),
        ["raw", interface, count] => report(raw(interface, count.parse().unwrap())),
        _ => eprintln!("sdo: run by tests/bench/run"),
    }
}

fn report(seconds: f64) {
    println!("{}", serde_json::json!({ "seconds": seconds }));
}

fn socket(interface: &str, id: u32, mask: u32) -> CanSocket {
    let socket = CanSocket::open(interface).unwrap();
    socket.set_filters(&[CanFilter::new(id, mask)]).unwrap();
    socket
}

fn receive(socket: &CanSocket) -> Frame {
    let mut frame = Frame::default();
    assert_eq!(read(socket, &mut frame), Ok(frame.len()));
    frame
}

fn send(socket: &CanSocket, frame: &Frame) {
    assert_eq!(write(socket, frame), Ok(frame.len()));
}

/// Four bytes for whatever is asked.
fn serve(interface: &str) {
    let socket = socket(interface, REQUEST, EVERY_NODE);
    loop {
        let mut frame = receive(&socket);
        let response = identifier(&frame) - REQUEST + RESPONSE;
        frame[..4].copy_from_slice(&response.to_ne_bytes());
        frame[8] = 0x43;
        frame[12..].copy_from_slice(&VALUE);
        send(&socket, &frame);
    }
}

fn identifier(frame: &Frame) -> u32 {
    u32::from_ne_bytes(*frame.first_chunk().unwrap())
}

fn raw(interface: &str, count: u32) -> f64 {
    let node = u32::from(NODE.raw());
    let socket = socket(interface, RESPONSE + node, ONE_NODE);
    let mut request = Frame::default();
    request[..4].copy_from_slice(&(REQUEST + node).to_ne_bytes());
    request[4..12].copy_from_slice(&[8, 0, 0, 0, 0x40, 0x00, 0x10, 0x00]);
    timed(count, || {
        send(&socket, &request);
        receive(&socket);
    })
}

fn ours(interface: &str, count: u32) -> f64 {
    let mut live = Live::builder(Clock::real())
        .socketcan(PORT, interface)
        .build()
        .unwrap();
    let mut client = SdoClient::new(NODE, Timeouts::default());
    let mut now = live.now();
    timed(count, || {
        client.read(now, DEVICE_TYPE, Method::Auto).unwrap();
        now = finish(&mut live, &mut client);
        assert_eq!(client.poll_outcome(), Some(Ok(VALUE.to_vec())));
    })
}

/// The loop that the sans-io client asks for; returns when its transfer ended.
fn finish(live: &mut Live, client: &mut SdoClient) -> Time {
    loop {
        while let Some(frame) = client.poll_transmit() {
            live.send(PORT, &Payload::Frame(frame)).unwrap();
        }
        let now = match live.receive(client.poll_timeout()) {
            Some(arrival) => {
                if let Input::Payload(Payload::Frame(frame)) = &arrival.input {
                    client.handle_frame(arrival.at, frame);
                }
                arrival.at
            }
            None => live.now(),
        };
        client.handle_timeout(now);
        if client.poll_timeout() == Time::NEVER {
            return now;
        }
    }
}

/// Seconds for `count` round trips, after some that do not count.
fn timed(count: u32, mut round_trip: impl FnMut()) -> f64 {
    for _ in 0..WARM_UP {
        round_trip();
    }
    let begin = Instant::now();
    for _ in 0..count {
        round_trip();
    }
    begin.elapsed().as_secs_f64()
}
