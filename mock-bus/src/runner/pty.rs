//! A pseudo-terminal whose far end another program opens like a serial port.
//!
//! What is sent while no program has it open is lost, as with a real port. A program that has
//! it open and is slow loses nothing until the buffers are full, and then only whole messages:
//! some clients never recover from half a line.

use std::collections::VecDeque;
use std::io;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::path::{Path, PathBuf};

use nix::errno::Errno;
use nix::fcntl::{FcntlArg, OFlag, fcntl};
use nix::libc;
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use nix::pty::openpty;
use nix::sys::inotify::{AddWatchFlags, InitFlags, Inotify};
use nix::sys::termios::{FlushArg, SetArg, cfmakeraw, tcflush, tcgetattr, tcsetattr};
use nix::unistd::{read, ttyname, write};
use rustix::termios::ioctl_tiocnxcl;

/// More unsent bytes than this are an overrun.
const UNSENT_MAX: usize = 16 * 1024;
/// So many are not kept for one piece with what follows.
const PIECE_MAX: usize = 2 * 1024;

pub(super) struct Pty {
    master: OwnedFd,
    /// Held open: a client that closes its end must not hang up the emulator's.
    slave: OwnedFd,
    path: PathBuf,
    link: Option<PathBuf>,
    unsent: VecDeque<u8>,
    clients: Clients,
    /// Its client says itself when it comes and goes: nobody needs to look.
    is_attended: bool,
}

impl Pty {
    /// A raw pseudo-terminal, and a symbolic link to it where one is wanted.
    pub(super) fn open(link: Option<&Path>) -> io::Result<Self> {
        let pair = openpty(None, None)?;
        let mut settings = tcgetattr(&pair.slave)?;
        cfmakeraw(&mut settings);
        tcsetattr(&pair.slave, SetArg::TCSANOW, &settings)?;
        let flags = OFlag::from_bits_retain(fcntl(&pair.master, FcntlArg::F_GETFL)?);
        fcntl(&pair.master, FcntlArg::F_SETFL(flags | OFlag::O_NONBLOCK))?;
        let path = ttyname(&pair.slave)?;
        // Before anybody can find it.
        let clients = Clients::of(&path);
        if let Some(link) = link {
            replace_link(&path, link)?;
        }
        Ok(Self {
            master: pair.master,
            slave: pair.slave,
            path,
            link: link.map(Path::to_owned),
            unsent: VecDeque::new(),
            clients,
            is_attended: false,
        })
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    pub(super) fn fd(&self) -> BorrowedFd<'_> {
        self.master.as_fd()
    }

    pub(super) fn has_unsent(&self) -> bool {
        !self.unsent.is_empty()
    }

    /// What the client has written.
    pub(super) fn receive(&mut self) -> io::Result<Vec<u8>> {
        self.look_who_is_there()?;
        let mut buffer = [0; 4096];
        match read(&self.master, &mut buffer) {
            Ok(length) => {
                self.clients.heard();
                Ok(buffer[..length].to_vec())
            }
            Err(Errno::EAGAIN | Errno::EINTR) => Ok(Vec::new()),
            Err(errno) => Err(errno.into()),
        }
    }

    /// The rate that the client has set, where it has set one of the usual by its code; one that
    /// is set as a number cannot be read here.
    pub(super) fn client_rate(&self) -> Option<u32> {
        let settings = libc::termios::from(tcgetattr(&self.slave).ok()?);
        Some(match settings.c_cflag & libc::CBAUD {
            libc::B4800 => 4_800,
            libc::B9600 => 9_600,
            libc::B19200 => 19_200,
            libc::B38400 => 38_400,
            libc::B57600 => 57_600,
            libc::B115200 => 115_200,
            libc::B230400 => 230_400,
            _ => return None,
        })
    }

    /// Exactly so many bytes of the client, which it has written: the kernel may still have them
    /// on the way. Fewer, when the client is not there any more and they do not come.
    pub(super) fn receive_exactly(
        &mut self,
        count: usize,
        is_there: impl Fn() -> bool,
    ) -> io::Result<Vec<u8>> {
        self.look_who_is_there()?;
        self.clients.heard();
        let mut bytes = vec![0; count];
        let mut filled = 0;
        while filled < count {
            match read(&self.master, &mut bytes[filled..]) {
                Ok(length) => filled += length,
                Err(Errno::EAGAIN) if await_readable(self.fd(), &is_there)? => {}
                Err(Errno::EAGAIN) => break,
                Err(Errno::EINTR) => {}
                Err(errno) => return Err(errno.into()),
            }
        }
        bytes.truncate(filled);
        Ok(bytes)
    }

