//! Events of the node, and the activities that take them.

use units::{Coordinate, Time};

use super::{Activity, Cia402Drive, drive_units, latch, start};
use crate::device::canopen_node::NodeEvent;
use crate::device::{Alarm, DeviceError};
use crate::protocol::script::Script;

impl<Q: Coordinate> Cia402Drive<Q> {
    pub(super) fn alarm(&mut self, alarm: Alarm) {
        self.alarms.push_back(alarm);
        self.prepared = None;
        let ends_it = match (&self.activity, alarm) {
            (Activity::Idle | Activity::Starting | Activity::Release, _) => false,
            // Stopping and resetting go on: they are the answer to alarms. A drive that booted
            // has nothing left to stop.
            (Activity::Power(_) | Activity::Halt(_), Alarm::UnexpectedBootUp { .. }) => true,
            (Activity::Power(_) | Activity::Halt(_), _) => false,
            (
                Activity::Move(_)
                | Activity::Homing(_)
                | Activity::Latch(_)
                | Activity::Mode(_)
                | Activity::Reference { .. },
                _,
            ) => true,
        };
        if ends_it {
            let step = self.activity.name();
            let device = self.node.name();
            self.finish(Err(DeviceError::Alarmed {
                device,
                step,
                alarm,
            }));
        }
    }

    pub(super) fn pump(&mut self, now: Time) {
        while let Some(event) = self.node.poll_event() {
            match event {
                NodeEvent::Described(script) => self.take_description(now, &script),
                NodeEvent::Operational => {}
                NodeEvent::ScriptDone(script) => self.script_done(now, &script),
                NodeEvent::Failed(error) => self.script_failed(now, error),
                NodeEvent::Alarm(alarm) => self.take_alarm(alarm),
                NodeEvent::Pdo { number, frame } => self.take_pdo(now, number, &frame),
                NodeEvent::PdoSilent { waited } => {
                    let node = self.node.id();
                    let period = self.settings.common.sync_period.as_nanos().max(1);
                    let missed = u32::try_from(waited.as_nanos() / period).unwrap_or(u32::MAX);
                    self.alarm(Alarm::PdoLost { node, missed });
                }
            }
        }
    }

    fn take_description(&mut self, now: Time, script: &Script) {
        self.probe.counts_edges = latch::counts_edges(&self.settings, script);
        self.supported_modes = start::supported_modes(script);
        let read = drive_units::stated(script);
        self.units_proven = self.settings.stated_units.are_all_with(read);
        self.per_turn = start::increments_per_turn(script);
        let steps = start::check_description(&self.settings, script)
            .and_then(|()| start::configuration(&self.settings, self.probe.counts_edges));
        match steps {
            Ok(steps) => self.node.configure(now, steps),
            Err(error) => {
                self.node.give_up(now);
                self.finish(Err(error));
            }
        }
    }

    fn script_done(&mut self, now: Time, script: &Script) {
        match &self.activity {
            Activity::Starting => self.end_start(now, script),
            Activity::Move(_) => self.move_prepared(now),
            Activity::Homing(_) => {
                self.note_before_home(script);
                self.homing_prepared(now);
            }
            Activity::Latch(_) => self.latch_written(now),
            Activity::Mode(_) => self.mode_written(now),
            Activity::Release => self.finish(Ok(())),
            Activity::Reference { .. } => self.reference_read(script),
            Activity::Idle | Activity::Power(_) | Activity::Halt(_) => {}
        }
    }

    fn script_failed(&mut self, now: Time, error: DeviceError) {
        match &self.activity {
            Activity::Homing(_) => self.homing_failed(now, error),
            Activity::Starting => self.finish(Err(error)),
            Activity::Move(_) => {
                self.profile = None;
                self.fail_motion(now, error);
            }
            Activity::Latch(_)
            | Activity::Mode(_)
            | Activity::Release
            | Activity::Reference { .. } => {
                self.finish(Err(error));
            }
            Activity::Idle | Activity::Power(_) | Activity::Halt(_) => {}
        }
    }
}
