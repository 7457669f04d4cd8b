//! The search for outliers, and whether those found are the bad readings.
//!
//! A reading that was left out has a rival where another one may be bad in its place. With three
//! placements one line apart, for example, a single closed circle of readings contains line n + 1
//! of the first and line n of the third, and it contains both: which of them is bad cannot be
//! told. Of the two evaluations, without the one and without the other, the sums of squares are
//! compared: a difference of q σ² makes it e^(q/2) times as likely that it is the one. A rival is
//! left out, too; where that leaves something unobservable, both are named.

use super::majority::{Kept, LeftOut, Majority, majority};
use super::outliers::Judge;
use super::solution::SolveError;
use super::solver::{Fit, Solver};

/// Rounds of the search for outliers; each takes out many at once.
const ROUNDS_MAX: usize = 20;

/// With more degrees of freedom the scatter is that of most readings, however bad a few are.
const MASKED_FREEDOM_MAX: usize = 250;

/// So many bad readings that mask one another are looked for.
const MASKED_MAX: usize = 8;

/// A reading is a rival of another up to this difference of the sums of squares, in units of a
/// reading's variance: one in 150.
const RIVAL_MAX: f64 = 10.0;

/// A reading whose residual has less of its variance determines itself.
const SPARED_MIN: f64 = 1e-6;

