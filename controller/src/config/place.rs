//! Where a key stands in the file, and what a key is made of.

use core::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Whether a key without quotation marks can have that letter (TOML v1.0, keys).
pub(crate) fn is_of_key(it: char) -> bool {
    it.is_ascii_alphanumeric() || "_-".contains(it)
}

/// What is wrong with a key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    /// That it is there.
    Name,
    /// What it says.
    Value,
    /// How much it says: the file can be read, and judged further.
    Size,
}

/// The places of a file's keys; none in one that cannot be read.
pub(super) struct Places<'a>(Option<Spanned<DeTable<'a>>>);

impl<'a> Places<'a> {
    /// Those of `text`: looked up often, and read once.
    pub(super) fn of(text: &'a str) -> Self {
        Self(DeTable::parse(text).ok())
    }

    /// Where that part of a dotted key stands, of a section its name; the deepest table on the way when it is absent.
    pub(super) fn span_of(&self, key: &str, part: Part) -> Option<Range<usize>> {
        span_in(self.0.as_ref()?.get_ref(), key, part)
    }
}

fn span_in(mut table: &DeTable<'_>, key: &str, part: Part) -> Option<Range<usize>> {
    let mut span = None;
    // `actuator[0]` is `actuator.0`.
    let mut parts = key.split(['.', '[', ']']).filter(|it| !it.is_empty());
    // `["axis.x"]` is one name with a point in it.
    if key.contains('.')
        && let Some((name, _)) = table.get_key_value(key)
    {
        return Some(name.span());
    }
    while let Some(own) = parts.next() {
        let exact = table.get_key_value(own);
        // What is in capitals is told as what it was meant to be.
        let alike = || {
            let mut names = table.iter();
            names.find(|(name, _)| name.get_ref().eq_ignore_ascii_case(own))
        };
        let Some((name, value)) = exact.or_else(alike) else {
            break;
        };
        span = Some(match value.get_ref() {
            DeValue::Table(_) => name.span(),
            _ if part == Part::Name => name.span(),
            _ => value.span(),
        });
        match value.get_ref() {
            DeValue::Table(inner) => table = inner,
            DeValue::Array(items) => {
                let at = parts.next().and_then(|it| it.parse::<usize>().ok());
                let Some(item) = at.and_then(|at| items.get(at)) else {
                    break;
                };
                span = Some(item.span());
                match item.get_ref() {
                    DeValue::Table(inner) => table = inner,
                    _ => break,
                }
            }
            _ => break,
        }
    }
    span
}
