//! The player of a history: it gives the requests, and tells the judges what they allow.

use core::time::Duration;
use std::sync::Arc;

use mock_bus::fault::FaultConfig;
use mock_bus::simulation::Simulation;
use service::{
    Caller, Desk, IfMoving, JogRequest, MoveRequest, Opened, Problem, RunKind, RunRequest,
    RunState, Service, StopMode, WayName,
};
use truestage::Machine;
use truestage::config::Loaded;

use super::draw::{MoveStep, Step, Timed};
use super::judge::{AxisFacts, Judge, Violation, Wrong, drive};
use super::kind::Kind;
use super::stage::Stage;

/// How long a step is waited for at most.
const STEP_MAX: Duration = Duration::from_secs(120);
/// How often the end of a step is looked for.
const LOOK_EVERY: Duration = Duration::from_millis(10);
/// A jog is renewed so often.
const RENEW_EVERY: Duration = Duration::from_millis(50);
/// It lapses 200 ms after it was renewed last.
const JOG_LAPSES: Duration = Duration::from_millis(300);

/// Motions and a run that have not ended.
#[derive(Clone, Debug)]
struct UnderWay {
    /// Of each axis.
    motions: Vec<Option<String>>,
    /// Of all of them.
    run: Option<Run>,
}

#[derive(Clone, Debug)]
struct Run {
    id: String,
    /// How many homings each drive had attained when it began.
    attained: Vec<u64>,
}

impl UnderWay {
    fn nothing(kind: &Kind) -> Self {
        Self {
            motions: vec![None; kind.axes.len()],
            run: None,
        }
    }

    fn is_nothing(&self) -> bool {
        self.run.is_none() && self.motions.iter().all(Option::is_none)
    }

    /// Whether nothing has the axis.
    fn is_free(&self, axis: usize) -> bool {
        self.run.is_none() && self.motions[axis].is_none()
    }
}

/// A program that keeps the machine.
struct Program {
    service: Service,
    desk: Desk,
}

/// Plays one history.
pub(super) struct Player<'k> {
    kind: &'k Kind,
    loaded: Loaded,
    stage: Arc<Stage>,
    program: Option<Program>,
    under_way: UnderWay,
    /// What was done, for people.
    pub(super) story: Vec<String>,
}

fn anna() -> Caller {
    Caller::named("anna")
}

/// Life of the history.
impl<'k> Player<'k> {
    pub(super) fn new(kind: &'k Kind, loaded: Loaded, stage: Arc<Stage>) -> Self {
        Self {
            kind,
            loaded,
            stage,
            program: None,
            under_way: UnderWay::nothing(kind),
            story: vec![],
        }
    }

    /// Plays all steps, and a while after them; the first violation ends the history.
    pub(super) fn play(&mut self, steps: &[Timed]) -> Option<Violation> {
        const AFTERWARDS: Duration = Duration::from_millis(1500);
        self.start();
        for timed in steps {
            if self.violation().is_some() {
                break;
            }
            let restarts = matches!(timed.step, Step::Restart { .. });
            if self.program.is_some() || restarts {
                self.step(&timed.step);
                self.let_be(timed.cut);
            }
        }
        if self.violation().is_none() {
            self.pass(AFTERWARDS);
        }
        self.end();
        self.stage.devices().rest(Duration::from_secs(2));
        self.violation()
    }

    fn violation(&self) -> Option<Violation> {
        self.stage.devices().violation()
    }

    fn note(&mut self, what: impl Into<String>) {
        let now = self.stage.devices().simulation.now();
        self.story
            .push(format!("{:8.3} {}", now.seconds(), what.into()));
    }

