//! The start: find the amplifier, read its identity, set it up, read its state.

use units::{Coordinate, Counts, Time};
use wire::copley::{Bank, DesiredState, EventStatus, Parameter};

use super::convert::{acceleration, length};
use super::{Activity, CopleyAxis};
use crate::device::copley::script::{Script, Step, read};
use crate::device::{DeviceError, Identity, Urgency};

const ASKING: &str = "reading its identity";

/// How far the start is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Starting {
    /// The amplifier at the cable is looked for.
    Finding,
    Asking,
    Configuring,
    /// The first look.
    Looking,
}

impl<Q: Coordinate> CopleyAxis<Q> {
    pub(super) fn begin_start(&mut self, now: Time) {
        self.supersede();
        self.alarms.clear();
        self.look.active = false;
        self.image.forget_position();
        self.identity = None;
        self.homed = false;
        self.origin = Counts(0);
        self.profile = None;
        self.started_at = None;
        self.kept = false;
        self.was_enabled = false;
        self.told = EventStatus::empty();
        self.told_silence = false;
        self.purpose = super::Purpose::Nothing;
        self.activity = Activity::Starting(Starting::Finding);
        self.link.open(now);
    }

    /// The line works, for the first time or again.
    pub(super) fn opened(&mut self, now: Time) {
        if let Activity::Starting(phase @ Starting::Finding) = &mut self.activity {
            *phase = Starting::Asking;
            let steps = vec![
                Step::read(Bank::Flash, Parameter::SERIAL_NUMBER, ASKING),
                Step::read(Bank::Flash, Parameter::MODEL, ASKING),
                read(Parameter::FIRMWARE, ASKING).optional(),
            ];
            self.run(now, steps, Urgency::Command);
        } else {
            // It was away: perhaps because it restarted.
            self.look.uptime_due = now;
        }
    }

    pub(super) fn start_step_done(&mut self, now: Time) {
        let Activity::Starting(phase) = self.activity else {
            return;
        };
        let next = match phase {
            Starting::Finding | Starting::Looking => return,
            Starting::Asking if self.asks_only => {
                let identified = self.take_identity();
                self.link.close();
                return self.finish(identified);
            }
            Starting::Asking => self
                .take_identity()
                .and_then(|()| self.configuration())
                .map(|steps| self.run(now, steps, Urgency::Command))
                .map(|()| Starting::Configuring),
            Starting::Configuring => {
                self.look.active = true;
                self.look.heard = now;
                self.look.uptime = None;
                self.look.uptime_due = now;
                self.look_anew(now);
                Ok(Starting::Looking)
            }
        };
        match next {
            Ok(next) => self.activity = Activity::Starting(next),
            Err(error) => {
                self.link.close();
                self.finish(Err(error));
            }
        }
    }

    fn take_identity(&mut self) -> Result<(), DeviceError> {
        let script: &Script = &self.script;
        let model = script.text(Parameter::MODEL).unwrap_or("").to_owned();
        let serial = script.number(Parameter::SERIAL_NUMBER);
        let firmware = script.number(Parameter::FIRMWARE).unwrap_or(0);
        let device = self.name();
        let wrong = |what, expected: String, seen: String| DeviceError::WrongAmplifier {
            device,
            what,
            expected,
            seen,
        };
        let seen = script.text(Parameter::SERIAL_NUMBER).unwrap_or("");
        let Some(serial) = serial.and_then(|serial| u32::try_from(serial).ok()) else {
            return Err(wrong("serial number", "a number".into(), seen.into()));
        };
        if let Some(expected) = self.settings.serial.filter(|expected| *expected != serial) {
            return Err(wrong("serial number", expected.to_string(), seen.into()));
        }
        if let Some(expected) = self.settings.model.as_ref().filter(|it| **it != model) {
            return Err(wrong("model", expected.clone(), model));
        }
        self.link.set_serial(serial.into());
        self.identity = Some(Identity {
            serial,
            revision: u32::try_from(firmware).unwrap_or(0),
            name: model,
            ..Identity::default()
        });
        Ok(())
    }

    /// Off, absolute trapezoidal moves, windows and the deceleration of aborts.
    fn configuration(&self) -> Result<Vec<Step>, DeviceError> {
        let settings = &self.settings;
        let mut steps = vec![Step::write(
            Parameter::DESIRED_STATE,
            DesiredState::Disabled.raw(),
            "disabling it",
        )];
        let parameter = Parameter::PROFILE_TYPE;
        steps.extend(Step::check(parameter, 0, "choosing absolute moves"));
        let parameter = Parameter::HOME_OFFSET;
        steps.extend(Step::check(parameter, 0, "clearing the home offset"));
        let parameter = Parameter::ABORT_DECELERATION;
        let value = acceleration(settings, parameter, settings.quick_stop_deceleration)?;
        steps.extend(Step::check(
            parameter,
            value,
            "setting the stop deceleration",
        ));
        if let Some(limit) = settings.following_error {
            let parameter = Parameter::FOLLOWING_ERROR_LIMIT;
            let value = length(settings, parameter, "following error limit", limit)?;
            let text = "setting the following error limit";
            steps.extend(Step::check(parameter, value, text));
        }
        let parameter = Parameter::TRACKING_WINDOW;
        let value = length(
            settings,
            parameter,
            "position window",
            settings.position_window,
        )?;
        steps.extend(Step::check(parameter, value, "setting the tracking window"));
        let parameter = Parameter::TRACKING_WINDOW_TIME;
        let value = settings.position_window_time.as_millis() as i64;
        let text = "setting the tracking window time";
        steps.extend(Step::check(parameter, value, text));
        Ok(steps)
    }
}
