//! Keys and sections that stand in a text a second time, or one as the other.

use std::collections::BTreeMap;

use serde_json::Value as Schema;
use toml::de::DeTable;

use super::{Recovered, TOLD_MAX, is_header, name_of};
use crate::config::diagnostic::{Diagnostic, shown};
use crate::config::lines::below;
use crate::config::place::is_of_key;
use crate::config::wanted::{Wanted, is_list};

/// Tells each, and leaves it out of `lines`, each of which is TOML by itself.
pub(super) fn take_out(
    lines: &mut [String],
    (file, schema): (&str, &Schema),
    found: &mut Recovered,
) {
    // Each round leaves out one line at least.
    for _ in 0..lines.len() {
        let text = lines.join("\n");
        let Err(error) = DeTable::parse(&text) else {
            return;
        };
        let at = error.span().map_or(0, |it| it.start);
        let before = text.get(..at).unwrap_or_default();
        let number = before.matches('\n').count();
        let column = before
            .rsplit('\n')
            .next()
            .unwrap_or_default()
            .chars()
            .count()
            + 1;
        let place = Place::at(lines, number);
        let is_again = has_begun_again(lines, number, &place);
        let lacking = place.is_section().then(|| place.lacking(schema));
        let lacking = lacking.flatten();
        let (cause, help) = match is_again {
            true => again(&place),
            false => place.told(lacking.as_ref()),
        };
        let name = name_of(place.line);
        let help = match place.is_section() && is_list(schema, name) {
            true => format!("write `[[{name}]]`: there can be several, each with two brackets"),
            false => help,
        };
        found.contested.push(place.key());
        // Which of the two was meant to be the missing one nobody knows.
        found.has_lost_heading |= lacking.is_some();
        found.findings.push(Diagnostic {
            file: file.to_owned(),
            line: number + 1,
            column,
            key: place.key(),
            cause,
            help,
        });
        let is_section = place.is_section();
        match lacking {
            // Its keys are judged there, whichever it is.
            Some(other) => lines[other.line] = format!("[{}]", other.name),
            None => leave_out(lines, number, is_section || is_again),
        }
        // A file with more of them was pasted together: what follows would take long, and say nothing new.
        if found.findings.len() > TOLD_MAX {
            lines[number..].iter_mut().for_each(String::clear);
            found.has_lost_heading = true;
        }
    }
}

/// Whether the next key of the section, too, stands there a second time: it is another section's that lacks its name.
fn has_begun_again(lines: &[String], number: usize, place: &Place<'_>) -> bool {
    if place.is_section() || place.twice(None).is_none() {
        return false;
    }
    let rest = lines.iter().enumerate().skip(number + 1);
    let mut next = rest.filter(|(_, it)| !it.trim().is_empty() && !it.trim().starts_with('#'));
    next.next().is_some_and(|(at, line)| {
        let next = Place::at(lines, at);
        !is_header(line) && next.twice(None).is_some()
    })
}

fn again(place: &Place<'_>) -> (String, String) {
    let section = match name_of(place.section) {
        "" => "the top of the file".to_owned(),
        name => format!("[{name}]"),
    };
    let cause = format!("from here on keys stand that {section} has already");
    let help =
        "a line with the name of another section is missing above them: write it, or remove them";
    (cause, help.into())
}

/// The line, and all of the section that it begins.
fn leave_out(lines: &mut [String], number: usize, is_section: bool) {
    for (at, line) in lines.iter_mut().enumerate().skip(number) {
        if at > number && (!is_section || is_header(line)) {
            return;
        }
        line.clear();
    }
}

/// A section that is missing where another one stands twice.
struct Lacking {
    name: String,
    /// Of the one that has its place, from 0.
    line: usize,
    /// Whether that has its keys, too.
    by_keys: bool,
}

