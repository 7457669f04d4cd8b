//! Lines to measure along: body and face diagonals of a work volume.
//!
//! Source: ISO 230-6: displacement tests along the four body diagonals and the six face
//! diagonals, of the tool along the diagonal.

use units::{Metres, Radians};

use crate::volumetric::{Axis, Point, Volume};

/// The four body diagonals, each of `count` points at even distances, starting at x low: with
/// (y, z) low and low, high and low, low and high, high and high. Fewer than 2 points count as 2.
///
/// # Example
///
/// ```
/// use compensator::volumetric::{Point, Volume, identify::body_diagonals};
///
/// let volume = Volume::new(Point::ZERO, Point::from_mm(600.0, 500.0, 400.0))?;
/// let [first, .., last] = body_diagonals(&volume, 3);
/// assert_eq!(first[1], Point::from_mm(300.0, 250.0, 200.0), "all meet in the middle");
/// assert_eq!(last[0], Point::from_mm(0.0, 500.0, 400.0));
/// # Ok::<(), compensator::volumetric::VolumeError>(())
/// ```
pub fn body_diagonals(volume: &Volume, count: usize) -> [Vec<Point>; 4] {
    core::array::from_fn(|at| {
        let from_high = [false, at % 2 == 1, at / 2 == 1];
        line(volume, from_high, [true; 3], count)
    })
}

/// The two diagonals of the face across `normal` at its low end, each of `count` points: both
/// start low in the first of the other two directions, then low or high in the second.
pub fn face_diagonals(volume: &Volume, normal: Axis, count: usize) -> [Vec<Point>; 2] {
    let second = normal.others()[1];
    core::array::from_fn(|at| {
        let (mut from_high, mut moves) = ([false; 3], [true; 3]);
        from_high[second.index()] = at == 1;
        moves[normal.index()] = false;
        line(volume, from_high, moves, count)
    })
}

fn line(volume: &Volume, from_high: [bool; 3], moves: [bool; 3], count: usize) -> Vec<Point> {
    let last = count.max(2) - 1;
    let (low, high) = (volume.low().array(), volume.high().array());
    let point = |at: usize| {
        let share = at as f64 / last as f64;
        Point::of(core::array::from_fn(|k| {
            let share = match (moves[k], from_high[k]) {
                (false, _) => 0.0,
                (true, false) => share,
                (true, true) => 1.0 - share,
            };
            low[k] + share * (high[k] - low[k])
        }))
    };
    (0..=last).map(point).collect()
}

/// The direction from the first to the last of `points`, of length 1; `None` when there is none.
pub fn direction(points: &[Point]) -> Option<[f64; 3]> {
    let way = *points.last()? - *points.first()?;
    let length = way.distance().value();
    (length > 0.0).then(|| way.array().map(|it| it / length))
}

/// The squareness of the second to the first direction of a face from the deviations of the
/// lengths of its two diagonals alone, when nothing else differs between them: the angle by which
/// the second axis is rotated from the first away, positive when it leans towards minus the
/// first. That is the squareness of y to x for the face across z, of z to y for the face across
/// x, and minus the squareness of z to x for the face across y.
///
/// The rising diagonal (both from low to high) shortens by c·ab/L, the falling one lengthens by
/// as much, with sides a and b and length L.
///
/// # Example
///
/// ```
/// use compensator::volumetric::identify::squareness_of_face_diagonals;
/// use units::Metres;
///
/// // Sides of 300 mm and 400 mm leaning by 10 µrad: 10e-6 · 0.3 · 0.4/0.5 m = 2.4 µm each.
/// let (rising, falling) = (Metres::from_um(-2.4), Metres::from_um(2.4));
/// let angle = squareness_of_face_diagonals(rising, falling, Metres(0.3), Metres(0.4));
/// assert!((angle.value() - 10e-6).abs() < 1e-15);
/// ```
pub fn squareness_of_face_diagonals(
    rising: Metres,
    falling: Metres,
    first_side: Metres,
    second_side: Metres,
) -> Radians {
    let (a, b) = (first_side.value(), second_side.value());
    let length = (a * a + b * b).sqrt();
    Radians((falling - rising).value() * length / (2.0 * a * b))
}
