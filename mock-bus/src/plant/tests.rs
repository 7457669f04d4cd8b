use super::*;
use core::time::Duration;

fn plant(seed: u64) -> Plant {
    Plant::new(&PlantConfig::default(), seed)
}

fn demand_at(plant: &mut Plant, now: Time, demand_m: f64) {
    plant.advance(now);
    plant.set_servo(0, Servo::Follow { demand: demand_m });
}

/// A trapezoid of 100 mm/s and 1 m/s², demanded every 1 ms, then 100 ms of rest.
fn ramp(plant: &mut Plant, start: Time, from_m: f64, goal_m: f64, look: Duration) -> Time {
    let mut now = start;
    for ms in 1.. {
        let way_m = (goal_m - from_m).abs();
        let gone_m = trapezoid(way_m, f64::from(ms) * 1e-3);
        demand_at(plant, now, from_m + gone_m * (goal_m - from_m).signum());
        let next = now + Duration::from_millis(1);
        while now + look < next {
            now += look;
            plant.advance(now);
        }
        now = next;
        if gone_m >= way_m {
            break;
        }
    }
    now += Duration::from_millis(100);
    plant.advance(now);
    now
}

/// How far a move of `way_m` has got after `s` seconds.
fn trapezoid(way_m: f64, s: f64) -> f64 {
    let (acceleration, top) = (1.0, f64::min(0.1, way_m.sqrt()));
    let rise = top / acceleration;
    let total = way_m / top + rise;
    let left = total - s;
    if left <= 0.0 {
        way_m
    } else if s < rise {
        acceleration * s * s / 2.0
    } else if left < rise {
        way_m - acceleration * left * left / 2.0
    } else {
        top * (s - rise / 2.0)
    }
}

#[test]
fn the_stage_settles_within_two_counts_of_its_demand() {
    for seed in 0..5 {
        let mut plant = plant(seed);
        let mut now = Time(1_000_000);
        let mut from = 0.0;
        for goal in [3e-3, 12.345e-3, 12.346e-3, -1e-3] {
            now = ramp(&mut plant, now, from, goal, Duration::from_millis(1));
            let wanted = (goal / 10e-9).round() as i64;
            let off = plant.encoder_counts(0) - wanted;
            assert!(off.abs() <= 2, "seed {seed} goal {goal}: {off} counts off");
            from = goal;
        }
    }
}

#[test]
fn the_physics_does_not_depend_on_how_often_it_is_looked_at() {
    let run = |look| {
        let mut plant = plant(3);
        let now = ramp(&mut plant, Time(1_234_567), 0.0, 20e-3, look);
        ramp(&mut plant, now, 20e-3, 7e-3, look);
        (
            plant.truth().position().value().to_bits(),
            plant.encoder_counts(0),
        )
    };
    assert_eq!(
        run(Duration::from_millis(1)),
        run(Duration::from_micros(77))
    );
}

#[test]
fn it_lags_while_moving_and_goes_its_speed() {
    let mut plant = plant(1);
    for ms in 1..=200_u64 {
        demand_at(&mut plant, Time(ms * 1_000_000), 1e-4 * ms as f64);
    }
    let lag = 0.02 / 10e-9 - plant.encoder_counts(0) as f64;
    assert!(lag > 100.0 && lag < 20_000.0, "{lag} counts");
    assert!(
        (plant.encoder_speed(0) - 1e7).abs() < 2e5,
        "{}",
        plant.encoder_speed(0)
    );
}

#[test]
fn without_torque_it_coasts_to_a_stop() {
    let mut plant = plant(1);
    for ms in 1..=200_u64 {
        demand_at(&mut plant, Time(ms * 1_000_000), 1e-4 * ms as f64);
    }
    plant.set_servo(0, Servo::Off);
    let before = plant.encoder_counts(0);
    plant.advance(Time(300_000_000));
    assert_eq!(plant.encoder_speed(0), 0.0);
    let coasted_um = (plant.encoder_counts(0) - before) as f64 * 0.01;
    assert!(
        coasted_um > 1000.0 && coasted_um < 4000.0,
        "{coasted_um} um"
    );
}

#[test]
fn as_found_the_deviation_fills_a_band_of_plus_minus_10_um() {
    for seed in 0..20 {
        let plant = plant(seed);
        let values: Vec<f64> = (0..=600)
            .map(|i| {
                plant
                    .truth()
                    .mean_deviation(Metres::from_mm(f64::from(i) * 0.1))
                    .um()
            })
            .collect();
        let most = values.iter().copied().fold(f64::MIN, f64::max);
        let least = values.iter().copied().fold(f64::MAX, f64::min);
        assert!(
            (most - least - 20.0).abs() < 1.0,
            "seed {seed}: {least} to {most}"
        );
        assert!(most.max(-least) < 14.0, "seed {seed}: {least} to {most}");
        let steepest = values
            .windows(2)
            .map(|w| ((w[1] - w[0]) / 100.0).abs())
            .fold(0.0, f64::max);
        assert!(steepest < 5e-3, "seed {seed}: {steepest}");
    }
}

