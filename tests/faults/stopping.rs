//! Stopping: on request, by a controller that is killed or held up (classes 39, 40, 50).

use std::cell::RefCell;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::rc::Rc;
use std::time::Duration;

use drivers::transport::{SendError, Transport};
use mock_bus::fault::Fault;
use mock_bus::simulation::Simulation;
use tests::{Bench, Edit};
use truestage::Failure;
use units::{Metres, Time};
use wire::cia402::PowerState;
use wire::{Arrival, Payload, Port};

use crate::scene::{
    Listener, PERIOD, Phase, STOPPING, Scene, WATCH_MASTER, Wanted, check, check_harmless,
    power_state,
};
use crate::witness::{Testimony, Witnessed};

#[test]
fn a_stop_request_stops_every_phase_in_a_controlled_way() {
    let wanted = Wanted {
        cause: |failure| matches!(failure, Failure::Machine(machine::Failure::Interrupted)),
        words: &["stopped on request"],
        within: PERIOD * 2,
        rest: PERIOD * 2 + STOPPING,
    };
    for (phase, after_ms) in [
        (Phase::Zero, 300),
        (Phase::Zero, 4000),
        (Phase::Move, 100),
        (Phase::Stand, 1000),
        (Phase::Calibrate, 2600),
        (Phase::Verify, 2600),
    ] {
        let played = check(
            Scene::during(phase).after_ms(after_ms).stop_request(),
            &wanted,
        );
        assert_eq!(
            power_state(&played.bench.emulated),
            PowerState::SwitchOnDisabled
        );
    }
}

/// Moves, and is killed in the midst of it: nobody ticks any more. Returns when that was.
fn killed_in_motion(watch: &'static str) -> (Bench, Time) {
    let seen = Rc::new(RefCell::new(Testimony::default()));
    let witness = Rc::clone(&seen);
    let key = "watch_master_ms = 500";
    let mut bench = Bench::wrapped(
        1,
        |text| text.edit(key, watch),
        |text| text,
        |inner| Box::new(Witnessed::new(inner, witness)),
    );
    let store = bench.store.clone();
    bench.machine.start().unwrap();
    bench.machine.linear("x").unwrap().zero(&store).unwrap();
    let end = bench.machine.now() + Duration::from_millis(100);
    // As SIGKILL does: nothing is tidied up on the way out.
    seen.borrow_mut()
        .plan(end, Box::new(|_| resume_unwind(Box::new("killed"))));
    let machine = &mut bench.machine;
    let moved = catch_unwind(AssertUnwindSafe(|| {
        machine.linear("x")?.move_to(Metres::from_mm(60.0))
    }));
    assert!(moved.is_err(), "the move ended before: {moved:?}");
    (bench, end)
}

#[test]
fn the_drive_stops_a_stage_whose_controller_was_killed() {
    let (bench, killed) = killed_in_motion("watch_master_ms = 150");
    let mut simulation = bench.emulated.simulation_mut();
    let position = |simulation: &mock_bus::simulation::Simulation| simulation.truth().position();
    let before = position(&simulation);
    simulation.advance(killed + Duration::from_millis(20));
    let moving = (position(&simulation) - before).abs();
    assert!(
        moving.mm() > 1.0,
        "it should still move: {} mm",
        moving.mm()
    );
    // Its last heartbeat may be as old as a heartbeat's period.
    simulation.advance(killed + Duration::from_millis(150) + STOPPING);
    let stopped = position(&simulation);
    simulation.advance(killed + Duration::from_secs(3));
    let crept = (position(&simulation) - stopped).abs();
    assert!(crept.um() < 1.0, "still moving: {} µm", crept.um());
    assert!(
        (60.0 - stopped.mm()).abs() > 5.0,
        "it ran to its target: {} mm",
        stopped.mm()
    );
    drop(simulation);
    let state = power_state(&bench.emulated);
    assert_ne!(state, PowerState::OperationEnabled);
}

#[test]
fn a_controller_held_up_for_a_moment_goes_on() {
    let moment = Duration::from_millis(9);
    for (phase, after_ms) in [(Phase::Calibrate, 2500), (Phase::Move, 100)] {
        let scene = Scene::during(phase).after_ms(after_ms);
        check_harmless(scene.held_up(moment, |_, _| {}));
    }
}

