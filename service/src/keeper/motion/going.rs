//! What one axis of a motion is sent, by what it is: along a way, or round and round.

use core::time::Duration;

use machine::{Driving, Failure, Machine, Moving};
use truestage::Agreed;
use truestage::linear::{Corrected, PlannedMove};
use truestage::rotary::{PlannedTurn, Way};
use truestage::runs::Moved;
use units::{Approach, AxisSpeed, Metres, Radians};

use super::super::mechanics::{Linear, Mechanics};
use super::super::seat::Seat;
use super::speed;
use crate::coordinate::Coordinate;
use crate::problem::{Code, Problem};
use crate::quantity::Quantity;

/// So long may an axis be on its way, in hours.
const LONGEST_H: u64 = 24;

/// What an axis is to do: everything has been judged.
#[derive(Clone, Copy, Debug)]
pub(super) enum Going {
    Along(PlannedMove),
    Round(PlannedTurn),
}

/// How whoever asks for a motion wants it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wanted {
    pub(super) agreed: Agreed,
    pub(super) speed: Option<AxisSpeed>,
    pub(super) way: Option<Way>,
    pub(super) approach: Option<Approach>,
}

impl Going {
    /// What the axis of `seat` is to do to be at `target`.
    pub(super) fn plan(
        machine: &Machine,
        seat: &Seat,
        target: Coordinate,
        wanted: Wanted,
    ) -> Result<Self, Problem> {
        let planned = match (&seat.mechanics, target) {
            (Mechanics::Linear(own), Coordinate::Length(target)) => {
                along(machine, seat, own, (target, wanted)).map(Self::Along)
            }
            (Mechanics::Turning(_), Coordinate::Angle(angle)) => {
                round(machine, seat, (angle, wanted)).map(Self::Round)
            }
            (Mechanics::Linear(_), Coordinate::Angle(_)) => Err(other_unit(&seat.name, false)),
            (Mechanics::Turning(_), Coordinate::Length(_)) => Err(other_unit(&seat.name, true)),
        }?;
        if seat.is_enabled(machine) {
            return Ok(planned);
        }
        let what = format!("axis {} is switched off; nothing was moved", seat.name);
        let help = "enable it first, as `truestage enable` does";
        Err(Problem::new(Code::AxisDisabled, what, help))
    }

    /// Where its point goes; angles count on over the turns.
    pub(super) fn target(&self, asked: Coordinate) -> Coordinate {
        match self {
            Self::Along(_) => asked,
            Self::Round(it) => it.target.into(),
        }
    }

    /// What its drive is sent first, where that is not the last.
    pub(super) fn by_way_of(&self) -> Option<Coordinate> {
        match self {
            Self::Along(it) => it.by_way_of.map(Coordinate::from),
            Self::Round(_) => None,
        }
    }

    /// What its drive is sent last.
    pub(super) fn set_point(&self) -> Coordinate {
        match self {
            Self::Along(it) => it.set_point.into(),
            Self::Round(it) => it.set_point.into(),
        }
    }

    /// How fast it goes.
    pub(super) fn speed(&self) -> Quantity {
        match self {
            Self::Along(it) => Quantity::mm_per_s(it.speed),
            Self::Round(it) => Quantity::deg_per_s(it.speed),
        }
    }

    /// # Errors
    /// When nobody can mean to wait for its end.
    pub(super) fn require_an_end(&self, machine: &Machine, seat: &Seat) -> Result<(), Problem> {
        if self.lasts(machine, seat).is_some() {
            return Ok(());
        }
        let axis = &seat.name;
        let what = format!(
            "axis {axis} would be on its way for more than {LONGEST_H} h; nothing was moved"
        );
        let help = "give a nearer target, or a higher speed";
        Err(Problem::new(Code::Refused, what, help))
    }

    /// How long its way takes from where the axis of `seat` is, by the speed alone; `None`: longer than anything may.
    pub(super) fn lasts(&self, machine: &Machine, seat: &Seat) -> Option<Duration> {
        let (way, speed) = match self {
            Self::Along(it) => {
                let reading = machine.reading(&seat.name).ok().flatten();
                let here = reading.map_or(it.set_point, |it| it.position);
                let from = it.by_way_of.unwrap_or(here);
                let way = (from - here).abs() + (it.set_point - from).abs();
                (way.value(), it.speed.value())
            }
            Self::Round(it) => {
                let reading = machine.devices().rotary_reading(&seat.name).ok().flatten();
                let here = reading.map_or(it.set_point, |it| it.position);
                ((it.set_point - here).value(), it.speed.value())
            }
        };
        let lasts = Duration::try_from_secs_f64(way.abs() / speed).ok();
        lasts.filter(|it| *it <= Duration::from_secs(LONGEST_H * 3600))
    }

