//! What the image controller's driver must and must not make of its answers.

use super::*;
use core::time::Duration;
use proptest::prelude::*;
use units::Radians;
use wire::in_sight::Cell;

const INFO: [&str; 6] = [
    "1",
    "Serial Number: 1A1234PP567890",
    "Application Version: 6.01.01",
    "Monitor Version: 4.09.00",
    "MAC Address: 00-d0-24-00-00-01",
    "Date of Build: Mar  1 2021",
];

struct Bench {
    device: InSight,
    now: Time,
}

fn settings() -> InSightSettings {
    InSightSettings::new("uvw.job", Cell::parse("C7").unwrap())
}

impl Bench {
    fn new(settings: InSightSettings) -> Self {
        let device = InSight::new(settings);
        let now = Time::from_seconds(2.0);
        let mut bench = Self { device, now };
        bench.device.start(now);
        assert_eq!(bench.sent(), ["", "GF"]);
        bench
    }

    /// Started, with `count` pictures taken so far.
    fn started(count: u32) -> Self {
        let mut bench = Self::new(settings());
        bench.answers(&["1", "uvw.job"]);
        assert_eq!(bench.sent(), ["GI", "GF"]);
        bench.answers(&INFO);
        bench.answers(&["1", "uvw.job"]);
        assert_eq!(bench.sent(), ["SO1"]);
        bench.answer("1");
        assert_eq!(bench.sent(), ["GVC007"]);
        bench.result(count);
        assert_eq!(bench.outcome(), Some(Ok(())));
        bench
    }

    /// Up to the first trigger.
    fn measuring(count: u32, exposures: u32) -> Self {
        let mut bench = Self::started(count);
        bench.begin(exposures);
        bench.answers(&["1", "uvw.job"]);
        assert_eq!(bench.sent(), ["GVC007"]);
        bench.result(count);
        assert_eq!(bench.sent(), ["SW8"]);
        bench
    }

    fn begin(&mut self, exposures: u32) {
        self.device.begin_pose(self.now, exposures);
        assert_eq!(self.sent(), ["GF"]);
    }

    fn sent(&mut self) -> Vec<String> {
        let payloads = core::iter::from_fn(|| self.device.poll_transmit());
        payloads
            .map(|payload| {
                let Payload::Bytes(mut bytes) = payload else {
                    panic!("a frame on a serial line")
                };
                assert_eq!(bytes.pop(), Some(TERMINATOR));
                String::from_utf8(bytes).unwrap()
            })
            .collect()
    }

    /// A line 5 ms later.
    fn answer(&mut self, line: &str) {
        self.now += Duration::from_millis(5);
        let input = Input::Payload(Payload::Bytes(format!("{line}\r").into_bytes()));
        self.device.handle(self.now, &input);
    }

    fn answers(&mut self, lines: &[&str]) {
        for line in lines {
            self.answer(line);
        }
    }

    /// The result cell after `count` pictures: two good marks at 1.5 µm, -2 µm, 10 arcsec.
    fn result(&mut self, count: u32) {
        self.answers(&["1", &format!("{count},2,1,1.500,-2.000,10.000,95.000")]);
    }

    /// Lets time pass to the next deadline.
    fn wait(&mut self) {
        self.now = self.device.poll_timeout();
        assert!(self.now < Time::NEVER, "nothing is waited for");
        self.device.handle_timeout(self.now);
    }

    fn outcome(&mut self) -> Option<Result<(), DeviceError>> {
        self.device.poll_outcome()
    }

    #[track_caller]
    fn failure(&mut self) -> String {
        match self.outcome() {
            Some(Err(error)) => {
                assert_eq!(self.device.pose(), None);
                assert_eq!(self.device.poll_timeout(), Time::NEVER);
                error.to_string()
            }
            other => panic!("no failure but {other:?}"),
        }
    }

    #[track_caller]
    fn pose(&mut self) -> PoseReading {
        assert_eq!(self.outcome(), Some(Ok(())));
        self.device.pose().expect("it ended well")
    }

