//! The compensation on its way to three axes: limited in size, rate and slope, without a bump.
//!
//! Source: CN1214003A's fourth part: the error becomes an offset that is added to the position
//! command all the time. The limits are those of [`crate::apply`], for three directions at once.

use units::{Metres, MetresPerSecond, Time};

use crate::apply::{Alarm, SlewedCorrection};
use crate::volumetric::{Axis, Point};

/// What an offset may do at most, in each direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OffsetLimits {
    /// Its largest magnitude.
    pub size: Metres,
    /// Its largest change per time while nothing moves.
    pub rate: MetresPerSecond,
    /// Its largest change per way of the axes, dimensionless; on top of the rate.
    pub slope: f64,
}

/// The offset added to the command of three axes.
#[derive(Clone, Debug)]
pub struct Offset {
    directions: [SlewedCorrection; 3],
    last: Option<Point>,
}

impl Offset {
    /// A disabled offset of zero.
    pub fn new(limits: OffsetLimits) -> Self {
        let one = SlewedCorrection::new(limits.size, limits.rate).with_slope(limits.slope);
        Self {
            directions: [one.clone(), one.clone(), one],
            last: None,
        }
    }

    /// Starts to follow what is wanted, from where it is.
    pub fn enable(&mut self) {
        self.directions
            .iter_mut()
            .for_each(SlewedCorrection::enable);
    }

    /// Starts to return to zero.
    pub fn disable(&mut self) {
        self.directions
            .iter_mut()
            .for_each(SlewedCorrection::disable);
    }

    /// Announces that what is wanted will jump: another table, another tool.
    pub fn expect_jump(&mut self) {
        let each = self.directions.iter_mut();
        each.for_each(SlewedCorrection::expect_jump);
    }

    /// The offset to add at `now`, with the axes commanded to `position`, when the deviation
    /// there is `deviation`: minus that, as far as the limits let it.
    pub fn advance(&mut self, now: Time, position: Point, deviation: Point) -> Point {
        let moved = self
            .last
            .map_or(Metres::ZERO, |last| (position - last).distance());
        self.last = Some(position);
        let mut next = [Metres::ZERO; 3];
        for axis in Axis::ALL {
            let wanted = -deviation.along(axis);
            let direction = &mut self.directions[axis.index()];
            next[axis.index()] = direction.advance_along(now, wanted, moved);
        }
        Point::new(next[0], next[1], next[2])
    }

    /// The offset given out last.
    pub fn current(&self) -> Point {
        let [x, y, z] = &self.directions;
        Point::new(x.current(), y.current(), z.current())
    }

    /// What was wrong in the last [`advance`](Self::advance), along which direction.
    pub fn alarm(&self) -> Option<(Axis, Alarm)> {
        let found = |axis: Axis| Some((axis, self.directions[axis.index()].alarm()?));
        Axis::ALL.into_iter().find_map(found)
    }

    /// Whether every direction has reached what is wanted since the last announced jump.
    pub fn is_settled(&self) -> bool {
        self.directions.iter().all(SlewedCorrection::is_settled)
    }
}
