//! The three-axis machine against its own promises.

use units::{Metres, Radians, Time};

use super::config::{ErrorsConfig, HeatConfig, VolumetricConfig};
use super::*;
use crate::plant::Plant;
use crate::plant::config::PlantConfig;

fn plant(config: VolumetricConfig, seed: u64) -> Plant {
    let config = PlantConfig {
        volumetric: Some(config),
        ..PlantConfig::default()
    };
    Plant::new(&config, seed)
}

pub(super) fn truth(plant: &Plant) -> VolumetricTruth<'_> {
    plant.truth().volumetric().unwrap()
}

pub(super) fn hours(hours: f64) -> Time {
    Time::from_seconds(3600.0 * hours)
}

pub(super) fn point(mm: [f64; 3]) -> Point {
    mm.map(Metres::from_mm)
}

fn length_um(deviation: Point) -> f64 {
    let squares = deviation.map(|component| component.um() * component.um());
    squares.iter().sum::<f64>().sqrt()
}

/// A grid over the work volume.
fn volume() -> impl Iterator<Item = Point> {
    let steps = |travel: f64| (0..=4).map(move |i| travel * f64::from(i) / 4.0);
    steps(500.0).flat_map(move |x| {
        steps(400.0).flat_map(move |y| steps(300.0).map(move |z| point([x, y, z])))
    })
}

/// No error, no heat.
pub(super) fn perfect() -> VolumetricConfig {
    VolumetricConfig {
        errors: ErrorsConfig {
            positioning_um: 0.0,
            straightness_um: 0.0,
            roll_arcsec: 0.0,
            pitch_and_yaw_arcsec: 0.0,
            squareness_arcsec: 0.0,
            ..ErrorsConfig::default()
        },
        heat: HeatConfig {
            duty: Vec::new(),
            air_temperature_c: 20.0,
            air_swing_k: 0.0,
            ..HeatConfig::default()
        },
        ..VolumetricConfig::default()
    }
}

#[test]
fn without_errors_the_tool_is_where_the_scales_say_whatever_the_chain() {
    for chain in ["FXYZ", "XFYZ", "YXFZ", "XYZF", "ZFYX"] {
        let config = VolumetricConfig {
            chain: chain.into(),
            ..perfect()
        };
        assert!(config.is_a_chain());
        let plant = plant(config, 1);
        let scales = point([123.0, 45.0, 67.0]);
        let deviation = truth(&plant).deviation_for(scales);
        assert!(length_um(deviation) < 1e-9, "{chain} {deviation:?}");
        let [x, y, z] = truth(&plant).tool_point_for(scales).map(Metres::mm);
        assert!((x - 123.0).abs() + (y - 45.0).abs() + (z + 33.0).abs() < 1e-9);
    }
    for chain in ["FXY", "FXXY", "XYZ", "FXYZZ"] {
        let config = VolumetricConfig {
            chain: chain.into(),
            ..perfect()
        };
        assert!(!config.is_a_chain(), "{chain}");
    }
}

/// By hand: a roll of 10 arcsec of x at an arm of (y, z) turns y towards z.
#[test]
fn the_roll_of_x_acts_on_the_arm_of_y_and_z() {
    let mut config = perfect();
    config.errors.deliberate_roll_arcsec = 10.0;
    let plant = plant(config, 1);
    let roll = Radians::from_arcsec(10.0).value();
    let [x, y, z] = truth(&plant)
        .deviation_for(point([250.0, 400.0, 300.0]))
        .map(Metres::um);
    // The tool's arm: y 400 mm, z 300 − 100 mm.
    assert!(x.abs() < 1e-9, "{x}");
    assert!((y + 200e3 * roll).abs() < 1e-3, "{y}");
    assert!((z - 400e3 * roll).abs() < 1e-3, "{z}");
}

/// The same roll of a table under the tool: the tool turns the other way in its frame.
#[test]
fn the_roll_of_a_table_turns_the_tool_the_other_way() {
    let mut config = perfect();
    config.chain = "XFYZ".into();
    config.errors.deliberate_roll_arcsec = 10.0;
    let plant = plant(config, 1);
    let roll = Radians::from_arcsec(10.0).value();
    let [x, y, z] = truth(&plant)
        .deviation_for(point([250.0, 400.0, 300.0]))
        .map(Metres::um);
    assert!(x.abs() < 1e-9, "{x}");
    assert!((y - 200e3 * roll).abs() < 1e-3, "{y}");
    assert!((z + 400e3 * roll).abs() < 1e-3, "{z}");
}

