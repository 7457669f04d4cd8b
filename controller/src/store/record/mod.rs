//! What one calibration says: a head that all kinds share, and the content of its kind.
//!
//! Each kind of content is a file `record` of its kind of machine. Another one is: its file with its
//! plain struct (`deny_unknown_fields`, every key with its unit), a variant of [`Content`], its arms in
//! `kind` and `summary`, and a way from [`CalibrationRecord`] to it that ends in
//! [`CalibrationRecord::other_kind`]. In the file the keys of head and content stand side by side.

mod head;

use serde::{Deserialize, Serialize};

use super::{StoreError, short};
use crate::linear::LinearContent;
use crate::platform::ScrewContent;
use crate::rotary::RotaryContent;
use crate::volumetric::{BeamReferencesContent, GeometryContent, StateMemoryContent};

pub use head::{EnvironmentRecord, IdentityRecord, InstrumentRecord, RecordHead};

/// One calibration of one axis: a signed statement of what was measured, with what, when,
/// on which machine, and how well.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CalibrationRecord {
    /// Whose it is and where it comes from.
    #[serde(flatten)]
    pub head: RecordHead,
    /// What it says. It is read last: what the head does not know must be known here.
    #[serde(flatten)]
    pub content: Content,
}

/// The model a calibration holds; the key `kind` says which.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Content {
    /// Deviations of a linear axis at calibrated positions.
    LinearErrorTable(LinearContent),
    /// Errors of a rotary table at the lines of a plate.
    RotaryErrorTable(RotaryContent),
    /// Lead error, periodic error and lost motion of a ball screw.
    ScrewModel(ScrewContent),
    /// The 21 errors of three axes.
    VolumetricGeometry(GeometryContent),
    /// What the detectors of three axes read when their errors were measured.
    BeamReferences(BeamReferencesContent),
    /// Displacements of three axes that are to be kept.
    StateMemory(StateMemoryContent),
}

impl Content {
    /// Its name in files and messages.
    pub const fn kind(&self) -> &'static str {
        match self {
            Self::LinearErrorTable(_) => LinearContent::KIND,
            Self::RotaryErrorTable(_) => RotaryContent::KIND,
            Self::ScrewModel(_) => ScrewContent::KIND,
            Self::VolumetricGeometry(_) => GeometryContent::KIND,
            Self::BeamReferences(_) => BeamReferencesContent::KIND,
            Self::StateMemory(_) => StateMemoryContent::KIND,
        }
    }

    /// How much it holds, in a few words.
    pub fn summary(&self) -> String {
        match self {
            Self::LinearErrorTable(it) => format!("{} nodes", it.nodes.len()),
            Self::RotaryErrorTable(it) => it.summary(),
            Self::ScrewModel(it) => it.summary(),
            Self::VolumetricGeometry(it) => it.summary(),
            Self::BeamReferences(it) => it.summary(),
            Self::StateMemory(it) => it.summary(),
        }
    }
}

impl CalibrationRecord {
    /// The error table of a linear axis.
    ///
    /// # Errors
    /// When this calibration, named `id`, is of another kind.
    pub fn linear(&self, id: &str) -> Result<&LinearContent, StoreError> {
        match &self.content {
            Content::LinearErrorTable(content) => Ok(content),
            _ => Err(self.other_kind(id, LinearContent::KIND)),
        }
    }

    /// The error table of a rotary axis.
    ///
    /// # Errors
    /// When this calibration, named `id`, is of another kind.
    pub fn rotary(&self, id: &str) -> Result<&RotaryContent, StoreError> {
        match &self.content {
            Content::RotaryErrorTable(content) => Ok(content),
            _ => Err(self.other_kind(id, RotaryContent::KIND)),
        }
    }

    /// The model of a ball screw.
    ///
    /// # Errors
    /// When this calibration, named `id`, is of another kind.
    pub fn screw(&self, id: &str) -> Result<&ScrewContent, StoreError> {
        match &self.content {
            Content::ScrewModel(content) => Ok(content),
            _ => Err(self.other_kind(id, ScrewContent::KIND)),
        }
    }

    /// The errors of three axes.
    ///
    /// # Errors
    /// When this calibration, named `id`, is of another kind.
    pub fn geometry(&self, id: &str) -> Result<&GeometryContent, StoreError> {
        match &self.content {
            Content::VolumetricGeometry(content) => Ok(content),
            _ => Err(self.other_kind(id, GeometryContent::KIND)),
        }
    }

    /// What the detectors of three axes read.
    ///
    /// # Errors
    /// When this calibration, named `id`, is of another kind.
    pub fn beam_references(&self, id: &str) -> Result<&BeamReferencesContent, StoreError> {
        match &self.content {
            Content::BeamReferences(content) => Ok(content),
            _ => Err(self.other_kind(id, BeamReferencesContent::KIND)),
        }
    }

    /// Displacements of three axes that are to be kept.
    ///
    /// # Errors
    /// When this calibration, named `id`, is of another kind.
    pub fn state_memory(&self, id: &str) -> Result<&StateMemoryContent, StoreError> {
        match &self.content {
            Content::StateMemory(content) => Ok(content),
            _ => Err(self.other_kind(id, StateMemoryContent::KIND)),
        }
    }

    /// The error for who wanted a calibration of kind `expected` and got this one, named `id`.
    pub fn other_kind(&self, id: &str, expected: &'static str) -> StoreError {
        StoreError::OtherKind {
            id: short(id),
            axis: self.head.axis.clone(),
            expected,
            seen: self.content.kind(),
        }
    }

    pub(super) fn bytes(&self) -> Vec<u8> {
        let mut bytes = serde_json::to_vec_pretty(self).expect("plain data always serialises");
        bytes.push(b'\n');
        bytes
    }
}

#[cfg(test)]
pub(crate) mod tests;
