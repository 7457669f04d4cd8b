//! What an axis is, and what corrects it: along a way, or round and round.

use core::time::Duration;

use machine::{AxisSettings, Machine};
use truestage::Failure;
use truestage::linear::Course;
use truestage::rotary::TableCourse;
use units::{Approach, Metres, Radians, Time};

use crate::coordinate::Coordinate;

/// What an axis is, with what corrects its moves.
pub(crate) enum Mechanics {
    Linear(Box<Linear>),
    Turning(Box<TableCourse>),
}

/// An axis along a way: within what it is moved, and what corrects that.
pub(crate) struct Linear {
    pub(super) settings: AxisSettings,
    pub(super) course: Course,
}

/// What a drive said last.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sampled {
    pub(super) at: Time,
    pub(super) standing: bool,
    pub(super) position: Coordinate,
}

impl Mechanics {
    /// Of the axis `name`, by what is in use now.
    pub(crate) fn of(machine: &mut truestage::Machine, name: &str) -> Result<Self, Failure> {
        if machine.config().rotary.contains_key(name) {
            let course = machine.rotary(name)?.course();
            return Ok(Self::Turning(Box::new(course)));
        }
        Ok(Self::Linear(Box::new(Linear {
            settings: *machine.axis_settings(name)?,
            course: machine.linear(name)?.course(),
        })))
    }

    /// For how long the axis `name` must have been in position.
    pub(super) fn in_position(machine: &truestage::Machine, name: &str) -> Duration {
        let config = machine.config();
        let linear = config.axis.get(name);
        let linear = linear.map(|it| it.motion.position_window_time_ms);
        let turning = config.rotary.get(name);
        let turning = turning.map(|it| it.position_window_time_ms);
        Duration::from_millis(linear.or(turning).unwrap_or_default().into())
    }

    /// How near its target the axis `name` must be.
    pub(super) fn position_window(machine: &truestage::Machine, name: &str) -> Coordinate {
        let config = machine.config();
        let turning = config.rotary.get(name);
        let turning = turning.map(|table| Radians::from_arcsec(table.position_window_arcsec));
        let linear = config.axis.get(name);
        let linear = linear.map(|axis| Metres::from_um(axis.motion.position_window_um));
        turning.map_or_else(|| linear.unwrap_or_default().into(), |window| window.into())
    }

    /// How long one move of the axis `name` may take.
    pub(super) fn move_timeout(machine: &truestage::Machine, name: &str) -> Duration {
        let config = machine.config();
        let linear = config.axis.get(name).map(|it| it.motion.move_timeout_s);
        let turning = config.rotary.get(name).map(|it| it.move_timeout_s);
        let seconds = linear.or(turning).unwrap_or_default();
        Duration::try_from_secs_f64(seconds).unwrap_or_default()
    }

    /// The soft limits, where there are some.
    pub(super) fn soft_limits(&self) -> Option<(Metres, Metres)> {
        match self {
            Self::Linear(it) => Some((it.settings.soft_min, it.settings.soft_max)),
            Self::Turning(_) => None,
        }
    }

    /// What the drive of the axis `name` said last.
    pub(super) fn sampled(&self, machine: &Machine, name: &str) -> Option<Sampled> {
        match self {
            Self::Linear(_) => machine.reading(name).ok().flatten().map(|it| Sampled {
                at: it.at,
                standing: it.standing,
                position: it.position.into(),
            }),
            Self::Turning(_) => {
                let reading = machine.devices().rotary_reading(name).ok().flatten();
                reading.map(|it| Sampled {
                    at: it.at,
                    standing: it.standing,
                    position: it.position.into(),
                })
            }
        }
    }

    /// Whether the axis `name` does not move, whatever its drive says of its target.
    pub(super) fn is_at_rest(&self, machine: &Machine, name: &str) -> bool {
        let at_rest = match self {
            Self::Linear(_) => machine.reading(name).ok().flatten().map(|it| it.at_rest),
            Self::Turning(_) => {
                let reading = machine.devices().rotary_reading(name).ok().flatten();
                reading.map(|it| it.at_rest)
            }
        };
        at_rest.unwrap_or(false)
    }

    /// Where the point of the axis `name` is when its encoder says `encoder`; `None` where nothing corrects that.
    pub(super) fn place(
        &self,
        machine: &Machine,
        name: &str,
        encoder: Coordinate,
    ) -> Option<Coordinate> {
        match (self, encoder) {
            (Self::Linear(it), Coordinate::Length(encoder)) => {
                let place = it.course.place(encoder, approach(machine, name))?;
                Some(place.into())
            }
            (Self::Turning(course), Coordinate::Angle(encoder)) => {
                Some(course.place(encoder)?.into())
            }
            (Self::Linear(_), Coordinate::Angle(_)) | (Self::Turning(_), Coordinate::Length(_)) => {
                None
            }
        }
    }

    /// How uncertain the place of the axis `name` is, at rest after a move that was made to its end or not.
    pub(super) fn standard_uncertainty(
        &self,
        machine: &Machine,
        name: &str,
        has_arrived: bool,
    ) -> Option<Coordinate> {
        match (self, self.sampled(machine, name)?.position) {
            (Self::Linear(it), Coordinate::Length(encoder)) => {
                let approach = approach(machine, name);
                let combined = it.course.uncertainty_at(encoder, approach, has_arrived)?;
                Some(combined.standard_uncertainty.into())
            }
            (Self::Turning(course), Coordinate::Angle(encoder)) if has_arrived => {
                Some(course.standard_uncertainty(encoder)?.into())
            }
            _ => None,
        }
    }
}

/// From which side the axis `name` came to where it is.
pub(super) fn approach(machine: &Machine, name: &str) -> Approach {
    let tracker = machine.approach(name).ok();
    let approach = tracker.and_then(|it| it.approach());
    approach.unwrap_or(Approach::Forward)
}
