//! Digital Calibration Certificates as laboratories write them, for tests: of several versions of the schema, with
//! their figures beside them. Nothing here is shared with what reads or writes certificates in the program.

use std::path::{Path, PathBuf};
use std::time::SystemTime;

use crate::random::random;

/// The day so many days after today, as XML writes it (UTC).
///
/// Source: H. Hinnant, "chrono-compatible low-level date algorithms", `civil_from_days`.
///
/// # Panics
/// When the computer's clock stands before 1970.
pub fn day_from_now(days: i64) -> String {
    let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
    let today = now.expect("the clock is set").as_secs() as i64 / 86_400;
    let z = today + days + 719_468;
    let era = z.div_euclid(146_097);
    let day_of_era = z.rem_euclid(146_097);
    let year_of_era =
        (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let shifted = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * shifted + 2) / 5 + 1;
    let month = if shifted < 10 {
        shifted + 3
    } else {
        shifted - 9
    };
    let year = year_of_era + era * 400 + i64::from(month <= 2);
    format!("{year:04}-{month:02}-{day:02}")
}

/// How an uncertainty is stated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stated {
    /// A standard uncertainty.
    Standard,
    /// U, k and p.
    Expanded,
    /// The same as D-SI 2.1 and earlier have it.
    ExpandedBefore,
    /// An interval, with the standard uncertainty.
    Interval,
    /// Not at all.
    Not,
}

/// Its coverage factor.
const K: f64 = 2.0;

/// A column of a result.
#[derive(Clone, Debug)]
pub struct Column {
    /// The `refType`.
    pub role: &'static str,
    /// In D-SI.
    pub unit: &'static str,
    /// In that unit.
    pub values: Vec<f64>,
    /// Standard uncertainties in that unit; none where none are stated.
    pub u: Vec<f64>,
    /// How these are stated.
    pub stated: Stated,
}

impl Column {
    /// Without uncertainties.
    pub fn new(role: &'static str, unit: &'static str, values: &[f64]) -> Self {
        Self {
            role,
            unit,
            values: values.to_vec(),
            u: Vec::new(),
            stated: Stated::Not,
        }
    }

    /// With these standard uncertainties.
    pub fn with_u(self, u: &[f64], stated: Stated) -> Self {
        let u = u.to_vec();
        Self { u, stated, ..self }
    }

    /// All values in one list.
    fn list(&self) -> String {
        let u = self.uncertainty("XMLList", &self.u, self.values.len());
        self.quantity(&format!(
            "<si:realListXMLList><si:valueXMLList>{}</si:valueXMLList><si:unitXMLList>{}</si:unitXMLList>{u}\
             </si:realListXMLList>",
            joined(&self.values),
            self.unit
        ))
    }

    /// One value by itself.
    fn single(&self, at: usize) -> String {
        let u: Vec<f64> = self.u.get(at).copied().into_iter().collect();
        let u = self.uncertainty("", &u, 1);
        self.quantity(&format!(
            "<si:real><si:value>{}</si:value><si:unit>{}</si:unit>{u}</si:real>",
            self.values[at], self.unit
        ))
    }

    fn quantity(&self, inner: &str) -> String {
        let role = match self.role {
            "" => String::new(),
            role => format!(" refType=\"{role}\""),
        };
        let name = name("a column");
        format!("<dcc:quantity{role}>{name}{inner}</dcc:quantity>\n")
    }

