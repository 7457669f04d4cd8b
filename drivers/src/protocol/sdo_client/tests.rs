//! Golden dialogs of each kind of transfer, then the faults that other clients get wrong.
//!
//! A dialog is written as candump prints it: `>` is what the client must send, `<` what the
//! server answers. Golden bytes: CiA 301, 7.2.4.3.

use core::time::Duration;
use units::Time;

use super::*;

const NODE: NodeId = NodeId::new(2).unwrap();
const NAME: Object = Object::new(0x1008, 0);
const MODE: Object = Object::new(0x6060, 0);
const DATA: Object = Object::new(0x1F50, 1);

/// What a fence reads and how a polite server answers.
const FENCE_ASKED: &str = "4000100000000000";
const FENCE_ANSWERED: &str = "4300100092010200";

fn hex(text: &str) -> Vec<u8> {
    text.as_bytes()
        .chunks(2)
        .map(|pair| u8::from_str_radix(core::str::from_utf8(pair).unwrap(), 16).unwrap())
        .collect()
}

struct Bench {
    client: SdoClient,
    now: Time,
}

impl Bench {
    fn new(retry: Retry) -> Self {
        Self {
            client: SdoClient::new(NODE, Timeouts::default()).with_retry(retry),
            now: Time::ZERO,
        }
    }

    #[track_caller]
    fn read(object: Object, method: Method) -> Self {
        let mut bench = Self::new(Retry::Never);
        bench.client.read(bench.now, object, method).unwrap();
        bench
    }

    #[track_caller]
    fn write(object: Object, data: &[u8], method: Method) -> Self {
        let mut bench = Self::new(Retry::Never);
        bench.client.write(bench.now, object, data, method).unwrap();
        bench
    }

    /// The client must send exactly this now, and nothing after it.
    #[track_caller]
    fn sends(&mut self, payloads: &[&str]) -> &mut Self {
        for payload in payloads {
            let frame = self.client.poll_transmit().expect("a frame is due");
            assert_eq!(frame.to_string(), format!("602#{payload}"));
        }
        assert_eq!(self.client.poll_transmit(), None);
        self
    }

    fn hears(&mut self, payload: &str) -> &mut Self {
        let frame = CanFrame::standard(0x582, &hex(payload));
        assert!(self.client.handle_frame(self.now, &frame));
        self
    }

    fn passes(&mut self, span: Duration) -> &mut Self {
        let until = self.now + span;
        while self.client.poll_timeout() <= until {
            self.now = self.client.poll_timeout();
            self.client.handle_timeout(self.now);
        }
        self.now = until;
        self
    }

    fn passes_ms(&mut self, ms: u64) -> &mut Self {
        self.passes(Duration::from_millis(ms))
    }

    /// Lets drain time pass and answers the fence, so that the next transfer may start.
    #[track_caller]
    fn passes_the_fence(&mut self) -> &mut Self {
        self.passes_ms(500)
            .sends(&[FENCE_ASKED])
            .hears(FENCE_ANSWERED)
    }

    #[track_caller]
    fn reads(&mut self, data: &[u8]) {
        assert_eq!(self.client.poll_outcome(), Some(Ok(data.to_vec())));
        assert_eq!(self.client.poll_timeout(), Time::NEVER);
    }

    #[track_caller]
    fn is_written(&mut self) {
        self.reads(&[]);
    }

    #[track_caller]
    fn still_waits(&mut self) -> &mut Self {
        assert_eq!(self.client.poll_outcome(), None);
        assert_eq!(self.client.poll_transmit(), None);
        self
    }

    #[track_caller]
    fn fails(&mut self, check: impl Fn(&SdoFailure) -> bool) -> &mut Self {
        let failure = self.client.poll_outcome().unwrap().unwrap_err();
        assert!(check(&failure), "{failure}");
        self
    }

    #[track_caller]
    fn fails_with(&mut self, expected: AbortCode) -> &mut Self {
        self.fails(
            |failure| matches!(failure, SdoFailure::Protocol { code, .. } if *code == expected),
        )
    }
}

