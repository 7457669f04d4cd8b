//! The µMD2 laser interferometer: a stream of samples over a serial line.
//!
//! Source: J. Beck and S. M. Goldwasser, µMD2 manual v1.41 and InterferometerGUI; the line
//! format is [`wire::umd2`]'s. Displacement = (distance − phase/256) · λ/2 / n, where
//! n is the optics factor (1 plane mirror single pass, 2 double pass, 4 …).
//!
//! The instrument counts fringes; once it has missed some, its number means nothing. Hence
//! a lost beam, a lost laser, a slew error, a restart of the firmware and an impossible jump
//! void the datum: nothing is read until [`DisplacementInstrument::set_datum`]. Lost lines
//! do not, the counter counts on; samples whose phase is flagged invalid are left out.
//! Absent: axes 2 and 3; the cross-check with the encoder (fringe jumps), which needs both
//! and is the controller's.

mod health;
mod sequence;
mod settings;
mod start;
mod weather;

use core::time::Duration;
use std::collections::VecDeque;
use units::{Metres, Time};
use wire::Payload;
use wire::umd2::{Line, LowSpeed, Sample};
use wire::{Input, LinkState};

use self::health::{fault_of, trouble_of};
use self::sequence::{Continuity, Sequence};
pub use self::settings::Umd2Settings;
use self::weather::Weather;
use super::average::{Averaging, RunningAverage};
use super::serial_line::{AssembledLine, LineAssembler};
use super::{
    Alarm, Device, DeviceError, DeviceName, DisplacementInstrument, DisplacementReading,
    Environment, Identity, Signal,
};

const NAME: DeviceName = DeviceName::Serial("interferometer");
/// Sixteen fields of at most 20 characters.
const LINE_MAX: usize = 16 * 21;
/// Sequence numbers that jump by more than this long a gap began anew.
const GAP_MAX_S: f64 = 600.0;
/// Impossible jumps in a row that are no damaged lines any more.
const JUMPS_MAX: u32 = 3;

/// Whether the count means anything.
#[derive(Clone, Copy, Debug, PartialEq)]
enum State {
    /// Not started.
    Idle,
    /// Waits for good samples in a row; `fault` is why the last one was none.
    Starting {
        since: Time,
        good: u32,
        fault: Option<Alarm>,
    },
    /// The displacement counts from here (in half wavelengths).
    Tracking { datum: f64 },
    /// The next good sample becomes the datum.
    WantsDatum,
    /// The count was lost.
    Lost,
}

/// A µMD2.
#[derive(Debug)]
pub struct Umd2 {
    settings: Umd2Settings,
    state: State,
    lines: LineAssembler,
    /// The newest good sample of an unbroken count, and when it came.
    newest: Option<(Sample, Time)>,
    sequence: Sequence,
    heard: Time,
    is_silent: bool,
    garbage_in_a_row: u64,
    jumps_in_a_row: u32,
    averaging: Averaging,
    weather: Weather,
    firmware: Option<i32>,
    outcome: Option<Result<(), DeviceError>>,
    alarms: VecDeque<Alarm>,
    counts: Counts,
}

#[derive(Debug, Default)]
struct Counts {
    samples: u64,
    lost: u64,
    garbage: u64,
    invalid_phase: u64,
    impossible_jumps: u64,
    beam_losses: u64,
    transport_losses: u64,
}

impl Umd2 {
    /// An interferometer that has not been started.
    ///
    /// # Panics
    /// When wavelength, optics factor or sample rate are not positive: the configuration
    /// has been checked before.
    pub fn new(settings: Umd2Settings) -> Self {
        let wavelength = settings.vacuum_wavelength;
        assert!(wavelength.is_finite() && wavelength > Metres::ZERO);
        assert!(settings.optics_factor > 0 && settings.sample_rate_hz > 0.0);
        Self {
            weather: Weather::new(settings.environment_age_max),
            sequence: Sequence::new((GAP_MAX_S * settings.sample_rate_hz) as u64),
            settings,
            state: State::Idle,
            lines: LineAssembler::new(b'\n', LINE_MAX),
            newest: None,
            heard: Time::ZERO,
            is_silent: false,
            garbage_in_a_row: 0,
            jumps_in_a_row: 0,
            averaging: Averaging::Never,
            firmware: None,
            outcome: None,
            alarms: VecDeque::new(),
            counts: Counts::default(),
        }
    }

