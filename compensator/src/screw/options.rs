//! What a fit of strokes should do.

use units::Metres;

/// What a fit should do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FitOptions {
    /// Travel per turn of the screw; without it no periodic term is looked for.
    pub lead: Option<Metres>,
    /// The highest harmonic of the lead that is looked for.
    pub harmonics_max: u32,
    /// The chance accepted of finding any periodic term where there is none.
    pub significance: f64,
    /// How many scatters off a row must be to be left out.
    pub outlier_threshold: f64,
    /// The largest share of rows that may be left out, 0 to 1.
    pub outlier_share_max: f64,
    /// Standard uncertainty of one row by what its instrument does not repeat, where that is known: it makes rows
    /// scatter, but not where a move ends.
    pub reading: Option<Metres>,
    /// The same of where all rows count from. It is the same error in each row, so that no row shows it, and
    /// comes back in every move.
    pub origin: Option<Metres>,
}

impl Default for FitOptions {
    /// No lead; with one, four harmonics at a level of 1 %.
    fn default() -> Self {
        Self {
            lead: None,
            harmonics_max: 4,
            significance: 0.01,
            outlier_threshold: 6.0,
            outlier_share_max: 0.2,
            reading: None,
            origin: None,
        }
    }
}
