//! Cautious first motion of a drive that states no unit of speed or acceleration.
//!
//! Counts per second count as stated. So the first motion after a start is slow under every candidate
//! unit, its speed and its ramp are measured, and only what agrees with them may be faster.
//!
//! | symbol | name |
//! |---|---|
//! | v, a | speed and acceleration asked for |
//! | T = v / a | ramp |
//! | x = v (t - T/2) | way at constant speed, t after the edge |
//!
//! Absent: a measured stopping way. It has the unit of the ramp.

use core::time::Duration;

use units::Coordinate;

use super::settings::Cia402Settings;
use crate::device::envelope::{Point, Profile};

/// The largest candidate, in counts per second: some drives count in tenths, others in tens.
const CANDIDATE_MAX: f64 = 10.0;
/// The largest candidate gives this share of the highest speed.
const SPEED_SHARE: f64 = 0.1;
/// The whole trial takes this share of the travel, even with the largest candidate.
const TRAVEL_SHARE: f64 = 0.01;
/// Seconds at full speed that the largest candidate moves before it is known.
const KNOWN_AFTER_S: f64 = 1.0;
const RAMP: Duration = Duration::from_millis(600);
/// A speed is measured over so long.
const WINDOW: Duration = Duration::from_millis(200);
/// An axis that did not move by now needs a larger speed.
const MOVES_WITHIN: Duration = Duration::from_millis(1500);
const ENDS_WITHIN: Duration = Duration::from_secs(4);
/// Two speeds this near are one.
const CONSTANT: f64 = 0.02;
/// What was asked for agrees with what is seen.
const AGREES: f64 = 0.2;
/// A ramp that took this share of the whole time has not ended.
const STILL: f64 = 0.8;
/// So many times its noise is a way that can be measured.
const MEASURABLE: i64 = 20;
/// So many times its noise is a way whose ramp can be measured: the axis may still settle as the motion begins.
const WELL_MEASURABLE: i64 = 100;
/// From the edge to the motion, beside the bus.
const REACTION: Duration = Duration::from_millis(20);

const SPEED: &str = "speed";
const ACCELERATION: &str = "acceleration";

/// What a trial showed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Verdict {
    Agrees,
    /// The axis hardly moves: this speed is safe under every unit that remains.
    TooSlow,
    /// `what` is `factor` times what was asked for.
    Differs {
        what: &'static str,
        factor: f64,
    },
}

/// One motion by which units are judged.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Trial {
    speed: u32,
    most: u32,
    /// The largest unit that remains.
    candidate: f64,
    /// The speed of the trial before, from which this one may begin, counts per second.
    initial: f64,
    began: Option<Point>,
    mark: Option<Point>,
    /// Of the window before.
    before: Option<f64>,
    last: Option<Point>,
    /// The axis turned, or its coordinates changed.
    is_void: bool,
}

impl Trial {
    /// Returns the trial of a motion at `speed`, counts per second, of a drive with `per_turn` increments.
    pub(super) fn new<Q: Coordinate>(
        settings: &Cia402Settings<Q>,
        speed: u32,
        per_turn: Option<f64>,
    ) -> Self {
        let figures = settings.figures();
        let travel = settings.travel_counts() * TRAVEL_SHARE / (CANDIDATE_MAX * KNOWN_AFTER_S);
        // A coarse window needs a way beyond that.
        let measurable = (settings.tolerance_counts() * MEASURABLE) as f64 / 2.0;
        let most = (figures.speed_max * SPEED_SHARE / CANDIDATE_MAX)
            .min(travel.max(measurable))
            .min(f64::from(speed))
            .max(1.0);
        // One unit may be a turn per minute.
        let candidate = per_turn.map_or(CANDIDATE_MAX, |counts| (counts / 60.0).max(CANDIDATE_MAX));
        Self {
            speed: (most * CANDIDATE_MAX / candidate).max(1.0) as u32,
            most: most as u32,
            candidate,
            initial: 0.0,
            began: None,
            mark: None,
            before: None,
            last: None,
            is_void: false,
        }
    }

    /// The same at ten times the speed; `None`: it is as fast as a trial may be.
    pub(super) fn raised(self) -> Option<Self> {
        (self.speed < self.most).then(|| Self {
            speed: self.speed.saturating_mul(10).min(self.most),
            candidate: (self.candidate / 10.0).max(CANDIDATE_MAX),
            initial: self.before.map_or(0.0, f64::abs),
            began: None,
            mark: None,
            before: None,
            last: None,
            ..self
        })
    }

