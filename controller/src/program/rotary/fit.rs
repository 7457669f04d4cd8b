//! `truestage plan rotary` and `truestage fit rotary`: the self-calibration of a rotary table, and
//! what `cal` shows of it.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use compensator::rotary::RotarySeries;
use compensator::rotary::{
    self, Criterion, Design, PlanError, Reading, Solution, SolveOptions,
    rms_amplification_of_a_pair, rms_amplification_of_all,
};
use machine::records::{CalibrationRecord, read_journal, short};
use serde_json::json;
use units::Radians;

use crate::program::budget;
use crate::program::controls::dcc::Certifiable;
use crate::program::data_file::rotary_head_of;
use crate::program::data_text::{is_journal, name_of, read};
use crate::program::output::{Ended, Output};
use crate::program::page::chart::BLUE;
use crate::program::page::compare::{Pair, overlaid};
use crate::program::plausible;
use crate::program::rotary::{json as to_json, uncertainty};
use crate::program::show::{Changes, Show};
use crate::rotary::PlateLog;
use crate::rotary::RotaryContent;
use crate::rotary::RotaryFailure;
use crate::rotary::estimate::fit_whole as fit_placed;
use crate::rotary::placed::Placed;
use crate::rotary::settings::interpolation_of;
use crate::{Failure, config};

/// Harmonics that a plan prints; `--json` has them all.
const SHOWN: usize = 8;

