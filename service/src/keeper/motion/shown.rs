//! Motions as they are shown.

use machine::Machine;
use truestage::linear::{Corrected, Moved, Teller};
use units::Metres;

use super::super::seat::Seat;
use super::{End, Leg, Motion, Phase};
use crate::quantity::Quantity;
use crate::view::{LegView, MotionState, MotionView, ToldView};

/// A motion that is under way.
pub(super) fn view(motion: &Motion, seats: &[Seat]) -> MotionView {
    let legs = motion.legs.iter().map(|leg| {
        let view = LegView {
            target: Quantity::mm(leg.target),
            set_point: leg.planned.map(|it| Quantity::mm(it.set_point)),
            corrected: leg.corrected().word().to_owned(),
            position: None,
            encoder: None,
            standard_uncertainty: None,
            told: None,
        };
        (seats[leg.at].name.to_string(), view)
    });
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
        axes: legs.collect(),
    }
}

/// A motion that has ended, with where its axes stand.
pub(super) fn ended(
    motion: &Motion,
    seats: &[Seat],
    machine: &Machine,
    teller: Option<Teller>,
    end: End,
) -> MotionView {
    let mut view = view(motion, seats);
    for leg in &motion.legs {
        let seat = &seats[leg.at];
        let Some(shown) = view.axes.get_mut(&*seat.name) else {
            continue;
        };
        let sample = seat.sample(machine);
        let place: Option<Metres> = sample.place.or(sample.encoder);
        shown.position = place.map(Quantity::mm);
        shown.encoder = sample.encoder.map(Quantity::mm);
        shown.standard_uncertainty = sample.standard_uncertainty.map(Quantity::um);
        shown.told = match (&end, teller) {
            (End::Done, Some(teller)) => told(leg, seat, machine, teller),
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
fn told(leg: &Leg, seat: &Seat, machine: &Machine, teller: Teller) -> Option<ToldView> {
    let encoder = machine.reading(&seat.name).ok().flatten()?.position;
    let approach = seat.approach(machine);
    let is_corrected = leg.corrected() != Corrected::No;
    let moved = Moved {
        target: leg.target,
        set_point: leg.planned?.set_point,
        encoder,
        approach,
        corrected: leg.corrected(),
        place: seat
            .course
            .place(encoder, approach)
            .filter(|_| is_corrected),
        uncertainty: seat
            .course
            .uncertainty_at(encoder, approach, leg.has_arrived())
            .filter(|_| is_corrected),
    };
    let calibration = seat.calibration.as_ref().filter(|_| is_corrected);
    let told = (teller.moved)(&seat.name, &moved, calibration.map(|it| &*it.id));
    Some(ToldView::from(told))
}
