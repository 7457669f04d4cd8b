//! The machine on a clock that all participants share: time passes only when nobody has
//! anything left to do.
//!
//! A participant that would wait says until when, and what it has sent since it last waited.
//! Once all of them wait, exactly that is taken in, in the order of the participants, and the
//! machine lives to the first moment that one of them waits for, or at which something
//! reaches one. Frames and bytes pass the kernel; nothing is guessed at, and how busy the
//! computer is changes nothing. The lines are those of [`wire::lockstep`].
//!
//! While there is no participant, time stands still. A participant that ends without signing off
//! (unless that is permitted), hangs, or computes without end is named, and the machine ends.

use core::time::Duration;
use std::io::{self, Read};
use std::os::fd::AsFd;
use std::sync::mpsc::TryRecvError;

use nix::errno::Errno;
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use nix::sched::{CpuSet, sched_getaffinity, sched_setaffinity};
use nix::unistd::Pid;
use units::Time;
use wire::Port;
use wire::lockstep::{Entry, Passed, Reply, Request, VERSION};

use super::endpoint::Endpoint;
use super::peer::{Doing, Heard};
use super::{Job, Site};

/// The machine lives no further at once, so that whoever asks for something meanwhile is
/// heard, however long everybody else waits.
const STRIDE: Duration = Duration::from_secs(1);
/// How often to look whether somebody hangs.
const LOOK_EVERY_MS: u16 = 500;

/// The calling thread.
const OWN: Pid = Pid::from_raw(0);

pub(super) struct Lockstep {
    site: Site,
    /// The processors on which this thread may compute.
    allowed: Option<CpuSet>,
    patience: Duration,
    outlive: bool,
}

impl Lockstep {
    /// A participant may compute or hang for `patience`; with `outlive` one that ends without
    /// taking leave does not end the machine.
    pub(super) fn new(site: Site, patience: Duration, outlive: bool) -> Self {
        Self {
            site,
            patience,
            outlive,
            allowed: sched_getaffinity(OWN).ok(),
        }
    }

    /// Until somebody stops it, a participant fails, or a terminal or interface does.
    pub(super) fn run(mut self) -> io::Result<()> {
        while !self.do_jobs() {
            if self.is_everybody_idle() {
                // Whoever goes on just now has nothing to say before somebody is waited for.
                if self.let_time_pass()? && !self.has_anybody_unheard() {
                    continue;
                }
            } else if self.wait()? {
                self.site.visitors.let_in()?;
            }
            self.hear_everybody()?;
        }
        Ok(())
    }

    /// True when it is time to stop.
    fn do_jobs(&mut self) -> bool {
        loop {
            match self.site.jobs.try_recv() {
                Ok(Job::Do(work)) => work(&mut self.site.machine),
                Ok(Job::Stop) | Err(TryRecvError::Disconnected) => return true,
                Err(TryRecvError::Empty) => return false,
            }
        }
    }

    /// Time waits for whoever works; with nobody there it stands still.
    fn is_everybody_idle(&self) -> bool {
        let mut anybody = false;
        self.site.visitors.peers.iter().all(|peer| {
            anybody |= matches!(peer.doing, Doing::Idle { .. });
            !matches!(peer.doing, Doing::Working(_))
        }) && anybody
    }

    fn has_anybody_unheard(&self) -> bool {
        let mut peers = self.site.visitors.peers.iter();
        peers.any(|peer| peer.has_unheard())
    }

    /// Whether somebody goes on.
    fn let_time_pass(&mut self) -> io::Result<bool> {
        let is_awaited = self.take_in()?;
        self.refuse_strangers()?;
        if !is_awaited {
            let waits = self
                .site
                .visitors
                .peers
                .iter()
                .filter_map(|peer| match peer.doing {
                    Doing::Idle { until, .. } => Some(until),
                    Doing::Nothing | Doing::Working(_) => None,
                });
            let until = waits.min().unwrap_or(Time::NEVER);
            let stride = self.site.machine.now() + STRIDE;
            self.site.machine.advance_until_delivery(until.min(stride));
            self.hand_out()?;
        }
        // All that was sent at this moment, in one piece.
        self.flush()?;
        Ok(self.wake())
    }

    fn flush(&mut self) -> io::Result<()> {
        let mut endpoints = self.site.endpoints.iter_mut();
        endpoints.try_for_each(Endpoint::flush)
    }

    /// What everybody has sent reaches the machine. Whether somebody waits for an answer that
    /// an adapter gives at once.
    fn take_in(&mut self) -> io::Result<bool> {
        let mut is_awaited = false;
        for who in 0..self.site.visitors.peers.len() {
            let Doing::Idle { sent, .. } = &mut self.site.visitors.peers[who].doing else {
                continue;
            };
            for entry in core::mem::take(sent) {
                is_awaited |= self.take_in_one(who, entry)?;
            }
        }
        Ok(is_awaited)
    }

