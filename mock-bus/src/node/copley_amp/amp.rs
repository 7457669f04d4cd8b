//! One amplifier: its memory, its power, and what it does with a command.

mod parameters;
mod trajectory;

use core::time::Duration;
use std::collections::BTreeMap;

use units::Time;
use wire::copley::{
    BAUD_AT_RESET, Command, DesiredState, Faults, Parameter, Reply, TrajectoryStatus,
};

use self::trajectory::Motion;
use super::config::CopleyAmpConfig;
use crate::node::profile::{MotionState, Profile};
use crate::plant::{Plant, Servo};
use crate::span::seconds;

/// How often the demand is updated while something moves.
const SERVO_PERIOD: Duration = Duration::from_millis(1);
/// How often the amplifier looks after itself while nothing moves.
const WATCH_PERIOD: Duration = Duration::from_millis(10);

/// The power stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stage {
    Off,
    /// On its way to being enabled.
    Enabling {
        until: Time,
    },
    /// The motor is under control.
    On,
    /// Disabled while it moved: it slows down first.
    Stopping,
}

pub(super) struct Amp {
    pub(super) config: CopleyAmpConfig,
    /// Values that outlive the power.
    flash: BTreeMap<u16, i64>,
    pub(super) ram: BTreeMap<u16, i64>,
    powered: bool,
    pub(super) booted_at: Time,
    pub(super) stage: Stage,
    /// Position = encoder counts + offset.
    pub(super) offset: i64,
    pub(super) profile: Profile,
    pub(super) motion: Motion,
    pub(super) trajectory: TrajectoryStatus,
    pub(super) settling: bool,
    pub(super) settled_since: Option<Time>,
    pub(super) latched: Faults,
    /// Faults whose cause is there.
    pub(super) causes: Faults,
    pub(super) torque_off: bool,
    pub(super) tracking_error: bool,
    new_rate: Option<u32>,
    pub(super) moved_at: Option<Time>,
    sent_demand: Option<f64>,
    due: Time,
}

impl Amp {
    pub(super) fn new(config: CopleyAmpConfig) -> Self {
        Self {
            flash: parameters::in_flash(&config),
            config,
            ram: BTreeMap::new(),
            powered: false,
            booted_at: Time::NEVER,
            stage: Stage::Off,
            offset: 0,
            profile: Profile::resting(0.0),
            motion: Motion::Standing,
            trajectory: TrajectoryStatus::empty(),
            settling: false,
            settled_since: None,
            latched: Faults::empty(),
            causes: Faults::empty(),
            torque_off: false,
            tracking_error: false,
            new_rate: None,
            moved_at: None,
            sent_demand: None,
            due: Time::NEVER,
        }
    }

    pub(super) fn listens(&self, now: Time) -> bool {
        self.powered && now >= self.booted_at
    }

    pub(super) const fn moved_at(&self) -> Option<Time> {
        self.moved_at
    }

    pub(super) const fn take_new_rate(&mut self) -> Option<u32> {
        self.new_rate.take()
    }

    pub(super) fn power_on(&mut self, now: Time, plant: &mut Plant) {
        if core::mem::replace(&mut self.powered, true) {
            return;
        }
        plant.encoder_power(self.config.axis, true);
        self.restart(now, plant);
    }

    pub(super) fn power_off(&mut self, plant: &mut Plant) {
        self.switch_off(plant);
        plant.encoder_power(self.config.axis, false);
        self.powered = false;
        self.due = Time::NEVER;
    }

    /// Everything volatile has its power-on value; the position counts from here.
    pub(super) fn restart(&mut self, now: Time, plant: &mut Plant) {
        self.switch_off(plant);
        self.booted_at = now + milliseconds(self.config.boot_ms);
        self.ram = self.flash.clone();
        self.offset = -plant.encoder_counts(self.config.axis);
        self.profile = Profile::resting(0.0);
        self.trajectory = TrajectoryStatus::empty();
        self.latched = Faults::empty();
        self.settling = false;
        self.new_rate = None;
        self.due = self.booted_at;
        if self.desired() == DesiredState::ProgrammedPosition {
            self.enable(self.booted_at);
        }
    }

    pub(super) fn next_event(&self) -> Time {
        if self.powered { self.due } else { Time::NEVER }
    }

    pub(super) const fn look_now(&mut self) {
        self.due = Time::ZERO;
    }

