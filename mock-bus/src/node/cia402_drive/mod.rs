//! An emulated CiA 402 servo drive over one axis of the plant.
//!
//! Purpose: the drive as a master meets it: power state machine, profile position with its
//! set-point handshake, cyclic synchronous position, homing, quick stop, limits, following error, heartbeat reaction, and
//! the default PDOs of a real drive. Its position loop is the plant's; the drive gives it a
//! demand at the servo rate while something moves, and none while nothing does.
//!
//! Source: CiA 402-2 and -3 (IEC 61800-7-201), CiA 301; the quirks are those of the drives in
//! protocols.md, 3.4. Absent: torque modes, jerk; profile velocity unless it is the mode left over.
//!
//! | symbol | name |
//! |---|---|
//! | 0x6064 | actual = sign · encoder counts + offset, wrapped to 0x607B, as i32 (it wraps) |
//! | 0x6062 | demand, from the [profile](super::profile) |
//! | 0x60F4 | following error = demand − actual |

mod brake;
mod config;
mod cyclic;
mod homing;
mod homing_run;
mod mechanism;
mod misbehaviour;
mod motion;
mod objects;
mod position_range;
mod positioning;
mod power;
mod quirks;
mod status;
mod supervision;
mod supply;
#[cfg(test)]
mod tests;
mod touch_probe;
mod transitions;
mod truth;

use std::time::Duration;

use units::Time;
use wire::Payload;
use wire::can::CanFrame;
use wire::canopen::NodeId;
use wire::canopen::emcy::EmergencyCode;
use wire::canopen::nmt::NmtState;
use wire::cia402::{Controlword, HomingStatus};

pub(in crate::node) use config::checked_node_id;
pub use config::{Cia402DriveConfig, RotaryDriveConfig, TouchProbeConfig};
pub use quirks::{DriveQuirks, RpdoDeadline, UnitObjects};
pub use truth::Homings;

use super::canopen_server::{CanopenServer, Deliveries, Manners, ServerEvent};
use super::profile::Profile;
use super::{Node, Section};
use crate::config::error::ConfigError;
use crate::plant::Plant;
use crate::plant::config::PlantConfig;
use cyclic::Cyclic;
use mechanism::{Mechanism, PlantAxis};
use misbehaviour::Memory;
use motion::Activity;
use positioning::Positioning;
use power::{Command, Power, Transition};

const PROFILE_POSITION: i64 = 1;
const PROFILE_VELOCITY: i64 = 3;
const HOMING: i64 = 6;
const CYCLIC_POSITION: i64 = 8;

/// An emulated drive on the bus.
///
/// # Example
///
/// ```
/// use mock_bus::node::Node;
/// use mock_bus::node::cia402_drive::{Cia402DriveConfig, Cia402DriveNode};
/// use mock_bus::plant::Plant;
/// use units::Time;
/// use wire::{Payload, can::CanFrame};
///
/// let (mut drive, mut plant) = (Cia402DriveNode::new(Default::default()), Plant::default());
/// let now = Time::from_seconds(1.0);
/// drive.advance(now, &mut plant);
/// let boot_up = Payload::Frame(CanFrame::standard(0x701, &[0]));
/// assert_eq!(drive.poll_transmit(), Some(boot_up));
/// let read_device_type = CanFrame::standard(0x601, &[0x40, 0x00, 0x10, 0, 0, 0, 0, 0]);
/// drive.handle(now, &Payload::Frame(read_device_type), &mut plant);
/// drive.advance(Time::from_seconds(1.1), &mut plant);
/// let answer = CanFrame::standard(0x581, &[0x43, 0x00, 0x10, 0, 0x92, 0x01, 0x02, 0x00]);
/// assert_eq!(drive.poll_transmit(), Some(Payload::Frame(answer)));
/// ```
#[derive(Debug)]
pub struct Cia402DriveNode {
    drive: Drive,
    /// Opened here, apart from the plant's own circuit.
    safe_torque_off: bool,
}

