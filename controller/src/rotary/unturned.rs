//! Whether a plate was turned at all between two of its placements.
//!
//! A plate that stays where it is shows the sum of its own errors and the table's at each position, the same in every
//! placement. One table and one plate explain that without any residual: the table has all the errors then, and the plate
//! none. So no residual tells it, nor a verification with the plate where it was: what is compared is the readings
//! themselves, by table position. A plate that was turned brings other lines there, whose errors are other ones; and one
//! that was taken up and fixed again lies a little elsewhere.
//!
//! Absent: a plate with smaller errors than the noise of its readings that was turned without moving it within its line.

use compensator::uncertainty::{median, robust_sigma};
use units::Radians;

use crate::rotary::placed::Placed;
use crate::rotary::plate_run::PlateRun;

/// Readings of two placements scatter by this many times what is stated, at most, where they are of the same lines: as much
/// as a calibration may ([`super::estimate`]).
const NOISE_FACTOR_MAX: f64 = 2.0;
/// A plate that was not touched lies within so many times the noise of a reading where it lay.
const MOVED_FACTOR_MAX: f64 = 10.0;

/// Two placements of which the later one was read as if the plate had not been turned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Unturned {
    /// The later one's offset.
    pub(super) offset: f64,
    /// The other one's.
    pub(super) like: f64,
    /// By how much their readings differ at a position: the standard deviation.
    pub(super) scatter: Radians,
}

/// The first of the placements, in the order in which they were read, that repeats an earlier one.
pub(super) fn unturned(run: &PlateRun, placed: &[Placed]) -> Option<Unturned> {
    let pairs = (1..placed.len()).flat_map(|later| (0..later).map(move |earlier| (later, earlier)));
    let mut unturned = pairs.filter_map(|(later, earlier)| {
        let (later, earlier) = (&placed[later], &placed[earlier]);
        Some(Unturned {
            offset: later.offset,
            like: earlier.offset,
            scatter: scatter_where_it_lay(run, later, earlier)?,
        })
    });
    unturned.next()
}

/// By how much both placements differ from each other where they are of the same lines in the same place.
fn scatter_where_it_lay(run: &PlateRun, later: &Placed, earlier: &Placed) -> Option<Radians> {
    let both = later.deviations.iter().zip(&earlier.deviations);
    let mut apart: Vec<f64> = both
        .filter_map(|(later, earlier)| Some(((*later)? - (*earlier)?).value()))
        .collect();
    let is_known = 2 * apart.len() > later.deviations.len();
    let moved = median(&apart)?;
    apart.iter_mut().for_each(|it| *it -= moved);
    let scatter = Radians(robust_sigma(&apart)?);
    let expected = run.noise_of_mean() * core::f64::consts::SQRT_2;
    let is_alike = scatter <= expected * NOISE_FACTOR_MAX;
    let is_there = Radians(moved).abs() <= run.noise * MOVED_FACTOR_MAX;
    (is_known && is_alike && is_there).then_some(scatter)
}
