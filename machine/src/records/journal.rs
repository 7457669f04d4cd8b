//! Run journals: every measured point is written when it is measured.
//!
//! One line an entry: eight hexadecimal digits of CRC-32, a blank, JSON whose key `entry` says what
//! it is. A killed run leaves whole lines and at most one torn one at the end, which is dropped
//! when it is read. Every journal records in the same way how a run begins, continues and ends;
//! what it measured is recorded in the terms of its kind ([`Log`]).

use std::io::{BufRead, BufReader};
use std::path::Path;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::door::Door;
use super::head::{IdentityRecord, InstrumentRecord};
use super::line::{json_of, next_line};
use super::regular::{JOURNAL_MAX, open_regular};
use super::sound::{
    COUNT_MAX, ERROR_M, ERROR_U_M, Judged, PASSES_MAX, PLACE_M, counted, number, numbers, optional,
};
use super::{SCHEMA_VERSION, StoreError, io_error, unsound};

/// What a run is: written first.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
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
    /// The program that writes it; `None` in journals of programs that did not say so.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub program: Option<String>,
    /// The calibration in use, `None` for uncompensated moves.
    pub calibration: Option<String>,
    /// The targets of one run, metres.
    pub targets_m: Vec<f64>,
    /// How many runs.
    pub runs: u32,
    /// Over which distance each target was approached, metres, where that is always the same.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub approach_m: Option<f64>,
}

impl JournalHeader {
    fn judge(&self) -> Judged {
        counted("runs", self.runs as usize, 0..=PASSES_MAX)?;
        counted("targets_m", self.targets_m.len(), 0..=COUNT_MAX)?;
        numbers("targets_m", &self.targets_m, &PLACE_M)?;
        optional("approach_m", self.approach_m, &PLACE_M)?;
        let u = self.instrument.standard_uncertainty_m;
        number("instrument.standard_uncertainty_m", u, &ERROR_U_M)
    }

    /// Whether `seen` can be the number of a run.
    ///
    /// # Errors
    /// When there is no such run.
    pub fn judge_run(&self, seen: u32) -> Judged {
        let most = (self.runs as usize).max(1);
        counted("run", seen as usize, 1..=most)
    }
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

impl ClosureEntry {
    /// Whether it can close a run of `header`'s.
    ///
    /// # Errors
    /// Naming the first thing that cannot be so.
    pub fn judge(&self, header: &JournalHeader) -> Judged {
        header.judge_run(self.run)?;
        number("start_m", self.start_m, &ERROR_M)?;
        number("closure_m", self.closure_m, &ERROR_M)
    }
}

/// What journals of one kind of machine hold besides how the run went.
pub trait Log: Default {
    /// What a line of it says: an enum that is tagged by the key `entry`.
    type Entry: Serialize + DeserializeOwned;

    /// What a line after the header is called in no other kind's journals.
    const OPENED_BY: &'static [&'static str];

    /// Whether `entry` can follow what was taken.
    ///
    /// # Errors
    /// Naming the first thing that cannot be so.
    fn judge(&self, header: &JournalHeader, entry: &Self::Entry) -> Judged;

    /// Takes what was judged.
    fn take(&mut self, entry: Self::Entry);

    /// Keeps what a continued run goes on from.
    fn keep_whole(&mut self, header: &JournalHeader);
}

/// The log of a journal whose measurements are not needed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AnyLog {
    /// What the first line after the header is called.
    pub opened_by: Option<String>,
}

impl Log for AnyLog {
    type Entry = serde_json::Value;

    const OPENED_BY: &'static [&'static str] = &[];

    fn judge(&self, _: &JournalHeader, _: &Self::Entry) -> Judged {
        Ok(())
    }

    fn take(&mut self, entry: Self::Entry) {
        let name = entry.get("entry").and_then(|it| it.as_str());
        self.opened_by = self.opened_by.take().or(name.map(str::to_owned));
    }

    fn keep_whole(&mut self, _: &JournalHeader) {}
}

/// How a run begins, goes on and ends: the lines of every journal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "entry", rename_all = "snake_case")]
pub(super) enum Mark {
    /// First line.
    Header(Box<JournalHeader>),
    /// The run was continued here after an interruption, at that time (UTC, RFC 3339).
    Resumed { at: String },
    /// The run failed, as the operator was told; what stands before stays valid.
    Failed { cause: String },
    /// The run is complete.
    Complete,
}

const MARKS: [&str; 4] = ["header", "resumed", "failed", "complete"];

enum Line<E> {
    Mark(Mark),
    Entry(E),
}

/// A journal that was read.
#[derive(Clone, Debug, PartialEq)]
pub struct ReadJournal<L> {
    /// What the run is.
    pub header: JournalHeader,
    /// What was measured.
    pub log: L,
    /// Whether the run was finished.
    pub complete: bool,
    /// Why it ended before, as the operator was told, unless it was continued.
    pub failure: Option<String>,
    /// How many bytes are whole lines.
    pub valid_bytes: u64,
    /// Whether a torn line follows them.
    pub torn: bool,
    /// BLAKE3 of the whole file, as it was read.
    pub blake3: String,
}

