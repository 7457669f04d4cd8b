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
    /// What its SYNC thread has done; `None` where time is simulated, and where the cyclic engine sends them.
    pub sync: Option<SyncStatistics>,
}

/// The bits of a SYNC without a counter.
const SYNC_BITS: u64 = 47;

/// Those of every CAN bus of `machine`.
pub fn bus_figures(machine: &Machine) -> Vec<BusFigures> {
    let buses = machine.ports.buses.iter().map(|bus| {
        let counts = machine.bus_account.of(bus.port);
        let sync = machine.transport.sync_statistics(bus.port);
        let syncs = sync.as_ref().map_or(0, |it| it.sent);
        let bits = counts.bits + SYNC_BITS * syncs;
        BusFigures {
            name: bus.name.clone(),
            counts,
            busy: Duration::from_secs_f64(bits as f64 / f64::from(bus.bitrate)),
            sync,
        }
    });
    buses.collect()
}

/// The newest temperatures of every module that has thermometers: its name, the number of the sensor from 0 on, and
/// what it said.
pub fn temperatures(machine: &Machine) -> Vec<(String, usize, Celsius)> {
    let modules = machine.devices.analogs.iter().filter_map(|unit| {
        let reading = unit.device.thermometers()?.temperatures()?;
        let sensors = reading.celsius.iter().enumerate();
        let known = sensors.filter_map(|(at, celsius)| Some((unit.name.clone(), at, (*celsius)?)));
        Some(known.collect::<Vec<_>>())
    });
    modules.flatten().collect()
}
