//! The client against a small server of its own kind, over a wire that drops and repeats
//! frames. The server shares nothing with the client but the constants of CiA 301, written out
//! again here. Whatever the wire does, an answer "done" must be the truth.

use core::time::Duration;
use std::collections::VecDeque;

use proptest::prelude::*;
use units::Time;

use super::*;

const NODE: NodeId = NodeId::new(9).unwrap();
const OBJECT: Object = Object::new(0x2000, 3);
const OBJECT_BYTES: [u8; 3] = [0x00, 0x20, 0x03];

#[derive(Debug, Default)]
enum Phase {
    #[default]
    Ready,
    Upload {
        at: usize,
        toggle: u8,
    },
    Download {
        toggle: u8,
    },
    BlockUpload {
        at: usize,
        sent: usize,
    },
    BlockUploadEnd,
    BlockDownload {
        expected: u8,
    },
    BlockDownloadEnd,
}

/// A polite server with one object.
#[derive(Debug, Default)]
struct Server {
    value: Vec<u8>,
    incoming: Vec<u8>,
    phase: Phase,
    block_size: u8,
    replies: VecDeque<[u8; 8]>,
}

fn crc(data: &[u8]) -> u16 {
    let mut crc = 0_u32;
    for byte in data {
        for bit in (0..8).rev() {
            let flip = (crc >> 15 ^ u32::from(byte >> bit)) & 1;
            crc = (crc << 1 & 0xFFFF) ^ (flip * 0x1021);
        }
    }
    crc as u16
}

impl Server {
    fn say(&mut self, command: u8, rest: &[u8]) {
        let mut payload = [0; 8];
        payload[0] = command;
        payload[1..=rest.len()].copy_from_slice(rest);
        self.replies.push_back(payload);
    }

    fn say_about_object(&mut self, command: u8, number: u32) {
        let mut rest = OBJECT_BYTES.to_vec();
        rest.extend(number.to_le_bytes());
        self.say(command, &rest);
    }

    fn abort(&mut self, code: u32) {
        self.phase = Phase::Ready;
        self.say_about_object(0x80, code);
    }

    fn hear(&mut self, request: [u8; 8]) {
        if request[0] == 0x80 {
            self.phase = Phase::Ready;
            return;
        }
        if let Phase::BlockDownload { expected } = self.phase {
            self.hear_block_segment(expected, request);
            return;
        }
        match request[0] & 0xE0 {
            0x40 => self.begin_upload(request),
            0x60 => self.next_segment(request),
            0x20 => self.begin_download(request),
            0x00 => self.take_segment(request),
            0xA0 => self.block_upload(request),
            0xC0 => self.block_download(request),
            _ => self.abort(0x0504_0001),
        }
    }

    fn begin_upload(&mut self, request: [u8; 8]) {
        if request[1..4] != OBJECT_BYTES {
            // Another object, of a fence.
            let mut reply = request;
            reply[0] = 0x43;
            self.replies.push_back(reply);
            return;
        }
        let value = self.value.clone();
        if (1..=4).contains(&value.len()) {
            let mut rest = OBJECT_BYTES.to_vec();
            rest.extend(&value);
            self.say(0x43 | ((4 - value.len() as u8) << 2), &rest);
        } else {
            self.phase = Phase::Upload { at: 0, toggle: 0 };
            self.say_about_object(0x41, value.len() as u32);
        }
    }

    fn next_segment(&mut self, request: [u8; 8]) {
        let Phase::Upload { at, toggle } = self.phase else {
            return self.abort(0x0504_0001);
        };
        if request[0] & 0x10 != toggle {
            return self.abort(0x0503_0000);
        }
        let end = self.value.len().min(at + 7);
        let last = u8::from(end == self.value.len());
        let part = self.value[at..end].to_vec();
        self.say(toggle | ((7 - part.len() as u8) << 1) | last, &part);
        self.phase = if last == 1 {
            Phase::Ready
        } else {
            Phase::Upload {
                at: end,
                toggle: toggle ^ 0x10,
            }
        };
    }

    fn begin_download(&mut self, request: [u8; 8]) {
        if request[0] & 0x02 != 0 {
            let len = 4 - usize::from(request[0] >> 2 & 3);
            self.value = request[4..4 + len].to_vec();
        } else {
            self.incoming.clear();
            self.phase = Phase::Download { toggle: 0 };
        }
        self.say_about_object(0x60, 0);
    }

