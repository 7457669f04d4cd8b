//! From where the nut should be to what the screw is commanded: the exact inverse, proven when
//! it is made, with lost motion taken up on true reversals only.
//!
//! The screw commanded to c pushes the nut forward to p(c) = c + offset + slope·c + periodic(c),
//! and in reverse to p(c) + lost motion. Where |slope| + Σ amplitude·2πh/lead < 1, p is strictly
//! increasing, so exactly one c belongs to each p. Where the nut is already known to be, no
//! motion is commanded; ahead of it the screw must push forward, behind it in reverse, after
//! crossing what is left of the play.

use core::f64::consts::TAU;

use units::{Approach, Metres};

use super::ScrewModel;
use super::engagement::{Engagement, Play, SNAP, ScrewMemory};
use super::limits::{Limits, ScrewError, check_limits, check_model, play_of};
use crate::uncertainty::combine;

/// Newton's steps before bisection; three do for slopes below 1e-2.
const NEWTON_STEPS: usize = 12;

/// How many standard uncertainties of the lost motion a take-up goes beyond it.
const TAKE_UP_MARGIN: f64 = 3.0;

/// A screw without play is engaged by any travel, even of a nanometre.
const TAKE_UP_MIN: f64 = 1e-9;

/// How the lost motion is compensated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rule {
    /// By the remembered engagement: after a reversal, as far as it is not taken up yet.
    Engagement,
    /// As the patent: every reverse move gets all of it, every forward move nothing, whatever
    /// was before. Read for positions; added move by move it would walk away at every reversal.
    Patent,
}

/// A target for which there is no compensation.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "screw compensation: {} mm is outside {} to {} mm, the measured range with its permitted \
     extrapolation",
    units::Short(seen.mm()), units::Short(first.mm()), units::Short(last.mm())
)]
pub struct OutOfRange {
    /// The target (or NaN).
    pub seen: Metres,
    /// The lowest target allowed.
    pub first: Metres,
    /// The highest target allowed.
    pub last: Metres,
}

/// What to command for a target, and what to expect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Correction {
    /// What the screw is commanded.
    pub set_point: Metres,
    /// The direction of the screw's travel; `None` when it need not move.
    pub approach: Option<Approach>,
    /// What to remember when the move is done.
    pub after: ScrewMemory,
    /// Where the nut will be at the lowest and at the highest; different while the engagement is
    /// not known.
    pub actual: (Metres, Metres),
    /// Standard uncertainty of the nut's place after this one move: of the model, of what the screw does besides it (its
    /// own errors at a stroke, and what a single move does not repeat: [`ScrewModel::scatter`]), and of an unknown
    /// engagement (its half range over √3).
    pub standard_uncertainty: Option<Metres>,
}

/// A screw's model made ready to be applied.
///
/// # Example
///
/// After a reversal the screw crosses the lost motion before the nut follows.
///
/// ```
/// use compensator::screw::{
///     Engagement, Limits, Rule, ScrewCompensation, ScrewMemory, ScrewModel,
/// };
/// use units::{Approach, Metres};
///
/// let model = ScrewModel {
///     offset: Metres::ZERO,
///     slope: 0.0,
///     lost_motion: Metres::from_um(2.3),
///     lead: None,
///     harmonics: vec![],
///     first: Metres::from_mm(-5.0),
///     last: Metres::from_mm(5.0),
///     covariance: None,
///     scatter: None,
/// };
/// let limits = Limits {
///     size: Metres::from_um(50.0),
///     slope: 0.05,
///     extrapolation: Metres::ZERO,
///     resolution: Metres::ZERO,
/// };
/// let screw = ScrewCompensation::new(model, limits, Rule::Engagement)?;
/// let memory = ScrewMemory { set_point: Metres::ZERO, engagement: Engagement::Forward };
/// let back = screw.correct(Metres::from_mm(-1.0), &memory)?;
/// assert!((back.set_point.um() + 1002.3).abs() < 1e-6);
/// assert_eq!(back.after.engagement, Engagement::Reverse);
/// let further = screw.correct(Metres::from_mm(-2.0), &back.after)?;
/// assert!((further.set_point.um() + 2002.3).abs() < 1e-6, "not twice");
/// assert_eq!(further.approach, Some(Approach::Reverse));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct ScrewCompensation {
    model: ScrewModel,
    limits: Limits,
    rule: Rule,
    play: Play,
    steepest: f64,
    ripple: f64,
    range: (Metres, Metres),
}

