//! Calibrations: immutable, addressed by their content, activated by a pointer.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::Deserialize;

use super::content::{CalibrationRecord, Content, ContentKind, Glance};
use super::door::Door;
use super::files::Files;
use super::pointer::ActivePointer;
use super::run_name::RunName;
use super::{SCHEMA_VERSION, StoreError, io_error, short, unsound};

/// One machine's folder.
///
/// # Example
///
/// ```
/// use machine::records::sound::{Judged, counted};
/// use machine::records::{CalibrationRecord, Content, ContentKind, RecordHead, Store};
/// use serde::{Deserialize, Serialize};
///
/// #[derive(Debug, PartialEq, Serialize, Deserialize)]
/// struct Note {
///     lines: usize,
/// }
///
/// impl Content for Note {
///     const KIND: &'static str = "note";
///
///     fn summary(&self) -> String {
///         format!("{} lines", self.lines)
///     }
///
///     fn judge(&self) -> Judged {
///         counted("lines", self.lines, 1..=10)
///     }
/// }
///
/// let folder = tempfile::tempdir()?;
/// let store = Store::new(folder.path(), "stage", const { &[ContentKind::of::<Note>()] });
/// let head = RecordHead { schema_version: 1, axis: "x".into(), ..RecordHead::default() };
/// let id = store.save(&CalibrationRecord { head, content: Note { lines: 2 } })?;
/// assert_eq!(store.resolve(&id[..6])?, id, "the beginning of its name is enough");
/// assert_eq!(store.glance(&id)?.summary, "2 lines");
/// store.activate("x", &id)?;
/// assert_eq!(store.active("x")?.current, Some(id));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Store {
    pub(super) root: PathBuf,
    kinds: &'static [ContentKind],
    pub(super) door: Door,
}

impl Store {
    /// The store of `machine` below `data_dir`, in which calibrations of these `kinds` may lie.
    pub fn new(data_dir: &Path, machine: &str, kinds: &'static [ContentKind]) -> Self {
        Self {
            root: data_dir.join(machine),
            kinds,
            door: Door::of_system(),
        }
    }

    /// The same store in these `files`.
    #[must_use]
    pub fn in_files(self, files: Arc<dyn Files>) -> Self {
        self.through(Door::Direct(files))
    }

    pub(super) fn through(&self, door: Door) -> Self {
        Self {
            door,
            ..self.clone()
        }
    }

    /// The machine's folder.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// The file names of all run journals, in no order.
    ///
    /// # Errors
    /// When the folder cannot be read; a missing one is an empty one.
    pub fn journals(&self) -> Result<Vec<String>, StoreError> {
        let mut names = self.list_folder(&self.runs())?;
        names.retain(|name| name.ends_with(".jsonl"));
        Ok(names)
    }

    /// The newest journal of `verb` on `axis`. Their names are in the order in which they were begun, also where the
    /// clock was set back meanwhile.
    ///
    /// # Errors
    /// When the folder cannot be read; a missing one is an empty one.
    pub fn newest_run(&self, verb: &str, axis: &str) -> Result<Option<PathBuf>, StoreError> {
        let names = self.journals()?;
        let newest = names
            .into_iter()
            .filter_map(|name| Some((RunName::parse(&name, verb, axis)?, name)))
            .max();
        Ok(newest.map(|(_, name)| self.runs().join(name)))
    }

    /// The folder of the run journals.
    pub fn runs(&self) -> PathBuf {
        self.root.join("runs")
    }

    /// The folder of the reports.
    pub fn reports(&self) -> PathBuf {
        self.root.join("reports")
    }

    /// Where calibration `id` is stored.
    pub fn calibration_path(&self, id: &str) -> PathBuf {
        self.root.join("calibrations").join(format!("{id}.json"))
    }

    fn pointer_path(&self, axis: &str) -> PathBuf {
        self.root.join("active").join(format!("{axis}.json"))
    }

    /// Stores `record` and returns its name, the BLAKE3 of its bytes.
    ///
    /// # Errors
    /// When it cannot be written; nothing stored before is touched.
    pub fn save<C: Content>(&self, record: &CalibrationRecord<C>) -> Result<String, StoreError> {
        let bytes = record.bytes();
        let id = blake3::hash(&bytes).to_hex().to_string();
        self.door.replace(&self.calibration_path(&id), bytes)?;
        Ok(id)
    }

