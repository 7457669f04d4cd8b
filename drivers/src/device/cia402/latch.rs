//! Touch probe 1 (CiA 402-2, 0x60B8 to 0x60BB, 0x60D0, 0x60D5 and 0x60D6).
//!
//! TPDO 3 carries the probe's status, the position latched at the chosen edge and, where the
//! drive has it, the count of those edges. The latched position holds one value: the axis must
//! be slow enough for each to be read before the next edge overwrites it. The count tells when
//! that went wrong; without it a new edge shows in a position (or, on some drives, a toggling
//! status bit) that changed.
//!
//! | bits of 0x60B8, 0x60B9 | meaning |
//! |---|---|
//! | function 0 | touch probe 1 on |
//! | function 1 | every edge; 0: the first |
//! | function 2 and 3 | 0 its own input, 2 the one in 0x60D0:01 |
//! | function 4, 5 | latch at the positive, the negative edge |
//! | status 0 | on |
//! | status 1, 2 | a position of the positive, the negative edge is there |
//! | status 6, 7 | of the manufacturer; here and there they toggle with each position |

use std::collections::VecDeque;

use units::{Coordinate, Counts, Quantity, Time};
use wire::canopen::Object;
use wire::canopen::pdo::{MappedObject, extract};

use super::convert::out_of_range;
use super::settings::{Cia402Settings, Edge, LatchSettings};
use super::{Activity, Cia402Drive};
use crate::device::{
    Alarm, DeviceError, LatchCommand, Latched, PositionLatch, Repeat, SYNCS_PER_EDGE,
};
use crate::protocol::script::{Script, Step};

const FUNCTION: Object = Object::new(0x60B8, 0);
const STATUS: MappedObject = MappedObject::new(0x60B9, 0, 16);
const SOURCE: Object = Object::new(0x60D0, 1);

const SWITCHING_OFF: &str = "switching the touch probe off";

const ON: u16 = 1 << 0;
const CONTINUOUS: u16 = 1 << 1;
const CHOSEN_SOURCE: u16 = 1 << 3;
const AT_POSITIVE_EDGE: u16 = 1 << 4;
const AT_NEGATIVE_EDGE: u16 = 1 << 5;

const fn position_object(edge: Edge) -> MappedObject {
    match edge {
        Edge::Positive => MappedObject::new(0x60BA, 0, 32),
        Edge::Negative => MappedObject::new(0x60BB, 0, 32),
    }
}

const fn count_object(edge: Edge) -> MappedObject {
    match edge {
        Edge::Positive => MappedObject::new(0x60D5, 0, 16),
        Edge::Negative => MappedObject::new(0x60D6, 0, 16),
    }
}

/// What is asked before the mapping: does the drive count edges?
pub(super) fn description<Q: Coordinate>(settings: &Cia402Settings<Q>) -> Option<Step> {
    const TEXT: &str = "reading its count of latched edges";
    let latch = settings.latch?;
    Some(Step::read(count_object(latch.edge).object, TEXT).optional())
}

pub(super) fn counts_edges<Q: Coordinate>(settings: &Cia402Settings<Q>, script: &Script) -> bool {
    let count = |latch: LatchSettings| script.value(count_object(latch.edge).object);
    settings.latch.and_then(count).is_some()
}

/// What TPDO 3 carries.
pub(super) fn mapping<Q: Coordinate>(
    settings: &Cia402Settings<Q>,
    counts_edges: bool,
) -> Option<Vec<MappedObject>> {
    let latch = settings.latch?;
    let mut mapped = vec![STATUS, position_object(latch.edge)];
    if counts_edges {
        mapped.push(count_object(latch.edge));
    }
    Some(mapped)
}

/// The probe off, and its input.
pub(super) fn configuration<Q: Coordinate>(settings: &Cia402Settings<Q>) -> Vec<Step> {
    let Some(latch) = settings.latch else {
        return Vec::new();
    };
    let mut steps = vec![Step::check(FUNCTION, 0_u16, SWITCHING_OFF)];
    if let Some(source) = latch.source {
        steps.push(Step::check(
            SOURCE,
            source,
            "choosing the touch probe's input",
        ));
    }
    steps
}

const fn function(latch: LatchSettings, repeat: Repeat) -> u16 {
    let edge = match latch.edge {
        Edge::Positive => AT_POSITIVE_EDGE,
        Edge::Negative => AT_NEGATIVE_EDGE,
    };
    let repeat = match repeat {
        Repeat::Once => 0,
        Repeat::Continuous => CONTINUOUS,
    };
    let source = match latch.source {
        Some(_) => CHOSEN_SOURCE,
        None => 0,
    };
    ON | edge | repeat | source
}

