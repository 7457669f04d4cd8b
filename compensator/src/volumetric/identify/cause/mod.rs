//! Which single cause explains readings that contradict each other, all of them.
//!
//! Source: G. Schwarz, Estimating the dimension of a model, Annals of Statistics 6 (1978) 461, for models
//! of different unknowns; R. Kass, A. Raftery, Bayes factors, JASA 90 (1995) 773, for what a difference
//! between them means. The same readings are evaluated as they would be were something other than it was
//! stated, and what leaves them scattering no more than they may is a likely cause.
//!
//! | symbol | name here |
//! |---|---|
//! | −2 ln L + k ln n | [`Cause::information`] |
//! | 2 ln 100 | [`ALIKE`]: a cause that is less likely than another by more than 100 is not told |
//!
//! Causes are looked for where readings are refused. A sound calibration is refused once in 10 000 times,
//! and has a cause told only where chance besides makes that cause fit: that is how often a sound one is
//! told a wrong cause at most.
//!
//! What no reading shows: the same change of the arm in all readings, which moves the errors of each axis
//! among themselves (the errors found are then those of the point that was really measured); which of the
//! first axes carry the workpiece, as far as only readings between tool and workpiece are concerned.
//!
//! Absent: two causes at once, or a cause with a reading that is off besides.

mod arm;
mod suspects;
mod weigh;

use units::Metres;
use units::portable::ln;

use super::scatter::scatter_limit;
use super::snoop::Snooped;
use super::{Observation, Plan};
use crate::volumetric::model::Chain;
use crate::volumetric::{Axis, Point};

pub use suspects::{Circumstance, suspects};

use arm::{levers, moved};
use weigh::{Weighed, Weights};

/// Causes are both told where one is no less likely than by a factor of 100: 2 ln 100.
const ALIKE: f64 = 9.2;
/// A cause must be this much more likely than what was stated, which was refused: 2 ln 10⁶.
const BETTER: f64 = 27.6;
/// Of so many lines another arm is tried in earnest, the likeliest first.
const LINES_TRIED: usize = 4;

/// What may be other than it was stated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Doubt {
    /// The axes stand on one another like this.
    Chain(Chain),
    /// In all lines that were read with this arm it was another one, compared with the other arms.
    Tool(Point),
    /// In this run alone the arm was another one.
    Line(usize),
    /// The detector on the slide of this axis sits elsewhere.
    Detector(Axis),
    /// The beam along this axis moves otherwise: how much more of it as a whole.
    Drift(Axis),
}

/// A doubt with how it is tried.
#[derive(Clone, Debug, PartialEq)]
pub struct Suspect {
    /// What is doubted.
    pub doubt: Doubt,
    /// How it is tried.
    pub trial: Trial,
}

/// What the readings would be evaluated with.
#[derive(Clone, Debug, PartialEq)]
pub enum Trial {
    /// Another chain.
    Chain {
        /// The chain it may be.
        chain: Chain,
        /// The readings as they are to be understood then: detectors sit on slides.
        observations: Vec<Observation>,
    },
    /// Another arm.
    Arm {
        /// In which readings, from 0.
        readings: Vec<usize>,
        /// Differences from the stated arm that are easily made; the stated one is tried anyway.
        starts: Vec<Point>,
    },
    /// Something that adds to the readings.
    Effect {
        /// By reading, in its SI unit for each unit of it.
        of: Vec<f64>,
    },
}

/// What has to be so to explain the readings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Explanation {
    /// What is doubted is as the doubt says.
    Whole,
    /// The arm is off by this in each direction, with its standard uncertainty; `None`: as stated.
    Arm([Option<(Metres, Metres)>; 3]),
    /// There is so much of the effect, with its standard uncertainty.
    Effect(f64, f64),
}

/// A cause that explains all readings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cause {
    /// What it is.
    pub doubt: Doubt,
    /// What it has to be.
    pub explanation: Explanation,
    /// How much the readings then scatter in units of their uncertainty.
    pub ratio: f64,
    /// Schwarz's criterion, counted from that of what was stated: the lower the likelier.
    pub information: f64,
}

/// What explains the readings.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Causes {
    /// The causes, the likeliest first; none where none explains all readings, or where gross errors
    /// explain them far better.
    pub told: Vec<Cause>,
    /// Whether gross errors explain the readings as well.
    pub gross_as_well: bool,
}

/// A suspect with how well it explains the readings.
struct Tried {
    doubt: Doubt,
    explanation: Explanation,
    weighed: Weighed,
}

impl Tried {
    /// The scatter, where it is no larger than it may be.
    fn explained(&self) -> Option<f64> {
        self.weighed.ratio().filter(|_| self.weighed.explains())
    }
}

