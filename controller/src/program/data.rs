//! `truestage fit` and `truestage iso230`: the mathematics on data measured elsewhere.

use std::path::{Path, PathBuf};

use clap::Subcommand;
use compensator::error_table::LinearSeries;
use compensator::error_table::{self, FitOptions, Fitted};
use compensator::hall_zero::HallSeries;
use compensator::hall_zero::fit_hall;
use compensator::iso230;
use machine::records::{CalibrationRecord, read_journal, short};
use serde_json::json;
use units::{Approach, Metres};

use crate::config::MachineConfig;
use crate::linear::measure::series_of as measured_series;
use crate::linear::{LinearContent, LinearLog};
use crate::program::data_file::head_of;
use crate::program::data_text::{is_journal, name_of, read};
use crate::program::linear::elsewhere::Elsewhere;
use crate::program::linear::uncertainty;
use crate::program::output::{Ended, Output};
use crate::program::plausible;
use crate::program::{json as to_json, text};
use crate::{Failure, config};

#[derive(Debug, Subcommand)]
pub(crate) enum FitCommand {
    /// An error table from columns run,approach,target_mm,measured_mm, or from the journal of a run.
    Linear {
        /// The data file, or a journal (*.jsonl).
        data: PathBuf,
        /// Store it as a calibration of this machine (activate it with `cal activate`).
        #[arg(long, value_name = "CONFIG")]
        save: Option<PathBuf>,
        /// The axis it belongs to; may be left out when there is only one.
        #[arg(long)]
        axis: Option<String>,
        #[command(flatten)]
        by: MeasuredBy,
    },
    /// The drift-free zero from columns position_um,peak_v,slope_v.
    Hall {
        /// The data file.
        data: PathBuf,
    },
    /// Ball screws, from columns axis,approach,stroke_um,deviation_um, or from the journal of a calibration.
    Screw(super::platform::fit::ScrewArgs),
    /// A rotary table's error, from columns offset,line,deviation_arcsec, or from the journal of a calibration.
    Rotary(super::rotary::fit::RotaryArgs),
    /// The errors of three axes, from the journal of a calibration or from columns
    /// line,reads,x_mm,y_mm,z_mm,tool_x_mm,tool_y_mm,tool_z_mm,deviation,u.
    Volumetric(super::volumetric::fit::VolumetricArgs),
}

/// With what data were measured elsewhere.
#[derive(Debug, clap::Args)]
pub(crate) struct MeasuredBy {
    /// The instrument that measured, by its name in the configuration: its corrections are made where the file has
    /// columns air_temperature_c,pressure_hpa,humidity_percent,material_temperature_c, and its uncertainty counts.
    #[arg(long, value_name = "NAME")]
    instrument: Option<String>,
    /// The configuration that describes it; may be left out beside --save.
    #[arg(long, value_name = "CONFIG")]
    config: Option<PathBuf>,
}

impl MeasuredBy {
    /// The configuration that describes the instrument, `save` where none else is named; `None` where no instrument
    /// is named.
    fn loaded(&self, save: Option<&Path>) -> Result<Option<config::Loaded>, Failure> {
        let path = self.config.as_deref().or(save);
        match (&self.instrument, path) {
            (None, _) => Ok(None),
            (Some(_), Some(path)) => Ok(Some(config::load(path)?)),
            (Some(name), None) => Err(Failure::Usage {
                what: format!("--instrument {name}: no configuration says what that is"),
                help: "add --config CONFIG".into(),
            }),
        }
    }

    /// The instrument in it.
    fn instrument<'a>(&'a self, loaded: &'a config::Loaded) -> Result<Elsewhere<'a>, Failure> {
        let name = self.instrument.as_deref().unwrap_or_default();
        let known = &loaded.config.instrument;
        let Some(instrument) = known.get(name) else {
            let names: Vec<&str> = known.keys().map(String::as_str).collect();
            return Err(Failure::Usage {
                what: format!("--instrument {name}: the configuration has no [instrument.{name}]"),
                help: format!("it has: {}", names.join(", ")),
            });
        };
        Ok(Elsewhere { name, instrument })
    }
}

