//! The periodic reading of the amplifier's state, and what of it is an alarm.

use core::time::Duration;
use units::{Coordinate, Counts, Time};
use wire::copley::{Bank, Command, EventStatus, Faults, Parameter, Reply, TrajectoryStatus};

use super::start::Starting;
use super::{Activity, CopleyAxis, Purpose};
use crate::device::plausible::Judgement;
use crate::device::{Alarm, AmplifierTrouble, Urgency};

/// How often the amplifier is asked how long it has been on.
const UPTIME_PERIOD: Duration = Duration::from_secs(1);
/// Its clock and ours may differ by this, and by a thousandth.
const UPTIME_TOLERANCE_MS: i64 = 500;

/// Bits that are alarms whenever they appear.
const TROUBLES: [(EventStatus, AmplifierTrouble); 11] = [
    (EventStatus::SHORT_CIRCUIT, AmplifierTrouble::ShortCircuit),
    (EventStatus::AMPLIFIER_HOT, AmplifierTrouble::AmplifierHot),
    (EventStatus::MOTOR_HOT, AmplifierTrouble::MotorHot),
    (EventStatus::OVER_VOLTAGE, AmplifierTrouble::OverVoltage),
    (EventStatus::UNDER_VOLTAGE, AmplifierTrouble::UnderVoltage),
    (EventStatus::FEEDBACK_ERROR, AmplifierTrouble::EncoderError),
    (EventStatus::PHASING_ERROR, AmplifierTrouble::PhasingError),
    (EventStatus::COMMAND_FAULT, AmplifierTrouble::CommandFault),
    (EventStatus::TRACKING_ERROR, AmplifierTrouble::TrackingError),
    (
        EventStatus::POSITIVE_SOFT_LIMIT,
        AmplifierTrouble::PositiveSoftLimit,
    ),
    (
        EventStatus::NEGATIVE_SOFT_LIMIT,
        AmplifierTrouble::NegativeSoftLimit,
    ),
];

/// Bits that are alarms unless a homing looks for them.
const SWITCHES: [(EventStatus, AmplifierTrouble); 2] = [
    (
        EventStatus::POSITIVE_LIMIT_SWITCH,
        AmplifierTrouble::PositiveLimitSwitch,
    ),
    (
        EventStatus::NEGATIVE_LIMIT_SWITCH,
        AmplifierTrouble::NegativeLimitSwitch,
    ),
];

/// Bits that an amplifier which must stay enabled has not.
const LEAVING: [(EventStatus, AmplifierTrouble); 2] = [
    (
        EventStatus::NOT_ENABLED_BY_INPUT,
        AmplifierTrouble::EnableInputOff,
    ),
    (EventStatus::OUTPUTS_OFF, AmplifierTrouble::Disabled),
];

impl<Q: Coordinate> CopleyAxis<Q> {
    /// Asks for the next thing of a look; begins one when none is under way.
    pub(super) fn ask_look(&mut self, now: Time) {
        if self.look.round.is_empty() {
            self.begin_look(now);
        }
        let Some(parameter) = self.look.round.front().copied() else {
            return;
        };
        let age = now.since(self.look.heard);
        let urgency = if age * 2 >= self.settings.timeouts.silence {
            Urgency::Command
        } else {
            Urgency::Poll
        };
        self.purpose = Purpose::Look(parameter);
        let bank = Bank::Ram;
        self.ask(Command::Get { bank, parameter }, urgency, self.look.due);
    }

    fn begin_look(&mut self, now: Time) {
        let round = &mut self.look.round;
        round.push_back(Parameter::EVENT_STATUS);
        if core::mem::take(&mut self.look.faults) {
            round.push_back(Parameter::FAULTS);
        }
        if matches!(self.activity, Activity::Motion(_) | Activity::Homing(_)) {
            round.push_back(Parameter::TRAJECTORY_STATUS);
        }
        round.push_back(Parameter::POSITION);
        if self.settings.read_following_error {
            round.push_back(Parameter::FOLLOWING_ERROR);
        }
        if self.look.uptime_due <= now {
            round.push_back(Parameter::UPTIME);
        }
    }

    pub(super) fn look_answered(&mut self, now: Time, parameter: Parameter, reply: &Reply) {
        if self.look.round.front() != Some(&parameter) {
            // Of a look that was begun anew.
            return;
        }
        self.look.round.pop_front();
        match reply.number() {
            Some(value) => self.take_value(now, parameter, value),
            // An amplifier without the parameter, or a damaged number: the next look is another.
            None if parameter == Parameter::UPTIME => self.look.uptime_due = Time::NEVER,
            None => {}
        }
        if self.look.round.is_empty() {
            let period = self.settings.poll_period;
            self.look.due = (self.look.due + period).max(now);
            self.look_done(now);
        }
    }

    pub(super) fn look_lost(&mut self, now: Time) {
        self.look.round.clear();
        self.look.due = now + self.settings.poll_period;
    }

