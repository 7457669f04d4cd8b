//! The datum: where the instrument reads zero, and what it reads against it.

use core::time::Duration;

use compensator::length_correction::LengthCorrection;
use drivers::device::{DisplacementReading, Environment};
use units::Metres;

use crate::assemble;
use crate::correction::Correction;
use crate::failure::Failure;
use crate::linear::cross_check::{DatumReadings, is_shaken};
use crate::linear::datum_in_use::Datum;
use crate::linear::run_plan::RunPlan;
use crate::linear::stage::LinearStage;

/// What is shaken at the datum would shift everything: it is read again, so often at most …
const ATTEMPTS: u32 = 10;
/// … and so long after.
const CALM: Duration = Duration::from_millis(200);

impl LinearStage<'_> {
    /// What the instrument of the last measurement reads at the axis's zero, approached
    /// forward, against its datum: by how much the zero has moved since.
    ///
    /// # Errors
    /// Whatever stops the machine; [`Failure::Usage`] when nothing was measured before.
    pub fn displacement_at_zero(&mut self) -> Result<Metres, Failure> {
        let axis = self.axis;
        let (plan, datum) = self.memory.datum.clone().ok_or_else(|| Failure::Usage {
            what: format!("axis {axis} has no datum"),
            help: "calibrate or verify first".into(),
        })?;
        self.core.use_instrument(&plan.instrument)?;
        self.go_to_datum(&plan)?;
        let reading = self.read_displacement(&plan)?;
        let environment = self.core.environment_of(&plan.instrument)?;
        self.core.leave_instrument();
        self.correct(&plan, &reading, &environment, &datum)
    }

    /// Goes to the far end of a run. The later runs begin there, too: what a stage remembers of its
    /// last moves (lost motion taken up, a servo that is slow to settle) is the same in all.
    pub(super) fn exercise(&mut self, plan: &RunPlan) -> Result<(), Failure> {
        let last = plan.targets[plan.targets.len() - 1];
        self.travel(last + plan.overrun, Correction::Off)?;
        Ok(())
    }

    /// Goes to the axis's zero, forward, and makes the instrument read zero there. What it reads there is
    /// read in reverse first, then forward: nothing counts from a reading that is older than another one of
    /// the datum's place, so that a count that slips between them shifts nothing.
    pub(super) fn set_datum(&mut self, plan: &RunPlan) -> Result<(Datum, DatumReadings), Failure> {
        self.go_to_datum(plan)?;
        self.core.stand_still(self.axis, plan.settle)?;
        self.core.set_instrument_datum(&plan.instrument)?;
        let reverse = if self.go_to_datum_in_reverse(plan)? {
            let reading = self.read_calm(plan)?;
            self.go_to_datum(plan)?;
            Some((reading, self.core.environment_of(&plan.instrument)?))
        } else {
            None
        };
        let offset = self.read_calm(plan)?.vacuum;
        let length = self.length_correction(plan)?;
        let datum = Datum { length, offset };
        let reverse = reverse.map(|(reading, environment)| {
            let corrected = self.correct(plan, &reading, &environment, &datum)?;
            Ok::<f64, Failure>(corrected.value())
        });
        let readings = DatumReadings {
            reverse_m: reverse.transpose()?,
            ..DatumReadings::forward(0.0)
        };
        Ok((datum, readings))
    }

    fn length_correction(&mut self, plan: &RunPlan) -> Result<LengthCorrection, Failure> {
        self.core
            .tell_beyond_certified(&plan.instrument, &plan.targets)?;
        let environment = self.core.environment_of(&plan.instrument)?;
        let config = &self.core.config.instrument[&plan.instrument];
        let environment = assemble::correction_environment(&environment);
        LengthCorrection::new(config.corrections(), &environment).map_err(|source| {
            Failure::Correction {
                instrument: plan.instrument.clone(),
                source,
            }
        })
    }

    pub(super) fn go_to_datum(&mut self, plan: &RunPlan) -> Result<(), Failure> {
        self.travel(Metres::ZERO - plan.overrun, Correction::Off)?;
        self.arrive(Metres::ZERO, Correction::Off)?;
        Ok(())
    }

    /// Goes to the datum's place in reverse, where a run has come from there; whether it has.
    pub(super) fn go_to_datum_in_reverse(&mut self, plan: &RunPlan) -> Result<bool, Failure> {
        let is_passed = plan.targets[plan.targets.len() - 1] >= Metres::ZERO;
        if is_passed {
            self.travel(plan.overrun, Correction::Off)?;
            self.arrive(Metres::ZERO, Correction::Off)?;
        }
        Ok(is_passed)
    }

    /// A reading of an axis that is not shaken, or the last one of many that are.
    pub(super) fn read_calm(&mut self, plan: &RunPlan) -> Result<DisplacementReading, Failure> {
        let mut reading = self.read_displacement(plan)?;
        for _ in 1..ATTEMPTS {
            if !is_shaken(reading.standard_deviation) {
                break;
            }
            self.core.stand_still(self.axis, CALM)?;
            reading = self.read_displacement(plan)?;
        }
        Ok(reading)
    }

    /// Lets the stage stand, then averages.
    pub(crate) fn read_displacement(
        &mut self,
        plan: &RunPlan,
    ) -> Result<DisplacementReading, Failure> {
        self.core.stand_still(self.axis, plan.settle)?;
        let rate_hz = self.core.config.instrument[&plan.instrument].readings_per_s();
        Ok(self
            .core
            .average(&plan.instrument, plan.average_samples, rate_hz)?)
    }

    /// A reading as a displacement from the datum.
    pub(super) fn correct(
        &self,
        plan: &RunPlan,
        reading: &DisplacementReading,
        environment: &Environment,
        datum: &Datum,
    ) -> Result<Metres, Failure> {
        let failed = |source| Failure::Correction {
            instrument: plan.instrument.clone(),
            source,
        };
        let environment = assemble::correction_environment(environment);
        let corrected = datum
            .length
            .correct(reading.vacuum - datum.offset, &environment)
            .map_err(failed)?;
        let instrument = &self.core.config.instrument[&plan.instrument];
        let displacement = corrected.displacement;
        Ok(displacement + instrument.scale_correction(displacement))
    }
}
