//! What a node says unasked: heartbeats, boot-ups, emergencies.

use units::Time;
use wire::canopen::Object;
use wire::canopen::emcy::{Emergency, EmergencyCode};
use wire::canopen::nmt::NmtState;

use super::{CanopenNode, NodeEvent, Phase};
use crate::device::{Alarm, DeviceError};
use crate::protocol::heartbeat::HeartbeatEvent;
use crate::protocol::script::Step;

/// The first entry of the heartbeats that a node watches.
pub(super) const WATCH: Object = Object::new(0x1016, 1);

impl CanopenNode {
    /// Whether its watch on our heartbeat was written and read back since the start, and it has not booted since.
    pub(in crate::device) const fn watches_master(&self) -> bool {
        self.watches_master
    }

    /// Whether the node reported since the start that it had lost our heartbeat: an end of this program makes it do so.
    pub(in crate::device) const fn lost_master(&self) -> bool {
        self.lost_master
    }

    /// Ends that watch: without our heartbeat the node would fault. `false`: it watches none.
    pub(in crate::device) fn release_watch(&mut self, now: Time) -> bool {
        if !self.watches_master {
            return false;
        }
        let text = "ending its watch on our heartbeat";
        self.watches_master = false;
        self.run(now, vec![Step::check(WATCH, 0_u32, text)]);
        true
    }

    pub(super) fn take_heartbeat(&mut self, now: Time, event: HeartbeatEvent) {
        match event {
            HeartbeatEvent::BootUp => self.take_boot_up(now),
            HeartbeatEvent::Changed { to, .. } => {
                self.note_operational(now);
                if self.is_up() && to != NmtState::Operational {
                    let node = self.settings.node;
                    self.alarm(Alarm::UnexpectedNmtState { node, state: to });
                }
            }
            HeartbeatEvent::Lost { waited } => {
                self.heartbeats_lost += 1;
                let node = self.settings.node;
                let alarm = Alarm::HeartbeatLost { node, waited };
                self.end_by(now, alarm);
            }
        }
    }

    fn take_boot_up(&mut self, now: Time) {
        self.boot_ups += 1;
        self.watches_master = false;
        // Nothing older than the boot-up can come any more.
        self.client.server_restarted();
        self.script = None;
        match self.phase {
            Phase::Off | Phase::Rebooted { .. } => {}
            Phase::Probing { .. } => self.probe(now),
            Phase::Up => self.phase = Phase::Rebooted { since: now },
            Phase::Describing
            | Phase::Described
            | Phase::Configuring
            | Phase::Starting { .. }
            | Phase::Operational { .. } => {
                let node = self.settings.node;
                self.end_by(now, Alarm::UnexpectedBootUp { node });
            }
        }
    }

    /// Process data after a boot-up: the one that sends them did not boot.
    pub(super) fn take_pdo_of_twin(&mut self) {
        if let Phase::Rebooted { .. } = self.phase {
            self.phase = Phase::Up;
            let node = self.settings.node;
            self.alarm(Alarm::DuplicateNode { node });
        }
    }

    /// An alarm that ends a start, or is told when the node is up.
    pub(super) fn end_by(&mut self, now: Time, alarm: Alarm) {
        match self.phase {
            Phase::Off | Phase::Probing { .. } | Phase::Rebooted { .. } => {}
            Phase::Up => self.alarm(alarm),
            Phase::Describing
            | Phase::Described
            | Phase::Configuring
            | Phase::Starting { .. }
            | Phase::Operational { .. } => {
                let device = self.name();
                let step = "the start";
                self.fail(
                    now,
                    DeviceError::Alarmed {
                        device,
                        step,
                        alarm,
                    },
                );
            }
        }
    }

    pub(super) fn take_emergency(&mut self, emergency: Emergency) {
        self.emergencies += 1;
        self.lost_master = emergency.code == EmergencyCode::HEARTBEAT_LOST
            || self.lost_master && !emergency.code.is_cleared();
        // During the start it is only counted: what was wrong shows in the device's state.
        if self.is_up() && !emergency.code.is_cleared() {
            let node = self.settings.node;
            self.alarm(Alarm::Emergency { node, emergency });
        }
    }

    pub(super) fn alarm(&mut self, alarm: Alarm) {
        self.events.push_back(NodeEvent::Alarm(alarm));
    }
}
