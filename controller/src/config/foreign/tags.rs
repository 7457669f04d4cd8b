//! Sections between tags, as in XML.

use super::{DEPTH_MAX, Entry, Node, Tree, is_name};
use crate::config::slips::informed::element;

/// The section that begins on the first of `lines`; `None` where it is none, or does not end.
pub(super) fn read(lines: &[&str]) -> Option<Tree> {
    let mut open = vec![Node {
        name: begun(lines.first()?)?,
        ..Node::default()
    }];
    for (at, line) in lines.iter().enumerate().skip(1) {
        let line = line.trim();
        if let Some(text) = element(line) {
            open.last_mut()?.entries.push(Entry { line: at, text });
        } else if let Some(name) = begun(line).filter(|_| open.len() < DEPTH_MAX) {
            open.push(Node {
                name,
                line: at,
                ..Node::default()
            });
        } else if let Some(name) = ended(line) {
            let node = open.pop().filter(|it| it.name == name)?;
            match open.last_mut() {
                Some(outer) => outer.inner.push(node),
                None => {
                    return Some(Tree {
                        root: node,
                        count: at + 1,
                        language: "XML",
                    });
                }
            }
        } else if !line.is_empty() && !line.starts_with("<!--") {
            return None;
        }
    }
    None
}

/// `x` of `<x>`.
fn begun(line: &str) -> Option<String> {
    let name = line.trim().strip_prefix('<')?.strip_suffix('>')?;
    is_name(name).then(|| name.to_owned())
}

/// `x` of `</x>`.
fn ended(line: &str) -> Option<&str> {
    line.strip_prefix("</")?.strip_suffix('>')
}
