//! What was measured or designed elsewhere, for a machine that a service keeps.

use std::path::{Path, PathBuf};

use machine::Stage;
use serde_json::{Value, json};

use super::{Service, Waiting, refuse, stop_request, told_of};
use crate::program::AxisArgs;
use crate::program::output::{Ended, Output};
use crate::program::rotary::readings::{ReadingsArgs, newest_of};
use crate::runs::DataFile;

/// Files, as a request has them.
pub(super) fn given(files: &[DataFile]) -> Value {
    let files = files.iter();
    files
        .map(|it| json!({"name": it.name, "text": it.text}))
        .collect()
}

impl Service {
    /// A run by what was read of a plate elsewhere; `resume` is the journal that it goes on with. Nothing moves, so
    /// nothing is zeroed.
    pub(super) fn by_readings(
        &self,
        (stage, mut request): (Stage, Value),
        args: &AxisArgs,
        (readings, resume): (&ReadingsArgs, Option<&PathBuf>),
        output: Output,
    ) -> Ended {
        refuse(args.machine.record.is_some(), "--record")?;
        request["axis"] = json!(args.axis);
        request["files"] = given(&readings.files()?);
        let journal = newest_of(stage.text(), args, resume)?;
        // Journals are known by their names there.
        let name = journal.as_deref().and_then(Path::file_stem);
        request["resume"] = json!(name.map(|it| it.to_string_lossy()));
        let stop = stop_request()?;
        let run = self.run(stage, request, None, Waiting::of_nobody(&stop, output))?;
        told_of(&run, output)
    }
}
