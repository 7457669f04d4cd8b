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
mod estimate;
mod failure;
mod in_use;
mod moves;
mod operator;
mod placement;
mod verify;

pub use calibrate::RotaryCalibrated;
pub use estimate::{Evaluated, evaluated};
pub use failure::RotaryFailure;
pub use moves::RotaryMoved;
pub use operator::{Operator, PlateMove, PlateTask};
pub use verify::{RotaryFigures, RotaryVerified};

pub(crate) use in_use::TableInUse;
