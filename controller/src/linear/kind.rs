//! What the list of kinds says of linear axes.

use machine::records::ContentKind;

use crate::kinds::kind::Kind;
use crate::linear::check::check;
use crate::linear::dependence::depends;
#[cfg(test)]
use crate::linear::golden::GOLDEN;
use crate::linear::record::LinearContent;
use crate::linear::warnings::warnings;

pub(crate) const KIND: Kind = Kind {
    check,
    depends,
    warnings,
    contents: &[ContentKind::of::<LinearContent>()],
    #[cfg(test)]
    golden: GOLDEN,
};
