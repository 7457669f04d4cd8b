//! Zero: find the drift-free origin with the two Hall sensors (system S5).
//!
//! Coarse: the drive homes on its negative limit switch (repeatable to tens of micrometres),
//! which says where the nominal zero is. Fine: the patent's search, then passes over both flanks in either
//! direction, with a regression of each. Last: the drive's coordinates are set so that the origin found is
//! zero (homing method 37).

use core::time::Duration;
use std::path::PathBuf;

use compensator::hall_zero::{
    HallPoint, Outcome, Pass, Progress, Sample, Search, Settings, ZeroEstimate,
    single_threshold_zero,
};
use drivers::device::{AxisCommand, DriveCommand};
use units::{Approach, Metres, MetresPerSecond, Time, Volts};

use crate::assemble;
use crate::correction::Correction;
use crate::failure::Failure;
use crate::homing;
use crate::linear::ZeroConfig;
use crate::linear::ZeroEntry;
use crate::linear::stage::LinearStage;
use crate::linear::{LinearEntry, LinearLog};
use crate::run::utc_now;
use crate::run::{missing, note_failure};
use crate::store::{InstrumentRecord, Journal, JournalHeader, SCHEMA_VERSION, Store, read_journal};
use machine::{STOP_LIMIT, Stage};

/// A zero that was found.
#[derive(Clone, Debug)]
pub struct Zeroed {
    /// The regression's result, in the drive's coordinates before they were set.
    pub estimate: ZeroEstimate,
    /// The patent's search.
    pub outcome: Outcome,
    /// Where it is recorded.
    pub journal: PathBuf,
    /// What was found now.
    pub entry: ZeroEntry,
    /// The zero before it, from the newest complete journal of this axis: what the sensors
    /// have drifted since.
    pub previous: Option<ZeroEntry>,
}

impl Zeroed {
    /// Where the zero of the art before the patent would be: at a fixed voltage of the slope
    /// sensor. In the coordinates of [`ZeroEstimate::origin`]; `None` when the search did not
    /// pass that voltage. For comparison only.
    pub fn single_threshold(&self, threshold: Volts) -> Option<Metres> {
        let points: Vec<_> = self.outcome.samples.iter().map(Sample::point).collect();
        single_threshold_zero(&points, threshold, Metres::from_um(100.0))
    }
}

/// How long the axis stands before its drive's coordinates are set.
const REST: Duration = Duration::from_millis(30);
/// And in how many samples that must show at least: a drive takes no coordinates before three lie together.
const RESTING_SAMPLES: u32 = 4;
/// A stage that is not at rest after so many times that is shaken: its passes tell how much, and a drive that
/// takes no coordinates then says so.
const RESTS: u32 = 10;
/// How often both flanks are passed, half of them in reverse; two in each direction would do.
const PASSES: u32 = 6;
/// How long the axis stands before each pass. A pass that begins while the axis still creeps into its place
/// shows the error of the stop before it once more, and nothing of what the axis repeats to: a servo of 5 Hz,
/// the softest that is foreseen, is within a thousandth of its last motion after this time.
const BETWEEN_PASSES: Duration = Duration::from_millis(250);
/// A pass begins and ends this share of the distance of G1 and G2 beyond them.
const PASS_MARGIN: f64 = 0.1;
/// The steps of zeroing that progress counts: up to the search, its passes, and the new origin.
const SEARCHED: u64 = 3;
const STEPS: u64 = SEARCHED + PASSES as u64 + 1;

