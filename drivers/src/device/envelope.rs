//! Motion envelope of one axis: the place and the speed that the active request allows.
//!
//! The envelope judges every sample, in every mode, also while no request is active. IEC 61800-5-2
//! names the same checks SOS, SLS, SLP and SDI where they are safety functions. These are not.
//!
//! A speed is judged over at least [`JUDGED_OVER`], by a cumulative sum (CUSUM) of what the axis
//! moved beyond 1.1 times the speed asked for. A vibration has no sum; a speed in a wrong unit has.
//!
//! | symbol | name |
//! |---|---|
//! | v, a | speed and deceleration asked for |
//! | v² / 2a | stopping way |
//! | lag | following-error limit |
//!
//! Absent: torque, jerk.

use core::time::Duration;

use units::{Coordinate, Quantity, Scale, Time};

use super::departure::{Asked, Departure};

/// A linear search may go so much farther than from one soft limit to the other.
pub const TRAVEL_MARGIN: f64 = 1.5;
/// One millisecond of jitter in five would be 20 % of false speed.
const JUDGED_OVER: Duration = Duration::from_millis(50);
/// A speed may be larger than asked by this factor.
const SPEED_MARGIN: f64 = 1.1;
/// A drive brakes later and softer than a calculation says.
const STOPPING_MARGIN: f64 = 1.5;
/// A step of more than so many times the speed asked for is no motion.
const STEP_MAX: f64 = 16.0;
/// More false positions in a row are no noise of the bus.
const IMPOSSIBLE_MAX: u8 = 5;
/// An axis is where it shall stand once so many samples lie there.
const QUIET_SAMPLES: u8 = 3;
/// From a command to the first sample that shows its effect, in SYNC periods.
const REACTION_PERIODS: u32 = 4;
/// Beside the bus, the drive takes its own time.
const REACTION: Duration = Duration::from_millis(20);

/// Figures of one axis, in counts and seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Figures {
    /// From sample to sample.
    pub(super) period: Duration,
    /// How much later a sample may be stamped.
    pub(super) stall_max: Duration,
    /// Following-error limit.
    pub(super) lag: i64,
    /// How far an axis that holds its place may leave that.
    pub(super) hold_limit: i64,
    /// How far a standing axis may be from its place.
    pub(super) window: i64,
    /// Counts per second that the axis can go at most.
    pub(super) speed_max: f64,
}

impl Profile {
    /// A motion at `speed` with `acceleration`, of an axis of `scale`.
    pub(super) fn new<Q: Coordinate>(
        scale: Scale<Q>,
        speed: Q::Speed,
        acceleration: Q::Acceleration,
    ) -> Self {
        let count = scale.resolution().abs().value();
        Self {
            speed: speed.abs().value() / count,
            acceleration: acceleration.abs().value() / count,
        }
    }

    /// What was written to a drive, in counts.
    pub(super) fn written(speed: u32, acceleration: u32) -> Self {
        Self {
            speed: f64::from(speed),
            acceleration: f64::from(acceleration),
        }
    }
}

/// The hold limit of an axis in counts: a tenth of its `lag` where none is set, at least its `window`.
pub(super) fn hold_limit<Q: Coordinate>(
    scale: Scale<Q>,
    set: Option<Q>,
    lag: i64,
    window: i64,
) -> i64 {
    let limit = set.map_or(lag / 10, |limit| scale.to_counts(limit).0.saturating_abs());
    limit.max(window)
}

/// A moment and a position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Point {
    pub(super) at: Time,
    pub(super) position: i64,
}

/// Speed and deceleration of a motion, counts per second and per second squared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Profile {
    pub(super) speed: f64,
    pub(super) acceleration: f64,
}

