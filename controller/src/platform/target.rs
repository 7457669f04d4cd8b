//! Where a platform is told to go: what is not named stays where it is.

use compensator::platform::Pose;
use units::{Metres, Radians};

use crate::platform::config::PARTS;
use crate::runs::{GroupMove, Part, Place};

/// The same, with what each is.
pub(super) fn parts() -> Vec<Part> {
    let part = |name: &str| Part {
        turns: name == PARTS[2],
        ..Part::of_length(name)
    };
    PARTS.map(part).to_vec()
}

/// Each part of `pose` by its name.
pub(super) fn places(pose: Pose) -> [(&'static str, Place); 3] {
    let [x, y, theta] = PARTS;
    [
        (x, Place::Length(pose.x)),
        (y, Place::Length(pose.y)),
        (theta, Place::Angle(pose.angle)),
    ]
}

/// A pose of which not every part need be named.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct NamedPose {
    pub(crate) x: Option<Metres>,
    pub(crate) y: Option<Metres>,
    pub(crate) angle: Option<Radians>,
}

impl NamedPose {
    /// What `asked` names of it.
    pub(super) fn of(asked: &GroupMove) -> Self {
        let [x, y, theta] = PARTS;
        Self {
            x: asked.length(x),
            y: asked.length(y),
            angle: asked.angle(theta),
        }
    }

    /// The parts that are not named.
    pub(crate) fn unnamed(&self) -> Vec<&'static str> {
        let named = [self.x.is_some(), self.y.is_some(), self.angle.is_some()];
        let parts = PARTS.into_iter().zip(named);
        parts.filter(|it| !it.1).map(|it| it.0).collect()
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_named_stays_where_it_is() {
        let here = Pose {
            x: Metres(1e-3),
            y: Metres(2e-3),
            angle: Radians(3e-3),
        };
        let pose = NamedPose {
            y: Some(Metres::ZERO),
            ..NamedPose::default()
        };
        assert_eq!(pose.unnamed(), ["x", "theta"]);
        let y = Metres::ZERO;
        assert_eq!(pose.from(here), Pose { y, ..here });
    }
}
