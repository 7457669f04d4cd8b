//! How much longer than configured things are waited for, see
//! [`crate::config::Loaded::patience`].

use core::time::Duration;

use compensator::hall_zero;
use drivers::device::cia402::Cia402Timeouts;
use units::Metres;

use machine::Patience;

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