/// The request in force.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Request {
    /// Nothing is judged.
    Free,
    /// The axis settles near the first sample; where it stands becomes its place.
    Arriving {
        room: i64,
        near: Option<i64>,
        samples: u8,
    },
    Hold {
        place: i64,
    },
    Within {
        asked: Asked,
        low: i64,
        high: i64,
        profile: Profile,
    },
    /// Set-points of two spans of time, lowest and highest.
    Follow {
        newer: (i64, i64),
        older: (i64, i64),
        turned_at: Time,
    },
}

/// Judges the samples of one axis.
#[derive(Debug)]
pub(super) struct Envelope {
    figures: Figures,
    request: Request,
    /// Where the present span of judging began.
    mark: Option<Point>,
    samples: u32,
    /// Beyond the speed asked for, with growing and with falling counts.
    excess: [f64; 2],
    /// The largest part of that which one span alone has brought.
    largest: [f64; 2],
    /// While homing, the last position that the speed allows, and one after that which it does not.
    good: Option<Point>,
    odd: Option<i64>,
    /// So many samples in a row are where no axis can have gone.
    impossible: u8,
    /// The first long step, from where it began.
    stepped: Option<(Point, i64)>,
}

impl Envelope {
    pub(super) const fn new(figures: Figures) -> Self {
        Self {
            figures,
            request: Request::Free,
            mark: None,
            samples: 0,
            excess: [0.0; 2],
            largest: [0.0; 2],
            good: None,
            odd: None,
            impossible: 0,
            stepped: None,
        }
    }

    /// Nothing is asked, and nothing is judged: the axis is off, or is being switched off.
    pub(super) const fn release(&mut self) {
        self.request = Request::Free;
    }

    /// The drive is enabled: the axis holds where it was before, `near` that place.
    pub(super) const fn take_hold(&mut self, near: Option<i64>) {
        self.request = Request::Arriving {
            room: self.figures.hold_limit,
            near,
            samples: 0,
        };
    }

    /// A motion is over: the axis settles where the next sample shows it.
    pub(super) const fn settle(&mut self) {
        self.request = Request::Arriving {
            room: self.figures.lag,
            near: None,
            samples: 0,
        };
    }

    /// The axis stands at `position`: what settled has its place there, and what stopped, once
    /// nothing is under way.
    pub(super) const fn stand(&mut self, position: i64, is_idle: bool) {
        match self.request {
            Request::Arriving { .. } => self.hold(position),
            Request::Within {
                asked: Asked::Stop, ..
            } if is_idle => self.hold(position),
            Request::Within { .. }
            | Request::Follow { .. }
            | Request::Hold { .. }
            | Request::Free => {}
        }
    }

    /// The axis holds `place`.
    pub(super) const fn hold(&mut self, place: i64) {
        self.request = Request::Hold { place };
    }

    /// A motion from `here` to `target`.
    pub(super) fn begin_motion(&mut self, here: Point, target: i64, profile: Profile) {
        // A motion that is under way brakes first, perhaps in the other direction.
        let credit = self.present_stopping_way(profile.acceleration);
        let room = self.figures.lag + credit as i64;
        let (low, high) = (here.position.min(target), here.position.max(target));
        self.begin(here, Asked::Motion, (low - room, high + room), profile);
        self.excess = [-credit; 2];
    }

    /// A search from `here` over `reach` at most, in either direction.
    pub(super) fn begin_homing(&mut self, here: Point, reach: i64, profile: Profile) {
        let range = around(here.position, reach);
        self.begin(here, Asked::Homing, range, profile);
    }

    /// A stop from `here`, as the present motion brakes; not while the axis is free or holds its
    /// place.
    pub(super) fn begin_stop(&mut self, here: Point) {
        let profile = match self.request {
            Request::Within { profile, .. } => profile,
            Request::Free
            | Request::Arriving { .. }
            | Request::Hold { .. }
            | Request::Follow { .. } => return,
        };
        let way = self.stopping_way(profile.speed, profile.acceleration) as i64 + self.figures.lag;
        self.begin(here, Asked::Stop, around(here.position, way), profile);
    }

