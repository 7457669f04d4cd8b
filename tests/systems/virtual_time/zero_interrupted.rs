//! Zeros of a linear stage from whose passes over the Hall sensors samples are lost: a computer that is held up while
//! the machine lives on, and frames that never arrive.
//!
//! The machine lives thirty times as fast as the wall's clock: a pause of 20 ms takes 0.6 s from it.

use core::time::Duration;
use std::cell::RefCell;
use std::rc::Rc;

use drivers::transport::in_process::InProcess;
use drivers::transport::{SendError, Transport};
use machine::{Observer, Stage};
use mock_bus::fault::{Fault, FaultConfig};
use tests::Bench;
use truestage::emulated::Emulated;
use truestage::for_tests::Zeroed;
use truestage::{Failure, Machine, ports};
use units::{Metres, Time};
use wire::{Arrival, Payload, Port};

const SPEED: f64 = 30.0;
/// So much of a pass is lost: a pause of 20 ms on the wall.
const HELD_UP: Duration = Duration::from_millis(600);
/// The steps of a zero that are done when its passes begin, and when its first one has been made.
const SEARCHED: u64 = 3;
const ONE_PASS: u64 = 4;

/// What takes samples away.
#[derive(Clone, Copy, Debug)]
enum Trouble {
    /// The computer is held up.
    Pause,
    /// What the module of the sensors sends is lost on its way.
    Frames,
}

/// What happens, and what was seen.
struct Course {
    /// Steps of the zero that are done.
    done: u64,
    /// Where the trouble begins.
    place: Metres,
    trouble: Trouble,
    /// After how many steps it comes, and whether it comes once only.
    due: (u64, bool),
    /// How often it came.
    came: u32,
    before: Option<Metres>,
    warnings: Vec<String>,
}

impl Course {
    /// Whether the stage, which now is `here`, meets the trouble on its way.
    fn meets(&mut self, here: Metres) -> bool {
        let before = self.before.unwrap_or(here);
        self.before = Some(here);
        let crosses = (before < self.place) != (here < self.place);
        let (due, once) = self.due;
        let is_due = match once {
            true => self.done == due && self.came == 0,
            false => self.done >= due,
        };
        let meets = crosses && is_due;
        self.came += u32::from(meets);
        meets
    }
}

struct Listener(Rc<RefCell<Course>>);

impl Observer for Listener {
    fn progress(&mut self, stage: Stage, _: &str, done: u64, _: u64) {
        if stage == Stage::Zero {
            self.0.borrow_mut().done = done;
        }
    }

    fn warning(&mut self, text: &str) {
        self.0.borrow_mut().warnings.push(text.to_owned());
    }
}

struct Interrupted {
    inner: InProcess<Emulated>,
    course: Rc<RefCell<Course>>,
}

impl Transport for Interrupted {
    fn now(&self) -> Time {
        self.inner.now()
    }

    fn send(&mut self, port: Port, payload: &Payload) -> Result<(), SendError> {
        self.inner.send(port, payload)
    }

    fn receive(&mut self, until: Time) -> Option<Arrival> {
        let arrival = self.inner.receive(until);
        let here = self.inner.world().simulation().truth().position();
        let mut course = self.course.borrow_mut();
        if course.meets(here) {
            let until = self.inner.now() + HELD_UP;
            let mut simulation = self.inner.world().simulation_mut();
            match course.trouble {
                Trouble::Pause => simulation.advance(until),
                Trouble::Frames => {
                    let lost = Fault::Drop {
                        port: "can0".into(),
                        cob_id: Some(0x182),
                    };
                    let lost = FaultConfig::lasting(lost, HELD_UP);
                    simulation.inject(lost).expect("the bus is there");
                }
            }
        }
        arrival
    }

    fn sleep_until(&mut self, until: Time) {
        self.inner.sleep_until(until);
    }

    fn set_sync(&mut self, port: Port, period: Option<Duration>) -> Result<(), SendError> {
        self.inner.set_sync(port, period)
    }
}

/// What came of a zero that meets `trouble`.
struct Played {
    zeroed: Result<Zeroed, Failure>,
    /// Where the drive's zero truly is, on the scale.
    zero: Metres,
    course: Rc<RefCell<Course>>,
}

