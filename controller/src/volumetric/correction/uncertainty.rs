//! The uncertainty of the correction, from the uncertainty of each value that is used.

use compensator::budget::PlacesBudget;
use compensator::volumetric::Point;
use compensator::volumetric::model::Conditions;
use compensator::volumetric::online::FeedStatus;
use units::portable::hypot;
use units::{Metres, Quantity, Radians};

use crate::volumetric::correction::{VolumetricCorrection, per_axis};
use crate::volumetric::thermometers::Thermometers;
use machine::engine::{AXES_MAX, PerAxis};

impl VolumetricCorrection {
    /// Of a displacement that nobody sees nothing is known but that it is no larger than the
    /// largest permitted; one that blends in is off by what is left of that.
    fn u_displacement(&self) -> Metres {
        let largest = self.model.machine().displacement_max / 3.0_f64.sqrt();
        let beams = self.beams.iter().flatten();
        let each = beams.map(|it| {
            let (slider, end) = it.monitor.status();
            if slider == FeedStatus::Good && end.is_none_or(|it| it == FeedStatus::Good) {
                let left = it.monitor.left().value();
                Metres(hypot(self.u_displacement.value(), left))
            } else {
                largest
            }
        });
        each.fold(self.u_displacement, Quantity::max)
    }

    /// Likewise of a roll.
    fn u_roll(&self) -> Radians {
        let largest = self.model.machine().roll_max / 3.0_f64.sqrt();
        let each = self.rolls.iter().flatten().map(|it| {
            if it.monitor.status() == FeedStatus::Good {
                let left = it.monitor.left().value();
                Radians(hypot(self.u_roll.value(), left))
            } else {
                largest
            }
        });
        each.fold(self.u_roll, Quantity::max)
    }

    /// The standard uncertainties at `command`.
    pub(super) fn uncertainty(&self, command: Point, now: &Conditions) -> PerAxis<Metres> {
        let (displacement, roll, temperatures) = self.u_of_inputs();
        let u = self
            .model
            .standard_uncertainty(command, now, displacement, roll, temperatures);
        u.map_or([Metres(f64::NAN); AXES_MAX], per_axis)
    }

    /// What makes the correction uncertain that was given last: along x, y and z, the budget's places in this order.
    /// `None` where none was given, and where nothing is uncertain.
    pub fn budget(&self) -> Option<PlacesBudget<Metres>> {
        let (command, now) = self.given.as_ref()?;
        let (displacement, roll, temperatures) = self.u_of_inputs();
        self.model
            .uncertainty_budget(*command, now, displacement, roll, temperatures)
    }

    /// Of displacements, rolls and temperatures, as they are known now.
    fn u_of_inputs(&self) -> (Metres, Radians, &[f64]) {
        let temperatures = self.thermometers.as_ref();
        let u_temperatures = temperatures.map_or(&[][..], Thermometers::u_kelvin);
        (self.u_displacement(), self.u_roll(), u_temperatures)
    }
}
