//! What comes out of a search.

use core::time::Duration;

use units::{Metres, MetresPerSecond, Volts};

use super::{Held, Sample};
use crate::hall_zero::{
    HallPoint, Pass, RefineError, RefineOptions, SearchFailure, Settings, ZeroEstimate, jump,
    refine, refine_passes,
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
        self.agreed(
            refine(&points, &RefineOptions::for_search(settings))?,
            settings,
        )
    }

    /// The regression over passes that were made after the search; see [`refine_passes`].
    ///
    /// # Errors
    /// As [`refine_passes`], or the jump of a voltage between two samples that spoilt it; when the slope sensor is the
    /// wrong way round in them; and when it lies further from P0 than the bands δ2 and δ3 and the lost motion
    /// explain.
    pub fn refine_by_passes(
        &self,
        passes: &[Pass],
        settings: &Settings,
    ) -> Result<ZeroEstimate, RefineError> {
        let options = RefineOptions::for_search(settings);
        let refined = refine_passes(passes, &options);
        let estimate = refined.map_err(|error| {
            let each = passes.iter().flat_map(|pass| pass.points.iter().copied());
            let points: Vec<HallPoint> = each.collect();
            jump::find(&points, settings).map_or(error, RefineError::Jumped)
        })?;
        if (estimate.centre_slope_v_per_m > 0.0) != settings.slope_rising {
            return Err(RefineError::SlopeInverted);
        }
        self.agreed(estimate, settings)
    }

    /// How fast the flanks that were found may be passed when a sample is taken every `sampling`.
    pub fn fastest_pass(&self, settings: &Settings, sampling: Duration) -> MetresPerSecond {
        let distance = self.g2.position - self.g1.position;
        RefineOptions::for_search(settings).fastest_pass(distance, sampling)
    }

    /// How wide the part of a flank is that gives its place.
    pub fn window(&self, settings: &Settings) -> Metres {
        let distance = self.g2.position - self.g1.position;
        RefineOptions::for_search(settings).window(distance)
    }

    /// `estimate`, if it is where the search stands.
    fn agreed(
        &self,
        mut estimate: ZeroEstimate,
        settings: &Settings,
    ) -> Result<ZeroEstimate, RefineError> {
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
        // The search has come to P0, G1 and G2 from one side each.
        let lost_motion = estimate
            .passes
            .map_or(Metres::ZERO, |it| it.lost_motion.abs());
        let limit = Metres(2.0 * own) + lost_motion;
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
///
/// # Example
///
/// A search goes to the nominal zero first, and gives up when nothing moves.
///
/// ```
/// use compensator::hall_zero::{Progress, Reason, Sample, Search, Settings};
/// use units::{Metres, Time, Volts};
///
/// let mut search = Search::new(Settings::default(), Metres::from_mm(1.0), Time::ZERO)?;
/// let mut look = |seconds: f64| {
///     let (at, position) = (Time::from_seconds(seconds), Metres::ZERO);
///     let (peak, slope) = (Volts(2.0), Volts(2.5));
///     search.handle_sample(&Sample { at, position, peak, slope, standing: true })
/// };
/// assert!(matches!(look(0.0), Progress::Move { to, .. } if to == Metres::from_mm(1.0)));
/// let Progress::Failed(failure) = look(3.0) else { unreachable!("2 s are the limit") };
/// assert!(matches!(failure.reason, Reason::NotMoving));
/// # Ok::<(), compensator::hall_zero::SettingsError>(())
/// ```
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
