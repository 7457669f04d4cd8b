//! What the service shows.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use truestage::runs::JudgedPath;
use utoipa::ToSchema;

mod chosen;
mod ending;
mod event;
mod journal;
mod storage;
mod told;

pub use chosen::{CalibrationView, ChangeView, ChosenView};
pub(crate) use ending::Ending;
pub use event::Event;
pub use journal::JournalView;
pub use storage::StorageView;
pub use told::{StoredView, ToldView};

use crate::problem::Code;
use crate::quantity::Quantity;

/// Why something ended.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct Cause {
    /// For programs.
    pub code: Code,
    /// For people, as the command line says it.
    pub cause: String,
    /// What the command line would end with.
    pub exit_code: u8,
}

impl Cause {
    /// Whether something took longer than it may: what ends so has timed out.
    pub(crate) fn is_overdue(&self) -> bool {
        self.code == Code::Overdue
    }
}

/// Who stopped something, and when.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct Stopped {
    /// Who.
    pub by: String,
    /// When, UTC, RFC 3339.
    pub at: String,
}

/// What an axis does, in PLCopen's words.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub enum AxisState {
    /// Switched off.
    Disabled,
    /// Switched on, and nothing moves it.
    Standstill,
    /// Finds its origin.
    Homing,
    /// On its way to a target.
    DiscreteMotion,
    /// Moves without a target.
    ContinuousMotion,
    /// Follows a path together with others.
    SynchronizedMotion,
    /// Slows down.
    Stopping,
    /// Stopped by a failure; a reset is needed.
    ErrorStop,
}

/// An axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct AxisView {
    /// Its name.
    pub name: String,
    /// What it is zeroed, calibrated and verified with: itself, `platform` or `volume`.
    #[serde(default)]
    pub group: String,
    /// What it does.
    pub state: AxisState,
    /// Where its point stands: corrected by the calibration in use, by the encoder alone where there is none.
    pub position: Option<Quantity>,
    /// Whether a calibration corrects `position`.
    pub corrected: bool,
    /// Standard uncertainty of the corrected position at rest; null where nobody knows it.
    pub standard_uncertainty: Option<Quantity>,
    /// What the drive's encoder says.
    pub encoder: Option<Quantity>,
    /// Where it was sent last.
    pub target: Option<Quantity>,
    /// What the drive was sent for that.
    pub set_point: Option<Quantity>,
    /// Whether it has its zero.
    pub homed: bool,
    /// The lower soft limit; null of an axis that turns endlessly.
    pub soft_min: Option<Quantity>,
    /// The upper soft limit.
    pub soft_max: Option<Quantity>,
    /// The calibration in use.
    pub calibration: Option<String>,
    /// When that was made, UTC, RFC 3339.
    #[serde(default)]
    pub calibration_created: Option<String>,
    /// The motion or run that has it.
    pub used_by: Option<String>,
    /// What stopped it last.
    pub last_cause: Option<Cause>,
}

/// What the machine as a whole is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum MachineState {
    /// Its devices are being started.
    Starting,
    /// Supervised; orders are carried out.
    Running,
    /// Stopped by a failure; a reset is needed.
    ErrorStop,
    /// The service ends.
    Ending,
}

/// The machine.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct MachineView {
    /// Its name.
    pub name: String,
    /// Its serial number.
    pub stage_serial: String,
    /// The hash of what a calibration depends on.
    pub config_hash: String,
    /// This program.
    pub program: String,
    /// When the service began, UTC, RFC 3339: one that began again counts its events from 1.
    #[serde(default)]
    pub started: String,
    /// What it is.
    pub state: MachineState,
    /// What stopped it, while it is in `error_stop`.
    pub cause: Option<Cause>,
    /// Its clock, in seconds.
    pub clock_s: f64,
    /// Who may command, when not everybody.
    pub lease: Option<LeaseView>,
    /// Axes that can move as one.
    #[serde(default)]
    pub groups: Vec<GroupView>,
    /// The number of the newest event.
    pub newest_event: u64,
}

/// Axes that can move as one.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct GroupView {
    /// What they are called together: `platform` or `volume`.
    pub name: String,
    /// Its axes.
    pub axes: Vec<String>,
    /// What a motion of them names as targets: the axes, or the parts of a pose.
    pub targets: Vec<String>,
}

/// Who may command.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct LeaseView {
    /// Who.
    pub name: String,
    /// For how much longer unless it is renewed, in seconds.
    pub seconds_left: f64,
}

/// A lease that was given.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct Leased {
    /// What proves it, with every order.
    pub token: String,
    /// For how long, in seconds.
    pub seconds: u32,
    /// From whom it was taken.
    pub taken_from: Option<String>,
}

