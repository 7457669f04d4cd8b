//! The two analog modules on the Hall sensors: CiA 401 on CAN, DCON on a serial line.

use core::time::Duration;

use drivers::device::cia401::Cia401Analog;
use drivers::device::dcon::Dcon;
use drivers::device::{Alarm, AnalogInput, AnalogReading, Device};
use mock_bus::fault::{Fault, FaultConfig};
use mock_bus::simulation::Simulation;
use tests::{Desk, Emulator, Rig, Setup, rigs};
use truestage::for_tests::ModuleConfig;
use units::Volts;

/// How long a module may be silent.
const SILENCE: Duration = Duration::from_millis(1500);

fn cia401(rig: Rig) -> Desk<Cia401Analog> {
    let emulator = Emulator::new(rig, &Setup::new(22));
    let loaded = &emulator.loaded;
    let analog = &loaded.config.analog["hall"];
    let ModuleConfig::Cia401(module) = &analog.module else {
        panic!("{:?}", analog.module)
    };
    let settings = module.settings(analog, loaded.config.wiring(), loaded.patience);
    Desk::new(emulator, "can0", Cia401Analog::new(settings))
}

fn dcon(rig: Rig) -> Desk<Dcon> {
    let emulator = Emulator::new(rig, &Setup::new(22).over_dcon());
    let loaded = &emulator.loaded;
    let analog = &loaded.config.analog["hall"];
    let ModuleConfig::Dcon(module) = &analog.module else {
        panic!("{:?}", analog.module)
    };
    let mut settings = module.settings(analog, loaded.patience);
    settings.stale_after = SILENCE;
    Desk::new(emulator, "adc", Dcon::new(settings))
}

/// Runs `procedure` with the started module on every rig.
#[track_caller]
fn check<D: AnalogInput>(module: impl Fn(Rig) -> Desk<D>, procedure: impl Fn(&mut Desk<D>)) {
    for rig in rigs() {
        let mut desk = module(rig);
        if let Err(error) = desk.start() {
            panic!("{rig:?}: {error}; {:?}", desk.alarms);
        }
        desk.live_until(|device| device.reading().is_some());
        procedure(&mut desk);
    }
}

/// A reading made after now.
fn fresh<D: AnalogInput>(desk: &mut Desk<D>) -> AnalogReading {
    let now = desk.now() + Duration::from_millis(300);
    desk.live_until(|device| device.reading().is_some_and(|it| it.at > now));
    desk.device
        .reading()
        .expect("it has just been read")
        .clone()
}

fn inject<D: Device>(desk: &Desk<D>, fault: Fault) {
    let inject = move |it: &mut Simulation| it.inject(FaultConfig::permanent(fault)).map(drop);
    desk.emulator
        .simulation(inject)
        .expect("the fault is one of this machine");
}

fn reads_plausible_voltages<D: AnalogInput>(desk: &mut Desk<D>) {
    let first = fresh(desk);
    let second = fresh(desk);
    assert_eq!(first.volts.len(), 2);
    assert_eq!(first.saturated, [false, false]);
    for (a, b) in first.volts.iter().zip(&second.volts) {
        // The stage is within 1.5 mm of the magnets, where the sensors see more than noise.
        assert!(a.value().abs() < 5.0, "{a:?}");
        assert!((a.value() - b.value()).abs() < 0.01, "{a:?}, then {b:?}");
    }
    let strongest = first
        .volts
        .iter()
        .fold(0.0_f64, |top, it| top.max(it.value().abs()));
    assert!(strongest > 0.05, "{:?}", first.volts);
    assert_eq!(desk.alarms, []);
}

fn shows_a_rail_as_saturation<D: AnalogInput>(desk: &mut Desk<D>) {
    inject(desk, Fault::InputRail { channel: 1 });
    let reading = fresh(desk);
    assert!(reading.volts[1].value().abs() > 4.9, "{:?}", reading.volts);
    assert!(!reading.saturated[0]);
}

#[test]
fn a_cia_401_module_reads_plausible_voltages() {
    check(cia401, reads_plausible_voltages);
}

#[test]
fn a_cia_401_module_on_the_rail_is_saturated() {
    check(cia401, |desk| {
        shows_a_rail_as_saturation(desk);
        assert!(fresh(desk).saturated[1]);
    });
}

#[test]
fn a_dcon_module_reads_plausible_voltages() {
    check(dcon, reads_plausible_voltages);
}

#[test]
fn a_dcon_module_shows_the_rail_of_its_input() {
    check(dcon, shows_a_rail_as_saturation);
}

#[test]
fn exchanged_inputs_exchange_their_values_on_both_modules() {
    fn swapped<D: AnalogInput>(desk: &mut Desk<D>) {
        let [a, b] = fresh(desk).volts[..] else {
            panic!("two channels")
        };
        inject(desk, Fault::InputsSwapped);
        let [c, d] = fresh(desk).volts[..] else {
            panic!("two channels")
        };
        let near = |x: Volts, y: Volts| (x.value() - y.value()).abs() < 0.01;
        assert!(near(a, d) && near(b, c), "{a:?} {b:?}, then {c:?} {d:?}");
    }
    check(cia401, swapped);
    check(dcon, swapped);
}

#[test]
fn a_silent_dcon_module_is_an_alarm_and_no_old_value() {
    check(dcon, |desk| {
        inject(
            desk,
            Fault::Silence {
                port: "adc".to_owned(),
            },
        );
        let since = desk.now();
        desk.live(SILENCE * 2);
        let stale = |alarm: &Alarm| matches!(alarm, Alarm::StaleSample { .. });
        assert!(desk.alarms.iter().any(stale), "{:?}", desk.alarms);
        let reading = desk.device.reading();
        assert!(reading.is_none_or(|it| it.at <= since + Duration::from_secs(1)));
    });
}
