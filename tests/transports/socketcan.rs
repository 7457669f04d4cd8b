//! SocketCAN as the kernel gives it: frames, time stamps, losses, interfaces that come and go.

use core::time::Duration;

use ::socketcan::{CanErrorFrame, CanSocket, Socket};
use drivers::transport::clock::Clock;
use drivers::transport::live::{Live, OpenError};
use drivers::transport::{SendError, Transport};
use tests::{Interface, run};
use wire::can::{BusErrorClass, CanFrame, CanId};
use wire::{Arrival, Input, LinkState};
use wire::{Payload, Port};

const HOST: Port = Port(0);
const LONG: Duration = Duration::from_secs(20);

fn open(interface: &Interface) -> Live {
    let built = Live::builder(Clock::real()).socketcan(HOST, interface.name());
    built.build().unwrap_or_else(|error| panic!("{error}"))
}

fn two(interface: &Interface) -> (Live, Live) {
    (open(interface), open(interface))
}

fn receive(live: &mut Live) -> Arrival {
    let until = live.now() + LONG;
    live.receive(until).expect("an arrival")
}

fn frame(id: u16, data: &[u8]) -> Payload {
    Payload::Frame(CanFrame::standard(id, data))
}

/// Passes over frames until the link has become `wanted`.
#[track_caller]
fn await_link(live: &mut Live, wanted: LinkState) {
    loop {
        match receive(live).input {
            Input::Link(state) if state == wanted => return,
            Input::Link(LinkState::Down) | Input::Payload(_) => {}
            other => panic!("{other:?} before {wanted:?}"),
        }
    }
}

#[test]
#[ignore = "needs SocketCAN"]
fn frames_of_every_kind_pass_between_two_sockets() {
    let vcan = Interface::vcan("tskinds");
    let (mut a, mut b) = two(&vcan);
    let extended = CanFrame::new(CanId::Extended(0x1234_5678), &[]).unwrap();
    let remote = CanFrame::remote(CanId::Standard(0x705), 1).unwrap();
    let kinds = [
        frame(0x601, &[1, 2, 3, 4, 5, 6, 7, 8]),
        frame(0x000, &[]),
        Payload::Frame(extended),
        Payload::Frame(remote),
    ];
    for payload in kinds {
        a.send(HOST, &payload).unwrap();
        assert_eq!(receive(&mut b).input, Input::Payload(payload));
    }
}

#[test]
#[ignore = "needs SocketCAN"]
fn a_frame_bears_the_kernels_time_of_its_arrival() {
    let vcan = Interface::vcan("tsstamps");
    let (mut a, mut b) = two(&vcan);
    for byte in 0..100 {
        let before = b.now();
        a.send(HOST, &frame(0x601, &[byte, 1])).unwrap();
        let arrival = receive(&mut b);
        assert_eq!(arrival.input, Input::Payload(frame(0x601, &[byte, 1])));
        // Two clocks of the kernel are compared: that is good to milliseconds.
        assert!(arrival.at + Duration::from_millis(5) >= before);
        assert!(arrival.at <= b.now());
    }
}

#[test]
#[ignore = "needs SocketCAN"]
fn a_frame_that_waited_in_the_queue_keeps_the_time_of_its_arrival() {
    let vcan = Interface::vcan("tsqueued");
    let (mut a, mut b) = two(&vcan);
    a.send(HOST, &frame(0x181, &[])).unwrap();
    let sent = b.now();
    while b.now().since(sent) < Duration::from_millis(300) {}
    let at = receive(&mut b).at;
    assert!(
        at < sent + Duration::from_millis(250),
        "{at}, sent by {sent}"
    );
}

#[test]
#[ignore = "needs SocketCAN"]
fn what_an_overflowing_receive_queue_drops_is_counted_to_the_last_frame() {
    let vcan = Interface::vcan("tsoverflow");
    let (mut a, mut b) = two(&vcan);
    let total = 20_000_u64;
    for _ in 0..total {
        while a
            .send(HOST, &frame(0x181, &[1, 2, 3, 4, 5, 6, 7, 8]))
            .is_err()
        {}
    }
    let (mut lost, mut received) = (0, 0);
    let mut count = |input: Input| match input {
        Input::Lost(frames) => lost += u64::from(frames),
        _ => received += 1,
    };
    let now = b.now();
    while let Some(arrival) = b.receive(now) {
        count(arrival.input);
    }
    // The kernel tells the loss with the next frame that it queues.
    a.send(HOST, &frame(0x181, &[])).unwrap();
    let last = loop {
        match receive(&mut b).input {
            Input::Payload(payload) if payload == frame(0x181, &[]) => break 1,
            input => count(input),
        }
    };
    assert!(lost > 0, "nothing was lost of {received}");
    assert_eq!(lost + received + last, total + 1);
}

