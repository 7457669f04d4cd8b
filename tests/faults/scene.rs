//! A scene: a machine in some phase of its work, and what goes wrong with it there.

use std::cell::{Cell, Ref, RefCell};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::rc::Rc;
use std::time::Duration;

use machine::engine::{Cause, Engine, NoCorrection};
use machine::records::Store;
use machine::records::read_journal;
use machine::{Observer, Stage};
use mock_bus::fault::{Fault, FaultConfig, FaultId};
use mock_bus::node::cia402_drive::Cia402DriveNode;
use mock_bus::simulation::Simulation;
use tests::{Bench, Edit};
use truestage::CalibrateOptions;
use truestage::emulated::Emulated;
use truestage::for_tests::Calibrated;
use truestage::linear::LinearLog;
use truestage::linear::VerifyOptions;
use truestage::{Failure, Machine};
use units::{Metres, Time};
use wire::cia402::PowerState;

use crate::witness::{Deed, Slow, Testimony, Witnessed};

/// From SYNC to SYNC in the shipped configuration.
pub const PERIOD: Duration = Duration::from_millis(5);
/// When a lost heartbeat is noticed.
pub const HEARTBEAT: Duration = Duration::from_millis(150);
/// When the drive notices that the controller is gone.
pub const WATCH_MASTER: Duration = Duration::from_millis(500);
/// What a stop may take once it is ordered: 200 mm/s at 20 m/s², a few frames.
pub const STOPPING: Duration = Duration::from_millis(100);

/// How long the witness looks on after the controller has ended.
pub const WATCHED: Duration = Duration::from_secs(2);

/// What the machine is doing when the fault comes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// Asking who is there.
    Scan,
    /// Starting the devices.
    Start,
    /// Finding its zero.
    Zero,
    /// A move from 0 to 60 mm.
    Move,
    /// Switching off and on again, then the same move.
    Restart,
    /// Standing enabled for three seconds.
    Stand,
    /// Measuring to learn the deviations.
    Calibrate,
    /// Measuring to judge.
    Verify,
    /// Following a path of four seconds, a set-point at every SYNC.
    Follow,
}

/// Whether something was seen on the emulated machine.
type Question = Box<dyn Fn(&Emulated) -> bool>;
/// Something that turns one text into another.
type Change = Box<dyn Fn(String) -> String>;

/// What happens where.
pub struct Scene {
    phase: Phase,
    after: Duration,
    seed: u64,
    faults: Vec<FaultConfig>,
    deed: Option<Deed>,
    delivered: Option<Question>,
    machine: Change,
    emulated: Change,
    stop: bool,
    stall: Option<Duration>,
    full: Option<u16>,
    slow: Option<Slow>,
    held_up: Option<Duration>,
    killed: bool,
}

/// What a controller that is killed panics with: nobody is told, nothing is done.
struct Killed;

/// The shipped machine with fewer points: the same procedures in less time.
pub fn shortened(text: String) -> String {
    text.edit("step_mm = 3.0", "step_mm = 6.0")
        .edit("targets = 8", "targets = 4")
        .edit("runs = 5", "runs = 2")
}

/// The same with an axis that follows cyclic set-points.
pub fn cyclic(text: String) -> String {
    text.edit(
        "[axis.x.identity]",
        "synchronous_start = true\n[axis.x.cyclic]\njerk_mm_per_s3 = 100000.0\n\
         deviation_limit_um = 1000.0\n[axis.x.identity]",
    )
}

/// To and fro over 30 mm, eight times in four seconds, begun and ended at rest.
fn path(period: Duration) -> Vec<Metres> {
    let count = (4.0 / period.as_secs_f64()) as u32;
    let points = (0..=count).map(|at| {
        let u = f64::from(at) / f64::from(count);
        let turn = std::f64::consts::TAU;
        let share = u - (turn * u).sin() / turn;
        Metres::from_mm(30.0 - 15.0 * (4.0 * turn * share).cos())
    });
    points.collect()
}

/// Follows the path to its end or to a stop, whatever the host must do for that.
pub fn follow(machine: &mut Machine) -> Result<Cause, Failure> {
    let (mut engine, mut desk) = Engine::new(machine, &["x"], Box::new(NoCorrection))?;
    let points = path(engine.period());
    let mut next = 0;
    let cause = machine.follow_with(&mut engine, &mut || {
        while next < points.len() && desk.path.room() > 0 {
            desk.path
                .push(&[points[next]])
                .expect("the path can be driven");
            next += 1;
        }
        if next == points.len() && desk.path.room() > 0 {
            let _ = desk.path.finish();
        }
    })?;
    match cause {
        Cause::PathDone | Cause::Overrun { .. } => Ok(cause),
        Cause::Asked => Err(Failure::Machine(machine::Failure::Interrupted)),
        other => panic!("{other}\n{}", engine.timing()),
    }
}

