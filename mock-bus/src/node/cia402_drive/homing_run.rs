//! How far a homing run is.

/// A run towards a limit switch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct HomingRun {
    /// −1 for the negative switch (1, 17), +1 for the positive one (2, 18).
    pub(super) direction: f64,
    /// Whether an index pulse is the home.
    pub(super) to_index: bool,
    pub(super) step: Step,
    pub(super) started_at: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Step {
    /// Until the switch is pressed.
    Seek,
    /// Slowing down on the switch.
    Stop,
    /// Until it is released: that is home, or where the index pulse is searched.
    BackOff,
    /// Until the next index pulse after this one (by number): that is home.
    Index { after: u64 },
    /// Slowing down behind it.
    Settle,
}
