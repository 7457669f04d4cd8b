//! Which machine stands here, and what its drives, faults and mains can do to it.
//!
//! A machine is a list of actuators, each with its own servo, encoder and switches, and
//! whatever they move together. Drives know actuators by number, from 0.

use units::Time;

use super::config::PlantConfig;
use super::parts::actuator::Actuator;
use super::platform::Platform;
use super::stage::Stage;
use super::table::Table;
use super::volumetric::Volumetric;

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
