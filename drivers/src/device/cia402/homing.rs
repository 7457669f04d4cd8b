//! Homing (CiA 402, 11; methods 17, 18, 33, 34 and 37): parameters, mode 6, start, status by
//! mask, mode 1 again.

use core::time::Duration;
use units::{Coordinate, Counts, Time};
use wire::cia402::{Controlword, HomingStatus, OperationMode, Statusword};

use super::convert::{counts_i32, position_counts};
use super::homing_place::HomingPlace;
use super::modulo::apart;
use super::reference::before_home;
use super::settings::HomeOffset;
use super::start::{HOME_OFFSET, MODE, Search, homing_steps};
use super::trial::Trial;
use super::{Activity, Cia402Drive};
use crate::device::envelope::{Profile, TRAVEL_MARGIN};
use crate::device::{DeviceError, Seen};
use crate::protocol::script::Step;

/// So many samples after the start, an error may still be that of the homing before.
const STALE_SAMPLES: u8 = 5;
/// A search for an index mark may go so much farther than a turn.
const TURN_MARGIN: f64 = 1.1;

#[derive(Clone, Debug, PartialEq)]
enum Phase {
    /// SDO: parameters, mode 6.
    Preparing,
    AwaitingHoming,
    Running {
        samples: u8,
        /// "Attained" was seen low since the start: what follows is about this homing.
        begun: bool,
        /// Before the start, the place shown was not the home coordinate.
        was_far: bool,
        /// Since when the axis stands and the drive calls homing done.
        done_since: Option<Time>,
    },
    /// The trial of its speed is over: once the axis stands, the search begins anew.
    Slowing,
    /// SDO: mode 1; then the outcome is told.
    Restoring(Result<(), DeviceError>),
    AwaitingProfile(Result<(), DeviceError>),
    AwaitingPosition,
}

/// A homing under way.
#[derive(Debug)]
pub(super) struct Homing {
    phase: Phase,
    /// The coordinate at home, in counts.
    position: i64,
    /// How far from there the axis may stand afterwards, with falling and with growing counts.
    beside: (i64, i64),
    /// The search, in counts per second and per second squared; `None`: homed where it stands.
    search: Option<Profile>,
    /// Its speed is tried first: the drive states no units.
    trial: Option<Trial>,
    since: Time,
    deadline: Time,
}

impl Homing {
    pub(super) const fn deadline(&self) -> Time {
        self.deadline
    }

    /// The trial of its speed, while that is searched at.
    pub(super) fn running_trial(&mut self) -> Option<&mut Trial> {
        match self.phase {
            Phase::Running { .. } => self.trial.as_mut(),
            Phase::Preparing
            | Phase::AwaitingHoming
            | Phase::Slowing
            | Phase::Restoring(_)
            | Phase::AwaitingProfile(_)
            | Phase::AwaitingPosition => None,
        }
    }
}

impl<Q: Coordinate> Cia402Drive<Q> {
    pub(super) fn begin_homing(&mut self, now: Time, position: Q, place: HomingPlace<Q::Speed>) {
        if place.speed().is_none() && !self.image.plausible.stands() {
            self.refuse("homing here", "an axis that stands still");
            return;
        }
        self.homing_asked = Some((position, place));
        self.prepare_homing(now, position, place, None);
    }

