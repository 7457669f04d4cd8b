//! Calibrations: immutable, addressed by their content, activated by a pointer.

use std::fs;
use std::path::{Path, PathBuf};

use compensator::error_table::{ErrorTable, Node};
use drivers::device::{Environment, Identity};
use serde::{Deserialize, Serialize};
use units::Metres;

use super::{SCHEMA_VERSION, StoreError, io_error, write_new_or_replace};

/// One calibration of one axis: a signed statement of what was measured, with what, when,
/// on which machine, and how well.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CalibrationRecord {
    /// Of this struct.
    pub schema_version: u32,
    /// What kind of model it is: `linear_error_table`.
    pub kind: String,
    /// The machine's name.
    pub machine: String,
    /// The stage's serial number.
    pub stage_serial: String,
    /// BLAKE3 of what a calibration depends on in the configuration.
    pub config_hash: String,
    /// Which axis.
    pub axis: String,
    /// Who the drive was.
    pub drive: IdentityRecord,
    /// One encoder count, metres.
    pub resolution_m: f64,
    /// When, UTC, RFC 3339.
    pub created: String,
    /// The program that made it.
    pub program: String,
    /// The run journal or data file it was made from.
    pub source: String,
    /// What measured, and which corrections its readings got.
    pub instrument: InstrumentRecord,
    /// Means over the run, where known.
    pub environment: EnvironmentRecord,
    /// How many runs.
    pub runs: u32,
    /// Difference of the same place measured first and last, metres, where measured.
    pub closure_m: Option<f64>,
    /// Mean lost motion (reverse − forward), metres, where both approaches were measured.
    pub lost_motion_m: Option<f64>,
    /// Its standard uncertainty, metres.
    pub lost_motion_u_m: Option<f64>,
    /// Deviation (actual − target) at each calibrated position.
    pub nodes: Vec<NodeRecord>,
}

/// The identity of a device.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(
    missing_docs,
    reason = "the fields of objects 0x1000, 0x1018 and 0x1008"
)]
pub struct IdentityRecord {
    pub device_type: u32,
    pub vendor: u32,
    pub product: u32,
    pub revision: u32,
    pub serial: u32,
    pub name: String,
}

impl From<&Identity> for IdentityRecord {
    fn from(identity: &Identity) -> Self {
        Self {
            device_type: identity.device_type,
            vendor: identity.vendor,
            product: identity.product,
            revision: identity.revision,
            serial: identity.serial,
            name: identity.name.clone(),
        }
    }
}

/// What measured, and how its readings were corrected.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "the names say which correction was on")]
pub struct InstrumentRecord {
    pub name: String,
    pub identity: String,
    pub air_corrected: bool,
    pub material_corrected: bool,
    pub dead_path_corrected: bool,
    pub cosine_corrected: bool,
    pub standard_uncertainty_m: f64,
}

/// The environment, SI (temperatures in °C); `None` where no sensor said.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "the names carry the units")]
pub struct EnvironmentRecord {
    pub air_temperature_c: Option<f64>,
    pub material_temperature_c: Option<f64>,
    pub pressure_pa: Option<f64>,
    pub relative_humidity: Option<f64>,
}

impl From<&Environment> for EnvironmentRecord {
    fn from(environment: &Environment) -> Self {
        Self {
            air_temperature_c: environment.air_temperature.map(|it| it.value()),
            material_temperature_c: environment.material_temperature.map(|it| it.value()),
            pressure_pa: environment.pressure.map(|it| it.value()),
            relative_humidity: environment.humidity.map(|it| it.value()),
        }
    }
}

/// One calibrated position, metres.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "the names carry quantity and unit")]
pub struct NodeRecord {
    pub position_m: f64,
    pub forward_m: Option<f64>,
    pub reverse_m: Option<f64>,
    pub forward_u_m: Option<f64>,
    pub reverse_u_m: Option<f64>,
}

impl CalibrationRecord {
    /// The nodes of `table` as they are stored.
    pub fn nodes_of(table: &ErrorTable) -> Vec<NodeRecord> {
        let metres = |value: Option<Metres>| value.map(Metres::value);
        table
            .nodes()
            .iter()
            .map(|node| NodeRecord {
                position_m: node.position.value(),
                forward_m: metres(node.forward),
                reverse_m: metres(node.reverse),
                forward_u_m: metres(node.u_forward),
                reverse_u_m: metres(node.u_reverse),
            })
            .collect()
    }

    /// The error table this record holds.
    ///
    /// # Errors
    /// When its nodes make no table.
    pub fn table(&self, id: &str) -> Result<ErrorTable, StoreError> {
        let nodes = self
            .nodes
            .iter()
            .map(|node| Node {
                position: Metres(node.position_m),
                forward: node.forward_m.map(Metres),
                reverse: node.reverse_m.map(Metres),
                u_forward: node.forward_u_m.map(Metres),
                u_reverse: node.reverse_u_m.map(Metres),
            })
            .collect();
        ErrorTable::new(nodes).map_err(|source| StoreError::Table {
            id: id.to_owned(),
            source,
        })
    }

