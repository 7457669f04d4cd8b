//! Where the records of a machine lie, and of which kinds its calibrations may be.

use std::path::Path;

use machine::records::{ContentKind, Store};

use crate::config::MachineSection;
use crate::linear::LinearContent;
use crate::platform::ScrewContent;
use crate::rotary::RotaryContent;
use crate::volumetric::{BeamReferencesContent, GeometryContent, StateMemoryContent};

/// What calibrations of each kind of machine say.
pub(crate) const CONTENTS: &[ContentKind] = &[
    ContentKind::of::<LinearContent>(),
    ContentKind::of::<RotaryContent>(),
    ContentKind::of::<ScrewContent>(),
    ContentKind::of::<GeometryContent>(),
    ContentKind::of::<BeamReferencesContent>(),
    ContentKind::of::<StateMemoryContent>(),
];

/// The store of the machine that a configuration describes.
pub fn store_of(machine: &MachineSection) -> Store {
    store_in(&machine.data_dir, &machine.name)
}

/// The store of `machine` below `data_dir`.
pub fn store_in(data_dir: &Path, machine: &str) -> Store {
    Store::new(data_dir, machine, CONTENTS)
}
