//! What a screw's model must fulfil before it may command anything.

use units::Metres;

use super::{BASE, Harmonic, ScrewModel};

/// A lost motion this many standard uncertainties below zero is none; lower is a mistake.
const NEGATIVE_MAX: f64 = 3.0;

/// What a compensation may do at most.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Largest deviation corrected, lost motion included.
    pub size: Metres,
    /// Largest |d deviation/d stroke|, dimensionless, below 1.
    pub slope: f64,
    /// How far beyond the strokes measured the model may be used.
    pub extrapolation: Metres,
    /// Targets this close to where the nut is known to be need no motion: half a count. At least
    /// a picometre, or rounding alone would turn the screw round.
    pub resolution: Metres,
}

/// The names of the limits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LimitName {
    /// [`Limits::size`].
    Size,
    /// [`Limits::slope`].
    Slope,
    /// [`Limits::extrapolation`].
    Extrapolation,
    /// [`Limits::resolution`].
    Resolution,
}

/// Why a model cannot be used to compensate.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ScrewError {
    /// A limit that is none.
    #[error(
        "screw compensation: limit {name:?} is {seen}; size and slope must be positive (the slope \
         below 1), the others not negative", seen = units::Short(*seen))]
    Limit {
        /// Which limit.
        name: LimitName,
        /// Its value in SI units.
        seen: f64,
    },
    /// A value of the model that is not finite, strokes that are no range, a harmonic without a
    /// lead, twice or of number 0, or a covariance of the wrong size.
    #[error("screw compensation: the model is not sound: {what}")]
    Unsound {
        /// What is wrong with it.
        what: &'static str,
    },
    /// A lost motion of the wrong sign.
    #[error(
        "screw compensation: the lost motion is {:.3} um; reverse − forward of a screw with play \
         is positive. Are the approaches swapped, or is the deviation not actual − commanded?",
        seen.um()
    )]
    NegativeLostMotion {
        /// The lost motion.
        seen: Metres,
    },
    /// A deviation larger than the limit.
    #[error(
        "screw compensation: deviations reach {:.3} um between {} and {} mm, the limit is {:.3} um; \
         millimetres taken for micrometres, or the model of another screw?",
        seen.um(), units::Short(first.mm()), units::Short(last.mm()), limit.um()
    )]
    TooLarge {
        /// A bound of the deviations.
        seen: Metres,
        /// The limit.
        limit: Metres,
        /// The lowest target allowed.
        first: Metres,
        /// The highest target allowed.
        last: Metres,
    },
    /// A slope above the limit.
    #[error(
        "screw compensation: the deviation changes by up to {:.1} um/mm, the limit is {:.1} um/mm",
        seen * 1e3, limit * 1e3
    )]
    TooSteep {
        /// A bound of the slope's magnitude.
        seen: f64,
        /// The limit.
        limit: f64,
    },
    /// A slope of 1 or more: several commands, or none, reach a target.
    #[error(
        "screw compensation: the deviation may change by {seen:.3} of the stroke; from 1 on the \
         correction has no unique inverse"
    )]
    NotInvertible {
        /// A bound of the slope's magnitude.
        seen: f64,
    },
}

pub(super) fn check_limits(limits: &Limits) -> Result<(), ScrewError> {
    let above_zero = f64::MIN_POSITIVE;
    let checks = [
        (LimitName::Size, limits.size.value(), above_zero, f64::MAX),
        (
            LimitName::Slope,
            limits.slope,
            above_zero,
            1.0_f64.next_down(),
        ),
        (
            LimitName::Extrapolation,
            limits.extrapolation.value(),
            0.0,
            f64::MAX,
        ),
        (
            LimitName::Resolution,
            limits.resolution.value(),
            0.0,
            f64::MAX,
        ),
    ];
    match checks
        .into_iter()
        .find(|(_, seen, low, high)| !(low..=high).contains(&seen))
    {
        Some((name, seen, ..)) => Err(ScrewError::Limit { name, seen }),
        None => Ok(()),
    }
}

pub(super) fn check_model(model: &ScrewModel) -> Result<(), ScrewError> {
    let lengths = [model.offset, model.lost_motion, model.first, model.last];
    let waves = || model.harmonics.iter();
    let finite = model.slope.is_finite()
        && lengths.iter().all(|it| it.is_finite())
        && waves().all(|it| it.sine.is_finite() && it.cosine.is_finite());
    let twice = |it: &Harmonic| waves().filter(|other| other.number == it.number).count() > 1;
    let size = BASE + 2 * model.harmonics.len();
    let covers = |it: &Vec<f64>| it.len() == size * size && it.iter().all(|c| c.is_finite());
    let lead_known = model
        .lead
        .is_some_and(|it| it.is_finite() && it > Metres::ZERO);
    let checks = [
        (finite, "a value is not finite"),
        (model.first < model.last, "its strokes do not form a range"),
        (
            lead_known || model.harmonics.is_empty(),
            "harmonics need a positive lead",
        ),
        (
            waves().all(|it| it.number > 0 && !twice(it)),
            "a harmonic appears twice or has the number 0",
        ),
        (
            model.covariance.as_ref().is_none_or(covers),
            "the covariance does not fit the parameters",
        ),
    ];
    match checks.into_iter().find(|(holds, _)| !holds) {
        Some((_, what)) => Err(ScrewError::Unsound { what }),
        None => Ok(()),
    }
}

/// The play that belongs to an estimated lost motion, which noise may have made negative.
pub(super) fn play_of(model: &ScrewModel) -> Result<f64, ScrewError> {
    let seen = model.lost_motion;
    // A single row scatters by more than the mean of all.
    let u = model.u_lost_motion().or(model.scatter);
    let u = u.unwrap_or(Metres::ZERO);
    if seen < u * -NEGATIVE_MAX {
        return Err(ScrewError::NegativeLostMotion { seen });
    }
    Ok(seen.value().max(0.0))
}
