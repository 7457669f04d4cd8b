//! Whether the calibrations of the screws make a platform better, by what a verification has seen: without them it would
//! have been off by what was seen and by what they took away.

use compensator::platform::Pose;
use units::{Metres, Radians};

use crate::failure::Failure;
use crate::platform::handle::AlignmentPlatform;
use crate::platform::mistaken::{Judged, Permitted};
use crate::platform::moves::PoseMoved;
use crate::platform::state::{difference, largest_error};
use crate::platform::verify::{PlatformVerified, PoseChecked};
use crate::run::settle;
use crate::store::{Store, short};

/// Standard uncertainties that a difference must have: of a hundred platforms that only shake some two are taken for
/// worse.
const SURE: f64 = 2.0;

/// Whether the poses were off by more with their calibrations than without, beyond what pictures do not repeat. Where
/// single pictures do not tell that, any difference counts.
fn is_worse(poses: &[PoseChecked], edge: Metres) -> bool {
    let size = |it: Pose| largest_error(it, edge).value();
    let (mut more, mut spread) = (0.0, 0.0);
    for pose in poses {
        let Some(known) = pose.known else {
            continue;
        };
        let left = difference(pose.seen, pose.target);
        let (with, without) = (size(left), size(sum(left, known)));
        more += with * with - without * without;
        // Of what both have in common only the product with what was taken away differs.
        let u = 2.0 * size(known) * pose.uncertainty.map_or(0.0, size);
        spread += u * u;
    }
    more > SURE * spread.sqrt()
}

impl AlignmentPlatform<'_> {
    /// The error that the screws' calibrations took away of a move to `target`: they sent the platform so far beside it.
    pub(super) fn known_error(&self, target: Pose, moved: &PoseMoved) -> Option<Pose> {
        let nominal = self.strokes_to(target).ok()?;
        let sent: Vec<Metres> = moved.set_points.iter().map(|it| it.1).collect();
        let kinematics = &self.state.kinematics;
        let pose = |strokes: &[Metres]| Some(kinematics.forward_near(strokes, target).ok()?.pose);
        Some(difference(pose(&nominal)?, pose(&sent)?))
    }

    /// Calibrations with which a platform is out of tolerance and worse than without are taken out of use, all of them:
    /// they were made together.
    pub(super) fn judge_benefit(
        &mut self,
        store: &Store,
        verified: &PlatformVerified,
    ) -> Result<(), Failure> {
        let edge = Metres::from_mm(self.config.edge_mm);
        let judged = verified.poses.iter().filter_map(|it| {
            let said = it.known?;
            Some(Judged {
                target: it.target,
                said,
                was: sum(difference(it.seen, it.target), said),
            })
        });
        let judged: Vec<Judged> = judged.collect();
        let rms = |of: &dyn Fn(&Judged) -> Pose| {
            let squares = judged.iter().map(|it| {
                let error = largest_error(of(it), edge).value();
                error * error
            });
            Metres((squares.sum::<f64>() / judged.len().max(1) as f64).sqrt())
        };
        let (before, after) = (rms(&|it| it.was), rms(&|it| difference(it.was, it.said)));
        if verified.is_within_tolerance() || !is_worse(&verified.poses, edge) {
            return Ok(());
        }
        let permitted = Permitted {
            kinematics: &self.state.kinematics,
            screws: self.state.screws.iter().map(|it| &*it.axis).collect(),
            tolerance: verified.tolerance,
            edge,
        };
        let cause = permitted.cause(&judged);
        let (calibration, in_use) = self.fall_back(store)?;
        Err(Failure::MadeWorse {
            axis: "platform".into(),
            calibration,
            before,
            after,
            cause,
            in_use,
        })
    }

    /// Those before are used again, screw by screw, or none; what is no longer used, and what is.
    fn fall_back(&mut self, store: &Store) -> Result<(String, Option<String>), Failure> {
        let mut left = Vec::new();
        let mut in_use = Vec::new();
        for at in 0..self.state.screws.len() {
            let screw = &mut self.state.screws[at];
            screw.compensation = None;
            let (axis, id) = (screw.axis.clone(), screw.calibration.take());
            left.extend(id.as_deref().map(short));
            if id.is_some() && store.active(&axis)?.current == id {
                in_use.extend(store.retire(&axis)?.as_deref().map(short));
            }
        }
        settle(&mut self.core, store)?;
        // What does not fit any more is said when somebody uses it.
        let _ = self.load_active(store);
        let named = (!in_use.is_empty()).then(|| in_use.join(", "));
        Ok((left.join(", "), named))
    }
}

fn sum(a: Pose, b: Pose) -> Pose {
    Pose {
        x: a.x + b.x,
        y: a.y + b.y,
        angle: Radians(a.angle.value() + b.angle.value()),
    }
}
