//! The cyclic engine: one set-point for several drives at every SYNC (CiA 402, mode 8), with a
//! correction computed in the same period from what the machine sees.
//!
//! - `account` has what the loop is asked and what it says; `decide` decides one period: samples judged, path or motion, correction, set-points, and when
//!   to stop. Sans-io, of fixed size.
//! - `hear` collects what was heard of one SYNC. `seats` knows which devices these are, `run` is its loop, [`Machine::follow`]: sleep to the absolute deadline, SYNC, listen, decide,
//!   send. It runs in the thread that calls it (docs/decisions/0014).
//! - `path` and `csv` write paths (`rows`, `join` and `blended` say what of a file), `motion` plans moves and stops, `correction` limits what is
//!   added.
//!
//! Two ways to stop. Trouble with the path or the host: a controlled stop, time-optimal within
//! jerk, acceleration and speed, begun by all axes in the same period ([`Cause`]). Trouble with
//! the bus or a drive: the quick stop command to every drive in the same period
//! ([`crate::Failure`]). Nothing is resumed by itself.
//!
//! The host holds a [`Desk`], from any thread: a bounded queue of points, orders, and what the
//! loop did lately. All of it passes through rings without locks. Linear axes only.

mod account;
mod blended;
mod cause;
mod correction;
mod csv;
mod decide;
#[cfg(test)]
mod decide_tests;
mod failure;
mod hear;
mod join;
mod judge;
mod lack;
mod limits;
mod moment;
mod motion;
mod pace;
mod path;
mod planner;
mod rows;
mod run;
mod seats;
mod tables;

use core::any::Any;
use core::time::Duration;

use rtrb::{Consumer, Producer, RingBuffer};
use units::{Metres, MetresPerSecond};

pub use account::{Counts, Live, State};
pub use blended::TightCorner;
pub use cause::Cause;
pub use correction::{
    CHANNELS_MAX, Channel, Corrected, Correction, NoCorrection, Observed, SPOTS_MAX,
    THERMOMETERS_MAX, ThermometerSample, Validity,
};
pub use csv::{CsvPath, Departure, PathForm, read_path};
pub use drivers::transport::Histogram;
pub use failure::EngineFailure;
pub use join::Join;
pub use judge::{PathError, PathFault};
pub use lack::{Lack, Source};
pub use limits::{AxisLimits, CorrectionLimits};
pub use moment::Moment;
pub use motion::{Motion, MotionError};
pub use pace::Timing;
pub use path::{PathWriter, PushError};
pub use rows::{CsvError, CsvFault};
pub use tables::TableCorrection;

use crate::failure::Failure;
use crate::machine::Machine;
use account::Command;
use correction::Applied;
use decide::{Core, Lines};

/// How many axes move together at most.
pub const AXES_MAX: usize = 8;
/// How many points the queue holds: half a second at 1 kHz.
const QUEUE_POINTS: usize = 512;
/// How many orders may wait.
const QUEUE_COMMANDS: usize = 16;
/// How many periods a watcher may be behind before he misses some.
const QUEUE_LIVE: usize = 256;

/// One value for each axis of an engine, in their order; what is beyond them means nothing.
pub type PerAxis<T> = [T; AXES_MAX];

/// What moves some axes of a machine together; driven by [`Machine::follow`].
pub struct Engine {
    axes: Vec<String>,
    period: Duration,
    limits: PerAxis<AxisLimits>,
    core: Core,
    timing: Timing,
    real_time: bool,
}

/// The host's side of an [`Engine`]: lives in whatever thread writes the path.
pub struct Desk {
    /// Where the path is written.
    pub path: PathWriter,
    commands: Producer<Command>,
    retired: Consumer<Box<dyn Correction>>,
    live: Consumer<Live>,
    newest: triple_buffer::Output<Option<Live>>,
    checker: Motion,
}

impl Engine {
    /// For `axes` of `machine`, each with a `[axis.NAME.cyclic]` in the configuration. The
    /// correction is switched off to begin with.
    ///
    /// # Errors
    /// When there is no such axis, or it is named twice, it is not configured for this, or the
    /// machine's CAN buses have different SYNC periods: the loop sends SYNC on all of them.
    pub fn new(
        machine: &Machine,
        axes: &[&str],
        correction: Box<dyn Correction>,
    ) -> Result<(Self, Desk), Failure> {
        if axes.is_empty() || axes.len() > AXES_MAX {
            return Err(EngineFailure::Axes { seen: axes.len() }.into());
        }
        let mut limits = [AxisLimits::default(); AXES_MAX];
        let mut of_correction = [CorrectionLimits {
            size: Metres::ZERO,
            rate: MetresPerSecond::ZERO,
        }; AXES_MAX];
        let mut period = Duration::ZERO;
        for (at, name) in axes.iter().enumerate() {
            let cyclic = machine.cyclic_settings(name)?;
            limits[at] = cyclic.limits;
            of_correction[at] = cyclic.correction;
            period = cyclic.period;
        }
        let names: Vec<String> = axes.iter().map(|name| (*name).to_owned()).collect();
        if let Some(twice) = (1..names.len()).find(|at| names[..*at].contains(&names[*at])) {
            let axis = names[twice].clone();
            return Err(EngineFailure::Twice { axis }.into());
        }
        run::require_one_sync(&machine.ports.buses, period)?;
        let (mut engine, desk) = Self::assemble(names, period, limits, &of_correction, correction);
        engine.core.be_patient(machine.patience);
        engine.real_time = machine.real_time;
        Ok((engine, desk))
    }

