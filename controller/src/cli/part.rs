//! Parts: a path of three axes that is followed, what the correction said along it, and the state
//! that later parts are to be made with.

use std::path::Path;

use compensator::volumetric::Axis;
use serde_json::{Value, json};
use truestage::cycle::volumetric::Remembered;
use truestage::engine::{CsvError, Engine, Lack, Live, NoCorrection, Validity, read_path};
use truestage::ports::Use;
use truestage::store::{MemoryName, short};
use truestage::{Failure, Machine, Store};
use units::Metres;

use super::data::read;
use super::output::{Ended, Output};
use super::session::Session;
use super::volume::with_zeroed_volume;
use super::{MachineArgs, MemoryArgs};

/// How a path was followed.
struct Followed {
    count: usize,
    corrected: Option<CorrectedPath>,
    timing: String,
    /// What later parts are made with, when this was the first.
    kept: Option<Remembered>,
}

pub(super) fn run(machine: &MachineArgs, file: &Path, is_first: bool, output: Output) -> Ended {
    let path = read(file)?;
    let follow = |machine: &mut Machine, store: &Store| {
        let points = |engine: &Engine| {
            let points = read_path(&path, engine.axes(), engine.period());
            points.map_err(|source: CsvError| Failure::Usage {
                what: format!("{}: {source}", file.display()),
                help: "the columns are time_s,x_mm,y_mm,z_mm".into(),
            })
        };
        followed(machine, store, is_first, points)
    };
    let (followed, counters) = with_zeroed_volume(machine, "run", Use::Motion, output, follow)?;
    let said = match &followed.corrected {
        Some(corrected) => corrected.text(),
        None => "uncorrected: the errors were never measured".into(),
    };
    let (count, timing) = (followed.count, &followed.timing);
    let mut text = format!("{count} points followed, {said}\n{timing}");
    let mut value = json!({"points": count, "corrected": followed.corrected.is_some(),
                           "counters": counters});
    if let Some(corrected) = &followed.corrected {
        corrected.write_into(&mut value);
    }
    if let Some(kept) = &followed.kept {
        text += &format!(
            "\nmade without what the detectors saw; {} keeps that: all later parts are made with it\n{}",
            short(&kept.id),
            kept_text(kept)
        );
        value["memory"] = kept_value(kept);
    }
    output.result(&text, &value)
}

fn followed(
    machine: &mut Machine,
    store: &Store,
    is_first: bool,
    points: impl FnOnce(&Engine) -> Result<Vec<Vec<Metres>>, Failure>,
) -> Result<Followed, Failure> {
    let (mover, part) = match is_first {
        true => {
            let (mover, part) = machine.first_part(store)?;
            (Some(mover), Some(part))
        }
        false => (machine.stored_mover(store)?, None),
    };
    let is_corrected = mover.is_some();
    let mut mover = match mover {
        Some(mover) => mover,
        None => machine.volumetric_mover(Box::new(NoCorrection))?,
    };
    let points = points(mover.engine())?;
    machine.correct_volume(&mut mover, is_corrected)?;
    if let Some(part) = &part {
        part.recorder.listen();
    }
    let mut corrected = CorrectedPath::default();
    let count = points.len();
    machine.drive_along(&mut mover, points, &mut |live| corrected.note(live))?;
    let timing = mover.engine().timing().to_string();
    let kept = match part {
        Some(part) => Some(machine.keep_part(store, mover, part)?),
        None => None,
    };
    Ok(Followed {
        count,
        corrected: is_corrected.then_some(corrected),
        timing,
        kept,
    })
}

/// What the correction said along a path.
#[derive(Default)]
struct CorrectedPath {
    largest: [Metres; 3],
    u: [Metres; 3],
    periods: u64,
    /// The worst that it had to do without, and for how many periods.
    without: Option<Lack>,
    degraded: u64,
    limited: u64,
}