    fn counter(&self, name: &str) -> u64 {
        let counters = self.device.counters();
        counters.into_iter().find(|(n, _)| *n == name).unwrap().1
    }
}

#[test]
fn the_start_checks_the_job_goes_online_and_learns_the_count() {
    let mut bench = Bench::started(41);
    let name = bench.device.identity().unwrap().name;
    assert_eq!(
        name,
        "In-Sight 1A1234PP567890, version 6.01.01, job uvw.job"
    );
    assert_eq!(bench.sent(), Vec::<String>::new());
    assert_eq!(bench.device.poll_timeout(), Time::NEVER);
}

#[test]
fn a_pose_is_fenced_triggered_and_read_in_si_units() {
    let mut bench = Bench::measuring(41, 1);
    bench.answer("1");
    assert_eq!(bench.sent(), ["GVC007"]);
    bench.result(42);
    let pose = bench.pose();
    assert_eq!(pose.at, bench.now);
    assert!((pose.x.um() - 1.5).abs() < 1e-9);
    assert!((pose.y.um() + 2.0).abs() < 1e-9);
    assert!((pose.angle.arcsec() - 10.0).abs() < 1e-9);
    assert_eq!((pose.samples, pose.rejected), (1, 0));
    assert!((pose.score - 0.95).abs() < 1e-12);
    assert_eq!(pose.covariance, [[0.0; 3]; 3]);
}

/// More than there are to find: whoever looks for one spot must know. A picture that was judged bad says it, too.
#[test]
fn how_many_targets_the_last_picture_showed_is_told_whether_it_was_good_or_not() {
    for (judged, is_good) in [(1, true), (0, false)] {
        let mut bench = Bench::started(41);
        bench.device.settings.rejects_max = 0;
        bench.begin(1);
        bench.answers(&["1", "uvw.job"]);
        bench.result(41);
        bench.answer("1");
        let picture = format!("42,3,{judged},1.500,-2.000,10.000,95.000");
        bench.answers(&["1", &picture]);
        assert_eq!(bench.outcome().unwrap().is_ok(), is_good);
        assert_eq!(bench.device.found(), 3);
    }
}

#[test]
fn several_exposures_are_averaged_with_their_scatter() {
    let mut bench = Bench::measuring(7, 3);
    for (count, x) in [(8, 1.0), (9, 2.0), (10, 3.0)] {
        bench.answer("1");
        assert_eq!(bench.sent(), ["GVC007"]);
        bench.answers(&[
            "1",
            &format!("{count},2,1,{x:.3},0.000,0.000,{}.000", 80 + count),
        ]);
        if count < 10 {
            assert_eq!(bench.sent(), ["SW8"]);
        }
    }
    let pose = bench.pose();
    assert_eq!(pose.samples, 3);
    assert!((pose.x.um() - 2.0).abs() < 1e-9);
    let [[of_x, ..], [_, of_y, _], _] = pose.covariance;
    assert!((of_x - 1e-12).abs() < 1e-21 && of_y == 0.0);
    assert!((pose.score - 0.88).abs() < 1e-12, "the worst of them");
}

#[test]
fn the_cameras_axes_are_turned_into_the_machines() {
    let mut settings = settings();
    settings.frame = CameraFrame {
        rotation: Radians::from_degrees(90.0),
        mirrored: true,
    };
    let mut measurement = Measurement::new(1);
    let picture = Inspection::parse("1,2,1,3.000,5.000,2.000,90.000").unwrap();
    let taken = measurement.take(Time::ZERO, &picture, &settings, NAME);
    let pose = taken.unwrap().unwrap();
    // Mirrored: (3, -5); its x axis is the machine's y axis: (5, 3). Angles count backwards.
    assert!((pose.x.um() - 5.0).abs() < 1e-9, "{pose:?}");
    assert!((pose.y.um() - 3.0).abs() < 1e-9, "{pose:?}");
    assert!((pose.angle.arcsec() + 2.0).abs() < 1e-9, "{pose:?}");
}

