//! Three axes whose thermometers have certificates: what these correct is in what a calibration keeps, what they are
//! unsure of is in what a move states, and nothing is measured with one that has expired.

use std::path::Path;

use mock_bus::fault::{Fault, FaultConfig};
use tests::Edit;
use tests::certificate::{Certificate, day_from_now};
use tests::volume::{GEOMETRY, Volume, calm, good, quick};
use truestage::volumetric::{GeometryContent, VerifyBy, WarmUp};
use units::Metres;

/// The thermometer over the x guide, the first of the configuration, at the plant's terminals.
const OVER: usize = 26;
/// So much it shows too much.
const ERROR_K: f64 = 0.5;

/// What it shows from 10 to 30 °C is too much by `error` K, give or take `u`.
fn certificate(error: f64, u: f64) -> Certificate {
    let (readings, errors) = ([10.0, 30.0], [error; 2]);
    Certificate::of_sensor("T-1", "\\degreecelsius", (&readings, &errors), u)
}

/// The configuration `text` with this certificate, in `folder`, of the first thermometer.
fn with(text: &str, folder: &Path, certificate: &Certificate) -> String {
    let (path, serial) = (certificate.written(folder), &certificate.serial_number);
    let last = "expansion_ppm_per_k = [5.0, 0.0, 0.0]\n";
    let section = format!(
        "{last}\n[volumetric.temperature.certificate]\nfile = {path:?}\nserial_number = {serial:?}\n"
    );
    text.edit_first(last, &section)
}

/// It shows half a kelvin too much, and the calibration that it has part in is a good one.
#[test]
fn what_a_thermometer_shows_too_much_its_certificate_takes_out_of_the_record() {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let certified = certificate(ERROR_K, 0.01);
    let machine = |text: String| quick(with(&text, folder.path(), &certified));
    let mut volume = Volume::zeroed(14, machine, |text| text);
    let shown = Fault::InputShifted {
        channel: OVER,
        by: ERROR_K,
    };
    let shown = FaultConfig::permanent(shown);
    let injected = volume.bench.emulated.simulation_mut().inject(shown);
    let injected = injected.expect("the thermometer is there");
    let made = good(volume.calibrate(WarmUp::None));
    assert!(
        volume
            .bench
            .emulated
            .simulation()
            .fault_deliveries(injected)
            > 0
    );
    let store = volume.bench.store.clone();
    let record = good(store.load::<GeometryContent>(&made.id));
    let certificates = record.head.instrument.certificates.iter();
    let named: Vec<_> = certificates
        .map(|it| (it.of.as_str(), it.serial_number.as_str()))
        .collect();
    assert_eq!(named, [("temperature 0", "T-1")]);
    let right = volume.truth(|it| it.scale_temperature(0).value() + 0.5 * it.gradient_k(0));
    let kept = record.content.temperatures_c[0];
    // It has become warmer since.
    assert!(
        (kept - right).abs() < 0.2,
        "{kept} °C is kept of {right} °C"
    );
    // As `calibrate --verify` goes on.
    let mut hand = volume.bench.emulated.clone();
    let verified = volume
        .work()
        .verify(&store, VerifyBy::Everything, &mut hand);
    assert!(good(verified).is_within_tolerance());
    let in_use = store.active(GEOMETRY).expect("a pointer").current;
    assert_eq!(in_use, Some(made.id));
}

/// What a move states of the tool at `target` along x where that thermometer's certificate states `u` K; no guide bends.
fn stated(u: f64, target: [f64; 3]) -> Metres {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let machine = |text: String| calm(with(&text, folder.path(), &certificate(0.0, u)));
    Volume::zeroed(15, machine, |text| text).stated_without_bends(target)[0]
}

/// 5 ppm/K over 400 mm.
#[test]
fn what_a_thermometers_certificate_is_unsure_of_is_in_what_a_move_states() {
    let (sure_k, unsure_k, target) = (0.1, 0.4, [400.0, 300.0, 200.0]);
    let [sure, unsure] = [sure_k, unsure_k].map(|u| stated(u, target).value());
    let of_kelvin = 5e-6 * target[0] * 1e-3;
    let expected = of_kelvin * of_kelvin * (unsure_k * unsure_k - sure_k * sure_k);
    let seen = unsure * unsure - sure * sure;
    assert!(
        (seen / expected - 1.0).abs() < 1e-3,
        "u² is {seen:e} m² more, not {expected:e}"
    );
}

#[test]
fn an_expired_thermometer_is_told_before_anything_moves_and_nothing_is_stored() {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let expired = Certificate {
        days: (day_from_now(-800), day_from_now(-799)),
        ..certificate(0.0, 0.01)
    };
    let machine = |text: String| quick(with(&text, folder.path(), &expired));
    let mut volume = Volume::zeroed(16, machine, |text| text);
    let known = volume.know_errors();
    let store = volume.bench.store.clone();
    let scales = |volume: &Volume| volume.truth(|truth| truth.scales());
    let (before, began) = (scales(&volume), volume.bench.machine.now());
    let mut hand = volume.bench.emulated.clone();
    let calibrated = volume.calibrate(WarmUp::None).map(drop);
    let referenced = volume.work().reference(&store).map(drop);
    let by = VerifyBy::AsFound;
    let verified = volume.work().verify(&store, by, &mut hand).map(drop);
    for refused in [calibrated, referenced, verified] {
        let failure = refused.expect_err("it has expired");
        assert_eq!(failure.exit_code(), 2, "{failure}");
        let told = failure.to_string();
        for word in ["volumetric.temperature.0.certificate", "it has ended on"] {
            assert!(told.contains(word), "`{word}` is not in: {told}");
        }
    }
    assert_eq!(volume.bench.machine.now(), began, "it was not waited for");
    assert_eq!(scales(&volume), before);
    assert_eq!(
        store.list().expect("a folder"),
        std::slice::from_ref(&known)
    );
    assert_eq!(
        store.active(GEOMETRY).expect("a pointer").current,
        Some(known)
    );
}
