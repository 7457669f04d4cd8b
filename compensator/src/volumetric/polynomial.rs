//! A polynomial of an axis's position, and the places through which a spline runs like it.
//!
//! All coefficients have the unit of the value: the variable is (position − origin)/scale.
//!
//! Absent: fitting one.

use units::Metres;

use super::function::{Pieces, Shape};

/// c₀ + c₁·t + c₂·t² + … with t = (position − origin)/scale, for positions of a range.
///
/// # Example
///
/// ```
/// use compensator::volumetric::Polynomial;
/// use units::Metres;
///
/// // A bow of 10 µm: zero at both ends of 500 mm.
/// let bow = Polynomial {
///     origin: Metres(0.25),
///     scale: Metres(0.25),
///     coefficients: vec![10e-6, 0.0, -10e-6],
///     from: Metres(0.0),
///     to: Metres(0.5),
/// };
/// assert!(bow.at(Metres(0.5)).abs() < 1e-18);
/// let (positions, values) = bow.drawn(1e-9).expect("a spline is a cubic");
/// assert_eq!((positions[0], positions.len()), (Metres(0.0), values.len()));
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Polynomial {
    /// Where t is 0.
    pub origin: Metres,
    /// How far from there t is 1.
    pub scale: Metres,
    /// Of the powers 0, 1, 2 …, in the unit of the value.
    pub coefficients: Vec<f64>,
    /// The lowest position that it holds for.
    pub from: Metres,
    /// The highest.
    pub to: Metres,
}

/// Into how many stretches a range is divided at first, and at most.
const STRETCHES: usize = 4;
const STRETCHES_MAX: usize = 4096;
/// At how many places of a stretch the spline is compared.
const COMPARED: usize = 4;

impl Polynomial {
    /// Its value at `position`, also outside the range.
    pub fn at(&self, position: Metres) -> f64 {
        let t = (position - self.origin) / self.scale;
        let highest_first = self.coefficients.iter().rev();
        highest_first.fold(0.0, |sum, it| sum * t + it)
    }

    /// Positions over its range, and its values there, of which the spline is nowhere farther from it than
    /// `tolerance`; `None` when no reasonable number of them is enough, or a number is not finite.
    pub fn drawn(&self, tolerance: f64) -> Option<(Vec<Metres>, Vec<f64>)> {
        let mut stretches = STRETCHES;
        while stretches <= STRETCHES_MAX {
            let nodes = self.places(stretches);
            let values: Vec<f64> = nodes.iter().map(|it| self.at(*it)).collect();
            let plain: Vec<f64> = nodes.iter().map(|it| it.value()).collect();
            let spline = Pieces::new(&plain, &values, Shape::Spline).ok()?;
            let between = self.places(stretches * COMPARED);
            let off = |it: &Metres| (spline.at(it.value()) - self.at(*it)).abs();
            // A comparison with what is no number is false.
            if between.iter().all(|it| off(it) <= tolerance) {
                return Some((nodes, values));
            }
            stretches *= 2;
        }
        None
    }

    /// The ends of `stretches` equal parts of its range.
    fn places(&self, stretches: usize) -> Vec<Metres> {
        // Both ends exactly: a range that only just covers another one still does.
        let share = |it: usize| it as f64 / stretches as f64;
        let at = |it: usize| self.from * (1.0 - share(it)) + self.to * share(it);
        (0..=stretches).map(at).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volumetric::function::Function;

    /// t⁶ at both ends and beyond them, with an origin off the middle.
    fn steep() -> Polynomial {
        Polynomial {
            origin: Metres(0.1),
            scale: Metres(0.4),
            coefficients: vec![1e-6, -2e-6, 0.0, 3e-6, 0.0, 0.0, 40e-6],
            from: Metres(-0.05),
            to: Metres(0.5),
        }
    }

    #[test]
    fn its_value_is_the_sum_of_its_powers() {
        // t = 1: the sum of all coefficients; t = 0.5 by hand.
        assert!((steep().at(Metres(0.5)) - 42e-6).abs() < 1e-18);
        let half = 1e-6 - 1e-6 + 3e-6 / 8.0 + 40e-6 / 64.0;
        assert!((steep().at(Metres(0.3)) - half).abs() < 1e-18);
    }

    #[test]
    fn the_spline_through_what_is_drawn_is_the_polynomial_to_the_tolerance() {
        for tolerance in [1e-9, 1e-12] {
            let (nodes, values) = steep().drawn(tolerance).unwrap();
            let values: Vec<Metres> = values.into_iter().map(Metres).collect();
            let spline = Function::new(&nodes, &values, Shape::Spline).unwrap();
            let off = (0..=997).map(|n| {
                let at = Metres(-0.05 + 0.55 * f64::from(n) / 997.0);
                (spline.at(at).value() - steep().at(at)).abs()
            });
            let off = off.fold(0.0, f64::max);
            assert!(off < 1.5 * tolerance, "{off} with {} nodes", nodes.len());
        }
    }

    #[test]
    fn what_no_spline_draws_is_none() {
        let mut endless = steep();
        endless.coefficients[6] = f64::INFINITY;
        assert_eq!(endless.drawn(1e-9), None);
        endless.coefficients = vec![1e300, 1e300, 1e300, 1e300, 1e300];
        assert_eq!(endless.drawn(1e-9), None);
    }
}
