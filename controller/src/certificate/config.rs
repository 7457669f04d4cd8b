//! The keys of a certificate in a machine's file.

use std::path::PathBuf;
use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;

use super::table::Certified;

/// A certificate of calibration, which is read with this file.
///
/// A Digital Calibration Certificate (DCC, schema 3.0 to 3.3 of the PTB) in XML. Its corrections are made, its
/// uncertainties enter the budget of each calibration; docs/exchange.md says which of its values are read. What a
/// calibration depends on has its hash: with another certificate an axis is calibrated again.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CertificateConfig {
    /// The certificate, from this file's folder.
    pub file: PathBuf,
    /// Serial number of what is certified: the certificate must name it.
    #[schemars(extend("x-range" = "not empty"))]
    #[schemars(extend("x-own" = true))]
    pub serial_number: String,
    /// Name or id of the result that is meant, where the certificate has several of that sort.
    pub result: Option<String>,
    /// How long it holds from the end of its calibration; needed where it does not say so itself. Of the two the
    /// shorter counts.
    #[schemars(range(min = 1, max = 600))]
    pub valid_months: Option<u32>,
    /// So long before it ends `check` and every start warn.
    #[serde(default = "a_month")]
    #[schemars(range(min = 0, max = 3650))]
    pub remind_days: u32,
    /// What it says, once it has been read.
    #[serde(skip)]
    pub(crate) certified: Option<Arc<Certified>>,
}

const fn a_month() -> u32 {
    30
}

#[cfg(test)]
impl CertificateConfig {
    /// One that was read, and certifies `figures`.
    pub(crate) fn of(figures: super::table::Figures) -> Self {
        let certified = Certified {
            identifier: "K".into(),
            laboratory: "L".into(),
            serial_number: "S".into(),
            calibrated: jiff::civil::date(2026, 1, 1),
            valid_until: jiff::civil::date(2027, 1, 1),
            hash: "ab".into(),
            figures,
        };
        Self {
            file: "certificate.xml".into(),
            serial_number: certified.serial_number.clone(),
            result: None,
            valid_months: None,
            remind_days: a_month(),
            certified: Some(Arc::new(certified)),
        }
    }
}
