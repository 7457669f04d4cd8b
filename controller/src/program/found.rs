//! Where the service is found that somebody asks.

use std::path::Path;

use machine::records::{Lease, Store};
use toml::Table;

use crate::Failure;
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
    /// When no service keeps the machine that was named: who has it instead.
    pub(crate) fn place(&self) -> Result<String, Failure> {
        if let Some(at) = &self.at {
            return Ok(at.clone());
        }
        let Some(path) = &self.config else {
            let here = Kept::of(Path::new(MACHINE));
            let place = here.and_then(|it| it.place);
            return Ok(place.unwrap_or_else(|| USUAL.into()));
        };
        let help = "start one with `truestage serve`, or say with --at where it is found";
        let Some(kept) = Kept::of(path) else {
            return Err(Failure::Usage {
                what: format!("{}: not the configuration of a machine", path.display()),
                help: help.into(),
            });
        };
        kept.place.ok_or_else(|| Failure::Usage {
            what: format!(
                "no service keeps machine {}{}",
                plain(&kept.name),
                kept.owner
                    .map_or(String::new(), |it| format!("; {} has it", plain(&it)))
            ),
            help: help.into(),
        })
    }
}

/// What `[machine]` says of `key`, line by line: the rest of the file may be none just now.
fn said(text: &str, key: &str) -> Option<String> {
    let lines = text.lines().map(str::trim);
    let own = lines.skip_while(|it| !it.starts_with("[machine]")).skip(1);
    let mut own = own.take_while(|it| !it.starts_with('['));
    own.find_map(|line| {
        let line: Table = line.parse().ok()?;
        Some(line.get(key)?.as_str()?.to_owned())
    })
}

/// Who has a machine. A configuration that is wrong, because somebody edits it, says all the same whose it is: a stop must
/// not fail by that.
struct Kept {
    name: String,
    owner: Option<String>,
    place: Option<String>,
}

impl Kept {
    fn of(path: &Path) -> Option<Self> {
        let text = std::fs::read_to_string(path).ok()?;
        let name = said(&text, "name")?;
        let data_dir = said(&text, "data_dir")?;
        let data_dir = path.parent().unwrap_or(Path::new("")).join(data_dir);
        let owner = Lease::owner(&Store::new(&data_dir, &name, &[]));
        let (owner, places) = owner.map_or((None, Vec::new()), |(it, places)| (Some(it), places));
        // What anybody on this computer may use, before what wants a token.
        let is_local = |it: &&String| it.starts_with("unix:");
        let place = places.iter().find(is_local).or(places.first()).cloned();
        Some(Self { name, owner, place })
    }
}
