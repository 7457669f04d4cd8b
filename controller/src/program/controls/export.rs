//! `truestage cal export`: a calibration in the form of another control.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use clap::Args;
use compensator::error_table::{Compensation, EndPolicy};
use machine::records::{CalibrationRecord, RecordHead, Store};
use serde_json::{Map, Value, json};

use super::correction::{Correction, Side};
use super::dcc::Issuer;
use super::exported::{Exported, Written};
use super::format::FormatName;
use super::{csv, dcc, linuxcnc, pmac, sinumerik};
use crate::config::{self, Loaded};
use crate::linear::LinearContent;
use crate::program::belongs::head_of;
use crate::program::kind::of_kind;
use crate::program::output::{Ended, Output};
use crate::program::written::create;
use crate::rotary::RotaryContent;
use crate::rotary::settings::periodic_compensation;
use crate::{Failure, linear};

const EXAMPLES: &str = "Examples:\n  truestage cal export machine.toml 3f2a --format csv --out x.csv\n  \
    truestage cal export machine.toml 3f2a --format linuxcnc --name 0 --out x.comp\n  \
    truestage cal export machine.toml 3f2a --format sinumerik-eec --name X1 --approach mean\n  \
    truestage cal export machine.toml 3f2a --format pmac --name 3 --counts 10000\n  \
    truestage cal export machine.toml 3f2a --format dcc --laboratory \"Works 2\" --country DE --person \"A. Meier\"\n\n\
    docs/exchange.md says how each control uses its table, with its sign.";

/// Which calibration, for whom.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct ExportArgs {
    /// The machine's configuration.
    config: PathBuf,
    /// The calibration's name, or the beginning of it.
    id: String,
    /// Whose table.
    #[arg(long, value_enum)]
    format: FormatName,
    /// Write it to this file, which must not exist yet; without it to standard output.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Where a table has one value for both directions: of which approach it shall be.
    #[arg(long, value_enum)]
    approach: Option<Side>,
    /// Distance between two values in millimetres, of a rotary axis in degrees; without it as near as the calibrated
    /// places are, and nearer where straight lines between these would be more than 0.01 um off.
    #[arg(long, value_name = "DISTANCE")]
    step: Option<f64>,
    /// What the axis is called there: the machine axis of a SINUMERIK (X1), the number of a joint of LinuxCNC (0) or of
    /// a motor of a PMAC (1).
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
    /// PMAC: counts of the motor's encoder for a millimetre, or for a turn of a rotary axis; without it those of the
    /// encoder that the calibration was made with.
    #[arg(long, value_name = "COUNTS")]
    counts: Option<f64>,
    /// DCC: who issues the certificate.
    #[arg(long, value_name = "NAME")]
    laboratory: Option<String>,
    /// DCC: where, by ISO 3166-1 (DE).
    #[arg(long, value_name = "CODE")]
    country: Option<String>,
    /// DCC: who answers for it.
    #[arg(long, value_name = "NAME")]
    person: Option<String>,
}

pub(crate) fn run(args: &ExportArgs, output: Output) -> Ended {
    args.format.require_settled()?;
    require_used(args)?;
    let loaded = config::load(&args.config)?;
    let store = loaded.config.machine.store();
    let id = store.resolve(&args.id)?;
    let written = written(args, &loaded, &store, &id)?;
    let mut value = json!({"calibration": id, "format": args.format.word(), "told": written.told,
                           "figures": written.figures});
    let Some(out) = &args.out else {
        for line in &written.told {
            output.note(&format!("note: {line}"));
        }
        value["text"] = json!(written.text);
        return output.result(written.text.trim_end_matches('\n'), &value);
    };
    write_new(out, &written.text)?;
    value["out"] = json!(out);
    let mut text = format!(
        "written to {}, as {}",
        out.display(),
        args.format.in_words()
    );
    for line in &written.told {
        text += &format!("\n  {line}");
    }
    output.result(&text, &value)
}

/// # Errors
/// When an option is given that would change nothing: whoever gave it believes that it does.
fn require_used(args: &ExportArgs) -> Result<(), Failure> {
    let given = [
        ("--approach", args.approach.is_some()),
        ("--step", args.step.is_some()),
        ("--name", args.name.is_some()),
        ("--counts", args.counts.is_some()),
        ("--laboratory", args.laboratory.is_some()),
        ("--country", args.country.is_some()),
        ("--person", args.person.is_some()),
    ];
    let takes = args.format.takes();
    let useless = given
        .iter()
        .find(|(option, is_given)| *is_given && !takes.contains(option));
    let Some((option, _)) = useless else {
        return Ok(());
    };
    let word = args.format.word();
    Err(Failure::Usage {
        what: match takes {
            [] => format!("{option}: --format {word} writes the calibration as it is"),
            _ => format!("{option}: --format {word} has no use for it"),
        },
        help: match takes {
            [] => "leave it out".into(),
            _ => format!("leave it out; this format takes {}", takes.join(", ")),
        },
    })
}

