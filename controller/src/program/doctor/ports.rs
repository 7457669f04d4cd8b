//! Each bus and line: is it there, may this user use it, is it set up.

use std::collections::BTreeMap;
use std::io::{Error, ErrorKind};
use std::path::{Path, PathBuf};

use nix::unistd::{AccessFlags, access};

use super::checked::Checked;
use super::host::Host;
use crate::config::MachineConfig;
use crate::ports::Endpoint;

/// What the kernel calls a CAN interface (ARPHRD_CAN).
const CAN_TYPE: &str = "280";
/// An interface that is up (IFF_UP).
const UP: u32 = 1;
/// Fewer frames in the queue of an interface than every axis and module may be sent in one period.
const QUEUE_LEAST: u32 = 64;
/// An adapter that keeps bytes for longer than this makes answers late.
const LATENCY_MAX_MS: u32 = 1;

pub(super) fn checks(
    host: &Host,
    config: &MachineConfig,
    endpoints: &BTreeMap<String, Endpoint>,
) -> Vec<Checked> {
    let mut found = shared(endpoints);
    for (name, endpoint) in endpoints {
        match endpoint {
            Endpoint::SocketCan(interface) => {
                let bitrate = config.can.get(name).map_or(0, |it| it.bitrate_bit_per_s);
                found.extend(interface_checks(host, (name, interface), bitrate));
            }
            Endpoint::Slcan(path) | Endpoint::Serial(path) => {
                found.extend(line_checks(host, name, path));
            }
        }
    }
    found
}

/// Two that are one.
fn shared(endpoints: &BTreeMap<String, Endpoint>) -> Vec<Checked> {
    let mut seen: BTreeMap<PathBuf, &str> = BTreeMap::new();
    let mut found = Vec::new();
    for (name, endpoint) in endpoints {
        let real = match endpoint {
            Endpoint::SocketCan(interface) => PathBuf::from(interface),
            Endpoint::Slcan(path) | Endpoint::Serial(path) => {
                path.canonicalize().unwrap_or_else(|_| path.clone())
            }
        };
        if let Some(other) = seen.insert(real.clone(), name) {
            let told = format!("is {}, and so is {other}", real.display());
            found.push(Checked::bad(
                name,
                told,
                "give each its own in the configuration",
            ));
        }
    }
    found
}

fn interface_checks(host: &Host, (name, interface): (&str, &str), bitrate: u32) -> Vec<Checked> {
    let folder = format!("sys/class/net/{interface}");
    let of = |key: &str| host.read(&format!("{folder}/{key}"));
    let set_up = format!("sudo ip link set {interface} up type can bitrate {bitrate}");
    if !host.has(&folder) {
        let told = format!("there is no interface {interface}");
        let fix = format!("plug the adapter in (`ip link` lists what is there), then {set_up}");
        return vec![Checked::bad(name, told, &fix)];
    }
    if of("type").is_some_and(|it| it != CAN_TYPE) {
        let told = format!("{interface} is no CAN interface");
        return vec![Checked::bad(
            name,
            told,
            "name another one; `ip -details link` says which are",
        )];
    }
    let flags =
        of("flags").and_then(|it| u32::from_str_radix(it.trim_start_matches("0x"), 16).ok());
    if flags.is_some_and(|it| it & UP == 0) {
        let told = format!("{interface} is down");
        return vec![Checked::bad(name, told, &set_up)];
    }
    let mut found = vec![Checked::good(name, format!("{interface} is up"))];
    let queue = of("tx_queue_len").and_then(|it| it.parse::<u32>().ok());
    if let Some(length) = queue.filter(|it| *it < QUEUE_LEAST) {
        let told = format!("{length} frames wait in its queue at most");
        let fix = format!("sudo ip link set {interface} txqueuelen 1000");
        found.push(Checked::doubtful(&format!("{name} queue"), told, &fix));
    }
    found.extend(errors(name, &of));
    found
}

/// What an interface has counted since it was set up.
fn errors(name: &str, of: &impl Fn(&str) -> Option<String>) -> Option<Checked> {
    let counters = ["rx_errors", "tx_errors", "rx_dropped", "tx_dropped"];
    let counted = counters.into_iter().filter_map(|it| {
        let count: u64 = of(&format!("statistics/{it}"))?.parse().ok()?;
        (count > 0).then(|| format!("{it} {count}"))
    });
    let counted: Vec<String> = counted.collect();
    (!counted.is_empty()).then(|| {
        Checked::doubtful(
            &format!("{name} counters"),
            format!("since it is up: {}", counted.join(", ")),
            "60 Ω between CAN_H and CAN_L with power off, one bit rate for all, one ground",
        )
    })
}

