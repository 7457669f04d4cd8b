//! `calibrate` and `verify` of a rotary axis whose plate a person reads: at the terminal, line by line, or
//! from files of readings.

use std::path::{Path, PathBuf};

use clap::Args;
use machine::records::{Lease, Store};
use serde_json::Value;

use crate::Failure;
use crate::config::{self, Loaded};
use crate::program::data_file::rotary_head_of;
use crate::program::data_text::{name_of, read};
use crate::program::operator::Terminal;
use crate::program::output::{Ended, Output};
use crate::program::resume::{journal_to_resume, resumable};
use crate::program::rotary::told::{self, verified};
use crate::program::session::choose_axis;
use crate::program::{AxisArgs, CalibrateArgs, VerifyArgs, only_for};
use crate::rotary::sighted::alone::{self, Source};
use crate::rotary::subject::Subject;
use crate::runs::DataFile;

/// Readings that were made elsewhere.
#[derive(Clone, Debug, Args)]
pub(crate) struct ReadingsArgs {
    /// A plate that a person reads (`sighting`): take the placement that is due from this file, and
    /// the next ones from further files. The machine may be off; nothing moves.
    #[arg(long, value_name = "FILE")]
    readings: Vec<PathBuf>,
}

impl ReadingsArgs {
    /// Whether there are none.
    pub(crate) fn is_empty(&self) -> bool {
        self.readings.is_empty()
    }

    /// # Errors
    /// When there are some, for what has no plate.
    pub(crate) fn refuse(&self) -> Result<(), Failure> {
        match self.is_empty() {
            true => Ok(()),
            false => Err(Failure::Usage {
                what: "--readings is for the plate of a rotary axis".into(),
                help: "leave it out".into(),
            }),
        }
    }

    pub(crate) fn files(&self) -> Result<Vec<DataFile>, Failure> {
        let file = |path: &PathBuf| {
            Ok(DataFile {
                name: name_of(path),
                text: read(path)?,
            })
        };
        self.readings.iter().map(file).collect()
    }
}

/// Who reads the plate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ReadBy {
    /// The line detector.
    Detector,
    /// A person, for whom the machine drives the table to each line.
    Driven,
    /// A person, or a file; the machine is not needed.
    Alone,
}

impl ReadBy {
    /// # Errors
    /// When there is no such axis; files for a plate that a detector reads.
    pub(crate) fn of(args: &AxisArgs, readings: &ReadingsArgs) -> Result<Self, Failure> {
        let loaded = config::load(&args.machine.config)?;
        let axis = axis_of(&loaded, args)?;
        let rotary = &loaded.config.rotary[&axis];
        let section = match rotary.line_signal {
            Some(_) => "line_signal",
            None => "line_detector",
        };
        match &rotary.sighting {
            None if readings.is_empty() => Ok(Self::Detector),
            None => Err(Failure::Usage {
                what: format!("axis {axis}: --readings, and a line detector reads its plate"),
                help: format!(
                    "put [rotary.{axis}.sighting] in place of [rotary.{axis}.{section}], or leave \
                     --readings out"
                ),
            }),
            Some(it) if readings.is_empty() && it.is_driven() => Ok(Self::Driven),
            Some(_) => Ok(Self::Alone),
        }
    }
}

pub(super) fn axis_of(loaded: &Loaded, args: &AxisArgs) -> Result<String, Failure> {
    choose_axis(loaded.config.rotary.keys().cloned().collect(), args)
}

/// The person at the terminal.
///
/// # Errors
/// When there is none, before anything moves.
pub(crate) fn person(
    yes: bool,
    args: &AxisArgs,
    output: Output,
    is_driven: bool,
) -> Result<Terminal, Failure> {
    if yes {
        return Err(Failure::Usage {
            what: "--yes, and a person reads the lines of the plate".into(),
            help: "leave --yes out, or give what was read with --readings FILE".into(),
        });
    }
    Terminal::of_reader(args.machine.hand(), output, is_driven)
}

