//! Zero of a platform: every screw on its index pulse, all of them reached forward, and the
//! camera's datum there.

use core::time::Duration;
use std::path::PathBuf;

use compensator::platform::Pose;
use drivers::device::AxisCommand;
use units::{Metres, MetresPerSecond};

use crate::correction::Correction;
use crate::failure::Failure;
use crate::homing;
use crate::memories::Memory;
use crate::platform::PlatformEntry;
use crate::platform::PoseEntry;
use crate::platform::handle::AlignmentPlatform;
use crate::store::Store;
use machine::Stage;

/// The datum is what everything is measured from: it is looked at so many times more often.
pub(super) const DATUM_LOOKS: u32 = 8;

/// A platform that was zeroed.
#[derive(Clone, Debug, PartialEq)]
pub struct PlatformZeroed {
    /// What the camera saw there, in the machine's frame.
    pub datum: Pose,
    /// Where it is recorded.
    pub journal: PathBuf,
}

impl AlignmentPlatform<'_> {
    /// Finds the screws' index pulses, one after the other, brings all of them to their zero
    /// from below, and takes what the camera sees there for the pose zero.
    ///
    /// # Errors
    /// Whatever stops the machine; the platform is not zeroed then.
    pub fn zero(&mut self, store: &Store) -> Result<PlatformZeroed, Failure> {
        self.state.forget();
        let mut journal = self.journal_header(store, "zero", 0, None, None)?;
        let datum = self
            .find_zero()
            .inspect_err(|failure| crate::run::note_failure(&mut journal, failure))?;
        let at_s = self.core.now().seconds();
        journal.write(&PlatformEntry::Pose(PoseEntry::looked(datum, at_s)))?;
        journal.complete()?;
        crate::run::settle(&mut self.core, store)?;
        Ok(PlatformZeroed {
            datum,
            journal: journal.path().to_owned(),
        })
    }

    fn find_zero(&mut self) -> Result<Pose, Failure> {
        let screws = self.state.screws.clone();
        let steps = screws.len() as u64 + 1;
        for screw in &screws {
            self.core.set_zeroed(&screw.axis, false)?;
            self.core.enable(&screw.axis)?;
        }
        for (done, screw) in (0..).zip(&screws) {
            self.core
                .observer()
                .progress(Stage::Zero, "platform", done, steps);
            self.home_on_index(&screw.axis, screw.index)?;
            self.core.set_zeroed(&screw.axis, true)?;
        }
        self.approach_zero()?;
        let exposures = self.config.exposures * DATUM_LOOKS;
        let datum = self.camera_pose(exposures)?;
        self.state.datum = Some(datum);
        self.core
            .observer()
            .progress(Stage::Zero, "platform", steps, steps);
        Ok(datum)
    }

    fn home_on_index(&mut self, axis: &str, position: Metres) -> Result<(), Failure> {
        let zero = &self.config.zero;
        let speed = MetresPerSecond(zero.search_speed_mm_per_s * 1e-3);
        let limit = Duration::from_secs_f64(zero.time_limit_s);
        let command = AxisCommand::HomeIndex { position, speed };
        let start = homing::place(&self.core, axis)?;
        let done = self.core.command(axis, command, "home on the index", limit);
        done.map_err(|failure| {
            let failure = homing::explained(&self.core, axis, start, failure.into());
            homing::before_zero(&self.core, axis, failure)
        })
    }

    /// All screws to their zero from below, so that all lean on the same flank as ever.
    pub(super) fn approach_zero(&mut self) -> Result<(), Failure> {
        let count = self.state.screws.len();
        let below = Metres::ZERO - self.lost_motion_max()? * 2.0;
        self.go_to_strokes(&vec![below; count], Correction::Off)?;
        self.go_to_strokes(&vec![Metres::ZERO; count], Correction::Off)?;
        self.state.pose = Some(Pose::default());
        Ok(())
    }
}
