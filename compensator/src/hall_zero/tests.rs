//! Whole searches on the tests' own stage.

use core::time::Duration;

use units::{Metres, Time, Volts};

use super::rig::{Magnets, Noise, Stage};
use super::*;

fn found(progress: Progress) -> Outcome {
    match progress {
        Progress::Found(outcome) => *outcome,
        Progress::Failed(failure) => panic!("not found: {failure}"),
        Progress::Move { .. } | Progress::Stand => panic!("not at its end"),
    }
}

fn failure(progress: Progress) -> SearchFailure {
    match progress {
        Progress::Failed(failure) => *failure,
        Progress::Found(outcome) => panic!("did not fail: found {:?}", outcome.p0),
        Progress::Move { .. } | Progress::Stand => panic!("not at its end"),
    }
}

fn search(magnets: Magnets, seed: u64) -> (Outcome, f64) {
    let mut stage = Stage::new(magnets, seed);
    let nominal_error = stage.noise.within(0.1e-3);
    let outcome = found(stage.zero(Settings::default(), nominal_error));
    (outcome, stage.origin())
}

#[test]
fn the_search_follows_the_patent_to_a_zero_within_its_bands() {
    let settings = Settings::default();
    for seed in 0..20 {
        let magnets = Magnets::drifted(&mut Noise(seed), 0.0);
        let (outcome, origin) = search(magnets, seed);
        let Outcome {
            peak_max,
            g1,
            g2,
            p0,
            ..
        } = &outcome;
        assert!((*peak_max - settings.vc - g1.peak).abs() <= settings.delta1);
        assert!((g2.peak - g1.peak).abs() <= settings.delta2);
        let mid = (g1.slope + g2.slope) / 2.0;
        assert!((p0.slope - mid).abs() <= settings.delta3);
        assert!((p0.peak - *peak_max).abs() <= settings.delta4);
        assert!(g1.position < p0.position && p0.position < g2.position);
        assert!((p0.position.value() - origin).abs() < 5e-6, "seed {seed}");
        assert!(
            outcome.elapsed < Duration::from_secs(30),
            "{:?}",
            outcome.elapsed
        );
    }
}

/// The acceptance of the project: the origin repeats within 60 nm (1 σ) over random drift.
#[test]
fn the_refined_origin_repeats_within_60_nm_while_one_threshold_moves_by_tens_of_micrometres() {
    let settings = Settings::default();
    let (mut squares, mut chi, mut threshold_squares) = (0.0, 0.0, 0.0);
    let runs = 100;
    for seed in 0..runs {
        let magnets = Magnets::drifted(&mut Noise(1000 + seed), 0.0);
        let (outcome, origin) = search(magnets, seed);
        let zero = outcome.refine(&settings).unwrap();
        let error = zero.origin.value() - origin;
        squares += error * error;
        chi += (error / zero.standard_uncertainty.value()).powi(2);
        let points: Vec<HallPoint> = outcome.samples.iter().map(Sample::point).collect();
        let ideal = Volts(Magnets::IDEAL.offset[1]);
        let single = single_threshold_zero(&points, ideal, Metres(50e-6)).unwrap();
        threshold_squares += (single.value() - origin).powi(2);
    }
    let n = runs as f64;
    let (rms, chi) = ((squares / n).sqrt(), chi / n);
    let threshold = (threshold_squares / n).sqrt();
    println!(
        "refined {:.1} nm rms, chi²/n {chi:.2}, single {:.1} um",
        rms * 1e9,
        threshold * 1e6
    );
    assert!(rms < 60e-9, "{:.1} nm", rms * 1e9);
    assert!((0.6..1.5).contains(&chi), "chi²/n = {chi}");
    assert!(threshold > 20e-6);
}

#[test]
fn a_change_of_parallelism_moves_the_origin_by_less_than_300_nm() {
    let mut worst = 0.0_f64;
    for seed in 0..40 {
        let magnets = Magnets::drifted(&mut Noise(3000 + seed), 1e-4);
        let (outcome, origin) = search(magnets, seed);
        let zero = outcome.refine(&Settings::default()).unwrap();
        worst = worst.max((zero.origin.value() - origin).abs());
    }
    println!("worst with tilt {:.1} nm", worst * 1e9);
    assert!(worst < 300e-9, "{:.1} nm", worst * 1e9);
}

#[test]
fn voltages_older_than_the_position_do_not_move_the_origin() {
    for lag in [-3e-3, 4e-3] {
        let mut squares = 0.0;
        for seed in 0..20 {
            let mut stage = Stage::new(Magnets::IDEAL, 500 + seed);
            stage.lag = lag;
            let origin = stage.origin();
            let zero = found(stage.zero(Settings::default(), 0.0))
                .refine(&Settings::default())
                .unwrap();
            squares += (zero.origin.value() - origin).powi(2);
            // 5 ms between samples.
            let seen = zero.lag_samples.unwrap() * 5e-3;
            assert!((seen - lag).abs() < 0.2e-3, "lag {lag} seen as {seen}");
        }
        let rms = (squares / 20.0_f64).sqrt();
        assert!(rms < 60e-9, "lag {lag}: {:.1} nm", rms * 1e9);
    }
}

