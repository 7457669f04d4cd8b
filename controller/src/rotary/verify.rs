//! Verify a rotary table: the plate of the calibration in a placement of its own.
//!
//! Each line is now read by another part of the table than ever before, and table and plate must
//! agree with what the calibration says of both. At an offset of whole lines the places are those
//! of the calibration; half a line beyond, they lie between them and the interpolation is on trial.
//!
//! What this sees: an error of the table of harmonic k, with the weight |w_s − w̄| (s the offset,
//! w̄ the mean over the placements of the calibration), which is never below 1 − |w̄|. What it
//! cannot see: where the zero is, and what table and detector do alike for every placement, such as
//! a detector that moves with the table. It judges readings of a table that turns; whether a move
//! comes to rest at the position that its reading shows depends on the drive.

use std::path::PathBuf;

use compensator::rotary::{self, PeriodicCompensation};
use compensator::uncertainty::rms;
use core::f64::consts::TAU;
use units::Radians;

use crate::failure::Failure;
use crate::rotary::JudgedEntry;
use crate::rotary::failure::RotaryFailure;
use crate::rotary::in_use::TableInUse;
use crate::rotary::operator::Operator;
use crate::rotary::placement::{Placed, PlateRun};
use crate::rotary::table::RotaryTable;
use crate::rotary::{PlateEntry, PlateLog};
use crate::run::missing;
use crate::run::note_failure;
use crate::store::{Journal, Store, short};
use machine::Stage;

/// How much better another place of the plate must fit.
const BETTER: f64 = 3.0;

/// Deviations (actual − target) of one state of the table, less their mean.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RotaryFigures {
    /// At the place of each line of the plate; `None` where it was not read or is not known.
    pub deviations: Vec<Option<Radians>>,
    /// The largest magnitude.
    pub largest: Radians,
    /// Root mean square.
    pub rms: Radians,
}

impl RotaryFigures {
    /// Of deviations that count from their mean.
    pub(crate) fn of(deviations: Vec<Option<Radians>>) -> Self {
        let seen: Vec<f64> = deviations.iter().flatten().map(|it| it.value()).collect();
        Self {
            largest: Radians(seen.iter().fold(0.0, |a: f64, b| a.max(b.abs()))),
            rms: Radians(if seen.is_empty() { 0.0 } else { rms(&seen) }),
            deviations,
        }
    }

    /// As a journal has them.
    #[cfg(feature = "program")]
    pub(crate) fn of_record(radians: &[Option<f64>]) -> Self {
        Self::of(radians.iter().map(|it| it.map(Radians)).collect())
    }
}

/// A verification of a rotary table.
#[derive(Clone, Debug, PartialEq)]
pub struct RotaryVerified {
    /// Where the plate lay, in lines.
    pub offset_lines: f64,
    /// The table without its calibration. Where no calibration knows the plate, its errors are in
    /// it.
    pub found: RotaryFigures,
    /// Whether the plate's errors were known.
    pub plate_known: bool,
    /// The table with its calibration, where that was wanted.
    pub left: Option<RotaryFigures>,
    /// What of the rms is the scatter of this verification's own readings.
    pub noise: Option<Radians>,
    /// By how much the plate moved while it was read.
    pub closure: Radians,
    /// The tolerance of the configuration.
    pub tolerance: Radians,
    /// Where every pass is.
    pub journal: PathBuf,
}

impl RotaryVerified {
    /// Whether the table with its calibration is within the tolerance; without one, never.
    pub fn is_within_tolerance(&self) -> bool {
        let left = self.left.as_ref();
        left.is_some_and(|it| it.largest <= self.tolerance)
    }

    fn entry(&self) -> JudgedEntry {
        let of = |figures: &RotaryFigures| {
            let values = figures.deviations.iter();
            values.map(|it| it.map(Radians::value)).collect()
        };
        JudgedEntry {
            plate_known: self.plate_known,
            found_rad: of(&self.found),
            left_rad: self.left.as_ref().map(of),
            tolerance_rad: self.tolerance.value(),
        }
    }
}

