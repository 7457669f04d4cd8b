//! Runs that were stopped, and go on with `--resume`.

use std::path::{Path, PathBuf};

use machine::records::{AnyLog, Store, read_journal};

use crate::Failure;
use crate::program::NEWEST_RUN;

/// The journal named, or, for a bare `--resume`, the newest incomplete one of this axis.
pub(crate) fn journal_to_resume(
    resume: Option<&PathBuf>,
    store: &Store,
    verb: &str,
    axis: &str,
) -> Result<Option<PathBuf>, Failure> {
    let Some(path) = resume else { return Ok(None) };
    if path.extension().is_some_and(|it| it == "toml") {
        return Err(Failure::Usage {
            what: format!("--resume {}: this is not a journal", path.display()),
            help: format!(
                "write the configuration first: truestage {verb} {} --resume",
                path.display()
            ),
        });
    }
    if path.as_os_str() != NEWEST_RUN {
        return Ok(Some(path.clone()));
    }
    match store.interrupted_run(verb, axis)? {
        Some(found) => Ok(Some(found.journal)),
        None => Err(Failure::Usage {
            what: format!("axis {axis} has no interrupted {verb} run"),
            help: "start a new one without --resume".into(),
        }),
    }
}

/// Runs what writes a journal of `verb` on `axis`. When it is stopped, or a device or the disk fails, says how it goes
/// on.
pub(crate) fn resumable<R>(
    store: &Store,
    verb: &str,
    axis: &str,
    resumed: Option<&Path>,
    run: impl FnOnce() -> Result<R, Failure>,
) -> Result<R, Failure> {
    let before = store.newest_run(verb, axis)?;
    run().map_err(|failure| {
        let begun = || {
            store
                .newest_run(verb, axis)
                .ok()?
                .filter(|it| Some(it) != before.as_ref())
        };
        match resumed.map(Path::to_owned).or_else(begun) {
            Some(journal) if goes_on(&failure, &journal) => Failure::Resumable {
                source: Box::new(failure),
                journal,
            },
            _ => failure,
        }
    })
}

/// Whether the run of `journal` goes on once the cause of `failure` is gone. What refuses the measured values refuses
/// them again.
fn goes_on(failure: &Failure, journal: &Path) -> bool {
    let is_incomplete = || read_journal::<AnyLog>(journal).is_ok_and(|read| !read.complete);
    let is_file = matches!(failure, Failure::File { .. });
    // A run whose measurement is complete is stored by the one that goes on.
    let is_kept = failure.is_stop() || failure.is_of_disk();
    is_kept || (is_file || failure.stops_the_machine()) && is_incomplete()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    fn store() -> (tempfile::TempDir, Store) {
        let folder = tempfile::tempdir().unwrap();
        let store = crate::stores::store_in(folder.path(), "m");
        fs::create_dir_all(store.runs()).unwrap();
        fs::write(store.runs().join("20200101-calibrate-x-00.jsonl"), "").unwrap();
        (folder, store)
    }

    fn stopped(store: &Store, begins: bool, failure: Failure) -> String {
        let run = || {
            if begins {
                fs::write(store.runs().join("20200102-calibrate-x-00.jsonl"), "").unwrap();
            }
            Err::<(), _>(failure)
        };
        let failed = resumable(store, "calibrate", "x", None, run).unwrap_err();
        failed.to_string()
    }

    #[test]
    fn a_run_that_somebody_stops_says_how_it_goes_on() {
        let (_folder, store) = store();
        let said = stopped(
            &store,
            true,
            Failure::Machine(machine::Failure::Interrupted),
        );
        assert!(said.contains("20200102-calibrate-x-00.jsonl"), "{said}");
        assert!(said.contains("--resume"), "{said}");
    }

    #[test]
    fn where_nothing_was_begun_or_something_failed_nothing_is_promised() {
        let (_folder, store) = self::store();
        let said = stopped(
            &store,
            false,
            Failure::Machine(machine::Failure::Interrupted),
        );
        assert!(!said.contains("--resume"), "{said}");
        let said = stopped(&store, true, Failure::ScanMismatch { wrong: 1 });
        assert!(!said.contains("--resume"), "{said}");
    }

    #[test]
    fn a_run_that_the_disk_ends_goes_on() {
        let (_folder, store) = store();
        let source = std::io::Error::from_raw_os_error(28);
        let full = machine::records::StoreError::Unsynced {
            path: "x".into(),
            source,
        };
        let said = stopped(&store, true, full.into());
        assert!(said.contains("--resume"), "{said}");
        let hangs = machine::records::DiskFailure::Behind { waiting: 7 };
        let said = stopped(&store, true, machine::Failure::from(hangs).into());
        assert!(said.contains("--resume"), "{said}");
    }

    #[test]
    fn a_run_that_was_continued_is_continued_again() {
        let (_folder, store) = store();
        let journal = store.runs().join("20200101-calibrate-x-00.jsonl");
        let run = || {
            Err::<(), _>(Failure::Machine(machine::Failure::Terminated {
                signal: 15,
            }))
        };
        let failed = resumable(&store, "calibrate", "x", Some(&journal), run).unwrap_err();
        assert_eq!(failed.exit_code(), 143);
        assert!(failed.to_string().contains("20200101"), "{failed}");
    }
}
