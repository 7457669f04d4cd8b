//! What the machine with three axes that ships does.

use core::time::Duration;

use truestage::Failure;
use truestage::volumetric::WarmUp;

use super::{Cycle, cycle, started};
use crate::rig::Bench;
use crate::shipped::VOLUMETRIC;
use crate::volume::{Volume, calm, spread};

/// How long three axes warm up between cold and warm lines.
const WARM_UP: Duration = Duration::from_secs(2 * 3600);

pub(super) const WHOLE: Cycle = cycle("volumetric", &VOLUMETRIC, calm, volumetric);
pub(super) const PART: Cycle = cycle("volumetric", &VOLUMETRIC, |text| text, part_of_volumetric);

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