#[test]
fn a_bow_lifts_the_middle_and_pitches_the_slide_with_its_slope() {
    let mut config = perfect();
    config.errors.deliberate_bow_um = 15.0;
    config.errors.deliberate_from_h = 1.0;
    let plant = plant(config, 1);
    let before = truth(&plant).error_motion(0, Metres::from_mm(250.0));
    assert_eq!(before.shift[2], Metres::ZERO, "not yet");
    let later = truth(&plant).at(hours(1.0));
    let motion = |mm| later.error_motion(0, Metres::from_mm(mm));
    assert!((motion(250.0).shift[2].um() - 15.0).abs() < 1e-9);
    assert!(motion(0.0).shift[2].um().abs() < 1e-9 && motion(500.0).shift[2].um().abs() < 1e-9);
    // At the beginning the way goes up by 4 · 15 µm / 500 mm: the nose up, a negative turn
    // about y.
    assert!((motion(0.0).turn[1].value() + 1.2e-4).abs() < 1e-9);
    assert!((motion(500.0).turn[1].value() - 1.2e-4).abs() < 1e-9);
    // The slide's pitch is the slope of its way everywhere.
    for mm in [10.0, 100.0, 333.0] {
        let rise = motion(mm + 0.5).shift[2].um() - motion(mm - 0.5).shift[2].um();
        assert!((rise * 1e-3 + motion(mm).turn[1].value()).abs() < 1e-9);
    }
}

/// A table that goes back along a guide that bends pitches the other way at the same coordinate.
#[test]
fn a_table_under_the_tool_pitches_along_its_own_way() {
    let pitch = |chain: &str| {
        let mut config = perfect();
        config.chain = chain.into();
        config.errors.deliberate_bow_um = 15.0;
        let motion = truth(&plant(config, 1)).error_motion(0, Metres::ZERO);
        (motion.shift[2], motion.turn[1])
    };
    let ((up, nose), (table_up, table_nose)) = (pitch("FXYZ"), pitch("XFYZ"));
    assert_eq!(up, table_up);
    assert!(nose.value().abs() > 1e-4 && nose == -table_nose, "{nose:?}");
}

/// What the issue asks of the machine, with room to spare.
#[test]
fn twenty_machines_err_by_30_um_and_drift_by_10_um_in_8_hours() {
    for seed in 0..20 {
        let plant = plant(VolumetricConfig::default(), seed);
        let worst_um = |at| {
            let look = truth(&plant).at(hours(at));
            let lengths = volume().map(|scales| length_um(look.deviation_for(scales)));
            lengths.fold(0.0, f64::max)
        };
        let (cold, warm) = (worst_um(0.0), worst_um(8.0));
        let drift = volume().map(|scales| {
            let [a, b] = [0.0, 8.0].map(|at| truth(&plant).at(hours(at)).deviation_for(scales));
            length_um([0, 1, 2].map(|axis| b[axis] - a[axis]))
        });
        let drift = drift.fold(0.0, f64::max);
        println!("seed {seed}: {cold:.1} µm, after 8 h {warm:.1} µm, drift {drift:.1} µm");
        assert!(cold >= 30.0 && warm >= 30.0, "seed {seed}: {cold} {warm}");
        assert!(drift >= 10.0, "seed {seed}: {drift}");
        // Nothing that no correction could be for: the shipped one is limited to 250 µm.
        assert!(cold < 225.0 && warm < 225.0, "seed {seed}: {cold} {warm}");
    }
}

#[test]
fn the_errors_are_smooth_functions_of_time_and_place() {
    let plant = plant(VolumetricConfig::default(), 5);
    for minute in 0..480 {
        let look = |at: f64| truth(&plant).at(hours(at / 60.0));
        let at = f64::from(minute);
        for scales in [[500.0, 400.0, 300.0], [250.0, 100.0, 0.0]].map(point) {
            let (now, next) = (look(at), look(at + 1.0));
            let (a, b) = (now.deviation_for(scales), next.deviation_for(scales));
            let in_a_minute = length_um([0, 1, 2].map(|axis| b[axis] - a[axis]));
            assert!(in_a_minute < 1.0, "minute {minute}: {in_a_minute} µm");
        }
    }
    let look = truth(&plant).at(hours(3.0));
    for mm in 0..400 {
        let [a, b] = [0.0, 1.0].map(|step| look.deviation_for(point([f64::from(mm) + step; 3])));
        let in_a_mm = length_um([0, 1, 2].map(|axis| b[axis] - a[axis]));
        assert!(in_a_mm < 1.0, "{mm} mm: {in_a_mm} µm");
    }
}

