//! Whether a calibration of a linear axis can be so.

use machine::records::Content;
use machine::records::sound::{
    COUNT_MAX, ERROR_M, ERROR_U_M, Judged, PLACE_M, counted, increasing, is, model, number,
    optional,
};

use crate::linear::LinearContent;

/// A figure that follows from others may differ by rounding.
const ROUNDING: f64 = 1e-9;

impl Content for LinearContent {
    const KIND: &'static str = Self::KIND;

    fn summary(&self) -> String {
        format!("{} nodes", self.nodes.len())
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
