//! Devices: what one device's objects or lines mean, behind traits in domain terms.
//!
//! Every device is sans-io: input and time come in, payloads and events go out. The
//! controller owns the loop (`truestage::tick`) that feeds them.

mod alarm;
mod analog_node;
mod average;
pub mod canopen_node;
pub mod cia401;
pub mod cia402;
pub mod cia404;
pub mod copley;
pub mod dcon;
mod departure;
mod direction;
mod envelope;
mod error;
#[cfg(test)]
mod fake_node;
pub mod in_sight;
mod latch;
mod name;
pub mod nd287;
mod plausible;
mod reading;
mod reference;
pub mod serial_line;
mod shared_line;
pub mod umd2;

use core::time::Duration;

use units::{
    Approach, Celsius, Coordinate, Metres, Pascals, Radians, RelativeHumidity, Time, Volts,
};
use wire::Input;
use wire::Payload;
use wire::cia402::PowerState;

pub use alarm::{Alarm, AmplifierTrouble, OwnAlarm};
pub use departure::Asked;
pub use direction::Direction;
pub use envelope::TRAVEL_MARGIN;
pub use error::{DeviceError, Seen};
pub use latch::{LatchCommand, Latched, PositionLatch, Repeat, RotaryAxis, SYNCS_PER_EDGE};
pub use name::DeviceName;
pub use reading::{AxisReading, Place};
pub use reference::{DriveReference, ReferenceLost, ReferenceProof};
pub use shared_line::{LineUse, Urgency};

/// The sans-io face that every device shows to the loop that drives it.
pub trait Device {
    /// Takes what came in on the device's port, also when it is meant for another device.
    fn handle(&mut self, now: Time, input: &Input);

    /// Acts on deadlines that have passed.
    fn handle_timeout(&mut self, now: Time);

    /// When [`Device::handle_timeout`] wants to be called next; [`Time::NEVER`] for never.
    fn poll_timeout(&self) -> Time;

    /// The next payload to send, in order. A device that shares its line is asked only when
    /// [`LineUse::may_speak`].
    fn poll_transmit(&mut self) -> Option<Payload>;

    /// What the device wants of its line; [`LineUse::Unshared`] unless it takes turns.
    fn line_use(&self) -> LineUse {
        LineUse::Unshared
    }

    /// The next alarm.
    fn poll_alarm(&mut self) -> Option<Alarm>;

    /// Begins the start procedure: who is it, is it what the configuration says, set it up.
    fn start(&mut self, now: Time);

    /// Begins the first part of the start, who it is, and leaves it at that where the rest would
    /// change something that matters. The device is not in service then.
    fn identify(&mut self, now: Time) {
        self.start(now);
    }

    /// What it looks for at the moment, for a person who waits and wonders; `None`: nothing.
    fn looks_for(&self) -> Option<String> {
        None
    }

    /// Begins to end the device's watch on the heartbeat of this controller, which is about to end.
    /// `false`: it watches none. [`Device::poll_outcome`] says when the watch has ended.
    fn release_watch(&mut self, _now: Time) -> bool {
        false
    }

    /// How the last command (or the start) went, once, when it has ended.
    fn poll_outcome(&mut self) -> Option<Result<(), DeviceError>>;

    /// What the device said it is, once the start procedure has asked.
    fn identity(&self) -> Option<Identity>;

    /// Counters for a person who looks for trouble: name and value.
    fn counters(&self) -> Vec<(&'static str, u64)>;
}

/// A servo drive, whatever it moves.
pub trait ServoDrive: Device {
    /// Begins a command; a command that still runs is superseded.
    /// [`Device::poll_outcome`] says when it is done, and how.
    fn control(&mut self, now: Time, command: DriveCommand);

    /// The newest state, in the drive's own terms.
    fn power_state(&self) -> Option<PowerState>;

    /// Whether the drive has a reference since it was last powered.
    fn is_homed(&self) -> bool;

