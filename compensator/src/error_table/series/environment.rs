//! The environment of each reading, in columns beside it, and what it does to the readings.

use units::{Celsius, Pascals, RelativeHumidity};

use super::{LinearFault, LinearSeries, Measurement};
use crate::data::{DataError, Format, Table};
use crate::length_correction::{
    Environment, EnvironmentError, LengthCorrection, Settings, check_environment,
};

/// Behind the columns of a series; all of them or none.
const COLUMNS: [&str; 4] = [
    "air_temperature_c",
    "pressure_hpa",
    "humidity_percent",
    "material_temperature_c",
];

pub(super) const FORMAT: Format = Format {
    columns: &[
        "run",
        "approach",
        "target_mm",
        "measured_mm",
        COLUMNS[0],
        COLUMNS[1],
        COLUMNS[2],
        COLUMNS[3],
    ],
    header: "run,approach,target_mm,measured_mm,air_temperature_c,pressure_hpa,humidity_percent,\
             material_temperature_c",
};

/// Whether the header of a file names any of these columns.
pub(super) fn is_named(text: &str) -> bool {
    let mut lines = text.lines().map(str::trim);
    let header = lines.find(|it| !it.is_empty() && !it.starts_with('#'));
    header.is_some_and(|it| COLUMNS.iter().any(|name| it.contains(name)))
}

/// The environment of a row.
pub(super) fn read(
    table: &Table<LinearFault>,
    row: usize,
) -> Result<Environment, DataError<LinearFault>> {
    let environment = Environment {
        air_temperature: Celsius(table.number(row, 4)?),
        pressure: Pascals(table.number(row, 5)? * 100.0),
        humidity: RelativeHumidity(table.number(row, 6)? / 100.0),
        material_temperature: Celsius(table.number(row, 7)?),
    };
    match check_environment(&environment) {
        Ok(()) => Ok(environment),
        Err(source) => Err(table.fail(row, 4, LinearFault::Environment(source).into())),
    }
}

impl LinearSeries {
    /// The environment of each measurement, in their order; empty where the file has no columns of it.
    pub fn environments(&self) -> &[Environment] {
        &self.environments
    }

