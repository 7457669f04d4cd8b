//! What the interferometer must and must not make of its stream.

use super::*;
use crate::device::{Direction, SignalTrouble};
use proptest::prelude::*;

const REFERENCE: u32 = 2_458;
/// One sample at the default rate.
const SAMPLE: Duration = Duration::from_micros(1_638);

struct Bench {
    device: Umd2,
    now: Time,
    sample: Sample,
}

impl Bench {
    fn new(settings: Umd2Settings) -> Self {
        let sample = Sample {
            reference_count: REFERENCE,
            measurement_count: REFERENCE,
            distance: 1_000,
            velocity: 0,
            phase: 0,
            sequence: 500_000,
            low_speed: LowSpeed::None,
        };
        let device = Umd2::new(settings);
        let now = Time::from_seconds(1.0);
        Self {
            device,
            now,
            sample,
        }
    }

    /// Samples that arrive at once.
    fn started() -> Self {
        Self::started_with(Umd2Settings {
            arrival_latency: Duration::ZERO,
            ..Umd2Settings::default()
        })
    }

    fn started_with(settings: Umd2Settings) -> Self {
        let mut bench = Self::new(settings);
        bench.device.start(bench.now);
        // A stream is joined in the middle of a line.
        bench.bytes(b"58 2458 0 0\n");
        for _ in 0..settings.start_samples {
            bench.next();
        }
        assert_eq!(bench.device.poll_outcome(), Some(Ok(())));
        bench
    }

    fn bytes(&mut self, bytes: &[u8]) {
        let input = Input::Payload(Payload::Bytes(bytes.to_vec()));
        self.device.handle(self.now, &input);
    }

    /// The next sample, as `self.sample` says.
    fn next(&mut self) {
        self.now += SAMPLE;
        self.sample.sequence = self.sample.sequence.wrapping_add(1);
        let line = self.sample.emit();
        self.bytes(line.as_bytes());
    }

    fn at(&mut self, distance: i64) {
        self.sample.distance = distance;
        self.next();
    }

    fn alarms(&mut self) -> Vec<Alarm> {
        core::iter::from_fn(|| self.device.poll_alarm()).collect()
    }

    fn latest_nm(&self) -> Option<f64> {
        self.device.latest().map(|reading| reading.vacuum.nm())
    }
}

/// Half a wavelength at n = 1.
const HALF_NM: f64 = 316.495_686;

#[track_caller]
fn check_nm(seen: Option<f64>, expected: f64) {
    let seen = seen.expect("a reading");
    assert!((seen - expected).abs() < 1e-3, "{seen} nm, not {expected}");
}

#[test]
fn displacement_counts_half_wavelengths_from_the_datum_with_the_phase_subtracted() {
    let mut bench = Bench::started();
    check_nm(bench.latest_nm(), 0.0);
    bench.sample.phase = 64;
    bench.at(1_010);
    check_nm(bench.latest_nm(), 9.75 * HALF_NM);
}

#[test]
fn double_pass_optics_divide_and_a_reversed_beam_negates() {
    let settings = Umd2Settings {
        optics_factor: 2,
        direction: Direction::Reversed,
        ..Umd2Settings::default()
    };
    let mut bench = Bench::started_with(settings);
    bench.at(1_010);
    check_nm(bench.latest_nm(), -5.0 * HALF_NM);
}

#[test]
fn a_new_datum_reads_zero_from_now_on() {
    let mut bench = Bench::started();
    bench.at(1_010);
    bench.device.set_datum(bench.now);
    check_nm(bench.latest_nm(), 0.0);
    bench.at(1_011);
    check_nm(bench.latest_nm(), HALF_NM);
}

#[track_caller]
fn check_count_lost(change: impl Fn(&mut Sample), alarm: Alarm) {
    let mut bench = Bench::started();
    bench.device.begin_average(bench.now, 5);
    let good = bench.sample;
    change(&mut bench.sample);
    bench.next();
    bench.next();
    assert_eq!(bench.alarms(), [alarm], "told once");
    let outcome = bench.device.poll_outcome();
    let Some(Err(DeviceError::Alarmed { alarm: cause, .. })) = outcome else {
        panic!("{outcome:?}")
    };
    assert_eq!(cause, alarm);
    // The beam comes back, the count does not.
    bench.sample = Sample {
        sequence: bench.sample.sequence,
        ..good
    };
    bench.next();
    assert_eq!(bench.device.latest(), None);
    bench.device.begin_average(bench.now, 1);
    let refused = bench.device.poll_outcome();
    assert!(matches!(
        refused,
        Some(Err(DeviceError::NotPossible { .. }))
    ));
    bench.device.set_datum(bench.now);
    assert_eq!(bench.device.latest(), None, "the datum is the next sample");
    bench.at(4_000);
    check_nm(bench.latest_nm(), 0.0);
}