#[test]
fn an_expedited_read_takes_one_frame_each_way() {
    Bench::read(Object::new(0x1000, 0), Method::Auto)
        .sends(&["4000100000000000"])
        .hears("4300100092010200")
        .reads(&[0x92, 0x01, 0x02, 0x00]);
}

#[test]
fn an_expedited_read_has_the_length_the_server_says() {
    Bench::read(MODE, Method::Auto)
        .sends(&["4060600000000000"])
        .hears("4F60600006000000")
        .reads(&[6]);
}

#[test]
fn an_expedited_write_takes_one_frame_each_way() {
    Bench::write(MODE, &[6], Method::Auto)
        .sends(&["2F60600006000000"])
        .hears("6060600000000000")
        .is_written();
}

#[test]
fn a_segmented_read_alternates_the_toggle_bit() {
    Bench::read(NAME, Method::Auto)
        .sends(&["4008100000000000"])
        .hears("410810000A000000")
        .sends(&["6000000000000000"])
        .hears("0041424344454647")
        .sends(&["7000000000000000"])
        .hears("1948494A00000000")
        .reads(b"ABCDEFGHIJ");
}

#[test]
fn a_segmented_read_without_a_size_is_taken() {
    Bench::read(NAME, Method::Auto)
        .sends(&["4008100000000000"])
        .hears("4008100000000000")
        .sends(&["6000000000000000"])
        .hears("0D41000000000000")
        .reads(b"A");
}

#[test]
fn a_segmented_write_alternates_the_toggle_bit() {
    Bench::write(NAME, b"ABCDEFGHIJ", Method::Auto)
        .sends(&["210810000A000000"])
        .hears("6008100000000000")
        .sends(&["0041424344454647"])
        .hears("2000000000000000")
        .sends(&["1948494A00000000"])
        .hears("3000000000000000")
        .is_written();
}

#[test]
fn an_empty_value_is_written_as_one_empty_segment() {
    Bench::write(NAME, b"", Method::Auto)
        .sends(&["2108100000000000"])
        .hears("6008100000000000")
        .sends(&["0F00000000000000"])
        .hears("2000000000000000")
        .is_written();
}

/// CRC-16/XMODEM of "123456789" is 0x31C3.
#[test]
fn a_block_read_checks_the_checksum_and_confirms_the_end() {
    Bench::read(DATA, Method::Block)
        .sends(&["A4501F017F000000"])
        .hears("C6501F0109000000")
        .sends(&["A300000000000000"])
        .hears("0131323334353637")
        .still_waits()
        .hears("8238390000000000")
        .sends(&["A2027F0000000000"])
        .hears("D5C3310000000000")
        .sends(&["A100000000000000"])
        .reads(b"123456789");
}

#[test]
fn a_block_write_obeys_the_servers_block_size() {
    let data = b"123456789";
    Bench::write(DATA, data, Method::Block)
        .sends(&["C6501F0109000000"])
        .hears("A4501F0101000000")
        .sends(&["0131323334353637"])
        .hears("A2010A0000000000")
        .sends(&["8138390000000000"])
        .hears("A2010A0000000000")
        .sends(&["D5C3310000000000"])
        .hears("A100000000000000")
        .is_written();
}

#[test]
fn a_block_write_to_a_server_without_checksum_sends_none() {
    Bench::write(DATA, b"123", Method::Block)
        .sends(&["C6501F0103000000"])
        .hears("A0501F017F000000")
        .sends(&["8131323300000000"])
        .hears("A2017F0000000000")
        .sends(&["D100000000000000"])
        .hears("A100000000000000")
        .is_written();
}

#[test]
fn segments_of_a_block_that_were_lost_are_sent_again() {
    Bench::write(DATA, &[7; 21], Method::Block)
        .sends(&["C6501F0115000000"])
        .hears("A4501F017F000000")
        .sends(&["0107070707070707", "0207070707070707", "8307070707070707"])
        .hears("A2017F0000000000")
        .sends(&["0107070707070707", "8207070707070707"]);
}

