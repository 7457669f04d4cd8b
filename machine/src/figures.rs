//! What a monitoring system asks of a machine: how punctual its SYNCs are, how full its buses, how warm it is.

use core::fmt;
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

/// How much this computer was late for a machine since the machine was made.
///
/// # Example
///
/// ```
/// use machine::HostDelays;
/// use std::time::Duration;
///
/// let before = HostDelays { syncs: 3, pauses: Duration::from_millis(20) };
/// let after = HostDelays { syncs: 123, pauses: Duration::from_millis(620) };
/// let meanwhile = after.since(before);
/// assert_eq!(
///     meanwhile.to_string(),
///     "the computer was held up: 120 SYNCs were left out, and this program was kept from its buses for 0.600 s"
/// );
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct HostDelays {
    /// SYNCs of all buses that were left out because they would have come too late; where time is simulated
    /// nobody counts them.
    pub syncs: u64,
    /// For how long, by the machine's clock, the program was kept from its buses; short pauses do not count.
    pub pauses: Duration,
}

impl HostDelays {
    /// What came to it since it was `earlier`.
    #[must_use]
    pub fn since(self, earlier: Self) -> Self {
        Self {
            syncs: self.syncs.saturating_sub(earlier.syncs),
            pauses: self.pauses.saturating_sub(earlier.pauses),
        }
    }

    /// Whether the computer was never late.
    pub fn is_none(self) -> bool {
        self == Self::default()
    }
}

impl fmt::Display for HostDelays {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { syncs, pauses } = *self;
        let kept = pauses.as_secs_f64();
        match (syncs, pauses.is_zero()) {
            (0, true) => write!(f, "the computer was not held up"),
            (0, false) => write!(
                f,
                "the computer was held up: this program was kept from its buses for {kept:.3} s"
            ),
            (_, true) => write!(f, "the computer was held up: {syncs} SYNCs were left out"),
            (_, false) => write!(
                f,
                "the computer was held up: {syncs} SYNCs were left out, and this program was kept from its \
                 buses for {kept:.3} s"
            ),
        }
    }
}

/// How much this computer was late for `machine` until now.
pub fn host_delays(machine: &Machine) -> HostDelays {
    let syncs = bus_figures(machine).into_iter().filter_map(|it| it.sync);
    HostDelays {
        syncs: syncs.map(|it| it.skipped).sum(),
        pauses: machine.host_watch.total(),
    }
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
