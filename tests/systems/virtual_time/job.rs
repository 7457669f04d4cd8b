//! A job of one axis: points, pauses, repetitions, an end, and what ends it before (system S3, steps 4, 5 and 7).

use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

use machine::StopRequest;
use machine::records::read_journal;
use mock_bus::fault::{Fault, FaultConfig};
use tests::{Bench, Edit};
use truestage::emulated::Emulated;
use truestage::for_tests::JobDone;
use truestage::linear::{Job, JobOperator, JobPlan, LinearLog, Reached};
use truestage::{CalibrateOptions, Failure};
use units::Metres;
use wire::cia402::PowerState;

/// At the gauge the input shows next to nothing, and 3 V more from a second on after the axis came there.
const JOB: &str = include_str!("../../../configs/jobs/linear.toml");
const INPUT: &str = "below_v = 4.0, within_s = 30.0";

/// Does what is asked for after some looks, and judges each point by the truth.
struct Person {
    emulated: Emulated,
    /// Asked for, one after the other.
    asked: Vec<String>,
    looks: u32,
    /// How far the point truly is from where the job says that it is, in units of the uncertainty stated.
    off: Vec<f64>,
    /// Presses Ctrl-C once so many points were reached.
    stops: Option<(usize, StopRequest)>,
    /// Goes home when asked so many times.
    leaves_when_asked: Option<usize>,
    /// When the gauge shows something, seconds after it was come to.
    gauge_after_s: Option<f64>,
}

impl Person {
    fn beside(bench: &Bench) -> Self {
        Self {
            emulated: bench.emulated.clone(),
            asked: Vec::new(),
            looks: 0,
            off: Vec::new(),
            stops: None,
            leaves_when_asked: None,
            gauge_after_s: Some(1.0),
        }
    }
}

impl JobOperator for Person {
    fn ask(&mut self, text: &str) -> Result<(), Failure> {
        self.asked.push(text.to_owned());
        self.looks = 0;
        match self.leaves_when_asked {
            Some(count) if count == self.asked.len() => {
                Err(Failure::Machine(machine::Failure::Interrupted))
            }
            _ => Ok(()),
        }
    }

    fn is_done(&mut self) -> Result<bool, Failure> {
        self.looks += 1;
        Ok(self.looks > 10)
    }

    fn reached(&mut self, it: &Reached) {
        let truth = self.emulated.simulation().truth().position();
        let u = it
            .moved
            .uncertainty
            .expect("it lies between calibrated positions");
        let off = truth - it.moved.place.expect("it is corrected");
        self.off.push(off.value() / u.standard_uncertainty.value());
        assert!(
            (truth - it.moved.target).abs() < Metres::from_um(1.0),
            "{it:?}"
        );
        if let (true, Some(after_s)) = (it.name == "gauge", self.gauge_after_s) {
            let mut simulation = self.emulated.simulation_mut();
            let shifted = FaultConfig {
                from_s: after_s,
                ..FaultConfig::permanent(Fault::InputShifted {
                    channel: 0,
                    by: 3.0,
                })
            };
            simulation.inject(shifted).expect("it has inputs");
        }
        if let Some((count, stop)) = &self.stops
            && self.off.len() == *count
        {
            stop.stop();
        }
    }
}

fn job(bench: &Bench, change: impl Fn(String) -> String) -> Job {
    let text = change(JOB.edit(INPUT, "above_v = 2.0, within_s = 3.0"));
    Job::parse(&text, "job.toml", &bench.loaded.config).unwrap_or_else(|error| panic!("{error}"))
}

fn calibrated(seed: u64) -> Bench {
    let mut bench = Bench::new(seed);
    let store = bench.store.clone();
    let made = bench.machine.guarded(|machine| {
        machine.start()?;
        machine.linear("x")?.zero(&store)?;
        machine
            .linear("x")?
            .calibrate(&store, &CalibrateOptions::default())?;
        machine.linear("x")?.move_to(Metres::ZERO)
    });
    made.unwrap_or_else(|failure: Failure| panic!("{failure}"));
    bench
}

fn done(bench: &mut Bench, job: &Job, person: &mut Person) -> Result<JobDone, Failure> {
    let store = bench.store.clone();
    let run = |machine: &mut truestage::Machine| machine.linear("x")?.run_job(&store, job, person);
    bench.machine.guarded(run)
}

fn newest_journal(folder: &Path) -> PathBuf {
    let runs = std::fs::read_dir(folder)
        .unwrap()
        .map(|it| it.unwrap().path());
    let jobs = runs.filter(|it| it.to_string_lossy().contains("-run-x-"));
    jobs.max().expect("a journal of a job")
}