    fn bytes(&mut self, now: Time, mut bytes: &[u8]) {
        while !bytes.is_empty() {
            match self.lines.take(&mut bytes) {
                None => {}
                Some(AssembledLine::Overlong) => self.garbage(),
                Some(AssembledLine::Whole(line)) => self.line(now, &line),
            }
        }
    }

    fn line(&mut self, now: Time, line: &[u8]) {
        match core::str::from_utf8(line).map(Line::parse) {
            Ok(Ok(Line::Sample(sample))) => self.sample(now, sample),
            Ok(Ok(Line::Debug)) => {}
            Ok(Err(_)) | Err(_) => self.garbage(),
        }
    }

    fn garbage(&mut self) {
        self.counts.garbage += 1;
        self.garbage_in_a_row += 1;
        if self.garbage_in_a_row == self.settings.garbage_lines_max {
            let lines = self.garbage_in_a_row;
            self.raise(Alarm::Garbage { lines });
        }
    }

    /// Reports, and ends what cannot go on.
    fn raise(&mut self, alarm: Alarm) {
        self.alarms.push_back(alarm);
        if let Averaging::Running(_) = self.averaging {
            self.averaging = Averaging::Never;
            self.outcome = Some(Err(DeviceError::Alarmed {
                device: NAME,
                step: "average",
                alarm,
            }));
        }
    }

    /// The count means nothing any more; told once.
    fn lose_count(&mut self, alarm: Alarm) {
        match self.state {
            State::Idle | State::Lost => {}
            // While starting, a bad sample just begins the row anew.
            State::Starting { since, .. } => self.start_again(since, Some(alarm)),
            State::Tracking { .. } | State::WantsDatum => {
                self.counts.beam_losses += 1;
                self.state = State::Lost;
                self.raise(alarm);
            }
        }
        self.newest = None;
        self.jumps_in_a_row = 0;
    }

    fn sample(&mut self, now: Time, sample: Sample) {
        let garbage = core::mem::take(&mut self.garbage_in_a_row);
        self.heard = now;
        self.weather.see(now, trouble_of(&sample));
        self.is_silent = false;
        self.counts.samples += 1;
        self.low_speed(now, sample.low_speed);
        match self.sequence.take(&sample, garbage) {
            Continuity::Follows => {}
            Continuity::Doubtful => return self.unusable(1, 0),
            Continuity::Gap(missing) => self.note_missing(missing),
            Continuity::Restart => return self.lose_count(Alarm::CountRestarted),
        }
        if let Some(alarm) = fault_of(&sample) {
            self.lose_count(alarm);
        } else if !sample.phase_is_valid() {
            self.counts.invalid_phase += 1;
            self.unusable(1, 1);
        } else if self.is_impossible(&sample) {
            self.impossible();
        } else {
            self.good_sample(now, sample);
        }
    }

    fn low_speed(&mut self, now: Time, value: LowSpeed) {
        self.weather.take(now, value);
        match value {
            LowSpeed::Firmware(version) => self.firmware = Some(version),
            LowSpeed::SignalStrength(strength) => {
                let least = self.settings.signal_strength_min.unwrap_or(i32::MIN);
                if strength < least {
                    self.lose_count(Alarm::BeamLost);
                }
            }
            _ => {}
        }
    }

    /// The count survives missing lines.
    fn note_missing(&mut self, missing: u64) {
        self.counts.lost += missing;
        if let State::Starting { since, fault, .. } = self.state {
            self.start_again(since, fault);
        }
        self.unusable(missing, 0);
    }

