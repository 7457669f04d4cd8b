//! Whether a loaded record is plausible: judged as a whole and once, when it is loaded, so that no
//! later code has to expect a list whose length differs from its neighbour's, a number that no
//! machine makes, or a place that does not exist.
//!
//! A checksum shows that nothing changed by accident; whoever edits a file can compute it again.
//! Limits are wide: they are what no stage, instrument or building reaches, not what a good machine
//! keeps.

use core::fmt;
use core::ops::RangeInclusive;

/// What cannot be so, where it stands, and what was expected there.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unsound {
    /// Where it stands.
    pub place: String,
    /// What can stand there.
    pub expected: String,
    /// What does.
    pub seen: String,
}

/// Whether something can be so, and what cannot.
pub type Judged = Result<(), Unsound>;

/// What numbers of a kind may be, and how a person calls that.
pub struct Limits {
    range: RangeInclusive<f64>,
    unit: &'static str,
}

/// From `low` to `high`; a `low` of the smallest number above 0 is said as "more than 0".
pub const fn limits(low: f64, high: f64, unit: &'static str) -> Limits {
    Limits {
        range: low..=high,
        unit,
    }
}

/// Places along an axis, and what stands for one.
pub const PLACE_M: Limits = limits(-1e3, 1e3, "m");
/// What a place is off by.
pub const ERROR_M: Limits = limits(-1.0, 1.0, "m");
/// How uncertain that is.
pub const ERROR_U_M: Limits = limits(0.0, 1.0, "m");
/// What is longer than nothing.
pub const LENGTH_M: Limits = limits(f64::MIN_POSITIVE, 1e3, "m");
/// Angles, and what they are off by.
pub const ANGLE_RAD: Limits = limits(-10.0, 10.0, "rad");
/// How uncertain that is.
pub const ANGLE_U_RAD: Limits = limits(0.0, 10.0, "rad");
/// Turns are counted on.
pub const TURNS_RAD: Limits = limits(-1e6, 1e6, "rad");
/// One count of an encoder.
pub const RESOLUTION: Limits = limits(f64::MIN_POSITIVE, 1.0, "m or rad per count");
/// What a place is off by, by way.
pub const SLOPE: Limits = limits(-1.0, 1.0, "m/m");
/// Thermal coefficients.
pub const PER_KELVIN: Limits = limits(-1.0, 1.0, "per kelvin");
/// How uncertain these are.
pub const PER_KELVIN_U: Limits = limits(0.0, 1.0, "per kelvin");
/// From absolute zero to what melts any stage.
pub const CELSIUS: Limits = limits(-273.15, 1500.0, "°C");
/// How uncertain temperatures are.
pub const KELVIN_U: Limits = limits(0.0, 1e3, "K");
/// Pressure of air.
pub const PASCAL: Limits = limits(0.0, 1e7, "Pa");
/// Sensors say a little less than nothing and a little more than all.
pub const HUMIDITY: Limits = limits(-0.5, 1.5, "of 1");
/// What sensors give.
pub const VOLTS: Limits = limits(-1e4, 1e4, "V");
/// Thirty years.
pub const SECONDS: Limits = limits(0.0, 1e9, "s");
/// How many times something is something else.
pub const RATIO: Limits = limits(0.0, 1e9, "times");
/// How fast tables turn.
pub const SPEED_RAD_PER_S: Limits = limits(f64::MIN_POSITIVE, 1e4, "rad/s");
/// Plates have no more lines, and lists no more entries.
pub const COUNT_MAX: usize = 1_000_000;
/// Passes over a plate, and runs, at most.
pub const PASSES_MAX: usize = 10_000;

/// Nothing is expected that is not between `limits`.
///
/// # Errors
/// When it is not so.
///
/// # Example
///
/// ```
/// use machine::records::sound::{CELSIUS, number};
///
/// assert_eq!(number("air", 21.5, &CELSIUS), Ok(()));
/// let unsound = number("air", -300.0, &CELSIUS).expect_err("colder than anything is");
/// assert_eq!((unsound.place.as_str(), unsound.seen.as_str()), ("air", "-3e2"));
/// assert!(number("air", f64::NAN, &CELSIUS).is_err());
/// ```
pub fn number(place: impl fmt::Display, seen: f64, limits: &Limits) -> Judged {
    // A NaN is in no range.
    if limits.range.contains(&seen) {
        return Ok(());
    }
    let (low, high) = (limits.range.start(), limits.range.end());
    let expected = match *low == f64::MIN_POSITIVE {
        true => format!("more than 0 and at most {high:e} {}", limits.unit),
        false => format!("{low:e} to {high:e} {}", limits.unit),
    };
    Err(unsound(place, expected, format!("{seen:e}")))
}

/// What cannot be so at `place`.
pub fn unsound(
    place: impl fmt::Display,
    expected: impl Into<String>,
    seen: impl Into<String>,
) -> Unsound {
    Unsound {
        place: place.to_string(),
        expected: expected.into(),
        seen: seen.into(),
    }
}

