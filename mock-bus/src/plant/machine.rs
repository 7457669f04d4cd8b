//! Which machine stands here, and what its drives, faults and mains can do to it.
//!
//! A machine is a list of actuators, each with its own servo, encoder and switches, and
//! whatever they move together. Drives know actuators by number, from 0.

use units::Time;

use super::Servo;
use super::config::PlantConfig;
use super::drive_train::DriveTrain;
use super::platform::Platform;
use super::stage::Stage;
use super::table::Table;
use super::volumetric::Volumetric;

/// One driven direction as its drive is wired to it.
pub(super) trait Actuator {
    fn train(&self) -> &DriveTrain;
    fn train_mut(&mut self) -> &mut DriveTrain;
    /// What the drive does to it from `now` on.
    fn set_servo(&mut self, now: Time, servo: Servo) {
        self.train_mut().set_servo(now, servo);
    }
    /// The encoder's counts since its power came on.
    fn counts(&self, now: Time) -> i64 {
        self.train().counts(now)
    }
    fn counts_per_s(&self, now: Time) -> f64 {
        self.train().counts_per_s(now)
    }
    /// Metres or radians of encoder travel per count.
    fn resolution(&self) -> f64 {
        self.train().encoder.resolution()
    }
    fn encoder_power(&mut self, on: bool) {
        self.train_mut().encoder_power(on);
    }
    /// The encoder's last index pulse since its power came on; `None` before, and where the
    /// encoder has no index.
    fn index_pulse(&self) -> Option<IndexPulse> {
        self.train().index_pulse()
    }
    /// The next edge at the drive's fast input by `now`; `None` also where nothing is wired to it.
    fn probe_edge(&mut self, _now: Time) -> Option<ProbeEdge> {
        None
    }
    /// Negative and positive limit switch: true when pressed.
    fn limit_switches(&self) -> (bool, bool) {
        self.train().limit_switches()
    }
    /// Holds a limit switch in a state, or (with `None`) leaves it to the mechanics.
    fn force_switch(&mut self, positive: bool, forced: Option<bool>) {
        self.train_mut().force_switch(positive, forced);
    }
    /// Holds it fast, or lets it go.
    fn set_blocked(&mut self, blocked: bool) {
        self.train_mut().mass.set_blocked(blocked);
    }
    fn set_torque_off(&mut self, off: bool) {
        self.train_mut().mass.set_torque_off(off);
    }
    fn torque_off(&self) -> bool {
        self.train().mass.torque_off()
    }
}

/// A pulse that the encoder gave at its index mark.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct IndexPulse {
    /// The count at the mark, in the encoder's present counting.
    pub count: i64,
    /// How many pulses there have been since the encoder was powered: a new one has a new number.
    pub number: u64,
}

/// An edge at a fast input, with what a drive latches at it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ProbeEdge {
    /// When.
    pub at: Time,
    /// From low to high.
    pub rising: bool,
    /// The encoder's count at that moment.
    pub count: i64,
}

/// The mechanics of one machine.
#[derive(Clone, Debug)]
pub(super) enum Machine {
    /// One linear-motor stage.
    Stage(Box<Stage>),
    /// A platform on screws.
    Platform(Box<Platform>),
    /// A rotary table.
    Table(Box<Table>),
    /// Three linear axes.
    Volumetric(Box<Volumetric>),
}

impl Machine {
    pub(super) fn new(config: &PlantConfig, seed: u64) -> Self {
        if let Some(platform) = &config.platform {
            Self::Platform(Box::new(Platform::new(platform, seed)))
        } else if let Some(table) = &config.table {
            Self::Table(Box::new(Table::new(table, seed)))
        } else if let Some(volumetric) = &config.volumetric {
            let dead_path_m = config.interferometer.dead_path_mm * 1e-3;
            Self::Volumetric(Box::new(Volumetric::new(volumetric, dead_path_m, seed)))
        } else {
            Self::Stage(Box::new(Stage::new(config.stage.clone(), seed)))
        }
    }

    pub(super) fn advance(&mut self, now: Time) {
        match self {
            Self::Stage(stage) => stage.advance(now),
            Self::Platform(platform) => platform.advance(now),
            Self::Table(table) => table.advance(now),
            Self::Volumetric(volumetric) => volumetric.advance(now),
        }
    }

    pub(super) fn actuator(&self, number: usize) -> Option<&dyn Actuator> {
        match self {
            Self::Stage(stage) => (number == 0).then_some(&**stage as &dyn Actuator),
            Self::Platform(platform) => platform.actuator(number),
            Self::Table(table) => (number == 0).then_some(&**table as &dyn Actuator),
            Self::Volumetric(volumetric) => volumetric.actuator(number),
        }
    }

    pub(super) fn actuator_mut(&mut self, number: usize) -> Option<&mut dyn Actuator> {
        match self {
            Self::Stage(stage) => (number == 0).then_some(&mut **stage as &mut dyn Actuator),
            Self::Platform(platform) => platform.actuator_mut(number),
            Self::Table(table) => (number == 0).then_some(&mut **table as &mut dyn Actuator),
            Self::Volumetric(volumetric) => volumetric.actuator_mut(number),
        }
    }

    /// One circuit takes the torque away from every actuator.
    pub(super) fn set_torque_off(&mut self, off: bool) {
        let mut number = 0;
        while let Some(actuator) = self.actuator_mut(number) {
            actuator.set_torque_off(off);
            number += 1;
        }
    }

    /// The mains is off: nobody holds the machine.
    pub(super) fn power_cycle(&mut self) {
        match self {
            Self::Stage(stage) => stage.push_a_little(),
            Self::Platform(platform) => platform.power_cycle(),
            Self::Table(table) => table.push_a_little(),
            Self::Volumetric(volumetric) => volumetric.power_cycle(),
        }
    }

    /// The linear stage, where the machine is one.
    pub(super) const fn stage(&self) -> Option<&Stage> {
        match self {
            Self::Stage(stage) => Some(stage),
            Self::Platform(_) | Self::Table(_) | Self::Volumetric(_) => None,
        }
    }

    /// The platform, where the machine is one.
    pub(super) const fn platform(&self) -> Option<&Platform> {
        match self {
            Self::Platform(platform) => Some(platform),
            Self::Stage(_) | Self::Table(_) | Self::Volumetric(_) => None,
        }
    }

    /// The rotary table, where the machine is one.
    pub(super) const fn table(&self) -> Option<&Table> {
        match self {
            Self::Table(table) => Some(table),
            Self::Stage(_) | Self::Platform(_) | Self::Volumetric(_) => None,
        }
    }

    /// The same, to be turned and spoilt.
    pub(super) const fn table_mut(&mut self) -> Option<&mut Table> {
        match self {
            Self::Table(table) => Some(table),
            Self::Stage(_) | Self::Platform(_) | Self::Volumetric(_) => None,
        }
    }

    /// The three axes, where the machine has them.
    pub(super) const fn volumetric(&self) -> Option<&Volumetric> {
        match self {
            Self::Volumetric(volumetric) => Some(volumetric),
            Self::Stage(_) | Self::Platform(_) | Self::Table(_) => None,
        }
    }

    /// The same, to be read and spoilt.
    pub(super) const fn volumetric_mut(&mut self) -> Option<&mut Volumetric> {
        match self {
            Self::Volumetric(volumetric) => Some(volumetric),
            Self::Stage(_) | Self::Platform(_) | Self::Table(_) => None,
        }
    }
}
