//! What a sweep of two Hall sensors says about the sensors themselves.
//!
//! Rails and bit-identical values speak for themselves. The rest is read off the shape: around
//! the nominal zero the right sensor 1 is flat and falls outwards, the right sensor 2 is steep
//! and rises (or falls, as configured). That holds on one side of the zero alone, too, so that a
//! search that failed early can still be explained.

use core::fmt;

use units::{Metres, Volts};

use super::profile::{profile, slopes};
use super::{Sensor, Settings};
use crate::hall_zero::HallPoint;

/// Samples at a rail before it counts: one may be a disturbance.
const RAIL_SAMPLES: usize = 3;
/// Travel needed before a curve's shape says anything.
const TRAVEL_MIN: f64 = 100e-6;
/// Bins of the profile the shape is read from.
const BINS: usize = 48;

/// A broken or wrongly wired sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SensorFault {
    /// At a rail.
    Saturated {
        /// Which sensor.
        sensor: Sensor,
        /// Its voltage.
        voltage: Volts,
    },
    /// Bit-identical over many samples.
    Stuck {
        /// Which sensor.
        sensor: Sensor,
        /// Its voltage.
        voltage: Volts,
    },
    /// Noise around a constant, over a travel where it must change.
    OpenWire {
        /// Which sensor.
        sensor: Sensor,
        /// Its mean voltage.
        voltage: Volts,
        /// The travel.
        travel: Metres,
    },
    /// The curves are each other's.
    Swapped,
    /// A curve is upside down.
    Inverted {
        /// Which sensor.
        sensor: Sensor,
    },
}

impl fmt::Display for SensorFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Saturated { sensor, voltage } => {
                write!(f, "{sensor} is saturated at {:.4} V", voltage.value())
            }
            Self::Stuck { sensor, voltage } => write!(
                f,
                "{sensor} reads exactly {:.4} V again and again: ADC stuck",
                voltage.value()
            ),
            Self::OpenWire {
                sensor,
                voltage,
                travel,
            } => write!(
                f,
                "{sensor} stays at {:.4} V over {:.0} um: wire open or magnets missing",
                voltage.value(),
                travel.um()
            ),
            Self::Swapped => f.write_str("the two sensors look swapped"),
            Self::Inverted { sensor } => write!(f, "{sensor} looks inverted in polarity"),
        }
    }
}

fn voltage(point: &HallPoint, sensor: Sensor) -> f64 {
    match sensor {
        Sensor::Peak => point.peak.value(),
        Sensor::Slope => point.slope.value(),
    }
}

/// Names what is wrong with the sensors that gave `points`, if it is recognisable.
///
/// `nominal` is where the zero should be, in the points' coordinates.
///
/// # Example
///
/// ```
/// use compensator::hall_zero::{HallPoint, SensorFault, Settings, diagnose};
/// use units::{Metres, Volts};
///
/// let points: Vec<HallPoint> = (-100..=100)
///     .map(|step| {
///         let mm = 0.01 * f64::from(step);
///         let (odd, even) = (2.0 * mm).sin_cos();
///         // Each on the other's input.
///         HallPoint { position: Metres::from_mm(mm), peak: Volts(2.5 + odd), slope: Volts(2.5 + even) }
///     })
///     .collect();
/// let fault = diagnose(&points, Metres::ZERO, &Settings::default());
/// assert_eq!(fault, Some(SensorFault::Swapped));
/// ```
pub fn diagnose(points: &[HallPoint], nominal: Metres, settings: &Settings) -> Option<SensorFault> {
    let sensors = [Sensor::Peak, Sensor::Slope];
    sensors
        .iter()
        .find_map(|&sensor| saturated(points, sensor, settings))
        .or_else(|| {
            sensors
                .iter()
                .find_map(|&sensor| constant(points, sensor, settings))
        })
        .or_else(|| misshapen(points, nominal, settings))
}

fn saturated(points: &[HallPoint], sensor: Sensor, settings: &Settings) -> Option<SensorFault> {
    let at_rail = |v: &f64| *v <= settings.rail_low.value() || *v >= settings.rail_high.value();
    let mut seen = points.iter().map(|p| voltage(p, sensor)).filter(at_rail);
    seen.nth(RAIL_SAMPLES - 1).map(|v| SensorFault::Saturated {
        sensor,
        voltage: Volts(v),
    })
}

fn travel(points: &[HallPoint]) -> f64 {
    let (low, high) = extent(points.iter().map(|p| p.position.value()));
    high - low
}

fn extent(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
        (low.min(v), high.max(v))
    })
}

fn constant(points: &[HallPoint], sensor: Sensor, settings: &Settings) -> Option<SensorFault> {
    let (low, high) = extent(points.iter().map(|p| voltage(p, sensor)));
    let travel = travel(points);
    if travel < TRAVEL_MIN {
        return None;
    }
    let voltage = Volts((low + high) / 2.0);
    if low == high {
        return Some(SensorFault::Stuck { sensor, voltage });
    }
    // Over a quarter of the search either curve changes by far more than a tenth of Vc0.
    let quiet = (10.0 * settings.noise.value()).max(settings.vc0.value() / 10.0);
    let far = travel > settings.search_limit.value() / 4.0;
    (far && high - low < quiet).then_some(SensorFault::OpenWire {
        sensor,
        voltage,
        travel: Metres(travel),
    })
}

/// Reads swapped and inverted sensors off the curves' shapes.
fn misshapen(points: &[HallPoint], nominal: Metres, settings: &Settings) -> Option<SensorFault> {
    let travel = travel(points);
    if travel < TRAVEL_MIN {
        return None;
    }
    let curves: Vec<(f64, f64, f64)> = slopes(&profile(points, BINS))
        .map(|(x, peak, slope)| (x - nominal.value(), peak, slope))
        .collect();
    let nearest = extent(curves.iter().map(|c| c.0.abs())).0;
    let near: Vec<&(f64, f64, f64)> = curves
        .iter()
        .filter(|c| c.0.abs() <= nearest + travel / 24.0)
        .collect();
    let mean =
        |f: fn(&(f64, f64, f64)) -> f64| near.iter().map(|c| f(c)).sum::<f64>() / near.len() as f64;
    let (peak_here, slope_here) = (mean(|c| c.1), mean(|c| c.2));
    let steepest = curves
        .iter()
        .max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))?;
    let slope_steepest = extent(curves.iter().map(|c| c.2.abs())).1;
    let peak_share = peak_here.abs() / steepest.1.abs();
    let slope_share = slope_here.abs() / slope_steepest;
    if peak_share > 0.6 && peak_share > 1.4 * slope_share {
        return Some(SensorFault::Swapped);
    }
    // The steepest part of curve 1 is the flank between the middle magnet and its neighbour;
    // a rise of less than the noise there is no flank.
    let rise = steepest.1.abs() * travel / BINS as f64;
    if slope_share > 0.5 && rise > 5.0 * settings.noise.value() && steepest.0 * steepest.1 > 0.0 {
        return Some(SensorFault::Inverted {
            sensor: Sensor::Peak,
        });
    }
    let wrong = (slope_here > 0.0) != settings.slope_rising;
    (slope_share > 0.5 && wrong).then_some(SensorFault::Inverted {
        sensor: Sensor::Slope,
    })
}
