//! Do the readings scatter more than their stated uncertainties explain, and which fit least?
//!
//! Source: Birge, Phys. Rev. 40 (1932) 207: the ratio √(χ²/ν) is 1 when stated uncertainties are
//! right; the limit of χ²/ν by Wilson and Hilferty ([`reduced_chi_square_limit`]); Baarda, A testing
//! procedure for use in geodetic networks (1968) for the residual in units of its own standard
//! deviation, and for the gross error that one reading would have to have.
//!
//! | symbol | name here |
//! |---|---|
//! | √(χ²/ν) | [`Identified::birge_ratio`] |
//! | ν | [`Identified::degrees_of_freedom`] |
//! | r = 1 − h | [`Identified::redundancies`] |
//! | w = v / √r | [`Conspicuous::times`] |
//! | ∇ = v / r | [`Conspicuous::off`] |
//!
//! Absent: gross errors one by one, and slips, which [`Plan::snoop`](super::Plan::snoop) tells: a reading
//! that is named here is where to look first.

use super::Observation;
use super::solve::Identified;
use crate::uncertainty::reduced_chi_square_limit;

/// Readings may scatter so many times as much as was stated of them.
pub const SCATTER_RATIO_MAX: f64 = 2.0;
/// Few spare readings may scatter more than that by chance: as much as one in 30 000 sound
/// calibrations does.
const SIGMAS: f64 = 4.0;
/// So many runs are named at most.
const NAMED: usize = 3;
/// A reading whose residual is so many times its own standard deviation is worth being named.
const CONSPICUOUS: f64 = 3.3;
/// With less of itself left in its residual a reading is not judged by it.
const REDUNDANCY_MIN: f64 = 1e-6;

/// How much readings scatter.
#[derive(Clone, Debug, PartialEq)]
pub struct Scattered {
    /// Their scatter in units of what was stated.
    pub ratio: f64,
    /// What it may be.
    pub limit: f64,
    /// Readings − unknowns.
    pub degrees_of_freedom: usize,
    /// Of the runs that fit least, the reading that fits least; the worst first.
    pub worst: Vec<Conspicuous>,
}

/// A reading that does not fit the others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conspicuous {
    /// Which reading, from 0.
    pub index: usize,
    /// Its run.
    pub run: usize,
    /// Its residual in units of the standard deviation that the residual should have.
    pub times: f64,
    /// By how much it is off, were it the only wrong one; in its SI unit.
    pub off: f64,
}

/// What the ratio √(χ²/ν) may be: [`SCATTER_RATIO_MAX`], or, of nine spare readings and fewer, what
/// one of 30 000 sound calibrations exceeds. Sound readings of ten spare ones exceed 2 once in
/// 60 000 times, of thirty once in 10¹², of more never.
pub fn scatter_limit(degrees_of_freedom: usize) -> f64 {
    let by_chance = reduced_chi_square_limit(degrees_of_freedom, SIGMAS).sqrt();
    SCATTER_RATIO_MAX.max(by_chance)
}

impl Identified {
    /// What is wrong with `observations`, which this was found from, where they scatter too much;
    /// `None` when they do not, or when none is spare. What the functions may at most do between their nodes
    /// must not explain it.
    pub fn scattered(&self, observations: &[Observation]) -> Option<Scattered> {
        let seen = self.scatter(observations)?;
        // A comparison with NaN is false, so that it is refused too.
        let is_sound = self.ratio_at_least? <= seen.limit;
        (!is_sound).then_some(seen)
    }

    /// How much `observations`, which this was found from, scatter; `None` when none is spare.
    pub fn scatter(&self, observations: &[Observation]) -> Option<Scattered> {
        Some(Scattered {
            ratio: self.birge_ratio?,
            limit: scatter_limit(self.degrees_of_freedom),
            degrees_of_freedom: self.degrees_of_freedom,
            worst: self.worst(observations),
        })
    }

    /// By run, what fits least.
    fn worst(&self, observations: &[Observation]) -> Vec<Conspicuous> {
        let each = observations.iter().zip(&self.u).zip(&self.residuals);
        let each = each.zip(&self.redundancies).enumerate();
        let judged = each.filter(|(_, (_, redundancy))| **redundancy > REDUNDANCY_MIN);
        let mut worst: Vec<Conspicuous> = Vec::new();
        for (index, (((observation, u), residual), redundancy)) in judged {
            let seen = Conspicuous {
                index,
                run: observation.run,
                times: residual / redundancy.sqrt(),
                off: residual / redundancy * u,
            };
            match worst.iter_mut().find(|it| it.run == seen.run) {
                Some(it) if it.times.abs() < seen.times.abs() => *it = seen,
                Some(_) => {}
                None => worst.push(seen),
            }
        }
        worst.retain(|it| it.times.abs() > CONSPICUOUS);
        worst.sort_by(|a, b| b.times.abs().total_cmp(&a.times.abs()));
        worst.truncate(NAMED);
        worst
    }
}
