//! Writes down what happened, on threads of its own: neither the machine nor a client waits for a disk.
//!
//! One thread writes the ledger, and another one every event to `journal.jsonl` beside it, one JSON object a line: where
//! one of them hangs, the other one goes on. A journal that has grown large becomes `journal.old.jsonl`.

use core::time::Duration;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver, Sender};
use std::thread::{self, Thread};
use std::time::Instant;

use crate::desk::Desk;
use crate::ledger::{WRITE_LIMIT, Writer};
use crate::system_log::SystemLog;

/// How often they look: the snapshot keeps far more events than happen meanwhile.
const EVERY: Duration = Duration::from_millis(50);
/// So large a journal may grow, in bytes.
const JOURNAL_MAX: u64 = 16 << 20;

/// The threads that write.
#[derive(Debug)]
pub(crate) struct Scribe {
    over: Arc<AtomicBool>,
    threads: Vec<(Thread, Receiver<()>)>,
}

impl Scribe {
    /// Writes what `desk` reads: by `writer` into the ledger, and events into `folder`.
    pub(crate) fn start(desk: Desk, writer: Writer, folder: PathBuf) -> io::Result<Self> {
        let mut scribe = Self {
            over: Arc::default(),
            threads: Vec::new(),
        };
        let events = desk.clone();
        scribe.spawn("ledger", move |over| keep_ledger(&desk, writer, over))?;
        scribe.spawn("scribe", move |over| keep_journal(&events, &folder, over))?;
        Ok(scribe)
    }

    fn spawn(
        &mut self,
        name: &str,
        work: impl FnOnce(&AtomicBool) + Send + 'static,
    ) -> io::Result<()> {
        let over = Arc::clone(&self.over);
        let (open, ended): (Sender<()>, _) = mpsc::channel();
        let builder = thread::Builder::new().name(name.into());
        let thread = builder.spawn(move || {
            let _open = open;
            work(&over);
        })?;
        self.threads.push((thread.thread().clone(), ended));
        Ok(())
    }

    /// Writes the rest and ends. A disk that hangs is not waited for.
    pub(crate) fn finish(self) {
        self.over.store(true, Ordering::Release);
        let until = Instant::now() + WRITE_LIMIT;
        for (thread, ended) in self.threads {
            thread.unpark();
            // Nothing is ever sent: either the thread has ended, or it is left behind.
            let _ = ended.recv_timeout(until.saturating_duration_since(Instant::now()));
        }
    }
}

fn keep_ledger(desk: &Desk, mut writer: Writer, over: &AtomicBool) {
    loop {
        let is_last = over.load(Ordering::Acquire);
        desk.note_ends();
        if is_last {
            writer.retry_now();
        }
        writer.write();
        if is_last {
            return;
        }
        writer.await_news(EVERY);
    }
}

fn keep_journal(desk: &Desk, folder: &Path, over: &AtomicBool) {
    let mut newest = 0;
    let mut log = SystemLog::of_environment();
    loop {
        let is_last = over.load(Ordering::Acquire);
        log.iter_mut().for_each(|log| log.tell(desk));
        // On a full disk ends come first: events would take the room that the ballast leaves them.
        if desk.storage().ok {
            // A disk that is gone must not end the service; the next look tries again.
            let _ = write_events(desk, folder, &mut newest);
        }
        if is_last {
            return;
        }
        thread::park_timeout(EVERY);
    }
}

fn write_events(desk: &Desk, folder: &Path, newest: &mut u64) -> io::Result<()> {
    let events = desk.events(*newest);
    let Some(last) = events.last().map(|event| event.id) else {
        return Ok(());
    };
    let mut bytes = Vec::new();
    for event in &events {
        serde_json::to_writer(&mut bytes, event)?;
        bytes.push(b'\n');
    }
    let mut file = journal(folder)?;
    let length = file.metadata()?.len();
    // The next try would stand behind half a line.
    let written = file.write_all(&bytes);
    written.or_else(|error| file.set_len(length).and(Err(error)))?;
    *newest = last;
    Ok(())
}

fn journal(folder: &Path) -> io::Result<File> {
    let path = folder.join("journal.jsonl");
    let is_large = fs::metadata(&path).is_ok_and(|found| found.len() > JOURNAL_MAX);
    if is_large {
        fs::rename(&path, folder.join("journal.old.jsonl"))?;
    }
    OpenOptions::new().create(true).append(true).open(path)
}
