//! Whether an axis makes sense, and its device has what it needs and nothing else.

use std::collections::BTreeMap;

use units::Short;

use crate::config::judge::{Finding, Judge};
use crate::config::{AxisConfig, MachineConfig};
use crate::hardware::bus::SerialLine;
use crate::hardware::drive::DriveConfig;
use crate::hardware::drive::copley::AMPLIFIER_RATES;

pub(super) fn check_axis(judge: &mut Judge<'_>, config: &MachineConfig, axis: &AxisConfig) {
    let motion = &axis.motion;
    judge.below(
        ("soft_min_mm", motion.soft_min_mm),
        ("soft_max_mm", motion.soft_max_mm),
    );
    let fastest = (motion.speed_max_mm_per_s, "speed_max_mm_per_s");
    judge.up_to("speed_mm_per_s", motion.speed_mm_per_s, fastest);
    let drive = axis.drive.family();
    drive.check(judge, config.wiring());
    let counts =
        motion.soft_min_mm.abs().max(motion.soft_max_mm.abs()) * 1e6 / motion.resolution_nm.abs();
    if motion.resolution_nm.abs() > 0.0 && counts > f64::from(i32::MAX) {
        judge.say(
            "resolution_nm",
            format!("the soft limits need {counts:.0} counts, a drive has 2147483647"),
            "use a coarser resolution or a shorter range",
        );
    }
    check_following_error(judge, axis);
    if let Some(limit) = motion.hold_limit_um {
        let window = ("position_window_um", motion.position_window_um);
        judge.at_least("hold_limit_um", limit, window);
    }
    check_gravity(judge, axis);
    check_drive_units(judge, axis);
}

/// Drives hold it in counts: less than one is 0, and every move ends with an error then.
fn check_following_error(judge: &mut Judge<'_>, axis: &AxisConfig) {
    let limit_um = axis.motion.following_error_limit_um;
    let count_um = axis.motion.resolution_nm.abs() * 1e-3;
    if limit_um > 0.0 && limit_um < count_um {
        judge.say(
            "following_error_limit_um",
            format!(
                "{} µm are less than one count of {} µm, and a drive holds it in whole counts",
                Short(limit_um),
                Short(count_um)
            ),
            "give what a move may lag behind, hundreds of counts or more",
        );
    }
}

/// A drive that is switched off after a quick stop lets its axis fall.
fn check_gravity(judge: &mut Judge<'_>, axis: &AxisConfig) {
    let motion = &axis.motion;
    if !motion.gravity || motion.drive_brake {
        return;
    }
    let seen = match &axis.drive {
        DriveConfig::Cia402(drive) => match drive.option_codes.quick_stop {
            Some(5..=8) => return,
            Some(code) => format!("with the quick stop code {code} its drive lets go of it"),
            None => "what its drive does after a quick stop is not stated".to_owned(),
        },
        DriveConfig::Copley(_) => "an amplifier that is switched off lets go of it".to_owned(),
    };
    let help = match &axis.drive {
        DriveConfig::Cia402(_) => {
            "set `option_codes = { quick_stop = 6 }` (or 5, 7, 8), so that the drive holds the axis, or \
             `drive_brake = true` where the drive closes a brake of its own first"
        }
        DriveConfig::Copley(_) => {
            "set `drive_brake = true` where the amplifier closes a brake before it switches off"
        }
    };
    judge.say("gravity", format!("is true, and {seen}"), help);
}

/// Drives hold speeds and accelerations in 32 bits, in units of their counts.
fn check_drive_units(judge: &mut Judge<'_>, axis: &AxisConfig) {
    let [speed_counts, acceleration_counts] = axis.drive.family().register_units();
    let motion = &axis.motion;
    let largest_mm = f64::from(i32::MAX) * motion.resolution_nm.abs() * 1e-6;
    let reference_speed = axis.zero.as_ref().map(|it| it.reference_speed_mm_per_s);
    for (key, value, counts, unit) in [
        (
            "speed_mm_per_s",
            Some(motion.speed_mm_per_s),
            speed_counts,
            "mm/s",
        ),
        (
            "zero.reference_speed_mm_per_s",
            reference_speed,
            speed_counts,
            "mm/s",
        ),
        (
            "acceleration_mm_per_s2",
            Some(motion.acceleration_mm_per_s2),
            acceleration_counts,
            "mm/s²",
        ),
        (
            "quick_stop_deceleration_mm_per_s2",
            Some(motion.quick_stop_deceleration_mm_per_s2),
            acceleration_counts,
            "mm/s²",
        ),
    ] {
        let largest = largest_mm * counts;
        if let Some(value) = value.filter(|it| *it > largest) {
            judge.say(
                key,
                format!(
                    "{} {unit} do not fit the drive's 32 bits: with a resolution of {} nm it takes \
                     {largest:.0} {unit} at most",
                    Short(value),
                    Short(motion.resolution_nm)
                ),
                "lower it, or use a coarser resolution",
            );
        }
    }
}

