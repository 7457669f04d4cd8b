//! One placement of a plate: asked for, read in both directions, and looked at again.

use core::time::Duration;
use std::collections::BTreeMap;

use units::{Approach, Radians};

use crate::failure::Failure;
use crate::rotary::PlateEntry;
use crate::rotary::SweepEntry;
use crate::rotary::failure::RotaryFailure;
use crate::rotary::operator::Operator;
use crate::rotary::placed::{Placed, closed};
use crate::rotary::plate_journal::PlateJournal;
use crate::rotary::plate_run::{DuePlacement, PlateRun};
use crate::rotary::table::RotaryTable;
use crate::rotary::{Sweep, SweepOptions};

/// How long the machine lives between two looks at the person.
pub(super) const LOOK_EVERY: Duration = Duration::from_millis(50);
/// Of the lines of a plate so many may be missing in a pass.
const MISSING_SHARE: f64 = 0.25;
/// The same where a busy computer lost them: other lines in every pass, so that others have them.
const UNREAD_SHARE: f64 = 0.5;
/// How often a pass is made again that lost its lines to a busy computer.
const AGAIN_MAX: u32 = 3;
/// So many lines are named in a warning.
const NAMED: usize = 6;

impl RotaryTable<'_> {
    /// Has the plate brought where it is `due`; the axis is off while somebody has his hands in.
    pub(super) fn place_plate(
        &mut self,
        run: &PlateRun,
        due: &DuePlacement,
        operator: &mut dyn Operator,
    ) -> Result<(), Failure> {
        self.rest()?;
        self.hand_over(run, due, operator)?;
        Ok(self.core.enable(self.axis)?)
    }

    /// The same of a table that whoever brings the plate about turns, too: the axis stays off.
    pub(super) fn hand_over(
        &mut self,
        run: &PlateRun,
        due: &DuePlacement,
        operator: &mut dyn Operator,
    ) -> Result<(), Failure> {
        self.core.disable(self.axis)?;
        let lies_at = self.memory.plate_at.take();
        operator.ask(&run.task(self.axis, due, lies_at))?;
        while !operator.is_done()? {
            let look = self.core.now() + LOOK_EVERY;
            self.core.tick(look)?;
        }
        Ok(())
    }

    /// Reads the plate as it lies, `done` passes of `total` being read already. `phase` is that of
    /// the placement which all others are counted from: somebody fixed it anywhere within a line
    /// spacing, and every further one is off by about as much. `None` for that placement itself.
    pub(super) fn read_placement(
        &mut self,
        run: &PlateRun,
        (offset, phase): (f64, Option<Radians>),
        (done, total): (u32, u32),
        journal: &mut PlateJournal,
    ) -> Result<Placed, Failure> {
        let of_part = offset.fract() * run.spacing();
        let mut phase = match phase {
            Some(phase) => Some(phase.value() + of_part),
            None => Some(of_part).filter(|it| *it != 0.0),
        };
        let mut sweeps: Vec<SweepEntry> = Vec::new();
        for number in 0..run.sweeps() {
            let approach = if number % 2 == 0 {
                Approach::Forward
            } else {
                Approach::Reverse
            };
            let options = SweepOptions {
                lines: run.lines,
                approach,
                speed: Some(run.speed),
                phase: phase.map(Radians),
            };
            let sweep = self.full_sweep(&options)?;
            // A placement lies somewhere; its passes must agree about where.
            phase = phase.or(Some(sweep.phase.value()));
            let entry = entry_of(
                &sweep,
                offset,
                number / 2 + 1,
                approach,
                self.core.now().seconds(),
            );
            journal.write(PlateEntry::Sweep(entry.clone()))?;
            sweeps.push(entry);
            let done = u64::from(done + number + 1);
            let observer = self.core.observer();
            observer.progress(run.stage, self.axis, done, total.into());
        }
        self.warn_of_lines(&sweeps);
        let at_s = self.core.now().seconds();
        let placement = closed(self.axis, run, (offset, at_s), &sweeps)?;
        journal.write(PlateEntry::Placed(placement))?;
        journal.flush_to_disk()?;
        self.memory.plate_at = Some(offset);
        Ok(Placed::of(&placement, &sweeps, run.passes))
    }

    /// A pass in which most lines were read. One that a busy computer spoilt is made again; dirt
    /// would only be the same again.
    fn full_sweep(&mut self, options: &SweepOptions) -> Result<Sweep, Failure> {
        let lines = options.lines;
        let mut again = 0;
        loop {
            let sweep = self.sweep(options)?;
            let seen = sweep.read();
            let busy = sweep.overwritten.len() > sweep.missing.len();
            let share = if busy { UNREAD_SHARE } else { MISSING_SHARE };
            let wanted = (f64::from(lines) * (1.0 - share)).ceil() as usize;
            if seen >= wanted {
                return Ok(sweep);
            }
            if !busy || again == AGAIN_MAX {
                return Err(RotaryFailure::TooFewLines {
                    axis: self.axis.to_owned(),
                    seen,
                    wanted,
                    overwritten: if busy { sweep.overwritten.len() } else { 0 },
                    lines,
                }
                .into());
            }
            again += 1;
            self.core.observer().warning(&format!(
                "axis {}: {} of {lines} lines were lost before they were read; the pass is \
                 made again",
                self.axis,
                sweep.overwritten.len()
            ));
        }
    }

    /// Lines that were not read are no reason to stop, but to clean the plate.
    fn warn_of_lines(&mut self, sweeps: &[SweepEntry]) {
        let axis = self.axis;
        let first = &sweeps[0];
        let seldom = |list: fn(&SweepEntry) -> &Vec<u32>, times: usize| {
            let mut counts = BTreeMap::new();
            for position in sweeps.iter().flat_map(list) {
                *counts.entry(*position).or_insert(0_usize) += 1;
            }
            counts.retain(|_, count| *count >= times);
            counts.into_keys().collect::<Vec<_>>()
        };
        let mut say = |text: String| {
            let text = format!("axis {axis}, plate at offset {}: {text}", first.offset);
            self.core.observer().warning(&text);
        };
        let unseen = seldom(|it| &it.missing, sweeps.len());
        if !unseen.is_empty() {
            say(format!("not seen (dirt?): {}", names(first, &unseen)));
        }
        let doubled = seldom(|it| &it.doubled, 1);
        if !doubled.is_empty() {
            say(format!(
                "seen twice, or too wide (a scratch?): {}",
                names(first, &doubled)
            ));
        }
        let again = seldom(|it| &it.overwritten, sweeps.len());
        let unread: usize = sweeps.iter().map(|it| it.overwritten.len()).sum();
        let unread = unread - again.len() * sweeps.len();
        let total = first.deviations_rad.len() * sweeps.len();
        // Of many lost by chance, some are lost in every pass by chance.
        if !again.is_empty() && unread * 20 < total {
            let names = names(first, &again);
            say(format!("lost unread in every pass (a scratch?): {names}"));
        }
        if unread > 0 {
            say(format!(
                "{unread} of {total} readings were lost before they were read: the computer is \
                 busy, or the table too fast"
            ));
        }
        let strays: Vec<f64> = sweeps
            .iter()
            .flat_map(|it| &it.strays_rad)
            .copied()
            .collect();
        if let Some(stray) = strays.first() {
            let (count, degrees) = (strays.len(), stray.to_degrees());
            say(format!(
                "{count} edge(s) where there is no line, one at {degrees:.4}°"
            ));
        }
    }
}

/// Table positions as lines of the plate; of many, the first.
fn names(sweep: &SweepEntry, positions: &[u32]) -> String {
    let lines = sweep.deviations_rad.len().max(1) as i64;
    let whole = sweep.offset.floor() as i64;
    let name = |position: &u32| (i64::from(*position) - whole).rem_euclid(lines).to_string();
    let mut named: Vec<String> = positions.iter().take(NAMED).map(name).collect();
    if positions.len() > NAMED {
        named.push(format!("and {} more", positions.len() - NAMED));
    }
    format!("line {}", named.join(", "))
}

fn entry_of(sweep: &Sweep, offset: f64, pass: u32, approach: Approach, at_s: f64) -> SweepEntry {
    let value = |it: &Option<Radians>| it.map(Radians::value);
    SweepEntry {
        offset,
        pass,
        approach: approach.symbol(),
        phase_rad: sweep.phase.value(),
        deviations_rad: sweep.deviations.iter().map(value).collect(),
        missing: sweep.missing.clone(),
        doubled: sweep.doubled.clone(),
        overwritten: sweep.overwritten.clone(),
        strays_rad: sweep.strays.iter().map(|it| it.value()).collect(),
        at_s,
    }
}
