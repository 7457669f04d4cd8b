//! `truestage schema`: the JSON Schemas of what this program prints with `--json`, and of what it reads.
//!
//! Each verb's forms stand in `any.rs`, or in `printed.rs` of the kind of machine; the verbs themselves, and what they
//! are for, are those of the command line. `docs/output.schema.json` is written from them.

mod any;
pub(crate) mod form;
pub(crate) mod parts;
pub(crate) mod shape;
#[cfg(test)]
mod tests;

use clap::{ArgMatches, Command, Subcommand};
use serde_json::{Map, Value, json};

use self::form::{Form, Printed, failure, failure_beside};
use self::shape::{Member, constant, list, object, part, text};
use crate::config;
use crate::program::kind::KINDS;
use crate::program::output::{Ended, NO_VERB, Output, SCHEMA};

/// Which schema.
#[derive(Clone, Copy, Debug, Subcommand)]
pub(crate) enum SchemaCommand {
    /// What this program prints with `--json`, verb by verb.
    Output,
    /// A machine's configuration, for editors.
    Machine,
}

/// `program`: the words of this program.
pub(crate) fn run(command: SchemaCommand, program: &Command, output: Output) -> Ended {
    let schema = match command {
        SchemaCommand::Output => document(program),
        SchemaCommand::Machine => config::schema::schema(),
    };
    let text = pretty(&schema);
    output.result(text.trim_end(), &json!({ "document": schema }))
}

fn pretty(schema: &Value) -> String {
    serde_json::to_string_pretty(schema).expect("plain data always serialises") + "\n"
}

/// The verb that is asked for, in full: `cal list`.
pub(crate) fn verb_of(words: &ArgMatches) -> String {
    let mut words = words;
    let mut names = Vec::new();
    while let Some((name, more)) = words.subcommand() {
        names.push(name);
        words = more;
    }
    names.join(" ")
}

/// A verb of the command line.
struct Verb {
    name: String,
    /// What it is for.
    about: String,
}

/// Every verb of `program`, in the order of its help.
fn verbs(program: &Command) -> Vec<Verb> {
    let mut found = Vec::new();
    for command in program.get_subcommands() {
        collect(command, "", &mut found);
    }
    found
}

fn collect(command: &Command, before: &str, found: &mut Vec<Verb>) {
    let name = format!("{before}{}", command.get_name());
    let more = format!("{name} ");
    // One that only leads to others is no verb.
    if !command.is_subcommand_required_set() {
        let about = command.get_about().map(ToString::to_string);
        found.push(Verb {
            name,
            about: about.unwrap_or_default(),
        });
    }
    for command in command.get_subcommands() {
        collect(command, &more, found);
    }
}

/// What all verbs print, of any machine and of each kind.
fn printed() -> Printed {
    let mut all = any::printed();
    for kind in KINDS {
        let own = (kind.printed)();
        all.forms.extend(own.forms);
        all.parts.extend(own.parts);
    }
    all
}

/// The schema of what `program` prints.
fn document(program: &Command) -> Value {
    let Printed { forms, parts } = printed();
    let refused = Verb {
        name: NO_VERB.into(),
        about: "The words of the command line were refused, so that there is no verb.".into(),
    };
    let mut verbs = verbs(program);
    verbs.push(refused);
    let mut parts: Map<String, Value> = parts
        .into_iter()
        .map(|(name, shape)| (name.to_owned(), shape.schema()))
        .collect();
    parts.insert("failure".into(), failed());
    let mut choices = Vec::new();
    for verb in &verbs {
        let name = format!("verb-{}", verb.name.replace(' ', "-"));
        let name = name.trim_end_matches('-').to_owned();
        choices.push(part(&name).schema());
        let own = forms.iter().filter(|it| it.verb == verb.name);
        parts.insert(name, of_verb(verb, own));
    }
    json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "$id": format!("urn:truestage:output:{SCHEMA}"),
        "title": "What truestage prints with --json",
        "description": "One object, or with `monitor` and `align` an object a line. docs/json.md says what is promised.",
        "type": "object",
        "required": ["schema", "verb"],
        "oneOf": choices,
        "$defs": parts,
    })
}

fn of_verb<'f>(verb: &Verb, forms: impl Iterator<Item = &'f Form>) -> Value {
    let forms = forms.map(|form| with_head(verb, form.what, form.members.clone(), form.is_judged));
    json!({
        "title": format!("truestage {}", verb.name).trim_end(),
        "description": verb.about,
        // Of a failure, which is described once for all verbs, too.
        "properties": {"verb": constant(verb.name.as_str()).schema()},
        "anyOf": forms.chain([part("failure").schema()]).collect::<Vec<_>>(),
    })
}

/// What any verb prints that has no result.
fn failed() -> Value {
    let head = [("schema", constant(SCHEMA)), ("verb", text())];
    let findings = list(part("finding")).about("Of a configuration that is not sound, each.");
    let members = head.into_iter().chain(failure());
    let mut schema = object(members.chain([("findings?", findings)])).schema();
    schema["title"] = json!("a failure, and no result");
    schema
}

/// An object of this form, with what every object says of itself.
fn with_head(verb: &Verb, what: &str, members: Vec<Member>, is_judged: bool) -> Value {
    let head = [
        ("schema", constant(SCHEMA)),
        ("verb", constant(verb.name.as_str())),
    ];
    let beside = is_judged.then(failure_beside).into_iter().flatten();
    let mut schema = object(head.into_iter().chain(members).chain(beside)).schema();
    schema["title"] = json!(what);
    if is_judged {
        schema["dependentRequired"] = json!({"error": ["exit_code"], "exit_code": ["error"]});
    }
    schema
}
