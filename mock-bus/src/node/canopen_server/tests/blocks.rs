//! Block SDO, with lost segments.

use wire::canopen::sdo::block_crc;

use super::{Bench, LOG};

const UPLOAD: &str = "601#A400200010000000";

fn log() -> Vec<u8> {
    (0..LOG).map(|place| place as u8).collect()
}

fn payload(frame: &str) -> Vec<u8> {
    let (_, hex) = frame.split_once('#').unwrap();
    let byte = |place| u8::from_str_radix(&hex[place..place + 2], 16).unwrap();
    (0..hex.len()).step_by(2).map(byte).collect()
}

/// The bytes of segments that are all there.
fn joined(frames: &[String]) -> Vec<u8> {
    frames
        .iter()
        .flat_map(|frame| payload(frame)[1..].to_vec())
        .collect()
}

#[test]
fn a_block_upload_delivers_every_byte_and_its_checksum() {
    let mut bench = Bench::new();
    assert_eq!(bench.ask(UPLOAD), ["581#C60020002C010000"]);
    let first = bench.ask("601#A300000000000000");
    assert_eq!(first.len(), 16);
    assert_eq!(first[0], "581#0100010203040506");
    assert!(first[15].starts_with("581#10"));
    let second = bench.ask("601#A210100000000000");
    let third = bench.ask("601#A210100000000000");
    assert_eq!(third.len(), 43 - 32);
    assert!(third[10].starts_with("581#8B"), "{}", third[10]);
    let mut data = joined(&[first, second, third].concat());
    data.truncate(LOG);
    assert_eq!(data, log());
    let [low, high] = block_crc(&data).to_le_bytes();
    let end = format!("581#C5{low:02X}{high:02X}0000000000");
    assert_eq!(bench.ask("601#A20B100000000000"), [end]);
    assert!(bench.ask("601#A100000000000000").is_empty());
    assert_eq!(bench.ask("601#A100000000000000"), ["581#8000000001000405"]);
}

#[test]
fn segments_that_the_client_missed_are_sent_again() {
    let mut bench = Bench::new();
    let _ = bench.ask(UPLOAD);
    let first = bench.ask("601#A300000000000000");
    let again = bench.ask("601#A204100000000000");
    assert_eq!(payload(&again[0])[1..], payload(&first[4])[1..]);
    assert_eq!(payload(&again[0])[0], 1);
    let all = bench.ask("601#A200100000000000");
    assert_eq!(all, again, "nothing confirmed: the same block again");
}

#[test]
fn the_client_may_change_the_block_size_but_not_to_nothing() {
    let mut bench = Bench::new();
    let _ = bench.ask(UPLOAD);
    let _ = bench.ask("601#A300000000000000");
    assert_eq!(bench.ask("601#A210030000000000").len(), 3);
    assert_eq!(bench.ask("601#A203000000000000"), ["581#8000200002000405"]);
    assert_eq!(bench.ask("601#A400200080000000"), ["581#8000200002000405"]);
}

#[test]
fn a_confirmation_of_segments_never_sent_aborts() {
    let mut bench = Bench::new();
    let _ = bench.ask(UPLOAD);
    let _ = bench.ask("601#A300000000000000");
    assert_eq!(bench.ask("601#A211100000000000"), ["581#8000200003000405"]);
}

#[test]
fn small_values_switch_to_another_protocol_where_the_client_allows_it() {
    let mut bench = Bench::new();
    assert_eq!(bench.ask("601#A400100010040000"), ["581#4300100092010200"]);
    assert_eq!(bench.ask("601#A400100010000000"), ["581#C600100004000000"]);
}

/// 20 bytes in three segments, one byte of the last unused.
const DOWNLOAD: &str = "601#C601200014000000";
const SEGMENTS: [&str; 3] = [
    "601#0100010203040506",
    "601#020708090A0B0C0D",
    "601#830E0F1011121300",
];

fn end_of_download() -> String {
    let data: Vec<u8> = (0..20).collect();
    let [low, high] = block_crc(&data).to_le_bytes();
    format!("601#C5{low:02X}{high:02X}0000000000")
}

#[test]
fn a_block_download_is_taken_when_size_and_checksum_fit() {
    let mut bench = Bench::new();
    bench.dialog(&[
        (DOWNLOAD, "581#A40120007F000000"),
        (SEGMENTS[0], ""),
        (SEGMENTS[1], ""),
        (SEGMENTS[2], "581#A2037F0000000000"),
        (&end_of_download(), "581#A100000000000000"),
        ("601#4001200000000000", "581#4101200014000000"),
    ]);
}

#[test]
fn a_lost_segment_of_a_download_is_asked_for_again() {
    let mut bench = Bench::new();
    bench.dialog(&[
        (DOWNLOAD, "581#A40120007F000000"),
        (SEGMENTS[0], ""),
        (SEGMENTS[2], "581#A2017F0000000000"),
        ("601#010708090A0B0C0D", ""),
        ("601#820E0F1011121300", "581#A2027F0000000000"),
        (&end_of_download(), "581#A100000000000000"),
    ]);
}

#[test]
fn when_the_last_segment_is_lost_the_server_confirms_after_a_while() {
    let mut bench = Bench::new();
    bench.dialog(&[(DOWNLOAD, "581#A40120007F000000"), (SEGMENTS[0], "")]);
    assert_eq!(bench.wait_ms(500), ["581#A2017F0000000000"]);
    assert_eq!(bench.wait_ms(500), ["581#8001200000000405"]);
}

#[test]
fn a_wrong_checksum_a_wrong_size_and_sequence_zero_abort() {
    let mut bench = Bench::new();
    let begin = [
        (DOWNLOAD, "581#A40120007F000000"),
        (SEGMENTS[0], ""),
        (SEGMENTS[1], ""),
        (SEGMENTS[2], "581#A2037F0000000000"),
    ];
    bench.dialog(&begin);
    assert_eq!(bench.ask("601#C500000000000000"), ["581#8001200004000405"]);
    bench.dialog(&begin);
    assert_eq!(bench.ask("601#C900000000000000"), ["581#8001200013000706"]);
    bench.dialog(&begin[..1]);
    assert_eq!(bench.ask("601#0000010203040506"), ["581#8001200003000405"]);
}

#[test]
fn an_abort_within_a_block_is_no_segment() {
    let mut bench = Bench::new();
    bench.dialog(&[
        (DOWNLOAD, "581#A40120007F000000"),
        (SEGMENTS[0], ""),
        ("601#8001200000000405", ""),
        (SEGMENTS[1], "581#8000000001000405"),
    ]);
}
