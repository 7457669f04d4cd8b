//! `truestage cal`: what is stored, what is in use, and back again.

use std::path::PathBuf;

use clap::Subcommand;
use serde_json::{Value, json};
use truestage::config::Loaded;
use truestage::linear::{LinearContent, NodeRecord};
use truestage::store::{CalibrationRecord, Content, Lease, RecordHead, Store, short};
use truestage::volumetric::MemoryName;
use truestage::volumetric::{GEOMETRY, REFERENCES, memory_pointer};
use truestage::{Failure, config};
use units::Metres;

use crate::program::output::{Ended, Output};

#[derive(Debug, Subcommand)]
pub(crate) enum CalCommand {
    /// All calibrations of the machine; `*` marks those in use.
    List {
        /// The machine's configuration.
        #[arg(default_value = "machine.toml")]
        config: PathBuf,
    },
    /// One calibration, whole.
    Show {
        /// The machine's configuration.
        config: PathBuf,
        /// Its name, or the beginning of it.
        id: String,
    },
    /// Two calibrations side by side.
    Diff {
        /// The machine's configuration.
        config: PathBuf,
        /// The older one.
        before: String,
        /// The newer one.
        after: String,
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
        /// Which axis; `platform` for all screws of one at once.
        #[arg(long)]
        axis: String,
    },
}

pub(crate) fn run(command: &CalCommand, output: Output) -> Ended {
    match command {
        CalCommand::List { config } => list(&store_of(config)?, output),
        CalCommand::Show { config, id } => show(&store_of(config)?, id, output),
        CalCommand::Diff {
            config,
            before,
            after,
        } => diff(&store_of(config)?, before, after, output),
        CalCommand::Activate { config, id } => activate(config, id, output),
        CalCommand::Rollback { config, axis } => rollback(config, axis, output),
    }
}

fn store_of(config: &std::path::Path) -> Result<Store, Failure> {
    let loaded = config::load(config)?;
    Ok(Store::of(&loaded.config.machine))
}

fn list(store: &Store, output: Output) -> Ended {
    let (text, value) = listed(store)?;
    output.result(&text, &value)
}

/// All calibrations, as text and as JSON.
pub(crate) fn listed(store: &Store) -> Result<(String, Value), Failure> {
    let mut lines = Vec::new();
    let mut values = Vec::new();
    for id in store.list()? {
        match store.load(&id) {
            Ok(record) => {
                let CalibrationRecord { head, content } = record;
                let used = store.active(&head.axis)?.current.as_deref() == Some(&id);
                lines.push(format!(
                    "{} {}  {}  axis {}  {}  {}",
                    if used { '*' } else { ' ' },
                    short(&id),
                    head.created,
                    head.axis,
                    content.summary(),
                    head.source
                ));
                values.push(json!({"id": id, "active": used, "axis": head.axis,
                                   "kind": content.kind(), "created": head.created,
                                   "source": head.source}));
            }
            Err(error) => {
                lines.push(format!("! {}  {error}", short(&id)));
                values.push(json!({"id": id, "error": error.to_string()}));
            }
        }
    }
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
    let record = store.load(&id)?;
    let head = &record.head;
    let mut text = format!(
        "calibration {id}\n  machine {} (stage {}), axis {}, made {} by {}\n  from {}, ",
        head.machine, head.stage_serial, head.axis, head.created, head.program, head.source,
    );
    text += &match &record.content {
        Content::LinearErrorTable(content) => linear_lines(content),
        Content::RotaryErrorTable(content) => super::rotary::fit::shown(content),
        Content::ScrewModel(content) => super::platform::fit::shown(content),
        Content::VolumetricGeometry(content) => super::volumetric::shown::shown(content),
        Content::BeamReferences(_) | Content::StateMemory(_) => record.content.summary(),
    };
    let value = serde_json::to_value(&record).expect("plain data always serialises");
    Ok((text, json!({"id": id, "record": value})))
}

fn linear_lines(content: &LinearContent) -> String {
    let head = format!(
        "{} runs, closure {}\n  position (mm)   forward (µm)   reverse (µm)        u (µm)",
        content.runs,
        micrometres(content.closure_m),
    );
    content
        .nodes
        .iter()
        .fold(head, |text, node| text + &node_line(node))
}

fn micrometres(metres: Option<f64>) -> String {
    metres.map_or("–".to_owned(), |it| format!("{:.3}", Metres(it).um()))
}

fn node_line(node: &NodeRecord) -> String {
    format!(
        "\n  {:>13.3}   {:>12}   {:>12}   {:>11}",
        Metres(node.position_m).mm(),
        micrometres(node.forward_m),
        micrometres(node.reverse_m),
        micrometres(node.forward_u_m.or(node.reverse_u_m)),
    )
}

fn diff(store: &Store, before: &str, after: &str, output: Output) -> Ended {
    let (text, value) = compared(store, before, after, output)?;
    output.result(&text, &value)
}