impl Cia402DriveNode {
    /// A drive that was powered at [`Time::ZERO`] and boots.
    ///
    /// # Panics
    /// When `config.node_id` is not 1 to 127, which reading a configuration file refuses.
    pub fn new(config: Cia402DriveConfig) -> Self {
        Self {
            drive: Drive::new(config),
            safe_torque_off: false,
        }
    }

    /// Opens (`true`) or closes the safe torque off input; it takes effect when the node is
    /// advanced next.
    pub fn set_safe_torque_off(&mut self, open: bool) {
        self.safe_torque_off = open;
        self.drive.look_now();
    }

    /// Local control (`true`): the statusword's remote bit is 0 and controlwords are ignored.
    pub fn set_local_control(&mut self, local: bool) {
        self.drive.local_control = local;
        self.drive.look_now();
    }

    /// The drive finds an error of its own (`Some`), or its cause goes away (`None`).
    pub fn set_internal_error(&mut self, code: Option<EmergencyCode>) {
        self.drive.internal_error = code;
        self.drive.look_now();
    }

    /// What the communication still spoils; writing it spoils what comes next.
    pub fn manners_mut(&mut self) -> &mut Manners {
        self.drive.server.manners_mut()
    }

    /// How the drive itself misbehaves.
    pub fn quirks_mut(&mut self) -> &mut DriveQuirks {
        &mut self.drive.config.quirks
    }

    /// Which faults were delivered, and how often.
    pub fn deliveries(&self) -> &Deliveries {
        self.drive.server.deliveries()
    }

    fn axis<'a>(&self, plant: &'a mut Plant) -> PlantAxis<'a> {
        let axis = self.drive.config.axis;
        PlantAxis { plant, axis }
    }
}

impl Section for Cia402DriveConfig {
    fn is_on_can(&self) -> bool {
        true
    }

    fn check(&self, plant: &PlantConfig) -> Result<(), ConfigError> {
        let (key, seen, expected) = match &self.rotary {
            Some(rotary) => {
                let turn = plant.table.as_ref().map(|it| it.encoder.counts_per_turn);
                if turn == Some(rotary.counts_per_turn) {
                    return Ok(());
                }
                let seen = f64::from(rotary.counts_per_turn);
                (
                    "counts_per_turn",
                    seen,
                    "the plant's table's counts_per_turn",
                )
            }
            None if self.encoder_resolution_nm == plant.resolution_nm() => return Ok(()),
            None => {
                let seen = self.encoder_resolution_nm;
                ("encoder_resolution_nm", seen, "the plant's resolution_nm")
            }
        };
        Err(ConfigError::Value {
            key,
            seen,
            expected,
        })
    }

    fn build(&self, _: u64, _: &str) -> Box<dyn Node> {
        Box::new(Cia402DriveNode::new(self.clone()))
    }
}

impl Node for Cia402DriveNode {
    fn concerns(&self, payload: &Payload) -> bool {
        matches!(payload, Payload::Frame(frame) if self.drive.server.concerns(frame))
    }

    fn handle(&mut self, now: Time, payload: &Payload, plant: &mut Plant) {
        if let Payload::Frame(frame) = payload {
            let mut axis = self.axis(plant);
            self.drive.handle(now, frame, &mut axis);
        }
    }

    fn advance(&mut self, now: Time, plant: &mut Plant) {
        let wired = plant.safe_torque_off(self.drive.config.axis);
        self.drive.safe_torque_off = self.safe_torque_off || wired;
        let mut axis = self.axis(plant);
        self.drive.advance(now, &mut axis);
    }

    fn next_event(&self) -> Time {
        self.drive.next_event()
    }

    fn poll_transmit(&mut self) -> Option<Payload> {
        self.drive.server.poll_transmit().map(Payload::Frame)
    }

    fn power_off(&mut self, _now: Time, plant: &mut Plant) {
        let mut axis = self.axis(plant);
        self.drive.power_off(&mut axis);
    }