#[test]
fn a_gap_in_a_block_read_is_asked_for_again() {
    Bench::read(DATA, Method::Block)
        .sends(&["A4501F017F000000"])
        .hears("C6501F0115000000")
        .sends(&["A300000000000000"])
        .hears("0101010101010101")
        .hears("8303030303030303")
        .sends(&["A2017F0000000000"])
        .hears("0102020202020202")
        .hears("8203030303030303")
        .sends(&["A2027F0000000000"]);
}

#[test]
fn a_lost_end_of_a_block_is_asked_for_again_after_silence() {
    Bench::read(DATA, Method::Block)
        .sends(&["A4501F017F000000"])
        .hears("C6501F010E000000")
        .sends(&["A300000000000000"])
        .hears("0101010101010101")
        .passes_ms(100)
        .sends(&["A2017F0000000000"])
        .hears("8102020202020202")
        .sends(&["A2017F0000000000"]);
}

#[test]
fn a_repeated_last_segment_is_not_taken_for_the_end_of_a_block() {
    let mut bench = Bench::read(DATA, Method::Block);
    bench
        .sends(&["A4501F017F000000"])
        .hears("C0501F0100000000")
        .sends(&["A300000000000000"]);
    for sequence in 1..65 {
        bench.hears(&format!("{sequence:02X}00000000000000"));
    }
    // Sequence 65 and "last" make 0xC1, the end message's command byte.
    bench
        .hears("C111223344556677")
        .sends(&["A2417F0000000000"])
        .hears("C111223344556677")
        .still_waits();
    assert_eq!(bench.client.counters().duplicated, 1);
}

#[test]
fn a_server_without_block_transfer_is_asked_segment_by_segment() {
    let mut bench = Bench::read(NAME, Method::Block);
    bench
        .sends(&["A40810007F000000"])
        .hears("8008100001000405")
        .sends(&["4008100000000000"])
        .hears("4108100001000000")
        .sends(&["6000000000000000"])
        .hears("0D41000000000000")
        .reads(b"A");
    Bench::write(NAME, b"ABCDE", Method::Block)
        .sends(&["C608100005000000"])
        .hears("8008100001000405")
        .sends(&["2108100005000000"]);
}

#[test]
fn a_server_may_answer_a_block_read_in_the_ordinary_way() {
    Bench::read(MODE, Method::Block)
        .sends(&["A46060007F000000"])
        .hears("4F60600006000000")
        .reads(&[6]);
}

#[test]
fn a_wrong_block_checksum_is_aborted() {
    Bench::read(DATA, Method::Block)
        .sends(&["A4501F017F000000"])
        .hears("C6501F0101000000")
        .sends(&["A300000000000000"])
        .hears("8131000000000000")
        .sends(&["A2017F0000000000"])
        .hears("D9FFFF0000000000")
        .sends(&["80501F0104000405"])
        .fails_with(AbortCode::CrcMismatch);
}

#[test]
fn an_impossible_block_size_is_aborted() {
    Bench::write(DATA, b"123456789", Method::Block)
        .sends(&["C6501F0109000000"])
        .hears("A4501F0100000000")
        .sends(&["80501F0102000405"])
        .fails_with(AbortCode::InvalidBlockSize);
}

#[test]
fn confirming_more_segments_than_were_sent_is_aborted() {
    Bench::write(DATA, b"123456789", Method::Block)
        .sends(&["C6501F0109000000"])
        .hears("A4501F017F000000")
        .sends(&["0131323334353637", "8238390000000000"])
        .hears("A2057F0000000000")
        .sends(&["80501F0103000405"])
        .fails_with(AbortCode::InvalidSequence);
}

#[test]
fn a_server_that_takes_no_segment_at_all_is_given_up() {
    let mut bench = Bench::write(DATA, b"1", Method::Block);
    bench.sends(&["C6501F0101000000"]).hears("A4501F017F000000");
    for _ in 0..8 {
        bench.sends(&["8131000000000000"]).hears("A2007F0000000000");
    }
    bench
        .sends(&["8131000000000000"])
        .hears("A2007F0000000000")
        .sends(&["80501F0103000405"])
        .fails_with(AbortCode::InvalidSequence);
}

// The fault matrix.

