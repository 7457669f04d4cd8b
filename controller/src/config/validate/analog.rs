//! Whether an analog module makes sense, and its device has what it needs and nothing else.

use super::drive;
use crate::assemble;
use crate::config::judge::Judge;
use crate::config::{
    AnalogConfig, Cia404Config, DconConfig, MachineConfig, ModuleConfig, NodeConfig,
};

/// Inputs of a cia404 module that the driver knows.
const CIA404_INPUTS: u8 = 8;

pub(super) fn check_analog(judge: &mut Judge<'_>, config: &MachineConfig, analog: &AnalogConfig) {
    let used = || analog.channels.iter().chain(analog.temperature_channels());
    let mut seen: Vec<u8> = used().copied().collect();
    seen.sort_unstable();
    seen.dedup();
    if seen.len() != used().count() || seen.is_empty() {
        judge.say(
            "channels",
            "is empty or names a channel twice",
            "list each used channel once",
        );
    }
    if analog.full_scale_v.len() != analog.channels.len() {
        judge.say(
            "full_scale_v",
            "must have one value per channel",
            "list as many as `channels`",
        );
    }
    match &analog.module {
        ModuleConfig::Cia401(node) => check_cia401(judge, config, analog, node),
        ModuleConfig::Cia404(module) => check_cia404(judge, config, analog, module),
        ModuleConfig::Dcon(module) => check_dcon(judge, config, analog, module),
    }
}

fn check_node(judge: &mut Judge<'_>, config: &MachineConfig, node: &NodeConfig) {
    let heartbeats = [
        node.heartbeat_producer_ms,
        node.heartbeat_consumer_ms,
        node.watch_master_ms,
    ];
    drive::check_node(judge, config, &node.bus, heartbeats);
}

fn check_cia401(
    judge: &mut Judge<'_>,
    config: &MachineConfig,
    analog: &AnalogConfig,
    node: &NodeConfig,
) {
    check_node(judge, config, node);
    if analog.channels.iter().any(|channel| *channel >= 4) {
        judge.say(
            "channels",
            "one process data object carries channels 0 to 3",
            "use those",
        );
    }
    for value in &analog.full_scale_v {
        judge.within("full_scale_v", *value, 1e-3, 1e3);
    }
}

fn check_cia404(
    judge: &mut Judge<'_>,
    config: &MachineConfig,
    analog: &AnalogConfig,
    module: &Cia404Config,
) {
    check_node(judge, config, &module.node);
    for (key, channels) in [
        ("channels", &analog.channels),
        ("temperature_channels", &module.temperature_channels),
    ] {
        if channels.iter().any(|channel| *channel >= CIA404_INPUTS) {
            judge.say(key, "a cia404 module has channels 0 to 7", "use those");
        }
    }
    for value in &analog.full_scale_v {
        let fits = *value > 0.0 && assemble::voltage_digits(*value).is_some();
        if !fits {
            judge.say(
                "full_scale_v",
                format!("{value} V does not fit 16 bits of millivolts"),
                "give more than 0, and 32.767 at most",
            );
        }
    }
}

fn check_dcon(
    judge: &mut Judge<'_>,
    config: &MachineConfig,
    analog: &AnalogConfig,
    module: &DconConfig,
) {
    judge.known("line", &module.line, &config.serial, "serial line");
    if analog.channels.iter().any(|channel| *channel >= 8) {
        judge.say("channels", "a dcon module has channels 0 to 7", "use those");
    }
    if assemble::dcon_range(&analog.full_scale_v).is_none() {
        judge.say(
            "full_scale_v",
            "a dcon module has one input range for all channels",
            "give each channel the same: 10.0, 5.0, 1.0, 0.5 or 0.15",
        );
    }
}

#[cfg(test)]
mod tests {
    use crate::config::validate::told;

    const VOLUMETRIC: &str = include_str!("../../../../configs/machines/volumetric.toml");

    /// The finding at `key` after `from`, once, has become `to`.
    #[track_caller]
    fn check(from: &str, to: &str, key: &str, says: &str) {
        told::check(VOLUMETRIC, from, to, key, says);
    }

    #[test]
    fn what_no_measuring_module_can_be_is_found_where_it_stands() {
        let (from, key) = ("every_syncs = 10\n", "analog.beams_x");
        check(from, "", key, "missing `every_syncs`");
        let every = format!("{key}.every_syncs");
        check(from, "every_syncs = 0\n", &every, "0 is impossible");
        check(from, "every_syncs = 241\n", &every, "241 is impossible");
        let to = "every_syncs = 10\npoll_period_ms = 5.0\n";
        let stranger = format!("{key}.poll_period_ms");
        check(from, to, &stranger, "`device = \"cia404\"` has no such key");
        let (from, to) = ("channels = [0, 1, 2, 3, 4, 5, 6, 7]", "channels = [8]");
        let channels = format!("{key}.channels");
        check(from, to, &channels, "channels 0 to 7");
        let (from, to) = ("full_scale_v = [3.2,", "full_scale_v = [40.0,");
        let range = format!("{key}.full_scale_v");
        check(from, to, &range, "40 V does not fit");
        let (from, to) = ("temperature_channels = [2,", "temperature_channels = [1,");
        check(from, to, "analog.roll_and_heat.channels", "twice");
    }
}