    /// Set-points are followed from `set_point` on.
    pub(super) const fn begin_following(&mut self, now: Time, set_point: i64) {
        let range = (set_point, set_point);
        self.request = Request::Follow {
            newer: range,
            older: range,
            turned_at: now,
        };
    }

    /// The next set-point.
    pub(super) fn follow(&mut self, now: Time, set_point: i64) {
        let Request::Follow {
            newer,
            older,
            turned_at,
        } = &mut self.request
        else {
            return self.begin_following(now, set_point);
        };
        if now.since(*turned_at) >= JUDGED_OVER {
            (*older, *newer, *turned_at) = (*newer, (set_point, set_point), now);
        } else {
            *newer = (newer.0.min(set_point), newer.1.max(set_point));
        }
    }

    /// Whether `position` is where a standing axis may be.
    pub(super) const fn is_in_place(&self, position: i64) -> bool {
        match self.request {
            Request::Hold { place } => (position - place).abs() <= self.figures.window,
            Request::Arriving { samples, .. } => samples >= QUIET_SAMPLES,
            Request::Within { .. } | Request::Follow { .. } | Request::Free => true,
        }
    }

    /// How far an axis may go on at `speed` until it stands, in counts.
    pub(super) fn stopping_way(&self, speed: f64, deceleration: f64) -> f64 {
        let reaction = (self.figures.period * REACTION_PERIODS + REACTION).as_secs_f64();
        STOPPING_MARGIN * speed * speed / (2.0 * deceleration.max(1.0)) + speed * reaction
    }

    /// Judges one sample.
    pub(super) fn judge(&mut self, at: Time, position: i64) -> Option<Departure> {
        let sample = Point { at, position };
        let (asked, (low, high), profile) = match self.request {
            Request::Free => return None,
            Request::Arriving {
                room,
                near,
                samples,
            } => {
                let near = near.unwrap_or(position);
                self.request = Request::Arriving {
                    room,
                    near: Some(near),
                    samples: samples.saturating_add(1),
                };
                (Asked::Hold, around(near, room), None)
            }
            Request::Hold { place } => (Asked::Hold, around(place, self.figures.hold_limit), None),
            Request::Within {
                asked,
                low,
                high,
                profile,
            } => {
                if asked == Asked::Homing && !self.takes_step(sample, profile) {
                    return self.judge_step(sample, profile);
                }
                (asked, (low, high), Some(profile))
            }
            Request::Follow { newer, older, .. } => {
                let (low, high) = (newer.0.min(older.0), newer.1.max(older.1));
                let lag = self.figures.lag;
                (Asked::Follow, (low - lag, high + lag), None)
            }
        };
        if position < low || position > high {
            let limit = if position < low { low } else { high };
            return Some(Departure::Place {
                asked,
                position,
                limit,
            });
        }
        self.judge_speed(sample, asked, profile?)
    }

    fn judge_speed(&mut self, sample: Point, asked: Asked, profile: Profile) -> Option<Departure> {
        self.samples = self.samples.saturating_add(1);
        let mark = *self.mark.get_or_insert(sample);
        // Samples that queued up are stamped together: at least a period lies between two.
        let stamped = sample.at.since(mark.at);
        let span = stamped.max(self.figures.period * self.samples) + self.figures.stall_max;
        if span < JUDGED_OVER {
            return None;
        }
        let moved = (sample.position - mark.position) as f64;
        let allowed = profile.speed * SPEED_MARGIN * span.as_secs_f64();
        (self.mark, self.samples) = (Some(sample), 0);
        let sums = self.excess.iter_mut().zip(&mut self.largest);
        for ((excess, largest), way) in sums.zip([moved, -moved]) {
            let beyond = way - allowed;
            *largest = largest.max(beyond);
            *excess = match *excess < 0.0 {
                true => *excess + beyond.max(0.0),
                false => (*excess + beyond).max(0.0),
            };
        }
        // A search may change its coordinates once, by less than a step.
        let is_search = asked == Asked::Homing;
        let once = self
            .largest
            .map(|largest| if is_search { largest } else { 0.0 });
        let mut sums = self.excess.iter().zip(once);
        let is_beyond = sums.any(|(excess, once)| excess - once > self.figures.hold_limit as f64);
        is_beyond.then(|| Departure::Speed {
            asked,
            limit: profile.speed,
            seen: moved.abs() / span.as_secs_f64(),
        })
    }

