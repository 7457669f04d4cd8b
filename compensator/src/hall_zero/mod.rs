//! Drift-free absolute zero of a stage from two Hall sensors (system S5).
//!
//! Source: CN101551226A, steps 1–5 and claims 14–20 (whose sub-steps 11)–51) the search
//! follows). Sensor 1 sits over three magnets N-S-N: its curve is even, with a maximum at the
//! nominal zero. Sensor 2 sits over two magnets S-N: its curve is odd, steep at zero. Two points
//! G1, G2 of equal voltage on the flanks of curve 1 are symmetric to the zero, whatever offset
//! and gain have become; the mean of sensor 2's voltages there is its voltage at the zero. The
//! patent's formulas (1), (3), (4), (6)–(9) are missing images, read as means of n samples and
//! as the window (V2_P1 + V2_P2)/2 ± δ3.
//!
//! | symbol | name here |
//! |---|---|
//! | V1, V2 | [`Sample::peak`], [`Sample::slope`] |
//! | V1max, G7 | [`Outcome::peak_max`], [`Step::Peak`] |
//! | Vc, Vc0, δ1…δ4, n | [`Settings::vc`], [`Settings::vc0`], [`Settings::delta1`] …, [`Settings::samples`] |
//! | G1 and P1, G2 and P2 | [`Outcome::g1`], [`Outcome::g2`] (both sensors' means) |
//! | P0 and G8 | [`Outcome::p0`] |
//!
//! The method cancels drift along the voltage axis and suppresses tilt. It does not cure what
//! moves the curves along x: uneven demagnetisation, outside magnets, expansion differences.
//!
//! Beyond the patent: every search is bounded in travel, time, soft limits and restarts; broken
//! sensors are recognised and named ([`diagnose`]); [`refine`] uses every sample of the search
//! and states its standard uncertainty.
//!
//! A pattern that is not where the search looks for it is recognised in a pass over the travel ([`pattern`]),
//! and its place and direction name a wrong scale or direction of the axis ([`mistake`]).
//!
//! A stage with two zero points side by side has a rotation, which they tell ([`rotation`]).
//!
//! Absent: motion itself (the search says where to move and when to stand), trending of the drift between
//! zeroings.

mod diagnose;
mod failure;
mod jump;
mod passes;
mod plan;
mod profile;
mod refine;
mod rotation;
mod search;
mod sensor;
mod series;
mod settings;
mod survey;

pub use diagnose::{SensorFault, diagnose};
pub use failure::{Reason, SearchFailure, Step};
pub use jump::{Jump, JumpCause};
pub use passes::{Pass, refine_passes};
pub use plan::{FlatLevel, PlanError, PlannedLevel, ZeroPlan, flat_level, plan_zero};
pub use refine::{
    Flank, Level, Passes, RefineError, RefineOptions, Side, ZeroEstimate, fit_hall, refine,
    single_threshold_zero,
};
pub use rotation::{Base, Rotation, rotation};
pub use search::{Held, Outcome, Progress, Sample, Search};
pub use sensor::Sensor;
pub use series::{HallPoint, HallSeries, HallSeriesError};
pub use settings::{Settings, SettingsError};
pub use survey::{Mistake, Pattern, mistake, pattern};

#[cfg(test)]
mod rig;
#[cfg(test)]
mod tests;