#[test]
fn the_late_reply_to_a_write_that_timed_out_does_not_complete_the_next_write() {
    let mut bench = Bench::write(MODE, &[6], Method::Auto);
    bench
        .sends(&["2F60600006000000"])
        .passes_ms(500)
        .sends(&["8060600000000405"])
        .fails(|failure| matches!(failure, SdoFailure::TimedOut { attempts: 1, .. }));
    let now = bench.now;
    bench.client.write(now, MODE, &[1], Method::Auto).unwrap();
    // The reply to the first write, 200 ms after the second was asked for.
    bench.passes_ms(200).hears("6060600000000000").still_waits();
    assert_eq!(bench.client.counters().late, 1);
    // And once more, just before the fence's answer.
    bench
        .passes_ms(300)
        .sends(&[FENCE_ASKED])
        .hears("6060600000000000")
        .still_waits()
        .hears(FENCE_ANSWERED)
        .sends(&["2F60600001000000"])
        .still_waits()
        .hears("6060600000000000")
        .is_written();
    assert_eq!(bench.client.counters().late, 2);
}

#[test]
fn a_write_that_the_server_never_executed_does_not_succeed_by_an_old_reply() {
    let mut bench = Bench::write(MODE, &[6], Method::Auto);
    bench.sends(&["2F60600006000000"]).passes_ms(500);
    bench.client.poll_outcome();
    bench.client.poll_transmit();
    let now = bench.now;
    bench.client.write(now, MODE, &[1], Method::Auto).unwrap();
    bench.hears("6060600000000000");
    // The server answers nothing more, not even the fence: the second write never went out.
    bench
        .passes_ms(500)
        .sends(&[FENCE_ASKED])
        .passes_ms(500)
        .sends(&["8000100000000405"])
        .fails(|failure| matches!(failure, SdoFailure::TimedOut { object: MODE, .. }));
}

#[test]
fn an_own_time_out_is_told_to_the_server_with_the_right_object() {
    Bench::read(Object::new(0x6099, 2), Method::Auto)
        .sends(&["4099600200000000"])
        .passes_ms(499)
        .still_waits()
        .passes_ms(1)
        .sends(&["8099600200000405"])
        .fails(|failure| {
            matches!(
                failure,
                SdoFailure::TimedOut { waited, awaited: "answer to a read", .. }
                    if *waited == Duration::from_millis(500)
            )
        });
}

#[test]
fn a_wrong_toggle_on_the_second_segment_is_aborted_with_the_right_object() {
    Bench::read(NAME, Method::Auto)
        .sends(&["4008100000000000"])
        .hears("4108100015000000")
        .sends(&["6000000000000000"])
        .hears("0041424344454647")
        .sends(&["7000000000000000"])
        .hears("0048494A4B4C4D4E")
        .sends(&["8008100000000305"])
        .fails_with(AbortCode::ToggleNotAlternated);
}

#[test]
fn a_wrong_toggle_on_the_first_confirmation_of_a_write_is_aborted() {
    Bench::write(NAME, b"ABCDEFGHIJ", Method::Auto)
        .sends(&["210810000A000000"])
        .hears("6008100000000000")
        .sends(&["0041424344454647"])
        .hears("3000000000000000")
        .sends(&["8008100000000305"])
        .fails_with(AbortCode::ToggleNotAlternated);
}

#[test]
fn a_read_whose_every_reply_comes_twice_gives_the_right_data() {
    let mut bench = Bench::read(NAME, Method::Auto);
    bench
        .sends(&["4008100000000000"])
        .hears("4108100015000000")
        .hears("4108100015000000")
        .sends(&["6000000000000000"])
        .hears("0041424344454647")
        .hears("0041424344454647")
        .sends(&["7000000000000000"])
        .hears("1048494A4B4C4D4E")
        .hears("1048494A4B4C4D4E")
        .sends(&["6000000000000000"])
        .hears("014F505152535455")
        .hears("014F505152535455")
        .reads(b"ABCDEFGHIJKLMNOPQRSTU");
    assert_eq!(bench.client.counters().duplicated, 3);
    assert_eq!(bench.client.counters().stale, 1);
}

