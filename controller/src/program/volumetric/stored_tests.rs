//! Files of three axes that somebody edited.

use crate::program::stored_tests::{QUICK, check, wanted};
use crate::volumetric::KIND;

#[test]
fn mutated_files_of_three_axes_are_shown_or_refused() {
    // A case takes twenty times as long as any other machine's.
    check(&KIND.golden, QUICK / 4);
}

#[test]
#[ignore = "takes minutes"]
fn many_mutated_files_of_three_axes() {
    check(&KIND.golden, wanted());
}
