//! Each quirk does what real drives do, and is counted where it made a difference.

use super::{AbortCode, Bench, Cia402DriveConfig};
use crate::node::canopen_server::{ChangedWrite, Manners, NamedObject};
use crate::node::cia402_drive::{DriveQuirks, Homings, RpdoDeadline, UnitObjects};
use crate::plant::Servo;

/// Statuswords without and with the bits 10, 12 and both, operation enabled.
const PLAIN: u16 = 0x0237;
const ATTAINED: u16 = 0x1237;
const DONE: u16 = 0x1637;

fn quirky(change: impl FnOnce(&mut DriveQuirks)) -> Bench {
    let mut config = Cia402DriveConfig::default();
    change(&mut config.quirks);
    Bench::with(config)
}

fn rude(change: impl FnOnce(&mut Manners)) -> Bench {
    let mut config = Cia402DriveConfig::default();
    change(&mut config.manners);
    Bench::with(config)
}

/// Enables without a look at the statusword.
fn switch_on(bench: &mut Bench) {
    for controlword in [0x06, 0x07, 0x0F] {
        bench.control(controlword);
        let _ = bench.wait_ms(5);
    }
}

fn enter_homing(bench: &mut Bench, method: i8) {
    bench.write(0x6060, &[6]);
    bench.write(0x6098, &method.to_le_bytes());
    let _ = bench.wait_ms(5);
}

/// Enabled in homing mode, towards a switch 2 mm away.
fn ready_to_search(bench: &mut Bench) {
    bench.axis.switches = (-200_000, i64::MAX);
    enter_homing(bench, 17);
    switch_on(bench);
}

#[track_caller]
fn check_delivered(bench: &Bench, key: &str) {
    assert!(bench.delivered(key), "{key} was not delivered");
}

#[test]
fn bits_of_the_homing_before_stay() {
    let mut bench = quirky(|quirks| quirks.stale_homing_ms = 80);
    ready_to_search(&mut bench);
    bench.check_status(0x0637);
    bench.control(0x1F);
    bench.check_status(PLAIN);
    bench.wait_until("the first homing", |bench| bench.status() == DONE);
    assert!(
        !bench.delivered("stale_homing_ms"),
        "none was attained before"
    );
    bench.axis.switches = (-2_000_000, i64::MAX);
    bench.control(0x0F);
    bench.control(0x1F);
    bench.check_status(DONE);
    let _ = bench.wait_ms(79);
    bench.check_status(DONE);
    let _ = bench.wait_ms(2);
    bench.check_status(PLAIN);
    check_delivered(&bench, "stale_homing_ms");
    let homings = Homings {
        begun: 2,
        attained: 1,
    };
    assert_eq!(bench.drive.homings, homings);
}

#[test]
fn bits_of_a_homing_stay_over_a_power_cycle() {
    let mut bench = quirky(|quirks| {
        quirks.stale_homing_ms = 80;
        quirks.stale_homing_from_power_on = true;
    });
    ready_to_search(&mut bench);
    bench.check_status(DONE);
    bench.control(0x1F);
    bench.check_status(DONE);
    let _ = bench.wait_ms(81);
    bench.check_status(PLAIN);
}

#[test]
fn a_homing_ends_without_target_reached() {
    let mut bench = quirky(|quirks| quirks.homing_ends_without_bit_10 = true);
    enter_homing(&mut bench, 37);
    switch_on(&mut bench);
    bench.control(0x1F);
    bench.check_status(ATTAINED);
    check_delivered(&bench, "homing_ends_without_bit_10");
}

#[test]
fn attained_sticks_in_homing_mode_only() {
    let mut bench = quirky(|quirks| quirks.homing_attained_stuck = true);
    bench.enable();
    ready_to_search(&mut bench);
    bench.check_status(DONE);
    bench.control(0x1F);
    bench.check_status(DONE);
    assert_eq!(bench.drive.homings.attained, 0);
    check_delivered(&bench, "homing_attained_stuck");
}

