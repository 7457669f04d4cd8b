//! Following error, safe torque off, lost master, internal errors.

use wire::canopen::emcy::EmergencyCode;

use super::Bench;
use crate::plant::Servo;

#[track_caller]
fn check_emergency(sent: &[String], start: &str) {
    assert!(
        sent.iter().any(|frame| frame.starts_with(start)),
        "{start} in {sent:?}"
    );
}

/// Faulhaber's frame of the same error begins with the same bytes: 11 86 20 (generic bit 0
/// is set here as CiA 301 demands).
#[test]
fn a_blocked_axis_faults_with_a_following_error() {
    let mut bench = Bench::new();
    bench.enable();
    bench.axis.blocked = true;
    bench.set_point(10_000_000, 0);
    let sent = bench.wait_ms(200);
    check_emergency(&sent, "081#118621");
    bench.check_status(0x0218);
    assert_eq!(bench.read(0x603F), 0x8611);
    assert_eq!(bench.read(0x1001), 0x21);
    assert_eq!(bench.axis.servo, Servo::Off);
}

#[test]
fn the_fault_reaction_is_seen_before_the_fault() {
    let mut bench = Bench::new();
    bench.enable();
    bench.axis.blocked = true;
    bench.set_point(10_000_000, 0);
    bench.wait_until("reaction", |bench| bench.status() & 0x4F == 0x0F);
    bench.wait_until("fault", |bench| bench.status() & 0x4F == 0x08);
}

#[test]
fn a_window_that_is_switched_off_never_faults() {
    let mut bench = Bench::new();
    bench.write(0x6065, &[0xFF; 4]);
    bench.enable();
    bench.axis.blocked = true;
    bench.set_point(10_000_000, 0);
    let _ = bench.wait_ms(6000);
    assert_eq!(bench.status() & 0x4F, 0x07);
    assert_eq!(bench.read(0x60F4), 10_000_000);
}

#[test]
fn a_fault_is_reset_by_an_edge_only() {
    let mut bench = Bench::new();
    bench.enable();
    bench.control(0x8F);
    bench.axis.blocked = true;
    bench.set_point(10_000_000, 0x80);
    bench.control(0x8F);
    let _ = bench.wait_ms(200);
    bench.check_status(0x0218);
    bench.control(0x80);
    bench.check_status(0x0218);
    bench.control(0x00);
    bench.control(0x80);
    bench.check_status(0x0250);
    assert_eq!(bench.read(0x603F), 0);
    assert_eq!(bench.read(0x1001), 0);
}

#[test]
fn safe_torque_off_faults_an_enabled_drive_and_cannot_be_reset_while_open() {
    let mut bench = Bench::new();
    bench.enable();
    bench.set_point(1_000_000, 0);
    let _ = bench.wait_ms(100);
    bench.drive.safe_torque_off = true;
    bench.drive.look_now();
    let sent = bench.wait_ms(1);
    check_emergency(&sent, "081#01FF81");
    bench.check_status(0x0218);
    assert_eq!(bench.axis.servo, Servo::Off);
    bench.control(0x00);
    bench.control(0x80);
    bench.check_status(0x0218);
    bench.drive.safe_torque_off = false;
    bench.drive.look_now();
    let _ = bench.wait_ms(1);
    bench.check_status(0x0218);
    bench.control(0x00);
    bench.control(0x80);
    bench.check_status(0x0250);
}

#[test]
fn safe_torque_off_keeps_a_drive_from_getting_ready() {
    let mut bench = Bench::new();
    bench.control(0x06);
    bench.drive.safe_torque_off = true;
    bench.drive.look_now();
    let sent = bench.wait_ms(5);
    check_emergency(&sent, "081#01FF");
    bench.check_status(0x0250);
    bench.control(0x06);
    let _ = bench.wait_ms(5);
    bench.check_status(0x0250);
    bench.drive.safe_torque_off = false;
    bench.drive.look_now();
    check_emergency(&bench.wait_ms(5), "081#0000");
    bench.control(0x06);
    let _ = bench.wait_ms(5);
    bench.check_status(0x0231);
}

