//! What a drive and its axis are told, and what they read.

use units::{Coordinate, Time};
use wire::cia402::{OperationMode, PowerState, Statusword};

use super::homing_place::HomingPlace;
use super::{Activity, Cia402Drive};
use crate::device::{
    Axis, AxisCommand, AxisReading, DeviceError, DriveCommand, DriveReference, Place,
    ReferenceLost, ServoDrive,
};

impl<Q: Coordinate> Cia402Drive<Q> {
    pub(super) fn refuse_out_of_service(&mut self) {
        self.refuse(
            "a command",
            "a started, operational node that sends process data; start it (again)",
        );
    }

    /// Whether a motion is under way that a superseding command does not end.
    const fn is_moving(&self) -> bool {
        matches!(
            self.activity,
            Activity::Move(_) | Activity::Homing(_) | Activity::Halt(_)
        )
    }

    fn is_enabled(&self) -> bool {
        self.state() == Some(PowerState::OperationEnabled)
    }
}

impl<Q: Coordinate> ServoDrive for Cia402Drive<Q> {
    fn control(&mut self, now: Time, command: DriveCommand) {
        let was_moving = self.is_moving();
        self.supersede(now);
        match command {
            DriveCommand::QuickStop => self.begin_quick_stop(now),
            _ if !self.node.is_in_service() => self.refuse_out_of_service(),
            DriveCommand::Enable => self.begin_enable(now, was_moving),
            DriveCommand::Disable => self.begin_disable(now),
            DriveCommand::ResetFault => self.begin_reset(now),
            // A drive that is not enabled does not move: nothing is left to do.
            DriveCommand::Halt if !self.is_enabled() => self.finish(Ok(())),
            DriveCommand::Halt => self.begin_halt(now),
            DriveCommand::EnterCyclic { period } => self.begin_cyclic(now, period),
            DriveCommand::LeaveCyclic => self.end_cyclic(now),
            DriveCommand::ReadReference { mark } => self.begin_reference(now, mark),
        }
    }

    fn power_state(&self) -> Option<PowerState> {
        self.state()
    }

    /// A drive that nothing is heard of may have lost its power, and its home with that.
    fn is_homed(&self) -> bool {
        self.homed && self.node.is_in_service()
    }

    fn watches_master(&self) -> bool {
        self.node.watches_master()
    }

    fn place(&self) -> Option<Place> {
        let stands = self.image.plausible.stands();
        self.reading().map(|reading| reading.place(stands))
    }

    fn was_enabled(&self) -> bool {
        self.was_enabled
    }

    fn proves_reference(&self) -> bool {
        self.settings.reference_proof.is_some()
    }

    fn reference(&self) -> Result<DriveReference, ReferenceLost> {
        self.shown_reference()
    }

    fn take_up_reference(&mut self, then: &DriveReference) -> Result<(), ReferenceLost> {
        self.compare_reference(then)
    }

    fn started_at(&self) -> Option<Time> {
        self.started_at
    }
}

impl<Q: Coordinate> Axis<Q> for Cia402Drive<Q> {
    fn command(&mut self, now: Time, command: AxisCommand<Q>) {
        if let AxisCommand::Drive(command) = command {
            self.control(now, command);
            return;
        }
        let (prepared, was_moving) = (self.prepared.take(), self.is_moving());
        let is_motion = matches!(
            command,
            AxisCommand::MoveTo { .. } | AxisCommand::Prepare { .. } | AxisCommand::Start
        );
        self.supersede(now);
        if was_moving && !is_motion && self.is_enabled() {
            // A motion under way may be replaced by another one only.
            self.hold_back(now);
        }
        match command {
            AxisCommand::Drive(_) => {}
            _ if was_moving && !is_motion => {
                self.refuse("homing", "an axis that stands still");
            }
            _ if !self.node.is_in_service() => self.refuse_out_of_service(),
            _ if !self.is_enabled() => self.refuse("moving", "an enabled drive"),
            AxisCommand::MoveTo {
                target,
                speed,
                acceleration,
            } => self.begin_move(now, (target, speed, acceleration), false),
            AxisCommand::Prepare {
                target,
                speed,
                acceleration,
            } => self.begin_move(now, (target, speed, acceleration), true),
            AxisCommand::Start => match prepared {
                Some(prepared) => self.begin_prepared(now, prepared),
                None => self.refuse("starting", "a move that was prepared immediately before"),
            },
            AxisCommand::HomeNegativeLimit { position, speed } => {
                self.begin_homing(now, position, HomingPlace::NegativeLimit(speed));
            }
            AxisCommand::HomeIndex { position, speed } => {
                self.begin_homing(now, position, HomingPlace::Index(speed));
            }
            AxisCommand::HomeNextIndex {
                position,
                speed,
                approach,
            } => self.begin_homing(now, position, HomingPlace::NextIndex(speed, approach)),
            AxisCommand::HomeHere { position } => {
                self.begin_homing(now, position, HomingPlace::Here);
            }
        }
    }

    fn follow(&mut self, now: Time, set_point: Q) -> Result<(), DeviceError> {
        self.send_set_point(now, set_point)
    }

    fn held(&self) -> Option<Q> {
        self.held_set_point()
    }

    fn reading(&self) -> Option<AxisReading<Q>> {
        let sample = self.image.sample()?;
        let scale = self.settings.scale;
        // In the cyclic mode bit 10 says nothing: the axis stands when it stands.
        let reached = match sample.mode {
            OperationMode::CyclicSynchronousPosition => self.image.plausible.stands(),
            _ => sample.status.contains(Statusword::TARGET_REACHED),
        };
        let in_place = self.envelope.is_in_place(sample.position.0);
        let pending = sample.mode == OperationMode::ProfilePosition
            && sample.status.contains(Statusword::MODE_12);
        Some(AxisReading {
            at: sample.at,
            counts: sample.position,
            position: scale.to_coordinate(sample.position),
            following_error: self
                .image
                .following_error()
                .map(|counts| scale.to_coordinate(counts)),
            standing: reached
                && !pending
                && in_place
                && !matches!(self.activity, Activity::Move(_) | Activity::Homing(_)),
            at_rest: in_place && self.image.plausible.stands(),
        })
    }
}
