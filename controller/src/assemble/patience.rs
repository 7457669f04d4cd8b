//! How much longer than configured things are waited for, see
//! [`crate::config::Loaded::patience`].

use core::time::Duration;

use compensator::hall_zero;
use drivers::device::canopen_node::{NodeSettings, NodeTimeouts};
use drivers::device::cia402::Cia402Timeouts;
use drivers::protocol::sdo_client::Timeouts as SdoTimeouts;
use units::Metres;

use machine::Patience;

/// Where the clock is faster than the wall's, a pause of the host silences process data and
/// heartbeats alike, so they are waited for alike.
pub(super) fn patient_pdos(
    usual: &NodeSettings,
    consumer_time: Duration,
    patience: Patience,
) -> u32 {
    if patience == Patience::NONE {
        return usual.missed_pdos_max;
    }
    let periods = patience.of(consumer_time).as_nanos() / usual.sync_period.as_nanos().max(1);
    u32::try_from(periods).map_or(u32::MAX, |it| it.max(usual.missed_pdos_max))
}

/// See [`crate::config::Loaded::patience`].
pub(super) fn patient_node(usual: NodeTimeouts, patience: Patience) -> NodeTimeouts {
    NodeTimeouts {
        boot: patience.of(usual.boot),
        sdo: SdoTimeouts {
            response: patience.of(usual.sdo.response),
            block_segment: patience.of(usual.sdo.block_segment),
            ..usual.sdo
        },
        operational: patience.of(usual.operational),
    }
}

pub(crate) fn patient_drive(usual: Cia402Timeouts, patience: Patience) -> Cia402Timeouts {
    Cia402Timeouts {
        transition: patience.of(usual.transition),
        mode: patience.of(usual.mode),
        set_point: patience.of(usual.set_point),
        settling: patience.of(usual.settling),
        standing: patience.of(usual.standing),
        homing: patience.of(usual.homing),
        new_position: patience.of(usual.new_position),
        latch: patience.of(usual.latch),
        repeat: patience.of(usual.repeat),
    }
}

/// The same for a machine whose clock runs faster than the wall's: see [`crate::ports::patience`].
pub(crate) fn patient_search(
    usual: hall_zero::Settings,
    patience: Patience,
) -> hall_zero::Settings {
    hall_zero::Settings {
        stall_limit: patience.of(usual.stall_limit),
        // So far it goes on the old way while nobody says where to.
        wrong_way: usual.wrong_way
            + Metres(usual.speed.value() * patience.beyond(Duration::ZERO).as_secs_f64()),
        ..usual
    }
}
