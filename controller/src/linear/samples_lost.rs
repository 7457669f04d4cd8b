//! What was read in a pass over the Hall sensors, and whether too much of it was lost.

use core::error::Error;
use core::fmt;
use core::time::Duration;

use compensator::hall_zero::{
    HallPoint, Outcome, RefineError, RefineOptions, Sample, Settings, refine,
};
use machine::HostDelays;
use units::Time;

/// Of the samples of a pass so many may be missing before they are the cause of whatever is wrong with the rest.
const MISSING_SHARE: f64 = 0.05;

/// What was read in a pass.
pub(super) struct PassRead {
    pub(super) points: Vec<HallPoint>,
    /// Samples that should have come between the others.
    pub(super) missing: u32,
    sampling: Duration,
    last: Option<Time>,
}

impl PassRead {
    /// Nothing yet, of a pass in which a sample is taken every `sampling`.
    pub(super) fn every(sampling: Duration) -> Self {
        Self {
            points: Vec::new(),
            missing: 0,
            sampling,
            last: None,
        }
    }

    pub(super) fn take(&mut self, sample: &Sample) {
        self.comes_to(sample.at);
        self.points.push(sample.point());
    }

    /// The pass, with whatever is missing of it, lasts until `at`.
    pub(super) fn comes_to(&mut self, at: Time) {
        if let Some(last) = self.last.replace(at) {
            let periods = at.since(last).as_secs_f64() / self.sampling.as_secs_f64();
            self.missing += (periods.round() as u32).saturating_sub(1);
        }
    }
}

/// What the samples that are missing do to a pass.
#[derive(Debug, PartialEq)]
pub(super) enum Loss {
    /// Nothing can be made of the others.
    Unusable(RefineError),
    /// So many are missing in a row that a flank, the peak or the zero may lie between them.
    Gap,
}

impl Loss {
    /// What is wrong with what was read between the flanks that a search has found; `None` where nothing is, or
    /// samples that are missing are not the cause.
    pub(super) fn of(read: &PassRead, settings: &Settings, outcome: &Outcome) -> Option<Self> {
        if read.missing == 0 {
            return None;
        }
        let all = read.points.len() as f64 + f64::from(read.missing);
        let is_cause = f64::from(read.missing) > all * MISSING_SHARE;
        let options = RefineOptions::for_search(settings);
        match refine(&read.points, &options) {
            Err(source @ RefineError::TooFewSamples { .. }) => Some(Self::Unusable(source)),
            Err(source) => {
                (is_cause && can_come_of_gaps(&source)).then_some(Self::Unusable(source))
            }
            Ok(_) => {
                let steps = read.points.windows(2);
                let mut apart = steps.map(|it| (it[1].position - it[0].position).abs());
                let window = outcome.window(settings);
                apart.any(|it| it > window).then_some(Self::Gap)
            }
        }
    }
}

/// Whether part of a curve that is missing can be the cause. What is there and does not fit is wrong by itself.
const fn can_come_of_gaps(error: &RefineError) -> bool {
    match error {
        RefineError::TooFewSamples { .. }
        | RefineError::PeakAtEnd { .. }
        | RefineError::FlankNotCovered { .. }
        | RefineError::NoCentre { .. }
        | RefineError::NoCrossing { .. }
        | RefineError::Asymmetric { .. }
        | RefineError::Swapped { .. }
        | RefineError::Fit { .. } => true,
        RefineError::NotFinite { .. }
        | RefineError::Jumped(_)
        | RefineError::SlopeInverted
        | RefineError::TooFewPasses { .. }
        | RefineError::LackOfFit { .. }
        | RefineError::TooManyOutliers { .. }
        | RefineError::Disagrees { .. } => false,
    }
}

