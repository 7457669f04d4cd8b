//! Homing (CiA 402, 11; methods 17, 18, 33, 34 and 37): parameters, mode 6, start, status by
//! mask, mode 1 again.

use core::time::Duration;
use units::{Approach, Coordinate, Time};
use wire::cia402::{Controlword, HomingStatus, OperationMode};

use super::convert::{counts_i32, position_counts};
use super::modulo::apart;
use super::reference::before_home;
use super::settings::HomeOffset;
use super::start::{HOME_OFFSET, MODE, homing_steps};
use super::{Activity, Cia402Drive};
use crate::device::{DeviceError, Seen};
use crate::protocol::script::Step;

/// So many samples after the start, "done" and "error" may still be those of the homing before.
const STALE_SAMPLES: u8 = 5;

#[derive(Clone, Debug, PartialEq)]
enum Phase {
    /// SDO: parameters, mode 6.
    Preparing,
    AwaitingHoming,
    Running {
        samples: u8,
        /// "In progress" or the like was seen: what follows is about this homing.
        begun: bool,
    },
    /// SDO: mode 1; then the outcome is told.
    Restoring(Result<(), DeviceError>),
    AwaitingProfile(Result<(), DeviceError>),
    AwaitingPosition,
}

/// A homing under way.
#[derive(Debug)]
pub(super) struct Homing {
    phase: Phase,
    /// The coordinate at home, in counts.
    position: i64,
    /// Homed where it stands: the reading must become `position`.
    here: bool,
    since: Time,
    deadline: Time,
}

impl Homing {
    pub(super) const fn deadline(&self) -> Time {
        self.deadline
    }
}

/// Where the home is, and how fast it is looked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum HomingPlace<S> {
    /// Where the axis stands.
    Here,
    /// Where it leaves its negative limit switch.
    NegativeLimit(S),
    /// At the first index pulse off that switch.
    Index(S),
    /// At the next index pulse in this direction.
    NextIndex(S, Approach),
}

impl<S: Copy> HomingPlace<S> {
    /// 0x6098. The negative end of the axis is the drive's positive one when the drive counts
    /// against the axis.
    pub(super) const fn method(&self, reversed: bool) -> i8 {
        use Approach::{Forward, Reverse};
        match (self, reversed) {
            (Self::Here, _) => 37,
            (Self::NegativeLimit(_), false) => 17,
            (Self::NegativeLimit(_), true) => 18,
            (Self::Index(_), false) => 1,
            (Self::Index(_), true) => 2,
            (Self::NextIndex(_, Reverse), false) | (Self::NextIndex(_, Forward), true) => 33,
            (Self::NextIndex(_, Forward), false) | (Self::NextIndex(_, Reverse), true) => 34,
        }
    }

    const fn speed(&self) -> Option<S> {
        match self {
            Self::Here => None,
            Self::NegativeLimit(speed) | Self::Index(speed) | Self::NextIndex(speed, _) => {
                Some(*speed)
            }
        }
    }
}

impl<Q: Coordinate> Cia402Drive<Q> {
    pub(super) fn begin_homing(&mut self, now: Time, position: Q, place: HomingPlace<Q::Speed>) {
        let search = place.speed();
        if search.is_none() && !self.image.plausible.stands() {
            self.refuse("homing here", "an axis that stands still");
            return;
        }
        let method = place.method(self.settings.scale.resolution() < Q::ZERO);
        let plan = self.home_counts(position).and_then(|(counts, shown)| {
            let offset = match self.settings.home_offset {
                HomeOffset::IsPositionAtHome => shown,
                HomeOffset::IsZeroFromHome => -shown,
            };
            let mut steps = homing_steps(&self.settings, method, offset, search)?;
            let first = before_home(&self.settings).filter(|_| search.is_none());
            steps.splice(0..0, first);
            Ok((counts, steps))
        });
        match plan {
            Err(error) => self.finish(Err(error)),
            Ok((position, steps)) => {
                self.reached = None;
                self.homed = false;
                self.before_home = None;
                self.image.plausible.allow_jumps(true);
                self.activity = Activity::Homing(Homing {
                    phase: Phase::Preparing,
                    position,
                    here: search.is_none(),
                    since: now,
                    deadline: Time::NEVER,
                });
                self.commanded_mode = None;
                // Without a set-point bit: in homing mode it would be the start. Halt stays
                // until then: without it an interrupted move would go on.
                let held = self.control & Controlword::HALT;
                self.send_control(now, Controlword::ENABLE_COMMAND | held);
                self.repeat_at = Time::NEVER;
                self.node.run(now, steps);
                self.pump(now);
            }
        }
    }

