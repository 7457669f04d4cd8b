//! The question of why something of a node did not come, or came false, and what answers it.

use core::time::Duration;

use drivers::device::{Alarm, DeviceError};
use units::Time;
use wire::Port;
use wire::canopen::{NodeId, Object};

use super::node_traffic::{DIGITAL_INPUTS, NodeTraffic, STATUSWORD};
use super::{BusTraffic, Finding};
use crate::engine::EngineFailure;
use crate::failure::Failure;

/// What comes at every SYNC and stays away for so many periods is missing.
const MISSED_PERIODS: u32 = 4;
/// So many of its own beats without a sign of life, in halves, make a node silent.
const SILENT_HALF_BEATS: u32 = 5;
/// The longest wait for an answer, and for a sign of life of a node that sends no heartbeat.
const ANSWER_LIMIT: Duration = Duration::from_millis(250);

/// A failure of a device on a CAN bus, of which the cause is looked for.
#[derive(Clone, Debug)]
pub(super) struct Question {
    pub(super) device: String,
    pub(super) port: Port,
    pub(super) node: NodeId,
    pub(super) failed: Time,
    /// Something did not come; else something false came.
    pub(super) is_absence: bool,
    /// A limit switch may have ended the motion.
    pub(super) may_be_limit: bool,
    /// What the drive is still to be asked, the next one last.
    pub(super) planned: Vec<Object>,
    /// When the drive was asked something last, and how many answers it had given before.
    pub(super) asked: Option<(Time, u32)>,
    pub(super) answer: Option<Finding>,
}

impl Question {
    /// What the drive is asked now, one question after the other.
    pub(super) fn next_object(&mut self, now: Time, node: &NodeTraffic) -> Option<Object> {
        // One that does not answer the first question answers none.
        if self
            .asked
            .is_some_and(|(_, answers)| node.answers == answers)
        {
            return None;
        }
        let is_known = |object: &Object| *object == STATUSWORD && contradiction(node).is_some();
        while self.planned.last().is_some_and(is_known) {
            self.planned.pop();
        }
        let object = self.planned.pop()?;
        self.asked = Some((now, node.answers));
        Some(object)
    }

    /// Whether the drive may still answer what it was asked last.
    pub(super) fn awaits_answer(&self, now: Time, node: &NodeTraffic) -> bool {
        self.asked
            .is_some_and(|(at, answers)| node.answers == answers && now.since(at) < ANSWER_LIMIT)
    }

    /// Whether more is asked, or answered, or would be contradicted by the process data to come.
    pub(super) fn may_tell_more(&self, now: Time, bus: &BusTraffic, node: &NodeTraffic) -> bool {
        let contradicted = contradiction(node)
            .is_some_and(|at| now.since(at) <= bus.period * (MISSED_PERIODS + 1));
        let may_ask = node.heard.is_some() && bus.drives.contains(&self.node);
        let is_asking = !self.planned.is_empty() || self.awaits_answer(now, node);
        contradicted || (may_ask && is_asking)
    }

    /// A limit switch that is pressed, as the drive's inputs say.
    pub(super) fn on_limit_switch(&self, node: &NodeTraffic) -> Option<Finding> {
        const NEGATIVE: u32 = 1 << 0;
        const POSITIVE: u32 = 1 << 1;
        let (_, inputs) = node.inputs.filter(|(at, _)| *at >= self.failed)?;
        let negative = inputs & NEGATIVE != 0;
        let is_pressed = self.may_be_limit && inputs & (NEGATIVE | POSITIVE) != 0;
        is_pressed.then_some(Finding::OnLimitSwitch {
            node: self.node,
            negative,
        })
    }

    /// A boot-up after its process data had begun. Before that a boot is ordinary.
    pub(super) fn restarted(&self, node: &NodeTraffic) -> Option<Finding> {
        let (boot_up, last) = (node.boot_up?, node.sample.map(|sample| sample.at)?);
        let since_last = boot_up > last || boot_up >= self.failed;
        since_last.then_some(Finding::Restarted {
            node: self.node,
            at: boot_up,
        })
    }

