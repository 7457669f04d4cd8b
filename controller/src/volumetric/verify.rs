//! Verify: a line that no calibration uses, read with the correction on, and written down.

use core::time::Duration;
use std::path::PathBuf;

use compensator::volumetric::Point;
use compensator::volumetric::identify::Reading;
use units::Metres;

use crate::failure::Failure;
use crate::run::{note_failure, settle};
use crate::store::{Journal, Store};
use crate::volumetric::handle::WorkVolume;
use crate::volumetric::inputs::place_of_temperature;
use crate::volumetric::line::{Line, LineOperator, LineOptics, LineReadout, LineTask};
use crate::volumetric::settings::point_of_mm;
use crate::volumetric::thermometers::right;
use crate::volumetric::{LineReadingEntry, VolumeCheckEntry, metres};
use crate::volumetric::{Mover, VolumetricCorrection, VolumetricFailure};
use crate::volumetric::{VolumeEntry, VolumeLog};
use crate::volumetric::{VolumetricConfig, VolumetricVerifyConfig};
use machine::Stage;
use machine::engine::THERMOMETERS_MAX;

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

impl VerifyBy {
    /// As it is called on the page.
    pub const fn text(self) -> &'static str {
        match self {
            Self::AsFound => "as found",
            Self::Tables => "by tables alone",
            Self::Everything => "as left",
        }
    }
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
    /// The deviation along the line that the correction took away, counted from that at its beginning.
    pub(crate) known: Option<Metres>,
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
    /// Where every reading is.
    pub journal: PathBuf,
}

impl VolumetricVerified {
    /// Whether it may be.
    pub fn is_within_tolerance(&self) -> bool {
        self.range <= self.limit
    }

    /// What a verification with corrections fails by, where it does.
    pub(crate) fn out_of_tolerance(&self) -> Option<Failure> {
        let failure = VolumetricFailure::OutOfTolerance {
            seen: self.range,
            limit: self.limit,
        };
        (!self.is_within_tolerance()).then(|| failure.into())
    }
}

