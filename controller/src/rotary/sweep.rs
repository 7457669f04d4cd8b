//! One turn of a rotary axis over the lines of a plate: where each line was read.
//!
//! The drive latches its position at every line (its touch probe), or a detector's voltage is sampled with the
//! position (`signal`); nothing here depends on when a frame comes. Lines are told apart by where they are: each
//! belongs to the nearest of `lines` equally spaced table positions, counted from the angle (the phase) that the lines
//! have in common. Lines must therefore be off by less than a quarter of their spacing.

use core::f64::consts::TAU;
use core::time::Duration;
use std::collections::BTreeSet;

use compensator::rotary::LinesSeen;
use drivers::device::{LatchCommand, Latched, Repeat};
use units::portable::{atan2, cos, sin};
use units::{Approach, Radians, RadiansPerSecond};

use crate::failure::Failure;
use crate::rotary::LineSignalConfig;
use crate::rotary::failure::RotaryFailure;
use crate::rotary::line_speed::SPACING_SHARE;
use crate::rotary::table::RotaryTable;
use crate::rotary::turn::Way;

/// So much of the spacing beside its place a line may be.
const LINE_SHARE: f64 = 0.25;
/// How long the axis runs at its speed before the first line counts, and after the last.
const STEADY: Duration = Duration::from_millis(300);
/// How long the axis stands before the probe is armed.
const REST: Duration = Duration::from_millis(50);
/// The longest a sweep may take beyond twice what its speed says.
const SWEEP_LIMIT: Duration = Duration::from_secs(10);
/// The longest it may take to come to rest.
const REST_LIMIT: Duration = Duration::from_secs(3);

/// How a plate is read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SweepOptions {
    /// How many lines the plate has.
    pub lines: u32,
    /// The direction of the turn.
    pub approach: Approach,
    /// `None`: the axis's own speed.
    pub speed: Option<RadiansPerSecond>,
    /// The phase of an earlier sweep of the same run. Without it the phase is taken to be less
    /// than half a spacing; with it, to be less than half a spacing from that one.
    pub phase: Option<Radians>,
}

/// One turn over all lines. Lists have one value for each table position, counted in line
/// spacings from the axis's zero.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sweep {
    /// Reading minus nominal: `None` where no single line was read.
    pub deviations: Vec<Option<Radians>>,
    /// What the deviations have in common, roughly.
    pub phase: Radians,
    /// Positions at which no line was seen: smudged?
    pub missing: Vec<u32>,
    /// Positions at which more than one edge came, or a pulse that is too wide for one line: scratched?
    pub doubled: Vec<u32>,
    /// Positions at which an edge was, or may have been, overwritten before it was read, or samples of a voltage were
    /// lost.
    pub overwritten: Vec<u32>,
    /// Readings that are near no line.
    pub strays: Vec<Radians>,
}

impl Sweep {
    /// How many lines were read.
    pub fn read(&self) -> usize {
        self.deviations.iter().flatten().count()
    }
}

/// A turn over all lines.
#[derive(Clone, Copy, Debug)]
pub(super) struct Turn {
    pub(super) target: Radians,
    pub(super) speed: RadiansPerSecond,
    /// How long it may take.
    pub(super) limit: Duration,
}

/// Where a detector saw something.
#[derive(Clone, Copy, Debug)]
struct LineEdge {
    position: Radians,
    /// So many before it were, or may have been, lost; it may be one of a scratch then.
    missed: u32,
}

impl From<&Latched<Radians>> for LineEdge {
    fn from(latched: &Latched<Radians>) -> Self {
        Self {
            position: latched.position,
            missed: latched.missed,
        }
    }
}

/// What a detector saw in a turn.
#[derive(Clone, Debug, Default)]
struct Passed {
    edges: Vec<LineEdge>,
    /// Of one whose voltage was sampled, besides the lines.
    signal: Option<LinesSeen>,
}

impl From<LinesSeen> for Passed {
    fn from(mut seen: LinesSeen) -> Self {
        let lines = core::mem::take(&mut seen.lines).into_iter();
        let edges = lines.map(|position| LineEdge {
            position,
            missed: 0,
        });
        Self {
            edges: edges.collect(),
            signal: Some(seen),
        }
    }
}

/// The nearest that two lines may be.
fn spacing_min(lines: u32) -> Radians {
    Radians(TAU / f64::from(lines) * SPACING_SHARE)
}

