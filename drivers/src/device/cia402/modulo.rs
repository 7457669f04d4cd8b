//! Positions that wrap: what a rotary axis's drive shows, and the angle that counts on.
//!
//! A drive wraps its position at a turn (0x607B) or where 32 bits end. Whichever it is, the
//! position of the next sample is taken to be the nearest one that the drive can mean: between
//! two samples an axis never turns by half a turn.

use units::{Approach, Coordinate, Counts, Radians};

use super::Cia402Drive;
use super::convert::EXACT_COUNTS;
use super::settings::{Cia402Settings, PositionRange, Turn};
use crate::device::RotaryAxis;

/// Positions this many counts apart look the same on the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Modulo(i64);

impl Modulo {
    /// From `earlier` to `later`, the shorter way.
    pub(super) const fn difference(self, later: i64, earlier: i64) -> i64 {
        let Self(counts) = self;
        let half = counts / 2;
        (later - earlier + half).rem_euclid(counts) - half
    }

    /// The position nearest to `reference` that looks like `raw`.
    pub(super) const fn nearest(self, raw: i64, reference: i64) -> i64 {
        reference + self.difference(raw, reference)
    }
}

/// From one position to another as far as the bus can tell.
pub(super) const fn apart(modulo: Option<Modulo>, later: i64, earlier: i64) -> i64 {
    match modulo {
        Some(modulo) => modulo.difference(later, earlier),
        None => later - earlier,
    }
}

impl<Q: Coordinate> Cia402Settings<Q> {
    pub(super) const fn modulo(&self) -> Option<Modulo> {
        match self.turn {
            None => None,
            Some(Turn { counts, range }) => Some(match range {
                PositionRange::CountsOn => Modulo(1 << 32),
                PositionRange::ToLastCount | PositionRange::ToFirstCount => Modulo(counts as i64),
            }),
        }
    }

    /// The counts of a turn of a drive that wraps there.
    pub(super) fn wraps_at(&self) -> Option<i64> {
        let turn = self.turn?;
        (turn.range != PositionRange::CountsOn).then_some(i64::from(turn.counts))
    }
}

impl<Q: Coordinate> Cia402Drive<Q> {
    /// What the bus carries for a position; `None` where 32 bits end.
    pub(super) fn on_the_wire(&self, position: i64) -> Option<i32> {
        let shown = match self.settings.wraps_at() {
            Some(counts) => position.rem_euclid(counts),
            None => position - self.image.wrapped_away(),
        };
        i32::try_from(shown).ok()
    }

    /// Where the drive's position register ends with growing counts, or with falling ones.
    pub(super) fn register_end(&self, grows: bool) -> Counts {
        let end = if grows { i32::MAX } else { i32::MIN };
        Counts(self.image.wrapped_away() + i64::from(end))
    }

    /// How far from `here` the axis can be sent, with growing counts or with falling ones.
    fn counts_left(&self, here: i64, grows: bool) -> i64 {
        let sign = if grows { 1 } else { -1 };
        if self.settings.wraps_at().is_some() {
            return EXACT_COUNTS - sign * here;
        }
        // The register must not run over while the axis settles there: it would count on from its other end, and the
        // way back be closed.
        let lag = self.settings.following_error.map_or(Q::ZERO, |it| it.0);
        let margin = self.settings.scale.to_counts(lag).0.abs() + self.settings.tolerance_counts();
        // Nor may the way be more than 31 bits hold: whether a drive sees it as one the other way round nobody knows.
        let left = sign * (self.register_end(grows).0 - here);
        left.min(i32::MAX.into()) - margin
    }
}

impl RotaryAxis for Cia402Drive<Radians> {
    fn last_position(&self, way: Approach) -> Option<Radians> {
        let here = self.image.sample()?.position.0;
        let scale = self.settings.scale;
        let grows = (way == Approach::Forward) == (scale.resolution() > Radians::ZERO);
        let left = self.counts_left(here, grows).max(0);
        let last = if grows { here + left } else { here - left };
        Some(scale.to_coordinate(Counts(last)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_position_that_wrapped_goes_on_counting() {
        let turn = Modulo(1000);
        assert_eq!(turn.nearest(3, 998), 1003);
        assert_eq!(turn.nearest(998, 1003), 998);
        assert_eq!(turn.nearest(990, -4_000), -4_010);
        assert_eq!(turn.nearest(499, 0), 499);
    }

    #[test]
    fn thirty_two_bits_wrap_likewise() {
        let register = Modulo(1 << 32);
        let last = i64::from(i32::MAX);
        assert_eq!(register.nearest(i64::from(i32::MIN), last), last + 1);
        assert_eq!(register.nearest(last, last + 1), last);
    }
}
