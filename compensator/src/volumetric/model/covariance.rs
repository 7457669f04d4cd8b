//! How sure the errors found are of the tool, with all that they have in common.
//!
//! Errors that are found from the same readings depend on each other: where one comes out too large, another comes out too
//! small, and the tool is known far better than each of them. At a place the tool deviates by d + Ω × t, for an offset t
//! of the tool; the covariance of d and Ω there says how sure that is for any tool (GUM 5.2.2). It is known at places all
//! over the volume and drawn by straight lines between them: of an error that is straight there this is too much, never
//! too little.
//!
//! Absent: what the functions do between their nodes, which has nothing in common.

use units::Metres;

use crate::volumetric::point::V3;
use crate::volumetric::{Axis, Point};

/// d along x, y and z, then Ω about them.
const COMPONENTS: usize = 6;
/// The upper triangle, row by row.
pub const ENTRIES: usize = COMPONENTS * (COMPONENTS + 1) / 2;

/// What rounding makes of two errors that are one and the same.
const ROUNDING: f64 = 1e-6;

/// Why numbers are no covariance.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum CovarianceError {
    /// An axis with a single place, or one whose places do not increase.
    #[error("covariance: the places along {axis} must be two or more, increasing")]
    Positions {
        /// Which axis.
        axis: Axis,
    },
    /// Another number of places than the axes make.
    #[error("covariance: {seen} places where the axes make {wanted}")]
    Count {
        /// How many there are.
        seen: usize,
        /// How many there should be.
        wanted: usize,
    },
    /// A number that is none, a variance below zero, or more in common than there is.
    #[error(
        "covariance: place {place} has a value that is not finite, a variance below zero, or a covariance beyond both variances"
    )]
    Value {
        /// Which place, counted from 0.
        place: usize,
    },
}

/// The covariance of the errors at places of the volume, SI units.
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorCovariance {
    positions: [Vec<f64>; 3],
    places: Vec<[f64; ENTRIES]>,
    freedom: Option<f64>,
}

impl ErrorCovariance {
    /// Of places on a grid whose `positions` along x, y and z are given; `places` are in the order of x, then y, then z, z
    /// the fastest; each has the upper triangle of the covariance of d_x, d_y, d_z (metres), Ω_x, Ω_y, Ω_z (radians), row
    /// by row.
    ///
    /// # Errors
    /// When numbers do not fit, or are no variances.
    pub fn new(
        positions: [Vec<Metres>; 3],
        places: Vec<[f64; ENTRIES]>,
    ) -> Result<Self, CovarianceError> {
        let positions = positions.map(|all| all.into_iter().map(Metres::value).collect());
        for axis in Axis::ALL {
            let own: &Vec<f64> = &positions[axis.index()];
            let increases = own.windows(2).all(|pair| pair[0] < pair[1]);
            if own.len() < 2 || !increases || own.iter().any(|it| !it.is_finite()) {
                return Err(CovarianceError::Positions { axis });
            }
        }
        let wanted = positions.iter().map(Vec::len).product();
        if places.len() != wanted {
            let seen = places.len();
            return Err(CovarianceError::Count { seen, wanted });
        }
        match places.iter().position(|it| !is_sound(it)) {
            Some(place) => Err(CovarianceError::Value { place }),
            None => Ok(Self {
                positions,
                places,
                freedom: None,
            }),
        }
    }

    /// The same, known as well as an estimate of so many degrees of freedom; `None` for infinitely many.
    #[must_use]
    pub fn with_degrees_of_freedom(self, freedom: Option<f64>) -> Self {
        Self { freedom, ..self }
    }

    /// How well it is known; `None` for infinitely many degrees of freedom.
    pub const fn degrees_of_freedom(&self) -> Option<f64> {
        self.freedom
    }

    /// Where the places are along x, y and z.
    pub fn positions(&self) -> [Vec<Metres>; 3] {
        let metres = |own: &Vec<f64>| own.iter().copied().map(Metres).collect();
        self.positions.each_ref().map(metres)
    }

    /// The places, as [`Self::new`] takes them.
    pub fn places(&self) -> &[[f64; ENTRIES]] {
        &self.places
    }

    /// The variances of the tool's deviation along x, y and z at `at`, m²; beyond the places those of the nearest ones.
    pub(super) fn variances(&self, at: Point, tool: V3) -> V3 {
        let here = self.at(at);
        let [x, y, z] = tool;
        // (Ω × t)_x = Ω_y t_z − Ω_z t_y, and so on.
        let rows = [
            [1.0, 0.0, 0.0, 0.0, z, -y],
            [0.0, 1.0, 0.0, -z, 0.0, x],
            [0.0, 0.0, 1.0, y, -x, 0.0],
        ];
        rows.map(|row| propagated(&row, &here).max(0.0))
    }

    fn at(&self, at: Point) -> [f64; ENTRIES] {
        let [x, y, z] = Axis::ALL.map(|axis| {
            let own = &self.positions[axis.index()];
            shares(own, at.along(axis).value())
        });
        let (along_y, along_z) = (self.positions[1].len(), self.positions[2].len());
        let mut sum = [0.0; ENTRIES];
        for (i, of_x) in x {
            for (j, of_y) in y {
                for (k, of_z) in z {
                    let share = of_x * of_y * of_z;
                    let place = &self.places[(i * along_y + j) * along_z + k];
                    for (sum, value) in sum.iter_mut().zip(place) {
                        *sum += share * value;
                    }
                }
            }
        }
        sum
    }
}

