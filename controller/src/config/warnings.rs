//! What is doubtful of a configuration that is sound: nothing of it is refused, all of it is told.

use std::collections::BTreeMap;
use std::path::PathBuf;

use units::{Metres, Short};

use super::judge::{Finding, Judge};
use super::model::MachineConfig;
use super::{device_warnings, motion_warnings, text_warnings, watch_warnings};
use crate::hardware::node::IdentityConfig;
use crate::kinds::KINDS;

/// What somebody should look at before anything moves.
pub(super) fn of(config: &MachineConfig) -> Vec<Finding> {
    let mut found = Vec::new();
    check_profiles(config, &mut found);
    check_paths(config, &mut found);
    check_serial_numbers(config, &mut found);
    check_rates(config, &mut found);
    check_dead_paths(config, &mut found);
    text_warnings::check(config, &mut found);
    device_warnings::check(config, &mut found);
    watch_warnings::check(config, &mut found);
    for kind in KINDS {
        (kind.warnings)(config, &mut found);
    }
    motion_warnings::check(config, &mut found);
    found
}

/// Whether each bus and line has a device of the computer to itself.
fn check_paths(config: &MachineConfig, found: &mut Vec<Finding>) {
    let buses = config.can.iter();
    let buses = buses.filter_map(|(name, it)| Some((format!("can.{name}"), it.path.as_ref()?)));
    let lines = config.serial.iter();
    let lines = lines.map(|(name, it)| (format!("serial.{name}"), &it.path));
    let mut taken: BTreeMap<&PathBuf, String> = BTreeMap::new();
    for (key, path) in buses.chain(lines) {
        if let Some(other) = taken.insert(path, key.clone()) {
            let cause = format!("{} is that of {other} too", path.display());
            let help = "give each the device that it is plugged into; `/dev/serial/by-id/` has their names";
            Judge::at(key, found).say("path", cause, help);
        }
    }
}

/// Whether each drive is one of its own: a section that was copied has the number of another.
fn check_serial_numbers(config: &MachineConfig, found: &mut Vec<Finding>) {
    let axes = config.axis.iter();
    let axes = axes.map(|(name, it)| {
        (
            format!("axis.{name}"),
            it.drive.family().identity(),
            it.node().is_some(),
        )
    });
    let tables = config.rotary.iter();
    let tables = tables.map(|(name, it)| {
        (
            format!("rotary.{name}"),
            it.node.identity.configured(),
            true,
        )
    });
    let mut taken: BTreeMap<(u32, u32, u32), String> = BTreeMap::new();
    for (section, identity, is_node) in axes.chain(tables) {
        if identity.serial == 0 {
            continue;
        }
        let whose = (identity.vendor, identity.product, identity.serial);
        if let Some(other) = taken.insert(whose, section.clone()) {
            let key = if is_node {
                "identity.serial_number"
            } else {
                "amplifier.serial_number"
            };
            Judge::at(section, found).say(
                key,
                format!("{} is the serial number of {other}, too", identity.serial),
                "no two devices of a kind have the same: `truestage scan` says which is where",
            );
        }
    }
}

/// What converters of serial lines are made for, in bit/s; others take the nearest that they can, without a word.
const USUAL_RATES: [u32; 34] = [
    50, 75, 110, 134, 150, 200, 300, 600, 1200, 1800, 2400, 4800, 9600, 14_400, 19_200, 28_800,
    38_400, 57_600, 76_800, 115_200, 128_000, 230_400, 250_000, 256_000, 460_800, 500_000, 576_000,
    921_600, 1_000_000, 1_152_000, 1_500_000, 2_000_000, 3_000_000, 4_000_000,
];

fn check_rates(config: &MachineConfig, found: &mut Vec<Finding>) {
    for (name, line) in &config.serial {
        let rate = line.baud_bit_per_s;
        if !USUAL_RATES.contains(&rate) {
            Judge::at(format!("serial.{name}"), found).say(
                "baud_bit_per_s",
                format!("{rate} bit/s is no usual rate, and nothing is understood at another one than the device has"),
                "take what its manual says: 9600, 19200, 38400, 57600, 115200 and so on",
            );
        }
    }
}

/// Longer than any machine is: beyond it a laser loses its fringes before the path is dead.
const DEAD_PATH_MAX: Metres = Metres(10.0);

fn check_dead_paths(config: &MachineConfig, found: &mut Vec<Finding>) {
    for (name, instrument) in &config.instrument {
        let Some(path) = instrument.corrections().dead_path.map(|it| it.length) else {
            continue;
        };
        if path > DEAD_PATH_MAX {
            Judge::at(format!("instrument.{name}"), found).say(
                "dead_path_mm",
                format!(
                    "{} mm of dead path are {} m, and a part in a million of air over it {} µm",
                    Short(path.mm()),
                    Short(path.value()),
                    Short(path.value())
                ),
                "give the way of the beam from the interferometer to the reflector at the zero, in millimetres",
            );
        }
    }
}

