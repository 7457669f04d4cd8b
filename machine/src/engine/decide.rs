//! What the loop decides in one SYNC period: positions and channels in, set-points out.
//!
//! No clock, no bus, no thread: the same core runs on a real machine and in virtual time, and a
//! test drives it by hand. Everything has a fixed size; nothing here waits or asks for memory,
//! except for the text of a failure that ends the loop.

use core::any::Any;
use core::time::Duration;

use rtrb::{Consumer, Producer};
use units::{Metres, MetresPerSecond, Time};

use super::account::{Command, Counts, Heard, Live, State, Trouble};
use super::cause::Cause;
use super::correction::{Applied, Correction, Observed};
use super::judge::Differences;
use super::moment::Moment;
use super::motion::Motion;
use super::path::Item;
use super::{AXES_MAX, AxisLimits, PerAxis};
use crate::patience::Patience;

/// So many samples of an axis in a row may be missing before it is not safe to go on.
const MISSING_MAX: u32 = 3;
/// So many set-points ago is what an axis shows now: one period to take it, one to answer, and
/// one that the interpolation of a drive may lag.
const ANSWER_PERIODS: usize = 3;
/// So many samples in a row must be too far from the set-point.
const DEVIATING_MAX: u32 = 2;

/// The channels between the host and the loop, as the loop holds them.
pub(super) struct Lines {
    pub(super) path: Consumer<Item>,
    pub(super) commands: Consumer<Command>,
    pub(super) retired: Producer<Box<dyn Correction>>,
    pub(super) live: Producer<Live>,
    pub(super) newest: triple_buffer::Input<Option<Live>>,
}

/// The decisions of the loop.
pub(super) struct Core {
    axes: usize,
    period_s: f64,
    period: Duration,
    limits: PerAxis<AxisLimits>,
    lines: Lines,
    motion: Motion,
    /// Since when the motion that is planned runs.
    elapsed: Duration,
    /// Whether the motion leads to the first point of a path.
    approaching: bool,
    /// Whether the queue holds, or will hold, the rest of a path that was begun.
    path_open: bool,
    /// Whether the rest that it may hold is of a path given up before this motion began.
    is_rest: bool,
    nominal: Differences,
    applied: Applied,
    state: State,
    actual: PerAxis<Metres>,
    history: [PerAxis<Metres>; ANSWER_PERIODS + 1],
    missing: PerAxis<u32>,
    missing_max: u32,
    deviating: PerAxis<u32>,
    counts: Counts,
}

impl Core {
    pub(super) fn new(
        axes: usize,
        period: Duration,
        limits: PerAxis<AxisLimits>,
        applied: Applied,
        lines: Lines,
    ) -> Self {
        let nowhere = [Metres::ZERO; AXES_MAX];
        Self {
            axes,
            period_s: period.as_secs_f64(),
            period,
            limits,
            lines,
            motion: Motion::new(axes, limits),
            elapsed: Duration::ZERO,
            approaching: false,
            path_open: false,
            is_rest: false,
            nominal: Differences::at_rest(nowhere),
            applied,
            state: State::Holding,
            actual: nowhere,
            history: [nowhere; ANSWER_PERIODS + 1],
            missing: [0; AXES_MAX],
            missing_max: MISSING_MAX,
            deviating: [0; AXES_MAX],
            counts: Counts::default(),
        }
    }

    /// Bears more missing samples: those of a machine in simulated time, whose host pauses.
    pub(super) fn be_patient(&mut self, patience: Patience) {
        self.missing_max = patience.periods(MISSING_MAX, self.period);
    }

    /// Begins at rest, with the set-points that the drives hold: what was added to them when the
    /// axes were last moved is in these, and is not added twice.
    pub(super) fn begin(&mut self, held: PerAxis<Metres>) {
        self.applied.begin();
        let added = self.applied.current();
        let nominal = core::array::from_fn(|axis| held[axis] - added[axis]);
        self.nominal = Differences::at_rest(nominal);
        self.state = State::Holding;
        self.is_rest = self.path_open;
        (self.missing, self.deviating) = ([0; AXES_MAX], [0; AXES_MAX]);
        self.actual = held;
        self.history = [held; ANSWER_PERIODS + 1];
    }

    /// What was ordered or written for a motion that failed is never driven in a later one.
    pub(super) fn forget_orders(&mut self) {
        self.drop_all();
        while self.lines.commands.pop().is_ok() {}
    }

    pub(super) const fn state(&self) -> State {
        self.state
    }

    pub(super) fn correction(&self) -> Option<&dyn Any> {
        self.applied.in_use()
    }

    pub(super) fn counts(&self) -> Counts {
        Counts {
            corrections_limited: self.applied.limited(),
            ..self.counts
        }
    }

    /// Whether nothing moves and nothing is to come.
    pub(super) const fn ended(&self) -> Option<Cause> {
        match self.state {
            State::Stopped(cause) => Some(cause),
            State::Holding | State::Moving | State::Following | State::Stopping(_) => None,
        }
    }