#[test]
fn a_lost_beam_a_lost_laser_and_a_slew_error_void_the_count_until_a_new_datum() {
    check_count_lost(|sample| sample.measurement_count = 0, Alarm::BeamLost);
    check_count_lost(|sample| sample.reference_count = 0, Alarm::LaserLost);
    check_count_lost(
        |sample| sample.measurement_count = 2 * REFERENCE + 1,
        Alarm::SlewError,
    );
    check_count_lost(|sample| sample.measurement_count = 3, Alarm::SlewError);
}

#[test]
fn a_datum_set_while_the_beam_is_blocked_is_voided_again() {
    let mut bench = Bench::started();
    bench.sample.measurement_count = 0;
    bench.next();
    bench.device.set_datum(bench.now);
    bench.next();
    assert_eq!(bench.alarms(), [Alarm::BeamLost, Alarm::BeamLost]);
    bench.sample.measurement_count = REFERENCE;
    bench.next();
    assert_eq!(bench.device.latest(), None);
}

#[test]
fn a_weak_signal_counts_as_a_lost_beam() {
    let settings = Umd2Settings {
        signal_strength_min: Some(200),
        ..Umd2Settings::default()
    };
    let mut bench = Bench::started_with(settings);
    bench.sample.low_speed = LowSpeed::SignalStrength(200);
    bench.next();
    assert_eq!(bench.alarms(), []);
    bench.sample.low_speed = LowSpeed::SignalStrength(199);
    bench.next();
    assert_eq!(bench.alarms(), [Alarm::BeamLost]);
    assert_eq!(bench.device.latest(), None);
}

/// Whoever aligns the optics looks before anything counts.
#[test]
fn the_strength_of_the_signal_is_told_before_the_start_and_while_the_beam_is_lost() {
    let mut bench = Bench::new(Umd2Settings {
        signal_strength_min: Some(200),
        ..Umd2Settings::default()
    });
    assert_eq!(bench.device.signal(), None);
    bench.bytes(b"58 2458 0 0\n");
    for strength in [150, 260] {
        bench.sample.low_speed = LowSpeed::SignalStrength(strength);
        bench.next();
        let signal = bench.device.signal().unwrap();
        assert_eq!((signal.strength, signal.least), (Some(strength), Some(200)));
        let trouble = (strength < 200).then_some(SignalTrouble::Weak);
        assert_eq!(signal.trouble, trouble);
    }
    assert_eq!(bench.alarms(), []);
}

#[test]
fn what_is_wrong_with_the_signal_is_told_by_the_newest_sample() {
    type Spoil = fn(&mut Sample);
    let mut bench = Bench::new(Umd2Settings::default());
    let cases: [(Spoil, Option<SignalTrouble>); 5] = [
        (|_| {}, None),
        (
            |it| it.reference_count = 0,
            Some(SignalTrouble::NoReference),
        ),
        (|it| it.measurement_count = 0, Some(SignalTrouble::NoBeam)),
        (|it| it.measurement_count *= 3, Some(SignalTrouble::Beat)),
        (|it| it.phase |= 0x0200, Some(SignalTrouble::NoPhase)),
    ];
    for (spoil, trouble) in cases {
        let good = bench.sample;
        spoil(&mut bench.sample);
        bench.next();
        bench.sample = Sample {
            sequence: bench.sample.sequence,
            ..good
        };
        let signal = bench.device.signal().expect("it has spoken");
        assert_eq!((signal.trouble, signal.strength), (trouble, None));
        assert_eq!(signal.at, bench.now);
    }
}

#[test]
fn an_average_gives_mean_and_standard_deviation() {
    let mut bench = Bench::started();
    bench.device.begin_average(bench.now, 4);
    for distance in [1_000, 1_002, 1_004, 1_006] {
        assert_eq!(bench.device.poll_outcome(), None);
        bench.at(distance);
    }
    assert_eq!(bench.device.poll_outcome(), Some(Ok(())));
    let reading = bench.device.average().unwrap();
    check_nm(Some(reading.vacuum.nm()), 3.0 * HALF_NM);
    // Of 0, 2, 4, 6 about 3: sqrt(20 / 3).
    let expected = (20.0_f64 / 3.0).sqrt() * HALF_NM;
    check_nm(Some(reading.standard_deviation.nm()), expected);
    assert_eq!((reading.samples, reading.at), (4, bench.now));
}

