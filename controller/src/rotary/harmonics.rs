//! The harmonics of the table error that a calibration holds.

use compensator::rotary::{Design, TableHarmonic, harmonics};
use compensator::uncertainty::rms;
use units::Radians;

use crate::rotary::RotaryContent;

impl RotaryContent {
    /// The harmonics of the table error, up to the highest that its lines tell between them, too.
    pub(crate) fn harmonics(&self) -> Vec<TableHarmonic> {
        let design = self.design();
        let known = design.as_ref().zip(self.reading_uncertainty());
        harmonics(&self.table_error_rad, known)
    }

    fn design(&self) -> Option<Design> {
        let offsets: Vec<usize> = self.offsets.iter().map(|it| *it as usize).collect();
        Design::new(self.table_error_rad.len(), &offsets, f64::INFINITY).ok()
    }

    /// Standard uncertainty of one reading, as the table error's stands for it.
    fn reading_uncertainty(&self) -> Option<Radians> {
        let of_table = self.standard_uncertainty_rad.as_ref()?;
        let amplified = self.noise_amplification;
        let is_known = !of_table.is_empty() && amplified > 0.0;
        is_known.then(|| Radians(rms(of_table) / amplified))
    }
}
