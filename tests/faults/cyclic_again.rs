//! What stays of a motion that failed: nothing. No order is driven later, no machine moves
//! unsupervised, and an axis that coasted beyond its limits is not jerked back.

use std::cell::RefCell;
use std::rc::Rc;
use std::time::Duration;

use drivers::transport::in_process::InProcess;
use drivers::transport::{SendError, Transport};
use machine::StopRequest;
use machine::engine::EngineFailure;
use machine::engine::{Cause, Engine, NoCorrection, State};
use mock_bus::fault::{Fault, FaultConfig};
use tests::{Bench, Edit, machine_config};
use truestage::emulated::Emulated;
use truestage::{Failure, Machine};
use units::{Metres, Time};
use wire::{Arrival, Payload, Port};

use crate::scene::{cyclic, follow, shortened};
use crate::witness::{Testimony, Witnessed};

fn text(text: String) -> String {
    cyclic(shortened(text))
}

fn zeroed() -> Bench {
    let mut bench = Bench::with(1, text, |text| text);
    bench.machine.start().unwrap();
    bench
        .machine
        .linear("x")
        .unwrap()
        .zero(&bench.store)
        .unwrap();
    bench
}

fn here(bench: &Bench) -> Metres {
    let reading = bench.machine.reading("x").unwrap();
    reading.expect("it has said where it is").position
}

/// Stands for 200 ms, then stops.
fn hold(machine: &mut Machine, engine: &mut Engine, desk: &mut machine::engine::Desk) {
    let mut periods = 0;
    let cause = machine.follow_with(engine, &mut || {
        periods += 1;
        if periods == 40 {
            desk.stop().unwrap();
        }
    });
    assert_eq!(cause.unwrap(), Cause::Asked);
}

#[test]
fn orders_and_points_of_a_motion_that_failed_are_never_driven_later() {
    let mut bench = Bench::with(1, text, |text| text);
    let machine = &mut bench.machine;
    machine.start().unwrap();
    let (mut engine, mut desk) = Engine::new(machine, &["x"], Box::new(NoCorrection)).unwrap();
    desk.move_to(&[Metres::from_mm(30.0)]).unwrap();
    for _ in 0..20 {
        desk.path.push(&[Metres::from_mm(40.0)]).unwrap();
    }
    desk.path.finish().unwrap();
    let refused = machine.follow(&mut engine);
    assert!(
        matches!(refused, Err(machine::Failure::NotZeroed { .. })),
        "{refused:?}"
    );
    machine.linear("x").unwrap().zero(&bench.store).unwrap();
    let before = here(&bench);
    hold(&mut bench.machine, &mut engine, &mut desk);
    let moved = (here(&bench) - before).abs();
    assert!(moved < Metres::from_um(10.0), "{moved}");
}

/// Whoever catches the failure and goes on would do so with every alarm ignored.
#[test]
fn after_a_quick_stop_nothing_moves_until_the_machine_is_started_again() {
    let mut bench = zeroed();
    let emergency = FaultConfig {
        from_s: 0.5,
        ..FaultConfig::times(
            Fault::Emergency {
                port: "can0".into(),
                node_id: 1,
                code: 0x4310,
                register: 0x08,
            },
            1,
        )
    };
    let id = bench.emulated.simulation_mut().inject(emergency).unwrap();
    let machine = &mut bench.machine;
    let stopped = follow(machine);
    assert!(
        matches!(
            stopped,
            Err(Failure::Machine(machine::Failure::Alarm { .. }))
        ),
        "{stopped:?}"
    );
    assert_eq!(bench.emulated.simulation().fault_deliveries(id), 1);
    let refused = |outcome: Result<(), Failure>| {
        let failure = outcome.unwrap_err();
        assert!(
            matches!(
                failure,
                Failure::Machine(machine::Failure::NotStarted { .. })
            ),
            "{failure}"
        );
        assert!(failure.to_string().contains("start it again"), "{failure}");
        assert_eq!(failure.exit_code(), 3);
    };
    refused(follow(machine).map(drop));
    refused(
        machine
            .linear("x")
            .unwrap()
            .move_to(Metres::from_mm(10.0))
            .map(drop),
    );
    refused(machine.linear("x").unwrap().zero(&bench.store).map(drop));
    refused(machine.enable("x").map_err(Failure::from));
    machine.start().unwrap();
    machine.linear("x").unwrap().zero(&bench.store).unwrap();
    assert_eq!(follow(machine).unwrap(), Cause::PathDone);
}

