//! `truestage cal import`: a table of another control as a calibration of a linear axis.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use compensator::error_table::{CompFileType, ErrorTable, Node, comp_file};
use machine::records::{CalibrationRecord, InstrumentRecord, short};
use serde_json::json;
use units::{Approach, Metres};

use super::format::FormatName;
use crate::config::{self, Loaded};
use crate::linear::LinearContent;
use crate::program::data::linear_axis;
use crate::program::data_file::head_of;
use crate::program::data_text::{name_of, read};
use crate::program::output::{Ended, Output};
use crate::{Failure, linear};

const EXAMPLES: &str = "Examples:\n  truestage cal import machine.toml x.csv --format csv --axis x\n  \
    truestage cal import machine.toml x.comp --format linuxcnc --comp-file-type 1 --uncertainty-um 0.5\n\n\
    docs/exchange.md says how each table is read, with its sign.";

/// The unit of the numbers in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum UnitName {
    Mm,
    Inch,
}

/// Which table, for which axis.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct ImportArgs {
    /// The machine's configuration.
    pub(crate) config: PathBuf,
    /// The table.
    file: PathBuf,
    /// Whose table: csv or linuxcnc.
    #[arg(long, value_enum)]
    format: FormatName,
    /// The linear axis it belongs to; may be left out when there is only one.
    #[arg(long)]
    axis: Option<String>,
    /// Standard uncertainty of every value; without it what the file says, or none.
    #[arg(long, value_name = "UM")]
    uncertainty_um: Option<f64>,
    /// LinuxCNC: what stands in the INI file, 0 for positions or 1 for trims.
    #[arg(long, value_name = "TYPE", value_parser = clap::value_parser!(u8).range(0..=1))]
    comp_file_type: Option<u8>,
    /// LinuxCNC: the unit of its numbers, `[TRAJ] LINEAR_UNITS`.
    #[arg(long, value_enum)]
    unit: Option<UnitName>,
    /// Use it from now on; without it what was used before stays in use.
    #[arg(long)]
    pub(crate) activate: bool,
}

/// `activate`: puts what was stored into use.
pub(crate) fn run(
    args: &ImportArgs,
    activate: impl FnOnce(&Path, &str) -> Result<(String, String), Failure>,
    output: Output,
) -> Ended {
    let table = table(args)?;
    let loaded = config::load(&args.config)?;
    let axis = linear_axis(&args.config, &loaded.config, args.axis.as_deref())?;
    // First of all whether there is such an axis.
    let mut head = head_of(&loaded, &axis, &args.file)?;
    require_here(&loaded, &axis, &table, &args.file)?;
    if loaded.config.axis[&axis].compensation.is_some() {
        linear::settings::compensation(&loaded.config, &axis, table.clone())?;
    }
    head.instrument = InstrumentRecord {
        name: format!("table of another control ({})", args.format.in_words()),
        ..Default::default()
    };
    let content = LinearContent::new(&table, 0, None);
    let record = CalibrationRecord { head, content };
    let id = loaded.config.machine.store().save(&record)?;
    let name = short(&id);
    let mut text = format!("{}\nstored as {name}", told(&table, &axis));
    // What is stored is told, whatever comes of using it.
    let used = args.activate.then(|| activate(&args.config, &id));
    text += &match &used {
        Some(Ok(_)) => ", and in use".to_owned(),
        _ => format!(
            "; use it with `truestage cal activate {} {name}`",
            args.config.display()
        ),
    };
    let (first, last) = table.range();
    let value = json!({"calibration": id, "axis": axis, "positions": table.nodes().len(),
                       "first_mm": first.mm(), "last_mm": last.mm(),
                       "largest_deviation_um": table.largest().um(), "active": matches!(used, Some(Ok(_)))});
    match used {
        Some(Err(failure)) => output.bad_result(&text, value, failure),
        _ => output.result(&text, &value),
    }
}

fn told(table: &ErrorTable, axis: &str) -> String {
    let (first, last) = table.range();
    let sides = [Approach::Forward, Approach::Reverse].map(|it| table.knows(it));
    let from = match sides {
        [true, true] => "both approaches",
        [true, false] => "forward only",
        _ => "in reverse only",
    };
    let is_known = (table.nodes().iter()).any(|it| it.u_forward.or(it.u_reverse).is_some());
    format!(
        "axis {axis}: {} positions from {} to {} mm, {from}, largest deviation (actual − target) {:.3} µm{}",
        table.nodes().len(),
        units::Short(first.mm()),
        units::Short(last.mm()),
        table.largest().um(),
        if is_known {
            ""
        } else {
            ", uncertainty unknown: say it with --uncertainty-um"
        }
    )
}