/// The places on both sides of `position`, and how much each counts.
fn shares(positions: &[f64], position: f64) -> [(usize, f64); 2] {
    let after = positions.partition_point(|it| *it <= position);
    let after = after.clamp(1, positions.len() - 1);
    let (from, to) = (positions[after - 1], positions[after]);
    let share = ((position - from) / (to - from)).clamp(0.0, 1.0);
    [(after - 1, 1.0 - share), (after, share)]
}

fn propagated(row: &[f64; COMPONENTS], covariance: &[f64; ENTRIES]) -> f64 {
    let mut sum = 0.0;
    let mut entries = covariance.iter();
    for i in 0..COMPONENTS {
        for k in i..COMPONENTS {
            let entry = entries.next().copied().unwrap_or_default();
            let times = if i == k { 1.0 } else { 2.0 };
            sum += times * row[i] * row[k] * entry;
        }
    }
    sum
}

/// Finite, no variance below zero, and no two errors that have more in common than each has.
fn is_sound(covariance: &[f64; ENTRIES]) -> bool {
    let mut variances = [0.0; COMPONENTS];
    // The first entry of each row of the triangle.
    let mut at = 0;
    for (row, variance) in variances.iter_mut().enumerate() {
        *variance = covariance[at];
        at += COMPONENTS - row;
    }
    let pairs = (0..COMPONENTS).flat_map(|i| (i..COMPONENTS).map(move |k| (i, k)));
    let mut entries = covariance.iter().zip(pairs);
    entries.all(|(entry, (i, k))| {
        let most = variances[i] * variances[k] * (1.0 + ROUNDING);
        variances[i] >= 0.0 && entry.is_finite() && entry * entry <= most
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of d_x = a and Ω_z = b, which are the same error but for the sign: a tool 1 m along y does not feel them.
    fn opposed() -> [f64; ENTRIES] {
        let mut entries = [0.0; ENTRIES];
        entries[0] = 4e-12; // d_x, d_x
        entries[5] = 4e-12; // d_x, Ω_z
        entries[20] = 4e-12; // Ω_z, Ω_z
        entries
    }

    fn grid(places: Vec<[f64; ENTRIES]>) -> Result<ErrorCovariance, CovarianceError> {
        let ends = || vec![Metres(0.0), Metres(0.5)];
        ErrorCovariance::new([ends(), ends(), ends()], places)
    }

    #[test]
    fn errors_that_depend_on_each_other_may_cancel_at_the_tool() {
        let known = grid(vec![opposed(); 8]).unwrap();
        let at = Point::from_mm(200.0, 100.0, 300.0);
        let [x, y, z] = known.variances(at, [0.0; 3]);
        assert!((x - 4e-12).abs() < 1e-20 && y == 0.0 && z == 0.0);
        let [x, y, _] = known.variances(at, [0.0, 1.0, 0.0]);
        assert!(x.abs() < 1e-20 && y == 0.0, "{x}");
        let [x, y, _] = known.variances(at, [0.0, -1.0, 0.0]);
        assert!((x - 16e-12).abs() < 1e-20 && y == 0.0, "{x}");
        let [_, y, _] = known.variances(at, [0.5, 0.0, 0.0]);
        assert!((y - 1e-12).abs() < 1e-20, "{y}");
    }

    #[test]
    fn between_places_it_is_drawn_by_straight_lines_and_beyond_them_it_stays() {
        let mut places = vec![[0.0; ENTRIES]; 8];
        for place in &mut places[4..] {
            place[0] = 8e-12;
        }
        let known = grid(places).unwrap();
        for (x_mm, variance) in [(0.0, 0.0), (125.0, 2e-12), (500.0, 8e-12), (900.0, 8e-12)] {
            let at = Point::from_mm(x_mm, 40.0, 60.0);
            let [x, ..] = known.variances(at, [0.0; 3]);
            assert!((x - variance).abs() < 1e-20, "{x_mm} mm: {x}");
        }
    }

    #[test]
    fn what_is_no_covariance_is_refused_where_it_is() {
        let seen = grid(vec![opposed(); 7]).unwrap_err();
        assert_eq!(seen, CovarianceError::Count { seen: 7, wanted: 8 });
        let mut places = vec![opposed(); 8];
        places[3][0] = -1e-12;
        assert_eq!(grid(places), Err(CovarianceError::Value { place: 3 }));
        let mut places = vec![opposed(); 8];
        places[6][5] = 5e-12;
        assert_eq!(grid(places), Err(CovarianceError::Value { place: 6 }));
        let falls = || vec![Metres(0.1), Metres(0.0)];
        let seen = ErrorCovariance::new([falls(), falls(), falls()], vec![opposed(); 8]);
        assert_eq!(seen, Err(CovarianceError::Positions { axis: Axis::X }));
    }
}