    /// Whether a calibration corrects it.
    pub(super) const fn corrected(&self) -> Corrected {
        match self {
            Self::Along(it) => it.corrected,
            Self::Round(PlannedTurn {
                corrected: true, ..
            }) => Corrected::Within,
            Self::Round(_) => Corrected::No,
        }
    }

    /// Begins the move of the axis `name` to `set_point`.
    pub(super) fn begin(
        &self,
        machine: &mut Machine,
        name: &str,
        set_point: Coordinate,
    ) -> Result<(), Failure> {
        match (self, set_point) {
            (Self::Along(it), Coordinate::Length(set_point)) => {
                Moving::of(machine, name)?.begin(set_point, it.speed)
            }
            (Self::Along(_), Coordinate::Angle(_)) => Ok(()),
            (Self::Round(it), _) => it.begin(machine, name),
        }
    }

    /// How the move of the axis `name` to `set_point` ended, once it has; from which side it came is remembered.
    pub(super) fn has_arrived(
        machine: &mut Machine,
        name: &str,
        set_point: Option<Coordinate>,
    ) -> Result<bool, Failure> {
        let Some(outcome) = Driving::of(machine, name)?.outcome() else {
            return Ok(false);
        };
        outcome?;
        if let Some(Coordinate::Length(set_point)) = set_point {
            Moving::of(machine, name)?.arrived(set_point);
        }
        Ok(true)
    }
}

/// That the target `name` is a length, or an angle, and was given as the other.
pub(super) fn other_unit(name: &str, turns: bool) -> Problem {
    let (what_it_does, expected) = match turns {
        true => ("turns", "an angle: \"12.5deg\""),
        false => ("goes along a way", "a length: \"12.5mm\""),
    };
    let what = format!("`targets.{name}`: it {what_it_does}");
    Problem::new(Code::NotOffered, what, format!("give {expected}"))
}

fn along(
    machine: &Machine,
    seat: &Seat,
    own: &Linear,
    (target, wanted): (Metres, Wanted),
) -> Result<PlannedMove, Problem> {
    let (axis, agreed) = (&seat.name, wanted.agreed);
    let alone = own.course.uncompensated();
    let course = match (seat.moved, agreed.uncompensated) {
        (Moved::Together, _) => {
            let what = format!("axis {axis} moves only together with others, and not by itself");
            let help = "ask where all of them shall be together: \"targets\": {\"x\": \"1mm\", \"theta\": \"20arcsec\"}";
            return Err(Problem::new(Code::NotOffered, what, help));
        }
        (Moved::CorrectedTogether | Moved::Alone, true) => &alone,
        (Moved::CorrectedTogether | Moved::Alone, false) => &own.course,
    };
    let mut planned = match wanted.approach {
        None => course.plan(machine, axis, target)?,
        Some(approach) => course.plan_from(machine, axis, target, approach)?,
    };
    planned.corrected.require(axis, target, agreed)?;
    if let Some(wanted) = wanted.speed {
        planned.speed = speed::along(axis, wanted)?.min(planned.speed);
    }
    Ok(planned)
}

fn round(
    machine: &Machine,
    seat: &Seat,
    (angle, wanted): (Radians, Wanted),
) -> Result<PlannedTurn, Problem> {
    let axis = &seat.name;
    machine
        .require_zeroed(axis)
        .map_err(truestage::Failure::from)?;
    let reading = machine.devices().rotary_reading(axis);
    let reading = reading.map_err(truestage::Failure::from)?;
    let course = match &seat.mechanics {
        Mechanics::Turning(course) if wanted.agreed.uncompensated => course.uncompensated(),
        Mechanics::Turning(course) => (**course).clone(),
        Mechanics::Linear(_) => return Err(other_unit(&seat.name, false)),
    };
    course.require(axis, wanted.agreed)?;
    let here = reading.map_or(Radians::ZERO, |it| it.position);
    let way = wanted.way.unwrap_or(Way::Shortest);
    let mut planned = course.plan(axis, here, angle, way)?;
    if let Some(wanted) = wanted.speed {
        planned.speed = speed::round(axis, wanted)?.min(planned.speed);
    }
    Ok(planned)
}
