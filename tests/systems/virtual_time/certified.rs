//! Laser and sensors that are off as their certificates say: what these correct is corrected with the right sign.

use std::path::Path;

use tests::certificate::{Certificate, day_from_now};
use tests::{Bench, Edit};
use truestage::linear::VerifyOptions;
use truestage::{CalibrateOptions, Failure};
use units::Metres;

/// By how much the emulated laser's wavelength is longer: 60 mm are counted 90 nm too short without its certificate.
const OFF_PPM: f64 = 1.5;
const NOMINAL_NM: f64 = 632.991_372;

fn section(folder: &Path, of: &str, certificate: &Certificate) -> String {
    let (path, serial) = (certificate.written(folder), &certificate.serial_number);
    format!("[instrument.laser.certificate.{of}]\nfile = {path:?}\nserial_number = {serial:?}\n")
}

fn laser(folder: &Path) -> String {
    let nm = NOMINAL_NM * (1.0 + OFF_PPM * 1e-6);
    section(
        folder,
        "wavelength",
        &Certificate::of_laser("LASER", nm, nm * 1e-9),
    )
}

/// A stage with these certificates and this emulation.
fn bench(seed: u64, sections: &str, emulated: &[(&str, &str)]) -> Bench {
    let machine = |text: String| text.edit("[axis.x.zero]", &format!("{sections}\n[axis.x.zero]"));
    Bench::with(seed, machine, |text| {
        emulated
            .iter()
            .fold(text, |text, (from, to)| text.edit_first(from, to))
    })
}

/// The deviation that a calibration says of 60 mm, and what its record says of certificates.
fn calibrated(mut bench: Bench) -> Result<(Metres, Vec<String>), Failure> {
    let store = bench.store.clone();
    bench.machine.guarded(|machine| {
        machine.start()?;
        machine.linear("x")?.zero(&store)?;
        let made = machine
            .linear("x")?
            .calibrate(&store, &CalibrateOptions::default())?;
        machine.shut_down()?;
        let last = *made.fitted.table.nodes().last().expect("it has positions");
        let certificates = made.record.head.instrument.certificates.iter();
        Ok((
            last.forward.expect("it was approached so"),
            certificates.map(|it| it.of.clone()).collect(),
        ))
    })
}

const LASER_OFF: (&str, &str) = ("wavelength_offset_ppm = 0.0", "wavelength_offset_ppm = 1.5");

/// The same stage, seen three times: by a laser that is right, by one that is off, and by that one with its certificate.
#[test]
fn what_a_laser_is_off_by_its_certificate_corrects_with_the_right_sign() {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    for seed in [5, 6] {
        let seen = |sections: &str, emulated: &[(&str, &str)]| {
            calibrated(bench(seed, sections, emulated))
                .unwrap_or_else(|failure| panic!("{failure}"))
        };
        let (right, none) = seen("", &[]);
        let (off, _) = seen("", &[LASER_OFF]);
        let (corrected, certificates) = seen(&laser(folder.path()), &[LASER_OFF]);
        assert_eq!(
            (none.len(), certificates.as_slice()),
            (0, &["wavelength".to_owned()][..])
        );
        // A longer wave is counted less often: what it measures seems shorter by 1.5 ppm of 60 mm.
        let shorter = (right - off).nm();
        assert!((shorter - 90.0).abs() < 15.0, "seed {seed}: {shorter} nm");
        let left = (right - corrected).nm();
        assert!(left.abs() < 15.0, "seed {seed}: {left} nm are left");
    }
}

/// The machine's thermometer shows 0.5 K too much, and so do the barometer and the air's thermometer, each as its
/// certificate says.
#[test]
fn what_sensors_are_off_by_their_certificates_correct_with_the_right_sign() {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let sensor = |of, serial, unit, readings: [f64; 2], error: f64, u| {
        let errors = [error; 2];
        section(
            folder.path(),
            of,
            &Certificate::of_sensor(serial, unit, (&readings, &errors), u),
        )
    };
    let certificates = [
        sensor(
            "material_temperature",
            "M",
            "\\degreecelsius",
            [10.0, 30.0],
            0.5,
            0.01,
        ),
        sensor(
            "air_temperature",
            "A",
            "\\kelvin",
            [283.15, 303.15],
            0.5,
            0.01,
        ),
        sensor(
            "pressure",
            "P",
            "\\hecto\\pascal",
            [900.0, 1100.0],
            -2.0,
            0.1,
        ),
        sensor("humidity", "H", "\\percent", [0.0, 100.0], 5.0, 0.5),
    ]
    .concat();
    let off = [(
        "noise_nm = 3.0\n",
        "noise_nm = 3.0\nstage_temperature_error_k = 0.5\nair_temperature_error_k = 0.5\npressure_error_hpa = -2.0\n\
         humidity_error_percent = 5.0\n",
    )];
    let seen = |sections: &str, emulated: &[(&str, &str)]| {
        let made = calibrated(bench(9, sections, emulated));
        made.unwrap_or_else(|failure| panic!("{failure}")).0
    };
    let right = seen("", &[]);
    let wrong = (right - seen("", &off)).nm();
    assert!(
        wrong.abs() > 250.0,
        "{wrong} nm: half a kelvin of steel alone is 345 nm of 60 mm"
    );
    let left = (right - seen(&certificates, &off)).nm();
    assert!(left.abs() < 20.0, "{left} nm are left");
}

#[test]
fn nothing_is_measured_by_what_has_an_expired_certificate_and_the_stage_moves_still() {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let mut expired = Certificate::of_laser("LASER", NOMINAL_NM, 1e-6);
    expired.days = (day_from_now(-800), day_from_now(-799));
    let mut bench = bench(3, &section(folder.path(), "wavelength", &expired), &[]);
    let store = bench.store.clone();
    bench.machine.start().expect("it starts");
    let mut machine = |what: &mut dyn FnMut(&mut truestage::Machine) -> Result<(), Failure>| {
        what(&mut bench.machine)
    };
    machine(&mut |it| it.linear("x")?.zero(&store).map(|_| ())).expect("a zero needs no laser");
    let moved = machine(&mut |it| it.linear("x")?.move_to(Metres::from_mm(10.0)).map(|_| ()));
    moved.expect("nor does a move");
    let options = CalibrateOptions::default();
    let refused = machine(&mut |it| it.linear("x")?.calibrate(&store, &options).map(|_| ()));
    let verify = VerifyOptions {
        compensated: false,
        calibration: None,
        resume: None,
    };
    let verified = machine(&mut |it| it.linear("x")?.verify(&store, &verify).map(|_| ()));
    for failure in [refused, verified].map(|it| it.expect_err("it has expired")) {
        assert_eq!(failure.exit_code(), 2);
        assert!(failure.to_string().contains("it has ended on"), "{failure}");
    }
    assert_eq!(store.list().expect("a folder"), Vec::<String>::new());
}

/// With another certificate the machine's calibrations are foreign; those made before there was one stay good.
#[test]
fn a_calibration_depends_on_the_certificate_that_it_was_made_with() {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let hash = |sections: &str| bench(3, sections, &[]).loaded.hash;
    let without = hash("");
    let first = hash(&laser(folder.path()));
    assert!(first.is(without.as_str()), "made before");
    let again = hash(&laser(folder.path()));
    assert_eq!(first, again);
    let other = Certificate::of_laser("LASER", NOMINAL_NM, 1e-6);
    let other = hash(&section(folder.path(), "wavelength", &other));
    assert!(!other.is(first.as_str()) && !without.is(first.as_str()));
}