impl Lacking {
    /// What to do, told on line `here`.
    fn help(&self, here: usize) -> String {
        let name = &self.name;
        match (self.by_keys, self.line == here) {
            (false, _) => format!("did you mean [{name}] by one of them? It is missing"),
            (true, true) => {
                format!("write [{name}] here: it is missing, and the keys below are its own")
            }
            (true, false) => format!(
                "write [{name}] on line {}: it is missing, and the keys there are its own",
                self.line + 1
            ),
        }
    }
}

/// A line of a text.
struct Place<'a> {
    lines: &'a [String],
    /// Counted from 0.
    number: usize,
    line: &'a str,
    /// The section that it is in; the line itself where that begins one.
    section: &'a str,
}

impl<'a> Place<'a> {
    fn at(lines: &'a [String], number: usize) -> Self {
        let until = &lines[..=number];
        let section = until
            .iter()
            .rev()
            .map(|it| it.trim())
            .find(|it| is_header(it));
        Self {
            lines,
            number,
            line: lines[number].trim(),
            section: section.unwrap_or_default(),
        }
    }

    fn is_section(&self) -> bool {
        is_header(self.line)
    }

    fn key(&self) -> String {
        match self.line.split_once('=') {
            Some((key, _)) if !self.is_section() => below(name_of(self.section), key.trim()),
            _ => name_of(self.section).to_owned(),
        }
    }

    /// What is wrong, and what to do.
    fn told(&self, lacking: Option<&Lacking>) -> (String, String) {
        let told = self.twice(lacking).or_else(|| self.key_and_section());
        told.unwrap_or_else(|| {
            let cause = format!("`{}` goes on with what has ended before", shown(self.line));
            let help = "write all keys of a section below one line with its name in brackets";
            (cause, help.into())
        })
    }