    /// Reads what has come, for nobody; how many bytes that was.
    pub(super) fn drop_heard(&mut self) -> io::Result<usize> {
        let (mut buffer, mut dropped) = ([0; 4096], 0);
        loop {
            match read(&self.master, &mut buffer) {
                Ok(0) | Err(Errno::EAGAIN) => return Ok(dropped),
                Ok(length) => dropped += length,
                Err(Errno::EINTR) => {}
                Err(errno) => return Err(errno.into()),
            }
        }
    }

    /// Sends now what fits, and the rest at the next [`Pty::flush`]; `false` when it is lost. For a
    /// client that says itself when it waits, all waits for the flush: each piece wakes the kernel's
    /// worker for terminals, which takes longer than the writing.
    pub(super) fn send(&mut self, bytes: &[u8]) -> io::Result<bool> {
        self.look_who_is_there()?;
        let is_heard = self.is_attended || self.clients.is_any();
        let taken = is_heard && self.unsent.len() + bytes.len() <= UNSENT_MAX;
        if taken {
            self.unsent.extend(bytes);
        }
        if !self.is_attended || self.unsent.len() > PIECE_MAX {
            self.flush()?;
        }
        Ok(taken)
    }

    pub(super) fn flush(&mut self) -> io::Result<()> {
        while !self.unsent.is_empty() {
            let (head, _) = self.unsent.as_slices();
            match write(&self.master, head) {
                Ok(sent) => drop(self.unsent.drain(..sent)),
                Err(Errno::EAGAIN) => break,
                Err(Errno::EINTR) => {}
                Err(errno) => return Err(errno.into()),
            }
        }
        Ok(())
    }

    /// A client that says itself when it comes and goes has come, or has gone.
    pub(super) fn attend(&mut self, is_there: bool) -> io::Result<()> {
        self.is_attended = false;
        self.look_who_is_there()?;
        self.is_attended = is_there;
        Ok(())
    }

    /// What the last program has not read when it closes is not for the next one, nor does it keep the terminal for
    /// itself any longer: a program that was killed could not give it back (TIOCEXCL).
    fn look_who_is_there(&mut self) -> io::Result<()> {
        if self.is_attended {
            return Ok(());
        }
        if self.clients.have_all_gone() {
            self.unsent.clear();
            tcflush(&self.slave, FlushArg::TCIFLUSH)?;
            ioctl_tiocnxcl(&self.slave)?;
        }
        Ok(())
    }
}

/// The programs that have the far end open. Equal events in a row may reach us as one, so that
/// the count is not certain; who is heard is there in any case.
struct Clients {
    /// `None` where the system has no more to give: then somebody is taken to be there.
    events: Option<Inotify>,
    count: usize,
}

impl Clients {
    fn of(path: &Path) -> Self {
        let watch = || {
            let events = Inotify::init(InitFlags::IN_NONBLOCK | InitFlags::IN_CLOEXEC)?;
            let wanted = AddWatchFlags::IN_OPEN | AddWatchFlags::IN_CLOSE;
            events.add_watch(path, wanted)?;
            nix::Result::Ok(events)
        };
        Self {
            events: watch().ok(),
            count: 0,
        }
    }

    fn is_any(&self) -> bool {
        self.count > 0 || self.events.is_none()
    }

    fn heard(&mut self) {
        self.count = self.count.max(1);
    }

    /// Whether there was a moment without any since the last look.
    fn have_all_gone(&mut self) -> bool {
        let mut all_gone = false;
        while let Some(Ok(events)) = self.events.as_ref().map(Inotify::read_events) {
            for event in events {
                if event.mask.contains(AddWatchFlags::IN_OPEN) {
                    self.count += 1;
                } else {
                    self.count = self.count.saturating_sub(1);
                    all_gone |= self.count == 0;
                }
            }
        }
        all_gone
    }
}

impl Drop for Pty {
    fn drop(&mut self) {
        if let Some(link) = &self.link {
            // Only our own link is removed; another emulator may have taken the name over.
            if std::fs::read_link(link).is_ok_and(|target| target == self.path) {
                let _ = std::fs::remove_file(link);
            }
        }
    }
}

/// Waits for what a client says that it has sent; `false` when that is not there any more and nothing comes.
///
/// # Errors
/// When it does not come.
pub(super) fn await_readable(
    descriptor: BorrowedFd<'_>,
    is_there: &impl Fn() -> bool,
) -> io::Result<bool> {
    /// The kernel hands on what was written within microseconds, on a busy computer too.
    const LOOK_MS: u16 = 500;
    const LOOKS: u16 = 20;
    for _ in 0..LOOKS {
        let was_there = is_there();
        let mut fds = [PollFd::new(descriptor, PollFlags::POLLIN)];
        match poll(&mut fds, PollTimeout::from(LOOK_MS)) {
            Ok(0) if !was_there => return Ok(false),
            Ok(0) => {}
            Ok(_) | Err(Errno::EINTR) => return Ok(true),
            Err(errno) => return Err(errno.into()),
        }
    }
    Err(io::Error::other(
        "a participant reports more bytes sent than have arrived",
    ))
}

