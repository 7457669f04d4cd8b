//! The cycle of three axes that are corrected throughout their volume (system S4).
//!
//! | file | what |
//! |---|---|
//! | `zero` | every axis on its index pulse, one after the other |
//! | `correction` | what the cyclic engine adds to each set-point: detectors, references, memories, temperatures, the model and its inverse |
//! | `line` | lines of the tool's way that a laser interferometer measures: set up, travelled, read |
//! | `inputs` | where in the engine's channels each detector stands, and whether it is to be believed |

mod correction;
mod failure;
mod inputs;
mod line;
mod zero;

pub use correction::{VolumetricCorrection, VolumetricState};
pub use failure::VolumetricFailure;
pub use line::{Line, LineOperator, LineOptics, LineReading, LineReadout, LineTask};
