//! Values of a detector on their way into a correction: they come and go without a jump.
//!
//! Source: none; the rules for a beam that is blocked, saturated, stale or implausible are
//! those of the machine's configuration: hold, fade out over a set time, or stop.
//!
//! Whenever what is wanted changes its origin (a detector comes, goes, returns; a reference is
//! exchanged), the difference between the value given out last and the value wanted now is kept
//! as an offset that shrinks to nothing over a set time. The value given out has no jump then,
//! by construction.
//!
//! What may fade to zero must be a difference: a temperature goes through a feed as what it is
//! above its reference.

use core::fmt;
use core::time::Duration;

use units::portable::powi;
use units::{Quantity, Time};

use super::Trouble;

/// What is done when a detector is in trouble longer than is tolerated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reaction {
    /// The last good value stays.
    Hold,
    /// It fades to zero over this time.
    FadeOut(Duration),
    /// It stays, and the machine is to stop.
    Stop,
}

/// The time constant by which a lag is followed, in units of that of what lags. Followed as slowly as the value itself,
/// a lag that has ended would seem to last: three time constants after its end four times of what is left of it.
const LAG_CONSTANT: f64 = 0.5;

/// How a feed treats its detector.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FeedSettings {
    /// How long trouble is tolerated; the last good value stays meanwhile. A detector that was
    /// never believed has as long, from the first time that it was asked.
    pub patience: Duration,
    /// What happens then.
    pub reaction: Reaction,
    /// How long the way to a new or returned detector takes.
    pub blend: Duration,
    /// Good values in a row needed before a detector is believed (again); 1 at least.
    pub confirm: u32,
    /// Time constant by which good values are smoothed against noise; zero for none. What the
    /// detectors see beyond their references changes over minutes, and little along the axes.
    pub smoothing: Duration,
    /// How often each sample is given in a row, 1 where each is given once: noise that stays for several values is
    /// smoothed less than noise that is another in each.
    pub repeats: u32,
}

/// What stands behind the value a feed gives out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FeedStatus {
    /// Nothing is believed yet: zero is given out. With the trouble there is, if any; beyond what
    /// is tolerated it is this only by [`Reaction::Hold`], since there is nothing to hold.
    Waiting(Option<Trouble>),
    /// A good value, on the way to it or at it.
    Good,
    /// The last good value, trouble being tolerated.
    Tolerated(Trouble),
    /// The last good value, by [`Reaction::Hold`].
    Held(Trouble),
    /// Fading out or faded, by [`Reaction::FadeOut`].
    Faded(Trouble),
    /// The last good value, or zero when there was none; the machine is to stop, by [`Reaction::Stop`].
    Stop(Trouble),
    /// Switched off: fading to zero or there.
    Off,
}

impl fmt::Display for FeedStatus {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Waiting(None) => f.write_str("no value accepted yet"),
            Self::Waiting(Some(trouble)) => write!(f, "{trouble}; no value was ever accepted"),
            Self::Good => f.write_str("good"),
            Self::Tolerated(trouble) => write!(f, "{trouble}; tolerated so far"),
            Self::Held(trouble) => write!(f, "{trouble}; its last value is held"),
            Self::Faded(trouble) => write!(f, "{trouble}; its value has faded out"),
            Self::Stop(trouble) => write!(f, "{trouble}"),
            Self::Off => f.write_str("switched off"),
        }
    }
}

#[derive(Clone, Copy, Debug)]
enum State {
    Off,
    /// Nothing is believed yet; since the first value, with the number of good ones in a row.
    Waiting {
        since: Option<Time>,
        good: u32,
    },
    Good,
    Troubled {
        since: Time,
        good: u32,
    },
}

impl State {
    const WAITING: Self = Self::Waiting {
        since: None,
        good: 0,
    };
}

/// N values of one detector.
#[derive(Clone, Debug)]
pub struct Feed<Q, const N: usize> {
    settings: FeedSettings,
    state: State,
    status: FeedStatus,
    /// The next good value is blended to.
    jump: bool,
    last: Time,
    /// What is wanted while nothing good comes.
    held: [Q; N],
    /// How far smoothing lags behind, itself smoothed.
    lag: [Q; N],
    /// What noise makes of it.
    noise: [LagNoise; N],
    output: [Q; N],
    /// Output − wanted when what is wanted changed its origin, and how it shrinks from there.
    offset: [Q; N],
    since: Time,
    over: Duration,
}

