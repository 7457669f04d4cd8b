//! Lines of progress on standard error, written by a thread of their own: whoever reads them late makes the writer
//! wait, and never the machine.

use std::io::Write as _;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::{self, JoinHandle};

use super::account::{Account, Sign};

/// So many signs may wait for the writer. Those of life that find no room are dropped: the next one says the same.
const WAITING: usize = 256;

/// Who is given signs.
pub(super) struct Lines {
    signs: Option<SyncSender<Sign>>,
    writer: Option<JoinHandle<()>>,
}

impl Lines {
    pub(super) fn new() -> Self {
        let (signs, taken) = sync_channel(WAITING);
        let writer = thread::Builder::new()
            .name("progress".into())
            .spawn(move || write(&taken));
        Self {
            signs: Some(signs),
            // Without a thread nobody hears anything, and the machine goes on.
            writer: writer.ok(),
        }
    }

    /// Takes a sign without ever waiting.
    pub(super) fn note(&self, sign: Sign) {
        if let Some(signs) = &self.signs {
            let _ = signs.try_send(sign);
        }
    }

    /// Takes what must not be lost.
    pub(super) fn say(&self, line: String) {
        if let Some(signs) = &self.signs {
            let _ = signs.send(Sign::Said(line));
        }
    }
}

fn write(signs: &Receiver<Sign>) {
    let mut account = Account::default();
    for sign in signs {
        if let Some(line) = account.take(sign) {
            // Nobody has to read it.
            let _ = writeln!(std::io::stderr().lock(), "{line}");
        }
    }
}

impl Drop for Lines {
    fn drop(&mut self) {
        self.signs = None;
        if let Some(writer) = self.writer.take() {
            let _ = writer.join();
        }
    }
}