#[test]
fn another_job_or_another_controller_is_refused() {
    let mut bench = Bench::new(settings());
    bench.answers(&["1", "other.job"]);
    assert!(bench.failure().contains("active job"));
    let mut settings = settings();
    settings.serial_number = Some("1A0000".into());
    let mut bench = Bench::new(settings);
    bench.answers(&["1", "uvw.job"]);
    bench.answers(&INFO);
    bench.answers(&["1", "uvw.job"]);
    assert!(bench.failure().contains("serial number"));
    bench.device.begin_pose(bench.now, 1);
    assert!(bench.failure().contains("a started image controller"));
}

#[test]
fn a_job_changed_behind_our_back_is_found_before_the_next_picture() {
    let mut bench = Bench::started(3);
    bench.begin(1);
    bench.answers(&["1", "RAMDisk/uvw.job"]);
    assert!(bench.failure().contains("active job"));
    assert_eq!(bench.sent(), Vec::<String>::new());
}

#[test]
fn refusals_are_told_with_their_status() {
    let mut bench = Bench::new(settings());
    bench.answers(&["1", "uvw.job"]);
    bench.answers(&INFO);
    bench.answers(&["1", "uvw.job", "-5"]);
    let told = bench.failure();
    assert!(
        told.contains("going online") && told.contains("set offline by hand"),
        "{told}"
    );
    let mut bench = Bench::measuring(3, 1);
    bench.answer("-2");
    let told = bench.failure();
    assert!(
        told.contains("taking a picture") && told.contains("-2"),
        "{told}"
    );
    let mut bench = Bench::measuring(3, 1);
    bench.answers(&["1", "-1"]);
    let told = bench.failure();
    assert!(
        told.contains("result cell") && told.contains("invalid"),
        "{told}"
    );
    assert_eq!(bench.counter("refused"), 1);
}

#[test]
fn a_job_that_was_never_saved_is_told_as_a_refusal_not_as_silence() {
    let mut bench = Bench::new(settings());
    while bench.device.poll_timeout() < Time::NEVER {
        bench.answer("-2");
        bench.wait();
    }
    assert!(bench.failure().contains("naming its active job"));
}

#[test]
fn nobody_there_is_a_time_out_that_says_what_was_awaited() {
    let mut bench = Bench::new(settings());
    while bench.device.poll_timeout() < Time::NEVER {
        bench.wait();
    }
    let told = bench.failure();
    assert!(told.contains("GF") && told.contains("10s"), "{told}");
    assert_eq!(bench.sent(), ["GF"; 19]);
    let mut bench = Bench::started(3);
    bench.begin(1);
    for _ in 0..4 {
        bench.wait();
    }
    assert!(
        bench.failure().contains("2s"),
        "a measurement is not that patient"
    );
}

/// The picture comes, but after we gave up waiting: the fence stands behind it.
#[test]
fn a_picture_that_took_too_long_is_read_once_the_fence_has_answered() {
    let mut bench = Bench::measuring(3, 1);
    bench.wait();
    assert_eq!(bench.sent(), ["GF"]);
    bench.answers(&["1", "1", "uvw.job"]);
    assert_eq!(bench.sent(), ["GVC007"]);
    bench.result(4);
    assert_eq!(bench.pose().samples, 1);
    assert_eq!(bench.counter("late_answers"), 1);
}

#[test]
fn a_trigger_that_was_lost_is_given_again_and_only_its_own_picture_is_taken() {
    let mut bench = Bench::measuring(3, 1);
    bench.wait();
    bench.answers(&["1", "uvw.job"]);
    assert_eq!(bench.sent(), ["GF", "GVC007"]);
    bench.result(3);
    assert_eq!(
        bench.sent(),
        ["GF"],
        "behind the fence nothing comes any more"
    );
    bench.answers(&["1", "uvw.job"]);
    assert_eq!(bench.sent(), ["GVC007"]);
    bench.result(3);
    assert_eq!(bench.sent(), ["SW8"]);
    bench.answer("1");
    bench.result(4);
    assert_eq!(bench.pose().samples, 1);
}

