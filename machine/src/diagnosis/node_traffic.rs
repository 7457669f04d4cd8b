//! The traffic of one node: when each kind of its frames came last.

use core::time::Duration;

use units::Time;
use wire::can::CanFrame;
use wire::canopen::nmt::{NmtState, parse_heartbeat};
use wire::canopen::sdo::SdoResponse;
use wire::canopen::{Function, Object};
use wire::cia402::Statusword;

/// The objects that are asked for of a drive.
pub(super) const STATUSWORD: Object = Object::new(0x6041, 0);
pub(super) const DIGITAL_INPUTS: Object = Object::new(0x60FD, 0);
/// So many periods without a frame are a gap.
const GAP_PERIODS: u32 = 3;

/// A time in which nothing came that should come at every SYNC.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Gap {
    pub(super) from: Time,
    pub(super) until: Time,
}

/// The newest TPDO 1, and since when it has not changed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    pub(super) frame: CanFrame,
    pub(super) since: Time,
    pub(super) at: Time,
}

impl Sample {
    /// The statusword in it, as a drive maps it.
    pub(super) fn statusword(&self) -> Option<Statusword> {
        let bytes = self.frame.data().first_chunk::<2>()?;
        Some(Statusword::from_bits_retain(u16::from_le_bytes(*bytes)))
    }
}

/// When what came from a node.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct NodeTraffic {
    /// Anything.
    pub(super) heard: Option<Time>,
    pub(super) heartbeat: Option<(Time, NmtState)>,
    /// From one heartbeat to the next, the longest.
    pub(super) beat: Option<Duration>,
    /// Process data of whatever number.
    pub(super) process_data: Option<Time>,
    pub(super) sample: Option<Sample>,
    pub(super) boot_up: Option<Time>,
    /// The newest gap in its process data.
    pub(super) gap: Option<Gap>,
    /// The statusword that it answered when it was asked.
    pub(super) statusword: Option<(Time, Statusword)>,
    /// Likewise its digital inputs.
    pub(super) inputs: Option<(Time, u32)>,
    /// How many questions it answered or refused.
    pub(super) answers: u32,
}

impl NodeTraffic {
    /// Takes `frame`, which is this node's by its identifier.
    pub(super) fn note(
        &mut self,
        at: Time,
        function: Function,
        frame: &CanFrame,
        period: Duration,
    ) {
        match function {
            Function::Tpdo1 => {
                self.note_gap(self.sample.map(|sample| sample.at), at, period);
                self.note_process_data(at, period);
                self.note_sample(at, frame);
            }
            Function::Tpdo2 | Function::Tpdo3 | Function::Tpdo4 => {
                self.note_process_data(at, period);
            }
            Function::ErrorControl => self.note_heartbeat(at, frame),
            Function::SdoResponse => self.note_answer(at, frame),
            Function::Emergency => {}
            // These go to the node: others sent them.
            Function::Rpdo1
            | Function::Rpdo2
            | Function::Rpdo3
            | Function::Rpdo4
            | Function::SdoRequest => return,
        }
        self.heard = Some(at);
    }

    fn note_process_data(&mut self, at: Time, period: Duration) {
        self.note_gap(self.process_data, at, period);
        self.process_data = Some(at);
    }

    fn note_gap(&mut self, before: Option<Time>, at: Time, period: Duration) {
        if let Some(from) = before
            && at.since(from) > period * GAP_PERIODS
        {
            self.gap = Some(Gap { from, until: at });
        }
    }

    fn note_sample(&mut self, at: Time, frame: &CanFrame) {
        let frame = *frame;
        let since = match &self.sample {
            Some(sample) if sample.frame == frame => sample.since,
            _ => at,
        };
        self.sample = Some(Sample { frame, since, at });
    }

    fn note_heartbeat(&mut self, at: Time, frame: &CanFrame) {
        let Ok((_, state)) = parse_heartbeat(frame) else {
            return;
        };
        if state == NmtState::BootUp {
            self.boot_up = Some(at);
            self.beat = None;
            self.heartbeat = None;
            return;
        }
        if let Some((before, _)) = self.heartbeat {
            let beat = at.since(before);
            self.beat = Some(self.beat.map_or(beat, |longest| longest.max(beat)));
        }
        self.heartbeat = Some((at, state));
    }

    fn note_answer(&mut self, at: Time, frame: &CanFrame) {
        self.answers += 1;
        let Ok(SdoResponse::UploadExpedited { object, data }) = SdoResponse::parse(frame.data())
        else {
            return;
        };
        let low = data.data().first_chunk::<2>().copied();
        let all = data.data().first_chunk::<4>().copied();
        if object == STATUSWORD
            && let Some(low) = low
        {
            let word = Statusword::from_bits_retain(u16::from_le_bytes(low));
            self.statusword = Some((at, word));
        }
        if object == DIGITAL_INPUTS
            && let Some(all) = all
        {
            self.inputs = Some((at, u32::from_le_bytes(all)));
        }
    }
}
