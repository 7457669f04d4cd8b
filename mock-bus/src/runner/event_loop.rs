//! Waits for clients and for the machine's next event, and carries between them.

use std::io::{self, Read};
use std::os::fd::AsFd;
use std::sync::mpsc::TryRecvError;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use nix::errno::Errno;
use nix::poll::{PollFd, PollFlags, ppoll};
use nix::sys::time::TimeSpec;
use units::Time;

use super::endpoint::Endpoint;
use super::{Job, Pauses, Site};

/// Shorter waits are not worth a system call; what is due meanwhile is done together.
const WAIT_MIN: Duration = Duration::from_micros(100);
const WAIT_MAX: Duration = Duration::from_secs(1);
/// A shorter pause is an ordinary computer's.
const PAUSE_MIN: Duration = Duration::from_millis(20);

pub(super) struct EventLoop {
    site: Site,
    started: Instant,
    speed: f64,
    pauses: Arc<Mutex<Pauses>>,
}

impl EventLoop {
    pub(super) fn new(site: Site, speed: f64, pauses: Arc<Mutex<Pauses>>) -> Self {
        Self {
            site,
            started: Instant::now(),
            speed,
            pauses,
        }
    }

    /// Until somebody stops it, or a terminal or interface fails.
    pub(super) fn run(mut self) -> io::Result<()> {
        loop {
            let now = self.now();
            self.note_pause(now);
            for endpoint in &mut self.site.endpoints {
                endpoint.receive(now, &mut self.site.machine)?;
            }
            self.site.machine.advance(now);
            self.hand_out()?;
            if self.do_jobs()? {
                return Ok(());
            }
            if self.site.visitors.lend_hands(&mut self.site.machine)? {
                self.hand_out()?;
            }
            self.wait()?;
        }
    }

    /// What was due and was not done: the computer has kept this thread from it.
    fn note_pause(&self, now: Time) {
        let late = now.since(self.site.machine.next_event());
        let pause = late.div_f64(self.speed);
        if pause >= PAUSE_MIN {
            let mut pauses = self.pauses.lock().unwrap_or_else(PoisonError::into_inner);
            pauses.count += 1;
            pauses.last = Some((now, pause));
        }
    }

    fn now(&self) -> Time {
        Time::from_seconds(self.started.elapsed().as_secs_f64() * self.speed)
    }

    /// True when it is time to stop. What one job sets off has left before the next begins.
    fn do_jobs(&mut self) -> io::Result<bool> {
        loop {
            match self.site.jobs.try_recv() {
                Ok(Job::Do(work)) => work(&mut self.site.machine),
                Ok(Job::Stop) | Err(TryRecvError::Disconnected) => return Ok(true),
                Err(TryRecvError::Empty) => return Ok(false),
            }
            let now = self.now();
            self.site.machine.advance(now);
            self.hand_out()?;
        }
    }

    fn hand_out(&mut self) -> io::Result<()> {
        while let Some(delivery) = self.site.machine.collect() {
            let place = usize::from(delivery.port.0);
            self.site.endpoints[place].send(delivery.at, delivery.event)?;
        }
        Ok(())
    }

    fn wait(&mut self) -> io::Result<()> {
        let span = self.span_to(self.site.machine.next_event());
        let mut fds = vec![PollFd::new(self.site.waker.as_fd(), PollFlags::POLLIN)];
        for (fd, unsent) in self.site.endpoints.iter().filter_map(Endpoint::fd) {
            let sending = if unsent {
                PollFlags::POLLOUT
            } else {
                PollFlags::empty()
            };
            fds.push(PollFd::new(fd, PollFlags::POLLIN | sending));
        }
        fds.extend(self.site.visitors.fds());
        match ppoll(&mut fds, Some(TimeSpec::from_duration(span)), None) {
            Ok(_) | Err(Errno::EINTR) => {}
            Err(errno) => return Err(errno.into()),
        }
        if fds[0].any() == Some(true) {
            let mut bytes = [0; 64];
            let _ = self.site.waker.read(&mut bytes)?;
        }
        Ok(())
    }

    /// Wall time until the machine's clock reaches `next`.
    fn span_to(&self, next: Time) -> Duration {
        if next == Time::NEVER {
            return WAIT_MAX;
        }
        let ahead_s = (next.seconds() - self.now().seconds()) / self.speed;
        Duration::try_from_secs_f64(ahead_s)
            .unwrap_or(Duration::ZERO)
            .clamp(WAIT_MIN, WAIT_MAX)
    }
}
