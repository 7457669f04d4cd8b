//! The rotary table under the machine: zero, turns, sweeps over the plate in several placements.

use core::f64::consts::TAU;

use drivers::device::DeviceError;
use mock_bus::fault::{Fault, FaultConfig};
use tests::{Bench, Edit};
use truestage::Failure;
use truestage::emulated::HallDrift;
use truestage::for_tests::Sweep;
use truestage::rotary::{RotaryFailure, SweepOptions, Way};
use units::{Approach, Radians, RadiansPerSecond};

const AXIS: &str = "c";

fn bench(seed: u64) -> Bench {
    Bench::rotary(seed, |text| text, |text| text)
}

fn options(approach: Approach) -> SweepOptions {
    SweepOptions {
        lines: 360,
        approach,
        speed: None,
        phase: None,
    }
}

fn run<R>(bench: &mut Bench, procedure: impl FnOnce(&mut Bench) -> Result<R, Failure>) -> R {
    procedure(bench).unwrap_or_else(|failure| panic!("{failure}"))
}

/// Started and zeroed.
fn ready(bench: &mut Bench) -> Result<(), Failure> {
    bench.machine.start()?;
    bench.machine.rotary(AXIS)?.zero()
}

/// Each reading minus the table's and the plate's true errors there, less their mean; arcsec.
fn residuals(bench: &Bench, sweep: &Sweep) -> Vec<f64> {
    let simulation = bench.emulated.simulation();
    let truth = simulation.truth();
    let table = truth.table().expect("the machine is a table");
    let (placement, _) = table.placement();
    let lines = table.lines() as i64;
    let errors: Vec<f64> = (0..)
        .zip(&sweep.deviations)
        .filter_map(|(at, deviation)| {
            let position = Radians(TAU * f64::from(at) / lines as f64);
            let line = (i64::from(at) - placement).rem_euclid(lines) as usize;
            let expected = table.encoder_error(position) + table.line_error(line);
            Some(((*deviation)? - expected).arcsec())
        })
        .collect();
    let mean = errors.iter().sum::<f64>() / errors.len() as f64;
    errors.iter().map(|error| error - mean).collect()
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|it| it * it).sum::<f64>() / values.len() as f64).sqrt()
}

#[test]
fn sweeps_of_several_placements_read_table_and_plate_to_the_detectors_noise() {
    let mut bench = bench(5);
    run(&mut bench, |bench| {
        ready(bench)?;
        let mut phase = None;
        for turned in [0.0, 1.0, 18.0, 113.0] {
            bench.emulated.simulation_mut().turn_plate(turned);
            for approach in [Approach::Forward, Approach::Reverse] {
                let begun = bench.machine.now();
                let options = SweepOptions {
                    phase,
                    ..options(approach)
                };
                let sweep = bench.machine.rotary(AXIS)?.sweep(&options)?;
                phase = phase.or(Some(sweep.phase));
                assert_eq!(sweep.read(), 360, "{sweep:?}");
                let noise = rms(&residuals(bench, &sweep));
                println!(
                    "turned {turned}, {approach:?}: {:.1} s, residual {noise:.4} arcsec rms",
                    bench.machine.now().since(begun).as_secs_f64()
                );
                assert!((0.04..0.06).contains(&noise), "{noise}");
            }
        }
        assert_eq!(
            bench.machine.power_state(AXIS)?.map(|it| it.bits()),
            Some(0x27)
        );
        bench.machine.shut_down()
    });
}

#[test]
fn two_sweeps_of_one_placement_agree_and_the_directions_differ_by_the_latency_only() {
    let mut bench = bench(6);
    run(&mut bench, |bench| {
        ready(bench)?;
        let forward = bench
            .machine
            .rotary(AXIS)?
            .sweep(&options(Approach::Forward))?;
        let reverse = bench
            .machine
            .rotary(AXIS)?
            .sweep(&options(Approach::Reverse))?;
        let apart: Vec<f64> = forward
            .deviations
            .iter()
            .zip(&reverse.deviations)
            .map(|(f, r)| (f.unwrap() - r.unwrap()).arcsec())
            .collect();
        let mean = apart.iter().sum::<f64>() / 360.0;
        // 2 µs at 30 °/s, to either side.
        assert!((mean - 0.432).abs() < 0.02, "{mean}");
        assert!(apart.iter().all(|it| (it - mean).abs() < 0.4));
        Ok(())
    });
}

#[test]
fn missing_and_doubtful_lines_are_named_by_their_place_on_the_table() {
    let mut bench = bench(7);
    run(&mut bench, |bench| {
        ready(bench)?;
        let mut simulation = bench.emulated.simulation_mut();
        simulation.turn_plate(10.0);
        let faults = [
            Fault::LineSmudged { line: 355 },
            Fault::LineSmudged { line: 20 },
            Fault::LineScratched { line: 100 },
        ];
        let injected = faults.map(|fault| simulation.inject(FaultConfig::permanent(fault)));
        let injected = injected.map(|it| it.expect("it is a plate"));
        drop(simulation);
        let sweep = bench
            .machine
            .rotary(AXIS)?
            .sweep(&options(Approach::Forward))?;
        assert_eq!(sweep.missing, [5, 30]);
        assert_eq!(sweep.overwritten, [110]);
        assert_eq!(sweep.read(), 357);
        for fault in injected {
            assert_eq!(bench.emulated.simulation().fault_deliveries(fault), 1);
        }
        // Slowly, the scratch is an edge of its own.
        let slow = SweepOptions {
            speed: Some(RadiansPerSecond(1.0_f64.to_radians())),
            ..options(Approach::Forward)
        };
        let sweep = bench.machine.rotary(AXIS)?.sweep(&slow)?;
        assert_eq!(sweep.doubled, [110]);
        assert_eq!(sweep.missing, [5, 30]);
        Ok(())
    });
}

