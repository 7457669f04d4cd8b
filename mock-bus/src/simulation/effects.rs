//! What a fault that lasts does to the machine when it begins, and what its end undoes.

use units::{Celsius, Metres, Pascals, Radians, RelativeHumidity};
use wire::can::{BusError, BusErrorClass, ControllerProblem};

use super::{Event, Link, Simulation};
use crate::bus::Sender;
use crate::fault::Fault;
use crate::plant::{Beam, Environment, InputFault, Reflection, Target};

/// Sensors that have lost their calibration memory show such things.
const IMPOSSIBLE: Environment = Environment {
    air_temperature: Celsius(-127.0),
    pressure: Pascals(0.0),
    humidity: RelativeHumidity(1.5),
    stage_temperature: Celsius(-127.0),
};

impl Simulation {
    pub(super) fn begin_fault(&mut self, fault: &Fault) {
        match fault {
            Fault::PowerLoss { node } => self.set_node_power(node, false),
            Fault::ErrorPassive { port } => {
                let passive = ControllerProblem::RX_PASSIVE | ControllerProblem::TX_PASSIVE;
                self.report(port, BusErrorClass::CONTROLLER, passive);
            }
            Fault::BusOff { port } => {
                self.report(port, BusErrorClass::BUS_OFF, ControllerProblem::empty());
                self.set_link(port, Link::Down);
            }
            Fault::LinkDown { port } => self.set_link(port, Link::Down),
            Fault::LinkGone { port } => self.set_link(port, Link::Gone),
            Fault::FringeJump { half_wavelengths } => self.plant.slip_fringes(*half_wavelengths),
            _ => self.set_plant_fault(fault, true),
        }
    }

    pub(super) fn finish_fault(&mut self, fault: &Fault) {
        match fault {
            Fault::PowerLoss { node } => self.set_node_power(node, true),
            Fault::ErrorPassive { port } => {
                self.report(port, BusErrorClass::CONTROLLER, ControllerProblem::ACTIVE);
            }
            Fault::BusOff { port } => {
                self.set_link(port, Link::Up);
                self.report(port, BusErrorClass::RESTARTED, ControllerProblem::empty());
            }
            Fault::LinkDown { port } | Fault::LinkGone { port } => self.set_link(port, Link::Up),
            Fault::Reorder { port, .. } => {
                if let Some(place) = self.config.port(port) {
                    self.release_held_back(place);
                }
            }
            _ => self.set_plant_fault(fault, false),
        }
    }

    fn set_plant_fault(&mut self, fault: &Fault, on: bool) {
        let plant = &mut self.plant;
        match *fault {
            Fault::BlockedAxis { axis } => plant.set_blocked(axis, on),
            Fault::SafeTorqueOff => plant.set_safe_torque_off(on),
            Fault::LimitSwitch {
                axis,
                positive,
                pressed,
            } => plant.force_limit_switch(axis, positive, on.then_some(pressed)),
            Fault::BeamBlocked => plant.set_beam(if on { Beam::Blocked } else { Beam::Good }),
            Fault::BeamWeak => plant.set_beam(if on { Beam::Weak } else { Beam::Good }),
            Fault::ReferenceBeamBlocked { axis, behind_slide } => {
                plant.trouble_beam(axis, |beam| match behind_slide {
                    true => beam.behind_slide = on,
                    false => beam.before_slide = on,
                });
            }
            Fault::ReferenceBeamBright { axis } => {
                plant.trouble_beam(axis, |beam| beam.bright = on);
            }
            Fault::ReferenceBeamKnocked { axis, by_um } => {
                let by_m = if on { by_um * 1e-6 } else { 0.0 };
                plant.trouble_beam(axis, |beam| beam.knocked_m = by_m);
            }
            Fault::ReferenceBeamReflected {
                axis,
                at,
                by_um,
                share,
            } => {
                let off_m = by_um.map(|um| um * 1e-6);
                let reflection = on.then_some(Reflection { off_m, share });
                plant.trouble_beam(axis, |beam| *beam.reflection_mut(at) = reflection);
            }
            Fault::TargetAbsent => plant.set_target(if on { Target::Absent } else { Target::Good }),
            Fault::TargetCovered => {
                plant.set_target(if on { Target::Covered } else { Target::Good });
            }
            Fault::LineSmudged { line } => plant.set_line_smudged(line, on),
            Fault::LineScratched { line } => plant.set_line_scratched(line, on),
            Fault::LineShifted { line, shift_arcsec } => {
                plant.shift_line(
                    line,
                    Radians::from_arcsec(if on { shift_arcsec } else { 0.0 }),
                );
            }
            Fault::DetectorDead => plant.set_detector_dead(on),
            Fault::Vibration { amplitude_um } => {
                plant.set_vibration(Metres::from_um(if on { amplitude_um } else { 0.0 }));
            }
            Fault::FrozenEnvironment => {
                let frozen = plant.sensed_environment();
                plant.freeze_environment(on.then_some(frozen));
            }
            Fault::ImpossibleEnvironment => plant.freeze_environment(on.then_some(IMPOSSIBLE)),
            Fault::InputsSwapped => plant.set_inputs_swapped(on),
            _ => self.set_input_fault(fault, on),
        }
    }

    /// Faults of frames and bytes act where these pass, and change nothing here.
    fn set_input_fault(&mut self, fault: &Fault, on: bool) {
        let (channel, kind) = match *fault {
            Fault::InputRail { channel } => (channel, InputFault::Rail),
            Fault::InputOpen { channel } => (channel, InputFault::Open),
            Fault::InputStuck { channel } => (channel, InputFault::Stuck),
            Fault::InputInverted { channel } => (channel, InputFault::Inverted),
            Fault::InputShifted { channel, by } => (channel, InputFault::Shifted(by)),
            _ => return,
        };
        self.plant.set_input_fault(channel, on.then_some(kind));
    }

    fn set_node_power(&mut self, node: &str, on: bool) {
        match self.slot(node) {
            Some(place) if on => self.power_on(place),
            Some(place) => self.power_off(place),
            None => {}
        }
    }

    fn set_link(&mut self, port: &str, link: Link) {
        let Some(place) = self.config.port(port) else {
            return;
        };
        self.ports[place].link = link;
        self.ports[place].forget(Sender::Host);
        self.tell_host(self.now, place, Event::Link(link));
    }

    fn report(&mut self, port: &str, class: BusErrorClass, controller: ControllerProblem) {
        if let Some(place) = self.config.port(port) {
            let error = BusError { class, controller };
            self.tell_host(self.now, place, Event::BusError(error));
        }
    }
}