    /// Whether the drive stops by itself once it no longer hears us: its watch on our heartbeat was written and read
    /// back since it was started.
    fn watches_master(&self) -> bool {
        false
    }

    /// Whether it was commanded towards operation enabled, or found enabled, since it was started.
    fn was_enabled(&self) -> bool {
        true
    }

    /// Whether it is configured how the drive proves that it kept its reference.
    fn proves_reference(&self) -> bool {
        false
    }

    /// What the last [`DriveCommand::ReadReference`] has read.
    ///
    /// # Errors
    /// Why it would prove nothing at the next start.
    fn reference(&self) -> Result<DriveReference, ReferenceLost> {
        Err(ReferenceLost::NotHomed)
    }

    /// Counts as homed again, when what was read last shows that its coordinates are those in which `then` was read.
    ///
    /// # Errors
    /// What speaks against it; it does not count as homed then.
    fn take_up_reference(&mut self, _then: &DriveReference) -> Result<(), ReferenceLost> {
        Err(ReferenceLost::NotHomed)
    }

    /// Where the axis was by the newest sample, whatever it moves in.
    fn place(&self) -> Option<Place>;

    /// When the last motion was seen to be begun: on CAN the arrival of the first statusword
    /// that acknowledges the set-point, on a serial line that of the amplifier's `ok`; when
    /// that was lost, the moment it was to start, since the motion may be as old. `None`
    /// before the first motion and from a new command until its motion begins.
    fn started_at(&self) -> Option<Time>;
}

/// What every drive can be told, whatever it moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DriveCommand {
    /// Switch on, up to operation enabled.
    Enable,
    /// Switch off, in a controlled way.
    Disable,
    /// Stop as fast as the quick stop deceleration allows, then disable.
    QuickStop,
    /// Acknowledge a fault, once.
    ResetFault,
    /// Slow down and stand, staying enabled; done when standing.
    Halt,
    /// Change to cyclic synchronous position with one set-point every `period`; done when the
    /// drive says that it is in the mode. Nothing moves: the set-point is where the axis stands.
    /// Refused by a drive that cannot do it, and while the axis moves.
    EnterCyclic {
        /// From SYNC to SYNC.
        period: Duration,
    },
    /// Change back to profile position.
    LeaveCyclic,
    /// Read what shows the reference of a drive that [`ServoDrive::proves_reference`]. Nothing moves.
    ReadReference {
        /// What is written into the drive first, where its proof is a [`ReferenceProof::Mark`]. Not 0.
        mark: Option<u32>,
    },
}

/// A controlled direction, linear or rotary: one servo drive that positions in `Q`.
pub trait Axis<Q: Coordinate = Metres>: ServoDrive {
    /// Begins a command; a command that still runs is superseded.
    /// [`Device::poll_outcome`] says when it is done, and how.
    fn command(&mut self, now: Time, command: AxisCommand<Q>);

    /// The set-point for the next SYNC, in drive coordinates; once in every period after
    /// [`DriveCommand::EnterCyclic`] and [`DriveCommand::Enable`].
    ///
    /// # Errors
    /// When the drive is not enabled in the cyclic mode, or the set-point is outside its limits;
    /// nothing is sent then.
    fn follow(&mut self, now: Time, set_point: Q) -> Result<(), DeviceError>;

    /// The set-point that the drive holds in the cyclic mode, `None` in any other.
    fn held(&self) -> Option<Q>;

    /// The newest sample of the axis, `None` before the first one.
    fn reading(&self) -> Option<AxisReading<Q>>;
}

