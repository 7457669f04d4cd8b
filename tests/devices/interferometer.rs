//! The µMD2 interferometer.

use core::time::Duration;

use drivers::device::umd2::Umd2;
use drivers::device::{Alarm, DisplacementInstrument};
use mock_bus::fault::{Fault, FaultConfig};
use tests::{Desk, Emulator, Setup, rigs};
use truestage::assemble;
use units::{Metres, Pascals};

type Laser = Desk<Umd2>;

/// Runs `procedure` with the started instrument on every rig.
#[track_caller]
fn check(procedure: impl Fn(&mut Laser)) {
    for rig in rigs() {
        let emulator = Emulator::new(rig, &Setup::new(23));
        let loaded = &emulator.loaded;
        let instrument = &loaded.config.instrument["laser"];
        let settings = assemble::umd2_settings(instrument, loaded.patience);
        let mut laser = Desk::new(emulator, "laser", Umd2::new(settings));
        if let Err(error) = laser.start() {
            panic!("{rig:?}: {error}; {:?}", laser.alarms);
        }
        procedure(&mut laser);
    }
}

fn average(laser: &mut Laser, samples: u32) -> Metres {
    let now = laser.now();
    laser.device.begin_average(now, samples);
    let outcome = laser.outcome();
    outcome.unwrap_or_else(|error| panic!("{error}; {:?}", laser.alarms));
    let average = laser.device.average().expect("it ended well");
    assert_eq!(average.samples, samples);
    average.vacuum
}

#[test]
fn a_datum_reads_zero_and_a_resting_stage_stays_there() {
    check(|laser| {
        laser.live_until(|laser| laser.latest().is_some());
        let now = laser.now();
        laser.device.set_datum(now);
        for _ in 0..3 {
            let displacement = average(laser, 100);
            assert!(
                displacement.abs() < Metres(200e-9),
                "{} nm",
                displacement.nm()
            );
        }
        assert_eq!(laser.alarms, []);
    });
}

#[test]
fn its_sensors_say_what_the_weather_is() {
    check(|laser| {
        laser.live_until(|laser| {
            let it = laser.environment();
            it.air_temperature.and(it.pressure).is_some() && it.humidity.is_some()
        });
        let said = laser.device.environment();
        let truth = laser
            .emulator
            .simulation(|simulation| simulation.truth().environment());
        let temperature = said.air_temperature.expect("awaited").0;
        assert!(
            (temperature - truth.air_temperature.0).abs() < 0.2,
            "{temperature} °C"
        );
        let Pascals(pressure) = said.pressure.expect("awaited");
        assert!((pressure - 100_200.0).abs() < 200.0, "{pressure} Pa");
        let humidity = said.humidity.expect("awaited").0;
        assert!((humidity - 0.46).abs() < 0.05, "{humidity}");
    });
}

#[test]
fn a_blocked_beam_is_an_alarm_and_no_number_until_a_new_datum() {
    check(|laser| {
        laser.live_until(|laser| laser.latest().is_some());
        let blocked = laser
            .emulator
            .simulation(|simulation| simulation.inject(FaultConfig::permanent(Fault::BeamBlocked)));
        let blocked = blocked.expect("every beam can be blocked");
        laser.live_until(|laser| laser.latest().is_none());
        assert!(
            laser.alarms.contains(&Alarm::BeamLost),
            "{:?}",
            laser.alarms
        );
        laser
            .emulator
            .simulation(move |simulation| simulation.end_fault(blocked));
        laser.live(Duration::from_millis(500));
        assert!(
            laser.device.latest().is_none(),
            "a lost count is never read again"
        );
        let now = laser.now();
        laser.device.set_datum(now);
        let displacement = average(laser, 50);
        assert!(
            displacement.abs() < Metres(200e-9),
            "{} nm",
            displacement.nm()
        );
    });
}
