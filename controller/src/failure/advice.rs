//! Which key of the configuration would let a refused table pass, and whether that is wise.

use compensator::error_table::{CompensationError, StandOff};
use units::Metres;
use units::portable::{log10, powi};

/// What to do about a position that stands off its neighbours.
pub(super) fn of_stand_off(axis: &str, refused: &StandOff) -> String {
    format!(
        ". Measure again, and finer around it: a knock, dirt on the scale, a loose reflector, a \
         count lost in every run? `jump_limit_um = {}` in [axis.{axis}.compensation] would accept \
         it, which is wise only when finer positions show the same place again: what is accepted is \
         taken for the stage",
        enough(refused.seen.abs())
    )
}

/// What to do about a table beyond a limit of the configuration.
pub(super) fn of_limit(axis: &str, refused: &CompensationError) -> String {
    let (key, number) = match refused {
        CompensationError::TooLarge { seen, .. } => ("size_limit_um", enough(seen.abs())),
        CompensationError::TooSteep { seen, .. } if *seen < 0.5 => {
            ("slope_limit", rounded_up(*seen))
        }
        CompensationError::TooSteep { .. }
        | CompensationError::NotInvertible { .. }
        | CompensationError::Limit { .. } => return String::new(),
    };
    format!(
        "; `{key} = {number}` in [axis.{axis}.compensation] would accept it, which is wise only \
         where an error like that is expected of this stage"
    )
}

/// Micrometres that are enough for `length`, and short to write.
fn enough(length: Metres) -> String {
    rounded_up(length.um())
}

/// Two digits, never less than `value`.
fn rounded_up(value: f64) -> String {
    // A decade of ten thousandths and less is beyond what any key takes.
    let digit = powi(10.0, log10(value.max(1e-4)).floor() as i32 - 1);
    let decimals = (-log10(digit).round()).max(0.0) as usize;
    // A hair more, so that what is printed is never the limit itself.
    format!("{:.decimals$}", ((value * 1.001) / digit).ceil() * digit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_number_that_would_do_is_short_and_enough() {
        for (value, expected) in [
            (5.041, "5.1"),
            (0.314_159, "0.32"),
            (70.0, "71"),
            (0.012_3, "0.013"),
            (123.4, "130"),
        ] {
            assert_eq!(rounded_up(value), expected);
        }
    }
}
