//! Habits of real nodes: what they lack, refuse, and do by themselves.

use super::{Bench, Manners, NamedObject, ServerEvent};
use wire::canopen::nmt::NmtState;

fn node(change: impl FnOnce(&mut Manners)) -> Bench {
    let mut manners = Manners::default();
    change(&mut manners);
    let mut bench = Bench::with(manners);
    assert_eq!(bench.wait_ms(10), ["701#00"]);
    bench.events();
    bench
}

#[track_caller]
fn check_counted(bench: &Bench, name: &str) {
    let deliveries = bench.server.deliveries();
    assert!(deliveries.contains_key(name), "{name}: {deliveries:?}");
}

#[test]
fn absent_objects_can_neither_be_read_nor_written_nor_mapped() {
    let mut bench = node(|manners| manners.absent_objects = vec![NamedObject::whole(0x6064)]);
    bench.dialog(&[
        ("601#4064600000000000", "581#8064600000000206"),
        ("601#2364600001000000", "581#8064600000000206"),
        ("601#23011801810200C0", "581#6001180100000000"),
        ("601#2F011A0000000000", "581#60011A0000000000"),
        ("601#23011A0120006460", "581#80011A0100000206"),
    ]);
    assert_eq!(bench.server.get(0x6064, 0), -2, "the device itself has it");
    check_counted(&bench, "absent_objects");
}

#[test]
fn absent_objects_have_an_abort_code_of_their_own() {
    let mut bench = node(|manners| {
        manners.absent_objects = vec!["0x1018:04".parse().unwrap()];
        manners.absent_abort_code = Some(0x0604_0041);
    });
    bench.dialog(&[("601#4018100400000000", "581#8018100441000406")]);
    check_counted(&bench, "absent_abort_code");
    let mut bench = node(|manners| {
        manners.absent_objects = vec!["0x1018:04".parse().unwrap()];
    });
    bench.dialog(&[("601#4018100400000000", "581#8018100411000906")]);
}

#[test]
fn read_only_objects_and_fixed_identifiers_are_refused() {
    let mut bench = node(|manners| {
        manners.read_only_objects = vec![NamedObject::whole(0x1A00)];
        manners.pdo_identifiers_fixed = true;
    });
    bench.dialog(&[
        ("601#2F001A0000000000", "581#80001A0002000106"),
        ("601#23001801810100C0", "581#6000180100000000"),
        ("601#2300180182010040", "581#8000180130000906"),
        ("601#2300180181010040", "581#6000180100000000"),
    ]);
    check_counted(&bench, "read_only_objects");
    check_counted(&bench, "pdo_identifiers_fixed");
}

#[test]
fn expedited_answers_hide_or_invent_their_size() {
    let mut bench = node(|manners| manners.sdo_size_bit_omitted = true);
    bench.dialog(&[("601#4001100000000000", "581#4201100000000000")]);
    check_counted(&bench, "sdo_size_bit_omitted");
    let mut bench = node(|manners| manners.sdo_always_four_bytes = true);
    bench.dialog(&[("601#4041600000000000", "581#4341600050020000")]);
    check_counted(&bench, "sdo_always_four_bytes");
}

#[test]
fn blocks_are_refused() {
    let mut bench = node(|manners| manners.sdo_blocks_refused = true);
    bench.dialog(&[
        ("601#A400200010000000", "581#8000200001000405"),
        ("601#C201200004000000", "581#8001200001000405"),
        ("601#4001100000000000", "581#4F01100000000000"),
    ]);
    check_counted(&bench, "sdo_blocks_refused");
}

#[test]
fn it_says_twice_that_it_has_booted() {
    let mut bench = node(|manners| manners.boots_twice_after_ms = 300);
    bench.start();
    assert!(bench.wait_ms(299).iter().all(|frame| frame != "701#00"));
    let sent = bench.wait_ms(1);
    assert!(sent.contains(&"701#00".to_owned()), "{sent:?}");
    assert_eq!(bench.server.nmt_state(), Some(NmtState::PreOperational));
    check_counted(&bench, "boots_twice_after_ms");
    assert!(bench.wait_ms(5000).iter().all(|frame| frame != "701#00"));
}

#[test]
fn its_own_sync_ends_with_bit_30() {
    let mut bench = node(|manners| manners.own_sync_ms = 20);
    bench.dialog(&[("601#4005100000000000", "581#4305100080000040")]);
    assert_eq!(bench.wait_ms(41), ["080#", "080#"]);
    bench.dialog(&[("601#2305100080000000", "581#6005100000000000")]);
    assert!(bench.wait_ms(500).is_empty());
}

#[test]
fn its_own_sync_counts() {
    let mut bench = node(|manners| {
        manners.own_sync_ms = 20;
        manners.sync_counter_overflow = 2;
    });
    assert_eq!(bench.wait_ms(60), ["080#01", "080#02", "080#01"]);
}

#[test]
fn a_sync_without_its_counter_is_refused() {
    let mut bench = node(|manners| manners.sync_counter_overflow = 240);
    bench.start();
    let _ = bench.sent();
    assert_eq!(bench.ask("080#"), ["081#4082110000000000"]);
    assert!(bench.events().is_empty());
    assert_eq!(bench.ask("080#01"), ["081#0000000000000000"]);
    assert_eq!(bench.events(), [ServerEvent::Synchronised]);
    check_counted(&bench, "sync_counter_overflow");
}

#[test]
fn a_guarded_node_answers_and_misses_its_guard() {
    let mut bench = node(|manners| manners.node_guarding_only = true);
    bench.dialog(&[
        ("601#4017100000000000", "581#8017100000000206"),
        ("601#4016100100000000", "581#8016100100000206"),
        ("601#2B0C100064000000", "581#600C100000000000"),
        ("601#2F0D100003000000", "581#600D100000000000"),
        ("701#R1", "701#7F"),
        ("701#R1", "701#FF"),
        ("701#R1", "701#7F"),
    ]);
    assert!(bench.wait_ms(299).is_empty());
    assert_eq!(bench.wait_ms(1), ["081#3081110100000000"]);
    let lost = |event: &ServerEvent| matches!(event, ServerEvent::HeartbeatLost(_));
    assert!(bench.events().iter().any(lost));
    assert_eq!(bench.ask("701#R1"), ["701#FF", "081#0000000000000000"]);
    let back = |event: &ServerEvent| matches!(event, ServerEvent::HeartbeatBack(_));
    assert!(bench.events().iter().any(back));
    check_counted(&bench, "node_guarding_only");
}
