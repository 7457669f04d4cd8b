//! A device of your own: the driver of a caliper on a serial line, and the loop that feeds it.
//!
//! A driver has no clock and no port: time and bytes come in, bytes and readings go out. So it is tried here
//! against a caliper of five lines, in virtual time, and runs unchanged on a real port.
//!
//! `cargo run -p drivers --example device`
#![expect(clippy::print_stdout, reason = "an example shows what it measured")]
use core::time::Duration;
use std::collections::VecDeque;

use drivers::device::serial_line::{AssembledLine, LineAssembler};
use drivers::device::{Alarm, Device, DeviceError, DeviceName, Identity, Seen};
use units::{Metres, Time};
use wire::{Input, Payload};

const NAME: DeviceName = DeviceName::Serial("caliper");
const CR: u8 = b'\r';
/// A caliper that says nothing for so long is not there.
const ANSWER_TIMEOUT: Duration = Duration::from_millis(200);

/// A caliper that answers `P` with its jaws' distance in millimetres.
struct Caliper {
    lines: LineAssembler,
    deadline: Time,
    reading: Option<Metres>,
    outbox: VecDeque<Payload>,
    outcome: Option<Result<(), DeviceError>>,
}

impl Caliper {
    fn new() -> Self {
        Self {
            lines: LineAssembler::new(CR, 16),
            deadline: Time::NEVER,
            reading: None,
            outbox: VecDeque::new(),
            outcome: None,
        }
    }

    /// A line that is no number is no reading; the deadline tells that it is missing.
    fn line(&mut self, line: &[u8]) {
        let number = core::str::from_utf8(line).ok();
        let Some(mm) = number
            .and_then(|it| it.parse::<f64>().ok())
            .filter(|it| it.is_finite())
        else {
            return;
        };
        self.reading = Some(Metres::from_mm(mm));
        self.deadline = Time::NEVER;
        self.outcome = Some(Ok(()));
    }
}

impl Device for Caliper {
    fn handle(&mut self, _: Time, input: &Input) {
        let Input::Payload(Payload::Bytes(bytes)) = input else {
            return;
        };
        for byte in bytes {
            if let Some(AssembledLine::Whole(line)) = self.lines.push(*byte) {
                self.line(&line);
            }
        }
    }

    fn handle_timeout(&mut self, now: Time) {
        if self.deadline <= now {
            self.deadline = Time::NEVER;
            self.outcome = Some(Err(DeviceError::Timeout {
                device: NAME,
                awaited: "the answer to P",
                waited: ANSWER_TIMEOUT,
                seen: Seen::Nothing,
            }));
        }
    }

    fn poll_timeout(&self) -> Time {
        self.deadline
    }

    fn poll_transmit(&mut self) -> Option<Payload> {
        self.outbox.pop_front()
    }

    fn poll_alarm(&mut self) -> Option<Alarm> {
        None
    }

    fn start(&mut self, now: Time) {
        self.outbox.push_back(Payload::Bytes(b"P\r".to_vec()));
        self.deadline = now + ANSWER_TIMEOUT;
    }

    fn poll_outcome(&mut self) -> Option<Result<(), DeviceError>> {
        self.outcome.take()
    }

    fn identity(&self) -> Option<Identity> {
        None
    }

    fn counters(&self) -> Vec<(&'static str, u64)> {
        Vec::new()
    }
}

/// The other end of the line: what it answers, 30 ms later; a flat battery answers nothing.
fn answer(asked: &Payload, has_battery: bool) -> Option<Payload> {
    let is_question = *asked == Payload::Bytes(b"P\r".to_vec());
    (is_question && has_battery).then(|| Payload::Bytes(b"+12.345\r".to_vec()))
}

/// What every loop does: hand over what came in, act on deadlines, send what is to be sent.
fn read(has_battery: bool) -> Result<Metres, DeviceError> {
    let mut caliper = Caliper::new();
    let mut now = Time::ZERO;
    let mut arriving: Option<(Time, Payload)> = None;
    caliper.start(now);
    loop {
        while let Some(payload) = caliper.poll_transmit() {
            let at = now + Duration::from_millis(30);
            arriving = answer(&payload, has_battery).map(|it| (at, it));
        }
        // Virtual time goes on to whatever comes next.
        let arrival = arriving.as_ref().map_or(Time::NEVER, |(at, _)| *at);
        now = caliper.poll_timeout().min(arrival);
        if let Some((_, payload)) = arriving.take_if(|(at, _)| *at <= now) {
            caliper.handle(now, &Input::Payload(payload));
        }
        caliper.handle_timeout(now);
        if let Some(outcome) = caliper.poll_outcome() {
            return outcome.map(|()| caliper.reading.unwrap_or_default());
        }
    }
}

fn main() {
    for has_battery in [true, false] {
        match read(has_battery) {
            Ok(distance) => println!("{:.3} mm", distance.mm()),
            Err(error) => println!("{error}"),
        }
    }
}
