//! Files of a linear axis that somebody edited.

use crate::linear::KIND;
use crate::program::stored_tests::{QUICK, check, wanted};

#[test]
fn mutated_files_of_a_linear_axis_are_shown_or_refused() {
    check(&KIND.golden, QUICK);
}

#[test]
#[ignore = "takes minutes"]
fn many_mutated_files_of_a_linear_axis() {
    check(&KIND.golden, wanted());
}
