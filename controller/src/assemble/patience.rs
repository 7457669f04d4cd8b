//! How much longer than configured things are waited for, see
//! [`crate::config::Loaded::patience`].

use core::time::Duration;

use drivers::device::canopen_node::{NodeSettings, NodeTimeouts};
use drivers::device::cia402::Cia402Timeouts;
use drivers::protocol::sdo_client::Timeouts as SdoTimeouts;

/// Where the clock is faster than the wall's, a pause of the host silences process data and
/// heartbeats alike, so they are waited for alike.
pub(super) fn patient_pdos(usual: &NodeSettings, consumer_time: Duration, patience: u32) -> u32 {
    if patience == 1 {
        return usual.missed_pdos_max;
    }
    let periods = (consumer_time * patience).as_nanos() / usual.sync_period.as_nanos().max(1);
    u32::try_from(periods).map_or(u32::MAX, |it| it.max(usual.missed_pdos_max))
}

/// See [`crate::config::Loaded::patience`].
pub(super) fn patient_node(usual: NodeTimeouts, patience: u32) -> NodeTimeouts {
    NodeTimeouts {
        boot: usual.boot * patience,
        sdo: SdoTimeouts {
            response: usual.sdo.response * patience,
            block_segment: usual.sdo.block_segment * patience,
            ..usual.sdo
        },
        operational: usual.operational * patience,
    }
}

pub(super) fn patient_drive(usual: Cia402Timeouts, patience: u32) -> Cia402Timeouts {
    Cia402Timeouts {
        transition: usual.transition * patience,
        mode: usual.mode * patience,
        set_point: usual.set_point * patience,
        settling: usual.settling * patience,
        standing: usual.standing * patience,
        homing: usual.homing * patience,
        new_position: usual.new_position * patience,
        repeat: usual.repeat * patience,
    }
}