/// A file that is there already is somebody's table.
fn write_new(path: &Path, text: &str) -> Result<(), Failure> {
    let failed = |source| Failure::File {
        path: path.to_owned(),
        source,
    };
    match create(path, text.as_bytes()) {
        Ok(()) => Ok(()),
        Err(error) if error.kind() == ErrorKind::AlreadyExists => Err(Failure::Usage {
            what: format!("--out {}: this file already exists", path.display()),
            help: "it was not changed; give another name, or move it away".into(),
        }),
        Err(error) => Err(failed(error)),
    }
}

fn written(
    args: &ExportArgs,
    loaded: &Loaded,
    store: &Store,
    id: &str,
) -> Result<Written, Failure> {
    if args.format == FormatName::Dcc {
        return certificate(args, store, id);
    }
    // What is in another control's table must be of this very machine.
    let head = head_of(loaded, store, id)?;
    let kind = store.glance(id)?.kind;
    let correction = match kind {
        LinearContent::KIND => of_linear(loaded, store, id, &head)?,
        RotaryContent::KIND => of_rotary(loaded, store, id, &head)?,
        _ => return Err(not_of_one_axis(args.format, &head, kind)),
    };
    let counts = args.counts.map(|it| match &correction {
        Correction::Linear(_) => it * 1e3,
        Correction::Rotary(_) => it / core::f64::consts::TAU,
    });
    let own = loaded.config.axis.get(&head.axis).map(|it| &it.motion);
    let exported = Exported {
        id,
        head: &head,
        correction: &correction,
        format: args.format,
        side: args.approach,
        step: args.step,
        name: args.name.as_deref(),
        counts,
        soft_limits: own.map(|it| (it.soft_min_mm * 1e-3, it.soft_max_mm * 1e-3)),
    };
    match args.format {
        FormatName::Linuxcnc => linuxcnc::written(&exported),
        FormatName::Pmac => pmac::written(&exported),
        FormatName::SinumerikEec => sinumerik::written(&exported),
        _ => in_columns(&exported),
    }
}

/// Of the record as it is, whatever the configuration has become since.
fn certificate(args: &ExportArgs, store: &Store, id: &str) -> Result<Written, Failure> {
    let glance = store.glance(id)?;
    let certified = (of_kind(glance.kind).certifiable)(store, id)?;
    let issuer = Issuer {
        laboratory: args.laboratory.as_deref(),
        country: args.country.as_deref(),
        person: args.person.as_deref(),
    };
    dcc::written(id, &glance.head, &certified, &issuer)
}

/// The record itself; nothing is chosen or interpolated.
fn in_columns(exported: &Exported<'_>) -> Result<Written, Failure> {
    let (rows, what) = match exported.correction {
        Correction::Linear(it) => (
            csv::linear(it.table()),
            "deviations are actual - target by each approach (forward: growing coordinates); u: standard uncertainty",
        ),
        Correction::Rotary(it) => (
            csv::rotary(it.table()),
            "deviations are actual - target at each line; u: standard uncertainty",
        ),
    };
    let mut text = String::new();
    for line in exported.header(&[what.to_owned()]) {
        text += &format!("# {line}\n");
    }
    Ok(Written {
        text: text + &rows,
        told: Vec::new(),
        figures: Map::<String, Value>::new(),
    })
}

/// Its ends hold: what a control does there is asked of every place.
fn of_linear(
    loaded: &Loaded,
    store: &Store,
    id: &str,
    head: &RecordHead,
) -> Result<Correction, Failure> {
    let record: CalibrationRecord<LinearContent> = store.load(id)?;
    let table = record.content.table(id)?;
    let made = linear::settings::compensation(&loaded.config, &head.axis, table)?;
    let (table, limits) = (made.table().clone(), made.limits());
    let held = Compensation::new(table, made.interpolation(), limits, EndPolicy::Hold);
    let held = held.map_err(|source| Failure::Compensation {
        axis: head.axis.clone(),
        source,
    })?;
    Ok(Correction::Linear(Box::new(held)))
}

fn of_rotary(
    loaded: &Loaded,
    store: &Store,
    id: &str,
    head: &RecordHead,
) -> Result<Correction, Failure> {
    let record: CalibrationRecord<RotaryContent> = store.load(id)?;
    let table = record.content.table(id)?;
    let own = loaded.config.rotary.get(&head.axis);
    let own = own.and_then(|it| it.compensation.as_ref());
    let own = own.ok_or_else(|| Failure::NotConfigured {
        axis: head.axis.clone(),
        section: "compensation",
    })?;
    let made = periodic_compensation(own, &head.axis, table)?;
    Ok(Correction::Rotary(Box::new(made)))
}

fn not_of_one_axis(format: FormatName, head: &RecordHead, kind: &str) -> Failure {
    Failure::Usage {
        what: format!(
            "--format {}: this is a calibration of the kind {kind} ({}); {} tables hold the deviations of one linear or \
             rotary axis by its own position, and it says more",
            format.word(),
            head.axis,
            format.in_words()
        ),
        help: "`cal show --json` prints it whole".into(),
    }
}
