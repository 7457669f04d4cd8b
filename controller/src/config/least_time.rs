//! How long a move takes at least, and what is too long to wait for.

use core::time::Duration;

use units::{Short, ShortSpan};

use super::judge::Judge;

/// An axis is measured over a night; a run that is longer than a day is seldom meant.
pub(crate) const RUN_MAX_S: f64 = 24.0 * 3600.0;
/// A table or a volume is measured over a weekend.
pub(crate) const LONG_RUN_MAX_S: f64 = 3.0 * RUN_MAX_S;
/// Nobody waits so long beside a move that hangs.
const HANGS_MAX_S: f64 = 600.0;
/// What takes time may take so much longer than it must, whatever settles.
const HANGS_TIMES: f64 = 20.0;

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

/// Whether one that hangs, of those that take `needed_s`, is given up after `limit_s` only when nobody waits any more.
pub(crate) fn hangs(limit_s: f64, needed_s: f64) -> bool {
    limit_s > HANGS_MAX_S.max(HANGS_TIMES * needed_s)
}

/// A search for an index: over `travel_mm` of the way that is called `way`, and given up after `limit_s`, which `key` says.
pub(crate) fn check_search(
    judge: &mut Judge<'_>,
    (way, travel_mm): (&str, f64),
    speed_mm_per_s: f64,
    (key, limit_s): (&str, f64),
) {
    let needed_s = travel_mm / speed_mm_per_s;
    let cause = |end: &str| {
        format!(
            "{way} takes {} at {} mm/s, and {end} after {}",
            span(needed_s),
            Short(speed_mm_per_s),
            span(limit_s)
        )
    };
    if needed_s > limit_s {
        judge.say(
            key,
            cause("the search is given up"),
            "raise it, or search faster",
        );
    } else if hangs(limit_s, needed_s) {
        let help = "give some times what the way takes";
        judge.say(key, cause("one that hangs is noticed"), help);
    }
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
