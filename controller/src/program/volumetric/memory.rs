//! States of three axes that are kept on purpose, so that all parts are alike: recorded, designed, forgotten.

use compensator::volumetric::Axis;
use machine::records::{Lease, Store, short};
use serde_json::{Value, json};

use crate::Machine;
use crate::config;
use crate::ports::Use;
use crate::program::MachineArgs;
use crate::program::data_file::volume_head_of;
use crate::program::data_text::{name_of, read};
use crate::program::kept::or_by_its_service;
use crate::program::output::{Ended, Output};
use crate::program::session::Session;
use crate::program::volumetric::memory_args::{ImportArgs, MemoryArgs};
use crate::program::volumetric::verbs::with_zeroed_volume;
use crate::runs::{DataFile, Told};
use crate::volumetric::memory_import::no_designed_second;
use crate::volumetric::{self, MemoryName, Remembered, memory_pointer};

pub(crate) fn record(args: &MemoryArgs, output: Output) -> Ended {
    let which = MemoryName::from(args.memory);
    or_by_its_service(recorded_here(&args.machine, which, output), |service| {
        let kind = match which {
            MemoryName::First => "first_memory",
            MemoryName::Second => "second_memory",
        };
        service.remember(kind, &args.machine, output)
    })
}

fn recorded_here(args: &MachineArgs, which: MemoryName, output: Output) -> Ended {
    let ready =
        |machine: &mut Machine, store: &Store| machine.volumetric()?.check_memory(store, which);
    let record = |machine: &mut Machine, store: &Store, ()| {
        machine.volumetric()?.record_memory(store, which)
    };
    let (kept, counters) = with_zeroed_volume(args, "memory", Use::Motion, output, ready, record)?;
    output.told(remembered(&kept), counters)
}

/// A state that was kept.
pub(super) fn remembered(kept: &Remembered) -> Told {
    Told {
        text: format!(
            "{} keeps the present state: all parts from now on are made with it\n{}",
            short(&kept.id),
            kept_text(kept)
        ),
        value: kept_value(kept),
    }
}

pub(super) fn kept_text(kept: &Remembered) -> String {
    let axes = Axis::ALL.into_iter().zip(kept.covers);
    let axes = axes.filter_map(|(axis, covers)| {
        let (from, to) = covers?;
        Some(format!("{axis} {:.3} to {:.3} mm", from.mm(), to.mm()))
    });
    let axes: Vec<String> = axes.collect();
    let rolls = rolls_of(kept);
    let rolls = match rolls.is_empty() {
        true => String::new(),
        false => format!(", with the roll of {}", rolls.join(", ")),
    };
    format!(
        "recorded along {}{rolls}; beyond that, the values at the ends hold{}",
        axes.join(", "),
        foreign_text(kept.foreign.as_deref())
    )
}

/// The axes whose rolls are kept.
fn rolls_of(kept: &Remembered) -> Vec<String> {
    let rolls = Axis::ALL.into_iter().zip(&kept.map.roll);
    let rolls = rolls.filter(|(_, roll)| roll.is_some());
    rolls.map(|(axis, _)| axis.to_string()).collect()
}

/// A second memory that no longer fits the first.
fn foreign_text(foreign: Option<&str>) -> String {
    let foreign = foreign.map(short);
    foreign.map_or_else(String::new, |it| {
        format!(
            "\nthe second memory {it} counts from another first memory: before the next part, \
             record it again (`truestage memory record`) or clear it (`truestage memory clear`)"
        )
    })
}

pub(super) fn kept_value(kept: &Remembered) -> Value {
    let axes = Axis::ALL.into_iter().zip(kept.covers);
    let axes = axes.filter_map(|(axis, covers)| {
        let (from, to) = covers?;
        Some(json!({"axis": axis.to_string(), "from_mm": from.mm(), "to_mm": to.mm()}))
    });
    json!({"memory": kept.id, "axes": axes.collect::<Vec<_>>(), "rolls": rolls_of(kept),
           "foreign_second": kept.foreign})
}

pub(crate) fn import(args: &ImportArgs, output: Output) -> Ended {
    if MemoryName::from(args.memory) == MemoryName::Second {
        return Err(no_designed_second());
    }
    let file = DataFile {
        name: name_of(&args.file),
        text: read(&args.file)?,
    };
    or_by_its_service(imported_here(args, &file, output), |service| {
        service.design(&file, output)
    })
}

fn imported_here(args: &ImportArgs, file: &DataFile, output: Output) -> Ended {
    let loaded = config::load(&args.config)?;
    let head = volume_head_of(&loaded, memory_pointer(MemoryName::First), &args.file)?;
    let store = loaded.config.machine.store();
    let _lease = Lease::take(&store, "memory")?;
    let kept = volumetric::import(&loaded.config, &store, head, (&file.text, &file.name))?;
    let told = designed(&kept);
    output.result(&told.text, &told.value)
}

/// A designed shape that is kept.
pub(super) fn designed(kept: &Remembered) -> Told {
    Told {
        text: format!(
            "{} keeps the designed shape: all parts from now on are made with it\n{}",
            short(&kept.id),
            kept_text(kept)
        ),
        value: kept_value(kept),
    }
}

pub(crate) fn clear(args: &MemoryArgs, output: Output) -> Ended {
    let which = MemoryName::from(args.memory);
    or_by_its_service(cleared_here(&args.machine, which, output), |service| {
        let [of, second] = [which, MemoryName::Second].map(memory_pointer);
        let [before, foreign] = service.clear(&args.machine, of, second)?;
        cleared(before.as_deref(), foreign.as_deref(), output)
    })
}

fn cleared_here(args: &MachineArgs, which: MemoryName, output: Output) -> Ended {
    let mut session = Session::open(args, "memory", Use::Motion, output)?;
    let (before, foreign) = session
        .machine
        .volumetric()?
        .clear_memory(&session.store, which)?;
    cleared(before.as_deref(), foreign.as_deref(), output)
}

fn cleared(before: Option<&str>, foreign: Option<&str>, output: Output) -> Ended {
    let text = match before {
        Some(id) => format!("{} is no longer in use", short(id)),
        None => "no memory was in use".into(),
    };
    let text = text + &foreign_text(foreign);
    output.result(
        &text,
        &json!({"cleared": before, "foreign_second": foreign}),
    )
}