/// The points of a journal, which were corrected when they were read.
fn series_of_journal(path: &Path, by: Option<&Elsewhere<'_>>) -> Result<LinearSeries, Failure> {
    if by.is_some() {
        return Err(Failure::Usage {
            what: format!(
                "--instrument is for data files, and {} is a journal",
                name_of(path)
            ),
            help: "leave it out: what a journal has was corrected when it was measured".into(),
        });
    }
    let journal = read_journal::<LinearLog>(path)?;
    measured_series(&journal.log.points)
}

/// Reads a series; columns of the environment that nothing would use are refused, as nobody could tell whether the
/// readings are corrected by them.
fn series_of(
    path: &Path,
    by: Option<&Elsewhere<'_>>,
    output: Output,
) -> Result<LinearSeries, Failure> {
    if is_journal(path) {
        return series_of_journal(path, by);
    }
    let (text, name) = (read(path)?, name_of(path));
    let series = LinearSeries::from_csv(&text, &name)?;
    if let Some(doubt) = plausible::positions(&text, &name, ["target_mm", "measured_mm"])? {
        output.note(&doubt);
    }
    match by {
        Some(by) => by.corrected(&series),
        None if series.environments().is_empty() => Ok(series),
        None => Err(Failure::Usage {
            what: format!(
                "{}: it has the environment of each reading, and nothing says what to correct by it",
                path.display()
            ),
            help: "add --instrument NAME --config CONFIG, whose section [instrument.NAME] says it; where the readings \
                   are corrected already, remove the columns"
                .into(),
        }),
    }
}

#[derive(Debug, Subcommand)]
pub(crate) enum PlanCommand {
    /// A path of three axes, or a job of one: whether the axes can follow it within what is calibrated, and how long it
    /// takes. No port is opened, nothing moves; `truestage run --dry-run` is the same.
    Path(super::run::PlanArgs),
    /// Offsets of a plate on a rotary table that amplify noise least, or the amplification of given
    /// ones.
    Rotary(super::rotary::fit::PlanArgs),
    /// Strokes that tell slope, lost motion and periodic error of a ball screw apart.
    Screw(super::platform::plan::PlanArgs),
    /// Vc and the bands of a zero search, from the curves of the Hall sensors: measured now, or of a sweep that is
    /// there.
    ///
    /// Measuring refers the axis to its limit switch and passes over the magnets; the sweep is kept.
    Zero(super::linear::plan::PlanArgs),
}

pub(crate) fn plan(command: &PlanCommand, output: Output) -> Ended {
    match command {
        PlanCommand::Path(args) => super::run::plan(args.clone(), output),
        PlanCommand::Rotary(args) => super::rotary::fit::plan(args, output),
        PlanCommand::Screw(args) => super::platform::plan::run(args, output),
        PlanCommand::Zero(args) => super::linear::plan::run(args, output),
    }
}

pub(crate) fn iso230(path: &Path, by: &MeasuredBy, output: Output) -> Ended {
    let loaded = by.loaded(None)?;
    let by = loaded.as_ref().map(|it| by.instrument(it)).transpose()?;
    let series = series_of(path, by.as_ref(), output)?;
    if is_single(&series) {
        let means = iso230::evaluate_means(&series)?;
        return output.result(&text::means(&means), &to_json::means(&means));
    }
    if let Some(approach) = iso230::only_approach(&series) {
        let figures = iso230::evaluate_one_way(&series, approach)?;
        return output.result(
            &text::one_way_figures(&figures),
            &to_json::one_way(&figures),
        );
    }
    let figures = iso230::evaluate(&series)?;
    let text = text::figures_table(&[("measured", &figures)]);
    output.result(&text, &to_json::figures(&figures))
}

/// Whether some target was measured once from a side and none never, so that there are means and no scatter.
fn is_single(series: &LinearSeries) -> bool {
    let only = iso230::only_approach(series);
    let sides = [Approach::Forward, Approach::Reverse];
    let sides = sides
        .into_iter()
        .filter(|it| only.is_none_or(|only| only == *it));
    let counts = sides.flat_map(|side| {
        let targets = series.targets().into_iter();
        targets.map(move |it| series.deviations(it, side).count())
    });
    counts.min() == Some(1)
}

