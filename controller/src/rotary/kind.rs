//! What the list of kinds says of rotary tables.

use machine::records::ContentKind;

use crate::kinds::kind::Kind;
use crate::rotary::check::check_rotaries;
#[cfg(test)]
use crate::rotary::golden::GOLDEN;
use crate::rotary::record::RotaryContent;

pub(crate) const KIND: Kind = Kind {
    check: check_rotaries,
    contents: &[ContentKind::of::<RotaryContent>()],
    #[cfg(test)]
    golden: GOLDEN,
};
