//! What is run on an alignment platform for whoever keeps a machine: all of its screws together.

use core::time::Duration;

use machine::Stage;
use machine::records::Store;
use serde_json::json;
use units::Metres;

use crate::config::MachineConfig;
use crate::connected::Machine;
use crate::failure::Failure;
use crate::platform::target::parts;
use crate::platform::together::MOVES;
use crate::platform::{PlatformFailure, PlatformTeller};
use crate::runs::{
    Change, Found, Group, GroupRuns, Moved, Planned, Task, Travel, Work, each_usable, standing,
};

/// What its screws are called together.
const WHOLE: &str = "platform";

pub(crate) static RUNS: GroupRuns = GroupRuns {
    groups,
    offered: &[Stage::Zero, Stage::Calibrate, Stage::Verify],
    resumed: |_, _, _| false,
    warm_up_min: |_| None,
    refuse,
    planned,
    perform,
    is_driven: |_, _| true,
    load,
    with_companions: |_, chosen| Ok(chosen),
    usable,
    paths: None,
    jobs: None,
    moves: Some(&MOVES),
    forgets: &[],
};

fn groups(config: &MachineConfig) -> Vec<Group> {
    let group = config.platform.iter().map(|platform| {
        let screws = platform.actuator.iter().map(|it| it.axis.clone());
        let screws: Vec<_> = screws.collect();
        Group {
            name: WHOLE.to_owned(),
            axes: screws.clone(),
            moved: Moved::Together,
            parts: parts(),
            // Each screw has its own model; they go back together.
            pointers: screws,
            journals: WHOLE.to_owned(),
            files: &[],
            runs: &RUNS,
        }
    });
    group.collect()
}

fn refuse(task: &Task) -> Result<(), Failure> {
    task.without_warm_up()?;
    if !task.accept_drift {
        return Ok(());
    }
    Err(Failure::Usage {
        what: "a platform that has drifted cannot be calibrated".into(),
        help: "wait until the temperature has settled".into(),
    })
}

fn planned(machine: &mut Machine, _: &str, task: &Task) -> Result<Planned, Failure> {
    let platform = machine.platform()?;
    let config = platform.config;
    let missing = |section| PlatformFailure::NotConfigured { section };
    let settle = Duration::from_millis(config.settle_ms.into());
    match task.stage {
        Stage::Calibrate => {
            let own = config.calibrate.as_ref().ok_or(missing("calibrate"))?;
            let strokes: Vec<_> = config
                .actuator
                .iter()
                .map(|it| own.strokes_of(it))
                .collect();
            let places: usize = strokes.iter().map(|it| it.targets().len()).sum();
            let points = 2 * places as u64 * u64::from(own.runs);
            // There and back in each run.
            let ways = strokes.iter().map(|it| match it.targets().as_slice() {
                [first, .., last] => (*last - *first).value(),
                _ => 0.0,
            });
            let travel = Metres(2.0 * ways.sum::<f64>() * f64::from(own.runs));
            let axes = config
                .actuator
                .iter()
                .filter_map(|it| platform.core.config.axis.get(&it.axis));
            let speeds = axes.map(|it| it.motion.speed_mm_per_s * 1e-3);
            let moving = travel.value() / speeds.fold(0.0, f64::max);
            let moving = Duration::try_from_secs_f64(moving).unwrap_or_default();
            Ok(Planned {
                points,
                travel: Some(Travel::Length(travel)),
                at_least: moving + standing(settle, points),
                ..Planned::default()
            })
        }
        Stage::Verify => {
            let own = config.verify.as_ref().ok_or(missing("verify"))?;
            let points = u64::from(own.poses);
            Ok(Planned {
                points,
                at_least: standing(settle, points),
                ..Planned::default()
            })
        }
        Stage::Zero | Stage::Reference | Stage::Job => Ok(Planned::default()),
    }
}

fn perform(work: Work<'_>, _: &str, task: &Task) -> Result<Found, Failure> {
    match task.stage {
        Stage::Calibrate => calibrate(work, task),
        Stage::Verify => verify(work, task),
        Stage::Zero | Stage::Reference | Stage::Job => zero(work),
    }
}

fn zero(work: Work<'_>) -> Result<Found, Failure> {
    let words = work.words::<PlatformTeller>();
    let zeroed = work.machine.platform()?.zero(work.store)?;
    let datum = zeroed.datum;
    Ok(Found {
        figures: json!({
            "datum_x_mm": datum.x.mm(),
            "datum_y_mm": datum.y.mm(),
            "datum_theta_arcsec": datum.angle.arcsec(),
            "journal": zeroed.journal,
        }),
        told: words.map(|it| (it.zeroed)(&zeroed)),
        ..Found::default()
    })
}

fn calibrate(work: Work<'_>, task: &Task) -> Result<Found, Failure> {
    let words = work.words::<PlatformTeller>();
    let options = task.calibrate_options();
    let made = work
        .machine
        .platform()?
        .calibrate_by(work.store, &options)?;
    Ok(Found {
        figures: json!({
            "screws": made.screws.len(),
            "closure_um": made.closure.um(),
            "journal": made.journal,
        }),
        told: words.map(|it| (it.calibrated)(&made)),
        stored: made.stored(),
        ..Found::default()
    })
}

fn verify(work: Work<'_>, task: &Task) -> Result<Found, Failure> {
    let words = work.words::<PlatformTeller>();
    let compensated = !task.uncompensated;
    let mut platform = work.machine.platform()?;
    if compensated {
        platform.load_active(work.store)?;
    }
    let verified = platform.verify(work.store, compensated)?;
    Ok(Found {
        figures: json!({
            "largest_um": verified.largest.um(),
            "rms_um": verified.rms.um(),
            "tolerance_um": verified.tolerance.um(),
            "within_tolerance": verified.is_within_tolerance(),
            "journal": verified.journal,
        }),
        told: words.map(|it| (it.verified)(&verified, compensated)),
        bad: verified.out_of_tolerance().filter(|_| compensated),
        ..Found::default()
    })
}

fn load(
    machine: &mut Machine,
    store: &Store,
    _: &str,
) -> Result<Vec<(String, Option<String>)>, Failure> {
    machine.platform()?.load_active(store)
}

fn usable(machine: &mut Machine, store: &Store, changes: &[Change]) -> Result<(), Failure> {
    let platform = machine.platform()?;
    each_usable(changes, |screw, id| {
        platform.usable(store, screw, id).map(drop)
    })
}
