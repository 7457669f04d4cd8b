//! What a configuration puts on each CAN bus, and whether it fits.

use core::time::Duration;
use std::collections::BTreeMap;

use drivers::protocol::bus_load::{BusLoad, BusLoadError, BusPlan};

use crate::config::MachineConfig;

/// Bytes of the PDOs a CiA 402 drive sends at every SYNC: statusword, position and mode; then
/// the following error.
const DRIVE_PDO_BYTES: [u8; 2] = [7, 4];
/// A drive that follows cyclic set-points hears controlword and target at every SYNC.
const SET_POINT_PDO_BYTES: u8 = 6;
/// A touch probe adds its status, a position and a count.
const LATCH_PDO_BYTES: u8 = 8;

/// What the devices of each CAN bus put on it while the machine runs, as a share of it, 0 to 1.
pub(crate) fn loads(config: &MachineConfig) -> BTreeMap<String, f64> {
    let each = config.can.keys();
    let fitting = each.filter_map(|name| Some((name.clone(), load(config, name).ok()?.load)));
    fitting.collect()
}

/// The load of CAN bus `name`.
///
/// # Errors
/// When it does not fit; the error says which SYNC period would.
///
/// # Panics
/// When there is no such bus.
pub(crate) fn load(config: &MachineConfig, name: &str) -> Result<BusLoad, BusLoadError> {
    let bus = &config.can[name];
    let ms = |ms: u16| Duration::from_millis(ms.into());
    let mut plan = BusPlan::new(bus.bitrate_bit_per_s, bus.sync_period())
        .with_heartbeat(ms(bus.master_heartbeat_ms));
    let axes = config.axis.values();
    let axes = axes.filter_map(|axis| Some((axis.node()?, axis.cyclic().is_some())));
    for (axis, is_cyclic) in axes.filter(|(axis, _)| axis.bus == name) {
        if is_cyclic {
            plan = plan.with_pdos(&[SET_POINT_PDO_BYTES]);
        }
        plan = plan
            .with_pdos(&DRIVE_PDO_BYTES)
            .with_heartbeat(ms(axis.heartbeat_producer_ms));
    }
    for rotary in config.rotary.values().filter(|it| it.node.bus == name) {
        plan = plan
            .with_pdos(&DRIVE_PDO_BYTES)
            .with_heartbeat(ms(rotary.node.heartbeat_producer_ms));
        if rotary.line_detector.is_some() {
            plan = plan.with_pdos(&[LATCH_PDO_BYTES]);
        }
    }
    let modules = config.analog.values();
    let modules = modules.filter_map(|it| Some((it, it.node()?)));
    for (analog, node) in modules.filter(|(_, node)| node.bus == name) {
        // Two bytes a channel; four channels fill a PDO.
        let inputs = analog.channels.len() + analog.temperature_channels().len();
        let pdos: Vec<u8> = (0..inputs.div_ceil(4))
            .map(|pdo| (inputs - 4 * pdo).min(4) as u8 * 2)
            .collect();
        plan = plan
            .with_seldom_pdos(&pdos, analog.every_syncs().unwrap_or(1))
            .with_heartbeat(ms(node.heartbeat_producer_ms));
    }
    plan.load()
}

#[cfg(test)]
mod tests {
    use crate::Edit;
    use crate::config;

    /// The shipped linear machine with four axes that follow set-points, on a SYNC of `period_ms`.
    fn four_axes(period_ms: &str) -> Result<config::Loaded, config::ConfigError> {
        const MACHINE: &str = include_str!("../../configs/machines/linear.toml");
        let (head, rest) = MACHINE.split_once("[axis.x]").expect("it has an axis");
        let (axis, rest) = rest.split_once("[analog.hall]").expect("it has a module");
        let axis = axis.edit(
            "[axis.x.identity]",
            "synchronous_start = true\n[axis.x.cyclic]\njerk_mm_per_s3 = 1e5\n\
             deviation_limit_um = 100.0\n[axis.x.identity]",
        );
        let mut text = head.edit(
            "sync_period_ms = 5.0",
            &format!("sync_period_ms = {period_ms}"),
        );
        for (name, node) in [("x", 1), ("y", 3), ("z", 4), ("w", 5)] {
            let own = format!("[axis.{name}]{axis}").edit("axis.x", &format!("axis.{name}"));
            text += &own.edit("node_id = 1", &format!("node_id = {node}"));
        }
        config::parse(&format!("{text}[analog.hall]{rest}"), "four.toml")
    }

    /// Bits of the longest frames: SYNC 55; for each axis RPDO of 6 bytes 115, TPDOs of 7 and 4
    /// bytes 125 and 95; the analog module's 4 bytes 95: 1490 of 1000, and of 2000 with 0.7 % of
    /// heartbeats.
    #[test]
    fn four_axes_at_1_mbit_do_not_fit_one_millisecond_and_the_error_says_what_does() {
        let Err(error) = four_axes("1.0") else {
            panic!("one millisecond was taken")
        };
        let error = error.to_string();
        assert!(error.contains("take 1.49ms, and it has 1ms"), "{error}");
        assert!(error.contains("a SYNC period of 1.8"), "{error}");
        let loaded = four_axes("2.0").expect("two milliseconds fit");
        let load = super::load(&loaded.config, "can0").expect("it fits");
        assert!((load.load - 0.745).abs() < 0.02, "{}", load.load);
    }

    #[test]
    fn a_cyclic_axis_needs_its_command_pdo_at_sync() {
        let text = include_str!("../../configs/machines/linear.toml").edit(
            "[axis.x.identity]",
            "[axis.x.cyclic]\njerk_mm_per_s3 = 0.5\ndeviation_limit_um = 100.0\n[axis.x.identity]",
        );
        let Err(error) = config::parse(&text, "one.toml") else {
            panic!("an axis without synchronous_start was taken")
        };
        let error = error.to_string();
        for word in ["synchronous_start", "jerk_mm_per_s3", "one.toml:"] {
            assert!(error.contains(word), "{word}: {error}");
        }
    }
}