    fn axis(&self, axis: usize) -> &'static AxisFacts {
        &self.kind.axes[axis]
    }

    /// Tells the judge of an axis.
    fn judge<R>(&self, axis: usize, work: impl FnOnce(&mut Judge, &mut Simulation) -> R) -> R {
        let mut devices = self.stage.devices();
        let devices = &mut *devices;
        work(&mut devices.judges[axis], &mut devices.simulation)
    }

    fn each_judge(&self, work: impl Fn(&mut Judge, &mut Simulation)) {
        for axis in 0..self.kind.axes.len() {
            self.judge(axis, &work);
        }
    }

    fn start(&mut self) {
        self.each_judge(|judge, simulation| {
            judge.forget_coasting();
            judge.allow_slowing(simulation, "the start of a program".into());
        });
        let (loaded, stage) = (self.loaded.clone(), Arc::clone(&self.stage));
        let store = loaded.config.machine.store();
        let open = move || {
            Ok(Opened {
                machine: Machine::new(&loaded, stage.transport()),
                store,
                held: Box::new(()),
                teller: None,
            })
        };
        let is_over =
            |started: &Result<Service, _>| started.as_ref().map_or(true, Service::is_over);
        match self.stage.start(|| Service::start(open), is_over) {
            Ok(service) => {
                let desk = service.desk();
                self.stage.set_desk(Some(desk.clone()));
                self.program = Some(Program { service, desk });
                self.note("a program has started");
            }
            Err(error) => self.note(format!("a program does not start: {error}")),
        }
    }

    fn end(&mut self) {
        self.leave_all("the end of the program");
        let Some(program) = self.program.take() else {
            return;
        };
        let is_over = || program.service.is_over();
        let _ = self.stage.ask(|| program.desk.end(&anna()), is_over);
        let ended = program.service.wait();
        self.stage.set_desk(None);
        self.leave_all("the end of the program");
        self.note(format!("the program has ended: {ended:?}"));
    }

    fn is_over(&self) -> bool {
        let service = self.program.as_ref().map(|program| &program.service);
        service.is_none_or(Service::is_over)
    }

    /// Lets time pass, whatever keeps the machine.
    fn pass(&self, span: Duration) {
        match &self.program {
            Some(program) => self.stage.let_pass(span, || program.service.is_over()),
            None => self.stage.devices().rest(span),
        }
    }

    fn ask<R>(
        &self,
        order: impl FnOnce(&Desk) -> Result<R, Problem>,
    ) -> Option<Result<R, Problem>> {
        let program = self.program.as_ref().filter(|_| !self.is_over())?;
        let is_over = || program.service.is_over();
        Some(self.stage.ask(|| order(&program.desk), is_over))
    }

    /// Gives an order and notes how it was answered.
    fn order<R>(
        &mut self,
        what: &str,
        order: impl FnOnce(&Desk) -> Result<R, Problem>,
    ) -> Option<R> {
        let answered = self.ask(order)?;
        let said = match &answered {
            Ok(_) => "yes".to_owned(),
            Err(problem) => format!("no: {problem}"),
        };
        self.note(format!("{what}: {said}"));
        answered.ok()
    }

    /// An axis may slow down, and is free.
    fn leave(&mut self, axis: usize, why: &str) {
        self.under_way.motions[axis] = None;
        self.judge(axis, |judge, simulation| {
            judge.end_search();
            judge.allow_slowing(simulation, why.to_owned());
        });
    }

    fn leave_all(&mut self, why: &str) {
        self.under_way.run = None;
        for axis in 0..self.kind.axes.len() {
            self.leave(axis, why);
        }
    }

    /// Lets the step be for so long, or to its end.
    fn let_be(&mut self, cut: Option<Duration>) {
        let limit = match cut {
            Some(cut) => cut,
            None if self.under_way.is_nothing() => LOOK_EVERY,
            None => STEP_MAX,
        };
        let mut passed = Duration::ZERO;
        while passed < limit && self.violation().is_none() {
            self.pass(LOOK_EVERY);
            passed += LOOK_EVERY;
            self.see_ends();
            if cut.is_none() && self.under_way.is_nothing() {
                return;
            }
        }
    }

    /// What was under way may have come to its end.
    fn see_ends(&mut self) {
        let Some(desk) = self.program.as_ref().map(|program| program.desk.clone()) else {
            return;
        };
        for axis in 0..self.kind.axes.len() {
            let Some(id) = &self.under_way.motions[axis] else {
                continue;
            };
            let motion = desk.motion(id).expect("it was asked for");
            if motion.state.is_end() {
                self.note(format!("it ends as {:?}, {:?}", motion.state, motion.cause));
                self.leave(axis, "the end of a motion");
            }
        }
        let Some(Run { id, attained }) = self.under_way.run.clone() else {
            return;
        };
        let run = desk.run(&id).expect("it was asked for");
        if run.state.is_end() {
            self.note(format!("it ends as {:?}, {:?}", run.state, run.cause));
            if run.kind == RunKind::Zero && run.state == RunState::Done {
                self.judge_zeros(&attained);
            }
            self.leave_all("the end of a run");
        }
    }
}

