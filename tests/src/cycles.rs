//! What each machine that ships does in virtual time where it is timed, and where its log is pinned.

use core::time::Duration;

use truestage::CalibrateOptions;
use truestage::linear::VerifyOptions;
use truestage::platform::Pose;
use truestage::rotary::Way;
use truestage::volumetric::WarmUp;
use truestage::{Failure, Machine, Store};
use units::{Metres, Radians};

use crate::Edit;
use crate::hand::Hand;
use crate::rig::Bench;
use crate::shipped::{LINEAR, ROTARY, Shipped, UVW, UVW_COPLEY, VOLUMETRIC};
use crate::volume::{Volume, calm, spread};

/// How long three axes warm up between cold and warm lines.
const WARM_UP: Duration = Duration::from_secs(2 * 3600);

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
    cycle("linear", &LINEAR, |text| text, linear),
    cycle("uvw", &UVW, |text| text, platform),
    cycle("uvw-copley", &UVW_COPLEY, |text| text, platform),
    cycle("rotary", &ROTARY, |text| text, rotary),
    cycle("volumetric", &VOLUMETRIC, calm, volumetric),
];

/// A part of it that takes a moment: the zero, fewer readings, and compensated moves.
pub const PARTS: [Cycle; 5] = [
    cycle("linear", &LINEAR, fewer_runs, part_of_linear),
    cycle("uvw", &UVW, few_strokes, part_of_platform),
    cycle("uvw-copley", &UVW_COPLEY, few_strokes, part_of_platform),
    cycle("rotary", &ROTARY, few_placements, part_of_rotary),
    cycle("volumetric", &VOLUMETRIC, |text| text, part_of_volumetric),
];

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

fn fewer_runs(text: String) -> String {
    changed(text, &[("runs = 3", "runs = 2")])
}

fn few_strokes(text: String) -> String {
    changed(
        text,
        &[
            ("step_mm = 0.25", "step_mm = 0.625"),
            ("runs = 2", "runs = 1"),
        ],
    )
}

fn few_placements(text: String) -> String {
    let changes = [
        ("placements = 4 ", "offsets = [0, 73, 162] "),
        ("optimise = ", "# "),
        ("amplification_limit = 3.0", "amplification_limit = 5.0"),
    ];
    changed(text, &changes)
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

fn linear(bench: Bench) -> Result<Bench, Failure> {
    let verify = |calibration: Option<String>| VerifyOptions {
        compensated: calibration.is_some(),
        calibration,
        resume: None,
    };
    started(bench, |machine, store| {
        machine.linear("x")?.zero(store)?;
        machine.linear("x")?.verify(store, &verify(None))?;
        let calibrated = machine
            .linear("x")?
            .calibrate(store, &CalibrateOptions::default())?;
        machine
            .linear("x")?
            .verify(store, &verify(Some(calibrated.id)))?;
        Ok(())
    })
}

fn part_of_linear(bench: Bench) -> Result<Bench, Failure> {
    started(bench, |machine, store| {
        machine.linear("x")?.zero(store)?;
        machine
            .linear("x")?
            .calibrate(store, &CalibrateOptions::default())?;
        for mm in [12.5, 44.4, 31.0] {
            machine.linear("x")?.move_to(Metres::from_mm(mm))?;
        }
        Ok(())
    })
}

fn somewhere() -> Pose {
    Pose {
        x: Metres::from_mm(0.7),
        y: Metres::from_mm(-1.1),
        angle: Radians::from_arcsec(600.0),
    }
}

fn platform(bench: Bench) -> Result<Bench, Failure> {
    started(bench, |machine, store| {
        machine.platform()?.zero(store)?;
        machine.platform()?.verify(store, false)?;
        machine.platform()?.move_to(Pose::default())?;
        machine.platform()?.calibrate(store)?;
        machine.platform()?.verify(store, true)?;
        machine.platform()?.align(somewhere())?;
        Ok(())
    })
}

fn part_of_platform(bench: Bench) -> Result<Bench, Failure> {
    started(bench, |machine, store| {
        machine.platform()?.zero(store)?;
        machine.platform()?.calibrate(store)?;
        machine.platform()?.move_to(somewhere())?;
        machine.platform()?.move_to(Pose::default())?;
        Ok(())
    })
}

fn hand_of(bench: &Bench) -> Hand<'static> {
    let emulated = bench.emulated.clone();
    Hand::new(move |lines| emulated.simulation_mut().turn_plate(lines))
}

fn rotary(bench: Bench) -> Result<Bench, Failure> {
    let mut hand = hand_of(&bench);
    started(bench, |machine, store| {
        machine.rotary("c")?.zero()?;
        machine
            .rotary("c")?
            .calibrate(store, &CalibrateOptions::default(), &mut hand)?;
        machine.rotary("c")?.verify(store, true, &mut hand)?;
        Ok(())
    })
}

fn part_of_rotary(bench: Bench) -> Result<Bench, Failure> {
    let mut hand = hand_of(&bench);
    started(bench, |machine, store| {
        machine.rotary("c")?.zero()?;
        machine
            .rotary("c")?
            .calibrate(store, &CalibrateOptions::default(), &mut hand)?;
        machine
            .rotary("c")?
            .move_to(Radians::from_degrees(123.4), Way::Shortest)?;
        Ok(())
    })
}

fn volumetric(bench: Bench) -> Result<Bench, Failure> {
    let mut hand = bench.emulated.clone();
    started(bench, |machine, store| {
        machine.volumetric()?.zero()?;
        machine
            .volumetric()?
            .calibrate(store, WarmUp::Idle(WARM_UP), None, &mut hand)?;
        Ok(())
    })
}

/// Corrected by errors that are known: finding them takes hours.
fn part_of_volumetric(mut bench: Bench) -> Result<Bench, Failure> {
    bench.machine.start()?;
    bench.machine.volumetric()?.zero()?;
    let mut volume = Volume { bench };
    volume.know_errors();
    let store = volume.bench.store.clone();
    volume.bench.machine.volumetric()?.reference(&store)?;
    let (mut mover, _) = volume.corrected();
    volume.visit(&mut mover, &spread(0, 3), &mut Vec::new());
    volume.bench.machine.shut_down()?;
    Ok(volume.bench)
}
