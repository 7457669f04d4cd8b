//! A machine whose CAN interface goes away under it.

use core::time::Duration;
use std::cell::Cell;
use std::rc::Rc;

use drivers::device::AxisCommand;
use drivers::transport::{SendError, Transport};
use tests::{Interface, Rig, Setup, Stand};
use truestage::Failure;
use units::{Metres, Time};
use wire::{Arrival, LinkState, Payload, Port};

/// Does something when its clock has reached a moment.
struct Meddling {
    inner: Box<dyn Transport>,
    at: Rc<Cell<Time>>,
    what: Box<dyn Fn()>,
}

impl Transport for Meddling {
    fn now(&self) -> Time {
        self.inner.now()
    }

    fn send(&mut self, port: Port, payload: &Payload) -> Result<(), SendError> {
        self.inner.send(port, payload)
    }

    fn receive(&mut self, until: Time) -> Option<Arrival> {
        if self.now() >= self.at.get() {
            self.at.set(Time::NEVER);
            (self.what)();
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

/// What the stage does, and when.
fn look(stand: &Stand) -> (Time, Metres) {
    stand.simulation(|it| (it.now(), it.truth().scale_position()))
}

/// The name begins with `vcan`: only such an interface may have a clock that is not real.
///
/// In the middle of a move that takes 80 s of the machine's life `what` happens to the
/// interface: the failure names port and state, and the stage stops far from the target.
#[track_caller]
fn check(name: &'static str, what: fn(&Interface), wanted: LinkState) {
    let interface = Rc::new(Interface::vcan(name));
    // An interface goes and comes by the wall's clock. A little faster than that, the machine has
    // patience with the one core of a guest.
    let setup = Setup::new(31)
        .by_the_wall(1.5)
        .interface(name)
        .machine("\nspeed_mm_per_s = 200.0", "\nspeed_mm_per_s = 0.5")
        .machine("move_timeout_s = 10.0", "move_timeout_s = 100.0");
    let at = Rc::new(Cell::new(Time::NEVER));
    let meddling = |inner| {
        let (at, what) = (at.clone(), Box::new(move || what(&interface)));
        Box::new(Meddling { inner, at, what }) as Box<dyn Transport>
    };
    let mut stand = Stand::wrapped(Rig::Vcan, &setup, meddling);
    let machine = &mut stand.machine;
    machine.start().unwrap_or_else(|it| panic!("{it}"));
    // A search for the zero would take half a minute by the wall's clock, in which a busy computer may
    // hold it up; where the stage counts from is all the same here.
    machine.enable("x").unwrap_or_else(|it| panic!("{it}"));
    let here = AxisCommand::HomeHere {
        position: Metres(0.0),
    };
    let homed = machine.command("x", here, "set origin", Duration::from_secs(5));
    homed.unwrap_or_else(|it| panic!("{it}"));
    machine.set_zeroed("x", true).unwrap();
    at.set(machine.now() + Duration::from_secs(2));
    let failure = machine
        .linear("x")
        .unwrap()
        .move_to(Metres::from_mm(40.0))
        .unwrap_err();
    assert_eq!(at.get(), Time::NEVER, "{failure}");
    let Failure::Machine(machine::Failure::Link { port, state }) = &failure else {
        panic!("{failure}")
    };
    assert_eq!((port.as_str(), *state), ("can0", wanted));
    assert_eq!(failure.exit_code(), 4);
    stops_by_itself(&stand);
}

/// Nobody tells the drive to stop; but it watches our heartbeat, which it hears no more.
fn stops_by_itself(stand: &Stand) {
    let (begin, _) = look(stand);
    loop {
        let (from, before) = look(stand);
        let mut after = (from, before);
        while after.0 < from + Duration::from_millis(200) {
            after = look(stand);
        }
        if (after.1 - before).abs() < Metres::from_um(0.1) {
            assert!(after.1 < Metres::from_mm(35.0), "it reached its target");
            return;
        }
        assert!(from < begin + Duration::from_secs(60), "it still moves");
    }
}

#[test]
#[ignore = "needs SocketCAN"]
fn an_interface_set_down_in_a_move_ends_it_by_name_and_the_stage_stops() {
    check("vcan-down", Interface::down, LinkState::Down);
}

#[test]
#[ignore = "needs SocketCAN"]
fn an_interface_deleted_in_a_move_ends_it_by_name_and_the_stage_stops() {
    check("vcan-del", Interface::delete, LinkState::Gone);
}