/// A command to the probe under way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LatchChange {
    /// What to become; `None`: disarmed.
    arming: Option<Arming>,
    phase: LatchPhase,
    since: Time,
    /// SDO has time-outs of its own.
    deadline: Time,
}

/// Off, then on: a drive that looks at the function once a cycle must see the edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum LatchPhase {
    SwitchingOff,
    AwaitingOff,
    SwitchingOn,
    AwaitingOn,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Arming {
    repeat: Repeat,
    /// In the speed's SI unit.
    speed_max: f64,
}

impl LatchChange {
    pub(super) const fn deadline(&self) -> Time {
        self.deadline
    }
}

/// What TPDO 3 showed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Shown {
    status: u16,
    position: i32,
    count: Option<u16>,
}

impl Shown {
    fn parse(payload: &[u8], counts_edges: bool) -> Option<Self> {
        Some(Self {
            status: extract(payload, 0, 16)? as u16,
            position: (extract(payload, 16, 32)? as u32).cast_signed(),
            count: if counts_edges {
                Some(extract(payload, 48, 16)? as u16)
            } else {
                None
            },
        })
    }

    const fn is_on(self) -> bool {
        self.status & ON != 0
    }

    const fn has_position(self, edge: Edge) -> bool {
        let bit = match edge {
            Edge::Positive => 1 << 1,
            Edge::Negative => 1 << 2,
        };
        self.status & bit != 0
    }

    const fn toggle(self, edge: Edge) -> u16 {
        match edge {
            Edge::Positive => self.status & 1 << 6,
            Edge::Negative => self.status & 1 << 7,
        }
    }

    /// How many edges came between `before` and this.
    fn edges_since(self, before: Self, edge: Edge) -> u16 {
        if !self.has_position(edge) {
            return 0;
        }
        match (before.count, self.count) {
            (Some(before), Some(now)) => now.wrapping_sub(before),
            _ => u16::from(
                !before.has_position(edge)
                    || before.position != self.position
                    || before.toggle(edge) != self.toggle(edge),
            ),
        }
    }
}

/// The touch probe as the driver knows it.
#[derive(Debug, Default)]
pub(super) struct Probe {
    /// Whether TPDO 3 carries the count.
    pub(super) counts_edges: bool,
    armed: Option<Armed>,
    events: VecDeque<(Time, Counts, u32)>,
    pub(super) latched: u64,
    pub(super) missed: u64,
}

#[derive(Clone, Copy, Debug)]
struct Armed {
    arming: Arming,
    before: Shown,
}

impl Probe {
    pub(super) const fn disarm(&mut self) {
        self.armed = None;
    }
}

impl<Q: Coordinate> Cia402Drive<Q> {
    /// A move over edges that come too fast would lose some.
    pub(super) fn check_armed_speed(&self, speed: Q::Speed) -> Result<(), DeviceError> {
        let armed = self.probe.armed.as_ref();
        armed.map_or(Ok(()), |it| self.check_edges(it.arming.speed_max, speed))
    }

    fn check_edges(&self, limit: f64, speed: Q::Speed) -> Result<(), DeviceError> {
        let Some(latch) = self.settings.latch else {
            return Ok(());
        };
        if speed.value() <= limit {
            return Ok(());
        }
        Err(out_of_range(
            &self.settings,
            position_object(latch.edge).object,
            "speed while latching every edge",
            (speed.value(), limit),
            Q::SPEED_UNIT,
        ))
    }

    fn begin_latch(&mut self, now: Time, arming: Option<Arming>) {
        self.probe.disarm();
        if arming.is_some() {
            self.probe.events.clear();
        }
        self.activity = Activity::Latch(LatchChange {
            arming,
            phase: LatchPhase::SwitchingOff,
            since: now,
            deadline: Time::NEVER,
        });
        self.write_function(now, 0, SWITCHING_OFF);
    }

    fn write_function(&mut self, now: Time, function: u16, text: &'static str) {
        self.node
            .run(now, vec![Step::check(FUNCTION, function, text)]);
        self.pump(now);
    }

    pub(super) fn latch_written(&mut self, now: Time) {
        let patience = self.settings.timeouts.latch;
        let Activity::Latch(change) = &mut self.activity else {
            return;
        };
        change.phase = match change.phase {
            LatchPhase::SwitchingOff | LatchPhase::AwaitingOff => LatchPhase::AwaitingOff,
            LatchPhase::SwitchingOn | LatchPhase::AwaitingOn => LatchPhase::AwaitingOn,
        };
        change.since = now;
        change.deadline = now + patience;
    }