fn volts(plant: &mut Plant, first: usize) -> [f64; 4] {
    [0, 1, 2, 3].map(|channel| plant.analog_volts(first + channel))
}

/// Position over ratio of a spot of 1 mm, near the middle: w·√π/(2·√2).
const GAIN_UM: f64 = 626.657;

fn spot_um([a, b, c, d]: [f64; 4]) -> [f64; 2] {
    let sum = a + b + c + d;
    [
        GAIN_UM * (a + d - b - c) / sum,
        GAIN_UM * (a + b - c - d) / sum,
    ]
}

/// S4's correction for the beam, by hand: what the slide sees, less the beam's part of the way.
#[test]
fn the_two_detectors_of_a_beam_tell_how_the_slide_has_moved() {
    for seed in 0..5 {
        let mut plant = plant(VolumetricConfig::default(), seed);
        let mut mean = |at: f64| {
            let mut sum = [[0.0; 2]; 6];
            for sample in 0..50 {
                plant.advance(hours(at) + core::time::Duration::from_millis(sample * 20));
                for (place, sum) in sum.iter_mut().enumerate() {
                    let [first, second] = spot_um(volts(&mut plant, 4 * place));
                    *sum = [sum[0] + first / 50.0, sum[1] + second / 50.0];
                }
            }
            let look = truth(&plant);
            let scales = look.scales();
            let shifts = [0, 1, 2].map(|axis| look.detector_shift(axis, scales[axis]));
            (sum, shifts.map(|shift| shift.map(Metres::um)), scales)
        };
        let (cold, cold_um, scales) = mean(0.1);
        for at in [2.0, 4.2, 8.0] {
            let (warm, warm_um, _) = mean(at);
            for axis in 0..3 {
                let way_mm = [500.0, 400.0, 300.0][axis] + 200.0;
                let share = (100.0 + scales[axis].mm()) / way_mm;
                for across in 0..2 {
                    let moved = |place: usize| warm[place][across] - cold[place][across];
                    let seen = share * moved(2 * axis + 1) - moved(2 * axis);
                    let true_um = warm_um[axis][across] - cold_um[axis][across];
                    assert!((seen - true_um).abs() < 0.35, "{axis} {seen} {true_um}");
                }
            }
        }
    }
}

#[test]
fn all_channels_of_one_moment_are_of_one_spot() {
    let config = VolumetricConfig {
        beams: config::BeamConfig {
            noise_mv: 0.0,
            turbulence_um: 5.0,
            ..config::BeamConfig::default()
        },
        ..VolumetricConfig::default()
    };
    let mut plant = plant(config, 2);
    plant.advance(hours(0.5));
    let first = volts(&mut plant, 0);
    assert_eq!(volts(&mut plant, 0), first);
    plant.advance(hours(0.5) + core::time::Duration::from_millis(4));
    assert_ne!(volts(&mut plant, 0), first);
}

#[test]
fn temperatures_are_those_over_and_under_the_guides() {
    let mut plant = plant(VolumetricConfig::default(), 9);
    plant.advance(hours(3.0));
    for axis in 0..3 {
        let [over, under] = [0, 1].map(|side| {
            let sensor = plant.analog_temperature(FIRST_TEMPERATURE + 2 * axis + side);
            sensor.unwrap().value()
        });
        let look = truth(&plant);
        let middle = look.scale_temperature(axis).value();
        assert!((f64::midpoint(over, under) - middle).abs() < 0.05);
        assert!((over - under - look.gradient_k(axis)).abs() < 0.08);
        assert!(look.gradient_k(axis) > 0.2, "it has warmed up");
    }
    assert_eq!(plant.analog_temperature(0), None, "a detector");
    assert!(
        plant.analog_volts(FIRST_TEMPERATURE).abs() < 0.1,
        "no voltage"
    );
}

