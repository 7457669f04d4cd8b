//! What each machine that ships does in virtual time where it is timed, and where its log is pinned.

mod linear;
mod platform;
mod rotary;
mod volumetric;

use machine::records::Store;
use mock_bus::config::MachineConfig as EmulatedConfig;
use truestage::{Failure, Machine};

use crate::Edit;
use crate::rig::Bench;
use crate::shipped::Shipped;

/// What a machine does from its start to its shutting down.
#[derive(Clone, Copy, Debug)]
pub struct Cycle {
    /// The machine's name.
    pub name: &'static str,
    shipped: &'static Shipped,
    machine: fn(String) -> String,
    run: fn(Bench) -> Result<Bench, Failure>,
}

impl Cycle {
    /// The machine with `seed`, not started.
    pub fn bench(&self, seed: u64) -> Bench {
        Bench::of(self.shipped, seed, self.machine)
    }

    /// The same machine on the devices that `change` makes of those that ship.
    ///
    /// # Panics
    /// When the devices that ship are none.
    pub fn bench_on(&self, seed: u64, change: impl FnOnce(&mut EmulatedConfig)) -> Bench {
        let mut emulated = EmulatedConfig::parse(self.shipped.emulated).expect("it ships");
        change(&mut emulated);
        Bench::of_emulated(self.shipped, seed, self.machine, &emulated, |transport| {
            Box::new(transport)
        })
    }

    /// What it does until something fails; the number of the log, and the failure.
    pub fn try_run(&self, bench: Bench) -> (u64, Option<Failure>) {
        let emulated = bench.emulated.clone();
        let failure = (self.run)(bench).err();
        let hash = emulated.simulation().log_hash();
        (hash, failure)
    }

    /// All that it does; the machine as it is left.
    ///
    /// # Panics
    /// When something fails.
    pub fn run(&self, bench: Bench) -> Bench {
        let result = (self.run)(bench);
        result.unwrap_or_else(|failure| panic!("{}: {failure}", self.name))
    }
}

/// The whole cycle of every machine that ships.
pub const WHOLE: [Cycle; 5] = [
    linear::WHOLE,
    platform::WHOLE,
    platform::WHOLE_COPLEY,
    rotary::WHOLE,
    volumetric::WHOLE,
];

/// A part of it that takes a moment: the zero, fewer readings, and compensated moves.
pub const PARTS: [Cycle; 5] = [
    linear::PART,
    platform::PART,
    platform::PART_COPLEY,
    rotary::PART,
    volumetric::PART,
];

/// The cycle of the machine that ships as `name`.
///
/// # Panics
/// When no machine is called so.
#[track_caller]
pub fn named(cycles: &'static [Cycle], name: &str) -> &'static Cycle {
    let cycle = cycles.iter().find(|cycle| cycle.name == name);
    cycle.unwrap_or_else(|| panic!("{name}: no machine that ships is called so"))
}

const fn cycle(
    name: &'static str,
    shipped: &'static Shipped,
    machine: fn(String) -> String,
    run: fn(Bench) -> Result<Bench, Failure>,
) -> Cycle {
    Cycle {
        name,
        shipped,
        machine,
        run,
    }
}

/// # Panics
/// When the configuration that ships has become another one.
fn changed(text: String, changes: &[(&str, &str)]) -> String {
    let changes = changes.iter();
    changes.fold(text, |text, (from, to)| text.edit(from, to))
}

/// The machine is started, does `cycle` with its store, and is shut down.
fn started(
    mut bench: Bench,
    cycle: impl FnOnce(&mut Machine, &Store) -> Result<(), Failure>,
) -> Result<Bench, Failure> {
    let store = bench.store.clone();
    bench.machine.guarded(|machine| {
        machine.start()?;
        cycle(machine, &store)?;
        machine.shut_down()
    })?;
    Ok(bench)
}
