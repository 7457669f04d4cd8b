//! What a configuration puts on each CAN bus, and whether it fits.

use core::time::Duration;

use drivers::protocol::bus_load::{BusLoad, BusLoadError, BusPlan};

use crate::config::MachineConfig;

/// Bytes of the PDOs a CiA 402 drive sends at every SYNC: statusword, position and mode; then
/// the following error.
const DRIVE_PDO_BYTES: [u8; 2] = [7, 4];
/// A drive that follows cyclic set-points hears controlword and target at every SYNC.
const SET_POINT_PDO_BYTES: u8 = 6;
/// A touch probe adds its status, a position and a count.
const LATCH_PDO_BYTES: u8 = 8;

/// The load of CAN bus `name`.
///
/// # Errors
/// When it does not fit; the error says which SYNC period would.
///
/// # Panics
/// When there is no such bus.
pub fn load(config: &MachineConfig, name: &str) -> Result<BusLoad, BusLoadError> {
    let bus = &config.can[name];
    let ms = |ms: u16| Duration::from_millis(ms.into());
    let sync_period = Duration::from_secs_f64(bus.sync_period_ms * 1e-3);
    let mut plan = BusPlan::new(bus.bitrate_bit_per_s, sync_period)
        .with_heartbeat(ms(bus.master_heartbeat_ms));
    let axes = config.axis.values();
    let axes = axes.filter_map(|axis| Some((axis.can()?, axis.cyclic.is_some())));
    for (axis, is_cyclic) in axes.filter(|(axis, _)| axis.bus == name) {
        if is_cyclic {
            plan = plan.with_pdos(&[SET_POINT_PDO_BYTES]);
        }
        plan = plan
            .with_pdos(&DRIVE_PDO_BYTES)
            .with_heartbeat(ms(axis.heartbeat_producer_ms));
    }
    for rotary in config.rotary.values().filter(|it| it.bus == name) {
        plan = plan
            .with_pdos(&DRIVE_PDO_BYTES)
            .with_heartbeat(ms(rotary.heartbeat_producer_ms));
        if rotary.line_detector.is_some() {
            plan = plan.with_pdos(&[LATCH_PDO_BYTES]);
        }
    }
    for analog in config
        .analog
        .values()
        .filter(|analog| analog.bus.as_deref() == Some(name))
    {
        // Two bytes a channel; four channels fill a PDO, more are refused by the check.
        let bytes = analog.channels.len().min(4) as u8 * 2;
        plan = plan.with_pdos(&[bytes]);
        if let Some(period) = analog.heartbeat_producer_ms {
            plan = plan.with_heartbeat(ms(period));
        }
    }
    plan.load()
}
