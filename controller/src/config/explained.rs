//! What a key that somebody has before him means: the words of its declaration.

use serde_json::Value;

use super::described::{Described, Row, of_devices, variants};
use super::lines::below;
use super::schema::{self, DEVICE};

/// What is said of a key or a section.
#[derive(Clone, Debug)]
pub(crate) struct Explained {
    /// What it is, where names and numbers are left open: the same for all that are alike.
    pub(crate) of: String,
    pub(crate) text: String,
    /// Every machine has a value of its own.
    pub(crate) is_own: bool,
}

/// Of the key `name` in the section at `path` (`axis.x`, `platform.actuator.0`); `None` where no such key can be.
pub(crate) fn of_key(path: &str, name: &str) -> Option<Explained> {
    let words = words();
    let (of, section) = section(words, path)?;
    let row = match (owner(words, section, name), name) {
        (Some(owner), _) => words.row(owner, name),
        (None, DEVICE) => of_devices(&variants(section).collect::<Vec<_>>()),
        (None, _) => return None,
    };
    let own = owner(words, section, name).map(|it| &it["properties"][name]["x-own"]);
    Some(Explained {
        of: below(&of, name),
        text: said(&row),
        is_own: own.is_some_and(|it| it == true),
    })
}

/// Of the section at `path`.
pub(crate) fn of_section(path: &str) -> Option<Explained> {
    let (of, section) = section(words(), path)?;
    let about = section["description"].as_str()?;
    let title = about.split("\n\n").next().unwrap_or(about);
    Some(Explained {
        text: format!("[{of}] {title}"),
        of,
        is_own: false,
    })
}

fn words() -> Described<'static> {
    Described {
        schema: schema::inline(),
    }
}

fn said(row: &Row) -> String {
    let range = match row.range.is_empty() {
        true => String::new(),
        false => format!("; {}", row.range),
    };
    // For a page, not for a file.
    let meaning = row.meaning.replace("<sub>", "").replace("</sub>", "");
    format!("{} ({}{range})", meaning.trim(), row.kind)
}

/// The part of a section that has the key: the section, or what it is for one device.
fn owner<'a>(words: Described<'a>, section: &'a Value, key: &str) -> Option<&'a Value> {
    let of_devices = variants(section).map(|it| words.resolved(it));
    let mut parts = core::iter::once(section).chain(of_devices);
    parts.find(|it| it["properties"][key].is_object() && it["properties"][key]["const"].is_null())
}

/// The section at `path`, and that path with what is the user's own left open.
fn section<'a>(words: Described<'a>, path: &str) -> Option<(String, &'a Value)> {
    let (mut of, mut at) = (String::new(), words.schema);
    let mut parts = path.split('.').filter(|it| !it.is_empty()).peekable();
    while let Some(part) = parts.next() {
        let owner = owner(words, at, part)?;
        let (name, section) = words.section(words.resolved(&owner["properties"][part]));
        of = below(&of, part) + name;
        let is_named = !name.is_empty();
        parts.next_if(|it| is_named || it.chars().all(|it| it.is_ascii_digit()));
        at = section;
    }
    Some((of, at))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(path: &str, name: &str, of: &str, says: &str) {
        let it = of_key(path, name).expect("there is such a key");
        assert_eq!(it.of, of);
        assert!(it.text.contains(says), "{}", it.text);
    }

    #[test]
    fn a_key_is_explained_wherever_it_stands() {
        check(
            "",
            "schema_version",
            "schema_version",
            "Version of this format. (integer, req.; 1)",
        );
        check(
            "axis.x",
            "soft_min_mm",
            "axis.NAME.soft_min_mm",
            "below `soft_max_mm`",
        );
        check(
            "axis.x",
            "device",
            "axis.NAME.device",
            "a CiA 402 drive on CAN",
        );
        check(
            "axis.x.identity",
            "vendor_id",
            "axis.NAME.identity.vendor_id",
            "0x1018:01",
        );
        check(
            "platform.actuator.2",
            "lead_mm",
            "platform.actuator.lead_mm",
            "number",
        );
        assert!(of_key("axis.x", "soft_mim_mm").is_none());
        let title = of_section("axis.x.zero").expect("there is one").text;
        assert!(title.starts_with("[axis.NAME.zero] "), "{title}");
    }

    /// How fast each `zero` of `part` and of all in it is sought, and whether every machine has a value of its own.
    fn zero_speeds(part: &Value, name: &str, found: &mut Vec<(String, bool)>) {
        if let Some(keys) = part["properties"].as_object().filter(|_| name == "zero") {
            let speeds = keys.iter().filter(|(key, _)| key.contains("_speed_"));
            found.extend(speeds.map(|(key, it)| (key.clone(), it["x-own"] == true)));
        }
        match part {
            Value::Object(inner) => {
                for (own, it) in inner {
                    let own = match own.as_str() {
                        "anyOf" | "oneOf" | "allOf" => name,
                        own => own,
                    };
                    zero_speeds(it, own, found);
                }
            }
            Value::Array(inner) => inner.iter().for_each(|it| zero_speeds(it, name, found)),
            _ => {}
        }
    }

    /// The first motion of a machine must not be as fast as an example.
    #[test]
    fn every_speed_of_a_zero_is_every_machine_s_own() {
        let mut found = Vec::new();
        zero_speeds(schema::inline(), "", &mut found);
        for key in [
            "reference_speed_mm_per_s",
            "search_speed_mm_per_s",
            "index_speed_deg_per_s",
        ] {
            assert!(found.iter().any(|(it, _)| it == key), "{key}: {found:?}");
        }
        assert!(found.iter().all(|(_, is_own)| *is_own), "{found:?}");
    }
}
