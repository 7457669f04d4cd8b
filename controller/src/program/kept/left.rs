//! Runs that ended before their result, and go on with `--resume`.

use std::path::Path;

use serde_json::Value;

use super::Service;
use crate::Failure;
use crate::program::NEWEST_RUN;
use crate::program::exchange::{ask, plain};

impl Service {
    /// The newest run that has ended before its result, can go on, and is of the kind and axis that `request` asks for; or
    /// the one of `journal`, where a file is named.
    pub(super) fn left(&self, request: &Value, journal: &Path) -> Result<Value, Failure> {
        let runs = ask(&self.at, "GET", "/v1/runs", "")?;
        let is_meant = |run: &&Value| {
            let of_axis = request["axis"].is_null() || run["of"] == request["axis"];
            let left = run["journal"].as_str().map(Path::new);
            let of_journal = journal == Path::new(NEWEST_RUN)
                || left.is_some_and(|it| it.file_name() == journal.file_name());
            let ended = matches!(
                run["state"].as_str(),
                Some("paused" | "stopped" | "failed" | "timed_out")
            );
            let goes_on = ended && run["can_resume"] == true;
            goes_on && run["kind"] == request["kind"] && of_axis && of_journal
        };
        let found = runs.as_array().into_iter().flatten().rfind(is_meant);
        found.cloned().ok_or_else(|| Failure::Usage {
            what: format!(
                "the service knows no {} run that was interrupted and can go on",
                plain(request["kind"].as_str().unwrap_or_default())
            ),
            help: "start a new one without --resume".into(),
        })
    }
}
