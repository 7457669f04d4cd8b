//! A disk that hangs or is full when a test wants it.

use std::io;
use std::path::Path;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

use machine::records::files::{Call, Files as _, OpenFile, OsFiles, Watch, WatchedFiles};

use crate::client::PATIENCE;

/// What an operating system says of a full disk.
const NO_SPACE: i32 = 28;

/// The files of the operating system, held up or refused.
#[derive(Clone, Debug, Default)]
pub(crate) struct Disk(Arc<Shared>);

#[derive(Debug, Default)]
struct Shared {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct State {
    hangs: bool,
    /// So many calls hang.
    hanging: usize,
    /// So many bytes have room, where it is full.
    room: Option<usize>,
}

impl Disk {
    fn state(&self) -> MutexGuard<'_, State> {
        self.0.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// From now on no sync ends.
    pub(crate) fn hang(&self) {
        self.state().hangs = true;
    }

    /// The files on it.
    pub(crate) fn files(&self) -> WatchedFiles<OsFiles, Self> {
        WatchedFiles {
            files: OsFiles,
            watch: self.clone(),
        }
    }

    /// It goes on.
    pub(crate) fn go_on(&self) {
        self.state().hangs = false;
        self.0.changed.notify_all();
    }

    /// Returns when something hangs.
    pub(crate) fn await_hanging(&self) {
        let waited = self
            .0
            .changed
            .wait_timeout_while(self.state(), PATIENCE, |state| state.hanging == 0);
        let timed_out = waited.unwrap_or_else(PoisonError::into_inner).1.timed_out();
        assert!(!timed_out, "nothing writes");
    }

    /// No byte more has room.
    pub(crate) fn fill(&self) {
        self.state().room = Some(0);
    }

    /// There is room again.
    pub(crate) fn free(&self) {
        self.state().room = None;
    }

    fn sync(&self) {
        let mut state = self.state();
        state.hanging += 1;
        self.0.changed.notify_all();
        let waited = self.0.changed.wait_while(state, |state| state.hangs);
        waited.unwrap_or_else(PoisonError::into_inner).hanging -= 1;
    }

    /// How many of `wanted` bytes have room.
    fn take_room(&self, wanted: usize) -> io::Result<usize> {
        let mut state = self.state();
        let Some(room) = &mut state.room else {
            return Ok(wanted);
        };
        let taken = wanted.min(*room);
        *room -= taken;
        match taken {
            0 if wanted > 0 => Err(io::Error::from_raw_os_error(NO_SPACE)),
            _ => Ok(taken),
        }
    }
}

impl Watch for Disk {
    fn begin_call(&self, call: Call, path: &Path) -> io::Result<()> {
        match call {
            Call::Remove => {
                let length = OsFiles.open(path).and_then(|file| file.length());
                if let (Some(room), Ok(length)) = (&mut self.state().room, length) {
                    *room += usize::try_from(length).unwrap_or(0);
                }
            }
            Call::SyncFolder => self.sync(),
            Call::Read
            | Call::List
            | Call::MakeFolder
            | Call::Create
            | Call::Open
            | Call::Rename => {}
        }
        Ok(())
    }

    fn take_file(&self, inner: Box<dyn OpenFile>) -> Box<dyn OpenFile> {
        let disk = self.clone();
        Box::new(Opened { disk, inner })
    }
}

#[derive(Debug)]
struct Opened {
    disk: Disk,
    inner: Box<dyn OpenFile>,
}

impl OpenFile for Opened {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let count = self.disk.take_room(bytes.len())?;
        self.inner.write(&bytes[..count])
    }

    fn sync(&mut self) -> io::Result<()> {
        self.disk.sync();
        self.inner.sync()
    }

    fn set_len(&mut self, length: u64) -> io::Result<()> {
        self.inner.set_len(length)
    }

    fn length(&self) -> io::Result<u64> {
        self.inner.length()
    }
}