/// How far a motion is. Its end is a level: it never changes again.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum MotionState {
    /// It waits for its axes.
    Queued,
    /// On its way.
    Moving,
    /// Its axes slow down.
    Stopping,
    /// Every axis has been in position for its time; the final positions were published before.
    Done,
    /// Somebody stopped it.
    Stopped,
    /// It did not get there.
    Failed,
    /// It did not get there in time, and was stopped.
    TimedOut,
}

impl MotionState {
    /// Whether it is an end.
    pub const fn is_end(self) -> bool {
        match self {
            Self::Queued | Self::Moving | Self::Stopping => false,
            Self::Done | Self::Stopped | Self::Failed | Self::TimedOut => true,
        }
    }
}

/// A motion.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct MotionView {
    /// Its name.
    pub id: String,
    /// Who asked for it.
    pub by: String,
    /// When it was accepted, UTC, RFC 3339.
    pub accepted: String,
    /// How far it is.
    pub state: MotionState,
    /// Who stopped it, when somebody did.
    pub stopped: Option<Stopped>,
    /// Why it failed, when it did.
    pub cause: Option<Cause>,
    /// Each axis; of a platform, each part of its pose.
    pub axes: BTreeMap<String, LegView>,
    /// How axes that have moved as one ended, as the command line prints it, when it is done.
    #[serde(default)]
    pub told: Option<ToldView>,
    /// Whether its end is on the disk: a restart does not change it any more. Left out before its end, and of a jog.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub kept: Option<bool>,
}

/// What one axis does in a motion.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct LegView {
    /// Where its point is to go.
    pub target: Quantity,
    /// What the drive was sent for that, once it was.
    pub set_point: Option<Quantity>,
    /// How fast it goes: as was asked, but no faster than its configuration and its correction allow. Null of axes that move as
    /// one.
    #[serde(default)]
    pub speed: Option<Quantity>,
    /// Whether a calibration corrects it: `no`, `yes`, `held` or `fading` (beyond the calibrated range).
    pub corrected: String,
    /// Where it stood at the end.
    pub position: Option<Quantity>,
    /// What the drive's encoder said there.
    pub encoder: Option<Quantity>,
    /// Standard uncertainty of that position; null where nobody knows it.
    pub standard_uncertainty: Option<Quantity>,
    /// How it ended, as the command line prints it, when it is done.
    pub told: Option<ToldView>,
}

/// How far a run is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum RunState {
    /// It waits to be started.
    Planned,
    /// Under way.
    Running,
    /// Its axes slow down.
    Stopping,
    /// Its axes stand and are free, and what it measured is kept: it can go on.
    Paused,
    /// It has its result.
    Done,
    /// Somebody stopped it.
    Stopped,
    /// It has no result.
    Failed,
    /// A step of it took longer than it may, and was stopped.
    TimedOut,
}

impl RunState {
    /// Whether it is an end.
    pub const fn is_end(self) -> bool {
        match self {
            Self::Planned | Self::Running | Self::Stopping | Self::Paused => false,
            Self::Done | Self::Stopped | Self::Failed | Self::TimedOut => true,
        }
    }
}

/// What a run will do.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct RunPlanView {
    /// How many points are measured; 0 for a zero.
    pub points: u64,
    /// How far the axis goes for them.
    pub travel: Option<Quantity>,
    /// How long that takes at least, in seconds: the ways at the usual speed, and standing.
    pub seconds_at_least: f64,
    /// What a person will be asked to do.
    pub asks: Vec<String>,
    /// By name, the share of each CAN bus that frames take meanwhile, 0 to 1. `truestage_bus_load_ratio` of the metrics is what was
    /// measured.
    #[serde(default)]
    pub bus_load: BTreeMap<String, f64>,
    /// What joins the rows of a path: `spline`, or `linear` with how far from a corner it may pass.
    #[serde(default)]
    pub join: Option<String>,
    /// Where a path is farthest from the straight joins of its rows: at corners it swings out, or cuts them.
    #[serde(default)]
    pub departure: Option<DepartureView>,
}

impl RunPlanView {
    /// Of a path that was judged.
    pub(crate) fn of_path(judged: &JudgedPath) -> Self {
        let departure = &judged.path.departure;
        let place = departure.place.iter();
        Self {
            points: judged.path.points.len() as u64,
            travel: Some(Quantity::mm(judged.travel)),
            seconds_at_least: judged.takes.as_secs_f64(),
            asks: Vec::new(),
            bus_load: BTreeMap::new(),
            join: Some(judged.path.join.to_string()),
            departure: Some(DepartureView {
                size: Quantity::mm(departure.size),
                at_s: departure.at_s,
                lines: departure.lines.to_vec(),
                place: place.map(|it| Quantity::mm(*it)).collect(),
            }),
        }
    }
}

