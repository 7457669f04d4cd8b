//! `truestage cal`: what is stored, what is in use, and back again.

use std::path::{Path, PathBuf};

use clap::Subcommand;
use machine::records::{Glance, Lease, Store, short};
use serde_json::{Value, json};

use crate::groups;
use crate::program::belongs::head_of;
use crate::program::cal_page;
use crate::program::chosen::{Used, told};
use crate::program::controls::export::{self, ExportArgs};
use crate::program::controls::import::{self, ImportArgs};
use crate::program::kept::or_by_its_service;
use crate::program::kind::of_kind;
use crate::program::output::{Ended, Output};
use crate::program::written::replace;
use crate::runs::{Change, Choice, Group, write};
use crate::{Failure, config};

#[derive(Debug, Subcommand)]
pub(crate) enum CalCommand {
    /// All calibrations of the machine, the oldest first; `*` marks those in use.
    List {
        /// The machine's configuration.
        #[arg(default_value = "machine.toml")]
        config: PathBuf,
    },
    /// One calibration, whole.
    Show {
        /// The machine's configuration.
        config: PathBuf,
        /// Its name, or the beginning of it; the one in use when not given.
        id: Option<String>,
    },
    /// Two calibrations side by side.
    Diff {
        /// The machine's configuration.
        config: PathBuf,
        /// The older one.
        before: String,
        /// The newer one.
        after: String,
        /// Write a page of both, with their curves over each other, to this file.
        #[arg(long, value_name = "FILE")]
        page: Option<PathBuf>,
    },
    /// Use this calibration from now on.
    Activate {
        /// The machine's configuration.
        config: PathBuf,
        /// Its name, or the beginning of it.
        id: String,
    },
    /// Go back to the calibration used before.
    Rollback {
        /// The machine's configuration.
        config: PathBuf,
        /// Which axis; `platform` for all screws of one at once, `volume` for the errors of three axes and what counts
        /// from them. May be left out when there is only one of these.
        #[arg(long)]
        axis: Option<String>,
    },
    /// Write a calibration in the form of another control (LinuxCNC, SINUMERIK, PMAC), or as CSV.
    Export(ExportArgs),
    /// Store a table of another control, or of CSV, as a calibration of a linear axis.
    Import(ImportArgs),
}

pub(crate) fn run(command: &CalCommand, output: Output) -> Ended {
    match command {
        CalCommand::List { config } => list(&opened(config)?, output),
        CalCommand::Show { config, id } => {
            let id = id
                .as_ref()
                .map_or_else(|| the_used(config), |it| Ok(it.clone()));
            show(&opened(config)?, &id?, output)
        }
        CalCommand::Diff {
            config,
            before,
            after,
            page,
        } => diff(&opened(config)?, [before, after], page.as_deref(), output),
        CalCommand::Activate { config, id } => {
            chosen(config, &Choice::Activate(id.clone()), output)
        }
        CalCommand::Rollback { config, axis } => {
            let axis = the_axis(config, axis.as_deref())?;
            chosen(config, &Choice::Rollback(axis), output)
        }
        CalCommand::Export(args) => export::run(args, output),
        CalCommand::Import(args) => import::run(args, put_into_use, output),
    }
}

fn opened(config: &Path) -> Result<Store, Failure> {
    let loaded = config::load(config)?;
    Ok(loaded.config.machine.store())
}

fn list(store: &Store, output: Output) -> Ended {
    let (text, value) = listed(store)?;
    output.result(&text, &value)
}

/// All calibrations, as text and as JSON.
pub(crate) fn listed(store: &Store) -> Result<(String, Value), Failure> {
    let mut all = Vec::new();
    for id in store.list()? {
        match store.glance(&id) {
            Ok(Glance {
                head,
                kind,
                summary,
            }) => {
                let used = store.active(&head.axis)?.current.as_deref() == Some(&id);
                let line = format!(
                    "{} {}  {}  axis {}  {}  {}",
                    if used { '*' } else { ' ' },
                    short(&id),
                    head.created,
                    head.axis,
                    summary,
                    head.source
                );
                let value = json!({"id": id, "active": used, "axis": head.axis, "kind": kind,
                                   "created": head.created, "source": head.source});
                all.push((head.created, line, value));
            }
            Err(error) => {
                let line = format!("! {}  {error}", short(&id));
                let value = json!({"id": id, "error": error.to_string()});
                all.push((String::new(), line, value));
            }
        }
    }
    // Times as they are stored are in order as text; what cannot be read has none, and comes first.
    all.sort_by(|a, b| a.0.cmp(&b.0));
    let (mut lines, values): (Vec<_>, Vec<_>) = all.into_iter().map(|it| (it.1, it.2)).unzip();
    if lines.is_empty() {
        lines.push("no calibrations yet; `truestage calibrate` makes one".into());
    }
    Ok((lines.join("\n"), json!({"calibrations": values})))
}

fn show(store: &Store, id: &str, output: Output) -> Ended {
    let (text, value) = shown(store, id)?;
    output.result(&text, &value)
}

/// One calibration, as text and as JSON.
pub(crate) fn shown(store: &Store, id: &str) -> Result<(String, Value), Failure> {
    let id = store.resolve(id)?;
    let Glance { head, kind, .. } = store.glance(&id)?;
    let (lines, value) = (of_kind(kind).one)(store, &id)?;
    let text = format!(
        "calibration {id}\n  machine {} (stage {}), axis {}, made {} by {}\n  from {}, {lines}",
        head.machine, head.stage_serial, head.axis, head.created, head.program, head.source,
    );
    let certificates = head.instrument.certificates.iter();
    let certificates = certificates.map(|it| format!("\n  {}", it.text()));
    let text = text + &certificates.collect::<String>();
    let text = match head.instrument.warning() {
        Some(warning) => format!("{text}\nwarning: its readings were {warning}"),
        None => text,
    };
    Ok((text, json!({"id": id, "record": value})))
}

