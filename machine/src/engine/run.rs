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
use wire::Payload;
use wire::canopen::sync::emit_sync;
use wire::cia402::PowerState;

use super::account::Trouble;
use super::hear::{answer, heard};
use super::pace::Pace;
use super::seats::Seats;
use super::{AXES_MAX, Cause, Engine, EngineFailure, PerAxis};
use crate::failure::Failure;
use crate::machine::{Machine, Supervision, call_attendant};
use crate::parts::{Bus, CyclicSettings};

/// The share of a period in which answers are awaited.
const LISTEN_SHARE: f64 = 0.5;
/// How long a drive may take to change its mode or to be enabled.
const CHANGE_LIMIT: Duration = Duration::from_secs(10);
/// How long the axes may take to come to rest before the mode is entered, and left.
const REST_LIMIT: Duration = Duration::from_secs(5);

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
        let outcome = follow_to_rest(self, engine, host);
        if outcome.is_err() {
            engine.core.forget_orders();
        }
        outcome
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
}

/// The loop's SYNC goes out on every CAN bus, also those that carry none of its axes.
pub(super) fn require_one_sync(buses: &[Bus], expected: Duration) -> Result<(), Failure> {
    match buses.iter().find(|it| it.sync_period != expected) {
        None => Ok(()),
        Some(other) => Err(EngineFailure::Periods {
            bus: other.name.clone(),
            expected,
            seen: other.sync_period,
        }
        .into()),
    }
}

fn follow_to_rest(
    machine: &mut Machine,
    engine: &mut Engine,
    host: &mut dyn FnMut(),
) -> Result<Cause, Failure> {
    for axis in &engine.axes {
        machine.require_zeroed(axis)?;
    }
    let seats = Seats::of(engine, machine)?;
    machine.require_supervised(seats.drive[0])?;
    let mut run = Run {
        machine,
        engine,
        seats,
    };
    run.await_rest()?;
    run.require_inside()?;
    // Locking memory takes its time, and so does letting it go: never between two SYNCs.
    let granted = run.engine.real_time.then(RealTime::ask);
    let text = granted.as_ref().map(ToString::to_string);
    run.engine.timing.scheduling = text.unwrap_or_default();
    run.between_rests(host)
}

/// A motion that is under way.
struct Run<'m> {
    machine: &'m mut Machine,
    engine: &'m mut Engine,
    seats: Seats,
}

