//! State memories of three axes, asked of the service that keeps the machine.

use core::slice::from_ref;

use machine::Stage;
use machine::records::short;
use serde_json::json;

use super::files::given;
use super::{Service, VOLUME, Waiting, refuse, stop_request, tell};
use crate::Failure;
use crate::program::MachineArgs;
use crate::program::exchange::ask;
use crate::program::output::{Ended, Output};
use crate::runs::{Choice, DataFile};

impl Service {
    /// Keeps the present state of three axes as a memory: `kind` is what the service calls that run.
    pub(crate) fn remember(&self, kind: &str, machine: &MachineArgs, output: Output) -> Ended {
        self.on_volume(json!({"kind": kind, "axis": VOLUME}), machine, output)
    }

    /// Keeps the designed shape in `file` as the first memory.
    pub(crate) fn design(&self, file: &DataFile, output: Output) -> Ended {
        let request =
            json!({"kind": "first_memory", "axis": VOLUME, "files": given(from_ref(file))});
        let stop = stop_request()?;
        let waiting = Waiting::of_nobody(&stop, output);
        let run = self.run(Stage::Reference, request, None, waiting)?;
        tell(&run, output)
    }

    /// Forgets what is kept under this name of the store. Gives what that was, and what is in use under `other` and
    /// counted from it.
    pub(crate) fn clear(
        &self,
        machine: &MachineArgs,
        of: &str,
        other: &str,
    ) -> Result<[Option<String>; 2], Failure> {
        refuse(machine.record.is_some(), "--record")?;
        let all = ask(&self.at, "GET", "/v1/calibrations", "")?;
        let used = |name: &str| {
            let mut all = all.as_array().into_iter().flatten();
            let used = all.find(|it| it["axis"] == name && it["active"] == true)?;
            used["id"].as_str().map(str::to_owned)
        };
        let chosen = self.post_choice(&Choice::Clear(of.into()))?;
        let warning = chosen["warning"].as_str().unwrap_or_default();
        let foreign = used(other).filter(|id| warning.contains(&short(id)));
        Ok([used(of), foreign])
    }
}
