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

mod attendance;

use core::time::Duration;
use std::io::{self, Read};
use std::os::fd::AsFd;
use std::sync::mpsc::TryRecvError;

use nix::errno::Errno;
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use nix::sched::{CpuSet, sched_getaffinity};
use nix::unistd::Pid;
use units::Time;
use wire::Port;
use wire::lockstep::{Entry, Passed, Reply, Request};

use super::endpoint::Answered;
use super::endpoint::Endpoint;
use super::peer::{Ahead, Doing, Heard};
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
    /// Whether it was told that somebody does not keep the clock.
    has_told_of_strangers: bool,
}

impl Lockstep {
    /// A participant may compute or hang for `patience`; with `outlive` one that ends without
    /// taking leave does not end the machine.
    pub(super) fn new(site: Site, patience: Duration, outlive: bool) -> Self {
        Self {
            site,
            patience,
            outlive,
            has_told_of_strangers: false,
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
            self.live_on()?;
        }
        // All that was sent since somebody went on last, in one piece.
        self.flush()?;
        Ok(self.wake())
    }

    /// The machine lives until somebody goes on.
    fn live_on(&mut self) -> io::Result<()> {
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
        let until = until.min(self.site.machine.now() + STRIDE);
        loop {
            let peers = self.site.visitors.peers.iter();
            let ahead = peers.flat_map(|peer| peer.ahead.iter().map(|it| it.at));
            let next = ahead.fold(until, Time::min);
            self.site.machine.advance_until_delivery(next);
            self.hand_out()?;
            self.take_in_due()?;
            let mut peers = self.site.visitors.peers.iter();
            if self.site.machine.now() >= until || peers.any(|it| it.is_due) {
                return Ok(());
            }
        }
    }

    /// What was sent ahead of its time, which has come, reaches the machine.
    fn take_in_due(&mut self) -> io::Result<()> {
        let now = self.site.machine.now();
        for who in 0..self.site.visitors.peers.len() {
            let ahead = &mut self.site.visitors.peers[who].ahead;
            let due: Vec<_> = ahead.extract_if(.., |it| it.at <= now).collect();
            for it in due {
                let machine = &mut self.site.machine;
                let answered = self.site.endpoints[it.place].take_in(&it.sent, now, machine)?;
                self.pass_answer(who, it.place, it.port, answered);
            }
        }
        Ok(())
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
        let peer = &self.site.visitors.peers[who];
        let is_there = || !peer.has_hung_up();
        let place = peer.ports.iter().find(|(_, port)| **port == entry.port);
        let Some((&place, _)) = place else {
            return Ok(false);
        };
        let now = self.site.machine.now();
        let endpoint = &mut self.site.endpoints[place];
        match entry.passed {
            Passed::Units(units) => {
                let sent = endpoint.read(units, is_there)?;
                let answered = endpoint.take_in(&sent, now, &mut self.site.machine)?;
                self.pass_answer(who, place, entry.port, answered);
                self.tell_sharers(who, place, units);
                Ok(answered.is_awaited)
            }
            Passed::At { units, at } => {
                let (sent, port) = (endpoint.read(units, is_there)?, entry.port);
                self.site.visitors.peers[who].ahead.push(Ahead {
                    at,
                    place,
                    port,
                    sent,
                });
                // It lies before them already: who shares the interface hears it when it was sent.
                self.tell_sharers(who, place, units);
                Ok(false)
            }
            Passed::Recall => {
                let ahead = &mut self.site.visitors.peers[who].ahead;
                let recalled: Vec<_> = ahead.extract_if(.., |it| it.place == place).collect();
                for it in recalled {
                    let answered = self.site.endpoints[place].take_back(&it.sent)?;
                    self.pass_answer(who, place, it.port, answered);
                }
                Ok(false)
            }
            Passed::Control(control) => {
                endpoint.control(control, now, &mut self.site.machine);
                Ok(false)
            }
            Passed::Look => Ok(false),
        }
    }

    /// What an adapter says to what it was sent does not end a wait by itself: mostly that it was sent.
    fn pass_answer(&mut self, who: usize, place: usize, port: Port, answered: Answered) {
        if answered.units > 0 {
            let passed = Passed::Units(answered.units);
            let joins = self.site.endpoints[place].is_adapter();
            let peer = &mut self.site.visitors.peers[who];
            peer.pass(Entry { port, passed }, joins);
            peer.is_due |= answered.is_awaited;
        }
    }

    fn tell_sharers(&mut self, who: usize, place: usize, units: usize) {
        if self.site.endpoints[place].is_shared() {
            self.tell_others(Some(who), place, Passed::Units(units));
        }
    }

    /// Whoever has the port open hears it too, except who has sent it.
    fn tell_others(&mut self, sender: Option<usize>, place: usize, passed: Passed) {
        let joins = self.site.endpoints[place].is_adapter();
        let now = self.site.machine.now();
        for (who, peer) in self.site.visitors.peers.iter_mut().enumerate() {
            if let Some(&port) = peer.ports.get(&place)
                && Some(who) != sender
            {
                peer.hand(now, Entry { port, passed }, joins);
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
            if until <= now || peer.is_due {
                peer.wake(now);
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
        let of_strangers = fds.len();
        if !self.is_anybody_there() {
            let silent = self.site.endpoints.iter().filter_map(Endpoint::terminal_fd);
            fds.extend(silent.map(|fd| PollFd::new(fd, PollFlags::POLLIN)));
        }
        match poll(&mut fds, PollTimeout::from(LOOK_EVERY_MS)) {
            Ok(0) => return self.complain().map(|()| false),
            Ok(_) | Err(Errno::EINTR) => {}
            Err(errno) => return Err(errno.into()),
        }
        let is_woken = fds[0].any() == Some(true);
        // The door stands first among the visitors.
        let has_come = fds.get(1).is_some_and(|door| door.any() == Some(true));
        let mut strangers = fds[of_strangers..].iter();
        if strangers.any(|it| it.any() == Some(true)) {
            self.ignore_strangers()?;
        }
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

    /// What somebody who has ended had sent is still on its way, as on a real line: where it said how much that is,
    /// no more than that. The next program may have opened the port by now, and what it writes is its own.
    fn forget(&mut self, who: usize) -> io::Result<()> {
        let peer = &mut self.site.visitors.peers[who];
        if let Doing::Idle { sent, .. } = &mut peer.doing {
            for entry in core::mem::take(sent) {
                self.take_in_one(who, entry)?;
            }
        } else {
            let places: Vec<_> = peer.ports.keys().copied().collect();
            let now = self.site.machine.now();
            for place in places {
                self.site.endpoints[place].receive(now, &mut self.site.machine)?;
            }
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
            Request::Idle {
                until,
                unhurried,
                sent,
            } => {
                self.site.visitors.peers[who].doing = Doing::Idle {
                    until,
                    unhurried,
                    sent,
                };
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
}
