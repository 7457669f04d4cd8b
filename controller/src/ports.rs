//! From the configuration's buses and lines to open ports.

use std::collections::BTreeMap;
use std::path::PathBuf;

use drivers::transport::Port;
use drivers::transport::clock::Clock;
use drivers::transport::live::{Live, LiveBuilder, SerialSettings, SlcanSettings};

use crate::assemble;
use crate::config::{CanBus, CanTransport, MachineConfig};
use crate::failure::Failure;

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
        "`{name}` is no {what} of the configuration; it has {}",
        names.join(", ")
    )))
}

/// The patience ([`Loaded::patience`]) that a machine needs whose clock runs `clock_speed`
/// times as fast as the wall's: none in real time. Beyond it, a host under load pauses for
/// tens of milliseconds, which the fastest supervision must outlast.
///
/// [`Loaded::patience`]: crate::config::Loaded::patience
pub fn patience(clock_speed: f64) -> u32 {
    const PAUSES: f64 = 25.0;
    if clock_speed <= 1.0 {
        1
    } else {
        (clock_speed * PAUSES).min(2000.0).ceil() as u32
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

/// Opens the buses and lines that `purpose` needs. `clock_speed` is 1 on real machines.
///
/// # Errors
/// When one cannot be opened; those before it are closed again.
pub fn open(
    config: &MachineConfig,
    overrides: &Overrides,
    purpose: Use,
    clock_speed: f64,
) -> Result<Live, Failure> {
    if !(clock_speed.is_finite() && clock_speed > 0.0) {
        return Err(Failure::Usage {
            what: format!("a clock speed of {clock_speed}"),
            help: "give a positive number; 1 is real time".into(),
        });
    }
    let mut builder = Live::builder(Clock::scaled(clock_speed));
    let ports = assemble::ports(config);
    for (name, bus) in &config.can {
        builder = add_can(builder, ports[name], bus, overrides.0.get(name));
    }
    for (name, line) in &config.serial {
        let machines_own = config
            .analog
            .values()
            .any(|it| it.line.as_ref() == Some(name));
        if purpose == Use::Motion && !machines_own {
            continue;
        }
        let path = match overrides.0.get(name) {
            Some(Endpoint::Serial(path)) => path,
            _ => &line.path,
        };
        builder = builder.serial(ports[name], path, SerialSettings::new(line.baud_bit_per_s));
    }
    Ok(builder.build()?)
}

fn add_can(
    builder: LiveBuilder,
    port: Port,
    bus: &CanBus,
    replacement: Option<&Endpoint>,
) -> LiveBuilder {
    let slcan = SlcanSettings::new(bus.bitrate_bit_per_s);
    let checked = "the check asks for the key that its transport needs";
    match (replacement, bus.transport) {
        (Some(Endpoint::SocketCan(interface)), _) => builder.socketcan(port, interface),
        (Some(Endpoint::Slcan(path) | Endpoint::Serial(path)), _) => {
            builder.slcan(port, path, slcan)
        }
        (None, CanTransport::SocketCan) => {
            builder.socketcan(port, bus.interface.as_deref().expect(checked))
        }
        (None, CanTransport::Slcan) => {
            builder.slcan(port, bus.path.as_ref().expect(checked), slcan)
        }
    }
}
