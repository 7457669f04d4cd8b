//! Whether an analog module makes sense, and its device has what it needs and nothing else.

use super::drive::{check_heartbeat, check_watch};
use crate::assemble;
use crate::config::judge::Judge;
use crate::config::{AnalogConfig, AnalogDevice, MachineConfig};

/// Inputs of a cia404 module that the driver knows.
const CIA404_INPUTS: u8 = 8;
/// A synchronous PDO comes at every 1st to 240th SYNC.
const EVERY_SYNCS_MAX: f64 = 240.0;

pub(super) fn check_analog(judge: &mut Judge<'_>, config: &MachineConfig, analog: &AnalogConfig) {
    let used = || analog.channels.iter().chain(&analog.temperature_channels);
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
    match analog.device {
        AnalogDevice::Cia401 => check_cia401(judge, config, analog),
        AnalogDevice::Cia404 => check_cia404(judge, config, analog),
        AnalogDevice::Dcon => check_dcon(judge, config, analog),
    }
    check_strangers(judge, analog);
}

/// A key of another kind of module would be believed to do something.
fn check_strangers(judge: &mut Judge<'_>, analog: &AnalogConfig) {
    let can = [
        ("bus", analog.bus.is_some()),
        ("node_id", analog.node_id.is_some()),
        (
            "heartbeat_producer_ms",
            analog.heartbeat_producer_ms.is_some(),
        ),
        (
            "heartbeat_consumer_ms",
            analog.heartbeat_consumer_ms.is_some(),
        ),
        ("watch_master_ms", analog.watch_master_ms.is_some()),
        ("identity", analog.identity.is_some()),
    ];
    let line = [
        ("line", analog.line.is_some()),
        ("address", analog.address.is_some()),
        ("checksum", analog.checksum),
        ("poll_period_ms", analog.poll_period_ms.is_some()),
    ];
    let measuring = [
        (
            "temperature_channels",
            !analog.temperature_channels.is_empty(),
        ),
        ("every_syncs", analog.every_syncs.is_some()),
    ];
    let (name, strangers): (_, Vec<_>) = match analog.device {
        AnalogDevice::Cia401 => ("cia401", line.into_iter().chain(measuring).collect()),
        AnalogDevice::Cia404 => ("cia404", line.to_vec()),
        AnalogDevice::Dcon => ("dcon", can.into_iter().chain(measuring).collect()),
    };
    for (key, _) in strangers.iter().filter(|(_, is_there)| *is_there) {
        judge.say(key, format!("a {name} module has no such key"), "remove it");
    }
}

/// What every module on CAN needs.
fn check_node(judge: &mut Judge<'_>, config: &MachineConfig, analog: &AnalogConfig, kind: &str) {
    let needs = |what: &str| format!("a {kind} module needs {what}");
    match (&analog.bus, analog.node_id) {
        (Some(bus), Some(node_id)) => {
            judge.known("bus", bus, &config.can, "CAN bus");
            judge.within("node_id", node_id.into(), 1.0, 127.0);
        }
        _ => judge.say("device", needs("`bus` and `node_id`"), "add them"),
    }
    match (
        analog.heartbeat_producer_ms,
        analog.heartbeat_consumer_ms,
        analog.watch_master_ms,
    ) {
        (Some(producer), Some(consumer), Some(watch)) => {
            check_heartbeat(judge, producer, consumer);
            check_watch(judge, config, analog.bus.as_deref().unwrap_or(""), watch);
        }
        _ => judge.say(
            "device",
            needs("`heartbeat_producer_ms`, `heartbeat_consumer_ms`, `watch_master_ms`"),
            "add them",
        ),
    }
    if analog.identity.is_none() {
        judge.say("device", needs("an `identity` section"), "add it");
    }
}

fn check_cia401(judge: &mut Judge<'_>, config: &MachineConfig, analog: &AnalogConfig) {
    check_node(judge, config, analog, "cia401");
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

fn check_cia404(judge: &mut Judge<'_>, config: &MachineConfig, analog: &AnalogConfig) {
    check_node(judge, config, analog, "cia404");
    for (key, channels) in [
        ("channels", &analog.channels),
        ("temperature_channels", &analog.temperature_channels),
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
    match analog.every_syncs {
        Some(every) => judge.within("every_syncs", every.into(), 1.0, EVERY_SYNCS_MAX),
        None => judge.say("device", "a cia404 module needs `every_syncs`", "add it"),
    }
}

fn check_dcon(judge: &mut Judge<'_>, config: &MachineConfig, analog: &AnalogConfig) {
    match (&analog.line, analog.address) {
        (Some(line), Some(_)) => judge.known("line", line, &config.serial, "serial line"),
        _ => judge.say(
            "device",
            "a dcon module needs `line` and `address`",
            "add them",
        ),
    }
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
    match analog.poll_period_ms {
        Some(period) => judge.within("poll_period_ms", period, 1.0, 60_000.0),
        None => judge.say("device", "a dcon module needs `poll_period_ms`", "add it"),
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
        let device = format!("{key}.device");
        check(from, "", &device, "needs `every_syncs`");
        let every = format!("{key}.every_syncs");
        check(from, "every_syncs = 0\n", &every, "0 is impossible");
        check(from, "every_syncs = 241\n", &every, "241 is impossible");
        let to = "every_syncs = 10\npoll_period_ms = 5.0\n";
        let stranger = format!("{key}.poll_period_ms");
        check(from, to, &stranger, "a cia404 module has no such key");
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
