//! `truestage fit screw`: lead error and lost motion of ball screws, and what `cal` shows of them.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use compensator::screw::{
    self, FitError, FitOptions, Fitted, Limits, Rule, ScrewCompensation, ScrewModel, StrokeOutlier,
};
use compensator::screw::{AxisStrokes, ScatterParts, Stroke, StrokeSeries};
use machine::records::{CalibrationRecord, read_journal, short};
use serde_json::{Value, json};
use units::{Approach, Metres, Short};

use crate::platform::PlatformConfig;
use crate::platform::PlatformFailure;
use crate::platform::PlatformLog;
use crate::platform::{ScrewContent, ScrewMethodName};
use crate::program::budget;
use crate::program::controls::dcc::Certifiable;
use crate::program::data_file::head_of;
use crate::program::data_text::{is_journal, name_of, read};
use crate::program::output::{Ended, Output};
use crate::program::page::chart::{BLUE, ORANGE};
use crate::program::page::compare::{Pair, overlaid};
use crate::program::platform::report::curve;
use crate::program::platform::{json as to_json, uncertainty};
use crate::program::show::{Changes, Show};
use crate::program::text;
use crate::program::text::ScrewTerm;
use crate::{Failure, config};

/// What `truestage fit screw` is told.
#[derive(Debug, Args)]
pub(crate) struct ScrewArgs {
    /// The data file; an axis may have any number of rows. Or the journal of a `calibrate` (*.jsonl).
    data: PathBuf,
    /// The patent's means, or least squares over all strokes with forward and reverse apart.
    #[arg(long, value_enum, default_value_t = Method::LeastSquares)]
    method: Method,
    /// Travel per turn: least squares looks for periodic errors within it.
    #[arg(long, value_name = "MM")]
    lead_mm: Option<f64>,
    /// Store one calibration for each axis of this machine (use it with `cal activate`).
    #[arg(long, value_name = "CONFIG")]
    save: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Method {
    Patent,
    LeastSquares,
}

impl Method {
    const fn name(self) -> &'static str {
        match self {
            Self::Patent => "patent",
            Self::LeastSquares => "least-squares",
        }
    }
}

/// One axis, estimated.
struct Estimated<'a> {
    axis: &'a str,
    rows: usize,
    model: ScrewModel,
    outliers: Vec<StrokeOutlier>,
    parts: Option<ScatterParts>,
    strokes: &'a [Stroke],
    text: String,
    value: Value,
}

pub(crate) fn run(args: &ScrewArgs, output: Output) -> Ended {
    let file = name_of(&args.data);
    let series = series_of(&args.data, &file)?;
    if args.method == Method::Patent && args.lead_mm.is_some() {
        output.note("note: the patent's method has no periodic error; --lead-mm has no effect");
    }
    let mut axes = Vec::new();
    for strokes in series.axes() {
        let failed = |source| PlatformFailure::Screw {
            place: strokes
                .line
                .map_or(file.clone(), |line| format!("{file}:{line}")),
            axis: strokes.axis.clone(),
            source,
        };
        axes.push(match args.method {
            Method::Patent => patent(strokes).map_err(failed)?,
            Method::LeastSquares => least_squares(strokes, args.lead_mm).map_err(failed)?,
        });
    }
    let saved = match &args.save {
        Some(config) => save(config, args, &axes)?,
        None => Vec::new(),
    };
    let mut lines = Vec::new();
    let mut values = serde_json::Map::new();
    for (i, mut it) in axes.into_iter().enumerate() {
        lines.push(format!("axis {}: {}", it.axis, it.text));
        if let Some(id) = saved.get(i) {
            lines.push(format!("  stored as {}", short(id)));
            it.value["calibration"] = json!(id);
        }
        values.insert(it.axis.to_owned(), it.value);
    }
    if let Some(config) = &args.save {
        lines.push(format!(
            "use them with `truestage cal activate {} ID`",
            config.display()
        ));
    }
    let value = json!({"method": args.method.name(), "axes": values});
    output.result(&lines.join("\n"), &value)
}

/// The strokes of a data file, or those that a calibration made.
fn series_of(path: &Path, file: &str) -> Result<StrokeSeries, Failure> {
    if !is_journal(path) {
        return Ok(StrokeSeries::from_csv(&read(path)?, file)?);
    }
    let journal = read_journal::<PlatformLog>(path)?;
    let strokes = journal.log.strokes.iter();
    let strokes = strokes.map(|it| (it.axis.clone(), it.stroke()));
    StrokeSeries::new(strokes.collect()).map_err(|source| Failure::Usage {
        what: format!("{file}: {source}"),
        help: "name the journal of a platform's `calibrate`".into(),
    })
}

