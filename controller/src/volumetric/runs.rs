//! What is run on three axes for whoever keeps a machine: all of them together, and a person sets lines up.

use core::time::Duration;
use std::path::Path;

use machine::Stage;
use machine::records::Store;
use serde_json::json;
use units::Metres;

use crate::config::MachineConfig;
use crate::connected::Machine;
use crate::failure::Failure;
use crate::runs::{
    DataFile, Found, Group, GroupRuns, JudgedPath, Moved, Part, PathJudge, Planned, Task, Travel,
    Work, standing,
};
use crate::volumetric::asked::Asking;
use crate::volumetric::calibrate::minutes_of;
use crate::volumetric::calibrate::plan::{set_up_task, volume_plan};
use crate::volumetric::chosen;
use crate::volumetric::handle::WorkVolume;
use crate::volumetric::memory_import::no_designed_second;
use crate::volumetric::motion::{MOVES, require_measured};
use crate::volumetric::{GEOMETRY, MemoryName, VerifyBy, VolumetricTeller, WarmUp, memory_pointer};

/// What the three axes are called together.
const WHOLE: &str = "volume";

pub(crate) static RUNS: GroupRuns = GroupRuns {
    groups,
    offered: &[
        Stage::Zero,
        Stage::Calibrate,
        Stage::Verify,
        Stage::Reference,
        Stage::Job,
    ],
    resumed: |_, _, stage| stage == Stage::Calibrate,
    warm_up_min: minutes_of,
    refuse,
    planned,
    perform,
    is_driven: |_, _| true,
    load,
    with_companions: chosen::with_companions,
    usable: chosen::usable,
    paths: Some(paths),
    jobs: None,
    moves: Some(&MOVES),
    forgets: &[
        memory_pointer(MemoryName::First),
        memory_pointer(MemoryName::Second),
    ],
};

fn groups(config: &MachineConfig) -> Vec<Group> {
    let volume = config.volumetric.iter();
    let group = volume.map(|volume| Group {
        name: WHOLE.to_owned(),
        axes: volume.axes.to_vec(),
        moved: Moved::CorrectedTogether,
        parts: volume.axes.iter().map(|it| Part::of_length(it)).collect(),
        pointers: chosen::pointers(),
        journals: GEOMETRY.to_owned(),
        files: &[Stage::Reference],
        runs: &RUNS,
    });
    group.collect()
}

/// How the axes become warm.
fn warm_up_of(task: &Task) -> Result<WarmUp, Failure> {
    let Some(minutes) = task.warm_up_min else {
        return Ok(WarmUp::None);
    };
    WarmUp::of_minutes(minutes).ok_or_else(|| Failure::Usage {
        what: format!("`warm_up_min` = {minutes}"),
        help: "give the minutes for which the axes move to and fro".into(),
    })
}

fn refuse(task: &Task) -> Result<(), Failure> {
    if !task.files.is_empty() {
        require_shape(task.memory, &task.files)?;
    }
    match task.stage {
        Stage::Calibrate => drop(warm_up_of(task)?),
        Stage::Zero | Stage::Verify | Stage::Reference | Stage::Job => task.without_warm_up()?,
    }
    if !task.accept_drift {
        return Ok(());
    }
    Err(Failure::Usage {
        what: "a calibration of three axes is not judged by its closure".into(),
        help: "start it again without accepting drift".into(),
    })
}

fn planned(machine: &mut Machine, _: &str, task: &Task) -> Result<Planned, Failure> {
    let volume = machine.volumetric()?;
    match task.stage {
        Stage::Calibrate => volume.planned_calibration(task.warm_up_min.is_some()),
        Stage::Verify => volume.planned_verification(),
        Stage::Zero | Stage::Reference | Stage::Job => Ok(Planned::default()),
    }
}