    /// One period: the set-points for the next SYNC.
    pub(super) fn step(&mut self, heard: &Heard<'_>) -> Result<PerAxis<Metres>, Trouble> {
        self.counts.cycles += 1;
        self.take_samples(heard)?;
        self.obey()?;
        self.advance()?;
        let nominal = self.nominal.moment.position;
        let observed = Observed {
            now: heard.now,
            nominal: &nominal[..self.axes],
            actual: &self.actual[..self.axes],
            channels: heard.channels,
            temperatures: heard.temperatures,
            spots: heard.spots,
        };
        let (offset, refused) = self.applied.advance(&observed);
        if let Some(cause) = refused {
            self.stop(cause)?;
        }
        let (set_point, clamped) = self.limited(&nominal, &offset);
        self.history.rotate_right(1);
        self.history[0] = set_point;
        self.tell(heard.now, &nominal, &offset, clamped);
        Ok(set_point)
    }

    /// `periods` SYNCs were missed by more than is tolerated.
    pub(super) fn overrun(&mut self, periods: u32) -> Result<(), Trouble> {
        self.stop(Cause::Overrun { periods })
    }

    /// Begins to stop, unless that is done or under way.
    pub(super) fn stop(&mut self, cause: Cause) -> Result<(), Trouble> {
        match self.state {
            State::Stopping(_) | State::Stopped(_) => return Ok(()),
            State::Holding => self.state = State::Stopped(cause),
            State::Moving | State::Following => {
                let from = self.moment();
                self.motion.plan_stop(&from).map_err(|_| Trouble::NoStop)?;
                self.elapsed = Duration::ZERO;
                self.state = State::Stopping(cause);
            }
        }
        // Behind the end of a path there may be another one already.
        if cause != Cause::PathDone {
            self.drop_all();
        }
        Ok(())
    }

    /// The motion at the last set-point.
    fn moment(&self) -> Moment {
        match self.state {
            State::Following => self.nominal.at_the_point(self.axes, self.period_s),
            State::Holding | State::Moving | State::Stopping(_) | State::Stopped(_) => {
                self.nominal.moment
            }
        }
    }

    /// What waits is old: it must not be driven later. The queue's size bounds this.
    fn drop_all(&mut self) {
        self.approaching = false;
        for _ in 0..self.lines.path.slots() {
            self.next_item();
        }
    }

    /// The rest of a path that was given up; says whether its end was among it.
    fn drop_rest(&mut self) -> bool {
        for _ in 0..self.lines.path.slots() {
            match self.next_item() {
                Some(Item::End) => return true,
                Some(Item::Begin) | None => return false,
                Some(Item::Point(_)) => {}
            }
        }
        false
    }

    fn next_item(&mut self) -> Option<Item> {
        let item = self.lines.path.pop().ok()?;
        self.path_open = matches!(item, Item::Point(_));
        Some(item)
    }

    fn take_samples(&mut self, heard: &Heard<'_>) -> Result<(), Trouble> {
        for axis in 0..self.axes {
            match heard.actual[axis] {
                Some(actual) => {
                    self.actual[axis] = actual;
                    self.missing[axis] = 0;
                    self.judge_lag(axis, actual)?;
                }
                None => {
                    self.missing[axis] += 1;
                    self.counts.missing += 1;
                    if self.missing[axis] >= self.missing_max {
                        let periods = self.missing[axis];
                        return Err(Trouble::Missing { axis, periods });
                    }
                }
            }
        }
        Ok(())
    }

    /// An axis that answers late shows one of the last set-points, or something between them.
    fn judge_lag(&mut self, axis: usize, actual: Metres) -> Result<(), Trouble> {
        let recent = self.history.iter().map(|set_points| set_points[axis]);
        let (low, high) = recent.fold((Metres(f64::MAX), Metres(f64::MIN)), |(low, high), it| {
            (low.min(it), high.max(it))
        });
        let lag = (low - actual).max(actual - high);
        let limit = self.limits[axis].deviation;
        if lag <= limit {
            self.deviating[axis] = 0;
            return Ok(());
        }
        self.deviating[axis] += 1;
        if self.deviating[axis] >= DEVIATING_MAX {
            return Err(Trouble::Deviates { axis, lag, limit });
        }
        Ok(())
    }

    fn obey(&mut self) -> Result<(), Trouble> {
        while let Ok(command) = self.lines.commands.pop() {
            match command {
                Command::Stop => self.stop(Cause::Asked)?,
                Command::Correct(on) => self.applied.switch(on),
                Command::Swap(correction) => {
                    let before = self.applied.swap(correction);
                    // As many places as commands: there is room, and memory is freed elsewhere.
                    if let Err(rtrb::PushError::Full(before)) = self.lines.retired.push(before) {
                        core::mem::forget(before);
                    }
                }
                Command::MoveTo(target, speed) => self.begin_move(&target, speed)?,
            }
        }
        if self.lines.commands.is_abandoned() && self.lines.path.is_abandoned() {
            let driven = matches!(self.state, State::Holding);
            if driven && self.lines.path.is_empty() {
                self.stop(Cause::HostGone)?;
            }
        }
        Ok(())
    }

