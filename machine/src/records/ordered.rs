//! Stores for the thread of a machine: what they write is ordered, what they read is there.

use core::time::Duration;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::disk::{Answer, Disk, DiskPace};
use super::disk_failure::DiskFailure;
use super::door::Door;
use super::{Store, StoreError};

/// What was asked of the thread of the records.
pub(crate) enum Asked<R> {
    /// It was done at once.
    Done(R),
    /// The machine lives on until it is done.
    Under(Answer<R>),
    /// The machine's clock stands until it is done.
    Held(Answer<R>),
}

impl<R> Asked<R> {
    /// The answer, if it is there within `span`; nothing lives on meanwhile.
    pub(crate) fn within(self, span: Duration) -> Result<Option<R>, DiskFailure> {
        match self {
            Self::Done(answer) => Ok(Some(answer)),
            Self::Under(mut answer) | Self::Held(mut answer) => answer.wait_for(span),
        }
    }
}

impl Store {
    /// The same store for the thread of a machine, which waits for no disk: what it reads is read now, and what it
    /// writes is ordered. Whether that was done is heard by [`Store::heard`].
    ///
    /// # Errors
    /// When the thread of the records cannot be started.
    pub fn ordered(&self, pace: DiskPace) -> io::Result<Self> {
        let disk = Disk::start(Arc::clone(self.door.files()), &self.root, pace)?;
        Ok(self.through(Door::Ordered(disk)))
    }

    /// The same store for any other thread: each call waits for the disk.
    #[must_use]
    pub fn direct(&self) -> Self {
        self.through(Door::Direct(Arc::clone(self.door.files())))
    }

    /// Does `work` in the thread of the records, after all that was ordered before; at once, where there is none.
    pub(crate) fn ask<R: Send + 'static>(
        &self,
        work: impl FnOnce(&Self) -> R + Send + 'static,
    ) -> Result<Asked<R>, DiskFailure> {
        let Door::Ordered(disk) = &self.door else {
            return Ok(Asked::Done(work(self)));
        };
        let within = self.through(Door::Within(Arc::clone(disk.shared())));
        let answer = disk.ask(move || work(&within))?;
        Ok(match disk.lets_time_pass() {
            true => Asked::Under(answer),
            false => Asked::Held(answer),
        })
    }

    /// Whether all that was done so far went well. What was ordered and has not been done yet is not in it: see
    /// [`ask_disk`](crate::ask_disk).
    ///
    /// # Errors
    /// Of the first that did not; it is said once.
    pub fn heard(&self) -> Result<(), StoreError> {
        let Door::Ordered(disk) = &self.door else {
            return Ok(());
        };
        disk.hear_failure().map_or(Ok(()), Err)
    }

    fn zero_note_path(&self, axis: &str) -> PathBuf {
        self.root.join("zeros").join(format!("{axis}.json"))
    }

    /// What is noted of the zero of `axis`.
    pub(crate) fn read_zero_note(&self, axis: &str) -> Option<String> {
        let bytes = self.door.read(&self.zero_note_path(axis)).ok()?;
        String::from_utf8(bytes).ok()
    }

    /// Notes the zero of `axis`.
    pub(crate) fn write_zero_note(&self, axis: &str, text: String) -> Result<(), StoreError> {
        self.door
            .replace(&self.zero_note_path(axis), text.into_bytes())
    }

    /// Believes the note of the zero of `axis` no more, and says where it is. It is to be removed.
    pub(crate) fn hide_zero_note(&self, axis: &str) -> PathBuf {
        let path = self.zero_note_path(axis);
        if let Door::Ordered(disk) = &self.door {
            disk.shared().copy().remove(&path);
        }
        path
    }

    /// Takes the note of the zero of `axis` away. Not in an ordered store.
    pub(crate) fn remove_zero_note(&self, axis: &str) -> io::Result<()> {
        self.door.remove(&self.zero_note_path(axis))
    }

    /// Has the calibrations `ids` ready for who reads them. In the thread of the records.
    pub fn hold_calibrations<'i>(&self, ids: impl IntoIterator<Item = &'i str>) {
        for id in ids {
            let path = self.calibration_path(id);
            if let Ok(bytes) = self.door.read(&path) {
                self.door.note(&path, Some(&bytes));
            }
        }
    }

    /// Has the content of `path` ready for who reads it next. In the thread of the records.
    pub(crate) fn hold(&self, path: &Path) {
        if let Door::Within(shared) = &self.door
            && let Ok(bytes) = self.door.read(path)
        {
            shared.copy().hold(path, bytes);
        }
    }

    /// How many orders the thread of the records has not done yet.
    pub fn waiting(&self) -> u64 {
        match &self.door {
            Door::Ordered(disk) => disk.waiting(),
            Door::Direct(_) | Door::Within(_) => 0,
        }
    }
}
