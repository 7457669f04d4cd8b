//! The three axes, points of the work volume, and the kernel's three-vectors.

use core::fmt;

use units::Metres;

/// One of three linear axes; also the direction it moves along.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Axis {
    /// The first.
    X,
    /// The second.
    Y,
    /// The third.
    Z,
}

impl Axis {
    /// All three, in order.
    pub const ALL: [Self; 3] = [Self::X, Self::Y, Self::Z];

    /// 0, 1 or 2.
    pub const fn index(self) -> usize {
        self as usize
    }

    /// The two other axes, in the order x, y, z: the sideways directions of this one.
    pub const fn others(self) -> [Self; 2] {
        match self {
            Self::X => [Self::Y, Self::Z],
            Self::Y => [Self::X, Self::Z],
            Self::Z => [Self::X, Self::Y],
        }
    }

    /// The axis that is called so; `None` for anything else.
    pub fn of_letter(letter: char) -> Option<Self> {
        match letter {
            'x' => Some(Self::X),
            'y' => Some(Self::Y),
            'z' => Some(Self::Z),
            _ => None,
        }
    }

    /// Likewise by a word of one letter.
    pub(super) fn named(text: &str) -> Option<Self> {
        let mut letters = text.chars();
        let axis = letters.next().and_then(Self::of_letter);
        axis.filter(|_| letters.next().is_none())
    }
}

impl fmt::Display for Axis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::X => "x",
            Self::Y => "y",
            Self::Z => "z",
        })
    }
}

/// A position, a displacement or a deviation in machine coordinates.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Point {
    /// Along x.
    pub x: Metres,
    /// Along y.
    pub y: Metres,
    /// Along z.
    pub z: Metres,
}

impl Point {
    /// No displacement.
    pub const ZERO: Self = Self::new(Metres::ZERO, Metres::ZERO, Metres::ZERO);

    /// From its three coordinates.
    pub const fn new(x: Metres, y: Metres, z: Metres) -> Self {
        Self { x, y, z }
    }

    /// From millimetres, as a person writes them.
    pub const fn from_mm(x: f64, y: f64, z: f64) -> Self {
        Self::new(Metres::from_mm(x), Metres::from_mm(y), Metres::from_mm(z))
    }

    /// The coordinate along `axis`.
    pub const fn along(self, axis: Axis) -> Metres {
        match axis {
            Axis::X => self.x,
            Axis::Y => self.y,
            Axis::Z => self.z,
        }
    }

    /// How far it is from the origin.
    pub fn distance(self) -> Metres {
        let [x, y, z] = self.array();
        Metres((x * x + y * y + z * z).sqrt())
    }

    #[inline]
    pub(crate) const fn array(self) -> V3 {
        [self.x.value(), self.y.value(), self.z.value()]
    }

    #[inline]
    pub(crate) const fn of(v: V3) -> Self {
        Self::new(Metres(v[0]), Metres(v[1]), Metres(v[2]))
    }
}

impl core::ops::Add for Point {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self::new(self.x + other.x, self.y + other.y, self.z + other.z)
    }
}

impl core::ops::Sub for Point {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self::new(self.x - other.x, self.y - other.y, self.z - other.z)
    }
}

impl core::ops::Neg for Point {
    type Output = Self;
    fn neg(self) -> Self {
        Self::new(-self.x, -self.y, -self.z)
    }
}

/// Why two corners do not make a volume.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("work volume, axis {axis}: {} mm to {} mm is not a range", units::Short(low.mm()),
    units::Short(high.mm()))]
pub struct VolumeError {
    /// Which axis.
    pub axis: Axis,
    /// Its low end.
    pub low: Metres,
    /// Its high end.
    pub high: Metres,
}

/// A box of machine coordinates, ends included.
///
/// # Example
///
/// ```
/// use compensator::volumetric::{Axis, Point, Volume};
///
/// let volume = Volume::new(Point::ZERO, Point::from_mm(600.0, 500.0, 400.0))?;
/// assert!(volume.contains(Point::from_mm(600.0, 0.0, 400.0)), "ends included");
/// assert_eq!(volume.nearest(Point::from_mm(-1.0, 7.0, 9.0)), Point::from_mm(0.0, 7.0, 9.0));
/// let flat = Volume::new(Point::ZERO, Point::from_mm(600.0, 0.0, 400.0));
/// assert!(flat.is_err_and(|it| it.axis == Axis::Y));
/// # Ok::<(), compensator::volumetric::VolumeError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Volume {
    low: Point,
    high: Point,
}

