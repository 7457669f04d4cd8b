//! A platform as a group that moves as one, for whoever keeps a machine.

use compensator::platform::Pose;
use machine::records::Store;

use crate::connected::Machine;
use crate::failure::Failure;
use crate::platform::PlatformTeller;
use crate::platform::motion::{PlatformMoved, PoseAsked};
use crate::platform::target::parts;
use crate::runs::{GroupMove, GroupMoved, GroupMoves, Judge, PartMoved, Place, Teller};

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
) -> Result<GroupMoved, Failure> {
    let asked = PoseAsked::of(asked);
    let mut platform = machine.platform()?;
    platform.check_asked(store, &asked)?;
    let before = platform.look_for(&asked)?;
    let moved = platform.move_asked(store, &asked, before)?;
    let words = teller.and_then(|it| it.of::<PlatformTeller>());
    Ok(GroupMoved {
        parts: parts_of(&moved),
        told: words.map(|it| (it.moved)(&moved)),
    })
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
