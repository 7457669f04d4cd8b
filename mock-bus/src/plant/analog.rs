//! The analog inputs: noise, rails, and broken wires. What is said of volts holds for the degrees
//! of a temperature sensor's input too.

use crate::random::Stream;

/// What is wrong with an analog input.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum InputFault {
    /// Tied to the positive rail.
    Rail,
    /// The wire is open: the input floats at a constant voltage.
    Open,
    /// Stuck at what it last showed.
    Stuck,
    /// The two wires of the sensor are exchanged.
    Inverted,
    /// It shows so much more than it should.
    Shifted(f64),
}

/// A floating input settles here, as the bias current of a multiplexer leaves it.
const OPEN_V: f64 = 0.0137;

#[derive(Clone, Debug)]
pub(super) struct Input {
    pub(super) fault: Option<InputFault>,
    noise_v: f64,
    rail_v: f64,
    last_v: f64,
    stream: Stream,
}

impl Input {
    pub(super) fn new(noise_v: f64, rail_v: f64, seed: u64, channel: usize) -> Self {
        Self {
            fault: None,
            noise_v,
            rail_v,
            last_v: 0.0,
            stream: Stream::new(seed, &format!("analog input {channel}")),
        }
    }

    /// The reading of a sensor at `sensor_v`, within the rails.
    pub(super) fn read(&mut self, sensor_v: f64) -> f64 {
        self.read_within(sensor_v, self.rail_v)
    }

    /// The same of a sensor with rails of its own.
    pub(super) fn read_within(&mut self, sensor_v: f64, rail_v: f64) -> f64 {
        let seen_v = match self.fault {
            Some(InputFault::Stuck) => return self.last_v,
            Some(InputFault::Rail) => return rail_v,
            Some(InputFault::Open) => OPEN_V,
            Some(InputFault::Inverted) => -sensor_v,
            Some(InputFault::Shifted(by_v)) => sensor_v + by_v,
            None => sensor_v,
        };
        let noisy_v = seen_v + self.noise_v * self.stream.gaussian();
        self.last_v = noisy_v.clamp(-rail_v, rail_v);
        self.last_v
    }
}