fn patent(strokes: &AxisStrokes) -> Result<Estimated<'_>, FitError> {
    let estimate = screw::patent::estimate(&strokes.strokes)?;
    let u = estimate.uncertainty;
    let slope = with_u(estimate.slope * 1e3, u.map(|it| it.slope * 1e3), "µm/mm");
    let lost_motion = with_u(estimate.mean_all.um(), u.map(|it| it.mean_all.um()), "µm");
    let text = format!(
        "{} strokes from {} to {} um, residual {:.3} µm\n  {:<24} {slope}\n  {:<24} {lost_motion}\n  \
         u: of the repetitions alone; errors that the screw always has at a stroke come on top",
        estimate.rows,
        Short(estimate.at_m.um()),
        Short(estimate.at_n.um()),
        estimate.residual.um(),
        "slope",
        "mean lost motion",
    );
    Ok(Estimated {
        axis: &strokes.axis,
        rows: estimate.rows,
        model: estimate.model(),
        outliers: Vec::new(),
        parts: estimate.parts(),
        strokes: &strokes.strokes,
        text,
        value: to_json::patent(&estimate),
    })
}

fn least_squares(strokes: &AxisStrokes, lead_mm: Option<f64>) -> Result<Estimated<'_>, FitError> {
    let options = FitOptions {
        lead: lead_mm.map(Metres::from_mm),
        ..FitOptions::default()
    };
    let fitted = screw::fit(&strokes.strokes, &options)?;
    let rows = strokes.strokes.len();
    let mut text = format!(
        "{rows} strokes from {} to {} um, residual {:.3} µm{}",
        Short(fitted.model.first.um()),
        Short(fitted.model.last.um()),
        fitted.residual.um(),
        model_text(&fitted.model)
    );
    text += &scatter_text(&fitted);
    if options.lead.is_none() {
        text += "\n  periodic errors were not looked for: give --lead-mm";
    }
    if !fitted.unobservable.is_empty() {
        text += &format!(
            "\n  not observable in these strokes: harmonics {:?}",
            fitted.unobservable
        );
    }
    text += &leaks_text(&fitted);
    text += &outlier_lines(&fitted.outliers, &strokes.lines);
    Ok(Estimated {
        axis: &strokes.axis,
        rows,
        value: to_json::fitted(&fitted, rows, &strokes.lines),
        model: fitted.model,
        outliers: fitted.outliers,
        parts: fitted.parts,
        strokes: &strokes.strokes,
        text,
    })
}

/// What the scatter is made of, and what the uncertainties were judged by.
fn scatter_text(fitted: &Fitted) -> String {
    let scatter = &fitted.scatter;
    let mut text = format!(
        "\n  repetitions scatter by {:.3} µm; the screw's own error at a stroke, which they do not \
         average out, is {:.3} µm",
        scatter.repeatability.um(),
        scatter.stroke.um()
    );
    text += &match fitted.degrees_of_freedom {
        0 => "\n  so few different strokes leave none to judge slope and offset by: their \
              uncertainties are unknown; measure more different strokes"
            .to_owned(),
        freedom => format!(
            "\n  u: twice it holds in 95 % of cases, by {freedom} degree(s) of freedom between \
             strokes (slope, offset, amplitudes) and {} within them (lost motion)",
            fitted.degrees_of_freedom_within
        ),
    };
    if matches!(fitted.degrees_of_freedom, 1..FEW_BETWEEN) {
        text += "\n  more different strokes, not more repetitions, would make the slope surer";
    }
    text
}

/// With fewer degrees of freedom u is widened by a tenth and more.
const FEW_BETWEEN: usize = 14;

/// What harmonics that are not in the model would do to the slope.
fn leaks_text(fitted: &Fitted) -> String {
    let modelled = |number| fitted.model.harmonics.iter().any(|it| it.number == number);
    let left_out = fitted.leaks.iter().filter(|it| !modelled(it.number));
    let lines = left_out.map(|it| {
        format!(
            "\n  1 µm of harmonic {}, which is not in the model, would shift the slope by up to \
             {:.4} µm/mm",
            it.number,
            it.slope_per_amplitude * 1e-3
        )
    });
    lines.collect()
}

/// Each row that was left out, by its line in the file where there is one.
pub(crate) fn outlier_lines(outliers: &[StrokeOutlier], lines: &[usize]) -> String {
    let named = outliers.iter().map(|it| {
        let line = lines.get(it.index);
        format!(
            "\n  left out: {}approach {}, stroke {} um, deviation {:.3} µm, {:+.3} µm off the others",
            line.map_or(String::new(), |line| format!("line {line}, ")),
            it.stroke.approach.symbol(),
            Short(it.stroke.stroke.um()),
            it.stroke.deviation.um(),
            it.residual.um()
        )
    });
    named.collect()
}

/// One line for each term.
fn model_text(model: &ScrewModel) -> String {
    let lines = text::screw_terms(model).into_iter().map(|it| {
        let value = with_u(it.value, it.standard_uncertainty, it.unit);
        format!("\n  {:<24} {value}", it.name)
    });
    lines.collect()
}

fn with_u(value: f64, u: Option<f64>, unit: &str) -> String {
    let u = u.map_or("u unknown".into(), |u| format!("u {u:.4}"));
    format!("{value:>9.4} {unit} ({u})")
}

