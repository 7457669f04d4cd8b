//! The engine's loop over a machine: [`Machine::follow`].
//!
//! One period: sleep to the absolute deadline, send SYNC, hear the answers (until all have come,
//! or half the period is over), decide, send the set-points; the drives take them at the next
//! SYNC. Devices, heartbeats and alarms are served as in every tick; what the devices judge
//! (heartbeat, emergency, power state, following error, implausible position) ends the loop as it
//! ends any procedure, but here with the quick stop command to every drive in the same period.
//!
//! A period that begins late is counted. Late by more than half a period: the next SYNCs are
//! counted from this one, so that two are never closer than half a period. Late by more than a period (times the patience of a
//! machine in simulated time): the drives have missed a SYNC, the queued path is dropped, and the
//! axes are stopped together.

use core::time::Duration;

use drivers::device::DriveCommand;
use drivers::transport::SendError;
use drivers::transport::real_time::RealTime;
use units::{Metres, Time};
use wire::canopen::sync::emit_sync;
use wire::cia402::PowerState;
use wire::{Payload, Port};

use super::account::Trouble;
use super::pace::Pace;
use super::{
    AXES_MAX, CHANNELS_MAX, Cause, Channel, Engine, EngineFailure, PerAxis, THERMOMETERS_MAX,
    ThermometerSample,
};
use crate::failure::Failure;
use crate::machine::{Machine, Supervision};
use crate::parts::CyclicSettings;

/// The share of a period in which answers are awaited.
const LISTEN_SHARE: f64 = 0.5;
/// How long a drive may take to change its mode or to be enabled.
const CHANGE_LIMIT: Duration = Duration::from_secs(10);
/// How long the axes may take to come to rest before the mode is entered, and left.
const REST_LIMIT: Duration = Duration::from_secs(5);

/// Where the engine's axes are among the machine's devices.
pub(super) struct Seats {
    pub(super) count: usize,
    /// By the engine's order of axes, the number of the drive.
    pub(super) drive: PerAxis<usize>,
    /// The buses that carry SYNC.
    buses: Vec<Port>,
    pub(super) channels: [Option<Channel>; CHANNELS_MAX],
    pub(super) temperatures: [Option<ThermometerSample>; THERMOMETERS_MAX],
}

impl Machine {
    /// Moves the axes of `engine` along what its [`Desk`](super::Desk) says, until the path is
    /// done or the axes were stopped in a controlled way; the cause says which. Axes that still
    /// settle from an earlier motion are waited for. The drives stay enabled, at rest.
    ///
    /// This thread is the loop's: it does nothing else until then.
    ///
    /// # Errors
    /// When an axis is not zeroed, does not come to rest, a drive refuses the mode, or something
    /// made it unsafe to go on: every drive has been told to quick stop then; see
    /// [`Machine::guarded`].
    pub fn follow(&mut self, engine: &mut Engine) -> Result<Cause, Failure> {
        self.follow_with(engine, &mut || {})
    }

    /// The same with `host` called once in every period, after the set-points have left: a host
    /// without a thread of its own. In virtual time there is no other, since it passes as fast as
    /// the loop runs.
    ///
    /// # Errors
    /// As [`Machine::follow`].
    pub fn follow_with(
        &mut self,
        engine: &mut Engine,
        host: &mut dyn FnMut(),
    ) -> Result<Cause, Failure> {
        let outcome = self.follow_to_rest(engine, host);
        if outcome.is_err() {
            engine.core.forget_orders();
        }
        outcome
    }

    fn follow_to_rest(
        &mut self,
        engine: &mut Engine,
        host: &mut dyn FnMut(),
    ) -> Result<Cause, Failure> {
        for axis in engine.axes.clone() {
            self.require_zeroed(&axis)?;
        }
        let mut seats = self.seats(engine)?;
        self.require_supervised(seats.drive[0])?;
        self.await_rest(engine, &seats)?;
        self.require_inside(engine, &seats)?;
        // Locking memory takes its time, and so does letting it go: never between two SYNCs.
        let granted = engine.real_time.then(RealTime::ask);
        let text = granted.as_ref().map(ToString::to_string);
        engine.timing.scheduling = text.unwrap_or_default();
        let held = self.enter_cyclic(engine, &seats)?;
        engine.core.begin(held);
        let cause = self.holding_back(|machine| {
            machine.with_own_sync(|it| it.run_periods(engine, &mut seats, host))
        })?;
        let leave = DriveCommand::LeaveCyclic;
        self.change_at_rest(engine, &seats, leave, "leaving the cyclic mode")?;
        for at in &seats.drive[..seats.count] {
            self.approach[*at].forget();
        }
        Ok(cause)
    }

