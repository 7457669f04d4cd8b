//! Whether a value is as a JSON Schema says (draft 2020-12), for the words of it that the schema of `--json` has.
//!
//! A word that is not known here is a failure, so that nothing is passed over. The Python of the peers says the same
//! of the same values (`tests/peers/schema.rs`).

use std::sync::LazyLock;

use serde_json::{Map, Value};

/// What describes values.
#[derive(Clone, Debug)]
pub struct Schema {
    whole: Value,
}

/// Words that say nothing of a value.
const SAID: [&str; 5] = ["$schema", "$id", "$defs", "title", "description"];

impl Schema {
    /// That of what `truestage --json` prints.
    pub fn of_output() -> &'static Self {
        static OUTPUT: LazyLock<Schema> = LazyLock::new(|| {
            let text = include_str!("../../docs/output.schema.json");
            Schema::new(serde_json::from_str(text).expect("it is JSON"))
        });
        &OUTPUT
    }

    /// That of a document.
    pub const fn new(whole: Value) -> Self {
        Self { whole }
    }

    /// The document.
    pub const fn document(&self) -> &Value {
        &self.whole
    }

    /// # Errors
    /// Where the value is not as described, and why.
    pub fn check(&self, value: &Value) -> Result<(), String> {
        self.value(&self.whole, value, "")
    }

    fn value(&self, schema: &Value, value: &Value, at: &str) -> Result<(), String> {
        let words = match schema {
            Value::Bool(true) => return Ok(()),
            Value::Object(words) => words,
            _ => return Err(format!("{at}: nothing may be here")),
        };
        for (word, of) in words {
            self.word((word, of), words, value, at)?;
        }
        Ok(())
    }

    fn word(
        &self,
        (word, of): (&str, &Value),
        words: &Map<String, Value>,
        value: &Value,
        at: &str,
    ) -> Result<(), String> {
        let is = |is: bool, why: String| {
            if is {
                Ok(())
            } else {
                Err(format!("{at}: {why}"))
            }
        };
        match word {
            "$ref" => self.value(self.named(of), value, at),
            "const" => is(equal(of, value), format!("{value} is not {of}")),
            "enum" => {
                let known = of.as_array().into_iter().flatten();
                let is_known = known.into_iter().any(|it| equal(it, value));
                is(is_known, format!("{value} is none of {of}"))
            }
            "type" => is(has_type(of, value), format!("{value} is no {of}")),
            "anyOf" => self.any(of, value, at).map(drop),
            "oneOf" => match self.any(of, value, at)? {
                1 => Ok(()),
                several => Err(format!("{at}: it is {several} of the choices")),
            },
            "items" => value.as_array().map_or(Ok(()), |all| {
                let mut all = all.iter().enumerate();
                all.try_for_each(|(k, it)| self.value(of, it, &format!("{at}/{k}")))
            }),
            "minItems" | "maxItems" => value.as_array().map_or(Ok(()), |all| {
                let (count, limit) = (all.len() as u64, of.as_u64());
                let fits = limit.is_some_and(|limit| match word {
                    "minItems" => count >= limit,
                    _ => count <= limit,
                });
                is(fits, format!("{count} items, {word} is {of}"))
            }),
            "properties" | "required" | "additionalProperties" | "dependentRequired" => {
                value.as_object().map_or(Ok(()), |members| {
                    self.members((word, of), words, members, at)
                })
            }
            said if SAID.contains(&said) => Ok(()),
            unknown => Err(format!(
                "{at}: the schema says `{unknown}`, which is not known here"
            )),
        }
    }

    fn members(
        &self,
        (word, of): (&str, &Value),
        words: &Map<String, Value>,
        members: &Map<String, Value>,
        at: &str,
    ) -> Result<(), String> {
        let known = words.get("properties");
        let lacks = |name: &Value| {
            let name = name.as_str().unwrap_or_default();
            match members.contains_key(name) {
                true => Ok(()),
                false => Err(format!("{at}: it has no `{name}`")),
            }
        };
        match word {
            "properties" => {
                let known = of.as_object().into_iter().flatten();
                let mut there = known.filter_map(|(name, of)| Some((name, of, members.get(name)?)));
                there.try_for_each(|(name, of, it)| self.value(of, it, &format!("{at}/{name}")))
            }
            "required" => of.as_array().into_iter().flatten().try_for_each(lacks),
            "dependentRequired" => {
                let all = of.as_object().into_iter().flatten();
                let there = all.filter(|(name, _)| members.contains_key(*name));
                let wanted = there.filter_map(|(_, of)| of.as_array());
                wanted.flatten().try_for_each(lacks)
            }
            _ => {
                let is_more = |name: &str| known.is_none_or(|it| it.get(name).is_none());
                let mut more = members.iter().filter(|(name, _)| is_more(name));
                more.try_for_each(|(name, it)| self.value(of, it, &format!("{at}/{name}")))
            }
        }
    }

    /// How many of the choices it is.
    fn any(&self, choices: &Value, value: &Value, at: &str) -> Result<usize, String> {
        let choices = choices.as_array().map_or(&[][..], Vec::as_slice);
        let seen = choices.iter().map(|it| self.value(it, value, at));
        let (good, bad): (Vec<_>, Vec<_>) = seen.partition(Result::is_ok);
        let why: Vec<String> = bad.into_iter().filter_map(Result::err).collect();
        match good.len() {
            0 => Err(format!("{at}: none of the choices: [{}]", why.join("; "))),
            some => Ok(some),
        }
    }

    /// What stands under `#/$defs/NAME`; nothing is as what is not there.
    fn named(&self, reference: &Value) -> &Value {
        let path = reference.as_str().and_then(|it| it.strip_prefix('#'));
        let found = path.and_then(|it| self.whole.pointer(it));
        found.unwrap_or(&Value::Bool(false))
    }
}

/// 1 and 1.0 are one number.
fn equal(a: &Value, b: &Value) -> bool {
    match (a.as_f64(), b.as_f64()) {
        (Some(a), Some(b)) => a == b,
        _ => a == b,
    }
}

fn has_type(of: &Value, value: &Value) -> bool {
    let is = |name: &Value| match name.as_str() {
        Some("null") => value.is_null(),
        Some("boolean") => value.is_boolean(),
        Some("string") => value.is_string(),
        Some("number") => value.is_number(),
        Some("integer") => value.as_f64().is_some_and(|it| it.fract() == 0.0),
        Some("array") => value.is_array(),
        Some("object") => value.is_object(),
        _ => false,
    };
    match of {
        Value::Array(names) => names.iter().any(is),
        name => is(name),
    }
}

/// That an object of `--json` is as the schema says.
///
/// # Panics
/// When it is not.
#[track_caller]
pub fn check_output(value: &Value) {
    if let Err(why) = check_of(value) {
        panic!("docs/output.schema.json does not describe {value:#}\n{why}");
    }
}

/// The same, with the reasons of its own verb alone.
fn check_of(value: &Value) -> Result<(), String> {
    let schema = Schema::of_output();
    let checked = schema.check(value);
    let words = value["verb"].as_str().into_iter();
    let words = words.flat_map(|it| it.split(' '));
    let own: Vec<&str> = ["verb"].into_iter().chain(words).collect();
    let own = own.join("-");
    match (&checked, schema.whole["$defs"].get(&own)) {
        (Err(_), Some(of_verb)) => schema.value(of_verb, value, "").and(checked),
        _ => checked,
    }
}
