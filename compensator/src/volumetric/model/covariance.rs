//! How sure the errors found are of the tool, with all that they have in common.
//!
//! Errors that are found from the same readings depend on each other: where one comes out too large, another comes out too
//! small, and the tool is known far better than each of them. At a place the tool deviates by d + Ω × t, for an offset t
//! of the tool; the covariance of d and Ω there says how sure that is for any tool (GUM 5.2.2). It is known at places all
//! over the volume and drawn by straight lines between them: of an error that is straight there this is too much, never
//! too little.
//!
//! Thermal coefficients that were found with the errors have their part in it ([`CoefficientCovariance`]).
//!
//! Absent: what the functions do between their nodes, which has nothing in common.

use units::Metres;

use super::coefficients::{COMPONENTS, Coefficient, CoefficientCovariance};
use crate::volumetric::point::V3;
use crate::volumetric::{Axis, Point};

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
    /// Thermal coefficients that do not fit.
    #[error(
        "covariance: a thermal coefficient is there twice, or there are not as many numbers as coefficients and places make, or one is no correlation"
    )]
    Coefficients,
}

/// The covariance of the errors at places of the volume, SI units.
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorCovariance {
    positions: [Vec<f64>; 3],
    places: Vec<[f64; ENTRIES]>,
    warmth: CoefficientCovariance,
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
                warmth: CoefficientCovariance::default(),
                positions,
                places,
                freedom: None,
            }),
        }
    }

    /// The same with thermal coefficients that were found together with the errors.
    ///
    /// # Errors
    /// When numbers do not fit, or are no covariances of these errors.
    pub fn with_coefficients(self, warmth: CoefficientCovariance) -> Result<Self, CovarianceError> {
        if warmth.coefficients.is_empty() {
            return Ok(self);
        }
        if !warmth.fits(self.places.len()) {
            return Err(CovarianceError::Coefficients);
        }
        match warmth.wrong_place(self.places.iter().map(variances_of)) {
            Some(place) => Err(CovarianceError::Value { place }),
            None => Ok(Self { warmth, ..self }),
        }
    }

    /// What it knows of thermal coefficients; nothing of none.
    pub const fn warmth(&self) -> &CoefficientCovariance {
        &self.warmth
    }

    /// The thermal coefficients that it knows of.
    pub(super) fn coefficients(&self) -> &[Coefficient] {
        &self.warmth.coefficients
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
    /// `warm`: what each coefficient moves the tool by there, in its order, when it is off by its standard uncertainty.
    pub(super) fn variances(&self, at: Point, tool: V3, warm: &[V3]) -> V3 {
        let here = self.at(at);
        let [x, y, z] = tool;
        // (Ω × t)_x = Ω_y t_z − Ω_z t_y, and so on.
        let rows = [
            [1.0, 0.0, 0.0, 0.0, z, -y],
            [0.0, 1.0, 0.0, -z, 0.0, x],
            [0.0, 0.0, 1.0, y, -x, 0.0],
        ];
        let mut variances = rows.map(|row| propagated(&row, &here));
        for (number, effect) in warm.iter().enumerate() {
            let crossed = self.crossed(number, at);
            for (k, row) in rows.iter().enumerate() {
                let shared: f64 = row.iter().zip(&crossed).map(|(a, b)| a * b).sum();
                let others = warm.iter().enumerate();
                let others =
                    others.map(|(other, it)| it[k] * self.warmth.correlation(number, other));
                variances[k] += effect[k] * (2.0 * shared + others.sum::<f64>());
            }
        }
        variances.map(|it| it.max(0.0))
    }

    /// The covariance of errors with the coefficient of this number.
    fn crossed(&self, number: usize, at: Point) -> [f64; COMPONENTS] {
        let mut sum = [0.0; COMPONENTS];
        self.each_share(at, |place, share| {
            let own = &self.warmth.with_errors[place][number];
            for (sum, value) in sum.iter_mut().zip(own) {
                *sum += share * value;
            }
        });
        sum
    }

    fn at(&self, at: Point) -> [f64; ENTRIES] {
        let mut sum = [0.0; ENTRIES];
        self.each_share(at, |place, share| {
            for (sum, value) in sum.iter_mut().zip(&self.places[place]) {
                *sum += share * value;
            }
        });
        sum
    }

    /// Tells `each` of every place about `at`, and how much it counts.
    fn each_share(&self, at: Point, mut each: impl FnMut(usize, f64)) {
        let [x, y, z] = Axis::ALL.map(|axis| {
            let own = &self.positions[axis.index()];
            shares(own, at.along(axis).value())
        });
        let (along_y, along_z) = (self.positions[1].len(), self.positions[2].len());
        for (i, of_x) in x {
            for (j, of_y) in y {
                for (k, of_z) in z {
                    each((i * along_y + j) * along_z + k, of_x * of_y * of_z);
                }
            }
        }
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
    let variances = variances_of(covariance);
    let pairs = (0..COMPONENTS).flat_map(|i| (i..COMPONENTS).map(move |k| (i, k)));
    let mut entries = covariance.iter().zip(pairs);
    entries.all(|(entry, (i, k))| {
        let most = variances[i] * variances[k] * (1.0 + ROUNDING);
        variances[i] >= 0.0 && entry.is_finite() && entry * entry <= most
    })
}

/// The first entry of each row of the triangle.
fn variances_of(covariance: &[f64; ENTRIES]) -> [f64; COMPONENTS] {
    let mut at = 0;
    core::array::from_fn(|row| {
        let variance = covariance[at];
        at += COMPONENTS - row;
        variance
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
        let [x, y, z] = known.variances(at, [0.0; 3], &[]);
        assert!((x - 4e-12).abs() < 1e-20 && y == 0.0 && z == 0.0);
        let [x, y, _] = known.variances(at, [0.0, 1.0, 0.0], &[]);
        assert!(x.abs() < 1e-20 && y == 0.0, "{x}");
        let [x, y, _] = known.variances(at, [0.0, -1.0, 0.0], &[]);
        assert!((x - 16e-12).abs() < 1e-20 && y == 0.0, "{x}");
        let [_, y, _] = known.variances(at, [0.5, 0.0, 0.0], &[]);
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
            let [x, ..] = known.variances(at, [0.0; 3], &[]);
            assert!((x - variance).abs() < 1e-20, "{x_mm} mm: {x}");
        }
    }

    /// An expansion along x that is too small where both errors are too large, by as many standard uncertainties.
    fn grown() -> CoefficientCovariance {
        let own = [-2e-6, 0.0, 0.0, 0.0, 0.0, -2e-6];
        CoefficientCovariance {
            coefficients: vec![Coefficient::Expansion(Axis::X)],
            correlations: vec![1.0],
            with_errors: vec![vec![own]; 8],
        }
    }

    #[test]
    fn a_coefficient_that_is_too_small_where_errors_are_too_large_leaves_a_warm_tool_surer() {
        let known = grid(vec![opposed(); 8]).unwrap();
        let known = known.with_coefficients(grown()).unwrap();
        let at = Point::from_mm(200.0, 100.0, 300.0);
        for (grows_um, left) in [(0.0, 4e-12), (1.0, 1e-12), (2.0, 0.0), (6.0, 16e-12)] {
            let warm = [[grows_um * 1e-6, 0.0, 0.0]];
            let [x, y, z] = known.variances(at, [0.0; 3], &warm);
            assert!((x - left).abs() < 1e-20 && y == 0.0 && z == 0.0, "{x}");
            let [x, ..] = known.variances(at, [0.0, 1.0, 0.0], &warm);
            assert!(
                (x - grows_um * grows_um * 1e-12).abs() < 1e-20,
                "{x}: it has its own alone"
            );
        }
    }

    #[test]
    fn coefficients_that_are_no_covariance_are_refused() {
        let known = || grid(vec![opposed(); 8]).unwrap();
        let refused = |change: &dyn Fn(&mut CoefficientCovariance)| {
            let mut own = grown();
            change(&mut own);
            known().with_coefficients(own).unwrap_err()
        };
        let wrong = CovarianceError::Coefficients;
        assert_eq!(refused(&|it| it.correlations = vec![0.5]), wrong);
        assert_eq!(refused(&|it| it.correlations = vec![f64::NAN]), wrong);
        assert_eq!(refused(&|it| it.with_errors.truncate(7)), wrong);
        let twice = |it: &mut CoefficientCovariance| {
            it.coefficients = vec![Coefficient::Expansion(Axis::X); 2];
            it.correlations = vec![1.0; 4];
        };
        assert_eq!(refused(&twice), wrong);
        let too_much = |it: &mut CoefficientCovariance| it.with_errors[5][0][0] = -3e-6;
        assert_eq!(refused(&too_much), CovarianceError::Value { place: 5 });
        let too_few = |it: &mut CoefficientCovariance| it.with_errors[2].clear();
        assert_eq!(refused(&too_few), CovarianceError::Value { place: 2 });
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
