//! Into and out of cyclic synchronous position (CiA 402, 10.8; mode 8), and its set-points.
//!
//! The order keeps the axis where it is: the interpolation period (0x60C2) is written and read
//! back, then the target in RPDO 1 becomes where the axis stands, then the mode is chosen and its
//! display (0x6061) awaited. While the drive is brought to operation enabled the target follows
//! the axis; once it is enabled only [`Axis::follow`](crate::device::Axis::follow) changes it.
//!
//! RPDO 1 must take effect at the SYNC: several axes are one motion only when they take their
//! set-points at the same moment. It is mapped so, and read back, when the drive is started
//! ([`Cia402Settings::synchronous_start`](super::Cia402Settings::synchronous_start)).
//!
//! Of the statusword two bits are watched meanwhile: 12, "drive follows the command value", and 11,
//! "internal limit active". For a drive that never sets bit 12 this is no alarm.
//!
//! Absent: offsets of velocity and torque (0x60B1, 0x60B2), modes 9 and 10.

use core::time::Duration;

use units::{Coordinate, Time};
use wire::canopen::Object;
use wire::cia402::{Controlword, OperationMode, PowerState, Statusword};

use super::convert::{out_of_range, position_counts};
use super::image::Sample;
use super::start::{MODE, TARGET_POSITION};
use super::{Activity, Cia402Drive};
use crate::device::{Alarm, DeviceError, Seen};
use crate::protocol::script::Step;

const PERIOD_VALUE: Object = Object::new(0x60C2, 1);
const PERIOD_INDEX: Object = Object::new(0x60C2, 2);

/// Bit 7 of 0x6502 stands for mode 8.
const CYCLIC_POSITION: u32 = 1 << 7;

const ENTERING: &str = "entering cyclic synchronous position";

/// So many samples in a row must say that set-points are limited, or not followed: a torque that
/// is limited for a moment is none.
const WATCHED_MAX: u32 = 3;

/// What the statusword has said of set-points in a row.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct CyclicWatch {
    has_followed: bool,
    unfollowed: u32,
    limited: u32,
}

/// A change of the mode under way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct ModeChange {
    to: OperationMode,
    /// Written; the display is awaited.
    written: bool,
    since: Time,
    /// SDO has time-outs of its own.
    deadline: Time,
}

impl ModeChange {
    pub(super) const fn deadline(&self) -> Time {
        self.deadline
    }
}

/// `period` as 0x60C2 has it: `value` times 10 to the power of `index` seconds.
///
/// The coarsest power that is exact: drives that know one power only know milliseconds.
/// `None` when no power takes it: 255 units at most.
///
/// # Example
///
/// ```
/// use drivers::device::cia402::interpolation_period;
/// use std::time::Duration;
///
/// assert_eq!(interpolation_period(Duration::from_millis(2)), Some((2, -3)));
/// assert_eq!(interpolation_period(Duration::from_micros(250)), Some((25, -5)));
/// assert_eq!(interpolation_period(Duration::from_nanos(1_500)), None);
/// ```
pub fn interpolation_period(period: Duration) -> Option<(u8, i8)> {
    let nanos = period.as_nanos();
    [
        (-3_i8, 1_000_000_u128),
        (-4, 100_000),
        (-5, 10_000),
        (-6, 1_000),
    ]
    .into_iter()
    .filter(|(_, unit)| nanos > 0 && nanos.is_multiple_of(*unit))
    .find_map(|(index, unit)| Some((u8::try_from(nanos / unit).ok()?, index)))
}

/// The shortest period from `at_least` on that [`interpolation_period`] takes, if there is one.
///
/// # Example
///
/// ```
/// use drivers::device::cia402::period_from;
/// use std::time::Duration;
///
/// assert_eq!(period_from(Duration::from_nanos(1_500)), Some(Duration::from_micros(2)));
/// assert_eq!(period_from(Duration::from_secs(1)), None, "255 ms at most");
/// ```
pub fn period_from(at_least: Duration) -> Option<Duration> {
    [1_000_u64, 10_000, 100_000, 1_000_000]
        .into_iter()
        .map(|unit| (unit, at_least.as_nanos().div_ceil(u128::from(unit)).max(1)))
        .find(|(_, units)| *units <= u128::from(u8::MAX))
        .map(|(unit, units)| Duration::from_nanos(unit * units as u64))
}