    /// The series with each measured position corrected by its own environment, as a displacement from the zero of
    /// the positions, whose environment is that of the first measurement. Positions are those of an instrument
    /// that multiplies by its wavelength in vacuum. As it is where there is no environment.
    ///
    /// # Errors
    /// When the settings or the environment permit no correction.
    ///
    /// # Example
    ///
    /// ```
    /// use compensator::error_table::LinearSeries;
    /// use compensator::length_correction::{EnvironmentUncertainty, MaterialExpansion, Settings};
    /// use units::Metres;
    ///
    /// let csv = "run,approach,target_mm,measured_mm,air_temperature_c,pressure_hpa,humidity_percent,\
    ///            material_temperature_c\n1,+,0,0,20,1013.25,50,20\n1,+,100,100.0242,20,1013.25,50,22\n";
    /// let series = LinearSeries::from_csv(csv, "x.csv")?;
    /// let steel = MaterialExpansion { per_kelvin: 11.5e-6, u_per_kelvin: 0.0 };
    /// let settings = Settings {
    ///     air: true,
    ///     vacuum_wavelength: Metres(633e-9),
    ///     u_relative_wavelength: 0.0,
    ///     co2_umol_per_mol: 450.0,
    ///     material_expansion: Some(steel),
    ///     dead_path: None,
    ///     cosine: None,
    ///     u_environment: EnvironmentUncertainty::default(),
    /// };
    /// let corrected = series.corrected(settings)?;
    /// let off = corrected.measurements()[1].deviation();
    /// assert!((off.um() - (24.2 - 2.3 - 27.1)).abs() < 0.1, "steel of 22 °C, air: {} µm", off.um());
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn corrected(&self, settings: Settings) -> Result<Self, EnvironmentError> {
        let Some(first) = self.environments.first() else {
            return Ok(self.clone());
        };
        let correction = LengthCorrection::new(settings, first)?;
        let each = self.measurements.iter().zip(&self.environments);
        let measurements = each.map(|(it, environment)| {
            let measured = correction.correct(it.measured, environment)?.displacement;
            Ok(Measurement { measured, ..*it })
        });
        Ok(Self {
            measurements: measurements.collect::<Result<_, EnvironmentError>>()?,
            environments: self.environments.clone(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::length_correction::EnvironmentUncertainty;
    use units::Metres;

    /// A helium-neon laser in air.
    const LASER: Settings = Settings {
        air: true,
        vacuum_wavelength: Metres(633e-9),
        u_relative_wavelength: 0.0,
        co2_umol_per_mol: 450.0,
        material_expansion: None,
        dead_path: None,
        cosine: None,
        u_environment: EnvironmentUncertainty {
            air_temperature: Celsius(0.0),
            pressure: Pascals(0.0),
            humidity: RelativeHumidity(0.0),
            material_temperature: Celsius(0.0),
            co2_umol_per_mol: 0.0,
        },
    };

    fn file(rows: &str) -> String {
        format!("# by hand\n{}\n{rows}", FORMAT.header)
    }

    fn read(rows: &str) -> Result<LinearSeries, DataError<LinearFault>> {
        LinearSeries::from_csv(&file(rows), "e.csv")
    }

    #[test]
    fn columns_are_read_with_their_units_and_none_of_them_is_needed() {
        let series = read("1,+,0,0,20,1013.25,50,21\n1,+,10,10.001,-12.5,990,40,-11\n").unwrap();
        let last = series.environments()[1];
        assert_eq!(last.air_temperature, Celsius(-12.5));
        assert_eq!(last.pressure, Pascals(99_000.0));
        assert_eq!(last.humidity, RelativeHumidity(0.4));
        assert_eq!(last.material_temperature, Celsius(-11.0));
        let without = LinearSeries::from_csv(&series.to_csv(), "e.csv").unwrap();
        assert!(without.environments().is_empty());
        assert_eq!(without.measurements(), series.measurements());
        assert_eq!(without.corrected(LASER).unwrap(), without);
    }

    #[test]
    fn what_no_place_can_have_and_columns_that_are_missing_are_named_with_their_line() {
        let refused = read("1,+,0,0,20,1013.25,50,21\n1,+,10,10.001,20,101325,50,21\n");
        let text = refused.unwrap_err().to_string();
        assert!(
            text.contains("e.csv:4:") && text.contains("air pressure"),
            "{text}"
        );
        let cold = read("1,+,0,0,-41,1013.25,50,21\n").unwrap_err().to_string();
        assert!(
            cold.contains("e.csv:3:") && cold.contains("outside -40 to 40"),
            "{cold}"
        );
        let few = "run,approach,target_mm,measured_mm,air_temperature_c\n1,+,0,0,20\n";
        let text = LinearSeries::from_csv(few, "e.csv")
            .unwrap_err()
            .to_string();
        assert!(text.contains("pressure_hpa"), "{text}");
    }

    /// 1 K of air is 0.95 ppm, 10 hPa are 2.7 ppm: by its own environment each.
    #[test]
    fn each_reading_is_corrected_by_its_own_environment() {
        let rows = "1,+,0,0,20,1013.25,50,20\n1,+,1000,1000.271373,20,1013.25,50,20\n\
                    2,+,0,0,20,1013.25,50,20\n2,+,1000,1000.271373,21,1013.25,50,20\n\
                    3,+,0,0,20,1013.25,50,20\n3,+,1000,1000.271373,20,1003.25,50,20\n";
        let corrected = read(rows).unwrap().corrected(LASER).unwrap();
        let target = Metres(1.0);
        let off = corrected.deviations(target, units::Approach::Forward);
        let um: Vec<f64> = off.map(|it| it.1.um()).collect();
        for (seen, expected) in um.iter().zip([0.0, 0.95, 2.68]) {
            assert!((seen - expected).abs() < 0.04, "{um:?}");
        }
    }
}
