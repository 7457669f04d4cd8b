//! What can go wrong with three axes beyond what can go wrong with each.

use core::time::Duration;
use std::path::PathBuf;

use compensator::volumetric::function::FunctionError;
use compensator::volumetric::identify::IdentifyError;
use compensator::volumetric::model::{ChainError, ConditionsError, ModelError};
use compensator::volumetric::online::{MemoryError, RollError, Trouble};
use compensator::volumetric::{Axis, NoCorrection, VolumeError};
use units::{Celsius, Metres, Radians};

use crate::failure::of_kind::KindFailure;
use crate::volumetric::calibrate::Scatter;
use crate::volumetric::limits::{BeyondLimits, NotWithin};
use crate::volumetric::settings::BeamDetectorError;
use machine::engine::{Cause, Lack, PushError};

/// Why three axes are not corrected, or not zeroed.
#[derive(Debug, thiserror::Error)]
pub enum VolumetricFailure {
    /// The machine has no such thing.
    #[error("this machine has no work volume: its configuration has no [volumetric]")]
    None,
    /// A section of the configuration is missing.
    #[error("[volumetric.{section}] is missing in the configuration")]
    NotConfigured {
        /// Which section.
        section: &'static str,
    },
    /// A beam is watched, but the references of its detectors are missing.
    #[error(
        "axis {axis}: its detectors have no references; take them (`truestage reference`) while \
         the machine has the temperature at which its errors were measured"
    )]
    NoReference {
        /// Whose beam.
        axis: Axis,
    },
    /// The roll is watched, but has no reference.
    #[error(
        "the roll detectors have no reference; take it (`truestage reference`) while the machine \
         has the temperature at which its errors were measured"
    )]
    NoRollReference,
    /// Thermometers without the temperatures at the calibration.
    #[error("{seen} reference temperatures for {expected} thermometers; calibrate again")]
    Temperatures {
        /// How many there are.
        seen: usize,
        /// How many there should be.
        expected: usize,
    },
    /// Nothing is known of the errors.
    #[error(
        "the errors of the three axes were never measured; `truestage calibrate` measures them"
    )]
    NoGeometry,
    /// References that were taken with other errors in use.
    #[error(
        "the references {references} of the detectors count from the calibration {measured_with}, \
         but {geometry} is in use; activate records that belong together (`truestage cal \
         activate`), or take the references again (`truestage reference`)"
    )]
    OtherGeometry {
        /// The references.
        references: String,
        /// Which calibration they belong to.
        measured_with: String,
        /// Which is in use.
        geometry: String,
    },
    /// A memory that counts from other references.
    #[error(
        "the {which} state memory {memory} counts from the references {measured_with}, but \
         {references} are in use; record it again (`truestage memory record --memory {which}`), or \
         clear it (`truestage memory clear --memory {which}`)"
    )]
    OtherReferences {
        /// First or second.
        which: &'static str,
        /// The memory.
        memory: String,
        /// Which references it belongs to.
        measured_with: String,
        /// Which are in use.
        references: String,
    },
    /// A second memory that counts beyond another first one.
    #[error(
        "the second state memory {memory} counts from the first memory {measured_with}, but \
         {first} is in use; make the first part again (`truestage run PATH --first-part`), record \
         it again (`truestage memory record --memory second`), or clear it (`truestage memory \
         clear --memory second`)"
    )]
    OtherFirstMemory {
        /// The second memory.
        memory: String,
        /// Which first memory it belongs to.
        measured_with: String,
        /// Which is in use.
        first: String,
    },
    /// What was recorded while a first part was made is no state to keep.
    #[error("{0}; nothing was stored")]
    Memory(#[from] MemoryError),
    /// A detector that gives no reliable value where its reference is to be taken.
    #[error(
        "axis {axis} at {:.3} mm: the detector {what} gives no reliable value: {source}; nothing \
         was stored", at.mm()
    )]
    Blind {
        /// Along which axis.
        axis: Axis,
        /// Where the axis stands.
        at: Metres,
        /// Which detector.
        what: &'static str,
        /// What is wrong.
        source: Trouble,
    },
    /// A thermometer that gives no reliable value.
    #[error(
        "thermometer {index} ([[volumetric.temperature]], counted from 0) gives no reliable value: \
         {source}; nothing was stored: check it and its wires, and begin again"
    )]
    NoTemperature {
        /// Which, from 0.
        index: usize,
        /// What is wrong.
        source: Trouble,
    },
    /// A machine that is not as warm as when its errors were measured.
    #[error(
        "thermometer {index} ([[volumetric.temperature]], counted from 0) shows {:.2} °C, but \
         {:.2} °C when the errors {geometry} were measured, more than {limit_k:.2} K apart: \
         references taken now would count the thermal errors as zero. Let the machine come to that \
         temperature (by resting, or by moving), or calibrate again; what was in use stays in use",
        now.value(), then.value()
    )]
    OtherWarmth {
        /// Which, from 0.
        index: usize,
        /// What it showed when the errors were measured.
        then: Celsius,
        /// What it shows now.
        now: Celsius,
        /// How far apart they may be.
        limit_k: f64,
        /// Which errors.
        geometry: String,
    },
    /// Likewise of the difference across a guide.
    #[error(
        "the guide of {axis}: thermometer {over} shows {now_k:+.2} K more than {under} (counted \
         from 0), but {then_k:+.2} K when the errors {geometry} were measured, more than \
         {limit_k:.2} K apart: references taken now would count its bending as zero. Let the \
         machine come to that state (by resting, or by moving), or calibrate again; what was in \
         use stays in use"
    )]
    OtherGradient {
        /// Whose guide.
        axis: Axis,
        /// The thermometer over its neutral plane, from 0.
        over: usize,
        /// The one under it.
        under: usize,
        /// The difference when the errors were measured, in kelvin.
        then_k: f64,
        /// The difference now.
        now_k: f64,
        /// How far apart they may be.
        limit_k: f64,
        /// Which errors.
        geometry: String,
    },
    /// Samples that do not come.
    #[error("measuring modules and cameras sent {seen} of {expected} samples in {:.1} s; do the modules sample (every_syncs), and do the \
        cameras take pictures?",
        waited.as_secs_f64())]
    NoSamples {
        /// How many came.
        seen: usize,
        /// How many were awaited.
        expected: usize,
        /// How long.
        waited: Duration,
    },
    /// A journal that does not say how its readings are evaluated.
    #[error(
        "this journal does not say how the errors of three axes are found from it; give the \
         journal of a `calibrate` run of such a machine"
    )]
    NoPlan,
    /// A calibration is to be continued, but its references no longer hold.
    #[error(
        "axis {axis}: along its travel the detectors of the {what} see changes that differ by \
         {:.2} um, more than {:.2} um (resume_limit_um), since the references of this run were \
         taken; the machine has changed, or a detector was moved: start a new calibration without \
         --resume", seen.um(),
         limit.um()
    )]
    Moved {
        /// Along which axis.
        axis: Axis,
        /// Of what.
        what: &'static str,
        /// Largest minus smallest change.
        seen: Metres,
        /// What it may be.
        limit: Metres,
    },
    /// A calibration is to be continued on a machine that is colder or warmer.
    #[error(
        "thermometer {index} ([[volumetric.temperature]], counted from 0) shows {seen:.2} °C, but \
         showed {before:.2} °C when this run was interrupted; without lines read after warming up, \
         at most {limit:.2} K of difference is permitted: let the machine come to that \
         temperature, or start a new calibration with --warm-up-min"
    )]
    WarmthSince {
        /// Which, from 0.
        index: usize,
        /// In the last line that is whole, °C.
        before: f64,
        /// Now, °C.
        seen: f64,
        /// By how much they may differ, kelvin.
        limit: f64,
    },
    /// Readings that do not determine the errors.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
    /// Readings that are worse than they can be.
    #[error("three axes: {0}")]
    Scatter(Box<Scatter>),
    /// What detectors see is more than a correction is proven for.
    #[error(transparent)]
    Conditions(#[from] ConditionsError),
    /// A place for which there is no correction.
    #[error(transparent)]
    NoCorrection(#[from] NoCorrection),
    /// The line of a verification.
    #[error("deviations along the line range over {:.3} um, the limit is {:.3} um", seen.um(), limit.um())]
    OutOfTolerance {
        /// Largest minus smallest.
        seen: Metres,
        /// What it may be.
        limit: Metres,
    },
    /// A path cannot be driven as it is.
    #[error("{}: {source}; nothing was moved", path.display())]
    RefusedPath {
        /// The file.
        path: PathBuf,
        /// What cannot be driven.
        source: PathRefusal,
    },
    /// A path that cannot be driven.
    #[error("the path was not driven to its end: {source}")]
    Path {
        /// Why.
        source: PushError,
    },
    /// A detector with impossible settings.
    #[error("axis {axis}: {source}")]
    Detector {
        /// Whose.
        axis: Axis,
        /// Why.
        source: BeamDetectorError,
    },
    /// The kinematic chain is invalid.
    #[error(transparent)]
    Chain(#[from] ChainError),
    /// The work volume is invalid.
    #[error(transparent)]
    Volume(#[from] VolumeError),
    /// An influence is not a function.
    #[error("influence: {0}")]
    Influence(#[from] FunctionError),
    /// The roll optics are invalid.
    #[error(transparent)]
    Roll(#[from] RollError),
    /// The errors cannot be compensated.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The configuration does not let a correction like this pass.
    #[error("three axes: {0}")]
    Limits(BeyondLimits),
    /// The correction was to be switched on, and something that it is computed from is missing.
    #[error("not corrected: {lack}; the machine was not moved")]
    Lacking {
        /// What, and why.
        lack: Lack,
    },
    /// The correction was to be switched on, and cannot be known.
    #[error(
        "not corrected: the detectors report more than the correction was proven for; the machine \
         was not moved; look for what has shifted, or calibrate again"
    )]
    NotProven,
    /// A line without a direction, or with optics that look along it.
    #[error(
        "this line has no direction, or its optics do not look across it; nothing was moved: give \
         it a length, and optics whose direction is square to the line"
    )]
    NotALine,
    /// A line is to be measured with something that is not there.
    #[error("there is no instrument `{instrument}`; add [instrument.{instrument}]")]
    NoInstrument {
        /// Its name.
        instrument: String,
    },
    /// A line is to be measured with optics that the configuration does not describe.
    #[error(
        "instrument {instrument}: `{key}` is missing in [instrument.{instrument}.optics]; nothing \
         was moved"
    )]
    NoOptics {
        /// Which instrument.
        instrument: String,
        /// What is missing.
        key: &'static str,
    },
    /// A line was set up, but the interferometer sees nothing.
    #[error(
        "instrument {instrument}: no beam comes back along the line that was set up; align \
         laser and optics, and begin again"
    )]
    NoLight {
        /// Which instrument.
        instrument: String,
    },
    /// A straight move ended elsewhere.
    #[error("the tool did not arrive: {cause}")]
    NotThere {
        /// Why it ended.
        cause: Cause,
    },
    /// A reading too large to be an error of the machine.
    #[error(
        "the line reads a deviation of {:.1} um, more than the {:.1} um that is possible on this \
         machine: check the optics, `reverse`, and that the tool stays on the line",
        seen.um(), limit.um()
    )]
    ImpossibleReading {
        /// What was read.
        seen: Metres,
        /// What is possible.
        limit: Metres,
    },
    /// A tilt too large to be an error of the machine.
    #[error(
        "the line reads a tilt of {:.1} arcsec, more than the {:.1} arcsec that is possible on \
         this machine: check the optics", seen.arcsec(), limit.arcsec()
    )]
    ImpossibleTilt {
        /// What was read.
        seen: Radians,
        /// What is possible.
        limit: Radians,
    },
}

