//! A small amplifier for the tests of the driver: parameters, moves that take a while, and a line
//! that can be spoilt.

use core::time::Duration;
use std::collections::{BTreeMap, VecDeque};

use units::Time;
use wire::copley::{
    BAUD_AT_RESET, Bank, CR, Command, DesiredState, ErrorCode, EventStatus, HomingMethod,
    Parameter, Reply, Request, Trajectory, TrajectoryStatus,
};
use wire::{LineControl, Payload};

const REPLY: Duration = Duration::from_millis(2);
/// Every move takes as long at least, so that none is faster than it was told.
const TRAVEL: Duration = Duration::from_millis(200);

/// What becomes of the next reply.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Spoil {
    /// It never comes.
    Lose,
    /// It comes this late.
    Delay(Duration),
    /// Something else comes.
    Replace(&'static str),
    /// The command itself is lost.
    LoseCommand,
}

pub(super) struct Fake {
    pub(super) rate: u32,
    host_rate: u32,
    pub(super) on: bool,
    booted: Time,
    line: Vec<u8>,
    pub(super) ram: BTreeMap<u16, i64>,
    pub(super) events: EventStatus,
    pub(super) trajectory: TrajectoryStatus,
    pub(super) position: i64,
    commanded: i64,
    arrives: Option<Time>,
    /// When and where the move under way began.
    begun: (Time, i64),
    /// Moves are so many times as fast as they are told.
    pub(super) hurry: f64,
    /// Homing keeps the bits of the homing before, and does nothing, until then.
    pub(super) stale_until: Option<Duration>,
    homes: Option<Time>,
    replies: VecDeque<(Time, Vec<u8>)>,
    /// Applied to the next reply to a line that contains the text.
    pub(super) spoils: VecDeque<(&'static str, Spoil)>,
}

impl Fake {
    pub(super) fn new() -> Self {
        Self {
            rate: BAUD_AT_RESET,
            host_rate: 0,
            on: true,
            booted: Time::ZERO,
            line: Vec::new(),
            ram: BTreeMap::new(),
            events: EventStatus::DISABLED_BY_SOFTWARE | EventStatus::OUTPUTS_OFF,
            trajectory: TrajectoryStatus::empty(),
            position: 0,
            commanded: 0,
            arrives: None,
            begun: (Time::ZERO, 0),
            hurry: 1.0,
            stale_until: None,
            homes: None,
            replies: VecDeque::new(),
            spoils: VecDeque::new(),
        }
    }

    pub(super) fn restart(&mut self, now: Time) {
        let fresh = Self::new();
        self.rate = fresh.rate;
        self.booted = now;
        self.ram.clear();
        self.events = fresh.events;
        self.trajectory = fresh.trajectory;
        (self.position, self.commanded) = (0, 0);
        self.arrives = None;
    }

    /// When the move under way ends.
    pub(super) const fn arrives(&self) -> Option<Time> {
        self.arrives
    }

    pub(super) fn next_event(&self) -> Time {
        let reply = self.replies.front().map_or(Time::NEVER, |(at, _)| *at);
        let homes = self.homes.unwrap_or(Time::NEVER);
        reply.min(self.arrives.unwrap_or(Time::NEVER)).min(homes)
    }

    pub(super) fn poll(&mut self, now: Time) -> Option<Vec<u8>> {
        if self.homes.is_some_and(|at| at <= now) {
            self.homes = None;
            self.home(now);
        }
        self.advance(now);
        if self.arrives.is_some_and(|at| at <= now) {
            self.arrives = None;
            self.position = self.commanded;
            self.events.remove(EventStatus::IN_MOTION);
            self.trajectory.remove(TrajectoryStatus::RUNNING);
        }
        if self.replies.front()?.0 > now {
            return None;
        }
        self.replies.pop_front().map(|(_, reply)| reply)
    }

    /// Where a move under way has taken it.
    fn advance(&mut self, now: Time) {
        let Some(arrives) = self.arrives else { return };
        let (since, from) = self.begun;
        let whole = arrives.since(since).as_secs_f64();
        let share = (now.since(since).as_secs_f64() / whole).min(1.0);
        self.position = from + ((self.commanded - from) as f64 * share) as i64;
    }

    fn travel(&self) -> Duration {
        let way = (self.commanded - self.position).abs() as f64;
        let speed = self.ram[&Parameter::SPEED.0] as f64 / 10.0;
        let seconds = way / speed / self.hurry;
        Duration::from_secs_f64(seconds.max(TRAVEL.as_secs_f64() / self.hurry))
    }

    fn home(&mut self, now: Time) {
        let method = self.ram[&Parameter::HOMING_METHOD.0];
        (self.position, self.commanded) = (0, 0);
        if HomingMethod::from_raw(method) != HomingMethod::Here {
            self.begun = (now, 0);
            self.arrives = Some(now + TRAVEL);
            self.events.insert(EventStatus::IN_MOTION);
            self.trajectory.insert(TrajectoryStatus::RUNNING);
        }
        self.trajectory.insert(TrajectoryStatus::REFERENCED);
    }

