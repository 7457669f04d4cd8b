//! Where a platform is told to go, as a person types it: what is not named stays where it is.

use units::text::{angle, length};
use units::{Metres, Radians};

use crate::Failure;
use crate::platform::Pose;
use crate::program::MoveArgs;
use crate::program::targets::AskedMotion;

/// A pose of which not every part need be named.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct NamedPose {
    x: Option<Metres>,
    y: Option<Metres>,
    angle: Option<Radians>,
}

impl NamedPose {
    /// `x=1mm y=-300um theta=20arcsec`, each at most once.
    pub(crate) fn parse(words: &[String]) -> Result<Self, Failure> {
        if words.is_empty() {
            return Err(Failure::Usage {
                what: "`move` needs a target".into(),
                help: "write x=1mm y=-0.5mm theta=20arcsec; what is not named stays where it is"
                    .into(),
            });
        }
        let mut pose = Self::default();
        for word in words {
            pose.take(word).ok_or_else(|| Failure::Usage {
                what: format!("`{word}` is not part of a pose"),
                help: "write x=1mm, y=-300um, theta=20arcsec or theta=0.5deg, each once".into(),
            })?;
        }
        Ok(pose)
    }

    fn take(&mut self, word: &str) -> Option<()> {
        let (name, value) = word.split_once('=')?;
        let is_new = match name {
            "x" => self.x.replace(length(value)?).is_none(),
            "y" => self.y.replace(length(value)?).is_none(),
            "theta" => self.angle.replace(angle(value)?).is_none(),
            _ => false,
        };
        is_new.then_some(())
    }

    /// The parts that are not named.
    pub(crate) fn unnamed(&self) -> Vec<&'static str> {
        let named = [
            ("x", self.x.is_some()),
            ("y", self.y.is_some()),
            ("theta", self.angle.is_some()),
        ];
        let unnamed = named.iter().filter(|(_, is_named)| !is_named);
        unnamed.map(|(name, _)| *name).collect()
    }

    /// The whole pose, where what is not named is that of `here`.
    pub(crate) fn from(&self, here: Pose) -> Pose {
        Pose {
            x: self.x.unwrap_or(here.x),
            y: self.y.unwrap_or(here.y),
            angle: self.angle.unwrap_or(here.angle),
        }
    }
}

/// The same as a service is asked for it.
pub(super) fn motion(args: &MoveArgs) -> Result<AskedMotion, Failure> {
    NamedPose::parse(&args.targets)?;
    Err(Failure::Usage {
        what: "a service keeps this machine, and does not move platforms".into(),
        help: "end the service first; then this verb moves it".into(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(words: &[&str]) -> Result<NamedPose, Failure> {
        let words: Vec<_> = words.iter().map(|it| (*it).to_owned()).collect();
        NamedPose::parse(&words)
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

    #[test]
    fn what_is_not_named_stays_where_it_is() {
        let here = Pose {
            x: Metres(1e-3),
            y: Metres(2e-3),
            angle: Radians(3e-3),
        };
        let pose = parsed(&["y=0mm"]).unwrap();
        assert_eq!(pose.unnamed(), ["x", "theta"]);
        let y = Metres::ZERO;
        assert_eq!(pose.from(here), Pose { y, ..here });
    }
}
