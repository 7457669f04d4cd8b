//! What the module's driver must and must not make of its answers.

use super::*;
use proptest::prelude::*;

struct Bench {
    device: Dcon,
    now: Time,
}

fn settings() -> DconSettings {
    DconSettings::new(1, InputRange::V5, vec![0, 1])
}

impl Bench {
    fn new(settings: DconSettings) -> Self {
        let device = Dcon::new(settings);
        let now = Time::from_seconds(2.0);
        let mut bench = Self { device, now };
        bench.device.start(now);
        assert_eq!(bench.sent(), ["", "$01M"]);
        bench
    }

    fn running() -> Self {
        let mut bench = Self::new(settings());
        bench.answer("!014117");
        assert_eq!(bench.sent(), ["$012"]);
        bench.answer("!01090600");
        assert_eq!(bench.sent(), ["#01"]);
        bench.answer(">+1.0000-2.5000");
        assert_eq!(bench.device.poll_outcome(), Some(Ok(())));
        bench
    }

    fn sent(&mut self) -> Vec<String> {
        let payloads = core::iter::from_fn(|| self.device.poll_transmit());
        payloads
            .map(|payload| {
                let Payload::Bytes(mut bytes) = payload else {
                    panic!("a frame on a serial line")
                };
                assert_eq!(bytes.pop(), Some(CR));
                String::from_utf8(bytes).unwrap()
            })
            .collect()
    }

    /// An answer 5 ms later.
    fn answer(&mut self, line: &str) {
        self.now += Duration::from_millis(5);
        let input = Input::Payload(Payload::Bytes(format!("{line}\r").into_bytes()));
        self.device.handle(self.now, &input);
    }

    /// Lets time pass to the next deadline.
    fn wait(&mut self) {
        self.now = self.device.poll_timeout();
        self.device.handle_timeout(self.now);
    }

    fn ask(&mut self) {
        self.wait();
        assert_eq!(self.sent(), ["#01"]);
    }

    fn volts(&self) -> Vec<f64> {
        let reading = self.device.reading().expect("a reading");
        reading.volts.iter().map(|volts| volts.value()).collect()
    }

    fn counter(&self, name: &str) -> u64 {
        let counters = self.device.counters();
        counters.into_iter().find(|(n, _)| *n == name).unwrap().1
    }

    fn alarms(&mut self) -> Vec<Alarm> {
        core::iter::from_fn(|| self.device.poll_alarm()).collect()
    }
}

#[test]
fn the_start_asks_name_and_configuration_and_reads_once() {
    let mut bench = Bench::running();
    assert_eq!(bench.volts(), [1.0, -2.5]);
    assert_eq!(bench.device.identity().unwrap().name, "4117");
    assert_eq!(bench.sent(), Vec::<String>::new());
}

#[test]
fn readings_keep_their_period() {
    let mut bench = Bench::running();
    bench.ask();
    let first = bench.now;
    bench.answer(">+1.0001-2.5001");
    bench.ask();
    assert_eq!(bench.now, first + Duration::from_millis(100));
}

#[track_caller]
fn check_refused(configuration: &str, needs: &str) {
    let mut bench = Bench::new(settings());
    bench.answer("!014117");
    bench.answer(configuration);
    let Some(Err(error)) = bench.device.poll_outcome() else {
        panic!("{configuration} was accepted")
    };
    assert!(error.to_string().contains(needs), "{error}");
    assert_eq!(bench.device.poll_timeout(), Time::NEVER);
}

#[test]
fn a_module_set_otherwise_is_refused() {
    check_refused("!01090601", "engineering units");
    check_refused("!01080600", "input range");
    check_refused("!01090640", "checksum");
}

#[test]
fn another_module_than_the_one_named_is_refused() {
    let name = Some("4017".to_owned());
    let mut bench = Bench::new(DconSettings { name, ..settings() });
    bench.answer("!014117");
    assert!(matches!(
        bench.device.poll_outcome(),
        Some(Err(DeviceError::NotPossible { .. }))
    ));
}

#[test]
fn a_module_with_too_few_channels_is_refused() {
    let channels = vec![0, 5];
    let mut bench = Bench::new(DconSettings {
        channels,
        ..settings()
    });
    bench.answer("!014117");
    bench.answer("!01090600");
    bench.answer(">+1.0000-2.5000");
    assert!(matches!(bench.device.poll_outcome(), Some(Err(_))));
}

#[test]
fn a_silent_module_is_asked_a_few_times_and_then_named() {
    let mut bench = Bench::new(settings());
    for _ in 0..3 {
        bench.wait();
        assert_eq!(bench.sent(), ["$01M"]);
    }
    bench.wait();
    let Some(Err(error)) = bench.device.poll_outcome() else {
        panic!("no outcome")
    };
    let text = error.to_string();
    assert!(text.contains("$AAM") && text.contains("800ms"), "{text}");
    assert_eq!(bench.device.poll_timeout(), Time::NEVER);
}

#[test]
fn a_late_answer_is_never_taken_for_the_present_one() {
    let mut bench = Bench::running();
    bench.ask();
    bench.wait();
    assert_eq!(bench.sent(), ["$01M"], "a fence");
    bench.answer(">+4.0000+4.0000");
    assert_eq!(bench.volts(), [1.0, -2.5]);
    assert_eq!(bench.counter("old_answers"), 1);
    bench.answer("!014117");
    assert_eq!(bench.sent(), ["#01"]);
    bench.answer(">+1.1000-2.6000");
    assert_eq!(bench.volts(), [1.1, -2.6]);
}

