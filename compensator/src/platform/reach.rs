//! Which poses the travel of the actuators allows.
//!
//! At a given turn each actuator allows a strip of the x/y plane, so the reachable positions
//! are a convex polygon. Along a turn, or along a straight path of poses, a stroke is a sine
//! plus a straight line; its extremes are known in closed form, nothing is sampled.

use core::f64::consts::TAU;

use units::portable::{acos, asin, atan2, hypot};
use units::{Metres, Radians};

use super::{Platform, Point, Pose, Row};

/// What rounding may add to a stroke that stands exactly at its limit, metres.
const SLACK: f64 = 1e-12;

/// One limit that a pose exceeds.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Beyond {
    /// An actuator cannot travel so far.
    #[error("actuator `{name}` would need {:.6} mm, it has {:.6} to {:.6} mm",
        stroke.mm(), min.mm(), max.mm())]
    Stroke {
        /// Which actuator.
        name: String,
        /// The stroke needed.
        stroke: Metres,
        /// Its lowest stroke.
        min: Metres,
        /// Its highest stroke.
        max: Metres,
    },
    /// The actuators lose their hold at this turn.
    #[error("the turn of {:.4}° is outside {:.4}° to {:.4}°, where the actuators hold the platform",
        angle.value().to_degrees(), min.value().to_degrees(), max.value().to_degrees())]
    Angle {
        /// The turn.
        angle: Radians,
        /// The lowest turn allowed.
        min: Radians,
        /// The highest turn allowed.
        max: Radians,
    },
    /// A NaN or an infinity.
    #[error("the pose is not finite")]
    NotFinite,
}

/// A pose that cannot be reached.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("the pose cannot be reached: {}", limits.iter().map(ToString::to_string)
    .collect::<Vec<_>>().join("; "))]
pub struct OutOfReach {
    /// Everything in the way, never empty.
    pub limits: Vec<Beyond>,
}

/// A straight path that leaves the reachable poses.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("the straight path cannot be followed: at {:.1} % of it {beyond}", fraction * 100.0)]
pub struct PathError {
    /// Where on the path it is worst, 0 at the start, 1 at the end.
    pub fraction: f64,
    /// What is in the way there.
    pub beyond: Beyond,
}

impl Platform {
    /// The strokes of a pose that can be reached.
    ///
    /// # Errors
    /// Every limit in the way.
    pub fn check(&self, pose: Pose) -> Result<Vec<Metres>, OutOfReach> {
        let raw = pose.raw();
        if raw.iter().any(|v| !v.is_finite()) {
            let limits = vec![Beyond::NotFinite];
            return Err(OutOfReach { limits });
        }
        let strokes: Vec<f64> = self.rows.iter().map(|row| row.stroke(raw)).collect();
        let mut limits: Vec<Beyond> = Vec::new();
        limits.extend(self.angle_excess(raw[2]));
        let beyond = strokes.iter().enumerate();
        limits.extend(beyond.filter_map(|(index, &stroke)| self.stroke_excess(index, stroke)));
        if limits.is_empty() {
            Ok(strokes.into_iter().map(Metres).collect())
        } else {
            Err(OutOfReach { limits })
        }
    }

    fn stroke_excess(&self, index: usize, stroke: f64) -> Option<Beyond> {
        (!self.rows[index].allows(stroke)).then(|| Beyond::Stroke {
            name: self.actuators[index].name.clone(),
            stroke: Metres(stroke),
            min: self.actuators[index].stroke_min,
            max: self.actuators[index].stroke_max,
        })
    }

    fn angle_excess(&self, angle: f64) -> Option<Beyond> {
        let (min, max) = self.angles;
        (angle < min || angle > max).then_some(Beyond::Angle {
            angle: Radians(angle),
            min: Radians(min),
            max: Radians(max),
        })
    }

