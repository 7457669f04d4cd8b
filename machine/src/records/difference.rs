//! Where two values first differ, named as in the files that they stand in.

use serde::Serialize;
use serde_json::Value;

/// Where two values first differ, and what stands there.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// Keys and places in lists, from the outside in; empty when the values are no tables or lists.
    pub place: String,
    /// In the one.
    pub expected: String,
    /// In the other.
    pub seen: String,
}

impl Difference {
    /// `what`, and where in it.
    pub fn in_what(&self, what: &str) -> String {
        if self.place.is_empty() {
            return what.to_owned();
        }
        format!("{what}, {}", self.place)
    }
}

/// The first difference of what `expected` and `seen` look like in a file, if there is one.
///
/// # Example
///
/// ```
/// use machine::records::first_difference;
/// use serde_json::json;
///
/// let before = json!({"drives": [{"serial": 1}, {"serial": 2}], "step": 0.5});
/// let now = json!({"drives": [{"serial": 1}, {"serial": 7}], "step": 0.6});
/// let first = first_difference(&before, &now).expect("they differ twice");
/// assert_eq!(first.in_what("the machine"), "the machine, drives[1].serial");
/// assert_eq!((first.expected.as_str(), first.seen.as_str()), ("2", "7"));
/// ```
pub fn first_difference<T: Serialize + ?Sized>(expected: &T, seen: &T) -> Option<Difference> {
    let value = |it: &T| serde_json::to_value(it).expect("plain data always serialises");
    below("", &value(expected), &value(seen))
}

fn below(place: &str, expected: &Value, seen: &Value) -> Option<Difference> {
    if expected == seen {
        return None;
    }
    let deeper = match (expected, seen) {
        (Value::Object(a), Value::Object(b)) => {
            let keys = a.keys().chain(b.keys().filter(|it| !a.contains_key(*it)));
            keys.into_iter().find_map(|key| {
                let name = match place {
                    "" => key.clone(),
                    _ => format!("{place}.{key}"),
                };
                let absent = &Value::Null;
                below(
                    &name,
                    a.get(key).unwrap_or(absent),
                    b.get(key).unwrap_or(absent),
                )
            })
        }
        (Value::Array(a), Value::Array(b)) if a.len() == b.len() => a
            .iter()
            .zip(b)
            .enumerate()
            .find_map(|(at, (a, b))| below(&format!("{place}[{at}]"), a, b)),
        (Value::Array(a), Value::Array(b)) => Some(Difference {
            place: format!(
                "number of {}",
                if place.is_empty() { "entries" } else { place }
            ),
            expected: a.len().to_string(),
            seen: b.len().to_string(),
        }),
        _ => None,
    };
    deeper.or_else(|| {
        Some(Difference {
            place: place.to_owned(),
            expected: shown(expected),
            seen: shown(seen),
        })
    })
}

fn shown(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        Value::Null => "nothing".into(),
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn told(expected: &Value, seen: &Value) -> String {
        first_difference(expected, seen).map_or_else(String::new, |it| {
            format!("{}: {}, {}", it.in_what("it"), it.expected, it.seen)
        })
    }

    #[test]
    fn the_first_difference_is_named_from_the_outside_in() {
        let before = json!({"drives": [{"serial": 1}, {"serial": 2}], "step": 0.5});
        assert_eq!(told(&before, &before), "");
        let now = json!({"drives": [{"serial": 1}, {"serial": 7}], "step": 0.6});
        assert_eq!(told(&before, &now), "it, drives[1].serial: 2, 7");
        let now = json!({"drives": [{"serial": 1}], "step": 0.5});
        assert_eq!(told(&before, &now), "it, number of drives: 2, 1");
        let now = json!({"drives": before["drives"].clone(), "step": 0.5, "shape": "spline"});
        assert_eq!(told(&before, &now), "it, shape: nothing, spline");
        assert_eq!(told(&json!("A"), &json!("B")), "it: A, B");
        assert_eq!(
            told(&json!([1.0]), &json!([1.0, 2.0])),
            "it, number of entries: 1, 2"
        );
    }
}
