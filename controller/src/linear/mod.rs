//! The cycle of a linear axis (system S3, and the zero of S5): calibrate → zero → compensate →
//! verify, as procedures on a [`Machine`](crate::Machine).

pub(crate) mod budget;
pub(crate) mod calibrate;
pub(crate) mod check;
mod config;
mod course;
mod cross_check;
mod datum;
mod datum_in_use;
mod dependence;
mod earlier_zero;
pub(crate) mod entries;
mod finding;
pub(crate) mod gantry;
#[cfg(test)]
mod golden;
pub(crate) mod job;
#[cfg(feature = "program")]
mod jog;
mod kind;
mod log;
pub(crate) mod measure;
mod memory;
pub(crate) mod moved;
mod on_trial;
mod pairing;
mod passes;
pub(crate) mod positions;
pub(crate) mod record;
pub(crate) mod run_plan;
mod runs;
mod samples_lost;
pub(crate) mod settings;
mod sound;
mod stage;
pub(crate) mod stored;
mod survey;
pub(crate) mod sweep;
mod table_correction;
mod told;
mod travel;
pub(crate) mod verify;
mod warnings;
pub(crate) mod zero;
pub(crate) mod zero_budget;

// What users write; `tests/tidy/public_names.txt` lists it.
pub use course::{Corrected, Course, PlannedMove};
pub use job::{Job, JobOperator, JobPlan, Reached};
pub use log::LinearLog;
pub use moved::Moved;
pub use record::LinearContent;
pub use stage::LinearStage;
pub use told::LinearTeller;
pub use verify::VerifyOptions;

// What the rest of this package uses.
pub(crate) use calibrate::Calibrated;
pub(crate) use config::{
    CalibrateConfig, CompensationConfig, EndPolicyName, GantryConfig, InterpolationName,
    VerifyConfig, ZeroConfig,
};
pub(crate) use datum_in_use::Datum;
#[cfg(feature = "program")]
pub(crate) use entries::HeldEntry;
pub(crate) use entries::{
    CriterionEntry, HallSweepEntry, JobEntry, PointEntry, ReachedEntry, RotationEntry, SyncsEntry,
    WentOnEntry, ZeroEntry,
};
pub(crate) use finding::PatternFinding;
#[cfg(feature = "program")]
pub(crate) use gantry::GantryZeroed;
#[cfg(test)]
pub(crate) use job::JobConfig;
pub(crate) use kind::KIND;
pub(crate) use log::LinearEntry;
pub(crate) use on_trial::NewIsWorse;
pub(crate) use run_plan::RunPlan;
pub(crate) use runs::RUNS;
pub(crate) use samples_lost::SamplesLost;
#[cfg(feature = "program")]
pub(crate) use sweep::ZeroPlanned;
pub(crate) use table_correction::table_correction;
#[cfg(feature = "program")]
pub(crate) use verify::UncertaintyAtTarget;
pub(crate) use verify::Verified;
pub(crate) use zero::Zeroed;
