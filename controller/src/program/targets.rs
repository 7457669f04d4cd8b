//! Targets as a person types them: the unit is never guessed.

use serde_json::{Map, Value, json};
use units::Metres;
use units::text::length;

use crate::Failure;
use crate::program::{ApproachName, MoveArgs};

/// The targets of a move of linear axes.
pub(crate) fn axis_targets(args: &MoveArgs) -> Result<Vec<(String, Metres)>, Failure> {
    if args.targets.is_empty() {
        return Err(Failure::Usage {
            what: "`move` needs a target".into(),
            help: "write AXIS=LENGTH with a unit: x=12.5mm".into(),
        });
    }
    args.each_once()?;
    args.targets.iter().map(|text| axis_target(text)).collect()
}

/// `x=12.5mm`: the unit is never guessed.
pub(crate) fn axis_target(text: &str) -> Result<(String, Metres), Failure> {
    let usage = || Failure::Usage {
        what: format!("`{text}` is not a target"),
        help: "write AXIS=LENGTH with a unit: x=12.5mm, x=-300um, x=0.1m".into(),
    };
    let (axis, value) = text.split_once('=').ok_or_else(usage)?;
    let length = length(value).ok_or_else(usage)?;
    if axis.is_empty() {
        return Err(usage());
    }
    Ok((axis.to_owned(), length))
}

/// A move as a service is asked for it.
pub(crate) struct AskedMotion {
    /// What the request says, but for what whoever asks agrees to.
    pub(crate) request: Value,
    /// What must have its zero: axes, or the groups that they are zeroed with.
    pub(crate) zeroed: Vec<String>,
    /// What is to be said of an axis besides what the service says.
    pub(crate) notes: Vec<(String, String)>,
}

/// The move of linear axes, each by itself.
pub(crate) fn axis_motion(args: &MoveArgs) -> Result<AskedMotion, Failure> {
    let targets = axis_targets(args)?;
    let zeroed = targets.iter().map(|it| it.0.clone()).collect();
    let targets = targets
        .into_iter()
        .map(|(axis, it)| (axis, json!({"value": it.mm(), "unit": "mm"})));
    let targets: Map<String, Value> = targets.collect();
    let side = args.approach.map(|it| match it {
        ApproachName::Forward => "forward",
        ApproachName::Reverse => "reverse",
    });
    Ok(AskedMotion {
        request: json!({"targets": targets, "approach": side}),
        zeroed,
        notes: Vec::new(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_target_needs_an_axis_a_number_and_a_unit() {
        let (axis, target) = axis_target("x=12.5mm").unwrap();
        assert_eq!((axis.as_str(), target), ("x", Metres(12.5 * 1e-3)));
        assert_eq!(axis_target("y=-300um").unwrap().1, Metres(-300.0 * 1e-6));
        for text in [
            "x=12.5", "x", "=1mm", "x=1,5mm", "x=nanmm", "x=infm", "x=mm",
        ] {
            assert!(axis_target(text).is_err(), "{text}");
        }
    }
}
