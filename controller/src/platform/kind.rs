//! What the list of kinds says of alignment platforms.

use machine::records::ContentKind;

use crate::kinds::kind::Kind;
use crate::platform::check::check;
use crate::platform::dependence::depends;
#[cfg(test)]
use crate::platform::golden::GOLDEN;
use crate::platform::record::ScrewContent;
use crate::platform::warnings::warnings;

pub(crate) const KIND: Kind = Kind {
    check,
    depends,
    warnings,
    contents: &[ContentKind::of::<ScrewContent>()],
    #[cfg(test)]
    golden: GOLDEN,
};
