//! The JSON Schema of a machine's file: every key with its type, range, default and meaning.
//!
//! A key is described once, where its field is declared: the doc comment is its meaning, the attributes
//! its range. What is read is judged by this (`structure.rs`), `configs/README.md` is written from it
//! (`reference.rs`), and editors complete and check by it (`configs/machine.schema.json`). Beside the words of
//! JSON Schema there are five of our own:
//!
//! | word | meaning |
//! |---|---|
//! | `x-magnitude` | least and most of the value without its sign |
//! | `x-above` | the value is greater than this |
//! | `x-range` | what else holds, in words; judged by code |
//! | `x-device` | only this device has it |
//! | `x-own` | every machine has a value of its own: `truestage new` marks what is an example's |

use std::sync::LazyLock;

use schemars::JsonSchema;
use schemars::generate::SchemaSettings;
use serde_json::Value;

use super::model::MachineConfig;

/// The key that says which device a section is about.
pub(super) const DEVICE: &str = "device";

/// The schema, each part where it is used; made once, because a program may read many files.
pub(super) fn inline() -> &'static Value {
    static INLINE: LazyLock<Value> = LazyLock::new(|| settings_of::<MachineConfig>(true));
    &INLINE
}

/// That of another file than a machine's.
pub(super) fn inline_of<C: JsonSchema>() -> Value {
    settings_of::<C>(true)
}

/// The schema as editors take it, each part once.
#[cfg(any(test, feature = "program"))]
pub(crate) fn schema() -> Value {
    settings_of::<MachineConfig>(false)
}

/// That of a job, each part once.
#[cfg(test)]
pub(crate) fn schema_of<C: JsonSchema>() -> Value {
    settings_of::<C>(false)
}

fn settings_of<C: JsonSchema>(inline: bool) -> Value {
    let settings = SchemaSettings::draft2020_12().with(|it| it.inline_subschemas = inline);
    let schema = settings.into_generator().into_root_schema_for::<C>();
    schema.to_value()
}

/// What may be left out is, where it is there, what it is otherwise.
pub(super) fn without_null(part: &Value) -> &Value {
    let choices = part["anyOf"].as_array();
    let real = choices.and_then(|it| it.iter().find(|it| it["type"] != "null"));
    real.unwrap_or(part)
}

/// The type of what may be left out, too.
pub(super) fn type_of(part: &Value) -> &str {
    let one = match &part["type"] {
        Value::Array(types) => types.iter().find(|it| *it != "null"),
        one => Some(one),
    };
    one.and_then(Value::as_str).unwrap_or("object")
}
