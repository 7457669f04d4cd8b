//! What a machine can be made of: for each section of the configuration that names a device, what all
//! families have in common, and a file for each family.
//!
//! A family's file has its keys, what they must keep to together, how its driver is set up, and what else a
//! procedure must know of it. Families do not know of each other. A further one is a file, and a variant of
//! the enum in the `mod.rs` above it.

pub(crate) mod analog;
pub(crate) mod bus;
pub(crate) mod camera;
pub(crate) mod certificate;
pub(crate) mod drive;
pub(crate) mod instrument;
pub(crate) mod kept_zero;
pub(crate) mod node;

use core::time::Duration;

/// Why what a driver is told can be told: nothing else passes the judgement of the configuration.
pub(crate) const CHECKED: &str = "the configuration was checked when it was loaded";

pub(crate) const fn millis(ms: u16) -> Duration {
    Duration::from_millis(ms as u64)
}
