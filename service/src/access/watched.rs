//! What files say, read again when they have changed: whoever gives a token or a certificate must not have to end the
//! service, which would cost the machine its zero.

use core::time::Duration;
use std::fs;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Instant, SystemTime};

/// How often it is looked whether a file has changed.
const LOOK_EVERY: Duration = Duration::from_secs(1);

/// What a file looks like from outside: when it was changed, and how long it is.
type Look = Vec<Option<(SystemTime, u64)>>;

/// What some files say.
pub(super) struct Watched<T, E> {
    files: Vec<PathBuf>,
    read: Box<dyn Fn() -> Result<T, E> + Send + Sync>,
    state: Mutex<State<T, E>>,
}

struct State<T, E> {
    looked: Instant,
    look: Look,
    said: Result<Arc<T>, Arc<E>>,
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
            said: Ok(Arc::new(read()?)),
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

    fn newest_at(&self, now: Instant) -> Result<Arc<T>, Arc<E>> {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        if now.saturating_duration_since(state.looked) >= LOOK_EVERY {
            state.looked = now;
            let look = look_at(&self.files);
            // One that could not be used is tried again: its mode may have been put right, which no time tells.
            if look != state.look || state.said.is_err() {
                state.look = look;
                state.said = (self.read)().map(Arc::new).map_err(Arc::new);
            }
        }
        state.said.clone()
    }
}

fn look_at(files: &[PathBuf]) -> Look {
    let looks = files.iter().map(|it| {
        let seen = fs::metadata(it).ok()?;
        Some((seen.modified().ok()?, seen.len()))
    });
    looks.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

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
        fs::write(&path, "333").unwrap();
        assert_eq!(*after(10).unwrap(), "333");
    }
}
