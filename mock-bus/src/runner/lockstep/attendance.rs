//! Who takes part in the clock, at which ports, and on which processor.

use std::io;

use nix::sched::{CpuSet, sched_setaffinity};
use wire::Port;
use wire::lockstep::{Reply, VERSION};

use super::super::endpoint::Endpoint;
use super::super::peer::Doing;
use super::{Lockstep, OWN};

impl Lockstep {
    pub(super) fn welcome(&mut self, who: usize, version: u32, pid: u32, name: String) -> Reply {
        if version != VERSION {
            return Reply::Refused(format!(
                "the program uses version {version} of the lockstep clock, this machine version \
                 {VERSION}"
            ));
        }
        if let Err(error) = self.ignore_strangers() {
            return Reply::Refused(error.to_string());
        }
        self.site.visitors.peers[who].join(name, pid);
        Reply::Welcome(self.site.machine.now())
    }

    /// Whether anybody shares the clock.
    pub(super) fn is_anybody_there(&self) -> bool {
        let mut peers = self.site.visitors.peers.iter();
        peers.any(|it| !matches!(it.doing, Doing::Nothing))
    }

    /// What a program says that does not share the clock must not be taken for the words of the next one that does: that
    /// would wait for answers in vain, and so would all after it. Looked for before anybody joins, who has written
    /// nothing yet.
    pub(super) fn ignore_strangers(&mut self) -> io::Result<()> {
        for place in 0..self.site.endpoints.len() {
            let mut peers = self.site.visitors.peers.iter();
            if peers.any(|it| it.ports.contains_key(&place)) {
                continue;
            }
            let endpoint = &mut self.site.endpoints[place];
            let dropped = endpoint.drop_heard()?;
            if dropped > 0 && !self.has_told_of_strangers {
                self.has_told_of_strangers = true;
                eprintln!(
                    "mock-bus: {}: a program that does not share the lockstep clock speaks there and is not answered: \
                     run it with the --clock of this machine, or this machine without one",
                    endpoint.name()
                );
            }
        }
        Ok(())
    }

    /// It has closed a port, or (with `None`) all of them.
    pub(super) fn detach(&mut self, who: usize, port: Option<Port>) {
        let endpoints = &mut self.site.endpoints;
        let peer = &mut self.site.visitors.peers[who];
        peer.ahead
            .retain(|it| port.is_some_and(|port| it.port != port));
        peer.ports.retain(|place, known| {
            let stays = port.is_some_and(|port| *known != port);
            if !stays {
                // What cannot be tidied up now shows when the next one opens it.
                let _ = endpoints[*place].attend(false);
            }
            stays
        });
    }

    /// Computes where the only participant does: each only waits for the other.
    pub(super) fn follow(&self, cpu: Option<u32>) {
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

    pub(super) fn attach(&mut self, who: usize, port: Port, endpoint: &str) -> Reply {
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
