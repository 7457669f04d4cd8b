//! The kinds of machines that there are. What is done for a machine of whatever kind goes through this
//! list; what a kind does is in its folder.

pub(crate) mod kind;

use self::kind::Kind;
use crate::{linear, platform, rotary, volumetric};

/// Each kind.
pub(crate) const KINDS: [Kind; 4] = [linear::KIND, rotary::KIND, platform::KIND, volumetric::KIND];
