//! What a monitoring system asks of a machine: how punctual its SYNCs are, how full its buses, how warm it is.

use core::time::Duration;

use drivers::transport::SyncStatistics;
use units::Celsius;

use crate::bus_account::BusCounts;
use crate::machine::Machine;

/// Figures of one CAN bus.
#[derive(Clone, Debug, PartialEq)]
pub struct BusFigures {
    /// Its name in the configuration.
    pub name: String,
    /// What passed on it.
    pub counts: BusCounts,
    /// For how long that took the bus, SYNCs included.
    pub busy: Duration,
    /// What became of SYNCs since the machine was made, whoever sent them; `None` where time is simulated.
    pub sync: Option<SyncStatistics>,
}

/// The bits of a SYNC without a counter.
const SYNC_BITS: u64 = 47;

/// Those of every CAN bus of `machine`.
pub fn bus_figures(machine: &Machine) -> Vec<BusFigures> {
    let account = &machine.ports.syncs;
    let buses = machine.ports.buses.iter().map(|bus| {
        let counts = machine.bus_account.of(bus.port);
        let running = machine.transport.sync_statistics(bus.port);
        let threads = account.of_threads(bus.port, running);
        // Those of the cyclic engine are among the frames.
        let syncs = threads.as_ref().map_or(0, |it| it.sent);
        let bits = counts.bits + SYNC_BITS * syncs;
        BusFigures {
            name: bus.name.clone(),
            counts,
            busy: Duration::from_secs_f64(bits as f64 / f64::from(bus.bitrate)),
            sync: threads.map(|it| account.with_engine(bus.port, it)),
        }
    });
    buses.collect()
}

/// A thermometer: the name of its device, which of its sensors it is, and what that said last.
pub type Thermometer = (String, String, Celsius);

/// The newest temperatures of every module that has thermometers, whose sensors have numbers from 0 on, and of every
/// instrument that measures its environment, `air` and `material`.
pub fn temperatures(machine: &Machine) -> Vec<Thermometer> {
    let modules = machine.devices.analogs.iter().filter_map(|unit| {
        let reading = unit.device.thermometers()?.temperatures()?;
        let sensors = reading.celsius.iter().enumerate();
        let known =
            sensors.filter_map(|(at, it)| Some((unit.name.clone(), at.to_string(), (*it)?)));
        Some(known.collect::<Vec<_>>())
    });
    let instruments = machine.devices.instruments.iter().flat_map(|unit| {
        let environment = unit.device.environment();
        let air = environment.air_temperature.map(|it| ("air", it));
        let material = environment.material_temperature.map(|it| ("material", it));
        let known = air.into_iter().chain(material);
        known.map(|(sensor, it)| (unit.name.clone(), sensor.to_owned(), it))
    });
    modules.flatten().chain(instruments).collect()
}