    /// Within which `axis` follows cyclic set-points.
    ///
    /// # Errors
    /// When there is no such axis, or it is not configured for that.
    pub fn cyclic_settings(&self, axis: &str) -> Result<CyclicSettings, Failure> {
        let cyclic = self.axis_settings(axis)?.cyclic;
        cyclic.ok_or_else(|| {
            let axis = axis.to_owned();
            EngineFailure::NotConfigured { axis }.into()
        })
    }

    /// The loop's SYNC goes out on every CAN bus, also those that carry none of its axes.
    pub(super) fn require_one_sync(&self, expected: Duration) -> Result<(), Failure> {
        let mut buses = self.buses.iter();
        match buses.find(|it| it.sync_period != expected) {
            None => Ok(()),
            Some(other) => Err(EngineFailure::Periods {
                bus: other.name.clone(),
                expected,
                seen: other.sync_period,
            }
            .into()),
        }
    }

    fn seats(&self, engine: &Engine) -> Result<Seats, Failure> {
        let mut drive = [0; AXES_MAX];
        for (at, axis) in engine.axes.iter().enumerate() {
            drive[at] = self.axis_index(axis)?;
        }
        Ok(Seats {
            count: engine.axes.len(),
            drive,
            buses: self.buses.iter().map(|it| it.port).collect(),
            channels: [None; CHANNELS_MAX],
            temperatures: [None; THERMOMETERS_MAX],
        })
    }

    /// Until every axis that its drive holds stands still; one that is not enabled goes where
    /// it likes.
    fn await_rest(&mut self, engine: &Engine, seats: &Seats) -> Result<(), Failure> {
        let begun = self.now();
        let deadline = begun + self.patience.of(REST_LIMIT);
        while let Some(axis) = (0..seats.count).find(|axis| self.moves(seats.drive[*axis])) {
            if self.now() >= deadline {
                let axis = engine.axes[axis].clone();
                let waited = self.now().since(begun);
                return Err(EngineFailure::NotAtRest { axis, waited }.into());
            }
            self.tick(deadline)?;
        }
        Ok(())
    }

    /// A drive that changes its mode while it moves may do anything. One change takes some periods,
    /// and another axis may creep meanwhile: before each of them all must stand.
    fn change_at_rest(
        &mut self,
        engine: &Engine,
        seats: &Seats,
        change: DriveCommand,
        step: &'static str,
    ) -> Result<(), Failure> {
        for at in &seats.drive[..seats.count] {
            self.await_rest(engine, seats)?;
            self.control(*at, change, step, CHANGE_LIMIT)?;
        }
        Ok(())
    }

    fn moves(&self, at: usize) -> bool {
        let device = &self.axes[at].device;
        device.power_state() == Some(PowerState::OperationEnabled)
            && device.reading().is_none_or(|it| !it.at_rest)
    }

    /// The first set-point of an axis beyond its soft limits would be the limit: a step.
    fn require_inside(&self, engine: &Engine, seats: &Seats) -> Result<(), Failure> {
        for (axis, at) in engine.axes.iter().zip(seats.drive) {
            if let Some(reading) = self.axes[at].device.reading() {
                self.require_place(axis, reading.position)?;
            }
        }
        Ok(())
    }

    /// As near as a move ends counts as inside.
    fn require_place(&self, axis: &str, at: Metres) -> Result<(), Failure> {
        let (min, max) = self.soft_limits(axis)?;
        let window = self.axis_settings(axis)?.position_window;
        if min - window <= at && at <= max + window {
            return Ok(());
        }
        let axis = axis.to_owned();
        Err(EngineFailure::Outside { axis, at, min, max }.into())
    }

    /// Every drive in the mode, enabled, and what each holds.
    fn enter_cyclic(&mut self, engine: &Engine, seats: &Seats) -> Result<PerAxis<Metres>, Failure> {
        let period = engine.period;
        let enter = DriveCommand::EnterCyclic { period };
        let mut held = [Metres::ZERO; AXES_MAX];
        self.change_at_rest(engine, seats, enter, "entering the cyclic mode")?;
        for at in &seats.drive[..seats.count] {
            self.control(*at, DriveCommand::Enable, "enable", CHANGE_LIMIT)?;
        }
        for (axis, at) in seats.drive[..seats.count].iter().enumerate() {
            let position = self.axes[*at].device.held();
            held[axis] = position.ok_or_else(|| EngineFailure::NotCyclic {
                axis: engine.axes[axis].clone(),
            })?;
            self.require_place(&engine.axes[axis], held[axis])?;
        }
        Ok(held)
    }

