//! Axes that are run together.

use std::path::Path;

use machine::Stage;
use machine::ask_disk;
use machine::records::Store;

use super::choice::{Change, Choice, chosen_among, write};
use super::job::JobJudge;
use super::path::PathJudge;
use super::person::Person;
use super::planned::Planned;
use super::task::{Found, Task, Work};
use super::teller::Teller;
use super::together::{GroupMove, GroupMoved, GroupMoves, Judge, NotMoved, Part};
use crate::bus_plan;
use crate::config::MachineConfig;
use crate::connected::Machine;
use crate::failure::Failure;

/// How the axes of a group are moved outside of runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Moved {
    /// Each by itself, by what corrects it.
    Alone,
    /// Each by itself only uncorrected: what corrects them corrects them together.
    CorrectedTogether,
    /// Never by themselves.
    Together,
}

/// Axes that are zeroed, calibrated and verified together: PLCopen's axes group. Of most machines each axis is one by
/// itself.
#[derive(Clone, Debug)]
pub struct Group {
    /// What it is called: its axis, where it has only one.
    pub name: String,
    /// Its axes.
    pub axes: Vec<String>,
    /// How they are moved.
    pub moved: Moved,
    /// Where it is as one, part by part; nothing of axes that are only moved by themselves.
    pub parts: Vec<Part>,
    /// What the store calls what it uses: its axes, or what its kind keeps of them together.
    pub pointers: Vec<String>,
    /// What its journals are called.
    pub(crate) journals: String,
    /// Which of its runs take files of what was measured or designed elsewhere.
    pub(crate) files: &'static [Stage],
    /// What its kind does for it.
    pub(crate) runs: &'static GroupRuns,
}

/// What a kind runs.
#[derive(Debug)]
pub(crate) struct GroupRuns {
    /// What of a machine it runs as one.
    pub(crate) groups: fn(&MachineConfig) -> Vec<Group>,
    /// Which runs there are.
    pub(crate) offered: &'static [Stage],
    /// Which of them can go on where they were left.
    pub(crate) resumed: fn(&MachineConfig, &str, Stage) -> bool,
    /// For how many minutes a run with this journal was to let its axes become warm.
    pub(crate) warm_up_min: fn(journal: &Path) -> Option<f64>,
    /// Options that it has no use for.
    pub(crate) refuse: fn(&Task) -> Result<(), Failure>,
    /// What a run of this group will do.
    pub(crate) planned: fn(&mut Machine, &str, &Task) -> Result<Planned, Failure>,
    /// Does it.
    pub(crate) perform: fn(Work<'_>, &str, &Task) -> Result<Found, Failure>,
    /// Whether its drives are on meanwhile; a person who turns a table by hand has them off.
    pub(crate) is_driven: fn(&MachineConfig, &str) -> bool,
    /// Uses the active calibration of each of its axes: the axis, and its calibration.
    pub(crate) load: fn(&mut Machine, &Store, &str) -> Result<InUse, Failure>,
    /// What else is used otherwise when these are: what counts from them.
    pub(crate) with_companions: fn(&Store, Vec<Change>) -> Result<Vec<Change>, Failure>,
    /// Whether this machine can use these, together with the others in use.
    pub(crate) usable: fn(&mut Machine, &Store, &[Change]) -> Result<(), Failure>,
    /// Who judges paths that it follows, where it follows some.
    pub(crate) paths: Option<MakesPathJudge>,
    /// Who judges jobs that its axes do, where they do some.
    pub(crate) jobs: Option<MakesJobJudge>,
    /// How it is moved as one, where it is.
    pub(crate) moves: Option<&'static GroupMoves>,
    /// What it works without, too, as the store calls it.
    pub(crate) forgets: &'static [&'static str],
}

/// Makes who judges paths.
pub(crate) type MakesPathJudge = fn(&mut Machine) -> Result<PathJudge, Failure>;

/// Makes who judges jobs.
pub(crate) type MakesJobJudge = fn(&Machine) -> JobJudge;

/// Which calibration each axis uses.
pub(crate) type InUse = Vec<(String, Option<String>)>;

impl Group {
    /// One axis by itself.
    pub(crate) fn of_one(axis: &str, runs: &'static GroupRuns) -> Self {
        Self {
            name: axis.to_owned(),
            axes: vec![axis.to_owned()],
            moved: Moved::Alone,
            parts: Vec::new(),
            pointers: vec![axis.to_owned()],
            journals: axis.to_owned(),
            files: &[],
            runs,
        }
    }

