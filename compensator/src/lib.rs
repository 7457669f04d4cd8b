//! The mathematics of truestage: estimate, store, correct, judge.
//!
//! Every function here is pure or a plain state machine: measured values and times come in as
//! arguments, results and named errors go out. There is no socket, file, clock, thread, sleep
//! or random number inside, so that a whole commissioning runs in virtual time and twice alike.
//!
//! | module | what it answers |
//! |---|---|
//! | [`data`] | are these measured data complete and in order? |
//! | [`error_table`] | what is the deviation of a linear axis, and which command undoes it (system S3)? |
//! | [`rotary`] | what is the error of a rotary table, by a plate worse than it (system S2)? |
//! | [`hall_zero`] | where is the drift-free origin (system S5)? |
//! | [`screw`] | what does a ball screw do to a stroke, and which command undoes it (system S1)? |
//! | [`iso230`] | how good is the axis, in the figures of ISO 230-2? |
//! | [`platform`] | which strokes bring an alignment platform into a pose, and back (system S1)? |
//! | [`volumetric`] | where is the tool of three axes really, now, and which command puts it right (system S4)? |
//! | [`air`], [`length_correction`] | what does the interferometer's reading mean at 20 °C? |
//! | [`budget`] | how uncertain is a calibrated place, and what makes it so? |
//! | [`apply`] | how does a correction get onto a moving axis without a bump? |
//! | [`interpolation`], [`least_squares`], [`significance`], [`uncertainty`] | the numerics under them |
//!
//! Sign: deviation = actual − target (ISO 230-2), compensation = −deviation. The correction is
//! the exact inverse: the command `c` with `c + deviation(c) = target`.
//!
//! Absent: drivers, devices and files; model types are not (de)serialised here.
//!
//! # Example
//!
//! What was measured becomes a table, and a target the command that brings the stage there. `examples/fit.rs` says
//! more.
//!
//! ```
//! use compensator::error_table::{
//!     Compensation, EndPolicy, FitOptions, Interpolation, Limits, LinearSeries, fit,
//! };
//! use units::{Approach, Metres, MetresPerSecond};
//!
//! // A stage that goes 1 µm too far in each millimetre.
//! let mut rows = "run,approach,target_mm,measured_mm\n".to_owned();
//! for run in 1..=3 {
//!     for target_mm in [0.0, 10.0, 20.0, 30.0] {
//!         rows += &format!("{run},+,{target_mm},{}\n", target_mm * 1.001);
//!     }
//! }
//! let series = LinearSeries::from_csv(&rows, "measured.csv")?;
//! let table = fit(&series, &FitOptions::default())?;
//! let limits = Limits {
//!     size: Metres::from_um(50.0),
//!     slope: 0.01,
//!     rate: MetresPerSecond(1.0),
//! };
//! let compensation = Compensation::new(table, Interpolation::Linear, limits, EndPolicy::Refuse)?;
//! let command = compensation.set_point(Metres::from_mm(20.0), Approach::Forward)?;
//! assert!((command.mm() * 1.001 - 20.0).abs() < 1e-6);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod air;
pub mod apply;
pub mod budget;
pub mod data;
pub mod error_table;
pub mod hall_zero;
pub mod interpolation;
pub mod iso230;
pub mod least_squares;
pub mod length_correction;
#[cfg(test)]
mod noise;
pub mod platform;
pub mod rotary;
pub mod screw;
pub mod significance;
pub mod uncertainty;
pub mod volumetric;