impl<Q: Quantity, const N: usize> Feed<Q, N> {
    /// A feed that gives out zero until its detector is believed.
    pub fn new(settings: FeedSettings) -> Self {
        Self {
            settings,
            state: State::WAITING,
            status: FeedStatus::Waiting(None),
            jump: false,
            last: Time::ZERO,
            held: [Q::ZERO; N],
            lag: [Q::ZERO; N],
            noise: [LagNoise::default(); N],
            output: [Q::ZERO; N],
            offset: [Q::ZERO; N],
            since: Time::ZERO,
            over: Duration::ZERO,
        }
    }

    /// Takes what the detector says at `now` and gives out the values to use.
    pub fn advance(&mut self, now: Time, measured: Result<[Q; N], Trouble>) -> [Q; N] {
        let finite = |it: &[Q; N]| it.iter().all(|q| q.is_finite());
        let measured = measured.and_then(|it| {
            let (seen, low, high) = (f64::NAN, f64::MIN, f64::MAX);
            let trouble = Trouble::Implausible { seen, low, high };
            if finite(&it) { Ok(it) } else { Err(trouble) }
        });
        match measured {
            Ok(value) => self.good(now, value),
            Err(trouble) => self.bad(now, trouble),
        }
        self.last = now;
        self.give(now)
    }

    /// Gives out the values at `now` while nothing new has come: the value taken last is neither counted nor smoothed
    /// again.
    pub fn repeat(&mut self, now: Time) -> [Q; N] {
        self.give(now)
    }

    /// Switches off: the values fade to zero over `fade`, whatever the detector says.
    pub fn disable(&mut self, now: Time, fade: Duration) {
        self.state = State::Off;
        self.status = FeedStatus::Off;
        self.turn_to(now, [Q::ZERO; N], fade);
    }

    /// Switches on again after [`disable`](Self::disable); nothing when it is on.
    pub fn enable(&mut self) {
        if let State::Off = self.state {
            self.state = State::WAITING;
            self.status = FeedStatus::Waiting(None);
        }
    }

    /// Announces that the next good value will differ although nothing moved: the reference
    /// was exchanged, a memory switched. It is blended to.
    pub fn expect_jump(&mut self) {
        self.jump = true;
    }

    /// Goes on where `before`, a feed of the same detector, has got to; if another value is wanted
    /// from now on, it is blended to.
    pub fn take_over(&mut self, before: &Self) {
        *self = Self {
            settings: self.settings,
            jump: true,
            ..before.clone()
        };
    }

    /// The same values count from elsewhere: all of them are larger by `by`.
    pub fn shift(&mut self, by: [Q; N]) {
        self.held = core::array::from_fn(|i| self.held[i] + by[i]);
        self.output = core::array::from_fn(|i| self.output[i] + by[i]);
    }

    /// What stands behind the values given out last.
    pub fn status(&self) -> FeedStatus {
        self.status
    }

    /// The values given out last.
    pub fn values(&self) -> [Q; N] {
        self.output
    }

    /// How far the values given out last are from what was wanted then, by the largest: next to
    /// nothing but while one blends into the other, smoothing lags behind or one fades out. What noise
    /// makes of a lag is taken off in the mean square: it is part of what is stated of the detector.
    pub fn left(&self) -> Q {
        let each = self.output.iter().zip(&self.held).zip(&self.lag);
        let each = each.zip(&self.noise);
        let each = each.map(|(((output, held), lag), noise)| {
            (*output - *held).abs() + Q::from_value(noise.beyond(lag.value()))
        });
        each.fold(Q::ZERO, Q::max)
    }

    fn good(&mut self, now: Time, value: [Q; N]) {
        let confirm = self.settings.confirm.max(1);
        match self.state {
            State::Off => return,
            State::Good if !self.jump => {
                self.smooth(now, value);
                return;
            }
            State::Waiting { since, good } if good + 1 < confirm => {
                let since = since.or(Some(now));
                let good = good + 1;
                self.state = State::Waiting { since, good };
                return;
            }
            State::Troubled { since, good } if good + 1 < confirm => {
                self.state = State::Troubled {
                    since,
                    good: good + 1,
                };
                return;
            }
            State::Good | State::Waiting { .. } | State::Troubled { .. } => {}
        }
        self.state = State::Good;
        self.status = FeedStatus::Good;
        self.jump = false;
        self.turn_to(now, value, self.settings.blend);
    }