impl Plan {
    /// Which of `suspects` explain all of `observations`, which were refused, in which `snooped` was found.
    pub fn causes(
        &self,
        observations: &[Observation],
        suspects: &[Suspect],
        snooped: &Snooped,
    ) -> Causes {
        let Ok(stated) = Weighed::new(self, observations, &[], Weights::BetweenNodes) else {
            return Causes::default();
        };
        let each = suspects.iter();
        let mut tried: Vec<Tried> = each.filter_map(|it| self.tried(observations, it)).collect();
        tried.extend(self.arms(observations, suspects, &stated));
        let gross = self.gross(observations, snooped);
        told(&stated, &tried, gross.as_ref())
    }

    /// What needs no search.
    fn tried(&self, observations: &[Observation], suspect: &Suspect) -> Option<Tried> {
        let weights = Weights::BetweenNodes;
        let (explanation, weighed) = match &suspect.trial {
            Trial::Chain {
                chain,
                observations,
            } => {
                let other = Self {
                    chain: *chain,
                    ..self.clone()
                };
                let weighed = Weighed::new(&other, observations, &[], weights).ok()?;
                (Explanation::Whole, weighed)
            }
            Trial::Effect { of } => {
                let extra = core::slice::from_ref(of);
                let weighed = Weighed::new(self, observations, extra, weights).ok()?;
                let (share, u) = weighed.extra(0);
                (Explanation::Effect(share, u), weighed)
            }
            Trial::Arm { .. } => return None,
        };
        Some(Tried {
            doubt: suspect.doubt,
            explanation,
            weighed,
        })
    }

    /// Arms: those that several lines share, and those of the likeliest lines.
    fn arms(
        &self,
        observations: &[Observation],
        suspects: &[Suspect],
        stated: &Weighed,
    ) -> Vec<Tried> {
        let basis = stated.basis();
        let gain = |readings: &[usize]| {
            let levers = levers(self, observations, readings, stated);
            stated.gain(&basis, &levers)
        };
        let (mut shared, mut single) = (Vec::new(), Vec::new());
        for it in suspects {
            match (&it.trial, it.doubt) {
                (Trial::Arm { readings, starts }, Doubt::Line(_)) => {
                    single.push((gain(readings), it.doubt, readings, starts));
                }
                (Trial::Arm { readings, starts }, _) => {
                    shared.push((0.0, it.doubt, readings, starts));
                }
                (Trial::Chain { .. } | Trial::Effect { .. }, _) => {}
            }
        }
        single.sort_by(|a, b| b.0.total_cmp(&a.0));
        single.truncate(LINES_TRIED);
        let each = shared.into_iter().chain(single);
        let found = each.flat_map(|(_, doubt, readings, starts)| {
            let starts = core::iter::once(Point::ZERO).chain(starts.iter().copied());
            let found = moved(self, observations, readings, starts).into_iter();
            found.map(move |it| Tried {
                doubt,
                explanation: Explanation::Arm(it.by),
                weighed: it.weighed,
            })
        });
        found.collect()
    }

    /// Gross errors as a model of their own, with what it costs to choose them among so many.
    fn gross(&self, observations: &[Observation], snooped: &Snooped) -> Option<(Weighed, f64)> {
        let ratio = snooped.ratio_left?;
        if snooped.found.is_empty() || ratio > scatter_limit(snooped.degrees_of_freedom) {
            return None;
        }
        let of = |it: &super::Gross| it.column(observations);
        let columns: Vec<Vec<f64>> = snooped.found.iter().map(of).collect();
        let weighed = Weighed::new(self, observations, &columns, Weights::BetweenNodes).ok()?;
        // One of all readings, and of all steps between two.
        let chosen = 2.0 * ln(2.0 * observations.len() as f64);
        Some((weighed, chosen * snooped.found.len() as f64))
    }
}

/// Those of `tried` that explain the readings, as well as any other does.
fn told(stated: &Weighed, tried: &[Tried], gross: Option<&(Weighed, f64)>) -> Causes {
    let explained: Vec<(&Tried, f64)> = tried
        .iter()
        .filter_map(|it| Some((it, it.explained()?)))
        .collect();
    let least = explained
        .iter()
        .map(|it| it.1)
        .fold(f64::INFINITY, f64::min);
    let scale = least.clamp(1.0, super::SCATTER_RATIO_MAX);
    let origin = stated.information(scale);
    let gross = gross.map(|(weighed, chosen)| weighed.information(scale) + chosen - origin);
    let cause = |(it, ratio): &(&Tried, f64)| Cause {
        doubt: it.doubt,
        explanation: it.explanation,
        ratio: *ratio,
        information: it.weighed.information(scale) - origin,
    };
    let mut told: Vec<Cause> = explained.iter().map(cause).collect();
    told.sort_by(|a, b| a.information.total_cmp(&b.information));
    let best = told.first().map_or(f64::INFINITY, |it| it.information);
    let enough = gross.map_or(best, |it| best.min(it)) + ALIKE;
    told.retain(|it| it.information <= enough && it.information <= -BETTER);
    Causes {
        gross_as_well: gross.is_some_and(|it| it <= best + ALIKE),
        told,
    }
}
