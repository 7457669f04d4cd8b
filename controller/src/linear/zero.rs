//! Zero: find the drift-free origin with the two Hall sensors (system S5).
//!
//! Coarse: the drive homes on its negative limit switch (repeatable to tens of micrometres),
//! which says where the nominal zero is. Fine: the patent's search, then passes over both flanks in either
//! direction, with a regression of each. Last: the drive's coordinates are set so that the origin found is
//! zero (homing method 37).

use core::time::Duration;
use std::path::PathBuf;

use compensator::budget::PlacesBudget;
use compensator::hall_zero::{
    FlatLevel, Outcome, Pass, Progress, Sample, Search, Settings, ZeroEstimate, flat_level,
    single_threshold_zero,
};
use compensator::uncertainty::{combine, of_rounding};
use drivers::device::{AxisCommand, DriveCommand};
use units::{Metres, MetresPerSecond, Volts};

use crate::assemble;
use crate::config::MachineConfig;
use crate::correction::Correction;
use crate::failure::Failure;
use crate::homing;
use crate::linear::ZeroConfig;
use crate::linear::earlier_zero::newest_zero;
use crate::linear::passes::{SEARCHED, STEPS};
use crate::linear::stage::{LinearStage, gantry_of};
use crate::linear::zero_budget;
use crate::linear::{HallSweepEntry, ZeroEntry};
use crate::linear::{LinearEntry, LinearLog};
use crate::made_by::made_by;
use crate::run::utc_now;
use crate::run::{missing, note_failure, settle};
use crate::store::{InstrumentRecord, Journal, JournalHeader, SCHEMA_VERSION, Store};
use machine::{STOP_LIMIT, Stage};

/// A zero that was found.
#[derive(Clone, Debug)]
pub struct Zeroed {
    /// The regression's result, in the drive's coordinates before they were set; its standard uncertainty is
    /// that of the drive's zero, which lies on a whole count.
    pub estimate: ZeroEstimate,
    /// The patent's search.
    pub outcome: Outcome,
    /// Where it is recorded.
    pub journal: PathBuf,
    /// What was found now.
    pub entry: ZeroEntry,
    /// Where Vc lies on a flat part of the curves.
    pub flat: Option<FlatLevel>,
    /// The zero before it, from the newest complete journal of this axis: what the sensors
    /// have drifted since.
    pub previous: Option<ZeroEntry>,
}

/// Where an axis is when its zero begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Begins {
    /// Nobody knows: it is referred to its limit switch first.
    Anywhere,
    /// Enabled, at its nominal zero.
    AtNominal,
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

