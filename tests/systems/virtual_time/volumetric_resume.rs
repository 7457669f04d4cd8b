//! A calibration of three axes that is interrupted, continued, and evaluated from its journal.

use core::time::Duration;
use std::fs;
use std::path::{Path, PathBuf};

use compensator::volumetric::function::Shape;
use machine::records::{ReadJournal, read_journal};
use tests::Edit;
use tests::volume::{Volume, good, quick};
use truestage::Failure;
use truestage::emulated::{Emulated, HallDrift};
use truestage::for_tests::VolumetricCalibrated;
use truestage::for_tests::VolumetricEvaluated;
use truestage::volumetric::VolumeLog;
use truestage::volumetric::{LineOperator, LineTask, WarmUp};

/// Sets lines up, notes which, and goes home before the one that it is told.
struct Hand {
    emulated: Emulated,
    asked: Vec<usize>,
    leaves_before: Option<usize>,
}

impl LineOperator for Hand {
    fn ask_line(&mut self, task: &LineTask) -> Result<(), Failure> {
        if Some(task.step.0) == self.leaves_before {
            return Err(Failure::Machine(machine::Failure::Interrupted));
        }
        self.asked.push(task.step.0);
        self.emulated.ask_line(task)
    }

    fn is_set_up(&mut self) -> Result<bool, Failure> {
        self.emulated.is_set_up()
    }

    fn pack_up(&mut self) -> Result<(), Failure> {
        self.emulated.pack_up()
    }
}

/// Calibrates, and says which lines were asked for.
fn calibrate(
    volume: &mut Volume,
    resume: Option<&Path>,
    leaves_before: Option<usize>,
) -> (Result<VolumetricCalibrated, Failure>, Vec<usize>) {
    calibrate_by(volume, WarmUp::None, resume, leaves_before)
}

fn calibrate_by(
    volume: &mut Volume,
    warm_up: WarmUp,
    resume: Option<&Path>,
    leaves_before: Option<usize>,
) -> (Result<VolumetricCalibrated, Failure>, Vec<usize>) {
    let mut hand = Hand {
        emulated: volume.bench.emulated.clone(),
        asked: Vec::new(),
        leaves_before,
    };
    let store = volume.bench.store.clone();
    let machine = &mut volume.bench.machine;
    let made = machine
        .volumetric()
        .unwrap()
        .calibrate(&store, warm_up, resume, &mut hand);
    (made, hand.asked)
}

fn journal_of(volume: &Volume) -> PathBuf {
    let newest = volume.bench.store.newest_run("calibrate", "volume");
    newest.expect("it can be read").expect("there is one")
}

fn read(path: &Path) -> ReadJournal<VolumeLog> {
    read_journal::<VolumeLog>(path).unwrap_or_else(|error| panic!("{error}"))
}

/// The mains goes off and on, and the machine is zeroed again.
fn another_morning(volume: &mut Volume) {
    let machine = &mut volume.bench.machine;
    good(machine.shut_down());
    let emulated = &volume.bench.emulated;
    emulated.simulation_mut().power_cycle(HallDrift::default());
    let back = machine.now() + Duration::from_secs(2);
    good(machine.run_until(back));
    good(machine.start());
    good(machine.volumetric().unwrap().zero());
}

