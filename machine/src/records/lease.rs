//! A machine is used by one program at a time.

use core::time::Duration;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::PathBuf;
use std::thread;

use nix::fcntl::{Flock, FlockArg};

use super::{Store, StoreError, io_error};

/// The right to use a machine; given back when dropped, or by the kernel when the process dies.
///
/// # Example
///
/// ```
/// use machine::records::{Lease, Store, StoreError};
///
/// let folder = tempfile::tempdir()?;
/// let store = Store::new(folder.path(), "stage", &[]);
/// let lease = Lease::take(&store, "calibrate")?;
/// let second = Lease::take(&store, "move");
/// assert!(matches!(second, Err(StoreError::Leased { owner, .. }) if owner.contains("calibrate")));
/// drop(lease);
/// Lease::take(&store, "move")?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Lease {
    lock: Flock<File>,
}

/// Whoever only looks who has the machine locks the file for a moment, too.
const LOOKS: u32 = 3;
const LOOK: Duration = Duration::from_millis(10);

fn lock(mut file: File) -> Result<Flock<File>, File> {
    for _ in 1..LOOKS {
        match Flock::lock(file, FlockArg::LockExclusiveNonblock) {
            Ok(lock) => return Ok(lock),
            Err((taken, _)) => file = taken,
        }
        thread::sleep(LOOK);
    }
    Flock::lock(file, FlockArg::LockExclusiveNonblock).map_err(|(file, _)| file)
}

/// What stands before each place in the lease of a program that lets others ask.
const PLACE: &str = "listening at ";

impl Lease {
    /// Takes the lease of the machine whose store this is, for `verb`.
    ///
    /// # Errors
    /// When another program has it (its name is told), or the lock file cannot be made.
    pub fn take(store: &Store, verb: &str) -> Result<Self, StoreError> {
        let path = path_of(store);
        fs::create_dir_all(store.root()).map_err(io_error("create the folder", store.root()))?;
        let file = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .open(&path)
            .map_err(|error| not_opened(store, error))?;
        match lock(file) {
            Ok(mut lock) => {
                name_owner(&mut lock, verb).map_err(io_error("write", &path))?;
                Ok(Self { lock })
            }
            Err(mut file) => {
                let (owner, places) = said_in(&mut file);
                Err(StoreError::Leased { owner, places })
            }
        }
    }

    /// Who has the machine, and where its owner can be asked; `None` when nobody has it. Nothing is made or written.
    pub fn owner(store: &Store) -> Option<(String, Vec<String>)> {
        let file = File::open(path_of(store)).ok()?;
        match Flock::lock(file, FlockArg::LockSharedNonblock) {
            Ok(_) => None,
            Err((mut file, _)) => Some(said_in(&mut file)),
        }
    }

    /// Tells whoever finds the machine in use where its owner can be asked.
    ///
    /// # Errors
    /// When the lock file cannot be written.
    pub fn announce(&self, places: &[String]) -> io::Result<()> {
        let mut file: &File = &self.lock;
        let lines: String = places.iter().map(|it| format!("{PLACE}{it}\n")).collect();
        file.write_all(lines.as_bytes())
    }
}

fn path_of(store: &Store) -> PathBuf {
    store.root().join("lease")
}

/// Why it cannot be opened for writing. Who may only read it can still ask its owner, as those in the group of a
/// service do.
fn not_opened(store: &Store, error: io::Error) -> StoreError {
    match Lease::owner(store) {
        Some((owner, places)) => StoreError::Leased { owner, places },
        None => io_error("open", &path_of(store))(error),
    }
}

/// What the file of a lease says: whose it is, and where that can be asked.
fn said_in(file: &mut File) -> (String, Vec<String>) {
    let mut said = String::new();
    // Who holds it is a courtesy; that it is held is the fact.
    let _ = file.rewind().and_then(|()| file.read_to_string(&mut said));
    let (owner, places) = said.split_once('\n').unwrap_or((&said, ""));
    let places = places.lines().filter_map(|it| it.strip_prefix(PLACE));
    let owner = match owner.trim() {
        "" => "a program that has just begun",
        owner => owner,
    };
    (owner.to_owned(), places.map(str::to_owned).collect())
}

/// In one piece over all that a killed program has left, and shortened only then: whoever looks meanwhile is told a
/// name, and not that its bearer listens where the dead one did.
fn name_owner(file: &mut File, verb: &str) -> io::Result<()> {
    let owner = format!("truestage {verb}, process {}\n", std::process::id());
    let left = file.metadata()?.len() as usize;
    file.write_all(over(&owner, left).as_bytes())?;
    file.set_len(owner.len() as u64)?;
    file.seek(SeekFrom::Start(owner.len() as u64))?;
    Ok(())
}

