//! Axes that run until their time is over or they can go no further, whatever kind they are.

use core::time::Duration;

use machine::{Driving, Machine, STOP_LIMIT};
use units::{AxisSpeed, MetresPerSecond, RadiansPerSecond};

use crate::failure::Failure;

/// How often an end is looked for.
const LOOK: Duration = Duration::from_millis(20);

/// How a jog ended.
#[cfg(feature = "program")]
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Jogged {
    /// Where the axis stands, by its encoder.
    pub(crate) position: units::LengthOrAngle,
    /// Whether it ended by itself: it goes no further.
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
#[cfg(feature = "program")]
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

/// Lets `axes` run on, for so long at most, to where they have been sent; they stand afterwards. Whether they came there.
///
/// # Errors
/// Whatever stops the machine.
pub(crate) fn run_on(
    machine: &mut Machine,
    axes: &[&str],
    duration: Option<Duration>,
) -> Result<bool, Failure> {
    let end = duration.map(|it| machine.now() + it);
    let mut under_way = axes.to_vec();
    loop {
        machine.tick(machine.now() + LOOK)?;
        under_way = still_under_way(machine, under_way)?;
        if under_way.is_empty() {
            return Ok(true);
        }
        if end.is_some_and(|end| machine.now() >= end) {
            bring_to_rest(machine, under_way)?;
            return Ok(false);
        }
    }
}

/// Those of `axes` whose command has not ended.
fn still_under_way<'a>(machine: &mut Machine, axes: Vec<&'a str>) -> Result<Vec<&'a str>, Failure> {
    let mut under_way = Vec::new();
    for axis in axes {
        match Driving::of(machine, axis)?.outcome() {
            Some(outcome) => outcome?,
            None => under_way.push(axis),
        }
    }
    Ok(under_way)
}

/// Slows all of `axes` down at once, and waits until they stand.
fn bring_to_rest(machine: &mut Machine, mut axes: Vec<&str>) -> Result<(), Failure> {
    for axis in &axes {
        Driving::of(machine, axis)?.halt();
    }
    let waited = machine.patience().of(STOP_LIMIT);
    let limit = machine.now() + waited;
    loop {
        machine.tick((machine.now() + LOOK).min(limit))?;
        axes = still_under_way(machine, axes)?;
        let Some(axis) = axes.first() else {
            return Ok(());
        };
        if machine.now() >= limit {
            let device = (*axis).to_owned();
            let step = "halt";
            return Err(machine::Failure::Overdue {
                device,
                step,
                waited,
            }
            .into());
        }
    }
}