#[test]
fn a_job_goes_through_its_points_as_planned_and_knows_how_sure_each_is() {
    let mut bench = calibrated(11);
    let job = job(&bench, |text| text);
    let plan = JobPlan::of(&job, &bench.loaded, &bench.store).unwrap();
    let mut person = Person::beside(&bench);
    // The gauge shows it once; the second time it still does.
    let done = done(&mut bench, &job, &mut person).unwrap_or_else(|failure| panic!("{failure}"));
    assert_eq!(person.asked.len(), 2, "{:?}", person.asked);
    assert!(
        person.asked[0].contains("load: lay a part"),
        "{:?}",
        person.asked
    );
    let names: Vec<&str> = done.reached.iter().map(|it| it.name.as_str()).collect();
    let once = ["load", "hole 1", "hole 2", "hole 3", "hole 4", "gauge"];
    assert_eq!(names, [once, once].concat());
    assert_eq!(plan.calibration, done.calibration);
    for (planned, it) in plan.points.iter().zip(&done.reached) {
        assert_eq!(
            (planned.set_point, planned.interval),
            (it.moved.set_point, it.interval)
        );
        assert_eq!(
            (planned.approach, planned.target),
            (it.moved.approach, it.moved.target)
        );
        let (from, to) = it.interval.expect("it lies between calibrated positions");
        assert!(from <= it.moved.target && it.moved.target <= to);
        assert!(
            it.moved.set_point != it.moved.target,
            "nothing was corrected"
        );
    }
    // Of normal deviations four times the uncertainty is exceeded by one in 16 000.
    assert!(
        person.off.iter().all(|it| it.abs() < 4.0),
        "{:?}",
        person.off
    );
    assert!(
        bench.true_position().abs() < Metres::from_um(1.0),
        "it ends at zero"
    );

    let read = read_journal::<LinearLog>(&done.journal).unwrap();
    assert!(read.complete && read.failure.is_none());
    assert_eq!(read.log.reached.len(), 12);
    assert!(
        read.log
            .reached
            .iter()
            .all(|it| it.u_m.is_some_and(|u| u > 1e-8))
    );
    let on: Vec<(&str, f64)> = read
        .log
        .went_on
        .iter()
        .map(|it| (it.by.as_str(), it.waited_s))
        .collect();
    let kinds = ["operator", "time", "time", "time", "time", "input"];
    assert_eq!(
        on.iter().map(|it| it.0).collect::<Vec<_>>(),
        [kinds, kinds].concat()
    );
    assert!((0.5..0.6).contains(&on[1].1), "{on:?}");
    assert!((1.0..1.2).contains(&on[5].1), "{on:?}");
    assert!(on[11].1 < 0.1, "{on:?}");
    assert!(read.log.went_on[5].seen_v.is_some_and(|it| it > 2.0));
}

/// What stands in the journal when a job ended before its end, and that the axis is without power then.
#[track_caller]
fn check_ended(bench: &Bench, reached: usize, cause: &str) {
    let power = bench.machine.power_state("x").unwrap();
    assert!(power != Some(PowerState::OperationEnabled), "{power:?}");
    let read = read_journal::<LinearLog>(&newest_journal(&bench.store.runs())).unwrap();
    assert!(!read.complete);
    assert_eq!(read.log.reached.len(), reached);
    assert!(
        read.failure.as_ref().is_some_and(|it| it.contains(cause)),
        "{:?}",
        read.failure
    );
}

#[test]
fn an_input_that_does_not_come_ends_the_job_with_what_was_wanted_and_seen() {
    let mut bench = calibrated(12);
    let job = job(&bench, |text| text);
    let mut person = Person {
        gauge_after_s: None,
        ..Person::beside(&bench)
    };
    let failure = done(&mut bench, &job, &mut person).unwrap_err();
    assert_eq!(failure.exit_code(), 4, "{failure}");
    let said = failure.to_string();
    for part in [
        "gauge",
        "input 0 of hall above 2.000 V",
        "within 3 s",
        "V last",
    ] {
        assert!(said.contains(part), "`{part}` is not in {said}");
    }
    check_ended(&bench, 6, "input 0 of hall");
}

#[test]
fn a_job_that_is_interrupted_stops_safely_and_keeps_what_was_reached() {
    let mut bench = calibrated(13);
    let job = job(&bench, |text| text);
    let mut person = Person::beside(&bench);
    person.stops = Some((3, bench.machine.stop_request()));
    let failure = done(&mut bench, &job, &mut person).unwrap_err();
    assert_eq!(failure.exit_code(), 130, "{failure}");
    check_ended(&bench, 3, "stopped on request");
}

#[test]
fn a_job_without_a_calibration_is_refused_before_anything_moves() {
    let mut bench = Bench::new(14);
    let job = job(&bench, |text| text);
    let refused = JobPlan::of(&job, &bench.loaded, &bench.store).unwrap_err();
    assert!(
        refused.to_string().contains("no active calibration"),
        "{refused}"
    );
    let mut person = Person::beside(&bench);
    let store = bench.store.clone();
    let before = bench.true_position();
    let run = bench.machine.guarded(|machine| {
        machine.start()?;
        machine.linear("x")?.run_job(&store, &job, &mut person)
    });
    assert_eq!(run.unwrap_err().exit_code(), 3);
    assert!((bench.true_position() - before).abs() < Metres::from_um(1.0));
}

