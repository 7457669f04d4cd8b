//! Profile position: the set-point handshake, limits, halt.

use super::Bench;
use crate::node::cia402_drive::Cia402DriveConfig;

const REACHED: u16 = 1 << 10;
const LIMIT: u16 = 1 << 11;
const ACKNOWLEDGED: u16 = 1 << 12;

#[track_caller]
fn check_bits(bench: &mut Bench, mask: u16, expected: u16) {
    let status = bench.status();
    assert_eq!(status & mask, expected, "statusword {status:#06X}");
}

fn wait_for_target(bench: &mut Bench) {
    bench.wait_until("target reached", |bench| bench.status() & REACHED != 0);
}

#[test]
fn the_handshake_acknowledges_moves_and_reaches() {
    let mut bench = Bench::new();
    bench.enable();
    check_bits(&mut bench, REACHED, REACHED);
    bench.write_i32(0x607A, 1_000_000);
    bench.control(0x1F);
    check_bits(&mut bench, REACHED | ACKNOWLEDGED, ACKNOWLEDGED);
    let _ = bench.wait_ms(30);
    check_bits(&mut bench, ACKNOWLEDGED, ACKNOWLEDGED);
    bench.control(0x0F);
    check_bits(&mut bench, ACKNOWLEDGED, 0);
    wait_for_target(&mut bench);
    assert_eq!(bench.position(), 1_000_000);
    assert_eq!(bench.read(0x60F4), 0);
}

/// 10 mm at 20 mm/s and 200 mm/s²: 0.1 + 0.4 + 0.1 s, then 10 ms in the window.
#[test]
fn a_move_takes_the_profiles_time() {
    let mut bench = Bench::new();
    bench.enable();
    bench.set_point(1_000_000, 0);
    let took = bench.wait_until("target reached", |bench| bench.status() & REACHED != 0);
    assert!((608..=614).contains(&took.as_millis()), "{took:?}");
}

#[test]
fn a_second_set_point_waits_and_keeps_bit_12() {
    let mut bench = Bench::new();
    bench.enable();
    bench.set_point(100_000, 0);
    bench.set_point(200_000, 0);
    bench.control(0x0F);
    check_bits(&mut bench, ACKNOWLEDGED, ACKNOWLEDGED);
    bench.set_point(900_000, 0);
    bench.control(0x0F);
    bench.wait_until("the buffer is free", |bench| {
        bench.status() & ACKNOWLEDGED == 0
    });
    assert_eq!(
        bench.position(),
        100_000,
        "the second starts where the first ended"
    );
    wait_for_target(&mut bench);
    assert_eq!(bench.position(), 200_000, "the third found the buffer full");
}

#[test]
fn change_immediately_replaces_what_runs_and_what_waits() {
    let mut bench = Bench::new();
    bench.enable();
    bench.set_point(1_000_000, 0);
    bench.set_point(2_000_000, 0);
    let _ = bench.wait_ms(200);
    bench.set_point(-50_000, 0x20);
    wait_for_target(&mut bench);
    assert_eq!(bench.position(), -50_000);
}

#[test]
fn relative_targets_count_from_the_last_target() {
    let mut bench = Bench::new();
    bench.enable();
    bench.set_point(100_000, 0);
    let _ = bench.wait_ms(5);
    bench.set_point(-30_000, 0x40);
    bench.control(0x0F);
    wait_for_target(&mut bench);
    assert_eq!(bench.position(), 70_000);
}

#[test]
fn an_identical_target_is_acknowledged_and_reached_again() {
    let mut bench = Bench::new();
    bench.enable();
    bench.set_point(0, 0);
    check_bits(&mut bench, REACHED | ACKNOWLEDGED, ACKNOWLEDGED);
    wait_for_target(&mut bench);
    bench.drive.config.quirks.identical_target_ignored = true;
    bench.set_point(0, 0);
    check_bits(&mut bench, REACHED | ACKNOWLEDGED, REACHED);
    assert!(bench.delivered("identical_target_ignored"));
}

#[test]
fn halt_stops_and_releasing_it_goes_on() {
    let mut bench = Bench::new();
    bench.enable();
    bench.set_point(1_000_000, 0);
    let _ = bench.wait_ms(200);
    bench.control(0x010F);
    check_bits(&mut bench, REACHED, 0);
    let _ = bench.wait_ms(110);
    check_bits(&mut bench, REACHED, REACHED);
    let halted = bench.position();
    assert!(halted < 1_000_000);
    let _ = bench.wait_ms(100);
    assert_eq!(bench.position(), halted);
    bench.control(0x0F);
    let _ = bench.wait_ms(5);
    wait_for_target(&mut bench);
    assert_eq!(bench.position(), 1_000_000);
}

