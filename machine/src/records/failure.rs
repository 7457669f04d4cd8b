//! Why something cannot be stored, or what is stored cannot be used.

use std::path::{Path, PathBuf};

use super::disk_failure::DiskFailure;
use super::sound::Unsound;
use super::{SCHEMA_VERSION, short};

/// Why a model cannot be made of what was stored.
pub type ModelError = Box<dyn core::error::Error + Send + Sync>;

/// Why something cannot be stored, or what is stored cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The operating system refused.
    #[error("{}: cannot {action}: {source}{}", path.display(), untouched(action))]
    Io {
        /// What was tried.
        action: &'static str,
        /// With which file.
        path: PathBuf,
        /// Why not.
        source: std::io::Error,
    },
    /// The thread of the records took or did nothing.
    #[error(transparent)]
    Disk(#[from] DiskFailure),
    /// The calibration is in use, which may be lost again.
    #[error(
        "{}: the new calibration is in use; that may not outlast a power cut, since its folder cannot be flushed to \
         disk: {source}. Check the disk, then use it again (`truestage cal activate`)", path.display()
    )]
    UseUnsynced {
        /// Which pointer.
        path: PathBuf,
        /// Why not.
        source: std::io::Error,
    },
    /// It was written whole and has its name, which may be lost again.
    #[error(
        "{}: written whole; it may not outlast a power cut, since its folder cannot be flushed to disk: {source}",
        path.display()
    )]
    Unsynced {
        /// Which file.
        path: PathBuf,
        /// Why not.
        source: std::io::Error,
    },
    /// The bytes are not those that were stored.
    #[error("{}: damaged: its content hashes to {seen}; roll back or calibrate again", path.display())]
    Damaged {
        /// Which file.
        path: PathBuf,
        /// The hash of what is there.
        seen: String,
    },
    /// The bytes are no record of ours.
    #[error("{}: line {line}: not a record of this program: {cause}", path.display())]
    Format {
        /// Which file.
        path: PathBuf,
        /// Counted from 1.
        line: usize,
        /// The parser's words.
        cause: String,
    },
    /// Complete, but with an impossible content.
    #[error(
        "{}: {place}: expected {expected}, seen: {seen}; the file was edited, or another program \
         wrote it, and none of it is used: restore it, or measure again",
        at_line(path, *line)
    )]
    Unsound {
        /// Which file.
        path: PathBuf,
        /// Of a journal, which line, from 1.
        line: Option<usize>,
        /// Which key of it.
        place: String,
        /// What can stand there.
        expected: String,
        /// What does.
        seen: String,
    },
    /// Written by a newer program.
    #[error(
        "{}: written with schema version {seen}, but this program knows version {SCHEMA_VERSION} \
         only; use a newer version of the program", path.display()
    )]
    Newer {
        /// Which file.
        path: PathBuf,
        /// Its version.
        seen: u32,
    },
    /// The calibration belongs to another machine or another set-up of this one.
    #[error(
        "calibration {id}: {what} is `{}` there, but `{}` here; the calibration is refused on this machine: {}",
        brief(expected), brief(seen), instead_of(instead.as_deref())
    )]
    Foreign {
        /// The calibration.
        id: String,
        /// What differs.
        what: &'static str,
        /// What the calibration says.
        expected: Box<str>,
        /// What this machine is.
        seen: Box<str>,
        /// The newest calibration that would fit, if it is known that there is one.
        instead: Option<Box<str>>,
    },
    /// The calibration holds another kind of model than is needed.
    #[error(
        "calibration {id} of axis {axis} is of the kind `{seen}`, but `{expected}` is needed here; \
         calibrate the axis again, or roll back to a calibration of that kind"
    )]
    OtherKind {
        /// The calibration.
        id: String,
        /// Its axis.
        axis: String,
        /// The kind wanted.
        expected: &'static str,
        /// The kind it is.
        seen: String,
    },
    /// Another program uses the machine.
    #[error("the machine is in use by {owner}; stop that program first")]
    Leased {
        /// Who.
        owner: String,
        /// Where the owner can be asked, when it lets others ask.
        places: Vec<String>,
    },
    /// No calibration has this name.
    #[error("no calibration `{id}`; `truestage cal list` shows what there is")]
    Unknown {
        /// What was asked for.
        id: String,
    },
    /// More than one calibration starts like this.
    #[error("the names of {count} calibrations begin with `{id}`; give more digits")]
    Ambiguous {
        /// What was asked for.
        id: String,
        /// How many fit.
        count: usize,
    },
    /// There is nothing to go back to.
    #[error(
        "axis {axis}: no earlier calibration to roll back to; one that makes an axis worse is not gone back to. `truestage \
         cal list` shows all that are stored, `truestage cal activate` uses any of them"
    )]
    NoEarlier {
        /// Which axis.
        axis: String,
    },
    /// The record's values make no model of their kind.
    #[error("calibration {id}: {source}")]
    Model {
        /// The calibration.
        id: String,
        /// Why.
        source: ModelError,
    },
    /// Likewise one part of it.
    #[error("calibration {id}, {name}: {source}")]
    Part {
        /// The calibration.
        id: String,
        /// Which part.
        name: String,
        /// Why.
        source: ModelError,
    },
    /// Nothing is left of the run to be done.
    #[error("{}: this run is complete; start a new one without --resume", path.display())]
    AlreadyComplete {
        /// Which journal.
        path: PathBuf,
    },
    /// The journal cannot be continued.
    #[error("{}: cannot be resumed: {what} was `{expected}` and is now `{seen}`", path.display())]
    NotResumable {
        /// Which journal.
        path: PathBuf,
        /// What differs.
        what: String,
        /// What the journal says.
        expected: String,
        /// What this run would be.
        seen: String,
    },
}

impl StoreError {
    /// The error for calibration `id`, of whose values no model can be made.
    pub fn model(id: &str, source: impl Into<ModelError>) -> Self {
        let (id, source) = (id.to_owned(), source.into());
        Self::Model { id, source }
    }
}

fn at_line(path: &Path, line: Option<usize>) -> String {
    let line = line.map_or_else(String::new, |it| format!(": line {it}"));
    path.display().to_string() + &line
}

pub(super) fn unsound(path: &Path, line: Option<usize>) -> impl FnOnce(Unsound) -> StoreError {
    let path = path.to_owned();
    move |it| StoreError::Unsound {
        path,
        line,
        place: it.place,
        expected: it.expected,
        seen: it.seen,
    }
}

/// What a failed writing leaves.
fn untouched(action: &str) -> &'static str {
    match action {
        // Nothing was to be written.
        "read" | "list" => "",
        _ => "; the files already stored are untouched",
    }
}

/// Digits of a hash.
const HASH: usize = 64;

/// Of a hash as much as tells it from others.
fn brief(value: &str) -> String {
    match value.len() == HASH && value.bytes().all(|it| it.is_ascii_hexdigit()) {
        true => short(value),
        false => value.to_owned(),
    }
}

/// What to do where a calibration is another machine's, or was made with another configuration.
fn instead_of(id: Option<&str>) -> String {
    match id {
        Some(id) => format!(
            "`truestage cal activate` with {} uses the newest one that was made with this configuration; or calibrate \
             again",
            short(id)
        ),
        None => "use one that was made with this configuration (`truestage cal list`), or calibrate again".into(),
    }
}

pub(super) fn io_error(
    action: &'static str,
    path: &Path,
) -> impl FnOnce(std::io::Error) -> StoreError {
    let path = path.to_owned();
    move |source| StoreError::Io {
        action,
        path,
        source,
    }
}
