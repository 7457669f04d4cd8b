//! Whether a calibration of a linear axis can be so.

use machine::records::Content;
use machine::records::sound::{
    COUNT_MAX, ERROR_M, ERROR_U_M, Judged, PLACE_M, as_many, counted, increasing, is, model,
    number, optional,
};

use crate::linear::LinearContent;
use crate::linear::record::{BudgetRecord, CombinedRecord};
use crate::store::budget::{ROUNDING, judge_lines, same, same_freedom};

impl Content for LinearContent {
    const KIND: &'static str = Self::KIND;

    fn summary(&self) -> String {
        format!("{} positions", self.nodes.len())
    }

    fn judge(&self) -> Judged {
        linear(self)
    }
}

fn linear(it: &LinearContent) -> Judged {
    counted("runs", it.runs as usize, 0..=COUNT_MAX)?;
    optional("closure_m", it.closure_m, &ERROR_M)?;
    optional("lost_motion_m", it.lost_motion_m, &ERROR_M)?;
    optional("lost_motion_u_m", it.lost_motion_u_m, &ERROR_U_M)?;
    optional("approach_m", it.approach_m, &PLACE_M)?;
    for (at, node) in it.nodes.iter().enumerate() {
        let place = |key: &str| format!("nodes[{at}].{key}");
        number(place("position_m"), node.position_m, &PLACE_M)?;
        optional(&place("forward_m"), node.forward_m, &ERROR_M)?;
        optional(&place("reverse_m"), node.reverse_m, &ERROR_M)?;
        optional(&place("forward_u_m"), node.forward_u_m, &ERROR_U_M)?;
        optional(&place("reverse_u_m"), node.reverse_u_m, &ERROR_U_M)?;
    }
    let positions: Vec<f64> = it.nodes.iter().map(|it| it.position_m).collect();
    increasing("nodes", &positions)?;
    let table = it.table("");
    let follows = table.as_ref().ok().and_then(|it| it.lost_motion());
    model("nodes", table)?;
    if let Some(budget) = &it.budget {
        judge_budget(it, budget)?;
    }
    let Some(stated) = it.lost_motion_m else {
        return Ok(());
    };
    let mean = follows.map(|it| it.mean.value());
    let agrees = mean.is_some_and(|it| (it - stated).abs() <= ROUNDING * (it.abs() + 1e-6));
    let expected = || match mean {
        Some(it) => format!("{it:e} m, which follows from the nodes"),
        None => "null: the nodes have one approach only".to_owned(),
    };
    is("lost_motion_m", agrees, expected, || {
        format!("{stated:e} m")
    })
}

/// A budget whose sums are not those of its lines says nothing.
fn judge_budget(it: &LinearContent, stated: &BudgetRecord) -> Judged {
    judge_lines(&stated.contributions, stated.coverage_factor)?;
    let budget = it.axis_budget("");
    let follows = budget.as_ref().ok().and_then(Option::as_ref);
    let follows = follows.map(|budget| BudgetRecord::new(budget, &it.approaches()));
    model("budget", budget)?;
    let Some(follows) = follows else {
        return Ok(());
    };
    judge_places(it, stated, &follows)
}

fn judge_places(it: &LinearContent, stated: &BudgetRecord, follows: &BudgetRecord) -> Judged {
    as_many(
        "budget.places",
        stated.places.len(),
        follows.places.len(),
        "the positions and the places between them",
    )?;
    for (at, (seen, expected)) in stated.places.iter().zip(&follows.places).enumerate() {
        let place = |key: &str| format!("budget.places[{at}].{key}");
        same(&place("position_m"), seen.position_m, expected.position_m)?;
        same_combined(&place("forward"), seen.forward, expected.forward)?;
        same_combined(&place("reverse"), seen.reverse, expected.reverse)?;
    }
    for (at, node) in it.nodes.iter().enumerate() {
        let [forward, reverse] = [
            follows.places[2 * at].forward,
            follows.places[2 * at].reverse,
        ];
        let u = |it: Option<CombinedRecord>| it.map_or(0.0, |it| it.u_m);
        let stated = |it: Option<f64>| it.unwrap_or(0.0);
        let place = |key: &str| format!("nodes[{at}].{key}");
        same(&place("forward_u_m"), stated(node.forward_u_m), u(forward))?;
        same(&place("reverse_u_m"), stated(node.reverse_u_m), u(reverse))?;
    }
    Ok(())
}

fn same_combined(
    place: &str,
    seen: Option<CombinedRecord>,
    expected: Option<CombinedRecord>,
) -> Judged {
    let (Some(seen), Some(expected)) = (seen, expected) else {
        let said = |it: bool| if it { "a value" } else { "null" }.to_owned();
        let (is_there, is_known) = (seen.is_some(), expected.is_some());
        return is(
            place,
            is_there == is_known,
            || said(is_known),
            || said(is_there),
        );
    };
    let at = |key: &str| format!("{place}.{key}");
    same(&at("u_m"), seen.u_m, expected.u_m)?;
    same(
        &at("expanded_u_m"),
        seen.expanded_u_m,
        expected.expanded_u_m,
    )?;
    let freedom = (seen.degrees_of_freedom, expected.degrees_of_freedom);
    same_freedom(&at("degrees_of_freedom"), freedom)
}