    /// Whether a position during homing is to be judged. One that is too far off is the first in
    /// new coordinates, or false: the next one tells. A speed that is too high makes every step too
    /// long.
    fn takes_step(&mut self, sample: Point, profile: Profile) -> bool {
        let Some(good) = self.good else {
            self.good = Some(sample);
            return true;
        };
        let figures = self.figures;
        let is_near = |from: i64, span: Duration| {
            let reach =
                profile.speed * SPEED_MARGIN * 2.0 * (span + figures.stall_max).as_secs_f64();
            (sample.position - from).abs() as f64 <= reach + figures.window as f64
        };
        let span = sample.at.since(good.at).max(figures.period);
        let can_be = |from: i64, span: Duration| {
            let reach = figures.speed_max * 2.0 * (span + figures.stall_max).as_secs_f64();
            (sample.position - from).abs() as f64 <= reach + figures.lag as f64
        };
        if let Some(odd) = self.odd
            && !can_be(good.position, span)
            && !can_be(odd, figures.period)
            && self.impossible < IMPOSSIBLE_MAX
        {
            self.impossible += 1;
            self.odd = Some(sample.position);
            return false;
        }
        self.impossible = 0;
        let odd = match (is_near(good.position, span), self.odd) {
            (true, _) => None,
            (false, None) => {
                self.odd = Some(sample.position);
                return false;
            }
            (false, Some(odd)) => Some(odd).filter(|odd| is_near(*odd, figures.period)),
        };
        (self.good, self.odd) = (Some(sample), None);
        if let Some(odd) = odd {
            self.shift(odd - good.position);
            return false;
        }
        true
    }

    /// A long step in the direction of the search that was followed by a change of coordinates: the
    /// axis came to its home too fast to be seen twice.
    fn judge_step(&mut self, sample: Point, profile: Profile) -> Option<Departure> {
        let (good, odd, mark) = (self.good?, self.odd?, self.mark?);
        let before = self.stepped.replace((good, odd))?;
        let (from, to) = before;
        let (step, searched) = (to - from.position, from.position - mark.position);
        let period = self.figures.period.as_secs_f64();
        let reach = profile.speed * SPEED_MARGIN * period;
        let seen = step.abs() as f64 / period;
        let is_motion = step.signum() == searched.signum() && seen < profile.speed * STEP_MAX;
        let is_fast = step.abs() as f64 > reach * 2.0 + self.figures.hold_limit as f64;
        let has_jumped = sample.position != to;
        (is_motion && is_fast && has_jumped).then_some(Departure::Speed {
            asked: Asked::Homing,
            limit: profile.speed,
            seen,
        })
    }

    /// The coordinates have changed by `step`.
    const fn shift(&mut self, step: i64) {
        if let Request::Within { low, high, .. } = &mut self.request {
            (*low, *high) = (*low + step, *high + step);
        }
        if let Some(mark) = &mut self.mark {
            mark.position += step;
        }
    }

    fn present_stopping_way(&self, deceleration: f64) -> f64 {
        match self.request {
            Request::Within { profile, .. } => {
                self.stopping_way(profile.speed, deceleration.min(profile.acceleration))
            }
            Request::Free
            | Request::Arriving { .. }
            | Request::Hold { .. }
            | Request::Follow { .. } => 0.0,
        }
    }

    fn begin(&mut self, here: Point, asked: Asked, (low, high): (i64, i64), profile: Profile) {
        self.request = Request::Within {
            asked,
            low,
            high,
            profile,
        };
        (self.mark, self.samples) = (Some(here), 0);
        (self.excess, self.largest) = ([0.0; 2], [0.0; 2]);
        (self.good, self.odd, self.impossible) = (Some(here), None, 0);
        self.stepped = None;
    }
}