#[test]
fn a_write_whose_every_confirmation_comes_twice_sends_each_segment_once() {
    let mut bench = Bench::write(NAME, b"ABCDEFGHIJ", Method::Auto);
    bench
        .sends(&["210810000A000000"])
        .hears("6008100000000000")
        .hears("6008100000000000")
        .sends(&["0041424344454647"])
        .hears("2000000000000000")
        .hears("2000000000000000")
        .sends(&["1948494A00000000"])
        .hears("3000000000000000")
        .is_written();
    assert_eq!(bench.client.counters().duplicated, 2);
}

#[test]
fn fewer_bytes_than_announced_are_aborted_as_too_short() {
    Bench::read(NAME, Method::Auto)
        .sends(&["4008100000000000"])
        .hears("4108100064000000")
        .sends(&["6000000000000000"])
        .hears("0141424344454647")
        .sends(&["8008100013000706"])
        .fails_with(AbortCode::LengthTooLow);
}

#[test]
fn more_bytes_than_announced_are_aborted_as_too_long() {
    Bench::read(NAME, Method::Auto)
        .sends(&["4008100000000000"])
        .hears("4108100005000000")
        .sends(&["6000000000000000"])
        .hears("0041424344454647")
        .sends(&["8008100012000706"])
        .fails_with(AbortCode::LengthTooHigh);
}

#[test]
fn a_block_of_the_wrong_size_is_aborted() {
    let dialog = |announced: &str, end: &str| {
        let mut bench = Bench::read(DATA, Method::Block);
        bench
            .sends(&["A4501F017F000000"])
            .hears(announced)
            .sends(&["A300000000000000"])
            .hears("8131323334353637")
            .sends(&["A2017F0000000000"])
            .hears(end);
        bench
    };
    dialog("C6501F0108000000", "C100000000000000").fails_with(AbortCode::LengthTooLow);
    dialog("C6501F0106000000", "C100000000000000").fails_with(AbortCode::LengthTooHigh);
}

#[test]
fn an_announced_size_beyond_all_reason_is_refused() {
    Bench::read(NAME, Method::Auto)
        .sends(&["4008100000000000"])
        .hears("41081000FFFFFFFF")
        .sends(&["8008100005000405"])
        .fails_with(AbortCode::OutOfMemory);
}

#[test]
fn a_reply_for_another_index_is_ignored_and_the_right_one_taken() {
    let mut bench = Bench::read(NAME, Method::Auto);
    bench
        .sends(&["4008100000000000"])
        .hears("4F09100041000000")
        .still_waits()
        .hears("4F08100142000000")
        .still_waits()
        .hears("4F08100043000000")
        .reads(b"C");
    assert_eq!(bench.client.counters().mismatched, 2);
}

#[test]
fn a_short_reply_is_ignored_and_the_right_one_taken() {
    let mut bench = Bench::read(NAME, Method::Auto);
    bench
        .sends(&["4008100000000000"])
        .hears("4F0810")
        .still_waits()
        .hears("4F08100043000000")
        .reads(b"C");
    assert_eq!(bench.client.counters().short, 1);
}

#[test]
fn a_reply_of_an_unexpected_kind_is_ignored_and_the_right_one_taken() {
    let mut bench = Bench::read(NAME, Method::Auto);
    bench
        .sends(&["4008100000000000"])
        .hears("6008100000000000")
        .hears("0041424344454647")
        .hears("E008100000000000")
        .still_waits()
        .hears("4F08100043000000")
        .reads(b"C");
    assert_eq!(bench.client.counters().unexpected, 3);
}

#[test]
fn ignored_frames_do_not_prolong_the_wait() {
    let mut bench = Bench::read(NAME, Method::Auto);
    bench.sends(&["4008100000000000"]);
    for _ in 0..4 {
        bench.passes_ms(100).hears("4F09100041000000");
    }
    bench.passes_ms(100).sends(&["8008100000000405"]);
}

#[test]
fn an_abort_by_the_server_is_decoded() {
    Bench::write(MODE, &[6], Method::Auto)
        .sends(&["2F60600006000000"])
        .hears("8060600022000008")
        .fails(|failure| {
            *failure
                == SdoFailure::Aborted {
                    object: MODE,
                    code: AbortCode::DeviceState,
                }
        });
}

