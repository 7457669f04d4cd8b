//! A judge who sees the plant, and knows what was asked.
//!
//! Places are encoder travel from the scale's own zero, in metres or radians.

use std::collections::VecDeque;
use std::fmt;
use std::time::Duration;

use mock_bus::node::cia402_drive::Cia402DriveNode;
use mock_bus::simulation::Simulation;
use service::{AxisState, Desk};
use units::Time;
use wire::cia402::PowerState;

/// How the judge looks at an axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct AxisFacts {
    pub(super) name: &'static str,
    /// What the emulation calls its drive.
    pub(super) node: &'static str,
    /// Its number in the plant.
    pub(super) number: usize,
    /// Its following-error limit.
    pub(super) following_error: f64,
    pub(super) acceleration: f64,
    /// What slows it down without torque.
    pub(super) friction: f64,
    /// Seconds from the answer to a request until its controlword takes effect.
    pub(super) reaction: f64,
    /// How fast its deceleration builds up in a controlled stop.
    pub(super) jerk: f64,
    /// Of its reference search, the fastest part.
    pub(super) search_speed: f64,
    /// Slower than this it stands.
    pub(super) standing_speed: f64,
    /// A place in the unit of `unit`.
    pub(super) per_unit: f64,
    pub(super) unit: &'static str,
}

/// What a history did that it must not.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Wrong {
    /// The axis was where nothing that was asked leads.
    Place,
    /// It was faster than asked.
    Speed,
    /// It was told to stand, and moved.
    Standstill,
    /// It was told to have its zero, and has none.
    Zero,
}

/// A verdict.
#[derive(Clone, Debug)]
pub(super) struct Violation {
    pub(super) wrong: Wrong,
    pub(super) at: Time,
    pub(super) text: String,
}

impl fmt::Display for Violation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{:?} at {:.3} s: {}",
            self.wrong,
            self.at.seconds(),
            self.text
        )
    }
}

/// Where the axis may be, and how fast.
#[derive(Clone, Debug)]
pub(super) struct Allowed {
    low: f64,
    high: f64,
    speed: f64,
    /// What was asked.
    asked: String,
    /// When it has to stand, where it may only slow down.
    stands_by: Option<Time>,
}

/// Sees one axis.
pub(super) struct Judge {
    facts: AxisFacts,
    allowed: Allowed,
    track: VecDeque<(Time, f64)>,
    standstill_since: Option<Time>,
    unhomed_since: Option<Time>,
    /// Something took the torque away, or will.
    may_coast: bool,
    /// A search is under way: the drive's home comes and goes.
    is_searching: bool,
    /// Takes effect once the drive begins a homing after so many.
    search: Option<(u64, Allowed)>,
    desk: Option<Desk>,
    asked_at: Time,
    pub(super) violation: Option<Violation>,
}

/// Speeds are judged over this time: one sample says nothing of a speed, and a monitor needs some to see one.
const SPEED_OVER: Duration = Duration::from_millis(300);
/// Standing is judged over this time.
const STANDING_OVER: Duration = Duration::from_millis(150);
/// An axis that slows down stands after this time.
const STANDS_AFTER: Duration = Duration::from_secs(3);
/// How often the program is asked what it shows.
const ASK_EVERY: Duration = Duration::from_millis(20);

impl Judge {
    pub(super) fn new(facts: AxisFacts) -> Self {
        Self {
            facts,
            allowed: Allowed {
                low: f64::NEG_INFINITY,
                high: f64::INFINITY,
                speed: 0.0,
                asked: "nothing yet".into(),
                stands_by: Some(Time::ZERO),
            },
            track: VecDeque::new(),
            standstill_since: None,
            unhomed_since: None,
            may_coast: false,
            is_searching: false,
            search: None,
            desk: None,
            asked_at: Time::ZERO,
            violation: None,
        }
    }

    pub(super) fn set_desk(&mut self, desk: Option<Desk>) {
        self.desk = desk;
        self.standstill_since = None;
        self.unhomed_since = None;
    }

    /// From now on the axis may be between these places, at this speed.
    pub(super) fn allow(
        &mut self,
        simulation: &mut Simulation,
        between: (f64, f64),
        speed: f64,
        asked: String,
    ) {
        let (low, high) = between;
        simulation.mark_travel(self.facts.number);
        self.track.clear();
        let beyond = self.facts.following_error + self.stopping_way(simulation, speed);
        self.allowed = Allowed {
            low: low - beyond,
            high: high + beyond,
            speed,
            asked,
            stands_by: None,
        };
    }

