//! What to say of a homing that did not end.

use drivers::device::TRAVEL_MARGIN;
use units::Metres;

use crate::failure::Failure;
use crate::handle::Core;

/// An axis that has gone this share of its configured travel before it cannot follow was sent as fast as it can go.
const SEARCHED_MIN: f64 = 0.1;

/// Where an axis says that it is; `None` before it has said anything.
pub(crate) fn place(core: &Core<'_>, axis: &str) -> Result<Option<Metres>, Failure> {
    Ok(core.reading(axis)?.map(|it| it.position))
}

/// `failure` of a homing that began at `start`; told by how far the axis says that it has moved, where that is
/// more than it can.
pub(crate) fn explained(
    core: &Core<'_>,
    axis: &str,
    start: Option<Metres>,
    failure: Failure,
) -> Failure {
    let is_endless = match &failure {
        Failure::Machine(machine::Failure::Overdue { .. }) => true,
        Failure::Machine(machine::Failure::Alarm { alarm, .. }) => alarm.is_endless_search(),
        _ => false,
    };
    let here = place(core, axis).ok().flatten();
    let (Some(start), Some(here)) = (start, here) else {
        return failure;
    };
    let motion = &core.config.axis[axis].motion;
    let travel = Metres::from_mm(motion.soft_max_mm - motion.soft_min_mm);
    let moved = (here - start).abs();
    if cannot_follow(&failure) && moved > travel * SEARCHED_MIN {
        return Failure::BeforeZero {
            axis: axis.to_owned(),
            resolution_nm: motion.resolution_nm,
            searched: Some(moved),
            source: Box::new(failure),
        };
    }
    if !is_endless || moved <= travel * TRAVEL_MARGIN {
        return failure;
    }
    Failure::NoLimitSwitch {
        axis: axis.to_owned(),
        moved,
        travel,
        resolution_nm: motion.resolution_nm,
        source: Box::new(failure),
    }
}

/// `failure` of an axis that had not found its zero, by which alone it is known how far a count is: told by that,
/// where its drive could not follow.
pub(crate) fn before_zero(core: &Core<'_>, axis: &str, failure: Failure) -> Failure {
    if !cannot_follow(&failure) {
        return failure;
    }
    Failure::BeforeZero {
        axis: axis.to_owned(),
        resolution_nm: core.config.axis[axis].motion.resolution_nm,
        searched: None,
        source: Box::new(failure),
    }
}

/// Whether a drive says that its axis does not follow.
fn cannot_follow(failure: &Failure) -> bool {
    match failure {
        Failure::Machine(machine::Failure::Alarm { alarm, .. }) => alarm.is_following_error(),
        _ => false,
    }
}