/// A pass over the Hall sensors from which too many samples are missing, for an operator.
#[derive(Debug, PartialEq)]
pub struct SamplesLost {
    pub(super) axis: String,
    pub(super) loss: Loss,
    pub(super) missing: u32,
    /// Of how many.
    pub(super) of: u32,
    /// How late this computer was meanwhile.
    pub(super) delays: HostDelays,
    /// How often the pass had been made before.
    pub(super) again: u32,
}

impl SamplesLost {
    /// What is told when the pass is made again.
    pub(super) fn warning(&self) -> String {
        format!("{}; the pass is made again", self.seen())
    }

    fn seen(&self) -> String {
        let Self {
            axis, missing, of, ..
        } = self;
        let cause = match self.delays.is_none() {
            true => "this computer was not late for long, so frames of the axis or of the module were probably lost \
                     on the way"
                .to_owned(),
            false => self.delays.to_string(),
        };
        format!(
            "axis {axis}: hall zero: {missing} of {of} samples of the sensors were lost in a pass over them ({cause})"
        )
    }

    /// What helps.
    fn help(&self) -> &'static str {
        match self.delays.is_none() {
            true => {
                "look at cable, termination and load of the bus, and at what the module is set to send"
            }
            false => {
                "allow the program SCHED_FIFO (`ulimit -r`), give the computer less to do, or, where the machine is \
                 emulated, let it live slower (`--speed`)"
            }
        }
    }
}

impl fmt::Display for SamplesLost {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (seen, again, help) = (self.seen(), self.again, self.help());
        write!(
            f,
            "{seen}, and too many each of the {again} times that it was made again"
        )?;
        if let Loss::Unusable(source) = &self.loss {
            write!(f, "; {source}")?;
        }
        write!(f, "; {help}")
    }
}

impl Error for SamplesLost {}

#[cfg(test)]
mod tests {
    use units::{Metres, Volts};

    use super::*;

    /// Samples that should come every 5 ms, and came then.
    fn read(at_us: &[u64]) -> PassRead {
        let mut read = PassRead::every(Duration::from_millis(5));
        for at in at_us {
            read.take(&Sample {
                at: Time(at * 1000),
                position: Metres::ZERO,
                peak: Volts(2.0),
                slope: Volts(2.5),
                standing: false,
            });
        }
        read
    }

    #[test]
    fn samples_that_did_not_come_are_counted_and_those_that_came_late_are_not() {
        for (at_us, missing) in [
            (&[][..], 0),
            (&[7_000], 0),
            (&[5_000, 10_000, 15_000], 0),
            (&[5_000, 12_000, 15_000, 22_400], 0),
            (&[5_000, 15_000, 20_000], 1),
            (&[5_000, 610_000, 615_000, 625_000], 121),
        ] {
            let read = read(at_us);
            assert_eq!((read.missing, read.points.len()), (missing, at_us.len()));
        }
        let mut read = read(&[5_000, 10_000]);
        read.comes_to(Time(14_000_000));
        assert_eq!(read.missing, 0);
        read.comes_to(Time(44_000_000));
        assert_eq!(read.missing, 5, "the end is missing");
    }

    #[test]
    fn what_is_told_names_the_computer_where_it_was_late_and_the_bus_where_it_was_not() {
        let told = |delays: HostDelays| {
            let source = RefineError::TooFewSamples {
                around: Metres::from_mm(-0.8),
                seen: 13,
                needed: 14,
            };
            SamplesLost {
                axis: "x".to_owned(),
                loss: Loss::Unusable(source),
                missing: 120,
                of: 330,
                delays,
                again: 3,
            }
            .to_string()
        };
        let late = HostDelays {
            syncs: 120,
            pauses: Duration::ZERO,
        };
        for (said, words) in [
            (
                told(late),
                ["120 of 330", "120 SYNCs were left out", "ulimit -r"],
            ),
            (
                told(HostDelays::default()),
                ["13 samples around -0.8", "on the way", "cable"],
            ),
        ] {
            for word in words {
                assert!(said.contains(word), "`{word}` is not in: {said}");
            }
        }
    }
}