#[test]
fn samples_that_may_be_older_than_an_averages_beginning_are_left_out() {
    let mut bench = Bench::started_with(Umd2Settings::default());
    bench.device.begin_average(bench.now, 2);
    let begun = bench.now;
    for _ in 0..9 {
        bench.at(1_500);
        assert_eq!(bench.device.poll_outcome(), None);
    }
    assert!(bench.now < begun + Duration::from_millis(16));
    bench.at(1_010);
    bench.at(1_010);
    let reading = bench.device.average().unwrap();
    check_nm(Some(reading.vacuum.nm()), 10.0 * HALF_NM);
}

#[test]
fn an_average_with_too_many_samples_missing_fails() {
    let mut bench = Bench::started();
    bench.device.begin_average(bench.now, 4);
    bench.sample.sequence += 4;
    bench.next();
    bench.next();
    assert_eq!(bench.alarms(), []);
    bench.sample.phase = 0x0200;
    bench.next();
    assert_eq!(bench.alarms(), [Alarm::SamplesLost { lost: 7 }]);
    assert!(matches!(bench.device.poll_outcome(), Some(Err(_))));
    // The count itself goes on.
    check_nm(bench.latest_nm(), 0.0);
}

#[test]
fn samples_with_an_invalid_phase_are_left_out() {
    let mut bench = Bench::started();
    bench.sample.phase = 0x0200;
    bench.at(1_300);
    check_nm(bench.latest_nm(), 0.0);
    bench.sample.phase = 0;
    bench.at(1_001);
    check_nm(bench.latest_nm(), HALF_NM);
    assert!(bench.device.counters().contains(&("invalid_phase", 1)));
}

#[test]
fn a_firmware_that_began_anew_voids_the_count() {
    let mut bench = Bench::started();
    bench.sample.sequence = 0;
    bench.sample.distance = 0;
    bench.next();
    bench.next();
    assert_eq!(bench.alarms(), [Alarm::CountRestarted]);
    assert_eq!(bench.device.latest(), None);
}

#[test]
fn a_damaged_line_that_still_reads_as_a_sample_is_no_number() {
    let mut bench = Bench::started();
    bench.at(1_000_000_000);
    check_nm(bench.latest_nm(), 0.0);
    bench.at(1_001);
    check_nm(bench.latest_nm(), HALF_NM);
    assert_eq!(bench.alarms(), []);
    for _ in 0..3 {
        bench.at(1_000_000_000);
    }
    assert_eq!(bench.alarms(), [Alarm::SlewError]);
}

#[test]
fn garbage_costs_one_sample_and_many_lines_of_it_an_alarm() {
    let mut bench = Bench::started();
    bench.bytes(b"\xFF\x00garb");
    bench.bytes(b"age\n");
    bench.at(1_001);
    check_nm(bench.latest_nm(), HALF_NM);
    assert_eq!(bench.alarms(), []);
    for _ in 0..40 {
        bench.bytes(b"xx\n");
    }
    assert_eq!(bench.alarms(), [Alarm::Garbage { lines: 20 }]);
}

#[test]
fn a_silent_stream_is_told_once_and_ends_an_average() {
    let mut bench = Bench::started();
    bench.device.begin_average(bench.now, 5);
    let due = bench.device.poll_timeout();
    assert_eq!(due, bench.now + Duration::from_millis(100));
    bench.device.handle_timeout(due);
    bench.device.handle_timeout(due + SAMPLE);
    let waited = Duration::from_millis(100);
    assert_eq!(bench.alarms(), [Alarm::StreamSilent { waited }]);
    assert_eq!(bench.device.poll_timeout(), Time::NEVER);
    assert!(matches!(bench.device.poll_outcome(), Some(Err(_))));
}

#[test]
fn an_unplugged_interferometer_has_lost_its_count() {
    let mut bench = Bench::started();
    bench
        .device
        .handle(bench.now, &Input::Link(LinkState::Gone));
    assert!(matches!(bench.alarms()[..], [Alarm::StreamSilent { .. }]));
    bench.device.handle(bench.now, &Input::Link(LinkState::Up));
    bench.bytes(b"58 1\n");
    bench.next();
    assert_eq!(bench.device.latest(), None);
}

