//! Run journals: every measured point is written when it is measured.
//!
//! One line an entry: eight hexadecimal digits of CRC-32, a blank, JSON. A killed run leaves
//! whole lines and at most one torn one at the end, which is dropped when it is read.

use std::fs::{self, File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::difference::{Difference, first_difference};
use super::record::{IdentityRecord, InstrumentRecord};
use super::{SCHEMA_VERSION, StoreError, io_error, sound, unsound};
use crate::config::ConfigHash;
use crate::linear::{PointEntry, ZeroEntry};
use crate::platform::{ArrangementEntry, PoseEntry, StrokeEntry};
use crate::rotary::{JudgedEntry, PlacementEntry, PlatePlanEntry, SweepEntry};
use crate::volumetric::{
    LineReadEntry, LineReadingEntry, VolumeCheckEntry, VolumePlanEntry, VolumeRead,
    VolumeReferencesEntry,
};

/// What a run is: written first.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JournalHeader {
    /// Of this file.
    pub schema_version: u32,
    /// `calibrate`, `verify`, `zero`.
    pub verb: String,
    /// The machine's name.
    pub machine: String,
    /// The stage's serial number.
    pub stage_serial: String,
    /// BLAKE3 of what a calibration depends on.
    pub config_hash: String,
    /// Which axis.
    pub axis: String,
    /// Who the drive is.
    pub drive: IdentityRecord,
    /// What measures.
    pub instrument: InstrumentRecord,
    /// When, UTC, RFC 3339.
    pub started: String,
    /// The calibration in use, `None` for uncompensated moves.
    pub calibration: Option<String>,
    /// The targets of one run, metres.
    pub targets_m: Vec<f64>,
    /// How many runs.
    pub runs: u32,
}

/// The datum's place, measured again after a run.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ClosureEntry {
    /// Which run, from 1.
    pub run: u32,
    /// What the instrument read there before the run, metres; 0 right after the datum.
    pub start_m: f64,
    /// What the instrument read there, metres; 0 when nothing drifted.
    pub closure_m: f64,
}

/// A line of a journal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "entry", rename_all = "snake_case")]
pub enum Entry {
    /// First line.
    Header(JournalHeader),
    /// A measured point.
    Point(PointEntry),
    /// A zero.
    Zero(ZeroEntry),
    /// What a platform is made of.
    Arrangement(ArrangementEntry),
    /// A stroke of one screw of a platform.
    Stroke(StrokeEntry),
    /// A pose of a platform that was looked at.
    Pose(PoseEntry),
    /// How a plate is to be read: the second line of such a run.
    PlatePlan(PlatePlanEntry),
    /// A pass over the lines of a plate.
    Sweep(SweepEntry),
    /// A placement of a plate was read whole.
    Placed(PlacementEntry),
    /// What a verification with a plate found.
    Judged(JudgedEntry),
    /// A placement turned out to be another one than was asked for: it must be read again.
    Misplaced {
        /// By how many lines the plate was to be turned.
        offset: f64,
    },
    /// How the errors of three axes are to be found: the second line of such a run.
    VolumePlan(VolumePlanEntry),
    /// What their detectors read before the first line.
    VolumeReferences(VolumeReferencesEntry),
    /// A reading of a line.
    LineReading(LineReadingEntry),
    /// A line was read to its end.
    LineRead(LineReadEntry),
    /// Which line a verification of three axes reads: the second line of such a run.
    VolumeCheck(VolumeCheckEntry),
    /// A run is whole, and the place of its datum still reads what it should.
    Closed(ClosureEntry),
    /// The run was continued here after an interruption.
    Resumed {
        /// When, UTC, RFC 3339.
        at: String,
    },
    /// The run failed; the points before stay valid.
    Failed {
        /// The operator's text.
        cause: String,
    },
    /// The run is complete.
    Complete,
}

/// A journal being written.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    file: File,
}

