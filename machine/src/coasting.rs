//! Axes that move on after their drives were switched off.
//!
//! A drive without torque (STO, a fault) says at once that it is off, and its table turns on. A stop ends when the axis
//! stands by its samples.

use core::time::Duration;

use drivers::device::Place;
use units::{LengthOrAngle, Metres, Radians, Time};

use crate::machine::Machine;

/// How long an axis that cannot be braked is watched until it stands.
pub(crate) const COAST_LIMIT: Duration = Duration::from_secs(10);
/// A drive that was heard before says where its axis is within this time.
const SILENT_MAX: Duration = Duration::from_secs(1);
/// A speed is that over so much of time.
const SPEED_OVER: Duration = Duration::from_millis(100);
/// An axis that coasts for so long is worth a word.
const WORTH_A_WORD: Duration = Duration::from_millis(500);

/// An axis whose drive was switched off.
struct Coasting {
    at: usize,
    /// The sample that its speed is counted from.
    from: Option<Place>,
    /// Its speed in a second, as far as that is known.
    speed: Option<LengthOrAngle>,
}

impl Coasting {
    /// Takes the newest sample; whether it has come to rest since `off`.
    fn has_stopped(&mut self, place: Option<Place>, off: Time) -> bool {
        let Some(place) = place.filter(|place| place.at > off) else {
            return false;
        };
        let from = *self.from.get_or_insert(place);
        if place.at >= from.at + SPEED_OVER {
            self.speed = speed(from, place);
            self.from = Some(place);
        }
        place.stands
    }
}

/// The way in a second, from one sample to another.
fn speed(from: Place, to: Place) -> Option<LengthOrAngle> {
    let seconds = to.at.since(from.at).as_secs_f64();
    match (from.position, to.position) {
        (LengthOrAngle::Length(from), LengthOrAngle::Length(to)) => {
            Some(Metres((to - from).value() / seconds).into())
        }
        (LengthOrAngle::Angle(from), LengthOrAngle::Angle(to)) => {
            Some(Radians((to - from).value() / seconds).into())
        }
        _ => None,
    }
}

/// Waits until the axes of `drives` stand, and warns of each one that does not within its time.
pub(crate) fn await_rest(machine: &mut Machine, drives: Vec<usize>) {
    let off = machine.now();
    let drives = drives.into_iter();
    let mut coasting: Vec<Coasting> = drives
        .map(|at| Coasting {
            at,
            from: None,
            speed: None,
        })
        .collect();
    let until = off + machine.patience.of(COAST_LIMIT);
    let mut next_word = off + WORTH_A_WORD;
    loop {
        let devices = &machine.devices;
        coasting.retain_mut(|axis| !axis.has_stopped(devices.drive(axis.at).place(), off));
        let now = machine.now();
        if now >= next_word {
            next_word = Time::NEVER;
            say_waiting(machine, &coasting);
        }
        let silent_after = off + machine.patience.of(SILENT_MAX);
        let is_heard = coasting.iter().any(|axis| axis.from.is_some());
        let deadline = if is_heard { until } else { silent_after };
        if coasting.is_empty() || now >= deadline || machine.tick(deadline.min(next_word)).is_err()
        {
            break;
        }
    }
    for axis in coasting {
        let name = machine.devices.name(axis.at);
        let speed = axis.speed.filter(|_| axis.from.is_some());
        machine.notices.warn_restless(&name, speed);
    }
}

fn say_waiting(machine: &mut Machine, coasting: &[Coasting]) {
    for axis in coasting {
        if let Some(speed) = axis.speed {
            let name = machine.devices.name(axis.at);
            let text = format!("{name}: coasts on without torque at {speed:+.1}/s");
            machine.notices.observer.waiting(&text);
        }
    }
}
