//! What values of JSON look like, as a JSON Schema says it.

use serde_json::{Map, Value, json};

use super::node::Node;
use super::table::is_number_by_name;

/// What a value, or each of several, looks like.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Shape {
    /// Nothing is said of it.
    Nothing,
    Bool,
    Whole,
    Number,
    Text,
    List(Box<Self>),
    Object(Vec<(String, Self)>),
    /// Now one thing, now another.
    Anything,
}

impl Shape {
    /// That of the value called `key`.
    pub(super) fn of(key: &str, node: &Node) -> Self {
        match node {
            Node::Null => Self::Nothing,
            Node::Bool(_) => Self::Bool,
            Node::Whole(_) if is_number_by_name(key) => Self::Number,
            Node::Whole(_) => Self::Whole,
            Node::Number(_) => Self::Number,
            Node::Text(_) => Self::Text,
            Node::List(items) => {
                let shapes = items.iter().map(|it| Self::of(key, it));
                Self::List(Box::new(shapes.reduce(Self::with).unwrap_or(Self::Nothing)))
            }
            Node::Object(members) => {
                let shapes = members.iter();
                Self::Object(
                    shapes
                        .map(|(key, it)| (key.clone(), Self::of(key, it)))
                        .collect(),
                )
            }
        }
    }

    /// That of values of which some have this one and some `other`.
    pub(super) fn with(self, other: Self) -> Self {
        match (self, other) {
            (one, other) if one == other => one,
            (Self::Nothing, it) | (it, Self::Nothing) => it,
            (Self::Whole | Self::Number, Self::Whole | Self::Number) => Self::Number,
            (Self::List(one), Self::List(other)) => Self::List(Box::new(one.with(*other))),
            (Self::Object(mut members), Self::Object(others)) => {
                for (key, other) in others {
                    match members.iter_mut().find(|it| it.0 == key) {
                        Some((_, one)) => {
                            let seen = core::mem::replace(one, Self::Nothing);
                            *one = seen.with(other);
                        }
                        None => members.push((key, other)),
                    }
                }
                Self::Object(members)
            }
            _ => Self::Anything,
        }
    }

    /// As a JSON Schema of the value called `key`. What no value was seen of is a number where its name ends in a
    /// unit, and else a text.
    pub(super) fn schema(&self, key: &str) -> Value {
        match self {
            Self::Nothing if is_number_by_name(key) => json!({"type": "number"}),
            Self::Nothing | Self::Text => json!({"type": "string"}),
            Self::Bool => json!({"type": "boolean"}),
            Self::Whole => json!({"type": "integer"}),
            Self::Number => json!({"type": "number"}),
            Self::List(items) => json!({"type": "array", "items": items.schema(key)}),
            Self::Object(members) => {
                let members = members.iter();
                let properties: Map<String, Value> = members
                    .map(|(key, it)| (key.clone(), it.schema(key)))
                    .collect();
                json!({"type": "object", "properties": properties})
            }
            Self::Anything => json!({}),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn schema(texts: &[&str]) -> Value {
        let nodes = texts.iter().map(|it| serde_json::from_str(it).unwrap());
        let shapes = nodes.map(|it: Node| Shape::of("", &it));
        shapes.reduce(Shape::with).unwrap().schema("")
    }

    #[test]
    fn what_some_have_and_others_lack_is_in_the_schema_with_its_type() {
        let seen = schema(&[
            r#"{"run":1,"at_m":0,"u_m":null,"axis":"x","list":[],"said":null}"#,
            r#"{"run":2,"at_m":0.5,"u_m":null,"axis":"y","list":[{"a":1},{"a":1.5,"b":true}]}"#,
        ]);
        let list = json!({"type": "object",
                          "properties": {"a": {"type": "number"}, "b": {"type": "boolean"}}});
        let expected = json!({"type": "object", "properties": {
            "run": {"type": "integer"},
            "at_m": {"type": "number"},
            "u_m": {"type": "number"},
            "axis": {"type": "string"},
            "list": {"type": "array", "items": list},
            "said": {"type": "string"},
        }});
        assert_eq!(seen, expected);
    }
}
