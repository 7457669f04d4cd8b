//! What is worth being doubted of a calibration: its chain, its arms, where its detectors sit, how its
//! beams move.

use units::Metres;

use super::{Doubt, Suspect, Trial};
use crate::volumetric::identify::effect::{Effect, seen};
use crate::volumetric::identify::{Observation, Plan, Reading};
use crate::volumetric::model::Chain;
use crate::volumetric::online::{BeamDrift, Displacement, MovingState};
use crate::volumetric::point::{add, cross};
use crate::volumetric::{Axis, Point};

/// What is known of a reading beyond the reading.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Circumstance {
    /// The axis on whose slide the machine's own detector sits that made it, counted in the direction of
    /// the tool; `None`: an instrument between workpiece and tool.
    pub detector: Option<Axis>,
    /// What the detectors saw of the slides beyond their references, which was taken off the reading.
    pub state: MovingState,
    /// How far each axis's beam had moved at its end, which was taken off what its detector saw.
    pub beam_shift: [Displacement; 3],
}

/// Chains, arms, detectors and beams that may be other than stated, of readings made in these
/// circumstances (as many as there are observations); `beams`: how each axis's beam is taken to move.
pub fn suspects(
    plan: &Plan,
    observations: &[Observation],
    circumstances: &[Circumstance],
    beams: [Option<BeamDrift>; 3],
) -> Vec<Suspect> {
    let mut all = chains(plan, observations, circumstances);
    all.extend(tools(observations, circumstances));
    for axis in Axis::ALL {
        let own = readings(observations, |at| circumstances[at].detector == Some(axis));
        if !own.is_empty() {
            all.push(arm(Doubt::Detector(axis), own, Vec::new()));
        }
        if let Some(drift) = beams[axis.index()] {
            let of = by_translation(plan, observations, circumstances, axis, drift);
            if of.iter().any(|it| *it != 0.0) {
                let trial = Trial::Effect { of };
                let doubt = Doubt::Drift(axis);
                all.push(Suspect { doubt, trial });
            }
        }
    }
    all
}

fn arm(doubt: Doubt, readings: Vec<usize>, starts: Vec<Point>) -> Suspect {
    let trial = Trial::Arm { readings, starts };
    Suspect { doubt, trial }
}

/// Displacements that fulfil a condition; angles do not depend on an arm.
fn readings(observations: &[Observation], is_own: impl Fn(usize) -> bool) -> Vec<usize> {
    let is_length = |it: &Observation| matches!(it.reading, Reading::Length { .. });
    let each = observations.iter().enumerate();
    let own = each.filter(|(at, it)| is_length(it) && is_own(*at));
    own.map(|(at, _)| at).collect()
}

/// Every other order of the axes; where the machine's own detectors made part of the readings also every
/// other set of axes that carry the workpiece, which the instrument's readings alone do not show.
fn chains(
    plan: &Plan,
    observations: &[Observation],
    circumstances: &[Circumstance],
) -> Vec<Suspect> {
    let stated = plan.chain;
    let still = MovingState::default();
    let is_seen = |it: &Circumstance| it.detector.is_some() || it.state != still;
    let by_detectors = circumstances.iter().any(is_seen);
    let carrying = |chain: &Chain| Axis::ALL.map(|axis| chain.carries_workpiece(axis));
    let alike = |chain: &Chain| match by_detectors {
        true => *chain == stated,
        false => chain.axes() == stated.axes(),
    };
    let mut chains: Vec<Chain> = Chain::all().filter(|it| !alike(it)).collect();
    if !by_detectors {
        // One of each order: where as many axes carry the workpiece as is stated.
        let count = |chain: &Chain| carrying(chain).iter().filter(|it| **it).count();
        chains.retain(|it| count(it) == count(&stated));
    }
    let each = chains.into_iter().map(|chain| {
        let own = observations.iter().zip(circumstances);
        let own = own.map(|(it, of)| as_in(stated, chain, it, of));
        Suspect {
            doubt: Doubt::Chain(chain),
            trial: Trial::Chain {
                chain,
                observations: own.collect(),
            },
        }
    });
    each.collect()
}