#[test]
fn a_new_immediate_target_supersedes_a_halted_one() {
    let mut bench = Bench::new();
    bench.enable();
    bench.set_point(1_000_000, 0);
    let _ = bench.wait_ms(200);
    bench.control(0x010F);
    let _ = bench.wait_ms(200);
    bench.set_point(0, 0x20);
    wait_for_target(&mut bench);
    assert_eq!(bench.position(), 0);
}

#[test]
fn soft_limits_clip_once_the_axis_is_homed() {
    let mut bench = Bench::new();
    bench
        .try_write(0x607D, 2, &50_000_i32.to_le_bytes())
        .unwrap();
    bench.enable();
    bench.set_point(60_000, 0);
    check_bits(&mut bench, LIMIT, 0);
    wait_for_target(&mut bench);
    bench.write(0x6060, &[6]);
    bench.write(0x6098, &[37]);
    let _ = bench.wait_ms(5);
    bench.control(0x0F);
    bench.control(0x1F);
    bench.write(0x6060, &[1]);
    let _ = bench.wait_ms(5);
    bench.set_point(60_000, 0);
    check_bits(&mut bench, LIMIT, LIMIT);
    wait_for_target(&mut bench);
    assert_eq!(bench.position(), 50_000);
    bench.set_point(10_000, 0);
    check_bits(&mut bench, LIMIT, 0);
}

#[test]
fn a_limit_switch_stops_an_outward_move_and_lets_an_inward_one_pass() {
    let mut bench = Bench::new();
    bench.axis.switches = (i64::MIN, 300_000);
    bench.enable();
    let _ = bench.sent();
    bench.set_point(1_000_000, 0);
    let sent = bench.wait_ms(400);
    assert!(
        sent.contains(&"081#10FF810100000000".to_owned()),
        "{sent:?}"
    );
    check_bits(&mut bench, REACHED | LIMIT, LIMIT);
    assert_eq!(bench.read(0x60FD), 2);
    let stopped = bench.position();
    assert!((300_000..320_000).contains(&stopped), "{stopped}");
    bench.set_point(1_000_000, 0);
    let _ = bench.wait_ms(100);
    assert_eq!(bench.position(), stopped, "farther out is refused");
    bench.control(0x0F);
    bench.set_point(0, 0);
    wait_for_target(&mut bench);
    assert_eq!(bench.position(), 0);
    check_bits(&mut bench, LIMIT, 0);
}

#[test]
fn a_target_that_is_never_reached_is_a_quirk() {
    let mut bench = Bench::new();
    bench.enable();
    bench.drive.config.quirks.target_never_reached = true;
    bench.set_point(100, 0);
    let _ = bench.wait_ms(1000);
    check_bits(&mut bench, REACHED, 0);
    assert_eq!(bench.position(), 100);
    assert!(bench.delivered("target_never_reached"));
}

#[test]
fn positions_wrap_at_32_bits_and_targets_mean_the_present_turn() {
    let mut bench = Bench::new();
    bench.drive.offset = i64::from(i32::MAX) - 10;
    bench.enable();
    assert_eq!(bench.position(), i32::MAX - 10);
    bench.set_point(100, 0x40);
    wait_for_target(&mut bench);
    assert_eq!(bench.position(), i32::MIN + 89);
    bench.control(0x0F);
    bench.set_point(i32::MIN, 0);
    wait_for_target(&mut bench);
    assert_eq!(bench.axis.counts, 11);
}

#[test]
fn inverted_polarity_counts_the_other_way() {
    let mut bench = Bench::new();
    bench.write(0x607E, &[0x80]);
    bench.enable();
    bench.set_point(5_000, 0);
    wait_for_target(&mut bench);
    assert_eq!(bench.axis.counts, -5_000);
    assert_eq!(bench.position(), 5_000);
}

#[test]
fn a_motor_wired_the_wrong_way_runs_away_into_the_following_error() {
    let mut bench = Bench::with(Cia402DriveConfig::default());
    bench.drive.config.quirks.direction_reversed = true;
    bench.enable();
    assert!(!bench.delivered("direction_reversed"), "it stands");
    bench.set_point(5_000_000, 0);
    let sent = bench.wait_ms(500);
    assert!(bench.delivered("direction_reversed"));
    assert!(
        sent.iter().any(|frame| frame.starts_with("081#1186")),
        "{sent:?}"
    );
    assert!(bench.axis.counts < -20_000);
}

#[test]
fn the_target_comes_with_the_controlword_in_one_pdo() {
    let mut bench = Bench::new();
    bench.enable();
    let _ = bench.send(0, &[0x80, 1]);
    bench
        .try_write(0x1402, 1, &0x401_u32.to_le_bytes())
        .unwrap();
    let _ = bench.send(0, &[1, 1]);
    let _ = bench.send(0x401, &[0x1F, 0x00, 0x40, 0x42, 0x0F, 0x00]);
    wait_for_target(&mut bench);
    assert_eq!(bench.position(), 1_000_000);
}