    /// Of `count` values with the standard uncertainties `u`; `x` ends the names of lists.
    fn uncertainty(&self, x: &str, u: &[f64], count: usize) -> String {
        let standard = joined(u);
        let expanded = joined(&u.iter().map(|it| it * K).collect::<Vec<_>>());
        let many = |it: &str| vec![it; count].join(" ");
        let (k, p) = (many("2"), many("0.95"));
        match self.stated {
            Stated::Not => String::new(),
            Stated::Standard => format!(
                "<si:measurementUncertaintyUnivariate{x}><si:standardMU{x}><si:valueStandardMU{x}>{standard}\
                 </si:valueStandardMU{x}></si:standardMU{x}></si:measurementUncertaintyUnivariate{x}>"
            ),
            Stated::Expanded => format!(
                "<si:measurementUncertaintyUnivariate{x}><si:expandedMU{x}><si:valueExpandedMU{x}>{expanded}\
                 </si:valueExpandedMU{x}><si:coverageFactor{x}>{k}</si:coverageFactor{x}><si:coverageProbability{x}>{p}\
                 </si:coverageProbability{x}></si:expandedMU{x}></si:measurementUncertaintyUnivariate{x}>"
            ),
            Stated::ExpandedBefore => format!(
                "<si:expandedUnc{x}><si:uncertainty{x}>{expanded}</si:uncertainty{x}><si:coverageFactor{x}>{k}\
                 </si:coverageFactor{x}><si:coverageProbability{x}>{p}</si:coverageProbability{x}></si:expandedUnc{x}>"
            ),
            Stated::Interval => {
                let (low, high) = (many("0"), many("1"));
                format!(
                    "<si:coverageInterval{x}><si:standardUnc{x}>{standard}</si:standardUnc{x}><si:intervalMin{x}>{low}\
                     </si:intervalMin{x}><si:intervalMax{x}>{high}</si:intervalMax{x}><si:coverageProbability{x}>{p}\
                     </si:coverageProbability{x}></si:coverageInterval{x}>"
                )
            }
        }
    }
}

fn joined(values: &[f64]) -> String {
    let each: Vec<String> = values.iter().map(f64::to_string).collect();
    each.join(" ")
}

fn name(text: &str) -> String {
    format!("<dcc:name><dcc:content lang=\"en\">{text}</dcc:content></dcc:name>")
}

