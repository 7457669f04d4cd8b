//! Buses and serial lines.

use crate::draft::{Draft, Draw};

/// Gives the bus one of the SYNC periods, and says which.
pub fn write(draft: &mut Draft, periods_ms: &[f64], draw: &mut Draw) -> f64 {
    let sync_ms = draw.of(periods_ms);
    draft.set("can.can0", "sync_period_ms", sync_ms);
    let heartbeat_ms = draw.size((20.0, 100.0)) as u32;
    draft.set("can.can0", "master_heartbeat_ms", heartbeat_ms);
    sync_ms
}

/// Gives the line a rate that devices have.
pub fn write_rate(draft: &mut Draft, line: &str, draw: &mut Draw) {
    let rates = [9600, 19_200, 38_400, 57_600, 115_200, 230_400, 921_600];
    let section = format!("serial.{line}");
    draft.set(&section, "baud_bit_per_s", draw.of(&rates));
}