/// The machine is started and zeroed again, and the job goes on with its newest journal.
fn gone_on(bench: &mut Bench, job: &Job, person: &mut Person) -> Result<JobDone, Failure> {
    let store = bench.store.clone();
    let journal = newest_journal(&store.runs());
    bench.machine.guarded(|machine| {
        machine.start()?;
        machine.linear("x")?.zero(&store)?;
        machine
            .linear("x")?
            .resume_job(&store, job, &journal, person)
    })
}

fn stops(done: &JobDone) -> Vec<(u32, usize)> {
    done.reached
        .iter()
        .map(|it| (it.repetition, it.number.0))
        .collect()
}

#[test]
fn a_job_goes_on_after_the_last_point_that_it_left_with_repetitions_and_conditions() {
    let mut bench = calibrated(15);
    let job = job(&bench, |text| text);
    let mut person = Person::beside(&bench);
    let stop = bench.machine.stop_request();
    person.stops = Some((3, stop.clone()));
    let failure = done(&mut bench, &job, &mut person).unwrap_err();
    assert_eq!(failure.exit_code(), 130, "{failure}");
    // The second hole was reached and not left.
    check_ended(&bench, 3, "stopped on request");
    stop.flag().store(false, Ordering::Relaxed);

    let mut person = Person::beside(&bench);
    let on = gone_on(&mut bench, &job, &mut person).unwrap_or_else(|failure| panic!("{failure}"));
    assert_eq!(on.before, 2);
    let first = (3..=6).map(|number| (1, number));
    let expected: Vec<_> = first.chain((1..=6).map(|number| (2, number))).collect();
    assert_eq!(stops(&on), expected);
    assert_eq!(person.asked.len(), 1, "{:?}", person.asked);
    assert!(
        person.off.iter().all(|it| it.abs() < 4.0),
        "{:?}",
        person.off
    );
    let read = read_journal::<LinearLog>(&on.journal).unwrap();
    assert!(read.complete && read.failure.is_none());
    assert_eq!((read.log.reached.len(), read.log.went_on.len()), (12, 12));
    assert!(
        bench.true_position().abs() < Metres::from_um(1.0),
        "it ends at zero"
    );

    let refused = gone_on(&mut bench, &job, &mut person).unwrap_err();
    assert!(refused.to_string().contains("complete"), "{refused}");
}

#[test]
fn a_point_whose_input_did_not_come_is_gone_to_again() {
    let mut bench = calibrated(16);
    let job = job(&bench, |text| text);
    let mut person = Person {
        gauge_after_s: None,
        ..Person::beside(&bench)
    };
    done(&mut bench, &job, &mut person).unwrap_err();
    let mut person = Person::beside(&bench);
    let on = gone_on(&mut bench, &job, &mut person).unwrap_or_else(|failure| panic!("{failure}"));
    assert_eq!((on.before, stops(&on)[0], on.reached.len()), (5, (1, 6), 7));
    assert_eq!(on.reached[0].name, "gauge");
}

#[test]
fn another_job_or_another_calibration_is_not_gone_on_with_and_what_changed_is_said() {
    let mut bench = calibrated(17);
    let job = self::job(&bench, |text| text);
    let mut person = Person {
        leaves_when_asked: Some(1),
        ..Person::beside(&bench)
    };
    done(&mut bench, &job, &mut person).unwrap_err();
    let changes: [(&str, &str, &str); 5] = [
        (
            "after_s = 0.5",
            "after_s = 0.75",
            "job, go_on[1] was `after 0.5 s` and is now `after 0.75 s`",
        ),
        (
            "repetitions = 2",
            "repetitions = 3",
            "job, repetitions was `2` and is now `3`",
        ),
        (
            "position_mm = 57.25",
            "position_mm = 57.5",
            "targets, [5] was `0.0572",
        ),
        (
            "within_s = 3.0",
            "within_s = 4.0",
            "within 3 s` and is now `input 0 of hall above 2 V within 4 s`",
        ),
        (
            "name = \"gauge\"",
            "name = \"gage\"",
            "job, names[5] was `gauge` and is now `gage`",
        ),
    ];
    for (from, to, says) in changes {
        let other = self::job(&bench, |text| text.edit_first(from, to));
        let refused = gone_on(&mut bench, &other, &mut person).unwrap_err();
        assert_eq!(refused.exit_code(), 3, "{refused}");
        let said = refused.to_string();
        assert!(said.contains(says), "`{says}` is not in {said}");
    }
    let store = bench.store.clone();
    let again = bench.machine.guarded(|machine| {
        machine.start()?;
        machine.linear("x")?.zero(&store)?;
        machine
            .linear("x")?
            .calibrate(&store, &CalibrateOptions::default())
    });
    again.unwrap_or_else(|failure| panic!("{failure}"));
    let refused = gone_on(&mut bench, &job, &mut person).unwrap_err();
    assert!(
        refused.to_string().contains("calibration was `"),
        "{refused}"
    );
}
