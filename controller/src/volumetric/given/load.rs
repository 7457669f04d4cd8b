//! Reading references that were given: a table, or functions.

use std::path::Path;

use compensator::volumetric::{GivenReference, Polynomial, ReferenceOf, ReferenceSeries};
use units::{Metres, Radians};

use super::config::{ReferenceDetectorName, ReferenceFunctionConfig, ReferenceFunctionsConfig};
use super::judge::{Unfit, unfit, without};
use crate::config::judge::{Finding, Judge};
use crate::config::{MachineConfig, read};
use crate::failure::Failure;
use crate::volumetric::settings::volume_axis;
use crate::volumetric::{GivenName, VolumetricConfig};

/// How far what is stored may be from a function that was given: a nanometre, or a nanoradian.
const DRAWN_WITHIN: f64 = 1e-9;

/// What `text`, the file called `name`, gives: one reference for each reading of each detector of the machine.
///
/// # Errors
/// When the file cannot be read, gives what this machine does not have or cannot show, or leaves something out:
/// with file and line.
pub(super) fn load(
    machine: &MachineConfig,
    config: &VolumetricConfig,
    (text, name): (&str, &str),
) -> Result<(Vec<GivenReference>, GivenName), Failure> {
    let ending = Path::new(name).extension();
    if ending.is_some_and(|it| it.eq_ignore_ascii_case("toml")) {
        let judge = |it: &ReferenceFunctionsConfig| judge_functions(machine, config, it);
        let own: ReferenceFunctionsConfig = read(text, name, judge)?;
        let given = own.function.iter().filter_map(|it| drawn(it).ok());
        return Ok((given.collect(), GivenName::Functions));
    }
    let series = ReferenceSeries::from_csv(text, name)?;
    let given = series.references();
    let refused = |place: String, Unfit { cause, help }| Failure::Usage {
        what: format!("{place}: {cause}; nothing was stored"),
        help,
    };
    for it in given {
        if let Some(why) = unfit(machine, config, it) {
            return Err(refused(format!("{name}:{}", it.row), why));
        }
    }
    match without(config, given) {
        Some(why) => Err(refused(name.to_owned(), why)),
        None => Ok((given.to_vec(), GivenName::Table)),
    }
}

fn judge_functions(
    machine: &MachineConfig,
    config: &VolumetricConfig,
    own: &ReferenceFunctionsConfig,
) -> Vec<Finding> {
    let mut findings = Vec::new();
    let mut given: Vec<GivenReference> = Vec::new();
    for (number, it) in own.function.iter().enumerate() {
        let judge = &mut Judge::at(format!("function.{number}"), &mut findings);
        let drawn = match drawn(it) {
            Ok(drawn) => drawn,
            Err(Wrong { key, cause, help }) => {
                judge.say(key, cause, help);
                continue;
            }
        };
        let is_same = |before: &GivenReference| (before.axis, before.of) == (drawn.axis, drawn.of);
        if given.iter().any(is_same) {
            let cause = format!("{}, {}: given twice", drawn.axis, drawn.of);
            judge.say("", cause, "remove one");
        }
        if let Some(Unfit { cause, help }) = unfit(machine, config, &drawn) {
            judge.say("", cause, help);
        }
        given.push(drawn);
    }
    // What could not be read may be what is missing.
    if findings.is_empty()
        && let Some(Unfit { cause, help }) = without(config, &given)
    {
        Judge::at("function".into(), &mut findings).say("", cause, help);
    }
    findings
}

/// A key that is wrong, and why.
struct Wrong {
    key: &'static str,
    cause: String,
    help: &'static str,
}

fn wrong<T>(key: &'static str, cause: impl Into<String>, help: &'static str) -> Result<T, Wrong> {
    let cause = cause.into();
    Err(Wrong { key, cause, help })
}

