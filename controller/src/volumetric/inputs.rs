//! Which of the engine's channels belong to each detector, and whether its value is accepted.

use core::time::Duration;

use compensator::volumetric::online::{JumpWatch, RollOptics, Sample, Shown, StuckWatch, Trouble};
use units::{Metres, Quantity, Radians, Time, Volts};

use crate::config::{AnalogConfig, MachineConfig};
use crate::volumetric::settings::roll_optics;
use crate::volumetric::{BeamConfig, DetectorConfig, RollConfig};
use machine::engine::{Channel, Observed};

use crate::volumetric::VolumetricFailure;

/// Where the voltage `channel` of `module` stands among all modules' channels.
pub(super) fn place_of_voltage(config: &MachineConfig, module: &str, channel: u8) -> usize {
    place(config, module, channel, |it| &it.channels)
}

/// Likewise of a thermometer.
pub(super) fn place_of_temperature(config: &MachineConfig, module: &str, channel: u8) -> usize {
    place(config, module, channel, AnalogConfig::temperature_channels)
}

/// The engine lists the modules in the order of their names.
fn place(
    config: &MachineConfig,
    module: &str,
    channel: u8,
    channels: fn(&AnalogConfig) -> &[u8],
) -> usize {
    let modules = config.analog.iter();
    let before = modules.take_while(|(name, _)| **name != module);
    let before: usize = before.map(|(_, it)| channels(it).len()).sum();
    let own = channels(&config.analog[module]);
    let within = own.iter().position(|it| *it == channel);
    before + within.unwrap_or(own.len())
}

/// The detector on the slide.
pub(super) fn slide_of(beam: &BeamConfig) -> Result<DetectorConfig<'_>, VolumetricFailure> {
    let section = "beam.slider";
    let missing = VolumetricFailure::NotConfigured { section };
    beam.on_the_slide().ok_or(missing)
}

/// Where what a detector shows stands among all that is observed.
#[derive(Clone, Copy, Debug)]
pub(super) enum DetectorPlace {
    /// Four channels.
    Channels([usize; 4]),
    /// A camera.
    Spot(usize),
}

impl DetectorPlace {
    pub(super) fn of(config: &MachineConfig, detector: DetectorConfig<'_>) -> Self {
        match detector {
            DetectorConfig::Channels(own) => {
                let place = |channel| place_of_voltage(config, &own.analog, channel);
                Self::Channels(own.channels.map(place))
            }
            // The engine lists the cameras in the order of their names.
            DetectorConfig::Camera(own) => {
                let before = config.camera.keys().take_while(|it| **it != own.camera);
                Self::Spot(before.count())
            }
        }
    }

    /// What it shows; `None` before the first sample or picture.
    pub(super) fn shown(&self, observed: &Observed<'_>) -> Option<Shown> {
        match self {
            Self::Channels(places) => sample(observed.channels, places).map(Shown::from),
            Self::Spot(place) => {
                let spot = observed.spots.get(*place).copied().flatten();
                spot.map(Shown::Camera)
            }
        }
    }
}

/// Four voltages of one moment; `None` before the first sample.
fn sample(channels: &[Option<Channel>], places: &[usize; 4]) -> Option<Sample> {
    let mut sample = Sample {
        channels: [Volts::ZERO; 4],
        at: Time::NEVER,
    };
    for (volts, place) in sample.channels.iter_mut().zip(places) {
        let channel = channels.get(*place).copied().flatten()?;
        *volts = channel.volts;
        sample.at = sample.at.min(channel.at);
    }
    Some(sample)
}

/// How often a feed of `detector` is given the same: that of a camera is given each picture once.
pub(super) fn repeats_of(config: &MachineConfig, detector: DetectorConfig<'_>) -> u32 {
    match detector {
        DetectorConfig::Channels(own) => repeats_of_module(config, &own.analog),
        DetectorConfig::Camera(_) => 1,
    }
}

/// Likewise of a module's channels: one that samples every n SYNCs gives the same n times.
pub(super) fn repeats_of_module(config: &MachineConfig, module: &str) -> u32 {
    let every = config.analog.get(module).and_then(|it| it.every_syncs());
    every.unwrap_or(1).into()
}

/// Two voltages that tell the roll of a slide.
#[derive(Clone, Debug)]
pub(super) struct RollReader {
    places: [usize; 2],
    per_volt: [f64; 2],
    optics: RollOptics,
    age_max: Duration,
    jump: JumpWatch<Radians, 1>,
    stuck: StuckWatch<2>,
}

impl RollReader {
    pub(super) fn new(
        config: &MachineConfig,
        roll: &RollConfig,
    ) -> Result<Self, VolumetricFailure> {
        let place = |channel: u8| place_of_voltage(config, &roll.analog, channel);
        Ok(Self {
            places: roll.channels.map(place),
            per_volt: roll.mm_per_v.map(|mm| mm * 1e-3),
            optics: roll_optics(roll)?,
            age_max: Duration::from_secs_f64(roll.age_max_ms * 1e-3),
            jump: JumpWatch::new(
                Radians::from_arcsec(roll.speed_max_arcsec_per_s).value(),
                Radians::from_arcsec(roll.noise_max_arcsec),
            ),
            stuck: StuckWatch::new(roll.stuck_samples),
        })
    }

    /// The roll by the newest samples.
    pub(super) fn read(&mut self, observed: &Observed<'_>) -> Result<Radians, Trouble> {
        let (volts, at) = self.volts(observed)?;
        self.stuck.check(at, volts.map(Quantity::value))?;
        let roll = self.roll(volts)?;
        self.jump.check(at, [roll])?;
        Ok(roll)
    }

    /// What the newest samples show by themselves, however it came about, and when they were taken.
    #[cfg(feature = "program")]
    pub(super) fn look(&self, observed: &Observed<'_>) -> Result<(Radians, Time), Trouble> {
        let (volts, at) = self.volts(observed)?;
        Ok((self.roll(volts)?, at))
    }

    fn roll(&self, volts: [Volts; 2]) -> Result<Radians, Trouble> {
        let reading = |k: usize| Metres(volts[k].value() * self.per_volt[k]);
        Ok(self.optics.solve(reading(0), reading(1))?.angle)
    }

    /// Both voltages, neither too old nor at an end of its converter's range.
    fn volts(&self, observed: &Observed<'_>) -> Result<([Volts; 2], Time), Trouble> {
        let mut volts = [Volts::ZERO; 2];
        let mut at = Time::NEVER;
        for (volts, place) in volts.iter_mut().zip(&self.places) {
            let channel = observed.channels.get(*place).copied().flatten();
            let seen = channel.map_or(Duration::MAX, |it| observed.now.since(it.at));
            let limit = self.age_max;
            let Some(channel) = channel.filter(|_| seen <= limit) else {
                return Err(Trouble::Stale { seen, limit });
            };
            if channel.saturated {
                return Err(Trouble::AtEnd {
                    seen: channel.volts,
                });
            }
            *volts = channel.volts;
            at = at.min(channel.at);
        }
        Ok((volts, at))
    }
}
