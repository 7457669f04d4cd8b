//! The cycle of a rotary axis (system S2): its table error comes out of the readings of a plate
//! that is no better, in several placements.
//!
//! A plate is turned by people. Each placement is asked for, read in both directions, and read
//! once more at the end, to see that nothing moved meanwhile. What was read stands in the journal,
//! one entry a pass, or one a line where a person reads; whole placements survive whatever ends the run,
//! and so does every line that a person has read.
//!
//! | word | meaning |
//! |---|---|
//! | offset | by how many lines the plate is turned against the table, from the first placement |
//! | table position p, line n | line n of a placement with offset s is read at p = n + s |
//! | pass | one turn over all lines, in one direction |

mod asked;
pub(crate) mod bidirectional;
pub(crate) mod calibrate;
pub(crate) mod check;
mod config;
mod course;
mod dependence;
mod entries;
pub(crate) mod estimate;
mod failure;
#[cfg(test)]
mod golden;
#[cfg(feature = "program")]
pub(crate) mod harmonics;
mod in_use;
#[cfg(feature = "program")]
mod jog;
mod kind;
mod line_speed;
mod log;
pub(crate) mod moves;
mod operator;
pub(crate) mod placed;
mod placement;
mod plate_journal;
mod plate_run;
pub(crate) mod record;
mod runs;
pub(crate) mod settings;
pub(crate) mod sighted;
mod sighting;
mod signal;
mod sound;
pub(crate) mod subject;
pub(crate) mod sweep;
mod table;
mod told;
mod turn;
mod unturned;
pub(crate) mod verify;
mod warnings;

// What users write; `tests/tidy/public_names.txt` lists it.
pub use course::{PlannedTurn, TableCourse};
pub use failure::RotaryFailure;
pub use log::PlateLog;
pub use operator::{Operator, PlateMove, PlateTask};
pub use record::RotaryContent;
pub use sweep::SweepOptions;
pub use table::RotaryTable;
pub use told::RotaryTeller;
pub use turn::Way;

// What the rest of this package uses.
pub(crate) use calibrate::RotaryCalibrated;
pub(crate) use config::{
    DirectionName, EdgeName, LineDetectorConfig, LineSideName, LineSignalConfig,
    PeriodicInterpolationName, PositionRangeName, RotaryCalibrateConfig, RotaryCompensationConfig,
    RotaryConfig, RotaryDevice, RotaryVerifyConfig, SightingConfig,
};
pub(crate) use course::RotaryMoved;
pub(crate) use entries::{
    JudgedEntry, PlacementEntry, PlatePlanEntry, SightedAt, SightedEntry, SweepEntry,
};
pub(crate) use in_use::TableInUse;
pub(crate) use kind::KIND;
pub(crate) use log::PlateEntry;
pub(crate) use runs::RUNS;
pub(crate) use sweep::Sweep;
pub(crate) use verify::RotaryVerified;