pub(crate) fn fit(command: &FitCommand, output: Output) -> Ended {
    match command {
        FitCommand::Linear {
            data,
            save,
            axis,
            by,
        } => linear(data, save.as_deref(), axis.as_deref(), by, output),
        FitCommand::Hall { data } => hall(data, output),
        FitCommand::Screw(args) => super::platform::fit::run(args, output),
        FitCommand::Rotary(args) => super::rotary::fit::fit(args, output),
        FitCommand::Volumetric(args) => super::volumetric::fit::fit(args, output),
    }
}

fn linear(
    path: &Path,
    save: Option<&Path>,
    axis: Option<&str>,
    by: &MeasuredBy,
    output: Output,
) -> Ended {
    let loaded = by.loaded(save)?;
    let by = loaded.as_ref().map(|it| by.instrument(it)).transpose()?;
    let series = series_of(path, by.as_ref(), output)?;
    let name = axis.unwrap_or("x").to_owned();
    let fitted = error_table::analyse(&series, &FitOptions::default())
        .map_err(|source| Failure::Fit { axis: name, source })?;
    let mut value = to_json::fitted(&fitted);
    value["closure_um"] = json!(fitted.drift.closure.map(to_json::um));
    value["closure_um_u"] = json!(fitted.drift.u_closure.map(to_json::um));
    let mut text = format!(
        "{} positions, largest deviation {:.3} µm, {} of {} points left out",
        fitted.table.nodes().len(),
        fitted.table.largest().um(),
        fitted.robust.outliers.len(),
        series.measurements().len()
    );
    if let Some(lost_motion) = fitted.table.lost_motion() {
        let u = lost_motion.standard_uncertainty;
        text += &format!(
            "\nlost motion (reverse − forward) {:.3} µm, standard uncertainty {}",
            lost_motion.mean.um(),
            u.map_or("unknown (one run)".into(), |u| format!("{:.3} µm", u.um()))
        );
    }
    text += &format!(
        "\n{} (last run − first)",
        text::closure(fitted.drift.closure)
    );
    let judged = fitted.table.judge_neighbours(Metres::ZERO);
    text += &match judged {
        Ok(noticed) => format!("\n{}", text::noticed(noticed)),
        Err(stand_off) => format!("\nNOT PLAUSIBLE AS IT IS: {stand_off}"),
    };
    value["wrong_position_noticed_um"] = json!(judged.ok().flatten().map(to_json::um));
    value["stands_off"] = json!(judged.err().map(|it| it.to_string()));
    if let Some(config) = save {
        let (id, content) = store_fit(config, axis, path, &series, &fitted, by.as_ref())?;
        text += &format!(
            "\n{}\nstored as {}; use it with `truestage cal activate {} {}`",
            match content.budget {
                Some(_) => uncertainty::sentence(&content),
                None => NO_INSTRUMENT.to_owned(),
            },
            short(&id),
            config.display(),
            short(&id)
        );
        value["calibration"] = json!(id);
        value["uncertainty"] = json!(content.budget.as_ref().map(uncertainty::value));
    }
    output.result(&text, &value)
}

/// Why a table has no budget.
const NO_INSTRUMENT: &str =
    "no uncertainty budget: nothing says what measured; name it with --instrument NAME";

/// Stores a table measured elsewhere; with its uncertainty budget where it is known with what.
fn store_fit(
    config_path: &Path,
    axis: Option<&str>,
    data: &Path,
    series: &LinearSeries,
    fitted: &Fitted,
    by: Option<&Elsewhere<'_>>,
) -> Result<(String, LinearContent), Failure> {
    let loaded = config::load(config_path)?;
    let axes = &loaded.config.axis;
    let name = linear_axis(config_path, &loaded.config, axis)?;
    let head = head_of(&loaded, &name, data)?;
    if axes[&name].compensation.is_some() {
        crate::linear::settings::compensation(&loaded.config, &name, fitted.table.clone())?;
    }
    let mut content = LinearContent::new(&fitted.table, series.runs().len() as u32, None);
    if let Some(by) = by {
        let budget = by.budget(&name, &axes[&name], series, fitted)?;
        content = content.with_budget(&budget);
    }
    let record = CalibrationRecord { head, content };
    let id = loaded.config.machine.store().save(&record)?;
    Ok((id, record.content))
}

