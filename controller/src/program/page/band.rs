//! The uncertainty of a curve, as a band around it that is wide enough to be seen.

use super::chart::{Mark, Series};

/// A band counts as seen when its half width is this share of what the curves range over: some
/// pixels more than the curve's own width.
pub(crate) const SEEN_SHARE: f64 = 0.02;
/// An enlarged band is no wider to each side than this share.
pub(crate) const WIDE_SHARE: f64 = 0.06;
/// What makes bands visible where uncertainties are a millionth of what they belong to.
pub(crate) const FACTOR_MAX: f64 = 1e6;

/// One place of a curve: where, what it is there, and its standard uncertainty.
pub(crate) type Sure = (f64, f64, f64);

/// By how much the bands of these curves must be enlarged to be seen beside them: 1, or 2, 5, 10 and
/// so on. One factor for all curves of a chart, which is said beside it ([`said`]).
pub(crate) fn enlargement<'a>(curves: impl Iterator<Item = &'a [Sure]> + Clone) -> f64 {
    let values = curves.clone().flatten().map(|it| it.1).chain([0.0]);
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), it| {
        (low.min(it), high.max(it))
    });
    let widest = curves.flatten().map(|it| 2.0 * it.2).fold(0.0, f64::max);
    let range = high - low;
    // Also where nothing is known, or nothing is wrong.
    let is_hidden = widest > 0.0 && widest < SEEN_SHARE * range;
    if !is_hidden {
        return 1.0;
    }
    let room = (WIDE_SHARE * range / widest).min(FACTOR_MAX);
    let power = 10_f64.powf(room.log10().floor());
    let factors = [5.0, 2.0, 1.0];
    let factor = factors.into_iter().find(|it| it * power <= room);
    factor.unwrap_or(1.0) * power
}

/// What is read beside a chart whose bands are enlarged.
pub(crate) fn said(factor: f64) -> String {
    let enlarged = match factor > 1.0 {
        true => format!(", enlarged {factor:.0} times to be seen"),
        false => String::new(),
    };
    format!("<p class=\"note\">Shaded: twice the standard uncertainty to both sides{enlarged}.</p>")
}

/// The band of `curve`, which is drawn before the curve itself.
pub(crate) fn band(
    name: &'static str,
    colour: &'static str,
    curve: &[Sure],
    factor: f64,
) -> Series {
    let edge = |sign: f64| {
        let at = move |(x, y, u): &Sure| (*x, y + sign * 2.0 * factor * u);
        curve.iter().map(at)
    };
    // The upper edge, then the lower one backwards.
    Series {
        name,
        colour,
        mark: Mark::Band,
        points: edge(1.0).chain(edge(-1.0).rev()).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(curve: &[Sure], expected: f64) {
        let factor = enlargement([curve].into_iter());
        assert!((factor / expected - 1.0).abs() < 1e-9, "{factor}");
    }

    #[test]
    fn a_band_that_nobody_would_see_is_enlarged_by_a_round_number_that_is_said() {
        // 0.05 of 20 to each side: 24 times would be 6 %.
        check(&[(0.0, -10.0, 0.025), (1.0, 10.0, 0.02)], 20.0);
        check(&[(0.0, -10.0, 0.5), (1.0, 10.0, 0.5)], 1.0);
        check(&[(0.0, 0.0, 0.5), (1.0, 0.0, 0.5)], 1.0);
        check(&[(0.0, -1.0, 0.0), (1.0, 1.0, 0.0)], 1.0);
        check(&[], 1.0);
        check(&[(0.0, 1.0, 1e-12)], 1e6);
        assert!(said(20.0).contains("enlarged 20 times") && !said(1.0).contains("enlarged"));
    }

    #[test]
    fn a_band_goes_round_its_curve() {
        let band = band("2 u", "red", &[(0.0, 1.0, 0.1), (1.0, 2.0, 0.2)], 10.0);
        assert_eq!(
            band.points,
            [(0.0, 3.0), (1.0, 6.0), (1.0, -2.0), (0.0, -1.0)]
        );
    }
}
