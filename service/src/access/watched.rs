//! What files say, read again when they have changed: whoever gives a token or a certificate must not have to end the
//! service, which would cost the machine its zero.

use core::time::Duration;
use std::fs;
use std::os::unix::fs::MetadataExt as _;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Instant, SystemTime};

/// How often it is looked whether a file has changed.
const LOOK_EVERY: Duration = Duration::from_secs(1);

/// What a file looks like from outside: when it was changed, how long it is, and who may read it.
type Look = Vec<Option<Seen>>;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Seen {
    modified: SystemTime,
    length: u64,
    mode: u32,
    owner: u32,
}

/// What some files say.
pub(super) struct Watched<T, E> {
    files: Vec<PathBuf>,
    read: Box<dyn Fn() -> Result<T, E> + Send + Sync>,
    state: Mutex<State<T, E>>,
}

struct State<T, E> {
    looked: Instant,
    look: Look,
    /// The last that could be used.
    good: Arc<T>,
    /// What is wrong with what they say now.
    wrong: Option<Arc<E>>,
}

impl<T, E> Watched<T, E> {
    /// # Errors
    /// When they cannot be read now.
    pub(super) fn open(
        files: Vec<PathBuf>,
        read: impl Fn() -> Result<T, E> + Send + Sync + 'static,
    ) -> Result<Self, E> {
        let look = look_at(&files);
        let state = State {
            looked: Instant::now(),
            look,
            good: Arc::new(read()?),
            wrong: None,
        };
        Ok(Self {
            files,
            read: Box::new(read),
            state: Mutex::new(state),
        })
    }

    /// What they say, at most a second old.
    ///
    /// # Errors
    /// When they were changed, and what they say now cannot be used.
    pub(super) fn newest(&self) -> Result<Arc<T>, Arc<E>> {
        self.newest_at(Instant::now())
    }

    /// The last that they said and that could be used; what they say now, if that can.
    pub(super) fn last_good(&self) -> Arc<T> {
        Arc::clone(&self.looked_at(Instant::now()).good)
    }

    fn newest_at(&self, now: Instant) -> Result<Arc<T>, Arc<E>> {
        let state = self.looked_at(now);
        match &state.wrong {
            None => Ok(Arc::clone(&state.good)),
            Some(wrong) => Err(Arc::clone(wrong)),
        }
    }

    fn looked_at(&self, now: Instant) -> MutexGuard<'_, State<T, E>> {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        if now.saturating_duration_since(state.looked) >= LOOK_EVERY {
            state.looked = now;
            let look = look_at(&self.files);
            // One that could not be used is tried again: its mode may have been put right, which no time tells.
            if look != state.look || state.wrong.is_some() {
                state.look = look;
                match (self.read)() {
                    Ok(good) => {
                        state.good = Arc::new(good);
                        state.wrong = None;
                    }
                    Err(wrong) => state.wrong = Some(Arc::new(wrong)),
                }
            }
        }
        state
    }
}

fn look_at(files: &[PathBuf]) -> Look {
    let looks = files.iter().map(|it| {
        let seen = fs::metadata(it).ok()?;
        Some(Seen {
            modified: seen.modified().ok()?,
            length: seen.len(),
            mode: seen.mode(),
            owner: seen.uid(),
        })
    });
    looks.collect()
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::PermissionsExt as _;

    use super::*;
    use crate::access::secret_file;

    #[test]
    fn a_file_whose_mode_alone_has_changed_is_judged_again() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let path = file.path().to_owned();
        let mode = |mode| fs::set_permissions(&path, fs::Permissions::from_mode(mode)).unwrap();
        mode(0o640);
        let secret = path.clone();
        let read = move || secret_file::read(&secret);
        let watched = Watched::open(vec![path.clone()], read).unwrap();
        let begun = Instant::now();
        let after = |seconds| watched.newest_at(begun + Duration::from_secs(seconds));
        assert!(after(2).is_ok());
        mode(0o644);
        assert!(after(4).is_err(), "others can read it now");
        mode(0o600);
        assert!(after(6).is_ok());
    }

    #[test]
    fn a_file_is_read_again_when_it_has_changed_and_not_otherwise() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        fs::write(&path, "1").unwrap();
        let file = path.clone();
        let read = move || fs::read_to_string(&file).map_err(|it| it.kind());
        let watched = Watched::open(vec![path.clone()], read).unwrap();
        let begun = Instant::now();
        let after = |seconds| watched.newest_at(begun + Duration::from_secs(seconds));
        let first = after(2).unwrap();
        assert!(
            Arc::ptr_eq(&first, &after(4).unwrap()),
            "nothing has changed"
        );
        fs::write(&path, "22").unwrap();
        assert_eq!(*after(4).unwrap(), "1", "it was looked at just now");
        assert_eq!(*after(6).unwrap(), "22");
        fs::remove_file(&path).unwrap();
        assert!(after(8).is_err(), "what is gone lets nobody in");
        assert_eq!(*watched.last_good(), "22", "what it said before is kept");
        fs::write(&path, "333").unwrap();
        assert_eq!(*after(10).unwrap(), "333");
    }
}