impl RotaryTable<'_> {
    /// Turns the table once over the plate, and a little more on both sides.
    ///
    /// # Errors
    /// Before anything moves: not zeroed, or too fast for each line to be read (the error says
    /// what would fit). Later: whatever stops the machine, and when no line is seen at all.
    pub fn sweep(&mut self, options: &SweepOptions) -> Result<Sweep, Failure> {
        let config = self.config;
        let usual = RadiansPerSecond(config.speed_deg_per_s.to_radians());
        let acceleration = config.acceleration_deg_per_s2.to_radians();
        let speed = options.speed.unwrap_or(usual);
        let steady = speed.value() * (speed.value() / (2.0 * acceleration) + STEADY.as_secs_f64());
        let signal = config.line_signal.as_ref();
        let of_signal = signal.map_or(Radians::ZERO, |it| it.run_up(self, speed));
        let run_up = steady + of_signal.value();
        let sign = options.approach.sign();
        if let Some(signal) = signal {
            self.check_sampling(signal, speed)?;
        } else {
            let spacing = spacing_min(options.lines);
            let table = self.core.turning(self.axis)?;
            table.check_latch_speed(spacing, speed)?;
        }
        let start = self.turn_to(Radians(-sign * run_up), Way::Shortest)?;
        self.rest()?;
        let first = start + Radians(sign * run_up);
        let way = TAU + 2.0 * run_up;
        let turn = Turn {
            target: start + Radians(sign * way),
            speed,
            limit: SWEEP_LIMIT + Duration::from_secs_f64(2.0 * way / speed.value()),
        };
        let passed = match signal {
            Some(signal) => self.scan(signal, &turn, options.lines)?.into(),
            None => Passed {
                edges: self.latch_lines(&turn, options.lines)?,
                signal: None,
            },
        };
        Ok(assign(&passed, first, options))
    }

    fn check_sampling(
        &self,
        signal: &LineSignalConfig,
        speed: RadiansPerSecond,
    ) -> Result<(), Failure> {
        let most = signal.speed_max(self.core.config, self.config);
        // What a file says in degrees comes back from radians a rounding larger.
        match most.filter(|most| speed.value().to_degrees() > most * (1.0 + 1e-9)) {
            None => Ok(()),
            Some(most_deg_per_s) => Err(RotaryFailure::TooFast {
                axis: self.axis.to_owned(),
                seen_deg_per_s: speed.value().to_degrees(),
                most_deg_per_s,
            }
            .into()),
        }
    }

    /// What the touch probe latches in a turn.
    fn latch_lines(&mut self, turn: &Turn, lines: u32) -> Result<Vec<LineEdge>, Failure> {
        let (repeat, spacing) = (Repeat::Continuous, spacing_min(lines));
        self.core
            .turning(self.axis)?
            .latch(LatchCommand::Arm { repeat, spacing })?;
        self.turn(turn.target, turn.speed, turn.limit)?;
        self.rest()?;
        self.core.turning(self.axis)?.latch(LatchCommand::Disarm)?;
        let latched = self.core.turning(self.axis)?.take_latched();
        if latched.is_empty() {
            let axis = self.axis.to_owned();
            return Err(RotaryFailure::NoLines { axis, lines }.into());
        }
        Ok(latched.iter().map(LineEdge::from).collect())
    }

    /// Waits until the rotary axis has stood without a break, by samples that were taken since:
    /// the host's clock alone would count old ones.
    pub(crate) fn rest(&mut self) -> Result<(), Failure> {
        let limit = self.core.patience().of(REST_LIMIT);
        let start = self.core.now();
        let mut first = None;
        loop {
            let reading = self.core.devices().rotary_reading(self.axis)?;
            match reading.filter(|it| it.standing && it.at > start) {
                Some(reading) => {
                    let since = *first.get_or_insert(reading.at);
                    if reading.at.since(since) >= REST {
                        return Ok(());
                    }
                }
                None => first = None,
            }
            let now = self.core.now();
            if now.since(start) > limit {
                return Err(Failure::Machine(machine::Failure::Overdue {
                    device: self.axis.to_owned(),
                    step: "standing still",
                    waited: limit,
                }));
            }
            self.core.tick(now + REST)?;
        }
    }
}