/// Stores every axis, or none: all are judged before the first is written.
fn save(path: &Path, args: &ScrewArgs, axes: &[Estimated<'_>]) -> Result<Vec<String>, Failure> {
    let loaded = config::load(path)?;
    let (method, rule) = match args.method {
        Method::Patent => (ScrewMethodName::Patent, Rule::Patent),
        Method::LeastSquares => (ScrewMethodName::LeastSquares, Rule::Engagement),
    };
    let mut records = Vec::new();
    for it in axes {
        let head = head_of(&loaded, it.axis, &args.data)?;
        let limits = limits_of(&loaded, it.axis);
        ScrewCompensation::new(it.model.clone(), limits, rule).map_err(|source| {
            let axis = it.axis.to_owned();
            PlatformFailure::Compensation { axis, source }
        })?;
        let rows = u32::try_from(it.rows).unwrap_or(u32::MAX);
        let content = ScrewContent::new(&it.model, method, rows).without(&it.outliers);
        let content = content.with_budget(it.parts.as_ref(), it.strokes);
        let content = content.map_err(|source| Failure::Budget {
            axis: it.axis.to_owned(),
            source,
        })?;
        records.push(CalibrationRecord { head, content });
    }
    let store = loaded.config.machine.store();
    let ids: Result<_, _> = records.iter().map(|record| store.save(record)).collect();
    Ok(ids?)
}

/// The limits of the axis, or, where it has none, those without which no model can be applied.
fn limits_of(loaded: &config::Loaded, axis: &str) -> Limits {
    let config = &loaded.config;
    let own = config
        .axis
        .get(axis)
        .and_then(|it| it.compensation.as_ref());
    let own = own.map(|it| (it.size_limit_um, it.slope_limit));
    let pushes = |it: &&PlatformConfig| it.actuator.iter().any(|it| it.axis == axis);
    let platform = config.platform.as_ref().filter(pushes);
    let platform = platform.and_then(|it| it.compensation.as_ref());
    let configured = own.or(platform.map(|it| (it.size_limit_um, it.slope_limit)));
    Limits {
        size: configured.map_or(Metres(f64::MAX), |(size_um, _)| Metres::from_um(size_um)),
        slope: configured.map_or(1.0_f64.next_down(), |(_, slope)| slope),
        extrapolation: Metres::ZERO,
        resolution: Metres::ZERO,
    }
}

impl Show for ScrewContent {
    fn certifiable(&self, axis: &str) -> Result<Certifiable, Failure> {
        Certifiable::screw(axis, self)
    }

    fn lines(&self) -> String {
        shown(self)
    }

    fn changes(&self, after: &Self) -> Option<Changes> {
        Some(changes(self, after))
    }

    fn drawn(&self, after: &Self) -> String {
        let pair = |names, colour, approach| Pair {
            names,
            colour,
            before: curve(&self.model(), approach),
            after: curve(&after.model(), approach),
        };
        let pairs = [
            pair(["before ↑", "after ↑", "↑"], BLUE, Approach::Forward),
            pair(["before ↓", "after ↓", "↓"], ORANGE, Approach::Reverse),
        ];
        overlaid(
            "Models of the screw",
            ("stroke (mm)", "deviation (µm)"),
            &pairs,
        )
    }
}

/// A stored model, for `cal show`.
fn shown(content: &ScrewContent) -> String {
    let scatter = content.scatter_m.map_or(String::new(), |it| {
        format!(", a single stop scatters by {:.3} µm", Metres(it).um())
    });
    let left_out = match content.outliers.len() {
        0 => String::new(),
        count => format!(", {count} of them left out"),
    };
    format!(
        "{} strokes{left_out} from {} to {} mm by {}{scatter}{}",
        content.rows,
        Short(Metres(content.first_stroke_m).mm()),
        Short(Metres(content.last_stroke_m).mm()),
        content.method.in_words(),
        model_text(&content.model()),
    ) + &budget::lines(uncertainty::worst(content))
}

/// Two stored models, for `cal diff`.
fn changes(before: &ScrewContent, after: &ScrewContent) -> Changes {
    let (old, new) = (
        text::screw_terms(&before.model()),
        text::screw_terms(&after.model()),
    );
    let value = |terms: &[ScrewTerm], name: &str| {
        terms
            .iter()
            .find(|it| it.name == name)
            .map_or(0.0, |it| it.value)
    };
    let mut lines = vec!["  term                             Δ".to_owned()];
    let mut values = Vec::new();
    // What is in one model only counts as zero in the other.
    let gone = old
        .iter()
        .filter(|it| new.iter().all(|other| other.name != it.name));
    for it in new.iter().chain(gone) {
        let change = value(&new, &it.name) - value(&old, &it.name);
        lines.push(format!("  {:<24} {change:>9.4} {}", it.name, it.unit));
        values.push(json!({"term": it.name, "unit": it.unit, "change": change}));
    }
    (lines, values)
}
