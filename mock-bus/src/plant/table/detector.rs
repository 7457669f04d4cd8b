//! What sees the plate's lines pass, and the edges that it gives.

use core::time::Duration;
use std::collections::{BTreeMap, BTreeSet, VecDeque};

use units::{Radians, Time};

use crate::plant::parts::pulse::ProbeEdge;
use crate::random::Stream;

use super::config::DetectorConfig;

/// Edges that nobody takes are forgotten, the oldest first.
const EDGES_MAX: usize = 1024;
/// How far behind a line a scratch lies that gives a second edge.
const SCRATCH_ARCSEC: f64 = 40.0;

/// A line passes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Passage {
    pub(super) line: u32,
    pub(super) at: Time,
    /// The reading, not rounded, at that moment.
    pub(super) reading: f64,
    /// Radians per second.
    pub(super) speed: f64,
}

#[derive(Clone, Debug)]
pub(super) struct Detector {
    noise: f64,
    latency_s: f64,
    pulse_s: f64,
    scratched: BTreeSet<u32>,
    /// By how much lines are seen beside their places, radians.
    shifted: BTreeMap<u32, f64>,
    dead: bool,
    edges: VecDeque<ProbeEdge>,
    passages: u64,
    stream: Stream,
}

impl Detector {
    pub(super) fn new(config: &DetectorConfig, seed: u64) -> Self {
        Self {
            noise: Radians::from_arcsec(config.noise_arcsec).value(),
            latency_s: config.latency_us * 1e-6,
            pulse_s: config.pulse_us * 1e-6,
            scratched: BTreeSet::new(),
            shifted: BTreeMap::new(),
            dead: false,
            edges: VecDeque::new(),
            passages: 0,
            stream: Stream::new(seed, "line detector"),
        }
    }

    /// A scratch beside a line gives an edge of its own, and adds to the light.
    pub(super) fn scratch(&mut self, line: u32, scratched: bool) {
        if scratched {
            self.scratched.insert(line);
        } else {
            self.scratched.remove(&line);
        }
    }

    /// A bump that comes whenever the line does.
    pub(super) fn shift(&mut self, line: u32, shift: Radians) {
        self.shifted.insert(line, shift.value());
    }

    /// By how much a line is seen beside its place.
    pub(super) fn shift_of(&self, line: u32) -> f64 {
        self.shifted.get(&line).copied().unwrap_or(0.0)
    }

    /// Whether there is a scratch beside a line.
    pub(super) fn is_scratched(&self, line: u32) -> bool {
        self.scratched.contains(&line)
    }

    pub(super) const fn is_dead(&self) -> bool {
        self.dead
    }

    pub(super) const fn set_dead(&mut self, dead: bool) {
        self.dead = dead;
    }

    /// How many lines it has seen.
    pub(super) const fn passages(&self) -> u64 {
        self.passages
    }

    /// A line passes; `counts` is what the encoder makes of a reading.
    pub(super) fn see(&mut self, passage: Passage, counts: impl Fn(f64) -> i64) {
        if self.dead {
            return;
        }
        self.passages += 1;
        let noise = self.noise * self.stream.gaussian() + self.shift_of(passage.line);
        self.pulse(passage, noise, &counts);
        if self.is_scratched(passage.line) {
            let behind = Radians::from_arcsec(SCRATCH_ARCSEC).value();
            let later = Passage {
                at: passage.at + span(behind / passage.speed.abs()),
                reading: passage.reading + behind * passage.speed.signum(),
                ..passage
            };
            let noise = self.noise * self.stream.gaussian();
            self.pulse(later, noise, &counts);
        }
    }

    fn pulse(&mut self, passage: Passage, noise: f64, counts: &impl Fn(f64) -> i64) {
        for (after_s, rising) in [
            (self.latency_s, true),
            (self.latency_s + self.pulse_s, false),
        ] {
            if self.edges.len() >= EDGES_MAX {
                self.edges.pop_front();
            }
            let reading = passage.reading + noise + passage.speed * after_s;
            self.edges.push_back(ProbeEdge {
                at: passage.at + span(after_s),
                rising,
                count: counts(reading),
            });
        }
    }

    /// The next edge that has come by `now`.
    pub(super) fn take(&mut self, now: Time) -> Option<ProbeEdge> {
        let first = self.edges.front()?;
        if first.at > now {
            return None;
        }
        self.edges.pop_front()
    }
}

fn span(seconds: f64) -> Duration {
    Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX)
}