impl Scene {
    /// Nothing goes wrong in `phase` yet.
    pub fn during(phase: Phase) -> Self {
        Self {
            phase,
            after: Duration::ZERO,
            seed: 1,
            faults: Vec::new(),
            deed: None,
            delivered: None,
            machine: match phase {
                Phase::Follow => Box::new(|text| cyclic(shortened(text))),
                _ => Box::new(shortened),
            },
            emulated: Box::new(|text| text),
            stop: false,
            stall: None,
            full: None,
            slow: None,
            held_up: None,
            killed: false,
        }
    }

    /// The fault comes this long after the phase began.
    pub fn after_ms(mut self, ms: u64) -> Self {
        self.after = Duration::from_millis(ms);
        self
    }

    /// The noise and the errors of the machine.
    pub const fn seed(mut self, seed: u64) -> Self {
        self.seed = seed;
        self
    }

    /// A fault that stays.
    pub fn fault(self, fault: Fault) -> Self {
        self.inject(FaultConfig::permanent(fault))
    }

    /// A fault with its duration and probability.
    pub fn inject(mut self, fault: FaultConfig) -> Self {
        self.faults.push(fault);
        self
    }

    /// Something done to the emulated devices when the fault is due; `delivered` says
    /// afterwards whether it really struck.
    pub fn deed(
        mut self,
        deed: impl FnOnce(&Emulated) + 'static,
        delivered: impl Fn(&Emulated) -> bool + 'static,
    ) -> Self {
        self.deed = Some(Box::new(deed));
        self.delivered = Some(Box::new(delivered));
        self
    }

    /// A machine that differs from the shipped one in `key`.
    pub fn machine(mut self, from: &'static str, to: &'static str) -> Self {
        let earlier = self.machine;
        self.machine = Box::new(move |text| earlier(text).edit(from, to));
        self
    }

    /// An emulation that differs from the shipped one.
    pub fn emulated(mut self, from: &'static str, to: &'static str) -> Self {
        let earlier = self.emulated;
        self.emulated = Box::new(move |text| earlier(text).edit(from, to));
        self
    }

    /// Somebody asks to stop when the fault is due.
    pub const fn stop_request(mut self) -> Self {
        self.stop = true;
        self
    }

    /// The controller is held up for so long when the fault is due, right after a SYNC.
    pub const fn stall(mut self, span: Duration) -> Self {
        self.stall = Some(span);
        self
    }

    /// The controller's port has no more room for frames with this identifier.
    pub const fn full(mut self, cob_id: u16) -> Self {
        self.full = Some(cob_id);
        self
    }

    /// The controller's computer takes frames more slowly than they come when the fault is due.
    pub const fn slow(mut self, slow: Slow) -> Self {
        self.slow = Some(slow);
        self
    }

    /// The controller is held up for so long when the fault is due, whatever it does then;
    /// `look` is shown the machine every millisecond meanwhile, with the time since it began.
    pub fn held_up(
        mut self,
        span: Duration,
        mut look: impl FnMut(Duration, &Simulation) + 'static,
    ) -> Self {
        const STEP: Duration = Duration::from_millis(1);
        self.held_up = Some(span);
        self.deed = Some(Box::new(move |emulated| {
            let mut simulation = emulated.simulation_mut();
            let began = simulation.now();
            while simulation.now() < began + span {
                let next = (simulation.now() + STEP).min(began + span);
                simulation.advance(next);
                look(next - began, &simulation);
            }
        }));
        self
    }

    /// The controller is killed when the fault is due: it does nothing any more.
    pub fn killed(mut self) -> Self {
        self.killed = true;
        self.deed = Some(Box::new(|_| resume_unwind(Box::new(Killed))));
        self
    }

    /// Plays the scene, and looks on for a while after its end.
    #[track_caller]
    pub fn play(self) -> Played {
        let span = self.held_up;
        let (played, delivered) = self.play_to_end();
        if let Some(span) = span {
            let unseen = played.seen().unseen_since(played.due);
            assert!(
                unseen >= span,
                "held up for {unseen:?} in place of {span:?}"
            );
        }
        played.seen().everything_was_done();
        played.rest();
        if let Some(delivered) = &delivered {
            assert!(
                delivered(&played.bench.emulated),
                "the fault was never delivered"
            );
        }
        played
    }

    /// Plays the scene to the end of its phase.
    #[track_caller]
    pub fn play_on(self) -> Played {
        self.play_to_end().0
    }