/// Zeroes the stage of `seed` twice: undisturbed, which tells where its left flank is, and with trouble there.
fn play(seed: u64, trouble: Trouble, due: (u64, bool)) -> (Metres, Played) {
    let mut bench = Bench::new(seed);
    let course = Rc::new(RefCell::new(Course {
        done: 0,
        place: Metres::ZERO,
        trouble,
        due: (u64::MAX, false),
        came: 0,
        before: None,
        warnings: Vec::new(),
    }));
    bench.loaded.patience = ports::Pace::Wall(SPEED).patience();
    let transport = Interrupted {
        inner: bench.emulated.transport(),
        course: Rc::clone(&course),
    };
    bench.machine = Machine::new(&bench.loaded, Box::new(transport));
    bench
        .machine
        .observe(Box::new(Listener(Rc::clone(&course))));
    let started = bench.machine.start();
    started.unwrap_or_else(|failure| panic!("seed {seed}: {failure}"));
    let undisturbed = zero(&mut bench).unwrap_or_else(|failure| panic!("seed {seed}: {failure}"));
    let expected = zero_on_the_scale(&bench);
    {
        let mut course = course.borrow_mut();
        assert_eq!(course.warnings, [""; 0], "seed {seed}");
        let flank = undisturbed.estimate.left.position - undisturbed.estimate.origin;
        // A pass in reverse loses half a millimetre before the flank and more behind it; one that goes forward what
        // lies between the flank and the peak.
        course.place = flank + Metres::from_mm(0.3);
        course.due = due;
        course.done = 0;
    }
    let zeroed = zero(&mut bench);
    let played = Played {
        zeroed,
        zero: zero_on_the_scale(&bench),
        course,
    };
    (expected, played)
}

fn zero(bench: &mut Bench) -> Result<Zeroed, Failure> {
    let store = bench.store.clone();
    let zeroed = |machine: &mut Machine| machine.linear("x")?.zero(&store);
    bench.machine.guarded(zeroed)
}

fn zero_on_the_scale(bench: &Bench) -> Metres {
    let reading = bench.machine.reading("x").expect("there is an axis x");
    let scale = bench.emulated.simulation().truth().scale_position();
    scale - reading.expect("it has been read").position
}

#[test]
fn a_pass_that_loses_its_samples_is_made_again_and_the_zero_is_as_good() {
    let cases = [
        (Trouble::Pause, "the computer was held up"),
        (Trouble::Frames, "frames of the axis or of the module"),
    ];
    for seed in [61, 62, 63] {
        for (trouble, cause) in cases {
            let (expected, played) = play(seed, trouble, (ONE_PASS, true));
            let zeroed = played.zeroed;
            let zeroed = zeroed.unwrap_or_else(|failure| panic!("{seed} {trouble:?}: {failure}"));
            let course = played.course.borrow();
            assert_eq!(course.came, 1, "it was never delivered");
            let [told] = &course.warnings[..] else {
                panic!("{seed} {trouble:?}: {:?}", course.warnings);
            };
            for word in [
                "axis x",
                "samples of the sensors were lost",
                cause,
                "made again",
            ] {
                assert!(told.contains(word), "`{word}` is not in: {told}");
            }
            let off = (played.zero - expected).abs();
            let u = zeroed.estimate.standard_uncertainty;
            println!(
                "{seed} {trouble:?}: off {:.4} µm, u {:.4} µm: {told}",
                off.um(),
                u.um()
            );
            assert!(off <= u * 4.0, "{seed} {trouble:?}: off by {} µm", off.um());
        }
    }
}

#[test]
fn where_each_pass_loses_its_samples_the_zero_fails_and_says_why() {
    let cases = [
        (Trouble::Pause, "the computer was held up"),
        (Trouble::Frames, "frames of the axis or of the module"),
    ];
    for (trouble, cause) in cases {
        let (_, played) = play(64, trouble, (SEARCHED, false));
        let Err(failure) = played.zeroed else {
            panic!("{trouble:?}: nothing was noticed");
        };
        assert!(matches!(failure, Failure::SamplesLost(_)), "{failure:?}");
        assert_eq!(failure.exit_code(), 4);
        let text = failure.to_string();
        for word in [cause, "each of the 3 times that it was made again"] {
            assert!(text.contains(word), "`{word}` is not in: {text}");
        }
        let course = played.course.borrow();
        assert_eq!(course.warnings.len(), 3, "{:?}", course.warnings);
        println!("{trouble:?}: {text}");
    }
}