    /// Returns the present allowance, to be put back where a request is refused.
    pub(super) fn allowed(&self) -> Allowed {
        self.allowed.clone()
    }

    /// A request was refused: what was allowed before it still is.
    pub(super) fn put_back(&mut self, allowed: Allowed) {
        self.allowed = allowed;
    }

    /// From now on it may slow down, and then has to stand.
    pub(super) fn allow_slowing(&mut self, simulation: &mut Simulation, asked: String) {
        let (here, speed) = self.state(simulation);
        let now = simulation.now();
        // Until the drive has the controlword its axis goes on and may still speed up; with a jerk, until
        // its acceleration has turned into a deceleration.
        let (jerk, reaction) = (self.facts.jerk, self.facts.reaction);
        let acceleration = self.deceleration(simulation);
        let most = self.allowed.speed.max(speed);
        let heard = (speed + acceleration * reaction).min(most);
        let fastest = (heard + acceleration * acceleration / (2.0 * jerk)).min(most);
        let turning = 2.0 * (fastest - heard) / acceleration + acceleration / (2.0 * jerk);
        let way = fastest * (reaction + turning);
        self.allow(simulation, (here - way, here + way), fastest, asked);
        self.allowed.speed = self.allowed.speed.max(self.facts.standing_speed);
        self.allowed.stands_by = Some(now + STANDS_AFTER);
    }

    /// Something takes the torque away from now on: the axis may coast.
    pub(super) fn allow_coasting(&mut self, simulation: &Simulation) {
        let (_, speed) = self.state(simulation);
        let speed = speed.max(self.allowed.speed);
        let way = speed * speed / (2.0 * self.facts.friction);
        self.allowed.low -= way;
        self.allowed.high += way;
        self.may_coast = true;
    }

    /// A new program keeps the machine.
    pub(super) const fn forget_coasting(&mut self) {
        self.may_coast = false;
    }

    /// A search between these places is asked for: the axis stands until its drive begins it.
    pub(super) fn allow_search(
        &mut self,
        simulation: &mut Simulation,
        between: (f64, f64),
        asked: &str,
    ) {
        let (here, speed) = self.state(simulation);
        let (low, high) = between;
        let begun = drive(simulation, &self.facts).homings().begun;
        let speed = speed.max(self.facts.search_speed);
        self.allow(
            simulation,
            (here + low, here + high),
            speed,
            asked.to_owned(),
        );
        self.search = Some((begun, self.allowed.clone()));
        self.allow_slowing(simulation, format!("{asked}, whose turn has not come"));
        self.is_searching = true;
    }

    /// The search that is allowed has begun.
    fn begin_search(&mut self, simulation: &mut Simulation) {
        if let Some((before, _)) = &self.search
            && drive(simulation, &self.facts).homings().begun > *before
            && let Some((_, allowed)) = self.search.take()
        {
            simulation.mark_travel(self.facts.number);
            self.track.clear();
            self.allowed = allowed;
        }
    }

    /// No search is under way.
    pub(super) fn end_search(&mut self) {
        self.is_searching = false;
        self.search = None;
    }

    /// Where the axis is, and how fast.
    pub(super) fn state(&self, simulation: &Simulation) -> (f64, f64) {
        let travel = simulation
            .travel(self.facts.number)
            .expect("the machine has an axis");
        (travel.position, travel.speed.abs())
    }

    fn stopping_way(&self, simulation: &mut Simulation, speed: f64) -> f64 {
        speed * speed / (2.0 * self.deceleration(simulation))
    }

    /// What slows the axis down: its drive, in the unit that it has, or friction.
    fn deceleration(&self, simulation: &mut Simulation) -> f64 {
        let drive = drive(simulation, &self.facts);
        let driven = drive.power_state() == PowerState::OperationEnabled;
        if driven && !self.may_coast {
            self.facts.acceleration * drive.quirks_mut().acceleration_unit.unwrap_or(1.0)
        } else {
            self.facts.friction
        }
    }

    /// Looks at the axis and at its view.
    pub(super) fn look(&mut self, simulation: &mut Simulation) {
        if self.violation.is_some() {
            return;
        }
        self.begin_search(simulation);
        let now = simulation.now();
        let (here, _) = self.state(simulation);
        self.track.push_back((now, here));
        while self
            .track
            .front()
            .is_some_and(|(at, _)| now - *at > SPEED_OVER * 2)
        {
            self.track.pop_front();
        }
        self.judge_place(simulation);
        self.judge_speed(now, here);
        self.come_to_rest(simulation, now, here);
        if now - self.asked_at >= ASK_EVERY {
            self.asked_at = now;
            self.judge_shown(simulation, now, here);
        }
    }

