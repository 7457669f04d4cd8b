//! How much of a bus's time each identifier takes, from window to window.

use core::time::Duration;

use units::Time;
use wire::can::{CanFrame, CanId};

use crate::bus_account::bits;

/// The number of 11-bit identifiers.
const STANDARD: usize = 0x800;
/// So many 29-bit identifiers are told apart in one window: CANopen uses none, and one that fills
/// a bus is among the first.
const EXTENDED_MAX: usize = 64;

/// Who takes the largest share of a bus.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Loudest {
    pub(super) id: CanId,
    /// Of the bus's time. More than 1 where no bits are counted, as on a virtual interface.
    pub(super) share: f64,
}

/// This window and the one before it.
#[derive(Debug)]
pub(super) struct Load {
    bit: Duration,
    window: Duration,
    before: Window,
    now: Window,
    /// How old the last thing was that was heard, when it was heard.
    lag: Duration,
    /// Who took the largest share of a whole window since this was asked for.
    peak: Option<Loudest>,
}

impl Load {
    pub(super) fn new(bit: Duration, window: Duration) -> Self {
        Self {
            bit,
            window,
            before: Window::default(),
            now: Window::default(),
            lag: Duration::ZERO,
            peak: None,
        }
    }

    /// Looks for the largest share from now on.
    pub(super) fn forget_peak(&mut self) {
        self.peak = None;
    }

    /// Who took the largest share of the bus in a window since [`Load::forget_peak`], or takes it now.
    pub(super) fn peak(&self, now: Time) -> Option<Loudest> {
        let both = self.peak.clone().into_iter().chain(self.loudest(now));
        both.max_by(|a, b| a.share.total_cmp(&b.share))
    }

    /// Counts `frame`, which arrived at `at` and is looked at now.
    pub(super) fn count(&mut self, at: Time, now: Time, frame: &CanFrame) {
        self.reach(at, now);
        self.now.add(frame.id(), self.bit * bits(frame));
    }

    /// Counts `frames` that came and that this computer did not take.
    pub(super) fn lose(&mut self, at: Time, now: Time, frames: u32) {
        self.reach(at, now);
        self.now.lost += frames;
    }

    fn reach(&mut self, at: Time, now: Time) {
        self.lag = now.since(at);
        if at.since(self.now.since) >= self.window {
            self.peak = self.peak(now);
            core::mem::swap(&mut self.before, &mut self.now);
            self.now.begin(at);
        }
    }

    /// Who took the largest share lately. A computer that is behind what it hears judges the bus at
    /// the time of that.
    pub(super) fn loudest(&self, now: Time) -> Option<Loudest> {
        let heard = Time(now.0.saturating_sub(self.lag.as_nanos() as u64));
        let span = heard.since(self.before.since).as_secs_f64();
        if span > 3.0 * self.window.as_secs_f64() || span <= 0.0 {
            return None;
        }
        // Since when the talker talks is not known: the shorter of both spans favours him.
        let recent = heard.since(self.now.since).as_secs_f64();
        let is_long_enough = recent > 0.25 * self.window.as_secs_f64();
        let share = |id: CanId| {
            let (late, early) = (self.now.busy_s(id), self.before.busy_s(id));
            let of_both = (late + early) / span;
            match is_long_enough {
                true => of_both.max(late / recent),
                false => of_both,
            }
        };
        let heard = self.now.heard().chain(self.before.heard());
        let each = heard.map(|id| Loudest {
            id,
            share: share(id),
        });
        each.max_by(|a, b| a.share.total_cmp(&b.share))
    }
}

/// One place for each identifier: counting asks for no memory, the cyclic engine counts too.
#[derive(Debug)]
struct Window {
    since: Time,
    standard: Box<[Duration; STANDARD]>,
    /// The standard identifiers that were heard: few of all.
    heard: Vec<u16>,
    extended: Vec<(u32, Duration)>,
    frames: u32,
    lost: u32,
}

impl Default for Window {
    fn default() -> Self {
        Self {
            since: Time::ZERO,
            standard: Box::new([Duration::ZERO; STANDARD]),
            heard: Vec::with_capacity(STANDARD),
            extended: Vec::with_capacity(EXTENDED_MAX),
            frames: 0,
            lost: 0,
        }
    }
}