/// Gives each position of one turn, which begins at `first`, to its line.
fn assign(passed: &Passed, first: Radians, options: &SweepOptions) -> Sweep {
    let edges = &passed.edges;
    let lines = i64::from(options.lines);
    let spacing = TAU / f64::from(options.lines);
    let phase = phase_of(edges, spacing, options.phase);
    let from = (first.value() - phase) / spacing;
    let window = match options.approach {
        Approach::Forward => from.ceil() as i64..from.ceil() as i64 + lines,
        Approach::Reverse => from.floor() as i64 + 1 - lines..from.floor() as i64 + 1,
    };
    let mut sweep = Sweep {
        deviations: vec![None; options.lines as usize],
        phase: Radians(phase),
        ..Sweep::default()
    };
    let mut counts = vec![0_u32; options.lines as usize];
    let mut unread = BTreeSet::new();
    let mut spoilt = BTreeSet::new();
    if let Some(signal) = &passed.signal {
        let at = |number: i64| number.rem_euclid(lines) as u32;
        let place = |number: i64| Radians(phase + number as f64 * spacing);
        let lacking = window.clone().filter(|it| signal.lacks(place(*it)));
        unread.extend(lacking.map(at));
        let numbers = signal.wide.iter().map(|it| (it.value() - phase) / spacing);
        let near = numbers.filter(|it| (it - it.round()).abs() <= LINE_SHARE);
        spoilt.extend(near.map(|it| at(it.round() as i64)));
    }
    for edge in edges {
        let number = ((edge.position.value() - phase) / spacing).round();
        let off = edge.position.value() - phase - number * spacing;
        if !window.contains(&(number as i64)) {
            continue;
        }
        if off.abs() > spacing * LINE_SHARE {
            sweep.strays.push(edge.position);
            continue;
        }
        let at = (number as i64).rem_euclid(lines) as u32;
        counts[at as usize] += 1;
        sweep.deviations[at as usize] = Some(edge.position - Radians(number * spacing));
        if edge.missed > 0 {
            // The edges before it, and perhaps the line's own by one of a scratch.
            let before = i64::from(edge.missed.min(options.lines));
            let back =
                |by: i64| (number as i64 - by * options.approach.sign() as i64).rem_euclid(lines);
            unread.extend((0..=before).map(|by| back(by) as u32));
            sweep.overwritten.push(at);
        }
    }
    for (at, count) in (0_u32..).zip(&counts) {
        match count {
            0 if unread.contains(&at) => sweep.overwritten.push(at),
            0 if spoilt.contains(&at) => sweep.doubled.push(at),
            0 => sweep.missing.push(at),
            1 => {}
            _ => sweep.doubled.push(at),
        }
    }
    // Which of several edges is the line's, nobody knows.
    for at in sweep.doubled.iter().chain(&sweep.overwritten) {
        sweep.deviations[*at as usize] = None;
    }
    sweep
}

/// What all positions have in common within a spacing: the direction of their mean on a circle
/// on which one spacing is one turn.
fn phase_of(edges: &[LineEdge], spacing: f64, near: Option<Radians>) -> f64 {
    let (sine, cosine) = edges.iter().fold((0.0, 0.0), |(sine, cosine), edge| {
        let angle = TAU * edge.position.value() / spacing;
        (sine + sin(angle), cosine + cos(angle))
    });
    let phase = atan2(sine, cosine) / TAU * spacing;
    let near = near.map_or(0.0, Radians::value);
    phase + spacing * ((near - phase) / spacing).round()
}

#[cfg(test)]
mod tests {
    use super::*;
    const LINES: u32 = 360;

    fn edge(degrees: f64) -> LineEdge {
        LineEdge {
            position: Radians::from_degrees(degrees),
            missed: 0,
        }
    }

    fn options(approach: Approach, phase_deg: Option<f64>) -> SweepOptions {
        SweepOptions {
            lines: LINES,
            approach,
            speed: None,
            phase: phase_deg.map(Radians::from_degrees),
        }
    }

    fn assigned(latched: &[LineEdge], first: Radians, options: &SweepOptions) -> Sweep {
        let passed = Passed {
            edges: latched.to_vec(),
            signal: None,
        };
        assign(&passed, first, options)
    }

    /// Lines from -2 to 362 degrees with an error of some arc-seconds each.
    fn plate(phase_deg: f64) -> Vec<LineEdge> {
        let error = |line: i32| 0.008 * f64::from(line).to_radians().sin();
        let lines = (-2..=362).map(|line| edge(f64::from(line) + phase_deg + error(line)));
        lines.collect()
    }