    fn take_segment(&mut self, request: [u8; 8]) {
        let Phase::Download { toggle } = self.phase else {
            return self.abort(0x0504_0001);
        };
        if request[0] & 0x10 != toggle {
            return self.abort(0x0503_0000);
        }
        let len = 7 - usize::from(request[0] >> 1 & 7);
        self.incoming.extend(&request[1..=len]);
        self.phase = Phase::Download {
            toggle: toggle ^ 0x10,
        };
        if request[0] & 1 != 0 {
            self.value = core::mem::take(&mut self.incoming);
            self.phase = Phase::Ready;
        }
        self.say(0x20 | toggle, &[]);
    }

    fn block_upload(&mut self, request: [u8; 8]) {
        let segments = self.value.len().div_ceil(7).max(1);
        match (request[0] & 3, &self.phase) {
            (0, _) => {
                self.phase = Phase::BlockUpload { at: 0, sent: 0 };
                self.say_about_object(0xC6, self.value.len() as u32);
            }
            (3, Phase::BlockUpload { at: 0, sent: 0 }) => self.send_block(0),
            (2, Phase::BlockUpload { at, sent }) => {
                let (at, sent) = (*at, *sent);
                let confirmed = usize::from(request[1]);
                if confirmed > sent {
                    return self.abort(0x0504_0003);
                }
                if at + confirmed == segments {
                    let unused = (segments * 7 - self.value.len()) as u8;
                    self.phase = Phase::BlockUploadEnd;
                    let [low, high] = crc(&self.value).to_le_bytes();
                    self.say(0xC1 | unused << 2, &[low, high]);
                } else {
                    self.send_block(at + confirmed);
                }
            }
            (1, Phase::BlockUploadEnd) => self.phase = Phase::Ready,
            _ => self.abort(0x0504_0001),
        }
    }

    fn send_block(&mut self, at: usize) {
        let segments = self.value.len().div_ceil(7).max(1);
        let count = (segments - at).min(127);
        for index in 0..count {
            let from = ((at + index) * 7).min(self.value.len());
            let end = self.value.len().min(from + 7);
            let part = self.value[from..end].to_vec();
            let last = u8::from(at + index + 1 == segments) << 7;
            self.say(last | (index as u8 + 1), &part);
        }
        self.phase = Phase::BlockUpload { at, sent: count };
    }

    fn block_download(&mut self, request: [u8; 8]) {
        if request[0] & 1 == 0 {
            self.incoming.clear();
            self.phase = Phase::BlockDownload { expected: 1 };
            let mut rest = OBJECT_BYTES.to_vec();
            rest.push(self.block_size);
            self.say(0xA4, &rest);
            return;
        }
        if !matches!(self.phase, Phase::BlockDownloadEnd) {
            return self.abort(0x0504_0001);
        }
        let unused = usize::from(request[0] >> 2 & 7);
        let len = self.incoming.len() - unused;
        self.incoming.truncate(len);
        if crc(&self.incoming).to_le_bytes() != request[1..3] {
            return self.abort(0x0504_0004);
        }
        self.value = core::mem::take(&mut self.incoming);
        self.phase = Phase::Ready;
        self.say(0xA1, &[]);
    }

    fn hear_block_segment(&mut self, expected: u8, request: [u8; 8]) {
        let (sequence, last) = (request[0] & 0x7F, request[0] & 0x80 != 0);
        let mut next = expected;
        if sequence == expected {
            self.incoming.extend(&request[1..8]);
            next += 1;
        }
        let whole = last && sequence == expected;
        self.phase = Phase::BlockDownload { expected: next };
        if last || sequence == self.block_size {
            let block_size = self.block_size;
            self.say(0xA2, &[next - 1, block_size]);
            self.phase = if whole {
                Phase::BlockDownloadEnd
            } else {
                Phase::BlockDownload { expected: 1 }
            };
        }
    }
}

/// What happens to a frame, drawn from a list of bytes again and again.
struct Wire<'a> {
    fates: &'a [u8],
    next: usize,
}

impl Wire<'_> {
    /// How many copies arrive.
    fn copies(&mut self) -> usize {
        if self.fates.is_empty() {
            return 1;
        }
        let fate = self.fates[self.next % self.fates.len()];
        self.next += 1;
        match fate {
            0..=4 => 0,
            5..=14 => 2,
            _ => 1,
        }
    }
}