    /// Samples that an average lacks, and how many of them for want of light.
    fn unusable(&mut self, count: u64, dim: u64) {
        if let Averaging::Running(average) = &mut self.averaging {
            average.lacking += count;
            average.dim += dim;
            let (lost, samples) = (average.lacking, average.dim);
            if lost > self.settings.lost_samples_max {
                self.raise(if samples * 2 > lost {
                    Alarm::BeamWeak { samples }
                } else {
                    Alarm::SamplesLost { lost }
                });
            }
        }
    }

    /// Faster than the electronics can count: measurement and reference frequency differ
    /// by less than the reference, so no sample is further than that from the one before.
    fn is_impossible(&self, sample: &Sample) -> bool {
        let Some((before, _)) = &self.newest else {
            return false;
        };
        let samples = sample.lost_since(before.sequence).saturating_add(1);
        let possible =
            u64::from(sample.reference_count.max(before.reference_count)).saturating_mul(samples);
        sample.distance.abs_diff(before.distance) > possible
    }

    /// One may be a damaged line that still reads as a sample; several are not.
    fn impossible(&mut self) {
        self.counts.impossible_jumps += 1;
        self.jumps_in_a_row += 1;
        self.unusable(1, 0);
        if self.jumps_in_a_row >= JUMPS_MAX {
            self.lose_count(Alarm::SlewError);
        }
    }

    fn good_sample(&mut self, now: Time, sample: Sample) {
        self.jumps_in_a_row = 0;
        self.newest = Some((sample, now));
        let half_wavelengths = sample.half_wavelengths();
        match self.state {
            State::Idle | State::Lost => {}
            State::Starting { since, good, .. } => {
                let good = good + 1;
                let fault = None;
                self.state = State::Starting { since, good, fault };
                if good >= self.settings.start_samples {
                    self.track_from(half_wavelengths);
                    self.outcome = Some(Ok(()));
                }
            }
            State::WantsDatum => {
                self.track_from(half_wavelengths);
                self.average(now, 0.0);
            }
            State::Tracking { datum } => self.average(now, half_wavelengths - datum),
        }
    }

    const fn track_from(&mut self, datum: f64) {
        self.state = State::Tracking { datum };
    }

    fn average(&mut self, now: Time, half_wavelengths: f64) {
        let displacement = self.displacement(half_wavelengths);
        if let Averaging::Running(average) = &mut self.averaging
            && let Some(reading) = average.add(now, displacement)
        {
            self.averaging = Averaging::Done(reading);
            self.outcome = Some(Ok(()));
        }
    }

    fn displacement(&self, half_wavelengths: f64) -> Metres {
        let optics = f64::from(self.settings.optics_factor);
        let per_half = self.settings.vacuum_wavelength / (2.0 * optics);
        per_half * (half_wavelengths * self.settings.direction.sign())
    }

    fn link(&mut self, state: LinkState) {
        self.lines.skip_message();
        if state != LinkState::Up {
            // Unplugged means without power: it will count from nothing.
            self.sequence.forget();
            let waited = Duration::ZERO;
            self.lose_count(Alarm::StreamSilent { waited });
        }
    }

    fn silent(&mut self, now: Time) {
        let waited = now.since(self.heard);
        if !self.is_silent && waited >= self.settings.stream_timeout {
            self.is_silent = true;
            // The count may have survived; whether it did, the next sample's number says.
            self.raise(Alarm::StreamSilent { waited });
        }
    }
}

impl Device for Umd2 {
    fn handle(&mut self, now: Time, input: &Input) {
        match input {
            Input::Payload(Payload::Bytes(bytes)) => self.bytes(now, bytes),
            Input::Link(state) => self.link(*state),
            Input::Lost(_) => {
                self.counts.transport_losses += 1;
                self.lines.skip_message();
            }
            Input::Payload(Payload::Frame(_) | Payload::Control(_)) | Input::BusError(_) => {}
        }
    }

    fn handle_timeout(&mut self, now: Time) {
        match self.state {
            State::Idle => {}
            State::Starting { since, good, fault } => self.start_ended(now, since, good, fault),
            State::Tracking { .. } | State::WantsDatum | State::Lost => self.silent(now),
        }
    }

