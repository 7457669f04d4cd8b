//! Axes that run until their time is over or they can go no further, whatever kind they are.

use core::time::Duration;

use machine::{Driving, Machine};
use units::{AxisSpeed, LengthOrAngle, MetresPerSecond, RadiansPerSecond};

use crate::failure::Failure;

/// How often an end is looked for.
const LOOK: Duration = Duration::from_millis(20);

/// How a jog ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Jogged {
    /// Where the axis stands, by its encoder.
    pub(crate) position: LengthOrAngle,
    /// Whether it ended where the axis goes no further.
    pub(crate) is_at_end: bool,
}

/// The speed of a jog of `axis`, which goes along a way.
///
/// # Errors
/// When it is an angular one.
pub(crate) fn along(axis: &str, speed: AxisSpeed) -> Result<MetresPerSecond, Failure> {
    match speed {
        AxisSpeed::Linear(it) => Ok(it),
        AxisSpeed::Angular(_) => Err(other_unit(axis, "goes along a way", speed, "2mm/s")),
    }
}

/// The speed of a jog of `axis`, which turns.
///
/// # Errors
/// When it is none of an angle.
pub(crate) fn round(axis: &str, speed: AxisSpeed) -> Result<RadiansPerSecond, Failure> {
    match speed {
        AxisSpeed::Angular(it) => Ok(it),
        AxisSpeed::Linear(_) => Err(other_unit(axis, "turns", speed, "5deg/s")),
    }
}

fn other_unit(axis: &str, does: &str, seen: AxisSpeed, expected: &str) -> Failure {
    Failure::Usage {
        what: format!("axis {axis} {does}, and {seen} is no speed of it"),
        help: format!("write {axis}={expected}, say"),
    }
}

/// Refuses a `speed` of `axis` above the `usual` one, which `key` of the configuration says.
///
/// # Errors
/// When it is.
pub(crate) fn require_usual(
    axis: &str,
    (speed, usual): (AxisSpeed, AxisSpeed),
    key: &str,
) -> Result<(), Failure> {
    let speed = speed.abs();
    if speed.value() <= usual.value() {
        return Ok(());
    }
    Err(Failure::Usage {
        what: format!("axis {axis}: {speed:.3} is faster than it usually moves, {usual:.3}"),
        help: format!("jog it slower, or change `{key}` of its section"),
    })
}

/// Lets `axis` run on, for so long at most, to where it has been sent; it stands afterwards. Whether it came there.
///
/// # Errors
/// Whatever stops the machine.
pub(crate) fn run_on(
    machine: &mut Machine,
    axis: &str,
    duration: Option<Duration>,
) -> Result<bool, Failure> {
    let end = duration.map(|it| machine.now() + it);
    loop {
        machine.tick(machine.now() + LOOK)?;
        if let Some(outcome) = Driving::of(machine, axis)?.outcome() {
            outcome?;
            return Ok(true);
        }
        if end.is_some_and(|end| machine.now() >= end) {
            Driving::of(machine, axis)?.come_to_rest()?;
            return Ok(false);
        }
    }
}
