//! The uncertainty of a calibration and of the places that it corrects.

use compensator::budget::{AxisBudget, Combined, Contribution, Correlation, Evaluation};
use compensator::error_table::Fitted;
use compensator::error_table::uncertainty::{self, Circumstances};
use compensator::length_correction::{Corrected, Environment, LengthCorrection};
use units::{Approach, Celsius, Metres, Pascals, RelativeHumidity};

use crate::config::InstrumentConfig;
use crate::failure::Failure;
use crate::linear::measure::Measured;
use crate::linear::run_plan::RunPlan;
use crate::linear::settings;
use crate::linear::stage::LinearStage;
use crate::store::EnvironmentRecord;

/// Where no sensor is read, air is taken to be like this.
pub(crate) const USUAL_AIR: Environment = Environment {
    air_temperature: Celsius(20.0),
    pressure: Pascals(101_325.0),
    humidity: RelativeHumidity(0.5),
    material_temperature: Celsius(20.0),
};
/// A share is that of one metre.
const METRE: Metres = Metres(1.0);

impl LinearStage<'_> {
    /// What makes the table that was `fitted` to what was `measured` uncertain.
    pub(super) fn budget_of(
        &self,
        plan: &RunPlan,
        measured: &Measured,
        fitted: &Fitted,
    ) -> Result<AxisBudget, Failure> {
        let instrument = &self.core.config.instrument[&plan.instrument];
        let short_period_nm = self
            .config
            .calibrate
            .as_ref()
            .map_or(0.0, |it| it.short_period_standard_uncertainty_nm);
        let known = Circumstances {
            instrument: Metres(instrument.instrument_standard_uncertainty_nm * 1e-9),
            closure: measured.closure.unwrap_or(Metres::ZERO),
            zero: (self.memory.course.zero.unwrap_or(Metres::ZERO), None),
            short_period: Metres(short_period_nm * 1e-9),
            interpolation: settings::interpolation_of(self.config),
            corrections: self.corrections(plan, instrument, measured)?,
        };
        uncertainty::budget(fitted, known).map_err(|source| Failure::Budget {
            axis: self.axis.to_owned(),
            source,
        })
    }

    /// What the corrections that are made leave uncertain, and what those that are switched off leave
    /// uncorrected.
    fn corrections(
        &self,
        plan: &RunPlan,
        instrument: &InstrumentConfig,
        measured: &Measured,
    ) -> Result<Vec<Contribution>, Failure> {
        let (_, datum) = self
            .memory
            .datum
            .as_ref()
            .expect("it was measured from one");
        let mean = environment(&measured.environment);
        let made = datum.length.contributions(&mean);
        let made = made.map_err(|source| Failure::Correction {
            instrument: plan.instrument.clone(),
            source,
        })?;
        let first = measured.points.first().map(|it| it.environment);
        let first = first.map_or(mean, |it| environment(&it));
        let made = made.into_iter().map(|it| instrument.named(it));
        let made = made.chain(instrument.scale_contribution());
        Ok(made.chain(left_out(instrument, &first, &mean)).collect())
    }

    /// How uncertain it is where the point stands after a corrected stop at `position`; `None` where
    /// the calibration in use says nothing of it: beyond its range, or when it has no budget.
    ///
    /// That is the calibration's budget, with the zero that the axis has now, the scatter of one stop and,
    /// where the axis does not arrive as it did in the calibration, what lost motion may do then.
    pub fn uncertainty_at(&self, position: Metres, approach: Approach) -> Option<Combined> {
        let course = &self.memory.course;
        course.uncertainty_after(self.approach_length(), position, approach)
    }
}

fn environment(it: &EnvironmentRecord) -> Environment {
    let known = |value: Option<f64>| value.unwrap_or(f64::NAN);
    Environment {
        air_temperature: Celsius(known(it.air_temperature_c)),
        pressure: Pascals(known(it.pressure_pa)),
        humidity: RelativeHumidity(known(it.relative_humidity)),
        material_temperature: Celsius(known(it.material_temperature_c)),
    }
}

