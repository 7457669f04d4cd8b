//! Real terminals; every wait is for an event, with a bound that only a broken run reaches.

use super::*;
use crate::fault::Fault;
use std::fs::File;
use std::io::Read;
use std::os::fd::AsFd;
use std::path::Path;
use std::time::Duration;

use nix::poll::{PollFd, PollFlags, PollTimeout, poll};

const MACHINE: &str = r#"
    name = "test"
    [[ports]]
    kind = "can"
    name = "can0"
    bitrate_kbit_per_s = 1000
    [[ports]]
    kind = "serial"
    name = "laser"
    [[ports]]
    kind = "serial"
    name = "adc"
    baud_bit_per_s = 9600
    [[nodes]]
    name = "laser"
    port = "laser"
    device = { kind = "umd2_interferometer", boot_ms = 1.0 }
    [[nodes]]
    name = "adc"
    port = "adc"
    device = { kind = "dcon_module", checksum = false, boot_ms = 0.0 }
"#;

fn machine() -> Running {
    spawn_on_ptys(&MachineConfig::parse(MACHINE).unwrap(), 1, 5.0).unwrap()
}

fn open(path: &Path) -> File {
    File::options().read(true).write(true).open(path).unwrap()
}

/// Reads until `end` or, in a broken run, for ten seconds; `None` when the line hangs up.
fn read_until(file: &mut File, end: u8) -> Option<String> {
    let mut text = Vec::new();
    while text.last() != Some(&end) {
        let mut fds = [PollFd::new(file.as_fd(), PollFlags::POLLIN)];
        let ready = poll(
            &mut fds,
            PollTimeout::try_from(Duration::from_secs(10)).unwrap(),
        );
        assert_eq!(ready, Ok(1), "nothing came after {text:?}");
        let mut byte = [0];
        if file.read(&mut byte).unwrap_or(0) == 0 {
            return None;
        }
        text.push(byte[0]);
    }
    Some(String::from_utf8_lossy(&text).into_owned())
}

#[test]
fn an_analog_module_answers_on_its_terminal() {
    let machine = machine();
    let mut adc = open(&machine.ports()[2]);
    adc.write_all(b"$01M\r").unwrap();
    assert_eq!(read_until(&mut adc, b'\r').unwrap(), "!014117\r");
    drop(adc);
    let mut again = open(&machine.ports()[2]);
    again.write_all(b"$01F\r").unwrap();
    assert_eq!(read_until(&mut again, b'\r').unwrap(), "!01A1.06\r");
    machine.stop().unwrap();
}

#[test]
fn an_interferometer_streams_to_its_terminal() {
    let machine = machine();
    let mut laser = open(&machine.ports()[1]);
    for _ in 0..50 {
        read_until(&mut laser, b'\n').unwrap();
    }
    let line = read_until(&mut laser, b'\n').unwrap();
    assert!(wire::umd2::Line::parse(line.trim_end()).is_ok(), "{line}");
}

#[test]
fn a_bus_without_a_kernel_is_reached_through_an_adapter() {
    let machine = machine();
    let mut can = open(&machine.ports()[0]);
    can.write_all(b"C\rS8\rO\rV\r").unwrap();
    // The closed adapter refuses to close, takes rate and opening, and says its version.
    let replies = read_until(&mut can, b'3').unwrap();
    assert_eq!(replies, "\x07\r\rV1013");
    read_until(&mut can, b'\r').unwrap();
    let fault = Fault::DuplicateBootUp {
        port: "can0".into(),
        node_id: 5,
    };
    let id = machine.inject(FaultConfig::permanent(fault)).unwrap();
    assert_eq!(read_until(&mut can, b'\r').unwrap(), "t705100\r");
    assert_eq!(machine.fault_deliveries(id).unwrap(), 1);
}

#[test]
fn an_adapter_that_is_pulled_out_hangs_up_and_comes_back_at_its_link() {
    let directory = std::env::temp_dir().join(format!("mock-bus-test-{}", std::process::id()));
    std::fs::create_dir_all(&directory).unwrap();
    let link = directory.join("adc");
    let options = Options {
        links: [("adc".to_owned(), link.clone())].into(),
        ..Options::default()
    };
    let machine = spawn(&MachineConfig::parse(MACHINE).unwrap(), &options).unwrap();
    let mut adc = open(&link);
    let gone = Fault::LinkGone { port: "adc".into() };
    let id = machine.inject(FaultConfig::permanent(gone)).unwrap();
    assert_eq!(read_until(&mut adc, b'\r'), None);
    machine.end_fault(id).unwrap();
    while machine.with(|machine| machine.link(wire::Port(2))).unwrap()
        != Some(crate::simulation::Link::Up)
    {}
    // The link is there as soon as the loop has handed the change out: before the next job.
    machine.with(|_| ()).unwrap();
    let mut adc = open(&link);
    adc.write_all(b"$01M\r").unwrap();
    assert_eq!(read_until(&mut adc, b'\r').unwrap(), "!014117\r");
    machine.stop().unwrap();
    assert!(!link.is_symlink());
    std::fs::remove_dir(&directory).unwrap();
}

#[test]
fn a_speed_of_nothing_is_refused() {
    let config = MachineConfig::parse(MACHINE).unwrap();
    let refused = spawn_on_ptys(&config, 1, 0.0);
    assert!(matches!(refused, Err(RunError::Speed { .. })));
}

#[test]
fn the_linear_machines_drive_says_what_it_is_through_the_adapter() {
    let text = include_str!("../../../configs/emulated/linear.toml");
    let machine = spawn_on_ptys(&MachineConfig::parse(text).unwrap(), 1, 10.0).unwrap();
    let mut can = open(&machine.ports()[0]);
    can.write_all(b"C\rS8\rO\r").unwrap();
    machine.power_cycle(HallDrift::default()).unwrap();
    while !read_until(&mut can, b'\r').unwrap().ends_with("t701100\r") {}
    // SDO upload of 0x1000: the answer is device type 402 with servo drive.
    can.write_all(b"t60184000100000000000\r").unwrap();
    let mut line = read_until(&mut can, b'\r').unwrap();
    while !line.starts_with("t581") {
        line = read_until(&mut can, b'\r').unwrap();
    }
    assert_eq!(line, "t58184300100092010200\r");
}
