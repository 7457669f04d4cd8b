//! What the machine's thread publishes after each tick, and where it is read.

use std::sync::{Arc, Mutex, PoisonError};

use truestage::config::MachineConfig;
use units::{Metres, Time};

use crate::coordinate::Coordinate;
use crate::figures::Figures;
use crate::quantity::Quantity;
use crate::view::{
    AxisState, AxisView, Cause, Event, GroupView, LeaseView, MachineState, MachineView, MotionView,
    RunView,
};

/// What never changes of a machine.
#[derive(Debug)]
pub(crate) struct Fixed {
    pub(crate) name: String,
    pub(crate) stage_serial: String,
    pub(crate) config_hash: String,
    /// When the service began, UTC, RFC 3339.
    pub(crate) started: String,
    pub(crate) axes: Vec<FixedAxis>,
    /// Axes that can move as one.
    pub(crate) groups: Vec<GroupView>,
    /// What its file said.
    pub(crate) config: MachineConfig,
}

/// What never changes of an axis.
#[derive(Debug)]
pub(crate) struct FixedAxis {
    pub(crate) name: String,
    /// What it is run with.
    pub(crate) group: String,
    /// `None`: it turns endlessly.
    pub(crate) soft_limits: Option<(Metres, Metres)>,
}

/// What corrects an axis.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct CalibrationInUse {
    pub(crate) id: String,
    /// When it was made, UTC, RFC 3339.
    pub(crate) created: String,
}

/// An axis at one moment.
#[derive(Clone, Debug)]
pub(crate) struct AxisSample {
    pub(crate) state: AxisState,
    pub(crate) encoder: Option<Coordinate>,
    pub(crate) place: Option<Coordinate>,
    pub(crate) standard_uncertainty: Option<Coordinate>,
    pub(crate) target: Option<Coordinate>,
    pub(crate) set_point: Option<Coordinate>,
    pub(crate) homed: bool,
    pub(crate) calibration: Option<Arc<CalibrationInUse>>,
    pub(crate) used_by: Option<Arc<str>>,
    pub(crate) last_cause: Option<Arc<Cause>>,
}

/// Everything that is known, at one moment. To copy it copies numbers and pointers.
#[derive(Clone, Debug)]
pub(crate) struct Snapshot {
    pub(crate) now: Time,
    pub(crate) state: MachineState,
    pub(crate) cause: Option<Arc<Cause>>,
    pub(crate) axes: Vec<AxisSample>,
    pub(crate) motions: Arc<Vec<Arc<MotionView>>>,
    pub(crate) runs: Arc<Vec<Arc<RunView>>>,
    pub(crate) events: Arc<Vec<Arc<Event>>>,
    pub(crate) lease: Option<(Arc<str>, Time)>,
    pub(crate) counters: Arc<Vec<(String, &'static str, u64)>>,
    pub(crate) figures: Arc<Figures>,
    pub(crate) ticks: u64,
}

/// A sign of life of the machine's thread.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Beat {
    /// How often it has ticked.
    pub(crate) ticks: u64,
    /// The machine's clock, in seconds.
    pub(crate) clock_s: f64,
}

impl Snapshot {
    /// Of a machine that is not there yet.
    pub(crate) fn before() -> Self {
        Self {
            now: Time::ZERO,
            state: MachineState::Starting,
            cause: None,
            axes: Vec::new(),
            motions: Arc::default(),
            runs: Arc::default(),
            events: Arc::default(),
            lease: None,
            counters: Arc::default(),
            figures: Arc::default(),
            ticks: 0,
        }
    }

    /// The number of the newest event, 0 before the first.
    pub(crate) fn newest_event(&self) -> u64 {
        self.events.last().map_or(0, |it| it.id)
    }

    /// The axes for people.
    pub(crate) fn axes_of(&self, fixed: &Fixed) -> Vec<AxisView> {
        let pairs = fixed.axes.iter().zip(&self.axes);
        pairs
            .map(|(fixed, sample)| view_of(fixed, sample))
            .collect()
    }

    /// The machine for people.
    pub(crate) fn machine_of(&self, fixed: &Fixed) -> MachineView {
        MachineView {
            name: fixed.name.clone(),
            stage_serial: fixed.stage_serial.clone(),
            config_hash: fixed.config_hash.clone(),
            program: format!("truestage {}", env!("CARGO_PKG_VERSION")),
            started: fixed.started.clone(),
            state: self.state,
            cause: self.cause.as_deref().cloned(),
            clock_s: self.now.seconds(),
            lease: self.lease_view(),
            groups: fixed.groups.clone(),
            newest_event: self.newest_event(),
        }
    }

    /// Who has the lease.
    pub(crate) fn lease_view(&self) -> Option<LeaseView> {
        let (name, until) = self.lease.as_ref()?;
        let left = until.since(self.now);
        (*until > self.now).then(|| LeaseView {
            name: name.to_string(),
            seconds_left: left.as_secs_f64(),
        })
    }
}

fn view_of(fixed: &FixedAxis, sample: &AxisSample) -> AxisView {
    AxisView {
        name: fixed.name.clone(),
        group: fixed.group.clone(),
        state: sample.state,
        position: sample.place.or(sample.encoder).map(Coordinate::shown),
        corrected: sample.place.is_some(),
        standard_uncertainty: sample.standard_uncertainty.map(Coordinate::small),
        encoder: sample.encoder.map(Coordinate::shown),
        target: sample.target.map(Coordinate::shown),
        set_point: sample.set_point.map(Coordinate::shown),
        homed: sample.homed,
        soft_min: fixed.soft_limits.map(|it| Quantity::mm(it.0)),
        soft_max: fixed.soft_limits.map(|it| Quantity::mm(it.1)),
        calibration: sample.calibration.as_ref().map(|it| it.id.clone()),
        calibration_created: sample.calibration.as_ref().map(|it| it.created.clone()),
        used_by: sample.used_by.as_deref().map(str::to_owned),
        last_cause: sample.last_cause.as_deref().cloned(),
    }
}

/// Where the newest snapshot is read. Readers wait for one another, the writer for nobody.
#[derive(Debug)]
pub(crate) struct Board(Mutex<triple_buffer::Output<Snapshot>>);

impl Board {
    pub(crate) const fn new(output: triple_buffer::Output<Snapshot>) -> Self {
        Self(Mutex::new(output))
    }

    /// The newest.
    pub(crate) fn newest(&self) -> Snapshot {
        let mut output = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        output.read().clone()
    }
}
