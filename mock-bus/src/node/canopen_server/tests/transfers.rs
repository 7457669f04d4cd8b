//! Expedited and segmented SDO.

use super::Bench;

#[test]
fn device_type_and_identity_read_expedited() {
    Bench::new().dialog(&[
        ("601#4000100000000000", "581#4300100092010200"),
        ("601#4018100000000000", "581#4F18100004000000"),
        ("601#4018100100000000", "581#43181001FF070000"),
        ("601#4041600000000000", "581#4B41600050020000"),
        ("601#4064600000000000", "581#43646000FEFFFFFF"),
    ]);
}

#[test]
fn a_name_longer_than_four_bytes_reads_in_segments() {
    Bench::new().dialog(&[
        ("601#4008100000000000", "581#4108100018000000"),
        ("601#6000000000000000", "581#0061206472697665"),
        ("601#7000000000000000", "581#1020776974682061"),
        ("601#6000000000000000", "581#00206C6F6E67206E"),
        ("601#7000000000000000", "581#19616D6500000000"),
    ]);
}

#[test]
fn seven_bytes_fill_one_last_segment() {
    Bench::new().dialog(&[
        ("601#400A100000000000", "581#410A100007000000"),
        ("601#6000000000000000", "581#0161626364656667"),
    ]);
}

#[test]
fn a_segmented_download_is_taken_at_its_last_segment() {
    let mut bench = Bench::new();
    bench.dialog(&[
        ("601#2101200009000000", "581#6001200000000000"),
        ("601#0001020304050607", "581#2000000000000000"),
        ("601#1B08090000000000", "581#3000000000000000"),
        ("601#4001200000000000", "581#4101200009000000"),
        ("601#6000000000000000", "581#0001020304050607"),
    ]);
    assert_eq!(bench.ask("601#7000000000000000"), ["581#1B08090000000000"]);
}

#[track_caller]
fn check_abort(dialog: &[&str], abort: &str) {
    let mut bench = Bench::new();
    let (last, before) = dialog.split_last().unwrap();
    for request in before {
        let answers = bench.ask(request);
        assert!(!answers[0].starts_with("581#80"), "{request}: {answers:?}");
    }
    assert_eq!(bench.ask(last), [abort]);
}

#[test]
fn aborts_name_the_object_and_the_standards_reason() {
    check_abort(&["601#4099990000000000"], "581#8099990000000206"); // no object
    check_abort(&["601#4018100500000000"], "581#8018100511000906"); // no sub-index
    check_abort(&["601#2B41600000000000"], "581#8041600002000106"); // read only
    check_abort(&["601#4085600000000000"], "581#8085600001000106"); // write only
    check_abort(&["601#2340600000000000"], "581#8040600012000706"); // too long
    check_abort(&["601#2F40600000000000"], "581#8040600013000706"); // too short
    check_abort(&["601#2B40600000800000"], "581#8040600031000906"); // too high
    check_abort(&["601#2F60600007000000"], "581#8060600030000906"); // no such mode
    check_abort(&["601#E040600000000000"], "581#8000000001000405"); // unknown command
    check_abort(&["601#6000000000000000"], "581#8000000001000405"); // no transfer runs
    check_abort(&["601#4003100100000000"], "581#8003100124000008"); // empty history
    check_abort(&["601#2310100100000000"], "581#8010100120000008"); // not "save"
}

#[test]
fn a_toggle_that_does_not_alternate_aborts_with_the_transfers_object() {
    let upload = ["601#4008100000000000", "601#7000000000000000"];
    check_abort(&upload, "581#8008100000000305");
    let download = ["601#2101200009000000", "601#1001020304050607"];
    check_abort(&download, "581#8001200000000305");
}

#[test]
fn more_or_fewer_bytes_than_announced_abort() {
    let more = ["601#2101200005000000", "601#0101020304050607"];
    check_abort(&more, "581#8001200012000706");
    let fewer = ["601#2101200009000000", "601#0101020304050607"];
    check_abort(&fewer, "581#8001200013000706");
}

#[test]
fn a_size_that_is_not_indicated_is_the_entrys_own() {
    let mut bench = Bench::new();
    assert_eq!(bench.ask("601#2240600044330000"), ["581#6040600000000000"]);
    assert_eq!(bench.server.get(0x6040, 0), 0x3344);
}

#[test]
fn a_new_request_replaces_the_old_transfer_and_a_short_one_is_ignored() {
    let mut bench = Bench::new();
    assert_eq!(bench.ask("601#4008100000000000").len(), 1);
    assert!(bench.ask("601#400810").is_empty());
    assert_eq!(bench.ask("601#4000100000000000"), ["581#4300100092010200"]);
    assert_eq!(bench.ask("601#6000000000000000"), ["581#8000000001000405"]);
}

#[test]
fn the_clients_abort_ends_the_transfer_without_an_answer() {
    let mut bench = Bench::new();
    let _ = bench.ask("601#4008100000000000");
    assert!(bench.ask("601#8008100000000405").is_empty());
    assert_eq!(bench.ask("601#6000000000000000"), ["581#8000000001000405"]);
}

#[test]
fn a_silent_client_is_aborted_after_a_second() {
    let mut bench = Bench::new();
    let _ = bench.ask("601#4008100000000000");
    assert!(bench.wait_ms(999).is_empty());
    assert_eq!(bench.wait_ms(1), ["581#8008100000000405"]);
    assert!(bench.wait_ms(5000).is_empty());
}

#[test]
fn stored_parameters_survive_power_and_restored_ones_come_with_the_next_reset() {
    let mut bench = Bench::new();
    let _ = bench.ask("601#2B40600011110000");
    bench.dialog(&[("601#2310100173617665", "581#6010100100000000")]);
    let _ = bench.ask("601#2B40600022220000");
    bench.server.power_off();
    assert!(bench.ask("601#4040600000000000").is_empty());
    bench.server.power_on(bench.now);
    assert_eq!(bench.wait_ms(10), ["701#00"]);
    bench.dialog(&[
        ("601#4040600000000000", "581#4B40600011110000"),
        ("601#231110016C6F6164", "581#6011100100000000"),
        ("601#4040600000000000", "581#4B40600011110000"),
        ("000#8101", ""),
    ]);
    assert_eq!(bench.wait_ms(10), ["701#00"]);
    bench.dialog(&[("601#4040600000000000", "581#4B40600034120000")]);
}