/// A certificate.
#[derive(Clone, Debug)]
pub struct Certificate {
    /// Of the schema.
    pub version: &'static str,
    /// What the laboratory calls it.
    pub identifier: String,
    /// Of what is certified.
    pub serial_number: String,
    /// The first and the last day.
    pub days: (String, String),
    /// How long it says that it holds (xs:duration).
    pub period: Option<String>,
    /// Its results: names and columns.
    pub results: Vec<(&'static str, Vec<Column>)>,
    /// Whether each value stands by itself, row by row.
    pub in_rows: bool,
}

impl Certificate {
    /// Of `serial_number`, calibrated some weeks ago, for two years.
    pub fn new(serial_number: &str, results: Vec<(&'static str, Vec<Column>)>) -> Self {
        Self {
            version: "3.3.0",
            identifier: format!("K-{serial_number}"),
            serial_number: serial_number.to_owned(),
            days: (day_from_now(-40), day_from_now(-39)),
            period: Some("P2Y".into()),
            results,
            in_rows: false,
        }
    }

    /// Of a laser with this wavelength in vacuum and its standard uncertainty, in nanometres.
    pub fn of_laser(serial_number: &str, nm: f64, u_nm: f64) -> Self {
        let column = Column::new("basic_measuredValue", "\\nano\\metre", &[nm]);
        let columns = vec![column.with_u(&[u_nm], Stated::Expanded)];
        Self::new(serial_number, vec![("vacuum wavelength", columns)])
    }

    /// Of a sensor that reads `errors` too much at these readings, each in `unit`.
    pub fn of_sensor(
        serial_number: &str,
        unit: &'static str,
        (readings, errors): (&[f64], &[f64]),
        u: f64,
    ) -> Self {
        let measured = Column::new("basic_measuredValue", unit, readings);
        let error = Column::new("basic_measurementError", unit, errors);
        let error = error.with_u(&vec![u; errors.len()], Stated::Expanded);
        Self::new(serial_number, vec![("calibration", vec![measured, error])])
    }

    /// The XML.
    pub fn text(&self) -> String {
        let contact = format!(
            "{}<dcc:eMail>laboratory@example.org</dcc:eMail><dcc:location><dcc:countryCode>DE</dcc:countryCode></dcc:location>",
            name("Laboratory of the test")
        );
        let results: String = self.results.iter().map(|it| self.result(it)).collect();
        format!(
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<!-- a comment -->\n\
             <dcc:digitalCalibrationCertificate xmlns:dcc=\"https://ptb.de/dcc\" xmlns:si=\"https://ptb.de/si\" \
             schemaVersion=\"{}\">\n<dcc:administrativeData>\n<dcc:dccSoftware><dcc:software>{}<dcc:release>1</dcc:release>\
             </dcc:software></dcc:dccSoftware>\n{}{}<dcc:calibrationLaboratory><dcc:contact>{contact}</dcc:contact>\
             </dcc:calibrationLaboratory>\n<dcc:respPersons><dcc:respPerson><dcc:person>{}</dcc:person></dcc:respPerson>\
             </dcc:respPersons>\n<dcc:customer>{contact}</dcc:customer>\n{}</dcc:administrativeData>\n\
             <dcc:measurementResults>\n<dcc:measurementResult>{}<dcc:results>\n{results}</dcc:results>\
             </dcc:measurementResult>\n</dcc:measurementResults>\n</dcc:digitalCalibrationCertificate>\n",
            self.version,
            name("a program"),
            self.core(),
            self.item(),
            name("A person"),
            self.statement(),
            name("Calibration"),
        )
    }

    fn core(&self) -> String {
        let (begin, end) = &self.days;
        format!(
            "<dcc:coreData><dcc:countryCodeISO3166_1>DE</dcc:countryCodeISO3166_1>\
             <dcc:usedLangCodeISO639_1>en</dcc:usedLangCodeISO639_1>\
             <dcc:mandatoryLangCodeISO639_1>en</dcc:mandatoryLangCodeISO639_1>\
             <dcc:uniqueIdentifier>{}</dcc:uniqueIdentifier><dcc:beginPerformanceDate>{begin}</dcc:beginPerformanceDate>\
             <dcc:endPerformanceDate>{end}</dcc:endPerformanceDate>\
             <dcc:performanceLocation>laboratory</dcc:performanceLocation></dcc:coreData>\n",
            self.identifier
        )
    }

    fn item(&self) -> String {
        format!(
            "<dcc:items><dcc:item>{}<dcc:manufacturer>{}</dcc:manufacturer><dcc:identifications><dcc:identification>\
             <dcc:issuer>manufacturer</dcc:issuer>\
             <dcc:value>{}</dcc:value></dcc:identification></dcc:identifications></dcc:item></dcc:items>\n",
            name("what was calibrated"),
            name("who made it"),
            self.serial_number
        )
    }

    fn statement(&self) -> String {
        let Some(period) = &self.period else {
            return String::new();
        };
        format!(
            "<dcc:statements><dcc:statement><dcc:valid>true</dcc:valid><dcc:period>{period}</dcc:period></dcc:statement>\
             </dcc:statements>\n"
        )
    }

    fn result(&self, (title, columns): &(&'static str, Vec<Column>)) -> String {
        let columns: String = match self.in_rows {
            false => columns.iter().map(Column::list).collect(),
            true => (0..columns[0].values.len())
                .map(|at| {
                    let row: String = columns.iter().map(|it| it.single(at)).collect();
                    format!("<dcc:list>{row}</dcc:list>\n")
                })
                .collect(),
        };
        format!(
            "<dcc:result>{}<dcc:data><dcc:list>\n{columns}</dcc:list></dcc:data></dcc:result>\n",
            name(title)
        )
    }

    /// Writes it into `folder`, named after what it is of.
    ///
    /// # Panics
    /// When there is no room.
    pub fn written(&self, folder: &Path) -> PathBuf {
        let path = folder.join(format!("{}.xml", self.serial_number));
        std::fs::write(&path, self.text()).expect("there is room");
        path
    }
}

/// A drawn certificate of the sensor `of` (a key of a laser's `certificate`), with what a reader must find: readings,
/// corrections and standard uncertainties in SI units, temperatures in degrees Celsius.
pub struct Drawn {
    /// The certificate.
    pub certificate: Certificate,
    /// Of what of the laser.
    pub of: &'static str,
    /// What it says; of a laser its wavelength, with a correction of 0.
    pub points: Vec<[f64; 3]>,
}

/// What sensors there are: key, unit, its size in SI units, its zero, lowest and highest reading, and a large error.
type Sensor = (&'static str, &'static str, f64, f64, f64, f64, f64);

const SENSORS: [Sensor; 5] = [
    (
        "air_temperature",
        "\\degreecelsius",
        1.0,
        0.0,
        15.0,
        30.0,
        0.3,
    ),
    (
        "material_temperature",
        "\\kelvin",
        1.0,
        273.15,
        288.0,
        303.0,
        0.3,
    ),
    (
        "pressure",
        "\\hecto\\pascal",
        100.0,
        0.0,
        940.0,
        1060.0,
        1.0,
    ),
    ("humidity", "\\percent", 0.01, 0.0, 20.0, 80.0, 3.0),
    ("pressure", "\\kilo\\pascal", 1e3, 0.0, 94.0, 106.0, 0.1),
];

/// The certificate of this number.
pub fn drawn(seed: u64) -> Drawn {
    let mut state = seed ^ 0x0063_6572_7469;
    let serial = format!("SN-{seed}");
    // A laser, then each sensor, and again.
    let mut drawn = match seed % 6 {
        0 => drawn_laser(&mut state, &serial, seed),
        at => drawn_sensor(&mut state, &serial, &SENSORS[at as usize - 1], seed),
    };
    let version = ["3.3.0", "3.2.1", "3.1.2"][(seed % 3) as usize];
    drawn.certificate.version = version;
    drawn
}

/// D-SI 2.1 and earlier have fewer ways.
fn way(seed: u64) -> Stated {
    let is_newest = seed.is_multiple_of(3);
    match (is_newest, (seed / 3) % 3) {
        (true, 0) => Stated::Standard,
        (true, 1) => Stated::Expanded,
        (true, _) | (false, 0 | 1) => Stated::ExpandedBefore,
        (false, _) => Stated::Interval,
    }
}

fn drawn_laser(state: &mut u64, serial: &str, seed: u64) -> Drawn {
    let nm = 632.991_212 * (1.0 + 3e-6 * (random(state) - 0.5));
    let u_nm = nm * 1e-9 * (1.0 + 20.0 * random(state));
    let is_frequency = seed.is_multiple_of(12);
    let thz = 299_792.458 / nm;
    let column = match is_frequency {
        false => {
            Column::new("basic_measuredValue", "\\nano\\metre", &[nm]).with_u(&[u_nm], way(seed))
        }
        true => Column::new("", "\\tera\\hertz", &[thz]).with_u(&[u_nm / nm * thz], way(seed)),
    };
    // Something else that a laboratory states beside it.
    let power = Column::new("basic_measuredValue", "\\milli\\watt", &[0.8]);
    let beam = Column::new("basic_measuredValue", "\\milli\\metre", &[6.0]);
    let results = vec![
        ("wavelength", vec![column]),
        ("power", vec![power]),
        ("diameter of the beam", vec![beam]),
    ];
    Drawn {
        certificate: Certificate::new(serial, results),
        of: "wavelength",
        points: vec![[nm * 1e-9, 0.0, u_nm * 1e-9]],
    }
}

fn drawn_sensor(state: &mut u64, serial: &str, sensor: &Sensor, seed: u64) -> Drawn {
    let (of, unit, one, zero, low, high, large) = *sensor;
    let count = 2 + (5.0 * random(state)) as usize;
    let reference: Vec<f64> = (0..count)
        .map(|at| low + (high - low) * at as f64 / (count - 1) as f64 + 0.1 * random(state))
        .collect();
    let errors: Vec<f64> = (0..count)
        .map(|_| large * (2.0 * random(state) - 1.0))
        .collect();
    let u: Vec<f64> = (0..count)
        .map(|_| large * (0.05 + 0.1 * random(state)))
        .collect();
    let measured: Vec<f64> = reference
        .iter()
        .zip(&errors)
        .map(|(it, error)| it + error)
        .collect();
    let corrections: Vec<f64> = errors.iter().map(|it| -it).collect();
    let column = |role, values: &[f64]| Column::new(role, unit, values);
    let stated = way(seed);
    let columns = match (seed / 6) % 4 {
        0 => vec![
            column("basic_measuredValue", &measured),
            column("basic_measurementError", &errors).with_u(&u, stated),
        ],
        1 => vec![
            column("basic_referenceValue", &reference),
            column("basic_measuredValue", &measured).with_u(&u, stated),
        ],
        2 => vec![
            column("basic_referenceValue", &reference),
            column("basic_measurementError_correction", &corrections).with_u(&u, stated),
        ],
        _ => vec![
            column("basic_referenceValue", &reference),
            column("basic_measuredValue gp_x", &measured),
            column("basic_measurementError_error", &errors).with_u(&u, stated),
        ],
    };
    let points = (0..count).map(|at| {
        [
            measured[at] * one - zero,
            corrections[at] * one,
            u[at] * one,
        ]
    });
    Drawn {
        points: points.collect(),
        certificate: Certificate {
            in_rows: seed.is_multiple_of(2),
            ..Certificate::new(serial, vec![("calibration", columns)])
        },
        of,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_day_is_followed_by_the_next() {
        assert!(day_from_now(0) < day_from_now(1));
        assert!(day_from_now(400) > day_from_now(31));
        assert_eq!(day_from_now(0).len(), 10);
    }
}
