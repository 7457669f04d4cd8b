//! From the configuration's buses and lines to open ports.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use drivers::transport::clock::Clock;
use drivers::transport::live::{Live, LiveBuilder, OpenError, SerialSettings, SlcanSettings};
use drivers::transport::lockstep::Participant;
use wire::Port;

use crate::assemble;
use crate::config::{CanTransport, MachineConfig};
use crate::failure::Failure;
use machine::Patience;
#[cfg(feature = "program")]
use machine::records::DiskPace;

/// Where a bus or a line is really found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Endpoint {
    /// A network interface.
    SocketCan(String),
    /// A serial CAN adapter.
    Slcan(PathBuf),
    /// A serial line.
    Serial(PathBuf),
}

/// Endpoints that replace those of the configuration, by the name of the bus or line.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Overrides(BTreeMap<String, Endpoint>);

impl Overrides {
    /// From `NAME=ENDPOINT` words: `can0=slcan:/dev/ttyACM0`, `can0=socketcan:can0`,
    /// `laser=/dev/ttyACM1`.
    ///
    /// # Errors
    /// When a word has another form or names no bus or line of `config`.
    pub fn parse(words: &[String], config: &MachineConfig) -> Result<Self, Failure> {
        let mut overrides = Self::default();
        for word in words {
            let (name, endpoint) = parse_word(word, config)?;
            overrides.set(&name, endpoint);
        }
        Ok(overrides)
    }

    /// Each bus or line that has one.
    #[cfg(feature = "program")]
    pub(crate) fn each(&self) -> impl Iterator<Item = (&String, &Endpoint)> {
        self.0.iter()
    }

    /// Puts `endpoint` in the place of bus or line `name`.
    pub fn set(&mut self, name: &str, endpoint: Endpoint) {
        self.0.insert(name.to_owned(), endpoint);
    }
}

fn parse_word(word: &str, config: &MachineConfig) -> Result<(String, Endpoint), Failure> {
    let usage = |help: String| Failure::Usage {
        what: format!("`--port {word}`"),
        help,
    };
    let form = "write NAME=slcan:PATH, NAME=socketcan:INTERFACE or NAME=PATH";
    let (name, endpoint) = word.split_once('=').ok_or_else(|| usage(form.into()))?;
    let endpoint = match endpoint.split_once(':') {
        Some(("slcan", path)) => Endpoint::Slcan(path.into()),
        Some(("socketcan", interface)) => Endpoint::SocketCan(interface.into()),
        _ => Endpoint::Serial(endpoint.into()),
    };
    let is_can = !matches!(endpoint, Endpoint::Serial(_));
    let known = if is_can {
        config.can.contains_key(name)
    } else {
        config.serial.contains_key(name)
    };
    if known {
        return Ok((name.to_owned(), endpoint));
    }
    let names: Vec<_> = config
        .can
        .keys()
        .chain(config.serial.keys())
        .cloned()
        .collect();
    let what = if is_can { "CAN bus" } else { "serial line" };
    Err(usage(format!(
        "`{name}` is not a {what} of the configuration, which has {}",
        names.join(", ")
    )))
}

/// Whose time a machine lives by.
#[derive(Clone, Debug)]
pub enum Pace {
    /// The wall's, so many times as fast; 1 on real machines.
    Wall(f64),
    /// An emulated machine's: it passes only when both ends have nothing left to do.
    Lockstep(Arc<Participant>),
}

impl From<f64> for Pace {
    fn from(speed: f64) -> Self {
        Self::Wall(speed)
    }
}

impl Pace {
    /// Takes part in the clock whose side channel is at `path`; the emulator calls it `name`.
    ///
    /// # Errors
    /// When no emulated machine is there.
    pub fn lockstep(path: &Path, name: &str) -> Result<Self, Failure> {
        let joined = Participant::join(path, name).map_err(OpenError::from)?;
        Ok(Self::Lockstep(joined))
    }

    /// How time passes for who waits for the disk.
    #[cfg(feature = "program")]
    pub(crate) const fn of_disk(&self) -> DiskPace {
        match self {
            Self::Wall(_) => DiskPace::Wall,
            Self::Lockstep(_) => DiskPace::Shared,
        }
    }

    /// The patience ([`Loaded::patience`]) that a machine needs: none in real time and on a
    /// clock that waits for both ends. On a clock that runs faster than the wall's, a host
    /// under load pauses for tens of milliseconds, which the fastest supervision must outlast.
    ///
    /// [`Loaded::patience`]: crate::config::Loaded::patience
    pub fn patience(&self) -> Patience {
        match self {
            Self::Wall(speed) => Patience::with_clock(*speed),
            Self::Lockstep(_) => Patience::NONE,
        }
    }