#[test]
fn a_controller_held_up_too_long_finds_the_drive_stopped_and_replays_nothing() {
    const HELD_UP: Duration = Duration::from_secs(2);
    let mut stopped = None;
    let look = move |since: Duration, simulation: &Simulation| {
        let here = simulation.truth().position();
        if since >= WATCH_MASTER + STOPPING {
            let crept = (here - *stopped.get_or_insert(here)).abs();
            assert!(crept.um() < 1.0, "it went on by {} µm", crept.um());
        }
    };
    let wanted = Wanted {
        cause: |failure| matches!(failure, Failure::Machine(machine::Failure::HeldUp { pause, .. }) if *pause > WATCH_MASTER),
        words: &["x:", "kept from its buses"],
        within: Duration::from_millis(2100),
        rest: WATCH_MASTER + STOPPING,
    };
    check(
        Scene::during(Phase::Move)
            .after_ms(60)
            .held_up(HELD_UP, look),
        &wanted,
    );
}

/// Longer than process data may be missing, shorter than the drive's own watch.
#[test]
fn a_controller_that_was_stopped_for_a_fifth_of_a_second_says_that_it_was_held_up() {
    const HELD_UP: Duration = Duration::from_millis(200);
    let wanted = Wanted {
        cause: |failure| matches!(failure, Failure::Machine(machine::Failure::HeldUp { pause, .. }) if *pause > HELD_UP / 2),
        words: &["kept from its buses", "too busy for real time"],
        within: HELD_UP + PERIOD * 4,
        rest: HELD_UP + PERIOD * 4 + STOPPING,
    };
    for (phase, after_ms) in [
        (Phase::Move, 60),
        (Phase::Stand, 1000),
        (Phase::Calibrate, 2500),
    ] {
        let scene = Scene::during(phase).after_ms(after_ms);
        check(scene.held_up(HELD_UP, |_, _| {}), &wanted);
    }
}

/// A transport that hears nothing for `pause`, once, in the middle of a start.
struct Late<T> {
    inner: T,
    pause: Duration,
}

impl<T: Transport> Transport for Late<T> {
    fn now(&self) -> Time {
        self.inner.now()
    }

    fn send(&mut self, port: Port, payload: &Payload) -> Result<(), SendError> {
        self.inner.send(port, payload)
    }

    fn receive(&mut self, until: Time) -> Option<Arrival> {
        if self.inner.now() >= Time::ZERO + STARTING {
            let pause = core::mem::take(&mut self.pause);
            self.inner.sleep_until(self.inner.now() + pause);
        }
        self.inner.receive(until)
    }

    fn sleep_until(&mut self, until: Time) {
        self.inner.sleep_until(until);
    }

    fn set_sync(&mut self, port: Port, period: Option<Duration>) -> Result<(), SendError> {
        self.inner.set_sync(port, period)
    }
}

const STARTING: Duration = Duration::from_millis(20);

/// Nothing was supervised then; what is judged by time may have been spoilt by it.
#[test]
fn a_search_that_fails_after_a_pause_is_told_with_the_pause() {
    let search = |pause: Duration| {
        let mut bench = Bench::wrapped(
            1,
            |text| text.edit("time_limit_s = 60.0", "time_limit_s = 1.0"),
            |text| text,
            |inner| Box::new(Late { inner, pause }),
        );
        let warnings = Rc::new(RefCell::new(Vec::new()));
        let listener = Listener(Rc::clone(&warnings));
        bench.machine.observe(Box::new(listener));
        let zeroed = bench.machine.guarded(|machine| {
            machine.start()?;
            machine.linear("x")?.zero(&bench.store)
        });
        assert!(matches!(zeroed, Err(Failure::Search { .. })), "{zeroed:?}");
        warnings.take().join("\n")
    };
    let warned = search(Duration::from_secs(1));
    assert!(
        warned.contains("kept from its buses for 0.") && warned.contains("pauses: 1,"),
        "{warned}"
    );
    let warned = search(Duration::ZERO);
    assert!(!warned.contains("kept from"), "{warned}");
}

#[test]
fn a_stop_request_while_the_drive_is_silent_ends_all_the_same() {
    let scene = Scene::during(Phase::Move)
        .after_ms(100)
        .fault(Fault::LinkGone {
            port: "can0".into(),
        })
        .stop_request();
    let wanted = Wanted {
        cause: |failure| {
            matches!(
                failure,
                Failure::Machine(machine::Failure::Interrupted | machine::Failure::Link { .. })
            )
        },
        words: &[],
        within: PERIOD,
        rest: WATCH_MASTER + STOPPING,
    };
    check(scene, &wanted);
}
