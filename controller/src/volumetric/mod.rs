//! The cycle of three axes that are corrected throughout their volume (system S4).
//!
//! | file | what |
//! |---|---|
//! | `zero` | every axis on its index pulse, one after the other |
//! | `calibrate` | lines by interferometer and detectors, cold and warm, and what made them |
//! | `reference` | what the detectors read when the machine is as its tables say |
//! | `given` | the same from a file, where it is known beforehand |
//! | `memory` | displacements that are to be kept, recorded before parts are made |
//! | `first_part` | displacements that are to be kept, recorded while the first part is made |
//! | `moves` | all three axes in one line, corrected |
//! | `verify` | a line that no calibration uses, read with the correction on |
//! | `sight` | what the detectors see at this moment, for whoever adjusts their beams |
//! | `state` | what is stored, put together: errors, references, memories |
//! | `correction` | what the cyclic engine adds to each set-point: detectors, references, memories, temperatures, the model and its inverse |
//! | `limits` | whether the configuration lets that pass, and which limits would |
//! | `line` | lines of the tool's way that a laser interferometer measures: set up, travelled, read |
//! | `inputs` | which of the engine's channels belong to each detector, and whether its value is accepted |
//! | `thermometers` | the same for the thermometers; those that belong together fail together |

mod asked;
mod benefit;
pub(crate) mod calibrate;
pub(crate) mod check;
mod chosen;
mod config;
mod correction;
mod dependence;
pub(crate) mod entries;
pub(crate) mod failure;
pub(crate) mod first_part;
#[cfg(feature = "program")]
pub(crate) mod given;
#[cfg(test)]
mod golden;
mod handle;
mod inputs;
mod kind;
mod limits;
pub(crate) mod line;
mod log;
mod memory;
pub(crate) mod memory_import;
pub(crate) mod motion;
pub(crate) mod moved;
mod moves;
pub(crate) mod path;
pub(crate) mod record;
pub(crate) mod reference;
mod runs;
pub(crate) mod settings;
#[cfg(feature = "program")]
pub(crate) mod sight;
mod sound;
mod state;
mod thermometers;
mod told;
pub(crate) mod verify;
mod warnings;
mod zero;

// What users write; `tests/tidy/public_names.txt` lists it.
pub use calibrate::WarmUp;
pub use correction::{VolumetricCorrection, VolumetricState};
pub use failure::VolumetricFailure;
pub use handle::WorkVolume;
pub use line::{LineOperator, LineOptics, LineTask};
pub use log::VolumeLog;
pub use moves::Mover;
pub use record::{GeometryContent, MemoryName, StateMemoryContent};
pub use told::VolumetricTeller;
pub use verify::VerifyBy;

// What the rest of this package uses.
#[cfg(feature = "program")]
pub(crate) use asked::AskedLine;
pub(crate) use calibrate::Scatter;
pub(crate) use calibrate::VolumetricCalibrated;
pub(crate) use config::{
    BeamConfig, BeamDetectorConfig, BeamDriftName, BeamsConfig, BendConfig, CurvePointConfig,
    DetectorConfig, FeedConfig, InfluenceConfig, LayoutName, OneOrMore, PICTURE_PERIODS_MAX,
    ReactionName, RollConfig, ShapeName, SpotCameraConfig, TemperatureConfig, VolumeAxisName,
    VolumetricCalibrateConfig, VolumetricCompensationConfig, VolumetricConfig,
    VolumetricVerifyConfig,
};
pub(crate) use entries::{
    BendEntry, ExpansionEntry, LineEntry, LineReadEntry, LineReadingEntry, LineVoidEntry,
    OpticsName, VolumeCheckEntry, VolumePlanEntry, VolumeReferencesEntry,
};
pub(crate) use entries::{metres, point};
#[cfg(feature = "program")]
pub(crate) use given::GivenReferences;
#[cfg(all(test, feature = "program"))]
pub(crate) use given::ReferenceFunctionsConfig;
pub(crate) use kind::KIND;
pub(crate) use log::VolumeEntry;
pub(crate) use memory::Remembered;
#[cfg(feature = "program")]
pub(crate) use memory_import::import;
#[cfg(feature = "program")]
pub(crate) use record::GivenName;
pub(crate) use record::{AXES, error_name};
pub(crate) use record::{
    AgreementRecord, BeamRecord, BeamReferencesContent, BendRecord, CovarianceRecord, DriftRecord,
    ExpansionRecord, FunctionRecord, FunctionShape, UnknownRecord,
};
pub(crate) use reference::References;
pub(crate) use runs::RUNS;
pub(crate) use state::{GEOMETRY, REFERENCES, VolumetricRecords, memory_pointer};
