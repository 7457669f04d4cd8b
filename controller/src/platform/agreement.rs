//! Whether the screws of a platform agree with each other: a fourth one can contradict the rest.

use compensator::platform::{Platform, Pose};
use compensator::screw::ScrewMemory;
use units::Metres;

use crate::failure::Failure;
use crate::platform::failure::{Contradiction, PlatformFailure};
use crate::platform::handle::AlignmentPlatform;
use crate::platform::state::Screw;

impl AlignmentPlatform<'_> {
    /// Refuses screws that would stand, by their models, where no pose has them together.
    pub(super) fn check_planned(&self, near: Pose, after: &[ScrewMemory]) -> Result<(), Failure> {
        let screws = &self.state.screws;
        let nuts = screws.iter().zip(after).map(|(screw, it)| nut(screw, it));
        self.check_agreement(near, &nuts.collect::<Vec<_>>(), "; nothing was moved")
    }

    /// Refuses what the encoders say after a move in the same way.
    pub(super) fn check_standing(&self, near: Pose) -> Result<(), Failure> {
        let mut nuts = Vec::new();
        for screw in &self.state.screws {
            let memory = screw.memory.unwrap_or_default();
            let here = self.core.reading(&screw.axis)?.map(|it| it.position);
            let off = here.map_or(Metres::ZERO, |here| here - memory.set_point);
            nuts.push(nut(screw, &memory) + off);
        }
        self.check_agreement(near, &nuts, ", after the move")
    }

    /// Refuses strokes that no pose has.
    pub(super) fn check_agreement(
        &self,
        near: Pose,
        strokes: &[Metres],
        consequence: &'static str,
    ) -> Result<(), Failure> {
        let Some(limit_um) = self.config.inconsistency_limit_um else {
            return Ok(());
        };
        let kinematics = &self.state.kinematics;
        agreed(
            kinematics,
            near,
            strokes,
            Metres::from_um(limit_um),
            consequence,
        )?;
        Ok(())
    }
}

/// Where the nut is, by the screw's model where there is one; the middle of what is possible.
fn nut(screw: &Screw, memory: &ScrewMemory) -> Metres {
    match &screw.compensation {
        None => memory.set_point,
        Some(compensation) => {
            let (low, high) = compensation.nut_at(memory);
            low + (high - low) / 2.0
        }
    }
}

fn agreed(
    kinematics: &Platform,
    near: Pose,
    strokes: &[Metres],
    limit: Metres,
    consequence: &'static str,
) -> Result<(), PlatformFailure> {
    let nearest = kinematics.forward_near(strokes, near)?;
    // A comparison with NaN is false, so that it is refused too.
    let is_agreed = nearest.inconsistency <= limit;
    if is_agreed {
        return Ok(());
    }
    let names = kinematics.actuators().iter().map(|it| it.name.clone());
    let off = strokes.iter().zip(kinematics.strokes(nearest.pose));
    Err(PlatformFailure::Contradiction {
        screws: Contradiction(names.zip(off.map(|(given, own)| *given - own)).collect()),
        seen: nearest.inconsistency,
        limit,
        consequence,
    })
}

#[cfg(test)]
mod tests {
    use compensator::platform::{Actuator, Point};

    use super::*;
    use crate::failure::of_kind::KindFailure;

    fn four() -> Platform {
        let place = |name: &str, x: f64, y: f64, direction| Actuator {
            name: name.into(),
            point: Point {
                x: Metres::from_mm(x),
                y: Metres::from_mm(y),
            },
            direction,
            stroke_min: Metres::from_mm(-5.0),
            stroke_max: Metres::from_mm(5.0),
        };
        let actuators = vec![
            place("u", -80.0, 80.0, [1.0, 0.0]),
            place("v", -80.0, -80.0, [1.0, 0.0]),
            place("w", -80.0, 0.0, [0.0, 1.0]),
            place("r", 80.0, 0.0, [0.0, 1.0]),
        ];
        Platform::new(actuators, Platform::CONDITION_MAX).expect("it holds")
    }

    #[test]
    fn four_screws_that_contradict_each_other_are_named_with_how_much() {
        let platform = four();
        let pose = Pose {
            x: Metres::from_mm(1.0),
            y: Metres::from_mm(-0.5),
            angle: units::Radians(0.004),
        };
        let mut strokes = platform.strokes(pose);
        let limit = Metres::from_um(1.0);
        assert!(agreed(&platform, pose, &strokes, limit, "").is_ok());
        strokes[3] += Metres::from_um(8.0);
        let error = agreed(&platform, pose, &strokes, limit, "; nothing was moved").unwrap_err();
        let text = error.to_string();
        // A quarter on each: the contradiction is one of all four.
        for part in [
            "u ",
            "v ",
            "w ",
            "r +2.0",
            "limit is 1.000",
            "nothing was moved",
        ] {
            assert!(text.contains(part), "`{part}` is not in {text}");
        }
        assert_eq!(error.exit_code(), 3);
        assert!(agreed(&platform, pose, &strokes, Metres::from_um(2.1), "").is_ok());
    }
}
