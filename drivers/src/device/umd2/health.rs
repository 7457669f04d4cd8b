//! Whether a sample's count means anything.

use crate::device::{Alarm, SignalTrouble};
use wire::umd2::Sample;

/// The measurement frequency is next to nothing below this part of the reference.
const SLOW_BEAT: u32 = 32;

/// What makes a sample's count worthless.
pub(super) const fn fault_of(sample: &Sample) -> Option<Alarm> {
    let (reference, measurement) = (sample.reference_count, sample.measurement_count);
    if reference == 0 {
        return Some(Alarm::LaserLost);
    }
    if measurement == 0 {
        return Some(Alarm::BeamLost);
    }
    let too_fast = measurement as u64 > 2 * reference as u64;
    let too_slow = (measurement as u64) * (SLOW_BEAT as u64) < reference as u64;
    if too_fast || too_slow {
        return Some(Alarm::SlewError);
    }
    None
}

/// What is wrong with the signal by one sample, for whoever aligns the optics.
pub(super) const fn trouble_of(sample: &Sample) -> Option<SignalTrouble> {
    match fault_of(sample) {
        Some(Alarm::LaserLost) => Some(SignalTrouble::NoReference),
        Some(Alarm::BeamLost) => Some(SignalTrouble::NoBeam),
        Some(_) => Some(SignalTrouble::Beat),
        None if !sample.phase_is_valid() => Some(SignalTrouble::NoPhase),
        None => None,
    }
}
