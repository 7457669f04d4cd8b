//! The kinds of machines that there are. What is done for a machine of whatever kind goes through this
//! list; what a kind does is in its folder.

pub(crate) mod kind;

use self::kind::Kind;

/// Each kind; a further one comes last ([`Kind::depends`]).
pub(crate) const KINDS: &[&Kind] = &[
    &crate::linear::KIND,
    &crate::rotary::KIND,
    &crate::platform::KIND,
    &crate::volumetric::KIND,
];
