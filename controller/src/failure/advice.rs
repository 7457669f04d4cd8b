//! Which key of the configuration would let a refused table pass, and whether that is wise.

use compensator::error_table::{CompensationError, StandOff};
use units::portable::{log10, powi};
use units::{Metres, Volts};

/// What to do about a position that stands off its neighbours.
pub(super) fn of_stand_off(axis: &str, refused: &StandOff) -> String {
    let turn = if refused.is_after_turn {
        ". The stage turns just before this position: where it takes up its lost motion slowly, or arrives \
         otherwise after a short way, a longer `overrun_mm` in the section of the run helps"
    } else {
        ""
    };
    format!(
        "{turn}. Measure again, and finer around it: a knock, dirt on the scale, a loose reflector, a \
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

/// What to do about a scale beyond its limit, when none of the mistakes that are known by their factor made it.
pub(super) fn of_scale(ppm: f64) -> String {
    /// An encoder is off by less: beyond it something is set up wrongly.
    const PLAUSIBLE_PPM: f64 = 10_000.0;
    if ppm.abs() > PLAUSIBLE_PPM {
        return String::new();
    }
    format!(
        ". `scale_limit_ppm = {}` would let it pass, which is wise only where the encoder is known to be off by \
         that much",
        rounded_up(ppm.abs())
    )
}

/// What to do about a place that is not found again.
pub(super) fn of_closure(seen: Metres) -> String {
    if !seen.value().is_finite() {
        return "It is no number: the instrument said nothing usable".to_owned();
    }
    format!(
        "`closure_limit_um = {}` would let it pass, which is wise only where the stage returns to no place better",
        enough(seen.abs())
    )
}

/// Micrometres that are enough for `length`, and short to write.
pub(crate) fn enough(length: Metres) -> String {
    rounded_up(length.um())
}

/// Two digits, never less than `value`.
pub(crate) fn rounded_up(value: f64) -> String {
    // A decade of ten thousandths and less is beyond what any key takes.
    let digit = powi(10.0, log10(value.max(1e-4)).floor() as i32 - 1);
    let decimals = (-log10(digit).round()).max(0.0) as usize;
    // A hair more, so that what is printed is never the limit itself.
    format!("{:.decimals$}", ((value * 1.001) / digit).ceil() * digit)
}

/// What an input showed last.
pub(super) fn of_input(seen: Option<Volts>) -> String {
    seen.map_or("it was never sampled there".into(), |it| {
        format!("it showed {:.3} V last", it.value())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_would_let_a_refusal_pass_is_told_unless_it_is_a_mistake_of_another_size() {
        assert!(
            of_scale(-1250.6).contains("`scale_limit_ppm = 1300`"),
            "{}",
            of_scale(-1250.6)
        );
        assert_eq!(of_scale(1e6), "");
        let closure = of_closure(Metres::from_um(-1.234));
        assert!(closure.contains("`closure_limit_um = 1.3`"), "{closure}");
        assert!(of_closure(Metres(f64::NAN)).contains("no number"));
    }

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
