//! Which mistake of a configuration explains what a camera saw of a platform whose screws were moved one
//! at a time.
//!
//! Each alternative changes one thing: how the camera's frame lies, how long its units are, which
//! screw is which, how far a screw goes for a stroke. Its number, where it has one, is fitted by
//! least squares; what is left are the deviations of every screw, at each stop, from what the
//! alternative expects of it, the standing screws' too.
//!
//! An alternative explains the readings when all of this holds:
//!
//! 1. It is no small change: a factor differs from 1, the sine of a turn from 0, by more than
//!    [`Tolerance::slope`], the slope that a sound screw may have.
//! 2. Its misfit is at most [`Tolerance::size`], the deviation that a sound screw may have. The misfit is
//!    the largest of the rms deviations of one screw while one screw (the same or another) is moved:
//!    a screw that does not matter to the others cannot hide in a mean of all.
//! 3. Its misfit is at most a fifth of that of the readings taken as configured: what is left is a
//!    twenty-fifth of the squares. A disturbance that is not proportional to strokes leaves more.
//! 4. No other alternative's misfit is less than half of its own. Those that are alike are all
//!    returned: the readings cannot tell them apart.
//!
//! Absent: two mistakes at once, and errors of the arrangement but for what looks like a wrong unit of the
//! camera's angles (levers of a wrong length).

mod fit;
#[cfg(test)]
mod rates;
#[cfg(test)]
mod rig;
#[cfg(test)]
mod tests;

use units::{Metres, Radians};

use super::{Platform, Pose};
use crate::uncertainty::rms;
use fit::{Readings, cells};

/// What is left of the readings' misfit under a cause, at most.
const IMPROVEMENT: f64 = 0.2;

/// Alternatives whose misfits differ by less than this factor are alike.
const ALIKE: f64 = 2.0;

/// So many stops of a screw, away from its zero, show how it moves.
const STOPS_MIN: usize = 3;

/// One stop: what every screw was commanded, and what was seen.
#[derive(Clone, Debug, PartialEq)]
pub struct Sighting {
    /// The stroke of each screw, in the order of the platform's actuators.
    pub commanded: Vec<Metres>,
    /// The camera's pose, in the machine's frame as configured.
    pub seen: Pose,
}

/// What a sound platform may show.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// The largest deviation of a stroke.
    pub size: Metres,
    /// The largest slope of a deviation, dimensionless.
    pub slope: f64,
}

/// What differs from the configuration.
#[derive(Clone, Debug, PartialEq)]
pub enum Cause {
    /// The machine's frame is the one that poses were given in, mirrored in y (y and angle change
    /// their signs) where `mirrored`, then turned.
    CameraFrame {
        /// Whether it is mirrored against what is configured.
        mirrored: bool,
        /// The turn after it, counter-clockwise.
        turn: Radians,
    },
    /// Lengths are seen this many times too long.
    CameraLength {
        /// Seen over true, positive.
        factor: f64,
    },
    /// Turns are seen this many times too large: the unit of the camera's angles, or the levers
    /// of the screws.
    CameraAngle {
        /// Seen over true, positive.
        factor: f64,
    },
    /// What screw number i was commanded, actuator number `order[i]` did.
    Exchanged {
        /// An actuator for each screw.
        order: Vec<usize>,
    },
    /// A screw goes this many times as far as it is commanded, the other way where negative.
    Screw {
        /// Which.
        which: usize,
        /// True over commanded.
        factor: f64,
    },
    /// All of them do.
    Screws {
        /// True over commanded.
        factor: f64,
    },
    /// A screw moves nothing.
    Still {
        /// Which.
        which: usize,
    },
}

/// A cause that explains the readings.
#[derive(Clone, Debug, PartialEq)]
pub struct Explained {
    /// What it is.
    pub cause: Cause,
    /// The misfit under it.
    pub misfit: Metres,
}

/// What the readings say.
#[derive(Clone, Debug, PartialEq)]
pub struct Verdict {
    /// Causes that explain them, the best first; none where none does.
    pub causes: Vec<Explained>,
    /// The misfit of the readings taken as configured.
    pub as_configured: Metres,
    /// What share of each screw's commanded stroke (rows) was seen of every screw (columns): 1
    /// on the diagonal and 0 elsewhere where all is well.
    pub gains: Vec<Vec<f64>>,
}

/// What explains the stops `sightings`, seen after `datum` was seen with all screws at their
/// zero; `homed` is the coordinate that each screw was given where it was homed.
///
/// `None` where some screw was not moved alone at three stops at least, or where something is
/// not finite.
#[must_use]
pub fn judge(
    platform: &Platform,
    homed: &[Metres],
    datum: Pose,
    sightings: &[Sighting],
    tolerance: Tolerance,
) -> Option<Verdict> {
    let readings = Readings::new(platform, homed, datum, sightings)?;
    let as_configured = misfit(&readings, None);
    if !as_configured.is_finite() {
        return None;
    }
    let limit = (IMPROVEMENT * as_configured).min(tolerance.size.value());
    let mut causes: Vec<(f64, Cause)> = fit::alternatives(&readings, tolerance)
        .into_iter()
        .map(|cause| (misfit(&readings, Some(&cause)), cause))
        .filter(|(misfit, _)| *misfit <= limit)
        .collect();
    causes.sort_by(|a, b| a.0.total_cmp(&b.0));
    if let Some(best) = causes.first().map(|it| it.0) {
        causes.retain(|it| it.0 <= ALIKE * best);
    }
    let explained = causes.into_iter().map(|(misfit, cause)| Explained {
        cause,
        misfit: Metres(misfit),
    });
    Some(Verdict {
        causes: explained.collect(),
        as_configured: Metres(as_configured),
        gains: fit::gains(&readings),
    })
}

/// The largest rms deviation of any screw while any screw is moved, metres.
fn misfit(readings: &Readings<'_>, cause: Option<&Cause>) -> f64 {
    let cells = cells(readings, cause);
    cells.iter().map(|it| rms(it)).fold(0.0, |most, it| {
        if most.is_nan() || it.is_nan() {
            f64::NAN
        } else {
            f64::max(most, it)
        }
    })
}
