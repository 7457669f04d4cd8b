//! A cycle of each machine that ships, in virtual time: what is done is the same wherever it is
//! measured, timed or pinned.

use core::time::Duration;

use truestage::Failure;
use truestage::cycle::platform::Pose;
use truestage::cycle::volumetric::WarmUp;
use truestage::cycle::{CalibrateOptions, VerifyOptions};
use units::{Metres, Radians};

use crate::hand::Hand;
use crate::rig::{Bench, LINEAR, ROTARY, Shipped, UVW, UVW_COPLEY, VOLUMETRIC};
use crate::volume::calm;

/// How long three axes warm up between cold and warm lines.
const WARM_UP: Duration = Duration::from_secs(2 * 3600);

/// What a machine does from its start to its shutting down.
#[derive(Clone, Copy, Debug)]
pub struct Cycle {
    /// The machine's name.
    pub name: &'static str,
    shipped: &'static Shipped,
    machine: fn(String) -> String,
    run: fn(&mut Bench) -> Result<(), Failure>,
}

impl Cycle {
    /// The machine with `seed`, not started.
    pub fn bench(&self, seed: u64) -> Bench {
        Bench::of(self.shipped, seed, self.machine)
    }

    /// All that it does.
    ///
    /// # Panics
    /// When something fails.
    pub fn run(&self, bench: &mut Bench) {
        let result = (self.run)(bench);
        result.unwrap_or_else(|failure| panic!("{}: {failure}", self.name));
    }
}

/// The whole cycle of every machine that ships.
pub const WHOLE: [Cycle; 5] = [
    Cycle {
        name: "linear",
        shipped: &LINEAR,
        machine: |text| text,
        run: linear,
    },
    Cycle {
        name: "uvw",
        shipped: &UVW,
        machine: |text| text,
        run: platform,
    },
    Cycle {
        name: "uvw-copley",
        shipped: &UVW_COPLEY,
        machine: |text| text,
        run: platform,
    },
    Cycle {
        name: "rotary",
        shipped: &ROTARY,
        machine: |text| text,
        run: rotary,
    },
    Cycle {
        name: "volumetric",
        shipped: &VOLUMETRIC,
        machine: calm,
        run: volumetric,
    },
];

fn linear(bench: &mut Bench) -> Result<(), Failure> {
    let store = bench.store.clone();
    let verify = |calibration: Option<String>| VerifyOptions {
        compensated: calibration.is_some(),
        calibration,
        resume: None,
    };
    bench.machine.guarded(|machine| {
        machine.start()?;
        machine.zero("x", &store)?;
        machine.verify("x", &store, &verify(None))?;
        let calibrated = machine.calibrate("x", &store, &CalibrateOptions::default())?;
        machine.verify("x", &store, &verify(Some(calibrated.id)))?;
        machine.shut_down()
    })
}

fn platform(bench: &mut Bench) -> Result<(), Failure> {
    let store = bench.store.clone();
    bench.machine.guarded(|machine| {
        machine.start()?;
        machine.zero_platform(&store)?;
        machine.verify_platform(&store, false)?;
        machine.move_pose(Pose::default())?;
        machine.calibrate_platform(&store)?;
        machine.verify_platform(&store, true)?;
        machine.align_pose(Pose {
            x: Metres::from_mm(0.7),
            y: Metres::from_mm(-1.1),
            angle: Radians::from_arcsec(600.0),
        })?;
        machine.shut_down()
    })
}

fn rotary(bench: &mut Bench) -> Result<(), Failure> {
    let store = bench.store.clone();
    let emulated = bench.emulated.clone();
    let mut hand = Hand::new(move |lines| emulated.simulation_mut().turn_plate(lines));
    bench.machine.guarded(|machine| {
        machine.start()?;
        machine.zero_rotary("c")?;
        machine.calibrate_rotary("c", &store, &CalibrateOptions::default(), &mut hand)?;
        machine.verify_rotary("c", &store, true, &mut hand)?;
        machine.shut_down()
    })
}

fn volumetric(bench: &mut Bench) -> Result<(), Failure> {
    let store = bench.store.clone();
    let mut hand = bench.emulated.clone();
    bench.machine.guarded(|machine| {
        machine.start()?;
        machine.zero_volumetric()?;
        machine.calibrate_volumetric(&store, WarmUp::Idle(WARM_UP), None, &mut hand)?;
        machine.shut_down()
    })
}