    pub(super) fn hear(&mut self, now: Time, payload: &Payload) {
        match payload {
            Payload::Control(LineControl::Baud(rate)) => self.host_rate = *rate,
            Payload::Control(LineControl::Break(true)) => {
                self.rate = BAUD_AT_RESET;
                self.line.clear();
            }
            Payload::Control(LineControl::Break(false)) | Payload::Frame(_) => {}
            Payload::Bytes(bytes) if self.on && self.host_rate == self.rate => {
                for byte in bytes {
                    if *byte == CR {
                        let line = core::mem::take(&mut self.line);
                        self.obey(now, &line);
                    } else {
                        self.line.push(*byte);
                    }
                }
            }
            Payload::Bytes(_) => {}
        }
    }

    fn obey(&mut self, now: Time, line: &[u8]) {
        let text = String::from_utf8_lossy(line).into_owned();
        let spoilt = self.spoils.iter().position(|(of, _)| text.contains(of));
        let spoil = spoilt
            .and_then(|at| self.spoils.remove(at))
            .map(|(_, it)| it);
        if spoil == Some(Spoil::LoseCommand) {
            return;
        }
        let rate = self.rate;
        let reply = match Request::parse(line) {
            Ok(request) => self.execute(now, request.command),
            Err(refused) => Reply::Error(refused.code),
        };
        if self.rate != rate {
            // It comes at the new rate: garbage.
            return;
        }
        let reply = reply.emit();
        match spoil {
            None => self.replies.push_back((now + REPLY, reply)),
            Some(Spoil::Delay(by)) => self.replies.push_back((now + REPLY + by, reply)),
            Some(Spoil::Replace(with)) => {
                let with = with.as_bytes().to_vec();
                self.replies.push_back((now + REPLY, with));
            }
            Some(Spoil::Lose | Spoil::LoseCommand) => {}
        }
    }

    fn execute(&mut self, now: Time, command: Command) -> Reply {
        match command {
            Command::Get { bank, parameter } => self.get(now, bank, parameter),
            Command::Set {
                parameter, value, ..
            } => self.set(parameter, value),
            Command::Trajectory(Trajectory::Move) => {
                if !self.events.contains(EventStatus::OUTPUTS_OFF) {
                    self.commanded = self.ram[&Parameter::POSITION_COMMAND.0];
                    self.begun = (now, self.position);
                    self.arrives = Some(now + self.travel());
                    self.events.insert(EventStatus::IN_MOTION);
                    self.trajectory.insert(TrajectoryStatus::RUNNING);
                    self.trajectory.remove(TrajectoryStatus::ABORTED);
                }
                Reply::Ok
            }
            Command::Trajectory(Trajectory::Abort) => {
                self.advance(now);
                if self.arrives.take().is_some() {
                    self.commanded = self.position;
                    self.events.remove(EventStatus::IN_MOTION);
                    self.trajectory.remove(TrajectoryStatus::RUNNING);
                    self.trajectory.insert(TrajectoryStatus::ABORTED);
                }
                Reply::Ok
            }
            Command::Trajectory(Trajectory::Home) => {
                assert_eq!(self.ram[&Parameter::HOME_OFFSET.0], 0, "it would move");
                match self.stale_until {
                    Some(stale) => self.homes = Some(now + stale),
                    None => self.home(now),
                }
                Reply::Ok
            }
            Command::Reset => Reply::Ok,
        }
    }

    fn get(&self, now: Time, bank: Bank, parameter: Parameter) -> Reply {
        let number = match (bank, parameter) {
            (Bank::Flash, Parameter::SERIAL_NUMBER) => 4002,
            (Bank::Flash, Parameter::MODEL) => return Reply::Value("MOCK-055-18".into()),
            (Bank::Flash, _) => return Reply::Error(ErrorCode::NotInThisBank),
            (_, Parameter::FIRMWARE) => 0x050C,
            (_, Parameter::BAUD) => i64::from(self.rate) + 3,
            (_, Parameter::EVENT_STATUS) => self.events.bits().into(),
            (_, Parameter::TRAJECTORY_STATUS) => self.trajectory.bits().into(),
            (_, Parameter::POSITION) => self.position,
            (_, Parameter::COMMANDED_POSITION) => self.commanded,
            (_, Parameter::FOLLOWING_ERROR) => self.commanded - self.position,
            (_, Parameter::UPTIME) => now.since(self.booted).as_millis() as i64,
            (_, other) => self.ram.get(&other.0).copied().unwrap_or(0),
        };
        Reply::Value(number.to_string())
    }

    fn set(&mut self, parameter: Parameter, value: i64) -> Reply {
        if value > i64::from(i32::MAX) {
            return Reply::Error(ErrorCode::OutOfRange);
        }
        if parameter == Parameter::FAULTS {
            let left = self.ram.get(&parameter.0).copied().unwrap_or(0) & !value;
            self.ram.insert(parameter.0, left);
            self.events.set(EventStatus::FAULT, left != 0);
            return Reply::Ok;
        }
        self.ram.insert(parameter.0, value);
        let off = EventStatus::DISABLED_BY_SOFTWARE | EventStatus::OUTPUTS_OFF;
        match parameter {
            Parameter::DESIRED_STATE if value == DesiredState::Disabled.raw() => {
                self.events.insert(off);
            }
            Parameter::DESIRED_STATE => self.events.remove(off),
            Parameter::BAUD => self.rate = value as u32,
            _ => {}
        }
        Reply::Ok
    }
}
