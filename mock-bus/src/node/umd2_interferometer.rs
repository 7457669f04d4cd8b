//! A µMD2 laser interferometer: it streams one line for each sample, whoever listens.
//!
//! Source: J. Beck and S. M. Goldwasser, µMD2 manual v1.41 (see `wire::umd2` for the
//! format). Displacement is counted from where the counter was reset: at power-on. A lost
//! beam stops the count, and what moved meanwhile is lost for ever; so does a reflector that
//! moves too fast. Samples leave in small batches, as a USB device hands them over.
//!
//! Absent: commands of the host (the firmware streams by itself), axes 2 and 3.

use core::time::Duration;
use serde::Deserialize;
use std::collections::VecDeque;
use wire::Payload;
use wire::umd2::{DEFAULT_SAMPLE_RATE_HZ, LowSpeed, PHASE_STEPS, Sample};

use units::Time;

use super::{Node, Section};
use crate::config::error::{ConfigError, positive};
use crate::plant::config::PlantConfig;
use crate::plant::{Beam, Fringes, Plant};

/// What an interferometer is set to.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Umd2InterferometerConfig {
    /// Samples per second.
    pub sample_rate_hz: f64,
    /// Samples that leave together.
    pub batch_samples: u32,
    /// The laser head's split frequency.
    pub reference_frequency_khz: f64,
    /// From power-on to the first sample.
    pub boot_ms: f64,
    /// Reported as low-speed code 10.
    pub firmware: i32,
    /// Loses this sample now and then: one in so many (0: none).
    pub lost_sample_every: u32,
}

impl Default for Umd2InterferometerConfig {
    fn default() -> Self {
        Self {
            sample_rate_hz: DEFAULT_SAMPLE_RATE_HZ,
            batch_samples: 6,
            reference_frequency_khz: 1500.0,
            boot_ms: 200.0,
            firmware: 141,
            lost_sample_every: 0,
        }
    }
}

/// The low-speed channel's turns, one for each sample.
const LOW_SPEED_TURNS: u32 = 8;
/// What the firmware sets when the phase means nothing.
const PHASE_INVALID: u16 = 0x0200;
/// Signal strength of a good and of a weak beam, in percent.
const STRONG: i32 = 87;
const WEAK: i32 = 9;

/// The emulated interferometer.
///
/// # Example
///
/// ```
/// use mock_bus::node::Node;
/// use mock_bus::node::umd2_interferometer::{Umd2InterferometerConfig, Umd2InterferometerNode};
/// use mock_bus::plant::Plant;
/// use units::Time;
/// use wire::Payload;
/// use wire::umd2::Line;
///
/// let config = Umd2InterferometerConfig { batch_samples: 1, ..Default::default() };
/// let (mut laser, mut plant) = (Umd2InterferometerNode::new(&config), Plant::default());
/// laser.power_on(Time::ZERO, &mut plant);
/// laser.advance(laser.next_event(), &mut plant);
/// let greeting = Payload::Bytes(b"! uMD2 firmware 141\n".to_vec());
/// assert_eq!(laser.poll_transmit(), Some(greeting));
/// laser.advance(laser.next_event(), &mut plant);
/// let Some(Payload::Bytes(line)) = laser.poll_transmit() else { unreachable!("it streams") };
/// let line = String::from_utf8(line)?;
/// let Ok(Line::Sample(sample)) = Line::parse(line.trim_end()) else { unreachable!("{line}") };
/// assert_eq!(sample.reference_count, 2458, "1500 kHz at 610.35 samples a second");
/// # Ok::<(), std::string::FromUtf8Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Umd2InterferometerNode {
    config: Umd2InterferometerConfig,
    powered_at: Option<Time>,
    samples: u64,
    sequence: u32,
    /// Half wavelengths at which the count would be zero, once the counter runs.
    datum: Option<f64>,
    /// The count as it stood when the beam was last seen.
    count: f64,
    previous: i64,
    batch: Vec<u8>,
    batched: u32,
    outbox: VecDeque<Payload>,
}

impl Umd2InterferometerNode {
    /// An interferometer without power.
    pub fn new(config: &Umd2InterferometerConfig) -> Self {
        Self {
            config: config.clone(),
            powered_at: None,
            samples: 0,
            sequence: 0,
            datum: None,
            count: 0.0,
            previous: 0,
            batch: Vec::new(),
            batched: 0,
            outbox: VecDeque::new(),
        }
    }

