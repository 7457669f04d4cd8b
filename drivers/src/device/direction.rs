//! Which way an instrument counts.

/// Which way the displacement counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Direction {
    /// As the instrument counts.
    #[default]
    AsCounted,
    /// The other way: the number falls while the axis goes forward.
    Reversed,
}

impl Direction {
    pub(super) const fn sign(self) -> f64 {
        match self {
            Self::AsCounted => 1.0,
            Self::Reversed => -1.0,
        }
    }
}
