//! What a sweep of two Hall sensors says about the sensors themselves.
//!
//! Rails and bit-identical values speak for themselves. The rest is read off the shape: around
//! the nominal zero the right sensor 1 is flat and falls outwards, the right sensor 2 is steep
//! and rises (or falls, as configured). That holds on one side of the zero alone, too, so that a
//! search that failed early can still be explained.

use core::fmt;

use units::{Metres, Volts};

use super::jump::{self, Jump};
use super::profile::{Bin, profile, slopes};
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
    /// A voltage jumped while the axis was searching.
    Jumped(Jump),
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
            Self::Jumped(jump) => jump.fmt(f),
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
        .or_else(|| jump::find(points, settings).map(SensorFault::Jumped))
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

/// By how much curve 1 rises from one bin to the next as one goes away from the nominal zero, squared so
/// that the flanks count and the noise does not.
fn rise_outwards(pair: &[Bin], nominal: Metres) -> f64 {
    let middle = (pair[0].x + pair[1].x) / 2.0 - nominal.value();
    let rise = pair[1].peak - pair[0].peak;
    middle.signum() * rise * rise.abs()
}

/// Reads swapped and inverted sensors off the curves' shapes.
fn misshapen(points: &[HallPoint], nominal: Metres, settings: &Settings) -> Option<SensorFault> {
    let travel = travel(points);
    if travel < TRAVEL_MIN {
        return None;
    }
    let bins = profile(points, BINS);
    let curves: Vec<(f64, f64, f64)> = slopes(&bins)
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
    let steepest = extent(curves.iter().map(|c| c.1.abs())).1;
    let slope_steepest = extent(curves.iter().map(|c| c.2.abs())).1;
    let peak_share = peak_here.abs() / steepest;
    let slope_share = slope_here.abs() / slope_steepest;
    if peak_share > 0.6 && peak_share > 1.4 * slope_share {
        return Some(SensorFault::Swapped);
    }
    // Curve 1 falls away from its maximum on both flanks, unless it is inverted; a rise of less than the
    // noise there is no flank. All bins are asked by how much they rise, as a voltage that was taken
    // elsewhere than its position can make a single slope the steepest.
    let rise = steepest * travel / BINS as f64;
    let outwards: f64 = bins.windows(2).map(|w| rise_outwards(w, nominal)).sum();
    if slope_share > 0.5 && rise > 5.0 * settings.noise.value() && outwards > 0.0 {
        return Some(SensorFault::Inverted {
            sensor: Sensor::Peak,
        });
    }
    let wrong = (slope_here > 0.0) != settings.slope_rising;
    (slope_share > 0.5 && wrong).then_some(SensorFault::Inverted {
        sensor: Sensor::Slope,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hall_zero::rig::Magnets;

    fn point(um: f64, off_mv: f64) -> HallPoint {
        let [peak, slope] = Magnets::IDEAL.volts(um * 1e-3);
        HallPoint {
            position: Metres::from_um(um),
            peak: Volts(peak + off_mv * 1e-3),
            slope: Volts(slope),
        }
    }

    /// Two voltages at almost the same place, the outer one of which was taken elsewhere: nowhere is the
    /// curve as steep.
    #[test]
    fn a_voltage_from_elsewhere_does_not_make_a_sensor_inverted() {
        let usual = Settings::default();
        for border in 2..BINS - 1 {
            for off_mv in [-30.0, 30.0] {
                let place = |bin: usize| match bin {
                    _ if bin + 1 == border => border as f64 * 100.0 - 0.1,
                    _ if bin == border => border as f64 * 100.0 + 0.1,
                    _ => bin as f64 * 100.0 + 50.0,
                };
                let width = BINS as f64 * 100.0;
                let um = |at: f64| (at / width - 0.5) * 1200.0;
                let shift = |bin: usize| if bin == border { off_mv } else { 0.0 };
                let ends = [point(-600.0, 0.0), point(600.0, 0.0)];
                let inner = (0..BINS).map(|bin| point(um(place(bin)), shift(bin)));
                let points: Vec<HallPoint> = inner.chain(ends).collect();
                let blamed = diagnose(&points, Metres::ZERO, &usual);
                assert_eq!(blamed, None, "bin {border}, {off_mv} mV");
            }
        }
    }
}
