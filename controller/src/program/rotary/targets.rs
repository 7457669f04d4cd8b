//! Where rotary axes are told to go, as a person types it, and which place that is.

use serde_json::{Map, Value, json};
use units::text::angle;
use units::{Radians, Short};

use crate::Failure;
use crate::program::targets::AskedMotion;
use crate::program::{MoveArgs, WayName};
use crate::rotary::Way;

/// Where the axes are told to go.
pub(super) fn targets(args: &MoveArgs) -> Result<Vec<(String, Radians)>, Failure> {
    if args.targets.is_empty() {
        return Err(Failure::Usage {
            what: "`move` needs a target".into(),
            help: "write AXIS=ANGLE with a unit: c=90deg".into(),
        });
    }
    args.each_once()?;
    args.targets.iter().map(|text| target(text)).collect()
}

pub(super) const fn named_way(args: &MoveArgs) -> Way {
    match args.way {
        None | Some(WayName::Shortest) => Way::Shortest,
        Some(WayName::Forward) => Way::Forward,
        Some(WayName::Reverse) => Way::Reverse,
        Some(WayName::Turns) => Way::Turns,
    }
}

/// The same as a service is asked for it.
pub(super) fn motion(args: &MoveArgs) -> Result<AskedMotion, Failure> {
    let way = named_way(args);
    let targets = targets(args)?;
    let notes = targets.iter().filter_map(|(axis, angle)| {
        let note = turns_left_out(*angle, way)?;
        Some((axis.clone(), format!("axis {axis}: {note}")))
    });
    let notes = notes.collect();
    let zeroed = targets.iter().map(|it| it.0.clone()).collect();
    let targets = targets.into_iter();
    let targets = targets.map(|(axis, it)| (axis, json!({"value": it.value(), "unit": "rad"})));
    let targets: Map<String, Value> = targets.collect();
    let way = match way {
        Way::Shortest => "shortest",
        Way::Forward => "forward",
        Way::Reverse => "reverse",
        Way::Turns => "turns",
    };
    Ok(AskedMotion {
        request: json!({"targets": targets, "way": way}),
        zeroed,
        notes,
    })
}

/// `c=90deg`: the unit is never guessed.
fn target(text: &str) -> Result<(String, Radians), Failure> {
    let parsed = text.split_once('=').and_then(|(axis, value)| {
        let named = (!axis.is_empty()).then(|| axis.to_owned());
        Some((named?, angle(value)?))
    });
    parsed.ok_or_else(|| Failure::Usage {
        what: format!("`{text}` is not a target"),
        help: "write AXIS=ANGLE with a unit: c=90deg, c=-30arcmin, c=20arcsec, c=1.5rad".into(),
    })
}

/// `to 40°, by the shortest way (400° is 1 turn more)`.
pub(super) fn to(angle: Radians, way: Way) -> String {
    let by = match way {
        Way::Turns => {
            return format!(
                "to {}°, turns counted from the zero",
                Short(angle.degrees())
            );
        }
        Way::Shortest => "by the shortest way",
        Way::Forward => "forward",
        Way::Reverse => "in reverse",
    };
    format!(
        "to {}°, {by}{}",
        Short(within_a_turn(angle)),
        turns_left_out(angle, way).map_or(String::new(), |it| format!(" ({it})"))
    )
}

/// That an angle of several turns is another one; `None` where it is not, or turns are counted.
pub(super) fn turns_left_out(angle: Radians, way: Way) -> Option<String> {
    let degrees = angle.degrees();
    let is_within = (within_a_turn(angle) - degrees).abs() < 1e-6 || way == Way::Turns;
    (!is_within).then(|| {
        format!(
            "{}° is {}°; with --way turns whole turns are made",
            Short(degrees),
            Short(within_a_turn(angle))
        )
    })
}

fn within_a_turn(angle: Radians) -> f64 {
    // What rounding leaves below zero is zero, and no whole turn.
    let degrees = (angle.degrees() * 1e9).round() / 1e9;
    degrees.rem_euclid(360.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_angle_of_several_turns_is_told_as_the_one_that_is_gone_to() {
        let told = |degrees, way| to(Radians::from_degrees(degrees), way);
        assert_eq!(told(-1e-14, Way::Shortest), "to 0°, by the shortest way");
        assert_eq!(told(40.0, Way::Shortest), "to 40°, by the shortest way");
        assert_eq!(
            told(400.0, Way::Forward),
            "to 40°, forward (400° is 40°; with --way turns whole turns are made)"
        );
        assert_eq!(
            told(-30.0, Way::Reverse),
            "to 330°, in reverse (-30° is 330°; with --way turns whole turns are made)"
        );
        assert_eq!(
            told(400.0, Way::Turns),
            "to 400°, turns counted from the zero"
        );
    }

    #[test]
    fn a_target_is_an_axis_and_an_angle_with_its_unit() {
        for (text, degrees) in [
            ("c=90deg", 90.0),
            ("c=-30arcmin", -0.5),
            ("c=36arcsec", 0.01),
            ("c=1e3mrad", 57.295_779_513_082_32),
            ("c=-725.5deg", -725.5),
        ] {
            let (axis, angle) = target(text).unwrap();
            assert_eq!(axis, "c");
            assert!((angle.degrees() - degrees).abs() < 1e-9, "{text}");
        }
        for text in [
            "c=90", "c", "=1deg", "c=1mm", "c=nandeg", "c=infrad", "c=1,5deg",
        ] {
            assert!(target(text).is_err(), "{text}");
        }
    }
}