    /// Speed and acceleration to write.
    pub(super) fn values(&self) -> (u32, u32) {
        let acceleration = f64::from(self.speed) / RAMP.as_secs_f64();
        (self.speed, acceleration.max(1.0) as u32)
    }

    /// What its envelope permits: the largest candidate.
    pub(super) fn profile(&self) -> Profile {
        let (speed, acceleration) = self.values();
        Profile {
            speed: f64::from(speed) * self.candidate,
            acceleration: f64::from(acceleration),
        }
    }

    /// How far its motion goes before it is judged.
    pub(super) fn way(&self) -> i64 {
        (f64::from(self.speed) * self.candidate * ENDS_WITHIN.as_secs_f64()) as i64
    }

    /// Whether nothing can be concluded any more.
    pub(super) const fn is_void(&self) -> bool {
        self.is_void
    }

    /// The edge goes out while the axis is `here`.
    pub(super) const fn begin(&mut self, here: Point) {
        (self.began, self.mark, self.last) = (Some(here), Some(here), Some(here));
    }

    /// Judges one sample of an axis with so much `noise`, in counts.
    pub(super) fn judge(&mut self, here: Point, noise: i64, period: Duration) -> Option<Verdict> {
        let (began, mark, last) = (self.began?, self.mark?, self.last?);
        self.last = Some(here);
        let step = (here.position - last.position).abs() as f64;
        let span = here.at.since(last.at).max(period) + REACTION;
        self.is_void |= step > self.profile().speed * 2.0 * span.as_secs_f64() + noise as f64;
        if self.is_void || here.at.since(mark.at) < WINDOW {
            return None;
        }
        let window = here.at.since(mark.at).as_secs_f64();
        let speed = (here.position - mark.position) as f64 / window;
        let before = self.before.replace(speed);
        self.mark = Some(here);
        let (way, time) = (here.position - began.position, here.at.since(began.at));
        let asked = self.values();
        let (asked_speed, acceleration) = (f64::from(asked.0), f64::from(asked.1));
        let is_late = time >= ENDS_WITHIN;
        if way.abs() < noise * WELL_MEASURABLE {
            let expected = asked_speed * time.as_secs_f64();
            self.is_void = is_late && expected < (noise * WELL_MEASURABLE * 2) as f64;
            let factor = way.abs() as f64 / expected;
            return match (is_late, self.is_void) {
                (true, true) => None,
                (true, false) => Some(Verdict::Differs {
                    what: SPEED,
                    factor,
                }),
                (false, _) => (time >= MOVES_WITHIN).then_some(Verdict::TooSlow),
            };
        }
        let before = before?;
        let gained = speed.abs() - before.abs();
        self.is_void = speed * way as f64 <= 0.0;
        let is_constant = gained.abs() <= CONSTANT * speed.abs() + noise as f64 / window;
        if self.is_void || !(is_constant || is_late) {
            return None;
        }
        let factor = speed.abs() / asked_speed;
        let delay = period + REACTION;
        let moving = time.saturating_sub(delay).as_secs_f64();
        let ramp = 2.0 * (moving - way.abs() as f64 / speed.abs());
        let speeds_up = ramp > STILL * moving;
        if speeds_up && factor < 1.0 - AGREES {
            let factor = speed.abs() / moving / acceleration;
            return Some(Verdict::Differs {
                what: ACCELERATION,
                factor,
            });
        }
        if (factor - 1.0).abs() > AGREES {
            return Some(Verdict::Differs {
                what: SPEED,
                factor,
            });
        }
        let wanted = asked_speed / acceleration;
        let doubt = AGREES * wanted + 2.0 * delay.as_secs_f64();
        // Way gained by a start at the speed of the trial before shortens the ramp that is seen.
        let faster = speed.abs() / (speed.abs() - self.initial).max(1.0);
        let agrees = |ramp: f64| (ramp - wanted).abs() <= doubt;
        if !agrees(ramp) && !agrees(ramp * faster * faster) {
            let factor = wanted / ramp.max(0.01);
            return Some(Verdict::Differs {
                what: ACCELERATION,
                factor,
            });
        }
        Some(Verdict::Agrees)
    }
}

#[cfg(test)]
mod tests {
    use units::Time;

    use super::super::tests::settings;
    use super::*;

    const PERIOD: Duration = Duration::from_millis(10);

