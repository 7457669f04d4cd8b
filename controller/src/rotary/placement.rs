//! One placement of a plate: asked for, read in both directions, and looked at again.

use core::f64::consts::TAU;
use core::time::Duration;
use std::collections::BTreeMap;

use compensator::uncertainty::{mean, median, robust_sigma, standard_deviation};
use units::{Approach, Radians, RadiansPerSecond};

use crate::failure::Failure;
use crate::rotary::RotaryCalibrateConfig;
use crate::rotary::failure::RotaryFailure;
use crate::rotary::operator::{Operator, PlateMove, PlateTask};
use crate::rotary::table::RotaryTable;
use crate::rotary::{PlacementEntry, PlatePlanEntry, SweepEntry};
use crate::rotary::{PlateEntry, PlateLog};
use crate::rotary::{Sweep, SweepOptions};
use crate::run::missing;
use crate::store::Journal;
use machine::Stage;

/// How long the machine lives between two looks at the person.
const LOOK_EVERY: Duration = Duration::from_millis(50);
/// Of the lines of a plate so many may be missing in a pass.
const MISSING_SHARE: f64 = 0.25;
/// The same where a busy computer lost them: other lines in every pass, so that others have them.
const UNREAD_SHARE: f64 = 0.5;
/// How often a pass is made again that lost its lines to a busy computer.
const AGAIN_MAX: u32 = 3;
/// The parts of a turn in which a plate may have moved.
const SECTORS: usize = 8;
/// A part has at least so many lines, where there are as many.
const SECTOR_LINES: usize = 8;
/// From how many standard deviations on a difference of two passes is no noise.
const WILD: f64 = 5.0;
/// So many neighbours on each side say whether a line that differs is dirty or the plate has moved.
const NEIGHBOURS: usize = 2;
/// So many lines are named in a warning.
const NAMED: usize = 6;

/// How a plate is read.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct PlateRun {
    pub(super) plate: String,
    pub(super) lines: u32,
    pub(super) passes: u32,
    pub(super) speed: RadiansPerSecond,
    /// Standard deviation of one line in one pass, as it is stated.
    pub(super) noise: Radians,
    /// `None`: a plate that moved is accepted.
    pub(super) closure_limit: Option<Radians>,
    pub(super) stage: Stage,
}

impl PlateRun {
    pub(super) fn spacing(&self) -> f64 {
        TAU / f64::from(self.lines)
    }

    pub(super) fn plan(&self, offsets: Vec<f64>) -> PlatePlanEntry {
        PlatePlanEntry {
            plate: self.plate.clone(),
            lines: self.lines,
            offsets,
            passes: self.passes,
            speed_rad_per_s: self.speed.value(),
        }
    }

    /// Standard deviation of a reading that is the mean of passes in both directions.
    pub(super) fn noise_of_mean(&self) -> Radians {
        self.noise / (2.0 * f64::from(self.passes)).sqrt()
    }

    /// Passes of one placement, the repeated one included.
    pub(super) const fn sweeps(&self) -> u32 {
        2 * self.passes + 1
    }
}

/// What was read in one placement. Lists count table positions.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Placed {
    pub(super) offset: f64,
    /// Mean of both directions, in which what the detector is late by cancels; of one, less what it
    /// is late by on the others; `None` where a line was not read.
    pub(super) deviations: Vec<Option<Radians>>,
    /// Standard deviation of one line in one pass, by what the directions differ.
    pub(super) scatter: Option<Radians>,
    pub(super) closure: Radians,
    /// Where a plate at offset 0 would have its lines, from the table positions.
    pub(super) phase: Radians,
}

