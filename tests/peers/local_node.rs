//! python-canopen's `LocalNode` is the server of our SDO client.

use drivers::protocol::sdo_client::{Method, SdoClient, SdoFailure, Timeouts};
use drivers::transport::Transport;
use drivers::transport::clock::Clock;
use drivers::transport::live::{Live, SlcanSettings};
use serde_json::json;
use std::time::Duration;
use tests::{INTERFACE, Rig, SlcanHub};
use wire::can::CanFrame;
use wire::canopen::sdo::AbortCode;
use wire::canopen::{NodeId, Object};
use wire::{Input, Payload, Port};

use crate::peer::Peer;

const BUS: Port = Port(0);
const NODE: u8 = 0x21;
const BOOT_UP: u16 = 0x721;
/// Only a broken run waits this long.
const PATIENCE: Duration = Duration::from_secs(60);
/// A Python server on a busy machine.
const TIMEOUTS: Timeouts = Timeouts {
    response: Duration::from_secs(20),
    block_segment: Duration::from_secs(20),
    late_reply: Duration::from_millis(100),
    quiet: Duration::from_millis(20),
};

/// Our side of the bus, and the server on the other.
struct Talk {
    live: Live,
    client: SdoClient,
    server: Peer,
    /// The bus itself, where it is none of the kernel's; it goes after its users.
    _hub: Option<SlcanHub>,
}

impl Talk {
    fn begin(rig: Rig) -> Self {
        let builder = Live::builder(Clock::real());
        let (builder, arguments, hub) = match rig {
            Rig::Vcan => (
                builder.socketcan(BUS, INTERFACE),
                ["socketcan".into(), INTERFACE.into()],
                None,
            ),
            Rig::Pty | Rig::InProcess => {
                let hub = SlcanHub::new();
                let [ours, theirs] = hub.paths().map(|path| path.display().to_string());
                let settings = SlcanSettings::new(1_000_000);
                (
                    builder.slcan(BUS, ours, settings),
                    ["slcan".into(), theirs],
                    Some(hub),
                )
            }
        };
        let live = builder.build().unwrap_or_else(|error| panic!("{error}"));
        let node = NodeId::new(NODE).expect("0x21 is a node");
        let client = SdoClient::new(node, TIMEOUTS);
        let server = Peer::start("local_node.py", &arguments.each_ref().map(String::as_str));
        assert_eq!(server.report(), json!({ "ready": true }));
        Self {
            live,
            client,
            server,
            _hub: hub,
        }
    }

    /// The next frame with this identifier.
    fn frame(&mut self, id: u16) -> CanFrame {
        let until = self.live.now() + PATIENCE;
        while let Some(arrival) = self.live.receive(until) {
            if let Input::Payload(Payload::Frame(frame)) = arrival.input
                && frame.standard_id() == Some(id)
            {
                return frame;
            }
        }
        panic!("no frame {id:03X} within {PATIENCE:?}");
    }

    /// Until the transfer that was begun has ended.
    fn outcome(&mut self) -> Result<Vec<u8>, SdoFailure> {
        loop {
            while let Some(frame) = self.client.poll_transmit() {
                self.live
                    .send(BUS, &Payload::Frame(frame))
                    .expect("the bus takes a frame");
            }
            if let Some(outcome) = self.client.poll_outcome() {
                return outcome;
            }
            match self.live.receive(self.client.poll_timeout()) {
                Some(arrival) => {
                    if let Input::Payload(Payload::Frame(frame)) = arrival.input {
                        self.client.handle_frame(arrival.at, &frame);
                    }
                }
                None => self.client.handle_timeout(self.live.now()),
            }
        }
    }

    fn read(&mut self, index: u16, sub: u8, method: Method) -> Result<Vec<u8>, SdoFailure> {
        let now = self.live.now();
        self.client
            .read(now, Object::new(index, sub), method)
            .expect("nothing else runs");
        self.outcome()
    }

    fn write(&mut self, index: u16, data: &[u8], method: Method) -> Result<Vec<u8>, SdoFailure> {
        let now = self.live.now();
        let object = Object::new(index, 0);
        self.client
            .write(now, object, data, method)
            .expect("nothing else runs");
        self.outcome()
    }

    #[track_caller]
    fn check_read(&mut self, index: u16, sub: u8, expected: &[u8]) {
        for method in [Method::Auto, Method::Block] {
            let read = self.read(index, sub, method);
            assert_eq!(
                read.as_deref(),
                Ok(expected),
                "{index:04X}:{sub} {method:?}"
            );
        }
    }

    #[track_caller]
    fn check_written(&mut self, index: u16, data: &[u8], method: Method) {
        assert_eq!(
            self.write(index, data, method),
            Ok(Vec::new()),
            "{index:04X} {method:?}"
        );
        self.check_read(index, 0, data);
    }

    #[track_caller]
    fn check_refused(&self, outcome: Result<Vec<u8>, SdoFailure>, object: Object, raw: u32) {
        let code = AbortCode::from_raw(raw);
        assert_eq!(outcome, Err(SdoFailure::Aborted { object, code }));
    }
}

/// Neither a whole number of segments nor of blocks.
fn long_value() -> Vec<u8> {
    (0..1_000u32).map(|at| (at * 13 + at / 256) as u8).collect()
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

#[test]
fn our_sdo_client_reads_and_writes_a_python_canopen_node() {
    for rig in crate::rigs() {
        let mut talk = Talk::begin(rig);
        assert_eq!(talk.frame(BOOT_UP).data(), [0]);
        talk.check_read(0x1000, 0, &[0x92, 0x01, 0x02, 0x00]);
        talk.check_read(0x1018, 4, &[0x04, 0x01, 0x00, 0x00]);
        talk.check_read(0x1008, 0, b"a local node of python-canopen");
        talk.check_written(0x2000, &[0xA5], Method::Auto);
        talk.check_written(0x2001, &[0x34, 0x12], Method::Auto);
        talk.check_written(0x2002, &[0x78, 0x56, 0x34, 0x12], Method::Auto);
        talk.check_written(0x2003, b"eleven long", Method::Auto);
        // This server knows no block transfer: ours falls back to segments.
        talk.check_written(0x2003, &long_value(), Method::Block);
        check_refusals(&mut talk);
        // The client is as good as before after all those refusals.
        talk.check_read(0x1000, 0, &[0x92, 0x01, 0x02, 0x00]);
        let counters = talk.client.counters();
        assert_eq!(
            (counters.aborts_sent, counters.stale, counters.mismatched),
            (0, 0, 0)
        );
        let held = talk.server.finish();
        let expected = json!({
            "u8": "a5", "u16": "3412", "u32": "78563412", "domain": hex(&long_value()),
        });
        assert_eq!(held, expected);
    }
}

fn check_refusals(talk: &mut Talk) {
    let read = talk.read(0x5FFF, 0, Method::Auto);
    talk.check_refused(read, Object::new(0x5FFF, 0), 0x0602_0000);
    let read = talk.read(0x1018, 9, Method::Auto);
    talk.check_refused(read, Object::new(0x1018, 9), 0x0609_0011);
    let read = talk.read(0x2011, 0, Method::Auto);
    talk.check_refused(read, Object::new(0x2011, 0), 0x0601_0001);
    let written = talk.write(0x2010, &[1, 2], Method::Auto);
    talk.check_refused(written, Object::new(0x2010, 0), 0x0601_0002);
    let written = talk.write(0x2002, b"too long for it", Method::Auto);
    talk.check_refused(written, Object::new(0x2002, 0), 0x0607_0010);
}