#[test]
fn a_mode_has_no_effect_while_off() {
    let mut bench = quirky(|quirks| quirks.mode_ignored_while_off = true);
    enter_homing(&mut bench, 37);
    assert_eq!(bench.read(0x6061), 1);
    check_delivered(&bench, "mode_ignored_while_off");
    switch_on(&mut bench);
    enter_homing(&mut bench, 37);
    assert_eq!(bench.read(0x6061), 6);
}

#[test]
fn a_mode_display_that_sticks_hides_the_mode() {
    let mut bench = quirky(|quirks| quirks.mode_display_stuck = Some(3));
    assert_eq!(bench.read(0x6061), 3);
    bench.enable();
    bench.set_point(100_000, 0);
    let _ = bench.wait_ms(1000);
    assert_eq!(bench.position(), 100_000, "it is in profile position");
    check_delivered(&bench, "mode_display_stuck");
}

#[test]
fn velocity_left_over_runs_the_axis_off() {
    let mut bench = quirky(|quirks| {
        quirks.left_mode = Some(3);
        quirks.left_velocity = 100_000;
        quirks.mode_ignored_while_off = true;
    });
    bench.write(0x6060, &[1]);
    let _ = bench.wait_ms(5);
    assert_eq!(bench.read(0x6061), 3);
    switch_on(&mut bench);
    let _ = bench.wait_ms(1000);
    assert!(bench.axis.counts > 90_000, "{}", bench.axis.counts);
    check_delivered(&bench, "left_mode");
    check_delivered(&bench, "left_velocity");
    bench.control(0x010F);
    let _ = bench.wait_ms(200);
    let halted = bench.axis.counts;
    let _ = bench.wait_ms(200);
    assert_eq!(bench.axis.counts, halted);
    bench.control(0x000F);
    let _ = bench.wait_ms(200);
    assert!(bench.axis.counts > halted);
    bench.write(0x6060, &[1]);
    let _ = bench.wait_ms(300);
    let stopped = bench.axis.counts;
    let _ = bench.wait_ms(200);
    assert_eq!(bench.axis.counts, stopped);
}

/// RPDO 2 as the controlword and the target, in this order of mapping.
fn map_target(bench: &mut Bench, order: [u32; 2]) {
    bench
        .try_write(0x1401, 1, &0x8000_0301_u32.to_le_bytes())
        .unwrap();
    bench.try_write(0x1601, 0, &[0]).unwrap();
    for (sub, entry) in (1..).zip(order) {
        bench.try_write(0x1601, sub, &entry.to_le_bytes()).unwrap();
    }
    bench.try_write(0x1601, 0, &[2]).unwrap();
    bench
        .try_write(0x1401, 1, &0x0301_u32.to_le_bytes())
        .unwrap();
}

const CONTROLWORD: u32 = 0x6040_0010;
const TARGET: u32 = 0x607A_0020;

#[track_caller]
fn check_edge(change: fn(&mut DriveQuirks), order: [u32; 2], expected: i64) {
    let mut bench = quirky(change);
    map_target(&mut bench, order);
    bench.enable();
    bench.write_i32(0x607A, 7000);
    let target = 90_000_i32.to_le_bytes();
    let mut frame = [0x1F, 0x00].to_vec();
    let place = if order[0] == CONTROLWORD { 2 } else { 0 };
    frame.splice(place..place, target);
    let _ = bench.send(0x301, &frame);
    let _ = bench.wait_ms(2000);
    assert_eq!(bench.axis.counts, expected, "{order:X?}");
}

#[test]
fn an_edge_takes_the_target_of_before() {
    let before = |quirks: &mut DriveQuirks| quirks.edge_before_target = true;
    check_edge(|_| {}, [CONTROLWORD, TARGET], 90_000);
    check_edge(before, [CONTROLWORD, TARGET], 7000);
    check_edge(before, [TARGET, CONTROLWORD], 7000);
    let ordered = |quirks: &mut DriveQuirks| quirks.edge_in_mapping_order = true;
    check_edge(ordered, [CONTROLWORD, TARGET], 7000);
    check_edge(ordered, [TARGET, CONTROLWORD], 90_000);
}