impl Placed {
    /// What `sweeps` of one placement, `passes` in each direction, say.
    pub(crate) fn of(placement: &PlacementEntry, sweeps: &[SweepEntry], passes: u32) -> Self {
        let own = |approach: char, passes: core::ops::RangeInclusive<u32>| {
            let own = sweeps.iter().filter(|it| it.offset == placement.offset);
            let own = own.filter(|it| it.approach == approach && passes.contains(&it.pass));
            mean_of(own)
        };
        let (mut forward, reverse) = (own('+', 1..=passes), own('-', 1..=passes));
        let both = |forward: &[Option<f64>]| -> Vec<f64> {
            let pairs = forward.iter().zip(&reverse);
            pairs.filter_map(|(f, r)| Some((*f)? - (*r)?)).collect()
        };
        let apart = both(&forward);
        let late = median(&apart).unwrap_or(0.0) / 2.0;
        let scatter = scatter_of(apart).map(|it| it * (f64::from(passes) / 2.0).sqrt());
        // A line that was missed may have been read in the repeated pass, or in one direction only.
        let again = own('+', passes + 1..=passes + 1);
        for (first, again) in forward.iter_mut().zip(again) {
            *first = first.or(again);
        }
        let pairs = forward.iter().zip(&reverse);
        let deviations = pairs.map(|(forward, reverse)| match (forward, reverse) {
            (Some(forward), Some(reverse)) => Some(Radians((forward + reverse) / 2.0)),
            (Some(forward), None) => Some(Radians(forward - late)),
            (None, Some(reverse)) => Some(Radians(reverse + late)),
            (None, None) => None,
        });
        let spacing = TAU / reverse.len().max(1) as f64;
        let first = sweeps.iter().find(|it| it.offset == placement.offset);
        let phase = first.map_or(0.0, |it| it.phase_rad - it.offset.fract() * spacing);
        Self {
            offset: placement.offset,
            deviations: deviations.collect(),
            scatter: scatter.map(Radians),
            closure: Radians(placement.closure_rad),
            phase: Radians(phase),
        }
    }

    /// By line of the plate: line n is read at position n + offset, its whole part.
    pub(super) fn by_line(&self) -> Vec<Option<Radians>> {
        let mut readings = self.deviations.clone();
        let whole = self.offset.floor() as usize % readings.len().max(1);
        readings.rotate_left(whole);
        readings
    }
}

/// By how much the plate moved in the worst placement.
pub(crate) fn largest_closure(closures: impl Iterator<Item = Radians>) -> Radians {
    closures.map(Radians::abs).fold(Radians::ZERO, Radians::max)
}

/// The standard deviation of values of which some are wild.
fn scatter_of(mut values: Vec<f64>) -> Option<f64> {
    let middle = median(&values)?;
    values.iter_mut().for_each(|it| *it -= middle);
    // The median of a coarse encoder's counts is coarse itself: it only tells what is wild.
    let wild = WILD * robust_sigma(&values)?;
    values.retain(|it| it.abs() <= wild);
    standard_deviation(&values)
}

fn mean_of<'a>(sweeps: impl Iterator<Item = &'a SweepEntry>) -> Vec<Option<f64>> {
    let mut sums: Vec<(f64, u32)> = Vec::new();
    for sweep in sweeps {
        sums.resize(sweep.deviations_rad.len(), (0.0, 0));
        for (sum, value) in sums.iter_mut().zip(&sweep.deviations_rad) {
            if let Some(value) = value {
                *sum = (sum.0 + value, sum.1 + 1);
            }
        }
    }
    let mean = |(sum, count): (f64, u32)| (count > 0).then(|| sum / f64::from(count));
    sums.into_iter().map(mean).collect()
}

/// By how much the second of two equal passes differs from the first: the mean over a part of the
/// turn, of that part where it is largest. A plate that slips in the middle of a pass shows, too:
/// all lines after that differ, whereas a dirty line leaves its neighbours what they are.
fn closure(first: &[Option<f64>], again: &[Option<f64>]) -> f64 {
    let apart: Vec<Option<f64>> = first
        .iter()
        .zip(again)
        .map(|(first, again)| Some((*again)? - (*first)?))
        .collect();
    let apart = without_dirt(&apart);
    let sectors = (apart.len() / SECTOR_LINES).clamp(1, SECTORS);
    let of_sector = |lines: &[Option<f64>]| {
        let seen: Vec<f64> = lines.iter().flatten().copied().collect();
        mean(&seen).unwrap_or(0.0)
    };
    let means = apart.chunks(apart.len().div_ceil(sectors).max(1));
    means
        .map(of_sector)
        .fold(0.0, |a, b| if b.abs() > f64::abs(a) { b } else { a })
}