    /// The coordinate at home in counts, and as the drive will show it.
    fn home_counts(&self, position: Q) -> Result<(i64, i32), DeviceError> {
        const WHAT: &str = "home position";
        let settings = &self.settings;
        let Some(turn) = settings.wraps_at() else {
            let counts = counts_i32(settings, HOME_OFFSET, WHAT, position)?;
            return Ok((i64::from(counts), counts));
        };
        let counts = position_counts(settings, HOME_OFFSET, WHAT, position)?;
        let shown = i32::try_from(counts.rem_euclid(turn)).expect("a turn fits 32 bits");
        Ok((counts, shown))
    }

    fn enter_homing(&mut self, now: Time, phase: Phase, patience: Option<Duration>) {
        if let Activity::Homing(homing) = &mut self.activity {
            homing.phase = phase;
            homing.since = now;
            homing.deadline = patience.map_or(Time::NEVER, |patience| now + patience);
        }
    }

    pub(super) fn homing_prepared(&mut self, now: Time) {
        let Activity::Homing(homing) = &self.activity else {
            return;
        };
        let mode = Some(self.settings.timeouts.mode);
        match homing.phase.clone() {
            Phase::Preparing => self.enter_homing(now, Phase::AwaitingHoming, mode),
            Phase::Restoring(result) => {
                self.commanded_mode = Some(OperationMode::ProfilePosition);
                self.enter_homing(now, Phase::AwaitingProfile(result), mode);
            }
            Phase::AwaitingHoming
            | Phase::Running { .. }
            | Phase::AwaitingProfile(_)
            | Phase::AwaitingPosition => {}
        }
    }

    /// A transfer failed, or the drive did: back to profile position, then tell.
    pub(super) fn homing_failed(&mut self, now: Time, error: DeviceError) {
        let Activity::Homing(homing) = &self.activity else {
            return;
        };
        match &homing.phase {
            Phase::Restoring(_) | Phase::AwaitingProfile(_) | Phase::AwaitingPosition => {
                self.finish(Err(error));
            }
            Phase::Preparing | Phase::AwaitingHoming | Phase::Running { .. } => {
                self.restore(now, Err(error));
            }
        }
    }

    fn restore(&mut self, now: Time, result: Result<(), DeviceError>) {
        self.send_control(now, Controlword::ENABLE_COMMAND);
        self.repeat_at = Time::NEVER;
        self.enter_homing(now, Phase::Restoring(result), None);
        let mode = OperationMode::ProfilePosition.raw();
        let step = Step::write(MODE, mode, "going back to profile position");
        self.node.run(now, vec![step]);
        self.pump(now);
    }