impl<Q: Coordinate> Cia402Drive<Q> {
    /// Whether set-points have an effect: the drive says that it is in the mode and enabled.
    fn takes_set_points(&self) -> bool {
        matches!(self.activity, Activity::Idle)
            && self.is_cyclic()
            && self.kept == Some(PowerState::OperationEnabled)
    }

    /// Whether both we and the drive are in cyclic synchronous position.
    pub(super) fn is_cyclic(&self) -> bool {
        let cyclic = Some(OperationMode::CyclicSynchronousPosition);
        self.mode() == cyclic && self.commanded_mode == cyclic
    }

    /// Outside of a motion the target in RPDO 1 is the axis' own place: a frame that is taken for a
    /// new set-point moves nothing.
    pub(super) fn keep_target_at_axis(&mut self) {
        let Some(sample) = self.image.sample() else {
            return;
        };
        let enabled = sample.state() == PowerState::OperationEnabled;
        let cyclic = Some(OperationMode::CyclicSynchronousPosition);
        let follows = self.commanded_mode == cyclic || Some(sample.mode) == cyclic;
        let has_target = match &self.activity {
            Activity::Move(moving) => moving.has_announced(),
            Activity::Halt(halt) => halt.has_announced(),
            Activity::Mode(_) => true,
            Activity::Idle
            | Activity::Starting
            | Activity::Power(_)
            | Activity::Homing(_)
            | Activity::Latch(_)
            | Activity::Release
            | Activity::Reference { .. } => self.prepared.is_some(),
        };
        if !(enabled && (follows || has_target)) {
            self.target = sample.shown;
        }
    }

    pub(super) fn begin_cyclic(&mut self, now: Time, period: Duration) {
        let modes = self.supported_modes;
        if modes.is_some_and(|modes| modes & CYCLIC_POSITION == 0) {
            let needs = "a drive that supports mode 8 (bit 7 of 0x6502)";
            return self.refuse(ENTERING, needs);
        }
        if !self.settings.synchronous_start {
            let needs = "command PDOs that take effect at the SYNC: set synchronous_start for this \
                         axis";
            return self.refuse(ENTERING, needs);
        }
        let Some((value, index)) = interpolation_period(period) else {
            let needs = "a SYNC period of whole microseconds that fits 0x60C2 (255 units)";
            return self.refuse(ENTERING, needs);
        };
        let enabled = self.state() == Some(PowerState::OperationEnabled);
        if enabled && !self.image.plausible.stands() {
            return self.refuse(ENTERING, "an axis that stands still");
        }
        const TEXT: &str = "setting the interpolation period";
        self.write_mode(
            now,
            OperationMode::CyclicSynchronousPosition,
            vec![
                Step::check(PERIOD_VALUE, value, TEXT),
                Step::check(PERIOD_INDEX, index, TEXT),
            ],
        );
        // What an enabled drive holds, as far as that is known; its own place otherwise. It goes
        // out now, before the mode that makes it count.
        let held = self.reached.take().filter(|_| enabled);
        let held = held.and_then(|counts| self.on_the_wire(counts));
        if let Some(target) = held.or(self.image.sample().map(|sample| sample.shown)) {
            self.target = target;
            self.send_control(
                now,
                self.control - Controlword::MODE_4 - Controlword::MODE_5,
            );
            self.repeat_at = Time::NEVER;
        }
    }

    pub(super) fn end_cyclic(&mut self, now: Time) {
        self.reached = None;
        if self.open_target {
            // Back in profile position the drive would go on to the target before.
            self.send_control(now, self.control | Controlword::HALT);
            self.repeat_at = Time::NEVER;
        }
        self.write_mode(now, OperationMode::ProfilePosition, Vec::new());
    }