    #[test]
    fn each_line_of_a_turn_is_read_once_whatever_the_run_up_saw() {
        let latched = plate(0.2);
        let sweep = assigned(&latched, Radians::ZERO, &options(Approach::Forward, None));
        assert_eq!(sweep.read(), 360);
        assert!((sweep.phase.degrees() - 0.2).abs() < 1e-4);
        let at_90 = sweep.deviations[90].unwrap().degrees();
        assert!((at_90 - 0.208).abs() < 1e-9, "{at_90}");
        assert_eq!((sweep.missing.len(), sweep.doubled.len()), (0, 0));
    }

    #[test]
    fn a_reverse_turn_gives_the_same_readings() {
        let mut latched = plate(0.2);
        latched.reverse();
        let turn = Radians::TURN;
        let sweep = assigned(&latched, turn, &options(Approach::Reverse, None));
        assert_eq!(sweep.read(), 360);
        let at_90 = sweep.deviations[90].unwrap().degrees();
        assert!((at_90 - 0.208).abs() < 1e-9, "{at_90}");
    }

    #[test]
    fn smudged_lines_are_named() {
        let mut latched = plate(-0.3);
        latched.retain(|edge| !(99.0..101.0).contains(&edge.position.degrees()));
        let sweep = assigned(&latched, Radians::ZERO, &options(Approach::Forward, None));
        assert_eq!(sweep.missing, [100, 101]);
        assert_eq!(sweep.read(), 358);
    }

    #[test]
    fn a_second_edge_makes_its_line_worthless_and_a_stray_one_nothing() {
        let mut latched = plate(0.0);
        latched.insert(103, edge(100.01));
        latched.insert(204, edge(200.5));
        let sweep = assigned(&latched, Radians::ZERO, &options(Approach::Forward, None));
        assert_eq!(sweep.doubled, [100]);
        assert_eq!(sweep.deviations[100], None);
        assert_eq!(sweep.strays.len(), 1);
        assert_eq!(sweep.read(), 359);
    }

    #[test]
    fn lines_overwritten_unread_are_not_called_unseen() {
        let overwrite = |latched: &mut Vec<LineEdge>| {
            let place =
                |degrees: f64| move |it: &LineEdge| it.position.degrees().round() == degrees;
            latched.retain(|it| !place(51.0)(it) && !place(52.0)(it) && !place(200.0)(it));
        };
        let mut latched = plate(0.0);
        overwrite(&mut latched);
        let mark = |latched: &mut Vec<LineEdge>, degrees: f64| {
            let at = latched
                .iter()
                .position(|it| it.position.degrees().round() == degrees);
            latched[at.unwrap()].missed = 2;
        };
        mark(&mut latched, 53.0);
        let sweep = assigned(&latched, Radians::ZERO, &options(Approach::Forward, None));
        assert_eq!(sweep.overwritten, [53, 51, 52]);
        assert_eq!((sweep.missing.as_slice(), sweep.read()), (&[200][..], 356));
        let mut latched = plate(0.0);
        overwrite(&mut latched);
        latched.reverse();
        mark(&mut latched, 50.0);
        let sweep = assigned(&latched, Radians::TURN, &options(Approach::Reverse, None));
        assert_eq!(sweep.overwritten, [50, 51, 52]);
        assert_eq!((sweep.missing.as_slice(), sweep.read()), (&[200][..], 356));
    }

    #[test]
    fn an_overwritten_edge_makes_the_one_that_was_read_worthless() {
        let mut latched = plate(0.0);
        let at = latched
            .iter()
            .position(|edge| edge.position.degrees() > 49.5);
        latched[at.unwrap()].missed = 1;
        let sweep = assigned(&latched, Radians::ZERO, &options(Approach::Forward, None));
        assert_eq!(sweep.overwritten, [50]);
        assert_eq!(sweep.deviations[50], None);
        assert!(sweep.missing.is_empty());
    }

    #[test]
    fn a_phase_near_half_a_spacing_is_kept_on_the_side_of_the_sweep_before() {
        let latched = plate(0.49);
        let sweep = assigned(
            &latched,
            Radians::ZERO,
            &options(Approach::Forward, Some(0.52)),
        );
        assert!((sweep.phase.degrees() - 0.49).abs() < 1e-3);
        let latched = plate(-0.49);
        let sweep = assigned(
            &latched,
            Radians::ZERO,
            &options(Approach::Forward, Some(0.49)),
        );
        assert!(
            (sweep.phase.degrees() - 0.51).abs() < 1e-3,
            "{:?}",
            sweep.phase
        );
    }
}