#[test]
fn a_calibration_that_was_interrupted_goes_on_at_its_first_line_that_is_not_whole() {
    let mut volume = Volume::zeroed(1, quick, |text| text);
    let (refused, asked) = calibrate(&mut volume, None, Some(11));
    assert!(
        matches!(
            refused,
            Err(Failure::Machine(machine::Failure::Interrupted))
        ),
        "{refused:?}"
    );
    let path = journal_of(&volume);
    let before = read(&path);
    assert!(before.failure.is_some() && !before.complete);
    assert_eq!(before.log.whole.len(), 10, "{asked:?}");
    assert!(
        volume
            .bench
            .store
            .list()
            .expect("it can be read")
            .is_empty()
    );

    // As killed in the middle of the line before.
    let bytes = fs::read(&path).expect("it is there");
    let text = String::from_utf8(bytes).expect("a journal is text");
    let last_whole = text.rfind("{\"entry\":\"line_read\"").expect("it was read");
    fs::write(&path, &text[..last_whole - 20]).expect("there is room");
    another_morning(&mut volume);
    let (made, asked_later) = calibrate(&mut volume, Some(&path), None);
    let made = good(made);
    assert_eq!(asked_later.first(), Some(&10), "{asked_later:?}");
    assert!(asked_later.iter().all(|it| *it >= 10));

    let after = read(&path);
    assert!(after.complete && after.failure.is_none());
    assert_eq!(after.log.references, before.log.references);
    let of_whole = |journal: &ReadJournal<VolumeLog>| {
        let readings = journal.log.readings.iter().filter(|it| it.line < 9);
        readings.cloned().collect::<Vec<_>>()
    };
    assert_eq!(of_whole(&after), of_whole(&before));
    let each = |line: usize| after.log.whole.iter().filter(|it| it.line == line).count();
    assert!((0..made.lines).all(|line| each(line) == 1));
    let store = volume.bench.store.clone();
    let known = good(volume.work().state(&store));
    assert_eq!(known.expect("it is in use").1.geometry, made.id);

    let error = calibrate(&mut volume, Some(&path), None).0.unwrap_err();
    assert!(error.to_string().contains("complete"), "{error}");
}

/// Continued or not, the same machine is found: what differs is a power cycle between.
#[test]
fn the_journal_alone_gives_the_stored_errors_again() {
    let mut volume = Volume::zeroed(1, quick, |text| text);
    let made = good(calibrate(&mut volume, None, None).0);
    let journal = read(&made.journal);
    let shape = Shape::Spline;
    let again = VolumetricEvaluated::of(&journal.log, shape);
    let again = again.unwrap_or_else(|failure| panic!("{failure}"));
    let stored = volume.bench.store.load(&made.id);
    let stored = stored.expect("it was stored").content;
    let config = volume.work().config();
    assert_eq!(again.content(config), stored);
    assert_eq!((again.lines, again.u_max), (made.lines, made.u_max));
    let source = made
        .journal
        .file_name()
        .expect("it has one")
        .to_string_lossy();
    let from_it = volume
        .bench
        .store
        .glances_from(&source)
        .expect("it can be read");
    let mut names: Vec<&str> = from_it.iter().map(|(id, _)| id.as_str()).collect();
    names.sort_unstable();
    let mut expected = [made.id.as_str(), made.references.as_str()];
    expected.sort_unstable();
    assert_eq!(names, expected);

    // Without the diagonals nothing tells the squarenesses, and that is said.
    let mut some = journal.log.clone();
    let plan = some.plan.clone().expect("it has one");
    some.whole
        .retain(|it| !plan.lines[it.line].purpose.starts_with("squareness"));
    let refused = VolumetricEvaluated::of(&some, shape).unwrap_err();
    assert!(
        refused.to_string().contains("squareness of y to x"),
        "{refused}"
    );
}

#[test]
fn what_is_not_the_same_machine_any_more_is_not_continued() {
    let mut volume = Volume::zeroed(1, quick, |text| text);
    let (_, asked) = calibrate(&mut volume, None, Some(2));
    assert_eq!(asked, [1]);
    let path = journal_of(&volume);
    let warm_up = WarmUp::Idle(Duration::from_secs(60));
    let refused = calibrate_by(&mut volume, warm_up, Some(&path), None).0;
    let text = refused.unwrap_err().to_string();
    assert!(text.contains("--warm-up-min"), "{text}");

    // Guides of another machine: its detectors see other curves, whatever its warmth.
    calibrate_by(&mut volume, warm_up, None, Some(2))
        .0
        .unwrap_err();
    let with_warm_lines = journal_of(&volume);
    assert_ne!(with_warm_lines, path);
    let mut other = Volume::zeroed(2, quick, |text| text);
    let (refused, asked) = calibrate_by(&mut other, warm_up, Some(&with_warm_lines), None);
    let refused = refused.unwrap_err();
    let text = refused.to_string();
    assert!(
        text.contains("resume_limit_um") && text.contains("--resume"),
        "{text}"
    );
    assert_eq!((refused.exit_code(), asked.len()), (3, 0));

    // Warmer by kelvins, with nothing to tell what that does.
    let packed = volume.bench.emulated.clone().pack_up();
    packed.unwrap_or_else(|failure| panic!("{failure}"));
    let span = Duration::from_secs(2 * 3600);
    good(volume.bench.machine.idle(span));
    let (refused, asked) = calibrate(&mut volume, Some(&path), None);
    let text = refused.unwrap_err().to_string();
    assert!(
        text.contains("thermometer") && text.contains("--warm-up-min"),
        "{text}"
    );
    assert_eq!(asked.len(), 0);
}