    fn take_sample(&mut self, plant: &mut Plant) {
        let fringes = plant.fringes();
        self.samples += 1;
        self.sequence = self.sequence.wrapping_add(1);
        let sample = self.sample(&fringes, plant);
        let lost = self.config.lost_sample_every;
        if lost == 0 || !self.samples.is_multiple_of(u64::from(lost)) {
            sample.emit_into(&mut self.batch);
        }
        self.batched += 1;
        if self.batched >= self.config.batch_samples {
            self.hand_over();
        }
    }

    fn hand_over(&mut self) {
        self.batched = 0;
        if !self.batch.is_empty() {
            let next = Vec::with_capacity(self.batch.len());
            let batch = core::mem::replace(&mut self.batch, next);
            self.outbox.push_back(Payload::Bytes(batch));
        }
    }

    fn sample(&mut self, fringes: &Fringes, plant: &Plant) -> Sample {
        let lit = fringes.beam != Beam::Blocked && !fringes.too_fast;
        self.follow(fringes, lit);
        let (distance, phase) = split(self.count);
        let velocity = distance - self.previous;
        self.previous = distance;
        let reference = self.config.reference_frequency_khz * 1e3 / self.config.sample_rate_hz;
        let shift = fringes.half_wavelengths_per_s / self.config.sample_rate_hz;
        let dim = fringes.beam == Beam::Weak || !lit;
        Sample {
            reference_count: reference.round() as u32,
            measurement_count: if lit {
                (reference + shift).round().max(0.0) as u32
            } else {
                0
            },
            distance,
            velocity,
            phase: if dim { phase | PHASE_INVALID } else { phase },
            sequence: self.sequence,
            low_speed: self.low_speed(fringes.beam, plant),
        }
    }

    /// The counter follows the light; without light it stands, and takes the next light that
    /// it sees for the place where it stands.
    fn follow(&mut self, fringes: &Fringes, lit: bool) {
        if !lit {
            self.datum = None;
            return;
        }
        let datum = *self
            .datum
            .get_or_insert(fringes.half_wavelengths - self.count);
        self.count = fringes.half_wavelengths - datum;
    }

    fn low_speed(&self, beam: Beam, plant: &Plant) -> LowSpeed {
        let sensed = || plant.sensed_environment();
        match self.sequence % LOW_SPEED_TURNS {
            0 => LowSpeed::Temperature1(scaled(sensed().air_temperature.value(), 100.0)),
            1 => LowSpeed::Temperature2(scaled(sensed().stage_temperature.value(), 100.0)),
            2 => LowSpeed::Pressure(scaled(sensed().pressure.value() / 100.0, 100.0)),
            3 => LowSpeed::Humidity(scaled(sensed().humidity.value() * 100.0, 10.0)),
            4 => LowSpeed::SampleRate(scaled(self.config.sample_rate_hz, 100.0)),
            5 => LowSpeed::Firmware(self.config.firmware),
            6 => LowSpeed::SignalStrength(match beam {
                Beam::Good => STRONG,
                Beam::Weak => WEAK,
                Beam::Blocked => 0,
            }),
            _ => LowSpeed::None,
        }
    }

    fn sample_time(&self, powered_at: Time) -> Time {
        let boot_s = self.config.boot_ms * 1e-3;
        let s = boot_s + self.samples as f64 / self.config.sample_rate_hz;
        powered_at + Duration::from_nanos((s * 1e9).round() as u64)
    }
}

/// `count` = distance - phase / 256.
fn split(count: f64) -> (i64, u16) {
    let steps = (count * PHASE_STEPS).round() as i64;
    let distance = steps.div_euclid(PHASE_STEPS as i64) + 1;
    let phase = distance * PHASE_STEPS as i64 - steps;
    if phase == PHASE_STEPS as i64 {
        (distance - 1, 0)
    } else {
        (distance, phase as u16)
    }
}

fn scaled(value: f64, factor: f64) -> i32 {
    (value * factor).round() as i32
}

impl Section for Umd2InterferometerConfig {
    fn check(&self, _: &PlantConfig) -> Result<(), ConfigError> {
        positive("sample_rate_hz", self.sample_rate_hz)?;
        positive("batch_samples", f64::from(self.batch_samples))
    }

    fn build(&self, _: u64, _: &str) -> Box<dyn Node> {
        Box::new(Umd2InterferometerNode::new(self))
    }
}

impl Node for Umd2InterferometerNode {
    fn handle(&mut self, _now: Time, _payload: &Payload, _plant: &mut Plant) {}

    fn advance(&mut self, now: Time, plant: &mut Plant) {
        if self.next_event() <= now {
            self.take_sample(plant);
        }
    }

