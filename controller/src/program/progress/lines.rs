//! Lines of progress on standard error, written by a thread of their own: whoever reads them late makes the writer
//! wait, and never the machine.

use std::io::Write;
use std::sync::mpsc::{Receiver, Sender, SyncSender, channel, sync_channel};
use std::sync::{Arc, Mutex, PoisonError, Weak};
use std::thread::{self, JoinHandle};

use super::account::{Account, Sign};

/// So many signs may wait for the writer. Those of life that find no room are dropped: the next one says the same.
const WAITING: usize = 256;

/// The writers of this program, each for as long as it is given something.
static WRITERS: Mutex<Vec<Weak<SyncSender<Given>>>> = Mutex::new(Vec::new());

/// What a writer is given.
enum Given {
    Sign(Sign),
    /// Somebody waits until all before this is written.
    Awaited(Sender<()>),
}

/// Who is given signs.
pub(super) struct Lines {
    signs: Option<Arc<SyncSender<Given>>>,
    writer: Option<JoinHandle<()>>,
}

impl Lines {
    pub(super) fn new() -> Self {
        Self::to(std::io::stderr())
    }

    fn to(out: impl Write + Send + 'static) -> Self {
        let (signs, taken) = sync_channel(WAITING);
        let signs = Arc::new(signs);
        let mut writers = WRITERS.lock().unwrap_or_else(PoisonError::into_inner);
        writers.retain(|it| it.strong_count() > 0);
        writers.push(Arc::downgrade(&signs));
        let writer = thread::Builder::new()
            .name("progress".into())
            .spawn(move || write(&taken, out));
        Self {
            signs: Some(signs),
            // Without a thread nobody hears anything, and the machine goes on.
            writer: writer.ok(),
        }
    }

    /// Takes a sign without ever waiting.
    pub(super) fn note(&self, sign: Sign) {
        if let Some(signs) = &self.signs {
            let _ = signs.try_send(Given::Sign(sign));
        }
    }

    /// Takes what must not be lost.
    pub(super) fn say(&self, line: String) {
        if let Some(signs) = &self.signs {
            let _ = signs.send(Given::Sign(Sign::Said(line)));
        }
    }
}

/// Waits until all is written that was given before: on a busy computer a writer gets its turn late, and what is
/// printed next would stand above it.
pub(in crate::program) fn settle() {
    let writers = WRITERS.lock().unwrap_or_else(PoisonError::into_inner);
    let open: Vec<_> = writers.iter().filter_map(Weak::upgrade).collect();
    drop(writers);
    let (reached, awaited) = channel();
    for writer in open {
        let _ = writer.send(Given::Awaited(reached.clone()));
    }
    drop(reached);
    // It ends when the last writer has said so, or has gone.
    awaited.iter().for_each(drop);
}

fn write(given: &Receiver<Given>, mut out: impl Write) {
    let mut account = Account::default();
    for it in given {
        match it {
            Given::Sign(sign) => {
                if let Some(line) = account.take(sign) {
                    // Nobody has to read it.
                    let _ = writeln!(out, "{line}");
                }
            }
            Given::Awaited(reached) => {
                let _ = reached.send(());
            }
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

#[cfg(test)]
mod tests {
    use core::time::Duration;
    use std::io;

    use super::*;

    /// A screen that is written to late, as on a busy computer.
    #[derive(Clone, Default)]
    struct Late(Arc<Mutex<Vec<u8>>>);

    impl Write for Late {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            thread::sleep(Duration::from_millis(50));
            self.0.lock().expect("nobody panics").write(bytes)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn what_was_said_stands_there_before_the_result() {
        let screen = Late::default();
        let lines = Lines::to(screen.clone());
        lines.say("asking nodes 1 to 127".into());
        settle();
        let shown = screen.0.lock().expect("nobody panics").clone();
        assert_eq!(shown, b"asking nodes 1 to 127\n");
    }

    #[test]
    fn with_nobody_who_says_anything_nothing_is_waited_for() {
        drop(Lines::to(io::sink()));
        settle();
    }
}
