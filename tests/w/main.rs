#[path = "../systems/virtual_time/volumetric_day.rs"]
mod volumetric_day;