    /// The corners of the reachable positions at this turn, counter-clockwise; none when no
    /// position is reachable.
    ///
    /// # Example
    ///
    /// ```
    /// use compensator::platform::Platform;
    /// use units::{Metres, Radians};
    ///
    /// let mm = Metres::from_mm;
    /// let platform = Platform::uvw(mm(200.0), mm(0.0), mm(10.0))?;
    /// let corners = platform.reachable_area(Radians::ZERO);
    /// assert_eq!(corners.len(), 4);
    /// assert!(corners.iter().all(|it| (it.x.abs().mm() - 10.0).abs() < 1e-9));
    /// // Far enough turned, u and v have nothing left.
    /// assert!(platform.reachable_area(Radians::from_degrees(20.0)).is_empty());
    /// # Ok::<(), compensator::platform::PlatformError>(())
    /// ```
    pub fn reachable_area(&self, angle: Radians) -> Vec<Point> {
        let angle = angle.value();
        if !angle.is_finite() || self.angle_excess(angle).is_some() {
            return Vec::new();
        }
        let mut corners = self.enclosing_square(angle);
        for row in &self.rows {
            let turned = row.turned(angle);
            let [dx, dy] = row.direction;
            corners = clipped(&corners, [dx, dy], row.max - turned);
            corners = clipped(&corners, [-dx, -dy], turned - row.min);
        }
        // Where limits meet in one corner it was cut more than once.
        corners.dedup_by(|a, b| same_place(*a, *b));
        while corners.len() > 1 && same_place(corners[0], corners[corners.len() - 1]) {
            corners.pop();
        }
        corners
            .into_iter()
            .map(|[x, y]| Point {
                x: Metres(x),
                y: Metres(y),
            })
            .collect()
    }

    /// A square that certainly holds all reachable positions. They lie in two crossing strips;
    /// the farther these are from perpendicular, the longer the diamond they cut out.
    fn enclosing_square(&self, angle: f64) -> Vec<[f64; 2]> {
        let farthest = |row: &Row| {
            let turned = row.turned(angle);
            (row.max - turned).abs().max((row.min - turned).abs())
        };
        let mut half = f64::INFINITY;
        for (i, a) in self.rows.iter().enumerate() {
            for b in &self.rows[i + 1..] {
                let sine = a.direction[0] * b.direction[1] - a.direction[1] * b.direction[0];
                half = half.min((farthest(a) + farthest(b)) / sine.abs());
            }
        }
        let half = half * 1.01 + 1e-6;
        vec![[-half, -half], [half, -half], [half, half], [-half, half]]
    }

    /// The turns around zero that are reachable at this position without a gap; `None` when the
    /// position cannot be reached unturned.
    pub fn reachable_angles(&self, at: Point) -> Option<(Radians, Radians)> {
        let (x, y) = (at.x.value(), at.y.value());
        let allowed = |angle: f64| {
            let fits = |row: &Row| row.allows(row.stroke([x, y, angle]));
            self.rows.iter().all(fits)
        };
        if !(x.is_finite() && y.is_finite() && allowed(0.0)) {
            return None;
        }
        let meets: Vec<f64> = self
            .rows
            .iter()
            .flat_map(|r| r.turns_at_limits(x, y))
            .collect();
        let end = |sign: f64, last: f64| {
            let ahead = meets.iter().map(|angle| (sign * angle).rem_euclid(TAU));
            let mut ends: Vec<f64> = ahead.filter(|angle| *angle < last).collect();
            ends.push(last);
            ends.sort_by(f64::total_cmp);
            let mut reached = 0.0;
            // A limit may be touched without being exceeded: what lies behind decides.
            for end in ends {
                if !allowed(sign * (reached + (end - reached) / 2.0)) {
                    break;
                }
                reached = end;
            }
            sign * reached
        };
        let (min, max) = (end(-1.0, -self.angles.0), end(1.0, self.angles.1));
        Some((Radians(min), Radians(max)))
    }

    /// The largest turn that is reachable both ways at the centre.
    pub fn angle_max(&self) -> Radians {
        self.reachable_angles(Point::default())
            .map_or(Radians::ZERO, |(min, max)| max.min(-min))
    }

