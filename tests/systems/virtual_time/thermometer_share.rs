//! What a thermometer does not know is in the uncertainty that a move states: its own standard uncertainty times what a kelvin
//! does to the place.

use tests::volume::{Volume, calm, good};
use tests::{Bench, Edit};
use truestage::{CalibrateOptions, Failure};
use units::{Approach, Metres};

/// Standard uncertainties of a thermometer, kelvin.
const SURE_K: f64 = 0.1;
const UNSURE_K: f64 = 0.5;

/// What the square of a thermometer's uncertainty is more where it is unsure.
fn more_k2() -> f64 {
    UNSURE_K * UNSURE_K - SURE_K * SURE_K
}

#[track_caller]
fn check(what: &str, sure: Metres, unsure: Metres, metres_per_kelvin: f64) {
    let square = |it: Metres| it.value() * it.value();
    let (seen, expected) = (
        square(unsure) - square(sure),
        metres_per_kelvin * metres_per_kelvin * more_k2(),
    );
    assert!(
        (seen / expected - 1.0).abs() < 1e-3,
        "{what}: u² is {seen:e} m² more, not {expected:e}"
    );
}

/// What a move of a linear axis to `target` states, whose calibration had a thermometer of its scale so sure.
fn stated_of_linear(u_kelvin: f64, target: Metres) -> Metres {
    let machine = |text: String| {
        let known =
            format!("\n[instrument.laser.uncertainty]\nmaterial_temperature_k = {u_kelvin}\n");
        text.edit("\n[axis.x.zero]", &format!("{known}\n[axis.x.zero]"))
    };
    let mut bench = Bench::with(11, machine, |text| text);
    let store = bench.store.clone();
    let moved = bench.machine.guarded(|machine| {
        machine.start()?;
        machine.linear("x")?.zero(&store)?;
        let options = CalibrateOptions::default();
        machine.linear("x")?.calibrate(&store, &options)?;
        let moved = machine.linear("x")?.move_and_read(target)?;
        assert_eq!(moved.approach, Approach::Forward);
        Ok::<_, Failure>(moved)
    });
    let stated = good(moved).uncertainty.expect("it was calibrated there");
    stated.standard_uncertainty
}

/// 11.5e-6/K over 45 mm.
#[test]
fn a_linear_axis_is_as_sure_as_the_thermometer_of_its_scale() {
    let target = Metres::from_mm(45.0);
    let [sure, unsure] = [SURE_K, UNSURE_K].map(|it| stated_of_linear(it, target));
    check("x", sure, unsure, 11.5e-6 * target.value());
}

/// What three axes state of their tool at `target`, whose thermometers are so sure; no guide bends.
fn stated_of_three(u_kelvin: f64, target: [f64; 3]) -> [Metres; 3] {
    let machine = |text: String| {
        let known = format!("standard_uncertainty_k = {u_kelvin}");
        calm(text.edit("standard_uncertainty_k = 0.01", &known))
    };
    Volume::zeroed(12, machine, |text| text).stated_without_bends(target)
}

/// Two thermometers of each scale, 5 ppm/K each.
#[test]
fn three_axes_are_as_sure_as_the_thermometers_of_their_scales() {
    let target = [400.0, 300.0, 200.0];
    let [sure, unsure] = [SURE_K, UNSURE_K].map(|it| stated_of_three(it, target));
    for (k, axis) in ["x", "y", "z"].into_iter().enumerate() {
        let of_both = 2.0_f64.sqrt() * 5e-6 * target[k] * 1e-3;
        check(axis, sure[k], unsure[k], of_both);
    }
}