    fn bad(&mut self, now: Time, trouble: Trouble) {
        let since = match self.state {
            State::Off => return,
            State::Waiting { since, .. } => {
                let since = since.unwrap_or(now);
                self.state = State::Waiting {
                    since: Some(since),
                    good: 0,
                };
                self.status = self.never_seen(now, since, trouble);
                return;
            }
            State::Good => now,
            State::Troubled { since, .. } => since,
        };
        self.state = State::Troubled { since, good: 0 };
        if now.since(since) < self.settings.patience {
            self.status = FeedStatus::Tolerated(trouble);
            return;
        }
        let faded = matches!(self.status, FeedStatus::Faded(_));
        self.status = match self.settings.reaction {
            Reaction::Hold => FeedStatus::Held(trouble),
            Reaction::Stop => FeedStatus::Stop(trouble),
            Reaction::FadeOut(fade) => {
                if !faded {
                    self.turn_to(now, [Q::ZERO; N], fade);
                }
                FeedStatus::Faded(trouble)
            }
        };
    }

    /// Of a detector that was in trouble from the beginning: zero is given out as it is.
    fn never_seen(&self, now: Time, since: Time, trouble: Trouble) -> FeedStatus {
        let tolerated = now.since(since) < self.settings.patience;
        match self.settings.reaction {
            _ if tolerated => FeedStatus::Waiting(Some(trouble)),
            Reaction::Hold => FeedStatus::Waiting(Some(trouble)),
            Reaction::FadeOut(_) => FeedStatus::Faded(trouble),
            Reaction::Stop => FeedStatus::Stop(trouble),
        }
    }

    /// A low pass of first order, whatever the time between two samples.
    fn smooth(&mut self, now: Time, value: [Q; N]) {
        let passed = now.since(self.last).as_secs_f64();
        let constant = self.settings.smoothing.as_secs_f64();
        let share = if constant > 0.0 {
            passed / (passed + constant)
        } else {
            1.0
        };
        let quick = share / (share + (1.0 - share) * LAG_CONSTANT);
        let repeats = self.settings.repeats.max(1);
        let passed = noise_passed(share, quick, repeats);
        for (i, value) in value.into_iter().enumerate() {
            self.held[i] = self.held[i] + (value - self.held[i]) * share;
            self.lag[i] = self.lag[i] + (value - self.held[i] - self.lag[i]) * quick;
            self.noise[i].take(value.value(), share, passed);
        }
    }

    /// From now on `wanted` is wanted, reached over `over` from what was given out last.
    fn turn_to(&mut self, now: Time, wanted: [Q; N], over: Duration) {
        self.held = wanted;
        self.lag = [Q::ZERO; N];
        self.noise = [LagNoise::default(); N];
        self.offset = core::array::from_fn(|i| self.output[i] - wanted[i]);
        self.since = now;
        self.over = over;
    }

    fn give(&mut self, now: Time) -> [Q; N] {
        let passed = now.since(self.since).as_secs_f64();
        let over = self.over.as_secs_f64();
        let left = if passed < over {
            1.0 - passed / over
        } else {
            0.0
        };
        self.output = core::array::from_fn(|i| self.held[i] + self.offset[i] * left);
        self.output
    }
}

/// How much of the mean square of changes from value to value is in that of a lag, where all is noise: values are smoothed by
/// the first share, their lag by the second, and each sample is given `repeats` times.
///
/// White noise of variance σ² goes through a low pass of pole a, whose output is taken off it, and one of pole b:
/// (1 − b)²·a²·2σ²/((1 − ab)(1 + a)(1 + b)) is left, the poles being those from sample to sample. A sample that stays for
/// n values changes them by 2σ²/n in the mean square.
fn noise_passed(share: f64, quick: f64, repeats: u32) -> f64 {
    let pole = |share: f64| powi(1.0 - share, i32::try_from(repeats).unwrap_or(i32::MAX));
    let (a, b) = (pole(share), pole(quick));
    f64::from(repeats) * (powi((1.0 - b) * a, 2) / ((1.0 - a * b) * (1.0 + a) * (1.0 + b)))
}

