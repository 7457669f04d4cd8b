//! The keys of a machine's file for people: `configs/README.md` is written from the schema.

use core::fmt::Write as _;

use serde_json::Value;

use super::described::{Described, Row, of_devices, uncapital, variants, word};

/// Every section with its keys, as Markdown.
pub(crate) fn markdown(schema: &Value) -> String {
    let reference = Reference {
        words: Described { schema },
    };
    let mut text = reference.keys(schema);
    reference.sections("", schema, &mut text);
    text
}

struct Reference<'a> {
    words: Described<'a>,
}

const HEAD: &str = "| key | type | range | meaning |\n|---|---|---|---|\n";

impl<'a> Reference<'a> {
    /// The sections below `path`, each followed by its own.
    fn sections(&self, path: &str, part: &'a Value, text: &mut String) {
        let of_devices = variants(part).map(|it| self.words.resolved(it));
        for (part, key) in core::iter::once(part)
            .chain(of_devices)
            .flat_map(|part| ordered(part).into_iter().map(move |key| (part, key)))
        {
            let own = self.words.resolved(&part["properties"][&key]);
            let (below, section) = self.words.section(own);
            if section["properties"].is_null() {
                continue;
            }
            let path = if path.is_empty() {
                key
            } else {
                format!("{path}.{key}")
            };
            let (open, close) = if own["type"] == "array" {
                ("[[", "]]")
            } else {
                ("[", "]")
            };
            let about = section["description"].as_str().unwrap_or_default();
            let (title, intro) = about.split_once("\n\n").unwrap_or((about, ""));
            let title = uncapital(title.trim_end_matches('.').replace('\n', " "));
            let heading = format!("\n### `{open}{path}{below}{close}`: {title}\n\n");
            // What several devices have is described once.
            if text.contains(&heading) {
                continue;
            }
            text.push_str(&heading);
            if !intro.is_empty() {
                let _ = write!(text, "{}\n\n", paragraphs(intro));
            }
            text.push_str(&self.keys(section));
            self.sections(&format!("{path}{below}"), section, text);
        }
    }

    /// The tables of a section's keys: those of every device, then those of each.
    fn keys(&self, section: &'a Value) -> String {
        let variants: Vec<_> = variants(section).collect();
        let mut text = HEAD.to_owned();
        if !variants.is_empty() {
            text += &device_row(&variants);
        }
        self.rows(section, &mut text);
        for variant in variants {
            let _ = write!(text, "\nWith `device = \"{}\"`:\n\n", word(variant));
            let about = variant["description"].as_str().unwrap_or_default();
            if let Some((_, more)) = about.split_once("\n\n") {
                let _ = write!(text, "{}\n\n", paragraphs(more));
            }
            text += HEAD;
            self.rows(self.words.resolved(variant), &mut text);
        }
        text
    }

    /// Keys one after the other that are alike share a row.
    fn rows(&self, section: &'a Value, text: &mut String) {
        let mut rows: Vec<(Vec<String>, Row)> = Vec::new();
        for key in ordered(section) {
            let row = self.words.row(section, &key);
            match rows.last_mut() {
                Some((keys, last)) if last.meaning == row.meaning && last.range == row.range => {
                    keys.push(key);
                }
                _ => rows.push((vec![key], row)),
            }
        }
        for (keys, row) in rows {
            let keys: Vec<_> = keys.iter().map(|it| format!("`{it}`")).collect();
            let (keys, kind) = (keys.join(", "), row.kind);
            let _ = writeln!(
                text,
                "| {keys} | {kind} | {} | {} |",
                row.range, row.meaning
            );
        }
    }
}

fn device_row(variants: &[&Value]) -> String {
    let Row {
        kind,
        range,
        meaning,
    } = of_devices(variants);
    format!("| `device` | {kind} | {range} |{meaning} |\n")
}

/// The keys of a section: first those that must be there, as they are declared.
fn ordered(section: &Value) -> Vec<String> {
    let required = section["required"].as_array().into_iter().flatten();
    let mut keys: Vec<_> = required
        .filter_map(Value::as_str)
        .map(str::to_owned)
        .collect();
    let all = section["properties"].as_object().into_iter().flatten();
    for (key, _) in all {
        if !keys.contains(key) {
            keys.push(key.clone());
        }
    }
    keys
}

/// Lines of a paragraph joined again, as Markdown has them.
fn paragraphs(text: &str) -> String {
    let each = text.split("\n\n").map(|it| it.replace('\n', " "));
    each.collect::<Vec<_>>().join("\n\n")
}

#[cfg(test)]
mod tests;
