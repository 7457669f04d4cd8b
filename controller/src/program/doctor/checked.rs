//! What was found of one thing.

use serde_json::{Value, json};

/// How good it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Verdict {
    Good,
    /// It works, and may not always.
    Doubtful,
    /// It does not work.
    Bad,
    /// Nobody can tell here.
    NotTold,
}

impl Verdict {
    const fn word(self) -> &'static str {
        match self {
            Self::Good => "ok",
            Self::Doubtful => "warning",
            Self::Bad => "BAD",
            Self::NotTold => "-",
        }
    }
}

/// One check.
#[derive(Clone, Debug)]
pub(super) struct Checked {
    pub(super) verdict: Verdict,
    /// Of what.
    subject: String,
    seen: String,
    /// What to do; empty where nothing is to be done.
    fix: String,
}

impl Checked {
    pub(super) fn good(subject: &str, seen: impl Into<String>) -> Self {
        Self::new(Verdict::Good, subject, seen.into(), "")
    }

    pub(super) fn not_told(subject: &str, seen: impl Into<String>) -> Self {
        Self::new(Verdict::NotTold, subject, seen.into(), "")
    }

    pub(super) fn doubtful(subject: &str, seen: impl Into<String>, fix: &str) -> Self {
        Self::new(Verdict::Doubtful, subject, seen.into(), fix)
    }

    pub(super) fn bad(subject: &str, seen: impl Into<String>, fix: &str) -> Self {
        Self::new(Verdict::Bad, subject, seen.into(), fix)
    }

    fn new(verdict: Verdict, subject: &str, seen: String, fix: &str) -> Self {
        Self {
            verdict,
            subject: subject.to_owned(),
            seen,
            fix: fix.to_owned(),
        }
    }

    /// For people.
    pub(super) fn line(&self) -> String {
        let line = format!("{:<7} {}: {}", self.verdict.word(), self.subject, self.seen);
        match self.fix.as_str() {
            "" => line,
            fix => format!("{line}\n        fix: {fix}"),
        }
    }

    /// For programs.
    pub(super) fn value(&self) -> Value {
        json!({"verdict": self.verdict.word().to_lowercase(), "subject": self.subject, "seen": self.seen,
               "fix": (!self.fix.is_empty()).then_some(&self.fix)})
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// The only check of `found` about `subject` has this verdict and says this.
    #[track_caller]
    pub(in super::super) fn expect(
        found: &[Checked],
        subject: &str,
        verdict: Verdict,
        says: [&str; 2],
    ) {
        let own: Vec<_> = found.iter().filter(|it| it.subject == subject).collect();
        let [one] = own[..] else {
            panic!("{subject}: {found:#?}")
        };
        assert_eq!(one.verdict, verdict, "{one:?}");
        assert!(one.seen.contains(says[0]), "{one:?}");
        assert!(one.fix.contains(says[1]), "{one:?}");
    }

    #[test]
    fn a_line_says_what_to_do_where_something_is_to_be_done() {
        let bad = Checked::bad("can0", "is down", "set it up");
        assert_eq!(bad.line(), "BAD     can0: is down\n        fix: set it up");
        assert_eq!(bad.value()["verdict"], "bad");
        let good = Checked::good("can0", "is up");
        assert_eq!(good.line(), "ok      can0: is up");
        assert_eq!(good.value()["fix"], Value::Null);
    }
}
