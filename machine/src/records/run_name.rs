//! Names of run journals: time, verb, axis, number.
//!
//! They are in the order in which the runs of a verb on an axis were begun: where the clock was set back since the
//! last one, a journal has that one's time and the next number. Its header has the time of the clock.

/// What orders the journals of a verb on an axis.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct RunName {
    stamp: String,
    number: u64,
}

impl RunName {
    /// What `name` is, where it names a journal of `verb` on `axis`.
    pub(super) fn parse(name: &str, verb: &str, axis: &str) -> Option<Self> {
        let stem = name.strip_suffix(".jsonl")?;
        let (stamp, number) = stem.split_once(&format!("-{verb}-{axis}-"))?;
        Some(Self {
            stamp: stamp.to_owned(),
            number: number.parse().ok()?,
        })
    }

    /// The name of a journal that is begun at `stamp`, behind all of these `names`.
    pub(super) fn next(names: &[String], stamp: &str, verb: &str, axis: &str) -> Self {
        let known = names
            .iter()
            .filter_map(|name| Self::parse(name, verb, axis));
        match known.max() {
            Some(last) if last.stamp.as_str() >= stamp => Self {
                number: last.number + 1,
                ..last
            },
            _ => Self {
                stamp: stamp.to_owned(),
                number: 0,
            },
        }
    }

    /// As it stands in the folder.
    pub(super) fn text(&self, verb: &str, axis: &str) -> String {
        format!("{}-{verb}-{axis}-{:02}.jsonl", self.stamp, self.number)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(names: &[&str], stamp: &str, expected: &str) {
        let names: Vec<String> = names.iter().map(|&name| name.to_owned()).collect();
        let next = RunName::next(&names, stamp, "calibrate", "x");
        assert_eq!(next.text("calibrate", "x"), expected, "{names:?}");
        let last = names
            .iter()
            .filter_map(|name| RunName::parse(name, "calibrate", "x"))
            .max();
        assert!(last.is_none_or(|last| last < next), "{names:?}");
    }

    #[test]
    fn a_new_journal_is_the_newest() {
        check(
            &[],
            "20260102T000000Z",
            "20260102T000000Z-calibrate-x-00.jsonl",
        );
        let first = "20260102T000000Z-calibrate-x-00.jsonl";
        check(
            &[first],
            "20260102T000000Z",
            "20260102T000000Z-calibrate-x-01.jsonl",
        );
        check(
            &[first],
            "20260103T000000Z",
            "20260103T000000Z-calibrate-x-00.jsonl",
        );
        let hundredth = "20260102T000000Z-calibrate-x-100.jsonl";
        let before = "20260102T000000Z-calibrate-x-99.jsonl";
        check(
            &[hundredth, before],
            "20260102T000000Z",
            "20260102T000000Z-calibrate-x-101.jsonl",
        );
    }

    #[test]
    fn a_clock_that_was_set_back_changes_no_order() {
        let later = "20260102T000000Z-calibrate-x-03.jsonl";
        check(
            &[later],
            "20200101T000000Z",
            "20260102T000000Z-calibrate-x-04.jsonl",
        );
        check(
            &["20260102T000000Z-calibrate-y-03.jsonl"],
            "20200101T000000Z",
            "20200101T000000Z-calibrate-x-00.jsonl",
        );
    }
}
