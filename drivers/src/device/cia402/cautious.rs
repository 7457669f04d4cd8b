//! Homings and moves that begin with a trial of the drive's units.

use units::{Coordinate, Time};
use wire::cia402::{HomingStatus, Statusword};

use super::drive_units::fitting_unit;
use super::motion::Move;
use super::trial::{Trial, Verdict};
use super::{Activity, Cia402Drive};
use crate::device::DeviceError;

impl<Q: Coordinate> Cia402Drive<Q> {
    /// The trial of a motion at `speed`, counts per second; `None`: the units are known.
    pub(super) fn trial_of(&self, speed: u32, raised: Option<Trial>) -> Option<Trial> {
        let new = || Trial::new(&self.settings, speed, self.per_turn);
        (!self.units_proven).then(|| raised.unwrap_or_else(new))
    }

    fn unit_seen(&self, what: &'static str, factor: f64) -> DeviceError {
        DeviceError::UnitSeen {
            node: self.node.id(),
            what,
            factor,
            fits: fitting_unit(factor, self.per_turn),
        }
    }

    /// Judges one sample of a search whose speed is tried.
    pub(super) fn follow_trial(&mut self, now: Time, word: Statusword) {
        let (settings, here) = (&self.settings, self.image.here());
        let (noise, period) = (settings.tolerance_counts(), settings.common.sync_period);
        let (Activity::Homing(homing), Some(here)) = (&mut self.activity, here) else {
            return;
        };
        let Some(trial) = homing.running_trial() else {
            return;
        };
        if HomingStatus::of(word) != HomingStatus::InProgress {
            return;
        }
        match trial.judge(here, noise, period) {
            None => {}
            Some(Verdict::TooSlow) => {
                if let Some(raised) = trial.raised() {
                    *trial = raised;
                    self.interrupt_homing(now);
                }
            }
            Some(Verdict::Agrees) => {
                self.units_proven = true;
                self.interrupt_homing(now);
            }
            Some(Verdict::Differs { what, factor }) => {
                let error = self.unit_seen(what, factor);
                self.restore(now, Err(error));
            }
        }
    }

    /// The axis stands after a trial: the search begins anew.
    pub(super) fn search_anew(&mut self, now: Time, trial: Option<Trial>) {
        if let Some((position, place)) = self.homing_asked {
            self.prepare_homing(now, position, place, trial);
        }
    }

    /// Makes the first part of a move that is asked for a trial of the drive's units. An axis that moves
    /// tells nothing of a ramp: its whole move is slow.
    pub(super) fn begin_cautiously(&self, planned: &mut Move) {
        let Some(trial) = self.trial_of(planned.profile.0, None) else {
            return;
        };
        let full = planned.profile;
        planned.profile = trial.values();
        if self.image.plausible.stands() {
            self.try_units(planned, trial, full);
        }
    }

    fn try_units(&self, planned: &mut Move, trial: Trial, full: (u32, u32)) {
        planned.profile = trial.values();
        planned.trial = Some((trial, full));
        let here = self.image.here();
        let here = here.map_or(planned.target, |here| here.position);
        let way = (planned.target - here).clamp(-trial.way(), trial.way());
        planned.set_point = self.way_point(here + way);
    }

    /// Judges one sample of a move that begins with a trial.
    pub(super) fn follow_tried_move(&mut self, now: Time) {
        let (settings, here) = (&self.settings, self.image.here());
        let (noise, period) = (settings.tolerance_counts(), settings.common.sync_period);
        let (Activity::Move(moving), Some(here)) = (&mut self.activity, here) else {
            return;
        };
        let Some((trial, full)) = &mut moving.trial else {
            return;
        };
        let verdict = trial.judge(here, noise, period);
        let (trial, full) = (*trial, *full);
        let mut planned = *moving;
        match verdict {
            None if trial.is_void() => self.end_tried_move(now, planned, trial.values()),
            None => {}
            Some(Verdict::TooSlow) => {
                if let Some(raised) = trial.raised() {
                    self.try_units(&mut planned, raised, full);
                    self.go_on_as(now, planned);
                }
            }
            Some(Verdict::Agrees) => {
                self.units_proven = true;
                self.end_tried_move(now, planned, full);
            }
            Some(Verdict::Differs { what, factor }) => {
                let error = self.unit_seen(what, factor);
                self.fail_motion(now, error);
            }
        }
    }

    fn end_tried_move(&mut self, now: Time, mut planned: Move, profile: (u32, u32)) {
        planned.trial = None;
        planned.profile = profile;
        planned.set_point = self.way_point(planned.target);
        self.go_on_as(now, planned);
    }
}
