//! PDOs: the order of remapping, transmission types, short frames.

use wire::canopen::Object;

use super::{Bench, ServerEvent};

/// TPDO2 off, emptied, mapped to position and statusword, synchronous, on.
const REMAP: [(&str, &str); 7] = [
    ("601#23011801810200C0", "581#6001180100000000"),
    ("601#2F011A0000000000", "581#60011A0000000000"),
    ("601#23011A0120006460", "581#60011A0100000000"),
    ("601#23011A0210004160", "581#60011A0200000000"),
    ("601#2F011A0002000000", "581#60011A0000000000"),
    ("601#2F01180201000000", "581#6001180200000000"),
    ("601#2301180181020040", "581#6001180100000000"),
];

fn sync(bench: &mut Bench) -> Vec<String> {
    let _ = bench.ask("080#");
    bench.server.send_synchronous(bench.now);
    bench.sent()
}

#[test]
fn the_standards_order_remaps_and_the_pdo_carries_the_new_objects() {
    let mut bench = Bench::new();
    bench.dialog(&REMAP);
    bench.start();
    let _ = bench.sent();
    assert_eq!(sync(&mut bench), ["281#FEFFFFFF5002"]);
}

#[track_caller]
fn check_refused(before: &[(&str, &str)], request: &str, abort: &str) {
    let mut bench = Bench::new();
    bench.dialog(before);
    assert_eq!(bench.ask(request), [abort]);
}

#[test]
fn every_violation_of_the_order_is_refused() {
    let off = &REMAP[..1];
    let open = &REMAP[..2];
    // The mapping of a PDO in use.
    check_refused(&[], "601#2F001A0000000000", "581#80001A0022000008");
    check_refused(&[], "601#23001A0110004160", "581#80001A0122000008");
    // Entries while sub 0 is not 0.
    check_refused(off, "601#23011A0120006460", "581#80011A0102000106");
    // No such object; not mappable at all, in this direction, with this length.
    check_refused(open, "601#23011A0110009999", "581#80011A0100000206");
    check_refused(open, "601#23011A0120000010", "581#80011A0141000406");
    check_refused(open, "601#23011A0120007A60", "581#80011A0141000406");
    check_refused(open, "601#23011A0110006460", "581#80011A0141000406");
    // More than 8 objects, more than 64 bits, an empty entry.
    check_refused(open, "601#2F011A0009000000", "581#80011A0042000406");
    check_refused(&REMAP[..4], "601#2F011A0003000000", "581#80011A0041000406");
    let three = [
        &REMAP[..3],
        &[("601#23011A0220006460", "581#60011A0200000000")],
    ]
    .concat();
    let three = [
        &three[..],
        &[("601#23011A0320006460", "581#60011A0300000000")],
    ]
    .concat();
    check_refused(&three, "601#2F011A0003000000", "581#80011A0042000406");
}

#[test]
fn parameters_of_a_pdo_in_use_keep_their_identifier_and_inhibit_time() {
    check_refused(&[], "601#2300180182010040", "581#8000180130000906");
    check_refused(&[], "601#2B00180364000000", "581#8000180322000008");
    check_refused(&[], "601#2F001802F1000000", "581#8000180230000906");
    check_refused(&REMAP[..1], "601#2301180101060040", "581#8001180130000906");
    check_refused(&[], "601#2F00180400000000", "581#8000180411000906");
}

#[test]
fn an_event_driven_pdo_comes_at_the_start_and_at_changes() {
    let mut bench = Bench::new();
    let _ = bench.ask("000#0101");
    bench.server.send_changes(bench.now);
    assert_eq!(bench.sent(), ["181#5002"]);
    bench.server.send_changes(bench.now);
    assert!(bench.sent().is_empty());
    bench.server.set(0x6041, 0, 0x0231);
    bench.server.send_changes(bench.now);
    assert_eq!(bench.sent(), ["181#3102"]);
}