    /// What a drive shows that counts speed and acceleration in such units.
    fn verdict(speed_unit: f64, acceleration_unit: f64) -> Option<Verdict> {
        let mut trial = Trial::new(&settings(), 1_000_000, None);
        let (speed, acceleration) = trial.values();
        let (speed, acceleration) = (
            f64::from(speed) * speed_unit,
            f64::from(acceleration) * acceleration_unit,
        );
        trial.begin(Point {
            at: Time::ZERO,
            position: 7,
        });
        (1..600).find_map(|sample| {
            let at = Time::ZERO + PERIOD * sample;
            let time = (at.seconds() - 0.015).max(0.0);
            let ramp = speed / acceleration;
            let ramped = time.min(ramp);
            let way = acceleration * ramped * ramped / 2.0 + speed * (time - ramped);
            let position = 7 - way as i64;
            trial.judge(Point { at, position }, 21, PERIOD)
        })
    }

    #[test]
    fn counts_per_second_agree() {
        assert_eq!(verdict(1.0, 1.0), Some(Verdict::Agrees));
        assert_eq!(verdict(1.1, 1.0), Some(Verdict::Agrees));
    }

    #[test]
    fn another_unit_is_told_with_its_factor() {
        for unit in [0.1, 0.5, 2.0, 6.17, 10.0] {
            let Some(Verdict::Differs {
                what: SPEED,
                factor,
            }) = verdict(unit, unit)
            else {
                panic!("{unit}: {:?}", verdict(unit, unit))
            };
            assert!((factor / unit - 1.0).abs() < 0.05, "{unit}: {factor}");
        }
        for unit in [0.1, 0.3, 3.0, 10.0] {
            let Some(Verdict::Differs {
                what: ACCELERATION,
                factor,
            }) = verdict(1.0, unit)
            else {
                panic!("{unit}: {:?}", verdict(1.0, unit))
            };
            assert!((0.5..2.0).contains(&(factor / unit)), "{unit}: {factor}");
        }
    }

    #[test]
    fn an_axis_that_hardly_moves_is_asked_for_more() {
        assert_eq!(verdict(1e-4, 1.0), Some(Verdict::TooSlow));
        let trial = Trial::new(&settings(), 1_000_000, Some(60_000.0));
        let raised = trial.raised().expect("a turn per minute was feared");
        assert_eq!(raised.values().0, trial.values().0 * 10);
    }

    #[test]
    fn the_largest_candidate_stays_within_a_tenth_of_the_highest_speed() {
        let settings = settings();
        let trial = Trial::new(&settings, u32::MAX, None);
        assert!(trial.profile().speed <= settings.figures().speed_max / 10.0);
    }

    /// What a sound drive shows whose servo follows with a lag, in seconds, and that moves `delay` after the edge.
    fn verdict_behind(period: Duration, delay: f64, lag: f64) -> Option<Verdict> {
        const STEP: f64 = 1e-3;
        let mut trial = Trial::new(&settings(), 1_000_000, None);
        let (speed, acceleration) = trial.values();
        let (speed, acceleration) = (f64::from(speed), f64::from(acceleration));
        trial.begin(Point {
            at: Time::ZERO,
            position: 7,
        });
        let (mut place, mut time, mut next) = (0.0, 0.0, period.as_secs_f64());
        while time < 8.0 {
            let since = (time - delay).max(0.0);
            let ramp = speed / acceleration;
            let ramped = since.min(ramp);
            let way = acceleration * ramped * ramped / 2.0 + speed * (since - ramped);
            place += (way - place) * (STEP / (lag + STEP));
            time += STEP;
            if time + STEP / 2.0 < next {
                continue;
            }
            next += period.as_secs_f64();
            let at = Time::from_seconds(time);
            let position = 7 - place as i64;
            let verdict = trial.judge(Point { at, position }, 21, period);
            if verdict.is_some() {
                return verdict;
            }
        }
        None
    }

    #[test]
    fn sound_drives_agree() {
        let mut refused = Vec::new();
        for period_ms in [1, 2, 5, 10, 20, 30] {
            for periods in 0..4 {
                for lag_ms in [0, 3, 10, 20, 40, 60] {
                    let period = Duration::from_millis(period_ms);
                    let delay = period.as_secs_f64() * f64::from(periods) + 1e-3;
                    let verdict = verdict_behind(period, delay, f64::from(lag_ms) * 1e-3);
                    if verdict != Some(Verdict::Agrees) {
                        refused.push((period_ms, periods, lag_ms, verdict));
                    }
                }
            }
        }
        assert!(refused.is_empty(), "{} of 144: {refused:?}", refused.len());
    }
}