#[test]
fn an_abort_in_the_middle_of_a_block_is_decoded() {
    Bench::read(DATA, Method::Block)
        .sends(&["A4501F017F000000"])
        .hears("C6501F0115000000")
        .sends(&["A300000000000000"])
        .hears("0101010101010101")
        .hears("80501F0100000606")
        .fails(|failure| {
            let code = AbortCode::HardwareError;
            *failure == SdoFailure::Aborted { object: DATA, code }
        });
}

#[test]
fn an_abort_for_another_object_is_ignored() {
    let mut bench = Bench::read(NAME, Method::Auto);
    bench
        .sends(&["4008100000000000"])
        .hears("8009100000000206")
        .still_waits();
    assert_eq!(bench.client.counters().mismatched, 1);
}

#[test]
fn a_flood_after_an_abort_is_drained_and_never_taken_for_an_answer() {
    let mut bench = Bench::read(NAME, Method::Auto);
    bench.sends(&["4008100000000000"]).passes_ms(500);
    bench.client.poll_outcome();
    bench.sends(&["8008100000000405"]);
    let now = bench.now;
    bench.client.read(now, NAME, Method::Auto).unwrap();
    for _ in 0..100 {
        bench.passes_ms(10).hears("8008100001000405").still_waits();
    }
    bench
        .passes_ms(20)
        .sends(&[FENCE_ASKED])
        .hears("8008100001000405")
        .hears(FENCE_ANSWERED)
        .sends(&["4008100000000000"])
        .hears("4F08100043000000")
        .reads(b"C");
    assert_eq!(bench.client.counters().late, 101);
}

#[test]
fn a_flood_that_never_ends_does_not_hold_the_client_for_ever() {
    let mut bench = Bench::read(NAME, Method::Auto);
    bench.sends(&["4008100000000000"]).passes_ms(500);
    bench.client.poll_outcome();
    bench.client.poll_transmit();
    let now = bench.now;
    bench.client.read(now, NAME, Method::Auto).unwrap();
    let failed = (0..1000).any(|_| {
        bench.passes_ms(5).hears("8008100001000405");
        bench.client.poll_transmit();
        bench.client.poll_outcome().is_some()
    });
    assert!(failed);
}

#[test]
fn a_repeated_abort_by_the_server_does_not_hit_the_next_transfer() {
    let mut bench = Bench::read(NAME, Method::Auto);
    bench
        .sends(&["4008100000000000"])
        .hears("8008100000000206")
        .fails(|failure| matches!(failure, SdoFailure::Aborted { .. }));
    let now = bench.now;
    bench.client.read(now, NAME, Method::Auto).unwrap();
    bench
        .sends(&[FENCE_ASKED])
        .hears("8008100000000206")
        .hears(FENCE_ANSWERED)
        .sends(&["4008100000000000"])
        .still_waits();
}

#[test]
fn a_fence_reads_neither_the_suspect_object_nor_the_next_one() {
    let mut bench = Bench::read(Object::new(0x1000, 0), Method::Auto);
    bench.sends(&["4000100000000000"]).passes_ms(500);
    bench.client.poll_outcome();
    bench.client.poll_transmit();
    let now = bench.now;
    let next = Object::new(0x1001, 0);
    bench.client.read(now, next, Method::Auto).unwrap();
    bench
        .passes_ms(500)
        .sends(&["4018100000000000"])
        .hears("4F18100004000000")
        .sends(&["4001100000000000"]);
}

#[test]
fn a_retry_begins_the_whole_transfer_anew_after_abort_drain_and_fence() {
    let mut bench = Bench::new(Retry::UpTo(1));
    bench.client.read(Time::ZERO, NAME, Method::Auto).unwrap();
    bench
        .sends(&["4008100000000000"])
        .hears("410810000A000000")
        .sends(&["6000000000000000"])
        .hears("0041424344454647")
        .sends(&["7000000000000000"])
        .passes_ms(500)
        // Never the segment request again: it might fetch the next segment.
        .sends(&["8008100000000405"])
        .passes_the_fence()
        .sends(&["4008100000000000"])
        .hears("4F08100043000000")
        .reads(b"C");
    assert_eq!(bench.client.counters().retries, 1);
}

