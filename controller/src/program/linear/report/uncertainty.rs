//! The uncertainty budget of a linear axis on its page: U over the position, and what makes it.

use units::Metres;

use crate::linear::record::{BudgetRecord, CombinedRecord, PlaceRecord};
use crate::linear::{LinearContent, ZeroEntry};
use crate::program::linear::uncertainty;
use crate::program::page::chart::{BLUE, Mark, ORANGE, Series, chart};
use crate::program::page::escape;

/// Less than this share of itself is no variation that a curve could show.
const VARIES: f64 = 0.01;

/// U over the position where it varies, then each contribution.
pub(super) fn html(content: &LinearContent) -> String {
    let Some(budget) = &content.budget else {
        return format!("<p>{}</p>", escape(uncertainty::NOT_STATED));
    };
    let mut html = format!("<p>{}</p>", escape(&uncertainty::sentence(content)));
    if varies(budget) {
        html += &format!("<figure>{}</figure>", curve(budget));
    }
    html + &uncertainty::worst(content).map_or_else(String::new, |it| it.table())
}

/// The budget of the last zero.
pub(super) fn of_last<'z>(zeros: impl Iterator<Item = &'z ZeroEntry>) -> String {
    let last = zeros.last().and_then(uncertainty::of_zero);
    last.map_or_else(String::new, |it| it.table())
}

fn expanded(budget: &BudgetRecord) -> impl Iterator<Item = f64> {
    let each = budget.places.iter();
    each.flat_map(|it| [it.forward, it.reverse])
        .flatten()
        .map(|it| Metres(it.expanded_u_m).um())
}

fn varies(budget: &BudgetRecord) -> bool {
    let least = expanded(budget).fold(f64::INFINITY, f64::min);
    let most = expanded(budget).fold(0.0, f64::max);
    most - least > VARIES * most
}

fn curve(budget: &BudgetRecord) -> String {
    type Side = fn(&PlaceRecord) -> Option<CombinedRecord>;
    let sides: [(&str, &str, Side); 2] = [
        ("forward ↑", BLUE, |it| it.forward),
        ("reverse ↓", ORANGE, |it| it.reverse),
    ];
    let series = sides.map(|(name, colour, side)| {
        let places = budget.places.iter();
        let points = places.filter_map(|it| {
            let u = Metres(side(it)?.expanded_u_m).um();
            Some((Metres(it.position_m).mm(), u))
        });
        Series::new(name, colour, Mark::Line, points.collect())
    });
    chart(
        "Expanded uncertainty of the deviation",
        ("position (mm)", "U, k = 2 (µm)"),
        &series,
        None,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOLDEN: &str = include_str!("../../../../golden/linear_budget.json");

    fn golden() -> LinearContent {
        let record: machine::records::CalibrationRecord<LinearContent> =
            serde_json::from_str(GOLDEN).expect("a golden file is read");
        record.content
    }

    #[test]
    fn page_and_text_state_the_same_largest_uncertainty_and_contributions() {
        let content = golden();
        let (html, text) = (html(&content), uncertainty::lines(&content));
        assert_eq!(html.matches("<polyline").count(), 2);
        // 11.5e-6/K · 0.1 K · 58.5 mm, half-way to the last position.
        for said in ["material temperature", "67.3", "103.3", "common scale"] {
            assert!(html.contains(said) && text.contains(said), "{said}: {text}");
        }
        assert!(html.contains(&uncertainty::sentence(&content)));
        // What is listed is all: the shares come to the whole.
        let at = uncertainty::worst(&content).unwrap();
        let sum: f64 = at.shares.iter().map(|(_, it)| it * it).sum();
        assert!((sum.sqrt() / at.u_si - 1.0).abs() < 1e-9);
    }

    #[test]
    fn a_curve_is_drawn_where_the_uncertainty_varies_only() {
        let mut content = golden();
        let budget = content.budget.as_mut().unwrap();
        let first = budget.places[0];
        for place in &mut budget.places {
            (place.forward, place.reverse) = (first.forward, first.reverse);
        }
        assert!(!html(&content).contains("<svg"));
        content.budget = None;
        assert!(html(&content).contains("no uncertainty budget"));
    }
}
