//! Calibrate: lines by laser interferometer and by the machine's own detectors, cold and, for the
//! thermal errors, warm; one identification of all of them with its covariance.
//!
//! The references of the detectors are taken first: what the tables hold for is the machine as it
//! was then. While lines are read it goes on warming up. What the detectors see of that, and what
//! temperatures are known to do by the configuration, is taken off each reading where it is made
//! (`known`). With warm lines expansions and bends are found with the errors, by what the thermometers
//! showed at each line; without, expansions are those of the configuration and how guides bend stays
//! unknown: the result says so. Straightnesses are those that the detectors read along their
//! beams, where there are beams; a beam is straighter than what a straightedge tells.
//!
//! Every reading is written down when it is made. A run that was interrupted is continued at its
//! first line that is not whole, as long as its references still hold (`resume`), and warms up anew
//! when it has cooled down (`warmth`). What is evaluated
//! is what was written down: the journal alone gives the same errors again.
//!
//! A result that cannot be applied, whose readings scatter much more than was stated of them (`scatter`),
//! or of which some are grossly wrong (`gross`) is refused before it is stored, with what else than was
//! stated would explain all readings (`cause`). Lines that are named then
//! count as not read, so that a run that is continued reads them again.

mod budget;
mod cause;
mod evaluate;
mod gross;
mod known;
mod off;
mod own;
pub(crate) mod plan;
mod readings;
mod resume;
mod scatter;
mod warmth;

use core::time::Duration;
use std::path::{Path, PathBuf};

use compensator::volumetric::Axis;
use compensator::volumetric::function::Function;
use compensator::volumetric::identify::{Identified, StandardLine};
use compensator::volumetric::online::BeamReference;
use units::{Metres, Radians};

pub use evaluate::VolumetricEvaluated;
pub(crate) use plan::volume_plan;
pub(crate) use scatter::Scatter;

use crate::config::MachineConfig;
use crate::failure::Failure;
use crate::made_by::made_by;
use crate::run::{CalibrateOptions, note_failure, require_certified, settle, utc_now};
use crate::store::budget::PlacesBudgetRecord;
use crate::store::{
    CalibrationRecord, InstrumentRecord, Journal, JournalHeader, RecordHead, SCHEMA_VERSION, Store,
};
use crate::volumetric::chosen::use_geometry;
use crate::volumetric::entries::MINUTES_MAX;
use crate::volumetric::handle::WorkVolume;
use crate::volumetric::line::LineOperator;
use crate::volumetric::reference::{References, require_thermometers_certified};
use crate::volumetric::settings::{beam_drift, function_shape, point_of_mm};
use crate::volumetric::thermometers::Thermometry;
use crate::volumetric::{
    AgreementRecord, UnknownRecord, VolumeLog, VolumePlanEntry, VolumeReferencesEntry,
};
use crate::volumetric::{GEOMETRY, REFERENCES, VolumetricFailure};
use crate::volumetric::{LineVoidEntry, VolumeEntry};
use crate::volumetric::{VolumetricCalibrateConfig, VolumetricConfig};
use machine::Stage;
use machine::{ask_disk, read_ahead};

use crate::volumetric::reference::mean::Noise;
use known::Known;
pub(crate) use warmth::minutes_of;
use warmth::{Warmth, warm_up_of, warmth_left};

/// What it is called where progress is told.
const WHOLE: &str = "volume";

/// How the machine becomes warm between cold and warm lines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WarmUp {
    /// No warming up: the expansion of scales and structure is taken from the configuration, and
    /// how guides bend stays unknown.
    None,
    /// Something else warms it for so long, while the axes are switched off.
    Idle(Duration),
    /// All axes go to and fro for so long (ISO 230-3).
    Travel(Duration),
}

impl WarmUp {
    /// That all axes go to and fro for so long; `None` where that is no time to wait.
    pub fn of_minutes(minutes: f64) -> Option<Self> {
        let is_a_time = minutes > 0.0 && minutes < MINUTES_MAX;
        is_a_time.then(|| Self::Travel(Duration::from_secs_f64(minutes * 60.0)))
    }

    /// For how many minutes all axes go to and fro, where they do.
    const fn minutes(self) -> Option<f64> {
        match self {
            Self::Travel(span) => Some(span.as_secs_f64() / 60.0),
            Self::None | Self::Idle(_) => None,
        }
    }
}

