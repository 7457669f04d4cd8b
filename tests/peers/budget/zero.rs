//! The budget of a Hall zero, computed again: by GTC from its record, and by GTC from where each pass finds the origin.

use compensator::hall_zero::{HallPoint, Pass, RefineOptions, refine, refine_passes};
use serde_json::json;
use tests::normal;
use truestage::for_tests::{zero_budget, zero_budget_record};
use units::{Approach, Metres, Volts};

use super::assert_close;
use super::places::{check_freedom, check_record};

/// The drive's counts, metres.
const COUNT: f64 = 10e-9;
/// Three forward, two in reverse.
const PASSES: usize = 5;

/// Both voltages over a group of three magnets and one of two, in millimetres from the origin.
fn volts(mm: f64) -> [f64; 2] {
    let lobe = |centre: f64| (1.0 + ((mm - centre) / 0.7).powi(2)).powf(-1.5);
    let even = lobe(0.0) - 0.6 * (lobe(-1.1) + lobe(1.1));
    [2.0 + 0.95 * even, 2.5 + 0.75 * (lobe(0.6) - lobe(-0.6))]
}

/// Passes that repeat to 80 nm, with 2 µm of lost motion.
fn passes() -> Vec<Pass> {
    let state = &mut 41;
    let pass = |number: usize| {
        let is_forward = number.is_multiple_of(2);
        let sign = if is_forward { 1.0 } else { -1.0 };
        let shift_mm = 80e-6 * normal(state) - sign * 1e-3;
        let point = |step: i32| {
            let mm = sign * f64::from(step) * 5e-3;
            let [peak, slope] = volts(mm + shift_mm);
            HallPoint {
                position: Metres::from_mm(mm),
                peak: Volts(peak + 2e-4 * normal(state)),
                slope: Volts(slope + 2e-4 * normal(state)),
            }
        };
        let points = (-200..=200).map(point).collect();
        let approach = match is_forward {
            true => Approach::Forward,
            false => Approach::Reverse,
        };
        Pass { approach, points }
    };
    (0..PASSES).map(pass).collect()
}

#[test]
fn gtc_comes_to_the_budget_of_a_zero_from_its_record_and_from_its_passes() {
    let passes = passes();
    let options = RefineOptions::default();
    let zero = refine_passes(&passes, &options).expect("they tell it");
    let budget = zero_budget(&zero, COUNT, Metres::ZERO).expect("its figures are finite");
    let record = zero_budget_record(&budget, zero.origin);
    let origin = |it: &Pass| {
        let found = refine(&it.points, &options);
        found.expect("each tells it").origin.value()
    };
    let origins = [Approach::Forward, Approach::Reverse].map(|side| {
        let own = passes.iter().filter(|it| it.approach == side);
        own.map(origin).collect::<Vec<f64>>()
    });
    let task = json!({"of": "zero", "origins": origins, "count": COUNT});
    let again = check_record(&json!({"budget": record}), task);
    let combined = budget.at(0);
    let u = combined.standard_uncertainty.value();
    assert_close("origin", zero.origin.value(), &again[0], u);
    assert_close("u of the zero", u, &again[1], u);
    check_freedom(&json!(combined.degrees_of_freedom), &again[2]);
    assert!(combined.degrees_of_freedom.is_some_and(|it| it > 3.0));
}
