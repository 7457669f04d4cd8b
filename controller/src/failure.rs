//! Why the machine stopped or refused: each says where, what was expected, what was seen.

pub(crate) mod advice;
mod exit_code;
pub(crate) mod of_kind;

use std::path::PathBuf;

use compensator::budget::BudgetError;
use compensator::data::DataError;
use compensator::error_table::{CompensationError, FitError};
use compensator::hall_zero::{PlanError, RefineError, SearchFailure};
use machine::{EngineFailure, Layered};
use units::{Metres, Radians};

use crate::config::{ConfigError, Count};
#[cfg(feature = "emulator")]
use crate::emulated::EmulatedError;
use crate::linear::{NewIsWorse, PatternFinding, SamplesLost};
use crate::store::StoreError;

use of_kind::{KindFailure, OfKind};

/// Everything that ends a verb without its result.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// The machine refused, or stopped.
    #[error(transparent)]
    Machine(#[from] machine::Failure),
    /// The configuration cannot be used.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// A machine of one kind did not do what it was asked ([`Failure::of_kind`]).
    #[error(transparent)]
    Kind(OfKind),
    /// A port cannot be opened.
    #[error(transparent)]
    Open(#[from] drivers::transport::live::OpenError),
    /// The verb needs something the configuration does not have.
    #[error("axis {axis}: the configuration has no section `{section}` for it")]
    NotConfigured {
        /// Which axis.
        axis: String,
        /// The missing section.
        section: &'static str,
    },
    /// The Hall search failed.
    #[error("axis {axis}: {source}")]
    Search {
        /// Which axis.
        axis: String,
        /// Step and values.
        source: Box<SearchFailure>,
    },
    /// The search failed, as the magnets are elsewhere.
    #[error("axis {axis}: {finding}. {source}")]
    PatternElsewhere {
        /// Which axis.
        axis: String,
        /// Where they are, and what that says of the axis.
        finding: Box<PatternFinding>,
        /// Step and values.
        source: Box<SearchFailure>,
    },
    /// The axis moved farther than its travel and met no limit switch.
    #[error(
        "axis {axis}: moved {:.3} mm by its encoder and met no limit switch, its soft limits are {:.3} mm \
         apart: resolution is probably below `resolution_nm = {:.3}` in [axis.{axis}] (it is {}), or the switch \
         is not connected. {source}",
        moved.mm(), travel.mm(), resolution_nm * (*travel / *moved), units::Short(*resolution_nm)
    )]
    NoLimitSwitch {
        /// Which axis.
        axis: String,
        /// By its encoder.
        moved: Metres,
        /// From one soft limit to the other.
        travel: Metres,
        /// One count as configured, nanometres.
        resolution_nm: f64,
        /// How long it looked.
        source: Box<Failure>,
    },
    /// The axis could not follow before it had found its zero.
    #[error("axis {axis}: {}. {source}", advice::of_start(axis, *resolution_nm, *searched))]
    BeforeZero {
        /// Which axis.
        axis: String,
        /// One count as configured, nanometres.
        resolution_nm: f64,
        /// How far it had looked for its limit switch, where that is far.
        searched: Option<Metres>,
        /// What its drive said.
        source: Box<Failure>,
    },
    /// The settings of the Hall search cannot work.
    #[error("axis {axis}: {source}")]
    SearchSettings {
        /// Which axis.
        axis: String,
        /// Which setting.
        source: compensator::hall_zero::SettingsError,
    },
    /// A target outside the calibrated range.
    #[error("axis {axis}: {source}; nothing was moved")]
    OutOfCalibration {
        /// Which axis.
        axis: String,
        /// Where, and what is calibrated.
        source: compensator::error_table::OutOfRange,
    },
    /// Nothing would correct the move, and nobody has agreed to that.
    #[error(
        "{what}: it would go to its target by its encoders alone, off by the deviation of the stage there; nothing \
         was moved. Run `truestage calibrate`, put a calibration into use (`truestage cal activate`), or agree to it: \
         --uncompensated (in a request \"uncompensated\": true)"
    )]
    NotCalibrated {
        /// Which axes, and what they lack.
        what: String,
    },
    /// The target is beyond the calibrated range, and nobody has agreed to that.
    #[error(
        "axis {axis}: {} mm is beyond the calibrated range of {} to {} mm, where the deviation of the stage was never \
         measured; nothing was moved. Calibrate a wider range, or agree to it: --beyond (in a request \"beyond\": true)",
        units::Short(target.mm()), units::Short(first.mm()), units::Short(last.mm())
    )]
    BeyondCalibrated {
        /// Which axis.
        axis: String,
        /// Where it was told to go.
        target: Metres,
        /// First calibrated position.
        first: Metres,
        /// Last calibrated position.
        last: Metres,
    },
    /// An input that a job waits for did not show what was wanted.
    #[error(
        "axis {axis}: point {point} of the job: {wanted} was wanted within {} s; {}; the axis was stopped where it \
         stood. Look at what drives the input; `within_s` says how long it is waited for",
        units::Short(within.as_secs_f64()), advice::of_input(*seen)
    )]
    InputNotSeen {
        /// Which axis.
        axis: String,
        /// Which point.
        point: String,
        /// The input and its level.
        wanted: String,
        /// What it showed last, if anything.
        seen: Option<units::Volts>,
        /// How long it was waited for.
        within: core::time::Duration,
    },
    /// A position of the error table does not fit its neighbours.
    #[error("axis {axis}: {source}{}", advice::of_stand_off(source))]
    StandsOff {
        /// Which axis.
        axis: String,
        /// Which position.
        source: compensator::error_table::StandOff,
    },
    /// Measurements do not make a series.
    #[error(transparent)]
    Series(#[from] compensator::error_table::SeriesError),
    /// The regression of the zero failed.
    #[error("axis {axis}: hall zero, refinement: {source}")]
    Refine {
        /// Which axis.
        axis: String,
        /// Why.
        source: RefineError,
    },
    /// Samples of the Hall sensors were lost however often they were passed.
    #[error(transparent)]
    SamplesLost(Box<SamplesLost>),
    /// The zero was found, but not well enough.
    #[error(
        "axis {axis}: hall zero found with a standard uncertainty of {:.4} µm, the limit is {:.4} µm; \
         a single pass over the sensors repeats to {:.4} µm. Look for noise of the sensors, vibration and a \
         servo that overshoots",
        seen.um(), limit.um(), scatter.um()
    )]
    ZeroUncertain {
        /// Which axis.
        axis: String,
        /// What was reached.
        seen: Metres,
        /// What is allowed.
        limit: Metres,
        /// The standard deviation of a single pass.
        scatter: Metres,
    },
    /// Interferometer and encoder disagree beyond reason.
    #[error(
        "axis {axis}: over {:.3} mm the instrument differs from the encoder by {ppm:.0} ppm, \
         the limit is {limit_ppm:.0} ppm; {cause}{}",
        travel.mm(), advice::of_scale(*ppm)
    )]
    ScaleMismatch {
        /// Which axis.
        axis: String,
        /// The travel compared.
        travel: Metres,
        /// The relative difference.
        ppm: f64,
        /// The limit.
        limit_ppm: f64,
        /// What it looks like.
        cause: &'static str,
    },
    /// The interferometer's count slipped.
    #[error(
        "axis {axis}: run {run}, between {} and {} mm the instrument jumped by {:.3} µm \
         against the encoder, {counts} {}: {}; set a new datum and measure again",
        units::Short(from.mm()), units::Short(to.mm()), jump.um(), of.name, of.slipped
    )]
    FringeJump {
        /// Which axis.
        axis: String,
        /// By how much.
        jump: Metres,
        /// The same, counted.
        counts: i64,
        /// What its counter counts.
        of: Count,
        /// In which run it was noticed.
        run: u32,
        /// The target before it.
        from: Metres,
        /// The target after it.
        to: Metres,
    },
    /// The interferometer's count slipped after its datum was set and before the first reading.
    #[error(
        "axis {axis}: run {run}, between the datum and the first reading the instrument jumped by {:.3} µm, \
         {counts} {}: {}; what it reads at the datum's place is off by that from the first reading to the end of \
         the run. Set a new datum and measure again",
        jump.um(), of.name, of.slipped
    )]
    DatumSlip {
        /// Which axis.
        axis: String,
        /// By how much.
        jump: Metres,
        /// The same, counted.
        counts: i64,
        /// What its counter counts.
        of: Count,
        /// In which run it was noticed.
        run: u32,
    },
    /// With its calibration the axis is worse than without; it is not used any more.
    #[error(
        "axis {axis}: CALIBRATION {calibration} MAKES THE AXIS WORSE: systematic deviation \
         {:.3} µm with it, {:.3} µm when it was made; {cause}. It was taken out of use; {}",
        after.um(), before.um(), in_use_text(in_use.as_deref())
    )]
    MadeWorse {
        /// Which axis.
        axis: String,
        /// The calibration, shortened.
        calibration: String,
        /// The systematic deviation that it should have taken away.
        before: Metres,
        /// What there is with it.
        after: Metres,
        /// What probably is wrong with it.
        cause: String,
        /// The calibration that is used again.
        in_use: Option<String>,
    },
    /// A calibration that was just made is worse than what was before; it is not used any more.
    #[error(transparent)]
    NewIsWorse(Box<NewIsWorse>),
    /// The same place measured at the beginning and the end differs too much.
    #[error(
        "axis {axis}: closure error {:.3} µm, the limit is {:.3} µm; thermal drift or a loose \
         instrument: nothing was saved. {}",
        seen.um(), limit.um(), advice::of_closure(*seen)
    )]
    Closure {
        /// Which axis.
        axis: String,
        /// What was seen.
        seen: Metres,
        /// What is allowed.
        limit: Metres,
    },
    /// A reading cannot be corrected.
    #[error("instrument {instrument}: {source}")]
    Correction {
        /// Which instrument.
        instrument: String,
        /// Why.
        source: compensator::length_correction::EnvironmentError,
    },
    /// The error table cannot be computed.
    #[error("axis {axis}: {source}")]
    Fit {
        /// Which axis.
        axis: String,
        /// Why.
        source: FitError,
    },
    /// How uncertain the error table is cannot be said.
    #[error("axis {axis}: {source}")]
    Budget {
        /// Which axis.
        axis: String,
        /// Why.
        source: BudgetError,
    },
    /// The error table cannot be applied.
    #[error("axis {axis}: {source}{}", advice::of_limit(source))]
    Compensation {
        /// Which axis.
        axis: String,
        /// Why.
        source: CompensationError,
    },
    /// ISO 230-2 figures cannot be computed.
    #[error(transparent)]
    Figures(#[from] compensator::iso230::EvaluationError),
    /// A data file is not what it should be.
    #[error(transparent)]
    Data(Box<dyn std::error::Error + Send + Sync>),
    /// Calibrations or journals cannot be stored or read.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// A file cannot be read or written.
    #[error("{}: {source}", path.display())]
    File {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// Devices are missing, unknown or not those of the configuration.
    #[error("{wrong} devices do not match the configuration")]
    ScanMismatch {
        /// How many.
        wrong: usize,
    },
    /// Something stands between this computer and the machine.
    #[error("{} must be put right first", units::Several(*wrong, "check"))]
    Unfit {
        /// How many checks failed.
        wrong: usize,
    },
    /// The result is out of tolerance.
    #[error(
        "axis {axis}: bidirectional accuracy A = {:.3} µm, the tolerance is {:.3} µm",
        seen.um(), limit.um()
    )]
    OutOfTolerance {
        /// Which axis.
        axis: String,
        /// What was measured.
        seen: Metres,
        /// What is allowed.
        limit: Metres,
    },
    /// The curves of the Hall sensors propose nothing.
    #[error("axis {axis}, sweep {}: {source}; nothing is proposed", sweep.display())]
    ZeroPlan {
        /// Which axis.
        axis: String,
        /// Where the sweep is.
        sweep: PathBuf,
        /// Why.
        source: PlanError,
    },
    /// The stage of a gantry is turned otherwise than when it was accepted.
    #[error(
        "gantry {gantry}: the stage stood turned by {:+.2} µrad against its angle at acceptance, the limit is \
         {:.2} µrad; a sensor, magnets or a limit switch have moved on one side, or the stage itself: look for what \
         was knocked or came loose, and zero again. Where the stage shall stay so, accept it anew \
         (`angle_at_acceptance_urad` in [gantry.{gantry}])",
        seen.value() * 1e6, limit.value() * 1e6
    )]
    Turned {
        /// Which gantry.
        gantry: String,
        /// By how much it differs.
        seen: Radians,
        /// What is allowed.
        limit: Radians,
    },
    /// A run that was stopped on request, and can be continued.
    #[error(
        "{source}; what was measured is kept in {}: the same command with --resume continues it",
        journal.display()
    )]
    Resumable {
        /// Who asked.
        source: Box<Failure>,
        /// Where the run is written.
        journal: PathBuf,
    },
    /// What measures has a certificate that does not hold today.
    #[error("{key}: the certificate {} does not hold: {standing}; {help}", file.display())]
    NotCertified {
        /// Where it stands in the configuration.
        key: String,
        /// The certificate.
        file: PathBuf,
        /// Since when, or until when.
        standing: String,
        /// What to do.
        help: &'static str,
    },
    /// The command line asks for something that is not there.
    #[error("{what}; {help}")]
    Usage {
        /// What is wrong.
        what: String,
        /// What to do.
        help: String,
    },
    /// The service that keeps the machine refused, or what it did failed.
    #[error("{said}")]
    Kept {
        /// Its words.
        said: String,
        /// What it would have been here.
        exit_code: u8,
    },
    /// The emulated machine cannot be brought up.
    #[cfg(feature = "emulator")]
    #[error("emulated machine: {0}")]
    Emulator(#[from] EmulatedError),
}