    fn before(&self) -> impl Iterator<Item = &'a str> {
        self.lines.iter().map(|it| it.trim()).take(self.number)
    }

    /// Where the same key, or the same section, stands before.
    fn twice(&self, lacking: Option<&Lacking>) -> Option<(String, String)> {
        let is_section = self.is_section();
        let wanted = match is_section {
            true => name_of(self.line),
            false => self.line.split_once('=')?.0.trim(),
        };
        let mut section = "";
        let mut first = None;
        for (number, line) in self.before().enumerate() {
            if is_header(line) {
                section = line;
                // Each section of a list is another one.
                first = first.filter(|_| !(line.starts_with("[[") && line == self.section));
            }
            let seen = match (is_section, line.split_once('=')) {
                (true, _) if is_header(line) => name_of(line),
                (false, Some((key, _))) if section == self.section => key.trim(),
                _ => continue,
            };
            if seen == wanted && first.is_none() {
                first = Some((number + 1, line));
            }
        }
        let (number, first) = first?;
        let lists = [first, self.line].map(|it| it.starts_with("[["));
        if is_section && lists[0] != lists[1] {
            let cause = format!(
                "`{}` stands here, and `{}` on line {number}",
                shown(self.line),
                shown(first)
            );
            let help =
                "write both alike: [[...]] where there can be several, [...] where there is one";
            return Some((cause, help.into()));
        }
        let what = if is_section { "the section" } else { "the key" };
        let cause = format!("{what} stands here a second time; line {number} has it first");
        let help = match is_section {
            true => lacking.map_or_else(
                || "leave one of them out".to_owned(),
                |it| it.help(self.number),
            ),
            false => {
                "leave one of them out, or write the section's name that is missing between them"
                    .to_owned()
            }
        };
        Some((cause, help))
    }

    /// The section that is missing where this one stands twice.
    fn lacking(&self, schema: &Schema) -> Option<Lacking> {
        let section = name_of(self.line);
        let by_name = || {
            let name = self.by_name(section, schema)?;
            let line = self.number;
            Some(Lacking {
                name,
                line,
                by_keys: false,
            })
        };
        self.by_keys(section, schema).or_else(by_name)
    }

    fn headers(&self) -> impl Iterator<Item = &'a str> {
        let lines = self.lines.iter().map(|it| it.trim());
        lines.filter(|it| is_header(it)).map(name_of)
    }

    /// `axis.y.zero` where `axis.x.zero` stands twice, and only `y` has none; `axis.y` where that has only sections.
    fn by_name(&self, section: &str, schema: &Schema) -> Option<String> {
        let (group, rest) = section.split_once('.')?;
        // Of sections that nobody names each is another one.
        if !schema["properties"][group]["properties"].is_null() {
            return None;
        }
        let part = rest.split_once('.').map_or("", |it| it.1);
        let names = self.headers();
        let names = names.filter_map(|it| it.strip_prefix(group)?.strip_prefix('.'));
        let mut each: BTreeMap<&str, bool> = BTreeMap::new();
        for it in names {
            let (name, own) = it.split_once('.').unwrap_or((it, ""));
            *each.entry(name).or_default() |= own == part;
        }
        let mut lacking = each.into_iter().filter(|it| !it.1).map(|it| it.0);
        match (lacking.next(), lacking.next()) {
            (Some(one), None) if part.is_empty() => Some(below(group, one)),
            (Some(one), None) => Some(below(&below(group, one), part)),
            _ => None,
        }
    }

    /// The only section beside it that is not there and has all keys of one of the two, which it has not itself.
    fn by_keys(&self, section: &str, schema: &Schema) -> Option<Lacking> {
        let (around, _) = section.rsplit_once('.')?;
        let first = self
            .before()
            .position(|it| is_header(it) && name_of(it) == section);
        let both = [Some(self.number), first].into_iter().flatten();
        let own = Wanted::at(schema, section);
        let parts = Wanted::at(schema, around).keys();
        for line in both {
            let keys = self.keys_below(line);
            if keys.is_empty() || keys.iter().all(|it| own.has(it)) {
                continue;
            }
            let others = parts.iter().map(|it| below(around, it));
            let mut others = others.filter(|it| {
                let wanted = Wanted::at(schema, it);
                let has_all = keys.iter().all(|key| wanted.has(key));
                has_all && !self.headers().any(|header| header == it)
            });
            if let (Some(name), None) = (others.next(), others.next()) {
                return Some(Lacking {
                    name,
                    line,
                    by_keys: true,
                });
            }
        }
        None
    }

    /// The keys of the section that begins on that line.
    fn keys_below(&self, line: usize) -> Vec<&'a str> {
        let rest = self.lines[line + 1..].iter().map(|it| it.trim());
        let own = rest.take_while(|it| !is_header(it));
        let keys = own.filter_map(|it| Some(it.split_once('=')?.0.trim()));
        keys.filter(|it| !it.is_empty() && it.chars().all(is_of_key))
            .collect()
    }

    /// Where a key has the name that a section has here, or the other way round.
    fn key_and_section(&self) -> Option<(String, String)> {
        let here = self.key();
        let is_section = self.is_section();
        let own = name_of(self.section);
        let is_in =
            |inner: &str, outer: &str| inner == outer || inner.starts_with(&format!("{outer}."));
        let mut section = "";
        let mut is_same = false;
        let first = self.before().position(|line| {
            if is_header(line) {
                section = name_of(line);
                return !is_section && section.len() > own.len() && is_in(&here, section);
            }
            let Some((key, value)) = line.split_once('=') else {
                return false;
            };
            let key = below(section, key.trim());
            is_same = here == key && value.trim().starts_with('{');
            is_section && (is_in(&here, &key) || is_in(&key, &here))
        })?;
        let [what, other] = match is_section {
            true => ["section", "key"],
            false => ["key", "section"],
        };
        let help = match is_same {
            true => "leave one of them out".to_owned(),
            false => format!("one of them has the wrong name: correct the {other} or the {what}"),
        };
        let cause = format!("it is a {what} here, and a {other} on line {}", first + 1);
        Some((cause, help))
    }
}
