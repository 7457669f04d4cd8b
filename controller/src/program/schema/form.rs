//! What a verb prints: one form, or several where it depends on the machine or on what was asked.

use super::shape::{Member, Shape, by_name, part, text, truth, whole};

/// One form of what a verb prints.
#[derive(Clone, Debug)]
pub(crate) struct Form {
    /// The verb in full: `cal list`.
    pub(crate) verb: &'static str,
    /// Of what, or when.
    pub(crate) what: &'static str,
    pub(crate) members: Vec<Member>,
    /// Whether a failure may stand beside the result.
    pub(crate) is_judged: bool,
}

impl Form {
    pub(crate) fn new(
        verb: &'static str,
        what: &'static str,
        members: impl IntoIterator<Item = Member>,
    ) -> Self {
        Self {
            verb,
            what,
            members: members.into_iter().collect(),
            is_judged: false,
        }
    }

    /// With what the devices counted, where this program had the machine itself.
    pub(crate) fn counted(mut self) -> Self {
        self.members.push(("counters?", part("counters")));
        self
    }

    /// A calibration whose verification may be cut short.
    pub(crate) fn tried(mut self) -> Self {
        self.members.push(("verification?", part("verification")));
        self
    }

    /// The result may be a bad one: then the failure is beside it.
    pub(crate) fn judged(mut self) -> Self {
        self.is_judged = true;
        self
    }
}

/// What is printed by verbs that belong together.
#[derive(Clone, Debug, Default)]
pub(crate) struct Printed {
    pub(crate) forms: Vec<Form>,
    /// What is in several of them, by its name.
    pub(crate) parts: Vec<(&'static str, Shape)>,
}

/// What every failure has, by name.
pub(super) fn of_failures() -> [(&'static str, Shape); 2] {
    [
        ("error", text().about("What went wrong, for an operator.")),
        (
            "exit-code",
            whole().about("What the program ends with; `truestage explain CODE` says more."),
        ),
    ]
}

/// The members of every failure without a result.
pub(super) fn failure() -> [Member; 6] {
    let journal = "What the run has measured is kept there.";
    let resumes = "The same command with --resume continues it.";
    let code = "The kind of failure, as a service names it.";
    [
        ("error", part("error")),
        ("exit_code", part("exit-code")),
        ("code?", text().about(code)),
        ("device?", text().about("The device that failed.")),
        ("journal?", text().about(journal)),
        ("can_resume?", truth().about(resumes)),
    ]
}

/// The same beside a result, which need not be a bad one.
pub(super) fn failure_beside() -> [Member; 2] {
    [("error?", part("error")), ("exit_code?", part("exit-code"))]
}

/// What devices counted on the way.
pub(super) fn counters() -> Shape {
    by_name(by_name(whole())).about(
        "What the devices counted on the way, by device and by what; what never happened is left out.",
    )
}