/// Likewise, where there is one.
///
/// # Errors
/// When it is not so.
pub fn optional(place: &str, seen: Option<f64>, limits: &Limits) -> Judged {
    seen.map_or(Ok(()), |it| number(place, it, limits))
}

/// Likewise, each of a list.
///
/// # Errors
/// When it is not so.
pub fn numbers(place: &str, seen: &[f64], limits: &Limits) -> Judged {
    let mut each = seen.iter().enumerate();
    each.try_for_each(|(at, it)| number(format_args!("{place}[{at}]"), *it, limits))
}

/// Likewise, each of a list that is there.
///
/// # Errors
/// When it is not so.
pub fn optionals(place: &str, seen: &[Option<f64>], limits: &Limits) -> Judged {
    let known = seen.iter().enumerate();
    let mut known = known.filter_map(|(at, it)| Some((at, (*it)?)));
    known.try_for_each(|(at, it)| number(format_args!("{place}[{at}]"), it, limits))
}

/// A list that has as many entries as something else.
///
/// # Errors
/// When it is not so.
pub fn as_many(place: &str, seen: usize, expected: usize, of: &str) -> Judged {
    is(
        place,
        seen == expected,
        || format!("{expected} entries, one for each of {of}"),
        || format!("{seen}"),
    )
}

/// A number of entries within `range`.
///
/// # Errors
/// When it is not so.
pub fn counted(place: &str, seen: usize, range: RangeInclusive<usize>) -> Judged {
    let expected = || format!("{} to {}", range.start(), range.end());
    is(place, range.contains(&seen), expected, || seen.to_string())
}

/// That `holds`.
///
/// # Errors
/// When it is not so.
pub fn is(
    place: impl fmt::Display,
    holds: bool,
    expected: impl FnOnce() -> String,
    seen: impl FnOnce() -> String,
) -> Judged {
    match holds {
        true => Ok(()),
        false => Err(unsound(place, expected(), seen())),
    }
}

/// One of these letters.
///
/// # Errors
/// When it is not so.
pub fn letter(place: &str, seen: char, among: &[char]) -> Judged {
    let expected = || {
        let each: Vec<String> = among.iter().map(|it| format!("`{it}`")).collect();
        each.join(" or ")
    };
    is(place, among.contains(&seen), expected, || {
        format!("`{}`", seen.escape_default())
    })
}

/// The two ways to come to a place.
///
/// # Errors
/// When it is not so.
pub fn approach(place: &str, seen: char) -> Judged {
    letter(place, seen, &['+', '-'])
}

/// What names a folder's file must not lead elsewhere.
///
/// # Errors
/// When it is not so.
///
/// # Example
///
/// ```
/// use machine::records::sound::file_name;
///
/// assert_eq!(file_name("axis", "x"), Ok(()));
/// assert!(file_name("axis", "../other/x").is_err(), "it would lead elsewhere");
/// ```
pub fn file_name(place: &str, seen: &str) -> Judged {
    let is_name = !seen.is_empty() && seen.len() <= 200 && seen != "." && seen != "..";
    let is_plain = seen.chars().all(|it| it != '/' && !it.is_control());
    let expected = || "a name without `/`, of at most 200 bytes".to_owned();
    is(place, is_name && is_plain, expected, || {
        format!("`{}`", seen.escape_debug().take(80).collect::<String>())
    })
}

/// Places closer than an atom's neighbours are one place, and no curve runs between them.
const STEP_MIN_M: f64 = 1e-10;

/// Places one behind the other, and not on each other.
///
/// # Errors
/// When it is not so.
///
/// # Example
///
/// ```
/// use machine::records::sound::increasing;
///
/// assert_eq!(increasing("nodes_m", &[0.0, 0.003, 0.006]), Ok(()));
/// let unsound = increasing("nodes_m", &[0.0, 0.003, 0.003]).expect_err("one place twice");
/// assert_eq!(unsound.place, "nodes_m[2]");
/// ```
pub fn increasing(place: &str, seen: &[f64]) -> Judged {
    // A comparison with NaN is false.
    let follows = |it: &[f64]| it[1] - it[0] >= STEP_MIN_M;
    let back = seen.windows(2).position(|it| !follows(it));
    back.map_or(Ok(()), |at| {
        let expected = format!("more than {:e}, the one before", seen[at]);
        let place = format_args!("{place}[{}]", at + 1);
        Err(unsound(place, expected, format!("{:e}", seen[at + 1])))
    })
}

/// What a model of its own says of it.
///
/// # Errors
/// When it is not so.
pub fn model<T>(place: &str, built: Result<T, impl fmt::Display>) -> Judged {
    let expected = "a model that can be applied";
    built
        .map(|_| ())
        .map_err(|it| unsound(place, expected, it.to_string()))
}

/// What is said once is not said otherwise later.
///
/// # Errors
/// When it is not so.
pub fn once(place: &str, is_new: bool) -> Judged {
    let expected = || "only one such line in a journal".to_owned();
    is(place, is_new, expected, || "another one".to_owned())
}
