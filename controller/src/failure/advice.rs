//! Advice for what was refused: what to look for. No advice widens a limit.

use compensator::error_table::{CompensationError, StandOff};
use units::portable::{log10, powi};
use units::{Metres, Short, Volts};

/// What to look for where a position stands off its neighbours.
pub(super) fn of_stand_off(refused: &StandOff) -> &'static str {
    if refused.is_after_turn {
        return ". The stage turns just before this position: where it takes up its lost motion slowly, or arrives \
                otherwise after a short way, a longer `overrun_mm` in the section of the run helps. Look for a knock, dirt \
                on the scale, a loose reflector, a count lost in every run, then measure again, and finer around it";
    }
    ". Look for a knock, dirt on the scale, a loose reflector, a count lost in every run, then measure again, and finer \
     around it"
}

/// What to look for where a table is beyond a limit of the configuration.
pub(super) const fn of_limit(refused: &CompensationError) -> &'static str {
    match refused {
        CompensationError::TooLarge { .. } => {
            ". Look for a wrong unit or sign of the instrument, a loose reflector, another optical configuration, then \
             measure again"
        }
        CompensationError::TooSteep { .. } => {
            ". Look for a knock, a count lost on the way, a loose reflector, then measure again, and finer around it"
        }
        CompensationError::NotInvertible { .. } | CompensationError::Limit { .. } => "",
    }
}

/// What to look for where a scale is beyond its limit, when none of the mistakes that are known by their factor made it.
pub(super) fn of_scale(ppm: f64) -> &'static str {
    /// An encoder is off by less: beyond it something is set up wrongly.
    const PLAUSIBLE_PPM: f64 = 10_000.0;
    if ppm.abs() > PLAUSIBLE_PPM {
        return "";
    }
    ". Look for a beam that is not along the axis (cosine), the temperature, pressure and material that are configured, and \
     the resolution of the encoder"
}

/// What to look for where a place is not found again.
pub(super) fn of_closure(seen: Metres) -> &'static str {
    if !seen.value().is_finite() {
        return "It is no number: the instrument said nothing usable";
    }
    "Look for a loose reflector or instrument, vibration, a stage that has not warmed up, then measure again"
}

/// What an axis says that could not follow before its zero, and what to look for; `searched`: so far it went for its limit
/// switch.
pub(super) fn of_start(axis: &str, resolution_nm: f64, searched: Option<Metres>) -> String {
    if let Some(searched) = searched {
        return format!(
            "was blocked after {:.3} mm on the way to its limit switch, which it did not meet: the limit switch is dead \
             or its wire broken and the axis is on its end stop, or something blocks it. Press the switch by hand and look \
             at 0x60FD of its drive; then look for what blocks the axis",
            searched.mm()
        );
    }
    format!(
        "could not follow before it had found its zero, and nothing has shown so far that `resolution_nm = {}` in \
         [axis.{axis}] is right: where a count of the encoder is longer than that, the axis is sent as many times faster \
         than it is asked to. Compare it with the encoder's data sheet; if it is right, look for what blocks or overloads \
         the axis",
        Short(resolution_nm)
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
    fn no_advice_proposes_a_wider_limit() {
        for text in [of_scale(-1250.6), of_closure(Metres::from_um(-1.234))] {
            assert!(text.contains("Look for"), "{text}");
            assert!(!text.contains("limit"), "{text}");
        }
        assert_eq!(of_scale(1e6), "");
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