fn check_fault(spoil: fn(&mut Sample), expected: &str) {
    for seed in 0..6 {
        let mut stage = Stage::new(Magnets::drifted(&mut Noise(seed), 1e-4), seed);
        stage.spoil = spoil;
        let nominal_error = stage.noise.within(0.1e-3);
        let failure = failure(stage.zero(Settings::default(), nominal_error));
        let text = failure.to_string();
        assert!(text.contains(expected), "seed {seed}: {text}");
        assert!(text.starts_with("hall zero, "), "{text}");
    }
}

#[test]
fn an_open_wire_is_named() {
    check_fault(
        |s| s.peak = Volts(0.3 + ((s.at.nanos() / 1_000_000) % 7) as f64 * 1e-4),
        "peak sensor stays at 0.300",
    );
    check_fault(
        |s| s.slope = Volts(0.3 + ((s.at.nanos() / 1_000_000) % 7) as f64 * 1e-4),
        "slope sensor stays at 0.300",
    );
}

#[test]
fn a_sensor_at_a_rail_is_named() {
    check_fault(
        |s| s.peak = Volts(5.0),
        "peak sensor is saturated at 5.0000 V",
    );
    check_fault(
        |s| s.slope = Volts(0.0),
        "slope sensor is saturated at 0.0000 V",
    );
    check_fault(
        |s| s.peak = s.peak.min(Volts(2.0)).max(Volts(0.1)),
        "ADC stuck",
    );
}

#[test]
fn a_stuck_adc_is_named() {
    check_fault(
        |s| s.peak = Volts(2.125),
        "peak sensor reads exactly 2.1250 V",
    );
    check_fault(
        |s| s.slope = Volts(2.125),
        "slope sensor reads exactly 2.1250 V",
    );
}

#[test]
fn swapped_wires_are_named() {
    check_fault(
        |s| core::mem::swap(&mut s.peak, &mut s.slope),
        "the two sensors look swapped",
    );
}

#[test]
fn an_inverted_sensor_is_named() {
    check_fault(
        |s| s.peak = Volts(5.0) - s.peak,
        "peak sensor looks inverted",
    );
    check_fault(
        |s| s.slope = Volts(5.0) - s.slope,
        "slope sensor looks inverted",
    );
}

#[test]
fn a_sound_stage_is_never_called_broken() {
    for seed in 0..60 {
        let magnets = Magnets::drifted(&mut Noise(7000 + seed), 1e-4);
        let mut stage = Stage::new(magnets, seed);
        let nominal_error = stage.noise.within(0.25e-3);
        found(stage.zero(Settings::default(), nominal_error));
    }
}

#[test]
fn an_axis_that_obeys_two_cycles_late_creeps_back_into_its_bands() {
    for seed in 0..20 {
        let mut stage = Stage::new(Magnets::drifted(&mut Noise(11_000 + seed), 1e-4), seed);
        stage.latency = 2;
        let origin = stage.origin();
        let outcome = found(stage.zero(Settings::default(), 0.1e-3));
        assert!(
            outcome.restarts > 0 && outcome.restarts < 60,
            "{}",
            outcome.restarts
        );
        let zero = outcome.refine(&Settings::default()).unwrap();
        assert!((zero.origin.value() - origin).abs() < 200e-9);
    }
}

#[test]
fn a_coarse_adc_is_neither_called_stuck_nor_does_it_spoil_the_origin() {
    // 16 bits over ±10 V.
    let coarse = |s: &mut Sample| {
        let step = 20.0 / 65536.0;
        s.peak = Volts((s.peak.value() / step).round() * step);
        s.slope = Volts((s.slope.value() / step).round() * step);
    };
    for seed in 0..20 {
        let mut stage = Stage::new(Magnets::drifted(&mut Noise(9000 + seed), 0.0), seed);
        stage.spoil = coarse;
        let origin = stage.origin();
        let zero = found(stage.zero(Settings::default(), 0.0))
            .refine(&Settings::default())
            .unwrap();
        let error = (zero.origin.value() - origin).abs();
        assert!(
            error < 4.0 * zero.standard_uncertainty.value(),
            "{} nm",
            error * 1e9
        );
        assert!(zero.standard_uncertainty.nm() < 40.0);
    }
}

#[test]
fn a_search_that_runs_out_of_travel_names_step_and_values() {
    let settings = Settings {
        search_limit: Metres(0.4e-3),
        ..Settings::default()
    };
    let failed = failure(Stage::new(Magnets::IDEAL, 1).zero(settings, 0.0));
    assert_eq!(
        (failed.step, failed.reason),
        (Step::Peak, Reason::TravelExhausted)
    );
    assert_eq!(failed.cause, None);
    let text = failed.to_string();
    assert!(text.contains("step 1 (G7, peak): peak sensor"), "{text}");
    assert!(text.contains("of 400 um: travel exhausted"), "{text}");
}

