//! Passes over both flanks of the zero: where they begin and end, how fast they are, and what is read on the way.
//!
//! A computer that is held up, or a bus that loses frames, takes samples away from a pass. Where that spoils it the
//! pass is made again, from where it began.

use core::time::Duration;

use compensator::hall_zero::{HallPoint, Outcome, Pass, Settings};
use drivers::device::AxisCommand;
use units::{Approach, Metres, MetresPerSecond};

use crate::failure::Failure;
use crate::linear::ZeroConfig;
use crate::linear::samples_lost::{Loss, PassRead, SamplesLost};
use crate::linear::stage::LinearStage;
use machine::{Stage, host_delays};

/// How often both flanks are passed, half of them in reverse; two in each direction would do.
const PASSES: u32 = 6;
/// How long the axis stands before each pass. A pass that begins while the axis still creeps into its place
/// shows the error of the stop before it once more, and nothing of what the axis repeats to: a servo of 5 Hz,
/// the softest that is foreseen, is within a thousandth of its last motion after this time.
pub(super) const BETWEEN_PASSES: Duration = Duration::from_millis(250);
/// A pass begins and ends this share of the distance of G1 and G2 beyond them.
const PASS_MARGIN: f64 = 0.1;
/// Each pass of a direction begins by this share of the distance of two samples further in than the one before
/// it. Without that a quiet stage is read at the very same places by all passes of a direction: the steps of the
/// converter, and what the scale errs within one of its periods, are the same in each then, and no scatter of
/// the passes shows them. (A share that no step and no period is a multiple of: the golden section.)
const STAGGER: f64 = 0.382;
/// How often a pass is made again that lost its samples.
const AGAIN_MAX: u32 = 3;
/// The steps of zeroing that progress counts: up to the search, its passes, and the new origin.
pub(super) const SEARCHED: u64 = 3;
pub(super) const STEPS: u64 = SEARCHED + PASSES as u64 + 1;

impl LinearStage<'_> {
    /// Passes over both flanks, forward and in reverse by turns: what lost motion and repeatability do to
    /// an origin shows between them.
    pub(super) fn passes(
        &mut self,
        config: &ZeroConfig,
        settings: &Settings,
        outcome: &Outcome,
    ) -> Result<Vec<Pass>, Failure> {
        let (low, high) = pass_ends(settings, outcome);
        let speed = self.pass_speed(config, settings, outcome);
        let apart = Metres(speed.value() * self.sampling(config).as_secs_f64());
        let stagger = |number: u32| apart * (STAGGER * f64::from(number));
        self.pass(config, low, speed)?;
        let (mut begin, limits) = (low, (settings, outcome));
        (0..PASSES)
            .map(|number| {
                // Where one direction ends, the other one begins.
                let (approach, end) = match number % 2 {
                    0 => (Approach::Forward, high - stagger(number / 2)),
                    _ => (Approach::Reverse, low + stagger(number / 2 + 1)),
                };
                let points = self.whole_pass(config, limits, (begin, end), speed)?;
                begin = end;
                let done = SEARCHED + u64::from(number) + 1;
                let observer = self.core.observer();
                observer.progress(Stage::Zero, self.axis, done, STEPS);
                Ok(Pass { approach, points })
            })
            .collect()
    }

    /// The usual speed, or so slow that the flanks get the samples that they need.
    pub(super) fn pass_speed(
        &self,
        config: &ZeroConfig,
        settings: &Settings,
        outcome: &Outcome,
    ) -> MetresPerSecond {
        let fastest = outcome.fastest_pass(settings, self.sampling(config));
        self.usual_pass_speed(config, settings).min(fastest)
    }

    /// Voltages that are sampled with the position are as good at four times the speed, as a delay drops out of
    /// the mean of both directions; those that are asked for are not, as nobody knows the delay of each.
    pub(super) fn usual_pass_speed(
        &self,
        config: &ZeroConfig,
        settings: &Settings,
    ) -> MetresPerSecond {
        let module = &self.core.config.analog[&config.analog];
        match module.poll_period() == Duration::ZERO {
            true => settings.speed * 4.0,
            false => settings.speed,
        }
    }

    /// A pass from `begin`, where the axis is, to `end` that has the samples that the regression needs.
    fn whole_pass(
        &mut self,
        config: &ZeroConfig,
        (settings, outcome): (&Settings, &Outcome),
        (begin, end): (Metres, Metres),
        speed: MetresPerSecond,
    ) -> Result<Vec<HallPoint>, Failure> {
        let mut again = 0;
        loop {
            self.rest(BETWEEN_PASSES)?;
            let before = host_delays(self.core.machine);
            let read = self.pass(config, end, speed)?;
            let Some(loss) = Loss::of(&read, settings, outcome) else {
                return Ok(read.points);
            };
            let lost = SamplesLost {
                axis: self.axis.to_owned(),
                loss,
                of: read.points.len() as u32 + read.missing,
                missing: read.missing,
                delays: host_delays(self.core.machine).since(before),
                again,
            };
            match lost.loss {
                Loss::Gap if again == AGAIN_MAX => return Ok(read.points),
                Loss::Unusable(_) if again == AGAIN_MAX => {
                    return Err(Failure::SamplesLost(Box::new(lost)));
                }
                Loss::Gap | Loss::Unusable(_) => {}
            }
            self.core.observer().warning(&lost.warning());
            again += 1;
            self.pass(config, begin, speed)?;
        }
    }

    /// Goes to `end`; what was read on the way.
    pub(super) fn pass(
        &mut self,
        config: &ZeroConfig,
        end: Metres,
        speed: MetresPerSecond,
    ) -> Result<PassRead, Failure> {
        let acceleration = self.core.axis_settings(self.axis)?.acceleration;
        let command = AxisCommand::MoveTo {
            target: end,
            speed,
            acceleration,
        };
        let mut pairing = self.pairing(config);
        let mut read = PassRead::every(self.sampling(config));
        self.core.begin(self.axis, command)?;
        loop {
            let deadline = self.core.now() + Duration::from_millis(100);
            self.core.tick(deadline)?;
            let arrived = self.core.outcome(self.axis)?;
            let sample = self.paired_sample(config, &mut pairing)?;
            if let Some(sample) = sample {
                read.take(&sample);
            }
            if let Some(outcome) = arrived {
                outcome?;
                read.comes_to(self.core.now());
                return Ok(read);
            }
        }
    }
}

/// Where passes begin and end: beyond both flanks, within the bounds of the search.
fn pass_ends(settings: &Settings, outcome: &Outcome) -> (Metres, Metres) {
    let margin = (outcome.g2.position - outcome.g1.position) * PASS_MARGIN;
    let low = settings.soft_min.max(Metres::ZERO - settings.search_limit);
    let high = settings.soft_max.min(settings.search_limit);
    (
        low.max(outcome.g1.position - margin),
        high.min(outcome.g2.position + margin),
    )
}