/// An old "1" must not pass for the answer to the trigger.
#[test]
fn an_old_answer_leads_to_no_old_picture() {
    let mut bench = Bench::measuring(3, 1);
    bench.answer("1");
    assert_eq!(bench.sent(), ["GVC007"]);
    bench.result(3);
    assert_eq!(bench.outcome(), None);
    bench.wait();
    assert_eq!(bench.sent(), ["GVC007"], "it is asked again a little later");
    bench.result(4);
    assert_eq!(bench.pose().samples, 1);
    assert_eq!(bench.counter("old_results"), 1);
}

#[test]
fn a_result_that_stays_the_old_one_ends_when_the_picture_is_late() {
    let mut bench = Bench::measuring(3, 1);
    let triggered = bench.now;
    bench.answer("1");
    let mut asked = 0;
    while bench.sent() == ["GVC007"] {
        bench.result(3);
        if bench.device.poll_timeout() < Time::NEVER {
            bench.wait();
        }
        asked += 1;
        assert!(asked < 1000, "for ever");
    }
    let waited = bench.now.since(triggered);
    assert!(waited >= Duration::from_secs(3), "{waited:?}");
    assert!(waited < Duration::from_secs(4), "{waited:?}");
}

#[test]
fn somebody_elses_trigger_spoils_a_picture_and_is_counted() {
    let mut bench = Bench::measuring(3, 1);
    bench.answer("1");
    assert_eq!(bench.sent(), ["GVC007"]);
    bench.result(5);
    assert_eq!(bench.sent(), ["GF"]);
    bench.answers(&["1", "uvw.job"]);
    bench.result(5);
    assert_eq!(bench.sent(), ["GVC007", "SW8"]);
    bench.answer("1");
    bench.result(6);
    assert_eq!(bench.pose().samples, 1);
    assert_eq!(bench.counter("strange_triggers"), 1);
    let mut bench = Bench::measuring(3, 1);
    for count in [5, 7, 9, 11] {
        bench.answer("1");
        bench.result(count);
        bench.answers(&["1", "uvw.job"]);
        bench.result(count);
    }
    assert!(bench.failure().contains("no other program triggers"));
}

#[test]
fn the_count_begins_again_after_its_largest() {
    let mut bench = Bench::measuring(COUNT_MAX, 1);
    bench.answer("1");
    bench.result(0);
    assert_eq!(bench.pose().samples, 1);
}

#[track_caller]
fn rejected(cells: &[&str]) -> (Bench, String) {
    let mut bench = Bench::measuring(3, 2);
    for (count, cell) in (4..).zip(cells) {
        bench.answer("1");
        bench.answers(&["1", &format!("{count},{cell}")]);
    }
    let told = bench.failure();
    (bench, told)
}

#[test]
fn pictures_without_target_or_judged_bad_are_left_out_up_to_a_limit() {
    let absent = "0,0,0.000,0.000,0.000,0.000";
    let hidden = "1,0,0.000,0.000,0.000,40.000";
    let judged = "2,0,9.000,9.000,9.000,45.000";
    let (_, told) = rejected(&[absent; 4]);
    assert!(told.contains("0 of 2 pictures were good"), "{told}");
    assert!(
        told.contains("4 showed no target and 0 were judged bad"),
        "{told}"
    );
    let (_, told) = rejected(&[absent, hidden, judged, judged]);
    assert!(
        told.contains("2 showed no target and 2 were judged bad"),
        "{told}"
    );
    assert!(told.contains("best score 45 %"), "{told}");
    let mut bench = Bench::measuring(3, 1);
    for (count, cell) in [
        (4, absent),
        (5, judged),
        (6, "2,1,1.000,0.000,0.000,49.000"),
    ] {
        bench.answer("1");
        bench.answers(&["1", &format!("{count},{cell}")]);
    }
    bench.answer("1");
    bench.result(7);
    let pose = bench.pose();
    assert_eq!((pose.samples, pose.rejected), (1, 3));
}

