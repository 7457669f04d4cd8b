//! What a drive shows of its reference, read and compared (0x6063, 0x6064, 0x607C, 0x607E, 0x6098, 0x603F).

use units::{Coordinate, Time};
use wire::canopen::Object;
use wire::cia402::PowerState;

use super::modulo::apart;
use super::settings::Cia402Settings;
use super::start::{HOME_OFFSET, HOMING_METHOD, POSITION_ACTUAL};
use super::{Activity, Cia402Drive};
use crate::device::reference::{DriveReference, ReferenceLost, ReferenceProof};
use crate::protocol::script::{Script, Step};

const INCREMENTS: Object = Object::new(0x6063, 0);
const POLARITY: Object = Object::new(0x607E, 0);
const ERROR_CODE: Object = Object::new(0x603F, 0);

/// Position and encoder are no farther apart than rounding makes them, one count of each reading.
const ROUNDING_COUNTS: f64 = 2.0;

/// Where the encoder's own position is.
const fn encoder(proof: ReferenceProof) -> Object {
    match proof {
        ReferenceProof::AbsoluteEncoder(object) => object,
        ReferenceProof::Mark(_) | ReferenceProof::HomedBit { .. } => INCREMENTS,
    }
}

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
        ReferenceProof::AbsoluteEncoder(_) => {}
    }
    let encoder = Step::read(encoder(proof), READING).optional();
    steps.extend([
        Step::read(HOMING_METHOD, READING),
        Step::read(HOME_OFFSET, READING),
        Step::read(POLARITY, READING).optional(),
        Step::read(ERROR_CODE, READING).optional(),
        encoder,
        Step::read(POSITION_ACTUAL.object, READING),
        encoder,
    ]);
    steps
}

fn shown(proof: ReferenceProof, mark: Option<u32>, script: &Script) -> DriveReference {
    let value = |object| script.value(object).unwrap_or(0);
    let mut increments = script.values(encoder(proof)).map(u32::cast_signed);
    let (before, after) = (increments.next(), increments.next());
    DriveReference {
        mark: match proof {
            ReferenceProof::Mark(object) => mark.or_else(|| script.value(object)),
            ReferenceProof::HomedBit { .. } | ReferenceProof::AbsoluteEncoder(_) => None,
        },
        homed: match proof {
            ReferenceProof::HomedBit { object, bit } => Some(value(object) >> bit.min(31) & 1 != 0),
            ReferenceProof::Mark(_) | ReferenceProof::AbsoluteEncoder(_) => None,
        },
        method: value(HOMING_METHOD),
        home_offset: value(HOME_OFFSET),
        polarity: value(POLARITY),
        position: value(POSITION_ACTUAL.object).cast_signed(),
        increments: before,
        moved: match (before, after) {
            (Some(before), Some(after)) => after.wrapping_sub(before).unsigned_abs(),
            _ => 0,
        },
        error_code: value(ERROR_CODE),
    }
}

/// Where a standing axis was when it was homed where it stands.
#[derive(Clone, Copy, Debug)]
pub(super) struct BeforeHome {
    position: i64,
    increments: i32,
}

