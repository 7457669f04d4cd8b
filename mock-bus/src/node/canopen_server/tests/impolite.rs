//! Each bad manner is delivered as often as asked for, and counted.

use super::{Bench, Manners};

fn impolite(change: impl FnOnce(&mut Manners)) -> Bench {
    let mut bench = Bench::new();
    change(bench.server.manners_mut());
    bench
}

#[track_caller]
fn check_counted(bench: &Bench, name: &str, times: u64) {
    assert_eq!(bench.server.deliveries().get(name), Some(&times), "{name}");
}

const READ: &str = "601#4000100000000000";
const VALUE: &str = "581#4300100092010200";

#[test]
fn a_late_reply_comes_after_the_next_ones() {
    let mut bench = impolite(|m| {
        m.sdo_late_replies = 1;
        m.sdo_late_reply_ms = 2000;
    });
    bench.dialog(&[(READ, ""), ("601#4001100000000000", "581#4F01100000000000")]);
    assert!(bench.wait_ms(1999).is_empty());
    assert_eq!(bench.wait_ms(1), [VALUE]);
    check_counted(&bench, "sdo_late_replies", 1);
}

#[test]
fn a_slow_server_answers_after_its_delay() {
    let mut bench = impolite(|m| m.sdo_response_delay_us = 5000);
    assert!(bench.ask(READ).is_empty());
    assert_eq!(bench.wait_ms(5), [VALUE]);
}

#[test]
fn duplicates_strays_wrong_indices_and_short_replies() {
    let mut bench = impolite(|m| m.sdo_duplicate_responses = 1);
    assert_eq!(bench.ask(READ), [VALUE, VALUE]);
    assert_eq!(bench.ask(READ), [VALUE]);
    let mut bench = impolite(|m| m.sdo_stray_replies = 1);
    assert_eq!(bench.ask(READ), ["581#4301100092010200", VALUE]);
    let mut bench = impolite(|m| m.sdo_wrong_indices = 1);
    assert_eq!(bench.ask(READ), ["581#4301100092010200"]);
    let mut bench = impolite(|m| m.sdo_short_replies = 1);
    assert_eq!(bench.ask(READ), ["581#430010"]);
    assert_eq!(bench.ask(READ), [VALUE]);
    check_counted(&bench, "sdo_short_replies", 1);
}

#[test]
fn toggles_and_sizes_lie_once() {
    let mut bench = impolite(|m| {
        m.sdo_wrong_toggles = 1;
        m.sdo_wrong_sizes = 1;
    });
    bench.dialog(&[
        ("601#4008100000000000", "581#4108100067000000"),
        ("601#6000000000000000", "581#1061206472697665"),
        ("601#7000000000000000", "581#1020776974682061"),
    ]);
    check_counted(&bench, "sdo_wrong_toggles", 1);
    check_counted(&bench, "sdo_wrong_sizes", 1);
}

#[test]
fn busy_and_silent_servers() {
    let mut bench = impolite(|m| m.sdo_busy = 1);
    bench.dialog(&[
        ("601#2B40600011110000", "581#8040600022000008"),
        ("601#2B40600011110000", "581#6040600000000000"),
    ]);
    let mut bench = impolite(|m| m.sdo_ignored_requests = 1);
    bench.dialog(&[("601#2B40600011110000", "")]);
    assert_eq!(bench.server.get(0x6040, 0), 0x1234);
    let mut bench = impolite(|m| m.sdo_lost_replies = 1);
    bench.dialog(&[("601#2B40600011110000", "")]);
    assert_eq!(bench.server.get(0x6040, 0), 0x1111);
}

#[test]
fn only_one_index_is_spoilt_where_asked_for() {
    let mut bench = impolite(|m| {
        m.sdo_only_index = Some(0x1001);
        m.sdo_short_replies = 1;
    });
    assert_eq!(bench.ask(READ), [VALUE]);
    assert_eq!(bench.ask("601#4001100000000000"), ["581#4F0110"]);
}

