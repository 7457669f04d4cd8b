//! The cycle of three axes that are corrected throughout their volume (system S4).
//!
//! | file | what |
//! |---|---|
//! | `zero` | every axis on its index pulse, one after the other |
//! | `calibrate` | lines by interferometer and detectors, cold and warm, and what made them |
//! | `reference` | what the detectors read when the machine is as its tables say |
//! | `memory` | displacements that are to be kept, recorded before parts are made |
//! | `first_part` | displacements that are to be kept, recorded while the first part is made |
//! | `moves` | all three axes in one line, corrected |
//! | `verify` | a line that no calibration uses, read with the correction on |
//! | `state` | what is stored, put together: errors, references, memories |
//! | `correction` | what the cyclic engine adds to each set-point: detectors, references, memories, temperatures, the model and its inverse |
//! | `line` | lines of the tool's way that a laser interferometer measures: set up, travelled, read |
//! | `inputs` | where in the engine's channels each detector stands, and whether it is to be believed |
//! | `thermometers` | likewise of the thermometers, which share their trouble where they belong together |

mod calibrate;
pub(crate) mod check;
mod config;
mod correction;
mod entries;
mod failure;
mod first_part;
mod handle;
mod inputs;
mod line;
mod log;
mod memory;
mod moves;
mod path_refusal;
mod record;
mod reference;
pub mod report;
pub mod settings;
mod sound;
mod state;
mod thermometers;
mod verify;
mod zero;

pub use calibrate::{
    Off, Scatter, VolumetricCalibrated, VolumetricEvaluated, WarmUp, WorstReading, volume_plan,
};
pub use config::{
    BeamConfig, BeamDetectorConfig, BeamDriftName, BeamsConfig, BendConfig, CurvePointConfig,
    FeedConfig, InfluenceConfig, LayoutName, ReactionName, ReferenceConfig, RollConfig, ShapeName,
    TemperatureConfig, VolumeAxisName, VolumetricCalibrateConfig, VolumetricCompensationConfig,
    VolumetricConfig, VolumetricVerifyConfig, VolumetricZeroConfig,
};
pub use correction::{VolumetricCorrection, VolumetricState};
pub use entries::{
    BendEntry, ExpansionEntry, LineEntry, LineReadEntry, LineReadingEntry, OpticsName,
    VolumeCheckEntry, VolumePlanEntry, VolumeReferencesEntry,
};
pub use failure::VolumetricFailure;
pub use first_part::{FirstPart, FirstPartCorrection, PartRecorder};
pub use handle::WorkVolume;
pub use line::{Line, LineOperator, LineOptics, LineReading, LineReadout, LineTask};
pub use log::{VolumeEntry, VolumeLog};
pub use memory::Remembered;
pub use moves::Mover;
pub use path_refusal::PathRefusal;
pub use record::{
    AgreementRecord, BeamRecord, BeamReferencesContent, BendRecord, ExpansionRecord,
    FunctionRecord, FunctionShape, GeometryContent, MemoryName, MemoryRecord, StateMemoryContent,
    UnknownRecord,
};
pub use reference::{References, VolumetricReferenced, measured_geometry};
pub use state::{GEOMETRY, REFERENCES, VolumetricRecords, memory_pointer};
pub use verify::{VerifyBy, VolumetricVerified, VolumetricVerifiedPoint};

pub(crate) use entries::{metres, point};
pub(crate) use record::{AXES, error_name};
