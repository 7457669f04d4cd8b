//! What is said of an uncertainty budget, whatever it is of: the same figures in text and on the page.

mod input;

use core::fmt::Write as _;

use compensator::budget::COVERAGE_FACTOR;
use serde_json::{Value, json};
use units::{Approach, Short};

use crate::program::page::escape;
use crate::store::budget::{
    ContributionRecord, CorrelationRecord, PlaceBudgetRecord, PlacesBudgetRecord, told_freedom,
};

/// Contributions that are named in one line.
const NAMED: usize = 4;
/// Seconds of arc in one radian.
const ARCSECONDS: f64 = 180.0 * 3600.0 / core::f64::consts::PI;

/// How a quantity is printed.
#[derive(Clone, Copy, Debug)]
struct Figure {
    unit: &'static str,
    per_si: f64,
    decimals: usize,
}

impl Figure {
    fn bare(&self, si: f64) -> String {
        format!("{:.*}", self.decimals, si * self.per_si)
    }

    fn with_unit(&self, si: f64) -> String {
        let space = if self.unit == "″" { "" } else { " " };
        format!("{}{space}{}", self.bare(si), self.unit)
    }
}

/// In which units a budget is told.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Told {
    /// The whole, in one line.
    whole: Figure,
    /// Shares in one line.
    brief: Figure,
    /// Shares in a table.
    share: Figure,
}

const fn figure(unit: &'static str, per_si: f64, decimals: usize) -> Figure {
    Figure {
        unit,
        per_si,
        decimals,
    }
}

/// Of lengths.
pub(crate) const LENGTHS: Told = Told {
    whole: figure("µm", 1e6, 3),
    brief: figure("nm", 1e9, 0),
    share: figure("nm", 1e9, 1),
};

/// Of angles.
pub(crate) const ANGLES: Told = Told {
    whole: figure("″", ARCSECONDS, 4),
    brief: figure("″", ARCSECONDS, 4),
    share: figure("″", ARCSECONDS, 5),
};

/// A budget at its least certain place.
#[derive(Clone, Debug)]
pub(crate) struct AtWorst {
    /// Where that is, in words.
    pub(crate) place: String,
    /// From which side, where that matters.
    pub(crate) approach: Option<Approach>,
    /// Each contribution with its share there in SI units, the largest first.
    pub(crate) shares: Vec<(ContributionRecord, f64)>,
    /// What they come to.
    pub(crate) u_si: f64,
    /// Its effective degrees of freedom.
    pub(crate) degrees_of_freedom: Option<f64>,
    /// In which units it is told.
    pub(crate) told: Told,
}

impl AtWorst {
    /// That of `budget`, whose places are called as `named` says.
    pub(crate) fn of(
        budget: &PlacesBudgetRecord,
        told: Told,
        named: impl Fn(&PlaceBudgetRecord) -> String,
    ) -> Option<Self> {
        let place = budget.least_certain()?;
        let lines = budget.contributions.iter().zip(&place.sensitivities);
        let shares = lines.map(|(it, by)| (it.clone(), (it.value * by).abs()));
        let worst = Self {
            place: named(place),
            approach: place.side(),
            shares: shares.collect(),
            u_si: place.u_si,
            degrees_of_freedom: place.degrees_of_freedom,
            told,
        };
        Some(worst.sorted())
    }

    /// The same with the largest share first.
    pub(crate) fn sorted(mut self) -> Self {
        self.shares.sort_by(|a, b| b.1.total_cmp(&a.1));
        self
    }

    fn expanded_si(&self) -> f64 {
        COVERAGE_FACTOR * self.u_si
    }

    /// In one line: the largest uncertainty, and what makes it.
    pub(crate) fn sentence(&self) -> String {
        let brief = self.told.brief;
        let named = self.shares.iter().take(NAMED);
        let named = named.map(|(it, share)| format!("{} {}", it.name, brief.with_unit(*share)));
        format!(
            "uncertainty U (k = {}) up to {}, at {}; largest contributions there: {}",
            Short(COVERAGE_FACTOR),
            self.told.whole.with_unit(self.expanded_si()),
            self.place,
            named.collect::<Vec<_>>().join(", ")
        )
    }

