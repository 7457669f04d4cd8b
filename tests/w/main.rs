//! For the time being.
#[path = "../systems/virtual_time/volumetric_day.rs"]
mod volumetric_day;
#[path = "../systems/virtual_time/volumetric_kept.rs"]
mod volumetric_kept;