#[test]
fn a_start_without_a_stream_says_what_it_waited_for() {
    let mut bench = Bench::new(Umd2Settings::default());
    bench.device.start(bench.now);
    assert_eq!(bench.device.identity(), None);
    let due = bench.device.poll_timeout();
    bench.device.handle_timeout(due);
    let Some(Err(error)) = bench.device.poll_outcome() else {
        panic!("no outcome")
    };
    let text = error.to_string();
    assert!(
        text.contains("good samples") && text.contains("3s"),
        "{text}"
    );
}

/// Whoever stands in the beam is not left to guess.
#[test]
fn a_start_in_a_blocked_beam_says_so_and_one_that_was_free_for_a_moment_what_it_waited_for() {
    for (is_free_at_last, expected) in [(false, "beam lost"), (true, "good samples")] {
        let mut bench = Bench::new(Umd2Settings::default());
        bench.device.start(bench.now);
        bench.next();
        bench.sample.measurement_count = 0;
        bench.next();
        if is_free_at_last {
            bench.sample.measurement_count = REFERENCE;
            bench.next();
        }
        let due = bench.device.poll_timeout();
        bench.device.handle_timeout(due);
        let Some(Err(error)) = bench.device.poll_outcome() else {
            panic!("no outcome")
        };
        assert!(error.to_string().contains(expected), "{error}");
    }
}

#[test]
fn the_start_wants_good_samples_in_a_row() {
    let mut bench = Bench::new(Umd2Settings::default());
    bench.device.start(bench.now);
    bench.bytes(b"\n");
    for _ in 0..19 {
        bench.next();
    }
    bench.sample.measurement_count = 0;
    bench.next();
    bench.sample.measurement_count = REFERENCE;
    for _ in 0..19 {
        bench.next();
        assert_eq!(bench.device.poll_outcome(), None);
    }
    bench.next();
    assert_eq!(bench.device.poll_outcome(), Some(Ok(())));
    assert_eq!(bench.alarms(), []);
}

#[test]
fn it_names_itself_with_its_firmware() {
    let mut bench = Bench::started();
    bench.sample.low_speed = LowSpeed::Firmware(141);
    bench.next();
    assert_eq!(bench.device.identity().unwrap().name, "uMD2 firmware 141");
}

#[test]
fn weather_is_given_in_si_units_while_it_is_fresh() {
    let mut bench = Bench::started();
    for value in [
        LowSpeed::Temperature1(2_150),
        LowSpeed::Temperature2(2_034),
        LowSpeed::Pressure(101_325),
        LowSpeed::Humidity(455),
    ] {
        bench.sample.low_speed = value;
        bench.next();
    }
    let weather = bench.device.environment();
    assert_eq!(weather.air_temperature, Some(units::Celsius(21.5)));
    assert_eq!(weather.material_temperature, Some(units::Celsius(20.34)));
    assert_eq!(weather.pressure, Some(units::Pascals(101_325.0)));
    let humidity = weather.humidity.unwrap().value();
    assert!((humidity - 0.455).abs() < 1e-12);
    bench.sample.low_speed = LowSpeed::None;
    bench.now += Duration::from_secs(11);
    bench.next();
    assert_eq!(bench.device.environment(), Environment::default());
}

#[test]
fn an_open_temperature_sensor_is_no_temperature() {
    let mut bench = Bench::started();
    bench.sample.low_speed = LowSpeed::Temperature1(2_000);
    bench.next();
    bench.sample.low_speed = LowSpeed::Temperature1(-27_315);
    bench.next();
    assert_eq!(bench.device.environment().air_temperature, None);
}

proptest! {
    #[test]
    fn no_bytes_make_it_panic_or_read_without_a_start(
        bytes in prop::collection::vec(any::<u8>(), 0..400),
    ) {
        let mut bench = Bench::new(Umd2Settings::default());
        bench.bytes(&bytes);
        prop_assert_eq!(bench.device.latest(), None);
    }

    #[test]
    fn one_damaged_byte_never_makes_an_impossible_reading(at in 0usize..40, byte in any::<u8>()) {
        let mut bench = Bench::started();
        let mut line = bench.sample.emit().into_bytes();
        let at = at % line.len();
        prop_assume!(byte != b'\n' || at == line.len() - 1);
        line[at] = byte;
        bench.bytes(&line);
        bench.bytes(b"\n");
        // A jump that the stage can make in one sample cannot be told from a true one.
        if let Some(reading) = bench.latest_nm() {
            prop_assert!(reading.abs() < f64::from(2 * REFERENCE) * HALF_NM);
        }
    }
}
