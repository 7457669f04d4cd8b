//! How well the readings of three axes agree, stored with what was found from them: screens and pages
//! show these figures and compute none of their own.

use serde::{Deserialize, Serialize};
use units::Metres;

/// How well readings agree with the errors that were found from them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AgreementRecord {
    /// How many lines were read whole.
    pub lines: usize,
    /// How many readings these have.
    pub readings: usize,
    /// How many of them are beyond the unknowns.
    pub degrees_of_freedom: usize,
    /// Their scatter in units of what was stated of them; `None` without readings to spare.
    pub scatter_ratio: Option<f64>,
    /// The largest standard uncertainty of the tool in use, in the volume.
    pub tool_u_max_m: f64,
}

impl AgreementRecord {
    /// How well uncertainties are known that were enlarged because readings scatter more than was stated of them; `None`
    /// for infinitely many degrees of freedom: they are as stated.
    ///
    /// What was added has those of the scatter (Welch and Satterthwaite).
    pub(crate) fn enlarged_with(&self) -> Option<f64> {
        let ratio = self.scatter_ratio.filter(|it| *it > 1.0)?;
        let added = 1.0 - 1.0 / (ratio * ratio);
        Some(self.degrees_of_freedom as f64 / (added * added))
    }

    /// `31 lines, 402 readings, 96 beyond the unknowns, scatter 0.47 of what was stated`.
    pub fn readings_text(&self) -> String {
        let ratio = self.scatter_ratio;
        let ratio = ratio.map_or("–".to_owned(), |it| format!("{it:.2}"));
        format!(
            "{} lines, {} readings, {} beyond the unknowns, scatter {ratio} of what was stated",
            self.lines, self.readings, self.degrees_of_freedom
        )
    }

    /// `tool: standard uncertainty 0.472 µm at most`.
    pub fn tool_text(&self) -> String {
        let u = Metres(self.tool_u_max_m).um();
        format!("tool: standard uncertainty {u:.3} µm at most")
    }
}
