//! What the display's driver must and must not make of its answers.

use core::time::Duration;

use super::*;
use crate::device::Direction;
use proptest::prelude::*;

const IDENTIFICATION: &[u8] = b"\x02ND-287    \r\n646118-01 \r\nV1-01     \r\n";
const ASKS_WHO: &[u8] = b"\x1bA0000\r";
const ASKS_VALUE: &[u8] = b"\x02";

struct Bench {
    device: Nd287,
    now: Time,
}

impl Bench {
    fn new(settings: Nd287Settings) -> Self {
        let now = Time::from_seconds(2.0);
        let mut device = Nd287::new(settings);
        device.start(now);
        let mut bench = Self { device, now };
        assert_eq!(bench.sent(), [ASKS_WHO]);
        bench
    }

    /// One that counts from the value that it read first, 10 mm.
    fn running() -> Self {
        Self::running_with(Nd287Settings::default())
    }

    fn running_with(settings: Nd287Settings) -> Self {
        let mut bench = Self::new(settings);
        bench.answer(IDENTIFICATION);
        assert_eq!(bench.sent(), [ASKS_VALUE]);
        bench.answer(&shows("+", "10.0000"));
        assert_eq!(bench.device.poll_outcome(), Some(Ok(())));
        bench
    }

    fn sent(&mut self) -> Vec<Vec<u8>> {
        let payloads = core::iter::from_fn(|| self.device.poll_transmit());
        payloads
            .map(|payload| match payload {
                Payload::Bytes(bytes) => bytes,
                other => panic!("{other:?} on a serial line"),
            })
            .collect()
    }

    /// An answer 20 ms later.
    fn answer(&mut self, bytes: &[u8]) {
        self.now += Duration::from_millis(20);
        let input = Input::Payload(Payload::Bytes(bytes.to_vec()));
        self.device.handle(self.now, &input);
    }

    /// Lets time pass to the next deadline.
    fn wait(&mut self) {
        self.now = self.device.poll_timeout();
        self.device.handle_timeout(self.now);
    }

    /// The next value, when it is due.
    fn reads(&mut self, line: &[u8]) {
        self.wait();
        assert_eq!(self.sent(), [ASKS_VALUE]);
        self.answer(line);
    }

    fn latest_mm(&self) -> Option<f64> {
        self.device.latest().map(|reading| reading.vacuum.mm())
    }

    fn alarms(&mut self) -> Vec<Alarm> {
        core::iter::from_fn(|| self.device.poll_alarm()).collect()
    }

    fn counter(&self, name: &str) -> u64 {
        let counters = self.device.counters();
        counters.into_iter().find(|(n, _)| *n == name).unwrap().1
    }
}

fn shows(sign: &str, number: &str) -> Vec<u8> {
    format!("{sign}{number:>10}    \r\n").into_bytes()
}

#[track_caller]
fn check_mm(seen: Option<f64>, expected: f64) {
    let seen = seen.expect("a reading");
    assert!((seen - expected).abs() < 1e-9, "{seen} mm, not {expected}");
}

#[test]
fn the_start_asks_who_it_is_and_counts_from_the_first_value() {
    let mut bench = Bench::running();
    assert_eq!(bench.device.identity().unwrap().name, "ND-287");
    check_mm(bench.latest_mm(), 0.0);
    bench.reads(&shows("-", "2.5000"));
    check_mm(bench.latest_mm(), -12.5);
}

#[test]
fn values_keep_their_period_and_belong_to_their_request() {
    let mut bench = Bench::running();
    bench.wait();
    let asked = bench.now;
    assert_eq!(bench.sent(), [ASKS_VALUE]);
    bench.answer(&shows("+", "10.0010"));
    assert_eq!(bench.device.latest().unwrap().at, asked);
    bench.wait();
    assert_eq!(bench.now, asked + Duration::from_millis(100));
}

#[test]
fn a_reversed_scale_negates_and_inches_are_no_millimetres() {
    let direction = Direction::Reversed;
    let mut bench = Bench::running_with(Nd287Settings {
        direction,
        ..Nd287Settings::default()
    });
    bench.reads(&shows("+", "11.0000"));
    check_mm(bench.latest_mm(), -1.0);
    let mut bench = Bench::new(Nd287Settings::default());
    bench.answer(IDENTIFICATION);
    bench.sent();
    bench.answer(b"+    1.0000 \"  \r\n");
    assert_eq!(bench.device.poll_outcome(), Some(Ok(())));
    bench.reads(b"+    1.1000 \"  \r\n");
    check_mm(bench.latest_mm(), 2.54);
}

#[track_caller]
fn check_refused(answers: &[&[u8]], needs: &str) {
    let mut bench = Bench::new(Nd287Settings::default());
    for answer in answers {
        bench.answer(answer);
    }
    let Some(Err(error)) = bench.device.poll_outcome() else {
        panic!("{answers:?} was accepted")
    };
    assert!(error.to_string().contains(needs), "{error}");
}