/// The device profile that a drive has (0x1000, its low half: CiA 301).
const DRIVE: u32 = 402;

/// Whether the device types are those of such devices.
fn check_profiles(config: &MachineConfig, found: &mut Vec<Finding>) {
    let axes = config.axis.iter();
    let axes = axes.filter_map(|(name, it)| Some((format!("axis.{name}"), it.node()?, DRIVE)));
    let tables = config.rotary.iter();
    let tables = tables.map(|(name, it)| (format!("rotary.{name}"), &it.node, DRIVE));
    let modules = config.analog.iter().filter_map(|(name, it)| {
        let profile = it.module.profile()?;
        Some((format!("analog.{name}"), it.node()?, profile))
    });
    for (key, node, profile) in axes.chain(tables).chain(modules) {
        let judge = &mut Judge::at(format!("{key}.identity"), found);
        check_profile(judge, &node.identity, profile);
    }
}

fn check_profile(judge: &mut Judge<'_>, identity: &IdentityConfig, profile: u32) {
    let seen = identity.device_type & 0xFFFF;
    if seen == profile {
        return;
    }
    judge.say(
        "device_type",
        format!(
            "{:#010X} is a device of profile CiA {seen}, and this section is for one of CiA {profile}",
            identity.device_type
        ),
        "take 0x1000 from what `truestage scan` found at this node",
    );
}

#[cfg(test)]
pub(crate) mod told {
    use crate::Edit;
    use crate::config::parse;

    /// With each `from` of `edits` become its `to`, these are all keys with a warning, and the last one of it says this.
    #[track_caller]
    pub(crate) fn check(text: &str, edits: &[(&str, &str)], keys: &[&str], says: &str) {
        let text = edits.iter().fold(text.to_owned(), |text, (from, to)| {
            text.edit_first(from, to)
        });
        let loaded = parse(&text, "m.toml").unwrap_or_else(|error| panic!("{error}"));
        let told: Vec<_> = loaded.warnings.iter().map(|it| it.key.as_str()).collect();
        assert_eq!(told, keys, "{:#?}", loaded.warnings);
        let last = loaded
            .warnings
            .last()
            .map_or(String::new(), |it| it.cause.clone());
        assert!(last.contains(says), "{last}");
    }
}

#[cfg(test)]
mod tests {
    use super::told::check;

    const LINEAR: &str = include_str!("../../../configs/machines/linear.toml");

    #[test]
    fn what_ships_is_beyond_doubt() {
        for text in [
            LINEAR,
            include_str!("../../../configs/machines/gantry.toml"),
            include_str!("../../../configs/machines/rotary.toml"),
            include_str!("../../../configs/machines/uvw.toml"),
            include_str!("../../../configs/machines/uvw-copley.toml"),
            include_str!("../../../configs/machines/volumetric.toml"),
        ] {
            check(text, &[], &[], "");
        }
    }

    #[test]
    fn two_drives_with_one_serial_number_are_told() {
        let amplifiers = include_str!("../../../configs/machines/uvw-copley.toml");
        let edit = ("serial_number = 4002", "serial_number = 4001");
        let says = "4001 is the serial number of axis.u, too";
        check(
            amplifiers,
            &[edit],
            &["axis.v.amplifier.serial_number"],
            says,
        );
    }

    #[test]
    fn a_rate_that_nobody_has_and_a_dead_path_that_no_machine_has_are_told() {
        let edit = ("baud_bit_per_s = 115200", "baud_bit_per_s = 115201");
        let says = "115201 bit/s is no usual rate";
        check(LINEAR, &[edit], &["serial.laser.baud_bit_per_s"], says);
        let edit = ("dead_path_mm = ", "dead_path_mm = 100000.0 # ");
        let says = "are 100 m";
        check(LINEAR, &[edit], &["instrument.laser.dead_path_mm"], says);
    }

    #[test]
    fn two_that_are_plugged_into_one_port_are_told() {
        let edit = ("path = \"/dev/ttyACM0\"", "path = \"/dev/ttyACM1\"");
        let says = "/dev/ttyACM1 is that of can.can0 too";
        check(LINEAR, &[edit], &["serial.laser.path"], says);
    }

    #[test]
    fn a_device_of_another_profile_is_told() {
        let edit = ("device_type = 0x00020192", "device_type = 0x00040191");
        let says = "0x00040191 is a device of profile CiA 401";
        check(LINEAR, &[edit], &["axis.x.identity.device_type"], says);
        let edit = ("device_type = 0x00040191", "device_type = 0x00020192");
        let says = "this section is for one of CiA 401";
        check(LINEAR, &[edit], &["analog.hall.identity.device_type"], says);
    }
}
