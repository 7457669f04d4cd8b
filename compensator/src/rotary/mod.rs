//! Rotary table: its error by means of a plate of lower accuracy (system S2).
//!
//! Source: the patent of Tsinghua University on the in-situ self-calibration of the measuring
//! system of a precision rotary table with a glass plate of radial lines, claim 1. A plate with N
//! lines is fixed on the table and its lines are read with the table's own angle sensor; it is
//! turned against the table, and read again. Line n of the placement with offset s is read at
//! table position n + s:
//!
//! ```text
//! V_s[n] = G[n + s] + A[n] + c_s + r      (indices modulo N; ΣG = 0, ΣA = 0)
//! ```
//!
//! | symbol | name here |
//! |---|---|
//! | N, P | lines, placements |
//! | s_j | [`Placement::offset`](crate::rotary::Placement) |
//! | V_j\[n\] | [`Placement::readings`](crate::rotary::Placement): reading − nominal angle |
//! | G\[n\] | [`Solution::table_error`]: reading − true angle of the table |
//! | A\[n\] | [`Solution::plate_error`] |
//! | c_j (Δθ_j) | the constant of a placement: how exactly it was turned |
//! | k | harmonic: periods of an error in a turn |
//! | w_j, w̄ | e^(i2πk s_j/N), its mean over the placements |
//! | Σ\|w_j − w̄\|² | what [`Design`] knows about harmonic k |
//!
//! Two placements one line apart are the patent's method: G\[n + 1\] − G\[n\] = V_1\[n\] − V_0\[n\] less
//! its mean, added up round the closed circle. Its noise grows with the period of the error; the
//! least squares over P ≥ 2 placements at offsets chosen by [`plan`] is the same method where it
//! is equal to it, and sees slow errors as well as fast ones.
//!
//! | file | step |
//! |---|---|
//! | `design` | which harmonics offsets can see, and how well, before anything is read |
//! | `plan` | offsets that amplify noise least |
//! | `closed_form` | the least squares of complete readings, with two Fourier transforms |
//! | `missing` | the same with readings missing |
//! | `outliers` | readings that belong to no model |
//! | `search` | the search for them, and which may be bad just as well |
//! | `majority` | whether the readings left out are those that were bad |
//! | `turns` | which turn of one placement makes all readings fit best |
//! | `misplaced` | a plate turned otherwise than was entered |
//! | `solver` | one evaluation after the other, until no outlier is left |
//! | `solution`, `solve` | all of it, with uncertainties |
//! | `budget` | what these are made of |
//! | `harmonics` | the table error as periods of a turn |
//! | `line_signal` | where lines are in the sampled signal of a detector |
//! | `sighted` | readings of one placement that a person made |
//! | `periodic` | deviation between the lines, and the command that undoes it |
//!
//! Limits: G is read at the nominal position of a line; the plate's error and the placement's
//! constant shift that place, which makes an error of slope of G times shift (10″ once a turn and
//! a plate placed 5′ askew: 0.015″). Harmonics above N/2 cannot be told from lower ones.
//!
//! Absent: turning the plate, storage.

mod budget;
mod closed_form;
mod design;
mod harmonics;
mod lanes;
mod line_signal;
mod majority;
mod misplaced;
mod missing;
mod outliers;
mod periodic;
mod plan;
#[cfg(test)]
mod rates;
#[cfg(test)]
mod rig;
mod search;
mod series;
mod sighted;
mod solution;
mod solve;
mod solver;
mod turns;

pub(crate) use design::gcd;
pub use design::{
    Design, DesignError, harmonic_max, rms_amplification_of_a_pair, rms_amplification_of_all,
};
pub use harmonics::{TABLES_PER_FALSE_HARMONIC, TableHarmonic, harmonics};
pub use line_signal::{
    LineShape, LinesSeen, SAMPLES_MIN, SignalSample, WIDTHS_APART, lines_in, width_seen,
};
pub use misplaced::{Misplaced, misplaced, shift_between};
pub use periodic::{
    NotAnAngle, PeriodicCompensation, PeriodicError, PeriodicInterpolation, PeriodicLimits,
    PeriodicTable,
};
pub use plan::{Criterion, PlanError, plan};
pub use series::{Placement, RotaryFault, RotarySeries, RotarySeriesError};
pub use sighted::{Implausible, Sighted, SightedFault, SightedPlan, SightedReading, pass_name};
pub use solution::{Outlier, Reading, Solution, SolveError, SolveOptions};
pub use solve::solve;