#[test]
fn a_sweep_too_fast_for_the_sync_is_refused_with_what_fits() {
    let mut bench = bench(8);
    run(&mut bench, |bench| {
        ready(bench)?;
        let fast = SweepOptions {
            speed: Some(RadiansPerSecond(170.0_f64.to_radians())),
            ..options(Approach::Forward)
        };
        let before = bench
            .machine
            .devices()
            .rotary_reading(AXIS)?
            .expect("it was zeroed");
        let refused = bench.machine.rotary(AXIS)?.sweep(&fast);
        let Err(Failure::Machine(machine::Failure::Device {
            source: DeviceError::OutOfRange { limit, unit, .. },
            ..
        })) = refused
        else {
            panic!("{refused:?}");
        };
        assert!(
            (limit - 75.0).abs() < 1e-9 && unit == "°/s",
            "{limit} {unit}"
        );
        let after = bench
            .machine
            .devices()
            .rotary_reading(AXIS)?
            .expect("it was zeroed");
        assert!((after.position - before.position).abs().arcsec() < 1.0);
        Ok(())
    });
}

#[test]
fn an_angle_is_reached_by_the_way_that_was_asked_for() {
    let mut bench = bench(9);
    run(&mut bench, |bench| {
        let early = bench
            .machine
            .rotary(AXIS)?
            .turn_to(Radians::ZERO, Way::Shortest);
        assert!(matches!(
            early,
            Err(Failure::Machine(machine::Failure::NotZeroed { .. }))
        ));
        ready(bench)?;
        for (degrees, way, expected) in [
            (350.0, Way::Shortest, -10.0),
            (10.0, Way::Forward, 10.0),
            (5.0, Way::Forward, 365.0),
            (10.0, Way::Reverse, 10.0),
            (725.0, Way::Turns, 725.0),
        ] {
            let angle = Radians::from_degrees(degrees);
            let target = bench.machine.rotary(AXIS)?.turn_to(angle, way)?;
            assert!(
                (target.degrees() - expected).abs() < 1e-4,
                "{}",
                target.degrees()
            );
            let reading = bench
                .machine
                .devices()
                .rotary_reading(AXIS)?
                .unwrap()
                .position;
            assert!((reading - target).abs().arcsec() < 0.2);
        }
        Ok(())
    });
}

#[test]
fn a_power_cycle_takes_the_zero_and_zeroing_again_brings_the_readings_back() {
    let mut bench = bench(10);
    run(&mut bench, |bench| {
        ready(bench)?;
        let before = bench
            .machine
            .rotary(AXIS)?
            .sweep(&options(Approach::Forward))?;
        bench.machine.shut_down()?;
        bench.power_cycle(HallDrift::default());
        bench.machine.start()?;
        assert!(!bench.machine.is_zeroed(AXIS));
        bench.machine.rotary(AXIS)?.zero()?;
        let after = bench
            .machine
            .rotary(AXIS)?
            .sweep(&options(Approach::Forward))?;
        let apart: Vec<f64> = before
            .deviations
            .iter()
            .zip(&after.deviations)
            .map(|(b, a)| (b.unwrap() - a.unwrap()).arcsec())
            .collect();
        assert!(rms(&apart) < 0.12, "{}", rms(&apart));
        Ok(())
    });
}

#[test]
fn a_failure_stops_and_disables_the_table() {
    let mut bench = bench(11);
    let failed = bench.machine.guarded(|machine| {
        machine.start()?;
        machine.rotary(AXIS)?.zero()?;
        bench
            .emulated
            .simulation_mut()
            .inject(FaultConfig::permanent(Fault::BlockedAxis { axis: 0 }))
            .expect("every table can be blocked");
        machine
            .rotary(AXIS)?
            .turn_to(Radians::from_degrees(90.0), Way::Shortest)
    });
    assert!(
        matches!(
            failed,
            Err(Failure::Machine(
                machine::Failure::Alarm { .. } | machine::Failure::Device { .. }
            ))
        ),
        "{failed:?}"
    );
    let state = bench.machine.power_state(AXIS).unwrap().unwrap();
    assert_ne!(state.bits(), 0x27, "{state:?}");
}

#[test]
fn a_table_without_plate_or_detector_says_what_to_look_for() {
    let smudge = "smudged_lines = []";
    let all: Vec<String> = (0..360).map(|line| line.to_string()).collect();
    let all = format!("smudged_lines = [{}]", all.join(", "));
    let mut bench = Bench::rotary(12, |text| text, |text| text.edit(smudge, &all));
    run(&mut bench, |bench| {
        ready(bench)?;
        let blind = bench
            .machine
            .rotary(AXIS)?
            .sweep(&options(Approach::Forward));
        let failure = blind.as_ref().err().and_then(Failure::of_kind);
        assert!(
            matches!(failure, Some(RotaryFailure::NoLines { lines: 360, .. })),
            "{blind:?}"
        );
        Ok(())
    });
}
