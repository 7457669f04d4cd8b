//! The magnets and Hall sensors of the drift-free absolute zero (system S5).
//!
//! Physics: a long bar magnet magnetised along its height is two sheets of magnetic charge.
//! The field of a charged strip of width w, seen at distance z, has the normal component
//!
//! ```text
//! B(x) ~ atan((x + w/2) / z) - atan((x - w/2) / z)
//! ```
//!
//! (E. P. Furlani, "Permanent Magnet and Electromechanical Devices", 2001, section 4.3, in two
//! dimensions). The near face counts positive, the far face, one magnet height further away,
//! negative. Group 1 is N-S-N at spacing p: an even curve with its maximum at x = 0. Group 2
//! is S-N at plus and minus p/2: an odd curve, steepest and straight at x = 0.
//!
//! Absent: shifts along x (uneven demagnetisation), which the method cannot cure either.

use crate::random::Stream;
use units::portable::atan;
use units::{Metres, Volts};

use super::config::HallConfig;

/// How one sensor's curve has moved since it was built.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SensorDrift {
    /// Added to the voltage.
    pub offset: Volts,
    /// Relative change of the gain.
    pub gain: f64,
    /// Relative change of the gain per metre of travel: plate and stage are not parallel.
    pub gain_per_m: f64,
}

/// How both sensors have drifted since the machine was built.
///
/// # Example
///
/// ```
/// use mock_bus::plant::{DriftLimits, HallDrift};
/// use units::Volts;
///
/// let limits = DriftLimits { offset: Volts(0.1), gain: 0.03, gain_per_m: 0.0 };
/// let drift = HallDrift::random(7, 1, limits);
/// assert_eq!(drift, HallDrift::random(7, 1, limits));
/// assert!(drift.sensors.iter().all(|it| it.offset.abs() <= Volts(0.1) && it.gain.abs() <= 0.03));
/// assert_ne!(drift, HallDrift::random(7, 2, limits), "the next night");
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HallDrift {
    /// Sensor 1 (even curve) and sensor 2 (odd curve).
    pub sensors: [SensorDrift; 2],
}

/// The largest drift of each kind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriftLimits {
    /// Largest offset, either way.
    pub offset: Volts,
    /// Largest relative gain change, either way.
    pub gain: f64,
    /// Largest relative gain change per metre, either way.
    pub gain_per_m: f64,
}

impl HallDrift {
    /// A drift drawn uniformly within `limits`, the same for the same seed and number.
    pub fn random(seed: u64, number: u64, limits: DriftLimits) -> Self {
        let mut stream = Stream::new(seed, &format!("hall drift {number}"));
        let mut within = |limit: f64| stream.between(-limit, limit);
        let sensors = core::array::from_fn(|_| SensorDrift {
            offset: Volts(within(limits.offset.value())),
            gain: within(limits.gain),
            gain_per_m: within(limits.gain_per_m),
        });
        Self { sensors }
    }
}

/// Which sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Sensor {
    /// Over N-S-N: even.
    Even,
    /// Over S-N: odd.
    Odd,
}

/// One magnet: where, and which way up.
type Magnet = (f64, f64);

#[derive(Clone, Debug)]
pub(super) struct HallField {
    config: HallConfig,
    even_scale: f64,
    odd_scale: f64,
    pub(super) drift: HallDrift,
}

impl HallField {
    pub(super) fn new(config: HallConfig) -> Self {
        let mut field = Self {
            config,
            even_scale: 1.0,
            odd_scale: 1.0,
            drift: HallDrift::default(),
        };
        let wanted = field.config.slope_v_per_mm * 1e3;
        field.even_scale = wanted / field.steepest_flank();
        field.odd_scale = wanted / field.slope(Sensor::Odd, 0.0);
        field
    }

    /// The voltage at the true position, offset, gain and tilt included, noise not.
    pub(super) fn volts(&self, sensor: Sensor, position: Metres) -> f64 {
        self.volts_drifted(&self.drift, sensor, position)
    }

    /// The same of sensors over magnets of that kind that have drifted otherwise.
    pub(super) fn volts_drifted(&self, drift: &HallDrift, sensor: Sensor, position: Metres) -> f64 {
        let drift = match sensor {
            Sensor::Even => drift.sensors[0],
            Sensor::Odd => drift.sensors[1],
        };
        let gain = 1.0 + drift.gain + drift.gain_per_m * position.value();
        let offset = self.config.offset_v + drift.offset.value();
        (offset + gain * self.curve(sensor, position.value()))
            .clamp(-self.config.rail_v, self.config.rail_v)
    }

