//! The patent's search as a state machine: samples in, motion wishes out.
//!
//! One variant of [`State`] per step. "Stand still and take n samples" is: wish to stand, wait
//! until the axis stands, count n samples; if one leaves the band, start over. The patent then
//! goes on in the direction of the search; here the voltage says on which side of the band the
//! stop ended, and a stop that overshot creeps back, a bounded number of times.

mod band;
mod outcome;
mod sample;
mod watch;

use units::{Metres, Time, Volts};

use super::{
    HallPoint, Reason, SearchFailure, Sensor, SensorFault, Settings, SettingsError, Step, diagnose,
};
use band::{Band, Hold};
pub use outcome::{Outcome, Progress};
pub use sample::{Held, Sample};
use watch::{MotionWatch, Watch};

#[derive(Clone, Debug)]
enum State {
    GoToNominal,
    PeakForward {
        peak_max: Volts,
    },
    PeakReverse {
        peak_max: Volts,
    },
    LeftFlank {
        peak_max: Volts,
        hold: Hold,
    },
    CrossPeak {
        peak_max: Volts,
        g1: Held,
    },
    RightFlank {
        peak_max: Volts,
        g1: Held,
        hold: Hold,
    },
    Centre {
        peak_max: Volts,
        g1: Held,
        g2: Held,
        hold: Hold,
    },
    Done,
}

/// A running search. Feed it every sample; do what it says.
#[derive(Clone, Debug)]
pub struct Search {
    settings: Settings,
    nominal: Metres,
    start: Time,
    state: State,
    samples: Vec<Sample>,
    last: Option<Sample>,
    watches: [Watch; 2],
    motion: MotionWatch,
    restarts: u32,
}

impl Search {
    /// A search around `nominal`, the nominal zero in raw encoder coordinates.
    ///
    /// # Errors
    /// When a setting cannot work or the nominal zero is outside the soft limits.
    pub fn new(settings: Settings, nominal: Metres, start: Time) -> Result<Self, SettingsError> {
        settings.validate()?;
        let Settings {
            soft_min, soft_max, ..
        } = settings;
        if !(nominal >= soft_min && nominal <= soft_max) {
            return Err(SettingsError::NominalOutside {
                nominal,
                soft_min,
                soft_max,
            });
        }
        Ok(Self {
            settings,
            nominal,
            start,
            state: State::GoToNominal,
            samples: Vec::new(),
            last: None,
            watches: [Watch::new(Sensor::Peak), Watch::new(Sensor::Slope)],
            motion: MotionWatch::default(),
            restarts: 0,
        })
    }

    /// When the search gives up; call [`handle_timeout`](Self::handle_timeout) then.
    pub fn poll_timeout(&self) -> Time {
        match self.state {
            State::Done => Time::NEVER,
            _ => self.start + self.settings.time_limit,
        }
    }

    /// Gives up when the time limit has passed without samples to say so.
    pub fn handle_timeout(&mut self, now: Time) -> Option<Progress> {
        if now < self.poll_timeout() {
            return None;
        }
        let nothing = Volts(f64::NAN);
        let last = self.last.unwrap_or(Sample {
            at: now,
            position: self.nominal,
            peak: nothing,
            slope: nothing,
            standing: false,
        });
        Some(self.fail(&Sample { at: now, ..last }, Reason::TimedOut, None))
    }

    /// The step at work.
    pub fn step(&self) -> Step {
        match self.state {
            State::GoToNominal => Step::Start,
            State::PeakForward { .. } | State::PeakReverse { .. } => Step::Peak,
            State::LeftFlank { .. } => Step::LeftFlank,
            State::CrossPeak { .. } | State::RightFlank { .. } => Step::RightFlank,
            State::Centre { .. } => Step::Centre,
            State::Done => Step::Check,
        }
    }

