//! Sections that are told apart by how far their lines stand in, as in YAML.

use super::{DEPTH_MAX, Entry, Node, Tree, is_name};
use crate::config::slips::comment_at;

/// The section that begins on the first of `lines`; `None` where it is none.
pub(super) fn read(lines: &[&str]) -> Option<Tree> {
    let name = named(lines.first()?)?;
    let count = extent(lines);
    let mut root = Node {
        name,
        ..Node::default()
    };
    let last = fill(&mut root, lines, (1, count), 1)?;
    let is_meant = last == count && count > 1;
    is_meant.then_some(Tree {
        root,
        count,
        language: "YAML",
    })
}

/// How many lines are of it: those that stand further in than the first, without empty ones at their end.
fn extent(lines: &[&str]) -> usize {
    let begin = depth(lines[0]);
    let is_in = |it: &&&str| !is_said(it) || depth(it) > begin;
    let within = lines[1..].iter().take_while(is_in).count();
    let last = lines[1..=within].iter().rposition(|it| is_said(it));
    last.map_or(1, |it| it + 2)
}

fn is_said(line: &str) -> bool {
    let line = line.trim();
    !line.is_empty() && !line.starts_with('#')
}

fn depth(line: &str) -> usize {
    line.len() - line.trim_start().len()
}

/// Without a comment behind it.
fn said(line: &str) -> &str {
    line[..comment_at(line)].trim()
}

/// `compensation` of `compensation:`.
fn named(line: &str) -> Option<String> {
    let name = said(line).strip_suffix(':')?.trim_matches(['"', '\'', ' ']);
    name.split('.').all(is_name).then(|| name.to_owned())
}

/// Reads the lines from the first to before the last into `node`; gives where it stopped, as they stand less far in.
fn fill(node: &mut Node, lines: &[&str], (from, to): (usize, usize), deep: usize) -> Option<usize> {
    if deep > DEPTH_MAX {
        return None;
    }
    let first = (from..to).find(|it| is_said(lines[*it]))?;
    let within = depth(lines[first]);
    let mut at = first;
    while at < to {
        let line = lines[at];
        if !is_said(line) {
            at += 1;
            continue;
        }
        if depth(line) < within {
            return Some(at);
        }
        at = match named(line) {
            Some(name) => inner(node, name, lines, (at, to), deep)?,
            None => {
                let text = said(line).to_owned();
                text.contains(':').then_some(())?;
                node.entries.push(Entry { line: at, text });
                at + 1
            }
        };
    }
    Some(to)
}

/// A section in this one, or a list with one entry a line.
fn inner(
    node: &mut Node,
    name: String,
    lines: &[&str],
    (at, to): (usize, usize),
    deep: usize,
) -> Option<usize> {
    let items = lines[at + 1..to].iter().map(|it| said(it));
    let items = items.map_while(|it| it.strip_prefix("- "));
    let items: Vec<&str> = items.collect();
    if !items.is_empty() {
        let text = format!("{name}: [{}]", items.join(", "));
        node.entries.push(Entry { line: at, text });
        return Some(at + 1 + items.len());
    }
    let mut own = Node {
        name,
        line: at,
        ..Node::default()
    };
    let next = fill(&mut own, lines, (at + 1, to), deep + 1)?;
    node.inner.push(own);
    Some(next)
}
