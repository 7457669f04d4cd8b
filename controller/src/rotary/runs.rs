//! What is run on rotary tables for whoever keeps a machine: each by itself, and a person turns the plate.

use core::f64::consts::TAU;
use core::time::Duration;

use machine::Stage;
use machine::records::Store;
use serde_json::json;
use units::Radians;

use crate::config::MachineConfig;
use crate::connected::Machine;
use crate::failure::Failure;
use crate::rotary::asked::Asking;
use crate::rotary::plate_run::{DuePlacement, PlateRun};
use crate::rotary::sighted::alone::Progress;
use crate::rotary::table::RotaryTable;
use crate::rotary::{RotaryCalibrated, RotaryTeller};
use crate::run::missing;
use crate::runs::{
    Change, Found, Group, GroupRuns, Planned, Task, Told, Travel, Work, each_usable,
};

pub(crate) static RUNS: GroupRuns = GroupRuns {
    groups,
    offered: &[Stage::Zero, Stage::Calibrate, Stage::Verify],
    resumed,
    warm_up_min: |_| None,
    refuse: Task::without_warm_up,
    planned,
    perform,
    is_driven: |config, axis| config.rotary[axis].is_driven(),
    load,
    with_companions: |_, chosen| Ok(chosen),
    usable,
    paths: None,
    jobs: None,
    moves: None,
    forgets: &[],
};

fn groups(config: &MachineConfig) -> Vec<Group> {
    let groups = config.rotary.iter().map(|(axis, own)| Group {
        files: match own.sighting {
            Some(_) => &[Stage::Calibrate, Stage::Verify],
            None => &[],
        },
        ..Group::of_one(axis, &RUNS)
    });
    groups.collect()
}

/// A verification by a detector is one placement: it is read again.
fn resumed(config: &MachineConfig, axis: &str, stage: Stage) -> bool {
    let by_a_person = config.rotary[axis].sighting.is_some();
    match stage {
        Stage::Calibrate => true,
        Stage::Verify => by_a_person,
        Stage::Zero | Stage::Reference | Stage::Job => false,
    }
}

fn planned(machine: &mut Machine, axis: &str, task: &Task) -> Result<Planned, Failure> {
    let table = machine.rotary(axis)?;
    match task.stage {
        Stage::Calibrate => table.planned_calibration(),
        Stage::Verify => table.planned_verification(),
        Stage::Zero | Stage::Reference | Stage::Job => {
            let zero = table.config.zero.as_ref();
            zero.map(|_| Planned::default())
                .ok_or_else(|| missing(axis, "zero"))
        }
    }
}

impl RotaryTable<'_> {
    fn planned_calibration(&self) -> Result<Planned, Failure> {
        let (run, config) = self.subject().plate_run()?;
        let design = config.design()?;
        let offsets: Vec<f64> = design.offsets().iter().map(|it| *it as f64).collect();
        let mut asks = Vec::new();
        let mut before = None;
        for (number, offset) in (1..).zip(&offsets) {
            let due = due(*offset, (number, offsets.len()), before);
            asks.push(run.task(self.axis, &due, before).text());
            before = Some(*offset);
        }
        Ok(self.planned_run(&run, asks))
    }

    fn planned_verification(&self) -> Result<Planned, Failure> {
        let own = self.config.verify.as_ref();
        let own = own.ok_or_else(|| missing(self.axis, "verify"))?;
        let (run, _) = self.subject().plate_run()?;
        let run = PlateRun {
            passes: own.passes,
            ..run
        };
        let known = self.memory.calibration.as_ref();
        let lay_at = known.and_then(|it| it.content.offsets.first());
        let due = due(own.offset_lines, (1, 1), lay_at.map(|it| f64::from(*it)));
        let task = run.task(self.axis, &due, self.memory.plate_at);
        Ok(self.planned_run(&run, vec![task.text()]))
    }

    /// What placements that are brought about by `asks` come to: each pass is a turn at least, of whoever turns the
    /// table.
    fn planned_run(&self, run: &PlateRun, mut asks: Vec<String>) -> Planned {
        let turns = u64::from(run.sweeps()) * asks.len() as u64;
        let travel = TAU * turns as f64;
        if run.sighting.is_some() {
            let each = u64::from(run.sweeps()) * u64::from(run.lines);
            asks.push(format!("{each} lines are read in each placement"));
        }
        let by_hand = Planned {
            points: turns * u64::from(run.lines),
            asks,
            ..Planned::default()
        };
        if !self.config.is_driven() {
            return by_hand;
        }
        Planned {
            travel: Some(Travel::Angle(Radians(travel))),
            at_least: Duration::try_from_secs_f64(travel / run.speed.value()).unwrap_or_default(),
            ..by_hand
        }
    }
}

