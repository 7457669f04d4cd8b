//! What of a certificate is kept with what was measured, and shown.

use machine::records::CertificateRecord;
#[cfg(feature = "program")]
use serde_json::{Value, json};
#[cfg(feature = "program")]
use units::Short;

#[cfg(feature = "program")]
use super::measurand::Measurand;
use super::table::Certified;
#[cfg(feature = "program")]
use super::table::{Figures, Point};

impl Certified {
    /// As records have it; `of` is what of the instrument it certifies.
    pub(crate) fn record(&self, of: &str) -> CertificateRecord {
        CertificateRecord {
            of: of.to_owned(),
            identifier: self.identifier.clone(),
            laboratory: self.laboratory.clone(),
            serial_number: self.serial_number.clone(),
            calibrated: self.calibrated.to_string(),
            valid_until: self.valid_until.to_string(),
            blake3: self.hash.clone(),
        }
    }
}

#[cfg(feature = "program")]
impl Figures {
    /// As `check --json` prints them, in SI units (temperatures in degrees Celsius).
    pub(crate) fn value(&self) -> Value {
        match self {
            Self::Value { value, u } => json!({"value": value, "standard_uncertainty": u}),
            Self::Table(points) => {
                let row = |it: &Point| json!({"reading": it.reading, "correction": it.correction, "standard_uncertainty": it.u});
                json!({"points": points.iter().map(row).collect::<Vec<_>>()})
            }
        }
    }
}

/// Its figures for a person.
#[cfg(feature = "program")]
pub(crate) fn shown(certified: &Certified, measurand: Measurand) -> String {
    let ((unit, per), (small, per_small)) = (measurand.unit(), measurand.small_unit());
    let rounded = |it: f64| Short((it * 1e6).round() / 1e6);
    let expanded = rounded(2.0 * certified.figures.u() * per_small);
    let what = match &certified.figures {
        Figures::Value { value, .. } => format!("{} {unit}", rounded(value * per)),
        Figures::Table(points) => {
            let (first, last) = certified.figures.range().unwrap_or_default();
            let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
            for it in points {
                (least, most) = (least.min(it.correction), most.max(it.correction));
            }
            format!(
                "at {} to {} {unit} corrections of {} to {} {small}",
                rounded(first * per),
                rounded(last * per),
                rounded(least * per_small),
                rounded(most * per_small)
            )
        }
    };
    format!("{what}, U = {expanded} {small} (k = 2)")
}