    fn take_value(&mut self, now: Time, parameter: Parameter, value: i64) {
        match parameter {
            Parameter::EVENT_STATUS => {
                self.image.events = EventStatus::from_bits_retain(value as u32);
            }
            Parameter::TRAJECTORY_STATUS => {
                self.image.trajectory = TrajectoryStatus::from_bits_retain(value as u16);
            }
            Parameter::POSITION => self.take_position(now, Counts(value)),
            Parameter::FOLLOWING_ERROR => self.image.following_error = Some(Counts(value)),
            Parameter::UPTIME => self.take_uptime(now, value),
            Parameter::FAULTS if value != 0 => {
                let faults = Faults::from_bits_retain(value as u32);
                self.trouble(AmplifierTrouble::Faults(faults));
            }
            _ => {}
        }
    }

    fn take_position(&mut self, now: Time, position: Counts) {
        if let Judgement::Jumped { by, limit } = self.image.take_position(now, position) {
            self.homed = false;
            let metres = |counts| self.settings.scale.to_coordinate(counts).abs().into();
            let (jump, limit) = (metres(by), metres(limit));
            let device = self.name();
            self.alarm(Alarm::AmplifierJumped {
                device,
                jump,
                limit,
            });
        }
    }

    /// An amplifier that has been on for less time than it was has restarted in between.
    fn take_uptime(&mut self, now: Time, uptime: i64) {
        self.look.uptime_due = now + UPTIME_PERIOD;
        let beyond = self.look.uptime.map_or(0, |(at, before)| {
            let passed = now.since(at).as_millis() as i64;
            let tolerance = UPTIME_TOLERANCE_MS + passed / 1000;
            let beyond = uptime - before - passed;
            if beyond.abs() > tolerance { beyond } else { 0 }
        });
        if beyond != 0 && !self.look.uptime_doubted {
            // Perhaps a wrong digit: once more, at once.
            self.look.uptime_doubted = true;
            self.look.uptime_due = now;
            return;
        }
        self.look.uptime_doubted = false;
        self.look.uptime = Some((now, uptime));
        if beyond < 0 {
            self.restarted();
        }
    }

    /// Everything volatile is gone: reference, profile, state.
    fn restarted(&mut self) {
        self.homed = false;
        self.profile = None;
        self.kept = false;
        self.image.forget_position();
        self.envelope.release();
        let device = self.name();
        self.alarm(Alarm::AmplifierRestarted { device });
    }

    fn trouble(&mut self, trouble: AmplifierTrouble) {
        let device = self.name();
        self.alarm(Alarm::Amplifier { device, trouble });
    }

    /// A whole look has ended.
    fn look_done(&mut self, now: Time) {
        if self.activity_is_first_look() {
            // What is wrong from the beginning is told when somebody wants to enable it.
            self.told = self.image.events;
            self.finish(Ok(()));
            return;
        }
        self.supervise();
        self.watch_motion(now);
        match &self.activity {
            Activity::Idle | Activity::Starting(_) => {}
            Activity::Power(_) => self.advance_power(now),
            Activity::Motion(_) => self.advance_motion(now),
            Activity::Halt(_) => self.advance_halt(),
            Activity::Homing(_) => self.advance_homing(now),
        }
    }

    const fn activity_is_first_look(&self) -> bool {
        matches!(self.activity, Activity::Starting(Starting::Looking))
    }

    fn supervise(&mut self) {
        let events = self.image.events;
        let new = events - self.told;
        self.told = events;
        if new.contains(EventStatus::FAULT) {
            self.look.faults = true;
        }
        let homing = matches!(self.activity, Activity::Homing(_));
        let changing = matches!(self.activity, Activity::Power(_));
        let left = self.kept && !changing;
        self.tell(&TROUBLES, new);
        if !homing {
            self.tell(&SWITCHES, new);
        }
        if left && events.intersects(EventStatus::NOT_ENABLED_BY_INPUT | EventStatus::OUTPUTS_OFF) {
            self.kept = false;
            // Why it left may be that it restarted.
            self.look.uptime_due = Time::ZERO;
            self.tell(&LEAVING, events);
        }
    }

    fn tell(&mut self, table: &[(EventStatus, AmplifierTrouble)], bits: EventStatus) {
        for (bit, trouble) in table {
            if bits.contains(*bit) {
                self.trouble(*trouble);
            }
        }
    }

    /// When silence becomes an alarm.
    pub(super) fn silence_deadline(&self) -> Time {
        if self.look.active && !self.told_silence {
            self.look.heard + self.settings.timeouts.silence
        } else {
            Time::NEVER
        }
    }

    pub(super) fn watch_silence(&mut self, now: Time) {
        if now >= self.silence_deadline() {
            self.told_silence = true;
            let waited = now.since(self.look.heard);
            let device = self.name();
            self.alarm(Alarm::AmplifierSilent { device, waited });
        }
    }
}