/// What `truestage plan rotary` is told.
#[derive(Debug, Args)]
pub(crate) struct PlanArgs {
    /// Lines of the plate.
    #[arg(long)]
    lines: usize,
    /// How often the plate is placed.
    #[arg(long, required_unless_present = "offsets", conflicts_with = "offsets")]
    placements: Option<usize>,
    /// What to keep small: the amplification of the worst harmonic, or the rms of all.
    #[arg(long, value_enum, default_value_t = CriterionName::Worst, conflicts_with = "offsets")]
    criterion: CriterionName,
    /// Judge these offsets instead: `0,1,8,26`.
    #[arg(long, value_delimiter = ',')]
    offsets: Option<Vec<usize>>,
    /// Refuse offsets that amplify the noise of a harmonic more than this.
    #[arg(long, value_name = "FACTOR", default_value_t = amplification_max())]
    amplification_limit: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum CriterionName {
    Worst,
    Rms,
}

/// What `truestage fit rotary` is told.
#[derive(Debug, Args)]
pub(crate) struct RotaryArgs {
    /// The data file; line n of a placement with offset s is read at table position n + s. Or the journal of a
    /// `calibrate` (*.jsonl), which knows the lines and the plate itself.
    data: PathBuf,
    /// Lines of the plate: the file cannot tell, as lines that were never read leave no row.
    #[arg(long)]
    lines: Option<usize>,
    /// Standard uncertainty of one reading, to be propagated in addition to that from the
    /// residuals.
    #[arg(long, value_name = "ARCSEC")]
    reading_noise_arcsec: Option<f64>,
    /// Refuse a series that amplifies noise more than this.
    #[arg(long, value_name = "FACTOR", default_value_t = amplification_max())]
    amplification_limit: f64,
    /// Store it as a calibration of this machine.
    #[arg(long, value_name = "CONFIG")]
    save: Option<PathBuf>,
    /// The rotary axis it belongs to; may be left out when there is only one.
    #[arg(long)]
    axis: Option<String>,
    /// With --save: the plate's serial number. Only with that plate the stored table can be
    /// verified.
    #[arg(long, value_name = "NAME", requires = "save")]
    plate: Option<String>,
}

fn amplification_max() -> f64 {
    SolveOptions::default().amplification_max
}

pub(crate) fn plan(args: &PlanArgs, output: Output) -> Ended {
    let wanted = match args.criterion {
        CriterionName::Worst => Criterion::Worst,
        CriterionName::Rms => Criterion::Rms,
    };
    let lines = args.lines;
    let (design, criterion) = match &args.offsets {
        Some(offsets) => (judged(lines, offsets, args.amplification_limit)?, None),
        None => {
            // clap has asked for it.
            let placements = args.placements.unwrap_or_default();
            let design = rotary::plan(lines, placements, wanted)?;
            let design = judged(lines, design.offsets(), args.amplification_limit)?;
            (design, Some(wanted))
        }
    };
    let pair = judged(lines, &[0, 1], f64::INFINITY)?;
    let mut value = to_json::design(&design, &pair);
    value["criterion"] = json!(criterion.map(to_json::criterion));
    output.result(&plan_text(&design, &pair), &value)
}

fn judged(lines: usize, offsets: &[usize], limit: f64) -> Result<Design, Failure> {
    Ok(Design::new(lines, offsets, limit).map_err(PlanError::from)?)
}

fn plan_text(design: &Design, pair: &Design) -> String {
    let lines = design.lines();
    let offsets: Vec<String> = design.offsets().iter().map(usize::to_string).collect();
    let (worst, _) = design.worst();
    let mut text = format!(
        "{lines} lines, {} placements: offsets {}\n  noise of a table error in units of that of a \
         reading (rms amplification)\n    {:<28} {:>9.4}\n    {:<28} {:>9.4}   theory {:.4}\n    \
         {:<28} {:>9}   theory {:.4}\n  noise of a harmonic in units of its noise in the readings \
         of one placement\n    {:<28} {:>9} {:>9}",
        design.offsets().len(),
        offsets.join(", "),
        "these offsets",
        design.rms_amplification(),
        "the patent's pair 0, 1",
        pair.rms_amplification(),
        rms_amplification_of_a_pair(lines),
        "a placement at every line",
        "",
        rms_amplification_of_all(lines),
        "harmonic",
        "these",
        "0, 1",
    );
    let mut row = |harmonic: usize, note: &str| {
        let (own, pair) = (design.amplification(harmonic), pair.amplification(harmonic));
        text += &format!("\n    {harmonic:<28} {own:>9.4} {pair:>9.4}{note}");
    };
    (1..=design.harmonics().min(SHOWN)).for_each(|harmonic| row(harmonic, ""));
    row(worst, "   the worst");
    text
}

pub(crate) fn fit(args: &RotaryArgs, output: Output) -> Ended {
    if is_journal(&args.data) {
        return of_journal(args, output);
    }
    let file = name_of(&args.data);
    let text = read(&args.data)?;
    let series = RotarySeries::from_csv(&text, &file, args.lines)?;
    plausible::plate(&text, &file)?;
    let options = SolveOptions {
        reading_noise: args.reading_noise_arcsec.map(noise).transpose()?,
        amplification_max: args.amplification_limit,
        ..SolveOptions::default()
    };
    if let Some(source) = rotary::misplaced(&series, &options) {
        return Err(RotaryFailure::MisplacedInData {
            place: file,
            source,
        }
        .into());
    }
    let solution = rotary::solve(&series, &options).map_err(|source| RotaryFailure::Unsolved {
        place: file,
        source,
    })?;
    told(args, args.plate.as_deref(), &solution, output)
}

/// The placements of a calibration that were read whole, evaluated as the calibration does.
fn of_journal(args: &RotaryArgs, output: Output) -> Ended {
    let own = [
        ("--lines", args.lines.is_some()),
        ("--plate", args.plate.is_some()),
    ];
    if let Some((option, _)) = own.into_iter().find(|it| it.1) {
        return Err(Failure::Usage {
            what: format!("{option}, and {} is a journal", name_of(&args.data)),
            help: "leave it out: a journal has its own".into(),
        });
    }
    let journal = read_journal::<PlateLog>(&args.data)?;
    let Some(plan) = &journal.log.plan else {
        return Err(Failure::Usage {
            what: format!("{}: no plate was read in it", name_of(&args.data)),
            help: "name the journal of a rotary table's `calibrate`".into(),
        });
    };
    let placements = journal.log.placements.iter();
    let placed: Vec<Placed> = placements
        .map(|it| Placed::in_plan(it, &journal.log.sweeps, plan))
        .collect();
    let options = SolveOptions {
        reading_noise: args.reading_noise_arcsec.map(noise).transpose()?,
        amplification_max: args.amplification_limit,
        ..SolveOptions::default()
    };
    let solution = fit_placed(&journal.header.axis, plan.lines, &options, &placed)?;
    told(args, Some(&plan.plate), &solution, output)
}

fn told(args: &RotaryArgs, plate: Option<&str>, solution: &Solution, output: Output) -> Ended {
    let mut value = to_json::solution(solution);
    let mut text = solution_text(solution);
    if let Some(config) = &args.save {
        let id = save(config, args, plate, solution)?;
        text += &format!(
            "\nstored as {} (use it with `truestage cal activate {} {}`)",
            short(&id),
            config.display(),
            short(&id)
        );
        value["calibration"] = json!(id);
    }
    output.result(&text, &value)
}

fn noise(arcsec: f64) -> Result<Radians, Failure> {
    if arcsec > 0.0 && arcsec.is_finite() {
        return Ok(Radians::from_arcsec(arcsec));
    }
    Err(Failure::Usage {
        what: format!("--reading-noise-arcsec is {arcsec}"),
        help: "give the standard deviation of one reading, above zero".into(),
    })
}

fn solution_text(solution: &Solution) -> String {
    let design = &solution.design;
    let largest = |values: &[Radians]| values.iter().fold(Radians::ZERO, |a, b| a.max(b.abs()));
    let content = RotaryContent::new(solution);
    let (harmonic, worst) = design.worst();
    let mut text = format!(
        "{} lines, offsets {:?}\n  {:<34} {:>9.4} ″\n  {:<34} {:>9.4} ″\n  {:<34} {:>9.4} ″ \
         ({} degrees of freedom)\n  {:<34} {:>9.4} (worst harmonic {harmonic}: {worst:.4})",
        design.lines(),
        design.offsets(),
        "largest table error",
        content.largest_error().arcsec(),
        "largest plate error",
        content.largest_plate_error().arcsec(),
        "residual rms",
        solution.residual_rms.arcsec(),
        solution.degrees_of_freedom,
        "noise amplification, rms",
        solution.noise_amplification(),
    );
    let mut stated = |values: Option<Vec<Radians>>, by: &str| {
        if let Some(values) = values {
            let largest = largest(&values).arcsec();
            text += &format!(
                "\n  {:<34} {largest:>9.4} ″ at most, {by}",
                "standard uncertainty"
            );
        }
    };
    stated(solution.uncertainty_seen(), "by the residuals");
    stated(solution.uncertainty_propagated(), "propagated");
    if solution.standard_uncertainty().is_none() {
        text += "\n  standard uncertainty unknown: two placements leave no residuals; give \
                 --reading-noise-arcsec";
    }
    text += &format!("\n  {}", content.harmonics_told());
    for it in &solution.outliers {
        let (name, residual) = (name(&it.reading), it.residual.arcsec());
        text += &format!("\n  left out: {name}, {residual:+.3} ″ from what the others predict");
    }
    for it in &solution.missing {
        text += &format!("\n  missing: {}", name(it));
    }
    text
}

fn name(reading: &Reading) -> String {
    format!("line {} at offset {}", reading.line, reading.offset)
}

/// Stores a table measured elsewhere.
fn save(
    path: &Path,
    args: &RotaryArgs,
    plate: Option<&str>,
    solution: &Solution,
) -> Result<String, Failure> {
    let loaded = config::load(path)?;
    let axes = &loaded.config.rotary;
    let axis = match (&args.axis, axes.len()) {
        (Some(axis), _) => axis.clone(),
        (None, 1) => axes.keys().next().expect("there is one").clone(),
        (None, 0) => {
            return Err(Failure::Usage {
                what: format!("{}: this machine has no rotary axis", path.display()),
                help: "a rotary error table can be stored only for a rotary axis".into(),
            });
        }
        (None, _) => {
            let names: Vec<_> = axes.keys().cloned().collect();
            return Err(Failure::Usage {
                what: "the machine has several rotary axes".into(),
                help: format!("add --axis with one of {}", names.join(", ")),
            });
        }
    };
    let mut head = rotary_head_of(&loaded, &axis, &args.data)?;
    if let Some(plate) = plate {
        head.instrument.identity = core::mem::replace(&mut head.instrument.name, plate.into());
    }
    let drawn = interpolation_of(axes[&axis].compensation.as_ref());
    let content = RotaryContent::new(solution).with_budget(solution, drawn);
    let content = content.map_err(|source| Failure::Budget {
        axis: axis.clone(),
        source,
    })?;
    if let Some(limits) = &axes[&axis].compensation {
        crate::rotary::settings::periodic_compensation(limits, &axis, content.table("just made")?)?;
    }
    let record = CalibrationRecord { head, content };
    Ok(loaded.config.machine.store().save(&record)?)
}

impl Show for RotaryContent {
    fn certifiable(&self, axis: &str) -> Result<Certifiable, Failure> {
        Certifiable::rotary(axis, self)
    }