/// Without torque at 200 mm/s shortly before the end: it coasts out of its limits.
#[test]
fn an_axis_outside_its_soft_limits_is_not_jerked_back() {
    let slippery = |text: String| {
        let rough = "friction_deceleration_m_per_s2 = 2.0";
        assert!(text.contains(rough));
        text.edit(rough, "friction_deceleration_m_per_s2 = 1.2")
    };
    let seen = Rc::new(RefCell::new(Testimony::default()));
    let witness = Rc::clone(&seen);
    let wrap = |inner| Box::new(Witnessed::new(inner, witness)) as Box<_>;
    let mut bench = Bench::wrapped(1, text, slippery, wrap);
    let machine = &mut bench.machine;
    machine.start().unwrap();
    machine.linear("x").unwrap().zero(&bench.store).unwrap();
    let request = machine.stop_request();
    let soon = machine.now() + Duration::from_millis(290);
    seen.borrow_mut()
        .plan(soon, Box::new(move |_| request.stop()));
    let moved = machine.linear("x").unwrap().move_to(Metres::from_mm(62.0));
    assert!(
        matches!(moved, Err(Failure::Machine(machine::Failure::Interrupted))),
        "{moved:?}"
    );
    machine.share_stop_request(&StopRequest::default());
    let coasting = FaultConfig::lasting(Fault::SafeTorqueOff, Duration::from_millis(500));
    let id = bench.emulated.simulation_mut().inject(coasting).unwrap();
    let machine = &mut bench.machine;
    let rested = machine.now() + Duration::from_secs(1);
    let mut told = 0;
    while let Err(failure) = machine.run_until(rested) {
        assert!(
            matches!(failure, machine::Failure::Alarm { .. }),
            "{failure}"
        );
        told += 1;
    }
    assert!(told > 0);
    assert_eq!(bench.emulated.simulation().fault_deliveries(id), 1);
    let outside = here(&bench);
    assert!(outside > Metres::from_mm(63.4), "{outside}");
    let failure = follow(&mut bench.machine).unwrap_err();
    let Failure::Machine(machine::Failure::Engine(EngineFailure::Outside { at, max, .. })) =
        &failure
    else {
        panic!("{failure}")
    };
    assert!((*at - outside).abs() < Metres::from_um(10.0) && *max == Metres::from_mm(63.0));
    assert!(failure.to_string().contains("axis x"), "{failure}");
    assert!((here(&bench) - outside).abs() < Metres::from_um(10.0));
    // What it advises.
    let machine = &mut bench.machine;
    machine.reset_fault("x").unwrap();
    machine.linear("x").unwrap().zero(&bench.store).unwrap();
    machine
        .linear("x")
        .unwrap()
        .move_to(Metres::from_mm(50.0))
        .unwrap();
    assert_eq!(follow(machine).unwrap(), Cause::PathDone);
}

/// Locked memory in kilobytes, as the system says.
fn locked_kb() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find_map(|it| it.strip_prefix("VmLck:"));
    let kb = line.and_then(|it| it.split_whitespace().next());
    kb.and_then(|it| it.parse().ok()).unwrap()
}

/// Whether memory was locked each time that SYNC was taken over and given back.
struct SyncWatch {
    inner: InProcess<Emulated>,
    locked: Rc<RefCell<Vec<(bool, bool)>>>,
}

impl Transport for SyncWatch {
    fn now(&self) -> Time {
        self.inner.now()
    }

    fn send(&mut self, port: Port, payload: &Payload) -> Result<(), SendError> {
        self.inner.send(port, payload)
    }

    fn receive(&mut self, until: Time) -> Option<Arrival> {
        self.inner.receive(until)
    }

    fn sleep_until(&mut self, until: Time) {
        self.inner.sleep_until(until);
    }

    fn set_sync(&mut self, port: Port, period: Option<Duration>) -> Result<(), SendError> {
        let locked = locked_kb() > 0;
        self.locked.borrow_mut().push((period.is_some(), locked));
        self.inner.set_sync(port, period)
    }
}

/// Locking takes tens of milliseconds: between two SYNCs every drive would fault.
#[test]
fn memory_is_locked_before_the_loop_takes_over_sync_and_let_go_after_it() {
    let locked = Rc::new(RefCell::new(Vec::new()));
    let watched = Rc::clone(&locked);
    let wrap = |inner| {
        Box::new(SyncWatch {
            inner,
            locked: watched,
        }) as Box<_>
    };
    let mut bench = Bench::wrapped(1, text, |text| text, wrap);
    let machine = &mut bench.machine;
    machine.start().unwrap();
    machine.linear("x").unwrap().zero(&bench.store).unwrap();
    let (mut engine, mut desk) = Engine::new(machine, &["x"], Box::new(NoCorrection)).unwrap();
    engine.in_real_time();
    hold(machine, &mut engine, &mut desk);
    assert_eq!(engine.state(), State::Stopped(Cause::Asked));
    let got = &engine.timing().scheduling;
    let is_locked = got.contains("memory locked");
    assert_eq!(is_locked, !got.contains("memory not locked"), "{got}");
    let locked = locked.borrow();
    let last = &locked[locked.len() - 2..];
    assert_eq!(last, [(false, is_locked), (true, is_locked)], "{got}");
    assert_eq!(locked_kb(), 0);
}

#[test]
fn a_bus_of_another_period_is_refused_although_no_axis_is_on_it() {
    let other = |period: &str| {
        let second = format!(
            "[can.can1]\ntransport = \"slcan\"\npath = \"/dev/ttyACM9\"\n\
             bitrate_bit_per_s = 1000000\nsync_period_ms = {period}\nmaster_node_id = 127\n\
             master_heartbeat_ms = 50\n\n[serial.laser]"
        );
        let folder = tempfile::tempdir().unwrap();
        let loaded = machine_config(folder.path(), |it| text(it).edit("[serial.laser]", &second));
        let bench = Bench::with(1, text, |text| text);
        let machine = Machine::new(&loaded, Box::new(bench.emulated.transport()));
        let made = Engine::new(&machine, &["x"], Box::new(NoCorrection));
        made.map(drop)
    };
    other("5.0").unwrap();
    let failure = other("7.0").unwrap_err();
    assert!(failure.to_string().contains("can1"), "{failure}");
    assert_eq!(failure.exit_code(), 2);
}

#[test]
fn an_axis_that_is_named_twice_is_refused() {
    let bench = Bench::with(1, text, |text| text);
    let made = Engine::new(&bench.machine, &["x", "x"], Box::new(NoCorrection));
    let failure = made.map(drop).unwrap_err();
    assert!(failure.to_string().contains("named twice"), "{failure}");
}
