//! An emulated machine that outlives the programs that keep it, and whose time passes only as far as a
//! history lets it.
//!
//! The machine's thread waits at every arrival until the history lets time pass: to a moment, or to the
//! answer of the order that is on its way. An order is taken at the moment at which it was given, so
//! that one seed is one history.

use std::collections::BTreeMap;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use drivers::transport::in_process::{InProcess, World};
use drivers::transport::{SendError, Transport};
use mock_bus::config::MachineConfig as EmulatedConfig;
use mock_bus::simulation::{DeliverError, Event, Link, Simulation};
use service::Desk;
use truestage::config::Loaded;
use truestage::for_tests::port_numbers;
use units::Time;
use wire::{Arrival, Input, LinkState, Payload, Port, Ports};

use super::judge::{Judge, Violation};

/// A machine's thread that has not come back for so long hangs.
const HANGS: Duration = Duration::from_secs(600);
/// Most programs have started in this time of the machine.
const START: Duration = Duration::from_millis(1500);
/// The player says in this time of the wall that its program has started.
const SAYS_SO: Duration = Duration::from_millis(500);
/// How often is looked whether an order has been given.
const LOOK_EVERY: Duration = Duration::from_micros(20);

/// How far time may pass.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Pass {
    /// To this moment, and on as long as the program has not started.
    Start { until: Time, started: bool },
    /// To this moment.
    Until(Time),
    /// To the answer of an order, which may not have been given yet.
    Answer { given: bool },
    /// Nowhere.
    Held,
}

/// The devices and their judge.
pub(super) struct Devices {
    pub(super) simulation: Simulation,
    /// One for each axis.
    pub(super) judges: Vec<Judge>,
    /// The controller's ports in the order of the simulation's.
    hosts: Vec<Option<Port>>,
    ports: BTreeMap<Port, Port>,
}

impl Devices {
    fn look(&mut self) {
        for judge in &mut self.judges {
            judge.look(&mut self.simulation);
        }
    }

    /// The first that was wrong.
    pub(super) fn violation(&self) -> Option<Violation> {
        let all = self
            .judges
            .iter()
            .filter_map(|judge| judge.violation.clone());
        all.min_by_key(|violation| violation.at)
    }

    /// Lets time pass where no program lives.
    pub(super) fn rest(&mut self, span: Duration) {
        const STEP: Duration = Duration::from_millis(5);
        let end = self.simulation.now() + span;
        while self.simulation.now() < end {
            let next = (self.simulation.now() + STEP).min(end);
            self.simulation.advance(next);
            while self.simulation.collect().is_some() {}
            self.look();
        }
    }
}

/// The machine and the way of its time.
pub(super) struct Stage {
    devices: Mutex<Devices>,
    pass: Mutex<Pass>,
    changed: Condvar,
    desk: Mutex<Option<Desk>>,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Stage {
    pub(super) fn new(
        emulated: &EmulatedConfig,
        seed: u64,
        loaded: &Loaded,
        judges: Vec<Judge>,
    ) -> Arc<Self> {
        let simulation = Simulation::new(emulated, seed).expect("the emulation was checked");
        let mut hosts = vec![None; emulated.ports.len()];
        let mut ports = BTreeMap::new();
        for (name, host) in port_numbers(&loaded.config) {
            let place = emulated.port(&name).expect("both describe one machine");
            hosts[place] = Some(host);
            ports.insert(host, Port(place as u8));
        }
        Arc::new(Self {
            devices: Mutex::new(Devices {
                simulation,
                judges,
                hosts,
                ports,
            }),
            pass: Mutex::new(Pass::Held),
            changed: Condvar::new(),
            desk: Mutex::new(None),
        })
    }

    /// The devices, while no time passes.
    pub(super) fn devices(&self) -> MutexGuard<'_, Devices> {
        lock(&self.devices)
    }

    /// A program's transport to the devices.
    pub(super) fn transport(self: &Arc<Self>) -> Box<dyn Transport> {
        Box::new(Gated {
            inner: InProcess::new(Wires(Arc::clone(self))),
            stage: Arc::clone(self),
        })
    }

    /// A program lives, and can be asked at `desk`.
    pub(super) fn set_desk(&self, desk: Option<Desk>) {
        for judge in &mut self.devices().judges {
            judge.set_desk(desk.clone());
        }
        *lock(&self.desk) = desk;
    }

    /// Starts a program by `start`; so much time passes for every program that takes no longer.
    pub(super) fn start<R>(&self, start: impl FnOnce() -> R, is_over: impl Fn(&R) -> bool) -> R {
        let until = self.devices().simulation.now() + START;
        self.go(Pass::Start {
            until,
            started: false,
        });
        let program = start();
        if let Pass::Start { started, .. } = &mut *lock(&self.pass) {
            *started = true;
        }
        self.changed.notify_all();
        self.wait(|| is_over(&program));
        program
    }

    /// Lets `span` pass; returns when it has.
    pub(super) fn let_pass(&self, span: Duration, is_over: impl Fn() -> bool) {
        let until = self.devices().simulation.now() + span;
        self.go(Pass::Until(until));
        self.wait(is_over);
    }

    /// Gives an order and lets time pass until it is answered.
    pub(super) fn ask<R>(&self, order: impl FnOnce() -> R, is_over: impl Fn() -> bool) -> R {
        self.go(Pass::Answer { given: false });
        let answered = order();
        let mut pass = lock(&self.pass);
        if *pass == (Pass::Answer { given: false }) {
            // Refused before it reached the machine.
            *pass = Pass::Held;
        }
        drop(pass);
        self.wait(is_over);
        answered
    }

