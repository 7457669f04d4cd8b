//! Where a platform is told to go, as a person types it.

use serde_json::{Map, Value, json};
use units::Metres;
use units::text::{angle, length};

use super::PLATFORM;
use crate::Failure;
use crate::platform::{NamedPose, PoseAsked};
use crate::program::MoveArgs;
use crate::program::targets::AskedMotion;

/// `x=1mm y=-300um theta=20arcsec`, each at most once.
pub(crate) fn parse(words: &[String]) -> Result<NamedPose, Failure> {
    if words.is_empty() {
        return Err(Failure::Usage {
            what: "`move` needs a target".into(),
            help: "write x=1mm y=-0.5mm theta=20arcsec; what is not named stays where it is".into(),
        });
    }
    let mut pose = NamedPose::default();
    for word in words {
        take(&mut pose, word).ok_or_else(|| Failure::Usage {
            what: format!("`{word}` is not part of a pose"),
            help: "write x=1mm, y=-300um, theta=20arcsec or theta=0.5deg, each once".into(),
        })?;
    }
    Ok(pose)
}

fn take(pose: &mut NamedPose, word: &str) -> Option<()> {
    let (name, value) = word.split_once('=')?;
    let is_new = match name {
        "x" => pose.x.replace(length(value)?).is_none(),
        "y" => pose.y.replace(length(value)?).is_none(),
        "theta" => pose.angle.replace(angle(value)?).is_none(),
        _ => false,
    };
    is_new.then_some(())
}

/// What the words of a `move` ask for.
pub(super) fn asked(args: &MoveArgs) -> Result<PoseAsked, Failure> {
    Ok(PoseAsked {
        named: parse(&args.targets)?,
        align: args.align,
        compensated: !args.agreed.uncompensated,
    })
}

/// The same as a service is asked for it.
pub(super) fn motion(args: &MoveArgs) -> Result<AskedMotion, Failure> {
    let NamedPose { x, y, angle } = parse(&args.targets)?;
    let length = |it: Metres| json!({"value": it.mm(), "unit": "mm"});
    let turn = angle.map(|it| json!({"value": it.value(), "unit": "rad"}));
    let parts = [("x", x.map(length)), ("y", y.map(length)), ("theta", turn)];
    let named = parts.into_iter();
    let named = named.filter_map(|(name, it)| Some((name.to_owned(), it?)));
    let targets: Map<String, Value> = named.collect();
    Ok(AskedMotion {
        request: json!({"targets": targets, "align": args.align}),
        zeroed: vec![PLATFORM.to_owned()],
        notes: Vec::new(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(words: &[&str]) -> Result<NamedPose, Failure> {
        let words: Vec<_> = words.iter().map(|it| (*it).to_owned()).collect();
        parse(&words)
    }

    #[test]
    fn a_pose_is_named_part_by_part_with_units() {
        let pose = parsed(&["x=1mm", "theta=-0.5deg"]).unwrap();
        assert_eq!((pose.x, pose.y), (Some(Metres(1e-3)), None));
        let angle = pose.angle.unwrap().value();
        assert!((angle + 0.5_f64.to_radians()).abs() < 1e-15);
        let arcsec = parsed(&["theta=20arcsec"]).unwrap().angle.unwrap();
        assert!((arcsec.arcsec() - 20.0).abs() < 1e-9);
        for words in [
            &["x=1"][..],
            &["z=1mm"],
            &["x=1mm", "x=2mm"],
            &["theta=1mm"],
            &["x=nanmm"],
            &[],
        ] {
            assert!(parsed(words).is_err(), "{words:?}");
        }
    }
}
