//! The µMD2 interferometer.

use core::time::Duration;

use drivers::device::umd2::Umd2;
use drivers::device::{Alarm, Device, DisplacementInstrument};
use mock_bus::fault::{Fault, FaultConfig};
use mock_bus::plant::{LineOptics, LineSetUp};
use mock_bus::simulation::Simulation;
use tests::{Desk, Emulator, Setup, rigs};
use truestage::for_tests::InstrumentDevice;
use units::{Metres, Pascals};

type Laser = Desk<Umd2>;

/// Runs `procedure` with the started instrument on every rig.
#[track_caller]
fn check(procedure: impl Fn(&mut Laser)) {
    for rig in rigs() {
        let mut laser = laser(Emulator::new(rig, &Setup::new(23)));
        if let Err(error) = laser.start() {
            panic!("{rig:?}: {error}; {:?}", laser.alarms);
        }
        procedure(&mut laser);
    }
}

fn laser(emulator: Emulator) -> Laser {
    let loaded = &emulator.loaded;
    let instrument = &loaded.config.instrument["laser"];
    let InstrumentDevice::Umd2(umd2) = &instrument.device else {
        panic!("{:?}", instrument.device)
    };
    let settings = umd2.settings(instrument, loaded.patience);
    Desk::new(emulator, "laser", Umd2::new(settings))
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

/// Along x, from where the machine was switched on.
const LINE: LineSetUp = LineSetUp {
    optics: LineOptics::Linear,
    along: [1.0, 0.0, 0.0],
    tool_offset: [Metres::ZERO; 3],
};

fn samples(laser: &Laser) -> u64 {
    let counters = laser.device.counters();
    let samples = counters.iter().find(|(name, _)| *name == "samples");
    samples.expect("it counts them").1
}

/// Silent until somebody sets it up; hands in the beam void its count; what is counted from the
/// next datum on is half wavelengths.
#[test]
fn a_laser_at_three_axes_counts_from_when_a_line_is_set_up() {
    for rig in rigs() {
        let mut laser = laser(Emulator::new(rig, &Setup::volumetric(23)));
        laser.live(Duration::from_secs(1));
        assert_eq!(samples(&laser), 0, "{rig:?}: it is in its case");
        laser
            .emulator
            .simulation(|machine| machine.set_up_line(&LINE));
        let started = laser.start();
        started.unwrap_or_else(|error| panic!("{rig:?}: {error}"));
        laser.live_until(|laser| laser.latest().is_some());
        laser.alarms.clear();
        laser
            .emulator
            .simulation(|machine| machine.set_up_line(&LINE));
        laser.live(Duration::from_millis(700));
        assert_eq!(laser.alarms, [Alarm::BeamLost], "{rig:?}");
        assert_eq!(laser.device.latest(), None, "{rig:?}");
        let now = laser.now();
        laser.device.set_datum(now);
        let before = average(&mut laser, 100);
        let half_wavelengths = 5;
        let jump = FaultConfig::permanent(Fault::FringeJump { half_wavelengths });
        let injected = laser.emulator.simulation(|machine| machine.inject(jump));
        injected.expect("no port is named");
        laser.live(Duration::from_millis(200));
        let moved = average(&mut laser, 100) - before;
        assert!(
            (moved.nm() - 5.0 * 316.495_686).abs() < 5.0,
            "{rig:?}: {} nm",
            moved.nm()
        );
        laser.emulator.simulation(Simulation::take_line_away);
        laser.live(Duration::from_millis(200));
        let said = samples(&laser);
        laser.live(Duration::from_secs(1));
        assert_eq!(samples(&laser), said, "{rig:?}: it is packed up");
    }
}
