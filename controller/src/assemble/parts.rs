//! What a machine is assembled of, from what its configuration says.

use core::time::Duration;
use std::collections::BTreeMap;

use machine::{AxisSettings, Bus, Camera, CyclicSettings, ExpectedNode, LinearAxis, Parts, Unit};
use units::{Metres, MetresPerSecond, MetresPerSecondSquared};
use wire::Port;
use wire::canopen::NodeId;

use super::ports;
use crate::config::{AxisConfig, CanBus, IdentityConfig, Loaded, MachineConfig};
use crate::hardware::drive::cyclic_settings;
use crate::hardware::node::{expected_identity, node_id};
use crate::rotary::settings::rotaries;

/// Everything of a machine but its transport, whose ports are numbered as [`ports`] says.
pub(crate) fn parts(loaded: &Loaded) -> Parts {
    let (config, patience) = (&loaded.config, loaded.patience);
    let ports = ports(config);
    let settings = config.axis.values().map(|axis| axis_settings(axis, config));
    let axes = config.axis.iter().map(|(name, axis)| Unit {
        name: name.clone(),
        port: ports[axis.port()],
        device: axis.driver(config.wiring(), patience),
    });
    let units = axes.zip(settings);
    Parts {
        buses: config
            .can
            .iter()
            .map(|it| bus(config, it, &ports))
            .collect(),
        lines: config
            .serial
            .keys()
            .map(|name| (ports[name], name.clone()))
            .collect(),
        axes: units
            .map(|(unit, settings)| LinearAxis { unit, settings })
            .collect(),
        rotaries: rotaries(config, &ports, patience),
        analogs: config
            .analog
            .iter()
            .map(|(name, it)| Unit {
                name: name.clone(),
                port: ports[it.port()],
                device: it.driver(config.wiring(), patience),
            })
            .collect(),
        instruments: config
            .instrument
            .iter()
            .map(|(name, it)| Unit {
                name: name.clone(),
                port: ports[&it.line],
                device: it.driver(patience),
            })
            .collect(),
        cameras: config
            .camera
            .iter()
            .map(|(name, it)| Camera {
                unit: Unit {
                    name: name.clone(),
                    port: ports[&it.line],
                    device: it.driver(patience),
                },
                inspection_timeout: it.inspection_timeout(),
                rejects_max: it.rejects_max,
                is_detector: config.is_detector(name),
            })
            .collect(),
        patience,
    }
}

fn bus(
    config: &MachineConfig,
    (name, can): (&String, &CanBus),
    ports: &BTreeMap<String, Port>,
) -> Bus {
    let nodes = nodes(config, name);
    let drives = nodes.iter().filter(|it| it.is_drive);
    Bus {
        name: name.clone(),
        port: ports[name],
        bitrate: can.bitrate_bit_per_s,
        sync_period: can.sync_period(),
        master: node_id(can.master_node_id),
        heartbeat: Duration::from_millis(can.master_heartbeat_ms.into()),
        drives: drives.map(|it| it.node).collect(),
        nodes: nodes.into_iter().map(|it| (it.node, it.expected)).collect(),
    }
}

struct Node {
    node: NodeId,
    is_drive: bool,
    expected: ExpectedNode,
}

/// The nodes that the configuration has on CAN bus `bus`: who they are and must be.
fn nodes(config: &MachineConfig, bus: &str) -> Vec<Node> {
    let node = |raw, is_drive, name: &String, identity: &IdentityConfig| Node {
        node: node_id(raw),
        is_drive,
        expected: ExpectedNode {
            device: name.clone(),
            identity: expected_identity(identity),
        },
    };
    let axes = config.axis.iter();
    let axes = axes
        .filter_map(|(name, axis)| Some((name, axis.node()?)))
        .filter(|(_, axis)| axis.bus == bus)
        .map(|(name, axis)| node(axis.node_id, true, name, &axis.identity));
    let rotaries = config.rotary.iter();
    let rotaries = rotaries
        .filter(|(_, rotary)| rotary.node.bus == bus)
        .map(|(name, rotary)| node(rotary.node.node_id, true, name, &rotary.node.identity));
    let analogs = config.analog.iter();
    let analogs = analogs
        .filter_map(|(name, it)| Some((name, it.node()?)))
        .filter(|(_, it)| it.bus == bus)
        .map(|(name, it)| node(it.node_id, false, name, &it.identity));
    axes.chain(rotaries).chain(analogs).collect()
}

fn axis_settings(axis: &AxisConfig, config: &MachineConfig) -> AxisSettings {
    AxisSettings {
        soft_min: Metres::from_mm(axis.motion.soft_min_mm),
        soft_max: Metres::from_mm(axis.motion.soft_max_mm),
        speed: MetresPerSecond(axis.motion.speed_mm_per_s * 1e-3),
        acceleration: MetresPerSecondSquared(axis.motion.acceleration_mm_per_s2 * 1e-3),
        position_window: Metres::from_um(axis.motion.position_window_um),
        move_timeout: Duration::from_secs_f64(axis.motion.move_timeout_s),
        cyclic: cyclic(axis, config),
    }
}

/// `None` for an axis without the section, and for one on a serial line.
fn cyclic(axis: &AxisConfig, config: &MachineConfig) -> Option<CyclicSettings> {
    let (node, cyclic) = axis.node().zip(axis.cyclic())?;
    let (limits, correction) = cyclic_settings(&axis.motion, cyclic);
    Some(CyclicSettings {
        limits,
        correction,
        period: config.can[&node.bus].sync_period(),
    })
}