#[test]
fn a_slow_drive_is_enabled_after_its_delay() {
    let mut bench = quirky(|quirks| quirks.enable_delay_ms = 4000);
    switch_on(&mut bench);
    let _ = bench.wait_ms(3990);
    bench.check_status(0x0233);
    let _ = bench.wait_ms(10);
    assert_eq!(bench.status() & 0x6F, 0x27);
    check_delivered(&bench, "enable_delay_ms");
    bench.control(0x07);
    let _ = bench.wait_ms(10);
    bench.control(0x0F);
    let _ = bench.wait_ms(3000);
    bench.control(0x07);
    let _ = bench.wait_ms(3000);
    bench.check_status(0x0233);
}

#[test]
fn halt_blocks_modes_and_set_points() {
    let mut bench = quirky(|quirks| {
        quirks.halt_blocks_mode = true;
        quirks.halt_blocks_acknowledge = true;
    });
    bench.enable();
    bench.write_i32(0x607A, 100_000);
    bench.control(0x010F);
    bench.control(0x011F);
    assert_eq!(bench.status() & 0x1000, 0);
    bench.write(0x6060, &[6]);
    let _ = bench.wait_ms(10);
    assert_eq!(bench.read(0x6061), 1);
    bench.control(0x001F);
    let _ = bench.wait_ms(1000);
    assert_eq!(bench.axis.counts, 0, "no edge was left");
    check_delivered(&bench, "halt_blocks_mode");
    check_delivered(&bench, "halt_blocks_acknowledge");
}

#[test]
fn a_lost_heartbeat_faults_a_drive_that_is_off() {
    let mut bench = quirky(|quirks| quirks.faults_on_lost_heartbeat = true);
    bench.watch_master();
    let _ = bench.wait_ms(200);
    bench.check_status(0x0218);
    check_delivered(&bench, "faults_on_lost_heartbeat");
    let reset = |bench: &mut Bench| {
        bench.control(0x00);
        bench.control(0x80);
        bench.status()
    };
    assert_eq!(reset(&mut bench), 0x0218, "no heartbeat");
    let _ = bench.send(0x77F, &[5]);
    assert_eq!(reset(&mut bench), 0x0250);
    let _ = bench.wait_ms(200);
    bench.check_status(0x0218);
    bench.try_write(0x1016, 1, &[0; 4]).unwrap();
    assert_eq!(reset(&mut bench), 0x0250, "no producer is watched");
    let _ = bench.wait_ms(500);
    bench.check_status(0x0250);
}

#[test]
fn a_watch_that_is_set_anew_needs_a_heartbeat() {
    let mut bench = quirky(|quirks| quirks.faults_on_lost_heartbeat = true);
    bench.watch_master();
    let _ = bench.wait_ms(200);
    bench
        .try_write(0x1016, 1, &0x007F_0096_u32.to_le_bytes())
        .unwrap();
    bench.control(0x80);
    bench.check_status(0x0218);
    let _ = bench.send(0x77F, &[5]);
    bench.control(0x00);
    bench.control(0x80);
    bench.check_status(0x0250);
}

#[test]
fn acknowledges_are_inverted_or_never_fall() {
    let mut bench = quirky(|quirks| quirks.acknowledge_inverted = true);
    switch_on(&mut bench);
    assert_eq!(bench.status() & 0x1000, 0x1000);
    bench.set_point(100_000, 0);
    assert_eq!(bench.status() & 0x1000, 0);
    bench.control(0x0F);
    assert_eq!(bench.status() & 0x1000, 0x1000);
    check_delivered(&bench, "acknowledge_inverted");
    let mut bench = quirky(|quirks| quirks.acknowledge_never_falls = true);
    bench.enable();
    assert_eq!(bench.status() & 0x1000, 0);
    bench.set_point(100_000, 0);
    bench.control(0x0F);
    assert_eq!(bench.status() & 0x1000, 0x1000);
    let _ = bench.wait_ms(1000);
    bench.set_point(0, 0);
    let _ = bench.wait_ms(1000);
    assert_eq!(bench.axis.counts, 0, "set-points are taken all the same");
    check_delivered(&bench, "acknowledge_never_falls");
}

