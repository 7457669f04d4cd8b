//! GTC computes the same uncertainties, degrees of freedom and covariances from the same budgets.

mod certified;
mod places;
mod tool_now;
mod zero;

use compensator::budget::{AxisBudget, Contribution, Correlation, Evaluation};
use serde_json::{Value, json};
use tests::random;
use units::{Approach, Metres};

use crate::peer::Peer;

const BUDGETS: u64 = 8;
/// What two programs may differ by in rounding.
const CLOSE: f64 = 1e-6;

const KINDS: [(Correlation, &str); 4] = [
    (Correlation::CommonScale, "common_scale"),
    (Correlation::CommonOffset, "common_offset"),
    (Correlation::Independent, "independent"),
    (Correlation::BetweenPositions, "between_positions"),
];

/// A budget by chance: each kind three times, for one approach, the other and both.
fn drawn(state: &mut u64) -> AxisBudget {
    let mut lines = Vec::new();
    for (correlation, name) in KINDS {
        for approach in [None, Some(Approach::Forward), Some(Approach::Reverse)] {
            let is_finite = random(state) < 0.7;
            // A scale is metres per metre: at 100 mm of the size of the others.
            let size = match correlation {
                Correlation::CommonScale => 1e-6,
                _ => 1e-7,
            };
            lines.push(Contribution {
                name: name.into(),
                evaluation: Evaluation::A,
                value: size * random(state),
                unit: "m".into(),
                sensitivity: 4.0 * random(state) - 2.0,
                degrees_of_freedom: is_finite.then(|| 1.0 + (40.0 * random(state)).floor()),
                correlation,
                approach,
            });
        }
    }
    let mut position = -0.02;
    let positions = core::iter::repeat_with(|| {
        position += 0.001 + 0.02 * random(state);
        Metres(position)
    });
    let positions = positions.take(8).collect();
    AxisBudget::new(lines, positions).expect("it is drawn from what can be")
}

fn place(budget: &AxisBudget, state: &mut u64) -> (Metres, Approach) {
    let positions = budget.positions();
    let (first, last) = (positions[0], positions[positions.len() - 1]);
    let at = match random(state) {
        it if it < 0.3 => positions[(random(state) * positions.len() as f64) as usize],
        _ => first + (last - first) * random(state),
    };
    let is_forward = random(state) < 0.5;
    let approach = if is_forward {
        Approach::Forward
    } else {
        Approach::Reverse
    };
    (at, approach)
}

fn as_json((at, approach): &(Metres, Approach)) -> Value {
    json!([at.value(), approach.symbol().to_string()])
}

fn task(budget: &AxisBudget, places: &[(Metres, Approach)]) -> Value {
    let name = |it: Correlation| KINDS.iter().find(|kind| kind.0 == it).map(|kind| kind.1);
    let lines = budget.contributions().iter().map(|it| {
        json!({
            "value": it.value,
            "sensitivity": it.sensitivity,
            "degrees_of_freedom": it.degrees_of_freedom,
            "correlation": name(it.correlation),
            "approach": it.approach.map(|it| it.symbol().to_string()),
        })
    });
    let pairs = places
        .windows(2)
        .map(|it| json!([as_json(&it[0]), as_json(&it[1])]));
    json!({
        "contributions": lines.collect::<Vec<_>>(),
        "positions": budget.positions().iter().map(|it| it.value()).collect::<Vec<_>>(),
        "places": places.iter().map(as_json).collect::<Vec<_>>(),
        "pairs": pairs.collect::<Vec<_>>(),
    })
}

#[track_caller]
fn assert_close(what: &str, ours: f64, theirs: &Value, scale: f64) {
    let theirs = theirs
        .as_f64()
        .unwrap_or_else(|| panic!("{what}: {theirs}"));
    assert!(
        (ours - theirs).abs() <= CLOSE * scale,
        "{what}: {ours:e}, GTC {theirs:e}"
    );
}

/// All budgets at once: GTC takes a second to begin.
#[test]
fn gtc_comes_to_the_same_uncertainties_degrees_of_freedom_and_covariances() {
    let budgets: Vec<_> = (1..=BUDGETS)
        .map(|seed| {
            let state = &mut (seed ^ 0x6774_6300);
            let budget = drawn(state);
            let places: Vec<_> = (0..20).map(|_| place(&budget, state)).collect();
            (budget, places)
        })
        .collect();
    let tasks: Vec<_> = budgets.iter().map(|it| task(&it.0, &it.1)).collect();
    let mut peer = Peer::start("budget.py", &[]);
    peer.feed(&Value::from(tasks).to_string());
    let reports = peer.finish();
    for (at, (budget, places)) in budgets.iter().enumerate() {
        check(budget, places, &reports[at]);
    }
}

fn check(budget: &AxisBudget, places: &[(Metres, Approach)], report: &Value) {
    let u = |it: &(Metres, Approach)| {
        let combined = budget.at(it.0, it.1).expect("it is within");
        (
            combined.standard_uncertainty.value(),
            combined.degrees_of_freedom,
        )
    };
    for (at, it) in places.iter().enumerate() {
        let (ours, freedom) = u(it);
        let theirs = &report["places"][at];
        assert_close("u", ours, &theirs[0], ours);
        match freedom {
            Some(ours) => assert_close("degrees of freedom", ours, &theirs[1], ours),
            None => assert_eq!(theirs[1], Value::Null),
        }
    }
    for (at, pair) in places.windows(2).enumerate() {
        let ours = budget
            .covariance(pair[0], pair[1])
            .expect("both are within");
        // Of nothing in common both make a zero but for rounding.
        let scale = u(&pair[0]).0 * u(&pair[1]).0;
        assert_close("covariance", ours, &report["pairs"][at], scale);
    }
}