    /// The whole budget, after something else.
    pub(crate) fn lines(&self) -> String {
        let share = self.told.share;
        let side = self
            .approach
            .map_or(String::new(), |it| format!(", {}", it.symbol()));
        let head = format!(
            "\nuncertainty budget (GUM), shares at {}{side}\n  {:<38} {:>4} {:>12} {:<9} {:>10} {:>9}  {}",
            self.place,
            "contribution",
            "type",
            "u of input",
            "",
            format!("share ({})", share.unit),
            "freedom",
            "at two places"
        );
        let each = self.shares.iter().map(|(it, own)| {
            let (number, unit) = input::told(it.value, &it.unit);
            format!(
                "\n  {:<38} {:>4} {:>12} {:<9} {:>10} {:>9}  {}",
                it.name,
                it.evaluation,
                number,
                unit,
                share.bare(*own),
                freedom(it.degrees_of_freedom, 1),
                correlation(it)
            )
        });
        let foot = format!(
            "\n  combined u {}, U (k = {}) {}, effective degrees of freedom {}",
            share.with_unit(self.u_si),
            Short(COVERAGE_FACTOR),
            share.with_unit(self.expanded_si()),
            freedom(self.degrees_of_freedom, 0)
        );
        head + &each.collect::<String>() + &foot
    }

    /// The same as a table of a page.
    pub(crate) fn table(&self) -> String {
        let share = self.told.share;
        let mut html = format!(
            "<table><tr><th>contribution</th><th>type</th><th>u of input</th><th></th>\
             <th>share at {} ({})</th><th>degrees of freedom</th><th>at two places</th></tr>",
            escape(&self.place),
            share.unit
        );
        for (it, own) in &self.shares {
            let (number, unit) = input::told(it.value, &it.unit);
            let _ = write!(
                html,
                "<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>",
                escape(&it.name),
                escape(&it.evaluation.to_string()),
                number,
                escape(unit),
                share.bare(*own),
                freedom(it.degrees_of_freedom, 1),
                correlation(it)
            );
        }
        let _ = write!(
            html,
            "<tr><td>combined u</td><td></td><td></td><td></td><td>{}</td><td>{}</td><td></td></tr>",
            share.bare(self.u_si),
            freedom(self.degrees_of_freedom, 1)
        );
        html + "</table>"
    }
}

/// Of a calibration that has no budget.
const NOT_STATED: &str = "no uncertainty budget: the calibration was made before there was one, or elsewhere, or nothing says \
                          how uncertain it is";

/// The whole budget after something else, or that there is none.
pub(crate) fn lines(worst: Option<AtWorst>) -> String {
    worst.map_or_else(|| format!("\n{NOT_STATED}"), |it| it.lines())
}

/// The same on a page.
pub(crate) fn html(worst: Option<AtWorst>) -> String {
    let told = |it: AtWorst| format!("<p>{}</p>{}", escape(&it.sentence()), it.table());
    worst.map_or_else(|| format!("<p>{}</p>", escape(NOT_STATED)), told)
}

/// For programs: the contributions as they are stored, and the `largest` uncertainty; `null` without a budget.
pub(crate) fn value_of(
    budget: Option<&PlacesBudgetRecord>,
    largest: impl Fn(&PlaceBudgetRecord) -> Value,
) -> Value {
    budget.map_or(Value::Null, |it| {
        json!({
            "coverage_factor": it.coverage_factor,
            "largest": it.least_certain().map(largest),
            "contributions": it.contributions,
        })
    })
}

/// Records of earlier programs have numbers of them that nobody reads.
fn freedom(it: Option<f64>, decimals: usize) -> String {
    told_freedom(it).map_or("∞".to_owned(), |it| format!("{it:.decimals$}"))
}

/// What a contribution does at two places, in words.
fn correlation(it: &ContributionRecord) -> &'static str {
    match it.correlation {
        CorrelationRecord::CommonScale => "common scale",
        CorrelationRecord::CommonOffset => "common offset",
        CorrelationRecord::Independent => "independent",
        CorrelationRecord::BetweenPositions => "between positions",
        CorrelationRecord::SharedReadings => "shared readings",
    }
}
