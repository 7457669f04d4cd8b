//! Edits of JSON as a hand, a script or a bug makes them: the structure stays JSON, nothing else.

use serde_json::{Number, Value, json};

use crate::chance::Chance;

/// How many values `value` holds, itself included.
fn size(value: &Value) -> usize {
    1 + match value {
        Value::Array(list) => list.iter().map(size).sum(),
        Value::Object(map) => map.values().map(size).sum(),
        _ => 0,
    }
}

/// The value of this number, counted as [`size`] does.
fn nth(value: &mut Value, mut at: usize) -> &mut Value {
    if at == 0 {
        return value;
    }
    at -= 1;
    let children: Box<dyn Iterator<Item = &mut Value>> = match value {
        Value::Array(list) => Box::new(list.iter_mut()),
        Value::Object(map) => Box::new(map.values_mut()),
        _ => unreachable!("it has no more values"),
    };
    for child in children {
        let own = size(child);
        if at < own {
            return nth(child, at);
        }
        at -= own;
    }
    unreachable!("the number was below the size")
}

/// One edit somewhere in `value`.
pub(crate) fn edit(value: &mut Value, chance: &mut Chance) {
    let at = chance.below(size(value));
    let other = nth(value, chance.below(size(value))).clone();
    let place = nth(value, at);
    // Now and then something that belongs elsewhere.
    if chance.below(12) == 0 {
        *place = other;
        return;
    }
    match place {
        Value::Null => {
            *place = chance.of(&[json!(0.5), json!(0), json!(-1e-6), json!("x"), json!([])])
        }
        Value::Bool(it) => *it = !*it,
        Value::Number(number) => *place = edited_number(number, chance),
        Value::String(text) => *place = Value::String(edited_text(text, chance)),
        Value::Array(list) => edit_list(list, chance),
        Value::Object(map) => {
            let keys: Vec<String> = map.keys().cloned().collect();
            if keys.is_empty() {
                return;
            }
            let (one, two) = (chance.of(&keys), chance.of(&keys));
            match chance.below(3) {
                0 => drop(map.remove(&one)),
                1 => drop(map.insert(one, Value::Null)),
                _ => {
                    let value = map[&two].clone();
                    map.insert(one, value);
                }
            }
        }
    }
}

fn edited_number(number: &Number, chance: &mut Chance) -> Value {
    let is_count = number.is_u64() || number.is_i64();
    if is_count && chance.below(4) != 0 {
        let count = number.as_i64().unwrap_or(0);
        let among = [
            0,
            1,
            2,
            -1,
            count.wrapping_add(1),
            count.wrapping_sub(1),
            count.wrapping_mul(2),
            1000,
            i64::from(u32::MAX),
            1 << 53,
            i64::MAX,
        ];
        return json!(chance.of(&among));
    }
    let value = number.as_f64().unwrap_or(0.0);
    let among = [
        0.0,
        -0.0,
        1.0,
        -1.0,
        -value,
        value * 1e-3,
        value * 1e3,
        value * 1e9,
        value * (1.0 + 1e-9),
        value + 1.0,
        1e18,
        1e154,
        1e300,
        -1e300,
        f64::MAX,
        5e-324,
        1e-200,
    ];
    json!(chance.of(&among))
}

fn edited_text(text: &str, chance: &mut Chance) -> String {
    match chance.below(6) {
        0 => String::new(),
        1 => "<script>&\"".to_owned(),
        2 => "../../up".to_owned(),
        3 => "µ".repeat(5000),
        4 => text.chars().rev().collect(),
        _ => text.chars().skip(1).collect(),
    }
}

fn edit_list(list: &mut Vec<Value>, chance: &mut Chance) {
    let at = chance.below(list.len());
    match chance.below(6) {
        0 => list.clear(),
        1 if !list.is_empty() => drop(list.remove(at)),
        2 if !list.is_empty() => list.insert(at, list[at].clone()),
        3 => list.truncate(at),
        4 => {
            let again = list.clone();
            (0..1 + chance.below(8)).for_each(|_| list.extend_from_slice(&again));
        }
        _ if !list.is_empty() => {
            let other = chance.below(list.len());
            list.swap(at, other);
        }
        _ => list.push(json!(0.0)),
    }
}

/// One edit of the lines of a journal, each of which is JSON.
pub(crate) fn edit_lines(lines: &mut Vec<Value>, chance: &mut Chance) {
    let at = chance.below(lines.len());
    match chance.below(14) {
        0 => drop(lines.remove(at)),
        1 => lines.insert(at, lines[at].clone()),
        2 => {
            let other = chance.below(lines.len());
            lines.swap(at, other);
        }
        3 => lines.truncate(at + 1),
        // What plans and heads say decides how the many lines behind are taken.
        4..=8 => edit(&mut lines[at.min(3)], chance),
        _ => edit(&mut lines[at], chance),
    }
    if lines.is_empty() {
        lines.push(Value::Null);
    }
}
