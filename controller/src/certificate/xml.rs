//! A certificate as a tree of elements. Whoever writes a file must not be able to exhaust or mislead its reader: it is
//! limited in size, in elements and in depth, and it declares nothing (no DTD, hence no entities of its own).

use roxmltree::{Document, Node, ParsingOptions};

use super::{Unfit, unfit};

pub(super) const DCC: &str = "https://ptb.de/dcc";
pub(super) const SI: &str = "https://ptb.de/si";

/// A certificate with pictures of its laboratory in it has some hundred kilobytes.
pub(super) const BYTES_MAX: u64 = 4 << 20;
const NODES_MAX: u32 = 200_000;
/// A quantity in lists of lists is some 15 elements deep.
const DEPTH_MAX: usize = 64;
/// Its longest tag has some hundred bytes of namespaces. The parser compares each attribute with each other one of its tag.
const TAG_MAX: usize = 8 << 10;

/// The tree of `text`.
///
/// # Errors
/// When it is no XML, declares something, or is beyond a limit.
pub(super) fn parsed(text: &str) -> Result<Document<'_>, Unfit> {
    if !text
        .trim_start_matches('\u{feff}')
        .trim_start()
        .starts_with('<')
    {
        return unfit(
            "it is no XML".to_owned(),
            "name the file of the digital calibration certificate (DCC), as the laboratory issued it",
        );
    }
    if has_long_tag(text) {
        return unfit(
            format!("one of its tags is longer than {} KiB", TAG_MAX >> 10),
            "no certificate has such; ask the laboratory for it as it was issued",
        );
    }
    let options = ParsingOptions {
        allow_dtd: false,
        nodes_limit: NODES_MAX,
        ..ParsingOptions::default()
    };
    let document = Document::parse_with_options(text, options).or_else(|error| {
        unfit(
            format!("it is no XML that is read here: {error}"),
            "ask the laboratory for the certificate as it was issued; one with a DTD or with entities of its own is \
             not read",
        )
    })?;
    let is_deep = |it: Node<'_, '_>| it.ancestors().nth(DEPTH_MAX).is_some();
    match document.descendants().any(is_deep) {
        true => unfit(
            format!("its elements are nested deeper than {DEPTH_MAX}"),
            "no certificate is; ask the laboratory for it as it was issued",
        ),
        false => Ok(document),
    }
}

/// Whether there is one before anything that is no XML.
fn has_long_tag(text: &str) -> bool {
    let mut rest = text;
    while let Some(at) = rest.find('<') {
        rest = &rest[at..];
        let others = [("<!--", "-->"), ("<![CDATA[", "]]>"), ("<?", "?>")];
        let other = others.iter().find(|it| rest.starts_with(it.0));
        let length = match other {
            Some((begin, end)) => {
                let end = rest[begin.len()..].find(end).map(|it| it + end.len());
                end.map(|it| begin.len() + it)
            }
            None => tag_length(rest),
        };
        match length {
            Some(length) if other.is_none() && length > TAG_MAX => return true,
            Some(length) => rest = &rest[length..],
            // It never ends: the parser says so of what is no tag.
            None => return other.is_none() && rest.len() > TAG_MAX,
        }
    }
    false
}

/// Up to the `>` that is not quoted.
fn tag_length(text: &str) -> Option<usize> {
    let mut quote = None;
    let end = text.bytes().position(|it| {
        match (quote, it) {
            (Some(open), _) if open == it => quote = None,
            (None, b'"' | b'\'') => quote = Some(it),
            _ => {}
        }
        quote.is_none() && it == b'>'
    });
    Some(end? + 1)
}

pub(super) fn is(node: Node<'_, '_>, space: &str, name: &str) -> bool {
    node.is_element() && node.has_tag_name((space, name))
}

/// The elements of `name` just below `node`.
pub(super) fn children<'a, 'i: 'a>(
    node: Node<'a, 'i>,
    space: &'static str,
    name: &'static str,
) -> impl Iterator<Item = Node<'a, 'i>> {
    node.children().filter(move |it| is(*it, space, name))
}

pub(super) fn child<'a, 'i: 'a>(
    node: Node<'a, 'i>,
    space: &'static str,
    name: &'static str,
) -> Option<Node<'a, 'i>> {
    children(node, space, name).next()
}

/// The element at the end of a path of names.
pub(super) fn at<'a, 'i: 'a>(
    node: Node<'a, 'i>,
    space: &'static str,
    path: &[&'static str],
) -> Option<Node<'a, 'i>> {
    path.iter()
        .try_fold(node, |node, name| child(node, space, name))
}

/// All that is written in `node`, without what surrounds it.
pub(super) fn text(node: Node<'_, '_>) -> String {
    let all: String = node
        .descendants()
        .filter(|it| it.is_text())
        .filter_map(|it| it.text())
        .collect();
    all.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// What `node` is called, in whatever language comes first.
pub(super) fn name_of(node: Node<'_, '_>) -> String {
    let content = at(node, DCC, &["name", "content"]);
    content.map(text).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tag_of_hundreds_of_thousands_of_attributes_is_refused_at_once() {
        let many: String = (0..300_000).map(|at| format!(" a{at}=\"\"")).collect();
        // What looks like an end of a tag or like a comment in it is none.
        for before in ["", " b=\">\" c='\">' d=\"<!--\""] {
            for after in ["/>", ""] {
                let text =
                    format!("<!-- > \" --><?x '?><a><![CDATA[<']]><b{before}{many}{after}</a>");
                let unfit = parsed(&text).unwrap_err();
                assert!(
                    unfit.cause.contains("tags is longer than"),
                    "{}",
                    unfit.cause
                );
            }
        }
        let picture = "x".repeat(100_000);
        let text = format!("<a b='>'><!-- {picture} --><![CDATA[{picture}]]>{picture}</a>");
        assert!(parsed(&text).is_ok());
    }
}