    fn take_in_one(&mut self, who: usize, entry: Entry) -> io::Result<bool> {
        let ports = &self.site.visitors.peers[who].ports;
        let place = ports.iter().find(|(_, port)| **port == entry.port);
        let Some((&place, _)) = place else {
            return Ok(false);
        };
        let now = self.site.machine.now();
        let answered =
            self.site.endpoints[place].take_in(entry.passed, now, &mut self.site.machine)?;
        if answered.units > 0 {
            let passed = Passed::Units(answered.units);
            let port = entry.port;
            let joins = self.site.endpoints[place].is_adapter();
            self.site.visitors.peers[who].pass(Entry { port, passed }, joins);
        }
        if self.site.endpoints[place].is_shared() {
            self.tell_others(Some(who), place, entry.passed);
        }
        Ok(answered.is_awaited)
    }

    /// Whoever has the port open hears it too, except who has sent it.
    fn tell_others(&mut self, sender: Option<usize>, place: usize, passed: Passed) {
        let joins = self.site.endpoints[place].is_adapter();
        for (who, peer) in self.site.visitors.peers.iter_mut().enumerate() {
            if let Some(&port) = peer.ports.get(&place)
                && Some(who) != sender
            {
                peer.pass(Entry { port, passed }, joins);
            }
        }
    }

    /// Who sends without keeping the clock would have to be guessed at.
    fn refuse_strangers(&mut self) -> io::Result<()> {
        for endpoint in &mut self.site.endpoints {
            if let Some(frame) = endpoint.strange_frame()? {
                return Err(io::Error::other(format!(
                    "{}: the frame {frame} comes from a program that does not share the lockstep \
                     clock; give this machine an interface of its own, or leave --clock out",
                    endpoint.name()
                )));
            }
        }
        Ok(())
    }

    fn hand_out(&mut self) -> io::Result<()> {
        while let Some(delivery) = self.site.machine.collect() {
            let place = usize::from(delivery.port.0);
            let is_open = self
                .site
                .visitors
                .peers
                .iter()
                .any(|peer| peer.ports.contains_key(&place));
            // Nobody has opened it: it is lost, as on a real line.
            if !is_open {
                continue;
            }
            if let Some(passed) = self.site.endpoints[place].send(delivery.at, delivery.event)? {
                self.tell_others(None, place, passed);
            }
        }
        Ok(())
    }

    /// Whoever has something to hear, or waited until now, goes on; whether anybody does.
    fn wake(&mut self) -> bool {
        let now = self.site.machine.now();
        let mut any = false;
        for peer in &mut self.site.visitors.peers {
            let Doing::Idle { until, .. } = peer.doing else {
                continue;
            };
            if until <= now || !peer.passed.is_empty() {
                let sent = core::mem::take(&mut peer.passed);
                peer.set_working();
                peer.say(&Reply::Go { now, sent });
                any = true;
            }
        }
        any
    }

    /// Until somebody says something; whether somebody new has come.
    fn wait(&mut self) -> io::Result<bool> {
        let mut fds = vec![PollFd::new(self.site.waker.as_fd(), PollFlags::POLLIN)];
        fds.extend(self.site.visitors.fds());
        let unsent = self.site.endpoints.iter().filter_map(Endpoint::fd);
        let unsent = unsent.filter(|(_, unsent)| *unsent);
        fds.extend(unsent.map(|(fd, _)| PollFd::new(fd, PollFlags::POLLOUT)));
        match poll(&mut fds, PollTimeout::from(LOOK_EVERY_MS)) {
            Ok(0) => return self.complain().map(|()| false),
            Ok(_) | Err(Errno::EINTR) => {}
            Err(errno) => return Err(errno.into()),
        }
        let is_woken = fds[0].any() == Some(true);
        // The door stands first among the visitors.
        let has_come = fds.get(1).is_some_and(|door| door.any() == Some(true));
        if is_woken {
            let mut bytes = [0; 64];
            let _ = self.site.waker.read(&mut bytes)?;
        }
        self.flush()?;
        Ok(has_come)
    }

    /// Names whoever everybody waits for in vain.
    fn complain(&mut self) -> io::Result<()> {
        let at = self.site.machine.now().seconds();
        for peer in &mut self.site.visitors.peers {
            if let Doing::Working(watch) = &mut peer.doing
                && let Some(complaint) = watch.complaint(self.patience)
            {
                let who = peer.who();
                let text = format!("{who} {complaint}; the machine stands still at {at:.6} s");
                return Err(io::Error::other(text));
            }
        }
        Ok(())
    }

    fn hear_everybody(&mut self) -> io::Result<()> {
        let mut who = 0;
        while who < self.site.visitors.peers.len() {
            if self.hear(who)? {
                who += 1;
            } else {
                self.site.visitors.peers.remove(who);
            }
        }
        Ok(())
    }

    /// Whether it is still there.
    fn hear(&mut self, who: usize) -> io::Result<bool> {
        loop {
            // One that waits for the time says nothing.
            if matches!(self.site.visitors.peers[who].doing, Doing::Idle { .. }) {
                return Ok(true);
            }
            match self.site.visitors.peers[who].hear() {
                Heard::Nothing => return Ok(true),
                Heard::Said(Request::Bye) => return self.forget(who).map(|()| false),
                Heard::Said(request) => self.answer(who, request),
                Heard::Nonsense(what) => self.site.visitors.peers[who].say(&Reply::Refused(what)),
                Heard::Gone => return self.gone(who).map(|()| false),
            }
        }
    }