impl RotaryTable<'_> {
    /// Has the plate placed at the configuration's verification offset, reads it, and judges.
    /// Being out of tolerance is a result here, not an error; being out of tolerance and worse
    /// than without the calibration is one, and takes the calibration out of use.
    ///
    /// # Errors
    /// Not zeroed; `compensated` without a calibration; another plate than the calibration's, or
    /// one that lies elsewhere; whatever stops the machine.
    pub fn verify(
        &mut self,
        store: &Store,
        compensated: bool,
        operator: &mut dyn Operator,
    ) -> Result<RotaryVerified, Failure> {
        self.core.require_zeroed(self.axis)?;
        let config = self.config.verify.clone();
        let config = config.ok_or_else(|| missing(self.axis, "verify"))?;
        let (run, _) = self.plate_run()?;
        let run = PlateRun {
            passes: config.passes,
            stage: Stage::Verify,
            ..run
        };
        let known = self.known_plate(&run, compensated)?;
        let id = known
            .as_ref()
            .map(|it| it.id.clone())
            .filter(|_| compensated);
        let header = self.header("verify", &run, id);
        let mut journal = Journal::create(&store.runs(), &header)?;
        let offset = config.offset_lines;
        // Without a calibration any placement is as good as another.
        let lay_at = known.as_ref().and_then(|it| it.content.offsets.first());
        let phase = known.as_ref().and_then(|it| it.content.plate_phase_rad);
        let places = (offset, lay_at.map(|it| f64::from(*it)), phase.map(Radians));
        let read = self.read_verification(&run, places, &mut journal, operator);
        let placed = read.inspect_err(|failure| note_failure(&mut journal, failure))?;
        if let Some(known) = &known {
            lies_there(self.axis, known, &placed)
                .inspect_err(|failure| note_failure(&mut journal, failure))?;
        }
        let verified = RotaryVerified {
            offset_lines: offset,
            found: figures(&placed, known.as_ref(), None),
            plate_known: known.is_some(),
            left: known
                .as_ref()
                .filter(|_| compensated)
                .map(|known| figures(&placed, Some(known), Some(&known.compensation))),
            noise: placed
                .scatter
                .map(|it| it / (2.0 * f64::from(run.passes)).sqrt()),
            closure: placed.closure,
            tolerance: Radians::from_arcsec(config.tolerance_arcsec),
            journal: journal.path().to_owned(),
        };
        journal.write(&PlateEntry::Judged(verified.entry()))?;
        self.judge_table(store, &verified)
            .inspect_err(|failure| note_failure(&mut journal, failure))?;
        journal.complete()?;
        Ok(verified)
    }

    fn read_verification(
        &mut self,
        run: &PlateRun,
        (offset, lay_at, phase): (f64, Option<f64>, Option<Radians>),
        journal: &mut Journal<PlateLog>,
        operator: &mut dyn Operator,
    ) -> Result<Placed, Failure> {
        journal.write(&PlateEntry::PlatePlan(run.plan(vec![offset])))?;
        self.place_plate(run, offset, (1, 1), lay_at, operator)?;
        self.read_placement(run, (offset, phase), (0, run.sweeps()), journal)
    }

    /// What the calibration in use says of the plate.
    fn known_plate(
        &self,
        run: &PlateRun,
        compensated: bool,
    ) -> Result<Option<TableInUse>, Failure> {
        let axis = self.axis;
        match self.memory.calibration.clone() {
            None if compensated => Err(Failure::Usage {
                what: format!("axis {axis} uses no calibration"),
                help: "load or make one, or verify uncompensated".into(),
            }),
            // Of another plate it says nothing, and of the table as found nothing is wanted.
            Some(known) if !compensated && !is_of(&known, run) => Ok(None),
            Some(known) if !is_of(&known, run) => {
                let lines = |plate: &str, lines: u32| format!("{plate} ({lines} lines)");
                Err(RotaryFailure::OtherPlate {
                    axis: self.axis.to_owned(),
                    expected: lines(&known.plate, known.content.lines),
                    seen: lines(&run.plate, run.lines),
                }
                .into())
            }
            known => Ok(known),
        }
    }

    fn judge_table(&mut self, store: &Store, verified: &RotaryVerified) -> Result<(), Failure> {
        let Some(left) = &verified.left else {
            return Ok(());
        };
        if verified.is_within_tolerance() || left.rms <= verified.found.rms {
            return Ok(());
        }
        let id = self.memory.calibration.take().map(|it| it.id);
        if id.is_some() && store.active(self.axis)?.current == id {
            store.retire(self.axis)?;
        }
        Err(RotaryFailure::MadeWorse {
            axis: self.axis.to_owned(),
            calibration: id.as_deref().map(short).unwrap_or_default(),
            before: verified.found.rms,
            after: left.rms,
        }
        .into())
    }
}

