//! A machine's file that is being made: an example's sections and keys, each with what its declaration says.

use std::collections::BTreeSet;
use std::path::Path;

use serde_json::Value;

use crate::config::explained::{self, Explained};
use crate::config::lines::{Line, MARK, below, lines};
use crate::ports::Endpoint;

/// How wide comments are.
const WIDTH: usize = 98;

/// The file.
#[derive(Clone, Debug)]
pub(super) struct Draft {
    sections: Vec<Section>,
}

#[derive(Clone, Debug, Default)]
struct Section {
    /// As it stands in the file; empty for the keys before the first one.
    text: String,
    path: String,
    keys: Vec<Key>,
}

#[derive(Clone, Debug)]
struct Key {
    name: String,
    value: String,
    /// An example's value, which every machine has another of.
    is_marked: bool,
}

/// A key of the file.
#[derive(Clone, Debug)]
pub(super) struct Place {
    /// Where it stands: `axis.x.soft_min_mm`.
    pub(super) path: String,
    pub(super) value: String,
    pub(super) explained: Explained,
}

impl Draft {
    /// Of the file of a machine that ships.
    pub(super) fn of(example: &str) -> Self {
        let mut sections = vec![Section::default()];
        for (_, line) in lines(example) {
            match (line, sections.last_mut()) {
                (Line::Section { text, path }, _) => sections.push(Section {
                    text: text.to_owned(),
                    path,
                    keys: Vec::new(),
                }),
                (Line::Key { name, value }, Some(last)) => last.keys.push(Key {
                    name: name.to_owned(),
                    value: value.to_owned(),
                    is_marked: false,
                }),
                (Line::Key { .. }, None) => {}
            }
        }
        let mut draft = Self { sections };
        draft.mark();
        draft
    }

    fn mark(&mut self) {
        for section in &mut self.sections {
            for key in &mut section.keys {
                let explained = explained::of_key(&section.path, &key.name);
                key.is_marked = explained.is_some_and(|it| it.is_own);
            }
        }
    }

    fn places(&self) -> impl Iterator<Item = (&Section, &Key)> {
        let sections = self.sections.iter();
        sections.flat_map(|section| section.keys.iter().map(move |key| (section, key)))
    }

    /// What is still to be filled in.
    pub(super) fn marked(&self) -> Vec<Place> {
        let marked = self.places().filter(|(_, key)| key.is_marked);
        marked.filter_map(place).collect()
    }

    /// The key at `path`, if there is one.
    pub(super) fn at(&self, path: &str) -> Option<Place> {
        let mut places = self.places();
        let found = places.find(|(section, key)| below(&section.path, &key.name) == path);
        found.and_then(place)
    }

    /// Every key's place.
    pub(super) fn paths(&self) -> Vec<String> {
        let all = self.places();
        all.map(|(section, key)| below(&section.path, &key.name))
            .collect()
    }

    /// Gives the key at `path` the value that was typed, a text with or without its quotes; whether there is such a
    /// key.
    pub(super) fn set(&mut self, path: &str, typed: &str) -> bool {
        self.change(path, |key| {
            let is_text = key.value.starts_with('"') && !typed.starts_with(['"', '\'']);
            key.value = match is_text {
                true => Value::from(typed).to_string(),
                false => typed.to_owned(),
            };
            key.is_marked = false;
        })
    }

    fn change(&mut self, path: &str, change: impl FnOnce(&mut Key)) -> bool {
        let sections = self.sections.iter_mut();
        let mut keys = sections.flat_map(|it| {
            let path = &it.path;
            it.keys
                .iter_mut()
                .map(move |key| (below(path, &key.name), key))
        });
        let found = keys.find(|(own, _)| own == path);
        found.map(|(_, key)| change(key)).is_some()
    }

    /// Likewise, of what somebody must still look at.
    pub(super) fn propose(&mut self, path: &str, value: &str) -> bool {
        self.change(path, |key| key.value = value.to_owned())
    }

    /// Says where a bus or a line is found.
    pub(super) fn connect(&mut self, name: &str, endpoint: &Endpoint) {
        let text = |it: &Path| it.to_string_lossy().into_owned();
        let key = |key: &str| format!("can.{name}.{key}");
        match endpoint {
            Endpoint::SocketCan(interface) => {
                self.set(&key("transport"), "socketcan");
                self.change(&key("path"), |it| it.name = "interface".into());
                self.set(&key("interface"), interface);
            }
            Endpoint::Slcan(path) => {
                self.set(&key("path"), &text(path));
            }
            Endpoint::Serial(path) => {
                self.set(&format!("serial.{name}.path"), &text(path));
            }
        }
    }

