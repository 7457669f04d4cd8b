//! NMT, heartbeat and emergencies.

use wire::canopen::NodeId;
use wire::canopen::emcy::EmergencyCode;
use wire::canopen::nmt::NmtState;

use super::{Bench, Manners, ServerEvent};
use crate::node::canopen_server::register;

#[test]
fn it_boots_after_its_delay_and_is_silent_before() {
    let mut bench = Bench::with(Manners::default());
    assert!(bench.wait_ms(9).is_empty());
    assert!(bench.ask("601#4000100000000000").is_empty());
    assert_eq!(bench.wait_ms(1), ["701#00"]);
    assert_eq!(bench.server.nmt_state(), Some(NmtState::PreOperational));
}

#[test]
fn it_obeys_commands_for_itself_and_for_all_only() {
    let mut bench = Bench::new();
    bench.dialog(&[("000#0102", ""), ("000#0180", "")]);
    assert_eq!(bench.server.nmt_state(), Some(NmtState::PreOperational));
    let _ = bench.ask("000#0100");
    assert_eq!(bench.server.nmt_state(), Some(NmtState::Operational));
    bench.dialog(&[("000#0201", ""), ("601#4000100000000000", "")]);
    assert_eq!(bench.server.nmt_state(), Some(NmtState::Stopped));
    let _ = bench.ask("000#8001");
    assert_eq!(bench.ask("601#4000100000000000").len(), 1);
}

#[test]
fn reset_communication_keeps_application_values() {
    let mut bench = Bench::new();
    let _ = bench.ask("601#2B40600011110000");
    let _ = bench.ask("601#2B17100064000000");
    assert!(bench.ask("000#8201").is_empty());
    assert_eq!(bench.wait_ms(10), ["701#00"]);
    bench.dialog(&[
        ("601#4017100000000000", "581#4B17100000000000"),
        ("601#4040600000000000", "581#4B40600011110000"),
    ]);
}

#[test]
fn heartbeats_come_at_their_period_and_say_the_state() {
    let mut bench = Bench::new();
    let _ = bench.ask("601#2B17100064000000");
    assert_eq!(bench.wait_ms(250), ["701#7F", "701#7F"]);
    let _ = bench.ask("000#0101");
    assert_eq!(bench.wait_ms(50), ["701#05"]);
    let _ = bench.ask("601#2B17100000000000");
    assert!(bench.wait_ms(1000).is_empty());
}

#[test]
fn a_master_that_falls_silent_is_reported_and_operational_left() {
    let mut bench = Bench::new();
    bench.dialog(&[("601#2316100196007F00", "581#6016100100000000")]);
    bench.start();
    let _ = bench.sent();
    assert!(
        bench.wait_ms(1000).is_empty(),
        "watching starts with the first beat"
    );
    let _ = bench.ask("77F#05");
    assert!(bench.wait_ms(149).is_empty());
    assert_eq!(bench.wait_ms(1), ["081#3081117F00000000"]);
    let master = NodeId::new(127).unwrap();
    let expected = [
        ServerEvent::HeartbeatLost(master),
        ServerEvent::Nmt(NmtState::PreOperational),
    ];
    assert_eq!(bench.events(), expected);
    assert!(bench.wait_ms(1000).is_empty(), "once is enough");
    assert_eq!(bench.ask("77F#05"), ["081#0000000000000000"]);
    assert_eq!(bench.events(), [ServerEvent::HeartbeatBack(master)]);
}

#[test]
fn error_behaviour_1_keeps_the_node_operational() {
    let mut bench = Bench::new();
    let _ = bench.ask("601#2F29100101000000");
    let _ = bench.ask("601#2316100196007F00");
    bench.start();
    let _ = bench.ask("77F#05");
    let _ = bench.wait_ms(200);
    assert_eq!(bench.server.nmt_state(), Some(NmtState::Operational));
}

#[test]
fn one_producer_is_not_watched_twice() {
    let mut bench = Bench::new();
    bench.dialog(&[
        ("601#2316100196007F00", "581#6016100100000000"),
        ("601#2316100296007F00", "581#8016100243000406"),
        ("601#2316100296007E00", "581#6016100200000000"),
    ]);
}

#[test]
fn errors_fill_register_and_history_and_are_told_once() {
    let mut bench = Bench::new();
    let following = EmergencyCode::FOLLOWING_ERROR;
    let detail = [2, 0, 0, 0, 0];
    bench
        .server
        .raise(bench.now, following, register::PROFILE, detail);
    bench
        .server
        .raise(bench.now, following, register::PROFILE, detail);
    assert_eq!(bench.sent(), ["081#1186210200000000"]);
    let other = EmergencyCode(0x4310);
    bench.server.raise(bench.now, other, 0x08, [0; 5]);
    assert_eq!(bench.sent(), ["081#1043290000000000"]);
    bench.dialog(&[
        ("601#4001100000000000", "581#4F01100029000000"),
        ("601#4003100000000000", "581#4F03100002000000"),
        ("601#4003100100000000", "581#4303100110430000"),
        ("601#4003100200000000", "581#4303100211860200"),
    ]);
    bench.server.clear(bench.now, following);
    assert_eq!(bench.sent(), ["081#0000090000000000"]);
    bench.server.clear(bench.now, other);
    assert_eq!(bench.sent(), ["081#0000000000000000"]);
    bench.dialog(&[
        ("601#2F03100005000000", "581#8003100030000906"),
        ("601#2F03100000000000", "581#6003100000000000"),
        ("601#4003100100000000", "581#8003100124000008"),
    ]);
}

#[test]
fn emergencies_keep_their_inhibit_time() {
    let mut bench = Bench::new();
    let _ = bench.ask("601#2B151000C8000000");
    bench
        .server
        .raise(bench.now, EmergencyCode(0x4310), 8, [0; 5]);
    bench
        .server
        .raise(bench.now, EmergencyCode(0x3210), 4, [0; 5]);
    assert_eq!(bench.sent().len(), 1);
    assert!(bench.wait_ms(19).is_empty());
    assert_eq!(bench.wait_ms(1), ["081#10320D0000000000"]);
}
