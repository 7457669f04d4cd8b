//! Whether a bus or a line can be reached as it is described.

use std::path::Path;

use crate::config::judge::Judge;
use crate::hardware::bus::{CanBus, CanTransport, SerialLine};

const BITRATES: [u32; 8] = [
    10_000, 20_000, 50_000, 125_000, 250_000, 500_000, 800_000, 1_000_000,
];

/// One of the two keys that say where a bus is: its name, whether it is there, what it names.
type Place = (&'static str, bool, &'static str);

pub(super) fn check_bus(judge: &mut Judge<'_>, bus: &CanBus) {
    let interface = (
        "interface",
        bus.interface.is_some(),
        "the name that `ip link` shows",
    );
    let path = ("path", bus.path.is_some(), "the adapter's serial device");
    match bus.transport {
        CanTransport::SocketCan => check_places(judge, "socketcan", interface, path),
        CanTransport::Slcan => check_places(judge, "slcan", path, interface),
    }
    if bus.interface.as_ref().is_some_and(|it| is_blank(it)) {
        judge.say(
            "interface",
            "is empty",
            "give the name that `ip link` shows, such as \"can0\"",
        );
    }
    check_path(judge, bus.path.as_deref());
    if !BITRATES.contains(&bus.bitrate_bit_per_s) {
        judge.say(
            "bitrate_bit_per_s",
            format!("{} bit/s is not a CANopen bit rate", bus.bitrate_bit_per_s),
            "CiA 301 has 10000, 20000, 50000, 125000, 250000, 500000, 800000, 1000000",
        );
    }
}

/// A transport takes `wanted`, and has nothing to do with `other`.
fn check_places(judge: &mut Judge<'_>, transport: &str, wanted: Place, other: Place) {
    let (key, is_there, what) = wanted;
    let (stranger, has_stranger, _) = other;
    let cause = format!("`transport = \"{transport}\"` takes `{key}`, {what}");
    match (is_there, has_stranger) {
        (true, false) => {}
        (true, true) => judge.say(
            stranger,
            format!("{cause}, and no `{stranger}`"),
            format!("remove `{stranger}`"),
        ),
        (false, true) => judge.say(
            stranger,
            format!("{cause}, and no `{stranger}`"),
            format!("write `{key}` in place of `{stranger}`, or another `transport`"),
        ),
        (false, false) => judge.say(
            "transport",
            format!("{cause}, and it is missing"),
            format!("write `{key}`: {what}"),
        ),
    }
}

pub(super) fn check_serial(judge: &mut Judge<'_>, line: &SerialLine) {
    check_path(judge, Some(&line.path));
}

fn check_path(judge: &mut Judge<'_>, path: Option<&Path>) {
    if path.is_some_and(|it| is_blank(&it.to_string_lossy())) {
        judge.say(
            "path",
            "is empty",
            "give the device that it is plugged into; `/dev/serial/by-id/` has their names",
        );
    }
}

fn is_blank(text: &str) -> bool {
    text.trim().is_empty()
}

#[cfg(test)]
mod tests {
    use crate::config::validate::told::check;

    const LINEAR: &str = include_str!("../../../../configs/machines/linear.toml");
    const PATH: &str = "path = \"/dev/ttyACM1\"";

    #[test]
    fn a_device_without_a_name_is_none() {
        for blank in ["path = \"\"", "path = \"  \""] {
            check(LINEAR, PATH, blank, "can.can0.path", "is empty");
            let line = "path = \"/dev/ttyACM0\"";
            check(LINEAR, line, blank, "serial.laser.path", "is empty");
        }
        let from = "transport = \"slcan\"";
        let to = "transport = \"socketcan\"\ninterface = \" \"";
        check(LINEAR, from, to, "can.can0.interface", "is empty");
    }

    #[test]
    fn where_a_bus_is_goes_with_how_it_is_reached() {
        let takes = "`transport = \"slcan\"` takes `path`, the adapter's serial device";
        let (to, key) = ("interface = \"can0\"", "can.can0.interface");
        let says = format!("{takes}, and no `interface`");
        check(LINEAR, PATH, to, key, &says);
        let both = format!("{PATH}\n{to}");
        check(LINEAR, PATH, &both, key, &says);
        let says = format!("{takes}, and it is missing");
        check(LINEAR, PATH, "", "can.can0.transport", &says);
        let (from, to) = ("transport = \"slcan\"", "transport = \"socketcan\"");
        let says = "`transport = \"socketcan\"` takes `interface`, the name that `ip link` shows, and no `path`";
        check(LINEAR, from, to, "can.can0.path", says);
    }
}