#[test]
fn a_soft_limit_bounds_the_search_before_the_travel_does() {
    let settings = Settings {
        soft_max: Metres(0.3e-3),
        ..Settings::default()
    };
    let failed = failure(Stage::new(Magnets::IDEAL, 2).zero(settings, 0.0));
    assert_eq!(
        (failed.step, failed.reason),
        (Step::RightFlank, Reason::TravelExhausted)
    );
    assert!((failed.searched.um() - 300.0).abs() < 5.0, "{failed}");
}

#[test]
fn too_large_a_vc_cannot_be_reached_and_says_so() {
    // The curve falls by about 1.1 V in all.
    let settings = Settings {
        vc: Volts(1.6),
        ..Settings::default()
    };
    let failed = failure(Stage::new(Magnets::IDEAL, 3).zero(settings, 0.0));
    assert_eq!(failed.reason, Reason::TravelExhausted);
    assert!((failed.searched.um() - 2000.0).abs() < 5.0, "{failed}");
}

#[test]
fn time_and_standstill_are_bounded() {
    let settings = Settings {
        time_limit: Duration::from_secs(3),
        ..Settings::default()
    };
    let failed = failure(Stage::new(Magnets::IDEAL, 4).zero(settings, 0.0));
    assert_eq!(failed.reason, Reason::TimedOut);
    let mut stage = Stage::new(Magnets::IDEAL, 5);
    stage.motor_works = false;
    let failed = failure(stage.zero(Settings::default(), 0.05e-3));
    assert_eq!(failed.reason, Reason::NotMoving);
    assert!(
        failed
            .to_string()
            .ends_with("um from it: the axis does not move"),
        "{failed}"
    );
}

#[test]
fn silence_of_the_sensors_ends_in_a_timeout() {
    let mut search = Search::new(Settings::default(), Metres::ZERO, Time::ZERO).unwrap();
    assert_eq!(search.handle_timeout(Time::from_seconds(59.9)), None);
    let failed = failure(search.handle_timeout(search.poll_timeout()).unwrap());
    assert_eq!(
        (failed.step, failed.reason),
        (Step::Start, Reason::TimedOut)
    );
    assert_eq!(search.poll_timeout(), Time::NEVER);
}

#[test]
fn a_vibrating_stage_gives_up_after_its_restarts() {
    let mut stage = Stage::new(Magnets::IDEAL, 6);
    stage.noise_volts = 5e-3;
    let settings = Settings {
        restarts_max: 5,
        ..Settings::default()
    };
    let failed = failure(stage.zero(settings, 0.0));
    assert_eq!(failed.reason, Reason::TooManyRestarts, "{failed}");
}

#[test]
fn a_sample_that_is_not_finite_or_out_of_order_ends_the_search() {
    let sample = |at: u64, peak: f64| Sample {
        at: Time(at),
        position: Metres::ZERO,
        peak: Volts(peak),
        slope: Volts(2.5),
        standing: true,
    };
    let mut search = Search::new(Settings::default(), Metres::ZERO, Time::ZERO).unwrap();
    search.handle_sample(&sample(5, 2.0));
    let failed = failure(search.handle_sample(&sample(6, f64::NAN)));
    assert_eq!(failed.reason, Reason::BadSample);
    let mut search = Search::new(Settings::default(), Metres::ZERO, Time::ZERO).unwrap();
    search.handle_sample(&sample(5, 2.0));
    assert_eq!(
        failure(search.handle_sample(&sample(4, 2.0))).reason,
        Reason::BadSample
    );
}

#[test]
fn an_axis_that_runs_the_wrong_way_is_stopped() {
    let mut search = Search::new(Settings::default(), Metres::ZERO, Time::ZERO).unwrap();
    let mut last = None;
    for i in 0..200_u64 {
        let sample = Sample {
            at: Time(i * 5_000_000),
            position: Metres(1e-3 + i as f64 * 2.5e-6),
            peak: Volts(2.0 + (i % 3) as f64 * 1e-4),
            slope: Volts(2.5),
            standing: false,
        };
        last = Some(search.handle_sample(&sample));
        if matches!(last, Some(Progress::Failed(_))) {
            assert!(i < 60);
            break;
        }
    }
    assert_eq!(failure(last.unwrap()).reason, Reason::WrongDirection);
}

#[test]
fn a_disturbed_zero_fails_the_check_of_step_five() {
    let mut stage = Stage::new(Magnets::IDEAL, 8);
    // Sensor 1 loses 30 mV while the axis stands at P0.
    stage.spoil = |s| {
        if s.at > Time::from_seconds(4.7) {
            s.peak -= Volts(0.03);
        }
    };
    let failed = failure(stage.zero(Settings::default(), 0.0));
    assert_eq!(
        (failed.step, failed.reason),
        (Step::Check, Reason::CheckFailed),
        "{failed}"
    );
    assert!(failed.to_string().contains("step 5"), "{failed}");
}
