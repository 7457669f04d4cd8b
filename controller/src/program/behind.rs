//! A file that a thread of its own writes: the thread of a machine, which records its buses, waits for no disk.

use std::io::{self, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicI32, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::thread;

use machine::records::DiskPace;

use super::streams::END_LIMIT;

/// So many blocks may wait: of 8 KiB each, minutes of a full bus.
const BLOCKS: usize = 2048;

/// The end at which is written. A disk that does not keep up, or fails, ends the file: it has no holes.
#[derive(Debug)]
pub(super) struct Behind {
    /// `None` when it is over.
    blocks: Option<SyncSender<Vec<u8>>>,
    pace: DiskPace,
    errno: Arc<AtomicI32>,
    ended: Receiver<()>,
}

impl Behind {
    /// # Errors
    /// When the thread cannot be started.
    pub(super) fn new(mut file: impl Write + Send + 'static, pace: DiskPace) -> io::Result<Self> {
        let (blocks, waiting) = sync_channel::<Vec<u8>>(BLOCKS);
        let (over, ended) = sync_channel(1);
        let errno = Arc::new(AtomicI32::new(0));
        let seen = Arc::clone(&errno);
        let writer = thread::Builder::new().name("record".into());
        writer.spawn(move || {
            let written = waiting.iter().try_for_each(|block| file.write_all(&block));
            if let Err(error) = written {
                seen.store(error.raw_os_error().unwrap_or(EIO), Ordering::Release);
            }
            // The other end may have given up.
            let _ = over.send(());
        })?;
        Ok(Self {
            blocks: Some(blocks),
            pace,
            errno,
            ended,
        })
    }
}

/// What stands for an error without a number.
const EIO: i32 = 5;

impl Write for Behind {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let Some(blocks) = &self.blocks else {
            return Err(io::ErrorKind::BrokenPipe.into());
        };
        let block = bytes.to_vec();
        let sent = match self.pace {
            DiskPace::Wall => blocks.try_send(block),
            DiskPace::Shared => blocks
                .send(block)
                .map_err(|refused| TrySendError::Disconnected(refused.0)),
        };
        match sent {
            Ok(()) => Ok(bytes.len()),
            Err(TrySendError::Full(_)) => Err(io::Error::other("the disk does not keep up")),
            Err(TrySendError::Disconnected(_)) => Err(io::Error::from_raw_os_error(
                self.errno.load(Ordering::Acquire),
            )),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Drop for Behind {
    fn drop(&mut self) {
        self.blocks = None;
        // What is not written by then is not waited for.
        let _ = self.ended.recv_timeout(END_LIMIT);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;
    use std::sync::mpsc::channel;

    use super::*;

    #[test]
    fn a_file_that_takes_nothing_holds_no_writer() {
        struct Hangs(Mutex<Receiver<()>>);
        impl Write for Hangs {
            fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
                // Until the test is over.
                let _ = self.0.lock().unwrap().recv();
                Ok(bytes.len())
            }
            fn flush(&mut self) -> io::Result<()> {
                Ok(())
            }
        }
        let (over, hangs) = channel::<()>();
        let mut behind = Behind::new(Hangs(Mutex::new(hangs)), DiskPace::Wall).unwrap();
        let taken = (0..2 * BLOCKS)
            .take_while(|_| behind.write(b"x").is_ok())
            .count();
        assert!((BLOCKS..=BLOCKS + 1).contains(&taken), "{taken}");
        drop(over);
    }

    #[test]
    fn a_full_disk_is_named() {
        struct Full;
        impl Write for Full {
            fn write(&mut self, _: &[u8]) -> io::Result<usize> {
                Err(io::Error::from_raw_os_error(28))
            }
            fn flush(&mut self) -> io::Result<()> {
                Ok(())
            }
        }
        let mut behind = Behind::new(Full, DiskPace::Shared).unwrap();
        let failed = core::iter::repeat_with(|| behind.write(b"x")).find_map(Result::err);
        assert_eq!(failed.unwrap().raw_os_error(), Some(28));
    }
}