/// A calibration of three axes that was made, stored and activated.
#[derive(Clone, Debug)]
pub struct VolumetricCalibrated {
    /// The name of the errors.
    pub id: String,
    /// The name of the references taken with them.
    pub references: String,
    /// How many lines were read, cold and warm.
    pub lines: usize,
    /// What was found.
    pub found: Identified,
    /// How well the readings agree, as it was stored.
    pub agreement: AgreementRecord,
    /// The largest standard uncertainty of the tool in the volume.
    pub u_max: Metres,
    /// What makes the tool uncertain, as it was stored.
    pub budget: Option<PlacesBudgetRecord>,
    /// What stays unknown: by how much those guides bend that bend according to the configuration,
    /// because no warm lines were read; errors that no line sees.
    pub unknown: UnknownRecord,
    /// Where every reading is.
    pub journal: PathBuf,
    /// Whether they are used from now on.
    pub is_in_use: bool,
}

impl VolumetricCalibrated {
    /// What the store calls each calibration, and its name.
    pub(crate) fn stored(&self) -> Vec<(String, String)> {
        vec![
            (GEOMETRY.into(), self.id.clone()),
            (REFERENCES.into(), self.references.clone()),
        ]
    }
}

/// What is known of the machine when its lines are read.
struct Session<'a> {
    config: VolumetricConfig,
    own: VolumetricCalibrateConfig,
    references: References,
    beams: [Option<BeamReference>; 3],
    rolls: [Option<Function<Radians>>; 3],
    known: Known,
    /// How single samples of the detector at the end of each beam scatter.
    end_noise: [Noise; 3],
    thermometry: Thermometry,
    operator: &'a mut dyn LineOperator,
    /// Of a run that goes on: what is left of the warmth of the lines that were read warm.
    warmth: Option<Warmth>,
    /// All lines, as in the plan.
    lines: Vec<StandardLine>,
    /// What was read up to now.
    read: VolumeLog,
}