    /// A hand may go as it comes; who shares the clock takes leave.
    fn gone(&mut self, who: usize) -> io::Result<()> {
        let peer = &self.site.visitors.peers[who];
        if matches!(peer.doing, Doing::Nothing) {
            return Ok(());
        }
        let what = format!(
            "{} ended without signing off, at {:.6} s",
            peer.who(),
            self.site.machine.now().seconds()
        );
        if !self.outlive {
            return Err(io::Error::other(what));
        }
        eprintln!("mock-bus: {what}; time stands still until the next program joins");
        self.forget(who)
    }

    /// What somebody who has ended had sent is still on its way, as on a real line.
    fn forget(&mut self, who: usize) -> io::Result<()> {
        let places: Vec<_> = self.site.visitors.peers[who]
            .ports
            .keys()
            .copied()
            .collect();
        let now = self.site.machine.now();
        for place in places {
            self.site.endpoints[place].receive(now, &mut self.site.machine)?;
        }
        self.detach(who, None);
        self.follow(None);
        Ok(())
    }

    fn answer(&mut self, who: usize, request: Request) {
        let reply = match request {
            Request::Hello { version, pid, name } => self.welcome(who, version, pid, name),
            Request::Attach { port, endpoint } => self.attach(who, port, &endpoint),
            Request::Detach { port } => {
                self.detach(who, Some(port));
                return;
            }
            Request::Idle { until, sent } => {
                self.site.visitors.peers[who].doing = Doing::Idle { until, sent };
                return;
            }
            Request::On { cpu } => {
                self.follow(cpu);
                return;
            }
            Request::Do { words } => {
                let hands = &mut self.site.visitors.hands;
                let done = hands.do_words(&words, &mut self.site.machine);
                done.map_or_else(Reply::Refused, Reply::Done)
            }
            // Heard already.
            Request::Bye => return,
        };
        self.site.visitors.peers[who].say(&reply);
    }

    fn welcome(&mut self, who: usize, version: u32, pid: u32, name: String) -> Reply {
        if version != VERSION {
            return Reply::Refused(format!(
                "the program uses version {version} of the lockstep clock, this machine version \
                 {VERSION}"
            ));
        }
        self.site.visitors.peers[who].join(name, pid);
        Reply::Welcome(self.site.machine.now())
    }

    /// It has closed a port, or (with `None`) all of them.
    fn detach(&mut self, who: usize, port: Option<Port>) {
        let endpoints = &mut self.site.endpoints;
        self.site.visitors.peers[who].ports.retain(|place, known| {
            let stays = port.is_some_and(|port| *known != port);
            if !stays {
                // What cannot be tidied up now shows when the next one opens it.
                let _ = endpoints[*place].attend(false);
            }
            stays
        });
    }

    /// Computes where the only participant does: each only waits for the other.
    fn follow(&self, cpu: Option<u32>) {
        let joined = self.site.visitors.peers.iter();
        let alone = joined
            .filter(|peer| !matches!(peer.doing, Doing::Nothing))
            .count()
            == 1;
        let (Some(allowed), wanted) = (self.allowed, cpu.filter(|_| alone)) else {
            return;
        };
        let mut set = CpuSet::new();
        match wanted {
            Some(cpu) if set.set(cpu as usize).is_ok() => {}
            _ => set = allowed,
        }
        // A refusal costs speed only.
        let _ = sched_setaffinity(OWN, &set);
    }

    /// Who has that port open. One that was killed while it waits for the time is not heard before that comes:
    /// it is let go now, and heard of for the last time when it is heard next.
    fn who_has(&mut self, place: usize) -> Option<String> {
        let peers = &self.site.visitors.peers;
        let other = peers.iter().position(|it| it.ports.contains_key(&place))?;
        if peers[other].has_hung_up() && self.gone(other).is_ok() {
            self.site.visitors.peers[other].doing = Doing::Nothing;
            return None;
        }
        Some(self.site.visitors.peers[other].who())
    }

    fn attach(&mut self, who: usize, port: Port, endpoint: &str) -> Reply {
        let place = self
            .site
            .endpoints
            .iter()
            .position(|it| it.is_called(endpoint));
        let Some(place) = place else {
            let known: Vec<_> = self.site.endpoints.iter().map(Endpoint::name).collect();
            return Reply::Refused(format!(
                "this machine has no port {endpoint}; it has {}",
                known.join(", ")
            ));
        };
        if !self.site.endpoints[place].is_shared()
            && let Some(other) = self.who_has(place)
        {
            return Reply::Refused(format!("{other} has {endpoint} open"));
        }
        if let Err(error) = self.site.endpoints[place].attend(true) {
            return Reply::Refused(error.to_string());
        }
        self.site.endpoints[place].opened(self.site.machine.now(), &mut self.site.machine);
        self.site.visitors.peers[who].ports.insert(place, port);
        Reply::Attached
    }
}
