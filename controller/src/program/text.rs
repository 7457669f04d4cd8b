//! What a person reads on a terminal.

use compensator::budget::COVERAGE_FACTOR;
use compensator::error_table::FALSE_ALARMS;
use compensator::iso230::{Conformity, Figures, Means, OneWayFigures};
use compensator::screw::ScrewModel;
use units::{Approach, Metres, Several, Short};

use crate::config::MachineConfig;
use crate::linear::settings;

/// A row of a table of figures: name, symbol, and the figure of each column.
pub(crate) type Row = (&'static str, &'static str, fn(&Figures) -> Metres);

pub(crate) const ROWS: &[Row] = &[
    ("accuracy, bidirectional", "A", |it| {
        it.accuracy.bidirectional
    }),
    ("accuracy, forward", "A↑", |it| it.accuracy.forward),
    ("accuracy, reverse", "A↓", |it| it.accuracy.reverse),
    ("repeatability, bidirectional", "R", |it| {
        it.repeatability.bidirectional
    }),
    ("repeatability, forward", "R↑", |it| {
        it.repeatability.forward
    }),
    ("repeatability, reverse", "R↓", |it| {
        it.repeatability.reverse
    }),
    ("systematic deviation", "E", |it| {
        it.systematic_deviation.bidirectional
    }),
    ("range of the mean deviation", "M", |it| {
        it.mean_bidirectional_deviation_range
    }),
    ("reversal value", "B", |it| it.reversal_value),
    ("mean reversal value", "B̄", |it| it.mean_reversal_value),
];

/// ISO 230-2 figures side by side, micrometres.
pub(crate) fn figures_table(columns: &[(&str, &Figures)]) -> String {
    let mut text = format!("{:<30} {:>3}", "ISO 230-2 (µm)", "");
    for (title, _) in columns {
        text += &format!(" {title:>22}");
    }
    for (name, symbol, figure) in ROWS {
        // A combining mark takes no column of its own.
        let width = if symbol.contains('\u{304}') { 4 } else { 3 };
        text += &format!("\n  {name:<28} {symbol:>width$}");
        for (_, figures) in columns {
            text += &format!(" {:>22.3}", figure(figures).um());
        }
    }
    let lacks = columns
        .iter()
        .filter_map(|(title, figures)| Some(format!("\n{title}: {}", lack(&figures.conformity)?)));
    text + &lacks.collect::<String>()
}

/// `A = 0.276 µm, tolerance 2.000 µm: within`.
pub(crate) fn verdict(figure: &str, tolerance: &str, is_within: bool) -> String {
    let verdict = if is_within { "within" } else { "NOT WITHIN" };
    format!("{figure}, tolerance {tolerance}: {verdict}")
}

/// A verdict of what is known to `expanded` (with k = 2), and whether it is good; `beyond` the tolerance, so uncertain a
/// figure shows nothing: `A = 0.220 µm, tolerance 2.000 µm: within, but U = 31.300 µm (k = 2) is larger than …`.
pub(crate) fn sure_verdict(
    [figure, tolerance, expanded]: [&str; 3],
    is_within: bool,
    is_beyond: bool,
) -> (String, bool) {
    let text = verdict(figure, tolerance, is_within);
    match is_within && is_beyond {
        false => (text, is_within),
        true => {
            let doubt = format!("U = {expanded} (k = {})", Short(COVERAGE_FACTOR));
            (
                format!("{text}, but {doubt} is larger than the tolerance: {SHOWS_NOTHING}"),
                false,
            )
        }
    }
}

/// How a verdict ends that nobody can rely upon.
pub(crate) const SHOWS_NOTHING: &str = "this run cannot show it";

/// Unidirectional ISO 230-2 figures, micrometres.
pub(crate) fn one_way_figures(figures: &OneWayFigures) -> String {
    let (side, arrow) = match figures.approach {
        Approach::Forward => ("forward", '↑'),
        Approach::Reverse => ("reverse", '↓'),
    };
    let rows = [
        ("accuracy", 'A', figures.accuracy),
        ("repeatability", 'R', figures.repeatability),
        ("systematic deviation", 'E', figures.systematic_deviation),
    ];
    let mut text = format!("{:<30} {:>3} {:>22}", "ISO 230-2 (µm)", "", "measured");
    for (name, symbol, figure) in rows {
        let name = format!("{name}, {side}");
        text += &format!("\n  {name:<28}  {symbol}{arrow} {:>22.3}", figure.um());
    }
    text += "\nall targets were approached from one side: figures of both sides (A, R, E, M, B) are not stated";
    let lack = lack(&figures.conformity).map(|it| format!("\nmeasured: {it}"));
    text + &lack.unwrap_or_default()
}

