//! Where the service is found that somebody asks.

use std::path::Path;

use machine::records::Lease;

use crate::Failure;
use crate::config::{self, MachineConfig};
use crate::program::ServiceArgs;
use crate::program::exchange::plain;

/// Where a service listens unless it is told otherwise.
const USUAL: &str = "unix:truestage.sock";
/// The machine of whoever names none.
const MACHINE: &str = "machine.toml";

impl ServiceArgs {
    /// Where to ask: as was said, or as the records of the machine say, or the usual place.
    ///
    /// # Errors
    /// When the machine that was named has no sound configuration, or no service keeps it.
    pub(crate) fn place(&self) -> Result<String, Failure> {
        if let Some(at) = &self.at {
            return Ok(at.clone());
        }
        let Some(path) = &self.config else {
            // A stop must not fail because of a configuration that nobody has named.
            let here = config::load(Path::new(MACHINE)).ok();
            let kept = here.and_then(|it| kept_at(&it.config));
            return Ok(kept.unwrap_or_else(|| USUAL.into()));
        };
        let loaded = config::load(path)?;
        kept_at(&loaded.config).ok_or_else(|| Failure::Usage {
            what: format!(
                "no service keeps machine {} ({})",
                plain(&loaded.config.machine.name),
                path.display()
            ),
            help: "start one with `truestage serve`, or say with --at where it is found".into(),
        })
    }
}

fn kept_at(config: &MachineConfig) -> Option<String> {
    let (_, places) = Lease::owner(&config.machine.store())?;
    places.into_iter().next()
}