impl From<NotWithin> for VolumetricFailure {
    fn from(reason: NotWithin) -> Self {
        match reason {
            NotWithin::Limits(beyond) => Self::Limits(beyond),
            NotWithin::Model(source) => Self::Model(source),
            NotWithin::Conditions(source) => Self::Conditions(source),
        }
    }
}

/// Why a path is not begun.
#[derive(Debug, thiserror::Error)]
pub enum PathRefusal {
    /// The axes cannot follow it: soft limits, speed, acceleration or jerk.
    #[error("{}{source}", between(*lines))]
    Point {
        /// What cannot be driven.
        source: PushError,
        /// The lines of the rows that it is between.
        lines: Option<[usize; 2]>,
    },
    /// They cannot follow a corner of straight lines within what is allowed.
    #[error(
        "{source}; at this speed the corner in line {line} can be passed within {:.3} mm: allow as much, or go slower",
        wants.mm() + 0.0005
    )]
    Corner {
        /// The point that cannot be driven.
        source: PushError,
        /// The line of the corner's row.
        line: usize,
        /// How far from it the axes can pass.
        wants: Metres,
    },
    /// It leaves the volume that is calibrated.
    #[error("{}at {at_s:.4} s: {source}", between(*lines))]
    Volume {
        /// The lines of the rows that it is between.
        lines: Option<[usize; 2]>,
        /// When it does, in seconds from the path's beginning.
        at_s: f64,
        /// Where it is then, and what is calibrated.
        source: Box<VolumetricFailure>,
    },
}