/// What an axis can be told.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AxisCommand<Q: Coordinate = Metres> {
    /// What every drive can be told.
    Drive(DriveCommand),
    /// Profile position move to `target` (drive coordinates); done when target reached.
    MoveTo {
        /// Where to, in drive coordinates.
        target: Q,
        /// Profile velocity.
        speed: Q::Speed,
        /// Profile acceleration and deceleration.
        acceleration: Q::Acceleration,
    },
    /// Everything of a move loaded into the drive and confirmed, but nothing moves; done when
    /// [`AxisCommand::Start`] is all that is missing. Any other command gives it up.
    Prepare {
        /// Where to, in drive coordinates.
        target: Q,
        /// Profile velocity.
        speed: Q::Speed,
        /// Profile acceleration and deceleration.
        acceleration: Q::Acceleration,
    },
    /// Begins the move that was prepared last; done when target reached. Refused when nothing
    /// is prepared.
    Start,
    /// Home on the negative limit switch (method 17); the drive's coordinates become
    /// `position` there.
    HomeNegativeLimit {
        /// The coordinate of the switch.
        position: Q,
        /// Search speed.
        speed: Q::Speed,
    },
    /// Home on the first index pulse off the negative limit switch (method 1); the drive's
    /// coordinates become `position` there.
    HomeIndex {
        /// The coordinate of the index pulse.
        position: Q,
        /// Search speed.
        speed: Q::Speed,
    },
    /// Home on the next index pulse of the encoder in a direction (methods 33 and 34); the
    /// drive's coordinates become `position` there.
    HomeNextIndex {
        /// The coordinate of the index mark.
        position: Q,
        /// Search speed.
        speed: Q::Speed,
        /// The direction of the search.
        approach: Approach,
    },
    /// Home here (method 37): the drive's coordinate becomes `position`.
    HomeHere {
        /// The coordinate of where the axis stands now.
        position: Q,
    },
}

impl<Q: Coordinate> From<DriveCommand> for AxisCommand<Q> {
    fn from(command: DriveCommand) -> Self {
        Self::Drive(command)
    }
}

/// Voltages that are read together.
pub trait AnalogInput: Device {
    /// How many channels are used.
    fn channels(&self) -> usize;

    /// The newest sample, `None` before the first; its age is the caller's to judge by `at`.
    fn reading(&self) -> Option<&AnalogReading>;

    /// The thermometers on the same module, where it has some.
    fn thermometers(&self) -> Option<&dyn TemperatureInput> {
        None
    }

    /// When it sampled last, whatever it measures; `None` before the first sample.
    fn last_sample(&self) -> Option<Time> {
        let thermometers = self.thermometers().and_then(TemperatureInput::temperatures);
        match self.channels() {
            0 => thermometers.map(|it| it.at),
            _ => self.reading().map(|it| it.at),
        }
    }
}

/// One sample of all channels.
#[derive(Clone, Debug, PartialEq)]
pub struct AnalogReading {
    /// When it arrived.
    pub at: Time,
    /// Each channel, in the order of the configuration.
    pub volts: Vec<Volts>,
    /// Per channel: whether the converter stood at an end of its range.
    pub saturated: Vec<bool>,
}

/// Temperatures that are read together.
pub trait TemperatureInput: Device {
    /// How many sensors are used.
    fn sensors(&self) -> usize;

    /// The newest sample, `None` before the first; its age is the caller's to judge by `at`.
    fn temperatures(&self) -> Option<&TemperatureReading>;
}

/// One sample of all sensors.
#[derive(Clone, Debug, PartialEq)]
pub struct TemperatureReading {
    /// When it arrived.
    pub at: Time,
    /// Each sensor, in the order of the configuration; `None` where the device says that there is
    /// none, or that it is beyond what can be measured.
    pub celsius: Vec<Option<Celsius>>,
}

/// An instrument that measures the change of a length from a datum.
pub trait DisplacementInstrument: Device {
    /// Begins an average over the next `samples` good samples.
    /// [`Device::poll_outcome`] says when it is done; then [`DisplacementInstrument::average`].
    fn begin_average(&mut self, now: Time, samples: u32);

    /// The last average, `None` before the first.
    fn average(&self) -> Option<DisplacementReading>;

    /// The newest good sample, `None` before the first and while the beam is lost.
    fn latest(&self) -> Option<DisplacementReading>;

    /// Makes the present displacement the datum: it reads zero from now on.
    /// Also accepts a lost count: after a lost beam nothing is read until this is called.
    fn set_datum(&mut self, now: Time);

