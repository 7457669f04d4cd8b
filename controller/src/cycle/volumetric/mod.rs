//! The cycle of three axes that are corrected throughout their volume (system S4).
//!
//! | file | what |
//! |---|---|
//! | `zero` | every axis on its index pulse, one after the other |
//! | `reference` | what the detectors read when the machine is as its tables say |
//! | `memory` | displacements that are to be kept, recorded |
//! | `moves` | all three axes in one line, corrected |
//! | `state` | what is stored, put together: errors, references, memories |
//! | `correction` | what the cyclic engine adds to each set-point: detectors, references, memories, temperatures, the model and its inverse |
//! | `inputs` | where in the engine's channels each detector stands, and whether it is to be believed |

mod correction;
mod failure;
mod inputs;
mod memory;
mod moves;
mod reference;
mod state;
mod zero;

pub use correction::{VolumetricCorrection, VolumetricState};
pub use failure::VolumetricFailure;
pub use memory::Remembered;
pub use moves::Mover;
pub use reference::{References, VolumetricReferenced};
pub use state::{GEOMETRY, REFERENCES, VolumetricRecords, memory_pointer};
