//! A text that is no TOML: each line that is not, in the words of whoever wrote it, and the text without them, so that
//! the rest can be judged all the same.

mod twice;

use std::collections::BTreeMap;

use serde_json::Value as Schema;
use toml::de::DeTable;

use super::diagnostic::{Diagnostic, shown};
use super::foreign::{self, Around, Foreign};
use super::lines::below;
use super::place::is_of_key;
use super::slips::{self, End, Slip, goes_on, headings, informed, is_toml};
use super::wanted::Wanted;

/// So many lines are told one by one; a file with more is hardly a configuration.
const TOLD_MAX: usize = 25;

/// What a text says besides what is no TOML in it.
#[derive(Default)]
pub(super) struct Recovered {
    /// With as many lines, each in its place: as it was meant where that can be told, empty otherwise.
    pub(super) text: String,
    pub(super) findings: Vec<Diagnostic>,
    /// Keys that are there and cannot be read.
    pub(super) unread: Vec<String>,
    /// Keys that are sections elsewhere, or the other way round: nothing more is said of them.
    pub(super) contested: Vec<String>,
    /// Sections whose last lines cannot be read.
    pub(super) cut_short: Vec<String>,
    /// Whether a section is there whose name cannot be read.
    pub(super) has_lost_heading: bool,
    /// Lines whose value was taken for a text without quotes.
    pub(super) taken_for_text: Vec<usize>,
}

impl Recovered {
    /// Of a text that is TOML throughout.
    pub(super) fn of(text: &str) -> Self {
        Self {
            text: text.to_owned(),
            ..Self::default()
        }
    }
}

impl Recovered {
    /// What is wrong with the line, which is the `number`th.
    fn note(&mut self, slip: &Slip, section: &Section, (line, number): (&str, usize), file: &str) {
        let read = slip.meant.as_deref().filter(|it| it.contains('='));
        let is_heading = slip.meant.as_deref().is_some_and(|it| it.starts_with('['));
        let key = match &slip.key {
            Some(key) => below(&section.path, key),
            None if is_heading => section.path.clone(),
            None => section.key(read.unwrap_or(line)),
        };
        if (slip.meant.is_none() || slip.key.is_some()) && !key.is_empty() {
            self.unread.push(key.clone());
        }
        self.unread
            .extend(slip.lost.iter().map(|it| below(&section.path, it)));
        self.has_lost_heading |= slip.is_lost_heading;
        if slip.is_lost_heading && slip.meant.is_some() {
            self.cut_short.push(section.path.clone());
        }
        if slip.is_text {
            self.taken_for_text.push(number);
        }
        self.findings.push(Diagnostic {
            file: file.to_owned(),
            line: number,
            column: line.get(..slip.at).unwrap_or(line).chars().count() + 1,
            key,
            cause: slip.cause.clone(),
            help: slip.help.clone(),
        });
    }
}

impl Recovered {
    /// What is wrong with a section of another language, `before` lines into the file; gives its lines as they were meant.
    fn note_foreign(
        &mut self,
        foreign: Foreign,
        section: &mut Section,
        (before, file): (usize, &str),
    ) -> Vec<String> {
        let line = before + 1;
        self.has_lost_heading |= foreign.path.is_none();
        let tell = |line, key: String, cause: String, help: String| Diagnostic {
            file: file.to_owned(),
            line,
            column: 1,
            key,
            cause,
            help,
        };
        let key = foreign.path.unwrap_or_else(|| section.path.clone());
        self.findings
            .push(tell(line, key, foreign.cause, foreign.help));
        for (at, key, help) in foreign.unread {
            self.unread.push(key.clone());
            self.findings.push(tell(
                line + at,
                key,
                "its value cannot be read as it is written here".into(),
                help,
            ));
        }
        for line in &foreign.meant {
            section.enter(line);
        }
        foreign.meant
    }
}

/// How many lines are of a section whose name cannot be read.
fn lost(lines: &[&str]) -> usize {
    let next = lines
        .iter()
        .position(|it| it.trim_start().starts_with('[') && is_header(it));
    next.unwrap_or(lines.len())
}

/// What can be read of `text`; `file` is its name in findings, `schema` what it should be.
pub(super) fn recovered(text: &str, file: &str, schema: &Schema) -> Recovered {
    let mut found = Recovered::default();
    let lines = text.split('\n');
    let lines: Vec<&str> = lines
        .map(|it| it.strip_suffix('\r').unwrap_or(it))
        .collect();
    let mut kept: Vec<String> = Vec::with_capacity(lines.len());
    let mut section = Section::default();
    let mut at = 0;
    let headings: Vec<&str> = lines
        .iter()
        .filter(|it| is_header(it))
        .map(|it| name_of(it))
        .collect();
    while let Some(line) = lines.get(at) {
        let count = extent(&lines[at..]);
        let whole = lines[at..at + count].join("\n");
        let around = Around {
            schema,
            section: &section.path,
            headings: &headings,
        };
        if found.findings.len() <= TOLD_MAX
            && !is_toml(&whole)
            && let Some(foreign) = foreign::of(&lines[at..], &around)
        {
            at += foreign.count;
            kept.extend(found.note_foreign(foreign, &mut section, (kept.len(), file)));
            continue;
        }
        match is_toml(&whole) {
            true => {
                section.enter(line);
                kept.extend(lines[at..at + count].iter().map(|it| (*it).to_owned()));
                at += count;
            }
            false => {
                let wanted = Wanted::at(schema, &section.path);
                let next = lines.get(at + 1).filter(|_| count == 1);
                let joined = next.and_then(|it| informed::of_two_lines(line, it, &wanted));
                let count = if joined.is_some() { 2 } else { count };
                let slip = joined.unwrap_or_else(|| slip(line, &whole, count, (schema, &wanted)));
                let meant = slip.meant.clone().unwrap_or_default();
                section.enter(&meant);
                found.note(&slip, &section, (line, at + 1), file);
                kept.push(meant);
                kept.extend((1..count).map(|_| String::new()));
                at += count;
                if slip.is_lost_heading {
                    let lost = lost(&lines[at..]);
                    kept.extend((0..lost).map(|_| String::new()));
                    at += lost;
                }
            }
        }
    }
    twice::take_out(&mut kept, (file, schema), &mut found);
    found.text = kept.join("\n");
    found.findings.sort_by_key(|it| (it.line, it.column));
    abridge(&mut found.findings);
    found
}