    fn poll_timeout(&self) -> Time {
        match self.state {
            State::Idle => Time::NEVER,
            State::Starting { since, .. } => since + self.settings.start_timeout,
            State::Tracking { .. } | State::WantsDatum | State::Lost if self.is_silent => {
                Time::NEVER
            }
            State::Tracking { .. } | State::WantsDatum | State::Lost => {
                self.heard + self.settings.stream_timeout
            }
        }
    }

    /// It only talks.
    fn poll_transmit(&mut self) -> Option<Payload> {
        None
    }

    fn poll_alarm(&mut self) -> Option<Alarm> {
        self.alarms.pop_front()
    }

    fn start(&mut self, now: Time) {
        self.start_again(now, None);
        self.outcome = None;
        self.averaging = Averaging::Never;
        self.newest = None;
        self.sequence.forget();
        self.is_silent = false;
        self.lines.skip_message();
    }

    fn poll_outcome(&mut self) -> Option<Result<(), DeviceError>> {
        self.outcome.take()
    }

    fn identity(&self) -> Option<Identity> {
        if matches!(self.state, State::Idle | State::Starting { .. }) {
            return None;
        }
        let name = match self.firmware {
            Some(version) => format!("uMD2 firmware {version}"),
            None => "uMD2".to_owned(),
        };
        Some(Identity {
            name,
            ..Identity::default()
        })
    }

    fn counters(&self) -> Vec<(&'static str, u64)> {
        vec![
            ("samples", self.counts.samples),
            ("samples_lost", self.counts.lost),
            ("garbage_lines", self.counts.garbage),
            ("invalid_phase", self.counts.invalid_phase),
            ("impossible_jumps", self.counts.impossible_jumps),
            ("counts_lost", self.counts.beam_losses),
            ("transport_losses", self.counts.transport_losses),
        ]
    }
}

impl DisplacementInstrument for Umd2 {
    fn begin_average(&mut self, now: Time, samples: u32) {
        self.outcome = None;
        let needs = match self.state {
            State::Tracking { .. } | State::WantsDatum if samples == 0 => "at least one sample",
            State::Tracking { .. } | State::WantsDatum if self.is_silent => "a stream of samples",
            State::Tracking { .. } | State::WantsDatum => {
                self.averaging = Averaging::Running(RunningAverage::new(
                    now + self.settings.arrival_latency,
                    samples,
                ));
                return;
            }
            State::Lost => "a new datum, since the count was lost",
            State::Idle | State::Starting { .. } => "a started interferometer",
        };
        self.averaging = Averaging::Never;
        self.outcome = Some(Err(DeviceError::NotPossible {
            device: NAME,
            step: "average",
            needs,
        }));
    }

    fn average(&self) -> Option<DisplacementReading> {
        self.averaging.reading()
    }

    fn latest(&self) -> Option<DisplacementReading> {
        let (State::Tracking { datum }, Some((sample, at))) = (self.state, &self.newest) else {
            return None;
        };
        Some(DisplacementReading {
            at: *at,
            vacuum: self.displacement(sample.half_wavelengths() - datum),
            standard_deviation: Metres::ZERO,
            samples: 1,
        })
    }

    fn set_datum(&mut self, now: Time) {
        match (self.state, &self.newest) {
            (State::Idle | State::Starting { .. }, _) => {}
            (State::Tracking { .. } | State::WantsDatum, Some((sample, at)))
                if now.since(*at) < self.settings.stream_timeout =>
            {
                self.track_from(sample.half_wavelengths());
            }
            (State::Tracking { .. } | State::WantsDatum | State::Lost, _) => {
                self.newest = None;
                self.state = State::WantsDatum;
            }
        }
    }

    fn environment(&self) -> Environment {
        if self.is_silent {
            return Environment::default();
        }
        self.weather.at(self.heard)
    }

    fn signal(&self) -> Option<Signal> {
        self.weather.signal(self.settings.signal_strength_min)
    }

    /// It streams without end, and only a start or an average waits for its lines.
    fn is_unhurried(&self) -> bool {
        !matches!(self.state, State::Starting { .. })
            && !matches!(self.averaging, Averaging::Running(_))
    }
}

#[cfg(test)]
mod tests;