/// Whether the calibration was made with the plate that is to be read.
fn is_of(known: &TableInUse, run: &PlateRun) -> bool {
    known.plate == run.plate && known.content.lines == run.lines
}

/// Of each line: its true angle, as the calibration knows the plate, less what the table reads
/// (or, with `table`, what it reads corrected), less the mean of that.
fn figures(
    placed: &Placed,
    known: Option<&TableInUse>,
    table: Option<&PeriodicCompensation>,
) -> RotaryFigures {
    let whole = placed.offset.floor() as usize;
    centred(deviations(&angles(placed, table), whole, known))
}

/// Of each table position: what the line there was read at, from the position, corrected with
/// `table`.
fn angles(placed: &Placed, table: Option<&PeriodicCompensation>) -> Vec<Option<Radians>> {
    let lines = placed.deviations.len();
    let angle = |(at, reading): (usize, &Option<Radians>)| {
        let reading = (*reading)?;
        let position = TAU * at as f64 / lines as f64;
        let corrected = match table {
            Some(table) => table.deviation(Radians(position) + reading).ok()?,
            None => Radians::ZERO,
        };
        Some(reading + corrected)
    };
    placed.deviations.iter().enumerate().map(angle).collect()
}

/// Of each line, when line n is at position n + `whole`: where it is by the plate, less where it
/// was found.
fn deviations(
    angles: &[Option<Radians>],
    whole: usize,
    known: Option<&TableInUse>,
) -> Vec<Option<Radians>> {
    let lines = angles.len();
    let deviation = |line: usize| {
        let plate = match known {
            Some(known) => (*known.content.plate_error_rad.get(line)?)?,
            None => 0.0,
        };
        Some(Radians(plate) - angles[(line + whole) % lines]?)
    };
    (0..lines).map(deviation).collect()
}

fn centred(values: Vec<Option<Radians>>) -> RotaryFigures {
    let seen = values.iter().flatten();
    let count = seen.clone().count().max(1) as f64;
    let mean = seen.copied().sum::<Radians>() / count;
    RotaryFigures::of(values.iter().map(|it| it.map(|it| it - mean)).collect())
}

/// Whether the lines that were read are those that lie there, by what the calibration knows of the
/// plate.
fn lies_there(axis: &str, known: &TableInUse, placed: &Placed) -> Result<(), Failure> {
    let angles = angles(placed, Some(&known.compensation));
    let (lines, whole) = (angles.len(), placed.offset.floor() as usize);
    let plate = known.content.plate_error_rad.iter().copied();
    let read = angles.iter().map(|it| it.map(Radians::value));
    // Line n lies at position n + shift.
    let shift = rotary::shift_between(plate, read);
    let residual = |whole: usize| centred(deviations(&angles, whole, Some(known))).rms;
    let (fits, expected) = (residual(shift), residual(whole));
    if shift == whole % lines || fits * BETTER >= expected {
        return Ok(());
    }
    let turned = (shift + lines - whole % lines) % lines;
    Err(RotaryFailure::LiesElsewhere {
        axis: axis.to_owned(),
        expected: placed.offset,
        seen: (placed.offset + turned as f64) % lines as f64,
        residual: fits,
        residual_expected: expected,
    }
    .into())
}
