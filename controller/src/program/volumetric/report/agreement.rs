//! How well the readings of three axes agree: the figures that were stored, and what is left of each
//! reading by the same curves.

use compensator::volumetric::function::Shape;

use crate::program::page::chart::{BLUE, Mark, Series, chart};
use crate::program::page::escape;
use crate::volumetric::calibrate::VolumetricEvaluated;
use crate::volumetric::{AgreementRecord, GeometryContent, VolumeLog};

/// The figures as they are stored.
pub(crate) fn figures(agreement: &AgreementRecord) -> String {
    format!(
        "<p>{}; {}.</p>",
        agreement.readings_text(),
        agreement.tool_text()
    )
}

/// What is left of each reading, evaluated again from what was written down by the curves that were
/// used; `stored` is what was made from it.
pub(crate) fn residuals(read: &VolumeLog, stored: Option<&GeometryContent>) -> String {
    let Some(shape) = shape(read, stored) else {
        return "<p class=\"note\">This run does not say how errors run between their nodes, and no \
                calibration was made from it: its readings are not evaluated here.</p>"
            .to_owned();
    };
    let evaluated = match VolumetricEvaluated::of(read, shape) {
        Ok(it) => it,
        Err(failure) => {
            let why = escape(&failure.to_string());
            return format!(
                "<p class=\"note\">No errors can be found from these readings: {why}.</p>"
            );
        }
    };
    let points = (0..).zip(&evaluated.found.residuals);
    let points = points.map(|(at, residual): (u32, _)| (f64::from(at), *residual));
    let dots = [Series {
        name: "one reading",
        colour: BLUE,
        mark: Mark::Dots,
        points: points.collect(),
    }];
    let mut html = "<h2>Residuals</h2>".to_owned();
    if stored.is_none_or(|it| it.agreement.is_none()) {
        html += &figures(&evaluated.agreement());
    }
    if let Some(scatter) = &evaluated.scatter {
        html += &format!("<p>Not to be used: {}.</p>", escape(&scatter.to_string()));
    }
    let labels = ("reading", "(reading − model) / u");
    html + &format!(
        "<figure>{}</figure>",
        chart("Residuals", labels, &dots, None)
    )
}

pub(crate) fn shape(read: &VolumeLog, stored: Option<&GeometryContent>) -> Option<Shape> {
    let planned = read.plan.as_ref().and_then(|it| it.shape);
    let used = stored
        .and_then(|it| it.functions.first())
        .map(|it| it.shape);
    planned.or(used).map(Shape::from)
}