impl Volume {
    /// The box between two corners.
    ///
    /// # Errors
    /// When along an axis the high end is not above the low one, or not a number.
    pub fn new(low: Point, high: Point) -> Result<Self, VolumeError> {
        for axis in Axis::ALL {
            let (low, high) = (low.along(axis), high.along(axis));
            if !(low < high && low.is_finite() && high.is_finite()) {
                return Err(VolumeError { axis, low, high });
            }
        }
        Ok(Self { low, high })
    }

    /// The low corner.
    pub fn low(&self) -> Point {
        self.low
    }

    /// The high corner.
    pub fn high(&self) -> Point {
        self.high
    }

    /// Whether `point` is inside, ends included; never for a NaN.
    #[inline]
    pub fn contains(&self, point: Point) -> bool {
        let (p, low, high) = (point.array(), self.low.array(), self.high.array());
        (0..3).all(|k| p[k] >= low[k] && p[k] <= high[k])
    }

    /// The point inside that is nearest to `point`.
    pub fn nearest(&self, point: Point) -> Point {
        let inside = |axis: Axis| {
            let (low, high) = (self.low.along(axis), self.high.along(axis));
            Metres(point.along(axis).value().clamp(low.value(), high.value()))
        };
        Point::new(inside(Axis::X), inside(Axis::Y), inside(Axis::Z))
    }

    /// The point inside that is nearest to `point`, which may be so far outside.
    ///
    /// # Errors
    /// [`NoCorrection::Outside`](super::NoCorrection::Outside) when it is farther.
    #[inline]
    pub fn nearest_within(
        &self,
        point: Point,
        reach: Metres,
    ) -> Result<Point, super::NoCorrection> {
        let inside = self.nearest(point);
        if (point - inside).distance() > reach {
            return Err(self.outside(point));
        }
        Ok(inside)
    }

    /// Refuses what is outside, naming the axis.
    #[inline]
    pub(crate) fn check(&self, point: Point) -> Result<(), super::NoCorrection> {
        if self.contains(point) {
            Ok(())
        } else {
            Err(self.outside(point))
        }
    }

    #[cold]
    fn outside(&self, point: Point) -> super::NoCorrection {
        let wrong = |axis: &Axis| {
            let seen = point.along(*axis);
            !(seen >= self.low.along(*axis) && seen <= self.high.along(*axis))
        };
        let axis = *Axis::ALL.iter().find(|it| wrong(it)).unwrap_or(&Axis::X);
        super::NoCorrection::Outside {
            axis,
            seen: point.along(axis),
            low: self.low.along(axis),
            high: self.high.along(axis),
        }
    }
}

/// Refuses a deviation of which a component is beyond `limit`, or not a number.
#[inline]
pub(crate) fn check_size(deviation: V3, limit: f64) -> Result<(), super::NoCorrection> {
    let within = |k: usize| deviation[k].abs() <= limit;
    if within(0) & within(1) & within(2) {
        return Ok(());
    }
    let axis = *Axis::ALL
        .iter()
        .find(|axis| !within(axis.index()))
        .unwrap_or(&Axis::X);
    Err(super::NoCorrection::TooLarge {
        axis,
        seen: Metres(deviation[axis.index()]),
        limit: Metres(limit),
    })
}

/// Metres or radians along x, y, z.
pub(crate) type V3 = [f64; 3];

/// The same with a lane that is not used: two registers instead of one and a half.
pub(crate) type V4 = [f64; 4];

#[inline]
pub(crate) fn add(a: V3, b: V3) -> V3 {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

#[inline]
pub(crate) fn cross(a: V3, b: V3) -> V3 {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// What |a × b| can be at most, for magnitudes `a` and `b`.
pub(crate) fn cross_bound(a: V3, b: V3) -> V3 {
    [
        a[1] * b[2] + a[2] * b[1],
        a[2] * b[0] + a[0] * b[2],
        a[0] * b[1] + a[1] * b[0],
    ]
}