#[track_caller]
fn check_late_rpdo(reaction: RpdoDeadline, status: u16) {
    let mut bench = quirky(|quirks| {
        quirks.rpdo_deadline_ms = 50;
        quirks.rpdo_deadline = reaction;
    });
    let _ = bench.send(0x201, &[0x00, 0x00]);
    let _ = bench.wait_ms(100);
    bench.check_status(0x0250);
    bench.enable();
    bench.set_point(10_000_000, 0);
    let _ = bench.send(0x201, &[0x1F, 0x00]);
    let sent = bench.wait_ms(49);
    assert!(
        sent.iter().all(|frame| !frame.starts_with("081")),
        "{sent:?}"
    );
    let sent = bench.wait_ms(100);
    assert!(
        sent.iter().any(|frame| frame.starts_with("081#5082")),
        "{sent:?}"
    );
    bench.check_status(status);
    let counted = bench.delivered("rpdo_deadline");
    assert_eq!(counted, reaction != RpdoDeadline::Ignored);
}

#[test]
fn an_rpdo_that_is_late_stops_or_faults() {
    check_late_rpdo(RpdoDeadline::Ignored, 0x1237);
    check_late_rpdo(RpdoDeadline::QuickStop, 0x0617);
    check_late_rpdo(RpdoDeadline::Fault, 0x0218);
}

#[test]
fn bits_of_its_own_are_in_every_statusword() {
    let mut bench = quirky(|quirks| quirks.statusword_bits = 0xC000);
    bench.check_status(0xC250);
    switch_on(&mut bench);
    assert_eq!(bench.status() & 0xC06F, 0xC027);
    check_delivered(&bench, "statusword_bits");
}

#[test]
fn speeds_have_16_bits() {
    let mut bench = quirky(|quirks| quirks.speeds_of_16_bits = true);
    let long = bench.try_write(0x6081, 0, &[0, 0, 1, 0]);
    assert_eq!(long, Err(AbortCode::LengthTooHigh));
    bench.write(0x6081, &1000_u16.to_le_bytes());
    assert_eq!(bench.read(0x607F), 0xFFFF, "as fast as it can say");
}

/// The time to 1 mm with 0x6081 at `velocity`.
#[track_caller]
fn check_unit(change: fn(&mut DriveQuirks), velocity: u32, expected_ms: u128) {
    let mut bench = quirky(change);
    bench.write(0x6081, &velocity.to_le_bytes());
    bench.enable();
    bench.set_point(100_000, 0);
    let took = bench.wait_until("1 mm", |bench| bench.axis.counts == 100_000);
    let ms = took.as_millis();
    assert!(ms.abs_diff(expected_ms) < 20, "{ms} ms");
}

#[test]
fn speeds_and_accelerations_have_units_of_their_own() {
    // 1 mm/s with a ramp of 200 mm/s².
    check_unit(|_| {}, 100_000, 1005);
    check_unit(|quirks| quirks.speed_unit = Some(10.0), 10_000, 1005);
    check_unit(|quirks| quirks.speed_unit = Some(10.0), 100_000, 150);
    let mut bench = quirky(|quirks| {
        quirks.speed_unit = Some(34.133);
        quirks.acceleration_unit = Some(34.133);
        quirks.unit_objects = UnitObjects {
            si_velocity: Some(0x00B4_4700),
            velocity_factor: Some([1, 60]),
            ..UnitObjects::default()
        };
    });
    assert_eq!(bench.read(0x60A9), 0x00B4_4700);
    assert_eq!(bench.read(0x6083), 585_943, "200 mm/s² in units of 34.133");
    assert_eq!(bench.read(0x6081), 58_594);
    bench.enable();
    bench.set_point(100_000, 0);
    check_delivered(&bench, "speed_unit");
    check_delivered(&bench, "acceleration_unit");
}

#[test]
fn a_unit_that_is_not_named_is_absent() {
    let mut bench = quirky(|quirks| quirks.speed_unit = Some(10.0));
    let command = [0x40, 0xA9, 0x60, 0, 0, 0, 0, 0];
    assert_eq!(bench.send(0x601, &command), ["581#80A9600000000206"]);
}