/// Where a path is farthest from the straight line between the two rows that it runs between.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct DepartureView {
    /// How far.
    pub size: Quantity,
    /// When, in seconds from its beginning.
    pub at_s: f64,
    /// The lines of the two rows, counted from 1.
    pub lines: Vec<usize>,
    /// Where it is then, by axis.
    pub place: Vec<Quantity>,
}

/// A run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct RunView {
    /// Its name.
    pub id: String,
    /// Who asked for it.
    pub by: String,
    /// What it is.
    pub kind: crate::request::RunKind,
    /// What is run: an axis, `platform` or `volume`.
    #[serde(default)]
    pub of: String,
    /// The axes that it takes for itself.
    pub axes: Vec<String>,
    /// How far it is.
    pub state: RunState,
    /// What it will do.
    pub plan: RunPlanView,
    /// So many steps are done.
    pub steps_done: u64,
    /// Of so many.
    pub steps: u64,
    /// How often this service has begun it: more than once where it went on after a pause or another end.
    #[serde(default)]
    pub begun: u32,
    /// Whether it can be paused, and go on with what it measured; of one that was stopped, has failed or timed out, whether
    /// it can go on with what its `journal` has.
    #[serde(default)]
    pub can_resume: bool,
    /// What it waits for a person to do, when it does.
    #[serde(default)]
    pub question: Option<QuestionView>,
    /// What the person was told after the last question.
    #[serde(default)]
    pub said: Vec<String>,
    /// Job: what was told of each point as soon as it was reached, as the command line tells it. Each is an event `point`
    /// besides, with its figures, and a run in an event `run` leaves them out.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub reached: Vec<String>,
    /// Who stopped it, when somebody did.
    pub stopped: Option<Stopped>,
    /// Why it has no result.
    pub cause: Option<Cause>,
    /// What it found; null before its end, and when it has no result.
    #[schema(value_type = Option<Object>)]
    pub result: serde_json::Value,
    /// The same, as the command line prints it.
    pub told: Option<ToldView>,
    /// Why the result is a bad one, although it is one: out of tolerance.
    #[serde(default)]
    pub out_of_tolerance: Option<Cause>,
    /// Calibrate: what it stored, also where its verification did not come to its end.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub stored: Vec<StoredView>,
    /// Calibrate: its verification shows that what was stored makes the machine worse.
    #[serde(default)]
    pub made_worse: bool,
    /// Where what it measured is, once it has ended; of one without a result, as far as it can go on with that.
    #[serde(default)]
    pub journal: Option<String>,
    /// Whether its end is on the disk: a restart does not change it any more. Left out before its end, and of a run that was
    /// asked for without a key.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub kept: Option<bool>,
}

/// What a run asks a person, and how that can be answered (`POST /v1/runs/{id}/answers`).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct QuestionView {
    /// Its number in this run; an answer names it.
    pub number: u32,
    /// What it is about: `turn_plate`, `set_up_line`, `read_line`, `close_placement`.
    pub what: String,
    /// For the person.
    pub text: String,
    /// The words that answer it.
    pub answers: Vec<String>,
    /// Whether any other line of text answers it, too: what was read.
    pub takes_text: bool,
    /// Whether hands are in the machine until it is answered: no axis is moved or enabled meanwhile.
    #[serde(default)]
    pub by_hand: bool,
    /// What the person must know of the drives first: they may be switched on, or an axis moves, as soon as it is
    /// answered. Empty where nothing is driven.
    #[serde(default)]
    pub safety: String,
    /// What is to be done, for programs.
    #[schema(value_type = Object)]
    pub task: serde_json::Value,
}

impl RunView {
    /// A run of which nothing is done yet.
    pub(crate) fn planned(
        id: &str,
        by: &str,
        kind: crate::request::RunKind,
        (of, axes): (&str, Vec<String>),
        plan: RunPlanView,
    ) -> Self {
        Self {
            id: id.to_owned(),
            by: by.to_owned(),
            kind,
            of: of.to_owned(),
            axes,
            state: RunState::Planned,
            plan,
            steps_done: 0,
            steps: 0,
            begun: 0,
            can_resume: false,
            question: None,
            said: Vec::new(),
            reached: Vec::new(),
            stopped: None,
            cause: None,
            result: serde_json::Value::Null,
            told: None,
            out_of_tolerance: None,
            stored: Vec::new(),
            made_worse: false,
            journal: None,
            kept: None,
        }
    }

    /// As it is told when something of it has changed: its points were told before.
    pub(crate) fn changed(&self) -> serde_json::Value {
        let mut data = serde_json::json!(self);
        if let Some(members) = data.as_object_mut() {
            members.remove("reached");
        }
        data
    }
}