/// The owner's line, and empty ones over the rest of so many bytes.
fn over(owner: &str, left: usize) -> String {
    format!("{owner:\n<left$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whoever is refused must be able to read who has the machine.
    #[test]
    fn the_lease_can_be_read_by_whom_any_other_new_file_can_be() {
        use std::os::unix::fs::MetadataExt;
        let folder = tempfile::tempdir().unwrap();
        let store = Store::new(folder.path(), "m", &[]);
        let _lease = Lease::take(&store, "calibrate").unwrap();
        let ordinary = store.root().join("ordinary");
        fs::write(&ordinary, b"x").unwrap();
        let mode = |path| fs::metadata(path).unwrap().mode();
        assert_eq!(mode(store.root().join("lease")), mode(ordinary));
    }

    #[test]
    fn a_second_program_is_told_where_the_owner_can_be_asked() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::new(folder.path(), "m", &[]);
        let lease = Lease::take(&store, "serve").unwrap();
        let of_second = || match Lease::take(&store, "move").unwrap_err() {
            StoreError::Leased { owner, places } => (owner, places),
            other => panic!("{other}"),
        };
        assert!(of_second().1.is_empty(), "it does not listen yet");
        assert_eq!(Lease::owner(&store), Some(of_second()));
        lease
            .announce(&["unix:/run/a b".into(), "tcp:[::1]:8470".into()])
            .unwrap();
        let (owner, places) = of_second();
        assert!(owner.starts_with("truestage serve, process "), "{owner}");
        assert_eq!(places, ["unix:/run/a b", "tcp:[::1]:8470"]);
        drop(lease);
        // What it said is gone with it.
        let _second = Lease::take(&store, "calibrate").unwrap();
        assert!(of_second().1.is_empty());
    }

    #[test]
    fn who_may_not_write_the_lease_is_told_where_its_owner_can_be_asked() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::new(folder.path(), "m", &[]);
        let denied = || not_opened(&store, io::ErrorKind::PermissionDenied.into());
        let lease = Lease::take(&store, "serve").unwrap();
        lease.announce(&["unix:/run/a".into()]).unwrap();
        assert!(matches!(denied(), StoreError::Leased { places, .. } if places == ["unix:/run/a"]));
        drop(lease);
        let said = denied().to_string();
        assert!(said.contains("permission denied"), "{said}");
    }

    #[test]
    fn what_a_killed_owner_said_is_gone_with_the_next_one() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::new(folder.path(), "m", &[]);
        let left = format!("truestage serve, process 1\n{PLACE}unix:/run/a\n{PLACE}unix:/run/b\n");
        fs::create_dir_all(store.root()).unwrap();
        fs::write(store.root().join("lease"), left).unwrap();
        let _lease = Lease::take(&store, "move").unwrap();
        let said = fs::read_to_string(store.root().join("lease")).unwrap();
        assert_eq!(
            said,
            format!("truestage move, process {}\n", std::process::id())
        );
    }

    /// Before the file is shortened: who waits for the next service to listen must not take the dead one's word for
    /// its own.
    #[test]
    fn at_no_moment_does_the_next_owner_listen_where_a_killed_one_did() {
        let left = format!("truestage serve, process 17\n{PLACE}unix:/run/a\n");
        for owner in [
            "truestage serve, process 4\n",
            "truestage calibrate, process 123456\n",
        ] {
            let mut said = left.clone().into_bytes();
            let over = over(owner, said.len());
            let beyond = said.split_off(over.len().min(said.len()));
            let between = [over.as_bytes(), &beyond].concat();
            let between = String::from_utf8(between).unwrap();
            assert!(
                between.starts_with(owner) && !between.contains(PLACE),
                "{between}"
            );
        }
        let long = "x".repeat(100);
        assert_eq!(over(&long, 3), long, "nothing of a longer name is lost");
    }

    #[test]
    fn a_second_program_is_told_who_has_the_machine() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::new(folder.path(), "m", &[]);
        let first = Lease::take(&store, "calibrate").unwrap();
        let error = Lease::take(&store, "move").unwrap_err().to_string();
        assert!(error.contains("truestage calibrate, process"), "{error}");
        drop(first);
        Lease::take(&store, "move").unwrap();
    }
}