impl WorkVolume<'_> {
    fn planned_calibration(&self, is_warm: bool) -> Result<Planned, Failure> {
        let (plan, lines) = volume_plan(self.config, is_warm, Vec::new())?;
        let numbered = plan.lines.iter().enumerate();
        let set_up = numbered.filter(|(_, line)| !line.by_detectors);
        let asks = set_up.map(|(number, _)| set_up_task(&lines, number).text());
        let points = plan.lines.iter().map(|line| line.points as u64).sum();
        let own = self.config.calibrate.as_ref();
        let settle_ms = own.map_or(0.0, |it| it.settle_ms);
        let ways = plan.lines.iter().map(|it| apart(it.from_m, it.to_m));
        let travel = Metres(ways.sum());
        let axes = self.config.axes.iter();
        let axes = axes.filter_map(|it| self.core.config.axis.get(it));
        let speeds = axes.map(|it| it.motion.speed_mm_per_s * 1e-3);
        // Its three axes at once take it along a diagonal.
        let speed = speeds.map(|it| it * it).sum::<f64>().sqrt();
        let moving = Duration::try_from_secs_f64(travel.value() / speed).unwrap_or_default();
        let settle = Duration::try_from_secs_f64(settle_ms * 1e-3).unwrap_or_default();
        Ok(Planned {
            points,
            travel: Some(Travel::Length(travel)),
            at_least: moving + standing(settle, points),
            asks: asks.collect(),
            ..Planned::default()
        })
    }

    fn planned_verification(&self) -> Result<Planned, Failure> {
        let own = self.verify_config()?;
        Ok(Planned {
            points: u64::from(own.points),
            asks: vec![self.verified_line(&own).text()],
            ..Planned::default()
        })
    }
}

/// From one place to the other, metres.
fn apart(from: [f64; 3], to: [f64; 3]) -> f64 {
    let ways = from.iter().zip(to).map(|(from, to)| to - from);
    ways.map(|it| it * it).sum::<f64>().sqrt()
}

/// Whether what is stored can be used, and which errors that corrects.
fn load(
    machine: &mut Machine,
    store: &Store,
    _: &str,
) -> Result<Vec<(String, Option<String>)>, Failure> {
    let volume = machine.volumetric()?;
    let stored = volume.state(store)?;
    let geometry = stored.map(|(_, records)| records.geometry);
    let axes = volume.config().axes.iter();
    Ok(axes.map(|it| (it.clone(), geometry.clone())).collect())
}

fn perform(work: Work<'_>, _: &str, task: &Task) -> Result<Found, Failure> {
    match task.stage {
        Stage::Zero => zero(work),
        Stage::Job => follow(work, task),
        Stage::Calibrate => calibrate(work, task),
        Stage::Verify => verify(work, task),
        Stage::Reference => match task.memory {
            None => reference(work),
            Some(memory) => match task.files.as_slice() {
                [] => remember(work, memory),
                files => import(work, memory, files),
            },
        },
    }
}

/// What a path of a service is called in what is said of it.
const PATH: &str = "path";

fn paths(machine: &mut Machine) -> Result<PathJudge, Failure> {
    let judge = machine.volumetric()?.path_judge()?;
    Ok(PathJudge::new(move |store, (rows, join), is_corrected| {
        if is_corrected {
            require_measured(store)?;
        }
        let path = judge.judge((Path::new(PATH), rows), join, is_corrected)?;
        Ok(JudgedPath::new(path, judge.period()))
    }))
}

fn follow(work: Work<'_>, task: &Task) -> Result<Found, Failure> {
    let words = work.words::<VolumetricTeller>();
    let Some(judged) = &task.path else {
        return Err(Failure::Usage {
            what: "a path without rows".into(),
            help: "give them".into(),
        });
    };
    let (points, is_corrected) = (judged.path.points.clone(), !task.uncompensated);
    let mut volume = work.machine.volumetric()?;
    let (followed, kept) = match task.first_part {
        false => (
            volume.follow_stored(work.store, points, is_corrected)?,
            None,
        ),
        true => {
            let ready = volume.first_part(work.store)?;
            let (followed, kept) = volume.follow_part(work.store, ready, points)?;
            (followed, Some(kept))
        }
    };
    let corrected = followed.corrected.as_ref();
    Ok(Found {
        figures: json!({
            "points": followed.count,
            "corrected": corrected.is_some(),
            "largest_correction_um": corrected.map(|it| it.largest.map(|it| it.um())),
            "u_max_um": corrected.map(|it| it.u.map(|it| it.um())),
            "memory": kept.as_ref().map(|it| &it.id),
        }),
        told: words.map(|it| (it.followed)(&followed, &judged.path, kept.as_ref())),
        ..Found::default()
    })
}