    pub(super) fn advance(&mut self, now: Time, plant: &mut Plant) {
        if !self.listens(now) || now < self.due {
            return;
        }
        if let Stage::Enabling { until } = self.stage
            && now >= until
            && !self.config.quirks.enable_refused
        {
            self.stage = Stage::On;
            self.profile = Profile::resting(self.position(plant) as f64);
        }
        self.watch(now, plant);
        self.proceed(now, plant);
        self.command_servo(now, plant);
        self.watch_settling(now, plant);
        let busy = self.settling || self.motion != Motion::Standing || self.stage != Stage::Off;
        let busy = busy && (!self.profile.is_done(now) || self.settling);
        let enabling = matches!(self.stage, Stage::Enabling { .. });
        self.due = now
            + if busy || enabling || self.stage == Stage::Stopping {
                SERVO_PERIOD
            } else {
                WATCH_PERIOD
            };
    }

    pub(super) fn execute(&mut self, now: Time, command: Command, plant: &mut Plant) -> Reply {
        let done = match command {
            Command::Get { bank, parameter } => {
                return parameters::get(self, now, bank, parameter, plant)
                    .map_or_else(Reply::Error, Reply::Value);
            }
            Command::Set {
                bank,
                parameter,
                value,
            } => parameters::set(self, now, bank, parameter, value, plant),
            Command::Trajectory(trajectory) => self.obey(now, trajectory, plant),
            // The node restarts instead of answering.
            Command::Reset => Ok(()),
        };
        self.look_now();
        done.map_or_else(Reply::Error, |()| Reply::Ok)
    }

    pub(super) fn ram(&self, parameter: Parameter) -> i64 {
        self.ram.get(&parameter.0).copied().unwrap_or(0)
    }

    pub(super) fn write_flash(&mut self, parameter: Parameter, value: i64) {
        self.flash.insert(parameter.0, value);
    }

    pub(super) fn flash(&self, parameter: Parameter) -> i64 {
        self.flash.get(&parameter.0).copied().unwrap_or(0)
    }

    pub(super) fn reset_rate(&mut self) {
        self.ram.insert(Parameter::BAUD.0, BAUD_AT_RESET.into());
    }

    pub(super) const fn set_new_rate(&mut self, rate: u32) {
        self.new_rate = Some(rate);
    }

    pub(super) fn desired(&self) -> DesiredState {
        DesiredState::from_raw(self.ram(Parameter::DESIRED_STATE))
    }

    pub(super) fn position(&self, plant: &Plant) -> i64 {
        plant.encoder_counts(self.config.axis) + self.offset
    }

    pub(super) fn demand(&self, now: Time) -> MotionState {
        self.profile.at(now)
    }

    /// Where the trajectory generator wants the axis; where it is, when nothing is wanted.
    pub(super) fn commanded(&self, now: Time, plant: &Plant) -> i64 {
        if self.controls() {
            self.demand(now).position.round() as i64
        } else {
            self.position(plant)
        }
    }

    /// Whether the servo has the motor.
    pub(super) const fn controls(&self) -> bool {
        matches!(self.stage, Stage::On | Stage::Stopping)
    }

    pub(super) fn enable(&mut self, now: Time) {
        let stopped_by = self.latched | self.causes;
        if matches!(self.stage, Stage::Off) && stopped_by.is_empty() && !self.torque_off {
            let until = now + milliseconds(self.config.enable_ms);
            self.stage = Stage::Enabling { until };
        }
    }

    /// In position modes it slows down before the power goes off.
    pub(super) fn disable(&mut self, now: Time, plant: &mut Plant) {
        match self.stage {
            Stage::On if !self.profile.is_done(now) => {
                self.abort(now);
                self.stage = Stage::Stopping;
            }
            Stage::On | Stage::Enabling { .. } => self.switch_off(plant),
            Stage::Off | Stage::Stopping => {}
        }
    }

    pub(super) fn switch_off(&mut self, plant: &mut Plant) {
        self.stage = Stage::Off;
        self.motion = Motion::Standing;
        self.trajectory.remove(TrajectoryStatus::RUNNING);
        self.settling = false;
        self.sent_demand = None;
        plant.set_servo(self.config.axis, Servo::Off);
    }

    /// Gives the plant the demand, when it changed.
    fn command_servo(&mut self, now: Time, plant: &mut Plant) {
        if !self.controls() {
            self.profile = Profile::resting(self.position(plant) as f64);
            return;
        }
        let counts = self.demand(now).position - self.offset as f64;
        let demand_m = counts * plant.encoder_resolution(self.config.axis);
        if self.sent_demand != Some(demand_m) {
            self.sent_demand = Some(demand_m);
            plant.set_servo(self.config.axis, Servo::Follow { demand: demand_m });
        }
    }
}

pub(super) fn milliseconds(ms: f64) -> Duration {
    seconds(ms * 1e-3)
}