#[test]
fn a_lost_block_segment_is_recovered_by_the_clients_confirmation() {
    let mut bench = impolite(|m| m.sdo_lost_block_segments = 1);
    let _ = bench.ask("601#A400200010000000");
    let block = bench.ask("601#A300000000000000");
    assert_eq!(block.len(), 15);
    assert!(block[0].starts_with("581#02"));
    assert_eq!(bench.ask("601#A200100000000000").len(), 16);
}

#[test]
fn stale_segments_follow_an_abort() {
    let mut bench = impolite(|m| m.sdo_floods_after_abort = 1);
    let _ = bench.ask("601#4008100000000000");
    assert_eq!(bench.ask("601#8008100000000405").len(), 8);
    check_counted(&bench, "sdo_floods_after_abort", 1);
}

#[test]
fn storing_takes_its_time() {
    let mut bench = impolite(|m| m.store_delay_ms = 1500);
    assert!(bench.ask("601#2310100173617665").is_empty());
    assert!(bench.wait_ms(1499).is_empty());
    assert_eq!(bench.wait_ms(1), ["581#6010100100000000"]);
}

#[test]
fn mappings_that_are_not_kept_and_mappings_that_lie() {
    let mut bench = impolite(|m| {
        m.mapping_ignored_writes = 1;
        m.mapping_lies = true;
    });
    bench.dialog(&[
        ("601#2F011A0000000000", "581#60011A0000000000"),
        ("601#23011A0120006460", "581#60011A0100000000"),
        ("601#40011A0100000000", "581#43011A0110004160"),
        ("601#23011A0120006460", "581#60011A0100000000"),
        ("601#23011A0210004160", "581#60011A0200000000"),
        ("601#2F011A0002000000", "581#60011A0000000000"),
        ("601#2F01180201000000", "581#6001180200000000"),
        ("601#2301180181020040", "581#6001180100000000"),
    ]);
    bench.start();
    let _ = bench.sent();
    let _ = bench.ask("080#");
    bench.server.send_synchronous(bench.now);
    assert_eq!(bench.sent(), ["281#5002FEFFFFFF"]);
}

#[test]
fn pdos_stop_while_the_heartbeat_goes_on_and_the_other_way_round() {
    let mut bench = impolite(|m| m.tpdo_mute = true);
    let _ = bench.ask("601#2B17100064000000");
    bench.start();
    bench.server.send_changes(bench.now);
    assert!(bench.sent().is_empty());
    assert_eq!(bench.wait_ms(100), ["701#05"]);
    check_counted(&bench, "tpdo_mute", 1);
    bench.server.manners_mut().tpdo_mute = false;
    bench.server.manners_mut().heartbeat_mute = true;
    bench.server.set(0x6041, 0, 7);
    bench.server.send_changes(bench.now);
    assert_eq!(bench.sent(), ["181#0700"]);
    assert!(bench.wait_ms(500).is_empty());
    check_counted(&bench, "heartbeat_mute", 5);
}

#[test]
fn single_pdos_are_dropped() {
    let mut bench = impolite(|m| m.tpdo_drops = 1);
    bench.start();
    for value in [1, 2] {
        bench.server.set(0x6041, 0, value);
        bench.server.send_changes(bench.now);
    }
    assert_eq!(bench.sent(), ["181#0200"]);
    check_counted(&bench, "tpdo_drops", 1);
}

#[test]
fn sizes_are_left_out_and_stale_bytes_left_in() {
    let mut bench = impolite(|m| {
        m.sdo_sizes_omitted = true;
        m.sdo_stale_bytes = true;
    });
    assert_eq!(bench.ask("601#4008100000000000"), ["581#4008100000000000"]);
    assert_eq!(bench.ask("601#4041600000000000"), ["581#4B4160005002A5A5"]);
    check_counted(&bench, "sdo_stale_bytes", 1);
}
