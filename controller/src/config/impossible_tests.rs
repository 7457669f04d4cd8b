//! Whatever number a file holds: it is judged, and nothing breaks.

use core::mem;
use std::collections::HashSet;

use toml::{Table, Value};

use super::parse;

const SHIPPED: [&str; 5] = [
    include_str!("../../../configs/machines/linear.toml"),
    include_str!("../../../configs/machines/rotary.toml"),
    include_str!("../../../configs/machines/uvw.toml"),
    include_str!("../../../configs/machines/uvw-copley.toml"),
    include_str!("../../../configs/machines/volumetric.toml"),
];

/// Every number below `value`, as the way there.
fn numbers(value: &Value, way: &mut Vec<String>, found: &mut Vec<Vec<String>>) {
    let below: Vec<(String, &Value)> = match value {
        Value::Integer(_) | Value::Float(_) => return found.push(way.clone()),
        Value::Table(inner) => inner.iter().map(|(key, it)| (key.clone(), it)).collect(),
        Value::Array(items) => (0..).map(|at: usize| at.to_string()).zip(items).collect(),
        _ => return,
    };
    for (key, inner) in below {
        way.push(key);
        numbers(inner, way, found);
        way.pop();
    }
}

fn at<'a>(value: &'a mut Value, way: &[String]) -> &'a mut Value {
    way.iter().fold(value, |value, key| match value {
        Value::Array(items) => &mut items[key.parse::<usize>().expect("a place")],
        other => &mut other[key.as_str()],
    })
}

/// Whether the file is sound with that value there; it is as before afterwards.
fn is_sound(document: &mut Value, way: &[String], value: Value) -> bool {
    let before = mem::replace(at(document, way), value);
    let text = toml::to_string(document).expect("it came from such a text");
    *at(document, way) = before;
    parse(&text, "m.toml").is_ok()
}

#[test]
fn no_number_breaks_the_judgement_and_what_is_no_number_is_refused() {
    for text in SHIPPED {
        let mut document = Value::Table(text.parse::<Table>().expect("it is sound"));
        let mut ways = Vec::new();
        numbers(&document, &mut Vec::new(), &mut ways);
        // Axes are judged alike: each of their keys once, whatever they are called.
        let mut seen = HashSet::new();
        ways.retain(|way| seen.insert([&way[..1], way.get(2..).unwrap_or_default()].concat()));
        assert!(ways.len() > 30, "{}", ways.len());
        for way in ways {
            for impossible in [f64::NAN, f64::INFINITY] {
                let sound = is_sound(&mut document, &way, Value::Float(impossible));
                assert!(!sound, "{impossible} at {way:?}");
            }
            for extreme in [-1.0, 1e-300, 1e300] {
                is_sound(&mut document, &way, Value::Float(extreme));
            }
            for extreme in [-1, i64::MAX] {
                is_sound(&mut document, &way, Value::Integer(extreme));
            }
        }
    }
}