/// Requests.
impl Player<'_> {
    fn step(&mut self, step: &Step) {
        match step {
            Step::Zero => self.run(RunKind::Zero, None),
            Step::Measure { calibrates: true } => self.run(RunKind::Calibrate, None),
            Step::Measure { calibrates: false } => self.run(RunKind::Verify, None),
            Step::Path { from, to } => self.run(RunKind::Path, Some((*from, *to))),
            Step::Enable { axis } => {
                let name = self.axis(*axis).name;
                self.order(&format!("enable {name}"), |desk| desk.enable(&anna(), name));
            }
            Step::Disable { axis } => {
                let name = self.axis(*axis).name;
                self.order(&format!("disable {name}"), |desk| {
                    desk.disable(&anna(), name)
                });
            }
            Step::Stop => self.stop(StopMode::Controlled),
            Step::QuickStop => self.stop(StopMode::Quick),
            Step::Reset => {
                self.order("reset", |desk| desk.reset(&anna()));
            }
            Step::Move(step) => self.move_to(*step),
            Step::Jog {
                axis,
                speed,
                held,
                has_rival,
            } => self.jog(*axis, *speed, *held, *has_rival),
            Step::Restart { after } => {
                self.end();
                self.stage.devices().rest(*after);
                self.start();
            }
            Step::Fault { axis, fault, lasts } => {
                let name = self.axis(*axis).name;
                self.note(format!("{name}: {fault:?} for {lasts:?}"));
                let config = FaultConfig::lasting(fault.clone(), *lasts);
                let injected = self.stage.devices().simulation.inject(config);
                injected.expect("a fault of this machine");
                self.each_judge(|judge, simulation| judge.allow_coasting(simulation));
            }
            Step::Nothing => {}
        }
    }

    fn stop(&mut self, mode: StopMode) {
        let asked = self.order(&format!("stop {mode:?}"), |desk| desk.stop(&anna(), mode));
        if asked.is_some() {
            self.leave_all("a stop");
        }
    }

    fn run(&mut self, kind: RunKind, path: Option<(f64, f64)>) {
        let attained = self.attained();
        let is_free = self.under_way.is_nothing();
        // While another one is under way it is refused, and nothing more is allowed.
        if is_free {
            self.allow_run(kind, path);
        }
        let mut request = RunRequest::of(kind, None);
        request.uncompensated = matches!(kind, RunKind::Verify | RunKind::Path);
        request.path = path.map(|(from, to)| self.rows(from, to).into());
        let id = self.order(&format!("{kind:?} {path:?}"), |desk| {
            desk.plan_run(&anna(), &request, None)
        });
        match id {
            Some(id) => {
                if !is_free {
                    // The one before ended meanwhile.
                    self.see_ends();
                    self.allow_run(kind, path);
                }
                self.under_way.run = Some(Run { id, attained });
            }
            None if is_free => self.leave_all("a refused run"),
            None => {}
        }
    }

    fn attained(&self) -> Vec<u64> {
        let axes = self.kind.axes.iter().enumerate();
        let attained = |(axis, facts): (usize, &AxisFacts)| {
            self.judge(axis, |_, simulation| {
                drive(simulation, facts).homings().attained
            })
        };
        axes.map(attained).collect()
    }

    fn allow_run(&self, run: RunKind, path: Option<(f64, f64)>) {
        let kind = self.kind;
        for (axis, facts) in kind.axes.iter().enumerate() {
            let (shown, here) = self.place(axis);
            let asked = format!("{run:?} {path:?}");
            self.judge(axis, |judge, simulation| match (run, path) {
                (RunKind::Zero, _) => judge.allow_search(simulation, kind.search, &asked),
                (_, Some((from, to))) => {
                    let ends = [from - shown, to - shown, 0.0];
                    let low = ends.into_iter().fold(f64::INFINITY, f64::min);
                    let high = ends.into_iter().fold(f64::NEG_INFINITY, f64::max);
                    judge.allow(simulation, (here + low, here + high), kind.speed, asked);
                }
                (_, None) => {
                    let speed = kind.speed.max(facts.search_speed);
                    let (low, high) = kind.search;
                    judge.allow(simulation, (here + low, here + high), speed, asked);
                }
            });
        }
    }

    /// A path of all axes at a quarter of the usual speed.
    fn rows(&self, from: f64, to: f64) -> String {
        let takes_s = ((to - from).abs() / self.kind.speed * 4.0).max(1.0);
        let mut rows = "time_s,x_mm,y_mm,z_mm\n".to_owned();
        for (time_s, place) in [(0.0, from), (takes_s, to)] {
            let mm = place / self.kind.axes[0].per_unit;
            rows += &format!("{time_s},{mm},{mm},{mm}\n");
        }
        rows
    }

    /// Where the axis is in the drive's coordinates, and in the plant's.
    fn place(&self, axis: usize) -> (f64, f64) {
        let facts = self.axis(axis);
        self.judge(axis, |judge, simulation| {
            let (here, _) = judge.state(simulation);
            let counts = simulation.encoder_counts(facts.number);
            let resolution = simulation.encoder_resolution(facts.number);
            let shown = drive(simulation, facts).position_at(counts);
            (shown as f64 * resolution, here)
        })
    }

    fn move_to(&mut self, step: MoveStep) {
        let kind = self.kind;
        let speed = step.speed.unwrap_or(kind.speed);
        let name = self.axis(step.axis).name;
        let mut request = MoveRequest::of(name, kind.target(step.target));
        request.speed = step.speed.map(|speed| kind.speed_of(speed));
        request.uncompensated = true;
        request.way = kind.turns.then_some(WayName::Shortest);
        request.dead_man_ms = step.lapses.then_some(100);
        if step.supersedes {
            request.if_moving = IfMoving::Supersede;
        }
        let (target, at) = (kind.text(step.target), kind.text(speed));
        let (supersedes, lapses) = (step.supersedes, step.lapses);
        let what =
            format!("move {name} to {target} at {at}/s, supersedes {supersedes}, lapses {lapses}");
        let is_free = self.under_way.is_free(step.axis);
        let before = self.judge(step.axis, |judge, _| judge.allowed());
        if is_free || step.supersedes {
            self.allow_move(step.axis, step.target, speed, what.clone());
        }
        let id = self.order(&what, |desk| desk.begin_motion(&anna(), &request, None));
        match id {
            Some(id) => {
                if !is_free && !step.supersedes {
                    // What had the axis ended meanwhile.
                    self.see_ends();
                    self.allow_move(step.axis, step.target, speed, what);
                }
                self.under_way.motions[step.axis] = Some(id);
            }
            None if is_free => self.leave(step.axis, "a refused motion"),
            None => self.judge(step.axis, |judge, _| judge.put_back(before)),
        }
    }

    /// The way to `target`, from where the axis is.
    fn allow_move(&self, axis: usize, target: f64, speed: f64, asked: String) {
        let (kind, facts) = (self.kind, self.axis(axis));
        let (shown, here) = self.place(axis);
        let way = kind.way(shown, target);
        self.judge(axis, |judge, simulation| {
            // A superseded motion slows down first, after which the other way round may be the shorter one.
            let now = judge.state(simulation).1.max(speed);
            let around = kind.way_around(way, now * now / facts.acceleration);
            let low = here + way.min(around).min(0.0) - kind.approach;
            let high = here + way.max(around).max(0.0) + kind.approach;
            judge.allow(simulation, (low, high), now, asked);
        });
    }

    fn jog(&mut self, axis: usize, speed: f64, held: Duration, has_rival: bool) {
        let name = self.axis(axis).name;
        let request = JogRequest {
            axis: name.into(),
            speed: self.kind.speed_of(speed),
        };
        if !self.under_way.is_free(axis) {
            let id = self.order("jog beside another motion", |desk| {
                desk.jog(&anna(), &request)
            });
            if let Some(id) = id {
                // What had the axis ended meanwhile.
                self.see_ends();
                let way = speed * JOG_LAPSES.as_secs_f64();
                self.allow_jogs(axis, speed, way, "a jog after another motion");
                self.under_way.motions[axis] = Some(id);
            }
            return;
        }
        let way = speed * (held + RENEW_EVERY + JOG_LAPSES).as_secs_f64();
        let back = JogRequest {
            axis: name.into(),
            speed: self.kind.speed_of(-speed),
        };
        let at = self.kind.text(speed);
        let what = format!("jog {name} at {at}/s for {held:?}, a rival {has_rival}");
        self.judge(axis, |judge, simulation| {
            let here = judge.state(simulation).0;
            let ends = (here + way.min(0.0), here + way.max(0.0));
            judge.allow(simulation, ends, speed.abs(), what.clone());
        });
        let mut id = self.order(&what, |desk| desk.jog(&anna(), &request));
        let mut passed = Duration::ZERO;
        while id.is_some() && passed < held {
            self.pass(RENEW_EVERY);
            passed += RENEW_EVERY;
            if has_rival {
                // Refused, unless the jog before has ended at the end of its way.
                let is_taken = self.ask(|desk| desk.jog(&Caller::named("bert"), &back));
                if matches!(is_taken, Some(Ok(_))) {
                    self.allow_jogs(axis, speed, way, &what);
                    self.pass(JOG_LAPSES * 2);
                    passed = held;
                }
            }
            if let Some(Ok(again)) = self.ask(|desk| desk.jog(&anna(), &request)) {
                id = Some(again);
            }
        }
        match id {
            Some(id) => self.under_way.motions[axis] = Some(id),
            None => self.leave(axis, "a refused jog"),
        }
    }

    /// Jogs in both directions, from where the axis is.
    fn allow_jogs(&mut self, axis: usize, speed: f64, way: f64, what: &str) {
        self.judge(axis, |judge, simulation| {
            let here = judge.state(simulation).0;
            let ends = (here - way.abs(), here + way.abs());
            judge.allow(simulation, ends, speed.abs(), what.to_owned());
        });
    }

    /// A zero that was told is one, of every axis.
    fn judge_zeros(&self, attained: &[u64]) {
        let kind = self.kind;
        for (axis, facts) in kind.axes.iter().enumerate() {
            let (shown, _) = self.place(axis);
            self.judge(axis, |judge, simulation| {
                let homings = drive(simulation, facts).homings();
                let now = simulation.now();
                let off = true_zero_off(kind, simulation, shown);
                if homings.attained == attained[axis] {
                    let text = format!("told as found, and no homing was attained: {homings:?}");
                    judge.accuse(Wrong::Zero, now, text);
                } else if off > facts.following_error {
                    let text = format!("told as found, {} off", kind.text(off));
                    judge.accuse(Wrong::Zero, now, text);
                }
            });
        }
    }
}

/// How far the drive's coordinates are off the true zero, where the plant has one.
fn true_zero_off(kind: &Kind, simulation: &Simulation, shown: f64) -> f64 {
    let truth = simulation.truth();
    let true_place = match truth.table() {
        Some(table) => table.reading().value(),
        None if kind.follows_paths => return 0.0,
        None => truth.position().value(),
    };
    kind.way(true_place, shown).abs()
}
