//! What a value of `--json` is like: the few words of JSON Schema (draft 2020-12) that it takes.
//!
//! Objects are closed: a member that nobody described is no member. `docs/json.md` says what that promises.

use serde_json::{Map, Value, json};

/// What a value is like.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Shape(Value);

/// A member of an object and its value; a key that ends in `?` may be left out.
pub(crate) type Member = (&'static str, Shape);

impl Shape {
    /// The same, and what it means.
    pub(crate) fn about(mut self, meaning: &str) -> Self {
        self.0["description"] = json!(meaning);
        self
    }

    /// That, or `null`.
    pub(crate) fn or_null(mut self) -> Self {
        if let Some(Value::String(only)) = self.0.get("type") {
            self.0["type"] = json!([only, "null"]);
            return self;
        }
        if let Some(Value::Array(words)) = self.0.get_mut("enum") {
            words.push(Value::Null);
            return self;
        }
        one_of([self, of_type("null")])
    }

    /// As JSON Schema has it.
    pub(crate) fn schema(self) -> Value {
        self.0
    }
}

fn of_type(name: &str) -> Shape {
    Shape(json!({ "type": name }))
}

pub(crate) fn text() -> Shape {
    of_type("string")
}

pub(crate) fn truth() -> Shape {
    of_type("boolean")
}

/// A finite number.
pub(crate) fn number() -> Shape {
    of_type("number")
}

/// A whole number.
pub(crate) fn whole() -> Shape {
    of_type("integer")
}

/// Always the same.
pub(crate) fn constant(value: impl Into<Value>) -> Shape {
    Shape(json!({ "const": value.into() }))
}

/// One of a few words.
pub(crate) fn word(words: &[&str]) -> Shape {
    Shape(json!({ "enum": words }))
}

/// Any number of alike values.
pub(crate) fn list(of: Shape) -> Shape {
    Shape(json!({"type": "array", "items": of.0}))
}

/// So many alike values.
pub(crate) fn several(count: usize, of: Shape) -> Shape {
    Shape(json!({"type": "array", "items": of.0, "minItems": count, "maxItems": count}))
}

/// Alike values, each by a name of its own.
pub(crate) fn by_name(of: Shape) -> Shape {
    Shape(json!({"type": "object", "additionalProperties": of.0}))
}

/// An object that something else describes.
pub(crate) fn described_elsewhere(where_to_look: &str) -> Shape {
    of_type("object").about(where_to_look)
}

/// Any value.
pub(crate) fn anything() -> Shape {
    Shape(json!({}))
}

/// One of these.
pub(crate) fn one_of(choices: impl IntoIterator<Item = Shape>) -> Shape {
    let choices: Vec<Value> = choices.into_iter().map(Shape::schema).collect();
    Shape(json!({ "anyOf": choices }))
}

/// What is described once, by this name.
pub(crate) fn part(name: &str) -> Shape {
    Shape(json!({"$ref": format!("#/$defs/{name}")}))
}

/// An object with these members and no others.
pub(crate) fn object(members: impl IntoIterator<Item = Member>) -> Shape {
    let mut properties = Map::new();
    let mut required = Vec::new();
    for (key, shape) in members {
        let name = key.trim_end_matches('?');
        if name == key {
            required.push(name);
        }
        let twice = properties.insert(name.to_owned(), shape.0);
        assert_eq!(twice, None, "`{name}` is described twice");
    }
    Shape(json!({
        "type": "object",
        "properties": properties,
        "required": required,
        "additionalProperties": false,
    }))
}

/// Members of one thing and of another.
pub(crate) fn and(mut members: Vec<Member>, more: impl IntoIterator<Item = Member>) -> Vec<Member> {
    members.extend(more);
    members
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_may_be_null_says_so_in_the_shortest_form() {
        let of = |shape: Shape| shape.or_null().schema();
        assert_eq!(of(number()), json!({"type": ["number", "null"]}));
        assert_eq!(of(word(&["a"])), json!({"enum": ["a", null]}));
        assert_eq!(
            of(part("a")),
            json!({"anyOf": [{"$ref": "#/$defs/a"}, {"type": "null"}]})
        );
    }

    #[test]
    fn an_object_has_its_members_and_no_others() {
        let shape = object([("a", truth()), ("b?", text().about("what it means"))]);
        assert_eq!(
            shape.schema(),
            json!({
                "type": "object",
                "properties": {
                    "a": {"type": "boolean"},
                    "b": {"type": "string", "description": "what it means"},
                },
                "required": ["a"],
                "additionalProperties": false,
            })
        );
    }
}