fn table(args: &ImportArgs) -> Result<ErrorTable, Failure> {
    args.format.require_settled()?;
    let only_linuxcnc = [
        ("--comp-file-type", args.comp_file_type.is_some()),
        ("--unit", args.unit.is_some()),
    ];
    let name = name_of(&args.file);
    let table = match args.format {
        FormatName::Csv => {
            if let Some((option, _)) = only_linuxcnc.iter().find(|it| it.1) {
                return Err(Failure::Usage {
                    what: format!("{option} is for --format linuxcnc"),
                    help: "leave it out".into(),
                });
            }
            ErrorTable::from_csv(&read(&args.file)?, &name)?
        }
        FormatName::Linuxcnc => comp_file(&read(&args.file)?, &name, kind(args)?, unit(args))?,
        _ => {
            return Err(Failure::Usage {
                what: format!(
                    "--format {}: such tables are written, not read",
                    args.format.word()
                ),
                help: "csv and linuxcnc are read".into(),
            });
        }
    };
    with_uncertainty(table, args.uncertainty_um)
}

fn kind(args: &ImportArgs) -> Result<CompFileType, Failure> {
    match args.comp_file_type {
        Some(0) => Ok(CompFileType::Positions),
        Some(_) => Ok(CompFileType::Trims),
        None => Err(Failure::Usage {
            what: "--format linuxcnc: the file does not say whether its numbers are positions or trims".into(),
            help: "add --comp-file-type with COMP_FILE_TYPE of the INI file".into(),
        }),
    }
}

fn unit(args: &ImportArgs) -> Metres {
    match args.unit {
        Some(UnitName::Inch) => Metres(25.4e-3),
        Some(UnitName::Mm) | None => Metres(1e-3),
    }
}

/// The same table with this uncertainty of every value.
fn with_uncertainty(table: ErrorTable, stated_um: Option<f64>) -> Result<ErrorTable, Failure> {
    let Some(stated_um) = stated_um else {
        return Ok(table);
    };
    let refuse = |what: String, help: &str| {
        Err(Failure::Usage {
            what,
            help: help.to_owned(),
        })
    };
    if !(stated_um.is_finite() && stated_um >= 0.0) {
        return refuse(
            format!("--uncertainty-um {stated_um}: no uncertainty"),
            "write 0.5 for 0.5 µm",
        );
    }
    if table
        .nodes()
        .iter()
        .any(|it| it.u_forward.or(it.u_reverse).is_some())
    {
        let what = "--uncertainty-um: the file states the uncertainty of its values".to_owned();
        return refuse(what, "leave it out, or remove the columns");
    }
    let u = Some(Metres::from_um(stated_um));
    let nodes = table.nodes().iter().map(|node| Node {
        u_forward: u.filter(|_| node.forward.is_some()),
        u_reverse: u.filter(|_| node.reverse.is_some()),
        ..*node
    });
    Ok(ErrorTable::new(nodes.collect()).expect("its positions and deviations made a table"))
}

/// A table in another unit, or of another axis, mostly lies elsewhere.
///
/// # Errors
/// When no position of it is within the soft limits, or it covers next to nothing of them.
fn require_here(
    loaded: &Loaded,
    axis: &str,
    table: &ErrorTable,
    file: &Path,
) -> Result<(), Failure> {
    const SHARE_MIN: f64 = 0.05;
    let Some(own) = loaded.config.axis.get(axis) else {
        return Ok(());
    };
    let (min, max) = (own.motion.soft_min_mm, own.motion.soft_max_mm);
    let (first, last) = table.range();
    let common = last.mm().min(max) - first.mm().max(min);
    if common >= SHARE_MIN * (max - min) {
        return Ok(());
    }
    Err(Failure::Usage {
        what: format!(
            "{}: its positions reach from {} to {} mm, the soft limits of axis {axis} from {} to {} mm",
            file.display(),
            units::Short(first.mm()),
            units::Short(last.mm()),
            units::Short(min),
            units::Short(max)
        ),
        help: "nothing was stored; is it of another axis, or in inches or metres (--unit)?".into(),
    })
}