    fn curve(&self, sensor: Sensor, x: f64) -> f64 {
        let p = self.config.magnet_spacing_mm * 1e-3;
        match sensor {
            Sensor::Even => self.even_scale * self.group(&[(-p, -1.0), (0.0, 1.0), (p, -1.0)], x),
            Sensor::Odd => self.odd_scale * self.group(&[(-p / 2.0, -1.0), (p / 2.0, 1.0)], x),
        }
    }

    fn group(&self, magnets: &[Magnet], x: f64) -> f64 {
        magnets
            .iter()
            .map(|(at, pole)| pole * self.magnet(x - at))
            .sum()
    }

    fn magnet(&self, x: f64) -> f64 {
        let gap = self.config.gap_mm * 1e-3;
        let far = gap + self.config.magnet_height_mm * 1e-3;
        self.face(x, gap) - self.face(x, far)
    }

    fn face(&self, x: f64, z: f64) -> f64 {
        let half = self.config.magnet_width_mm * 0.5e-3;
        atan((x + half) / z) - atan((x - half) / z)
    }

    /// In curve units per metre.
    fn slope(&self, sensor: Sensor, x: f64) -> f64 {
        const HALF_STEP_M: f64 = 5e-6;
        let rise = self.curve(sensor, x + HALF_STEP_M) - self.curve(sensor, x - HALF_STEP_M);
        rise / (2.0 * HALF_STEP_M)
    }

    /// The even curve's steepest slope, found by looking.
    fn steepest_flank(&self) -> f64 {
        let reach_m = self.config.magnet_spacing_mm * 1e-3;
        (0..=400)
            .map(|i| -self.slope(Sensor::Even, reach_m * f64::from(i) / 400.0))
            .fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn field() -> HallField {
        HallField::new(HallConfig::default())
    }

    #[test]
    fn one_curve_is_even_with_its_maximum_at_zero_and_the_other_odd() {
        let field = field();
        for um in (0..6000).step_by(50) {
            let (right, left) = (
                Metres::from_um(f64::from(um)),
                Metres::from_um(-f64::from(um)),
            );
            let even = field.volts(Sensor::Even, right) - field.volts(Sensor::Even, left);
            let odd = field.volts(Sensor::Odd, right) + field.volts(Sensor::Odd, left);
            assert!(
                even.abs() < 1e-12 && odd.abs() < 1e-12,
                "{um}: {even} {odd}"
            );
            assert!(field.volts(Sensor::Even, right) <= field.volts(Sensor::Even, Metres(0.0)));
        }
    }

    #[test]
    fn the_odd_curve_is_straight_within_a_millimetre_and_climbs_one_volt_per_millimetre() {
        let field = field();
        let at = |mm| field.volts(Sensor::Odd, Metres::from_mm(mm));
        assert!((at(0.1) / 0.1 - 1.0).abs() < 0.02, "{}", at(0.1) / 0.1);
        assert!((at(1.0) - 1.0).abs() < 0.06, "{}", at(1.0));
    }

    #[test]
    fn the_even_curve_has_flanks_of_a_volt_per_millimetre() {
        let field = field();
        let at = |mm| field.volts(Sensor::Even, Metres::from_mm(mm));
        let slopes: Vec<f64> = (0..40)
            .map(|i| {
                let mm = f64::from(i) * 0.1;
                (at(mm) - at(mm + 0.1)) / 0.1
            })
            .collect();
        let steepest = slopes.iter().copied().fold(0.0, f64::max);
        assert!((steepest - 1.0).abs() < 0.02, "{steepest}");
        assert!(at(0.0) - at(4.0) > 1.8, "{}", at(0.0) - at(4.0));
    }

    #[test]
    fn far_away_only_the_offset_is_left() {
        let field = field();
        assert!(field.volts(Sensor::Even, Metres::from_mm(60.0)).abs() < 5e-3);
        assert!(field.volts(Sensor::Odd, Metres::from_mm(60.0)).abs() < 5e-3);
    }

    #[test]
    fn drift_acts_on_offset_and_gain_and_never_moves_the_symmetry() {
        let mut drifted = field();
        drifted.drift = HallDrift::random(
            3,
            0,
            DriftLimits {
                offset: Volts(0.1),
                gain: 0.03,
                gain_per_m: 0.0,
            },
        );
        let x = Metres::from_mm(1.3);
        let even = drifted.volts(Sensor::Even, x) - drifted.volts(Sensor::Even, -x);
        assert!(even.abs() < 1e-12);
        assert_ne!(
            drifted.volts(Sensor::Even, x),
            field().volts(Sensor::Even, x)
        );
    }
}
