//! What the interferometer's slow channel says about air and material, and how strong its signal is.

use core::time::Duration;
use units::{Celsius, Pascals, RelativeHumidity, Time};
use wire::umd2::LowSpeed;

use super::super::{Environment, Signal, SignalTrouble};

/// The newest values and when they came. Temperature 1 is the air's, 2 the material's.
#[derive(Clone, Copy, Debug)]
pub(super) struct Weather {
    age_max: Duration,
    air: Option<(Celsius, Time)>,
    material: Option<(Celsius, Time)>,
    pressure: Option<(Pascals, Time)>,
    humidity: Option<(RelativeHumidity, Time)>,
    strength: Option<i32>,
    /// When the newest sample came, and what is wrong with the signal by it.
    seen: Option<(Time, Option<SignalTrouble>)>,
}

impl Weather {
    pub(super) const fn new(age_max: Duration) -> Self {
        Self {
            age_max,
            air: None,
            material: None,
            pressure: None,
            humidity: None,
            strength: None,
            seen: None,
        }
    }

    /// A sample came, with this wrong with its signal.
    pub(super) const fn see(&mut self, now: Time, trouble: Option<SignalTrouble>) {
        self.seen = Some((now, trouble));
    }

    /// How the signal is; one that is not as strong as `least` counts as lost.
    pub(super) fn signal(&self, least: Option<i32>) -> Option<Signal> {
        let (at, trouble) = self.seen?;
        let is_weak = |strength: i32| least.is_some_and(|least| strength < least);
        let weak = self.strength.filter(|it| is_weak(*it));
        Some(Signal {
            at,
            strength: self.strength,
            least,
            trouble: trouble.or(weak.map(|_| SignalTrouble::Weak)),
        })
    }

    /// Takes a value of the slow channel; one that no sensor can mean ends the old one's
    /// validity instead of replacing it.
    pub(super) fn take(&mut self, now: Time, value: LowSpeed) {
        match value {
            LowSpeed::Temperature1(raw) => self.air = celsius(raw).map(|value| (value, now)),
            LowSpeed::Temperature2(raw) => self.material = celsius(raw).map(|value| (value, now)),
            LowSpeed::Pressure(raw) => self.pressure = pascals(raw).map(|value| (value, now)),
            LowSpeed::SignalStrength(raw) => self.strength = Some(raw),
            LowSpeed::Humidity(raw) => self.humidity = humidity(raw).map(|value| (value, now)),
            _ => {}
        }
    }

    /// What is known at `now`.
    pub(super) fn at(&self, now: Time) -> Environment {
        Environment {
            air_temperature: self.fresh(now, self.air),
            material_temperature: self.fresh(now, self.material),
            pressure: self.fresh(now, self.pressure),
            humidity: self.fresh(now, self.humidity),
        }
    }

    fn fresh<T>(&self, now: Time, value: Option<(T, Time)>) -> Option<T> {
        let (value, at) = value?;
        (now.since(at) <= self.age_max).then_some(value)
    }
}

/// Hundredths of a degree; an open sensor reads far outside.
fn celsius(raw: i32) -> Option<Celsius> {
    let value = f64::from(raw) / 100.0;
    (-40.0..=85.0).contains(&value).then_some(Celsius(value))
}

/// Hundredths of a millibar.
fn pascals(raw: i32) -> Option<Pascals> {
    let value = f64::from(raw);
    (30_000.0..=120_000.0)
        .contains(&value)
        .then_some(Pascals(value))
}

/// Tenths of a percent.
fn humidity(raw: i32) -> Option<RelativeHumidity> {
    let value = f64::from(raw) / 1000.0;
    (0.0..=1.0)
        .contains(&value)
        .then_some(RelativeHumidity(value))
}