    fn bytes(&self) -> Vec<u8> {
        let mut bytes = serde_json::to_vec_pretty(self).expect("plain data always serialises");
        bytes.push(b'\n');
        bytes
    }

    /// Whether this record belongs to `here`.
    ///
    /// # Errors
    /// Naming the first thing that differs.
    pub fn belongs_to(&self, id: &str, here: &Self) -> Result<(), StoreError> {
        // A table measured elsewhere may not know the drive's serial number (0 in 0x1018:04).
        let serial_known = self.drive.serial != 0;
        let drive = |record: &Self| {
            let it = &record.drive;
            let product = format!("{:#X}:{:#X}", it.vendor, it.product);
            if serial_known {
                format!("{product} serial {}", it.serial)
            } else {
                product
            }
        };
        let comparisons = [
            ("the kind of model", self.kind.clone(), here.kind.clone()),
            (
                "the stage's serial number",
                self.stage_serial.clone(),
                here.stage_serial.clone(),
            ),
            ("the axis", self.axis.clone(), here.axis.clone()),
            ("the drive", drive(self), drive(here)),
            (
                "one encoder count (m)",
                self.resolution_m.to_string(),
                here.resolution_m.to_string(),
            ),
            (
                "the configuration's hash",
                self.config_hash.clone(),
                here.config_hash.clone(),
            ),
        ];
        for (what, expected, seen) in comparisons {
            if expected != seen {
                return Err(StoreError::Foreign {
                    id: short(id),
                    what,
                    expected,
                    seen,
                });
            }
        }
        Ok(())
    }
}

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

    /// Reads calibration `id` and checks that its bytes are those that were stored.
    ///
    /// # Errors
    /// When it is not there, damaged, or written by a newer program.
    pub fn load(&self, id: &str) -> Result<CalibrationRecord, StoreError> {
        let path = self.calibration_path(id);
        let bytes = fs::read(&path).map_err(io_error("read", &path))?;
        let seen = blake3::hash(&bytes).to_hex().to_string();
        if seen != id {
            return Err(StoreError::Damaged { path, seen });
        }
        parse_versioned(&path, &bytes)
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
        let mut pointer = self.active(axis)?;
        let earlier = pointer.history.pop().ok_or_else(|| StoreError::NoEarlier {
            axis: axis.to_owned(),
        })?;
        self.load(&earlier)?;
        pointer.current = Some(earlier.clone());
        self.write_pointer(axis, &pointer)?;
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

/// A calibration's name, short enough to read.
pub fn short(id: &str) -> String {
    id.chars().take(12).collect()
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
    use super::*;

    fn record(serial: &str) -> CalibrationRecord {
        let node = |position_m| NodeRecord {
            position_m,
            forward_m: Some(1e-6),
            reverse_m: Some(2e-6),
            forward_u_m: Some(1e-8),
            reverse_u_m: Some(1e-8),
        };
        CalibrationRecord {
            schema_version: SCHEMA_VERSION,
            kind: "linear_error_table".into(),
            machine: "m".into(),
            stage_serial: serial.into(),
            config_hash: "h".into(),
            axis: "x".into(),
            drive: IdentityRecord {
                vendor: 1,
                serial: 7,
                ..IdentityRecord::default()
            },
            resolution_m: 1e-8,
            created: "2026-01-01T00:00:00Z".into(),
            program: "test".into(),
            source: "run".into(),
            instrument: InstrumentRecord::default(),
            environment: EnvironmentRecord::default(),
            runs: 3,
            closure_m: None,
            lost_motion_m: None,
            lost_motion_u_m: None,
            nodes: vec![node(0.0), node(0.003)],
        }
    }

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
        assert_eq!(
            store.load(&id).unwrap().table(&id).unwrap().nodes().len(),
            2
        );
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
    fn a_calibration_of_another_stage_or_drive_is_foreign() {
        let mine = record("A");
        let mut other = record("B");
        assert!(mine.belongs_to("id", &mine).is_ok());
        let error = mine.belongs_to("id", &other).unwrap_err().to_string();
        assert!(
            error.contains("serial number") && error.contains("`A`"),
            "{error}"
        );
        other = record("A");
        other.drive.serial = 8;
        let error = mine.belongs_to("id", &other).unwrap_err().to_string();
        assert!(error.contains("the drive"), "{error}");
        other = record("A");
        other.kind = "rotary".into();
        assert!(mine.belongs_to("id", &other).is_err());
    }

    #[test]
    fn a_table_measured_elsewhere_fits_the_drive_whose_serial_number_nobody_wrote_down() {
        let machine = record("A");
        let mut elsewhere = record("A");
        elsewhere.drive.serial = 0;
        assert!(elsewhere.belongs_to("id", &machine).is_ok());
        elsewhere.drive.vendor = 2;
        assert!(elsewhere.belongs_to("id", &machine).is_err());
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