    fn clock(&self) -> Result<Clock, Failure> {
        match self {
            Self::Lockstep(participant) => Ok(Clock::lockstep(Arc::clone(participant))),
            Self::Wall(speed) if speed.is_finite() && *speed > 0.0 => Ok(Clock::scaled(*speed)),
            Self::Wall(speed) => Err(Failure::Usage {
                what: format!("a clock speed of {speed}"),
                help: "give a positive number; 1 is real time".into(),
            }),
        }
    }

    /// Whether a machine of metal can live by it.
    fn is_real(&self) -> bool {
        matches!(self, Self::Wall(speed) if *speed == 1.0)
    }
}

/// What a verb will do, which says what it needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Use {
    /// Move the machine; instruments need not be there.
    Motion,
    /// Read the instruments too.
    Measurement,
}

/// Opens the buses and lines that `purpose` needs. `pace` is 1.0 on real machines.
///
/// # Errors
/// When one cannot be opened; those before it are closed again.
pub fn open(
    config: &MachineConfig,
    overrides: &Overrides,
    purpose: Use,
    pace: impl Into<Pace>,
) -> Result<Live, Failure> {
    let pace = pace.into();
    let clock = pace.clock()?;
    let endpoints = endpoints(config, overrides, purpose);
    if !pace.is_real() {
        refuse_real(&endpoints)?;
    }
    let mut builder = Live::builder(clock);
    let ports = assemble::ports(config);
    for (name, endpoint) in &endpoints {
        builder = add(builder, ports[name], config, name, endpoint);
    }
    Ok(builder.build()?)
}

/// Where each bus and line that `purpose` needs is found.
pub(crate) fn endpoints(
    config: &MachineConfig,
    overrides: &Overrides,
    purpose: Use,
) -> BTreeMap<String, Endpoint> {
    let checked = "the check asks for the key that its transport needs";
    let buses = config.can.iter().map(|(name, bus)| {
        let endpoint = match bus.transport {
            CanTransport::SocketCan => Endpoint::SocketCan(bus.interface.clone().expect(checked)),
            CanTransport::Slcan => Endpoint::Slcan(bus.path.clone().expect(checked)),
        };
        (name, endpoint)
    });
    let machines_own = |name: &String| {
        let mut analogs = config.analog.values();
        let mut axes = config.axis.values();
        // A camera that sees a beam is part of the machine; one that sees a platform is brought along.
        let cameras = config.camera.iter();
        let mut detectors = cameras.filter(|(camera, _)| config.is_detector(camera));
        analogs.any(|it| it.port() == name)
            || axes.any(|it| it.port() == name)
            || detectors.any(|(_, it)| it.line == *name)
    };
    let lines = config
        .serial
        .iter()
        .filter(|(name, _)| purpose == Use::Measurement || machines_own(name))
        .map(|(name, line)| (name, Endpoint::Serial(line.path.clone())));
    buses
        .chain(lines)
        .map(|(name, usual)| {
            (
                name.clone(),
                overrides.0.get(name).cloned().unwrap_or(usual),
            )
        })
        .collect()
}

/// A clock that does not keep time stretches every supervision time-out: never with metal.
fn refuse_real(endpoints: &BTreeMap<String, Endpoint>) -> Result<(), Failure> {
    let is_emulated = |endpoint: &Endpoint| match endpoint {
        Endpoint::SocketCan(interface) => interface.starts_with("vcan"),
        Endpoint::Slcan(path) | Endpoint::Serial(path) => path
            .canonicalize()
            .is_ok_and(|path| path.starts_with("/dev/pts")),
    };
    match endpoints
        .iter()
        .find(|(_, endpoint)| !is_emulated(endpoint))
    {
        None => Ok(()),
        Some((name, _)) => Err(Failure::Usage {
            what: format!(
                "the clock of an emulated machine was asked for, but `{name}` is not an emulated \
                 port"
            ),
            help: "leave --clock and --clock-speed out on a real machine".into(),
        }),
    }
}

fn add(
    builder: LiveBuilder,
    port: Port,
    config: &MachineConfig,
    name: &str,
    endpoint: &Endpoint,
) -> LiveBuilder {
    match endpoint {
        Endpoint::SocketCan(interface) => builder.socketcan(port, interface),
        Endpoint::Slcan(path) => {
            let settings = SlcanSettings::new(config.can[name].bitrate_bit_per_s);
            builder.slcan(port, path, settings)
        }
        Endpoint::Serial(path) => {
            let settings = SerialSettings::new(config.serial[name].baud_bit_per_s);
            builder.serial(port, path, settings)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fast_clock_is_refused_on_a_real_port() {
        let real = BTreeMap::from([("can0".to_owned(), Endpoint::SocketCan("can0".into()))]);
        let error = refuse_real(&real).unwrap_err().to_string();
        assert!(error.contains("can0"), "{error}");
        let emulated = BTreeMap::from([("can0".to_owned(), Endpoint::SocketCan("vcan0".into()))]);
        assert!(refuse_real(&emulated).is_ok());
    }
}
