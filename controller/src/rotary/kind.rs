//! What the list of kinds says of rotary tables.

use machine::records::ContentKind;

use crate::kinds::kind::Kind;
use crate::rotary::check::check_rotaries;
use crate::rotary::dependence::depends;
#[cfg(test)]
use crate::rotary::golden::GOLDEN;
use crate::rotary::record::RotaryContent;
use crate::rotary::warnings::warnings;

pub(crate) const KIND: Kind = Kind {
    check: check_rotaries,
    depends,
    warnings,
    contents: &[ContentKind::of::<RotaryContent>()],
    #[cfg(test)]
    golden: GOLDEN,
};