#[test]
fn a_display_that_is_another_or_set_otherwise_is_not_started() {
    let other = b"\x02ND-731    \r\n246271-07 \r\nV1-01     \r\n";
    check_refused(&[other], "ND-28");
    check_refused(&[IDENTIFICATION, b"+   10.0000 G  \r\n"], "millimetres");
    check_refused(&[IDENTIFICATION, b"+   10.0000  =S\r\n"], "one input");
    check_refused(&[IDENTIFICATION, b"+   10.0000 ?  \r\n"], "good signals");
}

#[test]
fn a_start_without_an_answer_says_what_it_waited_for() {
    let mut bench = Bench::new(Nd287Settings::default());
    while bench.device.poll_timeout() != Time::NEVER {
        assert_eq!(bench.device.poll_outcome(), None);
        bench.wait();
    }
    assert!(bench.now >= Time::from_seconds(5.0), "three seconds");
    let Some(Err(error)) = bench.device.poll_outcome() else {
        panic!("no outcome")
    };
    assert!(error.to_string().contains("identification"), "{error}");
    assert_eq!(bench.device.poll_timeout(), Time::NEVER);
}

#[track_caller]
fn check_count_lost(line: &[u8], alarm: Alarm) {
    let mut bench = Bench::running();
    bench.device.begin_average(bench.now, 3);
    bench.reads(line);
    bench.reads(line);
    assert_eq!(bench.alarms(), [alarm], "told once");
    let outcome = bench.device.poll_outcome();
    assert!(matches!(outcome, Some(Err(DeviceError::Alarmed { .. }))));
    // The signals are good again, the count is not.
    bench.reads(&shows("+", "10.0000"));
    assert_eq!(bench.device.latest(), None);
    bench.device.begin_average(bench.now, 1);
    let refused = bench.device.poll_outcome();
    assert!(matches!(
        refused,
        Some(Err(DeviceError::NotPossible { .. }))
    ));
    bench.device.set_datum(bench.now);
    assert_eq!(bench.device.latest(), None, "the datum is the next value");
    bench.reads(&shows("+", "33.0000"));
    check_mm(bench.latest_mm(), 0.0);
}

#[test]
fn faulty_signals_and_another_setting_void_the_count_until_a_new_datum() {
    check_count_lost(b"+   10.0000 ?  \r\n", FAULTY);
    check_count_lost(b"+   10.0000 G  \r\n", SET_OTHERWISE);
    check_count_lost(b"+    0.3937 \"  \r\n", SET_OTHERWISE);
    check_count_lost(b"+   10.0000   S\r\n", SET_OTHERWISE);
    check_count_lost(b"+   10.0000   2\r\n", SET_OTHERWISE);
}

#[test]
fn a_damaged_digit_that_still_reads_as_a_value_is_no_number_and_a_preset_is_told() {
    let mut bench = Bench::running();
    bench.reads(&shows("+", "910.0000"));
    check_mm(bench.latest_mm(), 0.0);
    bench.reads(&shows("+", "10.0001"));
    check_mm(bench.latest_mm(), 1e-4);
    assert_eq!(bench.alarms(), []);
    for _ in 0..3 {
        bench.reads(&shows("+", "910.0000"));
    }
    assert_eq!(bench.alarms(), [JUMPED]);
    assert_eq!(bench.device.latest(), None);
}

#[test]
fn a_late_value_is_never_taken_for_the_present_one() {
    let mut bench = Bench::running();
    bench.wait();
    assert_eq!(bench.sent(), [ASKS_VALUE]);
    // It does not come, and the fence is asked for.
    bench.wait();
    assert_eq!(bench.sent(), [ASKS_WHO]);
    bench.answer(&shows("+", "10.0500"));
    check_mm(bench.latest_mm(), 0.0);
    bench.answer(IDENTIFICATION);
    assert_eq!(bench.sent(), [ASKS_VALUE]);
    bench.answer(&shows("+", "10.0700"));
    check_mm(bench.latest_mm(), 0.07);
    assert_eq!(bench.counter("old_answers"), 1);
    assert_eq!(bench.counter("late_answers"), 1);
}

#[test]
fn a_second_identification_is_an_old_answer() {
    let mut bench = Bench::new(Nd287Settings::default());
    bench.wait();
    bench.wait();
    assert_eq!(bench.sent(), [ASKS_WHO], "asked again");
    bench.answer(IDENTIFICATION);
    assert_eq!(bench.sent(), [ASKS_VALUE]);
    bench.answer(IDENTIFICATION);
    bench.answer(&shows("+", "1.0000"));
    assert_eq!(bench.device.poll_outcome(), Some(Ok(())));
    assert_eq!(bench.counter("damaged_lines"), 0);
}

