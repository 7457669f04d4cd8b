//! Homing on a limit switch and where the axis stands.

use super::{Bench, Cia402DriveConfig};

const DONE: u16 = 0x1637;
const FAILED: u16 = 0x2637;

fn ready(method: i8, offset: i32) -> Bench {
    ready_on(Bench::new(), method, offset)
}

/// With an index wired, and a mark every 100 000 counts from 50 000 on.
fn ready_with_index(method: i8, offset: i32) -> Bench {
    let config = Cia402DriveConfig {
        has_index: true,
        homing_search_limit_mm: 20.0,
        ..Cia402DriveConfig::default()
    };
    ready_on(Bench::with(config), method, offset)
}

fn ready_on(mut bench: Bench, method: i8, offset: i32) -> Bench {
    bench.write(0x6060, &[6]);
    bench.write(0x6098, &method.to_le_bytes());
    bench.write_i32(0x607C, offset);
    let _ = bench.wait_ms(5);
    for controlword in [0x06, 0x07, 0x0F] {
        bench.control(controlword);
        let _ = bench.wait_ms(5);
    }
    bench
}

#[test]
fn method_37_makes_the_present_position_the_offset() {
    let mut bench = ready(37, -123_456);
    bench.control(0x1F);
    bench.check_status(DONE);
    assert_eq!(bench.position(), -123_456);
    assert_eq!(bench.axis.counts, 0, "nothing moved");
    let _ = bench.wait_ms(100);
    assert_eq!(bench.axis.counts, 0);
}

#[test]
fn method_17_finds_the_edge_of_the_negative_switch() {
    let mut bench = ready(17, 1000);
    bench.axis.switches = (-200_000, i64::MAX);
    bench.control(0x1F);
    bench.check_status(0x0237);
    bench.wait_until("homing done", |bench| bench.status() == DONE);
    // At 0.5 mm/s the switch is seen at most one servo period late: 50 counts.
    let home = bench.axis.counts - i64::from(bench.position()) + 1000;
    assert!((-200_000..=-199_940).contains(&home), "home at {home}");
}

#[test]
fn started_on_the_switch_it_only_backs_off() {
    let mut bench = ready(17, 0);
    bench.axis.switches = (3_000, i64::MAX);
    bench.control(0x1F);
    bench.wait_until("homing done", |bench| bench.status() == DONE);
    let home = bench.axis.counts - i64::from(bench.position());
    assert!((3_000..=3_060).contains(&home), "home at {home}");
}

#[test]
fn method_18_mirrors_it() {
    let mut bench = ready(18, 0);
    bench.axis.switches = (i64::MIN, 100_000);
    bench.control(0x1F);
    bench.wait_until("homing done", |bench| bench.status() == DONE);
    let home = bench.axis.counts - i64::from(bench.position());
    assert!((99_940..=100_000).contains(&home), "home at {home}");
}

#[track_caller]
fn check_index(method: i8, switches: (i64, i64), home: i64) {
    let mut bench = ready_with_index(method, 700);
    bench.axis.switches = switches;
    bench.control(0x1F);
    bench.wait_until("homing done", |bench| bench.status() == DONE);
    let found = bench.axis.counts - i64::from(bench.position()) + 700;
    assert_eq!(found, home, "to the count, whatever the speed");
}

#[test]
fn an_index_pulse_off_the_switch_is_a_home_to_the_count() {
    check_index(1, (-223_456, i64::MAX), -150_000);
    check_index(2, (i64::MIN, 223_456), 150_000);
    check_index(33, (i64::MIN, i64::MAX), -50_000);
    check_index(34, (i64::MIN, i64::MAX), 50_000);
}

#[test]
fn a_pulse_passed_on_the_way_to_the_switch_is_not_the_home() {
    // The marks at -50 000 and -150 000 are passed twice; the first one after the edge counts.
    check_index(1, (-250_000, i64::MAX), -150_000);
}

#[test]
fn an_index_that_never_comes_is_a_homing_error() {
    let mut bench = ready_with_index(1, 0);
    bench.axis.switches = (-1_000, i64::MAX);
    bench.control(0x1F);
    let _ = bench.wait_ms(500);
    bench.axis.switches = (-1_000, 20_000);
    bench.wait_until("homing error", |bench| bench.status() == FAILED);
}

#[test]
fn no_switch_within_the_search_limit_is_a_homing_error() {
    let mut bench = ready(17, 0);
    bench.drive.config.homing_search_limit_mm = 5.0;
    bench.control(0x1F);
    bench.wait_until("homing error", |bench| bench.status() & 0x3400 == 0x2000);
    bench.wait_until("standstill", |bench| bench.status() == FAILED);
    assert!(bench.axis.counts < -500_000);
}

#[test]
fn the_wrong_switch_is_a_homing_error() {
    let mut bench = ready(17, 0);
    bench.axis.switches = (i64::MIN, i64::MAX);
    bench.control(0x1F);
    let _ = bench.wait_ms(1500);
    bench.axis.switches = (i64::MIN, i64::MIN);
    bench.wait_until("homing error", |bench| bench.status() == FAILED);
}

#[test]
fn both_switches_at_once_are_a_homing_error() {
    let mut bench = ready(17, 0);
    bench.control(0x1F);
    let _ = bench.wait_ms(50);
    bench.axis.switches = (i64::MAX, i64::MIN);
    bench.wait_until("homing error", |bench| bench.status() == FAILED);
}

#[test]
fn dropping_the_start_bit_interrupts() {
    let mut bench = ready(17, 0);
    bench.control(0x1F);
    let _ = bench.wait_ms(100);
    bench.control(0x0F);
    bench.check_status(0x0637);
    let _ = bench.wait_ms(100);
    let stopped = bench.axis.counts;
    let _ = bench.wait_ms(100);
    assert_eq!(bench.axis.counts, stopped);
}

#[test]
fn homing_attained_is_forgotten_with_the_mode_but_the_zero_is_not() {
    let mut bench = ready(37, 777);
    bench.control(0x1F);
    bench.write(0x6060, &[1]);
    let _ = bench.wait_ms(5);
    bench.write(0x6060, &[6]);
    let _ = bench.wait_ms(5);
    bench.check_status(0x0637);
    assert_eq!(bench.position(), 777);
}

#[test]
fn an_unknown_method_is_refused_when_written() {
    let mut bench = Bench::new();
    let refused = bench.try_write(0x6098, 0, &[1]);
    assert_eq!(refused, Err(super::AbortCode::InvalidValue));
}

#[test]
fn the_zero_is_lost_with_the_power_and_with_a_reset() {
    let mut bench = ready(37, 777);
    bench.control(0x1F);
    bench.axis.counts = 5_000;
    let _ = bench.send(0, &[0x81, 1]);
    assert_eq!(bench.wait_ms(200), ["701#00"]);
    assert_eq!(bench.position(), 0, "the counter starts again");
    bench.check_status(0x0250);
    let now = bench.now;
    bench.drive.power_off(&mut bench.axis);
    assert_eq!(bench.drive.next_event(), units::Time::NEVER);
    assert!(
        bench
            .send(0x601, &[0x40, 0, 0x10, 0, 0, 0, 0, 0])
            .is_empty()
    );
    bench.axis.counts = 123;
    bench.drive.power_on(now, &mut bench.axis);
    assert_eq!(bench.wait_ms(200), ["701#00"]);
    assert_eq!(bench.position(), 0);
}