/// What ISO 230-2 can be told of single measurements.
pub(crate) fn means(means: &Means) -> String {
    let rows = [
        ("systematic deviation", "E", means.systematic_deviation),
        ("systematic deviation, forward", "E↑", means.forward),
        ("systematic deviation, reverse", "E↓", means.reverse),
        (
            "range of the mean deviation",
            "M",
            means.mean_bidirectional_deviation_range,
        ),
        ("reversal value", "B", means.reversal_value),
        ("mean reversal value", "B̄", means.mean_reversal_value),
    ];
    let mut text = format!("{:<32} {:>3} {:>22}", "ISO 230-2 (µm)", "", "measured");
    for (name, symbol, figure) in rows {
        if let Some(figure) = figure {
            // A combining mark takes no column of its own.
            let width = if symbol.contains('\u{304}') { 4 } else { 3 };
            text += &format!("\n  {name:<30} {symbol:>width$} {:>22.3}", figure.um());
        }
    }
    text += "\nrepeatability (R) and accuracy (A) are not stated: a target was measured only once from a side, which \
             has no standard deviation; nor is a closure, which needs a second run";
    if means.systematic_deviation.is_none() {
        text += "\nall targets were approached from one side: figures of both sides (E, M, B) are not stated";
    }
    let lack = lack(&means.conformity).map(|it| format!("\nmeasured: {it}"));
    text + &lack.unwrap_or_default()
}

/// What a measurement lacks of the standard's: the figures are computed all the same.
pub(crate) fn lack(conformity: &Conformity) -> Option<String> {
    let Conformity {
        runs,
        runs_wanted,
        targets,
        targets_wanted,
    } = conformity;
    let few_runs = format!(
        "{} from each side, the standard requires {runs_wanted}",
        Several(*runs, "run")
    );
    let few_targets = format!(
        "{}, the standard requires {targets_wanted} over this range",
        Several(*targets, "target")
    );
    let lacks: Vec<String> = [
        (runs < runs_wanted, few_runs),
        (targets < targets_wanted, few_targets),
    ]
    .into_iter()
    .filter_map(|(is_so, text)| is_so.then_some(text))
    .collect();
    (!lacks.is_empty()).then(|| format!("DOES NOT CONFORM TO ISO 230-2: {}", lacks.join("; ")))
}

/// The same of the run of a calibration, which nobody makes as a test by the standard.
pub(crate) fn no_test(conformity: &Conformity) -> Option<String> {
    let it = conformity;
    let runs = format!("{} runs from each side ({} here)", it.runs_wanted, it.runs);
    let targets = format!(
        "{} targets over this range ({} here)",
        it.targets_wanted, it.targets
    );
    let takes = match (it.runs < it.runs_wanted, it.targets < it.targets_wanted) {
        (false, false) => return None,
        (true, false) => runs,
        (false, true) => targets,
        (true, true) => format!("{runs} and {targets}"),
    };
    Some(format!(
        "a calibration, no test by ISO 230-2, which takes {takes}"
    ))
}

/// A closure in words; a single run of a file has none.
pub(crate) fn closure(closure: Option<Metres>) -> String {
    closure.map_or("no closure".into(), |it| {
        format!("closure {:.3} µm", it.um())
    })
}

/// Which positions of its tables each linear axis accepts, and why.
pub(crate) fn table_notes(config: &MachineConfig) -> Vec<String> {
    let axes = config.axis.iter();
    let own = axes.filter_map(|(name, it)| Some((name, it.compensation.as_ref()?)));
    own.map(|(name, limits)| {
        let harmless = settings::harmless(config, name).um();
        let by = match limits.jump_limit_um {
            None => "half of what its instrument counts; `jump_limit_um` is not needed",
            Some(_) => {
                "its `jump_limit_um`: wise only where finer positions showed that the stage is \
                 like that, because a wrong position within this limit is corrected like a right \
                 one"
            }
        };
        format!(
            "axis {name}: a position of a table is refused when it stands off its neighbours by \
             more than occurs in one of {:.0} good tables and by more than {harmless:.3} µm ({by})",
            1.0 / FALSE_ALARMS
        )
    })
    .collect()
}

