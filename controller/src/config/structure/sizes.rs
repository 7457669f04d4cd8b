//! How large a number can be.

use serde_json::Value as Schema;
use units::Short;

use super::Found;
use crate::config::consequences::Doubt;
use crate::config::judge::Finding;
use crate::config::place::Part;
use crate::config::schema::type_of;

impl Found<'_> {
    /// Notes a number outside of its bounds, with some within.
    fn doubt(&mut self, key: &str, (low, high): (Option<f64>, Option<f64>)) {
        let middle = low.zip(high).map(|(low, high)| match low > 0.0 {
            true => (low * high).sqrt(),
            false => f64::midpoint(low, high),
        });
        let within = [low, middle, high].into_iter().flatten().collect();
        let key = key.to_owned();
        self.doubts.push(Doubt { key, within });
    }
}

fn say_size(found: &mut Found<'_>, key: &str, seen: f64, help: String) {
    let (key, cause) = (key.to_owned(), format!("{} is impossible", Short(seen)));
    found
        .findings
        .push((Finding { key, cause, help }, Part::Size));
}

pub(super) fn number(path: &str, seen: f64, schema: &Schema, found: &mut Found<'_>) {
    let bound = |key: &str| schema[key].as_f64();
    let (least, most) = whole_numbers(schema);
    let (low, high) = match schema["x-magnitude"].as_array() {
        Some(bounds) => (bounds[0].as_f64(), bounds[1].as_f64()),
        None => (bound("minimum").or(least), bound("maximum").or(most)),
    };
    let value = match schema["x-magnitude"].is_array() {
        true => seen.abs(),
        false => seen,
    };
    // A comparison with NaN, which TOML can write, is false.
    let is_within = low.is_none_or(|it| value >= it) && high.is_none_or(|it| value <= it);
    let is_whole = type_of(schema) != "integer" || seen.fract() == 0.0;
    if !(is_within && is_whole && seen.is_finite()) {
        let either = schema["x-magnitude"].is_array();
        let help = match (low, high) {
            (Some(0.0), Some(high)) if either => {
                format!("give {} to {}", whole(-high), whole(high))
            }
            (Some(low), Some(high)) if either => {
                format!("give {} to {}, with either sign", whole(low), whole(high))
            }
            (Some(low), Some(high)) => format!("give {} to {}", whole(low), whole(high)),
            (Some(low), None) => format!("give {} or more", whole(low)),
            (None, Some(high)) => format!("give {} or less", whole(high)),
            (None, None) => "give a number".into(),
        };
        let help = match schema["x-range"].as_str() {
            Some(more) => format!("{help} ({more})"),
            None => help,
        };
        found.doubt(path, (low, high));
        say_size(found, path, seen, help);
        return;
    }
    if let Some(limit) = schema["x-above"].as_f64().filter(|it| seen <= *it) {
        found.doubt(path, (Some(limit + 1.0), None));
        let help = format!("give more than {}", Short(limit));
        say_size(found, path, seen, help);
    }
}

/// A bound to its last digit, where it is a whole number.
fn whole(bound: f64) -> String {
    match bound.fract() == 0.0 && bound.abs() < 1e15 {
        true => format!("{bound:.0}"),
        false => Short(bound).to_string(),
    }
}

/// What a whole number of this size can be.
fn whole_numbers(schema: &Schema) -> (Option<f64>, Option<f64>) {
    let (least, most): (i64, i64) = match schema["format"].as_str() {
        Some("uint8") => (0, u8::MAX.into()),
        Some("uint16") => (0, u16::MAX.into()),
        Some("uint32") => (0, u32::MAX.into()),
        Some("int16") => (i16::MIN.into(), i16::MAX.into()),
        Some("int32") => (i32::MIN.into(), i32::MAX.into()),
        _ => return (None, None),
    };
    (Some(least as f64), Some(most as f64))
}