/// A function as a table that a spline runs through like it.
fn drawn(own: &ReferenceFunctionConfig) -> Result<GivenReference, Wrong> {
    let axis = volume_axis(own.axis);
    let of = reading(own)?;
    let coefficients = coefficients(own)?;
    let given = |positions, values| GivenReference {
        axis,
        of,
        positions,
        values,
        row: 0,
    };
    let ends = (own.from_mm, own.to_mm);
    if let ReferenceOf::End(_) = of {
        return match (&*coefficients, ends) {
            ([value], (None, None)) => Ok(given(Vec::new(), vec![*value])),
            ([_], _) => wrong(
                "from_mm",
                "the detector at the end of the beam stands still",
                "remove `from_mm` and `to_mm`",
            ),
            _ => wrong(
                "coefficients_um",
                "the detector at the end of the beam stands still",
                "give one coefficient: what it reads",
            ),
        };
    }
    let (Some(from_mm), Some(to_mm)) = ends else {
        let help = "give `from_mm` and `to_mm`: the positions that the function holds for";
        return wrong("", "it is not said where this function holds", help);
    };
    // A NaN, which TOML can write, is not in order, either.
    let is_in_order = from_mm < to_mm;
    if !is_in_order {
        return wrong("to_mm", "it is not above `from_mm`", "raise it");
    }
    let polynomial = Polynomial {
        origin: Metres::from_mm(own.origin_mm),
        scale: Metres::from_mm(own.scale_mm),
        coefficients,
        from: Metres::from_mm(from_mm),
        to: Metres::from_mm(to_mm),
    };
    match polynomial.drawn(DRAWN_WITHIN) {
        Some((positions, values)) => Ok(given(positions, values)),
        None => wrong(
            "",
            "this function is too large or too steep to be a reference",
            "are `origin_mm` and `scale_mm` right? Higher powers need a `scale_mm` as long as the travel",
        ),
    }
}

/// Which reading a function is of.
fn reading(own: &ReferenceFunctionConfig) -> Result<ReferenceOf, Wrong> {
    let axis = volume_axis(own.axis);
    let along = own.along.map(volume_axis);
    let across = along.filter(|it| *it != axis);
    match (own.detector, along, across) {
        (ReferenceDetectorName::Slide, _, Some(along)) => Ok(ReferenceOf::Slide(along)),
        (ReferenceDetectorName::End, _, Some(along)) => Ok(ReferenceOf::End(along)),
        (ReferenceDetectorName::Roll, None, _) => Ok(ReferenceOf::Roll),
        (ReferenceDetectorName::Roll, Some(_), _) => {
            wrong("along", "a roll has no direction", "remove it")
        }
        (ReferenceDetectorName::Slide | ReferenceDetectorName::End, _, None) => {
            let [first, second] = axis.others();
            wrong(
                if along.is_some() { "along" } else { "" },
                format!("the detectors of {axis} read along {first} and along {second}"),
                "give one of them as `along`",
            )
        }
    }
}

/// The coefficients in metres or radians.
fn coefficients(own: &ReferenceFunctionConfig) -> Result<Vec<f64>, Wrong> {
    let um = |it: &f64| Metres::from_um(*it).value();
    let arcsec = |it: &f64| Radians::from_arcsec(*it).value();
    match (own.detector, &own.coefficients_um, &own.coefficients_arcsec) {
        (ReferenceDetectorName::Roll, None, Some(own)) => Ok(own.iter().map(arcsec).collect()),
        (ReferenceDetectorName::Slide | ReferenceDetectorName::End, Some(own), None) => {
            Ok(own.iter().map(um).collect())
        }
        (ReferenceDetectorName::Roll, ..) => wrong(
            "",
            "a roll is an angle",
            "give `coefficients_arcsec` and no `coefficients_um`",
        ),
        (ReferenceDetectorName::Slide | ReferenceDetectorName::End, ..) => wrong(
            "",
            "where a detector sees its beam is a length",
            "give `coefficients_um` and no `coefficients_arcsec`",
        ),
    }
}