/// Two calibrations, as text and as JSON.
pub(crate) fn compared(
    store: &Store,
    before: &str,
    after: &str,
    output: Output,
) -> Result<(String, Value), Failure> {
    let (before_id, after_id) = (store.resolve(before)?, store.resolve(after)?);
    let (before, after) = (store.load(&before_id)?, store.load(&after_id)?);
    let (old_axis, new_axis) = (&before.head.axis, &after.head.axis);
    if old_axis != new_axis {
        let what = format!("note: the first is of axis {old_axis}, the second of axis {new_axis}");
        output.note(&what);
    }
    let (lines, values) = match &after.content {
        Content::LinearErrorTable(new) => linear_changes(before.linear(&before_id)?, new),
        Content::RotaryErrorTable(new) => {
            super::rotary::fit::changes(before.rotary(&before_id)?, new)
        }
        Content::ScrewModel(new) => super::platform::fit::changes(before.screw(&before_id)?, new),
        Content::VolumetricGeometry(new) => {
            super::volumetric::shown::changes(before.geometry(&before_id)?, new)
        }
        Content::BeamReferences(_) | Content::StateMemory(_) => {
            let kind = after.content.kind();
            return Err(Failure::Usage {
                what: format!("records of the kind {kind} are not compared"),
                help: "`cal show --json` prints them".into(),
            });
        }
    };
    Ok((lines.join("\n"), json!({"changes": values})))
}

fn linear_changes(before: &LinearContent, after: &LinearContent) -> (Vec<String>, Vec<Value>) {
    let mut lines = vec!["  position (mm)   Δ forward (µm)   Δ reverse (µm)".to_owned()];
    let mut values = Vec::new();
    for new in &after.nodes {
        let Some(old) = before
            .nodes
            .iter()
            .find(|old| old.position_m == new.position_m)
        else {
            continue;
        };
        let change = |new: Option<f64>, old: Option<f64>| Some(new? - old?);
        let (forward, reverse) = (
            change(new.forward_m, old.forward_m),
            change(new.reverse_m, old.reverse_m),
        );
        let position = Metres(new.position_m).mm();
        let (forward_um, reverse_um) = (micrometres(forward), micrometres(reverse));
        lines.push(format!(
            "  {position:>13.3}   {forward_um:>14}   {reverse_um:>14}"
        ));
        values.push(json!({
            "position_mm": position,
            "forward_um": forward.map(|it| Metres(it).um()),
            "reverse_um": reverse.map(|it| Metres(it).um()),
        }));
    }
    if values.is_empty() {
        lines.push("  no position stands in both".into());
    }
    (lines, values)
}

/// The stage and the configuration are checked here; the drive itself when it is used.
fn activate(path: &std::path::Path, id: &str, output: Output) -> Ended {
    let loaded = config::load(path)?;
    let section = &loaded.config.machine;
    let store = Store::of(&loaded.config.machine);
    // Whoever measures with a calibration must find it there to the end.
    let _lease = Lease::take(&store, "cal activate")?;
    let id = store.resolve(id)?;
    let record = store.load(&id)?;
    let CalibrationRecord { head, .. } = record;
    let here = RecordHead {
        stage_serial: section.stage_serial.clone(),
        config_hash: loaded.hash.as_str().to_owned(),
        ..head.clone()
    };
    head.belongs_to(&id, &here, &loaded.hash)?;
    known_axis(&loaded, &head.axis)?;
    store.activate(&head.axis, &id)?;
    let text = format!("axis {}: {} is in use", head.axis, short(&id));
    output.result(&text, &json!({"axis": head.axis, "active": id}))
}

fn known_axis(loaded: &Loaded, axis: &str) -> Result<(), Failure> {
    let (linear, rotary) = (loaded.config.axis.keys(), loaded.config.rotary.keys());
    let known: Vec<&str> = linear.chain(rotary).map(String::as_str).collect();
    let volume = [GEOMETRY, REFERENCES]
        .into_iter()
        .chain([MemoryName::First, MemoryName::Second].map(memory_pointer));
    let mut volume = volume.filter(|_| loaded.config.volumetric.is_some());
    if known.contains(&axis) || volume.any(|it| it == axis) {
        return Ok(());
    }
    Err(Failure::Machine(machine::Failure::NoSuchAxis {
        axis: axis.to_owned(),
        known: known.join(", "),
    }))
}

/// What `--axis` calls all screws of a platform.
const PLATFORM: &str = "platform";

fn rollback(path: &std::path::Path, axis: &str, output: Output) -> Ended {
    let loaded = config::load(path)?;
    let store = Store::of(&loaded.config.machine);
    let _lease = Lease::take(&store, "cal rollback")?;
    if let (PLATFORM, Some(platform)) = (axis, &loaded.config.platform) {
        let screws = platform.actuator.iter().map(|it| it.axis.as_str());
        return rollback_all(&store, &screws.collect::<Vec<_>>(), output);
    }
    known_axis(&loaded, axis)?;
    let id = store.rollback(axis)?;
    let text = format!("axis {axis}: back to {}", short(&id));
    output.result(&text, &json!({"axis": axis, "active": id}))
}

/// Every screw goes back, or none: a platform moves by models that were made together.
fn rollback_all(store: &Store, axes: &[&str], output: Output) -> Ended {
    for axis in axes {
        store.earlier(axis)?;
    }
    let mut lines = Vec::new();
    let mut active = serde_json::Map::new();
    for axis in axes {
        let id = store.rollback(axis)?;
        lines.push(format!("axis {axis}: back to {}", short(&id)));
        active.insert((*axis).to_owned(), json!(id));
    }
    output.result(
        &lines.join("\n"),
        &json!({"axis": PLATFORM, "active": active}),
    )
}
