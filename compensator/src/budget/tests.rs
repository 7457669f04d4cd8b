use proptest::prelude::*;

use super::*;

fn line(
    name: &str,
    (value, sensitivity, freedom): (f64, f64, f64),
    correlation: Correlation,
    approach: Option<Approach>,
) -> Contribution {
    Contribution {
        name: name.into(),
        evaluation: Evaluation::B,
        value,
        unit: "1".into(),
        sensitivity,
        degrees_of_freedom: freedom.is_finite().then_some(freedom),
        correlation,
        approach,
    }
}

const INFINITE: f64 = f64::INFINITY;

/// The axis of the golden numbers below.
fn golden() -> AxisBudget {
    use Correlation::{BetweenPositions, CommonOffset, CommonScale, Independent};
    let (forward, reverse) = (Some(Approach::Forward), Some(Approach::Reverse));
    let a_third = 3.0_f64.sqrt().recip();
    let lines = vec![
        line("1", (0.1, 11.5e-6, INFINITE), CommonScale, None),
        line("2", (1.15e-6, 0.8, INFINITE), CommonScale, None),
        line("3", (0.1, 9.3e-7, 8.0), CommonScale, None),
        line("4", (25e-9, 1.0, 42.0), CommonOffset, None),
        line("5", (31e-9, 1.0, 9.0), CommonOffset, None),
        line("6", (24e-9, a_third, 42.0), Independent, forward),
        line("7", (30e-9, a_third, 40.0), Independent, reverse),
        line("8", (12e-9, 1.0, 18.0), BetweenPositions, None),
    ];
    let positions = [0.0, 0.003, 0.006, 0.03, 0.06].map(Metres).to_vec();
    AxisBudget::new(lines, positions).unwrap()
}

fn close(seen: f64, expected: f64) -> bool {
    (seen - expected).abs() <= 1e-12 * expected.abs()
}

/// From GTC 1.5.1 (M. Hall, Measurement Standards Laboratory of New Zealand): each line of
/// [`golden`] is a `ureal(0, u, df)`. At a place x, w of an interval behind a position,
/// y = x·Σ c·scale + Σ c·offset + √(w² + (1 − w)²)·c·scatter + 4w(1 − w)·c·curve; then
/// `uncertainty(y)` and `dof(y)`. `tests/peers/budget.py` says the same.
#[test]
fn uncertainty_and_degrees_of_freedom_are_those_of_gtc() {
    let (forward, reverse) = (Approach::Forward, Approach::Reverse);
    for (x, approach, u, freedom) in [
        (
            0.0,
            forward,
            4.216_633_728_461_603_4e-8,
            28.027_616_282_035_705,
        ),
        (
            0.03,
            forward,
            6.113_750_158_454_301e-8,
            123.858_049_354_975_22,
        ),
        (
            0.06,
            forward,
            9.806_720_348_822_026e-8,
            819.127_402_265_309_9,
        ),
        (
            0.06,
            reverse,
            9.861_630_899_602_762e-8,
            827.570_289_590_605_4,
        ),
        (
            0.0045,
            forward,
            4.324_459_928_418_808e-8,
            30.871_184_258_149_118,
        ),
        (
            0.05,
            reverse,
            8.550_039_148_708_294e-8,
            471.316_390_716_360_96,
        ),
    ] {
        let seen = golden().at(Metres(x), approach).unwrap();
        assert!(close(seen.standard_uncertainty.value(), u), "{x}: {seen:?}");
        assert!(
            close(seen.degrees_of_freedom.unwrap(), freedom),
            "{x}: {seen:?}"
        );
    }
}

/// `get_covariance(y1, y2)` of the same script, with an input of its own for each position's scatter.
#[test]
fn covariances_are_those_of_gtc() {
    let (forward, reverse) = (Approach::Forward, Approach::Reverse);
    for (one, other, expected) in [
        ((0.03, forward), (0.06, forward), 5.505_588_199_999_999e-15),
        ((0.06, forward), (0.06, reverse), 9.425_176_399_999_998e-15),
        ((0.0045, forward), (0.004, forward), 1.849_195_882e-15),
    ] {
        let place = |it: (f64, Approach)| (Metres(it.0), it.1);
        let seen = golden().covariance(place(one), place(other)).unwrap();
        assert!(close(seen, expected), "{one:?} {other:?}: {seen:e}");
    }
}

#[test]
fn nothing_is_stated_beyond_the_calibrated_positions() {
    let budget = golden();
    for x in [-1e-9, 0.060_000_001, f64::NAN] {
        assert_eq!(budget.at(Metres(x), Approach::Forward), None);
    }
}

#[test]
fn numbers_that_no_uncertainty_has_are_refused_by_name() {
    let refused = |numbers| {
        let lines = vec![line("datum", numbers, Correlation::CommonOffset, None)];
        let error = AxisBudget::new(lines, vec![Metres(0.0), Metres(1.0)]).unwrap_err();
        error.to_string()
    };
    let said = refused((-1e-9, 1.0, INFINITE));
    assert_eq!(
        said,
        "uncertainty budget, `datum`: the standard uncertainty is -0.000000001"
    );
    assert!(refused((1e-9, f64::NAN, INFINITE)).contains("the sensitivity is NaN"));
    assert!(refused((1e-9, 1.0, 0.0)).contains("degrees of freedom is 0"));
    let backwards = AxisBudget::new(Vec::new(), vec![Metres(1.0), Metres(0.0)]);
    assert_eq!(backwards, Err(BudgetError::Positions));
}

proptest! {
    /// The variance of a difference is never negative, and a place has its own variance.
    #[test]
    fn covariances_form_a_covariance_matrix(a in 0.0..0.06_f64, b in 0.0..0.06_f64, same in any::<bool>()) {
        let budget = golden();
        let one = (Metres(a), Approach::Forward);
        let other = (Metres(b), if same { Approach::Forward } else { Approach::Reverse });
        let own = |it: (Metres, Approach)| budget.covariance(it, it).unwrap();
        let u = budget.at(one.0, one.1).unwrap().standard_uncertainty.value();
        prop_assert!(close(own(one), u * u));
        let both = budget.covariance(one, other).unwrap();
        prop_assert!(own(one) + own(other) - 2.0 * both >= -1e-9 * own(one));
    }
}
