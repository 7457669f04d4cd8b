//! Tables, series and models on which benchmarks and counts work.

pub mod plate;
pub mod stroke;
pub mod volume;