    /// Writes what the search needs; `trial` goes on where one was too slow.
    pub(super) fn prepare_homing(
        &mut self,
        now: Time,
        position: Q,
        place: HomingPlace<Q::Speed>,
        trial: Option<Trial>,
    ) {
        let method = place.method(self.settings.scale.resolution() < Q::ZERO);
        let plan = self.home_counts(position).and_then(|(counts, shown)| {
            let offset = match self.settings.home_offset {
                HomeOffset::IsPositionAtHome => shown,
                HomeOffset::IsZeroFromHome => -shown,
            };
            let speed = place.speed();
            let search = speed.map(|speed| Search::new(&self.settings, method, speed));
            let search = search.transpose()?;
            let trial = search.and_then(|search| self.trial_of(search.speed, trial));
            let search = match trial.map(|trial| trial.values()) {
                Some((speed, acceleration)) => Some(Search {
                    speed,
                    zero_speed: speed,
                    acceleration,
                }),
                None => search,
            };
            let mut steps = homing_steps(&self.settings, method, offset, search);
            let first = before_home(&self.settings).filter(|_| search.is_none());
            steps.splice(0..0, first);
            let search = search.map(|search| Profile::written(search.speed, search.acceleration));
            Ok((counts, search, trial, steps))
        });
        match plan {
            Err(error) => self.finish(Err(error)),
            Ok((position, search, trial, steps)) => {
                self.reached = None;
                self.homed = false;
                self.before_home = None;
                self.image.plausible.allow_jumps(true);
                self.activity = Activity::Homing(Homing {
                    phase: Phase::Preparing,
                    position,
                    beside: self.beside_home(search, place.ends_forward()),
                    search,
                    trial,
                    since: now,
                    deadline: Time::NEVER,
                });
                self.commanded_mode = None;
                // Without a set-point bit: in homing mode it would be the start. Halt stays
                // until then: without it an interrupted move would go on.
                let held = self.control & Controlword::HALT;
                self.send_control(now, Controlword::ENABLE_COMMAND | held);
                self.repeat_at = Time::NEVER;
                self.node.run(now, steps);
                self.pump(now);
            }
        }
    }

    /// The coordinate at home in counts, and as the drive will show it.
    fn home_counts(&self, position: Q) -> Result<(i64, i32), DeviceError> {
        const WHAT: &str = "home position";
        let settings = &self.settings;
        let Some(turn) = settings.wraps_at() else {
            let counts = counts_i32(settings, HOME_OFFSET, WHAT, position)?;
            return Ok((i64::from(counts), counts));
        };
        let counts = position_counts(settings, HOME_OFFSET, WHAT, position)?;
        let shown = i32::try_from(counts.rem_euclid(turn)).expect("a turn fits 32 bits");
        Ok((counts, shown))
    }

    fn enter_homing(&mut self, now: Time, phase: Phase, patience: Option<Duration>) {
        if let Activity::Homing(homing) = &mut self.activity {
            homing.phase = phase;
            homing.since = now;
            homing.deadline = patience.map_or(Time::NEVER, |patience| now + patience);
        }
    }

    pub(super) fn homing_prepared(&mut self, now: Time) {
        let Activity::Homing(homing) = &self.activity else {
            return;
        };
        let mode = Some(self.settings.timeouts.mode);
        match homing.phase.clone() {
            Phase::Preparing => self.enter_homing(now, Phase::AwaitingHoming, mode),
            Phase::Restoring(result) => {
                self.commanded_mode = Some(OperationMode::ProfilePosition);
                self.enter_homing(now, Phase::AwaitingProfile(result), mode);
            }
            Phase::AwaitingHoming
            | Phase::Running { .. }
            | Phase::Slowing
            | Phase::AwaitingProfile(_)
            | Phase::AwaitingPosition => {}
        }
    }

    /// A transfer failed, or the drive did: back to profile position, then tell.
    pub(super) fn homing_failed(&mut self, now: Time, error: DeviceError) {
        let Activity::Homing(homing) = &self.activity else {
            return;
        };
        match &homing.phase {
            Phase::Restoring(_) | Phase::AwaitingProfile(_) | Phase::AwaitingPosition => {
                self.finish(Err(error));
            }
            Phase::Preparing | Phase::AwaitingHoming | Phase::Running { .. } | Phase::Slowing => {
                self.restore(now, Err(error));
            }
        }
    }

    /// The drive calls homing done, and shows another place.
    fn refuse_home(&mut self) {
        let (Activity::Homing(homing), Some(here)) = (&self.activity, self.image.here()) else {
            return;
        };
        let shown = |counts| self.settings.scale.to_coordinate(Counts(counts)).into();
        let error = DeviceError::NotAtHome {
            node: self.node.id(),
            shown: shown(here.position),
            home: shown(homing.position),
        };
        self.envelope.settle();
        self.finish(Err(error));
    }

    pub(super) fn restore(&mut self, now: Time, result: Result<(), DeviceError>) {
        if result.is_err()
            && let Some(here) = self.image.here()
        {
            self.envelope.begin_stop(here);
        }
        // In profile position a halted drive would go on to its target before.
        let held = match self.open_target {
            true => Controlword::HALT,
            false => Controlword::empty(),
        };
        self.send_control(now, Controlword::ENABLE_COMMAND | held);
        self.repeat_at = Time::NEVER;
        self.enter_homing(now, Phase::Restoring(result), None);
        let mode = OperationMode::ProfilePosition.raw();
        let step = Step::write(MODE, mode, "going back to profile position");
        self.node.run(now, vec![step]);
        self.pump(now);
    }

