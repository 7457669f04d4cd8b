//! The uncertainty of the correction, from the uncertainty of each value that is used.

use compensator::budget::PlacesBudget;
use compensator::volumetric::Point;
use compensator::volumetric::model::{Conditions, Seen};
use compensator::volumetric::online::FeedStatus;
use units::portable::hypot;
use units::{Metres, Radians};

use crate::volumetric::correction::{VolumetricCorrection, per_axis};
use crate::volumetric::thermometers::Thermometers;
use machine::engine::{AXES_MAX, PerAxis};

impl VolumetricCorrection {
    /// Of a displacement that nobody sees nothing is known but that it is no larger than the
    /// largest permitted; one that blends in is off by what is left of that. A slide without a beam counts as
    /// the worst of the others at their best.
    fn u_displacement(&self) -> [Metres; 3] {
        let largest = self.model.machine().displacement_max / 3.0_f64.sqrt();
        let mut each = self.u_displacement;
        for (u, beam) in each.iter_mut().zip(&self.beams) {
            let Some(it) = beam else {
                continue;
            };
            let (slider, end) = it.monitor.status();
            *u = if slider == FeedStatus::Good && end.is_none_or(|it| it == FeedStatus::Good) {
                Metres(hypot(u.value(), it.monitor.left().value()))
            } else {
                largest.max(*u)
            };
        }
        each
    }

    /// Likewise of a roll.
    fn u_roll(&self) -> [Radians; 3] {
        let largest = self.model.machine().roll_max / 3.0_f64.sqrt();
        let mut each = self.u_roll;
        for (u, roll) in each.iter_mut().zip(&self.rolls) {
            let Some(it) = roll else {
                continue;
            };
            *u = if it.monitor.status() == FeedStatus::Good {
                Radians(hypot(u.value(), it.monitor.left().value()))
            } else {
                largest.max(*u)
            };
        }
        each
    }

    /// The standard uncertainties at `command`.
    pub(super) fn uncertainty(&self, command: Point, now: &Conditions) -> PerAxis<Metres> {
        let u = self.model.standard_uncertainty(command, now, &self.seen());
        u.map_or([Metres(f64::NAN); AXES_MAX], per_axis)
    }

    /// What makes the correction uncertain that was given last: along x, y and z, the budget's places in this order.
    /// `None` where none was given, and where nothing is uncertain.
    pub fn budget(&self) -> Option<PlacesBudget<Metres>> {
        let (command, now) = self.given.as_ref()?;
        self.model.uncertainty_budget(*command, now, &self.seen())
    }

    /// What displacements, rolls and temperatures are known to now.
    fn seen(&self) -> Seen<'_> {
        let temperatures = self.thermometers.as_ref();
        Seen {
            displacement: self.u_displacement(),
            roll: self.u_roll(),
            temperatures: temperatures.map_or(&[][..], Thermometers::u_kelvin),
        }
    }
}
