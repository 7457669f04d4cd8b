//! What a machine is assembled of.
//!
//! Whoever assembles it has read and checked a configuration; here is what of it the machine itself
//! needs, in SI units. What a kind of machine needs besides stays with that kind.

use core::time::Duration;
use std::collections::BTreeMap;

use drivers::device::canopen_node::ExpectedIdentity;
use drivers::device::{AnalogInput, Axis, DisplacementInstrument, PoseInstrument, RotaryAxis};
use units::{Metres, MetresPerSecond, MetresPerSecondSquared};
use wire::Port;
use wire::canopen::NodeId;

use crate::engine::{AxisLimits, CorrectionLimits};
use crate::patience::Patience;
use crate::unit::Unit;

/// All of a machine but its transport. Devices are numbered in the order of these lists: linear
/// axes, rotary axes, analog modules, instruments, cameras.
pub struct Parts {
    /// The CAN buses, in the order of their ports.
    pub buses: Vec<Bus>,
    /// The names of the serial lines, by their ports.
    pub lines: BTreeMap<Port, String>,
    /// The linear axes.
    pub axes: Vec<LinearAxis>,
    /// The rotary axes.
    pub rotaries: Vec<Unit<dyn RotaryAxis>>,
    /// The analog modules.
    pub analogs: Vec<Unit<dyn AnalogInput>>,
    /// The displacement instruments.
    pub instruments: Vec<Unit<dyn DisplacementInstrument>>,
    /// The image controllers.
    pub cameras: Vec<Camera>,
    /// How much longer than usual things are waited for.
    pub patience: Patience,
}

/// A CAN bus.
#[derive(Clone, Debug)]
pub struct Bus {
    /// Its name in the configuration.
    pub name: String,
    /// Its port.
    pub port: Port,
    /// Its bit rate, in bit/s.
    pub bitrate: u32,
    /// From SYNC to SYNC.
    pub sync_period: Duration,
    /// The controller's own node.
    pub master: NodeId,
    /// From one heartbeat of the controller to the next.
    pub heartbeat: Duration,
    /// The devices on it.
    pub nodes: BTreeMap<NodeId, ExpectedNode>,
    /// Those of them that are drives.
    pub drives: Vec<NodeId>,
}

/// A node as the configuration has it.
#[derive(Clone, Debug)]
pub struct ExpectedNode {
    /// The device's name.
    pub device: String,
    /// Who it must say that it is.
    pub identity: ExpectedIdentity,
}

/// A linear axis and what it may be told.
pub struct LinearAxis {
    /// Its drive.
    pub unit: Unit<dyn Axis>,
    /// Within which it is moved.
    pub settings: AxisSettings,
}

/// Within which a linear axis is moved, in machine coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisSettings {
    /// The lower soft limit.
    pub soft_min: Metres,
    /// The upper soft limit.
    pub soft_max: Metres,
    /// The usual speed of a move.
    pub speed: MetresPerSecond,
    /// The acceleration of a move.
    pub acceleration: MetresPerSecondSquared,
    /// How near its target a move ends.
    pub position_window: Metres,
    /// The longest a move may take.
    pub move_timeout: Duration,
    /// `None` when the axis cannot follow cyclic set-points.
    pub cyclic: Option<CyclicSettings>,
}

/// Within which a linear axis follows cyclic set-points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CyclicSettings {
    /// The limits of its path.
    pub limits: AxisLimits,
    /// The limits of what is added to it.
    pub correction: CorrectionLimits,
    /// The SYNC period of its bus.
    pub period: Duration,
}

/// An image controller.
pub struct Camera {
    /// Its driver.
    pub unit: Unit<dyn PoseInstrument>,
    /// How long one picture may take.
    pub inspection_timeout: Duration,
    /// How many pictures of one pose may be rejected.
    pub rejects_max: u32,
    /// Whether it sees the spot of a beam, all the time; otherwise it is started when a procedure first needs it.
    pub is_detector: bool,
}
