//! Which of the words that are known somebody meant by one that is not.

/// So much alike two words are one that was mistyped.
const LIKE: f64 = 0.6;
/// A key that is right as a whole is nearer than one that is right but for its unit.
const STEM_WEIGHT: f64 = 0.95;

/// The key of `free` that is most like `seen`, if one is.
pub(super) fn key_meant<'a>(seen: &str, free: &[&'a str]) -> Option<&'a str> {
    // With another unit it is still the same quantity.
    let by_stem = |key: &str| match has_unit(key) {
        true => likeness(stem(key), stem(seen)) * STEM_WEIGHT,
        false => 0.0,
    };
    most_alike(free, |key| likeness(key, seen).max(by_stem(key)))
        .or_else(|| with_words_left_out(seen, free))
}

/// The word of `known` that is most like `seen`, if one is.
pub(super) fn word_meant<'a>(seen: &str, known: &[&'a str]) -> Option<&'a str> {
    let best = most_alike(known, |word| likeness(word, seen))?;
    // Of several that are equally near nobody knows which was meant.
    let likeness_of_best = likeness(best, seen);
    let others = known.iter().filter(|it| **it != best);
    let is_only = others
        .map(|it| likeness(it, seen))
        .all(|it| it < likeness_of_best);
    is_only.then_some(best)
}

/// Likewise of names that were given: `hall_2` is another one than `hall_1`, and no slip of the hand; `qw` is one of `w`.
pub(super) fn name_meant<'a>(seen: &str, known: &[&'a str]) -> Option<&'a str> {
    let letters = |it: &str| {
        it.chars()
            .filter(|it| !it.is_ascii_digit())
            .collect::<String>()
    };
    let is_numbered = |it: &str| it.contains(|it: char| it.is_ascii_digit());
    let is_another =
        |it: &str| is_numbered(it) && is_numbered(seen) && letters(it) == letters(seen);
    // One that begins in the same way has only grown.
    let mut longer = known.iter().filter(|it| it.starts_with(seen));
    if let (Some(one), None) = (longer.next(), longer.next()) {
        return Some(one);
    }
    let free: Vec<&str> = known.iter().copied().filter(|it| !is_another(it)).collect();
    // Of two letters one is much, and yet only one slip.
    let slips = |it: &&str| strsim::damerau_levenshtein(it, seen) == 1;
    let mut near = free.iter().copied().filter(slips);
    let by_one_slip = near
        .next()
        .filter(|_| near.next().is_none() && seen.len() > 1);
    word_meant(seen, &free).or(by_one_slip)
}

fn most_alike<'a>(known: &[&'a str], alike: impl Fn(&str) -> f64) -> Option<&'a str> {
    let scored = known.iter().map(|word| (alike(word), *word));
    let best = scored.max_by(|a, b| a.0.total_cmp(&b.0))?;
    (best.0 >= LIKE).then_some(best.1)
}

/// Capitals, dashes and spaces are how people write, and no other letters.
fn likeness(known: &str, seen: &str) -> f64 {
    let as_written = strsim::normalized_damerau_levenshtein(known, seen);
    let letters = strsim::normalized_damerau_levenshtein(&plain(known), &plain(seen));
    as_written.max(letters)
}

/// A word without what joins its parts.
fn plain(word: &str) -> String {
    let letters = word.chars().filter(|it| !"_- ".contains(*it));
    letters.flat_map(char::to_lowercase).collect()
}

/// The only key of `free` that has all words of `seen`, and more.
fn with_words_left_out<'a>(seen: &str, free: &[&'a str]) -> Option<&'a str> {
    let has_all = |key: &&&str| {
        let mut words = key.split('_');
        seen.split('_').all(|wanted| words.any(|it| it == wanted))
    };
    let mut longer = free.iter().filter(has_all);
    match (longer.next(), longer.next()) {
        (Some(only), None) => Some(only),
        _ => None,
    }
}

/// Whether a key ends in a unit, and not in a word of its name.
fn has_unit(key: &str) -> bool {
    const UNITS: [&str; 26] = [
        "mm", "um", "nm", "m", "s", "s2", "s3", "ms", "us", "min", "h", "v", "mv", "deg", "rad",
        "mrad", "urad", "arcsec", "hz", "k", "kelvin", "c", "pa", "hpa", "ppm", "percent",
    ];
    key.rsplit_once('_').is_some_and(|it| UNITS.contains(&it.1))
}

/// A key without its unit.
fn stem(key: &str) -> &str {
    key.rsplit_once('_').map_or(key, |(stem, _)| stem)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn capitals_dashes_and_spaces_are_the_same_word() {
        let known = ["piecewise_constant", "linear", "monotone_cubic"];
        for seen in [
            "MonotoneCubic",
            "MONOTONE_CUBIC",
            "monotone-cubic",
            "monotone cubic",
        ] {
            assert_eq!(word_meant(seen, &known), Some("monotone_cubic"), "{seen}");
        }
        let keys = ["soft_min_mm", "soft_max_mm"];
        for seen in ["softMinMm", "SOFT_MIN_MM", "Soft_min_mm", "soft-min-mm"] {
            assert_eq!(key_meant(seen, &keys), Some("soft_min_mm"), "{seen}");
        }
    }

    #[test]
    fn the_end_of_a_key_counts_unless_it_is_a_unit() {
        let keys = ["line_signal", "line_detector"];
        assert_eq!(key_meant("line_detectr", &keys), Some("line_detector"));
        let keys = ["soft_min_mm", "soft_max_mm", "speed_mm_per_s"];
        assert_eq!(key_meant("soft_min_inch", &keys), Some("soft_min_mm"));
    }

    #[test]
    fn what_is_like_none_of_them_was_another_mistake() {
        assert_eq!(word_meant("quintic", &["linear", "spline"]), None);
        assert_eq!(word_meant("", &["linear"]), None);
        assert_eq!(key_meant("colour", &["node_id", "bus"]), None);
    }
}
