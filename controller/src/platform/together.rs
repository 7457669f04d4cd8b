//! A platform as a group that moves as one, for whoever keeps a machine.

use machine::records::Store;
use units::AxisSpeed;

use crate::connected::Machine;
use crate::failure::Failure;
use crate::platform::PlatformTeller;
use crate::platform::jog::PoseJog;
use crate::platform::motion::{PlatformMoved, PoseAsked};
use crate::platform::target::places;
use crate::runs::{GroupMove, GroupMoved, GroupMoves, Judge, NotMoved, PartMoved, Teller};

/// The screws of a platform move together, whether they are corrected or not.
pub(super) static MOVES: GroupMoves = GroupMoves { judge, perform };

fn judge(machine: &mut Machine, store: &Store) -> Result<Judge, Failure> {
    let platform = machine.platform()?;
    let course = platform.course(platform.without_calibration(store)?);
    Ok(Judge::by(course))
}

fn perform(
    machine: &mut Machine,
    store: &Store,
    asked: &GroupMove,
    teller: Option<&Teller>,
) -> Result<GroupMoved, NotMoved> {
    if let Some(speed) = asked.jog {
        return jogged(machine, asked, speed);
    }
    let speed = asked.speed;
    let asked = PoseAsked::of(asked);
    let mut platform = machine.platform().map_err(NotMoved::Before)?;
    platform.speed = speed;
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

/// It runs on to the end of its reach, unless somebody stops it before.
fn jogged(
    machine: &mut Machine,
    asked: &GroupMove,
    speed: AxisSpeed,
) -> Result<GroupMoved, NotMoved> {
    let mut platform = machine.platform().map_err(NotMoved::Before)?;
    let part = asked.targets.first().map_or("", |it| it.0.as_str());
    let planned = PoseJog::new(part, speed).and_then(|jog| platform.plan_jog(jog));
    let planned = planned.map_err(NotMoved::Before)?;
    platform.run_jog(&planned, None)?;
    let parts = places(planned.target).map(|(name, target)| PartMoved {
        name: name.to_owned(),
        target,
        set_point: None,
        position: None,
        standard_uncertainty: None,
    });
    Ok(GroupMoved {
        parts: parts.to_vec(),
        told: None,
    })
}

fn parts_of(moved: &PlatformMoved) -> Vec<PartMoved> {
    let seen = places(moved.seen).into_iter();
    let uncertainty = moved.uncertainty.map(places);
    let parts = places(moved.target).into_iter().zip(seen).enumerate();
    let parts = parts.map(|(at, ((name, target), (_, seen)))| PartMoved {
        name: name.to_owned(),
        target,
        set_point: None,
        position: Some(seen),
        standard_uncertainty: uncertainty.map(|it| it[at].1),
    });
    parts.collect()
}