/// How many of these lines the first of them goes on over.
fn extent(lines: &[&str]) -> usize {
    let Some(end) = goes_on(lines[0]) else {
        return 1;
    };
    let mut whole = lines[0].to_owned();
    for (at, line) in lines.iter().enumerate().skip(1) {
        // A key or a section: what was begun was never ended.
        if end == End::List && (begins(line) || is_header(line)) {
            let is_said = |it: &&str| !(it.trim().is_empty() || it.trim_start().starts_with('#'));
            let last = lines[1..at].iter().rposition(is_said);
            return last.map_or(1, |it| it + 2);
        }
        whole = whole + "\n" + line;
        let is_end = match end {
            End::List => line.trim_start().starts_with(']'),
            End::Table => line.trim_start().starts_with('}'),
            End::Text => false,
        };
        if is_end || is_toml(&whole) {
            return at + 1;
        }
    }
    1
}

/// Whether a key stands at the beginning of the line.
fn begins(line: &str) -> bool {
    let key = line.split_once('=').map(|it| it.0.trim());
    key.is_some_and(|it| !it.is_empty() && it.chars().all(is_of_key))
}

/// What is wrong with a line, or with what goes on over `count` lines.
fn slip(line: &str, whole: &str, count: usize, (schema, wanted): (&Schema, &Wanted<'_>)) -> Slip {
    let place = DeTable::parse(whole).err().and_then(|it| it.span());
    let at = place.map_or(0, |it| it.start);
    let informed = || informed::of_line(line, at, wanted);
    let is_taken = |it: &Slip| it.meant.as_deref().is_some_and(|it| wanted.takes(it));
    match goes_on(line) {
        Some(end) => (count == 1)
            .then(informed)
            .filter(is_taken)
            .unwrap_or_else(|| slips::of_lines(line, whole, end, count)),
        None if slips::is_mark(line) => slips::of_line(line, at),
        None => headings::of_schema(line, schema).unwrap_or_else(informed),
    }
}

/// Of a file without a line that is right, one finding says it.
fn abridge(findings: &mut Vec<Diagnostic>) {
    let more = findings.len().saturating_sub(TOLD_MAX);
    if more > 0 {
        findings.truncate(TOLD_MAX);
        if let Some(last) = findings.last_mut() {
            last.help +=
                &format!("; {more} more places below it are no TOML: is this a configuration?");
        }
    }
}

/// The section that a line stands in, as findings name it.
#[derive(Default)]
struct Section {
    path: String,
    /// How often each section of a list was seen.
    seen: BTreeMap<String, usize>,
}

impl Section {
    fn enter(&mut self, line: &str) {
        let line = line.trim();
        if !is_header(line) {
            return;
        }
        let name = name_of(line);
        self.path = match line.starts_with("[[") {
            true => {
                let count = self.seen.entry(name.to_owned()).or_default();
                *count += 1;
                format!("{name}.{}", *count - 1)
            }
            false => self.within(name),
        };
    }

    /// `[platform.actuator.strokes]` is of the last `[[platform.actuator]]`.
    fn within(&self, name: &str) -> String {
        let lists = self.seen.iter().rev();
        let mut inner = lists.filter_map(|(list, count)| {
            let rest = name.strip_prefix(list.as_str())?.strip_prefix('.')?;
            Some(format!("{list}.{}.{rest}", count - 1))
        });
        inner.next().unwrap_or_else(|| name.to_owned())
    }

    /// The path of the key of `line`, as far as the line tells it.
    fn key(&self, line: &str) -> String {
        let line = line.split(" #").next().unwrap_or_default().trim();
        let (key, _) = line.split_once('=').unwrap_or_else(|| {
            let end = line.find([':', ' ']).unwrap_or(line.len());
            (&line[..end], "")
        });
        let key = key.trim().trim_end_matches([':', '-', '=']).trim_end();
        let is_letter = |it: char| it.is_alphanumeric() || "_- ".contains(it);
        match key.is_empty() || !key.chars().all(is_letter) {
            true => self.path.clone(),
            false => below(&self.path, &shown(key)),
        }
    }
}

/// `[axis.x]`, and no line of a list over several lines.
fn is_header(line: &str) -> bool {
    let line = line.trim();
    let name = name_of(line);
    let is_name = |it: char| it.is_alphanumeric() || "_.-\"' ".contains(it);
    let is_list = name.starts_with(|it: char| it.is_ascii_digit() || it == '-');
    line.starts_with('[') && !name.is_empty() && !is_list && name.chars().all(is_name)
}

/// `axis.x` of `[axis.x]`, with whatever comment.
fn name_of(header: &str) -> &str {
    let inner = header.trim_start_matches('[');
    inner.split(']').next().unwrap_or_default().trim()
}

#[cfg(test)]
mod tests;