#[test]
fn a_cell_that_holds_no_inspection_is_no_measurement() {
    for cell in ["#ERR", "3.000", "5,2,1,NaN,0,0,90", "5;2;1;0;0;0;90"] {
        let mut bench = Bench::measuring(3, 1);
        bench.answers(&["1", "1", cell]);
        assert_eq!(bench.outcome(), None, "{cell}");
        for _ in 0..4 {
            if bench.device.poll_timeout() < Time::NEVER {
                bench.wait();
            }
            bench.answers(&["1", "uvw.job", "1", cell]);
        }
        while bench.device.poll_timeout() < Time::NEVER {
            bench.wait();
        }
        assert!(bench.failure().contains("GV"), "{cell}");
        assert!(bench.counter("damaged_lines") > 0);
    }
}

#[test]
fn a_system_that_boots_is_asked_again_and_its_repeated_answers_do_no_harm() {
    let mut bench = Bench::new(settings());
    bench.wait();
    bench.wait();
    assert_eq!(bench.sent(), ["GF"; 2]);
    bench.answers(&["1", "uvw.job"]);
    assert_eq!(bench.sent(), ["GI", "GF"]);
    bench.answers(&["1", "uvw.job", "1", "uvw.job"]);
    assert_eq!(bench.sent(), Vec::<String>::new());
    bench.answers(&INFO);
    bench.answers(&["1", "uvw.job"]);
    assert_eq!(bench.sent(), ["SO1"]);
}

#[test]
fn echoes_are_known_for_what_they_are() {
    let mut bench = Bench::new(settings());
    bench.answers(&["", "GF", "1", "uvw.job", "GI", "GF"]);
    bench.answers(&INFO);
    bench.answers(&["1", "uvw.job", "SO1", "1", "GVC007"]);
    bench.result(9);
    assert_eq!(bench.outcome(), Some(Ok(())));
    assert_eq!(bench.counter("echoes"), 5);
}

#[test]
fn a_new_pose_supersedes_the_one_that_runs() {
    let mut bench = Bench::measuring(3, 5);
    bench.begin(1);
    bench.answers(&["1", "1", "uvw.job"]);
    assert_eq!(bench.sent(), ["GVC007"]);
    bench.result(4);
    assert_eq!(
        bench.sent(),
        ["SW8"],
        "picture 4 was asked for by the old one"
    );
    bench.answer("1");
    bench.result(5);
    assert_eq!(bench.pose().samples, 1);
    bench.device.begin_pose(bench.now, 0);
    assert!(bench.failure().contains("at least one exposure"));
}

#[test]
fn garbage_in_a_row_is_an_alarm_once() {
    let mut bench = Bench::measuring(3, 1);
    for _ in 0..25 {
        bench.answer("\u{7f}x%%");
    }
    let alarms: Vec<_> = core::iter::from_fn(|| bench.device.poll_alarm()).collect();
    assert_eq!(alarms, [Alarm::Garbage { lines: 20 }]);
}

proptest! {
    /// Whatever comes, the driver ends by itself, and only the one right picture is a pose.
    #[test]
    fn no_bytes_make_it_panic_or_believe_an_old_picture(
        chunks in prop::collection::vec(
            prop_oneof![
                prop::collection::vec(any::<u8>(), 0..20),
                Just(b"1\r".to_vec()),
                Just(b"-2\r".to_vec()),
                Just(b"uvw.job\r".to_vec()),
                Just(b"3,2,1,9.0,9.0,9.0,95.0\r".to_vec()),
            ],
            0..60,
        ),
    ) {
        let mut bench = Bench::measuring(3, 1);
        for chunk in chunks {
            bench.now += Duration::from_millis(7);
            bench.device.handle_timeout(bench.now);
            bench.device.handle(bench.now, &Input::Payload(Payload::Bytes(chunk)));
            bench.sent();
            prop_assert_eq!(bench.device.pose(), None);
        }
        let mut steps = 0;
        while bench.device.poll_timeout() < Time::NEVER {
            bench.wait();
            bench.sent();
            steps += 1;
            prop_assert!(steps < 1000);
        }
        prop_assert_eq!(bench.device.pose(), None);
    }
}
