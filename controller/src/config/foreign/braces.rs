//! Sections in braces, as in JSON, or in round brackets, as in Python.

use super::{DEPTH_MAX, Entry, Node, Tree, is_name};

/// The section that begins on the first of `lines`; `None` where it is none, or does not end.
pub(super) fn read(lines: &[&str]) -> Option<Tree> {
    let first = lines.first()?.trim_end();
    if !first.ends_with(['{', '(', ',']) || first.trim_start().starts_with(['#', '[']) {
        return None;
    }
    let mut reader = Reader::default();
    for (at, line) in lines.iter().enumerate() {
        // A section of this language begins: the bracket was a stray one.
        if reader.lists == 0 && at > 0 && line.trim_start().starts_with('[') {
            return None;
        }
        reader.line(at, line)?;
        // An entry that begins a line at the outermost level is no part of a section in braces.
        if reader.open.is_empty() {
            let root = reader.root.take()?;
            let is_meant = at > 0 && (is_path(&root.name) || root.name.is_empty());
            return is_meant.then_some(Tree {
                root,
                count: at + 1,
                language: reader.language,
            });
        }
    }
    None
}

fn is_path(name: &str) -> bool {
    name.split(['.', '/']).all(is_name)
}

#[derive(Default)]
struct Reader {
    /// Sections that have begun and not ended, with the bracket that ends each.
    open: Vec<(Node, char)>,
    root: Option<Node>,
    /// What was read since the last entry, and where it began.
    said: String,
    from: usize,
    quote: Option<char>,
    /// How many lists are open.
    lists: usize,
    language: &'static str,
}

impl Reader {
    /// Reads one line; `None` where it cannot be of a section in braces.
    fn line(&mut self, at: usize, line: &str) -> Option<()> {
        let mut rest = line.chars().peekable();
        while let Some(it) = rest.next() {
            let is_comment = it == '#' || it == '/' && rest.peek() == Some(&'/');
            match it {
                _ if self.quote.is_some() => {
                    self.quote = self.quote.filter(|quote| *quote != it);
                    self.say(at, it);
                }
                _ if is_comment => break,
                '"' | '\'' => {
                    self.quote = Some(it);
                    self.say(at, it);
                }
                '[' => {
                    self.lists += 1;
                    self.say(at, it);
                }
                ']' => {
                    self.lists = self.lists.checked_sub(1)?;
                    self.say(at, it);
                }
                '{' | '(' if self.lists == 0 => self.begin(at, it)?,
                '}' | ')' if self.lists == 0 => self.end(it)?,
                ',' | ';' if self.lists == 0 => self.entry(),
                _ => self.say(at, it),
            }
        }
        // A text ends with its line.
        if self.quote.is_some() || self.open.is_empty() && self.root.is_none() {
            return None;
        }
        if self.lists == 0 {
            self.entry();
        }
        Some(())
    }

    fn say(&mut self, at: usize, it: char) {
        if self.said.trim().is_empty() {
            self.said.clear();
            self.from = at;
        }
        self.said.push(it);
    }

    fn begin(&mut self, at: usize, bracket: char) -> Option<()> {
        let is_marked = self.said.contains([':', '"', '\'']);
        let name = self
            .said
            .trim_matches(['"', '\'', ' ', '\t', ':', '=', '>', '@']);
        // A section's name, and no text with a bracket in it.
        if self.open.len() == DEPTH_MAX
            || !name.is_empty() && !is_path(name)
            || self.open.is_empty() && self.root.is_some()
        {
            return None;
        }
        let name = name.to_owned();
        self.said.clear();
        if self.open.is_empty() {
            self.language = if bracket == '{' && is_marked {
                "JSON"
            } else {
                "a program"
            };
        }
        let end = if bracket == '{' { '}' } else { ')' };
        self.open.push((
            Node {
                name,
                line: at,
                ..Node::default()
            },
            end,
        ));
        Some(())
    }

    fn entry(&mut self) {
        let text = self.said.trim().to_owned();
        self.said.clear();
        if let (Some((node, _)), false) = (self.open.last_mut(), text.is_empty()) {
            node.entries.push(Entry {
                line: self.from,
                text,
            });
        }
    }

    fn end(&mut self, bracket: char) -> Option<()> {
        self.entry();
        let (node, end) = self.open.pop()?;
        if end != bracket {
            return None;
        }
        match self.open.last_mut() {
            Some((outer, _)) => match as_list(&node) {
                Some(list) => outer.entries.push(list),
                None => outer.inner.push(node),
            },
            None => self.root = Some(node),
        }
        Some(())
    }
}

/// `(0, 1)` is how Python writes a list.
fn as_list(node: &Node) -> Option<Entry> {
    let is_plain = |it: &Entry| !it.text.contains([':', '=']);
    let is_list =
        node.inner.is_empty() && !node.entries.is_empty() && node.entries.iter().all(is_plain);
    let values: Vec<&str> = node.entries.iter().map(|it| it.text.as_str()).collect();
    is_list.then(|| Entry {
        line: node.line,
        text: format!("{} = [{}]", node.name, values.join(", ")),
    })
}