    /// Whether every pose of the straight path (x, y and turn in proportion) is reachable. The
    /// compensation of each screw comes on top: leave it room.
    ///
    /// # Errors
    /// The worst limit in the way, and where on the path.
    ///
    /// # Example
    ///
    /// ```
    /// use compensator::platform::{Platform, Pose};
    /// use units::Metres;
    ///
    /// let mm = Metres::from_mm;
    /// let platform = Platform::uvw(mm(200.0), mm(120.0), mm(10.0))?;
    /// let at = |x_mm: f64| Pose { x: mm(x_mm), ..Pose::default() };
    /// assert_eq!(platform.check_path(at(-9.0), at(9.0)), Ok(()));
    /// let error = platform.check_path(at(0.0), at(12.0)).expect_err("10 mm is all");
    /// assert_eq!(error.fraction, 1.0);
    /// # Ok::<(), compensator::platform::PlatformError>(())
    /// ```
    pub fn check_path(&self, from: Pose, to: Pose) -> Result<(), PathError> {
        let (start, end) = (from.raw(), to.raw());
        if start.iter().chain(&end).any(|v| !v.is_finite()) {
            let (fraction, beyond) = (0.0, Beyond::NotFinite);
            return Err(PathError { fraction, beyond });
        }
        for (fraction, pose) in [(0.0, start), (1.0, end)] {
            if let Some(beyond) = self.angle_excess(pose[2]) {
                return Err(PathError { fraction, beyond });
            }
        }
        let mut worst: Option<(f64, f64, usize, f64)> = None;
        for (index, row) in self.rows.iter().enumerate() {
            for fraction in row.extremes(start, end) {
                let at = [0, 1, 2].map(|i| start[i] + fraction * (end[i] - start[i]));
                let stroke = row.stroke(at);
                let excess = (stroke - row.max).max(row.min - stroke);
                if !row.allows(stroke) && worst.is_none_or(|(most, ..)| excess > most) {
                    worst = Some((excess, fraction, index, stroke));
                }
            }
        }
        let beyond = |(_, at, index, stroke)| Some((at, self.stroke_excess(index, stroke)?));
        match worst.and_then(beyond) {
            Some((fraction, beyond)) => Err(PathError { fraction, beyond }),
            None => Ok(()),
        }
    }
}

impl Row {
    fn allows(&self, stroke: f64) -> bool {
        stroke >= self.min - SLACK && stroke <= self.max + SLACK
    }

    /// The turns at which the stroke equals one of its limits, with the platform at x, y. The
    /// turn's part is r cos(θ − φ) − a.
    fn turns_at_limits(&self, x: f64, y: f64) -> Vec<f64> {
        let reach = hypot(self.radial, self.lever);
        let phase = atan2(self.lever, self.radial);
        let limits = [self.min, self.max].into_iter();
        limits
            .map(|limit| (limit + self.radial - self.along(x, y)) / reach)
            .filter(|cosine| cosine.abs() <= 1.0)
            .flat_map(|cosine| [phase + acos(cosine), phase - acos(cosine)])
            .collect()
    }

    /// The fractions of a straight path at which the stroke may be extreme, its ends included.
    fn extremes(&self, start: [f64; 3], end: [f64; 3]) -> Vec<f64> {
        let mut fractions = vec![0.0, 1.0];
        let turn = end[2] - start[2];
        let reach = hypot(self.radial, self.lever);
        // d stroke/d θ = d·Δt/Δθ − r sin(θ − φ) = 0.
        let sine = self.along(end[0] - start[0], end[1] - start[1]) / (turn * reach);
        // Without a turn there is no extreme between the ends, and the sine is no number.
        if sine.is_nan() || sine.abs() > 1.0 {
            return fractions;
        }
        let phase = atan2(self.lever, self.radial);
        let rise = asin(sine);
        for flat in [phase + rise, phase + core::f64::consts::PI - rise] {
            // Every repetition of the angle that the path passes.
            let low = start[2].min(end[2]);
            let mut angle = flat + ((low - flat) / TAU).ceil() * TAU;
            while angle <= start[2].max(end[2]) {
                fractions.push((angle - start[2]) / turn);
                angle += TAU;
            }
        }
        fractions
    }
}

fn same_place(a: [f64; 2], b: [f64; 2]) -> bool {
    hypot(a[0] - b[0], a[1] - b[1]) <= SLACK
}

/// The part of a convex polygon where `normal` · corner ≤ `limit`.
fn clipped(corners: &[[f64; 2]], normal: [f64; 2], limit: f64) -> Vec<[f64; 2]> {
    // A corner on the line up to rounding is on the line, or two limits that coincide would cut
    // each other's edge somewhere in the middle.
    let over = |c: [f64; 2]| {
        let over = normal[0] * c[0] + normal[1] * c[1] - limit;
        if over.abs() <= SLACK { 0.0 } else { over }
    };
    let mut kept = Vec::with_capacity(corners.len() + 1);
    for (i, &corner) in corners.iter().enumerate() {
        let next = corners[(i + 1) % corners.len()];
        let (here, there) = (over(corner), over(next));
        if here <= 0.0 {
            kept.push(corner);
        }
        if (here < 0.0 && there > 0.0) || (here > 0.0 && there < 0.0) {
            let share = here / (here - there);
            kept.push([0, 1].map(|k| corner[k] + share * (next[k] - corner[k])));
        }
    }
    kept
}