impl WorkVolume<'_> {
    /// Everything that is stored of the three axes, ready to correct them; `None` without a
    /// calibration.
    ///
    /// # Errors
    /// When what is stored does not belong to this machine, or cannot be applied.
    pub fn stored_mover(&self, store: &Store) -> Result<Option<Mover>, Failure> {
        let Some((state, _)) = self.state(store)? else {
            return Ok(None);
        };
        let correction = VolumetricCorrection::new(self.core.config, state)?;
        self.mover(Box::new(correction)).map(Some)
    }

    /// What moves the machine, corrected as `by` says, and the name of the errors it uses.
    fn mover_by(
        &self,
        store: &Store,
        by: VerifyBy,
    ) -> Result<(Option<Mover>, Option<String>), Failure> {
        if by == VerifyBy::AsFound {
            return Ok((None, None));
        }
        let stored = self.state(store)?;
        let (state, records) = stored.ok_or(VolumetricFailure::NoGeometry)?;
        let correction = match by {
            VerifyBy::Tables => VolumetricCorrection::by_tables(self.core.config, state)?,
            VerifyBy::AsFound | VerifyBy::Everything => {
                VolumetricCorrection::new(self.core.config, state)?
            }
        };
        let mover = self.mover(Box::new(correction))?;
        Ok((Some(mover), Some(records.geometry)))
    }

    /// Whether [`Self::verify`] has what it needs, before anything moves.
    ///
    /// # Errors
    /// When it is not configured, or nothing that can be applied is stored.
    pub fn check_verify(&self, store: &Store, by: VerifyBy) -> Result<(), Failure> {
        self.verify_config()?;
        self.mover_by(store, by).map(|_| ())
    }

    /// The line that is read.
    pub(super) fn verified_line(&self, own: &VolumetricVerifyConfig) -> LineTask {
        LineTask {
            optics: LineOptics::Linear,
            start: point_of_mm(own.from_mm),
            end: point_of_mm(own.to_mm),
            tool: point_of_mm(self.config.tool_offset_mm),
            step: (1, 1),
        }
    }

    pub(super) fn verify_config(&self) -> Result<VolumetricVerifyConfig, Failure> {
        let section = "verify";
        let own = self.config.verify.clone();
        Ok(own.ok_or(VolumetricFailure::NotConfigured { section })?)
    }

    /// Reads the line of `[volumetric.verify]` by interferometer, corrected as `by` says. A calibration by which it
    /// is out of tolerance and worse than without is taken out of use.
    ///
    /// # Errors
    /// When nothing is stored, the line cannot be set up or read, or anything stops the machine.
    pub fn verify(
        &mut self,
        store: &Store,
        by: VerifyBy,
        operator: &mut dyn LineOperator,
    ) -> Result<VolumetricVerified, Failure> {
        let config = self.config.clone();
        let own = self.verify_config()?;
        let (mover, geometry) = self.mover_by(store, by)?;
        let header = self.header("verify", geometry.clone())?;
        let mut journal = store.create_journal(&header)?;
        journal.write(&VolumeEntry::VolumeCheck(VolumeCheckEntry {
            state: by.text().to_owned(),
            from_m: metres(point_of_mm(own.from_mm)),
            to_m: metres(point_of_mm(own.to_mm)),
            tool_m: metres(point_of_mm(config.tool_offset_mm)),
            limit_m: Metres::from_um(own.limit_um).value(),
        }))?;
        settle(&mut self.core, store)?;
        let points = self
            .read_verified(&config, &own, mover, operator, &mut journal)
            .inspect_err(|it| note_failure(&mut journal, it))?;
        journal.complete()?;
        settle(&mut self.core, store)?;
        let path = journal.path().to_owned();
        let verified = judged(points, Metres::from_um(own.limit_um), path);
        // By the tables alone is how a machine is compared that also has detectors: their part is left out on purpose.
        if by == VerifyBy::Everything {
            self.judge_benefit(store, geometry.as_deref(), &verified)?;
        }
        Ok(verified)
    }

    fn read_verified(
        &mut self,
        config: &VolumetricConfig,
        own: &VolumetricVerifyConfig,
        mut mover: Option<Mover>,
        operator: &mut dyn LineOperator,
        journal: &mut Journal<VolumeLog>,
    ) -> Result<Vec<VolumetricVerifiedPoint>, Failure> {
        let section = "calibrate";
        let calibrate = config.calibrate.as_ref();
        let calibrate = calibrate.ok_or(VolumetricFailure::NotConfigured { section })?;
        let task = self.verified_line(own);
        let (from, to) = (task.start, task.end);
        let readout = LineReadout {
            instrument: calibrate.instrument.clone(),
            settle: Duration::from_secs_f64(calibrate.settle_ms * 1e-3),
            samples: calibrate.average_samples,
        };
        let line = self.set_up_line(&task, &readout, operator)?;
        if let Some(mover) = &mut mover {
            self.correct(mover, true)?;
        }
        let last = own.points - 1;
        let mut points = Vec::new();
        for n in 0..=last {
            let (done, total) = (u64::from(n), u64::from(own.points));
            self.core
                .observer()
                .progress(Stage::Verify, WHOLE, done, total);
            let share = f64::from(n) / f64::from(last);
            let way = to - from;
            let at = from + Point::new(way.x * share, way.y * share, way.z * share);
            let correction = match &mut mover {
                Some(mover) => Some(self.drive_to(mover, at, readout.settle)?.offset),
                None => {
                    self.go_straight(at)?;
                    None
                }
            };
            let correction_m = correction.map(|it| core::array::from_fn(|k| it[k].value()));
            let mut point = self.verified_point(config, &line, at, correction_m, journal)?;
            point.known = correction.map(|it| Metres::ZERO - along(&line, &it));
            points.push(point);
        }
        self.end_lines(operator)?;
        Ok(points)
    }

    /// Reads the line where the machine stands.
    fn verified_point(
        &mut self,
        config: &VolumetricConfig,
        line: &Line,
        at: Point,
        correction_m: Option<[f64; 3]>,
        journal: &mut Journal<VolumeLog>,
    ) -> Result<VolumetricVerifiedPoint, Failure> {
        let read = self.read_line_here(line, at)?;
        let Reading::Length { deviation, u, .. } = read.reading else {
            return Err(VolumetricFailure::NotALine.into());
        };
        journal.write(&VolumeEntry::LineReading(LineReadingEntry {
            scatter_m: Some(read.scatter.value()),
            temperatures_c: self.thermometers_now(config),
            correction_m,
            at_s: read.when.seconds(),
            ..LineReadingEntry::of(0, &read.observation(0))
        }))?;
        Ok(VolumetricVerifiedPoint {
            at,
            deviation,
            u,
            known: None,
        })
    }

    /// What the thermometers showed last, °C; a verification does not depend on them.
    fn thermometers_now(&self, config: &VolumetricConfig) -> Vec<Option<f64>> {
        let mut shown = [None; THERMOMETERS_MAX];
        self.core.devices().hear_temperatures(&mut shown);
        let each = config.temperature.iter().map(|it| {
            let place = place_of_temperature(self.core.config, &it.analog, it.channel);
            let sample = shown.get(place).copied().flatten()?;
            let shown = sample.celsius?;
            Some(right(shown, it.certified().as_deref()).value())
        });
        each.collect()
    }
}

/// What an offset of the axes is along the line.
fn along(line: &Line, offset: &[Metres]) -> Metres {
    let [x, y, z] = [0, 1, 2].map(|k| offset[k]);
    let (way, offset) = (line.task.end - line.task.start, Point::new(x, y, z));
    let product = way.x.value() * offset.x.value()
        + way.y.value() * offset.y.value()
        + way.z.value() * offset.z.value();
    Metres(product / way.distance().value())
}

fn judged(
    mut points: Vec<VolumetricVerifiedPoint>,
    limit: Metres,
    journal: PathBuf,
) -> VolumetricVerified {
    let read: Vec<Metres> = points.iter().map(|it| it.deviation).collect();
    let (deviations, range) = from_the_first(&read);
    let known_first = points.first().and_then(|it| it.known);
    for (it, deviation) in points.iter_mut().zip(deviations) {
        it.deviation = deviation;
        it.known = it.known.zip(known_first).map(|(own, first)| own - first);
    }
    VolumetricVerified {
        points,
        range,
        limit,
        journal,
    }
}

/// Deviations along a line counted from its first place, because the line began before the correction did, and
/// largest minus smallest of them.
pub(crate) fn from_the_first(read: &[Metres]) -> (Vec<Metres>, Metres) {
    let first = read.first().copied().unwrap_or(Metres::ZERO);
    let deviations: Vec<Metres> = read.iter().map(|it| *it - first).collect();
    let low = deviations.iter().copied().fold(Metres::ZERO, Metres::min);
    let high = deviations.iter().copied().fold(Metres::ZERO, Metres::max);
    (deviations, high - low)
}
