//! Whether a configuration makes sense: ranges, references, and what the buses can carry.

pub(crate) mod axis;
mod bus;
pub(crate) mod drive;

use std::collections::BTreeMap;

use self::axis::{check_axis, check_lines};
use self::bus::{check_bus, check_serial};
use self::drive::check_axis_name;
pub(super) use crate::config::judge::Finding;
use crate::config::judge::Judge;
use crate::config::place::is_of_key;
use crate::kinds::KINDS;
use drivers::device::cia402::period_from;
use drivers::protocol::bus_load::BusLoadError;

use super::model::MachineConfig;
use crate::bus_plan;

/// The version of the file format this program reads.
const SCHEMA_VERSION: u32 = 1;

/// All that cannot be.
pub(super) fn validate(config: &MachineConfig) -> Vec<Finding> {
    let mut findings = Vec::new();
    if config.schema_version != SCHEMA_VERSION {
        findings.push(Finding {
            key: "schema_version".into(),
            cause: format!("version {} is not known", config.schema_version),
            help: format!("this program reads version {SCHEMA_VERSION}"),
        });
    }
    check_name(&mut Judge::at("machine".into(), &mut findings), config);
    for (name, bus) in &config.can {
        check_bus(&mut Judge::at(format!("can.{name}"), &mut findings), bus);
    }
    for (name, line) in &config.serial {
        check_serial(
            &mut Judge::at(format!("serial.{name}"), &mut findings),
            line,
        );
    }
    for (name, axis) in &config.axis {
        check_axis_name(&mut findings, "axis", name);
        check_axis(
            &mut Judge::at(format!("axis.{name}"), &mut findings),
            config,
            axis,
        );
    }
    for (name, analog) in &config.analog {
        let mut judge = Judge::at(format!("analog.{name}"), &mut findings);
        analog.check(&mut judge, config.wiring());
    }
    for (name, instrument) in &config.instrument {
        let mut judge = Judge::at(format!("instrument.{name}"), &mut findings);
        instrument.check(&mut judge, config.wiring());
    }
    for (name, camera) in &config.camera {
        let mut judge = Judge::at(format!("camera.{name}"), &mut findings);
        if config.instrument.contains_key(name) {
            judge.say(
                "",
                format!("an instrument is also called `{name}`"),
                "give every instrument a name of its own",
            );
        }
        camera.check(&mut judge, config.wiring());
    }
    for kind in KINDS {
        (kind.check)(config, &mut findings);
    }
    check_node_ids(config, &mut findings);
    check_lines(config, &mut findings);
    // Only of a configuration that is otherwise sound: its numbers would mean nothing.
    if findings.is_empty() {
        check_bus_load(config, &mut findings);
    }
    findings
}

fn check_name(judge: &mut Judge<'_>, config: &MachineConfig) {
    let name = &config.machine.name;
    if name.is_empty() || !name.chars().all(is_of_key) {
        judge.say(
            "name",
            format!("`{name}` cannot name a folder"),
            "use letters, digits, - and _",
        );
    }
    if config.machine.stage_serial.trim().is_empty() {
        judge.say(
            "stage_serial",
            "is empty",
            "give the serial number on the stage's plate",
        );
    }
    if config.axis.is_empty() && config.rotary.is_empty() {
        judge.say(
            "",
            "the machine has no axis",
            "add an [axis.NAME] or a [rotary.NAME] section",
        );
    }
}

/// Node ids by bus: the master's, the drives', the modules'.
fn check_node_ids(config: &MachineConfig, findings: &mut Vec<Finding>) {
    let mut taken: BTreeMap<(&str, u8), String> = BTreeMap::new();
    for (name, bus) in &config.can {
        taken.insert(
            (name, bus.master_node_id),
            format!("can.{name}.master_node_id"),
        );
    }
    let axes = config
        .axis
        .iter()
        .filter_map(|(name, it)| Some((name, it.node()?)))
        .map(|(name, it)| (&*it.bus, it.node_id, format!("axis.{name}")));
    let rotaries = config
        .rotary
        .iter()
        .map(|(name, it)| (&*it.node.bus, it.node.node_id, format!("rotary.{name}")));
    let analogs = config
        .analog
        .iter()
        .filter_map(|(name, it)| Some((name, it.node()?)))
        .map(|(name, it)| (&*it.bus, it.node_id, format!("analog.{name}")));
    for (bus, node, owner) in axes.chain(rotaries).chain(analogs) {
        let key = format!("{owner}.node_id");
        if let Some(other) = taken.insert((bus, node), key.clone()) {
            findings.push(Finding {
                key,
                cause: format!("node {node} on {bus} is already {other}"),
                help: "every node on a bus needs its own number".into(),
            });
        }
    }
}

fn check_bus_load(config: &MachineConfig, findings: &mut Vec<Finding>) {
    for name in config.can.keys() {
        if let Err(overload) = bus_plan::load(config, name) {
            let help = match overload {
                BusLoadError::DoesNotFit {
                    shortest_period, ..
                } => {
                    // What a drive can be told (0x60C2), so that the advice can be followed.
                    let fits = period_from(shortest_period).unwrap_or(shortest_period);
                    let fits = format!("{} ms would fit", fits.as_nanos() as f64 / 1e6);
                    match config.can[name].bitrate_bit_per_s {
                        ..1_000_000 => {
                            format!("raise its bit rate, bitrate_bit_per_s; at this one {fits}")
                        }
                        _ => fits,
                    }
                }
                BusLoadError::NoRoom { .. } => {
                    "raise its bit rate, or its heartbeats' periods, or put fewer devices on it"
                        .into()
                }
                BusLoadError::Senseless { .. } => {
                    "give every period on this bus more than 0".into()
                }
            };
            findings.push(Finding {
                key: format!("can.{name}.sync_period_ms"),
                cause: overload.to_string(),
                help,
            });
        }
    }
}

/// What tests of the single parts share.
#[cfg(test)]
pub(crate) mod told {
    use crate::Edit;
    use crate::config::{ConfigError, parse};

    /// With the first `from` in `text` become `to`, the finding at `key` says so.
    #[track_caller]
    pub(crate) fn check(text: &str, from: &str, to: &str, key: &str, says: &str) {
        match parse(&text.edit_first(from, to), "machine.toml") {
            Err(ConfigError::Invalid { findings }) => {
                let told = findings
                    .iter()
                    .any(|it| it.key == key && it.cause.contains(says));
                assert!(told, "{findings:?}");
            }
            other => panic!("{to}: {other:?}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::told::check;

    #[test]
    fn a_serial_number_of_blanks_is_none() {
        let linear = include_str!("../../../../configs/machines/linear.toml");
        let key = "machine.stage_serial";
        for blank in ["\"\"", "\"  \""] {
            check(linear, "\"TS-LIN-0001\"", blank, key, "is empty");
        }
    }
}
