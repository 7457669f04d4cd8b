//! The text of a file of data, wherever it comes from: spreadsheets write UTF-8 with a mark before it, or UTF-16.

use std::io::{self, Read as _};
use std::path::Path;

use crate::Failure;

/// What stands for standard input where a file is named.
const STANDARD_INPUT: &str = "-";
/// The mark that they write before UTF-8.
const MARK: char = '\u{FEFF}';
/// The marks before UTF-16, the lower byte first and the higher one.
const LOW_FIRST: [u8; 2] = [0xFF, 0xFE];
const HIGH_FIRST: [u8; 2] = [0xFE, 0xFF];

/// The text of the file, or of standard input for `-`.
///
/// # Errors
/// When it cannot be read, or is no text.
pub(crate) fn read(path: &Path) -> Result<String, Failure> {
    let bytes = match is_standard_input(path) {
        true => {
            let mut bytes = Vec::new();
            io::stdin().read_to_end(&mut bytes).map(|_| bytes)
        }
        false => std::fs::read(path),
    };
    let text = bytes.and_then(|it| decoded(&it));
    text.map_err(|source| Failure::File {
        path: path.to_owned(),
        source,
    })
}

/// What messages call it.
pub(crate) fn name_of(path: &Path) -> String {
    match is_standard_input(path) {
        true => "standard input".into(),
        false => path.display().to_string(),
    }
}

/// Whether it is the journal of a run, by its name.
pub(crate) fn is_journal(path: &Path) -> bool {
    path.extension().is_some_and(|it| it == "jsonl")
}

fn is_standard_input(path: &Path) -> bool {
    path.as_os_str() == STANDARD_INPUT
}

fn decoded(bytes: &[u8]) -> io::Result<String> {
    let wide = |of: fn([u8; 2]) -> u16| {
        let pairs = bytes[2..].chunks_exact(2);
        if !pairs.remainder().is_empty() {
            return Err(no_text("UTF-16 that ends within a character".into()));
        }
        let units: Vec<u16> = pairs.map(|it| of([it[0], it[1]])).collect();
        String::from_utf16(&units).map_err(|_| no_text("damaged UTF-16".into()))
    };
    if bytes.starts_with(&LOW_FIRST) {
        return wide(u16::from_le_bytes);
    }
    if bytes.starts_with(&HIGH_FIRST) {
        return wide(u16::from_be_bytes);
    }
    match core::str::from_utf8(bytes) {
        Ok(text) => Ok(text.strip_prefix(MARK).unwrap_or(text).to_owned()),
        Err(error) => {
            let sound = &bytes[..error.valid_up_to()];
            let line = 1 + sound.iter().filter(|it| **it == b'\n').count();
            Err(no_text(format!("line {line} is not UTF-8")))
        }
    }
}

fn no_text(seen: String) -> io::Error {
    let help = "save the file as CSV in UTF-8";
    io::Error::new(io::ErrorKind::InvalidData, format!("{seen}: {help}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(bytes: &[u8], expected: &str) {
        assert_eq!(decoded(bytes).unwrap(), expected);
    }

    #[test]
    fn what_spreadsheets_write_is_text() {
        check("µm\n".as_bytes(), "µm\n");
        check("\u{FEFF}# by hand\n".as_bytes(), "# by hand\n");
        check(&[0xFF, 0xFE, b'a', 0, 0xB5, 0], "aµ");
        check(&[0xFE, 0xFF, 0, b'a', 0, 0xB5], "aµ");
        check(b"", "");
    }

    #[test]
    fn what_is_no_text_says_where_and_what_to_do() {
        let latin = b"run,target_mm\n1,2\n\xB5m\n";
        let seen = decoded(latin).unwrap_err().to_string();
        assert_eq!(seen, "line 3 is not UTF-8: save the file as CSV in UTF-8");
        let cut = decoded(&[0xFF, 0xFE, b'a']).unwrap_err().to_string();
        assert!(cut.contains("ends within a character"), "{cut}");
    }

    #[test]
    fn a_dash_is_standard_input() {
        assert_eq!(name_of(Path::new("-")), "standard input");
        assert_eq!(name_of(Path::new("./-")), "./-");
    }
}