    fn lines(&self) -> String {
        shown(self)
    }

    fn changes(&self, after: &Self) -> Option<Changes> {
        Some(changes(self, after))
    }

    fn drawn(&self, after: &Self) -> String {
        let pair = Pair {
            names: ["before", "after", "change"],
            colour: BLUE,
            before: curve(self),
            after: curve(after),
        };
        let labels = ("table angle (°)", "reading − true angle (″)");
        overlaid("Table errors", labels, &[pair])
    }
}

/// The table error by degrees, arcseconds.
fn curve(content: &RotaryContent) -> Vec<(f64, f64)> {
    let lines = content.table_error_rad.len().max(1) as f64;
    let each = content.table_error_rad.iter().enumerate();
    each.map(|(line, it)| (360.0 * line as f64 / lines, Radians(*it).arcsec()))
        .collect()
}

/// A stored table, for `cal show`.
fn shown(content: &RotaryContent) -> String {
    let arcsec = |value: f64| format!("{:.4}", Radians(value).arcsec());
    let cell = |value: Option<f64>| value.map_or("–".to_owned(), arcsec);
    let mut text = format!(
        "{} lines, plate offsets {:?}, residual rms {} ″\n  {}\n  line   table error (″)     u (″)   \
         plate (″)",
        content.lines,
        content.offsets,
        arcsec(content.residual_rms_rad),
        content.harmonics_told(),
    );
    for (line, error) in content.table_error_rad.iter().enumerate() {
        let u = content.standard_uncertainty_rad.as_ref();
        text += &format!(
            "\n  {line:>4}   {:>15}   {:>7}   {:>9}",
            arcsec(*error),
            cell(u.and_then(|it| it.get(line).copied())),
            cell(content.plate_error_rad.get(line).copied().flatten()),
        );
    }
    text + &budget::lines(uncertainty::worst(content))
}

/// Two stored tables, for `cal diff`.
fn changes(before: &RotaryContent, after: &RotaryContent) -> Changes {
    if before.lines != after.lines {
        let text = format!("  {} lines before, {} after", before.lines, after.lines);
        return (vec![text], Vec::new());
    }
    let mut lines = vec!["  line   Δ table error (″)".to_owned()];
    let mut values = Vec::new();
    let pairs = before.table_error_rad.iter().zip(&after.table_error_rad);
    for (line, (old, new)) in pairs.enumerate() {
        let change = Radians(new - old).arcsec();
        lines.push(format!("  {line:>4}   {change:>17.4}"));
        values.push(json!({"line": line, "table_error_arcsec": change}));
    }
    (lines, values)
}
