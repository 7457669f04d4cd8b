//! A platform as a group that moves as one, for whoever keeps a machine.

use compensator::platform::Pose;
use machine::records::Store;

use crate::connected::Machine;
use crate::failure::Failure;
use crate::platform::PlatformTeller;
use crate::platform::motion::{PlatformMoved, PoseAsked};
use crate::platform::target::parts;
use crate::runs::{GroupMove, GroupMoved, GroupMoves, Judge, NotMoved, PartMoved, Place, Teller};

/// The screws of a platform move together, whether they are corrected or not.
pub(super) static MOVES: GroupMoves = GroupMoves { judge, perform };

fn judge(machine: &mut Machine, store: &Store) -> Result<Judge, Failure> {
    let platform = machine.platform()?;
    let course = platform.course(platform.without_calibration(store)?);
    Ok(Judge::new(move |_, asked| {
        course.check(&PoseAsked::of(asked))
    }))
}

fn perform(
    machine: &mut Machine,
    store: &Store,
    asked: &GroupMove,
    teller: Option<&Teller>,
) -> Result<GroupMoved, NotMoved> {
    let asked = PoseAsked::of(asked);
    let mut platform = machine.platform().map_err(NotMoved::Before)?;
    let checked = platform.check_asked(store, &asked);
    checked.map_err(NotMoved::Before)?;
    let before = platform.look_for(&asked);
    let before = before.map_err(|it| not_seen(&platform.config.camera, it))?;
    let moved = platform.move_asked(store, &asked, before)?;
    let words = teller.and_then(|it| it.of::<PlatformTeller>());
    Ok(GroupMoved {
        parts: parts_of(&moved),
        told: words.map(|it| (it.moved)(&moved)),
    })
}

/// A camera that sees nothing harms nobody before anything moves. What fails meanwhile may be a drive all the same.
fn not_seen(camera: &str, failure: Failure) -> NotMoved {
    match &failure {
        Failure::Machine(it) if it.device() == Some(camera) => NotMoved::Before(failure),
        _ => NotMoved::UnderWay(failure),
    }
}

fn parts_of(moved: &PlatformMoved) -> Vec<PartMoved> {
    let parts = parts().into_iter().zip(0..);
    let place = |pose: Pose, at: usize| match at {
        0 => Place::Length(pose.x),
        1 => Place::Length(pose.y),
        _ => Place::Angle(pose.angle),
    };
    let parts = parts.map(|(part, at)| PartMoved {
        name: part.name,
        target: place(moved.target, at),
        set_point: None,
        position: Some(place(moved.seen, at)),
        standard_uncertainty: moved.uncertainty.map(|it| place(it, at)),
    });
    parts.collect()
}
