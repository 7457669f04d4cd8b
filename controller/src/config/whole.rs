//! A file that is no text at all, or that of something else: told once, and not of each of its lines.

use std::path::Path;

use super::diagnostic::{ConfigError, Diagnostic};

/// The text of the file at `path`.
///
/// # Errors
/// When it cannot be read, or is no UTF-8 text.
pub(super) fn text_of(path: &Path) -> Result<String, ConfigError> {
    let bytes = std::fs::read(path).map_err(|source| ConfigError::Unreadable {
        path: path.to_owned(),
        source,
    })?;
    decoded(bytes, &path.display().to_string())
}

/// Likewise of bytes that were read; `file` is its name in findings.
fn decoded(bytes: Vec<u8>, file: &str) -> Result<String, ConfigError> {
    let text = String::from_utf8(bytes).map_err(|error| {
        let bytes = error.as_bytes();
        let (cause, help, at) = match bytes {
            [0xFF, 0xFE, ..] | [0xFE, 0xFF, ..] => (UTF_16, UTF_16_HELP, 0),
            _ if is_every_second_zero(bytes) => (UTF_16, UTF_16_HELP, 0),
            _ => (NO_UTF_8, NO_UTF_8_HELP, error.utf8_error().valid_up_to()),
        };
        let before = String::from_utf8_lossy(&bytes[..at]);
        invalid(file, &before, at, cause, help)
    })?;
    match told(&text, file) {
        Some(error) => Err(error),
        None => Ok(text),
    }
}

const UTF_16: &str = "the file is saved as UTF-16 (\"Unicode\")";
const UTF_16_HELP: &str = "save it as UTF-8";
const NO_UTF_8: &str = "the bytes here are no UTF-8 text";
const NO_UTF_8_HELP: &str =
    "save the file as UTF-8; letters such as µ, ° and ü are others in other encodings";

/// What is wrong with all of `text`, if anything is.
pub(super) fn told(text: &str, file: &str) -> Option<ConfigError> {
    let begin = text.trim_start_matches('\u{feff}').trim_start();
    let tell = |at, cause: &str, help: &str| Some(invalid(file, text, at, cause, help));
    if is_every_second_zero(text.as_bytes()) {
        return tell(0, UTF_16, UTF_16_HELP);
    }
    if let Some(at) = text.find("\0\0\0\0") {
        let cause = "the file holds nothing but zeros from here on: it was not saved to its end";
        return tell(
            at,
            cause,
            "take a copy of it, or write it anew from here on",
        );
    }
    if !text.contains('\n') && text.matches('\r').count() > 1 {
        let help = "save the file with the line ends of Unix (LF) or Windows (CRLF)";
        return tell(0, "the lines end with CR alone", help);
    }
    if let Some(at) = again(text) {
        let help = "remove one of the two; what differs between them must be chosen";
        return tell(at, "the whole file stands here a second time", help);
    }
    let other = match begin.chars().next() {
        Some('{') if begin.trim_end().ends_with('}') => "JSON",
        Some('<') if !begin.starts_with("<<<<") => "XML",
        _ => return None,
    };
    let help = "a configuration is TOML: `[section]` lines, and lines `key = value` below them";
    tell(0, &format!("this is {other}"), help)
}

/// Where a text begins anew that has all its sections by then: one that was pasted behind itself.
fn again(text: &str) -> Option<usize> {
    let is_heading = |it: &&str| it.starts_with('[') && it.ends_with(']');
    let headings: Vec<&str> = text.lines().map(str::trim_end).filter(is_heading).collect();
    let (first, second) = headings.split_at(headings.len() / 2);
    // Other files may say the same of several things.
    if !first.contains(&"[machine]") || first != second {
        return None;
    }
    // From the heading on, or from the keys above all sections.
    let (_, behind) = text.split_once(first[0])?;
    let start = text.len() - behind.len();
    let second = start + behind.find(first[0])?;
    let top = text
        .lines()
        .map(str::trim)
        .find(|it| !it.is_empty() && !it.starts_with('#'))?;
    let keys = text[start..second].rfind(top).filter(|_| top != first[0]);
    Some(keys.map_or(second, |it| start + it))
}

/// Files beside a machine's that are TOML too: a section that only they have, what they are, and who reads them.
const OTHERS: [[&str; 3]; 3] = [
    [
        "[[point]]",
        "a job",
        "`truestage run machine.toml JOB.toml --dry-run` judges it",
    ],
    [
        "[[nodes]]",
        "an emulated machine",
        "`mock-bus` reads it; name the machine's own file",
    ],
    [
        "[[function]]",
        "a file of references",
        "`truestage reference import` reads it",
    ],
];

/// What a text is in place of a machine, if it is one of the other files.
pub(super) fn no_machine(text: &str, file: &str) -> Option<ConfigError> {
    let has = |wanted: &str| text.lines().any(|it| it.trim_start().starts_with(wanted));
    let [wanted, what, help] = OTHERS.iter().find(|it| has(it[0]))?;
    let at = text.find(wanted)?;
    let cause = format!("this is {what}, and no machine");
    (!has("[machine]")).then(|| invalid(file, text, at, &cause, help))
}

