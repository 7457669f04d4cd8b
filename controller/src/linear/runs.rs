//! What is run on linear axes for whoever keeps a machine: each by itself.

use machine::Stage;
use machine::records::Store;
use serde_json::json;

use crate::config::MachineConfig;
use crate::connected::Machine;
use crate::failure::Failure;
use crate::linear::job::asked::Asking;
use crate::linear::job::judge::job_judge;
use crate::linear::{Job, LinearTeller, Reached, VerifyOptions};
use crate::run::missing;
use crate::runs::{
    Change, Found, Group, GroupRuns, Planned, Task, Told, Travel, Work, each_usable,
};

pub(crate) static RUNS: GroupRuns = GroupRuns {
    groups,
    offered: &[Stage::Zero, Stage::Calibrate, Stage::Verify, Stage::Job],
    resumed: |_, _, stage| matches!(stage, Stage::Calibrate | Stage::Verify | Stage::Job),
    warm_up_min: |_| None,
    refuse: Task::without_warm_up,
    planned,
    perform,
    is_driven: |_, _| true,
    load,
    with_companions: |_, chosen| Ok(chosen),
    usable,
    paths: None,
    jobs: Some(|machine| job_judge(machine.config().clone(), machine.config_hash().clone())),
    moves: None,
    forgets: &[],
};

fn groups(config: &MachineConfig) -> Vec<Group> {
    let axes = config.axis.keys();
    axes.map(|it| Group::of_one(it, &RUNS)).collect()
}

fn planned(machine: &mut Machine, axis: &str, task: &Task) -> Result<Planned, Failure> {
    let stage_of = machine.linear(axis)?;
    let stage = task.stage;
    if stage == Stage::Job {
        // What a job will do is known with it.
        return Ok(Planned::default());
    }
    if stage == Stage::Zero {
        let zero = stage_of.config().zero.as_ref();
        return zero
            .map(|_| Planned::default())
            .ok_or_else(|| missing(axis, "zero"));
    }
    let plan = stage_of.planned(stage);
    let plan = plan.ok_or_else(|| missing(axis, stage.text()))?;
    Ok(Planned {
        points: plan.points,
        travel: Some(Travel::Length(plan.travel)),
        at_least: plan.at_least,
        ..Planned::default()
    })
}

fn perform(work: Work<'_>, axis: &str, task: &Task) -> Result<Found, Failure> {
    match task.stage {
        Stage::Calibrate => calibrate(work, axis, task),
        Stage::Verify => verify(work, axis, task),
        Stage::Job => do_job(work, axis, task),
        Stage::Zero | Stage::Reference => zero(work, axis),
    }
}

fn zero(work: Work<'_>, axis: &str) -> Result<Found, Failure> {
    let words = work.words::<LinearTeller>();
    let zeroed = work.machine.linear(axis)?.zero(work.store)?;
    let estimate = &zeroed.estimate;
    Ok(Found {
        figures: json!({
            "origin_um": estimate.origin.um(),
            "standard_uncertainty_um": estimate.standard_uncertainty.um(),
            "points": estimate.points,
            "journal": zeroed.journal,
        }),
        told: words.map(|it| (it.zeroed)(axis, &zeroed)),
        ..Found::default()
    })
}

fn calibrate(work: Work<'_>, axis: &str, task: &Task) -> Result<Found, Failure> {
    let options = task.calibrate_options();
    let words = work.words::<LinearTeller>();
    let mut stage = work.machine.linear(axis)?;
    let made = stage.calibrate(work.store, &options)?;
    Ok(Found {
        figures: json!({
            "calibration": made.id,
            "largest_deviation_um": made.fitted.table.largest().um(),
            "positions": made.fitted.table.nodes().len(),
            "closure_um": made.measured.closure.map(|it| it.um()),
            "journal": made.journal,
        }),
        told: words.map(|it| (it.calibrated)(&made)),
        stored: vec![(axis.to_owned(), made.id.clone())],
        ..Found::default()
    })
}

fn verify(work: Work<'_>, axis: &str, task: &Task) -> Result<Found, Failure> {
    let words = work.words::<LinearTeller>();
    let compensated = !task.uncompensated;
    let calibration = match compensated {
        true => work.machine.linear(axis)?.load_active(work.store)?,
        false => None,
    };
    let options = VerifyOptions {
        compensated,
        calibration,
        resume: task.resume.clone(),
    };
    let mut stage = work.machine.linear(axis)?;
    let verified = stage.verify(work.store, &options)?;
    Ok(Found {
        figures: json!({
            "accuracy_um": verified.figures.accuracy.bidirectional.um(),
            "tolerance_um": verified.tolerance.um(),
            "within_tolerance": verified.is_within_tolerance(),
            "journal": verified.journal,
        }),
        told: words.map(|it| (it.verified)(axis, &verified, compensated)),
        bad: verified.out_of_tolerance(axis).filter(|_| compensated),
        ..Found::default()
    })
}

fn do_job(work: Work<'_>, axis: &str, task: &Task) -> Result<Found, Failure> {
    let words = work.words::<LinearTeller>();
    let judged = task.job.as_ref();
    let judged = judged.and_then(|it| Some((it.of::<Job>()?, &it.calibration)));
    let (job, calibration) = judged.ok_or_else(|| Failure::Usage {
        what: "a job without points".into(),
        help: "give them".into(),
    })?;
    // What is beyond its range was refused with that one, and may lie elsewhere with another.
    if work.store.active(axis)?.current.as_ref() != Some(calibration) {
        return Err(Failure::Usage {
            what: format!(
                "axis {axis} uses another calibration than the one that this job was judged with"
            ),
            help: "plan it again".into(),
        });
    }
    let tells = words.map(|it| move |point: &Reached| (it.reached)(job, calibration, point));
    let mut person = Asking {
        person: work.person,
        tells: tells.as_ref().map(|it| it as &dyn Fn(&Reached) -> Told),
    };
    let mut stage = work.machine.linear(axis)?;
    let done = match &task.resume {
        None => stage.run_job(work.store, job, &mut person),
        Some(journal) => stage.resume_job(work.store, job, journal, &mut person),
    }?;
    Ok(Found {
        figures: json!({
            "points": done.reached.len(),
            "points_before": done.before,
            "calibration": done.calibration,
            "journal": done.journal,
        }),
        told: words.map(|it| (it.job_done)(job, &done)),
        ..Found::default()
    })
}

fn load(
    machine: &mut Machine,
    store: &Store,
    axis: &str,
) -> Result<Vec<(String, Option<String>)>, Failure> {
    let id = match machine.config().axis[axis].compensation {
        None => None,
        Some(_) => machine.linear(axis)?.load_active(store)?,
    };
    Ok(vec![(axis.to_owned(), id)])
}

fn usable(machine: &mut Machine, store: &Store, changes: &[Change]) -> Result<(), Failure> {
    each_usable(changes, |axis, id| {
        machine.linear(axis)?.usable(store, id).map(drop)
    })
}
