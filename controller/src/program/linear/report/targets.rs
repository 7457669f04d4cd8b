//! What each target showed in a verification: means, scatter, reversal, repeatability, and how uncertain the position
//! is there.

use core::fmt::Write as _;

use units::Metres;

use super::Section;
use crate::linear::CriterionEntry;

/// A row for each target; `criterion` says how uncertain the corrected position is, which only a verification states.
pub(super) fn html(section: &Section<'_>) -> String {
    let criterion = section.criterion.filter(|it| !it.targets.is_empty());
    let uncertain = match criterion {
        Some(_) => "<th>U ↑, k = 2 (µm)</th><th>U ↓, k = 2 (µm)</th>",
        None => "",
    };
    let mut html = format!(
        "<table><tr><th>target (mm)</th><th>mean ↑ (µm)</th><th>mean ↓ (µm)</th><th>s ↑ (µm)</th>\
         <th>s ↓ (µm)</th><th>B (µm)</th><th>R (µm)</th>{uncertain}</tr>",
    );
    for it in &section.figures.targets {
        let _ = write!(html, "<tr><td>{:.3}</td>", it.target.mm());
        let figures = [
            it.mean_forward,
            it.mean_reverse,
            it.s_forward,
            it.s_reverse,
            it.reversal_value,
            it.repeatability,
        ];
        for figure in figures {
            let _ = write!(html, "<td>{:.3}</td>", figure.um());
        }
        if let Some(criterion) = criterion {
            let [up, down] = expanded(criterion, it.target);
            let _ = write!(html, "<td>{up}</td><td>{down}</td>");
        }
        html += "</tr>";
    }
    html + "</table>"
}

/// The expanded uncertainty at a target, approached from either side.
fn expanded(criterion: &CriterionEntry, target: Metres) -> [String; 2] {
    let mut targets = criterion.targets.iter();
    let own = targets.find(|it| it.position_m == target.value());
    let sides = own.map_or([None, None], |it| [it.forward, it.reverse]);
    sides.map(|it| {
        it.map_or("–".to_owned(), |it| {
            format!("{:.3}", Metres(it.expanded_u_m).um())
        })
    })
}