    fn power_on(&mut self, now: Time, plant: &mut Plant) {
        let mut axis = self.axis(plant);
        self.drive.power_on(now, &mut axis);
    }
}

/// The drive over any mechanism.
#[derive(Debug)]
struct Drive {
    config: Cia402DriveConfig,
    server: CanopenServer,
    power: Power,
    /// What the last controlword asks for; `None` once the drive changed state by itself.
    command: Option<Command>,
    /// The next transition is not before this.
    power_free: Time,
    controlword: Controlword,
    /// The mode in force, whatever 0x6061 shows.
    mode: i64,
    mode_due: Time,
    /// Actual position = sign · encoder counts + offset.
    offset: i64,
    homed: bool,
    /// Where the encoder began to count when its power came.
    counted_from: i64,
    encoder_runs: bool,
    profile: Profile,
    activity: Activity,
    positioning: Positioning,
    homing: HomingStatus,
    homings: Homings,
    cyclic: Cyclic,
    /// Whether the power stage controls the motor.
    servo_on: bool,
    /// The last demand given to the plant, in metres or radians.
    sent_demand: Option<f64>,
    /// Where the demand was when the power stage was switched on.
    enabled_at: f64,
    servo_due: Time,
    following_since: Option<Time>,
    in_window_since: Option<Time>,
    /// When the last set-point's motion began.
    moved_at: Option<Time>,
    internal_limit: bool,
    fault: Option<EmergencyCode>,
    safe_torque_off: bool,
    local_control: bool,
    heartbeat_lost: bool,
    internal_error: Option<EmergencyCode>,
    memory: Memory,
}

impl Drive {
    fn new(config: Cia402DriveConfig) -> Self {
        let node = NodeId::new(config.node_id).expect("node_id is 1 to 127");
        let server = CanopenServer::new(
            node,
            Duration::from_millis(config.boot_delay_ms),
            &objects::description(&config, node),
            objects::dictionary(&config),
            config.manners.clone(),
        );
        let mut drive = Self {
            config,
            server,
            power: Power::NotReady,
            command: None,
            power_free: Time::ZERO,
            controlword: Controlword::empty(),
            mode: PROFILE_POSITION,
            mode_due: Time::NEVER,
            offset: 0,
            homed: false,
            counted_from: 0,
            encoder_runs: false,
            profile: Profile::resting(0.0),
            activity: Activity::Standing,
            positioning: Positioning::default(),
            homing: HomingStatus::NotStarted,
            homings: Homings::default(),
            cyclic: Cyclic::IDLE,
            servo_on: false,
            sent_demand: None,
            enabled_at: 0.0,
            servo_due: Time::ZERO,
            following_since: None,
            in_window_since: None,
            moved_at: None,
            internal_limit: false,
            fault: None,
            safe_torque_off: false,
            local_control: false,
            heartbeat_lost: false,
            internal_error: None,
            memory: Memory::NOTHING,
        };
        drive.mode = drive.get(0x6060);
        drive.remember_nothing();
        drive
    }

    /// Looks after itself as soon as it is advanced.
    fn look_now(&mut self) {
        self.servo_due = Time::ZERO;
    }

    fn handle(&mut self, now: Time, frame: &CanFrame, m: &mut impl Mechanism) {
        if !self.server.is_powered() || !self.server.concerns(frame) {
            return;
        }
        // A SYNC asks for no value before the drive has sampled at it.
        if !self.server.only_samples_at(frame) {
            self.publish(now, m);
        }
        self.note_target();
        self.server.handle(now, frame);
        self.settle(now, m);
    }

    fn advance(&mut self, now: Time, m: &mut impl Mechanism) {
        if !self.server.is_powered() {
            return;
        }
        if self.own_event() <= now {
            self.step(now, m);
        }
        if self.server.next_event() <= now || self.server.reports_changes() {
            self.publish(now, m);
            self.note_target();
            self.server.advance(now);
            self.settle(now, m);
        }
    }

