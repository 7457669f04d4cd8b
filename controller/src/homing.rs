//! What to say of a homing that did not end.

use units::Metres;

use crate::failure::Failure;
use crate::handle::Core;

/// An axis that moves this many times its configured travel without meeting a limit switch moves less than
/// it says.
const TRAVELS_MAX: f64 = 1.5;

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
    let is_overdue = matches!(failure, Failure::Machine(machine::Failure::Overdue { .. }));
    let here = place(core, axis).ok().flatten();
    let (true, Some(start), Some(here)) = (is_overdue, start, here) else {
        return failure;
    };
    let motion = &core.config.axis[axis].motion;
    let travel = Metres::from_mm(motion.soft_max_mm - motion.soft_min_mm);
    let moved = (here - start).abs();
    if moved <= travel * TRAVELS_MAX {
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
    match &failure {
        Failure::Machine(machine::Failure::Alarm { alarm, .. }) if alarm.is_following_error() => {
            Failure::BeforeZero {
                axis: axis.to_owned(),
                resolution_nm: core.config.axis[axis].motion.resolution_nm,
                source: Box::new(failure),
            }
        }
        _ => failure,
    }
}