fn run(client: &mut SdoClient, server: &mut Server, wire: &mut Wire<'_>) -> Option<bool> {
    let reads = matches!(
        client.job.as_ref().map(|job| &job.direction),
        Some(Direction::Read)
    );
    let mut now = Time::ZERO;
    for _ in 0..100_000 {
        if let Some(outcome) = client.poll_outcome() {
            return match outcome {
                Ok(data) => {
                    assert!(!reads || data == server.value, "read {data:?}");
                    Some(true)
                }
                Err(_) => Some(false),
            };
        }
        now += Duration::from_micros(200);
        if let Some(frame) = client.poll_transmit() {
            let payload: [u8; 8] = frame.data().try_into().unwrap();
            (0..wire.copies()).for_each(|_| server.hear(payload));
        } else if let Some(reply) = server.replies.pop_front() {
            let frame = CanFrame::standard(0x589, &reply);
            for _ in 0..wire.copies() {
                client.handle_frame(now, &frame);
            }
        } else {
            now = now.max(client.poll_timeout());
        }
        client.handle_timeout(now);
    }
    None
}

fn method(block: bool) -> Method {
    if block { Method::Block } else { Method::Auto }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(512))]

    #[test]
    fn on_a_clean_wire_every_value_is_written_and_read_back(
        value in prop::collection::vec(any::<u8>(), 0..3000),
        block: bool,
        block_size in 1_u8..=127,
    ) {
        let mut server = Server { block_size, ..Server::default() };
        let mut wire = Wire { fates: &[], next: 0 };
        let mut client = SdoClient::new(NODE, Timeouts::default());
        client.write(Time::ZERO, OBJECT, &value, method(block)).unwrap();
        prop_assert_eq!(run(&mut client, &mut server, &mut wire), Some(true));
        prop_assert_eq!(&server.value, &value);
        client.read(Time::ZERO, OBJECT, method(block)).unwrap();
        prop_assert_eq!(run(&mut client, &mut server, &mut wire), Some(true));
        prop_assert_eq!(client.counters(), Counters::default());
    }

    #[test]
    fn whatever_is_lost_or_repeated_a_write_that_is_done_is_true(
        value in prop::collection::vec(any::<u8>(), 1..1200),
        fates in prop::collection::vec(any::<u8>(), 1..400),
        block: bool,
        block_size in 1_u8..=127,
    ) {
        let mut server = Server { block_size, ..Server::default() };
        let mut wire = Wire { fates: &fates, next: 0 };
        let mut client =
            SdoClient::new(NODE, Timeouts::default()).with_retry(Retry::UpTo(3));
        client
            .write_idempotent(Time::ZERO, OBJECT, &value, method(block))
            .unwrap();
        let done = run(&mut client, &mut server, &mut wire);
        prop_assert!(done.is_some(), "it must end");
        if done == Some(true) {
            prop_assert_eq!(&server.value, &value);
        }
    }

    #[test]
    fn whatever_is_lost_or_repeated_a_read_that_is_done_is_true(
        value in prop::collection::vec(any::<u8>(), 1..1200),
        fates in prop::collection::vec(any::<u8>(), 1..400),
        block: bool,
    ) {
        let mut server = Server { value: value.clone(), block_size: 127, ..Server::default() };
        let mut wire = Wire { fates: &fates, next: 0 };
        let mut client =
            SdoClient::new(NODE, Timeouts::default()).with_retry(Retry::UpTo(3));
        client.read(Time::ZERO, OBJECT, method(block)).unwrap();
        // `run` compares what was read.
        prop_assert!(run(&mut client, &mut server, &mut wire).is_some(), "it must end");
    }

    #[test]
    fn no_frame_whatsoever_makes_the_client_panic_or_spin(
        frames in prop::collection::vec((any::<[u8; 8]>(), 0_usize..=8), 0..200),
        block: bool,
        write: bool,
    ) {
        let mut client = SdoClient::new(NODE, Timeouts::default()).with_retry(Retry::UpTo(1));
        if write {
            client.write(Time::ZERO, OBJECT, &[1; 40], method(block)).unwrap();
        } else {
            client.read(Time::ZERO, OBJECT, method(block)).unwrap();
        }
        let mut now = Time::ZERO;
        for (payload, len) in frames {
            now += Duration::from_millis(1);
            let mut payload = payload;
            // Half of them name the right object, to get further.
            if payload[7] & 1 == 0 {
                payload[1..4].copy_from_slice(&OBJECT_BYTES);
            }
            client.handle_frame(now, &CanFrame::standard(0x589, &payload[..len]));
            client.handle_timeout(now);
            let sent = (0..1000).take_while(|_| client.poll_transmit().is_some()).count();
            prop_assert!(sent < 1000);
        }
    }
}
