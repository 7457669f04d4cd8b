//! Where the axes were when a picture was taken.

use core::time::Duration;

use compensator::volumetric::online::Shown;
use compensator::volumetric::{Axis, Point};
use units::{Metres, Time};

use crate::volumetric::PICTURE_PERIODS_MAX;

/// `check` permits no picture that is older than [`PICTURE_PERIODS_MAX`].
const LENGTH: usize = PICTURE_PERIODS_MAX + 1;
/// Between two motions nothing is noted: what lies longer apart is no straight way.
const PAUSE: Duration = Duration::from_millis(500);

/// The positions at the last SYNCs.
#[derive(Clone, Debug)]
pub(super) struct Trail {
    steps: [(Time, Point); LENGTH],
    /// How many were noted.
    count: usize,
}

impl Default for Trail {
    fn default() -> Self {
        let nowhere = Point::new(Metres(0.0), Metres(0.0), Metres(0.0));
        Self {
            steps: [(Time::ZERO, nowhere); LENGTH],
            count: 0,
        }
    }
}

impl Trail {
    /// The axes are at `place` now.
    pub(super) const fn note(&mut self, now: Time, place: Point) {
        self.steps[self.count % LENGTH] = (now, place);
        self.count += 1;
    }

    /// Where `axis` was when a detector saw what it shows, with the axes at `actual` now.
    pub(super) fn position(&self, axis: Axis, shown: Option<&Shown>, actual: Point) -> Metres {
        match shown {
            Some(Shown::Camera(spot)) => self.at(spot.at).unwrap_or(actual).along(axis),
            Some(Shown::Channels(_)) | None => actual.along(axis),
        }
    }

    /// Where the axes were at `when`: between two steps on the straight way, before the oldest one and in a pause where the
    /// next one is.
    fn at(&self, when: Time) -> Option<Point> {
        let known = self.count.min(LENGTH);
        let mut later: Option<(Time, Point)> = None;
        for back in 1..=known {
            let step = self.steps[(self.count - back) % LENGTH];
            if step.0 <= when {
                return Some(match later {
                    None => step.1,
                    Some(later) if later.0.since(step.0) > PAUSE => later.1,
                    Some(later) => between(step, later, when),
                });
            }
            later = Some(step);
        }
        later.map(|it| it.1)
    }
}

fn between((from, start): (Time, Point), (to, end): (Time, Point), when: Time) -> Point {
    let share = when.since(from).as_secs_f64() / to.since(from).as_secs_f64();
    let [x, y, z] = Axis::ALL.map(|axis| {
        let (start, end) = (start.along(axis), end.along(axis));
        start + (end - start) * share
    });
    Point::new(x, y, z)
}

#[cfg(test)]
mod tests {
    use compensator::volumetric::online::{Sample, Spot, Unplaced};
    use units::Volts;

    use super::*;

    fn ms(ms: f64) -> Time {
        Time::ZERO + Duration::from_secs_f64(ms * 1e-3)
    }

    fn x_mm(mm: f64) -> Point {
        Point::new(Metres::from_mm(mm), Metres(0.0), Metres(0.0))
    }

    /// Two motions, three seconds apart.
    fn paused() -> Trail {
        let mut trail = Trail::default();
        trail.note(ms(100.0), x_mm(1.0));
        trail.note(ms(3100.0), x_mm(50.0));
        trail
    }

    #[test]
    fn a_picture_counts_for_where_the_axis_was() {
        let mut trail = Trail::default();
        let seen = |trail: &Trail, at: f64| {
            let shown = Shown::Camera(Spot {
                at: ms(at),
                place: Err(Unplaced::NoSpot),
            });
            trail.position(Axis::X, Some(&shown), x_mm(-1.0)).mm()
        };
        assert!((seen(&trail, 5.0) + 1.0).abs() < 1e-12, "nothing is known");
        // 0.1 mm every 10 ms, for longer than is kept.
        for step in 0..1000 {
            trail.note(ms(10.0 * f64::from(step)), x_mm(0.1 * f64::from(step)));
        }
        for (at, expected) in [(9950.0, 99.5), (9873.0, 98.73), (9990.0, 99.9), (1e5, 99.9)] {
            let mm = seen(&trail, at);
            assert!((mm - expected).abs() < 1e-9, "{at} ms: {mm} mm");
        }
        let paused = seen(&paused(), 3000.0);
        assert!(
            (paused - 50.0).abs() < 1e-9,
            "what moved them there was nobody's motion"
        );
        let oldest = 0.1 * f64::from(1000 - LENGTH as u32);
        assert!(
            (seen(&trail, 10.0) - oldest).abs() < 1e-9,
            "before the oldest"
        );
        let channels = Shown::from(Sample {
            channels: [Volts(1.0); 4],
            at: ms(9950.0),
        });
        let now = trail.position(Axis::X, Some(&channels), x_mm(7.0));
        assert!((now.mm() - 7.0).abs() < 1e-12, "channels are of now");
    }
}