#[test]
fn an_inhibited_pdo_waits_and_then_carries_the_newest_value() {
    let mut bench = Bench::new();
    bench.dialog(&[
        ("601#23001801810100C0", "581#6000180100000000"),
        ("601#2B00180364000000", "581#6000180300000000"),
        ("601#2300180181010040", "581#6000180100000000"),
    ]);
    bench.start();
    bench.server.send_changes(bench.now);
    assert_eq!(bench.sent(), ["181#5002"]);
    for value in [0x0231, 0x0233] {
        bench.server.set(0x6041, 0, value);
        bench.server.send_changes(bench.now);
    }
    assert!(bench.wait_ms(9).is_empty());
    assert_eq!(bench.wait_ms(1), ["181#3302"]);
    assert!(bench.wait_ms(100).is_empty());
}

#[test]
fn the_event_timer_repeats_a_pdo() {
    let mut bench = Bench::new();
    bench.dialog(&[("601#2B00180532000000", "581#6000180500000000")]);
    bench.start();
    let _ = bench.sent();
    assert_eq!(bench.wait_ms(100), ["181#5002", "181#5002"]);
}

#[test]
fn every_third_sync_and_only_changes() {
    let mut bench = Bench::new();
    bench.dialog(&REMAP[..5]);
    bench.dialog(&[("601#2F01180203000000", "581#6001180200000000"), REMAP[6]]);
    bench.dialog(&[("601#2F00180200000000", "581#6000180200000000")]);
    bench.start();
    let seen: Vec<Vec<String>> = (0..3).map(|_| sync(&mut bench)).collect();
    assert_eq!(seen[0], ["181#5002"]);
    assert!(seen[1].is_empty());
    assert_eq!(seen[2], ["281#FEFFFFFF5002"]);
    bench.server.set(0x6041, 0, 0x0231);
    assert_eq!(sync(&mut bench), ["181#3102"]);
}

#[test]
fn an_rpdo_writes_all_its_objects_before_anyone_is_told() {
    let mut bench = Bench::new();
    bench.dialog(&[
        ("601#2F01160000000000", "581#6001160000000000"),
        ("601#2301160110004060", "581#6001160100000000"),
        ("601#2301160208000500", "581#6001160200000000"),
        ("601#2301160320007A60", "581#6001160300000000"),
        ("601#2F01160003000000", "581#6001160000000000"),
        ("601#2301140101030000", "581#6001140100000000"),
    ]);
    bench.start();
    assert!(
        bench
            .ask("301#0F00AA78563412")
            .iter()
            .all(|f| !f.starts_with("081"))
    );
    assert_eq!(bench.server.get(0x607A, 0), 0x1234_5678);
    let written = |index| ServerEvent::Written(Object::new(index, 0));
    assert_eq!(bench.events(), [written(0x6040), written(0x607A)]);
}

#[test]
fn a_synchronous_rpdo_waits_for_the_sync() {
    let mut bench = Bench::new();
    bench.dialog(&[("601#2F00140201000000", "581#6000140200000000")]);
    bench.start();
    let _ = bench.ask("201#0600");
    assert_eq!(bench.server.get(0x6040, 0), 0x1234);
    let _ = bench.ask("080#");
    assert_eq!(bench.server.get(0x6040, 0), 6);
    let written = ServerEvent::Written(Object::new(0x6040, 0));
    assert_eq!(bench.events(), [written, ServerEvent::Synchronised]);
}

#[test]
fn a_short_rpdo_is_reported_once_and_not_processed() {
    let mut bench = Bench::new();
    bench.start();
    let _ = bench.sent();
    bench.dialog(&[
        ("201#06", "081#1082110100000000"),
        ("201#06", ""),
        ("201#0600", "081#0000000000000000"),
        ("201#06000000", ""),
    ]);
    assert_eq!(bench.server.get(0x6040, 0), 6);
}

#[test]
fn an_rpdo_that_stays_away_is_reported() {
    let mut bench = Bench::new();
    bench.dialog(&[("601#2B00140532000000", "581#6000140500000000")]);
    bench.start();
    let _ = bench.ask("201#0600");
    assert_eq!(bench.wait_ms(60), ["081#5082110000000000"]);
    assert_eq!(bench.ask("201#0600"), ["081#0000000000000000"]);
}

#[test]
fn pdos_and_remote_frames_mean_nothing_before_operational() {
    let mut bench = Bench::new();
    bench.dialog(&[("201#0600", ""), ("181#R2", ""), ("080#", "")]);
    assert!(bench.events().is_empty());
    bench.start();
    let _ = bench.sent();
    bench.dialog(&[("181#R2", "")]);
}
