//! A rotary table whose plate a person reads through a microscope: judged by the plant's truth.

use core::time::Duration;

use tests::{Bench, Edit, Hand, in_every_run, with_few_lines};
use truestage::emulated::Emulated;
use truestage::for_tests::{Asked, Person, Question, RotaryCalibrated};
use truestage::rotary::{Operator, PlateMove, PlateTask};
use truestage::{CalibrateOptions, Failure, Machine};

use super::rotary::{LIMIT_ARCSEC, check_tables, hand_of, is_enabled, residual, started};

const AXIS: &str = "c";
const LINES: u32 = 72;

/// A plate of 72 lines on a table without harmonics that these cannot see.
fn bench(seed: u64) -> Bench {
    let machine =
        |text: String| {
            text.edit(
            "[rotary.c.line_detector]       # at the drive's touch probe 1\nedge = \"positive\"",
            "[rotary.c.sighting]\nvalue = \"to_line\"\nrange_arcsec = 200.0",
        )
        .edit("lines = 360", "lines = 72")
        .edit("closure_limit_arcsec = 0.1 ", "closure_limit_arcsec = 0.15 ")
        .edit("offset_lines = 200.5", "offset_lines = 40.5")
        };
    Bench::rotary(seed, machine, |text| with_few_lines(&text))
}

/// Turns the plate and reads its lines.
struct AtTheMicroscope {
    hand: Hand<'static>,
    emulated: Emulated,
    answer: Option<String>,
    questions: usize,
    goes_home_at: usize,
    /// Whether the drive was off whenever he was asked to turn the plate, and on while he read.
    was_safe: bool,
}

impl AtTheMicroscope {
    fn of(bench: &Bench) -> Self {
        Self {
            hand: hand_of(&bench.emulated),
            emulated: bench.emulated.clone(),
            answer: None,
            questions: 0,
            goes_home_at: usize::MAX,
            was_safe: true,
        }
    }

    fn drive_is_on(&self) -> bool {
        is_enabled(&self.emulated)
    }
}

impl Operator for AtTheMicroscope {
    fn ask(&mut self, task: &PlateTask) -> Result<(), Failure> {
        self.was_safe &= !self.drive_is_on();
        if task.by == PlateMove::TurnBy(0.0) {
            // Whoever took it up would not put it down in the same place.
            self.hand.asked.push(task.clone());
            return Ok(());
        }
        self.hand.ask(task)
    }

    fn is_done(&mut self) -> Result<bool, Failure> {
        self.hand.is_done()
    }
}

impl Person for AtTheMicroscope {
    fn tell(&mut self, _: &str) {}

    fn question(&mut self, question: &Question) -> Result<(), Failure> {
        self.questions += 1;
        self.was_safe &= self.drive_is_on();
        let mut simulation = self.emulated.simulation_mut();
        self.answer = Some(match question.asked {
            _ if self.questions == self.goes_home_at => "stop".into(),
            Asked::Close => String::new(),
            Asked::Line { line, .. } => match simulation.sight_line(line).to_line {
                Some(away) => format!("{:.4}arcsec", away.arcsec()),
                None => "none".into(),
            },
        });
        Ok(())
    }

    fn answer(&mut self) -> Result<Option<String>, Failure> {
        Ok(self.answer.take())
    }

    fn refuse(&mut self, why: &str) -> Result<(), Failure> {
        panic!("what is seen was refused: {why}")
    }

    fn wait(&mut self, _: Duration) {}
}

fn calibrate(
    bench: &mut Bench,
    options: &CalibrateOptions,
    person: &mut AtTheMicroscope,
) -> Result<RotaryCalibrated, Failure> {
    let store = bench.store.clone();
    bench.machine.guarded(|machine| {
        machine
            .rotary(AXIS)?
            .calibrate_sighted(&store, options, person)
    })
}

#[test]
fn tables_read_through_a_microscope_are_as_right_as_by_the_touch_probe_and_as_sure_as_they_say() {
    check_tables((in_every_run(3, 6), LINES), |seed| {
        let mut bench = bench(seed);
        started(&mut bench);
        let mut person = AtTheMicroscope::of(&bench);
        let it = calibrate(&mut bench, &CalibrateOptions::default(), &mut person)
            .unwrap_or_else(|failure| panic!("seed {seed}: {failure}"));
        assert!(person.was_safe, "seed {seed}");
        (bench, it)
    });
}

/// Hours later, in another process, which knows nothing but the journal.
#[test]
fn a_table_read_on_two_days_is_as_right_and_its_verification_sees_the_places_between() {
    let mut bench = bench(31);
    started(&mut bench);
    let mut person = AtTheMicroscope::of(&bench);
    // In the second pass of the second placement.
    let of_one = 3 * LINES as usize + 1;
    person.goes_home_at = of_one + LINES as usize + 10;
    let stopped = calibrate(&mut bench, &CalibrateOptions::default(), &mut person);
    assert_eq!(stopped.unwrap_err().exit_code(), 130);
    let resume = bench.store.newest_run("calibrate", AXIS).unwrap();
    assert!(resume.is_some(), "what was read is kept");

    bench.machine = Machine::new(&bench.loaded, Box::new(bench.emulated.transport()));
    started(&mut bench);
    let options = CalibrateOptions {
        resume,
        accept_drift: false,
        ..CalibrateOptions::default()
    };
    person.goes_home_at = usize::MAX;
    let before = (person.hand.asked.len(), person.questions);
    calibrate(&mut bench, &options, &mut person).unwrap_or_else(|failure| panic!("{failure}"));
    let asked = &person.hand.asked[before.0..];
    assert_eq!((asked.len(), asked[0].by), (3, PlateMove::TurnBy(0.0)));
    assert_eq!(
        person.questions - before.1,
        3 * of_one - (LINES as usize + 9)
    );
    let left = residual(&mut bench, LINES, 0.0);
    assert!(left <= LIMIT_ARCSEC, "{left}");

    let store = bench.store.clone();
    let verified = bench.machine.guarded(|machine| {
        let mut table = machine.rotary(AXIS)?;
        table.verify_sighted(&store, (true, None), &mut person)
    });
    let it = verified.unwrap_or_else(|failure| panic!("{failure}"));
    assert!(it.is_within_tolerance() && person.was_safe);
    assert!(
        it.found.largest.arcsec() > 5.0,
        "{}",
        it.found.largest.arcsec()
    );
    // Scatter of one placement, of the table's and of the plate's error.
    let left = it.left.unwrap().rms.arcsec();
    assert!((0.025..0.07).contains(&left), "{left}");
}