    /// SYNC is sent here instead of by the transport, and given back however the loop ends.
    fn with_own_sync<R>(
        &mut self,
        run: impl FnOnce(&mut Self) -> Result<R, Failure>,
    ) -> Result<R, Failure> {
        self.set_sync(false)?;
        let outcome = run(self);
        let given_back = self.set_sync(true);
        let result = outcome?;
        given_back.map(|()| result)
    }

    fn run_periods(
        &mut self,
        engine: &mut Engine,
        seats: &mut Seats,
        host: &mut dyn FnMut(),
    ) -> Result<Cause, Failure> {
        let mut pace = Pace {
            // Between the transport's last SYNC and this one lies at most a period and a half.
            deadline: self.now() + engine.period / 2,
            synced: None,
            held_up: None,
        };
        loop {
            let period = self.one_period(engine, seats, &mut pace);
            let period = period.and_then(|ended| match ended {
                Some(_) => self.last_sync(seats, &pace).map(|()| ended),
                None => Ok(None),
            });
            match period {
                Ok(None) => host(),
                Ok(Some(cause)) => return Ok(cause),
                Err(failure) => {
                    let now = self.now();
                    let failure = self.bus_watch.explain(now, failure);
                    let failure = pace.explain(now, engine.period, failure);
                    self.quick_stop_together(seats);
                    return Err(failure);
                }
            }
        }
    }

    /// The transport's first SYNC comes a period after it is asked for. Asked for in the middle of
    /// one, the drives would wait for up to two periods, and fault when this computer stands still
    /// just then: so the loop sends one more when it is due.
    fn last_sync(&mut self, seats: &Seats, pace: &Pace) -> Result<(), Failure> {
        self.transport.sleep_until(pace.deadline);
        self.send_syncs(seats)
            .map_err(|source| self.not_sent(source, "SYNC"))
    }

    fn one_period(
        &mut self,
        engine: &mut Engine,
        seats: &mut Seats,
        pace: &mut Pace,
    ) -> Result<Option<Cause>, Failure> {
        let late = self.begin_period(engine, seats, pace)?;
        let synced = pace.synced.unwrap_or(pace.deadline);
        self.hear_answers(engine, seats, synced)?;
        let answered = self.now();
        self.fire_deadlines(answered);
        self.judge_alarms()?;
        let late_answers = engine.timing.late_answers;
        let judged = |trouble| trouble_to_failure(engine_axes(&engine.axes), late_answers, trouble);
        if late > 0 {
            engine.core.overrun(late).map_err(judged)?;
        }
        if self.stop.is_requested() {
            engine.core.stop(Cause::Asked).map_err(judged)?;
        }
        let heard = self.heard(seats, answered, synced);
        let set_points = engine.core.step(&heard).map_err(judged)?;
        for (at, set_point) in seats.drive[..seats.count].iter().zip(set_points) {
            self.send_set_point(*at, set_point)?;
        }
        self.send_pending()?;
        engine.timing.work.note(self.now().since(answered));
        pace.deadline += engine.period;
        Ok(engine.core.ended())
    }

    /// Waits for the deadline and sends SYNC. Returns how many SYNCs were missed, beyond what
    /// is tolerated.
    fn begin_period(
        &mut self,
        engine: &mut Engine,
        seats: &Seats,
        pace: &mut Pace,
    ) -> Result<u32, Failure> {
        let period = engine.period;
        self.transport.sleep_until(pace.deadline);
        let now = self.now();
        let late = now.since(pace.deadline);
        engine.timing.lateness.note(late);
        let mut missed = 0;
        if late >= period {
            let periods = late.as_nanos() / period.as_nanos().max(1);
            missed = u32::try_from(periods).unwrap_or(u32::MAX);
            engine.timing.overruns += 1;
            engine.timing.skipped += u64::from(missed);
            pace.deadline += period * missed;
        }
        if now.since(pace.deadline) > period / 2 {
            // The next SYNC on the old grid would come close behind this one.
            pace.deadline = now;
            engine.timing.shifted += 1;
        }
        self.send_syncs(seats)
            .map_err(|source| self.not_sent(source, "SYNC"))?;
        if let Some(before) = pace.synced {
            engine
                .timing
                .jitter
                .note(now.since(before).abs_diff(period));
        }
        pace.synced = Some(now);
        if missed < self.patience.periods(1, period) {
            return Ok(0);
        }
        pace.held_up = Some((now, missed));
        Ok(missed)
    }

