//! The cycle of a linear axis (system S3, and the zero of S5): calibrate → zero → compensate →
//! verify, as procedures on a [`Machine`](crate::Machine).

mod calibrate;
pub(crate) mod check;
mod config;
mod cross_check;
mod datum;
mod datum_in_use;
mod entries;
mod log;
mod measure;
mod moved;
mod record;
pub mod report;
mod run_plan;
pub mod settings;
mod sound;
mod stage;
mod table_correction;
mod travel;
mod verify;
mod zero;

pub use calibrate::Calibrated;
pub use config::{
    CalibrateConfig, CompensationConfig, EndPolicyName, InterpolationName, VerifyConfig, ZeroConfig,
};
pub use entries::{PointEntry, ZeroEntry};
pub use log::{LinearEntry, LinearLog};
pub use measure::{MeasureOptions, Measured};
pub use moved::{Corrected, Moved};
pub use record::{LinearContent, NodeRecord};
pub use run_plan::RunPlan;
pub use stage::LinearStage;
pub use verify::{Verified, VerifyOptions};
pub use zero::Zeroed;

pub(crate) use datum_in_use::Datum;
pub use measure::series_of;
pub(crate) use stage::AxisMemory;
pub(crate) use table_correction::table_correction;
