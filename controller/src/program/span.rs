//! Times on the command line: a number with its unit.

use core::time::Duration;

/// A time in words: `500ms`, `10s`, `1.5min`, `1h`.
pub(crate) fn span_of(text: &str) -> Result<Duration, String> {
    let form = || "write a time with its unit: 500ms, 10s, 5min, 1h".to_owned();
    let digits = text
        .find(|c: char| c.is_ascii_alphabetic())
        .ok_or_else(form)?;
    let (number, unit) = text.split_at(digits);
    let unit_s = match unit {
        "ms" => 1e-3,
        "s" => 1.0,
        "min" => 60.0,
        "h" => 3600.0,
        _ => return Err(form()),
    };
    let number: f64 = number.parse().map_err(|_| form())?;
    let seconds = Duration::try_from_secs_f64(number * unit_s).map_err(|_| form())?;
    if seconds.is_zero() {
        Err(form())
    } else {
        Ok(seconds)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_has_a_unit() {
        for (text, seconds) in [
            ("500ms", 0.5),
            ("10s", 10.0),
            ("1.5min", 90.0),
            ("2h", 7200.0),
        ] {
            assert_eq!(
                span_of(text),
                Ok(Duration::from_secs_f64(seconds)),
                "{text}"
            );
        }
        for text in ["10", "s", "0s", "-1s", "10 days", "1e400s"] {
            assert!(span_of(text).unwrap_err().contains("10s"), "{text}");
        }
    }
}
