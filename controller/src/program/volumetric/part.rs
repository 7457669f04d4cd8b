//! Parts: a path of three axes that is followed, what the correction said along it, and the state
//! that later parts are to be made with.

use std::path::Path;

use compensator::volumetric::Axis;
use machine::engine::{CsvPath, Departure, Join};
use machine::records::short;
use serde_json::{Value, json};
use units::Metres;

use crate::config;
use crate::ports::Use;
use crate::program::MachineArgs;
use crate::program::data_file::volume_head_of;
use crate::program::data_text::{name_of, read};
use crate::program::intended::nowhere;
use crate::program::kept::or_by_its_service;
use crate::program::output::{Ended, Output};
use crate::program::session::Session;
use crate::program::volumetric::memory_args::{ImportArgs, MemoryArgs};
use crate::program::volumetric::verbs::{with_zeroed_volume, zeroed_volume};
use crate::runs::Told;
use crate::volumetric::MemoryName;
use crate::volumetric::first_part::FirstPart;
use crate::volumetric::motion::require_measured;
use crate::volumetric::path::{CorrectedPath, PathFollowed};
use crate::volumetric::{Mover, Remembered, import, memory_pointer};
use crate::{Failure, Machine};
use machine::records::Store;

/// What drives a path.
enum Ready {
    /// Nothing is known to correct, or it is not to be.
    Alone,
    Corrected(Mover),
    First(Mover, FirstPart),
}

pub(crate) fn run(
    args: &MachineArgs,
    file: &Path,
    join: Option<Join>,
    (is_first, uncompensated): (bool, bool),
    output: Output,
) -> Ended {
    let rows = read(file)?;
    let how = (is_first, uncompensated);
    let here = followed_here(args, (file, &rows), join, how, output);
    or_by_its_service(here, |service| {
        // What cannot be followed is said with the names of here.
        let path = judged(args, (file, &rows), join, !uncompensated)?;
        output.note(&before_it_moves(file, &path));
        service.follow(args, asked_of_service(&rows, join, how), output)
    })
}

/// The same as a run of a service: its lines are those of the file.
fn asked_of_service(
    rows: &str,
    join: Option<Join>,
    (is_first, uncompensated): (bool, bool),
) -> Value {
    let kind = if is_first { "first_part" } else { "path" };
    let join = join.map(|it| it.to_string());
    json!({"kind": kind, "path": rows, "join": join, "uncompensated": uncompensated})
}

fn followed_here(
    args: &MachineArgs,
    (file, rows): (&Path, &str),
    join: Option<Join>,
    (is_first, uncompensated): (bool, bool),
    output: Output,
) -> Ended {
    let mut session = Session::open(args, "run", Use::Motion, output)?;
    if !uncompensated {
        require_measured(&session.store)?;
    }
    // Long paths take seconds to judge: before the drives wait for our heartbeat.
    let judge = session.machine.volumetric()?.path_judge()?;
    let mut path = judge.judge((file, rows), join, !uncompensated)?;
    output.note(&before_it_moves(file, &path));
    let points = core::mem::take(&mut path.points);
    let ready = |machine: &mut Machine, store: &Store| {
        let volume = machine.volumetric()?;
        if is_first {
            let (mover, part) = volume.first_part(store)?;
            return Ok(Ready::First(mover, part));
        }
        let mover = match uncompensated {
            true => None,
            false => volume.stored_mover(store)?,
        };
        Ok(mover.map_or(Ready::Alone, Ready::Corrected))
    };
    let follow =
        |machine: &mut Machine, store: &Store, ready| follow_part(machine, store, ready, points);
    let ((along, kept), counters) = zeroed_volume(session, ready, follow)?;
    output.told(followed(&along, &path, kept.as_ref()), counters)
}

/// What came of a path; `kept` is what later parts are made with, when it was the first.
pub(super) fn followed(followed: &PathFollowed, path: &CsvPath, kept: Option<&Remembered>) -> Told {
    let said = match &followed.corrected {
        Some(corrected) => corrected_text(corrected),
        None => "NOT CORRECTED: by the encoders alone".into(),
    };
    let (count, timing) = (followed.count, &followed.timing);
    let mut value = json!({"points": count, "corrected": followed.corrected.is_some(),
                           "join": path.join.to_string(),
                           "largest_departure": departure_value(&path.departure),
                           "thread": followed.thread});
    if let Some(corrected) = &followed.corrected {
        write_corrected(corrected, &mut value);
    }
    let mut text = format!("{count} points followed, {said}\n{timing}");
    if let Some(kept) = kept {
        text += &format!(
            "\nthe errors that the detectors saw were not corrected in this part; {} keeps them: \
             all later parts are made with them\n{}",
            short(&kept.id),
            kept_text(kept)
        );
        value["memory"] = kept_value(kept);
    }
    Told { text, value }
}

/// The path in `rows`, judged without a machine.
fn judged(
    args: &MachineArgs,
    (file, rows): (&Path, &str),
    join: Option<Join>,
    is_corrected: bool,
) -> Result<CsvPath, Failure> {
    let loaded = config::load(&args.config)?;
    if is_corrected {
        require_measured(&loaded.config.machine.store())?;
    }
    let judge = nowhere::machine(&loaded).volumetric()?.path_judge()?;
    judge.judge((file, rows), join, is_corrected)
}