/// What the corrections would have changed that are switched off: an effect that is known and not corrected
/// counts as a whole (GUM F.2.4.5).
pub(crate) fn left_out(
    instrument: &InstrumentConfig,
    first: &Environment,
    mean: &Environment,
) -> Vec<Contribution> {
    let (made, every) = (instrument.corrections(), instrument.every_correction());
    let would = |first: &Environment, mean: &Environment| -> Option<Corrected> {
        let all = LengthCorrection::new(every, first).ok()?;
        all.correct(METRE, mean).ok()
    };
    // Sensors that no correction uses need not be there.
    let Some(would) = would(first, mean).or_else(|| would(&USUAL_AIR, &USUAL_AIR)) else {
        return Vec::new();
    };
    let terms = would.terms;
    let is_off = |name, is_made: bool, term: Option<Metres>, correlation| {
        let term = term.filter(|_| !is_made)?;
        Some(uncorrected(name, term, correlation))
    };
    let angle = made.cosine.is_none().then_some(every.cosine).flatten();
    let lines = [
        is_off("air", made.air, terms.air, Correlation::CommonScale),
        is_off(
            "dead path",
            made.dead_path.is_some(),
            terms.dead_path,
            Correlation::CommonOffset,
        ),
        is_off(
            "expansion",
            made.material_expansion.is_some(),
            terms.material,
            Correlation::CommonScale,
        ),
        angle.map(|it| {
            let (angle, u) = (it.angle.value(), it.u_angle.value());
            // θ²/2 of an angle that is normal about `angle`: its root mean square.
            let fourth =
                angle * angle * angle * angle + 6.0 * angle * angle * u * u + 3.0 * u * u * u * u;
            uncorrected(
                "angle of the beam",
                Metres(0.5 * fourth.sqrt()),
                Correlation::CommonScale,
            )
        }),
    ];
    lines.into_iter().flatten().collect()
}

fn uncorrected(name: &str, per_metre: Metres, correlation: Correlation) -> Contribution {
    let name = format!("{name}, not corrected");
    let unit = match correlation {
        Correlation::CommonScale => "m/m",
        _ => "m",
    };
    let left_out = (per_metre.abs().value(), unit);
    Contribution::new(&name, Evaluation::B, left_out, correlation)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Edit;
    use crate::config::parse;

    const LINEAR: &str = include_str!("../../../configs/machines/linear.toml");

    /// What is left out at 60 mm with the shipped stage's air and 26 °C, nanometres.
    fn left_out_nm(text: &str) -> Vec<(String, f64)> {
        let config = parse(text, "m").unwrap().config;
        let hall = Environment {
            material_temperature: Celsius(26.0),
            ..USUAL_AIR
        };
        let lines = left_out(&config.instrument["laser"], &hall, &hall);
        let share = |it: Contribution| {
            let nm = it.share(Metres::from_mm(60.0)).nm();
            (it.name, nm)
        };
        lines.into_iter().map(share).collect()
    }

    #[track_caller]
    fn check(text: &str, name: &str, expected_nm: f64) {
        let seen = left_out_nm(text);
        let own = seen
            .iter()
            .find(|it| it.0 == format!("{name}, not corrected"));
        let nm = own.unwrap_or_else(|| panic!("{seen:?}")).1;
        assert!((nm - expected_nm).abs() < 0.02 * expected_nm, "{nm}");
    }

    #[test]
    fn a_correction_that_is_switched_off_counts_as_a_whole() {
        // √3/2 · (0.2 mrad)² · 60 mm.
        check(LINEAR, "angle of the beam", 2.08);
        assert_eq!(left_out_nm(LINEAR).len(), 1);
        // 6 K · 11.5e-6/K · 60 mm; (n − 1) · 60 mm; θ²/2 · 60 mm.
        let off = |key: &str| LINEAR.edit(&format!("{key} = true"), &format!("{key} = false"));
        check(&off("correct_material"), "expansion", 4140.0);
        check(&off("correct_air"), "air", 16_278.0);
        let leaning = LINEAR.edit("misalignment_mrad = 0.0", "misalignment_mrad = 5.0");
        check(&leaning, "angle of the beam", 750.0);
    }
}