pub(crate) fn in_use_text(in_use: Option<&str>) -> String {
    in_use.map_or_else(
        || "the axis has no calibration now".into(),
        |id| format!("calibration {id}, used before, is in use again"),
    )
}

impl Failure {
    /// That nothing corrects `axis`.
    pub(crate) fn not_calibrated(axis: &str) -> Self {
        Self::NotCalibrated {
            what: format!("axis {axis} has no calibration"),
        }
    }

    /// The failure of one kind of machine, where it is one of that kind.
    pub fn of_kind<K: KindFailure>(&self) -> Option<&K> {
        match self {
            Self::Kind(failure) => failure.downcast_ref(),
            _ => None,
        }
    }
}

impl<K: KindFailure> From<K> for Failure {
    fn from(failure: K) -> Self {
        Self::Kind(failure.into())
    }
}

impl<K: std::error::Error + Send + Sync + 'static> From<DataError<K>> for Failure {
    fn from(failure: DataError<K>) -> Self {
        Self::Data(Box::new(failure))
    }
}

impl From<EngineFailure> for Failure {
    fn from(failure: EngineFailure) -> Self {
        Self::Machine(failure.into())
    }
}

impl Layered for Failure {
    fn map_machine(self, explain: impl FnOnce(machine::Failure) -> machine::Failure) -> Self {
        match self {
            Self::Machine(failure) => Self::Machine(explain(failure)),
            other => other,
        }
    }

    fn depends_on_time(&self) -> bool {
        match self {
            Self::Kind(failure) => failure.depends_on_time(),
            _ => matches!(
                self,
                Self::Search { .. } | Self::InputNotSeen { .. } | Self::StandsOff { .. }
            ),
        }
    }
}
