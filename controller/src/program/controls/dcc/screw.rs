//! What a certificate of a platform's screw says: the parameters of its model, and what that comes to at the strokes
//! of its budget.

use compensator::screw::ScrewModel;
use units::{Approach, Metres};

use super::{Certifiable, DEVIATION, column, listed, quantities, real, without_uncertainty};
use crate::Failure;
use crate::platform::ScrewContent;
use crate::store::budget::PlacesBudgetRecord;

impl Certifiable {
    /// # Errors
    /// When an uncertainty is not known.
    pub(crate) fn screw(axis: &str, content: &ScrewContent) -> Result<Self, Failure> {
        let model = content.model();
        let parameters = parameters(&model).ok_or_else(without_uncertainty)?;
        let title = format!(
            "parameters of the model, by {}, from {} strokes: deviation = offset + slope times stroke + periodic terms, \
             and the lost motion where a stroke is reached in reverse; a periodic term of number n is sine times \
             sin(2 pi n stroke / lead) + cosine times cos(2 pi n stroke / lead)",
            content.method.in_words(),
            content.rows
        );
        let mut results = quantities(&title, &parameters);
        if let Some(budget) = &content.budget {
            let sides = [Approach::Forward, Approach::Reverse];
            let of_side = sides.map(|it| stops(&model, budget, it));
            results += &of_side.concat();
        }
        Ok(Self {
            title: format!("Deviations of the strokes of screw {axis}"),
            results,
            ..Self::default()
        })
    }
}

/// `None` where one of them has no uncertainty.
fn parameters(model: &ScrewModel) -> Option<String> {
    let metres = |name: &str, value: Metres, u: Metres| {
        real(name, "\\metre", value.value(), Some(u.value()))
    };
    let mut all = metres("offset", model.offset, model.u_offset()?);
    all += &real("slope", "\\one", model.slope, Some(model.u_slope()?));
    all += &metres("lost motion", model.lost_motion, model.u_lost_motion()?);
    if let Some(lead) = model.lead {
        all += &real("lead, nominal", "\\metre", lead.value(), None);
    }
    for (at, harmonic) in model.harmonics.iter().enumerate() {
        let [u_sine, u_cosine, _] = model.u_harmonic(at)?;
        let number = harmonic.number;
        all += &metres(&format!("sine of number {number}"), harmonic.sine, u_sine);
        let cosine = format!("cosine of number {number}");
        all += &metres(&cosine, harmonic.cosine, u_cosine);
    }
    Some(all)
}

/// At every stroke of the budget that is reached so.
fn stops(model: &ScrewModel, budget: &PlacesBudgetRecord, side: Approach) -> String {
    let places = budget.places.iter();
    let places = places.filter(|it| it.side() == Some(side) && it.at_si.len() == 1);
    let (mut strokes, mut deviations, mut u) = (Vec::new(), Vec::new(), Vec::new());
    for it in places {
        strokes.push(it.at_si[0]);
        deviations.push(model.deviation(Metres(it.at_si[0]), side).value());
        u.push(it.u_si);
    }
    if strokes.is_empty() {
        return String::new();
    }
    let columns = [
        column("stroke", "\\metre", &strokes, None),
        column(DEVIATION, "\\metre", &deviations, Some(&u)),
    ];
    let approach = match side {
        Approach::Forward => "forward approach (growing coordinates)",
        Approach::Reverse => "reverse approach (falling coordinates)",
    };
    listed(
        &format!("{approach}: by the model, with the standard uncertainty of a single stop"),
        &columns.concat(),
    )
}
