//! A section that stands over several lines as another language writes it: JSON, Python, YAML or XML; or in two versions.

mod braces;
mod home;
mod indents;
mod tags;
mod versions;

use serde_json::Value as Schema;

use super::diagnostic::shown;
use super::lines::below;
use super::slips::{informed, is_toml};
use super::wanted::{Wanted, heading};

/// No section has more lines, nor sections in more sections.
const LINES_MAX: usize = 200;
const DEPTH_MAX: usize = 6;

/// What a section says, in whatever language: lines count from the first of it.
#[derive(Debug, Default)]
struct Node {
    name: String,
    line: usize,
    entries: Vec<Entry>,
    inner: Vec<Node>,
}

#[derive(Clone, Debug)]
struct Entry {
    line: usize,
    text: String,
}

/// A tree, how many lines it takes, and the language that writes so.
struct Tree {
    root: Node,
    count: usize,
    language: &'static str,
}

impl Node {
    /// Whether keys of it, or of a section in it, stand behind a section in that.
    fn is_mixed(&self) -> bool {
        let first = self.inner.first().map_or(usize::MAX, |it| it.line);
        self.entries.iter().any(|it| it.line >= first) || self.inner.iter().any(Self::is_mixed)
    }
}

/// A section with its keys, where it is known which section it is.
struct Part<'a> {
    line: usize,
    path: Option<String>,
    entries: &'a [Entry],
}

/// Where a foreign section stands.
pub(super) struct Around<'a> {
    pub(super) schema: &'a Schema,
    /// The section above it, as findings name it.
    pub(super) section: &'a str,
    /// The names of all sections of the file.
    pub(super) headings: &'a [&'a str],
}

/// What is told of a foreign section.
pub(super) struct Foreign {
    /// So many lines it takes.
    pub(super) count: usize,
    /// As many lines, as they were meant.
    pub(super) meant: Vec<String>,
    pub(super) cause: String,
    pub(super) help: String,
    /// The first section in it; `None` where nobody knows which it is.
    pub(super) path: Option<String>,
    /// Keys that cannot be read: the line, the path, what it can have.
    pub(super) unread: Vec<(usize, String, String)>,
}

/// What begins on the first of `lines`, if it is a section of another language that ends.
pub(super) fn of(lines: &[&str], around: &Around<'_>) -> Option<Foreign> {
    let lines = &lines[..lines.len().min(LINES_MAX)];
    if let Some(versions) = versions::read(lines, around.section) {
        return Some(versions);
    }
    let tree = braces::read(lines)
        .or_else(|| tags::read(lines))
        .or_else(|| indents::read(lines))?;
    let mut parts = Vec::new();
    gather(&tree.root, &[], around, &mut parts);
    // Behind a section in it, keys of the outer one have no place in this file.
    let is_mixed = tree.root.is_mixed();
    if parts.is_empty() || is_mixed {
        return None;
    }
    let mut found = Foreign {
        count: tree.count,
        meant: vec![String::new(); tree.count],
        cause: format!("a section is written here as {} writes it", tree.language),
        help: String::new(),
        path: parts[0].path.clone(),
        unread: Vec::new(),
    };
    let mut said = Vec::new();
    for part in &parts {
        said.push(found.add(part, around.schema)?);
    }
    found.help = said.join("; ");
    Some(found)
}

/// Each section of the tree that has keys of its own.
fn gather<'a>(node: &'a Node, above: &[&'a str], around: &Around<'_>, parts: &mut Vec<Part<'a>>) {
    let between = |it: char| "./:\\".contains(it);
    let own = node.name.split(between).filter(|it| !it.is_empty());
    let names: Vec<&str> = above.iter().copied().chain(own).collect();
    if !node.entries.is_empty() {
        let keys: Vec<&str> = node
            .entries
            .iter()
            .filter_map(|it| key_of(&it.text))
            .collect();
        parts.push(Part {
            line: node.line,
            path: home::of(&names, &keys, around),
            entries: &node.entries,
        });
    }
    for it in &node.inner {
        gather(it, &names, around, parts);
    }
}

impl Foreign {
    /// Puts the part's lines where they stand; tells what to write, or nothing where two would be in one line.
    fn add(&mut self, part: &Part<'_>, schema: &Schema) -> Option<String> {
        let mut written = Vec::new();
        if let Some(path) = &part.path {
            let heading = heading(schema, path);
            self.put(part.line, &heading)?;
            let wanted = Wanted::at(schema, path);
            for entry in part.entries {
                let line = self.entry(entry, path, &wanted);
                self.put(entry.line, line.as_deref().unwrap_or_default())?;
                written.extend(line.map(|it| format!("`{}`", shown(&it))));
            }
            return Some(format!(
                "write `{heading}`, and below it, one a line, {}",
                written.join(", ")
            ));
        }
        let help = "write its name in brackets, `[section]`, and below it one `key = value` a line";
        Some(help.to_owned())
    }

    fn put(&mut self, at: usize, line: &str) -> Option<()> {
        let slot = self.meant.get_mut(at)?;
        if !slot.is_empty() {
            return None;
        }
        slot.push_str(line);
        Some(())
    }

    /// The line that an entry was meant to be; one that is not known is told with what it can be.
    fn entry(&mut self, entry: &Entry, path: &str, wanted: &Wanted<'_>) -> Option<String> {
        if let Some(line) = informed::entry(&entry.text, wanted) {
            return Some(line);
        }
        let key = key_of(&entry.text)?;
        let (_, raw) = entry.text.split_once([':', '='])?;
        let as_is = format!("{key} = {}", raw.trim());
        // What is wrong with a key or a value that can be read is told by what it is.
        if is_toml(&as_is) {
            return Some(as_is);
        }
        let help = match wanted.can_be(key) {
            Some(kind) => format!("give {kind}"),
            None => "remove it, or write `key = value`".to_owned(),
        };
        self.unread.push((entry.line, below(path, key), help));
        None
    }
}

/// `jerk` of `"jerk": 5.0`.
fn key_of(text: &str) -> Option<&str> {
    let (key, _) = text.split_once([':', '='])?;
    let key = key.trim().trim_matches(['"', '\'', '“', '”', ' ']);
    is_name(key).then_some(key)
}

fn is_name(text: &str) -> bool {
    !text.is_empty()
        && text
            .chars()
            .all(|it| it.is_alphanumeric() || "_-".contains(it))
}

#[cfg(test)]
mod tests;
