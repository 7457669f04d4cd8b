//! The speed that is asked for of an axis, in what it moves in.

use units::{AxisSpeed, MetresPerSecond, RadiansPerSecond};

use crate::problem::{Code, Problem};

/// Of `axis`, which goes along a way.
pub(super) fn along(axis: &str, speed: AxisSpeed) -> Result<MetresPerSecond, Problem> {
    match speed {
        AxisSpeed::Linear(it) => Ok(it),
        AxisSpeed::Angular(_) => Err(other_unit(axis, "goes along a way", speed, "2mm/s")),
    }
}

/// Of `axis`, which turns.
pub(super) fn round(axis: &str, speed: AxisSpeed) -> Result<RadiansPerSecond, Problem> {
    match speed {
        AxisSpeed::Angular(it) => Ok(it),
        AxisSpeed::Linear(_) => Err(other_unit(axis, "turns", speed, "5deg/s")),
    }
}

fn other_unit(axis: &str, does: &str, seen: AxisSpeed, expected: &str) -> Problem {
    let what = format!("`speed`: axis {axis} {does}, and {seen} is no speed of it");
    let help = format!("give one as \"{expected}\"; nothing was moved");
    Problem::new(Code::NotOffered, what, help)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_speed_of_the_other_kind_is_refused_with_what_was_expected() {
        let (linear, angular) = (MetresPerSecond(2e-3), RadiansPerSecond(1.0));
        assert_eq!(along("x", linear.into()), Ok(linear));
        assert_eq!(round("c", angular.into()), Ok(angular));
        let said = along("x", angular.into()).unwrap_err().to_string();
        assert!(said.contains("axis x") && said.contains("2mm/s"), "{said}");
        let said = round("c", linear.into()).unwrap_err().to_string();
        assert!(said.contains("2 mm/s") && said.contains("5deg/s"), "{said}");
    }
}