    fn write_mode(&mut self, now: Time, to: OperationMode, mut steps: Vec<Step>) {
        let text = match to {
            OperationMode::CyclicSynchronousPosition => "choosing cyclic synchronous position",
            _ => "choosing profile position",
        };
        steps.push(Step::write(MODE, to.raw(), text));
        self.commanded_mode = None;
        self.activity = Activity::Mode(ModeChange {
            to,
            written: false,
            since: now,
            deadline: Time::NEVER,
        });
        self.node.run(now, steps);
        self.pump(now);
    }

    pub(super) fn mode_written(&mut self, now: Time) {
        let patience = self.settings.timeouts.mode;
        let Activity::Mode(change) = &mut self.activity else {
            return;
        };
        change.written = true;
        change.since = now;
        change.deadline = now + patience;
        self.commanded_mode = Some(change.to);
        self.advance_mode();
    }

    pub(super) fn advance_mode(&mut self) {
        let Activity::Mode(change) = &self.activity else {
            return;
        };
        if change.written && self.mode() == Some(change.to) {
            match change.to {
                OperationMode::CyclicSynchronousPosition => self.watch_set_points(),
                _ => self.envelope.settle(),
            }
            self.finish(Ok(()));
        }
    }

    pub(super) fn mode_timeout(&mut self, now: Time) {
        let Activity::Mode(change) = &self.activity else {
            return;
        };
        if now >= change.deadline {
            let since = change.since;
            let seen = self
                .mode()
                .map_or(Seen::Nothing, |mode| Seen::Mode(mode.raw()));
            self.time_out(now, since, "the mode display (0x6061) to follow", seen);
        }
    }

    /// Puts `target` into RPDO 1; the drive takes it at the next SYNC.
    pub(super) fn send_set_point(&mut self, now: Time, target: Q) -> Result<(), DeviceError> {
        let settings = &self.settings;
        if !self.takes_set_points() {
            return Err(DeviceError::NotPossible {
                device: self.node.name(),
                step: "following a set-point",
                needs: "an enabled drive in cyclic synchronous position, with nothing else under \
                        way",
            });
        }
        let object = TARGET_POSITION.object;
        let counts = position_counts(settings, object, "set-point", target)?;
        let wire = self.on_the_wire(counts);
        let range = settings.soft_limits.unwrap_or((target, target));
        let limit = if target < range.0 { range.0 } else { range.1 };
        match wire {
            Some(wire) if range.0 <= target && target <= range.1 => {
                self.target = wire;
                self.envelope.follow(now, counts);
            }
            _ => {
                let range = (target.value(), limit.value());
                return Err(out_of_range(settings, object, "set-point", range, Q::UNIT));
            }
        }
        self.send_control(now, Controlword::ENABLE_COMMAND);
        // The next set-point repeats it soon enough, and a late repetition would be an old one.
        self.repeat_at = Time::NEVER;
        Ok(())
    }

    /// Told once, when it has lasted: a drive that no longer does what it is sent.
    pub(super) fn watch_cyclic(&mut self, sample: &Sample) {
        if !self.takes_set_points() || sample.state() != PowerState::OperationEnabled {
            self.cyclic_watch = CyclicWatch::default();
            return;
        }
        let follows = sample.status.contains(Statusword::MODE_12);
        let limits = sample.status.contains(Statusword::INTERNAL_LIMIT);
        let in_a_row = |before: u32, is: bool| if is { before.saturating_add(1) } else { 0 };
        let watch = &mut self.cyclic_watch;
        watch.has_followed |= follows;
        watch.unfollowed = in_a_row(watch.unfollowed, watch.has_followed && !follows);
        watch.limited = in_a_row(watch.limited, limits);
        let node = self.node.id();
        if watch.unfollowed == WATCHED_MAX {
            self.alarm(Alarm::NotFollowing { node });
        }
        if self.cyclic_watch.limited == WATCHED_MAX {
            self.alarm(Alarm::InternalLimit { node });
        }
    }

    /// What RPDO 1 says last, while that is a set-point.
    pub(super) fn held_set_point(&self) -> Option<Q> {
        self.is_cyclic().then(|| {
            self.settings
                .scale
                .to_coordinate(self.image.counting_on(self.target))
        })
    }
}