    /// Reads calibration `id` and checks that its bytes are those that were stored, and that what it
    /// says can be so.
    ///
    /// # Errors
    /// When it is not there, damaged, written by a newer program, of another kind, or says what
    /// cannot be.
    pub fn load<C: Content>(&self, id: &str) -> Result<CalibrationRecord<C>, StoreError> {
        let (path, bytes) = self.bytes(id)?;
        let tag: Tag = parse_versioned(&path, &bytes)?;
        if tag.kind != C::KIND {
            return Err(StoreError::OtherKind {
                id: short(id),
                axis: tag.axis,
                expected: C::KIND,
                seen: tag.kind,
            });
        }
        let record: CalibrationRecord<C> =
            serde_json::from_slice(&bytes).map_err(format_error(&path))?;
        record.judge().map_err(unsound(&path, None))?;
        Ok(record)
    }

    /// Likewise, when its kind is not known.
    ///
    /// # Errors
    /// As [`Store::load`]; when this store knows no such kind.
    pub fn glance(&self, id: &str) -> Result<Glance, StoreError> {
        let (path, bytes) = self.bytes(id)?;
        let tag: Tag = parse_versioned(&path, &bytes)?;
        let kind = self.kinds.iter().find(|it| it.name == tag.kind);
        let kind = kind.ok_or_else(|| StoreError::Format {
            path: path.clone(),
            line: 1,
            cause: format!("no kind of calibration is called `{}`", tag.kind),
        })?;
        let (glance, judged) = (kind.parse)(&bytes).map_err(format_error(&path))?;
        judged.map_err(unsound(&path, None))?;
        Ok(glance)
    }

    /// Where calibration `id` is, and its bytes, if they are those that were stored.
    fn bytes(&self, id: &str) -> Result<(PathBuf, Vec<u8>), StoreError> {
        let path = self.calibration_path(id);
        let bytes = self.door.read(&path).map_err(io_error("read", &path))?;
        let seen = blake3::hash(&bytes).to_hex().to_string();
        if seen != id {
            return Err(StoreError::Damaged { path, seen });
        }
        Ok((path, bytes))
    }

    /// The full name of the one calibration that begins with `prefix`.
    ///
    /// # Errors
    /// When none or several do.
    pub fn resolve(&self, prefix: &str) -> Result<String, StoreError> {
        let mut fitting = self.list()?;
        fitting.retain(|id| id.starts_with(prefix));
        match fitting.len() {
            0 => Err(StoreError::Unknown {
                id: prefix.to_owned(),
            }),
            1 => Ok(fitting.swap_remove(0)),
            count => Err(StoreError::Ambiguous {
                id: prefix.to_owned(),
                count,
            }),
        }
    }

    /// The names of all calibrations, sorted.
    ///
    /// # Errors
    /// When the folder cannot be read; a missing one is an empty one.
    pub fn list(&self) -> Result<Vec<String>, StoreError> {
        let mut names: Vec<_> = self
            .list_folder(&self.root.join("calibrations"))?
            .into_iter()
            .filter_map(|name| Some(name.strip_suffix(".json")?.to_owned()))
            .collect();
        names.sort_unstable();
        Ok(names)
    }

    /// The store that the journal at `path` lies in, by its place; `None` when it lies elsewhere.
    pub fn of_journal(path: &Path, kinds: &'static [ContentKind]) -> Option<Self> {
        let runs = path.parent()?;
        let is_store = runs.file_name()? == "runs";
        let root = runs.parent()?.to_owned();
        let door = Door::of_system();
        is_store.then_some(Self { root, kinds, door })
    }

    /// The calibrations of a kind that were made from the journal called `source`, with their names;
    /// what cannot be read is passed over.
    ///
    /// # Errors
    /// When the folder cannot be read.
    pub fn made_from<C: Content>(
        &self,
        source: &str,
    ) -> Result<Vec<(String, CalibrationRecord<C>)>, StoreError> {
        let records = self.list()?.into_iter().filter_map(|id| {
            let record = self.load(&id).ok()?;
            (record.head.source == source).then_some((id, record))
        });
        Ok(records.collect())
    }

    /// Likewise of every kind.
    ///
    /// # Errors
    /// As [`Store::made_from`].
    pub fn glances_from(&self, source: &str) -> Result<Vec<(String, Glance)>, StoreError> {
        let glances = self.list()?.into_iter().filter_map(|id| {
            let glance = self.glance(&id).ok()?;
            (glance.head.source == source).then_some((id, glance))
        });
        Ok(glances.collect())
    }

    /// What `axis` uses.
    ///
    /// # Errors
    /// When the pointer is there but cannot be read.
    pub fn active(&self, axis: &str) -> Result<ActivePointer, StoreError> {
        let path = self.pointer_path(axis);
        match self.door.read(&path) {
            Ok(bytes) => parse_versioned(&path, &bytes),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(ActivePointer {
                schema_version: SCHEMA_VERSION,
                ..ActivePointer::default()
            }),
            Err(error) => Err(io_error("read", &path)(error)),
        }
    }

