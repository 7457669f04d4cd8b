//! Which machine stands here, and what its drives, faults and mains can do to it.

use core::any::Any;

use units::Time;

use super::config::PlantConfig;
use super::mechanics::Mechanics;
use super::parts::actuator::Actuator;
use super::stage::Stage;

/// The mechanics of one machine: nearly always one, and those of a table beside three axes.
#[derive(Debug)]
pub(super) struct Machine(Vec<Box<dyn Mechanics>>);

impl Clone for Machine {
    fn clone(&self) -> Self {
        Self(self.0.iter().map(|it| it.boxed()).collect())
    }
}

impl Machine {
    pub(super) fn new(config: &PlantConfig, seed: u64) -> Self {
        let others = config.others().into_iter().flatten();
        let mut mechanics: Vec<_> = others
            .map(|section| section.build(&config.interferometer, seed))
            .collect();
        if mechanics.is_empty() {
            mechanics.push(Box::new(Stage::new(config.stage.clone(), seed)));
        }
        Self(mechanics)
    }

    pub(super) fn advance(&mut self, now: Time) {
        self.0.iter_mut().for_each(|it| it.advance(now));
    }

    /// Those of the second mechanics are numbered on.
    pub(super) fn actuator(&self, number: usize) -> Option<&dyn Actuator> {
        let (at, number) = self.place(number)?;
        self.0[at].actuator(number)
    }

    pub(super) fn actuator_mut(&mut self, number: usize) -> Option<&mut dyn Actuator> {
        let (at, number) = self.place(number)?;
        self.0[at].actuator_mut(number)
    }

    /// Which mechanics have the actuator of this number, and as which of theirs.
    fn place(&self, mut number: usize) -> Option<(usize, usize)> {
        for (at, mechanics) in self.0.iter().enumerate() {
            if mechanics.actuator(number).is_some() {
                return Some((at, number));
            }
            let own = (0..number).take_while(|it| mechanics.actuator(*it).is_some());
            number -= own.count();
        }
        None
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
        self.0.iter_mut().for_each(|it| it.power_cycle());
    }

    /// The mechanics of that kind, where there are some.
    pub(super) fn of<M: Mechanics>(&self) -> Option<&M> {
        self.0.iter().find_map(|it| {
            let mechanics: &dyn Any = &**it;
            mechanics.downcast_ref()
        })
    }

    /// The same, to be moved by hand and spoilt.
    pub(super) fn of_mut<M: Mechanics>(&mut self) -> Option<&mut M> {
        self.0.iter_mut().find_map(|it| {
            let mechanics: &mut dyn Any = &mut **it;
            mechanics.downcast_mut()
        })
    }
}
