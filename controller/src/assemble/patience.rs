//! How much longer than configured things are waited for, see
//! [`crate::config::Loaded::patience`].

use core::time::Duration;

use compensator::hall_zero;
use units::Metres;

use machine::Patience;

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
