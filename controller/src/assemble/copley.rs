//! Amplifiers on serial lines: from the configuration's words to their driver's settings.

use core::time::Duration;

use drivers::device::copley::{CopleySettings, CopleyTimeouts};
use units::{Metres, MetresPerSecond, MetresPerSecondSquared, Scale};
use wire::copley::Address;

use super::reference_limit;
use crate::config::{AxisConfig, CopleyAxisConfig, SerialLine};
use crate::hardware::{CHECKED, millis};
use machine::Patience;

/// A Copley amplifier, as its driver is told; the configuration has been checked.
///
/// # Panics
/// With an address that no amplifier has.
pub fn copley_settings(
    axis: &AxisConfig,
    serial: &CopleyAxisConfig,
    line: &SerialLine,
    patience: Patience,
) -> CopleySettings {
    let amplifier = serial.amplifier.clone().unwrap_or_default();
    let address = Address::node(serial.address).expect(CHECKED);
    let scale = Scale::new(Metres(axis.resolution_nm * 1e-9)).expect(CHECKED);
    let speed_max = MetresPerSecond(axis.speed_max_mm_per_s * 1e-3);
    let acceleration = MetresPerSecondSquared(axis.acceleration_mm_per_s2 * 1e-3);
    let quick_stop = MetresPerSecondSquared(axis.quick_stop_deceleration_mm_per_s2 * 1e-3);
    let usual = CopleySettings::new(address, scale, speed_max, acceleration.max(quick_stop));
    let homing = axis.zero.as_ref().map(|zero| reference_limit(zero, axis));
    CopleySettings {
        baud: line.baud_bit_per_s,
        model: amplifier.model,
        serial: amplifier.serial_number,
        soft_limits: Some((
            Metres::from_mm(axis.soft_min_mm),
            Metres::from_mm(axis.soft_max_mm),
        )),
        following_error: Some(Metres::from_um(axis.following_error_limit_um)),
        position_window: Metres::from_um(axis.position_window_um),
        position_window_time: millis(axis.position_window_time_ms),
        quick_stop_deceleration: quick_stop,
        poll_period: Duration::from_secs_f64(serial.poll_period_ms * 1e-3),
        timeouts: patient(
            CopleyTimeouts {
                homing: homing.unwrap_or(usual.timeouts.homing),
                ..usual.timeouts
            },
            patience,
        ),
        ..usual
    }
}

/// See [`crate::config::Loaded::patience`].
fn patient(usual: CopleyTimeouts, patience: Patience) -> CopleyTimeouts {
    CopleyTimeouts {
        reply: patience.of(usual.reply),
        quiet: patience.of(usual.quiet),
        find: patience.of(usual.find),
        drain: patience.of(usual.drain),
        silence: patience.of(usual.silence),
        transition: patience.of(usual.transition),
        motion: patience.of(usual.motion),
        settling: patience.of(usual.settling),
        standing: patience.of(usual.standing),
        homing: patience.of(usual.homing),
    }
}