/// Where in its file a path is refused.
fn between(lines: Option<[usize; 2]>) -> String {
    lines.map_or_else(String::new, |[one, next]| {
        format!("between lines {one} and {next}: ")
    })
}

impl KindFailure for VolumetricFailure {
    fn exit_code(&self) -> u8 {
        match self {
            Self::None
            | Self::NotConfigured { .. }
            | Self::Detector { .. }
            | Self::NotALine
            | Self::NoInstrument { .. }
            | Self::NoOptics { .. }
            | Self::Chain(_)
            | Self::Volume(_)
            | Self::Influence(_)
            | Self::NoPlan
            | Self::Roll(_) => 2,
            Self::OutOfTolerance { .. } | Self::Scatter(_) => 5,
            Self::NoReference { .. }
            | Self::NoGeometry
            | Self::OtherGeometry { .. }
            | Self::OtherReferences { .. }
            | Self::OtherFirstMemory { .. }
            | Self::Memory(_)
            | Self::Blind { .. }
            | Self::NoTemperature { .. }
            | Self::OtherWarmth { .. }
            | Self::OtherGradient { .. }
            | Self::NoRollReference
            | Self::Temperatures { .. }
            | Self::Moved { .. }
            | Self::WarmthSince { .. }
            | Self::Identify(_)
            | Self::Conditions(_)
            | Self::NoCorrection(_)
            | Self::Model(_)
            | Self::Limits(_)
            | Self::Path { .. }
            | Self::RefusedPath { .. } => 3,
            Self::NoSamples { .. }
            | Self::NoLight { .. }
            | Self::NotThere { .. }
            | Self::Lacking { .. }
            | Self::NotProven
            | Self::ImpossibleReading { .. }
            | Self::ImpossibleTilt { .. } => 4,
        }
    }
}
