//! References of the detectors of three axes: read by them, or given beforehand in a file.

use std::path::PathBuf;

use clap::{Args, Subcommand};
use machine::records::{Lease, Store, short};
use serde_json::{Value, json};

use crate::config::MachineConfig;
use crate::ports::Use;
use crate::program::MachineArgs;
use crate::program::data_file::volume_head_of;
use crate::program::data_text::{name_of, read};
use crate::program::kept::or_by_its_service;
use crate::program::output::{Ended, Output};
use crate::program::volumetric::shown::reference_changes;
use crate::program::volumetric::verbs::with_zeroed_volume;
use crate::volumetric::reference::{
    VolumetricReferenced, measured_geometry, require_thermometers_certified,
};
use crate::volumetric::{BeamReferencesContent, GivenReferences, REFERENCES, given};
use crate::{Failure, Machine, config};

/// What `truestage reference` is told.
#[derive(Debug, Args)]
#[command(args_conflicts_with_subcommands = true)]
pub(crate) struct ReferenceArgs {
    #[command(flatten)]
    machine: MachineArgs,
    #[command(subcommand)]
    command: Option<ReferenceCommand>,
}

/// What is done instead of reading them.
#[derive(Debug, Subcommand)]
enum ReferenceCommand {
    /// Take the references from a file, where they are known beforehand. Nothing moves, and the machine may be off.
    Import(ReferenceFile),
}

/// References that are known, and of which machine.
#[derive(Clone, Debug, Args)]
struct ReferenceFile {
    /// The machine's configuration.
    config: PathBuf,
    /// A table, columns axis,detector,along,position_mm,value,unit (.csv), or polynomials of the position (.toml,
    /// see configs/README.md): what each detector reads along its axis where the machine is as its tables say.
    file: PathBuf,
}

pub(crate) fn run(args: &ReferenceArgs, output: Output) -> Ended {
    match &args.command {
        Some(ReferenceCommand::Import(file)) => import(file, output),
        None => {
            let here = reference(&args.machine, output);
            or_by_its_service(here, |service| service.reference(&args.machine, output))
        }
    }
}

fn reference(args: &MachineArgs, output: Output) -> Ended {
    // Before any bus: a machine of another kind would be asked for a calibration of this one's.
    let config = config::load(&args.config)?.config;
    has_a_volume(&config)?;
    require_thermometers_certified(&config)?;
    let ready = |_: &mut Machine, store: &Store| measured_geometry(store);
    let run = |machine: &mut Machine, store: &Store, _| machine.volumetric()?.reference(store);
    let (taken, counters) = with_zeroed_volume(args, "reference", Use::Motion, output, ready, run)?;
    let mut value = referenced_value(&taken);
    value["counters"] = counters;
    output.result(&referenced_text(&taken), &value)
}

fn has_a_volume(config: &MachineConfig) -> Result<(), Failure> {
    if config.volumetric.is_some() {
        return Ok(());
    }
    Err(Failure::Usage {
        what:
            "`reference` is for three axes corrected throughout their volume, and this machine has \
             no [volumetric]"
                .into(),
        help: "to find the origin of an axis, run `truestage zero`".into(),
    })
}

pub(super) fn referenced_text(taken: &VolumetricReferenced) -> String {
    in_use_text(&taken.id, &taken.references.content)
}

fn in_use_text(id: &str, content: &BeamReferencesContent) -> String {
    let axes: String = content.beams.iter().map(|it| it.axis).collect();
    format!(
        "references {} of the beams of {axes}{} are in use, for the errors {}",
        short(id),
        match content.roll {
            Some(_) => " and the roll".to_owned(),
            None => content.rolls_text(),
        },
        short(&content.geometry)
    )
}

pub(super) fn referenced_value(taken: &VolumetricReferenced) -> Value {
    let temperatures = taken.references.temperatures.iter();
    json!({
        "references": taken.id,
        "geometry": taken.references.content.geometry,
        "temperatures_c": temperatures.map(|it| it.value()).collect::<Vec<_>>(),
    })
}

fn import(args: &ReferenceFile, output: Output) -> Ended {
    let loaded = config::load(&args.config)?;
    has_a_volume(&loaded.config)?;
    let text = read(&args.file)?;
    let head = volume_head_of(&loaded, REFERENCES, &args.file)?;
    let store = loaded.config.machine.store();
    // Whoever corrects by references must find them there to the end.
    let _lease = Lease::take(&store, "reference import")?;
    let file = name_of(&args.file);
    let given = given::import(&loaded.config, &store, head, (&text, &file))?;
    output.result(&given_text(&given, &file), &given_value(&given, &file))
}

/// What is in use now, where it comes from, and what it changes.
fn given_text(given: &GivenReferences, file: &str) -> String {
    let how = given.content.given.map_or("", |it| it.words());
    let mut text = format!(
        "{}\n  given beforehand as {how}, by {file}; no detector was read, and no uncertainty that is stated \
         contains theirs",
        in_use_text(&given.id, &given.content)
    );
    match &given.before {
        Some(before) => {
            text += "\n  largest changes from the references before:";
            for it in reference_changes(before, &given.content).0 {
                text += &format!("\n  {it}");
            }
        }
        None => text += "\n  there were none before for these errors",
    }
    for (which, id) in &given.foreign {
        let which = which.name();
        text += &format!(
            "\nthe {which} memory {} counts from other references: before the next part, record it again \
             (`truestage memory record --memory {which}`) or clear it (`truestage memory clear --memory {which}`)",
            short(id)
        );
    }
    text
}

fn given_value(given: &GivenReferences, file: &str) -> Value {
    let before = given.before.as_ref();
    let foreign = given.foreign.iter();
    let foreign = foreign.map(|(which, id)| json!({"which": which.name(), "memory": id}));
    json!({
        "references": given.id,
        "geometry": given.content.geometry,
        "given": given.content.given,
        "source": file,
        "changes": before.map(|it| reference_changes(it, &given.content).1),
        "foreign_memories": foreign.collect::<Vec<_>>(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_machine_without_a_volume_is_told_so_and_not_asked_for_its_calibration() {
        let judge = |text| has_a_volume(&config::parse(text, "m.toml").unwrap().config);
        let linear = judge(include_str!("../../../../configs/machines/linear.toml"));
        let failure = linear.unwrap_err();
        assert_eq!(failure.exit_code(), 2);
        let text = failure.to_string();
        assert!(
            text.contains("three axes") && !text.contains("calibrate"),
            "{text}"
        );
        assert!(judge(include_str!("../../../../configs/machines/volumetric.toml")).is_ok());
    }
}