fn due(offset: f64, step: (usize, usize), known: Option<f64>) -> DuePlacement {
    DuePlacement {
        offset,
        step,
        known,
        phase: None,
        done: (0, 0),
    }
}

fn perform(work: Work<'_>, axis: &str, task: &Task) -> Result<Found, Failure> {
    match task.stage {
        Stage::Calibrate => calibrate(work, axis, task),
        Stage::Verify => verify(work, axis, task),
        Stage::Zero | Stage::Reference | Stage::Job => zero(work, axis),
    }
}

fn zero(work: Work<'_>, axis: &str) -> Result<Found, Failure> {
    let words = work.words::<RotaryTeller>();
    work.machine.rotary(axis)?.zero()?;
    Ok(Found {
        figures: json!({}),
        told: words.map(|it| (it.zeroed)(axis)),
        ..Found::default()
    })
}

fn calibrate(work: Work<'_>, axis: &str, task: &Task) -> Result<Found, Failure> {
    let options = task.calibrate_options();
    let words = work.words::<RotaryTeller>();
    let mut table = work.machine.rotary(axis)?;
    let (store, mut person) = (work.store, Asking(work.person));
    let progress = match table.config.sighting {
        None => {
            let made = table.calibrate(store, &options, &mut person)?;
            let told = words.map(|it| (it.calibrated)(axis, &made));
            return Ok(found(axis, &made, told));
        }
        Some(_) if !task.files.is_empty() => table.calibrate_from(store, &options, &task.files)?,
        Some(_) => {
            let made = table.calibrate_sighted(store, &options, &mut person)?;
            Progress::Done(Box::new(made))
        }
    };
    let told = words.map(|it| (it.progress)(axis, &progress));
    Ok(match &progress {
        Progress::Done(made) => found(axis, made, told),
        Progress::Due(next) => Found {
            figures: json!({
                "placements_read": next.read.len(),
                "placements": next.task.step.1,
                "due_offset": next.task.offset,
                "columns": next.columns,
                "journal": next.journal,
            }),
            told,
            ..Found::default()
        },
    })
}

fn found(axis: &str, made: &RotaryCalibrated, told: Option<Told>) -> Found {
    Found {
        figures: json!({
            "calibration": made.id,
            "largest_deviation_arcsec": made.content.largest_error().arcsec(),
            "closure_arcsec": made.closure.arcsec(),
            "journal": made.journal,
        }),
        told,
        stored: vec![(axis.to_owned(), made.id.clone())],
        ..Found::default()
    }
}

fn verify(work: Work<'_>, axis: &str, task: &Task) -> Result<Found, Failure> {
    let compensated = !task.uncompensated;
    let words = work.words::<RotaryTeller>();
    let mut table = work.machine.rotary(axis)?;
    let (store, mut person) = (work.store, Asking(work.person));
    // Uncompensated, too: it knows the plate's errors.
    table.load_active(store)?;
    let how = (compensated, task.resume.as_ref());
    let verified = match table.config.sighting {
        None => table.verify(store, compensated, &mut person),
        Some(_) if !task.files.is_empty() => table.verify_from(store, how, &task.files),
        Some(_) => table.verify_sighted(store, how, &mut person),
    }?;
    let judged = verified.left.as_ref();
    Ok(Found {
        figures: json!({
            "found_arcsec": verified.found.largest.arcsec(),
            "left_arcsec": judged.map(|it| it.largest.arcsec()),
            "tolerance_arcsec": verified.tolerance.arcsec(),
            "within_tolerance": judged.map(|_| verified.is_within_tolerance()),
            "journal": verified.journal,
        }),
        told: words.map(|it| (it.verified)(axis, &verified)),
        bad: verified.out_of_tolerance(axis),
        ..Found::default()
    })
}

fn load(
    machine: &mut Machine,
    store: &Store,
    axis: &str,
) -> Result<Vec<(String, Option<String>)>, Failure> {
    let mut table = machine.rotary(axis)?;
    // One that was taken out of use is not used on.
    table.forget_calibration();
    let id = match table.config.compensation {
        None => None,
        Some(_) => table.load_active(store)?,
    };
    Ok(vec![(axis.to_owned(), id)])
}

fn usable(machine: &mut Machine, store: &Store, changes: &[Change]) -> Result<(), Failure> {
    each_usable(changes, |axis, id| {
        let table = machine.rotary(axis)?;
        table.subject().usable(store, id).map(drop)
    })
}