impl ScrewCompensation {
    /// Proves that `model` can be undone within `limits` and prepares it.
    ///
    /// The bounds of size and slope are sums of magnitudes: never too small, and too large only
    /// where harmonics do not peak together.
    ///
    /// # Errors
    /// When a limit is invalid, or the model is not sound or exceeds a limit, with value and limit.
    pub fn new(model: ScrewModel, limits: Limits, rule: Rule) -> Result<Self, ScrewError> {
        check_limits(&limits)?;
        check_model(&model)?;
        let range = (
            model.first - limits.extrapolation,
            model.last + limits.extrapolation,
        );
        let amplitudes = || model.harmonics.iter().map(|it| it.amplitude().value());
        let ripple: f64 = amplitudes().sum();
        let per_turn = |it: &super::Harmonic| TAU * f64::from(it.number) / model.lead_m();
        let waves = model.harmonics.iter();
        let steepest = model.slope.abs()
            + waves
                .map(|it| it.amplitude().value() * per_turn(it))
                .sum::<f64>();
        if steepest >= 1.0 {
            return Err(ScrewError::NotInvertible { seen: steepest });
        }
        if steepest > limits.slope {
            let (seen, limit) = (steepest, limits.slope);
            return Err(ScrewError::TooSteep { seen, limit });
        }
        let play = match rule {
            Rule::Engagement => play_of(&model)?,
            Rule::Patent => model.lost_motion.value().max(0.0),
        };
        let farthest = range.0.abs().max(range.1.abs()).value();
        let seen = model.offset.abs().value()
            + model.slope.abs() * farthest
            + ripple
            + model.lost_motion.abs().value();
        if seen > limits.size.value() {
            return Err(ScrewError::TooLarge {
                seen: Metres(seen),
                limit: limits.size,
                first: range.0,
                last: range.1,
            });
        }
        Ok(Self {
            model,
            limits,
            rule,
            play: Play(play),
            steepest,
            ripple,
            range,
        })
    }

    /// What to command so that the nut goes to `target`, given what is remembered.
    ///
    /// While the engagement is not known, and the target lies where the nut may be already, the
    /// play is crossed in the direction that leaves less in doubt; the rest is in
    /// [`Correction::actual`]. A [`take_up_move`](Self::take_up_move) before leaves no doubt.
    ///
    /// # Errors
    /// When the target is outside the strokes measured and their extrapolation, or NaN.
    pub fn correct(&self, target: Metres, memory: &ScrewMemory) -> Result<Correction, OutOfRange> {
        let (first, last) = self.range;
        if !(first..=last).contains(&target) {
            let seen = target;
            return Err(OutOfRange { seen, first, last });
        }
        let set_point = match self.rule {
            Rule::Engagement => self.engaged(target.value(), memory),
            Rule::Patent => self.as_the_patent(target.value(), memory),
        };
        Ok(self.expected(Metres(set_point), memory))
    }

    /// What becomes of the memory, and where the nut will be, when the screw is commanded to
    /// `set_point`, compensated or not.
    pub fn expected(&self, set_point: Metres, memory: &ScrewMemory) -> Correction {
        let travel = self.pushed(set_point.value()) - self.pushed(memory.set_point.value());
        let engagement = self.play.after(memory.engagement, travel);
        let after = ScrewMemory {
            set_point,
            engagement,
        };
        let (low, high) = self.nut(&after);
        let standard_uncertainty = self.u_model(set_point, engagement).map(|u| {
            let doubt = (high - low) / 2.0 / 3.0_f64.sqrt();
            let besides = self.model.scatter.unwrap_or_default();
            Metres(combine(&[u.value(), besides.value(), doubt]))
        });
        Correction {
            set_point,
            approach: Approach::of_move(memory.set_point, set_point),
            after,
            actual: (Metres(low), Metres(high)),
            standard_uncertainty,
        }
    }

    /// Where to command the screw so that the engagement is known afterwards: beyond the lost
    /// motion by three times its standard uncertainty, in the direction given. `None` when it is
    /// engaged that way already. Compare it with the soft limits before moving.
    pub fn take_up_move(&self, memory: &ScrewMemory, towards: Approach) -> Option<Metres> {
        let (least, most) = self.play.gaps(memory.engagement);
        let missing = match towards {
            Approach::Forward => most,
            Approach::Reverse => self.play.0 - least,
        };
        let known = match towards {
            Approach::Forward => Engagement::Forward,
            Approach::Reverse => Engagement::Reverse,
        };
        if memory.engagement == known {
            return None;
        }
        let u = self.model.u_lost_motion().map_or(0.0, Metres::value);
        let travel = (missing + TAKE_UP_MARGIN * u).max(TAKE_UP_MIN);
        let goal = self.pushed(memory.set_point.value()) + towards.sign() * travel;
        Some(Metres(self.command(goal)))
    }

