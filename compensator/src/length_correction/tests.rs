use core::time::Duration;

use units::Time;

use super::*;

fn environment() -> Environment {
    Environment {
        air_temperature: Celsius(20.0),
        pressure: Pascals(101_325.0),
        humidity: RelativeHumidity(0.5),
        material_temperature: Celsius(22.0),
    }
}

fn settings() -> Settings {
    Settings {
        air: true,
        vacuum_wavelength: Metres(633e-9),
        u_relative_wavelength: 2e-8,
        co2_umol_per_mol: 450.0,
        material_expansion: Some(MaterialExpansion {
            per_kelvin: 11.5e-6,
            u_per_kelvin: 1e-6,
        }),
        dead_path: Some(DeadPath {
            length: Metres(0.2),
            u_length: Metres(1e-3),
        }),
        cosine: Some(Cosine {
            angle: Radians(1e-3),
            u_angle: Radians(2e-4),
        }),
        u_environment: EnvironmentUncertainty {
            air_temperature: Celsius(0.1),
            pressure: Pascals(20.0),
            humidity: RelativeHumidity(0.05),
            material_temperature: Celsius(0.1),
            co2_umol_per_mol: 100.0,
        },
    }
}

fn off() -> Settings {
    Settings {
        air: false,
        material_expansion: None,
        dead_path: None,
        cosine: None,
        ..settings()
    }
}

fn correct(settings: Settings, optical: f64, now: &Environment) -> Corrected {
    let c = LengthCorrection::new(settings, &environment()).unwrap();
    c.correct(Metres(optical), now).unwrap()
}

fn check_nm(seen: Option<Metres>, expected: f64) {
    let seen = seen.unwrap().nm();
    assert!((seen - expected).abs() < 0.01, "{seen} nm");
}

#[test]
fn with_everything_off_the_length_is_the_optical_one() {
    let corrected = correct(off(), 0.06, &environment());
    assert_eq!(corrected.displacement, Metres(0.06));
    assert_eq!((corrected.index, corrected.terms), (1.0, Terms::default()));
}

/// n = 1.000271373 (NIST row): 60 mm/n − 60 mm = −60e6 nm·0.000271299 = −16 277.96 nm.
/// cos 1e-3: + L·5e-7 = 29.99 nm. 11.5e-6·2 K = 2.3e-5: −L·2.29995e-5 = −1379.6 nm.
#[test]
fn each_term_has_its_hand_worked_size() {
    let terms = correct(settings(), 0.06, &environment()).terms;
    assert!(
        (terms.air.unwrap().nm() + 16_277.96).abs() < 0.1,
        "{terms:?}"
    );
    check_nm(terms.dead_path, 0.0);
    check_nm(terms.cosine, 29.992);
    check_nm(terms.material, -1379.60);
}

#[test]
fn a_reflector_that_stands_still_reads_zero_when_the_air_changes() {
    // The phase of a dead path of 200 mm changes by D·(n − n₀) while nothing moves.
    let c = LengthCorrection::new(settings(), &environment()).unwrap();
    let warm = Environment {
        air_temperature: Celsius(21.5),
        ..environment()
    };
    let shift = index(&settings(), &warm).unwrap() - c.index_at_datum;
    assert!(shift < -1.3e-6);
    let seen = c.correct(Metres(0.2 * shift), &warm).unwrap();
    assert!(seen.displacement.abs().nm() < 1e-6, "{seen:?}");
    let without = correct(
        Settings {
            dead_path: None,
            ..settings()
        },
        0.2 * shift,
        &warm,
    );
    assert!(without.displacement.abs().nm() > 250.0);
}

#[test]
fn the_budget_names_every_source_and_combines_to_the_expected_size() {
    let c = LengthCorrection::new(settings(), &environment()).unwrap();
    let budget = c.budget(Metres(0.06), &environment()).unwrap();
    let of = |source| {
        budget
            .iter()
            .find(|line| line.source == source)
            .unwrap()
            .standard_uncertainty
            .nm()
    };
    assert_eq!(budget.len(), 10);
    assert!((of(Source::Wavelength) - 1.2).abs() < 0.01);
    assert!((of(Source::AirTemperature) - 5.6).abs() < 0.2);
    assert!((of(Source::Pressure) - 3.2).abs() < 0.1);
    assert!((of(Source::MaterialTemperature) - 69.0).abs() < 0.1);
    assert!((of(Source::ExpansionCoefficient) - 120.0).abs() < 0.1);
    assert!((of(Source::Cosine) - 12.0).abs() < 0.3);
    assert!(
        (combined(&budget).nm() - 139.3).abs() < 0.5,
        "{}",
        combined(&budget).nm()
    );
    let plain = LengthCorrection::new(off(), &environment()).unwrap();
    assert_eq!(plain.budget(Metres(0.06), &environment()).unwrap().len(), 1);
}

#[test]
fn a_sensor_out_of_range_is_named_and_never_replaced() {
    let c = LengthCorrection::new(settings(), &environment()).unwrap();
    for (broken, channel) in [
        (
            Environment {
                air_temperature: Celsius(-127.0),
                ..environment()
            },
            "air temperature",
        ),
        (
            Environment {
                pressure: Pascals(1013.25),
                ..environment()
            },
            "air pressure",
        ),
        (
            Environment {
                humidity: RelativeHumidity(45.0),
                ..environment()
            },
            "humidity",
        ),
        (
            Environment {
                material_temperature: Celsius(f64::NAN),
                ..environment()
            },
            "material temperature",
        ),
    ] {
        let error = c.correct(Metres(0.01), &broken).unwrap_err();
        assert!(error.to_string().contains(channel), "{error}");
    }
}

#[test]
fn impossible_settings_are_refused() {
    let refused = |s: Settings| LengthCorrection::new(s, &environment()).is_err();
    let ppm = MaterialExpansion {
        per_kelvin: 11.5,
        u_per_kelvin: 1.0,
    };
    assert!(refused(Settings {
        material_expansion: Some(ppm),
        ..settings()
    }));
    let degrees = Cosine {
        angle: Radians(0.5),
        u_angle: Radians(0.0),
    };
    assert!(refused(Settings {
        cosine: Some(degrees),
        ..settings()
    }));
    assert!(refused(Settings {
        air: false,
        ..settings()
    }));
}

#[test]
fn a_frozen_or_silent_sensor_is_found_out() {
    let second = |s| Time::from_seconds(s);
    let mut watch = EnvironmentWatch::new(Duration::from_secs(60), Duration::from_secs(5));
    assert!(matches!(
        watch.current(second(0.0)),
        Err(EnvironmentError::Stale { .. })
    ));
    for s in 0..=60 {
        let reading = Environment {
            air_temperature: Celsius(20.0 + f64::from(s) * 1e-3),
            humidity: RelativeHumidity(0.5 + f64::from(s) * 1e-4),
            material_temperature: Celsius(22.0 - f64::from(s) * 1e-3),
            ..environment()
        };
        watch.observe(second(f64::from(s)), reading).unwrap();
    }
    assert!(matches!(
        watch.current(second(66.0)),
        Err(EnvironmentError::Stale { .. })
    ));
    let error = watch.observe(second(61.0), environment()).unwrap_err();
    assert!(matches!(
        error,
        EnvironmentError::Frozen {
            channel: Channel::Pressure,
            ..
        }
    ));
    assert!(error.to_string().contains("frozen?"), "{error}");
}