    fn play_to_end(mut self) -> (Played, Option<Question>) {
        let seen = Rc::new(RefCell::new(Testimony::default()));
        let witness = Rc::clone(&seen);
        let mut bench = Bench::wrapped(self.seed, &self.machine, &self.emulated, |inner| {
            Box::new(Witnessed::new(inner, witness))
        });
        let store = bench.store.clone();
        let warnings = Rc::new(RefCell::new(Vec::new()));
        bench
            .machine
            .observe(Box::new(Listener(Rc::clone(&warnings))));
        let result = bench
            .machine
            .guarded(|machine| prepare(machine, self.phase, &store));
        result.unwrap_or_else(|failure| panic!("before the fault: {failure}"));
        let due = bench.machine.now() + self.after;
        let ids = self.schedule(&bench, due, &seen);
        let mut ended = due;
        let (calibrated, cause) = (RefCell::new(None), Cell::new(None));
        let guarded = AssertUnwindSafe(|| {
            bench.machine.guarded(|machine| {
                let result = perform(machine, self.phase, &store, &calibrated, &cause);
                ended = machine.now();
                result
            })
        });
        let result = catch_unwind(guarded).map(|result| {
            assert!(!self.killed, "nobody killed the controller: {result:?}");
            result
        });
        let result = result.unwrap_or_else(|panic| {
            if panic.is::<Killed>() {
                return Err(Failure::Machine(machine::Failure::Interrupted));
            }
            resume_unwind(panic)
        });
        let played = Played {
            bench,
            result,
            seen,
            ids,
            due,
            ended,
            warnings,
            calibrated,
            cause: cause.get(),
        };
        (played, self.delivered)
    }

    fn schedule(&mut self, bench: &Bench, due: Time, seen: &RefCell<Testimony>) -> Vec<FaultId> {
        let mut seen = seen.borrow_mut();
        if let Some(deed) = self.deed.take() {
            seen.plan(due, deed);
        }
        if let Some(span) = self.stall {
            seen.stall(due, span);
        }
        if let Some(cob_id) = self.full {
            seen.fill(due, cob_id);
        }
        if let Some(slow) = self.slow {
            seen.slow_down(due, slow);
        }
        if self.stop {
            let request = bench.machine.stop_request();
            seen.plan(due, Box::new(move |_| request.stop()));
        }
        let mut simulation = bench.emulated.simulation_mut();
        let later = self.after.as_secs_f64();
        let mut inject = |mut fault: FaultConfig| {
            fault.from_s += later;
            simulation
                .inject(fault)
                .expect("the fault names what is there")
        };
        self.faults.drain(..).map(&mut inject).collect()
    }
}

fn prepare(machine: &mut Machine, phase: Phase, store: &Store) -> Result<(), Failure> {
    if matches!(phase, Phase::Scan | Phase::Start) {
        return Ok(());
    }
    machine.start()?;
    if matches!(phase, Phase::Zero) {
        return Ok(());
    }
    machine.linear("x")?.zero(store)?;
    Ok(())
}

fn perform(
    machine: &mut Machine,
    phase: Phase,
    store: &Store,
    calibrated: &RefCell<Option<Calibrated>>,
    cause: &Cell<Option<Cause>>,
) -> Result<(), Failure> {
    match phase {
        Phase::Scan => drop(machine.scan()?),
        Phase::Start => machine.start()?,
        Phase::Zero => {
            machine.linear("x")?.zero(store)?;
        }
        Phase::Move => {
            machine.linear("x")?.move_to(Metres::from_mm(60.0))?;
        }
        Phase::Restart => {
            machine.disable("x")?;
            let until = machine.now() + Duration::from_millis(100);
            machine.run_until(until)?;
            machine.enable("x")?;
            machine.linear("x")?.move_to(Metres::from_mm(60.0))?;
        }
        Phase::Stand => {
            let until = machine.now() + Duration::from_secs(3);
            machine.run_until(until)?;
        }
        Phase::Calibrate => {
            let done = machine
                .linear("x")?
                .calibrate(store, &CalibrateOptions::default())?;
            *calibrated.borrow_mut() = Some(done);
        }
        Phase::Follow => cause.set(Some(follow(machine)?)),
        Phase::Verify => {
            let options = VerifyOptions {
                compensated: false,
                calibration: None,
                resume: None,
            };
            machine.linear("x")?.verify(store, &options)?;
        }
    }
    Ok(())
}

/// Writes down the warnings.
pub struct Listener(pub Rc<RefCell<Vec<String>>>);

impl Observer for Listener {
    fn progress(&mut self, _: Stage, _: &str, _: u64, _: u64) {}

    fn warning(&mut self, text: &str) {
        self.0.borrow_mut().push(text.to_owned());
    }
}

/// A scene that was played.
pub struct Played {
    pub bench: Bench,
    pub result: Result<(), Failure>,
    pub seen: Rc<RefCell<Testimony>>,
    ids: Vec<FaultId>,
    warnings: Rc<RefCell<Vec<String>>>,
    /// What a calibration gave.
    pub calibrated: RefCell<Option<Calibrated>>,
    /// How following a path came to its end.
    pub cause: Option<Cause>,
    /// When the fault was due.
    pub due: Time,
    /// When the phase ended.
    pub ended: Time,
}

