//! Calibrations: immutable, addressed by their content, activated by a pointer.

use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::record::CalibrationRecord;
use super::{SCHEMA_VERSION, StoreError, io_error, sound, unsound, write_new_or_replace};
use crate::config::MachineSection;

/// Which calibration an axis uses, and which it used before (oldest first).
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ActivePointer {
    /// Of this struct.
    pub schema_version: u32,
    /// The calibration in use.
    pub current: Option<String>,
    /// Those in use before.
    pub history: Vec<String>,
}

/// One machine's folder.
#[derive(Clone, Debug)]
pub struct Store {
    root: PathBuf,
}

impl Store {
    /// The store of `machine` below `data_dir`.
    pub fn new(data_dir: &Path, machine: &str) -> Self {
        Self {
            root: data_dir.join(machine),
        }
    }

    /// The store of the machine that a configuration describes.
    pub fn of(machine: &MachineSection) -> Self {
        Self::new(&machine.data_dir, &machine.name)
    }

    /// The machine's folder.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// The newest journal of `verb` on `axis`; their names begin with the time.
    ///
    /// # Errors
    /// When the folder cannot be read; a missing one is an empty one.
    pub fn newest_run(&self, verb: &str, axis: &str) -> Result<Option<PathBuf>, StoreError> {
        let part = format!("-{verb}-{axis}-");
        let mut names = list_folder(&self.runs())?;
        names.retain(|name| name.contains(&part) && name.ends_with(".jsonl"));
        Ok(names.into_iter().max().map(|name| self.runs().join(name)))
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
    pub fn save(&self, record: &CalibrationRecord) -> Result<String, StoreError> {
        let bytes = record.bytes();
        let id = blake3::hash(&bytes).to_hex().to_string();
        write_new_or_replace(&self.calibration_path(&id), &bytes)?;
        Ok(id)
    }

    /// Reads calibration `id` and checks that its bytes are those that were stored, and that what it
    /// says can be so.
    ///
    /// # Errors
    /// When it is not there, damaged, written by a newer program, or says what cannot be.
    pub fn load(&self, id: &str) -> Result<CalibrationRecord, StoreError> {
        let path = self.calibration_path(id);
        let bytes = fs::read(&path).map_err(io_error("read", &path))?;
        let seen = blake3::hash(&bytes).to_hex().to_string();
        if seen != id {
            return Err(StoreError::Damaged { path, seen });
        }
        let record = parse_versioned(&path, &bytes)?;
        sound::record(&record).map_err(unsound(&path, None))?;
        Ok(record)
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
        let mut names: Vec<_> = list_folder(&self.root.join("calibrations"))?
            .into_iter()
            .filter_map(|name| Some(name.strip_suffix(".json")?.to_owned()))
            .collect();
        names.sort_unstable();
        Ok(names)
    }

    /// The store that the journal at `path` lies in, by its place; `None` when it lies elsewhere.
    pub fn of_journal(path: &Path) -> Option<Self> {
        let runs = path.parent()?;
        let is_store = runs.file_name()? == "runs";
        let root = runs.parent()?.to_owned();
        is_store.then_some(Self { root })
    }

    /// The calibrations that were made from the journal called `source`, with their names; what
    /// cannot be read is passed over.
    ///
    /// # Errors
    /// When the folder cannot be read.
    pub fn made_from(&self, source: &str) -> Result<Vec<(String, CalibrationRecord)>, StoreError> {
        let records = self.list()?.into_iter().filter_map(|id| {
            let record = self.load(&id).ok()?;
            (record.head.source == source).then_some((id, record))
        });
        Ok(records.collect())
    }

    /// What `axis` uses.
    ///
    /// # Errors
    /// When the pointer is there but cannot be read.
    pub fn active(&self, axis: &str) -> Result<ActivePointer, StoreError> {
        let path = self.pointer_path(axis);
        match fs::read(&path) {
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
        self.load(id)?;
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
        self.load(&earlier)?;
        Ok(earlier)
    }

    /// Takes the calibration of `axis` out of use: the one before is used again, or none.
    /// Returns its name. What cannot be loaded is passed over.
    ///
    /// # Errors
    /// When the pointer cannot be read or written.
    pub fn retire(&self, axis: &str) -> Result<Option<String>, StoreError> {
        let mut pointer = self.active(axis)?;
        pointer.current = None;
        while let (None, Some(earlier)) = (&pointer.current, pointer.history.pop()) {
            pointer.current = Some(earlier).filter(|id| self.load(id).is_ok());
        }
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
        write_new_or_replace(path, html.as_bytes())
    }

    fn write_pointer(&self, axis: &str, pointer: &ActivePointer) -> Result<(), StoreError> {
        let bytes = serde_json::to_vec_pretty(pointer).expect("plain data always serialises");
        write_new_or_replace(&self.pointer_path(axis), &bytes)
    }
}

/// The names in a folder; a missing folder is an empty one.
fn list_folder(folder: &Path) -> Result<Vec<String>, StoreError> {
    let entries = match fs::read_dir(folder) {
        Ok(entries) => entries,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
        Err(error) => return Err(io_error("list", folder)(error)),
    };
    let mut names = Vec::new();
    for entry in entries {
        let entry = entry.map_err(io_error("list", folder))?;
        names.push(entry.file_name().to_string_lossy().into_owned());
    }
    Ok(names)
}

fn parse_versioned<T: for<'de> Deserialize<'de>>(
    path: &Path,
    bytes: &[u8],
) -> Result<T, StoreError> {
    #[derive(Deserialize)]
    struct Version {
        schema_version: u32,
    }
    let format = |error: serde_json::Error| StoreError::Format {
        path: path.to_owned(),
        line: error.line(),
        cause: error.to_string(),
    };
    let version: Version = serde_json::from_slice(bytes).map_err(format)?;
    if version.schema_version > SCHEMA_VERSION {
        return Err(StoreError::Newer {
            path: path.to_owned(),
            seen: version.schema_version,
        });
    }
    serde_json::from_slice(bytes).map_err(format)
}

#[cfg(test)]
mod tests {
    use super::super::record::tests::record;
    use super::*;

    fn store() -> (tempfile::TempDir, Store) {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::new(folder.path(), "m");
        (folder, store)
    }

    #[test]
    fn a_calibration_is_found_again_by_the_beginning_of_its_name() {
        let (_folder, store) = store();
        let id = store.save(&record("A")).unwrap();
        assert_eq!(store.resolve(&id[..6]).unwrap(), id);
        assert_eq!(store.load(&id).unwrap(), record("A"));
        let stored = store.load(&id).unwrap();
        let table = stored.linear(&id).unwrap().table(&id).unwrap();
        assert_eq!(table.nodes().len(), 2);
        assert!(matches!(
            store.resolve("zz"),
            Err(StoreError::Unknown { .. })
        ));
    }

    #[test]
    fn any_flipped_byte_is_found() {
        let (_folder, store) = store();
        let id = store.save(&record("A")).unwrap();
        let path = store.calibration_path(&id);
        let good = fs::read(&path).unwrap();
        for at in 0..good.len() {
            let mut bad = good.clone();
            bad[at] ^= 0x04;
            fs::write(&path, &bad).unwrap();
            assert!(
                matches!(store.load(&id), Err(StoreError::Damaged { .. })),
                "byte {at}"
            );
        }
        fs::write(&path, &good[..good.len() / 2]).unwrap();
        assert!(matches!(store.load(&id), Err(StoreError::Damaged { .. })));
    }

    #[test]
    fn rollback_returns_to_the_one_before() {
        let (_folder, store) = store();
        let first = store.save(&record("A")).unwrap();
        let second = store.save(&record("B")).unwrap();
        assert!(matches!(
            store.rollback("x"),
            Err(StoreError::NoEarlier { .. })
        ));
        store.activate("x", &first).unwrap();
        store.activate("x", &second).unwrap();
        assert_eq!(store.active("x").unwrap().current, Some(second));
        assert_eq!(store.rollback("x").unwrap(), first);
        assert_eq!(store.active("x").unwrap().current, Some(first));
    }

    #[test]
    fn a_file_from_a_newer_program_is_refused() {
        let (_folder, store) = store();
        let path = store.pointer_path("x");
        write_new_or_replace(&path, br#"{"schema_version":2,"future":1}"#).unwrap();
        assert!(matches!(
            store.active("x"),
            Err(StoreError::Newer { seen: 2, .. })
        ));
    }
}