    /// On the fly: from whatever the axes do now. A target that cannot be is refused where it is
    /// given; one for which there is no way all the same stops the axes, because the plan that
    /// they followed is lost.
    fn begin_move(
        &mut self,
        target: &PerAxis<Metres>,
        speed: Option<MetresPerSecond>,
    ) -> Result<(), Trouble> {
        if let State::Stopping(_) | State::Stopped(_) = self.state {
            return Ok(());
        }
        let from = self.moment();
        if let Err(error) = self.motion.plan_within(&from, target, speed) {
            return self.stop(Cause::of_refusal(&error));
        }
        self.drop_all();
        self.elapsed = Duration::ZERO;
        self.nominal = Differences::of(from);
        self.state = State::Moving;
        Ok(())
    }

    fn advance(&mut self) -> Result<(), Trouble> {
        match self.state {
            // The rest of a path that a move has put an end to.
            State::Holding if self.path_open => {
                if self.drop_rest() && self.is_rest {
                    self.state = State::Stopped(Cause::GivenUp);
                }
            }
            State::Holding => match self.next_item() {
                Some(Item::Point(first)) => {
                    let from = self.moment();
                    if let Err(error) = self.motion.plan_to(&from, &first) {
                        return self.stop(Cause::of_refusal(&error));
                    }
                    self.elapsed = Duration::ZERO;
                    self.approaching = true;
                    self.state = State::Moving;
                }
                Some(Item::End) => self.state = State::Stopped(Cause::PathDone),
                Some(Item::Begin) | None => {}
            },
            State::Moving => {
                self.go_along_the_plan();
                if self.motion.is_over(self.elapsed) {
                    let approached = core::mem::take(&mut self.approaching);
                    self.state = if approached {
                        State::Following
                    } else {
                        State::Holding
                    };
                }
            }
            State::Following => return self.follow(),
            State::Stopping(cause) => {
                self.go_along_the_plan();
                if self.motion.is_over(self.elapsed) {
                    self.state = State::Stopped(cause);
                }
            }
            State::Stopped(_) => {}
        }
        Ok(())
    }

    fn go_along_the_plan(&mut self) {
        self.elapsed += self.period;
        self.nominal = Differences::of(self.motion.at(self.elapsed));
    }

    fn follow(&mut self) -> Result<(), Trouble> {
        let point = match self.next_item() {
            Some(Item::Point(point)) => point,
            Some(Item::End | Item::Begin) => {
                self.stop(Cause::PathDone)?;
                return self.advance();
            }
            None => {
                let gone = self.lines.path.is_abandoned();
                self.stop(if gone { Cause::HostGone } else { Cause::RanDry })?;
                return self.advance();
            }
        };
        // Checked when it was written; what is driven is checked where it is driven, too.
        let next = self.nominal.next(&point, self.axes, self.period_s);
        for (axis, at) in point.iter().enumerate().take(self.axes) {
            let limits = &self.limits[axis];
            let speed = next.moment.speed[axis].abs();
            let within = limits.min <= *at && *at <= limits.max && speed <= limits.speed * 1.02;
            if !within {
                self.stop(Cause::PathRefused { axis })?;
                return self.advance();
            }
        }
        self.nominal = next;
        Ok(())
    }

    /// A correction never leads out of the soft limits.
    fn limited(
        &mut self,
        nominal: &PerAxis<Metres>,
        offset: &PerAxis<Metres>,
    ) -> (PerAxis<Metres>, PerAxis<bool>) {
        let (mut set_point, mut clamped) = (*nominal, [false; AXES_MAX]);
        for axis in 0..self.axes {
            let AxisLimits { min, max, .. } = self.limits[axis];
            let wanted = nominal[axis] + offset[axis];
            set_point[axis] = wanted.max(min).min(max);
            clamped[axis] = set_point[axis] != wanted;
            self.counts.clamped += u64::from(clamped[axis]);
        }
        (set_point, clamped)
    }

    /// A full line means that nobody looks; who looks again finds at least the newest.
    fn tell(
        &mut self,
        at: Time,
        nominal: &PerAxis<Metres>,
        offset: &PerAxis<Metres>,
        clamped: PerAxis<bool>,
    ) {
        let (said, corrected) = self.applied.last();
        let live = Live {
            at,
            cycle: self.counts.cycles,
            state: self.state,
            actual: self.actual,
            nominal: *nominal,
            offset: *offset,
            uncertainty: said.uncertainty,
            validity: said.validity,
            corrected,
            alarms: self.applied.alarms(),
            clamped,
        };
        let _ = self.lines.live.push(live);
        self.lines.newest.write(Some(live));
    }
}
