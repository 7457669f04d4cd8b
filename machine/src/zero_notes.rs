//! What is noted of zeros: a file for each axis whose drive can prove that it kept its reference.

use drivers::device::DriveReference;
use serde::{Deserialize, Serialize};

use crate::records::{IdentityRecord, Store, opened, sealed};

/// Of the note. One of another version is none.
pub(crate) const VERSION: u32 = 1;

/// Where the notes are, and of which configuration.
#[derive(Debug)]
pub(crate) struct KeptZeros {
    pub(crate) store: Store,
    pub(crate) configuration: String,
}

/// What was so when the axis had its zero.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Note {
    pub(crate) schema_version: u32,
    pub(crate) axis: String,
    /// Of the whole configuration: another one may mean other places by the same counts.
    pub(crate) configuration: String,
    pub(crate) drive: IdentityRecord,
    pub(crate) mark: Option<u32>,
    pub(crate) homed: Option<bool>,
    pub(crate) homing_method: u32,
    pub(crate) home_offset: u32,
    pub(crate) polarity: u32,
    pub(crate) position_counts: i32,
    pub(crate) encoder_increments: Option<i32>,
    pub(crate) moved_increments: u32,
    pub(crate) error_code: u32,
}

impl Note {
    pub(crate) const fn reference(&self) -> DriveReference {
        DriveReference {
            mark: self.mark,
            homed: self.homed,
            method: self.homing_method,
            home_offset: self.home_offset,
            polarity: self.polarity,
            position: self.position_counts,
            increments: self.encoder_increments,
            moved: self.moved_increments,
            error_code: self.error_code,
        }
    }
}

impl KeptZeros {
    pub(crate) fn read(&self, axis: &str) -> Option<Note> {
        let text = self.store.read_zero_note(axis)?;
        let json = opened(text.trim_end()).ok()?;
        serde_json::from_str(&json).ok()
    }
}

impl Note {
    /// As it stands in its file.
    pub(crate) fn text(&self) -> String {
        let json = serde_json::to_string(self).expect("a note is an object");
        sealed(&json)
    }
}