#[test]
fn homings_are_faster_than_asked_for() {
    let search = |factor: Option<f64>| {
        let mut bench = quirky(|quirks| quirks.homing_speed_factor = factor);
        ready_to_search(&mut bench);
        bench.control(0x1F);
        let _ = bench.wait_ms(150);
        (bench.axis.counts, bench.delivered("homing_speed_factor"))
    };
    let (asked, polite) = search(None);
    let (faster, counted) = search(Some(2.0));
    assert!(!polite && counted);
    assert!(faster < asked * 3 / 2, "{faster} and {asked}");
}

#[test]
fn soft_limits_are_written_upper_one_first() {
    let mut bench = rude(|manners| manners.upper_soft_limit_first = true);
    let lower = |bench: &mut Bench| bench.try_write(0x607D, 1, &[0; 4]);
    assert_eq!(lower(&mut bench), Err(AbortCode::MaximumBelowMinimum));
    bench.try_write(0x607D, 2, &9_i32.to_le_bytes()).unwrap();
    assert_eq!(lower(&mut bench), Ok(()));
    check_delivered(&bench, "upper_soft_limit_first");
}

#[test]
fn written_values_read_back_changed() {
    let mut bench = rude(|manners| {
        manners.changed_writes = vec![ChangedWrite {
            object: NamedObject::whole(0x6085),
            step: 7,
            maximum: Some(5000),
        }];
    });
    bench.write(0x6085, &1000_u32.to_le_bytes());
    assert_eq!(bench.read(0x6085), 994);
    bench.write(0x6085, &90_000_u32.to_le_bytes());
    assert_eq!(bench.read(0x6085), 4998);
    check_delivered(&bench, "changed_writes");
}

#[test]
fn the_drive_itself_has_what_a_master_misses() {
    let mut bench = rude(|manners| {
        manners.absent_objects = vec![NamedObject::whole(0x6084), NamedObject::whole(0x6007)];
    });
    let missing = bench.try_write(0x6084, 0, &[1, 0, 0, 0]);
    assert_eq!(missing, Err(AbortCode::NoSuchObject));
    bench.enable();
    bench.set_point(100_000, 0);
    let _ = bench.wait_ms(1000);
    assert_eq!(bench.axis.counts, 100_000);
    assert!(matches!(bench.axis.servo, Servo::Follow { .. }));
    check_delivered(&bench, "absent_objects");
}

#[test]
fn its_own_sync_moves_its_own_tpdos() {
    let mut bench = rude(|manners| manners.own_sync_ms = 20);
    bench
        .try_write(0x1800, 1, &0xC000_0181_u32.to_le_bytes())
        .unwrap();
    bench.try_write(0x1800, 2, &[1]).unwrap();
    bench
        .try_write(0x1800, 1, &0x4000_0181_u32.to_le_bytes())
        .unwrap();
    let _ = bench.sent();
    let sent = bench.wait_ms(20);
    assert!(sent.contains(&"080#".to_owned()), "{sent:?}");
    assert!(sent.contains(&"181#5002".to_owned()), "{sent:?}");
    check_delivered(&bench, "own_sync_ms");
}

#[test]
fn keys_are_read_from_a_file() {
    let text = r#"
        [quirks]
        stale_homing_ms = 250
        left_mode = 3
        rpdo_deadline = "quick_stop"
        speed_unit = 34.1
        unit_objects = { velocity_factor = [1, 60] }
        [manners]
        absent_objects = ["0x6066", "0x1A00:01"]
        changed_writes = [{ object = "0x6085", step = 7 }]
        own_sync_ms = 20
    "#;
    let config: Cia402DriveConfig = toml::from_str(text).unwrap();
    assert_eq!(config.quirks.rpdo_deadline, RpdoDeadline::QuickStop);
    assert_eq!(config.quirks.unit_objects.velocity_factor, Some([1, 60]));
    assert_eq!(config.manners.absent_objects[1].sub, Some(1));
    assert_eq!(config.manners.changed_writes[0].maximum, None);
}
