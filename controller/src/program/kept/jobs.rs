//! Jobs and paths of a machine that a service keeps.

use std::path::Path;

use machine::Stage;
use serde_json::{Value, json};

use super::{Service, VOLUME, Waiting, refuse, stop_request, tell};
use crate::program::MachineArgs;
use crate::program::exchange::plain;
use crate::program::linear::job::{GO_ON_ASKED, noted};
use crate::program::output::{Ended, Output};

/// Says which points were reached; how many these are.
pub(super) fn say_reached(run: &Value, output: Output) -> usize {
    let reached = run["reached"].as_array().map_or(&[][..], Vec::as_slice);
    for text in reached {
        output.note(&noted(&plain(text.as_str().unwrap_or_default())));
    }
    reached.len()
}

impl Service {
    /// Does the job that `request` has on the axis; `by` is whether nobody is waited for, and the hand of an emulated
    /// machine.
    pub(crate) fn do_job(
        &self,
        args: &MachineArgs,
        (axis, mut request): (&str, Value),
        by: (bool, Option<&Path>),
        output: Output,
    ) -> Ended {
        refuse(args.record.is_some(), "--record")?;
        let stop = stop_request()?;
        self.zero_first(Some(axis), &stop, output)?;
        request["kind"] = json!("job");
        let waiting = Waiting {
            by,
            asked: vec![&GO_ON_ASKED],
            ..Waiting::of_nobody(&stop, output)
        };
        let run = self.run(Stage::Job, request, None, waiting)?;
        tell(&run, output)
    }

    /// Follows the path that `request` has.
    pub(crate) fn follow(&self, args: &MachineArgs, request: Value, output: Output) -> Ended {
        refuse(args.record.is_some(), "--record")?;
        let stop = stop_request()?;
        self.zero_first(Some(VOLUME), &stop, output)?;
        let waiting = Waiting::of_nobody(&stop, output);
        let run = self.run(Stage::Job, request, None, waiting)?;
        tell(&run, output)
    }
}
