//! A position display over the encoder of a comparator, in place of the interferometer.

use core::time::Duration;

use drivers::device::nd287::Nd287;
use drivers::device::{Alarm, DeviceError, DisplacementInstrument};
use mock_bus::fault::{Fault, FaultConfig};
use tests::{Bench, Desk, EMULATED, Edit, Emulator, MACHINE, Rig, Setup, rigs};
use truestage::Failure;
use truestage::for_tests::InstrumentDevice;
use truestage::linear::VerifyOptions;
use truestage::CalibrateOptions;
use units::Metres;

/// The section of the instrument in a machine's file.
const SECTION: &str = "[instrument.laser]
device = \"nd287\"
line = \"laser\"
reverse = false
poll_period_ms = 100.0
signal_period_um = 4.0
speed_max_mm_per_s = 500.0
scale_standard_uncertainty_ppm = 0.5
correct_cosine = false
misalignment_mrad = 0.0
instrument_standard_uncertainty_nm = 30.0

";

const EMULATED_SECTION: &str = "kind = \"nd287_display\"\n\n";

/// A part of a shipped file, from one line to the one before another.
fn part(text: &'static str, from: &str, to: &str) -> &'static str {
    let begin = text.find(from).expect("it begins there");
    let length = text[begin..].find(to).expect("it ends there");
    &text[begin..begin + length]
}

fn laser() -> &'static str {
    part(MACHINE, "[instrument.laser]", "[axis.x.zero]")
}

fn interferometer() -> &'static str {
    part(EMULATED, "kind = \"umd2_interferometer\"", "[[nodes]]")
}

/// A machine's file with the display in place of the laser; a few values instead of many.
fn machine(text: String) -> String {
    let text = text.edit(laser(), SECTION);
    text.edit("average_samples = 12", "average_samples = 3")
}

/// The same in the file of its emulation.
fn emulated(text: String) -> String {
    text.edit(interferometer(), EMULATED_SECTION)
}

fn display(rig: Rig) -> Desk<Nd287> {
    let setup = Setup::new(31)
        .machine(laser(), SECTION)
        .emulated(interferometer(), EMULATED_SECTION);
    let emulator = Emulator::new(rig, &setup);
    let loaded = &emulator.loaded;
    let instrument = &loaded.config.instrument["laser"];
    let InstrumentDevice::Nd287(nd287) = &instrument.device else {
        panic!("{:?}", instrument.device)
    };
    let settings = nd287.settings(instrument, loaded.patience);
    Desk::new(emulator, "laser", Nd287::new(settings))
}

/// Runs `procedure` with the started display on every rig.
#[track_caller]
fn check(procedure: impl Fn(&mut Desk<Nd287>)) {
    for rig in rigs() {
        let mut desk = display(rig);
        if let Err(error) = desk.start() {
            panic!("{rig:?}: {error}; {:?}", desk.alarms);
        }
        procedure(&mut desk);
    }
}

fn inject(desk: &Desk<Nd287>, fault: FaultConfig) {
    let injected = desk.emulator.simulation(move |it| it.inject(fault).map(drop));
    injected.expect("a fault of this machine");
}

#[test]
fn a_stage_that_stands_still_reads_zero_and_its_noise() {
    check(|desk| {
        let now = desk.now();
        desk.device.set_datum(now);
        desk.device.begin_average(now, 20);
        desk.outcome().expect("an average");
        let reading = desk.device.average().expect("it has just ended");
        assert!(reading.vacuum.abs() < Metres(100e-9), "{reading:?}");
        let noise_nm = reading.standard_deviation.nm();
        assert!((2.0..100.0).contains(&noise_nm), "{noise_nm}");
        assert_eq!(reading.samples, 20);
    });
}

#[test]
fn dirt_on_the_scale_is_told_and_ends_an_average_without_a_number() {
    check(|desk| {
        inject(desk, FaultConfig::permanent(Fault::BeamBlocked));
        let now = desk.now();
        desk.device.begin_average(now, 5);
        let outcome = desk.outcome();
        assert!(matches!(outcome, Err(DeviceError::Alarmed { .. })), "{outcome:?}");
        let told = desk.alarms.iter().any(|it| it.to_string().contains("signals are faulty"));
        assert!(told, "{:?}", desk.alarms);
        assert_eq!(desk.device.latest(), None);
    });
}

#[test]
fn a_line_that_goes_dead_is_told_and_the_count_is_lost() {
    check(|desk| {
        let node = "interferometer".to_owned();
        inject(desk, FaultConfig::permanent(Fault::Mute { node }));
        desk.live(Duration::from_secs(3));
        let silent = |it: &Alarm| matches!(it, Alarm::StreamSilent { .. });
        assert!(desk.alarms.iter().any(silent), "{:?}", desk.alarms);
        assert_eq!(desk.device.latest(), None);
    });
}

fn cycle(seed: u64) -> Result<[Metres; 2], Failure> {
    let mut bench = Bench::with(seed, machine, emulated);
    let store = bench.store.clone();
    bench.machine.guarded(|machine| {
        machine.start()?;
        let verify = |machine: &mut truestage::Machine, calibration: Option<String>| {
            let options = VerifyOptions {
                compensated: calibration.is_some(),
                calibration,
                resume: None,
            };
            machine.linear("x")?.verify(&store, &options)
        };
        machine.linear("x")?.zero(&store)?;
        let found = verify(machine, None)?;
        let options = CalibrateOptions::default();
        let calibrated = machine.linear("x")?.calibrate(&store, &options)?;
        let left = verify(machine, Some(calibrated.id))?;
        machine.shut_down()?;
        Ok([found, left].map(|it| it.figures.accuracy.bidirectional))
    })
}

#[test]
fn a_stage_is_calibrated_by_it_as_by_an_interferometer() {
    for seed in 1..=5 {
        let [found, left] = cycle(seed).unwrap_or_else(|failure| panic!("seed {seed}: {failure}"));
        assert!(found > Metres::from_um(8.0), "seed {seed}: as found {} µm", found.um());
        assert!(left < Metres::from_um(2.0), "seed {seed}: as left {} µm", left.um());
    }
}

#[test]
fn a_count_that_slips_while_calibrating_is_told_in_signal_periods() {
    let mut bench = Bench::with(7, machine, emulated);
    let store = bench.store.clone();
    let emulated = bench.emulated.clone();
    let result = bench.machine.guarded(|machine| {
        machine.start()?;
        machine.linear("x")?.zero(&store)?;
        let fault = Fault::FringeJump { half_wavelengths: 2 };
        let mut fault = FaultConfig::permanent(fault);
        // While positions are read: a slip between the datum and the first of them looks like a drift.
        fault.from_s = 24.0;
        let injected = emulated.simulation_mut().inject(fault).map(drop);
        injected.expect("a fault of this machine");
        let options = CalibrateOptions::default();
        machine.linear("x")?.calibrate(&store, &options).map(drop)
    });
    let failure = result.expect_err("the count has slipped");
    let text = failure.to_string();
    assert!(text.contains("2 signal periods"), "{text}");
}
