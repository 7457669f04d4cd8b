//! The ports of a machine: its CAN buses and serial lines.

use std::collections::BTreeMap;

use drivers::transport::Transport;
use wire::Port;

use crate::failure::Failure;
use crate::parts::Bus;
use crate::sync_account::SyncAccount;

/// What a machine is connected to.
pub(crate) struct Ports {
    /// The CAN buses, in the order of their ports.
    pub(crate) buses: Vec<Bus>,
    /// The names of the serial lines.
    pub(crate) lines: BTreeMap<Port, String>,
    /// Whether the transport sends SYNC.
    pub(crate) is_synchronous: bool,
    /// What became of SYNCs.
    pub(crate) syncs: SyncAccount,
}

impl Ports {
    /// What the configuration calls `port`.
    pub(crate) fn name(&self, port: Port) -> String {
        let mut buses = self.buses.iter();
        let bus = buses.find(|it| it.port == port).map(|it| &it.name);
        let name = bus.or_else(|| self.lines.get(&port));
        name.cloned().unwrap_or_else(|| format!("port {}", port.0))
    }

    /// Lets `transport` send SYNC on every bus, or on none.
    pub(crate) fn set_sync(
        &mut self,
        transport: &mut dyn Transport,
        on: bool,
    ) -> Result<(), Failure> {
        self.is_synchronous = on;
        for bus in &self.buses {
            let period = on.then_some(bus.sync_period);
            let ending = transport.sync_statistics(bus.port).filter(|_| !on);
            if let Some(thread) = ending {
                self.syncs.ended(bus.port, &thread);
            }
            transport
                .set_sync(bus.port, period)
                .map_err(|source| Failure::Send {
                    device: format!("SYNC on {}", bus.name),
                    source,
                })?;
        }
        Ok(())
    }
}
