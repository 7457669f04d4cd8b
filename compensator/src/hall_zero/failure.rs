//! How a search fails: which step, which values, and what it looks like.

use core::fmt;
use core::time::Duration;

use units::{Metres, Volts};

use super::{Sample, Sensor, SensorFault};

/// The steps of the patent, and the way to the start.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Step {
    /// Going to the nominal zero.
    Start,
    /// Step 1: G7, the maximum of V1.
    Peak,
    /// Step 2: G1 on the left flank, with P1.
    LeftFlank,
    /// Step 3: G2 on the right flank, with P2.
    RightFlank,
    /// Step 4: P0 between them.
    Centre,
    /// Step 5: V1 at P0 against its maximum.
    Check,
}

impl fmt::Display for Step {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Start => "start (nominal zero)",
            Self::Peak => "step 1 (G7, peak)",
            Self::LeftFlank => "step 2 (G1, left flank)",
            Self::RightFlank => "step 3 (G2, right flank)",
            Self::Centre => "step 4 (P0, centre)",
            Self::Check => "step 5 (check of P0)",
        })
    }
}

/// What ended the search.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reason {
    /// The travel allowed was searched without success.
    TravelExhausted,
    /// The time limit passed.
    TimedOut,
    /// The samples of one band were started over too often.
    TooManyRestarts,
    /// Step 4 passed P0 by: V1 fell to V1_G1 − Vc.
    CentrePassed,
    /// Step 5: V1 at P0 is not at its maximum.
    CheckFailed,
    /// The axis did not move where motion was wanted.
    NotMoving,
    /// The axis moved the other way.
    WrongDirection,
    /// A sample was NaN, infinite or older than the one before.
    BadSample,
    /// A sensor is broken; the cause says how.
    SensorFault,
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::TravelExhausted => "travel exhausted",
            Self::TimedOut => "time limit passed",
            Self::TooManyRestarts => "the voltage did not stay in its band",
            Self::CentrePassed => "P0 passed without being met",
            Self::CheckFailed => "V1 at P0 is not its maximum",
            Self::NotMoving => "the axis does not move",
            Self::WrongDirection => "the axis moves in the wrong direction",
            Self::BadSample => "sample not finite or out of order",
            Self::SensorFault => "sensor fault",
        })
    }
}

/// A failed search, for an operator and for a machine.
#[derive(Clone, Debug, PartialEq)]
pub struct SearchFailure {
    /// The step that failed.
    pub step: Step,
    /// What ended it.
    pub reason: Reason,
    /// The sensor the step looks at.
    pub sensor: Sensor,
    /// Its last voltage.
    pub seen: Volts,
    /// The voltage wanted.
    pub wanted: Volts,
    /// Half width of the band around it.
    pub tolerance: Volts,
    /// Distance from the nominal zero at the end.
    pub searched: Metres,
    /// The distance allowed.
    pub search_limit: Metres,
    /// How long the search took.
    pub elapsed: Duration,
    /// What the sensors look like, if something is recognised.
    pub cause: Option<SensorFault>,
    /// Every sample taken.
    pub samples: Vec<Sample>,
}

impl fmt::Display for SearchFailure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "hall zero, {}: ", self.step)?;
        // On the way to the start no voltage is wanted yet.
        if self.step != Step::Start {
            let (seen, wanted) = (self.seen.value(), self.wanted.value());
            let tolerance = self.tolerance.value();
            write!(
                f,
                "{} {seen:.4} V, wanted {wanted:.4} ± {tolerance:.4} V, ",
                self.sensor
            )?;
        }
        let (searched, limit) = (self.searched.um(), self.search_limit.um());
        match self.step {
            Step::Start => write!(f, "{searched:.0} um from it: {}", self.reason)?,
            _ => write!(
                f,
                "searched {searched:.0} of {limit:.0} um: {}",
                self.reason
            )?,
        }
        match &self.cause {
            Some(cause) => write!(f, "; {cause}"),
            None => Ok(()),
        }
    }
}

impl core::error::Error for SearchFailure {}