impl CorrectedPath {
    fn note(&mut self, live: &Live) {
        self.periods += 1;
        for axis in 0..3 {
            self.largest[axis] = self.largest[axis].max(live.offset[axis].abs());
            self.u[axis] = self.u[axis].max(live.uncertainty[axis]);
        }
        if let Validity::Without(lack) = live.validity {
            self.without = Some(lack.worse_of(self.without));
        }
        self.degraded += u64::from(live.validity != Validity::Valid);
        let is_limited = live.alarms.iter().any(Option::is_some) || live.clamped.contains(&true);
        self.limited += u64::from(is_limited);
    }

    fn text(&self) -> String {
        let (largest, u) = (self.largest.map(|it| it.um()), self.u.map(|it| it.um()));
        let mut text = format!("largest corrections {largest:.3?} µm, u {u:.3?} µm at most");
        if self.degraded > 0 {
            let (degraded, periods) = (self.degraded, self.periods);
            text += &format!("\nnot all was known in {degraded} of {periods} periods");
        }
        if let Some(lack) = &self.without {
            text += &format!("; without {lack}");
        }
        if self.limited > 0 {
            let limited = self.limited;
            text += &format!("\nthe correction was limited in {limited} periods");
        }
        text
    }

    fn write_into(&self, value: &mut Value) {
        value["largest_correction_um"] = json!(self.largest.map(|it| it.um()));
        value["u_max_um"] = json!(self.u.map(|it| it.um()));
        value["periods_degraded"] = json!(self.degraded);
        value["without"] = json!(self.without.map(|it| it.to_string()));
        value["periods_limited"] = json!(self.limited);
    }
}

pub(super) fn memory_record(args: &MemoryArgs, output: Output) -> Ended {
    let which = MemoryName::from(args.memory);
    let record = |machine: &mut Machine, store: &Store| machine.record_memory(store, which);
    let (kept, counters) =
        with_zeroed_volume(&args.machine, "memory", Use::Motion, output, record)?;
    let text = format!(
        "{} keeps the present state: all parts from now on are made with it\n{}",
        short(&kept.id),
        kept_text(&kept)
    );
    let mut value = kept_value(&kept);
    value["counters"] = counters;
    output.result(&text, &value)
}

fn kept_text(kept: &Remembered) -> String {
    let axes = Axis::ALL.into_iter().zip(kept.covers);
    let axes = axes.filter_map(|(axis, covers)| {
        let (from, to) = covers?;
        Some(format!("{axis} {:.3} to {:.3} mm", from.mm(), to.mm()))
    });
    let axes: Vec<String> = axes.collect();
    format!(
        "recorded along {}; beyond, the ends hold{}",
        axes.join(", "),
        foreign_text(kept.foreign.as_deref())
    )
}

/// A second memory that no longer fits the first.
fn foreign_text(foreign: Option<&str>) -> String {
    let foreign = foreign.map(short);
    foreign.map_or_else(String::new, |it| {
        format!(
            "\nthe second memory {it} counts beyond another first one: before the next part record it \
             again (`truestage memory record`) or clear it (`truestage memory clear`)"
        )
    })
}

fn kept_value(kept: &Remembered) -> Value {
    let axes = Axis::ALL.into_iter().zip(kept.covers);
    let axes = axes.filter_map(|(axis, covers)| {
        let (from, to) = covers?;
        Some(json!({"axis": axis.to_string(), "from_mm": from.mm(), "to_mm": to.mm()}))
    });
    json!({"memory": kept.id, "axes": axes.collect::<Vec<_>>(), "foreign_second": kept.foreign})
}

pub(super) fn memory_clear(args: &MemoryArgs, output: Output) -> Ended {
    let which = MemoryName::from(args.memory);
    let session = Session::open(&args.machine, "memory", Use::Motion, output)?;
    let (before, foreign) = session.machine.clear_memory(&session.store, which)?;
    let text = match &before {
        Some(id) => format!("{} is kept no more", short(id)),
        None => "nothing was kept".into(),
    };
    let text = text + &foreign_text(foreign.as_deref());
    output.result(
        &text,
        &json!({"cleared": before, "foreign_second": foreign}),
    )
}
