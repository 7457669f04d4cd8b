//! What comes out of a search.

use core::time::Duration;

use units::{Metres, MetresPerSecond, Volts};

use super::{Held, Sample};
use crate::hall_zero::{
    HallPoint, RefineError, RefineOptions, SearchFailure, Settings, ZeroEstimate, refine,
};

/// A zero found by the patent's steps.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// V1max.
    pub peak_max: Volts,
    /// G1 with P1, on the left flank.
    pub g1: Held,
    /// G2 with P2, on the right flank.
    pub g2: Held,
    /// P0 with G8: where the axis stands now.
    pub p0: Held,
    /// Every sample from the nominal zero on.
    pub samples: Vec<Sample>,
    /// How long it took.
    pub elapsed: Duration,
    /// How often a band had to be started over, in all steps together.
    pub restarts: u32,
}

impl Outcome {
    /// The regression over every sample of the search; see [`refine`].
    ///
    /// # Errors
    /// As [`refine`]; and when it lies further from P0 than the bands δ2 and δ3 explain.
    pub fn refine(&self, settings: &Settings) -> Result<ZeroEstimate, RefineError> {
        let points: Vec<HallPoint> = self.samples.iter().map(Sample::point).collect();
        let mut estimate = refine(&points, &RefineOptions::for_search(settings))?;
        let p0 = self.p0.position;
        estimate.p0_patent = Some(p0);
        // δ3 and δ2 are voltages; the slopes turn them into the patent's own tolerance.
        let flank = estimate
            .left
            .slope_v_per_m
            .abs()
            .min(estimate.right.slope_v_per_m.abs());
        let own = settings.delta3.value() / estimate.centre_slope_v_per_m.abs()
            + settings.delta2.value() / flank;
        let limit = Metres(2.0 * own);
        if (estimate.origin - p0).abs() > limit {
            return Err(RefineError::Disagrees {
                origin: estimate.origin,
                p0,
                limit,
            });
        }
        Ok(estimate)
    }
}

/// What the search wants of the axis until the next sample.
#[derive(Clone, Debug, PartialEq)]
pub enum Progress {
    /// Move towards `to`; a new wish comes long before it is reached, or there.
    Move {
        /// Where to, never beyond the bounds of the search.
        to: Metres,
        /// How fast at most.
        speed: MetresPerSecond,
    },
    /// Stop and stand still.
    Stand,
    /// Found; the axis stands at P0.
    Found(Box<Outcome>),
    /// Not found; stop the axis.
    Failed(Box<SearchFailure>),
}