    /// What the instrument's own sensors say about its environment.
    fn environment(&self) -> Environment;

    /// How its signal is, by what it sent last, also while it is not started; `None` for one that has said nothing of it.
    fn signal(&self) -> Option<Signal> {
        None
    }

    /// Whether nobody waits for what it says at the moment: its readings may be handed over some
    /// milliseconds late, with the times at which they came.
    fn is_unhurried(&self) -> bool {
        false
    }
}

/// How the signal of an instrument is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Signal {
    /// When something was said of it last.
    pub at: Time,
    /// How strong, in a unit of its own: more is better. `None` before it was said.
    pub strength: Option<i32>,
    /// Below this it counts as lost, where that is set.
    pub least: Option<i32>,
    /// Why nothing can be counted by it.
    pub trouble: Option<SignalTrouble>,
}

/// Why an instrument cannot count by its signal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SignalTrouble {
    /// The source gives no reference.
    NoReference,
    /// Nothing of the measurement beam comes back.
    NoBeam,
    /// It comes back with a beat that no motion within what the instrument can follow explains.
    Beat,
    /// There is light, but too little of it for a phase.
    NoPhase,
    /// It is weaker than what is set as the least.
    Weak,
}

/// A displacement, not yet corrected for the medium or for temperature.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DisplacementReading {
    /// When the (last) sample arrived.
    pub at: Time,
    /// Displacement as if the beam ran in vacuum; the instrument's optics are included.
    pub vacuum: Metres,
    /// Standard deviation of the samples averaged, zero for a single one.
    pub standard_deviation: Metres,
    /// How many samples were averaged.
    pub samples: u32,
}

/// An instrument that sees where a body is in a plane.
pub trait PoseInstrument: Device {
    /// Begins to take pictures until `exposures` of them are good, and averages their poses.
    /// Only pictures taken after this call count. [`Device::poll_outcome`] says when it is
    /// done; then [`PoseInstrument::pose`].
    fn begin_pose(&mut self, now: Time, exposures: u32);

    /// The last pose, `None` before the first and after a measurement that failed: a picture
    /// that was judged bad never becomes a number.
    fn pose(&self) -> Option<PoseReading>;

    /// When the last picture was asked for, whether it was good or not.
    fn asked(&self) -> Time;

    /// How many targets the last picture showed, whether it was good or not: more than there are is a reflection, or
    /// something that looks like one.
    fn found(&self) -> u32;
}

/// Where a body was seen, in the machine's frame, from where the instrument was taught.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseReading {
    /// When the answer about the last picture arrived.
    pub at: Time,
    /// Displacement of the body's origin along x.
    pub x: Metres,
    /// Displacement of the body's origin along y.
    pub y: Metres,
    /// Turn, counter-clockwise.
    pub angle: Radians,
    /// Covariance of the single pictures in x, y and angle, m and rad; zero for a single one.
    pub covariance: [[f64; 3]; 3],
    /// How like the taught target the worst picture was, 0 to 1.
    pub score: f64,
    /// How many pictures were averaged.
    pub samples: u32,
    /// How many more were taken and judged bad.
    pub rejected: u32,
}

/// What an instrument's weather sensors say; `None` where it has none or they fell silent.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Environment {
    /// Air.
    pub air_temperature: Option<Celsius>,
    /// The machine's material.
    pub material_temperature: Option<Celsius>,
    /// Air.
    pub pressure: Option<Pascals>,
    /// Air.
    pub humidity: Option<RelativeHumidity>,
}

/// The identity object 0x1018 and the device type 0x1000; serial devices fill what they have.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub struct Identity {
    /// 0x1000.
    pub device_type: u32,
    /// 0x1018:01.
    pub vendor: u32,
    /// 0x1018:02.
    pub product: u32,
    /// 0x1018:03.
    pub revision: u32,
    /// 0x1018:04.
    pub serial: u32,
    /// 0x1008, or what a serial device calls itself.
    pub name: String,
}