/// The median of each line and its neighbours, as many at the ends as elsewhere.
fn without_dirt(apart: &[Option<f64>]) -> Vec<Option<f64>> {
    let width = apart.len().min(2 * NEIGHBOURS + 1);
    let middle = |at: usize| {
        let start = at.saturating_sub(NEIGHBOURS).min(apart.len() - width);
        let around = apart[start..start + width].iter().flatten();
        median(&around.copied().collect::<Vec<_>>())
    };
    let each = apart.iter().enumerate();
    each.map(|(at, own)| own.and(middle(at))).collect()
}

impl RotaryTable<'_> {
    /// The plate and how it is read, as configured.
    pub(super) fn plate_run(&self) -> Result<(PlateRun, RotaryCalibrateConfig), Failure> {
        let config = self.config;
        let run = config.calibrate.clone();
        let run = run.ok_or_else(|| missing(self.axis, "calibrate"))?;
        let speed = run.speed_deg_per_s.unwrap_or(config.speed_deg_per_s);
        let plate = PlateRun {
            plate: run.plate.clone(),
            lines: run.lines,
            passes: run.passes,
            speed: RadiansPerSecond(speed.to_radians()),
            noise: Radians::from_arcsec(run.reading_noise_arcsec),
            closure_limit: Some(Radians::from_arcsec(run.closure_limit_arcsec)),
            stage: Stage::Calibrate,
        };
        Ok((plate, run))
    }

    /// Has the plate brought to `offset`; the axis is off while somebody has his hands in. `known` is
    /// an offset at which it lay before, in the same run or in that of the calibration; `None` where
    /// this is the placement that all others are counted from.
    pub(super) fn place_plate(
        &mut self,
        run: &PlateRun,
        offset: f64,
        step: (usize, usize),
        known: Option<f64>,
        operator: &mut dyn Operator,
    ) -> Result<(), Failure> {
        self.rest()?;
        self.core.disable(self.axis)?;
        let lies_at = self.memory.plate_at.take();
        operator.ask(&PlateTask {
            axis: self.axis.to_owned(),
            plate: run.plate.clone(),
            lines: run.lines,
            step,
            offset,
            by: match (known, lies_at) {
                (None, _) => PlateMove::Fix,
                (Some(_), Some(here)) => PlateMove::TurnBy(offset - here),
                (Some(known), None) => PlateMove::TurnFrom {
                    offset: known,
                    lines: offset - known,
                },
            },
        })?;
        while !operator.is_done()? {
            let look = self.core.now() + LOOK_EVERY;
            self.core.tick(look)?;
        }
        Ok(self.core.enable(self.axis)?)
    }

    /// Reads the plate as it lies, `done` passes of `total` being read already. `phase` is that of
    /// the placement which all others are counted from: somebody fixed it anywhere within a line
    /// spacing, and every further one is off by about as much. `None` for that placement itself.
    pub(super) fn read_placement(
        &mut self,
        run: &PlateRun,
        (offset, phase): (f64, Option<Radians>),
        (done, total): (u32, u32),
        journal: &mut Journal<PlateLog>,
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
            journal.write(&PlateEntry::Sweep(entry.clone()))?;
            sweeps.push(entry);
            let done = u64::from(done + number + 1);
            let observer = self.core.observer();
            observer.progress(run.stage, self.axis, done, total.into());
        }
        self.warn_of_lines(&sweeps);
        let placement = self.closed(run, offset, &sweeps)?;
        journal.write(&PlateEntry::Placed(placement))?;
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
                "axis {}: {} of {lines} lines were overwritten before they were read; the pass is \
                 made again",
                self.axis,
                sweep.overwritten.len()
            ));
        }
    }

    fn closed(
        &self,
        run: &PlateRun,
        offset: f64,
        sweeps: &[SweepEntry],
    ) -> Result<PlacementEntry, RotaryFailure> {
        let (first, again) = (&sweeps[0], &sweeps[sweeps.len() - 1]);
        let closure_rad = closure(&first.deviations_rad, &again.deviations_rad);
        let placement = PlacementEntry {
            offset,
            closure_rad,
            at_s: self.core.now().seconds(),
        };
        let seen = Radians(closure_rad);
        match run.closure_limit {
            Some(limit) if seen.abs() > limit => Err(RotaryFailure::Slipped {
                axis: self.axis.to_owned(),
                offset,
                seen,
                limit,
            }),
            _ => Ok(placement),
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
                "seen twice (a scratch?): {}",
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
            say(format!(
                "overwritten unread in every pass (a scratch?): {names}"
            ));
        }
        if unread > 0 {
            say(format!(
                "{unread} of {total} readings were overwritten before they were read: the computer is \
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

#[cfg(test)]
mod tests {
    use super::*;

    fn sweep(pass: u32, approach: char, values: &[Option<f64>]) -> SweepEntry {
        SweepEntry {
            offset: 2.0,
            pass,
            approach,
            deviations_rad: values.to_vec(),
            ..SweepEntry::default()
        }
    }

    #[test]
    fn what_the_detector_is_late_by_cancels_and_is_known_where_one_direction_is_missing() {
        let sweeps = [
            sweep(1, '+', &[Some(1.5), Some(2.5), None, Some(4.5), None, None]),
            sweep(
                1,
                '-',
                &[Some(0.5), None, Some(2.5), Some(3.5), None, Some(5.5)],
            ),
            sweep(2, '+', &[Some(9.0), None, None, Some(9.0), None, Some(6.5)]),
        ];
        let placement = PlacementEntry {
            offset: 2.0,
            closure_rad: 0.0,
            at_s: 0.0,
        };
        let placed = Placed::of(&placement, &sweeps, 1);
        let some = |value| Some(Radians(value));
        let expected = [some(1.0), some(2.0), some(3.0), some(4.0), None, some(6.0)];
        assert_eq!(placed.deviations, expected);
        let turned = [some(3.0), some(4.0), None, some(6.0), some(1.0), some(2.0)];
        assert_eq!(placed.by_line(), turned);
    }

    #[test]
    fn a_slip_within_the_last_lines_of_a_pass_shows() {
        let first: Vec<Option<f64>> = (0..360)
            .map(|at| Some(if at < 350 { 1.0 } else { 6.0 }))
            .collect();
        let again = vec![Some(6.0); 360];
        assert!((closure(&first, &again) - 5.0).abs() < 1e-12);
        let late: Vec<Option<f64>> = (0..360)
            .map(|at| Some(if at < 350 { 1.0 } else { 6.0 }))
            .collect();
        let closed = closure(&vec![Some(1.0); 360], &late);
        assert!((closed - 5.0 * 10.0 / 45.0).abs() < 1e-12, "{closed}");
        assert_eq!(closure(&first, &first), 0.0);
    }

    #[test]
    fn one_dirty_line_is_no_plate_that_moved() {
        let clean = vec![Some(1.0); 36];
        for dirty in 0..36 {
            let mut again = clean.clone();
            again[dirty] = Some(1001.0);
            assert_eq!(closure(&clean, &again), 0.0, "line {dirty}");
            again[(dirty + 1) % 36] = None;
            assert_eq!(closure(&clean, &again), 0.0, "line {dirty}");
        }
        let slipped: Vec<Option<f64>> = (0..36)
            .map(|at| Some(if at < 33 { 1.0 } else { 9.0 }))
            .collect();
        assert!(closure(&clean, &slipped) > 2.0);
    }
}
