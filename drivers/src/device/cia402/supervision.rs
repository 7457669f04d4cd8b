//! What a drive reports of itself, and what of it is an alarm.

use units::{Coordinate, Time};
use wire::can::CanFrame;
use wire::cia402::{Controlword, OperationMode, PowerState, Statusword};

use super::image::{SAMPLE_BYTES, Sample};
use super::modulo::apart;
use super::start::POSITION_ACTUAL;
use super::{Activity, Cia402Drive};
use crate::device::departure::Departure;
use crate::device::plausible::Judgement;
use crate::device::{Alarm, DeviceError};
use crate::protocol::script::{Script, Step};

const COMPARING: &str = "comparing process data with the object it carries";

impl<Q: Coordinate> Cia402Drive<Q> {
    pub(super) fn take_alarm(&mut self, alarm: Alarm) {
        if let Alarm::UnexpectedBootUp { .. } | Alarm::DuplicateNode { .. } = alarm {
            // Everything volatile is gone: reference, profile, state.
            self.homed = false;
            self.reached = None;
            self.profile = None;
            self.commanded_mode = None;
            self.kept = None;
            self.open_target = false;
            self.sent_target = None;
            self.envelope.release();
            self.probe.disarm();
            self.image.clear();
        }
        self.alarm(alarm);
    }

    pub(super) fn take_pdo(&mut self, now: Time, number: u8, frame: &CanFrame) {
        let payload = frame.data();
        match number {
            1 if payload.len() < SAMPLE_BYTES => self.take_short_pdo(SAMPLE_BYTES, payload.len()),
            1 => {
                if let Some(sample) = Sample::parse(now, payload) {
                    self.told_short = false;
                    self.take_sample(now, sample);
                }
            }
            2 if !self.settings.map_following_error => {}
            2 if payload.len() < 4 => self.take_short_pdo(4, payload.len()),
            2 => self.image.take_following_error(payload),
            3 => self.take_latch(now, payload),
            _ => {}
        }
    }

    pub(super) fn take_short_pdo(&mut self, expected: usize, seen: usize) {
        self.short_pdos += 1;
        // Before the mapping is ours, anything may come.
        if self.node.is_up() && !core::mem::replace(&mut self.told_short, true) {
            let node = self.node.id();
            self.alarm(Alarm::PdoTooShort {
                node,
                expected,
                seen,
            });
        }
    }

    fn take_sample(&mut self, now: Time, sample: Sample) {
        if !self.node.is_up() {
            self.take_first_sample(now, sample);
            return;
        }
        match self.image.take(sample) {
            Judgement::Believed | Judgement::Doubted => {}
            Judgement::Jumped { by, limit } => {
                self.homed = false;
                self.reached = None;
                let node = self.node.id();
                let shown = |counts| self.settings.scale.to_coordinate(counts).abs().into();
                let (jump, limit) = (shown(by), shown(limit));
                self.alarm(Alarm::PositionJump { node, jump, limit });
            }
            Judgement::TooFast { seen, limit } => {
                let asked = self.asked();
                let alarm = self.shown(Departure::Speed { asked, limit, seen });
                self.alarm(alarm);
                self.stop_by_itself(now);
            }
        }
        self.supervise(&sample);
        self.watch_motion(now, &sample);
        match &self.activity {
            Activity::Idle
            | Activity::Starting
            | Activity::Latch(_)
            | Activity::Release
            | Activity::Reference { .. } => {}
            Activity::Power(_) => self.advance_power(now),
            Activity::Move(_) => self.advance_move(now),
            Activity::Halt(_) => self.advance_halt(now),
            Activity::Homing(_) => self.advance_homing(now),
            Activity::Mode(_) => self.advance_mode(),
        }
    }

    /// The first process data after NMT start is compared with the object itself: a mapping
    /// that reads back right may still be carried out wrong.
    fn take_first_sample(&mut self, now: Time, sample: Sample) {
        if !matches!(self.activity, Activity::Starting) || !self.node.is_operational() {
            return;
        }
        if let Some(raw) = self.compared {
            self.end_comparison(now, raw, sample);
        } else if self.first.replace(sample).is_none() {
            let object = POSITION_ACTUAL.object;
            self.node.run(now, vec![Step::read(object, COMPARING)]);
        }
    }

    /// The start is done when both agree. Where they do not, the axis may be moving (a controller that was
    /// killed has left it so): the next process data tell.
    pub(super) fn end_start(&mut self, now: Time, script: &Script) {
        let (Some(sample), Some(raw)) = (self.first, script.value(POSITION_ACTUAL.object)) else {
            return;
        };
        if self.agrees(raw, &sample, &sample) {
            self.is_started(now, sample);
        } else {
            self.compared = Some(raw);
        }
    }

    /// The object was read between the newest process data before it and `after`.
    fn end_comparison(&mut self, now: Time, raw: u32, after: Sample) {
        let Some(before) = self.first else {
            return;
        };
        if self.agrees(raw, &before, &after) {
            self.is_started(now, after);
            return;
        }
        self.node.give_up(now);
        self.finish(Err(DeviceError::ReadBack {
            node: self.node.id(),
            object: POSITION_ACTUAL.object,
            expected: u64::from(raw),
            seen: u64::from(before.shown.cast_unsigned()),
            step: COMPARING,
        }));
    }

    /// Whether an axis that was at `before` and then at `after` can have been at `raw` meanwhile.
    fn agrees(&self, raw: u32, before: &Sample, after: &Sample) -> bool {
        let away = |position| apart(self.settings.modulo(), position, before.position.0);
        let (seen, moved) = (away(i64::from(raw.cast_signed())), away(after.position.0));
        let margin = self.image.plausible.margin();
        (moved.min(0) - margin..=moved.max(0) + margin).contains(&seen)
    }

    fn is_started(&mut self, now: Time, sample: Sample) {
        (self.first, self.compared) = (None, None);
        self.node.up(now);
        self.commanded_mode = Some(OperationMode::ProfilePosition);
        match sample.status.state() {
            PowerState::OperationEnabled | PowerState::QuickStopActive => {
                self.stop_what_was_left(now);
            }
            _ => self.finish(Ok(())),
        }
        self.take_sample(now, sample);
    }

    /// Whoever had the drive before is gone, and what he began goes on: now that it hears heartbeats again, its own watch
    /// would never end it. The start is done when it is off.
    fn stop_what_was_left(&mut self, now: Time) {
        self.left_enabled += 1;
        // It may wait under HALT to go on to its target.
        self.control |= Controlword::HALT;
        self.was_enabled = true;
        self.begin_quick_stop(now);
    }

    fn supervise(&mut self, sample: &Sample) {
        let node = self.node.id();
        let seen = sample.state();
        let changing = matches!(self.activity, Activity::Power(_));
        match self.kept.filter(|kept| !changing && *kept != seen) {
            Some(expected) if !self.told_state => {
                self.told_state = true;
                self.reached = None;
                self.alarm(Alarm::DriveState {
                    node,
                    expected,
                    seen,
                });
            }
            Some(_) => {}
            None => self.told_state = false,
        }
        let positions = matches!(
            sample.mode,
            OperationMode::ProfilePosition | OperationMode::CyclicSynchronousPosition
        );
        let lagging = positions
            && seen == PowerState::OperationEnabled
            && sample.status.contains(Statusword::MODE_13);
        self.watch_course(lagging);
        if lagging && !self.told_following {
            self.alarm(Alarm::FollowingError { node });
        }
        self.told_following = lagging;
        self.watch_cyclic(sample);
    }
}
