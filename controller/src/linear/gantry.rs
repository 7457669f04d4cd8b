//! The zero of a gantry: both sides of one stage, and how far it is turned (system S5).
//!
//! Both sides move together to their limit switches and to their nominal zeros, so that the stage is turned no
//! further than it was. Then one side finds its zero while the other one stands: by no more than the search's limit
//! over the distance. The difference of both zero points, in the coordinates in which both sides were brought
//! together, is the rotation; afterwards each side counts from its own.

use core::time::Duration;
use std::path::PathBuf;

use compensator::hall_zero::{Base, rotation};
use compensator::uncertainty::{combine, of_rounding};
use drivers::device::AxisCommand;
use units::Metres;

use crate::failure::Failure;
use crate::handle::Core;
use crate::homing;
use crate::linear::earlier_zero::newest_zero;
use crate::linear::stage::{LinearStage, gantry_of};
use crate::linear::zero::{Begins, to_limit_switch};
use crate::linear::{GantryConfig, LinearEntry, LinearLog, RotationEntry, Zeroed};
use crate::run::{missing, note_failure, settle};
use crate::store::Store;

/// A gantry that was zeroed.
#[derive(Clone, Debug)]
pub struct GantryZeroed {
    /// What it is called.
    pub name: String,
    /// Its sides' zeros, in the order of the configuration.
    pub sides: [Zeroed; 2],
    /// How far it was turned.
    pub entry: RotationEntry,
    /// The same at the zero before it, from the newest journal of this gantry that says it.
    pub previous: Option<RotationEntry>,
    /// Where that is recorded.
    pub journal: PathBuf,
}