/// How wrong a position of a table could be without being noticed.
pub(crate) fn noticed(smallest: Option<Metres>) -> String {
    smallest.map_or_else(
        || "too few positions to notice a wrong one by its neighbours".into(),
        |error| {
            format!(
                "one position wrong by more than {:.2} µm would have been noticed by its neighbours",
                error.um()
            )
        },
    )
}

/// One term of a screw's model.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ScrewTerm {
    /// What it is.
    pub(crate) name: String,
    /// How large, in its unit.
    pub(crate) value: f64,
    /// Its standard uncertainty, where anything was repeated.
    pub(crate) standard_uncertainty: Option<f64>,
    /// The unit of both.
    pub(crate) unit: &'static str,
}

/// The terms of a screw's model, in the units people read.
pub(crate) fn screw_terms(model: &ScrewModel) -> Vec<ScrewTerm> {
    let term = |name: &str, value, standard_uncertainty, unit| ScrewTerm {
        name: name.to_owned(),
        value,
        standard_uncertainty,
        unit,
    };
    let um = |length: Option<Metres>| length.map(Metres::um);
    let (offset, lost_motion) = (model.offset.um(), model.lost_motion.um());
    let u_slope = model.u_slope().map(|u| u * 1e3);
    let mut terms = vec![
        term("slope", model.slope * 1e3, u_slope, "µm/mm"),
        term("lost motion", lost_motion, um(model.u_lost_motion()), "µm"),
        term("offset", offset, um(model.u_offset()), "µm"),
    ];
    for (index, harmonic) in model.harmonics.iter().enumerate() {
        let name = format!("amplitude, {} per turn", harmonic.number);
        let u = model.u_harmonic(index).map(|[.., u]| u);
        terms.push(term(&name, harmonic.amplitude().um(), um(u), "µm"));
    }
    terms
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figures(runs: u32, targets: u32) -> Figures {
        let mut rows = String::from("run,approach,target_mm,measured_mm\n");
        for run in 1..=runs {
            let row = |sign, mm: u32| format!("{run},{sign},{mm},{mm}.00{run}\n");
            rows.extend((1..=targets).map(|it| row('+', it * 10)));
            rows.extend((1..=targets).rev().map(|it| row('-', it * 10)));
        }
        let series = compensator::error_table::LinearSeries::from_csv(&rows, "rows").unwrap();
        compensator::iso230::evaluate(&series).unwrap()
    }

    #[test]
    fn what_a_measurement_lacks_of_the_standard_is_said_below_its_figures() {
        let (poor, good) = (figures(3, 4), figures(5, 5));
        let text = figures_table(&[("as found", &poor), ("as left", &good)]);
        let told = "\nas found: DOES NOT CONFORM TO ISO 230-2: 3 runs from each side, the standard \
                    requires 5; 4 targets, the standard requires 5 over this range";
        assert!(text.ends_with(told), "{text}");
        assert!(!figures_table(&[("as left", &good)]).contains("DOES NOT CONFORM"));
    }

    #[test]
    fn of_one_side_no_figure_of_both_is_stated() {
        let mut rows = String::from("run,approach,target_mm,measured_mm\n");
        for run in 1..=5 {
            rows.extend(
                (0..5)
                    .rev()
                    .map(|it| format!("{run},-,{it}0,{it}0.00{run}\n")),
            );
        }
        let series = compensator::error_table::LinearSeries::from_csv(&rows, "rows").unwrap();
        let side = compensator::iso230::only_approach(&series).unwrap();
        let figures = compensator::iso230::evaluate_one_way(&series, side).unwrap();
        let text = one_way_figures(&figures);
        for (symbol, um) in [("A↓", "6.325"), ("R↓", "6.325"), ("E↓", "0.000")] {
            let is_stated = |line: &str| line.contains(symbol) && line.ends_with(um);
            assert!(text.lines().any(is_stated), "{text}");
        }
        assert!(!text.contains("DOES NOT CONFORM"), "{text}");
        let value = crate::program::json::one_way(&figures);
        assert_eq!(value["accuracy"], serde_json::json!({"reverse": 6.3246}));
        assert_eq!(value.get("reversal_value"), None);
    }
}
