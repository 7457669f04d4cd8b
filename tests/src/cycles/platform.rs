//! What each alignment platform that ships does.

use truestage::Failure;
use truestage::platform::Pose;
use units::{Metres, Radians};

use super::{Cycle, changed, cycle, started};
use crate::rig::Bench;
use crate::shipped::{UVW, UVW_COPLEY};

pub(super) const WHOLE: Cycle = cycle("uvw", &UVW, |text| text, platform);
pub(super) const PART: Cycle = cycle("uvw", &UVW, few_strokes, part_of_platform);
pub(super) const WHOLE_COPLEY: Cycle = cycle("uvw-copley", &UVW_COPLEY, |text| text, platform);
pub(super) const PART_COPLEY: Cycle =
    cycle("uvw-copley", &UVW_COPLEY, few_strokes, part_of_platform);

fn few_strokes(text: String) -> String {
    changed(
        text,
        &[
            ("step_mm = 0.25", "step_mm = 0.625"),
            ("runs = 2", "runs = 1"),
        ],
    )
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
