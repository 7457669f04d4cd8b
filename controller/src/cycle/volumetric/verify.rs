//! Verify: a line that no calibration uses, read with the correction on.

use core::time::Duration;

use compensator::volumetric::Point;
use compensator::volumetric::identify::Reading;
use units::Metres;

use super::line::{LineOperator, LineOptics, LineReadout, LineTask};
use super::{Mover, VolumetricCorrection, VolumetricFailure};
use crate::assemble::point_of_mm;
use crate::failure::Failure;
use crate::machine::Machine;
use crate::observer::Stage;
use crate::store::Store;

/// What it is called where progress is told.
const WHOLE: &str = "volume";

/// What corrects the machine while it is verified.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VerifyBy {
    /// Nothing: the machine as found.
    AsFound,
    /// Its tables alone, without detectors and thermometers.
    Tables,
    /// Everything that is stored and seen.
    Everything,
}

/// One place of the line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VolumetricVerifiedPoint {
    /// Where the tool was sent.
    pub at: Point,
    /// Deviation along the line from that at its beginning.
    pub deviation: Metres,
    /// Standard uncertainty of the reading.
    pub u: Metres,
}

/// What the line showed.
#[derive(Clone, Debug)]
pub struct VolumetricVerified {
    /// Place by place.
    pub points: Vec<VolumetricVerifiedPoint>,
    /// Largest minus smallest deviation.
    pub range: Metres,
    /// What the range may be.
    pub limit: Metres,
}

impl VolumetricVerified {
    /// Whether it may be.
    pub fn is_within_tolerance(&self) -> bool {
        self.range <= self.limit
    }
}

impl Machine {
    /// Everything that is stored of the three axes, ready to correct them; `None` without a
    /// calibration.
    ///
    /// # Errors
    /// When what is stored does not belong to this machine, or cannot be applied.
    pub fn stored_mover(&self, store: &Store) -> Result<Option<Mover>, Failure> {
        let Some((state, _)) = self.volumetric_state(store)? else {
            return Ok(None);
        };
        let correction = VolumetricCorrection::new(self.config(), state)?;
        self.volumetric_mover(Box::new(correction)).map(Some)
    }

    fn mover_by(&self, store: &Store, by: VerifyBy) -> Result<Option<Mover>, Failure> {
        if by == VerifyBy::AsFound {
            return Ok(None);
        }
        let stored = self.volumetric_state(store)?;
        let (state, _) = stored.ok_or(VolumetricFailure::NoGeometry)?;
        let correction = match by {
            VerifyBy::Tables => VolumetricCorrection::by_tables(self.config(), state)?,
            VerifyBy::AsFound | VerifyBy::Everything => {
                VolumetricCorrection::new(self.config(), state)?
            }
        };
        self.volumetric_mover(Box::new(correction)).map(Some)
    }

    /// Reads the line of `[volumetric.verify]` by interferometer, corrected as `by` says.
    ///
    /// # Errors
    /// When nothing is stored, the line cannot be set up or read, or anything stops the machine.
    pub fn verify_volumetric(
        &mut self,
        store: &Store,
        by: VerifyBy,
        operator: &mut dyn LineOperator,
    ) -> Result<VolumetricVerified, Failure> {
        let config = self.volumetric_config()?.clone();
        let missing = |section| VolumetricFailure::NotConfigured { section };
        let own = config.verify.ok_or(missing("verify"))?;
        let calibrate = config.calibrate.ok_or(missing("calibrate"))?;
        let mut mover = self.mover_by(store, by)?;
        let (from, to) = (point_of_mm(own.from_mm), point_of_mm(own.to_mm));
        let task = LineTask {
            optics: LineOptics::Linear,
            start: from,
            end: to,
            tool: point_of_mm(config.tool_offset_mm),
            step: (1, 1),
        };
        let readout = LineReadout {
            instrument: calibrate.instrument,
            settle: Duration::from_secs_f64(calibrate.settle_ms * 1e-3),
            samples: calibrate.average_samples,
        };
        let line = self.set_up_line(&task, &readout, operator)?;
        if let Some(mover) = &mut mover {
            self.correct_volume(mover, true)?;
        }
        let last = own.points - 1;
        let mut points = Vec::new();
        for n in 0..=last {
            let (done, total) = (u64::from(n), u64::from(own.points));
            self.observer.progress(Stage::Verify, WHOLE, done, total);
            let share = f64::from(n) / f64::from(last);
            let way = to - from;
            let at = from + Point::new(way.x * share, way.y * share, way.z * share);
            match &mut mover {
                Some(mover) => drop(self.drive_to(mover, at, readout.settle)?),
                None => self.go_straight(at)?,
            }
            let read = self.read_line_here(&line, at)?;
            let Reading::Length { deviation, u, .. } = read.reading else {
                return Err(VolumetricFailure::NotALine.into());
            };
            points.push(VolumetricVerifiedPoint { at, deviation, u });
        }
        self.end_lines(operator)?;
        Ok(judged(points, Metres::from_um(own.limit_um)))
    }
}

/// Deviations count from the first place: the line began before the correction did.
fn judged(mut points: Vec<VolumetricVerifiedPoint>, limit: Metres) -> VolumetricVerified {
    let first = points.first().map_or(Metres(0.0), |it| it.deviation);
    let (mut low, mut high) = (Metres(0.0), Metres(0.0));
    for it in &mut points {
        it.deviation -= first;
        (low, high) = (low.min(it.deviation), high.max(it.deviation));
    }
    VolumetricVerified {
        points,
        range: high - low,
        limit,
    }
}
