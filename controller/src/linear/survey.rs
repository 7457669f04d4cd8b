//! When the search for the zero fails: whether the magnets are where the configuration says, and what it
//! says of the axis when they are not.

use compensator::hall_zero::{
    HallPoint, Reason, SearchFailure, SensorFault, Settings, mistake, pattern,
};
use units::{Metres, MetresPerSecond};

use crate::failure::Failure;
use crate::linear::ZeroConfig;
use crate::linear::finding::PatternFinding;
use crate::linear::stage::{LinearStage, gantry_of};

/// So many samples over the search limit, as configured: the pattern is about as wide.
const SAMPLES_PER_LIMIT: f64 = 10.0;
/// So many over the way from the limit switch to the nominal zero, where an axis that goes farther than it is
/// commanded passes the pattern.
const SAMPLES_PER_WAY: f64 = 400.0;

impl LinearStage<'_> {
    /// What to say of a search that failed: the magnets are looked for over the whole travel.
    pub(super) fn explained_search(
        &mut self,
        config: &ZeroConfig,
        settings: &Settings,
        failure: Box<SearchFailure>,
    ) -> Failure {
        let axis = self.axis.to_owned();
        // A side of a gantry does not pass over the travel alone.
        let is_alone = gantry_of(self.core.config, self.axis).is_none();
        let finding = if is_alone && is_worth_a_survey(&failure) {
            self.survey(config, settings)
        } else {
            Ok(None)
        };
        match finding {
            Err(stopped) if stopped.is_stop() => stopped,
            Ok(Some(finding)) => Failure::PatternElsewhere {
                axis,
                finding: Box::new(finding),
                source: failure,
            },
            // What went wrong on the way to an explanation explains nothing.
            Ok(None) | Err(_) => Failure::Search {
                axis,
                source: failure,
            },
        }
    }

    /// Passes closely over the way to the nominal zero, then over the travel.
    fn survey(
        &mut self,
        config: &ZeroConfig,
        settings: &Settings,
    ) -> Result<Option<PatternFinding>, Failure> {
        let limit = Metres::from_mm(config.negative_limit_mm);
        // An axis that goes farther than it is commanded would run onto its other limit switch on the long
        // way: the short one comes first.
        let passes = [
            (Metres::ZERO, (Metres::ZERO - limit) / SAMPLES_PER_WAY),
            (settings.soft_max, settings.search_limit / SAMPLES_PER_LIMIT),
        ];
        for (end, apart) in passes {
            self.reference(config)?;
            let speed = self.survey_speed(config, apart);
            let points = self.pass(config, end, speed)?.points;
            let found = self.finding(config, settings, &points);
            if found.is_some() {
                return Ok(found);
            }
        }
        Ok(None)
    }

    /// So fast that samples lie this far apart, at most as fast as to the limit switch.
    fn survey_speed(&self, config: &ZeroConfig, apart: Metres) -> MetresPerSecond {
        let reference = MetresPerSecond(config.reference_speed_mm_per_s * 1e-3);
        let period = self.sampling(config).as_secs_f64();
        reference.min(MetresPerSecond(apart.value() / period))
    }

    fn finding(
        &self,
        config: &ZeroConfig,
        settings: &Settings,
        points: &[HallPoint],
    ) -> Option<PatternFinding> {
        let limit = Metres::from_mm(config.negative_limit_mm);
        let pattern = pattern(points, settings)?;
        Some(PatternFinding {
            axis: self.axis.to_owned(),
            mistake: mistake(&pattern, limit, Metres::ZERO, settings)?,
            seen: pattern.middle - limit,
            configured: Metres::ZERO - limit,
            resolution_nm: self.config.motion.resolution_nm,
        })
    }
}

/// Whether magnets elsewhere can be the cause.
fn is_worth_a_survey(failure: &SearchFailure) -> bool {
    let is_dead = matches!(
        failure.cause,
        Some(SensorFault::Saturated { .. } | SensorFault::Stuck { .. })
    );
    let is_of_the_axis = matches!(
        failure.reason,
        Reason::NotMoving | Reason::WrongDirection | Reason::BadSample | Reason::TimedOut
    );
    !is_dead && !is_of_the_axis
}