#[test]
fn retries_end_after_the_number_allowed() {
    let mut bench = Bench::new(Retry::UpTo(1));
    bench.client.read(Time::ZERO, NAME, Method::Auto).unwrap();
    bench
        .sends(&["4008100000000000"])
        .passes_ms(500)
        .sends(&["8008100000000405"])
        .passes_the_fence()
        .sends(&["4008100000000000"])
        .passes_ms(500)
        .sends(&["8008100000000405"])
        .fails(|failure| matches!(failure, SdoFailure::TimedOut { attempts: 2, .. }));
}

#[test]
fn a_write_is_never_sent_twice_unless_it_is_called_idempotent() {
    let mut bench = Bench::new(Retry::UpTo(5));
    bench
        .client
        .write(Time::ZERO, MODE, &[6], Method::Auto)
        .unwrap();
    bench
        .sends(&["2F60600006000000"])
        .passes_ms(500)
        .sends(&["8060600000000405"])
        .fails(|failure| matches!(failure, SdoFailure::TimedOut { attempts: 1, .. }));
    let now = bench.now;
    let again = bench.client.write_idempotent(now, MODE, &[6], Method::Auto);
    assert_eq!(again, Ok(()));
    bench
        .passes_the_fence()
        .sends(&["2F60600006000000"])
        .passes_ms(500)
        .sends(&["8060600000000405"])
        .passes_the_fence()
        .sends(&["2F60600006000000"]);
}

#[test]
fn a_busy_server_is_asked_again_after_a_pause() {
    let mut bench = Bench::new(Retry::UpTo(1));
    let now = bench.now;
    let begun = bench.client.write_idempotent(now, MODE, &[6], Method::Auto);
    assert_eq!(begun, Ok(()));
    bench
        .sends(&["2F60600006000000"])
        .hears("8060600022000008")
        .still_waits()
        .passes_ms(20)
        .sends(&[FENCE_ASKED])
        .hears(FENCE_ANSWERED)
        .sends(&["2F60600006000000"])
        .hears("6060600000000000")
        .is_written();
}

#[test]
fn an_object_that_does_not_exist_is_not_asked_for_again() {
    let mut bench = Bench::new(Retry::UpTo(5));
    bench.client.read(Time::ZERO, NAME, Method::Auto).unwrap();
    bench
        .sends(&["4008100000000000"])
        .hears("8008100000000206")
        .fails(|failure| matches!(failure, SdoFailure::Aborted { .. }))
        .still_waits();
}

#[test]
fn frames_without_a_transfer_are_counted_as_stale() {
    let mut bench = Bench::new(Retry::Never);
    bench.hears("4F08100043000000").still_waits();
    assert_eq!(bench.client.counters().stale, 1);
}

#[test]
fn other_nodes_and_identifiers_are_not_touched() {
    let mut client = SdoClient::new(NODE, Timeouts::default());
    for id in [0x583, 0x602, 0x182] {
        assert!(!client.handle_frame(Time::ZERO, &CanFrame::standard(id, &[0; 8])));
    }
    assert_eq!(client.counters(), Counters::default());
}

#[test]
fn one_transfer_runs_at_a_time() {
    let mut bench = Bench::read(NAME, Method::Auto);
    let second = bench.client.read(Time::ZERO, MODE, Method::Auto);
    assert_eq!(second, Err(Busy));
}

#[test]
fn a_cancelled_transfer_is_aborted_and_leaves_no_outcome() {
    let mut bench = Bench::read(NAME, Method::Auto);
    bench.sends(&["4008100000000000"]);
    bench.client.cancel(Time::ZERO);
    bench
        .sends(&["8008100000000008"])
        .hears("4F08100043000000")
        .still_waits();
    let now = bench.now;
    bench.client.read(now, NAME, Method::Auto).unwrap();
    bench.passes_ms(20).sends(&[FENCE_ASKED]);
}
