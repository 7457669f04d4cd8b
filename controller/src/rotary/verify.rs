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
use compensator::uncertainty::{mean, rms};
use core::f64::consts::TAU;
use units::Radians;

use crate::failure::Failure;
use crate::rotary::bidirectional::Bidirectional;
use crate::rotary::calibrate::Read;
use crate::rotary::failure::RotaryFailure;
use crate::rotary::in_use::TableInUse;
use crate::rotary::operator::Operator;
use crate::rotary::placed::Placed;
use crate::rotary::plate_journal::PlateJournal;
use crate::rotary::plate_run::{DuePlacement, PlateRun};
use crate::rotary::subject::Subject;
use crate::rotary::table::RotaryTable;
use crate::rotary::{JudgedEntry, PlateEntry, RotaryVerifyConfig};
use crate::run::{missing, settle};
use crate::store::{Store, short};
use crate::worse::likeliest_cause;
use machine::Stage;
use machine::read_ahead;

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
    /// What the directions of its passes differ by; `None` where no line was read in both.
    pub bidirectional: Option<Bidirectional>,
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

    /// What a verification of `axis` that was to be within the tolerance failed by.
    pub(crate) fn out_of_tolerance(&self, axis: &str) -> Option<Failure> {
        let left = self.left.as_ref()?;
        let failure = RotaryFailure::OutOfTolerance {
            axis: axis.to_owned(),
            seen: left.largest,
            limit: self.tolerance,
        };
        (!self.is_within_tolerance()).then(|| failure.into())
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
            noise_rad: self.noise.map(Radians::value),
        }
    }
}

impl RotaryTable<'_> {
    /// Has the plate placed at the configuration's verification offset, reads it, and judges.
    /// Being out of tolerance is a result here, not an error; being out of tolerance and worse
    /// than without the calibration is one, and takes the calibration out of use.
    ///
    /// # Errors
    /// Not zeroed, or no line detector; `compensated` without a calibration; another plate than the
    /// calibration's, or one that lies elsewhere; whatever stops the machine.
    pub fn verify(
        &mut self,
        store: &Store,
        compensated: bool,
        operator: &mut dyn Operator,
    ) -> Result<RotaryVerified, Failure> {
        self.require_detector()?;
        self.verify_by(
            store,
            (compensated, None),
            &mut |table, run, due, journal| {
                table.place_plate(run, due, operator)?;
                table.read_placement(run, (due.offset, due.phase), due.done, journal)
            },
        )
    }

    /// The same with the placement brought about and read by `read`, perhaps as a run that is continued.
    pub(super) fn verify_by(
        &mut self,
        store: &Store,
        (compensated, resume): (bool, Option<&PathBuf>),
        read: &mut Read<'_>,
    ) -> Result<RotaryVerified, Failure> {
        self.core.require_zeroed(self.axis)?;
        let known = self.memory.calibration.clone();
        if let Some(journal) = resume {
            read_ahead(&mut self.core, store, journal.clone())?;
        }
        let mut it = Verification::begin(self.subject(), store, (compensated, known), resume)?;
        settle(&mut self.core, store)?;
        let due = it.due();
        let placed = self.read_due(read, &it.run, &due, &mut it.journal);
        let placed = placed.inspect_err(|failure| it.journal.note(failure))?;
        let verified = it.judge(store, &placed);
        settle(&mut self.core, store)?;
        verified.inspect_err(|failure| {
            if let Some(RotaryFailure::MadeWorse { .. }) = failure.of_kind() {
                self.memory.calibration = None;
            }
        })
    }
}

/// A verification that is under way.
pub(crate) struct Verification<'a> {
    pub(super) subject: Subject<'a>,
    pub(super) run: PlateRun,
    config: RotaryVerifyConfig,
    known: Option<TableInUse>,
    compensated: bool,
    pub(super) journal: PlateJournal,
}

impl<'a> Verification<'a> {
    /// A new one, or one that is continued; `known` is the calibration in use.
    pub(super) fn begin(
        subject: Subject<'a>,
        store: &Store,
        (compensated, known): (bool, Option<TableInUse>),
        resume: Option<&PathBuf>,
    ) -> Result<Self, Failure> {
        let config = subject.config.verify.clone();
        let config = config.ok_or_else(|| missing(subject.axis, "verify"))?;
        let (run, _) = subject.plate_run()?;
        let run = PlateRun {
            passes: config.passes,
            stage: Stage::Verify,
            ..run
        };
        let known = known_plate(subject.axis, known, &run, compensated)?;
        let id = known.as_ref().map(|it| it.id.clone());
        let header = subject.header("verify", &run, id.filter(|_| compensated));
        let plan = run.plan(vec![config.offset_lines]);
        let journal = PlateJournal::open(store, &header, &plan, resume, &subject)?;
        Ok(Self {
            subject,
            run,
            config,
            known,
            compensated,
            journal,
        })
    }