/// Points `link` at `target`; a file that is no link is left alone.
fn replace_link(target: &Path, link: &Path) -> io::Result<()> {
    if link.is_symlink() {
        std::fs::remove_file(link)?;
    }
    std::os::unix::fs::symlink(target, link)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rustix::termios::ioctl_tiocexcl;
    use std::fs::{File, Permissions};
    use std::io::{BufRead, BufReader, Read};
    use std::os::unix::fs::{MetadataExt as _, PermissionsExt as _};
    use std::os::unix::process::CommandExt as _;
    use std::process::{Command, Stdio};

    /// A user without any right of its own.
    const NOBODY: u32 = 65_534;

    fn client(pty: &Pty) -> File {
        let mut options = File::options();
        options.read(true).write(true).open(pty.path()).unwrap()
    }

    #[track_caller]
    fn check_heard(client: &mut File, expected: &[u8]) {
        let mut heard = vec![0; expected.len()];
        client.read_exact(&mut heard).unwrap();
        assert_eq!(heard, expected);
    }

    #[test]
    fn what_is_sent_while_no_program_has_it_open_is_lost() {
        let mut pty = Pty::open(None).unwrap();
        pty.send(b"before\r").unwrap();
        let mut first = client(&pty);
        pty.send(b"read\r").unwrap();
        check_heard(&mut first, b"read\r");
        pty.send(b"unread\r").unwrap();
        drop(first);
        pty.send(b"between\r").unwrap();
        let mut second = client(&pty);
        pty.send(b"after\r").unwrap();
        check_heard(&mut second, b"after\r");
    }

    #[test]
    fn a_program_that_is_slow_loses_whole_messages_and_only_when_all_buffers_are_full() {
        const SENT: usize = 5_000;
        let mut pty = Pty::open(None).unwrap();
        let slow = client(&pty);
        for number in 0..SENT {
            pty.send(line(number).as_bytes()).unwrap();
        }
        assert!(pty.has_unsent());
        let mut lines = BufReader::new(slow).split(b'\r');
        let mut heard = Vec::new();
        while pty.has_unsent() {
            heard.push(lines.next().unwrap().unwrap());
            pty.flush().unwrap();
        }
        pty.send(b"end\r").unwrap();
        heard.extend(lines.map(Result::unwrap).take_while(|line| line != b"end"));
        assert!(heard.len() < SENT, "nothing was lost");
        // The kernel moves bytes on in its own time, so that room, and with it a later line,
        // may follow lines that were lost. What was taken before the buffers were full is whole.
        let filled = UNSENT_MAX / line(0).len();
        let mut sent = 0..SENT;
        for (number, found) in heard.iter().enumerate() {
            let found = String::from_utf8_lossy(found) + "\r";
            let at = sent.find(|it| line(*it) == found);
            let at = at.unwrap_or_else(|| panic!("{found:?} was never sent, or before another"));
            assert!(number > filled || at == number, "{at} follows too early");
        }
        assert!(heard.len() > filled, "only {} lines", heard.len());
    }

    /// Root opens it in any case, so that somebody else tries.
    fn another_can_open(pty: &Pty) -> bool {
        let mut other = Command::new("sh");
        other.args(["-c", "exec 3<>\"$0\""]).arg(pty.path());
        other.stderr(Stdio::null());
        if std::fs::metadata(pty.path()).unwrap().uid() == 0 {
            let everybody = Permissions::from_mode(0o666);
            std::fs::set_permissions(pty.path(), everybody).unwrap();
            other.uid(NOBODY);
        }
        other.status().unwrap().success()
    }

    #[test]
    fn what_a_program_that_was_killed_had_for_itself_is_free_for_the_next() {
        let mut pty = Pty::open(None).unwrap();
        let killed = client(&pty);
        ioctl_tiocexcl(&killed).unwrap();
        pty.send(b"heard\r").unwrap();
        assert!(!another_can_open(&pty), "it has it for itself");
        drop(killed);
        pty.send(b"lost\r").unwrap();
        assert!(another_can_open(&pty), "nobody has it");
    }

    fn line(number: usize) -> String {
        format!("line {number:08} of many\r")
    }
}