    /// So long nothing may come from the node.
    pub(super) fn silent_after(&self, bus: &BusTraffic) -> Duration {
        let beat = bus.nodes.get(&self.node).and_then(|node| node.beat);
        let by_beat = beat.map_or(ANSWER_LIMIT, |beat| beat * SILENT_HALF_BEATS / 2);
        by_beat.max(bus.period * MISSED_PERIODS)
    }

    pub(super) fn silent(
        &self,
        now: Time,
        bus: &BusTraffic,
        node: &NodeTraffic,
    ) -> Option<Finding> {
        let margin = bus.period * MISSED_PERIODS;
        let Some(since) = node.heard else {
            let others = bus.others_after(self.node, Time::ZERO);
            return Some(self.nothing_heard(bus, None, others));
        };
        // Without a heartbeat it may have had nothing to say, unless it was asked.
        let speaks = node.beat.is_some()
            || self
                .asked
                .is_some_and(|(asked, _)| asked > since && now.since(asked) >= ANSWER_LIMIT);
        if !speaks || now.since(since) < self.silent_after(bus) {
            return None;
        }
        let others = bus.others_after(self.node, since + margin);
        if node.beat.is_none() && !others.is_empty() {
            return Some(Finding::NoAnswer {
                node: self.node,
                since,
            });
        }
        Some(self.nothing_heard(bus, Some(since), others))
    }

    pub(super) fn nothing_heard(
        &self,
        bus: &BusTraffic,
        since: Option<Time>,
        others: Vec<NodeId>,
    ) -> Finding {
        if others.is_empty() {
            return Finding::BusSilent {
                port: bus.name.clone(),
                since,
                nodes: bus.nodes.len(),
            };
        }
        Finding::Silent {
            node: self.node,
            since,
            others,
        }
    }

    /// A node that still says something, but not all that it should.
    pub(super) fn alive(&self, now: Time, bus: &BusTraffic, node: &NodeTraffic) -> Option<Finding> {
        let margin = bus.period * MISSED_PERIODS;
        let data = node.process_data?;
        let is_fresh = |at: Time| now.since(at) < margin;
        let sample = node.sample.filter(|sample| !is_fresh(sample.at));
        if let Some(sample) = sample.filter(|_| is_fresh(data)) {
            return Some(Finding::NoSample {
                node: self.node,
                since: sample.at,
            });
        }
        if is_fresh(data) {
            return self.alive_with_data(now, node);
        }
        let (beat_at, state) = node.heartbeat.filter(|(at, _)| *at > data + margin)?;
        if beat_at <= self.failed {
            return None;
        }
        let mut others = bus.nodes.iter().filter(|(other, _)| **other != self.node);
        let had_data = others
            .clone()
            .any(|(_, other)| other.process_data.is_some());
        let all_ended =
            others.all(|(_, other)| other.process_data.is_none_or(|at| at < data + margin));
        if had_data && all_ended {
            let port = bus.name.clone();
            return Some(Finding::NoSync { port, since: data });
        }
        Some(Finding::NoProcessData {
            node: self.node,
            since: data,
            state,
        })
    }

    /// Its process data come, or come again.
    pub(super) fn alive_with_data(&self, now: Time, node: &NodeTraffic) -> Option<Finding> {
        if let Some(gap) = node.gap.filter(|gap| gap.until >= self.failed) {
            return Some(Finding::Interrupted {
                node: self.node,
                gap: gap.until.since(gap.from),
            });
        }
        let (beat, _) = node.heartbeat?;
        let is_late = now.since(beat) >= node.beat? * SILENT_HALF_BEATS / 2;
        is_late.then_some(Finding::NoHeartbeat {
            node: self.node,
            since: beat,
        })
    }

    /// The process data still say what they said before the drive was asked, and it answered something else.
    pub(super) fn frozen(&self, bus: &BusTraffic, node: &NodeTraffic) -> Option<Finding> {
        let (at, sample, (_, read)) = (contradiction(node)?, node.sample?, node.statusword?);
        let is_later = sample.at >= at + bus.period * MISSED_PERIODS;
        is_later.then_some(Finding::Frozen {
            node: self.node,
            since: sample.since,
            shown: sample.statusword()?,
            read,
        })
    }
}