/// What is read before an axis is homed where it stands, of a drive whose encoder shall prove that it kept its reference.
pub(super) fn before_home<Q: Coordinate>(settings: &Cia402Settings<Q>) -> Option<Step> {
    match settings.reference_proof {
        Some(ReferenceProof::AbsoluteEncoder(object)) => {
            Some(Step::read(object, "reading its encoder before homing").optional())
        }
        Some(ReferenceProof::Mark(_) | ReferenceProof::HomedBit { .. }) | None => None,
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

    /// Keeps where the axis stands that is homed there.
    pub(super) fn note_before_home(&mut self, script: &Script) {
        let Some(ReferenceProof::AbsoluteEncoder(object)) = self.settings.reference_proof else {
            return;
        };
        let position = self.image.sample().map(|it| it.position.0);
        if let (Some(increments), Some(position)) = (script.value(object), position) {
            self.before_home = Some(BeforeHome {
                position,
                increments: increments.cast_signed(),
            });
        }
    }

    /// What was read last, if it can prove anything at the next start.
    pub(super) fn shown_reference(&self) -> Result<DriveReference, ReferenceLost> {
        let shown = self.reference.unwrap_or_default();
        self.judge_reference(&shown, &shown)?;
        self.judge_encoder(&shown)?;
        Ok(shown)
    }

    /// Takes the drive's coordinates for those in which `then` was read, when what was read last shows that they are.
    pub(super) fn compare_reference(&mut self, then: &DriveReference) -> Result<(), ReferenceLost> {
        let now = self.reference.unwrap_or_default();
        self.homed = false;
        self.judge_reference(then, &now)?;
        self.homed = true;
        Ok(())
    }

    fn judge_reference(
        &self,
        then: &DriveReference,
        now: &DriveReference,
    ) -> Result<(), ReferenceLost> {
        let is_absolute = match self.settings.reference_proof {
            Some(ReferenceProof::Mark(_)) => {
                let (expected, seen) = (then.mark.unwrap_or(0), now.mark.unwrap_or(0));
                // 0 is what an object holds that nobody has written.
                if expected == 0 || seen != expected {
                    return Err(ReferenceLost::Mark { expected, seen });
                }
                false
            }
            Some(ReferenceProof::HomedBit { .. }) if now.homed == Some(true) => false,
            Some(ReferenceProof::HomedBit { .. }) | None => return Err(ReferenceLost::NotHomed),
            Some(ReferenceProof::AbsoluteEncoder(_)) => true,
        };
        if now.increments.is_none() && (is_absolute || then.increments.is_some()) {
            return Err(ReferenceLost::NoEncoder);
        }
        let written = [
            (HOMING_METHOD, then.method, now.method),
            (HOME_OFFSET, then.home_offset, now.home_offset),
        ];
        // A drive with an absolute encoder keeps its origin, and need not keep how it got it.
        let written = written.into_iter().filter(|_| !is_absolute);
        let direction = (POLARITY, then.polarity, now.polarity);
        let mut all = written.chain([direction]);
        if let Some((object, expected, seen)) = all.find(|(_, then, now)| then != now) {
            return Err(ReferenceLost::Changed {
                object,
                expected,
                seen,
            });
        }
        // A drive need not have 0x603F.
        let is_in_fault = matches!(
            self.state(),
            Some(PowerState::Fault | PowerState::FaultReactionActive)
        );
        if is_fault(now.error_code) || is_in_fault && now.error_code == 0 {
            let code = now.error_code;
            return Err(ReferenceLost::Fault { code });
        }
        self.judge_shift(then, now)
    }

    /// Whether the origin lies where it lay, as far as the encoder's own position shows it.
    fn judge_shift(
        &self,
        then: &DriveReference,
        now: &DriveReference,
    ) -> Result<(), ReferenceLost> {
        let (Some(before), Some(after)) = (then.increments, now.increments) else {
            return Ok(());
        };
        let units = self.units_per_increment();
        let moved = then.moved.max(now.moved);
        if f64::from(moved) * units > self.settings.tolerance_counts() as f64 {
            return Err(ReferenceLost::Moving { increments: moved });
        }
        let turned = f64::from(after.wrapping_sub(before)) * units;
        let margin = ROUNDING_COUNTS + f64::from(then.moved.saturating_add(now.moved)) * units;
        let modulo = self.settings.modulo();
        // The encoder counts with or against the axis.
        let expected = [turned, -turned].map(|it| i64::from(then.position) + it.round() as i64);
        let away = expected.map(|it| apart(modulo, i64::from(now.position), it));
        let counts = away.into_iter().min_by_key(|it| it.abs()).unwrap_or(0);
        match counts.abs() as f64 <= margin {
            true => Ok(()),
            false => Err(ReferenceLost::Shifted { counts }),
        }
    }

    /// Whether what shall be the encoder's own position stayed when the position changed by homing where the axis stood.
    fn judge_encoder(&self, now: &DriveReference) -> Result<(), ReferenceLost> {
        let Some(ReferenceProof::AbsoluteEncoder(object)) = self.settings.reference_proof else {
            return Ok(());
        };
        let (Some(before), Some(after)) = (self.before_home, now.increments) else {
            return Err(ReferenceLost::NotTried { object });
        };
        let moved = f64::from(after.wrapping_sub(before.increments)) * self.units_per_increment();
        let homed = i64::from(now.position) - before.position;
        let tolerance = self.settings.tolerance_counts() as f64;
        match (homed.abs() as f64 > tolerance, moved.abs() > tolerance) {
            (true, false) => Ok(()),
            (true, true) => Err(ReferenceLost::NotOfEncoder { object }),
            (false, _) => Err(ReferenceLost::NotTried { object }),
        }
    }

    fn units_per_increment(&self) -> f64 {
        let scale = self.settings.scale.resolution().abs();
        self.settings.increment.map_or(1.0, |it| it / scale)
    }
}

/// Whether a drive with this code (0x603F) may have lost count. That it lost its master, as it does when a controller
/// ends, is a matter of communication (CiA 301: 81xx) and says nothing of where the axis is.
const fn is_fault(code: u32) -> bool {
    code != 0 && code & 0xFF00 != 0x8100
}