/// Reads a journal up to its last whole line.
///
/// # Errors
/// When it cannot be read, has no header, a line before the last one is damaged, or one says what
/// cannot be.
pub fn read_journal<L: Log>(path: &Path) -> Result<ReadJournal<L>, StoreError> {
    journal_of(path, open(path)?, |_| {})
}

/// The journal at `path`, to be read in pieces.
fn open(path: &Path) -> Result<impl BufRead, StoreError> {
    let file = open_regular(path, JOURNAL_MAX).map_err(io_error("read", path))?;
    Ok(BufReader::new(file))
}

pub(super) fn read_by<L: Log>(door: &Door, path: &Path) -> Result<ReadJournal<L>, StoreError> {
    let bytes = door.read(path).map_err(io_error("read", path))?;
    journal_of(path, &*bytes, |_| {})
}

/// Reads a journal of whatever kind, and the entry of each whole line of it, marks included: JSON without its
/// checksum, the members in the order in which they were written.
///
/// # Errors
/// Those of [`read_journal`].
pub fn read_entries(path: &Path) -> Result<(ReadJournal<AnyLog>, Vec<String>), StoreError> {
    let mut whole = Vec::new();
    let read = journal_of(path, open(path)?, |json| whole.push(json.to_owned()))?;
    Ok((read, whole))
}

/// Reads a journal line by line, and tells `whole` the JSON of each whole line.
pub(super) fn journal_of<L: Log>(
    path: &Path,
    mut file: impl BufRead,
    mut whole: impl FnMut(&str),
) -> Result<ReadJournal<L>, StoreError> {
    let mut read: Option<ReadJournal<L>> = None;
    let mut hash = blake3::Hasher::new();
    let mut valid_bytes = 0;
    let (mut torn, mut line) = (false, Vec::new());
    for number in 1.. {
        let is_last = next_line(&mut file, &mut line).map_err(io_error("read", path))?;
        if line.is_empty() {
            break;
        }
        hash.update(&line);
        let json = json_of(&line);
        match json.as_deref().map_err(String::clone).and_then(parse_line) {
            Ok(parsed) => {
                valid_bytes += line.len() as u64;
                take(path, number, parsed, &mut read)?;
                whole(&json.unwrap_or_default());
            }
            Err(_) if is_last => torn = true,
            // A hole that a power cut has left: nothing behind it was flushed to the disk.
            Err(_) if line.contains(&0) => {
                torn = true;
                break;
            }
            Err(cause) => {
                return Err(damaged(path, number, &cause));
            }
        }
    }
    let missing = "the header line is missing or incomplete";
    let mut read = read.ok_or_else(|| damaged(path, 1, missing))?;
    (read.valid_bytes, read.torn) = (valid_bytes, torn);
    read.blake3 = hash.finalize().to_hex().to_string();
    Ok(read)
}

fn parse_line<E: DeserializeOwned>(json: &str) -> Result<Line<E>, String> {
    #[derive(Deserialize)]
    struct Tag {
        entry: String,
    }
    let tag: Tag = serde_json::from_str(json).map_err(|error| error.to_string())?;
    let parsed = match MARKS.contains(&tag.entry.as_str()) {
        true => serde_json::from_str(json).map(Line::Mark),
        false => serde_json::from_str(json).map(Line::Entry),
    };
    parsed.map_err(|error| error.to_string())
}

fn take<L: Log>(
    path: &Path,
    line: usize,
    parsed: Line<L::Entry>,
    read: &mut Option<ReadJournal<L>>,
) -> Result<(), StoreError> {
    let Some(read) = read else {
        *read = Some(begin(path, line, parsed)?);
        return Ok(());
    };
    match parsed {
        Line::Mark(Mark::Header(_)) => return Err(damaged(path, line, NO_HEADER)),
        Line::Mark(Mark::Resumed { .. }) => {
            read.complete = false;
            read.failure = None;
            read.log.keep_whole(&read.header);
        }
        Line::Mark(Mark::Failed { cause }) => {
            read.complete = false;
            read.failure = Some(cause);
        }
        Line::Mark(Mark::Complete) => read.complete = true,
        Line::Entry(entry) => {
            let judged = read.log.judge(&read.header, &entry);
            judged.map_err(unsound(path, Some(line)))?;
            read.log.take(entry);
        }
    }
    Ok(())
}

/// The first line must be the header.
fn begin<L: Log>(
    path: &Path,
    line: usize,
    parsed: Line<L::Entry>,
) -> Result<ReadJournal<L>, StoreError> {
    let Line::Mark(Mark::Header(header)) = parsed else {
        return Err(damaged(path, line, NO_HEADER));
    };
    if header.schema_version > SCHEMA_VERSION {
        return Err(StoreError::Newer {
            path: path.to_owned(),
            seen: header.schema_version,
        });
    }
    header.judge().map_err(unsound(path, Some(line)))?;
    Ok(ReadJournal {
        header: *header,
        log: L::default(),
        complete: false,
        failure: None,
        valid_bytes: 0,
        torn: false,
        blake3: String::new(),
    })
}

/// Of a journal that begins otherwise.
const NO_HEADER: &str = "the header must be the first line and the only one";

fn damaged(path: &Path, line: usize, cause: &str) -> StoreError {
    StoreError::Format {
        path: path.to_owned(),
        line,
        cause: cause.into(),
    }
}