fn zero(work: Work<'_>) -> Result<Found, Failure> {
    let words = work.words::<VolumetricTeller>();
    work.machine.volumetric()?.zero()?;
    Ok(Found {
        figures: json!({}),
        told: words.map(|it| (it.zeroed)()),
        ..Found::default()
    })
}

fn calibrate(work: Work<'_>, task: &Task) -> Result<Found, Failure> {
    let words = work.words::<VolumetricTeller>();
    let (store, options) = (work.store, task.calibrate_options());
    let mut volume = work.machine.volumetric()?;
    let warm_up = warm_up_of(task)?;
    let made = volume.calibrate_by(store, warm_up, &options, &mut Asking(work.person))?;
    Ok(Found {
        figures: json!({
            "geometry": made.id,
            "references": made.references,
            "lines": made.lines,
            "u_tool_max_um": made.u_max.um(),
            "journal": made.journal,
        }),
        told: words.map(|it| (it.calibrated)(&made)),
        stored: made.stored(),
        ..Found::default()
    })
}

fn verify(work: Work<'_>, task: &Task) -> Result<Found, Failure> {
    let words = work.words::<VolumetricTeller>();
    let by = match task.uncompensated {
        true => VerifyBy::AsFound,
        false => VerifyBy::Everything,
    };
    let mut volume = work.machine.volumetric()?;
    volume.check_verify(work.store, by)?;
    let verified = volume.verify(work.store, by, &mut Asking(work.person))?;
    Ok(Found {
        figures: json!({
            "range_um": verified.range.um(),
            "tolerance_um": verified.limit.um(),
            "within_tolerance": verified.is_within_tolerance(),
            "journal": verified.journal,
        }),
        told: words.map(|it| (it.verified)(&verified)),
        bad: verified.out_of_tolerance().filter(|_| !task.uncompensated),
        ..Found::default()
    })
}

fn reference(work: Work<'_>) -> Result<Found, Failure> {
    let words = work.words::<VolumetricTeller>();
    let taken = work.machine.volumetric()?.reference(work.store)?;
    Ok(Found {
        figures: json!({"references": taken.id, "geometry": taken.references.content.geometry}),
        told: words.map(|it| (it.referenced)(&taken)),
        ..Found::default()
    })
}

/// The file of a designed shape: a first memory is one of one file.
fn require_shape(memory: Option<MemoryName>, files: &[DataFile]) -> Result<&DataFile, Failure> {
    match (memory, files) {
        (Some(MemoryName::First), [file]) => Ok(file),
        (Some(MemoryName::First), _) => Err(Failure::Usage {
            what: format!("{} files, and a designed shape is one", files.len()),
            help: "give that one".into(),
        }),
        (Some(MemoryName::Second), _) => Err(no_designed_second()),
        (None, _) => Err(Failure::Usage {
            what: "`files`, and references are what the machine's detectors see".into(),
            help: "leave them out".into(),
        }),
    }
}

/// Keeps a designed shape as the state in which all later parts are made; nothing moves.
fn import(work: Work<'_>, memory: MemoryName, files: &[DataFile]) -> Result<Found, Failure> {
    let words = work.words::<VolumetricTeller>();
    let file = require_shape(Some(memory), files)?;
    let mut volume = work.machine.volumetric()?;
    let kept = volume.import_memory(work.store, file)?;
    Ok(Found {
        figures: json!({"memory": kept.id, "foreign_second": kept.foreign}),
        told: words.map(|it| (it.designed)(&kept)),
        ..Found::default()
    })
}

/// Keeps the present state, in which all later parts are made.
fn remember(work: Work<'_>, memory: MemoryName) -> Result<Found, Failure> {
    let words = work.words::<VolumetricTeller>();
    let mut volume = work.machine.volumetric()?;
    volume.check_memory(work.store, memory)?;
    let kept = volume.record_memory(work.store, memory)?;
    Ok(Found {
        figures: json!({"memory": kept.id, "foreign_second": kept.foreign}),
        told: words.map(|it| (it.remembered)(&kept)),
        ..Found::default()
    })
}