    /// Where the nut is, at the lowest and at the highest.
    pub fn nut_at(&self, memory: &ScrewMemory) -> (Metres, Metres) {
        let (low, high) = self.nut(memory);
        (Metres(low), Metres(high))
    }

    /// The model this was made from.
    pub fn model(&self) -> &ScrewModel {
        &self.model
    }

    /// The limits it was checked against.
    pub fn limits(&self) -> Limits {
        self.limits
    }

    /// How lost motion is compensated.
    pub fn rule(&self) -> Rule {
        self.rule
    }

    /// The lowest and the highest target allowed.
    pub fn range(&self) -> (Metres, Metres) {
        self.range
    }

    /// A bound of |d deviation/d stroke|, below 1.
    pub fn steepest_slope(&self) -> f64 {
        self.steepest
    }

    /// Where a nut that is pushed forward is when the screw stands at `command`.
    fn pushed(&self, command: f64) -> f64 {
        command + self.model.forward(command)
    }

    fn nut(&self, memory: &ScrewMemory) -> (f64, f64) {
        let pushed = self.pushed(memory.set_point.value());
        let (least, most) = self.play.gaps(memory.engagement);
        (pushed + least, pushed + most)
    }

    fn engaged(&self, target: f64, memory: &ScrewMemory) -> f64 {
        let (low, high) = self.nut(memory);
        let resolution = self.limits.resolution.value().max(SNAP);
        let near = |place: f64| (target - place).abs() <= resolution;
        if near(low) && near(high) {
            return memory.set_point.value();
        }
        // Ahead of where the nut may be it is pushed forward for certain, behind it in reverse.
        // In between one of both leaves it short by no more than it is away from that end.
        if target - low >= high - target {
            self.command(target)
        } else {
            self.command(target - self.play.0)
        }
    }

    fn as_the_patent(&self, target: f64, memory: &ScrewMemory) -> f64 {
        let (low, high) = self.nut(memory);
        let linear = target - self.model.slope * target;
        let travel = target - (low + (high - low) / 2.0);
        if travel.abs() <= self.limits.resolution.value().max(SNAP) {
            memory.set_point.value()
        } else if travel > 0.0 {
            linear
        } else {
            linear - self.model.lost_motion.value()
        }
    }

    /// The command c with c + deviation(c, forward) = `goal`.
    fn command(&self, goal: f64) -> f64 {
        let model = &self.model;
        let scale = 1.0 + model.slope;
        let straight = (goal - model.offset.value()) / scale;
        if model.harmonics.is_empty() {
            return straight;
        }
        let lead = model.lead_m();
        let slope_at = |c: f64| {
            let waves = model.harmonics.iter().map(|it| it.slope_at(c, lead));
            scale + waves.sum::<f64>()
        };
        let mut c = straight - model.periodic(straight);
        for _ in 0..NEWTON_STEPS {
            let step = (self.pushed(c) - goal) / slope_at(c);
            c -= step;
            // The error after this step is its square times the curvature, far below rounding.
            if step.abs() <= 1e-9 * lead {
                return c;
            }
        }
        self.bisected(goal, straight)
    }

    /// For slopes so near 1 that Newton's steps wander; p is increasing, so this ends.
    #[cold]
    fn bisected(&self, goal: f64, straight: f64) -> f64 {
        let reach = self.ripple / (1.0 + self.model.slope);
        let (mut low, mut high) = (straight - reach, straight + reach);
        for _ in 0..80 {
            let middle = low + (high - low) / 2.0;
            if self.pushed(middle) < goal {
                low = middle;
            } else {
                high = middle;
            }
        }
        low + (high - low) / 2.0
    }

    /// Where the gap came from a reversal, its start may have been either side: the larger.
    fn u_model(&self, stroke: Metres, engagement: Engagement) -> Option<Metres> {
        let u = |approach| self.model.predict(stroke, approach).standard_uncertainty;
        match engagement {
            Engagement::Forward => u(Approach::Forward),
            Engagement::Reverse => u(Approach::Reverse),
            Engagement::Between { .. } | Engagement::Unknown => {
                Some(u(Approach::Forward)?.max(u(Approach::Reverse)?))
            }
        }
    }
}

#[cfg(test)]
#[path = "compensation_tests.rs"]
mod tests;