impl<'a> Solver<'a> {
    /// The fit without outliers, and why it is not to be believed, if it is not.
    pub(super) fn search<'r>(
        &self,
        judge: &Judge<'_>,
        readings: &'r [f64],
        mut fit: Fit<'a, 'r>,
    ) -> (Fit<'a, 'r>, Option<SolveError>) {
        let total = readings.len() - self.missing.len();
        let limit = (total as f64 * self.options.outlier_share_max) as usize;
        let mut outliers: Vec<usize> = Vec::new();
        for round in 0.. {
            let suspects = judge.suspects(&fit.scan, || self.residuals(&fit));
            let Some(&first) = suspects.first() else {
                match self.masked(judge, readings, &fit, &outliers, limit.max(1)) {
                    Some((freed, found)) => (fit, outliers) = (freed, found),
                    None => break,
                }
                continue;
            };
            let before = outliers.len();
            outliers.extend(suspects);
            // A single bad reading is believed even where few were made.
            if outliers.len() > limit.max(1) || round == ROUNDS_MAX {
                let doubt = SolveError::TooManyOutliers {
                    seen: outliers.len(),
                    readings: total,
                    limit: limit.max(1),
                    first: self.name(first),
                };
                return (fit, Some(doubt));
            }
            match self.without(readings, &mut outliers, before + 1) {
                Ok(freed) => fit = freed,
                Err(doubt) => return (fit, Some(self.because_of(doubt, &outliers))),
            }
        }
        if outliers.is_empty() {
            return (fit, None);
        }
        let left = outliers.len();
        let kept: Vec<usize> = {
            let agrees = agreement(judge, readings, &fit);
            let stays_out = |at: &usize| agrees(*at) != Some(true);
            outliers.into_iter().filter(stays_out).collect()
        };
        if kept.len() == left {
            return (fit, None);
        }
        match self.fit(readings, &kept) {
            Ok(freed) => (freed, None),
            Err(doubt) => (fit, Some(doubt)),
        }
    }

    /// A few bad readings of few are all the scatter there is, and none stands off. So the worst are
    /// left out one by one; when the rest then agrees, and disagrees with each of them, they were bad.
    fn masked<'r>(
        &self,
        judge: &Judge<'_>,
        readings: &'r [f64],
        fit: &Fit<'a, 'r>,
        outliers: &[usize],
        limit: usize,
    ) -> Option<(Fit<'a, 'r>, Vec<usize>)> {
        if self.degrees_of_freedom(fit) > MASKED_FREEDOM_MAX {
            return None;
        }
        let mut outliers = outliers.to_vec();
        let mut worst = judge.worst(&self.residuals(fit))?;
        for _ in 0..MASKED_MAX.min(limit.saturating_sub(outliers.len())) {
            outliers.push(worst);
            let freed = self.fit(readings, &outliers).ok()?;
            let residuals = self.residuals(&freed);
            let all_stand_off = {
                let agrees = agreement(judge, readings, &freed);
                outliers.iter().all(|at| agrees(*at) == Some(false))
            };
            if all_stand_off && judge.suspects(&freed.scan, || residuals.clone()).is_empty() {
                return Some((freed, outliers));
            }
            worst = judge.worst(&residuals)?;
        }
        None
    }

    /// The fit without `outliers`. Of two that only one can be spared of, as a bad reading throws its shadow
    /// on the other, the later one stays; the first `sure` are left out in any case.
    fn without<'r>(
        &self,
        readings: &'r [f64],
        outliers: &mut Vec<usize>,
        sure: usize,
    ) -> Result<Fit<'a, 'r>, SolveError> {
        loop {
            let needed = match self.fit(readings, outliers) {
                Err(SolveError::Unobservable { reading }) => reading,
                other => return other,
            };
            let place = outliers.iter().position(|at| self.name(*at) == needed);
            match place {
                Some(place) if place >= sure => drop(outliers.remove(place)),
                _ if outliers.len() > sure => drop(outliers.pop()),
                _ => return Err(SolveError::Unobservable { reading: needed }),
            }
        }
    }

    /// `fit`, with the sound readings in the place of those kept at positions where most are bad, and
    /// without those that may be bad just as well as one that was left out.
    pub(super) fn settled<'r>(
        &self,
        judge: &Judge<'_>,
        readings: &'r [f64],
        mut fit: Fit<'a, 'r>,
    ) -> Result<Fit<'a, 'r>, SolveError> {
        fit = self.with_majority(judge, readings, fit)?;
        let pairs = self.rivals(judge, readings, &fit);
        let Some((one, other)) = pairs.first() else {
            return Ok(fit);
        };
        let mut outliers = self.outliers(&fit);
        outliers.extend(pairs.iter().map(|it| it.1));
        outliers.sort_unstable();
        outliers.dedup();
        let without = self.fit(readings, &outliers);
        let without = without.map_err(|_| SolveError::Ambiguous {
            one: self.name(*one),
            other: self.name(*other),
        })?;
        self.with_majority(judge, readings, without)
    }

    /// `fit`, with the sound readings in the place of those kept at positions where most are bad.
    fn with_majority<'r>(
        &self,
        judge: &Judge<'_>,
        readings: &'r [f64],
        mut fit: Fit<'a, 'r>,
    ) -> Result<Fit<'a, 'r>, SolveError> {
        for round in 0.. {
            let outliers = self.outliers(&fit);
            let doubtful = self.doubtful(judge, readings, &fit, &outliers);
            let Some((position, sound)) = doubtful else {
                break;
            };
            if sound.is_empty() || round == ROUNDS_MAX {
                return Err(self.undetermined(position, &outliers));
            }
            let others = outliers.iter().filter(|at| !sound.contains(at)).copied();
            let kept = self.at_position(position).filter(|at| !fit.is_out(*at));
            let outliers: Vec<usize> = others.chain(kept).collect();
            let freed = self.fit(readings, &outliers);
            fit = freed.map_err(|doubt| self.because_of(doubt, &outliers))?;
        }
        Ok(fit)
    }

    /// Of each outlier the readings that were kept and may be bad in its place: with it and without
    /// them the others are met almost as well.
    fn rivals(
        &self,
        judge: &Judge<'_>,
        readings: &[f64],
        fit: &Fit<'_, '_>,
    ) -> Vec<(usize, usize)> {
        let Some(gaps) = &fit.gaps else {
            return Vec::new();
        };
        let (outliers, scatter) = (self.outliers(fit), judge.scatter(&fit.scan));
        let residuals = self.residuals(fit);
        let mut candidates: Vec<usize> = outliers
            .iter()
            .flat_map(|at| gaps.akin(*at))
            .filter(|at| !fit.is_out(*at))
            .collect();
        candidates.sort_unstable();
        candidates.dedup();
        let mut pairs = Vec::new();
        for other in candidates {
            let (own, shadows) = gaps.shadow(other);
            for one in &outliers {
                let Some(shadow) = shadows.iter().find(|it| it.0 == *one) else {
                    continue;
                };
                let Some(variance) = fit.prediction_variance(*one) else {
                    continue;
                };
                let apart = readings[*one] - fit.readings[*one];
                // With `one` put back, and `other` left out in its place.
                let back = residuals[other] + shadow.1 * apart / variance;
                let of_other = own + shadow.1 * shadow.1 / variance;
                let gained = apart * apart / variance - back * back / of_other;
                if of_other > SPARED_MIN && gained <= RIVAL_MAX * scatter * scatter {
                    pairs.push((*one, other));
                }
            }
        }
        pairs
    }

    /// The first position where those kept are no majority, and which are; none where nobody can
    /// tell.
    fn doubtful(
        &self,
        judge: &Judge<'_>,
        readings: &[f64],
        fit: &Fit<'_, '_>,
        outliers: &[usize],
    ) -> Option<(usize, Vec<usize>)> {
        let scatter = judge.scatter(&fit.scan);
        let mut left = vec![self.design.offsets().len(); self.design.lines()];
        fit.left_out
            .iter()
            .for_each(|at| left[at % self.design.lines()] -= 1);
        // The last reading of a line only gives the line's own error.
        let tells = |at: &usize| !fit.is_out(*at) && left[at % self.design.lines()] > 1;
        let residuals = self.residuals(fit);
        let scaled = |at: &usize| {
            let own = fit.gaps.as_ref().map_or(1.0, |it| it.shadow(*at).0);
            residuals[*at].abs() / (scatter * own.max(SPARED_MIN).sqrt())
        };
        let mut positions: Vec<usize> = outliers.iter().map(|at| self.position(*at)).collect();
        positions.sort_unstable();
        positions.dedup();
        positions.into_iter().find_map(|position| {
            let own: Vec<usize> = self.at_position(position).filter(tells).collect();
            let kept = Kept {
                count: own.len(),
                read: self.made_at(position).count(),
                apart: own.iter().map(scaled).fold(0.0, f64::max),
            };
            let left_out = self
                .at_position(position)
                .filter(|at| outliers.contains(at));
            let left_out = left_out.map(|at| LeftOut {
                at,
                apart: readings[at] - fit.readings[at],
                variance: fit.prediction_variance(at).unwrap_or(1.0),
            });
            match majority(judge, scatter, kept, &left_out.collect::<Vec<_>>()) {
                Majority::Kept => None,
                Majority::LeftOut(sound) => Some((position, sound)),
                Majority::Nowhere => Some((position, Vec::new())),
            }
        })
    }

    pub(super) fn outliers(&self, fit: &Fit<'_, '_>) -> Vec<usize> {
        let own = fit.left_out.iter().copied();
        own.filter(|at| self.missing.binary_search(at).is_err())
            .collect()
    }

    /// The position of the table at which reading `at` is made.
    fn position(&self, at: usize) -> usize {
        let lines = self.design.lines();
        (at + self.design.offsets()[at / lines]) % lines
    }

    /// The readings at `position`, one of each placement.
    fn at_position(&self, position: usize) -> impl Iterator<Item = usize> {
        let lines = self.design.lines();
        let offsets = self.design.offsets().iter().enumerate();
        offsets
            .map(move |(placement, offset)| placement * lines + (position + lines - offset) % lines)
    }

    /// The same but for those missing.
    fn made_at(&self, position: usize) -> impl Iterator<Item = usize> {
        let made = |at: &usize| self.missing.binary_search(at).is_err();
        self.at_position(position).filter(made)
    }

    fn undetermined(&self, position: usize, outliers: &[usize]) -> SolveError {
        let disagree = self
            .at_position(position)
            .filter(|at| outliers.contains(at));
        SolveError::Undetermined {
            position,
            lines: self.design.lines(),
            read: self.made_at(position).count(),
            disagree: disagree.map(|at| self.name(at)).collect(),
        }
    }

    /// `doubt`, when it came from leaving out `outliers`.
    fn because_of(&self, doubt: SolveError, outliers: &[usize]) -> SolveError {
        let SolveError::Unobservable { reading } = doubt else {
            return doubt;
        };
        let position = (reading.line + reading.offset) % self.design.lines();
        let own = self.at_position(position).any(|at| outliers.contains(&at));
        if own {
            self.undetermined(position, outliers)
        } else {
            doubt
        }
    }
}

/// Whether a reading that was left out fits what the others predict for it; `None` where they predict nothing.
fn agreement(
    judge: &Judge<'_>,
    readings: &[f64],
    fit: &Fit<'_, '_>,
) -> impl Fn(usize) -> Option<bool> {
    let scatter = judge.scatter(&fit.scan);
    move |at| {
        let variance = fit.prediction_variance(at)?;
        Some(judge.fits(readings[at] - fit.readings[at], variance, scatter))
    }
}
