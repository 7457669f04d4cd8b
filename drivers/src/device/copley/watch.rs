//! Watch on what the axis does, by the request in force: place and speed.
//!
//! The amplifier is looked at some tens of times a second: what it does in between is its own affair.

use core::time::Duration;

use units::{Coordinate, Quantity, Time};

use super::script::Step;
use super::{Activity, CopleyAxis, CopleySettings};
use crate::device::envelope::{Figures, Point, Profile, TRAVEL_MARGIN, hold_limit};
use crate::device::{Alarm, DeviceError};

/// An amplifier samples when it is asked, not when its answer arrives.
pub(super) const SAMPLED_EARLIER: Duration = Duration::from_millis(20);

impl<Q: Coordinate> CopleySettings<Q> {
    /// What its motion is judged by, in counts.
    pub(super) fn figures(&self) -> Figures {
        let counts = |length: Q| self.scale.to_counts(length).0.saturating_abs();
        let window = self.tolerance_counts();
        // The amplifier's own limit is not known here.
        let lag = counts(self.following_error.unwrap_or(self.jump_margin)).max(window);
        Figures {
            period: self.poll_period,
            stall_max: SAMPLED_EARLIER,
            lag,
            hold_limit: hold_limit(self.scale, self.hold_limit, lag, window),
            window,
            speed_max: self.speed_max.value() / self.scale.resolution().abs().value(),
        }
    }

    /// How far a search may go from where it begins, in counts.
    pub(super) fn search_reach(&self) -> i64 {
        self.soft_limits.map_or(i64::MAX / 4, |(low, high)| {
            let travel = self.scale.to_counts(high - low).0.saturating_abs();
            (travel as f64 * TRAVEL_MARGIN) as i64
        })
    }

    /// A search at `speed`, in counts per second and per second squared.
    pub(super) fn search_profile(&self, speed: Q::Speed) -> Profile {
        Profile::new(self.scale, speed, self.homing_acceleration)
    }
}

impl<Q: Coordinate> CopleyAxis<Q> {
    /// Where the axis is, in counts of the amplifier.
    pub(super) fn here(&self) -> Option<Point> {
        let (at, position) = self.image.position()?;
        Some(Point {
            at,
            position: position.0,
        })
    }

    /// Judges the newest position; outside of what was asked the amplifier is stopped at once.
    pub(super) fn watch_motion(&mut self, now: Time) {
        if matches!(self.activity, Activity::Power(_) | Activity::Starting(_)) {
            return;
        }
        if !self.kept || !self.is_enabled() {
            return self.envelope.release();
        }
        let Some(here) = self.here() else {
            return;
        };
        if let Some(departure) = self.envelope.judge(here.at, here.position) {
            let (scale, origin) = (self.settings.scale, self.origin);
            let alarm = departure.to_alarm(self.name(), scale, origin);
            self.alarm(alarm);
            self.stop_by_itself(now);
        } else if self.image.plausible.stands() {
            let is_idle = matches!(self.activity, Activity::Idle);
            self.envelope.stand(here.position, is_idle);
        }
    }

    /// A quick stop without an order: how a command ended before stays to be asked for.
    fn stop_by_itself(&mut self, now: Time) {
        self.begin_quick_stop(now);
        self.stops_by_itself = true;
    }

    /// The first step of whatever is to begin while a move runs that nobody waits for any more.
    pub(super) fn abort_first(&self, was_moving: bool) -> Vec<Step> {
        match was_moving {
            true => vec![Step::abort("ending the move before")],
            false => Vec::new(),
        }
    }

    /// Whether a motion is under way.
    pub(super) const fn is_moving(&self) -> bool {
        matches!(
            self.activity,
            Activity::Motion(_) | Activity::Homing(_) | Activity::Halt(_)
        )
    }

    pub(super) fn alarm(&mut self, alarm: Alarm) {
        self.alarms.push_back(alarm);
        let restarted = matches!(alarm, Alarm::AmplifierRestarted { .. });
        let ends_it = match &self.activity {
            Activity::Idle | Activity::Starting(_) => false,
            // Stopping and resetting go on: they are the answer to alarms.
            Activity::Power(_) | Activity::Halt(_) => restarted,
            Activity::Motion(_) | Activity::Homing(_) => true,
        };
        self.prepared = None;
        if ends_it {
            let step = self.activity.name();
            let device = self.name();
            self.finish(Err(DeviceError::Alarmed {
                device,
                step,
                alarm,
            }));
        }
    }
}