/// The reading as it is to be understood if the chain is `chain`.
fn as_in(stated: Chain, chain: Chain, it: &Observation, of: &Circumstance) -> Observation {
    let mut own = *it;
    if let Some(axis) = of.detector {
        let carried = |chain: Chain| chain.lever(axis, it.at, Point::ZERO);
        own.tool = it.tool + carried(stated) - carried(chain);
        let turned = stated.sense(axis) * chain.sense(axis);
        match &mut own.reading {
            Reading::Length { deviation, .. } => *deviation = *deviation * turned,
            Reading::Angle { deviation, .. } => *deviation = *deviation * turned,
        }
        return own;
    }
    // Of angles nothing was taken off.
    let taken = |chain: Chain| seen(it.reading, &moved_by(chain, it, &of.state));
    if let Reading::Length { deviation, .. } = &mut own.reading {
        *deviation += Metres(taken(stated) - taken(chain));
    }
    own
}

/// What slides that strayed and rolled made of the measured point.
fn moved_by(chain: Chain, it: &Observation, state: &MovingState) -> Effect {
    let mut moved = [0.0; 3];
    for axis in Axis::ALL {
        let mut turn = [0.0; 3];
        turn[axis.index()] = state.roll[axis.index()].value();
        let lever = chain.lever(axis, it.at, it.tool).array();
        let own = add(state.sideways_of(axis), cross(turn, lever));
        moved = add(moved, own.map(|it| it * chain.sense(axis)));
    }
    Effect::displaced(moved)
}

/// What a beam that moves by one share more as a whole, and less about its source, adds to the readings.
fn by_translation(
    plan: &Plan,
    observations: &[Observation],
    circumstances: &[Circumstance],
    axis: Axis,
    drift: BeamDrift,
) -> Vec<f64> {
    let each = observations.iter().zip(circumstances).map(|(it, of)| {
        let more = 1.0 - drift.swing(it.at.along(axis));
        let shift = of.beam_shift[axis.index()].map(|it| it * more);
        let mut state = MovingState::default();
        state.sideways[axis.index()] = shift;
        let moved = seen(it.reading, &moved_by(plan.chain, it, &state));
        match of.detector {
            // What its own detector saw counts as it is; of what others read it was taken off.
            Some(own) if own == axis => -moved,
            Some(_) => 0.0,
            None => moved,
        }
    });
    each.collect()
}

/// The arm of each line, and of all that were read with the same one.
fn tools(observations: &[Observation], circumstances: &[Circumstance]) -> Vec<Suspect> {
    let by_instrument = |at: usize| circumstances[at].detector.is_none();
    let own = readings(observations, by_instrument);
    let mut tools: Vec<(Point, usize)> = Vec::new();
    for at in &own {
        let tool = observations[*at].tool;
        match tools.iter_mut().find(|it| it.0 == tool) {
            Some((_, count)) => *count += 1,
            None => tools.push((tool, 1)),
        }
    }
    // What most were read with is what the others are compared with.
    tools.sort_by_key(|it| core::cmp::Reverse(it.1));
    let Some(((usual, _), others)) = tools.split_first() else {
        return Vec::new();
    };
    let mut all: Vec<Suspect> = Vec::new();
    for (tool, _) in others {
        let with = own
            .iter()
            .copied()
            .filter(|at| observations[*at].tool == *tool);
        let starts = mistaken(*tool - *usual);
        all.push(arm(Doubt::Tool(*tool), with.collect(), starts));
    }
    let mut runs: Vec<usize> = own.iter().map(|at| observations[*at].run).collect();
    runs.dedup();
    for run in runs {
        let of_run = own
            .iter()
            .copied()
            .filter(|at| observations[*at].run == run);
        let of_run: Vec<usize> = of_run.collect();
        let is_known =
            |it: &Suspect| matches!(&it.trial, Trial::Arm { readings, .. } if *readings == of_run);
        if all.iter().any(is_known) {
            continue;
        }
        let stated = observations[of_run[0]].tool;
        let others = tools.iter().map(|it| it.0).filter(|it| *it != stated);
        let starts = others.map(|it| it - stated).collect();
        all.push(arm(Doubt::Line(run), of_run, starts));
    }
    all
}

/// What an arm longer by `by` than another is easily mistaken for: the other way, or along another axis.
fn mistaken(by: Point) -> Vec<Point> {
    let by = by.array();
    let mut starts = Vec::new();
    for from in (0..3).filter(|k| by[*k] != 0.0) {
        let mut start = |to: usize, length: f64| {
            let mut other = [0.0; 3];
            other[from] -= by[from];
            other[to] += length;
            starts.push(Point::of(other));
        };
        start(from, -by[from]);
        for to in (0..3).filter(|k| *k != from) {
            start(to, by[from]);
            start(to, -by[from]);
        }
    }
    starts
}
