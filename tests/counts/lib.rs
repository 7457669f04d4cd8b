//! The package of the counts of instructions: `main.rs` is all that this package has.