    fn assemble(
        axes: Vec<String>,
        period: Duration,
        limits: PerAxis<AxisLimits>,
        of_correction: &PerAxis<CorrectionLimits>,
        correction: Box<dyn Correction>,
    ) -> (Self, Desk) {
        let (points, path) = RingBuffer::new(QUEUE_POINTS);
        let (orders, commands) = RingBuffer::new(QUEUE_COMMANDS);
        let (retired, collected) = RingBuffer::new(QUEUE_COMMANDS);
        let (live, seen) = RingBuffer::new(QUEUE_LIVE);
        let (newest, latest) = triple_buffer::triple_buffer(&None);
        let lines = Lines {
            path,
            commands,
            retired,
            live,
            newest,
        };
        let applied = Applied::new(correction, of_correction, period);
        let desk = Desk {
            path: PathWriter::new(axes.clone(), period, limits, points),
            commands: orders,
            retired: collected,
            live: seen,
            newest: latest,
            checker: Motion::new(axes.len(), limits),
        };
        let core = Core::new(axes.len(), period, limits, applied, lines);
        let engine = Self {
            axes,
            period,
            limits,
            core,
            timing: Timing::default(),
            real_time: false,
        };
        (engine, desk)
    }

    /// Lets the loop ask for SCHED_FIFO and locked memory; [`Timing`] says what it got.
    pub const fn in_real_time(&mut self) {
        self.real_time = true;
    }

    /// The axes, in order.
    pub fn axes(&self) -> &[String] {
        &self.axes
    }

    /// From SYNC to SYNC.
    pub const fn period(&self) -> Duration {
        self.period
    }

    /// What a path must be made for that its axes follow, joined by `join`, or as its file says.
    pub fn path_form(&self, join: Option<Join>) -> PathForm<'_> {
        PathForm {
            axes: &self.axes,
            limits: &self.limits[..self.axes.len()],
            period: self.period,
            join,
        }
    }

    /// What the loop is doing, or did last.
    pub const fn state(&self) -> State {
        self.core.state()
    }

    /// The correction in use, of one that gives itself away ([`Correction::as_any`]).
    pub fn correction(&self) -> Option<&dyn Any> {
        self.core.correction()
    }

    /// What was counted.
    pub fn counts(&self) -> Counts {
        self.core.counts()
    }

    /// How punctual the loop was.
    pub const fn timing(&self) -> &Timing {
        &self.timing
    }
}

impl Desk {
    /// Asks for a controlled stop; the loop ends when all axes are at rest.
    ///
    /// # Errors
    /// When nobody takes it.
    pub fn stop(&mut self) -> Result<(), EngineFailure> {
        self.order(Command::Stop)
    }

    /// Switches the correction on or off; it is slewed either way.
    ///
    /// # Errors
    /// When nobody takes it.
    pub fn correct(&mut self, on: bool) -> Result<(), EngineFailure> {
        self.order(Command::Correct(on))
    }

    /// Another correction from one period to the next; the set-points are slewed to it.
    ///
    /// # Errors
    /// When nobody takes it.
    pub fn swap(&mut self, correction: Box<dyn Correction>) -> Result<(), EngineFailure> {
        // What the loop has done with is freed here, not there.
        while self.retired.pop().is_ok() {}
        self.order(Command::Swap(correction))
    }

    /// Moves all axes together to `target`, from whatever they do now; a path that was begun is
    /// given up.
    ///
    /// # Errors
    /// When the target is outside the soft limits, or nobody takes the order.
    pub fn move_to(&mut self, target: &[Metres]) -> Result<(), Failure> {
        self.move_within(target, None)
    }

    /// The same, with all axes together no faster than `speed`; axes that move come to rest first.
    ///
    /// # Errors
    /// As [`Self::move_to`].
    pub fn move_within(
        &mut self,
        target: &[Metres],
        speed: Option<MetresPerSecond>,
    ) -> Result<(), Failure> {
        let all = self.check_target(target)?;
        Ok(self.order(Command::MoveTo(all, speed))?)
    }

    /// Whether the axes could be moved to `target`.
    ///
    /// # Errors
    /// When it is outside the soft limits, or not of these axes.
    pub fn check_target(&mut self, target: &[Metres]) -> Result<PerAxis<Metres>, Failure> {
        let expected = self.path.axes().len();
        if target.len() != expected {
            return Err(EngineFailure::Axes { seen: target.len() }.into());
        }
        let mut all = [Metres::ZERO; AXES_MAX];
        all[..expected].copy_from_slice(target);
        let planned = self.checker.plan_to(&Moment::at_rest(all), &all);
        planned.map_err(|error| self.named(error))?;
        Ok(all)
    }

    /// A plan knows its axes by number.
    fn named(&self, error: MotionError) -> Failure {
        let names = self.path.axes();
        match error {
            MotionError::SoftLimit {
                axis,
                target,
                min,
                max,
            } => Failure::SoftLimit {
                axis: names.get(axis).cloned().unwrap_or_default(),
                target,
                min,
                max,
            },
            other => EngineFailure::Motion(other).into(),
        }
    }

    /// The newest period of the loop, `None` before the first.
    pub fn live(&mut self) -> Option<Live> {
        let newest = (*self.newest.read())?;
        // Those before it count as looked at.
        while self.live.peek().is_ok_and(|it| it.at <= newest.at) {
            let _ = self.live.pop();
        }
        Some(newest)
    }

    /// The next period that has not been read yet, in order; some are left out when more than 256
    /// were not read.
    pub fn next_live(&mut self) -> Option<Live> {
        self.live.pop().ok()
    }

    fn order(&mut self, command: Command) -> Result<(), EngineFailure> {
        if self.commands.is_abandoned() {
            return Err(EngineFailure::NotTaken);
        }
        self.commands
            .push(command)
            .map_err(|_| EngineFailure::NotTaken)
    }
}
