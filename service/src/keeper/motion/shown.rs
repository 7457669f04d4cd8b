//! Motions as they are shown.

use machine::Machine;
use truestage::linear::{Corrected, LinearTeller, Moved};
use truestage::rotary::RotaryTeller;
use truestage::runs::{Teller, Told};

use super::super::groups::Grouped;
use super::super::mechanics::{Mechanics, approach};
use super::super::seat::Seat;
use super::going::Going;
use super::{End, Leg, Motion, Phase, together};
use crate::coordinate::Coordinate;
use crate::view::{LegView, MotionState, MotionView, ToldView};

/// A motion that is under way.
pub(super) fn view(motion: &Motion, seats: &[Seat]) -> MotionView {
    let legs = motion.legs.iter().map(|leg| {
        let view = LegView {
            target: leg.target.shown(),
            set_point: leg.going.map(|it| it.set_point().shown()),
            speed: leg.going.map(|it| it.speed()),
            corrected: leg.corrected().word().to_owned(),
            position: None,
            encoder: None,
            standard_uncertainty: None,
            told: None,
        };
        (seats[leg.at].name.to_string(), view)
    });
    let axes = match &motion.together {
        Some(together) => together.legs(),
        None => legs.collect(),
    };
    MotionView {
        id: motion.id.to_string(),
        by: motion.by.clone(),
        accepted: motion.accepted.clone(),
        state: match motion.phase {
            Phase::Queued => MotionState::Queued,
            Phase::Moving => MotionState::Moving,
            Phase::Stopping(_) => MotionState::Stopping,
        },
        stopped: None,
        cause: None,
        axes,
        told: None,
        kept: None,
    }
}

/// A motion that has ended, with where its axes stand.
pub(super) fn ended(
    motion: &Motion,
    (seats, groups): (&[Seat], &[Grouped]),
    machine: &Machine,
    teller: Option<&Teller>,
    end: End,
) -> MotionView {
    let mut view = view(motion, seats);
    if let Some(together) = &motion.together {
        let standing = groups[together.group()].standing(machine);
        view.axes = together::ended(together, seats, machine, &standing);
        let told = together.moved().and_then(|it| it.told.clone());
        view.told = told
            .filter(|_| matches!(end, End::Done))
            .map(ToldView::from);
    }
    for leg in &motion.legs {
        let seat = &seats[leg.at];
        let Some(shown) = view.axes.get_mut(&*seat.name) else {
            continue;
        };
        let sample = seat.sample(machine);
        (shown.position, shown.encoder) = seat.place_shown(machine);
        shown.standard_uncertainty = sample.standard_uncertainty.map(Coordinate::small);
        shown.told = match (&end, teller) {
            (End::Done, Some(teller)) => told(leg, seat, machine, teller).map(ToldView::from),
            _ => None,
        };
    }
    (view.state, view.stopped, view.cause) = match end {
        End::Done => (MotionState::Done, None, None),
        End::Stopped(stopped) => (MotionState::Stopped, Some(stopped), None),
        End::Failed(cause) => (MotionState::Failed, None, Some(cause)),
        End::TimedOut(cause) => (MotionState::TimedOut, None, Some(cause)),
    };
    view
}

/// What the command line says of a move to where an axis stands now.
fn told(leg: &Leg, seat: &Seat, machine: &Machine, teller: &Teller) -> Option<Told> {
    let is_corrected = leg.corrected() != Corrected::No;
    let calibration = seat.calibration.as_ref().filter(|_| is_corrected);
    let calibration = calibration.map(|it| it.id.as_str());
    let encoder = seat.mechanics.sampled(machine, &seat.name)?.position;
    match (&seat.mechanics, leg.going?, encoder) {
        (Mechanics::Linear(own), Going::Along(planned), Coordinate::Length(encoder)) => {
            let Coordinate::Length(target) = leg.target else {
                return None;
            };
            let (course, approach) = (&own.course, approach(machine, &seat.name));
            let uncertainty = course.uncertainty_at(encoder, approach, leg.has_arrived());
            let moved = Moved {
                target,
                set_point: planned.set_point,
                encoder,
                approach,
                corrected: leg.corrected(),
                place: course.place(encoder, approach).filter(|_| is_corrected),
                uncertainty: uncertainty.filter(|_| is_corrected),
            };
            let teller = teller.of::<LinearTeller>()?;
            Some((teller.moved)(&seat.name, &moved, calibration))
        }
        (Mechanics::Turning(course), Going::Round(planned), Coordinate::Angle(reading)) => {
            let moved = course.moved(&planned, reading);
            let teller = teller.of::<RotaryTeller>()?;
            Some((teller.moved)(&seat.name, &moved, calibration))
        }
        _ => None,
    }
}