impl Journal {
    /// Starts a journal in `folder`.
    ///
    /// # Errors
    /// When it cannot be created.
    pub fn create(folder: &Path, header: &JournalHeader) -> Result<Self, StoreError> {
        fs::create_dir_all(folder).map_err(io_error("create the folder", folder))?;
        let stamp = header.started.replace([':', '-'], "");
        for attempt in 0..10_000_u32 {
            let name = format!("{stamp}-{}-{}-{attempt:02}.jsonl", header.verb, header.axis);
            let path = folder.join(name);
            match OpenOptions::new().append(true).create_new(true).open(&path) {
                Ok(file) => {
                    let mut journal = Self { path, file };
                    journal.write(&Entry::Header(header.clone()))?;
                    return Ok(journal);
                }
                Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => {}
                Err(error) => return Err(io_error("create", &path)(error)),
            }
        }
        let taken = std::io::Error::from(std::io::ErrorKind::AlreadyExists);
        Err(io_error("create a new journal in", folder)(taken))
    }

    /// Continues the journal at `path` after its last whole line; `hash` is of the configuration
    /// that it is continued with.
    ///
    /// # Errors
    /// When it cannot be read or does not describe the same run as `header`.
    pub fn resume(
        path: &Path,
        header: &JournalHeader,
        hash: &ConfigHash,
    ) -> Result<(Self, ReadJournal), StoreError> {
        let mut read = read_journal(path)?;
        same_run(path, &read.header, header, hash)?;
        if read.complete {
            return Err(StoreError::AlreadyComplete {
                path: path.to_owned(),
            });
        }
        let file = OpenOptions::new()
            .append(true)
            .open(path)
            .map_err(io_error("open", path))?;
        file.set_len(read.valid_bytes)
            .map_err(io_error("cut the torn line of", path))?;
        let mut journal = Self {
            path: path.to_owned(),
            file,
        };
        journal.write(&Entry::Resumed {
            at: header.started.clone(),
        })?;
        read.failure = None;
        read.keep_whole_runs();
        Ok((journal, read))
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Appends one entry; it is in the kernel's hands when this returns, so that killing the
    /// process loses nothing.
    ///
    /// # Errors
    /// When it cannot be written: the run must stop, its points would be lost.
    pub fn write(&mut self, entry: &Entry) -> Result<(), StoreError> {
        let json = serde_json::to_string(entry).expect("plain data always serialises");
        let line = format!("{:08x} {json}\n", crc32fast::hash(json.as_bytes()));
        self.file
            .write_all(line.as_bytes())
            .map_err(io_error("append to", &self.path))
    }

    /// Forces everything to the disk; called where the axis stands and time does not matter.
    ///
    /// # Errors
    /// When the disk refuses.
    pub fn flush_to_disk(&mut self) -> Result<(), StoreError> {
        self.file
            .sync_data()
            .map_err(io_error("flush to disk", &self.path))
    }
}

/// A journal that was read.
#[derive(Clone, Debug, PartialEq)]
pub struct ReadJournal {
    /// What the run is.
    pub header: JournalHeader,
    /// Its points, in the order they were measured.
    pub points: Vec<PointEntry>,
    /// Its zeros.
    pub zeros: Vec<ZeroEntry>,
    /// How far each whole run had drifted at its end.
    pub closures: Vec<ClosureEntry>,
    /// What the platform is made of, where the run was one of a platform.
    pub arrangement: Option<ArrangementEntry>,
    /// Strokes of a platform's screws.
    pub strokes: Vec<StrokeEntry>,
    /// Poses of a platform.
    pub poses: Vec<PoseEntry>,
    /// How a plate is read.
    pub plate_plan: Option<PlatePlanEntry>,
    /// Passes over it.
    pub sweeps: Vec<SweepEntry>,
    /// Its placements that were read whole.
    pub placements: Vec<PlacementEntry>,
    /// What a verification with it found.
    pub judged: Option<JudgedEntry>,
    /// Of three axes.
    pub volume: VolumeRead,
    /// Whether the run was finished.
    pub complete: bool,
    /// Why it ended before, as the operator was told, unless it was continued.
    pub failure: Option<String>,
    /// How many bytes are whole lines.
    pub valid_bytes: u64,
    /// Whether a torn line follows them.
    pub torn: bool,
}

impl ReadJournal {
    /// What a continued measurement goes on from. Its datum is a new one, so that only runs
    /// whose end was seen to agree with their own datum are kept.
    fn keep_whole_runs(&mut self) {
        let whole = self.header.targets_m.len() * 2;
        let points = core::mem::take(&mut self.points);
        let count = |run: u32| points.iter().filter(|point| point.run == run).count();
        self.closures.retain(|closure| count(closure.run) == whole);
        let is_kept = |run: u32| self.closures.iter().any(|closure| closure.run == run);
        self.points = points
            .iter()
            .filter(|it| is_kept(it.run))
            .copied()
            .collect();
        let placed = |offset: f64| self.placements.iter().any(|it| it.offset == offset);
        self.sweeps.retain(|it| placed(it.offset));
        self.volume.keep_whole_lines();
    }