    /// Takes a sample and says what to do. After the end it only says to stand.
    pub fn handle_sample(&mut self, sample: &Sample) -> Progress {
        if matches!(self.state, State::Done) {
            return Progress::Stand;
        }
        if let Some(reason) = self.reject(sample) {
            return self.fail(sample, reason, None);
        }
        self.last = Some(*sample);
        if !matches!(self.state, State::GoToNominal) {
            self.samples.push(*sample);
            let (v1, v2) = (sample.peak.value(), sample.slope.value());
            let [peak, slope] = &mut self.watches;
            let x = sample.position.value();
            let fault = peak.observe(v1, x, &self.settings);
            if let Some(fault) = fault.or(slope.observe(v2, x, &self.settings)) {
                return self.fail(sample, Reason::SensorFault, Some(fault));
            }
        }
        let progress = self.advance(sample);
        match progress {
            Progress::Move { to, .. } => match self.object(sample, to) {
                Some(reason) => self.fail(sample, reason, None),
                None => progress,
            },
            Progress::Stand => {
                self.motion.stand();
                progress
            }
            Progress::Found(_) | Progress::Failed(_) => progress,
        }
    }

    /// Why the motion towards `to` must not go on, if so: it ended in vain or does not happen.
    fn object(&mut self, sample: &Sample, to: Metres) -> Option<Reason> {
        let at_end = (to - sample.position).abs() <= self.settings.arrival;
        match self.state {
            State::GoToNominal if at_end => None,
            _ if at_end => Some(Reason::TravelExhausted),
            _ => self.motion.observe(sample, to, &self.settings),
        }
    }

    fn reject(&self, sample: &Sample) -> Option<Reason> {
        let finite =
            sample.position.is_finite() && sample.peak.is_finite() && sample.slope.is_finite();
        let in_order = self.last.is_none_or(|last| sample.at >= last.at);
        if !finite || !in_order {
            Some(Reason::BadSample)
        } else if sample.at.since(self.start) > self.settings.time_limit {
            Some(Reason::TimedOut)
        } else {
            None
        }
    }

    fn advance(&mut self, sample: &Sample) -> Progress {
        match core::mem::replace(&mut self.state, State::Done) {
            State::GoToNominal => self.go_to_nominal(sample),
            State::PeakForward { peak_max } => self.peak_forward(sample, peak_max),
            State::PeakReverse { peak_max } => self.peak_reverse(sample, peak_max),
            State::LeftFlank { peak_max, hold } => self.left_flank(sample, peak_max, hold),
            State::CrossPeak { peak_max, g1 } => self.cross_peak(sample, peak_max, g1),
            State::RightFlank { peak_max, g1, hold } => {
                self.right_flank(sample, peak_max, g1, hold)
            }
            State::Centre {
                peak_max,
                g1,
                g2,
                hold,
            } => self.centre(sample, peak_max, g1, g2, hold),
            State::Done => Progress::Stand,
        }
    }

    /// 11): at the nominal zero, V1max := V1.
    fn go_to_nominal(&mut self, sample: &Sample) -> Progress {
        let there = (sample.position - self.nominal).abs() <= self.settings.arrival;
        if there && sample.standing {
            self.samples.push(*sample);
            self.state = State::PeakForward {
                peak_max: sample.peak,
            };
            return self.forward();
        }
        self.state = State::GoToNominal;
        if there {
            return Progress::Stand;
        }
        Progress::Move {
            to: self.nominal,
            speed: self.settings.speed,
        }
    }

    /// 12), 13): on in +x until V1 has fallen Vc0 below its maximum.
    fn peak_forward(&mut self, sample: &Sample, peak_max: Volts) -> Progress {
        let peak_max = peak_max.max(sample.peak);
        if peak_max - sample.peak < self.settings.vc0 {
            self.state = State::PeakForward { peak_max };
            self.forward()
        } else {
            self.state = State::PeakReverse { peak_max };
            self.reverse()
        }
    }

