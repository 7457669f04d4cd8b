//! What a certificate of three axes says: each of their error functions at its positions, the squarenesses, and what
//! warmth does to them.

use compensator::volumetric::Axis;
use compensator::volumetric::model::ErrorName;

use super::{Certifiable, column, condition, listed, quantities, real, without_uncertainty};
use crate::Failure;
use crate::volumetric::{AXES, FunctionRecord, GeometryContent, error_name};

const SQUARENESSES: [&str; 3] = [
    "squareness of y to x",
    "squareness of z to x",
    "squareness of z to y",
];

impl Certifiable {
    /// # Errors
    /// When an uncertainty is not known.
    pub(crate) fn volume(content: &GeometryContent) -> Result<Self, Failure> {
        let functions = content.functions.iter().map(function);
        let functions = functions.collect::<Option<String>>();
        let functions = functions.ok_or_else(without_uncertainty)?;
        Ok(Self {
            title: "Geometric errors of three axes, deviation = actual - target, by the letters of ISO 230-1".into(),
            results: functions + &squarenesses(content) + &warmth(content),
            conditions: temperatures(content),
            drives: content.drives.iter().map(|it| it.serial).collect(),
            remarks: remarks(content),
        })
    }
}

fn letter(axis: Axis) -> char {
    AXES[axis.index()]
}

/// What the letters of an error mean, and its unit.
fn meaning(name: &str) -> Option<(String, &'static str)> {
    Some(match error_name(name)? {
        ErrorName::Along(moving, along) => (
            format!(
                "{name}: error along {} while {} moves",
                letter(along),
                letter(moving)
            ),
            "\\metre",
        ),
        ErrorName::About(moving, about) => (
            format!(
                "{name}: turn about {} while {} moves",
                letter(about),
                letter(moving)
            ),
            "\\radian",
        ),
    })
}

/// `None` where it has no uncertainty, or is none of the errors.
fn function(it: &FunctionRecord) -> Option<String> {
    let (title, unit) = meaning(&it.name)?;
    let u = it.standard_uncertainties_si.as_deref()?;
    let at = |positions: &[f64]| column("position", "\\metre", positions, None);
    let columns = [
        at(&it.positions_m),
        column("error", unit, &it.values_si, Some(u)),
    ];
    let mut results = listed(&title, &columns.concat());
    if let Some(between) = &it.between_standard_uncertainties_si {
        let pairs = it.positions_m.windows(2);
        let middles: Vec<f64> = pairs.map(|it| f64::midpoint(it[0], it[1])).collect();
        let what = "standard uncertainty of how far the error is from the curve";
        let columns = [at(&middles), column(what, unit, between, None)];
        let title = format!("{}: half-way between its positions", it.name);
        results += &listed(&title, &columns.concat());
    }
    Some(results)
}

fn squarenesses(content: &GeometryContent) -> String {
    let values = content.squareness_rad.iter().zip(content.squareness_u_rad);
    let each = SQUARENESSES.iter().zip(values);
    let all = each.map(|(name, (value, u))| real(name, "\\radian", *value, Some(u)));
    quantities("squarenesses", &all.collect::<String>())
}

/// What was found of bending guides and expanding scales.
fn warmth(content: &GeometryContent) -> String {
    let bends = content.bends.iter().map(|it| {
        let name = format!(
            "bow of guide {} towards {} for each kelvin",
            it.axis, it.towards
        );
        let u = it.standard_uncertainty_m_per_k;
        real(&name, "\\metre\\kelvin\\tothe{-1}", it.bow_m_per_k, Some(u))
    });
    let scales = content.expansions.iter().map(|it| {
        let name = format!("expansion of scale {} for each kelvin", it.axis);
        let u = it.standard_uncertainty_per_k;
        real(&name, "\\kelvin\\tothe{-1}", it.per_k, Some(u))
    });
    let all: String = bends.chain(scales).collect();
    match all.is_empty() {
        true => all,
        false => quantities("what warmth does", &all),
    }
}

fn temperatures(content: &GeometryContent) -> String {
    let each = (0..).zip(&content.temperatures_c);
    let each = each.map(|(number, celsius): (u32, _)| {
        let name = format!("thermometer {number} of the machine, mean over the run");
        condition(&name, *celsius, "\\degreecelsius")
    });
    each.collect()
}

/// What a reader of the figures must know.
fn remarks(content: &GeometryContent) -> Vec<String> {
    let mut remarks = vec![
        "Errors that are not listed are taken as zero. Values of one function depend on each other; their covariance is \
         part of the stored calibration, and not of this certificate."
            .to_owned(),
    ];
    if let Some(agreement) = &content.agreement {
        remarks.push(format!("{}.", agreement.readings_text()));
    }
    let unknown = content.unknown.summary();
    let unknown = unknown.trim_start_matches(", ");
    if !unknown.is_empty() {
        remarks.push(format!("Not found: {unknown}."));
    }
    remarks
}
