//! Characters that look like others, or like nothing, as word processors, web pages and other alphabets leave them.

use super::{Parts, Slip, is_toml};
use crate::config::diagnostic::shown;

/// What nobody sees.
pub(super) fn hidden(parts: &Parts<'_>) -> Option<Slip> {
    let is_hidden = |it: char| it.is_control() && it != '\t';
    let (at, it) = parts.line.char_indices().find(|(_, it)| is_hidden(*it))?;
    let cause = format!(
        "a character that is not seen stands here (U+{:04X})",
        u32::from(it)
    );
    let meant: String = parts.line.chars().filter(|it| !is_hidden(*it)).collect();
    let meant = is_toml(&meant).then_some(meant);
    Some(Slip::new(
        at,
        cause,
        "remove it, or type the line anew".into(),
        meant,
    ))
}

/// What a character was meant to be.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Meant {
    Quote,
    Minus,
    Space,
    Other(char),
}

fn meant(it: char) -> Option<Meant> {
    Some(match it {
        '“' | '”' | '„' | '‟' | '«' | '»' | '‘' | '’' | '‚' | '‹' | '›' | '´' | '`' => {
            Meant::Quote
        }
        '−' | '–' | '—' | '‐' | '‑' => Meant::Minus,
        '\u{a0}' | '\u{2000}'..='\u{200d}' | '\u{202f}' | '\u{2060}' | '\u{3000}' | '\u{feff}' => {
            Meant::Space
        }
        '！'..='～' => Meant::Other(char::from_u32(u32::from(it) - 0xFEE0)?),
        'µ' | 'μ' => Meant::Other('u'),
        'а' | 'α' => Meant::Other('a'),
        'е' => Meant::Other('e'),
        'о' | 'ο' => Meant::Other('o'),
        'с' => Meant::Other('c'),
        'р' | 'ρ' => Meant::Other('p'),
        'х' => Meant::Other('x'),
        'у' => Meant::Other('y'),
        'і' => Meant::Other('i'),
        _ => return None,
    })
}

/// What looks like a character of the keyboard and is another one.
pub(super) fn look_alike(parts: &Parts<'_>) -> Option<Slip> {
    let mut first = None;
    let replaced: String = parts
        .said
        .char_indices()
        .map(|(at, it)| match meant(it) {
            None => it,
            Some(kind) => {
                first.get_or_insert((at, it, kind));
                match kind {
                    Meant::Quote => '"',
                    Meant::Minus => '-',
                    Meant::Space => ' ',
                    Meant::Other(it) => it,
                }
            }
        })
        .collect();
    let (at, it, kind) = first?;
    let meant = format!("{replaced}{}", parts.comment);
    if !is_toml(&meant) {
        return None;
    }
    let line = shown(replaced.trim());
    let parted = replaced.split_once('=');
    let value = match parted.filter(|it| at > it.0.len()) {
        Some((_, value)) => shown(value.trim()),
        None => format!("`{line}`"),
    };
    let (cause, help) = match kind {
        Meant::Quote => (
            format!("`{it}` is a quotation mark of printed text"),
            format!("write the straight one of the keyboard: {value}"),
        ),
        Meant::Minus => (
            format!("`{it}` is a dash and no minus sign"),
            format!("write {value} with the minus of the keyboard"),
        ),
        Meant::Space => (
            format!(
                "a character that is not seen stands here (U+{:04X})",
                u32::from(it)
            ),
            format!("type the line anew: `{line}`"),
        ),
        Meant::Other(own) => (
            format!("`{it}` is not the `{own}` of the keyboard"),
            format!("write `{line}`"),
        ),
    };
    Some(Slip::new(at, cause, help, Some(meant)))
}