impl LinearStage<'_> {
    /// Finds the zero points of both sides of the gantry that this axis is a side of, and how far the stage was
    /// turned; both sides are enabled and stand at their zeros afterwards.
    ///
    /// An angle beyond its limit is a result all the same: `is_within_limit` of its entry.
    ///
    /// # Errors
    /// When it is no side of a gantry; whatever stops the machine; as [`Self::zero`] of either side. Neither side is
    /// zeroed then.
    pub fn zero_gantry(&mut self, store: &Store) -> Result<GantryZeroed, Failure> {
        let own = gantry_of(self.core.config, self.axis);
        let (name, gantry) = own.ok_or_else(|| missing(self.axis, "gantry"))?;
        let previous = newest_zero(&mut self.core, store, name)?;
        let previous = previous.and_then(|mut log| log.rotations.pop());
        let mut journal = store.create_journal::<LinearLog>(&self.zero_header(name))?;
        settle(&mut self.core, store)?;
        let found = self.zero_both(gantry, store);
        if found.is_err() {
            // One side alone must not count as if the stage stood straight.
            let axes = gantry.axes.each_ref();
            let forgotten = axes.map(|axis| self.core.set_zeroed(axis, false));
            forgotten.into_iter().collect::<Result<(), _>>()?;
        }
        let sides = found.inspect_err(|failure| note_failure(&mut journal, failure))?;
        let entry = self.rotation_entry(gantry, &sides);
        journal.write(&LinearEntry::Rotation(entry.clone()))?;
        journal.complete()?;
        settle(&mut self.core, store)?;
        Ok(GantryZeroed {
            name: name.to_owned(),
            sides,
            entry,
            previous,
            journal: journal.path().to_owned(),
        })
    }

    fn zero_both(&mut self, gantry: &GantryConfig, store: &Store) -> Result<[Zeroed; 2], Failure> {
        for axis in &gantry.axes {
            self.core.set_zeroed(axis, false)?;
            self.core.enable(axis)?;
        }
        self.bring_together(gantry)?;
        let [first, second] = &gantry.axes;
        Ok([
            self.side(first)?.zero_from(store, Begins::AtNominal)?,
            self.side(second)?.zero_from(store, Begins::AtNominal)?,
        ])
    }

    /// Both sides to their limit switches, then to their nominal zeros.
    fn bring_together(&mut self, gantry: &GantryConfig) -> Result<(), Failure> {
        let mut home = Vec::new();
        let mut to_nominal = Vec::new();
        let mut limit = Duration::ZERO;
        for axis in &gantry.axes {
            let config = &self.core.config.axis[axis];
            let zero = config.zero.as_ref();
            home.push(to_limit_switch(zero.ok_or_else(|| missing(axis, "zero"))?));
            limit = limit.max(config.reference_limit().unwrap_or_default());
            let settings = self.core.axis_settings(axis)?;
            to_nominal.push(AxisCommand::MoveTo {
                target: Metres::ZERO,
                speed: settings.speed,
                acceleration: settings.acceleration,
            });
        }
        self.together(gantry, "reference", &home, limit)?;
        let move_timeout = self.core.axis_settings(self.axis)?.move_timeout;
        self.together(gantry, "move", &to_nominal, move_timeout)?;
        for axis in &gantry.axes {
            self.core.forget_approach(axis)?;
        }
        Ok(())
    }

    /// Gives each side its command at one moment, and waits until both have done it.
    fn together(
        &mut self,
        gantry: &GantryConfig,
        step: &'static str,
        commands: &[AxisCommand],
        limit: Duration,
    ) -> Result<(), Failure> {
        let starts = gantry
            .axes
            .each_ref()
            .map(|it| homing::place(&self.core, it));
        for (axis, command) in gantry.axes.iter().zip(commands) {
            self.core.begin(axis, *command)?;
        }
        let limit = self.core.patience().of(limit);
        let end = self.core.now() + limit;
        let mut under_way: Vec<_> = gantry.axes.iter().zip(starts).collect();
        while let Some((axis, _)) = under_way.first() {
            if self.core.now() >= end {
                let device = (*axis).clone();
                let waited = limit;
                return Err(Failure::Machine(machine::Failure::Overdue {
                    device,
                    step,
                    waited,
                }));
            }
            self.core.tick(end)?;
            let mut still = Vec::new();
            for (axis, start) in under_way {
                match self.core.outcome(axis)? {
                    None => still.push((axis, start)),
                    Some(Ok(())) => {}
                    Some(Err(failure)) => {
                        let failure = failure.into();
                        return Err(homing::explained(&self.core, axis, start?, failure));
                    }
                }
            }
            under_way = still;
        }
        Ok(())
    }

    /// The handle of one side.
    fn side(&mut self, axis: &str) -> Result<LinearStage<'_>, Failure> {
        let known = self.core.config.axis.get_key_value(axis);
        let (axis, config) = known.ok_or_else(|| missing(axis, "zero"))?;
        let memory = match &mut self.other_side {
            Some(other) if axis != self.axis => &mut **other,
            _ => &mut *self.memory,
        };
        Ok(LinearStage {
            core: Core {
                machine: &mut *self.core.machine,
                config: self.core.config,
                config_hash: self.core.config_hash,
            },
            axis,
            config,
            memory,
            other_side: None,
        })
    }

    fn rotation_entry(&self, gantry: &GantryConfig, sides: &[Zeroed; 2]) -> RotationEntry {
        let [first, second] = &gantry.axes;
        let [own, other] = sides.each_ref().map(|it| &it.estimate);
        let (ahead, behind) = match gantry.ahead_when_positive == *second {
            true => (other, own),
            false => (own, other),
        };
        let base = Base {
            distance: Metres::from_mm(gantry.distance_mm),
            standard_uncertainty: Metres::from_mm(gantry.distance_standard_uncertainty_mm),
            scale: gantry.scale_standard_uncertainty_ppm * 1e-6,
        };
        let turned = rotation(ahead, behind, base);
        // How the stage stands now: what the passes of both sides tell, and that each zero lies on a whole count.
        let exact = Base {
            standard_uncertainty: Metres::ZERO,
            scale: 0.0,
            ..base
        };
        let of_passes = rotation(ahead, behind, exact).standard_uncertainty.value();
        let of_counts = gantry.axes.each_ref().map(|axis| {
            let count = self.core.config.axis[axis].motion.resolution_nm.abs() * 1e-9;
            of_rounding(count) / base.distance.value()
        });
        let zero_u_rad = combine(&[of_passes, of_counts[0], of_counts[1]]);
        let rad = |urad: Option<f64>| urad.map(|it| it * 1e-6);
        RotationEntry {
            axes: [first.clone(), second.clone()],
            zeros: sides.each_ref().map(|it| {
                let name = it.journal.file_name().unwrap_or_default();
                name.to_string_lossy().into_owned()
            }),
            origins_m: sides.each_ref().map(|it| it.estimate.origin.value()),
            ahead_when_positive: gantry.ahead_when_positive.clone(),
            distance_m: base.distance.value(),
            distance_u_m: base.standard_uncertainty.value(),
            scale_u: base.scale,
            angle_rad: turned.angle.value(),
            standard_uncertainty_rad: turned.standard_uncertainty.value(),
            degrees_of_freedom: turned.degrees_of_freedom,
            angle_at_acceptance_rad: rad(gantry.angle_at_acceptance_urad),
            angle_limit_rad: rad(gantry.angle_limit_urad),
            zero_u_rad,
            at_s: self.core.now().seconds(),
        }
    }
}
