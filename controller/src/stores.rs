//! Where the records of a machine lie, and of which kinds its calibrations may be.

use std::path::Path;
use std::sync::LazyLock;

use machine::records::{ContentKind, Store};

use crate::config::MachineSection;
use crate::kinds::KINDS;

/// What calibrations of each kind of machine say.
pub(crate) fn contents() -> &'static [ContentKind] {
    static CONTENTS: LazyLock<Vec<ContentKind>> =
        LazyLock::new(|| KINDS.iter().flat_map(|it| it.contents).copied().collect());
    &CONTENTS
}

impl MachineSection {
    /// The store of the machine that this describes.
    pub fn store(&self) -> Store {
        store_in(&self.data_dir, &self.name)
    }
}

/// The store of `machine` below `data_dir`.
pub fn store_in(data_dir: &Path, machine: &str) -> Store {
    Store::new(data_dir, machine, contents())
}