    /// Makes `id` the calibration of `axis`; the one before stays in the history.
    ///
    /// # Errors
    /// When `id` cannot be loaded or the pointer cannot be written.
    pub fn activate(&self, axis: &str, id: &str) -> Result<(), StoreError> {
        self.glance(id)?;
        let mut pointer = self.active(axis)?;
        pointer
            .history
            .extend(pointer.current.take().filter(|current| current != id));
        pointer.current = Some(id.to_owned());
        self.write_pointer(axis, &pointer)
    }

    /// Goes back to the calibration used before; returns its name.
    ///
    /// # Errors
    /// When there is none, or it cannot be loaded.
    pub fn rollback(&self, axis: &str) -> Result<String, StoreError> {
        let earlier = self.earlier(axis)?;
        let mut pointer = self.active(axis)?;
        pointer.history.pop();
        pointer.current = Some(earlier.clone());
        self.write_pointer(axis, &pointer)?;
        Ok(earlier)
    }

    /// The name of the calibration that [`Store::rollback`] would go back to.
    ///
    /// # Errors
    /// When there is none, or it cannot be loaded.
    pub fn earlier(&self, axis: &str) -> Result<String, StoreError> {
        let mut pointer = self.active(axis)?;
        let earlier = pointer.history.pop().ok_or_else(|| StoreError::NoEarlier {
            axis: axis.to_owned(),
        })?;
        self.glance(&earlier)?;
        Ok(earlier)
    }

    /// Takes the calibration of `axis` out of use: the one before is used again, or none.
    /// Returns its name. What cannot be loaded is passed over.
    ///
    /// # Errors
    /// When the pointer cannot be read or written.
    pub fn retire(&self, axis: &str) -> Result<Option<String>, StoreError> {
        self.retire_to(axis, |_| true)
    }

    /// Likewise, passing over what is not `usable` now. Where nothing is, all of it stays in the history: it can be
    /// gone back to once it is usable again.
    ///
    /// # Errors
    /// As [`Store::retire`].
    pub fn retire_to(
        &self,
        axis: &str,
        mut usable: impl FnMut(&str) -> bool,
    ) -> Result<Option<String>, StoreError> {
        let mut pointer = self.active(axis)?;
        let mut is_good = |id: &String| self.glance(id).is_ok() && usable(id);
        let newest = pointer.history.iter().rposition(&mut is_good);
        pointer.current = newest.and_then(|at| pointer.history.drain(at..).next());
        self.write_pointer(axis, &pointer)?;
        Ok(pointer.current)
    }

    /// Uses nothing under `axis` any more; what was in use stays in the history. Returns its name.
    ///
    /// # Errors
    /// When the pointer cannot be read or written.
    pub fn put_out_of_use(&self, axis: &str) -> Result<Option<String>, StoreError> {
        let mut pointer = self.active(axis)?;
        let before = pointer.current.take();
        pointer.history.extend(before.clone());
        self.write_pointer(axis, &pointer)?;
        Ok(before)
    }

    /// Writes a page for people.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn write_report(&self, path: &Path, html: &str) -> Result<(), StoreError> {
        self.door.replace(path, html.as_bytes().to_vec())
    }

    fn write_pointer(&self, axis: &str, pointer: &ActivePointer) -> Result<(), StoreError> {
        let bytes = serde_json::to_vec_pretty(pointer).expect("plain data always serialises");
        self.door.replace_pointer(&self.pointer_path(axis), bytes)
    }

    /// The names in a folder; a missing folder is an empty one.
    fn list_folder(&self, folder: &Path) -> Result<Vec<String>, StoreError> {
        let names = match self.door.list(folder) {
            Ok(names) => names,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
            Err(error) => return Err(io_error("list", folder)(error)),
        };
        let names = names.iter().map(|name| name.to_string_lossy().into_owned());
        Ok(names.collect())
    }
}

/// Of which kind a calibration is, and of which axis.
#[derive(Deserialize)]
struct Tag {
    kind: String,
    axis: String,
}

fn parse_versioned<T: for<'de> Deserialize<'de>>(
    path: &Path,
    bytes: &[u8],
) -> Result<T, StoreError> {
    #[derive(Deserialize)]
    struct Version {
        schema_version: u32,
    }
    let version: Version = serde_json::from_slice(bytes).map_err(format_error(path))?;
    if version.schema_version > SCHEMA_VERSION {
        return Err(StoreError::Newer {
            path: path.to_owned(),
            seen: version.schema_version,
        });
    }
    serde_json::from_slice(bytes).map_err(format_error(path))
}

fn format_error(path: &Path) -> impl Fn(serde_json::Error) -> StoreError {
    let path = path.to_owned();
    move |error| StoreError::Format {
        path: path.clone(),
        line: error.line(),
        cause: error.to_string(),
    }
}

#[cfg(test)]
mod tests;
