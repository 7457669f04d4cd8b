//! The cycle of a rotary axis (system S2): its table error comes out of the readings of a plate
//! that is no better, in several placements.
//!
//! A plate is turned by people. Each placement is asked for, read in both directions, and read
//! once more at the end, to see that nothing moved meanwhile. What was read stands in the journal,
//! one entry a pass; whole placements survive whatever ends the run.
//!
//! | word | meaning |
//! |---|---|
//! | offset | by how many lines the plate is turned against the table, from the first placement |
//! | table position p, line n | line n of a placement with offset s is read at p = n + s |
//! | pass | one turn over all lines, in one direction |

mod calibrate;
pub(crate) mod check;
mod config;
mod entries;
mod estimate;
mod failure;
mod in_use;
pub mod json;
mod line_speed;
mod log;
mod moves;
mod operator;
mod placement;
mod record;
pub mod report;
pub mod settings;
mod sound;
mod sweep;
mod table;
mod turn;
mod verify;

pub use calibrate::RotaryCalibrated;
pub use config::{
    DirectionName, EdgeName, LineDetectorConfig, OptimiseName, PeriodicInterpolationName,
    PositionRangeName, RotaryCalibrateConfig, RotaryCompensationConfig, RotaryConfig, RotaryDevice,
    RotaryVerifyConfig, RotaryZeroConfig,
};
pub use entries::{JudgedEntry, PlacementEntry, PlatePlanEntry, SweepEntry};
pub use estimate::{Evaluated, evaluated};
pub use failure::RotaryFailure;
pub use log::{PlateEntry, PlateLog};
pub use moves::RotaryMoved;
pub use operator::{Operator, PlateMove, PlateTask};
pub use record::{ReadingName, RotaryContent};
pub use sweep::{Sweep, SweepOptions};
pub use table::RotaryTable;
pub use turn::Way;
pub use verify::{RotaryFigures, RotaryVerified};

pub(crate) use in_use::TableInUse;
pub(crate) use table::RotaryMemory;