/// The table as far as it is known without its machine, which is leased all the same: its records are
/// written.
struct Desk {
    loaded: Loaded,
    axis: String,
    store: Store,
    _lease: Lease,
}

impl Desk {
    fn open(args: &AxisArgs, verb: &str) -> Result<Self, Failure> {
        let loaded = config::load(&args.machine.config)?;
        let axis = axis_of(&loaded, args)?;
        let store = loaded.config.machine.store();
        Ok(Self {
            _lease: Lease::take(&store, verb)?,
            loaded,
            axis,
            store,
        })
    }

    fn subject(&self) -> Result<Subject<'_>, Failure> {
        Ok(Subject {
            axis: &self.axis,
            config: &self.loaded.config.rotary[&self.axis],
            hash: &self.loaded.hash,
            here: rotary_head_of(&self.loaded, &self.axis, Path::new(""))?,
            asked: false,
        })
    }
}

pub(crate) fn calibrate(args: &CalibrateArgs, output: Output) -> Ended {
    only_for_driven(args.verify)?;
    let files = args.readings.files()?;
    let mut person = reader(&files, args.ask.yes, &args.axis, output)?;
    let desk = Desk::open(&args.axis, "calibrate")?;
    let (axis, store) = (desk.axis.as_str(), &desk.store);
    let options = args.options(journal_to_resume(
        args.resume.as_ref(),
        store,
        "calibrate",
        axis,
    )?);
    let resumed = options.resume.as_deref();
    let progress = resumable(store, "calibrate", axis, resumed, || {
        let source = source(&files, &mut person);
        alone::calibrate(desk.subject()?, store, &options, source)
    })?;
    let told = told::progress(axis, &progress);
    output.result(&told.text, &told.value)
}

pub(crate) fn verify(args: &VerifyArgs, output: Output) -> Ended {
    let files = args.readings.files()?;
    let mut person = reader(&files, args.ask.yes, &args.axis, output)?;
    let desk = Desk::open(&args.axis, "verify")?;
    let (axis, store) = (desk.axis.as_str(), &desk.store);
    let resume = journal_to_resume(args.resume.as_ref(), store, "verify", axis)?;
    let how = (!args.uncompensated, resume.as_ref());
    let it = resumable(store, "verify", axis, resume.as_deref(), || {
        alone::verify(desk.subject()?, store, how, source(&files, &mut person))
    })?;
    verified(axis, &it, Value::Null, output)
}

/// # Errors
/// When it is to be verified at once: what is read of it then is another file.
pub(crate) fn only_for_driven(verify: bool) -> Result<(), Failure> {
    only_for(
        "--verify",
        "tables that the machine turns; verify this one afterwards",
        verify,
    )
}

/// Whether the plate is read by a person who turns the table himself.
pub(crate) fn is_turned_by_hand(args: &AxisArgs) -> Result<bool, Failure> {
    let loaded = config::load(&args.machine.config)?;
    let meant = |it: &&String| args.axis.as_ref().is_none_or(|axis| axis == *it);
    let mut meant = loaded.config.rotary.iter().filter(|(axis, _)| meant(axis));
    Ok(meant.any(|(_, it)| !it.is_driven()))
}

/// The journal of `verb` that `resume` names, or the newest that was left.
pub(crate) fn newest_of(
    verb: &str,
    args: &AxisArgs,
    resume: Option<&PathBuf>,
) -> Result<Option<PathBuf>, Failure> {
    let loaded = config::load(&args.machine.config)?;
    let axis = axis_of(&loaded, args)?;
    journal_to_resume(resume, &loaded.config.machine.store(), verb, &axis)
}

/// Who reads where there are no files.
fn reader(
    files: &[DataFile],
    yes: bool,
    args: &AxisArgs,
    output: Output,
) -> Result<Option<Terminal>, Failure> {
    let is_asked = files.is_empty();
    is_asked
        .then(|| person(yes, args, output, false))
        .transpose()
}

fn source<'a>(files: &'a [DataFile], person: &'a mut Option<Terminal>) -> Source<'a> {
    match person {
        Some(person) => Source::Person(person),
        None => Source::Files(files),
    }
}
