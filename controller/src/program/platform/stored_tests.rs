//! Files of a platform that somebody edited.

use crate::platform::KIND;
use crate::program::stored_tests::{QUICK, check, wanted};

#[test]
fn mutated_files_of_a_platform_are_shown_or_refused() {
    check(&KIND.golden, QUICK);
}

#[test]
#[ignore = "takes minutes"]
fn many_mutated_files_of_a_platform() {
    check(&KIND.golden, wanted());
}
