//! Data that were measured elsewhere, with an instrument that a configuration describes: what its corrections make
//! of them, and how uncertain a table of them is.

use compensator::budget::{AxisBudget, BudgetError};
use compensator::error_table::uncertainty::{self, Circumstances};
use compensator::error_table::{Fitted, LinearSeries};
use compensator::length_correction::{Environment, LengthCorrection};
use units::{Celsius, Metres, Pascals, RelativeHumidity};

use crate::config::{AxisConfig, InstrumentConfig};
use crate::failure::Failure;
use crate::linear::budget::{USUAL_AIR, left_out};
use crate::linear::settings;

/// An instrument of a configuration, by its name there.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Elsewhere<'a> {
    pub(crate) name: &'a str,
    pub(crate) instrument: &'a InstrumentConfig,
}

impl Elsewhere<'_> {
    /// The readings with the corrections that the instrument's section switches on, each by its own environment
    /// (none of these where the file has no columns of it), and with what the certificate of its scale corrects.
    ///
    /// # Errors
    /// When the environment permits no correction.
    pub(crate) fn corrected(&self, series: &LinearSeries) -> Result<LinearSeries, Failure> {
        let settings = self.instrument.corrections();
        let series = series.corrected(settings).map_err(self.failed())?;
        Ok(series.plus(|it| self.instrument.scale_correction(it)))
    }

    /// What makes the table that was `fitted` to `series` uncertain. The zero of the data is the datum of the
    /// table; what the axis finds as its zero is added where the table is used. Without columns of the environment
    /// the corrections are taken to have been made at 20 °C and 1013.25 hPa.
    ///
    /// # Errors
    /// When there are not two runs, so that nothing is known of the scatter; when the environment permits no
    /// correction.
    pub(crate) fn budget(
        &self,
        name: &str,
        axis: &AxisConfig,
        series: &LinearSeries,
        fitted: &Fitted,
    ) -> Result<AxisBudget, Failure> {
        let all = series.environments();
        let first = all.first().copied().unwrap_or(USUAL_AIR);
        let mean = mean(all).unwrap_or(USUAL_AIR);
        let length = LengthCorrection::new(self.instrument.corrections(), &first);
        let made = length.and_then(|it| it.contributions(&mean));
        let made = made.map_err(self.failed())?.into_iter();
        let made = made.map(|it| self.instrument.named(it));
        let short_period_nm = axis
            .calibrate
            .as_ref()
            .map_or(0.0, |it| it.short_period_standard_uncertainty_nm);
        let known = Circumstances {
            instrument: Metres(self.instrument.instrument_standard_uncertainty_nm * 1e-9),
            closure: fitted.drift.closure.unwrap_or(Metres::ZERO),
            zero: (Metres::ZERO, None),
            short_period: Metres(short_period_nm * 1e-9),
            interpolation: settings::interpolation_of(axis),
            corrections: made
                .chain(self.instrument.scale_contribution())
                .chain(left_out(self.instrument, &first, &mean))
                .collect(),
        };
        uncertainty::budget(fitted, known).map_err(|source: BudgetError| Failure::Budget {
            axis: name.to_owned(),
            source,
        })
    }

    fn failed(
        &self,
    ) -> impl Fn(compensator::length_correction::EnvironmentError) -> Failure + use<> {
        let instrument = self.name.to_owned();
        move |source| Failure::Correction {
            instrument: instrument.clone(),
            source,
        }
    }
}

fn mean(all: &[Environment]) -> Option<Environment> {
    let mean = |of: fn(&Environment) -> f64| all.iter().map(of).sum::<f64>() / all.len() as f64;
    (!all.is_empty()).then(|| Environment {
        air_temperature: Celsius(mean(|it| it.air_temperature.value())),
        pressure: Pascals(mean(|it| it.pressure.value())),
        humidity: RelativeHumidity(mean(|it| it.humidity.value())),
        material_temperature: Celsius(mean(|it| it.material_temperature.value())),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hardware::instrument::comparator;

    /// At 10 mm the scale shows 5 µm more than at 0: there is less than was read.
    #[test]
    fn what_the_certificate_of_a_scale_corrects_is_made_of_readings_from_elsewhere() {
        let csv = "run,approach,target_mm,measured_mm\n1,+,0,0\n1,+,10,10\n";
        let series = LinearSeries::from_csv(csv, "x.csv").unwrap();
        let instrument = comparator(false);
        let elsewhere = Elsewhere {
            name: "laser",
            instrument: &instrument,
        };
        let corrected = elsewhere.corrected(&series).unwrap();
        let read: Vec<f64> = corrected
            .measurements()
            .iter()
            .map(|it| it.measured.um())
            .collect();
        assert!(
            read[0].abs() < 1e-9 && (read[1] - 9995.0).abs() < 1e-6,
            "{read:?}"
        );
    }
}