    fn next_event(&self) -> Time {
        if !self.server.is_powered() {
            return Time::NEVER;
        }
        self.own_event().min(self.server.next_event())
    }

    fn own_event(&self) -> Time {
        let transition = match self.pending_transition() {
            Some(Transition::T4) if self.memory.enable_due != Time::NEVER => {
                self.power_free.max(self.memory.enable_due)
            }
            Some(_) => self.power_free,
            None => Time::NEVER,
        };
        let own = self.servo_due.min(self.mode_due);
        own.min(transition).min(self.cyclic.sync_due)
    }

    /// One round of the drive's own work.
    fn step(&mut self, now: Time, m: &mut impl Mechanism) {
        self.follow_mode(now);
        self.supervise(now, m);
        self.proceed(now, m);
        self.watch_window(now, m);
        self.pass_power(now, m);
        self.command_servo(now, m);
        self.schedule(now);
    }

    fn schedule(&mut self, now: Time) {
        let period = if self.is_busy(now) {
            Duration::from_micros(self.config.servo_period_us.max(1))
        } else {
            Duration::from_millis(self.config.supervision_period_ms.max(1))
        };
        let next = now + period;
        self.servo_due = if self.servo_due <= now {
            next
        } else {
            self.servo_due.min(next)
        };
    }

    /// Acts on what the frames said, until nothing is left to act on.
    fn settle(&mut self, now: Time, m: &mut impl Mechanism) {
        let mut stale = false;
        while let Some(event) = self.server.poll_event() {
            self.on_event(now, event, m);
            // Who samples at a SYNC has just published.
            stale = event != ServerEvent::Synchronised;
        }
        if stale {
            self.publish(now, m);
        }
        self.server.send_changes(now);
    }

    fn on_event(&mut self, now: Time, event: ServerEvent, m: &mut impl Mechanism) {
        match event {
            ServerEvent::Written(object) => match object.index {
                0x6040 => self.on_controlword(now, m),
                0x6060 => self.change_mode(now),
                0x607A => self.note_target_in_order(),
                0x60FF => self.run_at_speed(now),
                0x60B8 => self.on_probe_function(),
                _ => {}
            },
            ServerEvent::Synchronised => {
                self.on_sync(now, m);
                self.publish(now, m);
                self.server.send_synchronous(now);
            }
            ServerEvent::Nmt(state) => {
                if self.power == Power::NotReady {
                    self.power = Power::SwitchOnDisabled;
                }
                if state == NmtState::Stopped {
                    self.abort_connection(now, m);
                }
            }
            ServerEvent::ResetNode => self.boot(m),
            ServerEvent::ResetCommunication => self.abort_connection(now, m),
            ServerEvent::HeartbeatLost(_) => self.lose_master(now, m),
            ServerEvent::RpdoLost => self.lose_rpdo(now, m),
            ServerEvent::HeartbeatBack(_) => self.heartbeat_lost = false,
        }
    }

    fn get(&self, index: u16) -> i64 {
        self.server.get(index, 0)
    }

    const fn mode(&self) -> i64 {
        self.mode
    }

    fn change_mode(&mut self, now: Time) {
        if self.ignores_mode() {
            return;
        }
        let lag = Duration::from_millis(self.config.mode_lag_ms);
        self.mode_due = now + lag;
    }

    /// 0x6061 follows 0x6060; what the old mode was doing is slowed down and given up.
    fn follow_mode(&mut self, now: Time) {
        if now < self.mode_due {
            return;
        }
        self.mode_due = Time::NEVER;
        let mode = self.get(0x6060);
        if mode == self.mode() {
            return;
        }
        self.mode = mode;
        self.show_mode();
        self.homing = HomingStatus::NotStarted;
        self.positioning = Positioning::at(self.profile.end_position());
        if self.power == Power::OperationEnabled && self.is_moving_itself() {
            let deceleration = self.acceleration(0x6084);
            self.ramp(now, deceleration, motion::After::Stay);
        }
        self.run_at_speed(now);
    }
}