    fn advance_latch(&mut self, now: Time, latch: LatchSettings, shown: Shown) {
        let Activity::Latch(change) = &mut self.activity else {
            return;
        };
        match (change.phase, change.arming) {
            (LatchPhase::SwitchingOff | LatchPhase::SwitchingOn, _) => {}
            (LatchPhase::AwaitingOff, None) if !shown.is_on() => self.finish(Ok(())),
            (LatchPhase::AwaitingOff, Some(arming)) if !shown.is_on() => {
                change.phase = LatchPhase::SwitchingOn;
                change.deadline = Time::NEVER;
                let function = function(latch, arming.repeat);
                self.write_function(now, function, "arming the touch probe");
            }
            (LatchPhase::AwaitingOn, Some(arming)) if shown.is_on() => {
                // The axis stands: what is latched already is from before.
                let before = shown;
                self.probe.armed = Some(Armed { arming, before });
                self.finish(Ok(()));
            }
            (LatchPhase::AwaitingOff | LatchPhase::AwaitingOn, _) => {}
        }
    }

    pub(super) fn take_latch(&mut self, now: Time, payload: &[u8]) {
        let Some(latch) = self.settings.latch else {
            return;
        };
        let Some(shown) = Shown::parse(payload, self.probe.counts_edges) else {
            self.take_short_pdo(if self.probe.counts_edges { 8 } else { 6 }, payload.len());
            return;
        };
        self.advance_latch(now, latch, shown);
        self.take_edges(now, latch.edge, shown);
    }

    fn take_edges(&mut self, now: Time, edge: Edge, shown: Shown) {
        let Some(armed) = &mut self.probe.armed else {
            return;
        };
        if !shown.is_on() {
            self.probe.disarm();
            let node = self.node.id();
            self.alarm(Alarm::LatchDisarmed { node });
            return;
        }
        let edges = shown.edges_since(armed.before, edge);
        armed.before = shown;
        let Some(missed) = edges.checked_sub(1) else {
            return;
        };
        if armed.arming.repeat == Repeat::Once {
            self.probe.disarm();
        }
        self.probe.latched += 1;
        self.probe.missed += u64::from(missed);
        let position = self.image.counting_on(shown.position);
        let event = (now, position, u32::from(missed));
        self.probe.events.push_back(event);
    }

    pub(super) fn latch_timeout(&mut self, now: Time) {
        let Activity::Latch(change) = &self.activity else {
            return;
        };
        if now >= change.deadline {
            let (since, seen) = (change.since, self.seen_status());
            let awaited = match change.phase {
                LatchPhase::SwitchingOff | LatchPhase::AwaitingOff => {
                    "the touch probe to be switched off"
                }
                LatchPhase::SwitchingOn | LatchPhase::AwaitingOn => "the touch probe to be armed",
            };
            self.time_out(now, since, awaited, seen);
        }
    }
}

impl<Q: Coordinate> PositionLatch<Q> for Cia402Drive<Q> {
    fn latch(&mut self, now: Time, command: LatchCommand<Q>) {
        const STEP: &str = "setting the touch probe";
        if !matches!(self.activity, Activity::Idle) {
            // What runs goes on.
            self.outcome = Some(Err(DeviceError::NotPossible {
                device: self.node.name(),
                step: STEP,
                needs: "a drive with nothing else under way",
            }));
            return;
        }
        self.supersede(now);
        match command {
            _ if self.settings.latch.is_none() => {
                self.refuse(STEP, "a drive whose touch probe is configured");
            }
            _ if !self.node.is_in_service() => self.refuse_out_of_service(),
            LatchCommand::Disarm => self.begin_latch(now, None),
            LatchCommand::Arm { .. } if !self.image.plausible.stands() => {
                self.refuse(STEP, "an axis that stands still");
            }
            LatchCommand::Arm { repeat, spacing } => {
                let speed_max = self.latch_speed_max(spacing).value();
                self.begin_latch(now, Some(Arming { repeat, speed_max }));
            }
        }
    }

    fn is_latching(&self) -> bool {
        self.probe.armed.is_some()
    }

    fn latch_speed_max(&self, spacing: Q) -> Q::Speed {
        let period = self.settings.common.sync_period.as_secs_f64();
        Q::Speed::from_value(spacing.value().abs() / (SYNCS_PER_EDGE * period))
    }

    fn check_latch_speed(&self, spacing: Q, speed: Q::Speed) -> Result<(), DeviceError> {
        self.check_edges(self.latch_speed_max(spacing).value(), speed)
    }

    fn poll_latched(&mut self) -> Option<Latched<Q>> {
        let (at, counts, missed) = self.probe.events.pop_front()?;
        Some(Latched {
            at,
            counts,
            position: self.settings.scale.to_coordinate(counts),
            missed,
        })
    }
}
