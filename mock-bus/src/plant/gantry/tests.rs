//! The gantry's physics, without any bus.

use core::time::Duration;

use units::{Metres, Time};

use super::config::GantryConfig;
use crate::plant::config::{DeviationConfig, HallConfig, PlantConfig};
use crate::plant::{HallDrift, Plant, Servo};

/// A gantry whose scales do not err, with quiet sensors.
fn plant_of(seed: u64) -> Plant {
    let mut gantry = GantryConfig {
        sensor_offset_max_mv: 0.0,
        sensor_gain_max: 0.0,
        ..GantryConfig::default()
    };
    gantry.side.deviation = DeviationConfig {
        peak_um: 0.0,
        lost_motion_um: 0.0,
        cyclic_amplitude_nm: 0.0,
        repeatability_nm: 0.0,
        ..DeviationConfig::default()
    };
    let config = PlantConfig {
        gantry: Some(gantry),
        hall: HallConfig {
            noise_mv: 0.0,
            ..HallConfig::default()
        },
        ..PlantConfig::default()
    };
    Plant::new(&config, seed)
}

/// Brings each side to a place on its scale.
fn bring(plant: &mut Plant, now: &mut Time, to: [Metres; 2]) {
    let truth = plant.truth().gantry().unwrap();
    let there = truth.scale_positions();
    let starts = [0, 1].map(|axis| {
        let counts = plant.encoder_counts(axis) as f64;
        counts * plant.encoder_resolution(axis)
    });
    for ms in 0..2000 {
        let share = (f64::from(ms) / 1000.0).min(1.0);
        for axis in [0, 1] {
            let way = (to[axis] - there[axis]).value();
            let demand = starts[axis] + share * way;
            plant.set_servo(axis, Servo::Follow { demand });
        }
        *now += Duration::from_millis(1);
        plant.advance(*now);
    }
}

#[test]
fn the_shipped_file_says_what_the_defaults_are() {
    let text = include_str!("../../../../configs/emulated/gantry.toml");
    let machine = crate::config::MachineConfig::parse(text).unwrap();
    let expected = PlantConfig {
        gantry: Some(GantryConfig::default()),
        ..PlantConfig::default()
    };
    assert_eq!(machine.plant, expected);
}

#[test]
fn a_stage_that_is_not_turned_has_both_groups_of_magnets_over_their_sensors() {
    for seed in 1..=5 {
        let (mut plant, mut now) = (plant_of(seed), Time::ZERO);
        let truth = plant.truth().gantry().unwrap();
        let (turned, distance) = (truth.turned(), truth.distance());
        assert!(
            turned.value().abs() <= 200e-6 && turned.value() != 0.0,
            "{turned:?}"
        );
        let ahead = Metres(-turned.value() * distance.value());
        bring(&mut plant, &mut now, [Metres::ZERO, ahead]);
        let angle = plant.truth().gantry().unwrap().angle();
        assert!(angle.value().abs() < 0.1e-6, "{angle:?}");
        // Both odd curves stand at their middle, 1 V/mm from it.
        for channel in [1, 3] {
            let volts = plant.analog_volts(channel);
            assert!(volts.abs() < 0.1e-3, "channel {channel}: {volts} V");
        }
        let (first, second) = (plant.analog_volts(0), plant.analog_volts(2));
        assert!((first - second).abs() < 1e-6, "{first} V, {second} V");
    }
}

#[test]
fn the_second_side_is_ahead_at_positive_angles() {
    let (mut plant, mut now) = (plant_of(1), Time::ZERO);
    bring(&mut plant, &mut now, [Metres::ZERO, Metres::from_um(40.0)]);
    let truth = plant.truth().gantry().unwrap();
    let expected = truth.turned().value() + 40e-6 / 0.4;
    assert!((truth.angle().value() - expected).abs() < 0.1e-6);
}

#[test]
fn a_power_cycle_pushes_each_side_and_changes_the_sensors_of_both() {
    let config = PlantConfig {
        gantry: Some(GantryConfig::default()),
        ..PlantConfig::default()
    };
    let mut plant = Plant::new(&config, 3);
    let seen = |plant: &mut Plant| [0, 2].map(|it| plant.analog_volts(it));
    let before = seen(&mut plant);
    let drift = HallDrift::random(
        3,
        1,
        crate::plant::DriftLimits {
            offset: units::Volts(0.1),
            gain: 0.0,
            gain_per_m: 0.0,
        },
    );
    plant.power_cycle(drift);
    let after = seen(&mut plant);
    assert!((before[0] - after[0]).abs() > 1e-3 && (before[1] - after[1]).abs() > 1e-3);
}