#[track_caller]
fn check_lost_master(option: i16, status: u16) {
    let mut bench = Bench::new();
    bench.write(0x6007, &option.to_le_bytes());
    bench.watch_master();
    bench.enable();
    bench.set_point(10_000_000, 0);
    let _ = bench.send(0x77F, &[5]);
    let before = bench.wait_ms(149);
    assert!(before.iter().all(|frame| !frame.starts_with("081")));
    check_emergency(&bench.wait_ms(1), "081#3081117F");
    let _ = bench.wait_ms(50);
    bench.check_status(status);
    let stopped = bench.axis.counts;
    let _ = bench.wait_ms(500);
    let still = bench.axis.counts == stopped;
    assert_eq!(still, option != 0, "only option 0 goes on");
}

#[test]
fn a_lost_master_stops_the_drive_as_6007_says() {
    check_lost_master(0, 0x1237);
    check_lost_master(1, 0x0218);
    check_lost_master(2, 0x0250);
    check_lost_master(3, 0x0617);
}

#[test]
fn after_the_loss_the_old_controlword_starts_nothing() {
    let mut bench = Bench::new();
    bench.watch_master();
    bench.enable();
    let _ = bench.wait_ms(500);
    bench.check_status(0x0617);
    let _ = bench.send(0x77F, &[5]);
    let _ = bench.wait_ms(100);
    bench.check_status(0x0617);
    let _ = bench.send(0x77F, &[5]);
    bench.control(0x0F);
    let _ = bench.wait_ms(20);
    bench.check_status(0x0637);
}

#[track_caller]
fn check_command_stops(command: u8) {
    let mut bench = Bench::new();
    bench.enable();
    bench.set_point(10_000_000, 0);
    let _ = bench.wait_ms(200);
    let _ = bench.send(0, &[command, 1]);
    let _ = bench.wait_ms(50);
    let stopped = bench.axis.counts;
    let _ = bench.wait_ms(500);
    assert_eq!(bench.axis.counts, stopped);
}

#[test]
fn stopping_or_resetting_the_node_stops_the_motion() {
    check_command_stops(0x02);
    check_command_stops(0x81);
    check_command_stops(0x82);
}

#[test]
fn an_internal_error_is_a_fault_until_its_cause_is_gone() {
    let mut bench = Bench::new();
    bench.enable();
    bench.drive.internal_error = Some(EmergencyCode(0x4310));
    bench.drive.look_now();
    check_emergency(&bench.wait_ms(5), "081#104321");
    bench.check_status(0x0218);
    bench.control(0x80);
    bench.check_status(0x0218);
    bench.drive.internal_error = None;
    bench.control(0x00);
    bench.control(0x80);
    bench.check_status(0x0250);
    let (newest, _) = (bench.drive.server.get(0x1003, 1), 0);
    assert_eq!(newest, 0x4310);
}

#[test]
fn power_loss_while_moving_leaves_no_torque() {
    let mut bench = Bench::new();
    bench.enable();
    bench.set_point(10_000_000, 0);
    let _ = bench.wait_ms(200);
    bench.drive.power_off(&mut bench.axis);
    assert_eq!(bench.axis.servo, Servo::Off);
    assert!(bench.wait_ms(1000).is_empty());
}

#[test]
fn a_reset_that_is_ignored_is_counted_as_delivered() {
    let mut bench = Bench::new();
    bench.enable();
    bench.axis.blocked = true;
    bench.set_point(10_000_000, 0);
    let _ = bench.wait_ms(200);
    bench.check_status(0x0218);
    bench.drive.config.quirks.fault_reset_ignored = true;
    assert!(!bench.delivered("fault_reset_ignored"), "nobody has asked");
    bench.control(0x00);
    bench.control(0x80);
    bench.check_status(0x0218);
    assert!(bench.delivered("fault_reset_ignored"));
}
