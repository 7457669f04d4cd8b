//! The cycle: calibrate → zero → compensate → verify, as procedures on a [`Machine`].
//!
//! [`Machine`]: crate::connected::Machine

mod calibrate;
mod cross_check;
mod datum;
mod datum_in_use;
mod measure;
mod moved;
pub mod platform;
pub mod rotary;
mod run_plan;
pub(crate) mod sweep;
mod table_correction;
mod travel;
mod turn;
mod verify;
pub mod volumetric;
mod zero;

pub use calibrate::{CalibrateOptions, Calibrated};
pub use machine::Found;
pub use measure::{MeasureOptions, Measured};
pub use moved::{Corrected, Moved};
pub use run_plan::RunPlan;
pub use sweep::{Sweep, SweepOptions};
pub use turn::Way;
pub use verify::{Verified, VerifyOptions};
pub use zero::Zeroed;

pub(crate) use calibrate::note_failure;
pub(crate) use datum_in_use::Datum;
pub use measure::series_of;

/// The time of day for records, UTC, RFC 3339, to the second. Control never reads it.
pub fn utc_now() -> String {
    let now = jiff::Timestamp::now();
    now.strftime("%Y-%m-%dT%H:%M:%SZ").to_string()
}
