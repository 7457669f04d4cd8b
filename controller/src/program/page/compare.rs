//! Two runs, or two calibrations, side by side: their heads, their figures with the differences, and what both show at
//! one scale.

use core::fmt::Write as _;

use serde_json::{Value, json};

use super::chart::{Mark, Series, axes_of, chart, drawn};
use super::head::{Fact, facts};
use super::{document, escape};
use crate::program::json::rounded;

/// A figure of both.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Compared {
    pub(crate) name: String,
    pub(crate) unit: &'static str,
    /// Of the first and of the second; `None` where it has none.
    pub(crate) values: [Option<f64>; 2],
}

impl Compared {
    /// The second less the first.
    fn difference(&self) -> Option<f64> {
        let [before, after] = self.values;
        Some(after? - before?)
    }
}

/// What is shown of two runs.
#[derive(Clone, Debug, Default)]
pub(crate) struct Comparison {
    pub(crate) title: String,
    /// The heads of both.
    pub(crate) heads: [Vec<Fact>; 2],
    pub(crate) figures: Vec<Compared>,
    /// Sections with what both show at one scale.
    pub(crate) body: String,
}

/// What figures are rounded to: ten thousandths of their units, as everywhere.
const PER_UNIT: f64 = 1e4;

impl Comparison {
    /// For programs.
    pub(crate) fn value(&self) -> Value {
        let number = |it: Option<f64>| it.map(|it| rounded(it, PER_UNIT));
        let each = self.figures.iter().map(|it| {
            json!({
                "name": it.name,
                "unit": it.unit,
                "first": number(it.values[0]),
                "second": number(it.values[1]),
                "difference": number(it.difference()),
            })
        });
        each.collect()
    }

    /// The page.
    pub(crate) fn html(&self) -> String {
        let [first, second] = &self.heads;
        let body = format!(
            "<h2>Figures</h2>{}{}<h2>The first run</h2>{}<h2>The second run</h2>{}",
            self.table(),
            self.body,
            facts(first),
            facts(second)
        );
        document(&self.title, &body, "A difference is second − first.")
    }

    fn table(&self) -> String {
        let mut html = String::from(
            "<table><tr><th>figure</th><th>first</th><th>second</th><th>difference</th></tr>",
        );
        let number = |it: Option<f64>| it.map_or("–".to_owned(), |it| format!("{it:.3}"));
        for it in &self.figures {
            let difference = it.difference();
            let difference = difference.map_or("–".to_owned(), |it| format!("{it:+.3}"));
            let _ = write!(
                html,
                "<tr><td>{} ({})</td><td>{}</td><td>{}</td><td>{difference}</td></tr>",
                escape(&it.name),
                escape(it.unit),
                number(it.values[0]),
                number(it.values[1])
            );
        }
        html + "</table>"
    }
}

/// What two runs show, below each other on axes that show both.
pub(crate) fn at_one_scale(
    title: &str,
    labels: (&str, &str),
    [first, second]: [Vec<Series>; 2],
) -> String {
    let all: Vec<Series> = first.iter().chain(&second).cloned().collect();
    if all.iter().all(|it| it.points.is_empty()) {
        return String::new();
    }
    let axes = axes_of(&all, core::iter::once(0.0));
    let of = |which: &str, series: &[Series]| {
        let title = format!("{title}, {which} run");
        let svg = drawn(&title, labels, series, (&axes, &[]));
        format!("<figure><figcaption>{which} run</figcaption>{svg}</figure>")
    };
    format!(
        "<h2>{} at one scale</h2>{}{}",
        escape(title),
        of("first", &first),
        of("second", &second)
    )
}

/// `second` less `first` at the places that both have, in the order of the places.
pub(crate) fn differences(first: &[(f64, f64)], second: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let at = |place: f64| first.iter().find(|it| it.0 == place);
    let each = second.iter();
    each.filter_map(|(place, value)| Some((*place, value - at(*place)?.1)))
        .collect()
}

/// A curve before and after.
pub(crate) struct Pair {
    /// What it is called before, after, and as a change.
    pub(crate) names: [&'static str; 3],
    pub(crate) colour: &'static str,
    pub(crate) before: Vec<(f64, f64)>,
    pub(crate) after: Vec<(f64, f64)>,
}

/// Curves before and after over each other, then their changes at the places that both have.
pub(crate) fn overlaid(title: &str, labels: (&str, &str), pairs: &[Pair]) -> String {
    let curves = pairs.iter().flat_map(|it| {
        let [before, after, _] = it.names;
        [
            Series::new(before, it.colour, Mark::Dashes, it.before.clone()),
            Series::new(after, it.colour, Mark::Line, it.after.clone()),
        ]
    });
    let curves: Vec<_> = curves.filter(|it| !it.points.is_empty()).collect();
    let changes = pairs.iter().map(|it| {
        let change = differences(&it.before, &it.after);
        Series::new(it.names[2], it.colour, Mark::Line, change)
    });
    let changes: Vec<_> = changes.filter(|it| !it.points.is_empty()).collect();
    let section = |title: &str, series: &[Series]| match series.is_empty() {
        true => String::new(),
        false => format!(
            "<h2>{}</h2><figure>{}</figure>",
            escape(title),
            chart(title, labels, series, None)
        ),
    };
    section(title, &curves) + &section(&format!("{title}: change"), &changes)
}
