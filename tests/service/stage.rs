//! A service on an emulated machine in virtual time, which passes only while somebody asks or waits.

use std::path::Path;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Condvar, Mutex, PoisonError};

use core::time::Duration;

use drivers::transport::in_process::InProcess;
use drivers::transport::{SendError, Transport};
use mock_bus::fault::{Fault, FaultConfig, FaultId};
use mock_bus::simulation::Simulation;
use service::{Desk, Opened, Service};
use tests::{Shipped, shipped_config};
use truestage::Machine;
use truestage::emulated::Emulated;
use units::Time;
use wire::{Arrival, Payload, Port};

/// Time passes while it is open.
#[derive(Debug, Default)]
pub(crate) struct Gate {
    open: Mutex<u32>,
    opened: Condvar,
}

impl Gate {
    /// Time passes until this is dropped.
    pub(crate) fn pass(self: &Arc<Self>) -> Passing {
        *self.open.lock().unwrap_or_else(PoisonError::into_inner) += 1;
        self.opened.notify_all();
        Passing(Arc::clone(self))
    }

    fn wait(&self) {
        let mut open = self.open.lock().unwrap_or_else(PoisonError::into_inner);
        while *open == 0 {
            open = self
                .opened
                .wait(open)
                .unwrap_or_else(PoisonError::into_inner);
        }
    }
}

/// Keeps time passing.
#[derive(Debug)]
pub(crate) struct Passing(Arc<Gate>);

impl Drop for Passing {
    fn drop(&mut self) {
        *self.0.open.lock().unwrap_or_else(PoisonError::into_inner) -= 1;
    }
}

type Meddling = Box<dyn FnOnce(&mut Simulation) + Send>;

/// A transport to the emulated machine that waits at the gate.
struct Gated {
    inner: InProcess<Emulated>,
    emulated: Emulated,
    gate: Arc<Gate>,
    meddling: Receiver<Meddling>,
}

impl Transport for Gated {
    fn now(&self) -> Time {
        self.inner.now()
    }

    fn send(&mut self, port: Port, payload: &Payload) -> Result<(), SendError> {
        self.inner.send(port, payload)
    }

    fn receive(&mut self, until: Time) -> Option<Arrival> {
        self.gate.wait();
        for meddle in self.meddling.try_iter() {
            meddle(&mut self.emulated.simulation_mut());
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

/// A service that keeps an emulated machine.
pub(crate) struct Stage {
    pub(crate) desk: Desk,
    pub(crate) gate: Arc<Gate>,
    meddling: Sender<Meddling>,
    service: Option<Service>,
}

impl Stage {
    /// The machine `shipped` with `seed`, its records below `folder`, after `change` of its configuration.
    pub(crate) fn new(
        shipped: Shipped,
        seed: u64,
        folder: &Path,
        change: impl Fn(String) -> String,
    ) -> Self {
        let loaded = shipped_config(&shipped, folder, change);
        let gate = Arc::new(Gate::default());
        let (meddling, received) = channel();
        let inner_gate = Arc::clone(&gate);
        let store = truestage::store_of(&loaded.config.machine);
        let passing = gate.pass();
        let service = Service::start(move || {
            let emulated = Emulated::new(shipped.emulated, seed, &loaded.config)?;
            let transport = Gated {
                inner: emulated.transport(),
                emulated,
                gate: inner_gate,
                meddling: received,
            };
            Ok(Opened {
                machine: Machine::new(&loaded, Box::new(transport)),
                store,
                held: Box::new(()),
            })
        });
        drop(passing);
        let service = service.unwrap_or_else(|error| panic!("{error}"));
        Self {
            desk: service.desk(),
            gate,
            meddling,
            service: Some(service),
        }
    }

    /// Does something to the simulated machine, in its own thread, and returns what that gave.
    pub(crate) fn simulation<R: Send + 'static>(
        &self,
        work: impl FnOnce(&mut Simulation) -> R + Send + 'static,
    ) -> R {
        let (send, received) = channel();
        let meddle: Meddling = Box::new(move |simulation| {
            // The test waits for it.
            let _ = send.send(work(simulation));
        });
        self.meddling.send(meddle).expect("the machine is there");
        let _passing = self.gate.pass();
        received.recv().expect("the machine ticks")
    }

    /// Something goes wrong from now on.
    pub(crate) fn inject(&self, fault: Fault) -> FaultId {
        self.simulation(|simulation| {
            let mut fault = FaultConfig::permanent(fault);
            fault.from_s = simulation.now().seconds();
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
            let _passing = self.gate.pass();
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