impl LinearStage<'_> {
    /// Finds the origin of the axis and makes it the drive's zero; the axis is enabled and
    /// stands at its origin afterwards.
    ///
    /// # Errors
    /// Whatever stops the machine; a search or a regression that fails, with step and
    /// values; an origin that is not certain enough. The axis is not zeroed then.
    pub fn zero(&mut self, store: &Store) -> Result<Zeroed, Failure> {
        let config = self.config.zero.clone();
        let config = config.ok_or_else(|| missing(self.axis, "zero"))?;
        self.core.set_zeroed(self.axis, false)?;
        let previous = previous_zero(store, self.axis);
        let mut journal = Journal::create(&store.runs(), &self.zero_header())?;
        let found = self
            .find_zero(&config, &mut journal)
            .map_err(|failure| homing::before_zero(&self.core, self.axis, failure));
        let (outcome, estimate, entry) =
            found.inspect_err(|failure| note_failure(&mut journal, failure))?;
        journal.complete()?;
        self.memory.course.zero = Some(estimate.standard_uncertainty);
        Ok(Zeroed {
            estimate,
            outcome,
            journal: journal.path().to_owned(),
            entry,
            previous,
        })
    }

    fn find_zero(
        &mut self,
        config: &ZeroConfig,
        journal: &mut Journal<LinearLog>,
    ) -> Result<(Outcome, ZeroEstimate, ZeroEntry), Failure> {
        self.core
            .observer()
            .progress(Stage::Zero, self.axis, 0, STEPS);
        self.core.enable(self.axis)?;
        self.reference(config)?;
        self.core
            .observer()
            .progress(Stage::Zero, self.axis, 1, STEPS);
        self.travel(Metres::ZERO, Correction::Off)?;
        self.core
            .observer()
            .progress(Stage::Zero, self.axis, 2, STEPS);
        let usual = assemble::hall_settings(config, &self.config.motion);
        let settings = assemble::patient_search(usual, self.core.patience());
        let outcome = self.search(config, settings)?;
        self.core
            .observer()
            .progress(Stage::Zero, self.axis, SEARCHED, STEPS);
        let passes = self.passes(config, &settings, &outcome)?;
        let estimate = self.estimate(config, &settings, &outcome, &passes)?;
        let entry = self.zero_entry(&estimate);
        journal.write(&LinearEntry::Zero(entry))?;
        self.adopt_zero(config, estimate.origin)?;
        self.core
            .observer()
            .progress(Stage::Zero, self.axis, STEPS, STEPS);
        Ok((outcome, estimate, entry))
    }

    /// Coarse reference on the negative limit switch.
    pub(super) fn reference(&mut self, config: &ZeroConfig) -> Result<(), Failure> {
        let start = homing::place(&self.core, self.axis)?;
        let speed = MetresPerSecond(config.reference_speed_mm_per_s * 1e-3);
        let limit = self.config.reference_limit().unwrap_or_default();
        let position = Metres::from_mm(config.negative_limit_mm);
        let command = AxisCommand::HomeNegativeLimit { position, speed };
        let done = self.core.command(self.axis, command, "reference", limit);
        done.map_err(|failure| homing::explained(&self.core, self.axis, start, failure.into()))?;
        Ok(self.core.forget_approach(self.axis)?)
    }

    /// Runs the patent's search, one step a sample.
    fn search(&mut self, config: &ZeroConfig, settings: Settings) -> Result<Outcome, Failure> {
        let failed = |source| Failure::SearchSettings {
            axis: self.axis.to_owned(),
            source,
        };
        let mut search = Search::new(settings, Metres::ZERO, self.core.now()).map_err(failed)?;
        let mut pairing = self.pairing(config);
        let mut motion = None;
        loop {
            let deadline = search
                .poll_timeout()
                .min(self.core.now() + Duration::from_millis(100));
            self.core.tick(deadline)?;
            self.check_motion()?;
            let progress = match self.paired_sample(config, &mut pairing)? {
                Some(sample) => Some(search.handle_sample(&sample)),
                None => search.handle_timeout(self.core.now()),
            };
            match progress {
                None => {}
                Some(Progress::Found(outcome)) => return Ok(*outcome),
                Some(Progress::Failed(source)) => {
                    self.core
                        .command(self.axis, DriveCommand::Halt, "halt", STOP_LIMIT)?;
                    return Err(self.explained_search(config, &settings, source));
                }
                Some(step) => self.obey(&step, &mut motion)?,
            }
        }
    }

    /// Passes over both flanks, forward and in reverse by turns: what lost motion and repeatability do to
    /// an origin shows between them.
    fn passes(
        &mut self,
        config: &ZeroConfig,
        settings: &Settings,
        outcome: &Outcome,
    ) -> Result<Vec<Pass>, Failure> {
        let (low, high) = pass_ends(settings, outcome);
        let speed = self.pass_speed(config, settings, outcome);
        self.pass(config, low, speed)?;
        (0..PASSES)
            .map(|number| {
                self.rest(BETWEEN_PASSES)?;
                let (approach, end) = match number % 2 {
                    0 => (Approach::Forward, high),
                    _ => (Approach::Reverse, low),
                };
                let points = self.pass(config, end, speed)?;
                let done = SEARCHED + u64::from(number) + 1;
                let observer = self.core.observer();
                observer.progress(Stage::Zero, self.axis, done, STEPS);
                Ok(Pass { approach, points })
            })
            .collect()
    }

    /// Voltages that are sampled with the position are as good at four times the speed, as a delay drops out of
    /// the mean of both directions; those that are asked for are not, as nobody knows the delay of each. Either
    /// is slow enough for the samples that the flanks need.
    fn pass_speed(
        &self,
        config: &ZeroConfig,
        settings: &Settings,
        outcome: &Outcome,
    ) -> MetresPerSecond {
        let module = &self.core.config.analog[&config.analog];
        let wanted = if module.poll_period() == Duration::ZERO {
            settings.speed * 4.0
        } else {
            settings.speed
        };
        let fastest = outcome.fastest_pass(settings, self.sampling(config));
        wanted.min(fastest)
    }

    /// How often a position and voltages that belong to it are read.
    pub(super) fn sampling(&self, config: &ZeroConfig) -> Duration {
        let node = self.config.node();
        let bus = &node.expect("the check asks for a drive on CAN").bus;
        let sync_s = self.core.config.can[bus].sync_period_ms * 1e-3;
        let module = &self.core.config.analog[&config.analog];
        let poll_s = module.poll_period().as_secs_f64();
        Duration::from_secs_f64(sync_s.max(poll_s))
    }

    /// Goes to `end`; what was read on the way.
    pub(super) fn pass(
        &mut self,
        config: &ZeroConfig,
        end: Metres,
        speed: MetresPerSecond,
    ) -> Result<Vec<HallPoint>, Failure> {
        let acceleration = self.core.axis_settings(self.axis)?.acceleration;
        let command = AxisCommand::MoveTo {
            target: end,
            speed,
            acceleration,
        };
        let mut pairing = self.pairing(config);
        let mut points = Vec::new();
        self.core.begin(self.axis, command)?;
        loop {
            let deadline = self.core.now() + Duration::from_millis(100);
            self.core.tick(deadline)?;
            let arrived = self.core.outcome(self.axis)?;
            let sample = self.paired_sample(config, &mut pairing)?;
            points.extend(sample.map(|it| it.point()));
            if let Some(outcome) = arrived {
                outcome?;
                return Ok(points);
            }
        }
    }

    /// Turns the search's wish into a profile move or a halt, when it differs from the last.
    fn obey(
        &mut self,
        progress: &Progress,
        motion: &mut Option<AxisCommand>,
    ) -> Result<(), Failure> {
        let command = match *progress {
            Progress::Move { to, speed } => {
                let acceleration = self.core.axis_settings(self.axis)?.acceleration;
                AxisCommand::MoveTo {
                    target: to,
                    speed,
                    acceleration,
                }
            }
            _ => DriveCommand::Halt.into(),
        };
        if *motion != Some(command) {
            self.core.begin(self.axis, command)?;
            *motion = Some(command);
        }
        Ok(())
    }

    /// A move of the search that failed ends the search.
    fn check_motion(&mut self) -> Result<(), Failure> {
        Ok(self.core.outcome(self.axis)?.unwrap_or(Ok(()))?)
    }

    fn estimate(
        &self,
        config: &ZeroConfig,
        settings: &Settings,
        outcome: &Outcome,
        passes: &[Pass],
    ) -> Result<ZeroEstimate, Failure> {
        let refined = outcome.refine_by_passes(passes, settings);
        let estimate = refined.map_err(|source| Failure::Refine {
            axis: self.axis.to_owned(),
            source,
        })?;
        let limit = Metres::from_um(config.standard_uncertainty_limit_um);
        if estimate.standard_uncertainty > limit {
            let seen = estimate.standard_uncertainty;
            return Err(Failure::ZeroUncertain {
                axis: self.axis.to_owned(),
                seen,
                limit,
                scatter: estimate.passes.map_or(seen, |it| it.scatter),
            });
        }
        Ok(estimate)
    }

    /// Goes to the origin and makes it the drive's zero.
    fn adopt_zero(&mut self, config: &ZeroConfig, origin: Metres) -> Result<(), Failure> {
        self.travel(origin, Correction::Off)?;
        let rest = REST.max(self.sampling(config) * RESTING_SAMPLES);
        self.rest(rest)?;
        let reading = self
            .core
            .reading(self.axis)?
            .expect("an axis that moved has been read");
        let position = reading.position - origin;
        self.core.command(
            self.axis,
            AxisCommand::HomeHere { position },
            "set origin",
            Duration::from_secs(5),
        )?;
        self.core.set_zeroed(self.axis, true)?;
        Ok(self.core.forget_approach(self.axis)?)
    }

    /// Stands for `span`, and longer while its samples still move: some drives say that the target is reached
    /// as soon as it is near.
    fn rest(&mut self, span: Duration) -> Result<(), Failure> {
        for _ in 0..RESTS {
            self.core.stand_still(self.axis, span)?;
            if self.core.reading(self.axis)?.is_some_and(|it| it.at_rest) {
                break;
            }
        }
        Ok(())
    }

    fn zero_entry(&self, estimate: &ZeroEstimate) -> ZeroEntry {
        ZeroEntry {
            origin_m: estimate.origin.value(),
            standard_uncertainty_m: estimate.standard_uncertainty.value(),
            patent_p0_m: estimate.p0_patent.unwrap_or(estimate.origin).value(),
            peak_max_v: estimate.peak_max.value(),
            mid_v: estimate.mid_voltage.value(),
            at_s: self.core.now().seconds(),
        }
    }

    fn zero_header(&self) -> JournalHeader {
        let here = self.core.this_machine(self.axis);
        JournalHeader {
            schema_version: SCHEMA_VERSION,
            verb: "zero".into(),
            machine: here.machine,
            stage_serial: here.stage_serial,
            config_hash: here.config_hash,
            axis: here.axis,
            drive: here.drive,
            instrument: InstrumentRecord::default(),
            started: utc_now(),
            calibration: None,
            targets_m: Vec::new(),
            runs: 0,
            approach_m: None,
        }
    }

    fn pairing(&self, config: &ZeroConfig) -> Pairing {
        Pairing {
            window: self.sampling(config).mul_f64(0.6),
            used_axis: Time::ZERO,
            used_analog: Time::ZERO,
        }
    }

    /// The newest position and voltages that belong together and were not used before.
    ///
    /// On CAN both are sampled at one SYNC and arrive together; members of different SYNC
    /// periods lie further apart than the window and are never paired.
    fn paired_sample(
        &self,
        config: &ZeroConfig,
        pairing: &mut Pairing,
    ) -> Result<Option<Sample>, Failure> {
        let analog = self.core.devices().analog(&config.analog)?;
        let (Some(position), Some(voltages)) = (self.core.reading(self.axis)?, analog.reading())
        else {
            return Ok(None);
        };
        if position.at <= pairing.used_axis || voltages.at <= pairing.used_analog {
            return Ok(None);
        }
        let apart = position
            .at
            .since(voltages.at)
            .max(voltages.at.since(position.at));
        if apart > pairing.window {
            return Ok(None);
        }
        pairing.used_axis = position.at;
        pairing.used_analog = voltages.at;
        Ok(Some(Sample {
            at: position.at.max(voltages.at),
            position: position.position,
            peak: voltages.volts[0],
            slope: voltages.volts[1],
            standing: position.standing,
        }))
    }
}

/// Where passes begin and end: beyond both flanks, within the bounds of the search.
fn pass_ends(settings: &Settings, outcome: &Outcome) -> (Metres, Metres) {
    let margin = (outcome.g2.position - outcome.g1.position) * PASS_MARGIN;
    let low = settings.soft_min.max(Metres::ZERO - settings.search_limit);
    let high = settings.soft_max.min(settings.search_limit);
    (
        low.max(outcome.g1.position - margin),
        high.min(outcome.g2.position + margin),
    )
}

/// The newest zero on record. A trend is worth having but never worth failing for: a journal
/// that cannot be read is no reason not to zero.
fn previous_zero(store: &Store, axis: &str) -> Option<ZeroEntry> {
    let path = store.newest_run("zero", axis).ok().flatten()?;
    read_journal::<LinearLog>(&path).ok()?.log.zeros.pop()
}

/// Which samples were used already.
struct Pairing {
    window: Duration,
    used_axis: Time,
    used_analog: Time,
}