/// What the noise of samples makes of a lag, told by how they change from one to the next: what a machine sees on its
/// way changes little from sample to sample, and much over the time that smoothing takes.
#[derive(Clone, Copy, Debug, Default)]
struct LagNoise {
    last: Option<f64>,
    /// The mean square of changes from value to value.
    changes: f64,
    /// The mean square of the lag by noise.
    square: f64,
}

impl LagNoise {
    /// Takes a value that was smoothed by `share`; so much of its changes is `passed` to the lag.
    fn take(&mut self, value: f64, share: f64, passed: f64) {
        if share <= 0.0 {
            return;
        }
        let change = self.last.map_or(0.0, |last| value - last);
        self.last = Some(value);
        self.changes += (change * change - self.changes) * share;
        self.square = self.changes * passed;
    }

    /// How much of a lag is not noise.
    fn beyond(&self, lag: f64) -> f64 {
        (lag * lag - self.square).max(0.0).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::Noise;

    const SMOOTHING: Duration = Duration::from_millis(100);

    fn feed(repeats: u32) -> Feed<units::Metres, 1> {
        Feed::new(FeedSettings {
            patience: Duration::ZERO,
            reaction: Reaction::Hold,
            blend: Duration::ZERO,
            confirm: 1,
            smoothing: SMOOTHING,
            repeats,
        })
    }

    /// Values each 2 ms, by `value` of milliseconds, that each stay so often, with noise of 1; what `seen` makes of the
    /// feed after each.
    fn each_told(
        repeats: u32,
        value: impl Fn(u64) -> f64,
        mut seen: impl FnMut(u64, &Feed<units::Metres, 1>),
    ) {
        let (mut feed, mut noise, mut now) = (feed(repeats), Noise(77), 0.0);
        for at in 0..100_000_u64 {
            if at.is_multiple_of(repeats.into()) {
                now = value(2 * at) + noise.normal();
            }
            let time = Time::ZERO + Duration::from_millis(2 * at);
            feed.advance(time, Ok([units::Metres(now)]));
            seen(2 * at, &feed);
        }
    }

    #[test]
    fn noise_makes_as_much_of_a_lag_as_is_told_however_often_a_sample_is_given() {
        for repeats in [1, 3, 10] {
            let (mut does, mut told) = (0.0, 0.0);
            each_told(
                repeats,
                |_| 0.0,
                |_, it| {
                    does += it.lag[0].value().powi(2);
                    told += it.noise[0].square;
                },
            );
            let ratio = does / told;
            assert!((0.85..1.15).contains(&ratio), "{repeats}: {ratio}");
        }
    }

    /// What is left by noise alone is half of what its lag is, in the mean square: where that is less than it is in the
    /// mean, nothing is taken off.
    #[test]
    fn of_noise_little_is_left() {
        let (mut left, mut lag, mut count) = (0.0, 0.0, 0.0);
        each_told(
            10,
            |_| 0.0,
            |_, it| {
                left += it.left().value().powi(2);
                lag += it.lag[0].value().powi(2);
                count += 1.0;
            },
        );
        assert!(left < 0.7 * lag, "{left} {lag}");
        assert!(left / count < 0.09, "{}", left / count);
    }

    /// A way of which 200 units a second are seen, for a second, and a rest as long: the value lags behind by 20 on the
    /// way, and three time constants after its end by one.
    #[test]
    fn what_is_left_of_a_way_is_told_on_it_and_when_it_ends() {
        let at_ms = |ms: u64| 0.2 * (ms % 2000).min(1000) as f64;
        let turns = |ms: u64| {
            if (ms / 2000).is_multiple_of(2) {
                at_ms(ms)
            } else {
                200.0 - at_ms(ms)
            }
        };
        let (mut on_the_way, mut at_rest, mut count) = (0.0, 0.0, 0.0);
        each_told(10, turns, |ms, it| {
            if ms < 4000 {
                return;
            }
            match ms % 2000 {
                900 => {
                    on_the_way += it.left().value();
                    count += 1.0;
                }
                1300 => at_rest += it.left().value().powi(2),
                _ => {}
            }
        });
        let (on_the_way, at_rest) = (on_the_way / count, (at_rest / count).sqrt());
        assert!((18.0..23.0).contains(&on_the_way), "{on_the_way}");
        assert!((1.0..3.0).contains(&at_rest), "{at_rest}");
    }
}