/// The linear axis that a table is stored for.
pub(super) fn linear_axis(
    path: &Path,
    config: &MachineConfig,
    axis: Option<&str>,
) -> Result<String, Failure> {
    let names: Vec<&str> = config.axis.keys().map(String::as_str).collect();
    let usage = |what, help| Err(Failure::Usage { what, help });
    match (axis, names.as_slice()) {
        (Some(axis), [_, ..]) => Ok(axis.to_owned()),
        (None, [only]) => Ok((*only).to_owned()),
        (None, [_, ..]) => usage(
            "the machine has several linear axes".into(),
            format!("add --axis with one of {}", names.join(", ")),
        ),
        (_, []) => {
            let rotary: Vec<&str> = config.rotary.keys().map(String::as_str).collect();
            let what = match rotary.as_slice() {
                [] => "no axis at all".to_owned(),
                _ => format!("only the rotary {}", rotary.join(", ")),
            };
            usage(
                format!(
                    "{}: a linear table is for a linear axis, and this machine has {what}",
                    path.display()
                ),
                "name the configuration of a linear axis; `truestage fit rotary` is for rotary ones"
                    .into(),
            )
        }
    }
}

/// Rounded to what is printed, so that nothing prints as `-0.0000`.
fn without_minus_zero(volts: f64) -> f64 {
    (volts * 1e4).round() / 1e4 + 0.0
}

fn hall(path: &Path, output: Output) -> Ended {
    if is_journal(path) {
        return Err(Failure::Usage {
            what: format!("{}: a zero's journal has no whole sweep", name_of(path)),
            help: "give the sweep that `plan zero` keeps (columns position_um,peak_v,slope_v)"
                .into(),
        });
    }
    let series = HallSeries::from_csv(&read(path)?, &name_of(path))?;
    let estimate = fit_hall(&series).map_err(|source| Failure::Refine {
        axis: name_of(path),
        source,
    })?;
    let text = format!(
        "origin {:.4} µm, standard uncertainty {:.4} µm ({} points)\nflanks at {:.1} and {:.1} µm, \
         mid voltage {:.4} V",
        estimate.origin.um(),
        estimate.standard_uncertainty.um(),
        estimate.points,
        estimate.left.position.um(),
        estimate.right.position.um(),
        without_minus_zero(estimate.mid_voltage.value())
    );
    output.result(&text, &to_json::zero(&estimate))
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROTARY: &str = include_str!("../../../configs/machines/rotary.toml");
    const LINEAR: &str = include_str!("../../../configs/machines/linear.toml");
    const UVW: &str = include_str!("../../../configs/machines/uvw.toml");

    #[test]
    fn what_rounds_to_nothing_has_no_sign() {
        for volts in [-0.0, -0.00004, 0.00004] {
            assert_eq!(format!("{:.4}", without_minus_zero(volts)), "0.0000");
        }
        assert_eq!(format!("{:.4}", without_minus_zero(-0.00006)), "-0.0001");
    }

    #[track_caller]
    fn check(text: &str, axis: Option<&str>, expected: Result<&str, &str>) {
        let config = config::parse(text, "m.toml").unwrap().config;
        match (linear_axis(Path::new("m.toml"), &config, axis), expected) {
            (Ok(name), Ok(wanted)) => assert_eq!(name, wanted),
            (Err(failure), Err(words)) => {
                let said = failure.to_string();
                assert!(said.contains(words), "{said}");
            }
            (seen, _) => panic!("{seen:?}"),
        }
    }

    #[test]
    fn a_linear_table_is_stored_for_a_linear_axis_or_it_is_said_that_there_is_none() {
        check(LINEAR, None, Ok("x"));
        check(UVW, None, Err("add --axis with one of u, v, w"));
        check(UVW, Some("v"), Ok("v"));
        check(ROTARY, None, Err("this machine has only the rotary c"));
        check(
            ROTARY,
            Some("c"),
            Err("a linear table is for a linear axis"),
        );
    }
}