#[test]
fn the_roll_detectors_see_the_roll_that_comes_with_warmth() {
    let mut plant = plant(VolumetricConfig::default(), 4);
    let mut sum_v = |at: f64| {
        plant.advance(hours(at));
        let scale = truth(&plant).scales()[0];
        let roll = truth(&plant).error_motion(0, scale).turn[0].value();
        let volts = plant.analog_volts(FIRST_ROLL) + plant.analog_volts(FIRST_ROLL + 1);
        (volts, roll)
    };
    let (cold_v, cold) = sum_v(0.0);
    let (warm_v, warm) = sum_v(8.0);
    // (2h − L)·tan α at 10 V/mm.
    let expected_v = -0.26 * 1e4 * (warm - cold);
    assert!(
        (warm_v - cold_v - expected_v).abs() < 1e-3,
        "{warm_v} {expected_v}"
    );
}

/// All slides on a smooth way to scale positions, standing at the end; what a drive would ask for
/// every 4 ms.
pub(super) fn move_to(plant: &mut Plant, start: Time, targets_mm: [f64; 3]) -> Time {
    const STEPS: u32 = 150;
    let from = truth(plant).scales().map(Metres::value);
    let zeros = [0, 1, 2].map(|axis| truth(plant).count_zero(axis).value());
    let at = |step: u32| start + core::time::Duration::from_millis(4) * step;
    for step in 1..=STEPS {
        plant.advance(at(step));
        let share = f64::from(step) / f64::from(STEPS);
        let smooth = share * share * share * (10.0 - 15.0 * share + 6.0 * share * share);
        for axis in 0..3 {
            let way = targets_mm[axis] * 1e-3 - from[axis];
            let demand = from[axis] + smooth * way - zeros[axis];
            plant.set_servo(axis, crate::plant::Servo::Follow { demand });
        }
    }
    plant.advance(at(STEPS + 50));
    at(STEPS + 50)
}

/// The bows, films and rolls of 8 hours as the detectors tell them, at places all over the
/// volume: the machine's own motions are seen wherever the slides are.
#[test]
fn what_warmth_does_sideways_is_seen_at_every_place() {
    let mut plant = plant(VolumetricConfig::default(), 11);
    let places = [
        [20.0, 20.0, 20.0],
        [250.0, 200.0, 150.0],
        [480.0, 380.0, 280.0],
    ];
    let mut look = |at: f64| {
        let mut now = hours(at);
        plant.advance(now);
        places.map(|place| {
            now = move_to(&mut plant, now, place);
            let mut sum = [[0.0; 2]; 6];
            for _ in 0..50 {
                now += core::time::Duration::from_millis(16);
                plant.advance(now);
                for (place, sum) in sum.iter_mut().enumerate() {
                    let [first, second] = spot_um(volts(&mut plant, 4 * place));
                    *sum = [sum[0] + first / 50.0, sum[1] + second / 50.0];
                }
            }
            let scales = truth(&plant).scales();
            for (scale, wanted) in scales.iter().zip(place) {
                assert!((scale.mm() - wanted).abs() < 1e-4, "{scale:?} {wanted}");
            }
            let shift = |axis| {
                truth(&plant)
                    .detector_shift(axis, scales[axis])
                    .map(Metres::um)
            };
            (sum, [0, 1, 2].map(shift))
        })
    };
    let (cold, warm) = (look(0.05), look(7.9));
    let mut largest = 0.0_f64;
    for ((cold, warm), place) in cold.iter().zip(&warm).zip(places) {
        for axis in 0..3 {
            let share = (100.0 + place[axis]) / ([500.0, 400.0, 300.0][axis] + 200.0);
            for across in 0..2 {
                let moved = |place: usize| warm.0[place][across] - cold.0[place][across];
                let seen = share * moved(2 * axis + 1) - moved(2 * axis);
                let true_um = warm.1[axis][across] - cold.1[axis][across];
                assert!((seen - true_um).abs() < 0.35, "{axis} {seen} {true_um}");
                largest = largest.max(true_um.abs());
            }
        }
    }
    assert!(largest > 5.0, "{largest} µm: there was something to see");
}

#[test]
fn one_seed_is_one_machine() {
    let at = |seed| {
        let mut plant = plant(VolumetricConfig::default(), seed);
        plant.advance(hours(1.0));
        let deviation = truth(&plant).deviation_for(point([100.0; 3]));
        (
            deviation.map(|it| it.value().to_bits()),
            plant.analog_volts(3).to_bits(),
        )
    };
    assert_eq!(at(7), at(7));
    assert_ne!(at(7).0, at(8).0);
}