    pub(super) fn advance_homing(&mut self, now: Time) {
        let Some(sample) = self.image.sample().copied() else {
            return;
        };
        let Activity::Homing(homing) = &mut self.activity else {
            return;
        };
        match &mut homing.phase {
            Phase::Preparing | Phase::Restoring(_) => {}
            Phase::AwaitingHoming => {
                if sample.mode == OperationMode::Homing {
                    self.start_homing(now);
                }
            }
            Phase::Running { .. } => {
                self.follow_homing(now, sample.status);
                self.follow_trial(now, sample.status);
            }
            Phase::Slowing => {
                // A sample from before the halt says nothing yet.
                let fresh = now.since(homing.since) >= self.settings.common.sync_period * 2;
                if fresh && self.image.plausible.stands() {
                    let trial = homing.trial;
                    self.search_anew(now, trial);
                }
            }
            Phase::AwaitingProfile(result) => {
                if sample.mode == OperationMode::ProfilePosition {
                    match result.clone() {
                        Err(error) => self.finish(Err(error)),
                        Ok(()) => {
                            let patience = Some(self.settings.timeouts.new_position);
                            self.enter_homing(now, Phase::AwaitingPosition, patience);
                            self.advance_homing(now);
                        }
                    }
                }
            }
            Phase::AwaitingPosition => {
                let wanted = homing.position;
                if self.is_home(sample.position.0) {
                    self.image.count_from(wanted);
                    self.homed = true;
                    self.envelope.settle();
                    self.finish(Ok(()));
                }
            }
        }
    }

    /// The search is interrupted: without the start bit, and held by HALT.
    pub(super) fn interrupt_homing(&mut self, now: Time) {
        self.hold_back(now);
        self.repeat_at = Time::NEVER;
        let patience = Some(self.settings.timeouts.standing);
        self.enter_homing(now, Phase::Slowing, patience);
    }

    fn start_homing(&mut self, now: Time) {
        let Some(here) = self.image.here() else {
            return;
        };
        let was_far = !self.is_home(here.position);
        let reach = self.search_reach();
        let Activity::Homing(homing) = &mut self.activity else {
            return;
        };
        let still = Profile {
            speed: 0.0,
            acceleration: 1.0,
        };
        let mut profile = homing.search.unwrap_or(still);
        // Beyond the end of its way an axis slows down.
        let way = self
            .envelope
            .stopping_way(profile.speed, profile.acceleration) as i64;
        let reach = match homing.search {
            Some(_) => reach.saturating_add(way),
            None => self.settings.figures().lag,
        };
        if let Some(trial) = &mut homing.trial {
            trial.begin(here);
            profile = trial.profile();
        }
        self.envelope.begin_homing(here, reach, profile);
        let phase = Phase::Running {
            samples: 0,
            begun: false,
            was_far,
            done_since: None,
        };
        self.enter_homing(now, phase, Some(self.settings.timeouts.homing));
        self.send_control(now, Controlword::ENABLE_COMMAND | Controlword::MODE_4);
    }