fn line_checks(host: &Host, name: &str, path: &Path) -> Vec<Checked> {
    let shown = path.display();
    let usable = access(path, AccessFlags::R_OK | AccessFlags::W_OK);
    let denied = usable.err().map(Error::from);
    match denied.map(|it| it.kind()) {
        None => {}
        Some(ErrorKind::PermissionDenied) => {
            let told = format!("{shown}: permission denied");
            let fix = "sudo usermod -aG dialout $USER, then log in again; or install packaging/70-truestage.rules";
            return vec![Checked::bad(name, told, fix)];
        }
        Some(ErrorKind::NotFound) => {
            let told = format!("{shown} is not there");
            let fix = "plug it in; `ls -l /dev/serial/by-id` lists adapters by names that stay";
            return vec![Checked::bad(name, told, fix)];
        }
        Some(kind) => {
            let told = format!("{shown}: {kind}");
            return vec![Checked::bad(
                name,
                told,
                "see what the kernel says: `dmesg | tail`",
            )];
        }
    }
    let mut found = vec![Checked::good(name, format!("{shown} can be opened"))];
    found.extend(latency(host, name, path));
    found
}

/// USB adapters of FTDI keep bytes until so many milliseconds are over.
fn latency(host: &Host, name: &str, path: &Path) -> Option<Checked> {
    let real = path.canonicalize().ok()?;
    let device = real.file_name()?.to_str()?;
    let file = format!("sys/bus/usb-serial/devices/{device}/latency_timer");
    let ms: u32 = host.read(&file)?.parse().ok()?;
    (ms > LATENCY_MAX_MS).then(|| {
        Checked::doubtful(
            &format!("{name} latency"),
            format!("its adapter keeps bytes for {ms} ms"),
            &format!(
                "echo 1 | sudo tee /{file}; packaging/70-truestage.rules does it at each start"
            ),
        )
    })
}

#[cfg(test)]
mod tests {
    use super::super::checked::Verdict;
    use super::super::checked::tests::expect;
    use super::super::host::tests::host;
    use super::*;

    fn interface(files: &[(&str, &str)]) -> Vec<Checked> {
        let named: Vec<_> = files
            .iter()
            .map(|(key, text)| (format!("sys/class/net/can0/{key}"), *text))
            .collect();
        let named: Vec<_> = named.iter().map(|(key, it)| (key.as_str(), *it)).collect();
        let (_folder, host) = host(&named);
        interface_checks(&host, ("bus", "can0"), 500_000)
    }

    #[test]
    fn an_interface_that_is_missing_down_or_none_says_how_it_is_set_up() {
        let says = ["no interface can0", "type can bitrate 500000"];
        expect(&interface(&[]), "bus", Verdict::Bad, says);
        let ethernet = [("type", "1"), ("flags", "0x1003")];
        expect(
            &interface(&ethernet),
            "bus",
            Verdict::Bad,
            ["no CAN interface", ""],
        );
        let down = [("type", "280"), ("flags", "0x40080")];
        let says = ["is down", "sudo ip link set can0 up"];
        expect(&interface(&down), "bus", Verdict::Bad, says);
    }

    #[test]
    fn a_short_queue_and_errors_that_were_counted_are_told() {
        let up = [
            ("type", "280\n"),
            ("flags", "0x400c1\n"),
            ("tx_queue_len", "10\n"),
            ("statistics/rx_errors", "3\n"),
            ("statistics/tx_errors", "0\n"),
        ];
        let found = interface(&up);
        expect(&found, "bus", Verdict::Good, ["is up", ""]);
        expect(
            &found,
            "bus queue",
            Verdict::Doubtful,
            ["10 frames", "1000"],
        );
        let says = ["since it is up: rx_errors 3", "60 Ω"];
        expect(&found, "bus counters", Verdict::Doubtful, says);
        let long = [
            ("type", "280"),
            ("flags", "0x400c1"),
            ("tx_queue_len", "1000"),
        ];
        assert_eq!(interface(&long).len(), 1);
    }

    #[test]
    fn a_line_that_is_missing_or_slow_is_told() {
        let timer = "sys/bus/usb-serial/devices/ttyUSB7/latency_timer";
        let (folder, host) = host(&[(timer, "16\n"), ("dev/ttyUSB7", "")]);
        let path = folder.path().join("dev/ttyUSB7");
        let found = line_checks(&host, "laser", &path);
        expect(&found, "laser", Verdict::Good, ["can be opened", ""]);
        expect(
            &found,
            "laser latency",
            Verdict::Doubtful,
            ["16 ms", "tee /sys/bus"],
        );
        let found = line_checks(&host, "laser", &path.with_file_name("ttyUSB8"));
        expect(&found, "laser", Verdict::Bad, ["is not there", "by-id"]);
    }

    #[test]
    fn one_adapter_is_not_two() {
        let line = |path: &str| Endpoint::Serial(path.into());
        let endpoints = [("laser", line("/dev/null")), ("amps", line("/dev/null"))];
        let endpoints = endpoints.map(|(name, it)| (name.to_owned(), it));
        let found = shared(&endpoints.into());
        expect(
            &found,
            "laser",
            Verdict::Bad,
            ["/dev/null, and so is amps", "its own"],
        );
    }
}
