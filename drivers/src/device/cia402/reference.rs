//! What a drive shows of its reference, read and compared (0x6063, 0x6064, 0x607C, 0x6098, 0x603F).

use units::{Coordinate, Time};
use wire::canopen::Object;

use super::modulo::apart;
use super::start::{HOME_OFFSET, HOMING_METHOD, POSITION_ACTUAL};
use super::{Activity, Cia402Drive};
use crate::device::reference::{DriveReference, ReferenceLost, ReferenceProof};
use crate::protocol::script::{Script, Step};

const INCREMENTS: Object = Object::new(0x6063, 0);
const ERROR_CODE: Object = Object::new(0x603F, 0);

/// Position and encoder are no farther apart than rounding makes them, one count of each reading.
const ROUNDING_COUNTS: f64 = 2.0;

/// The mark, where there is one to write; then all that a reference shows in. The encoder is read on both sides of the
/// position, which tells how far it moved between.
fn steps(proof: ReferenceProof, mark: Option<u32>) -> Vec<Step> {
    const READING: &str = "reading what shows its reference";
    let mut steps = Vec::new();
    match proof {
        ReferenceProof::Mark(object) => steps.push(match mark {
            Some(mark) => Step::check(object, mark, "writing the mark of its zero"),
            None => Step::read(object, READING),
        }),
        ReferenceProof::HomedBit { object, .. } => steps.push(Step::read(object, READING)),
        ReferenceProof::AbsoluteEncoder => {}
    }
    steps.extend([
        Step::read(HOMING_METHOD, READING),
        Step::read(HOME_OFFSET, READING),
        Step::read(ERROR_CODE, READING).optional(),
        Step::read(INCREMENTS, READING).optional(),
        Step::read(POSITION_ACTUAL.object, READING),
        Step::read(INCREMENTS, READING).optional(),
    ]);
    steps
}

fn shown(proof: ReferenceProof, mark: Option<u32>, script: &Script) -> DriveReference {
    let signed = |object| script.value(object).map(u32::cast_signed);
    let mut increments = script.values(INCREMENTS).map(u32::cast_signed);
    let (before, after) = (increments.next(), increments.next());
    DriveReference {
        mark: match proof {
            ReferenceProof::Mark(object) => mark.or_else(|| script.value(object)),
            ReferenceProof::HomedBit { .. } | ReferenceProof::AbsoluteEncoder => None,
        },
        homed: match proof {
            ReferenceProof::HomedBit { object, bit } => {
                let bits = script.value(object).unwrap_or(0);
                Some(bits >> bit.min(31) & 1 != 0)
            }
            ReferenceProof::Mark(_) | ReferenceProof::AbsoluteEncoder => None,
        },
        method: script.value(HOMING_METHOD).unwrap_or(0),
        home_offset: script.value(HOME_OFFSET).unwrap_or(0),
        position: signed(POSITION_ACTUAL.object).unwrap_or(0),
        increments: before,
        moved: match (before, after) {
            (Some(before), Some(after)) => after.wrapping_sub(before).unsigned_abs(),
            _ => 0,
        },
        error_code: script.value(ERROR_CODE).unwrap_or(0),
    }
}

impl<Q: Coordinate> Cia402Drive<Q> {
    pub(super) fn begin_reference(&mut self, now: Time, mark: Option<u32>) {
        let Some(proof) = self.settings.reference_proof else {
            self.refuse(
                "reading its reference",
                "a proof of it in the configuration",
            );
            return;
        };
        self.reference = None;
        self.activity = Activity::Reference { mark };
        self.node.run(now, steps(proof, mark));
        self.pump(now);
    }

    pub(super) fn reference_read(&mut self, script: &Script) {
        let Activity::Reference { mark } = self.activity else {
            return;
        };
        let proof = self.settings.reference_proof;
        self.reference = proof.map(|proof| shown(proof, mark, script));
        self.finish(Ok(()));
    }

    /// Takes the drive's coordinates for those in which `then` was read, when what was read last shows that they are.
    pub(super) fn compare_reference(&mut self, then: &DriveReference) -> Result<(), ReferenceLost> {
        let now = self.reference.unwrap_or_default();
        self.homed = false;
        match self.settings.reference_proof {
            Some(ReferenceProof::Mark(_)) => {
                let (expected, seen) = (then.mark.unwrap_or(0), now.mark.unwrap_or(0));
                // 0 is what an object holds that nobody has written.
                if expected == 0 || seen != expected {
                    return Err(ReferenceLost::Mark { expected, seen });
                }
            }
            Some(ReferenceProof::HomedBit { .. }) => {
                if now.homed != Some(true) {
                    return Err(ReferenceLost::NotHomed);
                }
            }
            Some(ReferenceProof::AbsoluteEncoder) => {
                if now.increments.is_none() || then.increments.is_none() {
                    return Err(ReferenceLost::NoEncoder);
                }
            }
            None => return Err(ReferenceLost::NotHomed),
        }
        for (object, expected, seen) in [
            (HOMING_METHOD, then.method, now.method),
            (HOME_OFFSET, then.home_offset, now.home_offset),
        ] {
            // A drive with an absolute encoder keeps its origin, and need not keep how it got it.
            let is_kept = self.settings.reference_proof != Some(ReferenceProof::AbsoluteEncoder);
            if is_kept && expected != seen {
                return Err(ReferenceLost::Homed {
                    object,
                    expected,
                    seen,
                });
            }
        }
        if is_fault(now.error_code) {
            let code = now.error_code;
            return Err(ReferenceLost::Fault { code });
        }
        match self.shift(then, &now) {
            0 => {
                self.homed = true;
                Ok(())
            }
            counts => Err(ReferenceLost::Shifted { counts }),
        }
    }

    /// By how many position units the origin lies elsewhere now, as far as the encoder's own position shows it: 0 where
    /// both changed alike, or the drive has no such position.
    fn shift(&self, then: &DriveReference, now: &DriveReference) -> i64 {
        let (Some(before), Some(after)) = (then.increments, now.increments) else {
            return 0;
        };
        let scale = self.settings.scale.resolution().abs();
        let units = self.settings.increment.map_or(1.0, |it| it / scale);
        let turned = f64::from(after.wrapping_sub(before)) * units;
        let margin = ROUNDING_COUNTS + f64::from(then.moved.saturating_add(now.moved)) * units;
        let modulo = self.settings.modulo();
        // 0x6063 counts with or against the axis (0x607E).
        [turned, -turned]
            .map(|turned| {
                let expected = i64::from(then.position) + turned.round() as i64;
                apart(modulo, i64::from(now.position), expected)
            })
            .into_iter()
            .min_by_key(|away| away.abs())
            .filter(|away| away.abs() as f64 > margin)
            .unwrap_or(0)
    }
}

/// Whether a drive with this code (0x603F) may have lost count. That it lost its master, as it does when a controller
/// ends, is a matter of communication (CiA 301: 81xx) and says nothing of where the axis is.
const fn is_fault(code: u32) -> bool {
    code != 0 && code & 0xFF00 != 0x8100
}
