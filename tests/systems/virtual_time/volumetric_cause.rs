//! Calibrations of three axes of which something other than single readings is wrong: what it is, is told.

use compensator::volumetric::Point;
use tests::volume::{Volume, quick};
use tests::{Edit, in_every_run};
use truestage::Failure;
use truestage::emulated::Emulated;
use truestage::volumetric::{LineOperator, LineTask, VolumetricFailure, WarmUp};
use units::Metres;

/// Mounts the moving optic elsewhere on some lines.
struct Mounting<F: Fn(&LineTask) -> Point> {
    emulated: Emulated,
    off: F,
}

impl<F: Fn(&LineTask) -> Point> LineOperator for Mounting<F> {
    fn ask_line(&mut self, task: &LineTask) -> Result<(), Failure> {
        let tool = task.tool + (self.off)(task);
        self.emulated.ask_line(&LineTask { tool, ..*task })
    }

    fn is_set_up(&mut self) -> Result<bool, Failure> {
        self.emulated.is_set_up()
    }

    fn pack_up(&mut self) -> Result<(), Failure> {
        self.emulated.pack_up()
    }
}

fn as_asked(_: &LineTask) -> Point {
    Point::ZERO
}

/// The machine as it is, `stated` in its configuration; why its calibration is refused.
fn refused(
    seed: u64,
    stated: impl Fn(String) -> String,
    is: impl Fn(String) -> String,
    off: impl Fn(&LineTask) -> Point,
) -> String {
    let mut volume = Volume::zeroed(seed, |text| stated(quick(text)), is);
    let store = volume.bench.store.clone();
    let emulated = volume.bench.emulated.clone();
    let mut hand = Mounting { emulated, off };
    let mut work = volume.bench.machine.volumetric().unwrap();
    let failure = match work.calibrate(&store, WarmUp::None, None, &mut hand) {
        Ok(made) => panic!("stored as {}", made.id),
        Err(failure) => failure,
    };
    let scattered = matches!(failure.of_kind(), Some(VolumetricFailure::Scatter(_)));
    assert!(scattered, "{failure}");
    assert_eq!(failure.exit_code(), 5);
    assert!(store.list().expect("it can be read").is_empty());
    println!("{failure}");
    failure.to_string()
}

/// The first of the causes, up to the next.
fn first(text: &str) -> &str {
    let mut causes = text.split("likely cause: ").skip(1);
    causes.next().unwrap_or_else(|| panic!("no cause: {text}"))
}

#[track_caller]
fn check(text: &str, part: &str) {
    assert!(first(text).contains(part), "{part}: {text}");
}

/// Also a wrong carrier of the workpiece shows, by what the machine's own detectors read.
#[test]
fn a_chain_that_is_stated_wrongly_is_told_with_the_right_one() {
    let chains = [(1, "FYXZ"), (2, "FZYX"), (3, "XFYZ")];
    for (seed, stated) in &chains[..in_every_run(1, chains.len())] {
        let wrong =
            |text: String| text.edit("chain = \"FXYZ\" ", &format!("chain = \"{stated}\" "));
        let text = refused(*seed, wrong, |text| text, as_asked);
        check(&text, &format!("like `FXYZ` where `{stated}` is stated"));
    }
}

/// 40 mm too far out.
#[test]
fn an_arm_of_another_length_is_told_with_its_length() {
    let off = |task: &LineTask| match task.tool.x > Metres::ZERO {
        true => Point::from_mm(40.0, 0.0, 0.0),
        false => Point::ZERO,
    };
    let text = refused(4, |text| text, |text| text, off);
    check(
        &text,
        "elsewhere on the tool, compared with the other lines: x = 1",
    );
    check(&text, "where 100.0 mm is stated");
}

/// 80 mm down, on the line that tells the positioning of x: an error of Abbe.
#[test]
fn a_reflector_that_sat_elsewhere_on_one_line_is_told_with_its_place() {
    let off = |task: &LineTask| match task.step.0 {
        1 => Point::from_mm(0.0, 0.0, -80.0),
        _ => Point::ZERO,
    };
    let text = refused(5, |text| text, |text| text, off);
    check(&text, "on line 1 alone the measured point was elsewhere");
    check(&text, "where -100.0 mm is stated");
    assert!(text.contains("calibrate --resume"), "{text}");
}

/// 100 mm further along its slide, where pitch and yaw move it more.
#[test]
fn a_detector_that_sits_elsewhere_is_told_with_its_place() {
    let (said, right) = ("[0.0, 15.0, 25.0]", "[100.0, 15.0, 25.0]");
    let is = |text: String| {
        let from = format!("detector_place_mm = {said}");
        text.edit(&from, &format!("detector_place_mm = {right}"))
    };
    let stated = |text: String| {
        // Two of the three detectors are stated as they sit.
        let (said, right) = (format!("place_mm = {said}"), format!("place_mm = {right}"));
        text.edit(&said, &right).edit_first(&right, &said)
    };
    let text = refused(6, stated, is, as_asked);
    check(&text, "the detector on the slide of x sits elsewhere: x = ");
    check(&text, "where 0.0 mm is stated");
}

/// Sources that swing by 100 µrad within minutes, said to shift.
#[test]
fn a_beam_that_is_said_to_move_otherwise_is_told() {
    let is = |text: String| {
        text.edit("pivot_urad = 15.0", "pivot_urad = 100.0")
            .edit("wander_period_min = 120.0", "wander_period_min = 8.0")
    };
    let stated = |text: String| {
        let wide = text
            .edit("noise_max_um = 3.0", "noise_max_um = 30.0")
            .edit("displacement_max_um = 60.0", "displacement_max_um = 240.0");
        wide.edit_first("drift = \"pivoting\"", "drift = \"translating\"")
    };
    let text = refused(7, stated, is, as_asked);
    check(&text, "the beam along x moves otherwise when it moves");
    check(&text, "where 1.00 is stated");
}