impl Run<'_> {
    fn between_rests(&mut self, host: &mut dyn FnMut()) -> Result<Cause, Failure> {
        let held = self.enter_cyclic()?;
        self.engine.core.begin(held);
        self.machine.notices.hold_back();
        let cause = self.with_own_sync(host);
        self.machine.notices.let_go();
        let cause = cause?;
        self.change_at_rest(DriveCommand::LeaveCyclic, "leaving the cyclic mode")?;
        for at in self.seats.drives() {
            self.machine.approach[*at].forget();
        }
        Ok(cause)
    }

    /// Until every axis that its drive holds stands still; one that is not enabled goes where
    /// it likes.
    fn await_rest(&mut self) -> Result<(), Failure> {
        let begun = self.machine.now();
        let deadline = begun + self.machine.patience.of(REST_LIMIT);
        while let Some(axis) = self.seats.drives().iter().position(|at| self.moves(*at)) {
            if self.machine.now() >= deadline {
                let axis = self.engine.axes[axis].clone();
                let waited = self.machine.now().since(begun);
                return Err(EngineFailure::NotAtRest { axis, waited }.into());
            }
            self.machine.tick(deadline)?;
        }
        Ok(())
    }

    /// A drive that changes its mode while it moves may do anything. One change takes some periods,
    /// and another axis may creep meanwhile: before each of them all must stand.
    fn change_at_rest(&mut self, change: DriveCommand, step: &'static str) -> Result<(), Failure> {
        for axis in 0..self.seats.count {
            self.await_rest()?;
            let at = self.seats.drive[axis];
            self.machine.control(at, change, step, CHANGE_LIMIT)?;
        }
        Ok(())
    }

    fn moves(&self, at: usize) -> bool {
        let device = &self.machine.devices.axes[at].device;
        device.power_state() == Some(PowerState::OperationEnabled)
            && device.reading().is_none_or(|it| !it.at_rest)
    }

    /// The first set-point of an axis beyond its soft limits would be the limit: a step.
    fn require_inside(&self) -> Result<(), Failure> {
        for (axis, at) in self.engine.axes.iter().zip(self.seats.drive) {
            if let Some(reading) = self.machine.devices.axes[at].device.reading() {
                self.require_place(axis, reading.position)?;
            }
        }
        Ok(())
    }

    /// As near as a move ends counts as inside.
    fn require_place(&self, axis: &str, at: Metres) -> Result<(), Failure> {
        let (min, max) = self.machine.soft_limits(axis)?;
        let window = self.machine.axis_settings(axis)?.position_window;
        if min - window <= at && at <= max + window {
            return Ok(());
        }
        let axis = axis.to_owned();
        Err(EngineFailure::Outside { axis, at, min, max }.into())
    }

    /// Every drive in the mode, enabled, and what each holds.
    fn enter_cyclic(&mut self) -> Result<PerAxis<Metres>, Failure> {
        let period = self.engine.period;
        let enter = DriveCommand::EnterCyclic { period };
        let mut held = [Metres::ZERO; AXES_MAX];
        self.change_at_rest(enter, "entering the cyclic mode")?;
        for axis in 0..self.seats.count {
            let at = self.seats.drive[axis];
            self.machine
                .control(at, DriveCommand::Enable, "enable", CHANGE_LIMIT)?;
        }
        for (axis, at) in self.seats.drives().iter().enumerate() {
            let position = self.machine.devices.axes[*at].device.held();
            let name = &self.engine.axes[axis];
            held[axis] = position.ok_or_else(|| EngineFailure::NotCyclic { axis: name.clone() })?;
            self.require_place(name, held[axis])?;
        }
        Ok(held)
    }

    /// SYNC is sent here instead of by the transport, and given back however the loop ends.
    fn with_own_sync(&mut self, host: &mut dyn FnMut()) -> Result<Cause, Failure> {
        let machine = &mut *self.machine;
        machine.ports.set_sync(&mut *machine.transport, false)?;
        machine.follows = true;
        let outcome = self.run_periods(host);
        let machine = &mut *self.machine;
        machine.follows = false;
        let given_back = machine.ports.set_sync(&mut *machine.transport, true);
        let result = outcome?;
        given_back.map(|()| result)
    }

    fn run_periods(&mut self, host: &mut dyn FnMut()) -> Result<Cause, Failure> {
        let mut pace = Pace {
            // Between the transport's last SYNC and this one lies at most a period and a half.
            deadline: self.machine.now() + self.engine.period / 2,
            synced: None,
            held_up: None,
        };
        loop {
            let period = self.one_period(&mut pace);
            let period = period.and_then(|ended| match ended {
                Some(_) => self.last_sync(&pace).map(|()| ended),
                None => Ok(None),
            });
            match period {
                Ok(None) => host(),
                Ok(Some(cause)) => return Ok(cause),
                // Whoever attends to the machine has told every drive already.
                Err(Failure::Interrupted) => return Err(Failure::Interrupted),
                Err(failure) => {
                    let now = self.machine.now();
                    let failure = self.machine.bus_watch.explain(now, failure);
                    let failure = pace.explain(now, self.engine.period, failure);
                    self.quick_stop_together();
                    return Err(failure);
                }
            }
        }
    }

    /// The transport's first SYNC comes a period after it is asked for. Asked for in the middle of
    /// one, the drives would wait for up to two periods, and fault when this computer stands still
    /// just then: so the loop sends one more when it is due.
    fn last_sync(&mut self, pace: &Pace) -> Result<(), Failure> {
        self.machine.transport.sleep_until(pace.deadline);
        self.send_syncs()
            .map_err(|source| self.not_sent(source, "SYNC"))
    }

    fn one_period(&mut self, pace: &mut Pace) -> Result<Option<Cause>, Failure> {
        let late = self.begin_period(pace)?;
        let synced = pace.synced.unwrap_or(pace.deadline);
        self.hear_answers(synced)?;
        let answered = self.machine.now();
        self.machine.fire_deadlines(answered);
        let machine = &mut *self.machine;
        machine
            .devices
            .keep_looking(answered, true, &mut machine.notices);
        machine.notices.lives(answered);
        self.machine.judge_alarms()?;
        let engine = &mut *self.engine;
        let late_answers = engine.timing.late_answers;
        let judged = |trouble| trouble_to_failure(engine_axes(&engine.axes), late_answers, trouble);
        if late > 0 {
            engine.core.overrun(late).map_err(judged)?;
        }
        if self.machine.stop.is_requested() {
            engine.core.stop(Cause::Asked).map_err(judged)?;
        }
        let heard = heard(&self.machine.devices, &mut self.seats, answered, synced);
        let set_points = engine.core.step(&heard).map_err(judged)?;
        for (axis, set_point) in (0..self.seats.count).zip(set_points) {
            self.send_set_point(self.seats.drive[axis], set_point)?;
        }
        self.machine.send_pending()?;
        let work = self.machine.now().since(answered);
        let engine = &mut *self.engine;
        engine.timing.work.note(work);
        pace.deadline += engine.period;
        let ended = engine.core.ended();
        self.be_attended()?;
        Ok(ended)
    }

    /// Whoever attends to the machine looks after it once in every period. Where he ends what runs, the axes stop
    /// together, or have been told to by him.
    fn be_attended(&mut self) -> Result<(), Failure> {
        match call_attendant(self.machine) {
            Ok(()) => Ok(()),
            Err(Failure::Interrupted) if self.machine.follows => {
                let late_answers = self.engine.timing.late_answers;
                let axes = engine_axes(&self.engine.axes);
                let stopped = self.engine.core.stop(Cause::Asked);
                stopped.map_err(|it| trouble_to_failure(axes, late_answers, it))
            }
            Err(failure) => Err(failure),
        }
    }

    /// Waits for the deadline and sends SYNC. Returns how many SYNCs were missed, beyond what
    /// is tolerated.
    fn begin_period(&mut self, pace: &mut Pace) -> Result<u32, Failure> {
        let period = self.engine.period;
        self.machine.transport.sleep_until(pace.deadline);
        let now = self.machine.now();
        let late = now.since(pace.deadline);
        let timing = &mut self.engine.timing;
        timing.lateness.note(late);
        let mut missed = 0;
        if late >= period {
            let periods = late.as_nanos() / period.as_nanos().max(1);
            missed = u32::try_from(periods).unwrap_or(u32::MAX);
            timing.overruns += 1;
            timing.skipped += u64::from(missed);
            pace.deadline += period * missed;
        }
        if now.since(pace.deadline) > period / 2 {
            // The next SYNC on the old grid would come close behind this one.
            pace.deadline = now;
            timing.shifted += 1;
        }
        self.account(late, missed);
        self.send_syncs()
            .map_err(|source| self.not_sent(source, "SYNC"))?;
        if let Some(before) = pace.synced {
            let jitter = now.since(before).abs_diff(period);
            self.engine.timing.jitter.note(jitter);
        }
        pace.synced = Some(now);
        if missed < self.machine.patience.periods(1, period) {
            return Ok(0);
        }
        pace.held_up = Some((now, missed));
        Ok(missed)
    }

    /// A SYNC that leaves now is among those that the machine's buses are judged by.
    fn account(&mut self, late: Duration, missed: u32) {
        for port in self.seats.buses.iter() {
            if let Some(syncs) = self.machine.ports.syncs.of_engine(*port) {
                syncs.lateness.note(late);
                syncs.sent += 1;
                syncs.skipped += u64::from(missed);
            }
        }
    }

    fn send_syncs(&mut self) -> Result<(), SendError> {
        let sync = Payload::Frame(emit_sync(None));
        let machine = &mut *self.machine;
        let mut buses = self.seats.buses.iter();
        buses.try_for_each(|port| {
            machine.bus_account.sent(*port, &sync);
            machine.transport.send(*port, &sync)
        })
    }

    /// Takes what arrives until every axis has answered, or the time for it is over.
    fn hear_answers(&mut self, synced: Time) -> Result<(), Failure> {
        let listened = synced + self.engine.period.mul_f64(LISTEN_SHARE);
        loop {
            let devices = &self.machine.devices;
            let mut drives = self.seats.drives().iter();
            let complete = drives.all(|at| answer(devices, *at, synced).is_some());
            // What else waits is taken too, so that nothing piles up.
            let until = if complete { Time::ZERO } else { listened };
            let Some(arrival) = self.machine.transport.receive(until) else {
                return Ok(());
            };
            let was_complete = complete;
            self.machine.take(&arrival)?;
            if arrival.at < synced {
                let devices = &self.machine.devices;
                let mut drives = self.seats.drives().iter();
                let is_late = drives.any(|at| answer(devices, *at, arrival.at).is_some());
                self.engine.timing.late_answers += u64::from(is_late);
            } else if !was_complete {
                self.engine.timing.answers.note(arrival.at.since(synced));
            }
            // On a flooded bus something always waits.
            if arrival.at > listened {
                return Ok(());
            }
        }
    }

    /// At once or not at all: a set-point that waits for room would be an old one.
    fn send_set_point(&mut self, at: usize, set_point: Metres) -> Result<(), Failure> {
        let now = self.machine.transport.now();
        let unit = &mut self.machine.devices.axes[at];
        if let Err(source) = unit.device.follow(now, set_point) {
            let device = unit.name.clone();
            return Err(Failure::Device { device, source });
        }
        while let Some(payload) = unit.device.poll_transmit() {
            self.machine.bus_account.sent(unit.port, &payload);
            if let Err(source) = self.machine.transport.send(unit.port, &payload) {
                let name = unit.name.clone();
                return Err(self.not_sent(source, &name));
            }
        }
        Ok(())
    }

    fn not_sent(&mut self, source: SendError, what: &str) -> Failure {
        // What has arrived meanwhile may say why: bus-off, for one. On a flooded bus something always
        // waits.
        let begun = self.machine.now();
        while let Some(arrival) = self.machine.transport.receive(Time::ZERO) {
            if let Err(failure) = self.machine.take(&arrival) {
                return failure;
            }
            if arrival.at > begun {
                break;
            }
        }
        if let SendError::Unusable { port, state } = source {
            let port = self.machine.ports.name(port);
            return Failure::Link { port, state };
        }
        let why = format!("{what}: {source}");
        EngineFailure::NotSent { why }.into()
    }

    /// The quick stop command to every drive and the SYNC at which it counts, now. What a port
    /// does not take is left to the drives' watch on our heartbeat. Nothing moves any more until
    /// the machine is started again ([`Machine::require_supervised`]).
    fn quick_stop_together(&mut self) {
        self.machine.supervision = Supervision::Stopping;
        self.machine.outbox.clear();
        let now = self.machine.now();
        for at in 0..self.machine.devices.drive_count() {
            self.machine
                .devices
                .drive_mut(at)
                .control(now, DriveCommand::QuickStop);
        }
        let _ = self.machine.send_pending();
        let _ = self.send_syncs();
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