/// `reach` around `place`.
const fn around(place: i64, reach: i64) -> (i64, i64) {
    (place.saturating_sub(reach), place.saturating_add(reach))
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD: Duration = Duration::from_millis(5);
    const PROFILE: Profile = Profile {
        speed: 10_000.0,
        acceleration: 100_000.0,
    };

    fn envelope() -> Envelope {
        Envelope::new(Figures {
            period: PERIOD,
            stall_max: Duration::ZERO,
            lag: 500,
            hold_limit: 50,
            window: 5,
            speed_max: 100_000.0,
        })
    }

    fn at(sample: u32) -> Time {
        Time::ZERO + PERIOD * sample
    }

    const START: Point = Point {
        at: Time::ZERO,
        position: 0,
    };

    /// Feeds positions one period apart and returns the first departure.
    fn judge(envelope: &mut Envelope, positions: impl Iterator<Item = f64>) -> Option<Departure> {
        let mut numbered = (1..).zip(positions);
        numbered.find_map(|(sample, position)| envelope.judge(at(sample), position as i64))
    }

    #[test]
    fn an_axis_that_leaves_its_place_departs() {
        let mut envelope = envelope();
        envelope.take_hold(None);
        assert_eq!(judge(&mut envelope, [1000.0, 1050.0].into_iter()), None);
        envelope.stand(1000, true);
        assert!(envelope.is_in_place(1005) && !envelope.is_in_place(1006));
        let seen = judge(&mut envelope, [1051.0].into_iter());
        let place = Departure::Place {
            asked: Asked::Hold,
            position: 1051,
            limit: 1050,
        };
        assert_eq!(seen, Some(place));
    }

    #[test]
    fn a_motion_at_the_speed_asked_for_stays_inside() {
        let mut envelope = envelope();
        envelope.begin_motion(START, 20_000, PROFILE);
        let way = (1..400).map(|sample| f64::from(sample * 52).min(20_100.0));
        assert_eq!(judge(&mut envelope, way), None);
    }

    #[test]
    fn a_speed_beyond_a_tenth_more_departs() {
        for factor in [1.3, 3.4, 10.0] {
            let mut envelope = envelope();
            envelope.begin_motion(START, 1_000_000, PROFILE);
            let way = (1..400).map(|sample| f64::from(sample) * 50.0 * factor);
            let seen = judge(&mut envelope, way);
            let Some(Departure::Speed { seen, limit, .. }) = seen else {
                panic!("{factor}: {seen:?}")
            };
            assert_eq!(limit, PROFILE.speed);
            assert!((seen / limit / factor - 1.0).abs() < 0.02, "{seen}");
        }
    }

    #[test]
    fn a_vibration_is_no_speed() {
        let mut envelope = envelope();
        let slow = Profile {
            speed: 100.0,
            ..PROFILE
        };
        envelope.begin_motion(START, 10_000, slow);
        let way = (1..4000).map(|sample: i32| {
            let sample = f64::from(sample);
            sample * 0.5 + 20.0 * (sample * 1.7).sin()
        });
        assert_eq!(judge(&mut envelope, way), None);
    }

    #[test]
    fn samples_that_arrive_together_are_no_speed() {
        let mut envelope = envelope();
        envelope.begin_motion(START, 1_000_000, PROFILE);
        // Twenty samples wait, then arrive within a microsecond each.
        for sample in 1..400_i64 {
            let late = Time::ZERO + PERIOD * (sample as u32 / 20 * 20 + 20);
            let stamp = late + Duration::from_micros(sample as u64 % 20);
            assert_eq!(envelope.judge(stamp, sample * 50), None);
        }
    }

    #[test]
    fn a_motion_past_its_target_departs() {
        let mut envelope = envelope();
        envelope.begin_motion(START, 2_000, PROFILE);
        let way = (1..400).map(|sample| f64::from(sample) * 50.0);
        let seen = judge(&mut envelope, way);
        assert!(matches!(
            seen,
            Some(Departure::Place {
                position: 2550,
                limit: 2500,
                ..
            })
        ));
    }

    #[test]
    fn a_motion_the_other_way_round_departs_at_the_following_error() {
        let mut envelope = envelope();
        envelope.begin_motion(START, 2_000, PROFILE);
        let way = (1..400).map(|sample| f64::from(sample) * -50.0);
        let seen = judge(&mut envelope, way);
        assert!(matches!(
            seen,
            Some(Departure::Place { position: -550, .. })
        ));
    }

    #[test]
    fn a_superseded_motion_may_brake_first() {
        let mut envelope = envelope();
        envelope.begin_motion(START, 100_000, PROFILE);
        // At 10 000 counts/s when it is sent back at a tenth of that.
        let here = Point {
            at: at(100),
            position: 5_000,
        };
        let slow = Profile {
            speed: 1_000.0,
            ..PROFILE
        };
        envelope.begin_motion(here, 0, slow);
        let (mut position, mut speed) = (5_000.0_f64, 10_000.0_f64);
        for sample in 101..500 {
            speed = (speed - 500.0).max(-1_000.0);
            position += speed * PERIOD.as_secs_f64();
            assert_eq!(envelope.judge(at(sample), position as i64), None);
        }
    }

    #[test]
    fn a_stop_has_its_stopping_way() {
        let mut stopping = envelope();
        stopping.begin_motion(START, 100_000, PROFILE);
        let here = Point {
            at: at(1),
            position: 5_000,
        };
        stopping.begin_stop(here);
        assert_eq!(stopping.judge(at(2), 5_500), None);
        assert!(stopping.judge(at(3), 7_000).is_some(), "it goes on");
    }

    #[test]
    fn homing_may_change_coordinates_once() {
        let mut homing = envelope();
        homing.begin_homing(START, 100_000, PROFILE);
        let way = (1..100).map(|sample| f64::from(sample) * 50.0);
        let after = (0..20).map(|_| -60_000.0);
        assert_eq!(judge(&mut homing, way.chain(after)), None);
        let mut noisy = envelope();
        noisy.begin_homing(START, 100_000, PROFILE);
        let way = (1..100).map(|sample| match sample % 7 {
            0 => 4e8,
            _ => f64::from(sample) * 50.0,
        });
        assert_eq!(judge(&mut noisy, way), None, "false positions");
        let mut fast = envelope();
        fast.begin_homing(START, 100_000_000, PROFILE);
        let way = (1..400).map(|sample| f64::from(sample) * 170.0);
        assert!(matches!(
            judge(&mut fast, way),
            Some(Departure::Speed { .. })
        ));
    }

    #[test]
    fn a_small_change_of_coordinates_is_no_speed() {
        let mut homing = envelope();
        homing.begin_homing(START, 100_000, PROFILE);
        let way = (1..100).map(|sample| f64::from(sample) * 50.0);
        let after = (100..200).map(|sample| f64::from(sample) * 50.0 + 90.0);
        assert_eq!(judge(&mut homing, way.chain(after)), None);
        let mut fast = envelope();
        fast.begin_homing(START, 100_000, PROFILE);
        let way = (1..100).map(|sample| f64::from(sample) * 65.0);
        assert!(judge(&mut fast, way).is_some(), "each span is beyond");
    }

    #[test]
    fn set_points_are_followed_within_the_following_error() {
        let mut envelope = envelope();
        envelope.begin_following(Time::ZERO, 0);
        for sample in 1..200_i64 {
            envelope.follow(at(sample as u32), sample * 40);
            assert_eq!(envelope.judge(at(sample as u32), sample * 40 - 300), None);
        }
        assert!(envelope.judge(at(200), 9_000).is_some());
    }
}