#[test]
fn a_reversal_takes_up_the_lost_motion() {
    let mut plant = plant(4);
    let look = Duration::from_millis(1);
    let there = ramp(&mut plant, Time(1_000_000), 0.0, 10e-3, look);
    let forward = plant.truth();
    let forward = forward.position() - forward.scale_position();
    let beyond = ramp(&mut plant, there, 10e-3, 11e-3, look);
    ramp(&mut plant, beyond, 11e-3, 10e-3, look);
    let truth = plant.truth();
    let lost = truth.position() - truth.scale_position() - forward;
    assert!((lost.um() - 1.0).abs() < 0.2, "{} um", lost.um());
    let wanted = truth.deviation(truth.scale_position(), units::Approach::Reverse);
    let seen = truth.position() - truth.scale_position();
    assert!(
        (seen - wanted).abs().nm() < 120.0,
        "{} nm",
        (seen - wanted).nm()
    );
}

#[test]
fn an_encoder_counts_from_where_it_was_switched_on() {
    let mut plant = plant(5);
    assert_eq!(plant.encoder_counts(0), 0);
    ramp(
        &mut plant,
        Time(1_000_000),
        0.0,
        5e-3,
        Duration::from_millis(1),
    );
    assert!((plant.encoder_counts(0) - 500_000).abs() <= 2);
    plant.set_servo(0, Servo::Off);
    plant.encoder_power(0, false);
    plant.power_cycle(HallDrift::default());
    plant.encoder_power(0, true);
    assert_eq!(plant.encoder_counts(0), 0);
    let truth = plant.truth();
    assert!((truth.count_zero() - truth.scale_position()).abs().nm() < 5.1);
}

#[test]
fn the_limit_switches_act_near_their_places() {
    let mut plant = plant(6);
    let start = plant.truth().scale_position().value();
    ramp(
        &mut plant,
        Time(1_000_000),
        0.0,
        -5.9e-3 - start,
        Duration::from_millis(1),
    );
    assert_eq!(plant.limit_switches(0), (false, false));
    let mut plant = self::plant(6);
    ramp(
        &mut plant,
        Time(1_000_000),
        0.0,
        -6.1e-3 - start,
        Duration::from_millis(1),
    );
    assert_eq!(plant.limit_switches(0), (true, false));
}

#[test]
fn hard_stops_hold_the_stage() {
    let mut plant = plant(6);
    ramp(
        &mut plant,
        Time(1_000_000),
        0.0,
        -30e-3,
        Duration::from_millis(1),
    );
    assert!((plant.truth().scale_position().mm() + 7.0).abs() < 1e-9);
}

#[test]
fn a_blocked_stage_does_not_follow_and_an_open_sto_takes_the_torque() {
    let mut plant = plant(7);
    plant.set_blocked(0, true);
    ramp(
        &mut plant,
        Time(1_000_000),
        0.0,
        5e-3,
        Duration::from_millis(1),
    );
    assert!(plant.encoder_counts(0).abs() <= 1);
    let mut plant = self::plant(7);
    plant.set_safe_torque_off(true);
    ramp(
        &mut plant,
        Time(1_000_000),
        0.0,
        5e-3,
        Duration::from_millis(1),
    );
    assert_eq!(plant.encoder_counts(0), 0);
    assert!(plant.safe_torque_off(0));
}

#[test]
fn fringes_follow_the_true_displacement() {
    let mut plant = plant(8);
    let (before, from) = (plant.fringes(), plant.truth().position());
    ramp(
        &mut plant,
        Time(1_000_000),
        0.0,
        30e-3,
        Duration::from_millis(1),
    );
    let (after, to) = (plant.fringes(), plant.truth().position());
    let fringes = after.half_wavelengths - before.half_wavelengths;
    let vacuum = fringes * 632.991_372e-9 / 2.0 / (to - from).value();
    assert!((vacuum - 1.000_27).abs() < 5e-6, "{vacuum}");
}

#[test]
fn broken_inputs_look_broken() {
    let mut plant = plant(9);
    let (even, odd) = (plant.analog_volts(0), plant.analog_volts(1));
    plant.set_inputs_swapped(true);
    assert!((plant.analog_volts(0) - odd).abs() < 2e-3);
    assert!((plant.analog_volts(1) - even).abs() < 2e-3);
    plant.set_inputs_swapped(false);
    plant.set_input_fault(0, Some(InputFault::Stuck));
    assert_eq!(plant.analog_volts(0), plant.analog_volts(0));
    plant.set_input_fault(0, Some(InputFault::Rail));
    assert_eq!(plant.analog_volts(0), 5.0);
    plant.set_input_fault(0, Some(InputFault::Inverted));
    assert!((plant.analog_volts(0) + even).abs() < 2e-3);
}

#[test]
fn a_smooth_move_overshoots_by_less_than_a_micrometre() {
    let mut plant = plant(2);
    let mut most = i64::MIN;
    let mut now = Time(1_000_000);
    for ms in 1..=900 {
        demand_at(&mut plant, now, trapezoid(0.06, f64::from(ms) * 1e-3));
        now += Duration::from_millis(1);
        plant.advance(now);
        most = most.max(plant.encoder_counts(0));
    }
    assert!((5_999_998..6_000_100).contains(&most), "{most}");
}