/// A corner of the volume, which has lines of few places.
fn small(text: String) -> String {
    quick(text)
        .edit(
            "high_mm = [500.0, 400.0, 300.0]",
            "high_mm = [100.0, 100.0, 100.0]",
        )
        .edit("from_mm = [0.0, 0.0, 150.0]", "from_mm = [0.0, 0.0, 50.0]")
        .edit(
            "to_mm = [500.0, 400.0, 150.0]",
            "to_mm = [100.0, 100.0, 50.0]",
        )
}

/// Cold for five minutes, warm for a shift of an hour and a quarter, and cold again; it becomes warm and cold six times as
/// fast as the one that ships.
fn of_a_shift(text: String) -> String {
    let fast = text
        .edit(
            "air_time_constant_min = 150.0",
            "air_time_constant_min = 25.0",
        )
        .edit(
            "scale_time_constant_min = 60.0",
            "scale_time_constant_min = 10.0",
        );
    fast.edit(
        "{ from_h = 0.0, share = 0.8 }",
        "{ from_h = 0.0, share = 0.0 }",
    )
    .edit(
        "{ from_h = 4.0, share = 0.1 }",
        "{ from_h = 0.08, share = 1.0 }",
    )
    .edit(
        "{ from_h = 4.5, share = 1.0 }",
        "{ from_h = 1.33, share = 0.0 }",
    )
}

#[test]
fn a_run_that_goes_on_warms_up_again_where_less_than_four_fifths_of_the_warmth_are_left() {
    let mut volume = Volume::zeroed(1, small, of_a_shift);
    let span = Duration::from_secs(20 * 60);
    let warm_up = WarmUp::Idle(span);
    calibrate_by(&mut volume, warm_up, None, Some(1))
        .0
        .unwrap_err();
    let path = journal_of(&volume);
    let plan = read(&path).log.plan.expect("it has one");
    let lines = plan.lines.iter().enumerate();
    let warm = lines.filter(|(_, it)| it.warm && !it.by_detectors);
    let warm: Vec<usize> = warm.map(|(at, _)| at + 1).collect();
    assert!(warm.len() > 3, "{warm:?}");

    // By the machine's clock, until the person goes home before that line.
    let goes_on_to = |volume: &mut Volume, line: usize| {
        let begun = volume.bench.machine.now();
        let (left, _) = calibrate_by(volume, warm_up, Some(&path), Some(line));
        let left = left.unwrap_err();
        assert!(
            matches!(left, Failure::Machine(machine::Failure::Interrupted)),
            "{left}"
        );
        volume.bench.machine.now().since(begun)
    };
    // Cold lines, and the first that is read warm.
    assert!(goes_on_to(&mut volume, warm[1]) > span);
    assert!(goes_on_to(&mut volume, warm[2]) < span);
    let night = Duration::from_secs(140 * 60);
    good(volume.bench.machine.idle(night));
    for axis in ["x", "y", "z"] {
        good(volume.bench.machine.enable(axis));
    }
    assert!(
        goes_on_to(&mut volume, warm[3]) > span,
        "it had cooled down"
    );
}

#[test]
fn a_run_that_goes_on_becomes_warm_for_as_long_as_it_was_to() {
    let mut volume = Volume::zeroed(1, small, |text| text);
    let minutes = 2.5;
    let warm_up = WarmUp::of_minutes(minutes).expect("a time");
    let left = calibrate_by(&mut volume, warm_up, None, Some(1)).0;
    left.unwrap_err();
    let path = journal_of(&volume);
    let plan = read(&path).log.plan.expect("it has one");
    assert_eq!(plan.warm_up_min, Some(minutes));
    // Whoever goes on with it says nothing of that, or another time.
    for warm_up in [WarmUp::None, WarmUp::of_minutes(3.0).expect("a time")] {
        let left = calibrate_by(&mut volume, warm_up, Some(&path), Some(1)).0;
        let left = left.unwrap_err();
        assert!(
            matches!(left, Failure::Machine(machine::Failure::Interrupted)),
            "{left}"
        );
    }
}