    fn send_syncs(&mut self, seats: &Seats) -> Result<(), SendError> {
        let sync = Payload::Frame(emit_sync(None));
        seats
            .buses
            .iter()
            .try_for_each(|port| self.transport.send(*port, &sync))
    }

    /// Takes what arrives until every axis has answered, or the time for it is over.
    fn hear_answers(
        &mut self,
        engine: &mut Engine,
        seats: &Seats,
        synced: Time,
    ) -> Result<(), Failure> {
        let listened = synced + engine.period.mul_f64(LISTEN_SHARE);
        loop {
            let complete = seats.drive[..seats.count]
                .iter()
                .all(|at| self.answer(*at, synced).is_some());
            // What else waits is taken too, so that nothing piles up.
            let until = if complete { Time::ZERO } else { listened };
            let Some(arrival) = self.transport.receive(until) else {
                return Ok(());
            };
            let was_complete = complete;
            self.take(&arrival)?;
            if arrival.at < synced {
                let is_late = seats.drive[..seats.count]
                    .iter()
                    .any(|at| self.answer(*at, arrival.at).is_some());
                engine.timing.late_answers += u64::from(is_late);
            } else if !was_complete {
                engine.timing.answers.note(arrival.at.since(synced));
            }
            // On a flooded bus something always waits.
            if arrival.at > listened {
                return Ok(());
            }
        }
    }

    /// At once or not at all: a set-point that waits for room would be an old one.
    fn send_set_point(&mut self, at: usize, set_point: Metres) -> Result<(), Failure> {
        let now = self.transport.now();
        let unit = &mut self.axes[at];
        if let Err(source) = unit.device.follow(now, set_point) {
            let device = unit.name.clone();
            return Err(Failure::Device { device, source });
        }
        while let Some(payload) = unit.device.poll_transmit() {
            if let Err(source) = self.transport.send(unit.port, &payload) {
                let name = unit.name.clone();
                return Err(self.not_sent(source, &name));
            }
        }
        Ok(())
    }

    fn not_sent(&mut self, source: SendError, what: &str) -> Failure {
        // What has arrived meanwhile may say why: bus-off, for one. On a flooded bus something always
        // waits.
        let begun = self.now();
        while let Some(arrival) = self.transport.receive(Time::ZERO) {
            if let Err(failure) = self.take(&arrival) {
                return failure;
            }
            if arrival.at > begun {
                break;
            }
        }
        if let SendError::Unusable { port, state } = source {
            let port = self.port_name(port);
            return Failure::Link { port, state };
        }
        let why = format!("{what}: {source}");
        EngineFailure::NotSent { why }.into()
    }

    /// The quick stop command to every drive and the SYNC at which it counts, now. What a port
    /// does not take is left to the drives' watch on our heartbeat. Nothing moves any more until
    /// the machine is started again ([`Machine::require_supervised`]).
    fn quick_stop_together(&mut self, seats: &Seats) {
        self.supervision = Supervision::Stopping;
        self.outbox.clear();
        let now = self.now();
        for at in 0..self.drive_count() {
            self.drive_mut(at).control(now, DriveCommand::QuickStop);
        }
        let _ = self.send_pending();
        let _ = self.send_syncs(seats);
    }
}

fn engine_axes(axes: &[String]) -> impl Fn(usize) -> String + '_ {
    |axis| axes.get(axis).cloned().unwrap_or_default()
}

fn trouble_to_failure(name: impl Fn(usize) -> String, late: u64, trouble: Trouble) -> Failure {
    match trouble {
        Trouble::Missing { axis, periods } => EngineFailure::Missing {
            axis: name(axis),
            periods,
            late,
        },
        Trouble::Deviates { axis, lag, limit } => EngineFailure::Deviates {
            axis: name(axis),
            lag,
            limit,
        },
        Trouble::NoStop => EngineFailure::NoStop,
    }
    .into()
}
