//! A service on an emulated machine in virtual time or in lockstep, which passes only while somebody asks or waits.

use std::path::Path;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, OnceLock, PoisonError};

use core::time::Duration;

use drivers::transport::{SendError, Transport};
use machine::records::files::{Files, os_files};
use mock_bus::fault::{Fault, FaultConfig, FaultId};
use mock_bus::simulation::Simulation;
use service::{Desk, Opened, Service};
use tests::{PlantTrace, Rig, Shipped, shipped_config};
use truestage::config::Loaded;
use truestage::emulated::{Emulated, EmulatedOnPtys};
use truestage::{Failure, Machine, ports};
use units::Time;
use wire::{Arrival, Payload, Port, Ports};

use crate::client::PATIENCE;

/// So much passes at most for a request that does not wait: nothing that ends by itself within it is asked of a
/// service here, and a drive is switched on within a few of them.
const ALLOWANCE: Duration = Duration::from_millis(50);
/// While an order has no answer and its time is used up, a tick passes each time: it is taken at the end of one.
const TRICKLE: Duration = Duration::from_millis(2);
/// How often it is looked whether there is such an order; no time of the machine passes by looking.
const LOOK_EVERY: Duration = Duration::from_millis(1);

/// Time passes while it is open. How much passes for a request is counted by the machine's clock: a computer that
/// holds up the one who asked does not let the machine run on meanwhile.
#[derive(Debug, Default)]
pub(crate) struct Gate {
    doors: Mutex<Doors>,
    opened: Condvar,
    /// So much has passed as somebody wanted to pass.
    passed: Condvar,
    /// Who knows how many orders have no answer.
    desk: OnceLock<Desk>,
}

#[derive(Debug)]
struct Doors {
    /// How many keep it open.
    open: u32,
    /// How many of them wait for what takes its time.
    waiting: u32,
    /// So much time passes at most each time that somebody else opens it.
    allowance: Duration,
    /// Somebody has opened it since the machine's thread looked last.
    is_fresh: bool,
    /// When the allowance is used up.
    until: Option<Time>,
    /// So much time is to pass, whoever asks meanwhile.
    wanted: Option<Duration>,
    /// When it has.
    wanted_until: Option<Time>,
}

impl Default for Doors {
    fn default() -> Self {
        Self {
            open: 0,
            waiting: 0,
            allowance: ALLOWANCE,
            is_fresh: false,
            until: None,
            wanted: None,
            wanted_until: None,
        }
    }
}

impl Doors {
    /// Whether the time may go on from `now`.
    fn let_pass(&mut self, now: Time) -> bool {
        if core::mem::take(&mut self.is_fresh) {
            self.until = Some(now + self.allowance);
        }
        if let Some(wanted) = self.wanted.take() {
            self.wanted_until = Some(now + wanted);
        }
        let is_before = |until: Option<Time>| until.is_some_and(|until| now < until);
        is_before(self.wanted_until) || self.open > 0 && (self.waiting > 0 || is_before(self.until))
    }

    /// Whether what was wanted to pass has passed at `now`.
    fn has_passed(&mut self, now: Time) -> bool {
        let has = self.wanted_until.is_some_and(|until| now >= until);
        if has {
            self.wanted_until = None;
        }
        has
    }
}

impl Gate {
    /// A little time passes for a request, and hardly more while its answer is on its way.
    pub(crate) fn pass(self: &Arc<Self>) -> Passing {
        self.open(false)
    }

    /// Time passes until this is dropped: somebody waits for an end.
    pub(crate) fn wait_for_an_end(self: &Arc<Self>) -> Passing {
        self.open(true)
    }

    /// For a request that may wait so long.
    pub(crate) fn pass_for(self: &Arc<Self>, wait: Duration) -> Passing {
        self.open(!wait.is_zero())
    }

    fn open(self: &Arc<Self>, waits: bool) -> Passing {
        let mut doors = self.doors();
        doors.open += 1;
        doors.waiting += u32::from(waits);
        doors.is_fresh = true;
        self.opened.notify_all();
        Passing {
            gate: Arc::clone(self),
            waits,
        }
    }

    /// Returns when so much has passed by the machine's clock, and no more.
    pub(crate) fn let_pass(&self, wanted: Duration) {
        let mut doors = self.doors();
        doors.wanted = Some(wanted);
        self.opened.notify_all();
        let is_due = |doors: &mut Doors| doors.wanted.is_some() || doors.wanted_until.is_some();
        let waited = self.passed.wait_timeout_while(doors, PATIENCE, is_due);
        let (doors, timed_out) = waited.unwrap_or_else(PoisonError::into_inner);
        drop(doors);
        assert!(!timed_out.timed_out(), "the machine ticks no more");
    }

