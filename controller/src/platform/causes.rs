//! Which key of the configuration is wrong, where a platform's readings say so.
//!
//! A calibration that is refused is looked at once more: when the readings fit a machine that differs
//! from the configuration in one thing, that thing is named with the key to change
//! ([`compensator::platform::cause`]).

use compensator::platform::cause::{Sighting, Tolerance, judge};
use units::Metres;

use crate::failure::Failure;
use crate::platform::explanation::Explanation;
use crate::platform::failure::PlatformFailure;
use crate::platform::handle::AlignmentPlatform;

impl AlignmentPlatform<'_> {
    /// `failure`, with what of the configuration explains the readings; as it is where they do not
    /// contradict the configuration beyond what a screw may do.
    pub(super) fn explained(&self, failure: Failure, sightings: &[Sighting]) -> Failure {
        let is_judgement = match failure.of_kind() {
            Some(own) => matches!(
                own,
                PlatformFailure::Fit { .. } | PlatformFailure::Compensation { .. }
            ),
            None => matches!(failure, Failure::Closure { .. }),
        };
        let explanation = is_judgement.then(|| self.explanation(sightings)).flatten();
        match explanation {
            None => failure,
            Some(explanation) => PlatformFailure::Misdescribed {
                explanation: Box::new(explanation),
                source: Box::new(failure),
            }
            .into(),
        }
    }

    fn explanation(&self, sightings: &[Sighting]) -> Option<Explanation> {
        let limits = self.config.compensation.as_ref()?;
        let tolerance = Tolerance {
            size: Metres::from_um(limits.size_limit_um),
            slope: limits.slope_limit,
        };
        let kinematics = &self.state.kinematics;
        let homed: Vec<_> = self.state.screws.iter().map(|it| it.index).collect();
        let verdict = judge(kinematics, &homed, self.state.datum?, sightings, tolerance)?;
        let is_gross = verdict.as_configured > tolerance.size;
        if verdict.causes.is_empty() && !is_gross {
            return None;
        }
        let screw = |axis: &String| {
            (
                axis.clone(),
                self.core.config.axis[axis].motion.resolution_nm,
            )
        };
        let camera = &self.config.camera;
        Some(Explanation {
            verdict,
            screws: self.state.screws.iter().map(|it| screw(&it.axis)).collect(),
            camera: (camera.clone(), self.core.config.camera[camera].keys()),
        })
    }
}