    /// The placement that is to be read.
    pub(super) fn due(&self) -> DuePlacement {
        // Without a calibration any placement is as good as another.
        let content = self.known.as_ref().map(|it| &it.content);
        let lay_at = content.and_then(|it| it.offsets.first());
        DuePlacement {
            offset: self.config.offset_lines,
            step: (1, 1),
            known: lay_at.map(|it| f64::from(*it)),
            phase: content.and_then(|it| it.plate_phase_rad).map(Radians),
            done: (0, self.run.sweeps()),
        }
    }

    /// What was read, judged, written down and acted upon.
    pub(super) fn judge(
        mut self,
        store: &Store,
        placed: &Placed,
    ) -> Result<RotaryVerified, Failure> {
        let verified = self.judged(store, placed);
        let verified = verified.inspect_err(|failure| self.journal.note(failure))?;
        self.journal.complete()?;
        Ok(verified)
    }

    fn judged(&mut self, store: &Store, placed: &Placed) -> Result<RotaryVerified, Failure> {
        let axis = self.subject.axis;
        if let Some(known) = &self.known {
            lies_there(axis, known, placed)?;
        }
        let known = self.known.as_ref();
        let verified = RotaryVerified {
            offset_lines: self.config.offset_lines,
            found: figures(placed, known, None),
            plate_known: known.is_some(),
            left: known
                .filter(|_| self.compensated)
                .map(|known| figures(placed, Some(known), Some(&known.compensation))),
            noise: placed
                .scatter
                .map(|it| it / (2.0 * f64::from(self.run.passes)).sqrt()),
            bidirectional: Bidirectional::of(
                &self.journal.so_far().sweeps,
                placed.offset,
                self.run.passes,
            ),
            closure: placed.closure,
            tolerance: Radians::from_arcsec(self.config.tolerance_arcsec),
            journal: self.journal.path().to_owned(),
        };
        self.journal.write(PlateEntry::Judged(verified.entry()))?;
        judge_table(axis, store, known, &verified)?;
        Ok(verified)
    }
}

/// What the calibration in use says of the plate.
fn known_plate(
    axis: &str,
    in_use: Option<TableInUse>,
    run: &PlateRun,
    compensated: bool,
) -> Result<Option<TableInUse>, Failure> {
    match in_use {
        None if compensated => Err(Failure::Usage {
            what: format!("axis {axis} uses no calibration"),
            help: "load or make one, or verify uncompensated".into(),
        }),
        // Of another plate it says nothing, and of the table as found nothing is wanted.
        Some(known) if !compensated && !is_of(&known, run) => Ok(None),
        Some(known) if !is_of(&known, run) => {
            let lines = |plate: &str, lines: u32| format!("{plate} ({lines} lines)");
            Err(RotaryFailure::OtherPlate {
                axis: axis.to_owned(),
                expected: lines(&known.plate, known.content.lines),
                seen: lines(&run.plate, run.lines),
            }
            .into())
        }
        known => Ok(known),
    }
}

/// A calibration that makes the table worse is taken out of use.
fn judge_table(
    axis: &str,
    store: &Store,
    known: Option<&TableInUse>,
    verified: &RotaryVerified,
) -> Result<(), Failure> {
    let Some(left) = &verified.left else {
        return Ok(());
    };
    if verified.is_within_tolerance() || left.rms <= verified.found.rms {
        return Ok(());
    }
    let id = known.map(|it| it.id.clone());
    let in_use = match id.is_some() && store.active(axis)?.current == id {
        true => store.retire(axis)?,
        false => None,
    };
    let ways = known.map(|it| ways(it, verified.offset_lines, left));
    Err(RotaryFailure::MadeWorse {
        cause: likeliest_cause(&ways.unwrap_or_default()),
        in_use: in_use.as_deref().map(short),
        axis: axis.to_owned(),
        calibration: id.as_deref().map(short).unwrap_or_default(),
        before: verified.found.rms,
        after: left.rms,
    }
    .into())
}

/// Of each line of a plate at `offset` what the calibration says of the place where it lies, and what is left there: of
/// a table that is wrong and a plate that is right, and of both as one calibration found them, which then has also made
/// the line wrong by the mean of what the table is wrong by where the line lay.
fn ways(known: &TableInUse, offset: f64, left: &RotaryFigures) -> [Vec<(f64, f64)>; 2] {
    let lines = left.deviations.len();
    let says = |line: usize, offset: f64| {
        let place = Radians(TAU * (line as f64 + offset) / lines as f64);
        known.compensation.deviation(place).ok().map(Radians::value)
    };
    let of_plate = |line: usize| {
        let offsets = known.content.offsets.iter();
        let there: Option<Vec<f64>> = offsets.map(|it| says(line, f64::from(*it))).collect();
        mean(&there?)
    };
    let pair = |line: usize| {
        let (says, left) = (says(line, offset)?, left.deviations[line]?.value());
        Some([(says, left), (says - of_plate(line)?, left)])
    };
    let pairs: Vec<[(f64, f64); 2]> = (0..lines).filter_map(pair).collect();
    [0, 1].map(|way| pairs.iter().map(|it| it[way]).collect())
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
        // Where the table's error was seen: at the line, or where the table stood.
        let seen_at = Radians(position) + placed.stood.unwrap_or(reading);
        let corrected = match table {
            Some(table) => table.deviation(seen_at).ok()?,
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