    fn next_event(&self) -> Time {
        self.powered_at
            .map_or(Time::NEVER, |at| self.sample_time(at))
    }

    fn poll_transmit(&mut self) -> Option<Payload> {
        self.outbox.pop_front()
    }

    fn power_off(&mut self, _now: Time, _plant: &mut Plant) {
        *self = Self::new(&self.config);
    }

    fn power_on(&mut self, now: Time, _plant: &mut Plant) {
        *self = Self::new(&self.config);
        self.powered_at = Some(now);
        let hello = format!("! uMD2 firmware {}\n", self.config.firmware);
        self.outbox.push_back(Payload::Bytes(hello.into_bytes()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::Servo;
    use wire::umd2::{Line, VACUUM_WAVELENGTH_M};

    struct Rig {
        node: Umd2InterferometerNode,
        plant: Plant,
        now: Time,
    }

    impl Rig {
        fn new() -> Self {
            let mut rig = Self {
                node: Umd2InterferometerNode::new(&Umd2InterferometerConfig::default()),
                plant: Plant::default(),
                now: Time::ZERO,
            };
            rig.node.power_on(Time::ZERO, &mut rig.plant);
            rig
        }

        fn run(&mut self, s: f64) -> Vec<Sample> {
            let end = self.now + Duration::from_secs_f64(s);
            let mut samples = Vec::new();
            while self.node.next_event() <= end {
                self.now = self.node.next_event();
                self.plant.advance(self.now);
                self.node.advance(self.now, &mut self.plant);
                while let Some(Payload::Bytes(bytes)) = self.node.poll_transmit() {
                    samples.extend(parse(&bytes));
                }
            }
            self.now = end;
            self.plant.advance(end);
            samples
        }

        fn go(&mut self, demand_m: f64) -> Vec<Sample> {
            self.plant.set_servo(0, Servo::Follow { demand: demand_m });
            self.run(0.4)
        }
    }

    fn parse(bytes: &[u8]) -> Vec<Sample> {
        let text = core::str::from_utf8(bytes).unwrap();
        text.lines()
            .filter_map(|line| match Line::parse(line).unwrap() {
                Line::Sample(sample) => Some(sample),
                Line::Debug => None,
            })
            .collect()
    }

    #[test]
    fn it_streams_at_its_rate_without_gaps_and_tells_the_climate() {
        let samples = Rig::new().run(1.2);
        assert!((600..=615).contains(&samples.len()), "{}", samples.len());
        assert!(
            samples
                .windows(2)
                .all(|pair| pair[1].lost_since(pair[0].sequence) == 0)
        );
        let air = samples.iter().find_map(|sample| match sample.low_speed {
            LowSpeed::Temperature1(value) => Some(value),
            _ => None,
        });
        assert!((2100..2160).contains(&air.unwrap()));
    }

    #[test]
    fn the_count_follows_the_true_displacement() {
        let mut rig = Rig::new();
        let before = rig.run(0.4).last().unwrap().half_wavelengths();
        let from = rig.plant.truth().position();
        let after = rig.go(1e-3).last().unwrap().half_wavelengths();
        let moved = rig.plant.truth().position() - from;
        let vacuum_m = (after - before) * VACUUM_WAVELENGTH_M / 2.0;
        let air_m = vacuum_m / 1.000_27;
        assert!((air_m - moved.value()).abs() < 30e-9, "{air_m} {moved}");
    }

    #[test]
    fn a_lost_beam_loses_the_count() {
        let mut rig = Rig::new();
        let before = *rig.run(0.4).last().unwrap();
        rig.plant.set_beam(Beam::Blocked);
        let dark = *rig.go(1e-3).last().unwrap();
        assert_eq!((dark.measurement_count, dark.velocity), (0, 0));
        assert!(!dark.phase_is_valid());
        rig.plant.set_beam(Beam::Good);
        let after = *rig.run(0.1).last().unwrap();
        let off = after.half_wavelengths() - before.half_wavelengths();
        assert!(off.abs() < 0.3 && after.measurement_count > 2000, "{off}");
    }

    #[test]
    fn a_count_is_split_as_the_codec_joins_it() {
        for count in [0.0, 0.25, -0.25, 5.998, -7.001, 1e6 + 0.5] {
            let (distance, phase) = split(count);
            let joined = distance as f64 - f64::from(phase) / 256.0;
            assert!((joined - count).abs() <= 0.5 / 256.0, "{count} {joined}");
            assert!(phase < 256);
        }
    }
}