#[test]
fn a_display_that_falls_silent_has_lost_its_count() {
    let mut bench = Bench::running();
    bench.wait();
    let asked = bench.now;
    while bench.now < asked + Duration::from_secs(1) {
        bench.wait();
    }
    let waited = Duration::from_secs(1);
    assert_eq!(bench.alarms(), [Alarm::StreamSilent { waited }]);
    assert_eq!(bench.device.latest(), None);
    while bench.sent() != [ASKS_WHO] {
        bench.wait();
    }
    bench.answer(IDENTIFICATION);
    bench.sent();
    bench.answer(&shows("+", "10.0000"));
    assert_eq!(bench.device.latest(), None, "it counts from elsewhere");
}

/// Fences that are answered are no values.
#[test]
fn a_display_that_says_who_it_is_and_gives_no_value_has_lost_its_count() {
    let mut bench = Bench::running();
    let read = bench.now;
    while bench.now < read + Duration::from_secs(2) && bench.device.latest().is_some() {
        bench.wait();
        match &bench.sent()[..] {
            [asked] if asked == ASKS_WHO => bench.answer(IDENTIFICATION),
            [asked] if asked == ASKS_VALUE => bench.answer(b"+   10.0x00    \r\n"),
            _ => {}
        }
    }
    let silent = |it: &Alarm| matches!(it, Alarm::StreamSilent { .. });
    assert!(bench.alarms().iter().any(silent));
    assert_eq!(bench.device.latest(), None);
}

/// Two fences look alike: a second one is asked when nothing is left to come.
#[test]
fn a_fence_that_is_late_is_waited_out_and_no_value_is_taken_for_another() {
    let mut bench = Bench::running();
    bench.wait();
    assert_eq!(bench.sent(), [ASKS_VALUE]);
    bench.wait();
    assert_eq!(bench.sent(), [ASKS_WHO]);
    bench.wait();
    assert_eq!(bench.sent(), Vec::<Vec<u8>>::new(), "nothing is asked");
    let late = bench.now;
    bench.answer(&shows("+", "10.0500"));
    bench.answer(IDENTIFICATION);
    bench.wait();
    assert_eq!(bench.sent(), [ASKS_WHO]);
    assert!(bench.now >= late + Duration::from_millis(300));
    check_mm(bench.latest_mm(), 0.0);
}

#[test]
fn another_setting_stays_refused_until_it_is_set_back_or_started_again() {
    let mut bench = Bench::running();
    bench.reads(b"+   10.0000   2\r\n");
    bench.device.set_datum(bench.now);
    bench.reads(b"+   10.0000   2\r\n");
    assert_eq!(bench.device.latest(), None);
    assert_eq!(bench.alarms(), [SET_OTHERWISE, SET_OTHERWISE]);
    bench.device.set_datum(bench.now);
    bench.reads(&shows("+", "10.0000"));
    check_mm(bench.latest_mm(), 0.0);
}

#[test]
fn garbage_costs_its_own_line_and_much_of_it_an_alarm() {
    let mut bench = Bench::running();
    bench.wait();
    bench.sent();
    bench.answer(b"+10.0\xff\x00\r\n");
    bench.answer(&shows("+", "10.0020"));
    check_mm(bench.latest_mm(), 0.002);
    bench.wait();
    bench.sent();
    for _ in 0..6 {
        bench.answer(b"nonsense that is longer\r\n");
    }
    assert_eq!(bench.alarms(), [Alarm::Garbage { lines: 5 }]);
}

#[test]
fn an_average_takes_what_was_asked_after_its_beginning() {
    let mut bench = Bench::running();
    bench.wait();
    bench.sent();
    bench.now += Duration::from_millis(5);
    bench.device.begin_average(bench.now, 2);
    bench.answer(&shows("+", "19.0000"));
    bench.reads(&shows("+", "19.0010"));
    assert_eq!(bench.device.poll_outcome(), None);
    bench.reads(&shows("+", "19.0030"));
    assert_eq!(bench.device.poll_outcome(), Some(Ok(())));
    let reading = bench.device.average().unwrap();
    check_mm(Some(reading.vacuum.mm()), 9.002);
    assert_eq!(reading.samples, 2);
}

#[test]
fn a_datum_is_not_a_value_that_was_asked_for_before() {
    let mut bench = Bench::running();
    bench.wait();
    bench.sent();
    bench.device.set_datum(bench.now);
    bench.answer(&shows("+", "10.5000"));
    assert_eq!(bench.device.latest(), None);
    assert_eq!(bench.sent(), [ASKS_VALUE], "asked again at once");
    bench.answer(&shows("+", "11.0000"));
    check_mm(bench.latest_mm(), 0.0);
}

proptest! {
    #[test]
    fn no_bytes_make_it_panic_or_read_what_was_not_shown(
        runs in prop::collection::vec(prop::collection::vec(any::<u8>(), 0..30), 0..20),
    ) {
        let mut bench = Bench::running();
        for run in runs {
            bench.wait();
            bench.answer(&run);
        }
        if let Some(reading) = bench.device.latest() {
            prop_assert!(reading.vacuum.is_finite());
        }
    }
}
