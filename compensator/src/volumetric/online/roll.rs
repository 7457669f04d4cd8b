//! Roll of a slider from two detectors beside one beam splitter arrangement, in closed form.
//!
//! Source: CN1214003A, equations (1) to (3):
//!
//! tan α = (y₁ + y₂)/(L + (y₁ + y₂) tan φ), y₁ = (h tan α − x₁)/(tan φ − tan α), y₂ likewise.
//!
//! With t = tan α, f = tan φ and X = x₁ + x₂ the sum of the last two put into the first gives
//!
//! (L − 2hf)·t² + (2h + (X − L)·f)·t − X = 0,
//!
//! of which the root that goes to zero with X is taken, written so that it keeps its digits.
//!
//! Of a rigid slide y₁ + y₂ = L·t/(1 − t·f) and y₁ − y₂ = 2v/(1 − t·f), with v its shift along the normal of its
//! surface: of α, y₁ and y₂ two are free, and a function of all three is one of the roll and of the displacement along
//! v. The roll turns the slide in the rigid-body model; the displacement is what the slide's beam detector reads, against
//! a beam that an end detector watches, which nobody does with the beams here.
//!
//! | symbol | name here |
//! |---|---|
//! | α, y₁, y₂ | [`Roll`] |
//! | h, L, φ | [`RollOptics`]: `height`, `base`, `inclination` |
//! | x₁, x₂ | the readings of both detectors |

use units::portable::{atan, tan};
use units::{Metres, Radians};

/// The geometry of the two detectors.
///
/// # Example
///
/// ```
/// use compensator::volumetric::online::RollOptics;
/// use units::{Metres, Radians};
///
/// let (mm, roll_max) = (Metres::from_mm, Radians(0.05));
/// let optics = RollOptics::new(mm(10.0), mm(100.0), Radians::from_degrees(45.0), roll_max)?;
/// let roll = optics.solve(mm(-0.5), mm(-0.3))?;
/// assert!((roll.angle.value().tan() - 0.01).abs() < 1e-15);
/// assert!((roll.first.mm() - 0.6 / 0.99).abs() < 1e-12);
/// assert!(optics.solve(mm(50.0), mm(50.0)).is_err(), "no roll up to 0.05 rad");
/// # Ok::<(), compensator::volumetric::online::RollError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RollOptics {
    height: f64,
    base: f64,
    slope: f64,
    roll_max: f64,
}

/// Rotation of a slider about its direction, and its offsets at both detectors.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Roll {
    /// α, right-handed about the axis's direction when the readings are.
    pub angle: Radians,
    /// y₁.
    pub first: Metres,
    /// y₂.
    pub second: Metres,
}

/// Why a geometry or two readings say nothing about the roll.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum RollError {
    /// An arrangement in which readings of zero do not mean a roll of zero alone.
    #[error(
        "roll detectors: with height {} mm, base {} mm and an inclination of {} degrees the \
         readings do not determine the roll",
        units::Short(height.mm()), units::Short(base.mm()), units::Short(inclination.degrees())
    )]
    Geometry {
        /// h.
        height: Metres,
        /// L.
        base: Metres,
        /// φ.
        inclination: Radians,
    },
    /// Readings that no roll of the permitted size makes.
    #[error("roll detectors: readings of {} mm and {} mm fit no roll up to {:.1} arcsec",
        units::Short(first.mm()), units::Short(second.mm()), limit.arcsec())]
    NoRoll {
        /// x₁.
        first: Metres,
        /// x₂.
        second: Metres,
        /// The largest roll permitted.
        limit: Radians,
    },
}

impl RollOptics {
    /// The arrangement with height h, base L and inclination φ; rolls up to `roll_max`.
    ///
    /// # Errors
    /// When L is not positive, tan φ is zero or 2h = L·tan φ (then the roll is not determined),
    /// or `roll_max` is not between zero and a right angle.
    pub fn new(
        height: Metres,
        base: Metres,
        inclination: Radians,
        roll_max: Radians,
    ) -> Result<Self, RollError> {
        let slope = tan(inclination.value());
        let determined = (2.0 * height.value() - base.value() * slope).abs();
        let sound = base > Metres::ZERO
            && slope.abs() > 1e-6
            && determined > 1e-6 * base.value()
            && determined.is_finite()
            && roll_max.value() > 0.0
            && roll_max.value() < core::f64::consts::FRAC_PI_2;
        if !sound {
            return Err(RollError::Geometry {
                height,
                base,
                inclination,
            });
        }
        Ok(Self {
            height: height.value(),
            base: base.value(),
            slope,
            roll_max: roll_max.value(),
        })
    }

    /// Roll and offsets from the readings x₁ and x₂.
    ///
    /// # Errors
    /// When no roll up to the largest one permitted makes these readings.
    pub fn solve(&self, first: Metres, second: Metres) -> Result<Roll, RollError> {
        let (h, base, f) = (self.height, self.base, self.slope);
        let sum = first.value() + second.value();
        let square = base - 2.0 * h * f;
        let linear = 2.0 * h + (sum - base) * f;
        let root = (linear * linear + 4.0 * square * sum).sqrt();
        let t = 2.0 * sum / (linear + root.copysign(linear));
        let offset = |x: Metres| Metres((h * t - x.value()) / (f - t));
        let roll = Roll {
            angle: Radians(atan(t)),
            first: offset(first),
            second: offset(second),
        };
        let finite = roll.first.is_finite() && roll.second.is_finite();
        // Beyond t = f the surfaces of the arrangement are passed: another root's country.
        let on_branch = (f - t) * f > 0.0;
        if finite && on_branch && roll.angle.value().abs() <= self.roll_max {
            Ok(roll)
        } else {
            Err(RollError::NoRoll {
                first,
                second,
                limit: Radians(self.roll_max),
            })
        }
    }
}
