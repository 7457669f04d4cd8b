//! The JSON Schema of a machine's file: every key with its type, range, default and meaning.
//!
//! A key is described once, where its field is declared: the doc comment is its meaning, the attributes
//! its range. What is read is judged by this (`structure.rs`), `configs/README.md` is written from it
//! (`reference.rs`), and editors complete and check by it (`configs/machine.schema.json`). Beside the words of
//! JSON Schema there are three of our own:
//!
//! | word | meaning |
//! |---|---|
//! | `x-magnitude` | least and most of the value without its sign |
//! | `x-above` | the value is greater than this |
//! | `x-range` | what else holds, in words; judged by code |

use schemars::generate::SchemaSettings;
use serde_json::Value;

use super::model::MachineConfig;

/// The schema, each part where it is used.
pub(super) fn inline() -> Value {
    settings_of(true)
}

/// The schema as editors take it, each part once.
pub fn schema() -> Value {
    settings_of(false)
}

fn settings_of(inline: bool) -> Value {
    let settings = SchemaSettings::draft2020_12().with(|it| it.inline_subschemas = inline);
    let schema = settings
        .into_generator()
        .into_root_schema_for::<MachineConfig>();
    schema.to_value()
}
