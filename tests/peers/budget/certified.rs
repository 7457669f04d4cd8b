//! GTC comes to the same uncertainty of a calibration's lengths, with certificates of laser and sensors and without.

use std::path::Path;

use compensator::budget::AxisBudget;
use serde_json::{Value, json};
use tests::certificate::Certificate;
use tests::{Bench, Edit};
use truestage::{CalibrateOptions, Failure};
use units::Metres;

use crate::peer::Peer;

/// What goes into a length: what a budget calls it, and whether with a certificate.
const LINES: [&str; 6] = [
    "wavelength or scale",
    "air temperature",
    "air pressure",
    "relative humidity",
    "material temperature",
    "coefficient of expansion",
];

/// Standard uncertainties that the certificates state: relative, K, Pa, 1, K.
const CERTIFIED: [f64; 5] = [3e-9, 0.015, 4.0, 0.006, 0.008];
/// What is taken without certificates (docs: the configuration's defaults).
const USUAL: [f64; 5] = [2e-8, 0.1, 20.0, 0.03, 0.1];
const WAVELENGTH_NM: f64 = 632.991_372;

/// The sections of certificates of everything.
fn sections(folder: &Path) -> String {
    let [relative, air, pressure, humidity, material] = CERTIFIED;
    let laser = Certificate::of_laser("L", WAVELENGTH_NM, WAVELENGTH_NM * relative);
    let sensor = |serial, unit, readings: [f64; 2], errors: [f64; 2], u| {
        Certificate::of_sensor(serial, unit, (&readings, &errors), u)
    };
    let all = [
        ("wavelength", laser),
        (
            "air_temperature",
            sensor("A", "\\degreecelsius", [10.0, 30.0], [0.0, 0.0], air),
        ),
        (
            "pressure",
            sensor(
                "P",
                "\\hecto\\pascal",
                [900.0, 1100.0],
                [0.0, 0.0],
                pressure * 1e-2,
            ),
        ),
        (
            "humidity",
            sensor("H", "\\percent", [10.0, 90.0], [0.0, 0.0], humidity * 1e2),
        ),
        (
            "material_temperature",
            sensor("M", "\\degreecelsius", [10.0, 30.0], [0.0, 0.0], material),
        ),
    ];
    let section = |(of, it): &(&str, Certificate)| {
        let (path, serial) = (it.written(folder), &it.serial_number);
        format!(
            "[instrument.laser.certificate.{of}]\nfile = {path:?}\nserial_number = {serial:?}\n"
        )
    };
    all.iter().map(section).collect()
}

/// The budget of a whole calibration, and the environment that it was made in.
fn calibrated(certificates: &str) -> (AxisBudget, Value) {
    let machine =
        |text: String| text.edit("[axis.x.zero]", &format!("{certificates}\n[axis.x.zero]"));
    let mut bench = Bench::with(11, machine, |text| text);
    let store = bench.store.clone();
    let made = bench.machine.guarded(|machine| {
        machine.start()?;
        machine.linear("x")?.zero(&store)?;
        let made = machine
            .linear("x")?
            .calibrate(&store, &CalibrateOptions::default())?;
        machine.shut_down()?;
        Ok(made)
    });
    let made = made.unwrap_or_else(|failure: Failure| panic!("{failure}"));
    let environment = &made.record.head.environment;
    (made.budget, json!(environment))
}

/// The share of a length of 60 mm that instrument and sensors leave uncertain, as the budget has it.
fn share(budget: &AxisBudget, suffix: &str) -> f64 {
    let far = Metres::from_mm(60.0);
    let lines = LINES.iter().map(|name| {
        let own = budget.contributions().iter();
        let name = match *name {
            "coefficient of expansion" => (*name).to_owned(),
            name => format!("{name}{suffix}"),
        };
        let own = own.filter(|it| it.name == name).collect::<Vec<_>>();
        assert_eq!(own.len(), 1, "{name}: {:?}", budget.contributions());
        own[0].share(far).value()
    });
    lines.map(|it| it * it).sum::<f64>().sqrt() / far.value()
}

fn task(environment: &Value, [relative, air, pressure, humidity, material]: [f64; 5]) -> Value {
    let of = |key: &str| environment[key].as_f64().expect("a sensor has said it");
    json!({
        "wavelength_m": [WAVELENGTH_NM * 1e-9, WAVELENGTH_NM * 1e-9 * relative],
        "air_c": [of("air_temperature_c"), air],
        "pressure_pa": [of("pressure_pa"), pressure],
        "humidity": [of("relative_humidity"), humidity],
        "material_c": [of("material_temperature_c"), material],
        "expansion": [11.5e-6, 1.15e-6],
    })
}

#[test]
fn gtc_comes_to_the_same_uncertainty_with_certificates_and_without() {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let (without, air) = calibrated("");
    let (with, certified_air) = calibrated(&sections(folder.path()));
    let mut peer = Peer::start("certified_budget.py", &[]);
    let tasks = json!([task(&air, USUAL), task(&certified_air, CERTIFIED)]);
    peer.feed(&tasks.to_string());
    let theirs = peer.report();
    let ours = [share(&without, ""), share(&with, ", by its certificate")];
    for (at, ours) in ours.iter().enumerate() {
        let theirs = theirs[at].as_f64().expect("a number");
        assert!(
            (ours / theirs - 1.0).abs() < 0.01,
            "{at}: {ours:e}, GTC {theirs:e}"
        );
    }
    assert!(
        ours[1] < 0.7 * ours[0],
        "what is left is the coefficient of expansion, which nothing here certifies: {ours:?}"
    );
}