fn diff(store: &Store, [before, after]: [&str; 2], page: Option<&Path>, output: Output) -> Ended {
    let (mut text, mut value) = compared(store, before, after, output)?;
    if let Some(path) = page {
        let html = compared_page(store, [before, after], &text)?;
        replace(path, html.as_bytes())?;
        text += &format!("\npage in {}", path.display());
        value["page"] = json!(path);
    }
    output.result(&text, &value)
}

/// Two calibrations on a page; `lines` are what the screen says of them.
fn compared_page(store: &Store, both: [&str; 2], lines: &str) -> Result<String, Failure> {
    let [before, after] = both.map(|it| store.resolve(it));
    let (before, after) = (before?, after?);
    let (old, new) = (store.glance(&before)?, store.glance(&after)?);
    let drawn = (of_kind(new.kind).drawn)(store, &before, &after)?;
    Ok(cal_page::html(
        [(&before, &old), (&after, &new)],
        lines,
        &drawn,
    ))
}

/// Two calibrations, as text and as JSON.
pub(crate) fn compared(
    store: &Store,
    before: &str,
    after: &str,
    output: Output,
) -> Result<(String, Value), Failure> {
    let (before_id, after_id) = (store.resolve(before)?, store.resolve(after)?);
    let (before, after) = (store.glance(&before_id)?, store.glance(&after_id)?);
    let (old_axis, new_axis) = (&before.head.axis, &after.head.axis);
    if old_axis != new_axis {
        let what = format!("note: the first is of axis {old_axis}, the second of axis {new_axis}");
        output.note(&what);
    }
    let changes = (of_kind(after.kind).two)(store, &before_id, &after_id)?;
    let (lines, values) = changes.ok_or_else(|| Failure::Usage {
        what: format!("records of the kind {} are not compared", after.kind),
        help: "`cal show --json` prints them".into(),
    })?;
    Ok((lines.join("\n"), json!({"changes": values})))
}

/// What is gone back for: the one that is named, or the only one.
fn the_axis(path: &Path, axis: Option<&str>) -> Result<String, Failure> {
    if let Some(axis) = axis {
        return Ok(axis.to_owned());
    }
    let groups = groups(&config::load(path)?.config);
    match groups.as_slice() {
        [only] => Ok(only.name.clone()),
        all => {
            let names: Vec<&str> = all.iter().map(|it| it.name.as_str()).collect();
            Err(Failure::Usage {
                what: "the machine has several axes".into(),
                help: format!("add --axis with one of {}", names.join(", ")),
            })
        }
    }
}

/// The name of the only calibration in use.
fn the_used(path: &Path) -> Result<String, Failure> {
    let config = config::load(path)?.config;
    let (store, groups) = (config.machine.store(), groups(&config));
    let mut used = Vec::new();
    for pointer in groups.iter().flat_map(|it| &it.pointers) {
        let current = store.active(pointer)?.current;
        used.extend(current.map(|id| (pointer, id)));
    }
    if let [(_, only)] = used.as_slice() {
        return Ok(only.clone());
    }
    let named = used.iter().map(|(of, id)| format!("{of} {}", short(id)));
    let named: Vec<String> = named.collect();
    Err(match named.is_empty() {
        true => Failure::Usage {
            what: "no calibration is in use".into(),
            help: "add the name of one: `truestage cal list` has all of them".into(),
        },
        false => Failure::Usage {
            what: format!("several calibrations are in use: {}", named.join(", ")),
            help: "add the name of one of them".into(),
        },
    })
}

/// What is used from now on: done here, or by the service that keeps the machine.
fn chosen(path: &Path, choice: &Choice, output: Output) -> Ended {
    let here = choose(path, choice).and_then(|changes| {
        let used = changes.iter().map(|it| Used {
            pointer: &it.pointer,
            id: it.id.as_deref(),
            is_earlier: it.is_earlier,
        });
        told(choice, &used.collect::<Vec<_>>(), output)
    });
    or_by_its_service(here, |service| service.choose(choice, output))
}

/// Chooses while nobody has the machine. The stage and the configuration are checked here; the drive itself when it
/// is used.
fn choose(path: &Path, choice: &Choice) -> Result<Vec<Change>, Failure> {
    let loaded = config::load(path)?;
    let store = loaded.config.machine.store();
    let groups = groups(&loaded.config);
    let changes = || Group::chosen(&groups, &store, choice)?.changes(&store, choice);
    if !store.root().exists() {
        // A lease would make the folder.
        changes()?;
    }
    // Whoever measures with a calibration must find it there to the end.
    let verb = match choice {
        Choice::Activate(_) => "cal activate",
        Choice::Rollback(_) => "cal rollback",
        Choice::Clear(_) => "memory clear",
    };
    let _lease = Lease::take(&store, verb)?;
    let changes = changes()?;
    for id in changes.iter().filter_map(|it| it.id.as_ref()) {
        head_of(&loaded, &store, id)?;
    }
    write(&store, &changes)?;
    Ok(changes)
}

/// The axis and the whole name.
fn put_into_use(path: &Path, id: &str) -> Result<(String, String), Failure> {
    let changes = choose(path, &Choice::Activate(id.to_owned()))?;
    let used = changes.into_iter().next();
    let used = used.and_then(|it| Some((it.pointer, it.id?)));
    Ok(used.expect("what is activated is in use"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_of_calibration_that_is_stored_is_shown() {
        for kind in crate::stores::contents() {
            assert_eq!(of_kind(kind.name()).kind, kind.name());
        }
    }
}
