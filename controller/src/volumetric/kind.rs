//! What the list of kinds says of three axes.

use machine::records::ContentKind;

use crate::kinds::kind::Kind;
use crate::volumetric::check::check;
use crate::volumetric::dependence::depends;
#[cfg(test)]
use crate::volumetric::golden::GOLDEN;
use crate::volumetric::record::{BeamReferencesContent, GeometryContent, StateMemoryContent};
use crate::volumetric::warnings::warnings;

pub(crate) const KIND: Kind = Kind {
    check,
    depends,
    warnings,
    contents: &[
        ContentKind::of::<GeometryContent>(),
        ContentKind::of::<BeamReferencesContent>(),
        ContentKind::of::<StateMemoryContent>(),
    ],
    #[cfg(test)]
    golden: GOLDEN,
};