impl LinearStage<'_> {
    /// Finds the origin of the axis and makes it the drive's zero; the axis is enabled and
    /// stands at its origin afterwards.
    ///
    /// # Errors
    /// Whatever stops the machine; a search or a regression that fails, with step and
    /// values; an origin that is not certain enough. The axis is not zeroed then. A side of a gantry is refused
    /// ([`Self::zero_gantry`]): going to its limit switch alone would turn the stage.
    pub fn zero(&mut self, store: &Store) -> Result<Zeroed, Failure> {
        self.require_alone()?;
        self.zero_from(store, Begins::Anywhere)
    }

    /// Refuses a side of a gantry.
    pub(super) fn require_alone(&self) -> Result<(), Failure> {
        require_alone(self.core.config, self.axis)
    }

    /// The same of an axis that may be at its nominal zero already.
    pub(super) fn zero_from(&mut self, store: &Store, begins: Begins) -> Result<Zeroed, Failure> {
        let config = self.config.zero.clone();
        let config = config.ok_or_else(|| missing(self.axis, "zero"))?;
        self.core.set_zeroed(self.axis, false)?;
        let previous = newest_zero(&mut self.core, store, self.axis)?;
        let previous = previous.and_then(|mut log| log.zeros.pop());
        let mut journal = store.create_journal(&self.zero_header(self.axis))?;
        settle(&mut self.core, store)?;
        let found = self
            .find_zero(&config, &mut journal, begins)
            .map_err(|failure| homing::before_zero(&self.core, self.axis, failure));
        let (outcome, estimate, entry, flat) =
            found.inspect_err(|failure| note_failure(&mut journal, failure))?;
        journal.complete()?;
        settle(&mut self.core, store)?;
        self.memory.course.zero = Some(estimate.standard_uncertainty);
        Ok(Zeroed {
            estimate,
            outcome,
            journal: journal.path().to_owned(),
            entry,
            flat,
            previous,
        })
    }

    fn find_zero(
        &mut self,
        config: &ZeroConfig,
        journal: &mut Journal<LinearLog>,
        begins: Begins,
    ) -> Result<(Outcome, ZeroEstimate, ZeroEntry, Option<FlatLevel>), Failure> {
        self.core
            .observer()
            .progress(Stage::Zero, self.axis, 0, STEPS);
        match begins {
            Begins::Anywhere => self.go_to_nominal(config)?,
            Begins::AtNominal => {}
        }
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
        let (estimate, budget) = self.estimate(config, &settings, &outcome, &passes)?;
        let entry = self.zero_entry(&estimate, &budget);
        journal.write(&LinearEntry::HallSweep(HallSweepEntry::of(&outcome)))?;
        journal.write(&LinearEntry::Zero(entry.clone()))?;
        self.adopt_zero(config, estimate.origin)?;
        self.core
            .observer()
            .progress(Stage::Zero, self.axis, STEPS, STEPS);
        let flat = flat_level(&passes, &estimate, settings.vc);
        Ok((outcome, estimate, entry, flat))
    }

    /// On, to the limit switch, and to the nominal zero.
    pub(super) fn go_to_nominal(&mut self, config: &ZeroConfig) -> Result<(), Failure> {
        self.core.enable(self.axis)?;
        self.reference(config)?;
        self.core
            .observer()
            .progress(Stage::Zero, self.axis, 1, STEPS);
        self.travel(Metres::ZERO, Correction::Off)?;
        Ok(())
    }

    /// Coarse reference on the negative limit switch.
    pub(super) fn reference(&mut self, config: &ZeroConfig) -> Result<(), Failure> {
        let start = homing::place(&self.core, self.axis)?;
        let limit = self.config.reference_limit().unwrap_or_default();
        let command = to_limit_switch(config);
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
    ) -> Result<(ZeroEstimate, PlacesBudget<Metres>), Failure> {
        let refined = outcome.refine_by_passes(passes, settings);
        let mut estimate = refined.map_err(|source| Failure::Refine {
            axis: self.axis.to_owned(),
            source,
        })?;
        // The drive takes its zero in whole counts.
        let count = self.config.motion.resolution_nm.abs() * 1e-9;
        let age = self.age_of_voltages(config).as_secs_f64();
        let lag = Metres(self.pass_speed(config, settings, outcome).value() * age);
        let budget =
            zero_budget::budget(&estimate, count, lag).map_err(|source| Failure::Budget {
                axis: self.axis.to_owned(),
                source,
            })?;
        let of_passes = estimate.standard_uncertainty.value();
        estimate.standard_uncertainty = Metres(combine(&[
            of_passes,
            of_rounding(count),
            zero_budget::of_lag(lag),
        ]));
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
        Ok((estimate, budget))
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
    pub(super) fn rest(&mut self, span: Duration) -> Result<(), Failure> {
        for _ in 0..RESTS {
            self.core.stand_still(self.axis, span)?;
            if self.core.reading(self.axis)?.is_some_and(|it| it.at_rest) {
                break;
            }
        }
        Ok(())
    }

    fn zero_entry(&self, estimate: &ZeroEstimate, budget: &PlacesBudget<Metres>) -> ZeroEntry {
        ZeroEntry {
            origin_m: estimate.origin.value(),
            standard_uncertainty_m: estimate.standard_uncertainty.value(),
            patent_p0_m: estimate.p0_patent.unwrap_or(estimate.origin).value(),
            peak_max_v: estimate.peak_max.value(),
            mid_v: estimate.mid_voltage.value(),
            at_s: self.core.now().seconds(),
            budget: Some(zero_budget::record(budget, estimate.origin)),
        }
    }

    /// The header of the journal of a zero of `axis`.
    pub(super) fn zero_header(&self, axis: &str) -> JournalHeader {
        let here = self.core.this_machine(axis);
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
            program: Some(made_by()),
            calibration: None,
            targets_m: Vec::new(),
            runs: 0,
            approach_m: None,
        }
    }
}

/// Refuses a side of a gantry, which goes nowhere far by itself.
pub(crate) fn require_alone(config: &MachineConfig, axis: &str) -> Result<(), Failure> {
    let Some((name, _)) = gantry_of(config, axis) else {
        return Ok(());
    };
    Err(Failure::Usage {
        what: format!(
            "axis {axis} is a side of the gantry {name}, which it would turn on its way; nothing was moved"
        ),
        help: format!("zero both sides together: `truestage zero --axis {name}`"),
    })
}

/// The way to the negative limit switch, which becomes the nominal place that `config` gives it.
pub(super) fn to_limit_switch(config: &ZeroConfig) -> AxisCommand {
    AxisCommand::HomeNegativeLimit {
        position: Metres::from_mm(config.negative_limit_mm),
        speed: MetresPerSecond(config.reference_speed_mm_per_s * 1e-3),
    }
}
