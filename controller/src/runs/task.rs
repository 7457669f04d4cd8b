//! What is run, what it will take, and what came of it.

use core::any::Any;
use std::path::PathBuf;

use machine::Stage;
use machine::records::Store;
use serde_json::Value;

use super::data_file::DataFile;
use super::job::JudgedJob;
use super::path::JudgedPath;
use super::person::Person;
use super::teller::{Teller, Told};
use crate::connected::Machine;
use crate::failure::Failure;
use crate::run::CalibrateOptions;
use crate::volumetric::MemoryName;

/// A run that is to be done.
#[derive(Clone, Debug, PartialEq)]
pub struct Task {
    /// Which.
    pub stage: Stage,
    /// The journal that it goes on with.
    pub resume: Option<PathBuf>,
    /// Calibrate: store although the same place differs too much between beginning and end.
    pub accept_drift: bool,
    /// Calibrate: store what is found, and use what was used before.
    pub aside: bool,
    /// Calibrate: verify with it at once; where it makes things worse, what was used before is used again.
    pub verify: bool,
    /// Verify: as found, without the calibration. A path: by the encoders alone.
    pub uncompensated: bool,
    /// Calibrate three axes: they warm up for so many minutes, and what that changes is measured again.
    pub warm_up_min: Option<f64>,
    /// The path that is followed, where it is one.
    pub path: Option<JudgedPath>,
    /// What the detectors see along the path is not corrected, but kept for the parts that follow.
    pub first_part: bool,
    /// References: the present state is kept as this memory instead, and all later parts are made with it.
    pub memory: Option<MemoryName>,
    /// The job that is done, where it is one.
    pub job: Option<JudgedJob>,
    /// What was measured or designed elsewhere, in place of what the machine would measure: then nothing moves, and
    /// nothing is switched on.
    pub files: Vec<DataFile>,
}

impl Task {
    /// The procedure of this stage, as it is done where nobody says otherwise.
    pub const fn of(stage: Stage) -> Self {
        Self {
            stage,
            resume: None,
            accept_drift: false,
            aside: false,
            verify: false,
            uncompensated: false,
            warm_up_min: None,
            path: None,
            first_part: false,
            memory: None,
            job: None,
            files: Vec::new(),
        }
    }

    /// Whether the machine does it itself, with its drives.
    pub(crate) const fn is_driven(&self) -> bool {
        self.files.is_empty()
    }

    /// # Errors
    /// When it is to warm up what is not measured cold and warm.
    pub(crate) fn without_warm_up(&self) -> Result<(), Failure> {
        match self.warm_up_min {
            None => Ok(()),
            Some(_) => Err(Failure::Usage {
                what: "three axes are warmed up between the lines of their calibration, and nothing else is".into(),
                help: "leave `warm_up_min` out".into(),
            }),
        }
    }

    /// # Errors
    /// When it keeps aside or verifies what it does not find, or verifies with what it keeps aside.
    pub(super) fn refuse_of_calibrations(&self) -> Result<(), Failure> {
        let refused = |what: &str, help: &str| {
            Err(Failure::Usage {
                what: what.into(),
                help: help.into(),
            })
        };
        let is_calibration = self.stage == Stage::Calibrate;
        match (self.aside, self.verify) {
            (true, true) => refused(
                "`aside` together with `verify`: what is kept aside is not used, and not verified",
                "leave one of them out",
            ),
            (true, false) if !is_calibration => {
                refused("`aside` is for calibrations", "leave it out")
            }
            (false, true) if !is_calibration => {
                refused("`verify` is for calibrations", "leave it out")
            }
            (false, true) if !self.is_driven() => refused(
                "`verify` together with `files`: a verification has files of its own",
                "leave it out, and verify afterwards",
            ),
            _ => Ok(()),
        }
    }

    /// The verification of what it has made; `None` where none is wanted.
    pub(super) fn then(&self) -> Option<Self> {
        let is_verified = self.verify && !self.aside && self.stage == Stage::Calibrate;
        is_verified.then(|| Self {
            stage: Stage::Verify,
            resume: None,
            accept_drift: false,
            uncompensated: false,
            verify: false,
            warm_up_min: None,
            ..self.clone()
        })
    }

    /// The same for a verb that calibrates one axis.
    pub(crate) fn calibrate_options(&self) -> CalibrateOptions {
        CalibrateOptions {
            resume: self.resume.clone(),
            accept_drift: self.accept_drift,
            aside: self.aside,
        }
    }
}

/// What a procedure works with.
pub(crate) struct Work<'w> {
    pub(crate) machine: &'w mut Machine,
    pub(crate) store: &'w Store,
    pub(crate) person: &'w mut dyn Person,
    pub(crate) teller: Option<&'w Teller>,
}

impl Work<'_> {
    /// The words of the kind whose they are, where somebody wants to be told.
    pub(crate) fn words<W: Any>(&self) -> Option<&'static W> {
        self.teller?.of()
    }
}

impl Found {
    /// With what the verification of a calibration found.
    pub(super) fn verified(&mut self, verified: Self) {
        self.figures["verified"] = verified.figures;
        if let (Some(told), Some(then)) = (&mut self.told, verified.told) {
            told.append_verified(then);
        }
        self.bad = verified.bad;
    }
}

/// What a run found.
#[derive(Debug, Default)]
pub struct Found {
    /// The figures that matter.
    pub figures: Value,
    /// The same, as the command line prints it.
    pub told: Option<Told>,
    /// The calibrations that it stored: what the store calls each, and its name.
    pub stored: Vec<(String, String)>,
    /// Why the result is a bad one, although it is one.
    pub bad: Option<Failure>,
}