    /// Which runs it has.
    pub const fn offered(&self) -> &'static [Stage] {
        self.runs.offered
    }

    /// What its journals are called.
    pub fn journals(&self) -> &str {
        &self.journals
    }

    /// Whether a run of it can go on where it was left.
    pub fn is_resumed(&self, config: &MachineConfig, stage: Stage) -> bool {
        (self.runs.resumed)(config, &self.name, stage)
    }

    /// For how many minutes a run that left `journal` was to let its axes become warm; `None` where it was not.
    pub fn warm_up_min(&self, journal: &Path) -> Option<f64> {
        (self.runs.warm_up_min)(journal)
    }

    /// Refuses options that a run of it has no use for.
    ///
    /// # Errors
    /// When `task` has one.
    pub fn refuse(&self, task: &Task) -> Result<(), Failure> {
        task.refuse_of_calibrations()?;
        self.refuse_files(task)?;
        (self.runs.refuse)(task)
    }

    fn refuse_files(&self, task: &Task) -> Result<(), Failure> {
        if task.is_driven() || self.files.contains(&task.stage) {
            return Ok(());
        }
        Err(Failure::Usage {
            what: format!(
                "`files`, and {} measures itself for a run of this kind",
                self.name
            ),
            help: "leave them out".into(),
        })
    }

    /// What a run of it will do.
    ///
    /// # Errors
    /// When it is not configured.
    pub fn planned(&self, machine: &mut Machine, task: &Task) -> Result<Planned, Failure> {
        let planned = (self.runs.planned)(machine, &self.name, task)?;
        Ok(Planned {
            bus_load: bus_plan::loads(machine.config()),
            ..planned
        })
    }

    /// Does what `task` says. `person` does what has to be done by hand, and `teller` says what came of it.
    ///
    /// # Errors
    /// Those of the procedure.
    pub fn perform(
        &self,
        machine: &mut Machine,
        store: &Store,
        task: &Task,
        person: &mut dyn Person,
        teller: Option<&Teller>,
    ) -> Result<Found, Failure> {
        if self.needs_power(machine, task) {
            self.axes.iter().try_for_each(|it| machine.enable(it))?;
        }
        let work = Work {
            machine,
            store,
            person,
            teller,
        };
        let mut found = (self.runs.perform)(work, &self.name, task)?;
        if let Some(then) = task.then() {
            let work = Work {
                machine,
                store,
                person,
                teller,
            };
            match (self.runs.perform)(work, &self.name, &then) {
                Ok(verified) => found.verified(verified),
                // What was stored is told, and why it is not verified, or not used.
                Err(failure) => found.bad = Some(failure),
            }
        }
        // Of files no device has counted anything.
        if let (Some(told), Some(teller), true) = (&mut found.told, teller, task.is_driven()) {
            told.value["counters"] = (teller.counters)(machine);
        }
        Ok(found)
    }

    /// A zero switches on what it needs itself.
    fn needs_power(&self, machine: &Machine, task: &Task) -> bool {
        let is_zero = task.stage == Stage::Zero;
        !is_zero && task.is_driven() && (self.runs.is_driven)(&machine.config, &self.name)
    }

    /// Uses the active calibration of each of its axes from now on, and says which that is.
    ///
    /// # Errors
    /// When one does not belong to this machine, or cannot be used.
    pub fn load(
        &self,
        machine: &mut Machine,
        store: &Store,
    ) -> Result<Vec<(String, Option<String>)>, Failure> {
        (self.runs.load)(machine, store, &self.name)
    }

    /// Whether `name` is what the store calls something that it uses, or it itself.
    pub(crate) fn is_about(&self, name: &str) -> bool {
        self.name == name || self.pointers.iter().any(|it| it == name)
    }

    /// The one of `groups` whose calibrations `choice` is about.
    ///
    /// # Errors
    /// When there is none, or no such calibration.
    pub fn chosen<'g>(
        groups: &'g [Self],
        store: &Store,
        choice: &Choice,
    ) -> Result<&'g Self, Failure> {
        let of = choice.of(store)?;
        let found = groups.iter().find(|it| it.is_about(&of));
        found.ok_or_else(|| {
            let known = groups.iter().flat_map(|it| it.pointers.iter().cloned());
            let known: Vec<_> = known.collect();
            Failure::Machine(machine::Failure::NoSuchAxis {
                axis: of,
                known: known.join(", "),
            })
        })
    }

    /// What `choice` changes of what it uses. Nothing is written.
    ///
    /// # Errors
    /// When there is no such calibration, none before, or it does not go with the others in use.
    pub(crate) fn changes(&self, store: &Store, choice: &Choice) -> Result<Vec<Change>, Failure> {
        let chosen = chosen_among(&self.pointers, store, choice)?;
        if let Choice::Clear(name) = choice {
            // What counted from it stays: whoever wants it no longer either says so.
            return self.require_does_without(name).map(|()| chosen);
        }
        (self.runs.with_companions)(store, chosen)
    }

    fn require_does_without(&self, name: &str) -> Result<(), Failure> {
        if self.runs.forgets.contains(&name) {
            return Ok(());
        }
        Err(Failure::Usage {
            what: format!("{name} is no state that was kept on purpose, and is not forgotten"),
            help: match self.runs.forgets {
                [] => "go back to the one before it: `cal rollback`".into(),
                all => format!("clear one of {}", all.join(", ")),
            },
        })
    }

    /// Uses what `choice` says from now on, now and after the next start; says what that changed. Nothing moves: the
    /// next move is corrected by it, from where the axes stand.
    ///
    /// # Errors
    /// When it cannot be used on this machine, or not with the others in use; what was used before is used still.
    pub fn choose(
        &self,
        machine: &mut Machine,
        store: &Store,
        choice: &Choice,
    ) -> Result<Vec<Change>, Failure> {
        let (group, wanted) = (self.clone(), choice.clone());
        let changes = ask_disk(machine, store, move |store| {
            let changes = group.changes(store, &wanted)?;
            store.hold_calibrations(changes.iter().filter_map(|change| change.id.as_deref()));
            Ok::<_, Failure>(changes)
        })??;
        // Without what is cleared the others may be of no use: that is said when they are loaded.
        let is_loaded = !matches!(choice, Choice::Clear(_));
        if is_loaded {
            (self.runs.usable)(machine, store, &changes)?;
        }
        let written = changes.clone();
        ask_disk(machine, store, move |store| write(store, &written))??;
        if is_loaded {
            self.load(machine, store)?;
        }
        Ok(changes)
    }

    /// Who judges paths that it follows; `None` where it follows none.
    ///
    /// # Errors
    /// When its axes are not made for it.
    pub fn path_judge(&self, machine: &mut Machine) -> Result<Option<PathJudge>, Failure> {
        self.runs.paths.map(|it| it(machine)).transpose()
    }

    /// Whether it follows paths.
    pub const fn follows_paths(&self) -> bool {
        self.runs.paths.is_some()
    }

    /// Who judges jobs that its axes do; `None` where they do none.
    pub fn job_judge(&self, machine: &Machine) -> Option<JobJudge> {
        self.runs.jobs.map(|it| it(machine))
    }

    /// Whether its axes do jobs.
    pub const fn does_jobs(&self) -> bool {
        self.runs.jobs.is_some()
    }

    fn moves(&self) -> Result<&'static GroupMoves, Failure> {
        self.runs.moves.ok_or_else(|| Failure::Usage {
            what: format!("{} is not moved as one", self.name),
            help: "move its axes by themselves".into(),
        })
    }

    /// Who judges its moves as one, by the calibrations that are in use now.
    ///
    /// # Errors
    /// When it is not moved as one, or a calibration cannot be read.
    pub fn judge(&self, machine: &mut Machine, store: &Store) -> Result<Judge, Failure> {
        (self.moves()?.judge)(machine, store)
    }

    /// Moves it as one, and says what that came to once anything may have been sent.
    ///
    /// # Errors
    /// What failed before anything was sent to an axis: all of them are as they were, and supervised. Those of the
    /// procedure later are in what is returned.
    pub fn move_to(
        &self,
        machine: &mut Machine,
        store: &Store,
        asked: &GroupMove,
        teller: Option<&Teller>,
    ) -> Result<Result<GroupMoved, Failure>, Failure> {
        let mut moved = match (self.moves()?.perform)(machine, store, asked, teller) {
            Ok(moved) => moved,
            Err(NotMoved::Before(failure)) => return Err(failure),
            Err(NotMoved::UnderWay(failure)) => return Ok(Err(failure)),
        };
        if let (Some(told), Some(teller)) = (&mut moved.told, teller) {
            told.value["counters"] = (teller.counters)(machine);
        }
        Ok(Ok(moved))
    }
}