    /// One statusword during the search.
    fn follow_homing(&mut self, now: Time, word: Statusword) {
        let status = HomingStatus::of(word);
        let (period, patience) = (self.settings.common.sync_period, self.settings.timeouts);
        let stands = self.image.plausible.stands();
        let is_home = self
            .image
            .here()
            .is_some_and(|here| self.is_home(here.position));
        let Activity::Homing(homing) = &mut self.activity else {
            return;
        };
        let Phase::Running {
            samples,
            begun,
            was_far,
            done_since,
        } = &mut homing.phase
        else {
            return;
        };
        *samples = samples.saturating_add(1);
        // Homed where it stands: nothing was searched, and the place says all.
        let is_here = homing.search.is_none();
        // Before that, the drive may not have had the start.
        let has_heard = now.since(homing.since) >= period * 2;
        *begun |=
            status == HomingStatus::InProgress || has_heard && !word.contains(Statusword::MODE_12);
        if *begun {
            self.repeat_at = Time::NEVER;
        }
        if status != HomingStatus::Done || !has_heard || !stands {
            *done_since = None;
        }
        match status {
            HomingStatus::Done if has_heard => {
                let since = *done_since.get_or_insert(now);
                // A drive may change its coordinates a little later, or with the mode.
                let is_over = *begun && stands && now.since(since) >= patience.new_position / 2;
                let is_new = *begun || *was_far && stands || is_here;
                if is_home && is_new || is_over {
                    self.restore(now, Ok(()));
                }
            }
            HomingStatus::ErrorMoving | HomingStatus::ErrorStopped
                if *begun || *samples > STALE_SAMPLES =>
            {
                let error = DeviceError::DriveRefused {
                    node: self.node.id(),
                    step: "homing",
                    state: word.state(),
                };
                self.restore(now, Err(error));
            }
            HomingStatus::NotStarted
            | HomingStatus::InProgress
            | HomingStatus::Attained
            | HomingStatus::Done
            | HomingStatus::ErrorMoving
            | HomingStatus::ErrorStopped
            | HomingStatus::Unknown(_) => {}
        }
    }

    /// How far a search may go from where it begins.
    fn search_reach(&self) -> i64 {
        let travel = self.settings.travel_counts();
        let margin = match self.settings.turn {
            Some(_) => TURN_MARGIN,
            None => TRAVEL_MARGIN,
        };
        let reach = (travel * margin).min((i64::MAX / 4) as f64);
        reach as i64 + self.settings.figures().lag
    }

    /// How far from home the axis may stand after a homing: it stops behind the place where its home
    /// was found.
    fn beside_home(&self, search: Option<Profile>, is_forward: bool) -> (i64, i64) {
        let tolerance = self.settings.tolerance_counts();
        let Some(Profile {
            speed,
            acceleration,
        }) = search
        else {
            return (tolerance, tolerance);
        };
        let samples = (self.settings.common.sync_period * 2).as_secs_f64();
        let way = speed * speed / (2.0 * acceleration.max(1.0)) + speed * samples;
        let lag = self.settings.figures().lag;
        let behind = way as i64 + lag;
        let counts_forward = is_forward == (self.settings.scale.resolution() > Q::ZERO);
        match counts_forward {
            true => (lag, behind),
            false => (behind, lag),
        }
    }

    /// Whether the place shown is the home coordinate, as far as the axis stands beside its home.
    fn is_home(&self, position: i64) -> bool {
        let Activity::Homing(homing) = &self.activity else {
            return false;
        };
        let modulo = self.settings.modulo();
        let away = apart(modulo, position, homing.position);
        (-homing.beside.0..=homing.beside.1).contains(&away)
    }

    pub(super) fn homing_timeout(&mut self, now: Time) {
        let Activity::Homing(homing) = &self.activity else {
            return;
        };
        if now < homing.deadline {
            return;
        }
        let since = homing.since;
        let mode = self
            .mode()
            .map_or(Seen::Nothing, |mode| Seen::Mode(mode.raw()));
        match homing.phase.clone() {
            Phase::Preparing | Phase::Restoring(_) => {}
            Phase::Slowing => {
                let error = DeviceError::Timeout {
                    device: self.node.name(),
                    awaited: "the axis to stand still after the trial of its speed",
                    waited: now.since(since),
                    seen: self.seen_status(),
                };
                self.restore(now, Err(error));
            }
            Phase::AwaitingHoming => {
                let error = DeviceError::Timeout {
                    device: self.node.name(),
                    awaited: "the homing mode",
                    waited: now.since(since),
                    seen: mode,
                };
                self.restore(now, Err(error));
            }
            Phase::Running { .. } => {
                let error = DeviceError::Timeout {
                    device: self.node.name(),
                    awaited: "the end of homing",
                    waited: now.since(since),
                    seen: self.seen_status(),
                };
                self.restore(now, Err(error));
            }
            // The homing's own failure is the better cause.
            Phase::AwaitingProfile(Err(error)) => self.finish(Err(error)),
            Phase::AwaitingProfile(Ok(())) => {
                self.time_out(now, since, "profile position after homing", mode);
            }
            Phase::AwaitingPosition => self.refuse_home(),
        }
    }
}
