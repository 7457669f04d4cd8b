//! Writes down what happened, on a thread of its own: neither the machine nor a client waits for a disk.
//!
//! How motions ended goes to the ledger, every event to `journal.jsonl` beside it, one JSON object a line. A
//! journal that has grown large becomes `journal.old.jsonl`.

use core::time::Duration;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};

use crate::desk::Desk;
use crate::system_log::SystemLog;

/// How often it looks: the snapshot keeps far more events than happen meanwhile.
const EVERY: Duration = Duration::from_millis(50);
/// So large a journal may grow, in bytes.
const JOURNAL_MAX: u64 = 16 << 20;

/// The thread that writes.
#[derive(Debug)]
pub(crate) struct Scribe {
    over: Arc<AtomicBool>,
    thread: JoinHandle<()>,
}

impl Scribe {
    /// Writes what `desk` reads into `folder`.
    pub(crate) fn start(desk: Desk, folder: PathBuf) -> io::Result<Self> {
        let over = Arc::new(AtomicBool::new(false));
        let seen = Arc::clone(&over);
        let thread = thread::Builder::new()
            .name("scribe".into())
            .spawn(move || {
                let mut newest = 0;
                let mut log = SystemLog::of_environment();
                loop {
                    let is_last = seen.load(Ordering::Acquire);
                    // A disk that is full or gone must not end the service; the next look tries again.
                    let _ = desk.write_ends();
                    let _ = write_events(&desk, &folder, &mut newest);
                    log.iter_mut().for_each(|it| it.tell(&desk));
                    if is_last {
                        return;
                    }
                    thread::park_timeout(EVERY);
                }
            })?;
        Ok(Self { over, thread })
    }

    /// Writes the rest and ends.
    pub(crate) fn finish(self) {
        self.over.store(true, Ordering::Release);
        self.thread.thread().unpark();
        let _ = self.thread.join();
    }
}

fn write_events(desk: &Desk, folder: &Path, newest: &mut u64) -> io::Result<()> {
    let events = desk.events(*newest);
    let Some(last) = events.last().map(|it| it.id) else {
        return Ok(());
    };
    let mut bytes = Vec::new();
    for event in &events {
        serde_json::to_writer(&mut bytes, event)?;
        bytes.push(b'\n');
    }
    journal(folder)?.write_all(&bytes)?;
    *newest = last;
    Ok(())
}

fn journal(folder: &Path) -> io::Result<File> {
    let path = folder.join("journal.jsonl");
    let is_large = fs::metadata(&path).is_ok_and(|it| it.len() > JOURNAL_MAX);
    if is_large {
        fs::rename(&path, folder.join("journal.old.jsonl"))?;
    }
    OpenOptions::new().create(true).append(true).open(path)
}
