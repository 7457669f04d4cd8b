//! A calibration that is about to be written for another control, and what its file says of it.

use machine::records::RecordHead;
use serde_json::{Map, Value, json};

use super::correction::{Correction, Measure, Side};
use super::format::FormatName;

/// What is written, of which calibration, and what was asked of it.
pub(super) struct Exported<'a> {
    pub(super) id: &'a str,
    pub(super) head: &'a RecordHead,
    pub(super) correction: &'a Correction,
    pub(super) format: FormatName,
    pub(super) side: Option<Side>,
    pub(super) step: Option<f64>,
    /// What the axis is called there.
    pub(super) name: Option<&'a str>,
    /// Encoder counts for a metre or a radian there.
    pub(super) counts: Option<f64>,
    /// Where the axis may go.
    pub(super) soft_limits: Option<(f64, f64)>,
}

/// A file for another control.
pub(super) struct Written {
    pub(super) text: String,
    /// What its user must know.
    pub(super) told: Vec<String>,
    pub(super) figures: Map<String, Value>,
}

impl Exported<'_> {
    pub(super) const fn measure(&self) -> Measure {
        self.correction.measure()
    }

    /// Whose table it is, in lines of ASCII: controls show nothing else.
    pub(super) fn header(&self, what: &[String]) -> Vec<String> {
        let head = self.head;
        let u = match self.correction.uncertainty() {
            Some(u) => format!("standard uncertainty up to {}", self.measure().small(u)),
            None => "no uncertainty is stated".to_owned(),
        };
        let mut lines = vec![
            format!("truestage {}", env!("CARGO_PKG_VERSION")),
            format!("calibration {}", self.id),
            format!(
                "axis {} of machine {}, stage {}",
                head.axis, head.machine, head.stage_serial
            ),
            format!("made {} from {}; {u}", head.created, head.source),
        ];
        lines.extend_from_slice(what);
        lines.iter().map(|line| ascii(line)).collect()
    }

    /// What the straight lines of the control do, for people and programs.
    pub(super) fn lines_told(
        &self,
        off: f64,
        values: usize,
        figures: &mut Map<String, Value>,
    ) -> String {
        let largest = self.measure().small(off);
        let key = match self.measure() {
            Measure::Length => "straight_lines_off_um",
            Measure::Angle => "straight_lines_off_arcsec",
        };
        figures.insert(key.into(), json!(self.measure().small_value(off)));
        figures.insert("values".into(), json!(values));
        format!(
            "{values} values: the control's straight lines are up to {largest} off the correction that truestage makes"
        )
    }
}

/// What other controls and their editors show: letters of ASCII, one line.
fn ascii(line: &str) -> String {
    let plain = line.replace('µ', "u").replace('−', "-");
    plain
        .chars()
        .map(|it| if matches!(it, ' '..='~') { it } else { '?' })
        .collect()
}