/// An amplifier can be brought to these rates only.
fn check_rate(judge: &mut Judge<'_>, line: Option<&SerialLine>) {
    if let Some(rate) = line
        .map(|it| it.baud_bit_per_s)
        .filter(|it| !AMPLIFIER_RATES.contains(it))
    {
        judge.say(
            "baud_bit_per_s",
            format!("{rate} bit/s is not a bit rate of an amplifier"),
            format!("give one of {AMPLIFIER_RATES:?}"),
        );
    }
}

/// Amplifiers share a line by their addresses; nothing else can share it with them.
pub(super) fn check_lines(config: &MachineConfig, findings: &mut Vec<Finding>) {
    let mut taken: BTreeMap<(&str, u8), String> = BTreeMap::new();
    let mut owned: BTreeMap<&str, String> = BTreeMap::new();
    for (name, axis) in &config.axis {
        let Some(address) = axis.address() else {
            continue;
        };
        let line = axis.port();
        let key = format!("axis.{name}.address");
        if !owned.contains_key(line) {
            owned.insert(line, key.clone());
            check_rate(
                &mut Judge::at(format!("serial.{line}"), findings),
                config.serial.get(line),
            );
        }
        if let Some(other) = taken.insert((line, address), key.clone()) {
            findings.push(Finding {
                key,
                cause: format!("amplifier {address} on {line} is already {other}"),
                help: "every amplifier on a line needs its own address".into(),
            });
        }
    }
    for (name, module) in &config.analog {
        let Some(address) = module.address() else {
            continue;
        };
        let key = format!("analog.{name}.address");
        if let Some(other) = taken.insert((module.port(), address), key.clone()) {
            findings.push(Finding {
                key,
                cause: format!("address {address} on {} is already {other}", module.port()),
                help: "every module on a line needs its own address".into(),
            });
        }
    }
    let analogs = config
        .analog
        .iter()
        .filter(|(_, it)| it.node().is_none())
        .map(|(name, it)| (it.port(), format!("analog.{name}.line")));
    let instruments = config
        .instrument
        .iter()
        .map(|(name, it)| (&*it.line, format!("instrument.{name}.line")));
    let cameras = config
        .camera
        .iter()
        .map(|(name, it)| (&*it.line, format!("camera.{name}.line")));
    for (line, key) in analogs.chain(instruments).chain(cameras) {
        if let Some(owner) = owned.get(line) {
            findings.push(Finding {
                key,
                cause: format!("{line} belongs to amplifiers ({owner})"),
                help: "give each of both a serial line of its own".into(),
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::Edit;
    use crate::config::parse;
    use crate::config::validate::told::check;

    const DRIVES: &str = include_str!("../../../../configs/machines/uvw.toml");
    const AMPLIFIERS: &str = include_str!("../../../../configs/machines/uvw-copley.toml");

    #[test]
    fn the_same_platform_is_sound_on_either_bus() {
        for text in [DRIVES, AMPLIFIERS] {
            parse(text, "machine.toml").unwrap_or_else(|error| panic!("{error}"));
        }
    }

    #[test]
    fn each_device_needs_its_own_keys_and_has_no_others() {
        let says = "missing `heartbeat_producer_ms`";
        let key = "axis.u";
        check(DRIVES, "heartbeat_producer_ms = 50\n", "", key, says);
        let says = "missing `poll_period_ms`";
        let both = "line = \"amps\"\naddress = 0                    # at the cable\n";
        let gone = AMPLIFIERS.edit_first(both, "address = 0\n");
        check(&gone, "poll_period_ms = 20.0\n", "", key, says);
        let says = "`device = \"copley\"` has no such key";
        for (stranger, key) in [
            ("watch_master_ms = 500\n", "axis.u.watch_master_ms"),
            ("synchronous_start = true\n", "axis.u.synchronous_start"),
        ] {
            let to = format!("device = \"copley\"\n{stranger}");
            check(AMPLIFIERS, "device = \"copley\"\n", &to, key, says);
        }
        let to = "device = \"cia402\"\naddress = 1\n";
        let says = "`device = \"cia402\"` has no such key";
        check(DRIVES, "device = \"cia402\"\n", to, "axis.u.address", says);
    }

    #[test]
    fn what_a_line_of_amplifiers_cannot_be_is_found_where_it_stands() {
        let again = "amplifier 1 on amps is already axis.v.address";
        let (from, key) = ("address = 2", "axis.w.address");
        check(AMPLIFIERS, from, "address = 1", key, again);
        check(AMPLIFIERS, from, "address = 128", key, "128");
        let (from, key) = (
            "baud_bit_per_s = 115200        #",
            "serial.amps.baud_bit_per_s",
        );
        let to = "baud_bit_per_s = 14400 #";
        check(AMPLIFIERS, from, to, key, "not a bit rate of an amplifier");
        let (from, key) = ("line = \"vision\"", "camera.eye.line");
        let says = "amps belongs to amplifiers (axis.u.address)";
        check(AMPLIFIERS, from, "line = \"amps\"", key, says);
        let (from, key) = ("line = \"amps\"", "axis.u.line");
        check(AMPLIFIERS, from, "line = \"ampz\"", key, "ampz");
        let from = "serial_number = 4001";
        let says = "no amplifier calls itself so";
        check(
            AMPLIFIERS,
            from,
            "model = \" \"",
            "axis.u.amplifier.model",
            says,
        );
        let (from, key) = ("poll_period_ms = 20.0", "axis.u.poll_period_ms");
        check(AMPLIFIERS, from, "poll_period_ms = 0.0", key, "");
    }

    /// Twenty metres per second squared are 4e9 counts of 5 nm: the start would be refused.
    #[test]
    fn what_a_drive_cannot_hold_at_its_resolution_is_found_before_the_start() {
        let linear = include_str!("../../../../configs/machines/linear.toml");
        let (from, to) = ("resolution_nm = 10.0", "resolution_nm = 5.0");
        let key = "axis.x.quick_stop_deceleration_mm_per_s2";
        let says = "20000 mm/s² do not fit the drive's 32 bits: with a resolution of 5 nm it takes \
                    10737 mm/s² at most";
        check(linear, from, to, key, says);
        let to = "resolution_nm = 2.0";
        check(
            linear,
            from,
            to,
            "axis.x.acceleration_mm_per_s2",
            "4295 mm/s²",
        );
        let to = "resolution_nm = 0.05";
        check(linear, from, to, "axis.x.speed_mm_per_s", "107 mm/s");
        let (from, key) = ("resolution_nm = 10.0", "axis.u.speed_mm_per_s");
        check(AMPLIFIERS, from, "resolution_nm = 0.02", key, "do not fit");
    }

    #[test]
    fn a_following_error_of_less_than_a_count_is_refused() {
        let (from, to) = ("limit_um = 200.0", "limit_um = 0.002");
        let key = "axis.u.following_error_limit_um";
        for text in [DRIVES, AMPLIFIERS] {
            let says = "0.002 µm are less than one count of 0.01 µm";
            check(text, from, to, key, says);
        }
    }

    #[test]
    fn an_axis_that_gravity_pulls_is_never_let_go() {
        let (from, key) = ("following_error_limit_um = 200.0", "axis.u.gravity");
        let gravity = "gravity = true\nfollowing_error_limit_um = 200.0";
        check(
            DRIVES,
            from,
            gravity,
            key,
            "after a quick stop is not stated",
        );
        let ramp =
            "gravity = true\noption_codes = { quick_stop = 2 }\nfollowing_error_limit_um = 200.0";
        check(DRIVES, from, ramp, key, "with the quick stop code 2");
        let amplifier = "an amplifier that is switched off lets go of it";
        check(AMPLIFIERS, from, gravity, key, amplifier);
        let hold =
            "gravity = true\noption_codes = { quick_stop = 6 }\nfollowing_error_limit_um = 200.0";
        let brake = "gravity = true\ndrive_brake = true\nfollowing_error_limit_um = 200.0";
        for (text, to) in [(DRIVES, hold), (DRIVES, brake), (AMPLIFIERS, brake)] {
            let parsed = crate::config::parse(&text.replacen(from, to, 1), "m.toml");
            assert!(parsed.is_ok(), "{to}");
        }
    }

    #[test]
    fn a_hold_limit_below_the_window_is_refused() {
        let (from, key) = ("following_error_limit_um = 200.0", "axis.u.hold_limit_um");
        let to = "hold_limit_um = 0.01\nfollowing_error_limit_um = 200.0";
        check(DRIVES, from, to, key, "position_window_um");
    }

    #[test]
    fn a_hall_search_over_a_serial_line_is_refused() {
        let linear = include_str!("../../../../configs/machines/linear.toml");
        let begin = linear.find("[axis.x.zero]").expect("it has a zero");
        let end = linear.find("[axis.x.calibrate]").expect("it comes next");
        let zero = linear[begin..end].edit("axis.x", "axis.u");
        let text = format!("{AMPLIFIERS}\n{zero}");
        check(
            &text,
            "",
            "",
            "axis.u.zero",
            "`device = \"copley\"` has no such key",
        );
    }
}
