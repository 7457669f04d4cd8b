//! Lines of the ledger: JSON with a checksum, one record each.
//!
//! Ledgers of earlier programs have no checksums, and may have a torn record joined with the next one.

use machine::records::{opened, sealed};
use serde::{Deserialize, Serialize};

use super::asked::{Asked, AskedMotion, AskedRun, End, lasting};
use crate::view::{MotionView, RunView};

/// A record of the file.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Line {
    /// The service began for this time.
    Boot(u64),
    /// The identity of the file when it was made: a copy of it has another one.
    File(String),
    /// A motion was asked for.
    Asked(AskedMotion),
    /// A motion or run was refused: nothing moved.
    Refused(String),
    /// A motion ended.
    Ended(Box<MotionView>),
    /// A run was asked for with a key.
    AskedRun(AskedRun),
    /// A run ended; once more where it went on.
    EndedRun(Box<RunView>),
    /// Part of an earlier ledger could not be read; it was kept under this name.
    Damaged(String),
    /// This person accepted that.
    Accepted(String),
}

/// How each record begins.
const BEGINNINGS: [&str; 9] = [
    "{\"boot\":",
    "{\"file\":",
    "{\"asked\":",
    "{\"refused\":",
    "{\"ended\":",
    "{\"asked_run\":",
    "{\"ended_run\":",
    "{\"damaged\":",
    "{\"accepted\":",
];

impl Line {
    pub(super) fn of_asked(asked: &Asked) -> Self {
        match asked {
            Asked::Motion(motion) => Self::Asked(motion.clone()),
            Asked::Run(run) => Self::AskedRun(run.clone()),
        }
    }

    pub(super) fn of_end(end: &End) -> Self {
        match end {
            End::Motion(view) => Self::Ended(Box::new(MotionView::clone(view))),
            End::Run(view) => Self::EndedRun(Box::new(lasting(view))),
        }
    }

    /// The line as it is written.
    pub(super) fn sealed(&self) -> String {
        // Maps have keys of text, and nothing else here can fail.
        let json = serde_json::to_string(self).expect("a record is JSON");
        sealed(&json)
    }

    fn parse(text: &str) -> Option<Self> {
        let json = match text.contains("\"crc32\":\"") {
            true => opened(text).ok()?,
            false => text.to_owned(),
        };
        serde_json::from_str(&json).ok()
    }
}

/// What a file says.
#[derive(Debug, Default)]
pub(super) struct Reading {
    pub(super) lines: Vec<Line>,
    /// So many torn records were left out: no request with one of them was ever taken.
    pub(super) torn: usize,
    /// So many lines cannot be read, and are no torn records.
    pub(super) unreadable: usize,
}

impl Reading {
    pub(super) fn parse(bytes: &[u8]) -> Self {
        let mut reading = Self::default();
        let mut rest = bytes;
        while !rest.is_empty() {
            let end = rest.iter().position(|byte| *byte == b'\n');
            let (line, after) = rest.split_at(end.unwrap_or(rest.len()));
            rest = after.get(1..).unwrap_or_default();
            if !line.is_empty() {
                reading.take(&String::from_utf8_lossy(line), end.is_none());
            }
        }
        reading
    }

    fn take(&mut self, text: &str, is_unfinished: bool) {
        if let Some(line) = Line::parse(text) {
            self.lines.push(line);
        } else if let Some((torn, line)) = split(text) {
            match Line::parse(torn) {
                Some(before) => self.lines.push(before),
                None => self.torn += 1,
            }
            self.lines.push(line);
        } else if is_unfinished {
            self.torn += 1;
        } else {
            self.unreadable += 1;
        }
    }
}

/// The whole record at the end of a line, and what stands before it.
fn split(text: &str) -> Option<(&str, Line)> {
    let begins = text.match_indices("{\"").map(|(at, _)| at);
    let mut begins = begins.filter(|at| {
        let rest = &text[*at..];
        *at > 0 && BEGINNINGS.iter().any(|begin| rest.starts_with(begin))
    });
    begins.find_map(|at| Some((&text[..at], Line::parse(&text[at..])?)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(name: &str) -> Line {
        Line::Refused(name.to_owned())
    }

    #[track_caller]
    fn check(text: &str, (lines, torn, unreadable): (usize, usize, usize)) {
        let reading = Reading::parse(text.as_bytes());
        let seen = (reading.lines.len(), reading.torn, reading.unreadable);
        assert_eq!(seen, (lines, torn, unreadable), "{text}");
    }

    #[test]
    fn torn_records_are_cut_and_joined_ones_split() {
        let (one, two) = (refused("m1-1").sealed(), refused("m1-2").sealed());
        let whole = format!("{one}{two}");
        check(&whole, (2, 0, 0));
        for length in one.len() + 1..whole.len() - 1 {
            check(&whole[..length], (1, 1, 0));
            // The bug of earlier programs: the next record stands behind a torn one.
            check(&format!("{}{one}", &whole[..length]), (2, 1, 0));
        }
        check(whole[..whole.len() - 1].as_ref(), (2, 0, 0));
        check(&whole.replacen('\n', "", 1), (2, 0, 0));
    }

    #[test]
    fn ledgers_without_checksums_are_read() {
        let (one, two) = (r#"{"refused":"m1-1"}"#, r#"{"boot":3}"#);
        check(&format!("{one}\n{two}\n"), (2, 0, 0));
        check(
            &format!("{one}\n{{\"asked\":{{\"id\":\"m1-2{two}\n"),
            (2, 1, 0),
        );
    }

    #[test]
    fn no_changed_byte_passes_as_a_record() {
        let text = format!("{}{}", refused("m1-1").sealed(), refused("m1-2").sealed());
        let end = text.find('\n').expect("it has lines");
        for at in 0..end {
            let mut bytes = text.clone().into_bytes();
            bytes[at] ^= 2;
            let reading = Reading::parse(&bytes);
            assert_eq!((reading.lines.len(), reading.unreadable), (1, 1), "{at}");
        }
    }
}