    fn go(&self, pass: Pass) {
        *lock(&self.pass) = pass;
        self.changed.notify_all();
    }

    fn wait(&self, is_over: impl Fn() -> bool) {
        const SLICE: Duration = Duration::from_millis(50);
        let begun = Instant::now();
        let mut pass = lock(&self.pass);
        while *pass != Pass::Held && !is_over() {
            let waited = self.changed.wait_timeout(pass, SLICE);
            (pass, _) = waited.unwrap_or_else(PoisonError::into_inner);
            assert!(begun.elapsed() < HANGS, "the machine's thread hangs");
        }
    }

    fn unanswered(&self) -> usize {
        lock(&self.desk).as_ref().map_or(0, Desk::unanswered)
    }

    /// The machine's thread waits here for its time.
    fn wait_for_time(&self, now: Time) {
        let mut pass = lock(&self.pass);
        loop {
            match *pass {
                Pass::Start { until, .. } if now < until => return,
                Pass::Start { started: true, .. } => self.arrive(&mut pass),
                Pass::Start { until, .. } => pass = self.wait_for_start(pass, until),
                Pass::Until(until) if now < until => return,
                Pass::Until(_) => self.arrive(&mut pass),
                Pass::Answer { given: false } if self.unanswered() > 0 => {
                    *pass = Pass::Answer { given: true };
                    return;
                }
                Pass::Answer { given: true } if self.unanswered() > 0 => return,
                Pass::Answer { given: true } => self.arrive(&mut pass),
                Pass::Answer { given: false } => {
                    let waited = self.changed.wait_timeout(pass, LOOK_EVERY);
                    (pass, _) = waited.unwrap_or_else(PoisonError::into_inner);
                }
                Pass::Held => {
                    let waited = self.changed.wait(pass);
                    pass = waited.unwrap_or_else(PoisonError::into_inner);
                }
            }
        }
    }

    /// The player may be about to say that its program has started; else that needs more time.
    fn wait_for_start<'p>(&self, pass: MutexGuard<'p, Pass>, until: Time) -> MutexGuard<'p, Pass> {
        let starts = |pass: &mut Pass| matches!(pass, Pass::Start { started: false, .. });
        let waited = self.changed.wait_timeout_while(pass, SAYS_SO, starts);
        let (mut pass, waited) = waited.unwrap_or_else(PoisonError::into_inner);
        if waited.timed_out() {
            *pass = Pass::Start {
                until: until + START,
                started: false,
            };
        }
        pass
    }

    fn arrive(&self, pass: &mut Pass) {
        *pass = Pass::Held;
        self.changed.notify_all();
    }
}

struct Gated {
    inner: InProcess<Wires>,
    stage: Arc<Stage>,
}

impl Transport for Gated {
    fn now(&self) -> Time {
        self.inner.now()
    }

    fn send(&mut self, port: Port, payload: &Payload) -> Result<(), SendError> {
        self.inner.send(port, payload)
    }

    fn receive(&mut self, until: Time) -> Option<Arrival> {
        self.receive_unhurried(until, Ports::NONE)
    }

    fn receive_unhurried(&mut self, until: Time, unhurried: Ports) -> Option<Arrival> {
        self.stage.wait_for_time(self.inner.now());
        self.inner.receive_unhurried(until, unhurried)
    }

    fn sleep_until(&mut self, until: Time) {
        self.inner.sleep_until(until);
    }

    fn set_sync(&mut self, port: Port, period: Option<Duration>) -> Result<(), SendError> {
        self.inner.set_sync(port, period)
    }
}

/// The devices at the other end of a program's ports.
struct Wires(Arc<Stage>);

impl World for Wires {
    fn now(&self) -> Time {
        self.0.devices().simulation.now()
    }

    fn next_event(&self) -> Time {
        self.0.devices().simulation.next_event()
    }

    fn advance(&mut self, to: Time) {
        let mut devices = self.0.devices();
        devices.simulation.advance(to);
        devices.look();
    }

    fn advance_until_arrival(&mut self, to: Time) -> Time {
        let mut devices = self.0.devices();
        devices.simulation.advance_until_delivery(to);
        devices.look();
        devices.simulation.now()
    }

    fn deliver(&mut self, at: Time, port: Port, payload: &Payload) -> Result<(), SendError> {
        let mut devices = self.0.devices();
        let inner = devices.ports.get(&port).copied();
        let inner = inner.ok_or(SendError::WrongKind { port })?;
        let delivered = devices.simulation.deliver(at, inner, payload);
        delivered.map_err(|error| match error {
            DeliverError::NoPort { .. } | DeliverError::WrongKind { .. } => {
                SendError::WrongKind { port }
            }
            DeliverError::Unusable { link, .. } => SendError::Unusable {
                port,
                state: link_state(link),
            },
            DeliverError::QueueFull { .. } => SendError::QueueFull { port },
        })
    }

    fn collect(&mut self) -> Option<Arrival> {
        let mut devices = self.0.devices();
        loop {
            let delivery = devices.simulation.collect()?;
            // A line that the machine does not use.
            let Some(port) = devices.hosts[usize::from(delivery.port.0)] else {
                continue;
            };
            let input = match delivery.event {
                Event::Payload(payload) => Input::Payload(payload),
                Event::BusError(error) => Input::BusError(error),
                Event::Link(link) => Input::Link(link_state(link)),
            };
            return Some(Arrival {
                port,
                at: delivery.at,
                input,
            });
        }
    }
}

const fn link_state(link: Link) -> LinkState {
    match link {
        Link::Up => LinkState::Up,
        Link::Down => LinkState::Down,
        Link::Gone => LinkState::Gone,
    }
}
