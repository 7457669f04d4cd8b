//! A line of a journal: an object of JSON whose last member is the checksum of the rest (JSON Lines, so that any
//! program that reads these reads a journal).

use std::io::{self, BufRead, Read as _};

/// What stands before the checksum.
const KEY: &str = "\"crc32\":\"";
/// How many hexadecimal digits it has.
const DIGITS: usize = 8;

/// The line of an entry, which is an object: with its checksum and the end of the line.
///
/// # Panics
/// When `json` is no object.
pub fn sealed(json: &str) -> String {
    let checksum = crc32fast::hash(json.as_bytes());
    let members = json.strip_suffix('}').expect("an entry is an object");
    let comma = if members.ends_with('{') { "" } else { "," };
    format!("{members}{comma}{KEY}{checksum:08x}\"}}\n")
}

/// Of what is no line of a journal.
const NO_CHECKSUM: &str =
    "no checksum, which each line of a journal has (`runs/*.jsonl` of a machine's records)";

/// The entry of a line, whose checksum is right. Lines of earlier programs have it in front.
///
/// # Errors
/// There is none, or it is that of another line.
pub fn opened(line: &str) -> Result<String, String> {
    let (json, digits) = match line.starts_with('{') {
        true => inside(line)?,
        false => in_front(line)?,
    };
    let expected = u32::from_str_radix(digits, 16).map_err(|_| NO_CHECKSUM)?;
    let seen = crc32fast::hash(json.as_bytes());
    match seen == expected {
        true => Ok(json),
        false => Err(format!("checksum {seen:08x}, the line says {expected:08x}")),
    }
}

fn inside(line: &str) -> Result<(String, &str), String> {
    let (members, checksum) = line.rsplit_once(KEY).ok_or(NO_CHECKSUM)?;
    let digits = checksum.strip_suffix("\"}").filter(|it| it.len() == DIGITS);
    let digits = digits.ok_or("no whole checksum at the end")?;
    let members = members.strip_suffix(',').unwrap_or(members);
    Ok((format!("{members}}}"), digits))
}

fn in_front(line: &str) -> Result<(String, &str), String> {
    let (digits, json) = line.split_once(' ').ok_or(NO_CHECKSUM)?;
    Ok((json.to_owned(), digits))
}

/// So long a line is, in bytes.
const LINE_MAX: u64 = 16 << 20;

/// Reads one line with its end, nothing at the end of the file; whether nothing follows.
pub(super) fn next_line(file: &mut impl BufRead, line: &mut Vec<u8>) -> io::Result<bool> {
    line.clear();
    file.by_ref().take(LINE_MAX).read_until(b'\n', line)?;
    Ok(file.fill_buf()?.is_empty())
}

/// The entry of a whole line.
pub(super) fn json_of(line: &[u8]) -> Result<String, String> {
    let text = core::str::from_utf8(line).map_err(|error| error.to_string())?;
    opened(text.strip_suffix('\n').ok_or("the line has no end")?)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ENTRY: &str = r#"{"entry":"point","text":"a \"crc32\":\"00000000\"} b"}"#;

    #[test]
    fn a_line_is_an_object_and_is_opened_as_it_was_sealed() {
        for json in [ENTRY, "{}", r#"{"entry":"complete"}"#] {
            let line = sealed(json);
            let line = line.strip_suffix('\n').unwrap();
            let value: serde_json::Value = serde_json::from_str(line).unwrap();
            assert_eq!(
                value["crc32"].as_str().map(str::len),
                Some(DIGITS),
                "{line}"
            );
            assert_eq!(opened(line).unwrap(), json);
        }
    }

    #[test]
    fn a_line_of_an_earlier_program_is_opened() {
        let line = format!("{:08x} {ENTRY}", crc32fast::hash(ENTRY.as_bytes()));
        assert_eq!(opened(&line).unwrap(), ENTRY);
    }

    #[test]
    fn what_is_no_line_of_a_journal_is_told_so() {
        for line in ["# A machine.", "[machine]", "{}", "name = \"x\""] {
            assert_eq!(opened(line).unwrap_err(), NO_CHECKSUM, "{line}");
        }
    }

    #[test]
    fn no_changed_byte_passes() {
        let line = sealed(ENTRY);
        let line = line.strip_suffix('\n').unwrap();
        for at in 0..line.len() {
            let mut bytes = line.as_bytes().to_vec();
            bytes[at] ^= 1;
            let changed = String::from_utf8(bytes).unwrap();
            // Another letter of the same digit is the same number.
            let same = changed.eq_ignore_ascii_case(line);
            assert!(same || opened(&changed).is_err(), "{changed}");
        }
        for short in [
            "",
            "{}",
            "{\"crc32\":\"",
            "12345678",
            "{\"crc32\":\"1234567\"}",
        ] {
            assert!(opened(short).is_err(), "{short}");
        }
    }
}
