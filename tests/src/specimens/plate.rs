//! Readings of a plate on a table, each with errors of its own.

use compensator::rotary::{Placement, RotarySeries};
use units::Radians;

use crate::{normal, random};

/// Deviation of the table at a position of so many lines, in arc seconds.
pub fn table_arcsec(position: usize, lines: usize) -> f64 {
    let angle = core::f64::consts::TAU * position as f64 / lines as f64;
    6.0 * angle.cos() + 3.0 * (2.0 * angle).sin() + (36.0 * angle).sin()
}

/// ±10″ of table, ±30″ of plate, noise of about 0.05″.
///
/// # Panics
/// When the offsets make no series.
pub fn series(lines: usize, offsets: &[usize]) -> RotarySeries {
    let mut state = lines as u64;
    let plate: Vec<f64> = (0..lines)
        .map(|_| 60.0 * random(&mut state) - 30.0)
        .collect();
    let placements = offsets.iter().map(|&offset| {
        let mut read = |line: usize| {
            let noise = normal(&mut state);
            let table = table_arcsec((line + offset) % lines, lines);
            Some(Radians::from_arcsec(table + plate[line] + 0.05 * noise))
        };
        let readings = (0..lines).map(&mut read).collect();
        Placement { offset, readings }
    });
    RotarySeries::new(lines, placements.collect()).unwrap()
}
