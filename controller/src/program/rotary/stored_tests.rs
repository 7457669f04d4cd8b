//! Files of a rotary table that somebody edited.

use crate::program::stored_tests::{QUICK, check, wanted};
use crate::rotary::KIND;

#[test]
fn mutated_files_of_a_rotary_table_are_shown_or_refused() {
    check(&KIND.golden, QUICK);
}

#[test]
#[ignore = "takes minutes"]
fn many_mutated_files_of_a_rotary_table() {
    check(&KIND.golden, wanted());
}