    fn judge_place(&mut self, simulation: &Simulation) {
        let travel = simulation
            .travel(self.facts.number)
            .expect("the machine has an axis");
        let Allowed { low, high, .. } = self.allowed;
        let beyond = (low - travel.since_mark.low).max(travel.since_mark.high - high);
        if beyond > 0.0 {
            let text = format!(
                "{} beyond {} to {}, asked: {}",
                self.text(beyond),
                self.text(low),
                self.text(high),
                self.allowed.asked
            );
            self.accuse(Wrong::Place, simulation.now(), text);
        }
    }

    /// The mean speed over the last [`SPEED_OVER`], once it lies behind what was asked.
    fn judge_speed(&mut self, now: Time, here: f64) {
        let Some(speed) = self.mean_speed(now, here, SPEED_OVER) else {
            return;
        };
        let most = 1.1 * self.allowed.speed + self.facts.standing_speed;
        if speed > most && self.allowed.stands_by.is_none() {
            let text = format!(
                "{}/s where at most {}/s was asked: {}",
                self.text(speed),
                self.text(self.allowed.speed),
                self.allowed.asked
            );
            self.accuse(Wrong::Speed, now, text);
        }
    }

    /// The mean speed over the last `span`; `None` before that has passed.
    fn mean_speed(&self, now: Time, here: f64, span: Duration) -> Option<f64> {
        let old = self.track.partition_point(|(at, _)| now - *at >= span);
        let (at, place) = self.track[old.checked_sub(1)?];
        Some((here - place).abs() / (now - at).as_secs_f64())
    }

    /// An axis that only slows down and has come to rest has to stay there.
    fn come_to_rest(&mut self, simulation: &mut Simulation, now: Time, here: f64) {
        let Some(stands_by) = self.allowed.stands_by else {
            return;
        };
        let speed = self.mean_speed(now, here, STANDING_OVER);
        let stands = speed.is_some_and(|speed| speed < self.facts.standing_speed / 10.0);
        if stands_by != Time::NEVER && (stands || now >= stands_by) {
            let asked = format!("to stand, after {}", self.allowed.asked);
            self.allow(simulation, (here, here), 0.0, asked);
            self.allowed.stands_by = Some(Time::NEVER);
        }
    }

    fn judge_shown(&mut self, simulation: &mut Simulation, now: Time, here: f64) {
        let shown = self.desk.as_ref().map(|desk| desk.axis(self.facts.name));
        let Some(Ok(axis)) = shown else {
            return;
        };
        if axis.state != AxisState::Standstill {
            self.standstill_since = None;
        }
        let since = *self.standstill_since.get_or_insert(now);
        let speed = self.mean_speed(now, here, STANDING_OVER).unwrap_or(0.0);
        let long = axis.state == AxisState::Standstill && now - since >= STANDING_OVER + ASK_EVERY;
        if long && speed > self.facts.standing_speed {
            let text = format!("\"Standstill\" at {}/s", self.text(speed));
            self.accuse(Wrong::Standstill, now, text);
        }
        let false_zero =
            axis.homed && !self.is_searching && !drive(simulation, &self.facts).is_homed();
        if !false_zero {
            self.unhomed_since = None;
            return;
        }
        let since = *self.unhomed_since.get_or_insert(now);
        if now - since >= Duration::from_secs(1) {
            let text = "it is shown as zeroed, and its drive has no home".to_owned();
            self.accuse(Wrong::Zero, now, text);
        }
    }

    /// Something is wrong; the first of it counts.
    pub(super) fn accuse(&mut self, wrong: Wrong, at: Time, text: String) {
        let text = format!("{}: {text}", self.facts.name);
        self.violation.get_or_insert(Violation { wrong, at, text });
    }

    fn text(&self, place: f64) -> String {
        format!("{:.3} {}", place / self.facts.per_unit, self.facts.unit)
    }
}

/// The drive of an axis.
pub(super) fn drive<'s>(
    simulation: &'s mut Simulation,
    facts: &AxisFacts,
) -> &'s mut Cia402DriveNode {
    let node = simulation.node_mut(facts.node);
    node.expect("the machine has its drives")
}