impl Played {
    /// Two seconds without a controller, with the witness looking on.
    fn rest(&self) {
        let mut simulation = self.bench.emulated.simulation_mut();
        let end = simulation.now() + WATCHED;
        while simulation.now() < end {
            let next = simulation.now() + Duration::from_millis(2);
            simulation.advance(next);
            let here = (next, simulation.truth().scale_position().value());
            self.seen.borrow_mut().path.push(here);
        }
    }

    /// How long after the fault the phase ended.
    pub fn reaction(&self) -> Duration {
        self.ended - self.due
    }

    /// What the operator was warned of.
    pub fn warnings(&self) -> Vec<String> {
        self.warnings.borrow().clone()
    }

    /// What the witness saw.
    pub fn seen(&self) -> Ref<'_, Testimony> {
        self.seen.borrow()
    }

    /// Points that the newest journal of `verb` holds.
    #[track_caller]
    pub fn journal_points(&self, verb: &str) -> usize {
        let path = self.bench.store.newest_run(verb, "x").unwrap();
        read_journal::<LinearLog>(&path.expect("there is a journal"))
            .unwrap()
            .log
            .points
            .len()
    }

    /// The machine came to rest within `span` of the fault and stays so, without power or in
    /// quick stop; whatever calibration is active can be used, every journal read.
    #[track_caller]
    pub fn is_safe(&self, span: Duration) -> &Self {
        if let Some(at) = self.seen().moved_last(self.due) {
            assert!(
                at <= self.due + span,
                "still moving {:?} after the fault",
                at - self.due
            );
        }
        let state = power_state(&self.bench.emulated);
        let harmless = !matches!(state, PowerState::OperationEnabled);
        assert!(harmless, "the drive was left in {state}");
        self.keeps_its_records()
    }

    /// Whatever calibration is active can be used, and every journal can be read.
    #[track_caller]
    pub fn keeps_its_records(&self) -> &Self {
        let store = &self.bench.store;
        if let Some(id) = store.active("x").unwrap().current {
            store
                .glance(&id)
                .unwrap_or_else(|error| panic!("active calibration: {error}"));
        }
        if let Ok(folder) = std::fs::read_dir(store.runs()) {
            for entry in folder {
                let path = entry.unwrap().path();
                read_journal::<LinearLog>(&path).unwrap_or_else(|error| panic!("journal: {error}"));
            }
        }
        self
    }

    /// Every fault struck.
    #[track_caller]
    pub fn was_delivered(&self) -> &Self {
        let simulation = self.bench.emulated.simulation();
        for id in &self.ids {
            assert!(
                simulation.fault_deliveries(*id) > 0,
                "{id:?} was never delivered"
            );
        }
        self
    }
}

/// The drive's state as it is, whatever it says.
pub fn power_state(emulated: &Emulated) -> PowerState {
    with_drive(emulated, |drive| drive.power_state())
}

/// Looks at the drive, or changes it.
pub fn with_drive<R>(emulated: &Emulated, look: impl FnOnce(&mut Cia402DriveNode) -> R) -> R {
    let mut simulation = emulated.simulation_mut();
    look(
        simulation
            .node_mut("drive")
            .expect("the machine has a drive"),
    )
}

/// What must come of a fault.
pub struct Wanted<'a> {
    /// Whether this is the failure.
    pub cause: fn(&Failure) -> bool,
    /// Words of its text.
    pub words: &'a [&'a str],
    /// From the fault to the failure, at most.
    pub within: Duration,
    /// From the fault to rest, at most.
    pub rest: Duration,
}

/// Plays `scene` and judges what came of it: delivered, named, in time, safe, nothing lost.
#[track_caller]
pub fn check(scene: Scene, wanted: &Wanted<'_>) -> Played {
    let played = scene.play();
    let failure = match &played.result {
        Ok(()) => panic!("nothing was noticed until {}", played.ended),
        Err(failure) => failure,
    };
    let text = failure.to_string();
    assert!(
        (wanted.cause)(failure),
        "another cause was named: {text}\n{failure:?}"
    );
    for word in wanted.words {
        assert!(text.contains(word), "`{word}` is not in: {text}");
    }
    let reaction = played.reaction();
    assert!(
        reaction <= wanted.within,
        "noticed only after {reaction:?}: {text}"
    );
    played.was_delivered();
    played.is_safe(wanted.rest);
    played
}

/// Plays `scene`, whose fault must do no harm.
#[track_caller]
pub fn check_harmless(scene: Scene) -> Played {
    let played = scene.play();
    played.was_delivered();
    if let Err(failure) = &played.result {
        panic!("should have been tolerated: {failure}\n{failure:?}");
    }
    played.keeps_its_records();
    played
}