/// Since when the process data contradict the statusword that the drive answered.
fn contradiction(node: &NodeTraffic) -> Option<Time> {
    let ((at, read), sample) = (node.statusword?, node.sample?);
    let shown = sample.statusword()?;
    (sample.since < at && shown.state() != read.state()).then_some(at)
}

/// What a drive is asked because of `failure`, the next one last. In the state in which something was waited for in vain
/// it is asked before the stop too.
pub(super) fn questions(failure: &Failure) -> Vec<Object> {
    let mut questions = Vec::new();
    questions.extend(may_be_limit(failure).then_some(DIGITAL_INPUTS));
    questions.push(STATUSWORD);
    questions.extend(is_wait(failure).then_some(STATUSWORD));
    questions
}

/// Whether something was waited for in vain: the drive is in the state in which it was then.
pub(crate) const fn is_wait(failure: &Failure) -> bool {
    matches!(
        failure,
        Failure::Overdue { .. }
            | Failure::Device {
                source: DeviceError::Timeout { .. },
                ..
            }
    )
}

/// Whether the motion may have ended on a limit switch, for which no code of a standard stands.
pub(super) fn may_be_limit(failure: &Failure) -> bool {
    const MANUFACTURERS: u16 = 0xFF00;
    match failure {
        Failure::Alarm { alarm, .. }
        | Failure::Device {
            source: DeviceError::Alarmed { alarm, .. },
            ..
        } => match alarm {
            Alarm::InternalLimit { .. } => true,
            Alarm::Emergency { emergency, .. } => emergency.code.0 & MANUFACTURERS == MANUFACTURERS,
            _ => false,
        },
        Failure::Device {
            source: DeviceError::Timeout { .. } | DeviceError::DriveRefused { .. },
            ..
        }
        | Failure::Overdue { .. } => true,
        _ => false,
    }
}

/// The failure itself, without what was said about it.
pub(super) fn root(failure: &Failure) -> &Failure {
    match failure {
        Failure::HeldUp { failure, .. } => root(failure),
        other => other,
    }
}

/// The device whose traffic may explain `failure`.
pub(super) fn device_of(failure: &Failure) -> Option<&str> {
    match root(failure) {
        Failure::Engine(
            EngineFailure::Missing { axis, .. }
            | EngineFailure::Deviates { axis, .. }
            | EngineFailure::NotCyclic { axis },
        ) => Some(axis),
        Failure::Alarm { device, alarm } if may_be_false(alarm) => Some(device),
        Failure::Device {
            device,
            source:
                DeviceError::Timeout { .. }
                | DeviceError::SdoTimeout { .. }
                | DeviceError::DriveRefused { .. },
        }
        | Failure::Overdue { device, .. } => Some(device),
        Failure::Device {
            device,
            source: DeviceError::Alarmed { alarm, .. },
        } if may_be_false(alarm) => Some(device),
        _ => None,
    }
}

/// Whether something missing, or false data, may have raised it.
const fn may_be_false(alarm: &Alarm) -> bool {
    matches!(
        alarm,
        Alarm::HeartbeatLost { .. }
            | Alarm::PdoLost { .. }
            | Alarm::StaleSample { .. }
            | Alarm::UnexpectedNmtState { .. }
            | Alarm::DuplicateNode { .. }
            | Alarm::Emergency { .. }
            | Alarm::PdoTooShort { .. }
            | Alarm::DriveState { .. }
            | Alarm::FollowingError { .. }
            | Alarm::NotFollowing { .. }
            | Alarm::InternalLimit { .. }
            | Alarm::WrongDirection { .. }
            | Alarm::PositionJump { .. }
            | Alarm::OutsideEnvelope { .. }
            | Alarm::TooFast { .. }
            | Alarm::WrongMode { .. }
            | Alarm::EnabledUnasked { .. }
            | Alarm::LatchDisarmed { .. }
    )
}