    fn forget_placement(&mut self, offset: f64) {
        self.sweeps.retain(|it| it.offset != offset);
        self.placements.retain(|it| it.offset != offset);
    }
}

fn same_run(
    path: &Path,
    old: &JournalHeader,
    new: &JournalHeader,
    hash: &ConfigHash,
) -> Result<(), StoreError> {
    let text = |a: &str, b: &str| first_difference(a, b);
    let config_hash = hash.beside(&old.config_hash);
    let comparisons = [
        ("verb", text(&old.verb, &new.verb)),
        ("stage serial", text(&old.stage_serial, &new.stage_serial)),
        ("configuration hash", text(&old.config_hash, config_hash)),
        ("axis", text(&old.axis, &new.axis)),
        ("drive", first_difference(&old.drive, &new.drive)),
        (
            "calibration",
            first_difference(&old.calibration, &new.calibration),
        ),
        (
            "instrument and its corrections",
            first_difference(&old.instrument, &new.instrument),
        ),
        ("number of runs", first_difference(&old.runs, &new.runs)),
        ("targets", first_difference(&old.targets_m, &new.targets_m)),
    ];
    let different = comparisons
        .into_iter()
        .find_map(|(what, it)| Some((what, it?)));
    different.map_or(Ok(()), |(what, it)| Err(not_resumable(path, what, it)))
}

/// The error for a journal whose run was another one than would be continued, with where they differ.
pub(crate) fn not_resumable(path: &Path, what: &str, it: Difference) -> StoreError {
    StoreError::NotResumable {
        path: path.to_owned(),
        what: it.in_what(what),
        expected: it.expected,
        seen: it.seen,
    }
}

/// Reads a journal up to its last whole line.
///
/// # Errors
/// When it cannot be read, has no header, a line before the last one is damaged, or one says what
/// cannot be.
pub fn read_journal(path: &Path) -> Result<ReadJournal, StoreError> {
    let bytes = fs::read(path).map_err(io_error("read", path))?;
    let mut read: Option<ReadJournal> = None;
    let mut valid_bytes = 0;
    let mut torn = false;
    let lines: Vec<&[u8]> = bytes.split_inclusive(|byte| *byte == b'\n').collect();
    for (at, line) in lines.iter().enumerate() {
        match parse_line(line) {
            Ok(entry) => {
                valid_bytes += line.len() as u64;
                take(path, at + 1, entry, &mut read)?;
            }
            Err(_) if at + 1 == lines.len() => torn = true,
            Err(cause) => {
                return Err(StoreError::Format {
                    path: path.to_owned(),
                    line: at + 1,
                    cause,
                });
            }
        }
    }
    let mut read = read.ok_or_else(|| StoreError::Format {
        path: path.to_owned(),
        line: 1,
        cause: "no whole header line".into(),
    })?;
    read.valid_bytes = valid_bytes;
    read.torn = torn;
    Ok(read)
}

fn parse_line(line: &[u8]) -> Result<Entry, String> {
    let text = core::str::from_utf8(line).map_err(|error| error.to_string())?;
    let text = text.strip_suffix('\n').ok_or("the line does not end")?;
    let (digits, json) = text.split_once(' ').ok_or("no checksum")?;
    let expected = u32::from_str_radix(digits, 16).map_err(|error| error.to_string())?;
    let seen = crc32fast::hash(json.as_bytes());
    if seen != expected {
        return Err(format!("checksum {seen:08x}, the line says {expected:08x}"));
    }
    serde_json::from_str(json).map_err(|error| error.to_string())
}

/// Of a whole journal.
#[cfg(test)]
pub(super) fn entries(text: &str) -> impl Iterator<Item = Entry> {
    let lines = text.as_bytes().split_inclusive(|byte| *byte == b'\n');
    lines.map(|line| parse_line(line).expect("a whole line"))
}

fn take(
    path: &Path,
    line: usize,
    entry: Entry,
    read: &mut Option<ReadJournal>,
) -> Result<(), StoreError> {
    let misplaced = || StoreError::Format {
        path: path.to_owned(),
        line,
        cause: "the header must be the first line and the only one".into(),
    };
    if let Some(read) = &read {
        sound::entry(read, &entry).map_err(unsound(path, Some(line)))?;
    }
    match (entry, read.as_mut()) {
        (Entry::Header(header), None) if header.schema_version > SCHEMA_VERSION => {
            return Err(StoreError::Newer {
                path: path.to_owned(),
                seen: header.schema_version,
            });
        }
        (Entry::Header(header), None) => {
            sound::header(&header).map_err(unsound(path, Some(line)))?;
            *read = Some(ReadJournal {
                header,
                points: Vec::new(),
                zeros: Vec::new(),
                closures: Vec::new(),
                arrangement: None,
                strokes: Vec::new(),
                poses: Vec::new(),
                plate_plan: None,
                sweeps: Vec::new(),
                placements: Vec::new(),
                judged: None,
                volume: VolumeRead::default(),
                complete: false,
                failure: None,
                valid_bytes: 0,
                torn: false,
            });
        }
        (Entry::Header(_), Some(_)) | (_, None) => return Err(misplaced()),
        (Entry::Point(point), Some(read)) => read.points.push(point),
        (Entry::Zero(zero), Some(read)) => read.zeros.push(zero),
        (Entry::Closed(closure), Some(read)) => read.closures.push(closure),
        (Entry::Arrangement(it), Some(read)) => read.arrangement = Some(it),
        (Entry::Stroke(stroke), Some(read)) => read.strokes.push(stroke),
        (Entry::Pose(pose), Some(read)) => read.poses.push(pose),
        (Entry::PlatePlan(plan), Some(read)) => read.plate_plan = Some(plan),
        (Entry::Sweep(sweep), Some(read)) => read.sweeps.push(sweep),
        (Entry::Placed(placement), Some(read)) => read.placements.push(placement),
        (Entry::Judged(judged), Some(read)) => read.judged = Some(judged),
        (Entry::VolumePlan(plan), Some(read)) => read.volume.plan = Some(plan),
        (Entry::VolumeReferences(it), Some(read)) => read.volume.references = Some(it),
        (Entry::LineReading(reading), Some(read)) => read.volume.readings.push(reading),
        (Entry::LineRead(line), Some(read)) => read.volume.whole.push(line),
        (Entry::VolumeCheck(check), Some(read)) => read.volume.check = Some(check),
        (Entry::Misplaced { offset }, Some(read)) => read.forget_placement(offset),
        (Entry::Resumed { .. }, Some(read)) => {
            read.complete = false;
            read.failure = None;
            read.keep_whole_runs();
        }
        (Entry::Failed { cause }, Some(read)) => {
            read.complete = false;
            read.failure = Some(cause);
        }
        (Entry::Complete, Some(read)) => read.complete = true,
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Edit;
    use crate::store::EnvironmentRecord;

    fn hash() -> ConfigHash {
        ConfigHash::only("h")
    }

    fn header() -> JournalHeader {
        JournalHeader {
            schema_version: SCHEMA_VERSION,
            verb: "calibrate".into(),
            machine: "m".into(),
            stage_serial: "A".into(),
            config_hash: "h".into(),
            axis: "x".into(),
            drive: IdentityRecord::default(),
            instrument: InstrumentRecord::default(),
            started: "2026-01-01T00:00:00Z".into(),
            calibration: None,
            targets_m: vec![0.0, 0.003],
            runs: 3,
        }
    }

    fn point(run: u32) -> Entry {
        Entry::Point(PointEntry {
            run,
            approach: '+',
            target_m: 0.003,
            set_point_m: 0.003,
            encoder_m: 0.003,
            measured_m: 0.003_001,
            scatter_m: 1e-9,
            at_s: 1.5,
            environment: EnvironmentRecord::default(),
        })
    }

    #[test]
    fn a_journal_cut_at_any_byte_loses_at_most_its_last_line() {
        let folder = tempfile::tempdir().unwrap();
        let mut journal = Journal::create(folder.path(), &header()).unwrap();
        let first_line = fs::read(journal.path()).unwrap().len();
        for run in 1..=3 {
            journal.write(&point(run)).unwrap();
        }
        let whole = fs::read(journal.path()).unwrap();
        let cut = folder.path().join("cut.jsonl");
        for length in first_line..=whole.len() {
            fs::write(&cut, &whole[..length]).unwrap();
            let read = read_journal(&cut).unwrap();
            let complete_lines = whole[..length]
                .iter()
                .filter(|byte| **byte == b'\n')
                .count();
            assert_eq!(read.points.len(), complete_lines - 1);
            assert!(!read.complete);
        }
    }

    /// 17 × 3 mm is 0.051000000000000004: a target read is the target written, to the last bit.
    #[test]
    fn any_target_is_the_same_target_when_a_run_is_continued() {
        let folder = tempfile::tempdir().unwrap();
        let mut header = header();
        header.targets_m = (0..=20).map(|at| f64::from(at * 3) * 1e-3).collect();
        let journal = Journal::create(folder.path(), &header).unwrap();
        Journal::resume(journal.path(), &header, &hash()).unwrap();
    }

    fn write_points(journal: &mut Journal, run: u32) {
        for _ in 0..4 {
            journal.write(&point(run)).unwrap();
        }
    }

    /// One whole run of the header's two targets.
    fn write_run(journal: &mut Journal, run: u32) {
        write_points(journal, run);
        let closure_m = 1e-8;
        journal
            .write(&Entry::Closed(ClosureEntry {
                run,
                start_m: 0.0,
                closure_m,
            }))
            .unwrap();
    }

    #[test]
    fn a_run_whose_datum_was_not_measured_again_is_not_kept() {
        let folder = tempfile::tempdir().unwrap();
        let mut journal = Journal::create(folder.path(), &header()).unwrap();
        write_run(&mut journal, 1);
        write_points(&mut journal, 2);
        let (_, read) = Journal::resume(journal.path(), &header(), &hash()).unwrap();
        assert!(read.points.iter().all(|point| point.run == 1));
        assert_eq!((read.points.len(), read.closures.len()), (4, 1));
    }

    #[test]
    fn resuming_cuts_the_torn_line_and_goes_on() {
        let folder = tempfile::tempdir().unwrap();
        let mut journal = Journal::create(folder.path(), &header()).unwrap();
        write_run(&mut journal, 1);
        let path = journal.path().to_owned();
        let mut bytes = fs::read(&path).unwrap();
        bytes.extend_from_slice(b"1234abcd {\"entry\":\"poi");
        fs::write(&path, &bytes).unwrap();
        let (mut journal, read) = Journal::resume(&path, &header(), &hash()).unwrap();
        assert!(read.torn);
        assert_eq!(read.points.len(), 4);
        write_run(&mut journal, 2);
        journal.write(&Entry::Complete).unwrap();
        let read = read_journal(&path).unwrap();
        assert_eq!(
            (read.points.len(), read.complete, read.torn),
            (8, true, false)
        );
    }

    #[test]
    fn a_run_cut_short_counts_once_however_often_it_is_resumed() {
        let folder = tempfile::tempdir().unwrap();
        let mut journal = Journal::create(folder.path(), &header()).unwrap();
        write_run(&mut journal, 1);
        journal.write(&point(2)).unwrap();
        let path = journal.path().to_owned();
        let (mut journal, read) = Journal::resume(&path, &header(), &hash()).unwrap();
        assert_eq!(read.points.len(), 4);
        write_run(&mut journal, 2);
        let (_, read) = Journal::resume(&path, &header(), &hash()).unwrap();
        let runs: Vec<_> = read.points.iter().map(|point| point.run).collect();
        assert_eq!(runs, [1, 1, 1, 1, 2, 2, 2, 2]);
        assert_eq!(read_journal(&path).unwrap().points, read.points);
    }

    #[test]
    fn of_a_plate_whole_placements_are_kept_that_lay_where_they_should() {
        let folder = tempfile::tempdir().unwrap();
        let mut journal = Journal::create(folder.path(), &header()).unwrap();
        let sweep = |offset| {
            Entry::Sweep(SweepEntry {
                offset,
                pass: 1,
                approach: '+',
                deviations_rad: vec![None; 360],
                ..SweepEntry::default()
            })
        };
        let plan = PlatePlanEntry {
            plate: "p".into(),
            lines: 360,
            offsets: vec![0.0, 73.0, 162.0],
            passes: 1,
            speed_rad_per_s: 1.0,
        };
        let placed = |offset| {
            Entry::Placed(PlacementEntry {
                offset,
                closure_rad: 0.0,
                at_s: 0.0,
            })
        };
        for entry in [
            Entry::PlatePlan(plan),
            sweep(0.0),
            sweep(0.0),
            placed(0.0),
            sweep(73.0),
            placed(73.0),
        ] {
            journal.write(&entry).unwrap();
        }
        journal.write(&Entry::Misplaced { offset: 73.0 }).unwrap();
        journal.write(&sweep(162.0)).unwrap();
        let path = journal.path().to_owned();
        let (mut journal, read) = Journal::resume(&path, &header(), &hash()).unwrap();
        assert_eq!((read.sweeps.len(), read.placements.len()), (2, 1));
        journal.write(&sweep(73.0)).unwrap();
        journal.write(&placed(73.0)).unwrap();
        let read = read_journal(&path).unwrap();
        assert_eq!((read.sweeps.len(), read.placements.len()), (3, 2));
    }

    #[test]
    fn a_run_that_failed_says_why_until_it_is_continued() {
        let folder = tempfile::tempdir().unwrap();
        let mut journal = Journal::create(folder.path(), &header()).unwrap();
        let cause = "the laser beam is blocked".to_owned();
        journal.write(&Entry::Failed { cause }).unwrap();
        let path = journal.path().to_owned();
        let failure = || read_journal(&path).unwrap().failure;
        assert_eq!(failure().as_deref(), Some("the laser beam is blocked"));
        Journal::resume(&path, &header(), &hash()).unwrap();
        assert_eq!(failure(), None);
    }

    #[test]
    fn a_run_that_is_complete_cannot_be_continued() {
        let folder = tempfile::tempdir().unwrap();
        let mut journal = Journal::create(folder.path(), &header()).unwrap();
        write_run(&mut journal, 1);
        journal.write(&Entry::Complete).unwrap();
        let error = Journal::resume(journal.path(), &header(), &hash()).unwrap_err();
        assert!(error.to_string().contains("complete"), "{error}");
    }

    #[test]
    fn a_damaged_line_in_the_middle_is_an_error_with_its_number() {
        let folder = tempfile::tempdir().unwrap();
        let mut journal = Journal::create(folder.path(), &header()).unwrap();
        journal.write(&point(1)).unwrap();
        journal.write(&point(2)).unwrap();
        let path = journal.path().to_owned();
        let text = fs::read_to_string(&path)
            .unwrap()
            .edit_first("\"run\":1", "\"run\":7");
        fs::write(&path, text).unwrap();
        let error = read_journal(&path).unwrap_err();
        assert!(
            matches!(error, StoreError::Format { line: 2, .. }),
            "{error}"
        );
    }

    #[test]
    fn another_run_cannot_be_resumed() {
        let folder = tempfile::tempdir().unwrap();
        let journal = Journal::create(folder.path(), &header()).unwrap();
        let mut other = header();
        other.stage_serial = "B".into();
        let error = Journal::resume(journal.path(), &other, &hash()).unwrap_err();
        assert!(error.to_string().contains("stage serial"), "{error}");
        let mut other = header();
        other.instrument.air_corrected = true;
        let error = Journal::resume(journal.path(), &other, &hash()).unwrap_err();
        assert!(error.to_string().contains("instrument"), "{error}");
    }
}
