//! Linear axes on the command line.

pub(crate) mod demo;
mod moved;
pub(crate) mod verbs;

use super::verbs::Verbs;

/// What it does for the verbs of the cycle.
pub(crate) const VERBS: Verbs = Verbs {
    zero: verbs::zero,
    calibrate: verbs::calibrate,
    verify: verbs::verify,
    move_to: verbs::move_to,
};