#[test]
fn answers_later_than_several_fences_are_old_all_the_same() {
    let mut bench = Bench::running();
    bench.ask();
    bench.wait();
    bench.wait();
    assert_eq!(bench.sent(), ["$01M", "$01M"]);
    // Everything comes at last: the value, the first fence, and behind it the second.
    bench.answer(">+4.0000+4.0000");
    bench.answer("!014117");
    assert_eq!(bench.sent(), ["#01"]);
    bench.answer("!014117");
    assert_eq!(bench.volts(), [1.0, -2.5]);
    bench.answer(">+1.2000-2.7000");
    assert_eq!(bench.volts(), [1.2, -2.7]);
}

#[test]
fn an_answer_that_nobody_asked_for_is_ignored() {
    let mut bench = Bench::running();
    bench.answer(">+4.0000+4.0000");
    assert_eq!(bench.volts(), [1.0, -2.5]);
    assert_eq!(bench.counter("old_answers"), 1);
}

#[test]
fn a_late_configuration_is_not_taken_for_a_name_nor_a_name_for_a_configuration() {
    let mut bench = Bench::new(settings());
    bench.wait();
    bench.answer("!014117");
    bench.sent();
    bench.answer("!014117");
    assert_eq!(bench.device.poll_outcome(), None);
    bench.wait();
    bench.answer("!01090600");
    assert_eq!(bench.sent(), ["$01M"]);
    bench.answer("!014117");
    assert_eq!(bench.sent(), ["$012"]);
    assert_eq!(bench.device.identity().unwrap().name, "4117");
}

#[test]
fn garbage_and_refusals_without_end_do_not_prolong_the_start() {
    for line in ["~~~~", "?01"] {
        let mut bench = Bench::new(settings());
        let begun = bench.now;
        let mut outcome = None;
        while outcome.is_none() && bench.now < begun + Duration::from_secs(2) {
            bench.answer(line);
            bench.device.handle_timeout(bench.now);
            outcome = bench.device.poll_outcome();
        }
        assert!(matches!(outcome, Some(Err(DeviceError::Timeout { .. }))));
        assert_eq!(bench.sent().len(), 3, "three retries");
    }
}

#[test]
fn an_echo_is_no_answer() {
    let mut bench = Bench::running();
    bench.ask();
    bench.answer("#01");
    bench.answer(">+1.3000-2.8000");
    assert_eq!(bench.volts(), [1.3, -2.8]);
    assert_eq!(bench.counter("echoes"), 1);
}

#[test]
fn damaged_answers_are_counted_and_several_raise_an_alarm() {
    let mut bench = Bench::running();
    for _ in 0..5 {
        bench.ask();
        bench.answer(">+4.00x0+4.0000");
        bench.wait();
        assert_eq!(bench.sent(), ["$01M"]);
        bench.answer("!014117");
        bench.sent();
        bench.answer(">+1.0000-2.5000");
    }
    assert_eq!(bench.counter("damaged_lines"), 5);
    assert_eq!(bench.alarms(), []);
    bench.ask();
    for _ in 0..7 {
        bench.answer("~~~~");
    }
    assert_eq!(bench.alarms(), [Alarm::Garbage { lines: 5 }]);
    assert_eq!(bench.volts(), [1.0, -2.5]);
}

#[test]
fn a_wrong_checksum_is_damage() {
    let mut bench = Bench {
        device: Dcon::new(DconSettings {
            checksum: true,
            ..settings()
        }),
        now: Time::ZERO,
    };
    bench.device.start(bench.now);
    assert_eq!(bench.sent(), ["", "$01MD2"]);
    bench.answer("!0141170F");
    assert_eq!(bench.counter("damaged_lines"), 1);
    let line = String::from_utf8(frame("!014117", true)).unwrap();
    bench.answer(line.trim_end());
    assert_eq!(bench.device.identity().unwrap().name, "4117");
}

#[test]
fn over_range_is_flagged_for_its_channel() {
    let mut bench = Bench::running();
    bench.ask();
    bench.answer(">+9.9999-2.5000");
    let reading = bench.device.reading().unwrap();
    assert_eq!(reading.saturated, [true, false]);
    assert_eq!(bench.volts(), [5.0, -2.5]);
}

#[test]
fn a_module_that_falls_silent_raises_an_alarm_once_and_is_asked_on() {
    let mut bench = Bench::running();
    let silent_since = bench.now;
    while bench.now < silent_since + Duration::from_secs(3) {
        bench.wait();
    }
    let waited = Duration::from_secs(1);
    assert_eq!(bench.alarms(), [Alarm::StaleSample { waited }]);
    assert!(bench.sent().len() > 5);
    bench.answer("!014117");
    bench.answer(">+1.4000-2.5000");
    assert_eq!(bench.volts(), [1.4, -2.5]);
}

#[test]
fn a_module_plugged_in_again_is_checked_again() {
    let mut bench = Bench::running();
    bench
        .device
        .handle(bench.now, &Input::Link(LinkState::Gone));
    bench.device.handle(bench.now, &Input::Link(LinkState::Up));
    assert_eq!(bench.sent(), ["$01M"]);
    bench.answer("!014117");
    assert_eq!(bench.sent(), ["$012"]);
}

proptest! {
    #[test]
    fn no_bytes_make_it_panic(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        let mut bench = Bench::running();
        bench.ask();
        let input = Input::Payload(Payload::Bytes(bytes));
        bench.device.handle(bench.now, &input);
        bench.wait();
    }
}