/// So many sections a machine's file has at most: a bus has 127 nodes.
const SECTIONS_MAX: usize = 4000;

/// Refuses a text with more sections than any machine has: its findings would fill a book.
pub(super) fn too_many_sections(text: &str, file: &str) -> Option<ConfigError> {
    let lines = text.lines().map(str::trim_start);
    let count = lines.filter(|line| line.starts_with('[')).count();
    let cause = format!("the file has {count} sections; a machine has {SECTIONS_MAX} at most");
    let help = "give what is connected here, and leave out the rest";
    (count > SECTIONS_MAX).then(|| invalid(file, text, 0, &cause, help))
}

fn is_every_second_zero(bytes: &[u8]) -> bool {
    let pairs = || bytes.chunks_exact(2).take(100);
    let count = |at: usize| pairs().filter(|it| it[at] == 0).count();
    let most = pairs().count() * 9 / 10;
    most > 0 && (0..2).any(|at| count(at) >= most && count(1 - at) < most / 2)
}

fn invalid(file: &str, text: &str, at: usize, cause: &str, help: &str) -> ConfigError {
    let (cause, help) = (cause.to_owned(), help.to_owned());
    // What was valid of the text may be longer, or shorter, than its bytes.
    let at = at.min(text.len());
    ConfigError::Invalid {
        findings: vec![Diagnostic::at(file, text, &(at..at), "", cause, help)],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LINEAR: &str = include_str!("../../../configs/machines/linear.toml");

    #[track_caller]
    fn check(bytes: Vec<u8>, line: usize, says: &str) {
        let found = match decoded(bytes, "m.toml") {
            Err(ConfigError::Invalid { findings }) => findings,
            other => panic!("{other:?}"),
        };
        let [one] = &found[..] else {
            panic!("{found:#?}")
        };
        assert_eq!(one.line, line, "{one}");
        assert!(one.cause.contains(says) && !one.help.is_empty(), "{one}");
    }

    #[test]
    fn more_sections_than_a_machine_can_have_are_refused_at_once() {
        let sections = |count| LINEAR.to_owned() + &"[foo]\n".repeat(count);
        assert!(too_many_sections(&sections(3000), "m.toml").is_none());
        let said = too_many_sections(&sections(20_000), "m.toml").expect("it is refused");
        assert!(
            said.to_string().contains("sections; a machine has 4000"),
            "{said}"
        );
    }

    #[test]
    fn a_file_in_another_encoding_says_which_or_where() {
        let [little, big]: [Vec<u8>; 2] = [
            LINEAR.encode_utf16().flat_map(u16::to_le_bytes).collect(),
            LINEAR.encode_utf16().flat_map(u16::to_be_bytes).collect(),
        ];
        check(little.clone(), 1, "UTF-16");
        check(big, 1, "UTF-16");
        check([vec![0xFF, 0xFE], little].concat(), 1, "UTF-16");
        let latin = [&b"# one\nname = \"a\" # 5 "[..], &[0xB5], b"m\n"].concat();
        check(latin, 2, "no UTF-8");
    }

    #[test]
    fn a_file_that_stands_there_twice_says_from_where() {
        let lines = LINEAR.lines().count();
        let top = LINEAR
            .lines()
            .position(|it| it.starts_with("schema_version"));
        let top = top.expect("it has one") + 1;
        let twice = format!("{LINEAR}{LINEAR}");
        check(twice.into_bytes(), lines + top, "a second time");
    }

    #[test]
    fn a_file_that_was_not_saved_to_its_end_says_from_where() {
        let mut bytes = LINEAR.as_bytes()[..200].to_vec();
        let line = LINEAR[..200].matches('\n').count() + 1;
        bytes.extend([0; 4096]);
        check(bytes, line, "not saved to its end");
    }

    #[test]
    fn a_file_of_another_kind_says_so_once() {
        check(LINEAR.replace('\n', "\r").into_bytes(), 1, "CR alone");
        check(b"{\n  \"machine\": {}\n}\n".to_vec(), 1, "JSON");
        check(
            b"\n<?xml version=\"1.0\"?>\n<machine/>\n".to_vec(),
            1,
            "XML",
        );
        for (text, says) in [
            (include_str!("../../../configs/jobs/linear.toml"), "a job"),
            (
                include_str!("../../../configs/emulated/linear.toml"),
                "an emulated machine",
            ),
            (
                include_str!("../../../configs/data/references.toml"),
                "a file of references",
            ),
        ] {
            let told = no_machine(text, "m.toml")
                .expect("it is no machine")
                .to_string();
            assert!(told.contains(says) && told.contains("help: `"), "{told}");
        }
        assert!(no_machine(LINEAR, "m.toml").is_none());
        assert!(decoded(LINEAR.as_bytes().to_vec(), "m.toml").is_ok());
        assert!(decoded(Vec::new(), "m.toml").is_ok());
    }
}