    /// From now on at most `allowance` passes for each request: whoever asks many times a second does so by the
    /// machine's clock.
    pub(crate) fn limit(&self, allowance: Duration) {
        self.doors().allowance = allowance;
    }

    /// As before a limit.
    pub(crate) fn lift_limit(&self) {
        self.limit(ALLOWANCE);
    }

    fn hold(&self, now: Time) {
        let mut doors = self.doors();
        loop {
            let goes_on = doors.let_pass(now);
            if doors.has_passed(now) {
                self.passed.notify_all();
            }
            if goes_on {
                return;
            }
            if doors.open > 0 && self.has_an_order() {
                doors.until = Some(now + TRICKLE);
                continue;
            }
            let waited = self.opened.wait_timeout(doors, LOOK_EVERY);
            (doors, _) = waited.unwrap_or_else(PoisonError::into_inner);
        }
    }

    fn has_an_order(&self) -> bool {
        self.desk.get().is_some_and(|desk| desk.unanswered() > 0)
    }

    fn doors(&self) -> MutexGuard<'_, Doors> {
        self.doors.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Keeps time passing.
#[derive(Debug)]
pub(crate) struct Passing {
    gate: Arc<Gate>,
    waits: bool,
}

impl Drop for Passing {
    fn drop(&mut self) {
        let mut doors = self.gate.doors();
        doors.open -= 1;
        doors.waiting -= u32::from(self.waits);
    }
}

type Meddling = Box<dyn FnOnce(&mut Simulation) + Send>;
type OpenedTransport = (Box<dyn Transport>, Option<(Emulated, Receiver<Meddling>)>);

/// A transport to the emulated machine that waits at the gate.
struct Gated {
    inner: Box<dyn Transport>,
    gate: Arc<Gate>,
    /// In this process it is this thread that meddles.
    meddling: Option<(Emulated, Receiver<Meddling>)>,
    trace: Arc<Mutex<Option<PlantTrace>>>,
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
        self.gate.hold(self.inner.now());
        if let Some((emulated, meddling)) = &self.meddling {
            let mut trace = self.trace.lock().unwrap_or_else(PoisonError::into_inner);
            if let Some(trace) = trace.as_mut() {
                trace.note(self.inner.now(), &emulated.simulation());
            }
            drop(trace);
            for meddle in meddling.try_iter() {
                meddle(&mut emulated.simulation_mut());
            }
        }
        self.inner.receive_unhurried(until, unhurried)
    }

    fn sleep_until(&mut self, until: Time) {
        self.inner.sleep_until(until);
    }

    fn set_sync(&mut self, port: Port, period: Option<Duration>) -> Result<(), SendError> {
        self.inner.set_sync(port, period)
    }
}

/// Where the emulated machine is.
enum Place {
    /// In the machine's thread.
    InProcess(Sender<Meddling>),
    /// In a thread of its own, behind terminals.
    Running(Box<EmulatedOnPtys>),
}

/// A service that keeps an emulated machine.
pub(crate) struct Stage {
    pub(crate) desk: Desk,
    pub(crate) gate: Arc<Gate>,
    place: Place,
    service: Option<Service>,
    trace: Arc<Mutex<Option<PlantTrace>>>,
}

impl Stage {
    /// The machine `shipped` with `seed` on `rig`, its records below `folder`, after `change` of its
    /// configuration.
    pub(crate) fn new(
        rig: Rig,
        (shipped, seed): (Shipped, u64),
        folder: &Path,
        change: impl Fn(String) -> String,
    ) -> Self {
        let loaded = shipped_config(&shipped, folder, change);
        let text = shipped.emulated;
        let emulated = match rig {
            Rig::InProcess => return Self::in_process(os_files(), loaded, text, seed),
            Rig::Pty => EmulatedOnPtys::in_lockstep(text, seed),
            Rig::Vcan => EmulatedOnPtys::in_lockstep_on_socketcan(text, seed, "vcan0"),
        };
        Self::on_ptys(
            loaded,
            emulated.unwrap_or_else(|error| panic!("{rig:?}: {error}")),
        )
    }

    /// The machine `shipped` in this process, with `files` as the disk of its ledger.
    pub(crate) fn on_disk(
        files: Arc<dyn Files>,
        (shipped, seed): (Shipped, u64),
        folder: &Path,
        change: impl Fn(String) -> String,
    ) -> Self {
        let loaded = shipped_config(&shipped, folder, change);
        Self::in_process(files, loaded, shipped.emulated, seed)
    }