/// Says what would be driven; nothing is connected.
pub(crate) fn only_judged(
    args: &MachineArgs,
    file: &Path,
    join: Option<Join>,
    is_corrected: bool,
    output: Output,
) -> Ended {
    let rows = read(file)?;
    let path = judged(args, (file, &rows), join, is_corrected)?;
    let value = json!({"dry_run": true, "points": path.points.len(), "join": path.join.to_string(),
                       "longer_s": path.longer.as_secs_f64(),
                       "largest_departure": departure_value(&path.departure)});
    output.result(&before_it_moves(file, &path), &value)
}

/// What is driven, for whoever may still stop it: rows that turn a corner are not joined straight, or not passed.
fn before_it_moves(file: &Path, path: &CsvPath) -> String {
    let CsvPath {
        points, departure, ..
    } = path;
    let at = Axis::ALL.into_iter().zip(&departure.place);
    let at: Vec<String> = at
        .map(|(axis, it)| format!("{axis} {:.3}", it.mm()))
        .collect();
    let ([from, to], size, at_s) = (departure.lines, departure.size.mm(), departure.at_s);
    let place = format!("at {at_s:.3} s (lines {from} to {to}), {} mm", at.join(" "));
    let begin = format!("{}: {} points along", file.display(), points.len());
    match path.join {
        Join::Spline => format!(
            "{begin} the cubic spline through the rows; it departs from the straight lines between them by \
             {size:.3} mm at most, {place}"
        ),
        Join::Linear { blend } => format!(
            "{begin} straight lines through the rows; no corner is passed farther than {size:.3} mm ({:.3} mm are \
             allowed), {place}; to begin and end at rest it takes {:.3} s longer than the rows say",
            blend.mm(),
            path.longer.as_secs_f64()
        ),
    }
}

fn departure_value(departure: &Departure) -> Value {
    let place = departure.place.iter().map(|it| it.mm());
    json!({"mm": departure.size.mm(), "at_s": departure.at_s, "lines": departure.lines,
           "place_mm": place.collect::<Vec<_>>()})
}

/// Follows the path, and says what later parts are made with, when this was the first.
fn follow_part(
    machine: &mut Machine,
    store: &Store,
    ready: Ready,
    points: Vec<Vec<Metres>>,
) -> Result<(PathFollowed, Option<Remembered>), Failure> {
    let mut volume = machine.volumetric()?;
    match ready {
        Ready::First(mover, part) => {
            let (followed, kept) = volume.follow_part(store, (mover, part), points)?;
            Ok((followed, Some(kept)))
        }
        Ready::Corrected(mut mover) => {
            let followed = volume.follow(&mut mover, points, true, || {})?;
            Ok((followed, None))
        }
        Ready::Alone => {
            let mut mover = volume.uncorrected_mover()?;
            let followed = volume.follow(&mut mover, points, false, || {})?;
            Ok((followed, None))
        }
    }
}

fn corrected_text(path: &CorrectedPath) -> String {
    let (largest, u) = (path.largest.map(|it| it.um()), path.u.map(|it| it.um()));
    let mut text = format!("largest corrections {largest:.3?} µm, u {u:.3?} µm at most");
    if path.degraded > 0 {
        let (degraded, periods) = (path.degraded, path.periods);
        text += &format!("\nthe correction lacked a value in {degraded} of {periods} periods");
    }
    if let Some(lack) = &path.without {
        text += &format!("; without {lack}");
    }
    if path.limited > 0 {
        let limited = path.limited;
        text += &format!("\nthe correction was limited in {limited} periods");
    }
    text
}

fn write_corrected(path: &CorrectedPath, value: &mut Value) {
    value["largest_correction_um"] = json!(path.largest.map(|it| it.um()));
    value["u_max_um"] = json!(path.u.map(|it| it.um()));
    value["periods_degraded"] = json!(path.degraded);
    value["without"] = json!(path.without.as_ref().map(|it| it.to_string()));
    value["periods_limited"] = json!(path.limited);
}

pub(crate) fn memory_record(args: &MemoryArgs, output: Output) -> Ended {
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

fn kept_text(kept: &Remembered) -> String {
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

fn kept_value(kept: &Remembered) -> Value {
    let axes = Axis::ALL.into_iter().zip(kept.covers);
    let axes = axes.filter_map(|(axis, covers)| {
        let (from, to) = covers?;
        Some(json!({"axis": axis.to_string(), "from_mm": from.mm(), "to_mm": to.mm()}))
    });
    json!({"memory": kept.id, "axes": axes.collect::<Vec<_>>(), "rolls": rolls_of(kept),
           "foreign_second": kept.foreign})
}

pub(crate) fn memory_import(args: &ImportArgs, output: Output) -> Ended {
    if MemoryName::from(args.memory) == MemoryName::Second {
        return Err(Failure::Usage {
            what: "a second memory is the state that a first part was made in".into(),
            help: "record it with `truestage run --first-part` or `truestage memory record`".into(),
        });
    }
    let loaded = config::load(&args.config)?;
    let text = read(&args.file)?;
    let head = volume_head_of(&loaded, memory_pointer(MemoryName::First), &args.file)?;
    let store = loaded.config.machine.store();
    let file = name_of(&args.file);
    let kept = import(&loaded.config, &store, head, (&text, &file))?;
    let text = format!(
        "{} keeps the designed shape: all parts from now on are made with it\n{}",
        short(&kept.id),
        kept_text(&kept)
    );
    output.result(&text, &kept_value(&kept))
}

pub(crate) fn memory_clear(args: &MemoryArgs, output: Output) -> Ended {
    let which = MemoryName::from(args.memory);
    or_by_its_service(cleared_here(&args.machine, which, output), |service| {
        // What counted from it goes out of use with it.
        cleared(
            service.clear(memory_pointer(which))?.as_deref(),
            None,
            output,
        )
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
