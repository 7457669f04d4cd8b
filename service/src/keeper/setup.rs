//! What is known of a machine before it is started.

use std::collections::BTreeMap;

use machine::Stage;
use truestage::runs::{Group, Moved, Planned, Task, Travel};
use truestage::{Failure, Machine};

use super::events::utc_now;
use super::mechanics::Mechanics;
use super::rest::RestWatch;
use super::seat::{self, Seat};
use crate::problem::Problem;
use crate::quantity::Quantity;
use crate::request::RunKind;
use crate::snapshot::{Fixed, FixedAxis};
use crate::view::{AxisState, GroupView, RunPlanView};

/// What never changes of `machine`.
pub(crate) fn fixed(machine: &mut Machine, groups: &[Group]) -> Result<Fixed, Failure> {
    let names = names(machine).into_iter();
    let axes = names.map(|name| {
        let soft_limits = Mechanics::of(machine, &name)?.soft_limits();
        let group = group_of(groups, &name).map_or_else(|| name.clone(), |it| it.name.clone());
        Ok(FixedAxis {
            name,
            group,
            soft_limits,
        })
    });
    let axes = axes.collect::<Result<_, Failure>>()?;
    let section = &machine.config().machine;
    Ok(Fixed {
        name: section.name.clone(),
        stage_serial: section.stage_serial.clone(),
        config_hash: machine.config_hash().as_str().to_owned(),
        started: utc_now(),
        axes,
        groups: groups.iter().filter_map(moved_as_one).collect(),
        config: machine.config().clone(),
    })
}

fn moved_as_one(group: &Group) -> Option<GroupView> {
    let targets = group.parts.iter().map(|it| it.name.clone());
    let targets: Vec<_> = targets.collect();
    (!targets.is_empty()).then(|| GroupView {
        name: group.name.clone(),
        axes: group.axes.clone(),
        targets,
    })
}

/// The axes of `machine`.
fn names(machine: &Machine) -> Vec<String> {
    let devices = machine.devices();
    [devices.axis_names(), devices.rotary_names()].concat()
}

fn group_of<'g>(groups: &'g [Group], axis: &str) -> Option<&'g Group> {
    let mut groups = groups.iter();
    groups.find(|it| it.axes.iter().any(|it| it == axis))
}

/// The axes of `machine`, of these `groups`, which nobody has yet.
pub(crate) fn seats(machine: &mut Machine, groups: &[Group]) -> Result<Vec<Seat>, Failure> {
    let names = names(machine);
    names.iter().map(|it| seat(machine, groups, it)).collect()
}

fn seat(machine: &mut Machine, groups: &[Group], name: &str) -> Result<Seat, Failure> {
    Ok(Seat {
        name: name.into(),
        moved: group_of(groups, name).map_or(Moved::Alone, |it| it.moved),
        mechanics: Mechanics::of(machine, name)?,
        move_timeout: Mechanics::move_timeout(machine, name),
        in_position: Mechanics::in_position(machine, name),
        rest: RestWatch::new(Mechanics::position_window(machine, name)),
        calibration: None,
        task: seat::Task::Free,
        standing_since: None,
        target: None,
        set_point: None,
        standard_uncertainty: None,
        rests_at: None,
        last_cause: None,
        state: AxisState::Disabled,
    })
}

/// What the runs of a group would do, or why they cannot be; one that its kind does not have is not there. A calibration
/// that becomes warm on its way does something else.
pub(crate) type Plans = BTreeMap<(RunKind, Warmth), Result<RunPlanView, Problem>>;

/// Whether a calibration becomes warm on its way.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Warmth {
    Cold,
    Warm,
}

impl Warmth {
    pub(crate) const fn of(warm_up_min: Option<f64>) -> Self {
        match warm_up_min {
            None => Self::Cold,
            Some(_) => Self::Warm,
        }
    }

    /// For however long.
    const fn minutes(self) -> Option<f64> {
        match self {
            Self::Cold => None,
            Self::Warm => Some(1.0),
        }
    }
}

/// What the runs of `group` would do now.
pub(crate) fn plans(machine: &mut Machine, group: &Group) -> Plans {
    let offered = |it: &RunKind| it.is_offered(group);
    let kinds = RunKind::ALL.into_iter().filter(offered);
    let mut plans = Plans::new();
    for kind in kinds {
        for warmth in [Warmth::Cold, Warmth::Warm] {
            let task = Task {
                warm_up_min: warmth.minutes(),
                ..Task::of(kind.stage())
            };
            if group.refuse(&task).is_ok() {
                let planned = group.planned(machine, &task);
                let plan = planned.map(shown).map_err(Problem::from);
                plans.insert((kind, warmth), plan);
            }
        }
    }
    plans
}

pub(super) fn shown(planned: Planned) -> RunPlanView {
    RunPlanView {
        points: planned.points,
        travel: planned.travel.map(|it| match it {
            Travel::Length(it) => Quantity::mm(it),
            Travel::Angle(it) => Quantity::deg(it),
        }),
        seconds_at_least: planned.at_least.as_secs_f64(),
        asks: planned.asks,
        bus_load: planned.bus_load,
        join: None,
        departure: None,
    }
}

/// Which of the runs of `group` go on where they were left.
pub(crate) fn resumed(machine: &Machine, group: &Group) -> Vec<Stage> {
    let offered = group.offered().iter().copied();
    let resumed = offered.filter(|it| group.is_resumed(machine.config(), *it));
    resumed.collect()
}