    /// The file, with a comment for each key where it first stands.
    pub(super) fn text(&self) -> String {
        let mut told = BTreeSet::new();
        let mut text = HEAD.to_owned();
        for section in &self.sections {
            if !section.text.is_empty() {
                let title = explained::of_section(&section.path);
                text += "\n";
                text += &title.map_or_else(String::new, |it| comment(&it, &mut told));
                text += &format!("{}\n", section.text);
            }
            for key in &section.keys {
                if let Some(it) = explained::of_key(&section.path, &key.name) {
                    text += &comment(&it, &mut told);
                }
                text += &format!("{} = {}", key.name, key.value);
                if key.is_marked {
                    text += &format!("   # {MARK}");
                }
                text += "\n";
            }
        }
        text
    }
}

const HEAD: &str = "\
# A machine of truestage. configs/README.md describes every key, `truestage check` judges this file.
#
# A value with a mark in capitals behind it is an example's: write your machine's, and take the mark
# away. Nothing moves before. What a key means stands where it comes first.

";

fn place((section, key): (&Section, &Key)) -> Option<Place> {
    Some(Place {
        path: below(&section.path, &key.name),
        value: key.value.clone(),
        explained: explained::of_key(&section.path, &key.name)?,
    })
}

/// Once for all that are alike.
fn comment(it: &Explained, told: &mut BTreeSet<String>) -> String {
    match told.insert(it.of.clone()) {
        true => wrapped(&it.text),
        false => String::new(),
    }
}

fn wrapped(text: &str) -> String {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.chars().count() + word.chars().count() < WIDTH => {
                *line += " ";
                *line += word;
            }
            _ => lines.push(format!("# {word}")),
        }
    }
    lines.iter().map(|line| format!("{line}\n")).collect()
}

#[cfg(test)]
mod tests {
    use super::super::example::Example;
    use super::*;
    use crate::config::parse;
    use clap::ValueEnum;

    const LINEAR: &str = include_str!("../../../../configs/machines/linear.toml");

    #[test]
    fn what_is_written_is_the_example_with_every_key_explained_once_and_its_own_values_marked() {
        for demo in Example::value_variants() {
            let example = demo.text;
            let text = Draft::of(example).text();
            let seen = parse(&text, "new.toml").unwrap_or_else(|error| panic!("{error}"));
            let shipped = parse(example, "shipped.toml").expect("it ships");
            let name = demo.name;
            assert_eq!(
                format!("{:?}", seen.config),
                format!("{:?}", shipped.config),
                "{name}"
            );
            assert!(
                seen.warnings.is_empty() && seen.filled_in().is_err(),
                "{name}"
            );
            let unfilled = seen.unfilled.iter().map(|it| it.key.clone());
            let marked = Draft::of(example).marked().into_iter().map(|it| it.path);
            assert!(unfilled.eq(marked), "{name}: `check` names what is marked");
            let explained = text.matches("# 0x1018:01. (integer, req.)\n").count();
            assert!(explained <= 2, "{name}: once for drives, once for modules");
            for section in Draft::of(example).sections {
                for key in section.keys {
                    let it = explained::of_key(&section.path, &key.name);
                    assert!(it.is_some(), "{name}: {}", below(&section.path, &key.name));
                }
            }
        }
    }

    #[test]
    fn a_value_that_was_given_is_marked_no_more_and_a_text_gets_its_quotes() {
        let mut draft = Draft::of(LINEAR);
        let before = draft.marked().len();
        assert!(draft.set("machine.stage_serial", "TS-7"));
        assert!(draft.set("axis.x.soft_min_mm", "-1.5"));
        assert!(!draft.set("axis.x.soft_mim_mm", "-1.5"));
        draft.connect("can0", &Endpoint::SocketCan("can1".into()));
        draft.connect("laser", &Endpoint::Serial("/dev/laser".into()));
        assert_eq!(draft.marked().len(), before - 4);
        let text = draft.text();
        for line in [
            "stage_serial = \"TS-7\"\n",
            "soft_min_mm = -1.5\n",
            "soft_max_mm = 63.0   # FILL IN\n",
            "transport = \"socketcan\"\n",
            "interface = \"can1\"\n",
            "path = \"/dev/laser\"\n",
            "# Soft limit; also written to the drive (0x607D)",
        ] {
            assert!(text.contains(line), "{line}: {text}");
        }
        let longest = text.lines().map(|it| it.chars().count()).max();
        assert!(longest <= Some(WIDTH + 2), "{longest:?}");
        parse(&text, "new.toml").unwrap_or_else(|error| panic!("{error}"));
    }
}
