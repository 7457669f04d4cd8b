//! How long a move takes at least.

use core::time::Duration;

use units::ShortSpan;

/// How long a way takes at least, from rest to rest; a short one never reaches the speed.
pub(crate) fn least_time(way: f64, speed: f64, acceleration: f64) -> f64 {
    match way < speed * speed / acceleration {
        true => 2.0 * (way / acceleration).sqrt(),
        false => way / speed + speed / acceleration,
    }
}

/// A time for people, however long.
pub(crate) fn span(seconds: f64) -> ShortSpan {
    ShortSpan(Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_short_way_never_reaches_the_speed() {
        assert!((least_time(66.0, 200.0, 5000.0) - 0.37).abs() < 1e-12);
        assert!((least_time(4.0, 200.0, 2000.0) - 0.089_442_719).abs() < 1e-9);
    }
}