    /// 14), 15): back in -x until V1 has fallen Vc - δ1 below its maximum.
    fn peak_reverse(&mut self, sample: &Sample, peak_max: Volts) -> Progress {
        let peak_max = peak_max.max(sample.peak);
        if peak_max - sample.peak < self.settings.vc - self.settings.delta1 {
            self.state = State::PeakReverse { peak_max };
            self.reverse()
        } else {
            self.left_flank(sample, peak_max, Hold::default())
        }
    }

    /// 21)–26): G1, where V1 is V1max - Vc.
    fn left_flank(&mut self, sample: &Sample, peak_max: Volts, mut hold: Hold) -> Progress {
        let Settings { vc, delta1, .. } = self.settings;
        let band = Band::peak(peak_max - vc, delta1, true);
        let (progress, held) = self.seek(sample, band, &mut hold);
        self.state = match held {
            Some(g1) => State::CrossPeak { peak_max, g1 },
            None => State::LeftFlank { peak_max, hold },
        };
        self.bounded(sample, progress)
    }

    /// 31), 32): over the peak in +x.
    fn cross_peak(&mut self, sample: &Sample, peak_max: Volts, g1: Held) -> Progress {
        let at_peak = (sample.peak - peak_max).abs() <= self.settings.delta1;
        self.state = if at_peak {
            State::RightFlank {
                peak_max,
                g1,
                hold: Hold::default(),
            }
        } else {
            State::CrossPeak { peak_max, g1 }
        };
        self.forward()
    }

    /// 33)–38): G2, where V1 is what it was at G1.
    fn right_flank(
        &mut self,
        sample: &Sample,
        peak_max: Volts,
        g1: Held,
        mut hold: Hold,
    ) -> Progress {
        let band = Band::peak(g1.peak, self.settings.delta2, false);
        let (progress, held) = self.seek(sample, band, &mut hold);
        self.state = match held {
            Some(g2) => State::Centre {
                peak_max,
                g1,
                g2,
                hold: Hold::default(),
            },
            None => State::RightFlank { peak_max, g1, hold },
        };
        self.bounded(sample, progress)
    }

    /// 41)–46): P0, where V2 is the mean of P1 and P2.
    fn centre(
        &mut self,
        sample: &Sample,
        peak_max: Volts,
        g1: Held,
        g2: Held,
        mut hold: Hold,
    ) -> Progress {
        let passed = sample.peak <= g1.peak - self.settings.vc;
        let band = Band::centre(&g1, &g2, self.settings.delta3);
        let (progress, held) = self.seek(sample, band, &mut hold);
        if let Some(p0) = held {
            return self.finish(sample, peak_max, g1, g2, p0);
        }
        self.state = State::Centre {
            peak_max,
            g1,
            g2,
            hold,
        };
        if passed {
            return self.fail(sample, Reason::CentrePassed, None);
        }
        self.bounded(sample, progress)
    }

    /// Seeks a band, stands in it and takes n samples: the common part of steps 2, 3 and 4.
    fn seek(&mut self, sample: &Sample, band: Band, hold: &mut Hold) -> (Progress, Option<Held>) {
        let excess = band.voltage(sample) - band.wanted;
        if excess.abs() > band.tolerance {
            let restarts = hold.restarts;
            hold.start_over();
            self.restarts += hold.restarts - restarts;
            let speed = match hold.restarts {
                0 => self.settings.speed,
                _ => self.settings.creep_speed,
            };
            let towards_plus = (excess < Volts::ZERO) == band.rising;
            let to = if towards_plus {
                self.bounds().1
            } else {
                self.bounds().0
            };
            return (Progress::Move { to, speed }, None);
        }
        hold.wished = true;
        if sample.standing {
            hold.add(sample);
        }
        if hold.count >= self.settings.samples {
            return (Progress::Stand, Some(hold.mean()));
        }
        (Progress::Stand, None)
    }