    fn in_process(files: Arc<dyn Files>, loaded: Loaded, text: &'static str, seed: u64) -> Self {
        let (meddling, received) = channel();
        let open = move |loaded: &Loaded| {
            let emulated = Emulated::new(text, seed, &loaded.config)?;
            let transport: Box<dyn Transport> = Box::new(emulated.transport());
            Ok((transport, Some((emulated, received))))
        };
        Self::start(files, loaded, open, Place::InProcess(meddling))
    }

    fn on_ptys(mut loaded: Loaded, emulated: EmulatedOnPtys) -> Self {
        let overrides = emulated.overrides(&loaded.config);
        let overrides = overrides.expect("its ports were matched");
        let pace = emulated.pace("a test").expect("the emulator runs");
        loaded.patience = pace.patience();
        let open = move |loaded: &Loaded| {
            let live = ports::open(&loaded.config, &overrides, ports::Use::Measurement, pace)?;
            let transport: Box<dyn Transport> = Box::new(live);
            Ok((transport, None))
        };
        Self::start(os_files(), loaded, open, Place::Running(Box::new(emulated)))
    }

    fn start<O>(files: Arc<dyn Files>, loaded: Loaded, open: O, place: Place) -> Self
    where
        O: FnOnce(&Loaded) -> Result<OpenedTransport, Failure> + Send + 'static,
    {
        let gate = Arc::new(Gate::default());
        let trace = Arc::default();
        let inner_trace = Arc::clone(&trace);
        let inner_gate = Arc::clone(&gate);
        let store = loaded.config.machine.store();
        let passing = gate.wait_for_an_end();
        let service = Service::start_with(files, move || {
            let (inner, meddling) = open(&loaded)?;
            let transport = Gated {
                inner,
                gate: inner_gate,
                meddling,
                trace: inner_trace,
            };
            Ok(Opened {
                machine: Machine::new(&loaded, Box::new(transport)),
                store,
                held: Box::new(()),
                teller: None,
            })
        });
        drop(passing);
        let service = service.unwrap_or_else(|error| panic!("{error}"));
        let known = gate.desk.set(service.desk());
        known.expect("a gate has one service");
        Self {
            desk: service.desk(),
            gate,
            place,
            service: Some(service),
            trace,
        }
    }

    /// Does something to the simulated machine, in its own thread, and returns what that gave.
    pub(crate) fn simulation<R: Send + 'static>(
        &self,
        work: impl FnOnce(&mut Simulation) -> R + Send + 'static,
    ) -> R {
        let meddling = match &self.place {
            Place::InProcess(meddling) => meddling,
            Place::Running(emulated) => {
                let result = emulated.running().with(work);
                return result.unwrap_or_else(|error| panic!("{error}"));
            }
        };
        let (send, received) = channel();
        let meddle: Meddling = Box::new(move |simulation| {
            // The test waits for it.
            let _ = send.send(work(simulation));
        });
        meddling.send(meddle).expect("the machine is there");
        let _passing = self.gate.pass();
        received.recv().expect("the machine ticks")
    }

    /// Takes down what the plant does from now on; where it is in this process.
    pub(crate) fn trace_anew(&self) {
        *self.trace() = Some(PlantTrace::default());
    }

    /// What the plant has done since.
    pub(crate) fn traced(&self) -> PlantTrace {
        self.trace().clone().expect("it was asked for")
    }

    fn trace(&self) -> MutexGuard<'_, Option<PlantTrace>> {
        self.trace.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Something goes wrong from now on.
    pub(crate) fn inject(&self, fault: Fault) -> FaultId {
        self.simulation(|simulation| {
            let fault = FaultConfig::permanent(fault);
            simulation.inject(fault).expect("a fault of this machine")
        })
    }

    /// How often it struck.
    pub(crate) fn deliveries(&self, fault: FaultId) -> u64 {
        self.simulation(move |simulation| simulation.fault_deliveries(fault))
    }

    /// It is over.
    pub(crate) fn end_fault(&self, fault: FaultId) {
        self.simulation(move |simulation| simulation.end_fault(fault));
    }

    /// Where the point of the stage truly is, in millimetres from the true origin.
    pub(crate) fn true_mm(&self) -> f64 {
        self.simulation(|simulation| simulation.truth().position().mm())
    }

    /// Ends the service as a person ends it.
    pub(crate) fn end(mut self) {
        self.close();
    }

    fn close(&mut self) {
        if let Some(service) = self.service.take() {
            let _passing = self.gate.wait_for_an_end();
            let _ = self.desk.end(&service::Caller::named("the test"));
            let ended = service.wait();
            if !std::thread::panicking() {
                ended.expect("it was asked to end");
            }
        }
    }
}

impl Drop for Stage {
    fn drop(&mut self) {
        self.close();
    }
}
