//! Standstill of an axis that nothing moves, by its samples alone.

use core::time::Duration;

use units::Time;

use crate::coordinate::Coordinate;

/// An axis that was seen to move stands once it has kept its place for so long.
const REST: Duration = Duration::from_millis(100);
/// What has just come to rest settles for as long, within so many windows.
const SETTLING_WINDOWS: f64 = 10.0;

/// Where an axis stands, and whether it has left that place.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RestWatch {
    window: Coordinate,
    /// When and where it was first seen.
    first: Option<(Time, Coordinate)>,
    /// Where it stands, or was when it last left its place.
    place: Coordinate,
    /// When it last left its place.
    left: Option<Time>,
}

impl RestWatch {
    /// Of an axis that keeps its place within `window`.
    pub(crate) const fn new(window: Coordinate) -> Self {
        Self {
            window,
            first: None,
            place: window,
            left: None,
        }
    }

    /// Takes note of where it is `at` a moment.
    pub(crate) fn note(&mut self, at: Time, position: Coordinate) {
        let (since, first) = *self.first.get_or_insert((at, position));
        if at.since(since) < REST {
            self.place = position;
            if apart(first, position) > SETTLING_WINDOWS * value(self.window) {
                self.left = Some(at);
            }
            return;
        }
        if apart(self.place, position) > value(self.window) {
            self.place = position;
            self.left = Some(at);
        }
        if self.left.is_some_and(|left| at.since(left) >= REST) {
            self.left = None;
        }
    }

    /// Forgets where it stood: it is moved.
    pub(crate) const fn forget(&mut self) {
        self.first = None;
        self.left = None;
    }

    /// Whether it moves.
    pub(crate) const fn moves(&self) -> bool {
        self.left.is_some()
    }
}

const fn value(coordinate: Coordinate) -> f64 {
    match coordinate {
        Coordinate::Length(length) => length.value(),
        Coordinate::Angle(angle) => angle.value(),
    }
}

fn apart(one: Coordinate, other: Coordinate) -> f64 {
    (value(one) - value(other)).abs()
}

#[cfg(test)]
mod tests {
    use units::Metres;

    use super::*;

    fn at_um(um: f64) -> Coordinate {
        Metres::from_um(um).into()
    }

    /// Samples every millisecond from `since_ms` on.
    fn note(watch: &mut RestWatch, since_ms: u64, places_um: impl Iterator<Item = f64>) -> u64 {
        let mut ms = since_ms;
        for um in places_um {
            watch.note(Time::from_seconds(ms as f64 * 1e-3), at_um(um));
            ms += 1;
        }
        ms
    }

    #[test]
    fn an_axis_that_creeps_is_seen_to_move() {
        let mut watch = RestWatch::new(at_um(0.1));
        // 10 µm/s, which is a tenth of the window from sample to sample.
        let end = note(&mut watch, 0, (0..500).map(|ms| f64::from(ms) * 0.01));
        assert!(watch.moves());
        let end = note(&mut watch, end, core::iter::repeat_n(5.0, 80));
        assert!(watch.moves(), "it stood for less than its time");
        note(&mut watch, end, core::iter::repeat_n(5.0, 40));
        assert!(!watch.moves());
    }

    #[test]
    fn an_axis_that_keeps_its_place_stands() {
        let mut watch = RestWatch::new(at_um(0.1));
        note(&mut watch, 0, (0..500).map(|ms| f64::from(ms % 2) * 0.09));
        assert!(!watch.moves());
        note(&mut watch, 500, core::iter::once(3.0));
        assert!(watch.moves());
        watch.forget();
        assert!(!watch.moves(), "it was sent there");
    }

    #[test]
    fn an_axis_that_settles_stands_and_one_that_goes_on_does_not() {
        let mut watch = RestWatch::new(at_um(0.1));
        note(&mut watch, 0, (0..99).map(|ms| 0.9 / f64::from(ms + 1)));
        assert!(!watch.moves());
        watch.forget();
        // 1 mm/s.
        note(&mut watch, 200, (0..5).map(f64::from));
        assert!(watch.moves());
    }
}