    /// Ends a step whose band was started over too often.
    fn bounded(&mut self, sample: &Sample, progress: Progress) -> Progress {
        let restarts = match &self.state {
            State::LeftFlank { hold, .. }
            | State::RightFlank { hold, .. }
            | State::Centre { hold, .. } => hold.restarts,
            _ => 0,
        };
        if restarts > self.settings.restarts_max {
            return self.fail(sample, Reason::TooManyRestarts, None);
        }
        progress
    }

    /// 51): the check of step 5, and the look at the curves as a whole.
    fn finish(
        &mut self,
        sample: &Sample,
        peak_max: Volts,
        g1: Held,
        g2: Held,
        p0: Held,
    ) -> Progress {
        self.state = State::Done;
        let fault = self.diagnose();
        let off = (p0.peak - peak_max).abs() > self.settings.delta4;
        if off || fault.is_some() {
            let reason = if off {
                Reason::CheckFailed
            } else {
                Reason::SensorFault
            };
            let band = Band::peak(peak_max, self.settings.delta4, false);
            let at_p0 = Sample {
                peak: p0.peak,
                ..*sample
            };
            return self.fail_in(Step::Check, band, &at_p0, reason, fault);
        }
        Progress::Found(Box::new(Outcome {
            peak_max,
            g1,
            g2,
            p0,
            samples: core::mem::take(&mut self.samples),
            elapsed: sample.at.since(self.start),
            restarts: self.restarts,
        }))
    }

    /// Lowest and highest position of the search.
    fn bounds(&self) -> (Metres, Metres) {
        let Settings {
            search_limit,
            soft_min,
            soft_max,
            ..
        } = self.settings;
        (
            (self.nominal - search_limit).max(soft_min),
            (self.nominal + search_limit).min(soft_max),
        )
    }

    fn forward(&self) -> Progress {
        Progress::Move {
            to: self.bounds().1,
            speed: self.settings.speed,
        }
    }

    fn reverse(&self) -> Progress {
        Progress::Move {
            to: self.bounds().0,
            speed: self.settings.speed,
        }
    }

    /// The band the present step looks for.
    fn band(&self) -> Band {
        let Settings {
            vc,
            vc0,
            delta1,
            delta2,
            delta3,
            ..
        } = self.settings;
        match &self.state {
            State::GoToNominal | State::Done => Band::peak(Volts::ZERO, Volts::ZERO, false),
            State::PeakForward { peak_max } => Band::peak(*peak_max - vc0, delta1, false),
            State::PeakReverse { peak_max } | State::LeftFlank { peak_max, .. } => {
                Band::peak(*peak_max - vc, delta1, true)
            }
            State::CrossPeak { peak_max, .. } => Band::peak(*peak_max, delta1, true),
            State::RightFlank { g1, .. } => Band::peak(g1.peak, delta2, false),
            State::Centre { g1, g2, .. } => Band::centre(g1, g2, delta3),
        }
    }

    fn diagnose(&self) -> Option<SensorFault> {
        let points: Vec<HallPoint> = self.samples.iter().map(Sample::point).collect();
        diagnose(&points, self.nominal, &self.settings)
    }

    fn fail(&mut self, sample: &Sample, reason: Reason, fault: Option<SensorFault>) -> Progress {
        let (step, band) = (self.step(), self.band());
        let cause = fault.or_else(|| self.diagnose());
        self.fail_in(step, band, sample, reason, cause)
    }

    fn fail_in(
        &mut self,
        step: Step,
        band: Band,
        sample: &Sample,
        reason: Reason,
        cause: Option<SensorFault>,
    ) -> Progress {
        self.state = State::Done;
        Progress::Failed(Box::new(SearchFailure {
            step,
            reason,
            sensor: band.sensor,
            seen: band.voltage(sample),
            wanted: band.wanted,
            tolerance: band.tolerance,
            searched: (sample.position - self.nominal).abs(),
            search_limit: self.settings.search_limit,
            elapsed: sample.at.since(self.start),
            cause,
            samples: core::mem::take(&mut self.samples),
        }))
    }
}