#[test]
#[ignore = "needs SocketCAN"]
fn an_interface_set_down_is_told_and_used_again_when_it_is_up() {
    let vcan = Interface::vcan("tsdown");
    let (mut a, mut b) = two(&vcan);
    vcan.down();
    assert_eq!(receive(&mut a).input, Input::Link(LinkState::Down));
    assert_eq!(receive(&mut b).input, Input::Link(LinkState::Down));
    let state = LinkState::Down;
    let refused = a.send(HOST, &frame(1, &[]));
    assert_eq!(refused, Err(SendError::Unusable { port: HOST, state }));
    vcan.up();
    assert_eq!(receive(&mut a).input, Input::Link(LinkState::Up));
    assert_eq!(receive(&mut b).input, Input::Link(LinkState::Up));
    a.send(HOST, &frame(2, &[])).unwrap();
    assert_eq!(receive(&mut b).input, Input::Payload(frame(2, &[])));
}

#[test]
#[ignore = "needs SocketCAN"]
fn an_interface_that_is_deleted_and_made_again_is_opened_again() {
    let vcan = Interface::vcan("tsdeleted");
    let (mut a, mut b) = two(&vcan);
    a.set_sync(HOST, Some(Duration::from_millis(5))).unwrap();
    vcan.delete();
    await_link(&mut a, LinkState::Gone);
    await_link(&mut b, LinkState::Gone);
    let state = LinkState::Gone;
    let refused = a.send(HOST, &frame(1, &[]));
    assert_eq!(refused, Err(SendError::Unusable { port: HOST, state }));
    vcan.add();
    await_link(&mut a, LinkState::Up);
    await_link(&mut b, LinkState::Up);
    // The SYNC thread has followed to the new socket.
    assert_eq!(receive(&mut b).input, Input::Payload(frame(0x080, &[])));
}

#[test]
#[ignore = "needs SocketCAN"]
fn syncs_reach_the_others_but_not_their_sender() {
    let vcan = Interface::vcan("tssync");
    let (mut a, mut b) = two(&vcan);
    a.set_sync(HOST, Some(Duration::from_millis(2))).unwrap();
    for _ in 0..20 {
        assert_eq!(receive(&mut b).input, Input::Payload(frame(0x080, &[])));
    }
    a.set_sync(HOST, None).unwrap();
    let now = a.now();
    assert_eq!(a.receive(now), None);
}

#[test]
#[ignore = "needs SocketCAN"]
fn error_frames_are_bus_errors() {
    let vcan = Interface::vcan("tserrors");
    let mut live = open(&vcan);
    let other = CanSocket::open(vcan.name()).unwrap();
    let bus_off = CanErrorFrame::new_error(0x40, &[0; 8]).unwrap();
    other.write_frame(&bus_off).unwrap();
    let Input::BusError(error) = receive(&mut live).input else {
        panic!("no bus error")
    };
    assert!(error.class.contains(BusErrorClass::BUS_OFF), "{error:?}");
}

#[test]
#[ignore = "needs SocketCAN"]
fn a_missing_interface_is_named() {
    let built = Live::builder(Clock::real())
        .socketcan(HOST, "nocan9")
        .build();
    assert!(matches!(built, Err(OpenError::NoInterface { interface }) if interface == "nocan9"));
}

#[test]
#[ignore = "needs SocketCAN"]
fn a_full_transmit_queue_refuses_a_frame_and_takes_the_next_one_later() {
    let wire = Interface::pair("tsslow0", "tsslow1");
    // 1 kB/s after the first ten frames, and room for twenty more.
    run("tc qdisc add dev tsslow0 root tbf rate 8kbit burst 160 limit 320");
    let mut live = open(&wire);
    let payload = frame(0x201, &[0; 8]);
    let refused = (0..1_000).find_map(|_| live.send(HOST, &payload).err());
    assert_eq!(refused, Some(SendError::QueueFull { port: HOST }));
    let until = live.now() + LONG;
    while live.send(HOST, &payload).is_err() {
        assert!(live.now() < until, "the queue never empties");
    }
}