impl Window {
    fn begin(&mut self, since: Time) {
        self.since = since;
        for cob_id in self.heard.drain(..) {
            self.standard[usize::from(cob_id)] = Duration::ZERO;
        }
        self.extended.clear();
        (self.frames, self.lost) = (0, 0);
    }

    fn add(&mut self, id: CanId, span: Duration) {
        self.frames += 1;
        match id {
            CanId::Standard(cob_id) => self.add_standard(cob_id, span),
            CanId::Extended(raw) => self.add_extended(raw, span),
        }
    }

    fn add_standard(&mut self, cob_id: u16, span: Duration) {
        let Some(busy) = self.standard.get_mut(usize::from(cob_id)) else {
            return;
        };
        if *busy == Duration::ZERO {
            self.heard.push(cob_id);
        }
        *busy += span;
    }

    fn add_extended(&mut self, raw: u32, span: Duration) {
        match self.extended.iter().position(|(known, _)| *known == raw) {
            Some(at) => self.extended[at].1 += span,
            None if self.extended.len() < EXTENDED_MAX => self.extended.push((raw, span)),
            None => {}
        }
    }

    fn heard(&self) -> impl Iterator<Item = CanId> {
        let standard = self.heard.iter().map(|it| CanId::Standard(*it));
        standard.chain(self.extended.iter().map(|(raw, _)| CanId::Extended(*raw)))
    }

    /// How long `id` took the bus, in seconds. What was lost is taken to be of the same kinds as
    /// what was heard.
    fn busy_s(&self, id: CanId) -> f64 {
        let busy = match id {
            CanId::Standard(cob_id) => self.standard.get(usize::from(cob_id)).copied(),
            CanId::Extended(raw) => {
                let mut known = self.extended.iter();
                known.find(|(it, _)| *it == raw).map(|(_, busy)| *busy)
            }
        };
        let all = f64::from(self.frames) + f64::from(self.lost);
        let unheard = all / f64::from(self.frames.max(1));
        busy.unwrap_or_default().as_secs_f64() * unheard
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BIT: Duration = Duration::from_micros(1);
    const WINDOW: Duration = Duration::from_millis(20);
    const MS: u64 = 1_000_000;

    /// `id` every millisecond with 8 bytes for 60 ms, heard `lag_ms` after it came; `lost` frames
    /// with each. Returns the loudest `later_ms` after the last was heard.
    fn loudest(id: CanId, lag_ms: u64, lost: u32, later_ms: u64) -> Option<Loudest> {
        let mut load = Load::new(BIT, WINDOW);
        let frame = CanFrame::new(id, &[0; 8]).unwrap();
        for ms in 0..=60 {
            let (at, now) = (Time(ms * MS), Time((ms + lag_ms) * MS));
            load.count(at, now, &frame);
            load.lose(at, now, lost);
        }
        load.loudest(Time((60 + lag_ms + later_ms) * MS))
    }

    #[track_caller]
    fn check(seen: Option<Loudest>, id: CanId, share: f64) {
        let seen = seen.expect("somebody was heard");
        assert_eq!(seen.id, id);
        assert!((seen.share / share - 1.0).abs() < 0.1, "{seen:?}");
    }

    #[test]
    fn an_identifier_has_the_share_of_its_bits_whether_it_has_11_or_29() {
        let (standard, extended) = (CanId::Standard(0x7F0), CanId::Extended(0x123));
        check(loudest(standard, 0, 0, 0), standard, 0.111);
        check(loudest(extended, 0, 0, 0), extended, 0.131);
    }

    #[test]
    fn a_computer_that_is_behind_judges_the_bus_at_the_time_of_what_it_hears() {
        let id = CanId::Standard(0x001);
        check(loudest(id, 500, 0, 0), id, 0.111);
        // Who is silent now is not to blame.
        assert_eq!(loudest(id, 0, 0, 100), None);
    }

    #[test]
    fn frames_that_were_lost_count_with_those_that_were_heard() {
        let id = CanId::Standard(0x001);
        check(loudest(id, 0, 9, 0), id, 1.11);
    }

    #[test]
    fn more_identifiers_than_are_told_apart_are_no_trouble() {
        let mut load = Load::new(BIT, WINDOW);
        for raw in 0..1000 {
            let frame = CanFrame::new(CanId::Extended(raw), &[]).unwrap();
            load.count(Time(MS), Time(MS), &frame);
        }
        assert!(load.loudest(Time(2 * MS)).is_some());
    }
}