    pub(super) fn advance_homing(&mut self, now: Time) {
        let Some(sample) = self.image.sample().copied() else {
            return;
        };
        let Activity::Homing(homing) = &mut self.activity else {
            return;
        };
        match &mut homing.phase {
            Phase::Preparing | Phase::Restoring(_) => {}
            Phase::AwaitingHoming => {
                if sample.mode == OperationMode::Homing {
                    let phase = Phase::Running {
                        samples: 0,
                        begun: false,
                    };
                    self.enter_homing(now, phase, Some(self.settings.timeouts.homing));
                    self.send_control(now, Controlword::ENABLE_COMMAND | Controlword::MODE_4);
                }
            }
            Phase::Running { samples, begun } => {
                *samples = samples.saturating_add(1);
                let status = HomingStatus::of(sample.status);
                let fresh = *begun || *samples > STALE_SAMPLES;
                match status {
                    HomingStatus::InProgress | HomingStatus::Attained => {
                        *begun = true;
                        self.repeat_at = Time::NEVER;
                    }
                    HomingStatus::Done if fresh => self.restore(now, Ok(())),
                    HomingStatus::ErrorMoving | HomingStatus::ErrorStopped if fresh => {
                        let node = self.node.id();
                        let (step, state) = ("homing", sample.state());
                        let error = DeviceError::DriveRefused { node, step, state };
                        self.restore(now, Err(error));
                    }
                    HomingStatus::NotStarted
                    | HomingStatus::Done
                    | HomingStatus::ErrorMoving
                    | HomingStatus::ErrorStopped
                    | HomingStatus::Unknown(_) => {}
                }
            }
            Phase::AwaitingProfile(result) => {
                if sample.mode == OperationMode::ProfilePosition {
                    match result.clone() {
                        Err(error) => self.finish(Err(error)),
                        Ok(()) => {
                            let patience = Some(self.settings.timeouts.new_position);
                            self.enter_homing(now, Phase::AwaitingPosition, patience);
                            self.advance_homing(now);
                        }
                    }
                }
            }
            Phase::AwaitingPosition => {
                let (wanted, here) = (homing.position, homing.here);
                if self.is_new_position(sample.position.0, wanted, here) {
                    self.image.count_from(wanted);
                    self.target = self.on_the_wire(wanted).unwrap_or(self.target);
                    self.homed = true;
                    self.finish(Ok(()));
                }
            }
        }
    }

    /// Whether the position after a homing to `wanted` is believed.
    fn is_new_position(&self, position: i64, wanted: i64, here: bool) -> bool {
        let modulo = self.settings.modulo();
        let away = apart(modulo, position, wanted).abs();
        let mirrored = apart(modulo, position, -wanted).abs();
        if here {
            away <= self.settings.tolerance_counts()
        } else {
            // A search ends somewhere beside the switch, but not at minus its place: there
            // 0x607C has the other meaning, and the next move would go through the switch.
            away < mirrored || apart(modulo, wanted, -wanted) == 0
        }
    }

    pub(super) fn homing_timeout(&mut self, now: Time) {
        let Activity::Homing(homing) = &self.activity else {
            return;
        };
        if now < homing.deadline {
            return;
        }
        let since = homing.since;
        let mode = self
            .mode()
            .map_or(Seen::Nothing, |mode| Seen::Mode(mode.raw()));
        match homing.phase.clone() {
            Phase::Preparing | Phase::Restoring(_) => {}
            Phase::AwaitingHoming => {
                let error = DeviceError::Timeout {
                    device: self.node.name(),
                    awaited: "the homing mode",
                    waited: now.since(since),
                    seen: mode,
                };
                self.restore(now, Err(error));
            }
            Phase::Running { .. } => {
                let error = DeviceError::Timeout {
                    device: self.node.name(),
                    awaited: "the end of homing",
                    waited: now.since(since),
                    seen: self.seen_status(),
                };
                self.restore(now, Err(error));
            }
            // The homing's own failure is the better cause.
            Phase::AwaitingProfile(Err(error)) => self.finish(Err(error)),
            Phase::AwaitingProfile(Ok(())) => {
                self.time_out(now, since, "profile position after homing", mode);
            }
            Phase::AwaitingPosition => {
                let seen = self.image.sample().map_or(Seen::Nothing, |sample| {
                    Seen::Position(self.settings.scale.to_coordinate(sample.position).into())
                });
                self.time_out(now, since, "the new position after homing", seen);
            }
        }
    }
}