impl WorkVolume<'_> {
    /// Takes references, reads all lines that tell this machine's errors, then (unless it is not
    /// wanted) lets it become warm and reads those again that tell what warmth does; finds the
    /// errors, stores and activates them with their references. With `resume` the lines that are
    /// whole in that journal are not read again, and its references stay what everything counts
    /// from. Where nothing is said of `warm_up` then, the axes go to and fro as that journal says, unless
    /// the machine is still warm.
    ///
    /// # Errors
    /// When an axis is not zeroed, a line cannot be set up or read, the readings do not tell all
    /// errors or scatter too much, the result cannot be applied, or anything stops the machine; when the journal is one
    /// of another run, or its references hold no more. What was in use before stays in use then.
    pub fn calibrate(
        &mut self,
        store: &Store,
        warm_up: WarmUp,
        resume: Option<&Path>,
        operator: &mut dyn LineOperator,
    ) -> Result<VolumetricCalibrated, Failure> {
        let options = CalibrateOptions {
            resume: resume.map(Path::to_owned),
            ..CalibrateOptions::default()
        };
        self.calibrate_by(store, warm_up, &options, operator)
    }

    /// The same; with `options.aside` what is found is stored only, and what was used before is used still.
    ///
    /// # Errors
    /// As [`Self::calibrate`].
    pub fn calibrate_by(
        &mut self,
        store: &Store,
        warm_up: WarmUp,
        options: &CalibrateOptions,
        operator: &mut dyn LineOperator,
    ) -> Result<VolumetricCalibrated, Failure> {
        let resume = options.resume.as_deref();
        let warm_up = match (warm_up, resume) {
            (WarmUp::None, Some(journal)) => warm_up_of(&mut self.core, store, journal)?,
            (given, _) => given,
        };
        let config = self.config.clone();
        let drives = self.volume_drives(&config);
        let (plan, lines) = volume_plan(&config, warm_up != WarmUp::None, drives)?;
        let plan = VolumePlanEntry {
            warm_up_min: warm_up.minutes(),
            ..plan
        };
        let header = self.header("calibrate", None)?;
        if let Some(journal) = resume {
            read_ahead(&mut self.core, store, journal.to_owned())?;
        }
        let (mut journal, read) =
            resume::open(store, &header, plan, resume, self.core.config_hash)?;
        settle(&mut self.core, store)?;
        let made = self
            .calibration_session(config, lines, read, &mut journal, operator)
            .and_then(|mut session| {
                self.read_lines(&mut session, warm_up, &mut journal)?;
                self.conclude(store, session, &mut journal, !options.aside)
            });
        let made = made.inspect_err(|it| note_failure(&mut journal, it))?;
        journal.complete()?;
        settle(&mut self.core, store)?;
        Ok(made)
    }

    /// The first line of a journal of three axes.
    pub(super) fn header(
        &self,
        verb: &str,
        calibration: Option<String>,
    ) -> Result<JournalHeader, Failure> {
        let section = "calibrate";
        let own = self.config.calibrate.as_ref();
        let own = own.ok_or(VolumetricFailure::NotConfigured { section })?;
        let instrument = &own.instrument;
        if !self.core.config.instrument.contains_key(instrument) {
            let instrument = instrument.clone();
            return Err(VolumetricFailure::NoInstrument { instrument }.into());
        }
        require_all_certified(self.core.config, instrument)?;
        let head = self.this_volume(GEOMETRY)?;
        Ok(JournalHeader {
            schema_version: SCHEMA_VERSION,
            verb: verb.to_owned(),
            machine: head.machine,
            stage_serial: head.stage_serial,
            config_hash: head.config_hash,
            axis: head.axis,
            drive: head.drive,
            // It is brought along: who it is shows when it is switched on.
            instrument: InstrumentRecord {
                identity: String::new(),
                ..self.lines_instrument(instrument)
            },
            started: utc_now(),
            program: Some(made_by()),
            calibration,
            targets_m: Vec::new(),
            runs: 1,
            approach_m: None,
        })
    }

    /// What the records say of the instrument that reads lines, with the certificates of the thermometers.
    fn lines_instrument(&self, name: &str) -> InstrumentRecord {
        let off = self.core.config.instrument[name].switched_off_of_lines();
        let mut record = self.core.instrument_record(name);
        record.switched_off = off.iter().map(|it| it.name.to_owned()).collect();
        record
            .certificates
            .extend(self.config.certificate_records());
        record
    }

    fn read_lines(
        &mut self,
        session: &mut Session<'_>,
        warm_up: WarmUp,
        journal: &mut Journal<VolumeLog>,
    ) -> Result<(), Failure> {
        let total = session.lines.len();
        let mut is_warm = session.warmth == Some(Warmth::Left);
        session.tell_warmth(warm_up);
        for at in 0..total {
            self.core
                .observer()
                .progress(Stage::Calibrate, WHOLE, at as u64, total as u64);
            if session.read.is_whole(at) {
                continue;
            }
            if session.is_warm_line(at) && !is_warm {
                self.end_lines(session.operator)?;
                self.become_warm(warm_up)?;
                is_warm = true;
            }
            self.run_line(session, at, journal)?;
        }
        self.end_lines(session.operator)?;
        self.core
            .observer()
            .progress(Stage::Calibrate, WHOLE, total as u64, total as u64);
        Ok(())
    }

    /// Takes the references, or those of the journal if they still hold.
    fn calibration_session<'a>(
        &mut self,
        config: VolumetricConfig,
        lines: Vec<StandardLine>,
        mut read: VolumeLog,
        journal: &mut Journal<VolumeLog>,
        operator: &'a mut dyn LineOperator,
    ) -> Result<Session<'a>, Failure> {
        let section = "calibrate";
        let own = config.calibrate.clone();
        let own = own.ok_or(VolumetricFailure::NotConfigured { section })?;
        let taken = self.take_references()?;
        let mut warmth = None;
        let entry = match read.references.take() {
            Some(kept) => {
                self.still_holds(&config, &own, &read, &kept, &taken)?;
                let left = warmth_left(&read, &kept.temperatures_c, &taken.temperatures);
                warmth = Some(left);
                kept
            }
            None => {
                let entry = VolumeReferencesEntry {
                    content: taken.content,
                    temperatures_c: taken.temperatures.iter().map(|it| it.value()).collect(),
                    at_s: self.core.now().seconds(),
                };
                journal.write(&VolumeEntry::VolumeReferences(entry.clone()))?;
                journal.flush_to_disk()?;
                entry
            }
        };
        let references = References::from(&entry);
        read.references = Some(entry);
        let is_warm = read
            .plan
            .iter()
            .any(|plan| plan.lines.iter().any(|it| it.warm));
        let known = Known::new(&config, &references.temperatures, is_warm)?;
        let thermometry = Thermometry::new(self.core.config, &config.temperature);
        let mut beams = [None, None, None];
        for (axis, beam) in Axis::ALL.into_iter().zip(config.beam.each()) {
            if let Some(drift) = beam.and_then(beam_drift) {
                beams[axis.index()] = references.content.beam("just taken", axis, drift)?;
            }
        }
        let rolls = references.content.rolls("just taken", &config)?;
        Ok(Session {
            config,
            own,
            references,
            beams,
            rolls,
            known,
            end_noise: Default::default(),
            thermometry,
            operator,
            warmth,
            lines,
            read,
        })
    }

    fn become_warm(&mut self, how: WarmUp) -> Result<(), Failure> {
        let config = self.config.clone();
        let corners = [point_of_mm(config.low_mm), point_of_mm(config.high_mm)];
        match how {
            WarmUp::None => {}
            WarmUp::Idle(span) => self.core.idle(span)?,
            WarmUp::Travel(span) => {
                let until = self.core.now() + span;
                while self.core.now() < until {
                    for corner in corners {
                        self.go_straight(corner)?;
                    }
                }
            }
        }
        for axis in &config.axes {
            self.core.enable(axis)?;
        }
        Ok(())
    }

    fn conclude(
        &mut self,
        store: &Store,
        session: Session<'_>,
        journal: &mut Journal<VolumeLog>,
        is_used: bool,
    ) -> Result<VolumetricCalibrated, Failure> {
        let shape = function_shape(session.config.compensation.interpolation);
        let evaluated = VolumetricEvaluated::of(&session.read, shape)?;
        if let Some(scatter) = &evaluated.scatter {
            void_lines(&scatter.void(), journal)?;
        }
        // What cannot be applied must not be stored as what is in use.
        evaluated.check(self.core.config, Some(&session.references.content))?;
        let source = journal.path().file_name().unwrap_or_default();
        let source = source.to_string_lossy().into_owned();
        let head = RecordHead {
            created: utc_now(),
            source: source.clone(),
            instrument: self.lines_instrument(&session.own.instrument),
            ..self.this_volume(GEOMETRY)?
        };
        let content = evaluated.content(&session.config);
        let (unknown, budget) = (content.unknown.clone(), content.budget.clone());
        settle(&mut self.core, store)?;
        let id = store.save(&CalibrationRecord { head, content })?;
        let references = self.keep_references(store, &id, session.references, &source)?;
        if is_used {
            // With its references, and without memories that count from others.
            let own = id.clone();
            ask_disk(&mut self.core, store, move |store| {
                use_geometry(store, &own)
            })??;
        } else {
            settle(&mut self.core, store)?;
        }
        Ok(VolumetricCalibrated {
            id,
            references: references.id,
            agreement: evaluated.agreement(),
            lines: evaluated.lines,
            found: evaluated.found,
            u_max: evaluated.u_max,
            budget,
            unknown,
            journal: journal.path().to_owned(),
            is_in_use: is_used,
        })
    }
}

/// Has these lines read again when the run is continued.
/// Whether what reads lines, and the thermometers beside it, have certificates that hold today.
///
/// # Errors
/// Of the first that does not.
pub(crate) fn require_all_certified(
    config: &MachineConfig,
    instrument: &str,
) -> Result<(), Failure> {
    require_certified(config, &format!("instrument.{instrument}."))?;
    require_thermometers_certified(config)
}

fn void_lines(lines: &[usize], journal: &mut Journal<VolumeLog>) -> Result<(), Failure> {
    for line in lines.iter().copied() {
        journal.write(&VolumeEntry::LineVoid(LineVoidEntry { line }))?;
    }
    Ok(journal.flush_to_disk()?)
}

impl Session<'_> {
    /// Whether it warms up again, where a line is left that is read warm.
    fn tell_warmth(&mut self, how: WarmUp) {
        let is_left = |at| self.is_warm_line(at) && !self.read.is_whole(at);
        if let Some(warmth) = self.warmth
            && (0..self.lines.len()).any(is_left)
        {
            self.operator.tell(&warmth.text(how));
        }
    }

    fn is_warm_line(&self, at: usize) -> bool {
        let plan = self.read.plan.as_ref();
        plan.is_some_and(|it| it.lines[at].warm)
    }
}
