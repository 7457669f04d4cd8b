//! Axes that are run together, and which of them a run is for.

use std::sync::Arc;

use machine::Stage;
use truestage::Machine;
use truestage::runs::{Group, GroupMove, Judge, Place};
use units::AxisSpeed;

use super::Keeper;
use super::setup::{Plans, Warmth, plans, resumed};
use crate::problem::{Code, Problem};
use crate::request::RunKind;
use crate::view::RunPlanView;

/// A group, and what its runs would do.
#[derive(Debug)]
pub(crate) struct Grouped {
    pub(super) group: Arc<Group>,
    pub(super) plans: Plans,
    resumed: Vec<Stage>,
    /// The numbers of its axes.
    pub(super) axes: Vec<usize>,
    /// Who judges its moves as one, or why nobody can.
    judge: Option<Result<Judge, Problem>>,
}

impl Grouped {
    /// Whether its run of `kind` goes on where it was left.
    pub(super) fn is_resumed(&self, kind: RunKind) -> bool {
        self.resumed.contains(&kind.stage())
    }

    /// Whether it can be moved so.
    pub(super) fn judge(
        &self,
        machine: &machine::Machine,
        asked: &GroupMove,
    ) -> Result<(), Problem> {
        Ok(self.judged_by()?.judge(machine, asked)?)
    }

    /// Where a jog of `part` at `speed` ends when nobody stops it.
    pub(super) fn end_of_jog(
        &self,
        machine: &machine::Machine,
        part: &str,
        speed: AxisSpeed,
    ) -> Result<Place, Problem> {
        let end = self.judged_by()?.end_of_jog(machine, part, speed)?;
        end.ok_or_else(|| self.not_as_one("jogged"))
    }

    /// Where the encoders have each part that is not an axis by itself.
    pub(super) fn standing(&self, machine: &machine::Machine) -> Vec<(String, Place)> {
        let standing = self.judged_by().ok().map(|it| it.standing(machine));
        standing.and_then(Result::ok).unwrap_or_default()
    }

    fn judged_by(&self) -> Result<&Judge, Problem> {
        let judge = self.judge.as_ref();
        let judge = judge.ok_or_else(|| self.not_as_one("moved"))?;
        judge.as_ref().map_err(Clone::clone)
    }

    fn not_as_one(&self, done: &str) -> Problem {
        let what = format!("{} is not {done} as one", self.group.name);
        Problem::new(Code::NotOffered, what, "move its axes by themselves")
    }
}

impl Keeper {
    /// What is run on `machine`.
    pub(crate) fn add_groups(&mut self, machine: &mut Machine, groups: Vec<Group>) {
        for group in groups {
            let axes = group.axes.iter();
            let axes = axes.filter_map(|it| self.place(it).ok()).collect();
            self.groups.push(Grouped {
                plans: plans(machine, &group),
                resumed: resumed(machine, &group),
                group: Arc::new(group),
                axes,
                judge: None,
            });
        }
    }

    /// What runs would do now: what was measured meanwhile is known.
    pub(crate) fn plan_anew(&mut self, machine: &mut Machine) {
        for grouped in &mut self.groups {
            grouped.plans = plans(machine, &grouped.group);
        }
    }

    /// Moves of the group `name` as one are judged by what is stored now.
    pub(crate) fn set_judge(&mut self, name: &str, judge: Result<Judge, Problem>) {
        let mut groups = self.groups.iter_mut();
        if let Some(grouped) = groups.find(|it| it.group.name == name) {
            grouped.judge = Some(judge);
        }
    }

    /// All groups.
    pub(crate) fn groups(&self) -> Vec<Arc<Group>> {
        let groups = self.groups.iter();
        groups.map(|it| Arc::clone(&it.group)).collect()
    }

    /// The number of the group that a run is for.
    pub(super) fn group_of(&self, asked: Option<&str>) -> Result<usize, Problem> {
        match (asked, self.groups.as_slice()) {
            (None, [_]) => Ok(0),
            (None, groups) => {
                let names: Vec<_> = groups.iter().map(|it| it.group.name.as_str()).collect();
                let what = "the machine has several axes";
                let help = format!("name one in `axis`: {}", names.join(", "));
                Err(Problem::new(Code::BadRequest, what, help))
            }
            (Some(name), groups) => {
                let found = groups.iter().position(|it| it.group.name == name);
                found.map_or_else(|| Err(self.no_group(name)), Ok)
            }
        }
    }

    /// Why `name` is no group: it is in one, or there is no such axis.
    fn no_group(&self, name: &str) -> Problem {
        let at = match self.place(name) {
            Ok(at) => at,
            Err(problem) => return problem,
        };
        let of = self.groups.iter().find(|it| it.axes.contains(&at));
        let (axes, group) = of.map_or((String::new(), ""), |it| {
            (it.group.axes.join(", "), it.group.name.as_str())
        });
        let what = format!("axis {name} is not run by itself, but {axes} together");
        let help = format!("say `axis`: \"{group}\", or leave it out");
        Problem::new(Code::NotOffered, what, help)
    }

    /// What the run of `kind` of group `at` will do; it becomes warm for so long on its way.
    pub(super) fn plan_of(
        &self,
        kind: RunKind,
        warm_up_min: Option<f64>,
        at: usize,
    ) -> Result<RunPlanView, Problem> {
        let grouped = &self.groups[at];
        let plans = &grouped.plans;
        let planned = plans.get(&(kind, Warmth::of(warm_up_min)));
        // What has no use for it is refused in its own words.
        if let Some(plan) = planned.or_else(|| plans.get(&(kind, Warmth::Cold))) {
            let plan = plan.clone()?;
            return Ok(RunPlanView {
                seconds_at_least: plan.seconds_at_least + warm_up_min.unwrap_or_default() * 60.0,
                ..plan
            });
        }
        let offered = RunKind::ALL.into_iter();
        let offered = offered.filter(|it| it.is_offered(&grouped.group));
        let offered: Vec<_> = offered.map(RunKind::word).collect();
        let what = format!("{} has no run `{}`", grouped.group.name, kind.word());
        let help = format!("it has {}", offered.join(", "));
        Err(Problem::new(Code::NotOffered, what, help))
    }
}
