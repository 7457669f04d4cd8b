//! A move of three axes as it is asked for: to a place of which not every axis need be named, corrected by all that is
//! stored or not at all.

use core::time::Duration;

use compensator::volumetric::{Point, Volume};
use machine::engine::Live;
use machine::records::Store;
use units::{Metres, MetresPerSecond};

use crate::connected::Machine;
use crate::failure::Failure;
use crate::jogging::along;
use crate::memories::Memory;
use crate::runs::{GroupMove, GroupMoved, GroupMoves, Judge, NotMoved, PartMoved, Place, Teller};
use crate::volumetric::handle::WorkVolume;
use crate::volumetric::moved::VolumetricMoved;
use crate::volumetric::moves::check_in;
use crate::volumetric::path::PathFollowed;
use crate::volumetric::settings::work_volume;
use crate::volumetric::{
    GEOMETRY, Mover, VolumetricCorrection, VolumetricFailure, VolumetricRecords, VolumetricState,
    VolumetricTeller,
};

/// How long the tool is seen to stand at its target.
const STAND: Duration = Duration::from_millis(200);

/// What is remembered under this name.
const MEMORY: &str = "volume";

/// Where some of the three axes are told to go.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NamedPoint(pub(crate) [Option<Metres>; 3]);

impl NamedPoint {
    fn of(axes: &[String; 3], asked: &GroupMove) -> Self {
        Self(axes.each_ref().map(|it| asked.length(it)))
    }

    /// The whole point: the axes that are not named stay at `rest`.
    pub(crate) fn from(&self, rest: [Metres; 3]) -> Point {
        let at = |k: usize| self.0[k].unwrap_or(rest[k]);
        Point::new(at(0), at(1), at(2))
    }
}

/// What the last corrected move has left. A loop knows what it has added to the set-points that the drives hold; a new
/// one would add it again, and the tool would go there and back.
#[derive(Default)]
pub(crate) struct LastMove(Option<(Ready, Live)>);

impl Memory for LastMove {
    fn forget(&mut self) {
        self.0 = None;
    }

    fn interrupted_before_it_ends(&mut self) {
        self.0 = None;
    }
}

/// A corrected move that may begin.
pub(crate) struct Ready {
    mover: Mover,
    records: VolumetricRecords,
}

impl WorkVolume<'_> {
    /// Whether the axes may go to `target`; the correction reaches no farther than the volume.
    ///
    /// # Errors
    /// Why not.
    #[cfg(feature = "program")]
    pub(crate) fn check_target(&self, target: Point, is_corrected: bool) -> Result<(), Failure> {
        self.uncorrected_mover()?.check_target(target)?;
        match is_corrected {
            true => Ok(self.check(target)?),
            false => Ok(()),
        }
    }

    /// What a move to `target` needs that all that is stored corrects. Nothing moves.
    ///
    /// # Errors
    /// When nothing was measured, what is stored cannot be applied, or the target is outside.
    pub(crate) fn ready(&mut self, store: &Store, target: Point) -> Result<Ready, Failure> {
        let stored = self.state(store)?.ok_or_else(never_measured)?;
        // A target that is refused must not cost the loop that is kept.
        if let Some((kept, _)) = &mut self.last().0 {
            kept.mover.check_target(target)?;
            self.check(target)?;
        }
        let mut ready = self.loop_of(stored)?;
        ready.mover.check_target(target)?;
        self.check(target)?;
        Ok(ready)
    }

    /// The loop that all that is stored corrects.
    fn corrected_loop(&mut self, store: &Store) -> Result<Ready, Failure> {
        let stored = self.state(store)?.ok_or_else(never_measured)?;
        self.loop_of(stored)
    }

    /// The loop that this corrects: the last one, while that is what it knows.
    fn loop_of(
        &mut self,
        (state, records): (VolumetricState, VolumetricRecords),
    ) -> Result<Ready, Failure> {
        let last = self.last().0.take().map(|it| it.0);
        let last = last.filter(|it| it.records == records);
        if let Some(last) = last {
            return Ok(last);
        }
        let correction = VolumetricCorrection::new(self.core.config, state)?;
        let mover = self.mover(Box::new(correction))?;
        Ok(Ready { mover, records })
    }

    /// Follows `points`, which were judged, corrected by all that is stored or not at all.
    ///
    /// # Errors
    /// When nothing was measured, or what is stored cannot be applied; those of [`Self::follow`].
    pub(crate) fn follow_stored(
        &mut self,
        store: &Store,
        points: Vec<Vec<Metres>>,
        is_corrected: bool,
    ) -> Result<PathFollowed, Failure> {
        if !is_corrected {
            let mut mover = self.uncorrected_mover()?;
            return self.follow(&mut mover, points, false, || {});
        }
        let Ready { mut mover, records } = self.corrected_loop(store)?;
        let followed = self.follow(&mut mover, points, true, || {})?;
        let last = followed.last.map(|live| (Ready { mover, records }, live));
        self.last().0 = last;
        Ok(followed)
    }

    /// Moves the tool to `target`, and says what the correction was there.
    ///
    /// # Errors
    /// Those of [`Self::correct`] and [`Self::drive_to`].
    pub(crate) fn go_corrected(
        &mut self,
        ready: Ready,
        target: Point,
    ) -> Result<VolumetricMoved, Failure> {
        let Ready { mut mover, records } = ready;
        self.correct(&mut mover, true)?;
        let live = self.drive_to(&mut mover, target, STAND)?;
        let moved = VolumetricMoved::of(&mut mover, live);
        self.last().0 = Some((Ready { mover, records }, moved.live));
        Ok(moved)
    }

    fn last(&mut self) -> &mut LastMove {
        self.memories.of(MEMORY, LastMove::default)
    }

    /// Where the tool stands: where it was told to be, as far as the axes still stand there, and else by the encoders.
    fn stands(&self) -> Result<[Metres; 3], Failure> {
        let mut stands = [Metres::ZERO; 3];
        let last = self.memories.get::<LastMove>(MEMORY);
        for (k, axis) in self.config.axes.iter().enumerate() {
            let reading = self.core.reading(axis)?;
            let here = reading.map_or(Metres::ZERO, |it| it.position);
            let window = self.core.axis_settings(axis)?.position_window;
            let told = last.and_then(|it| it.0.as_ref()).map(|it| it.1);
            let told = told.filter(|it| (it.nominal[k] + it.offset[k] - here).abs() <= window);
            stands[k] = told.map_or(here, |it| it.nominal[k]);
        }
        Ok(stands)
    }
}

/// Refuses what is to be corrected where nothing was measured.
///
/// # Errors
/// Nothing was, or the store cannot be read.
pub(crate) fn require_measured(store: &Store) -> Result<(), Failure> {
    match store.active(GEOMETRY)?.current {
        Some(_) => Ok(()),
        None => Err(never_measured()),
    }
}

/// Three axes that nothing corrects.
fn never_measured() -> Failure {
    Failure::NotCalibrated {
        what: "the errors of x, y and z were never measured".into(),
    }
}

/// Three axes move as one where they are corrected, and each by itself where they are not.
pub(super) static MOVES: GroupMoves = GroupMoves { judge, perform };

/// What can be told of a move before any device is asked for more than where it stands.
struct VolumeCourse {
    axes: [String; 3],
    volume: Volume,
    reach: Metres,
    is_measured: bool,
}

impl VolumeCourse {
    fn check(&self, machine: &machine::Machine, asked: &GroupMove) -> Result<(), Failure> {
        if asked.align {
            return Err(Failure::Usage {
                what: "three axes are not aligned: no camera sees them".into(),
                help: "leave `align` out".into(),
            });
        }
        if !self.is_measured {
            return Err(never_measured());
        }
        tool_speed(asked)?;
        let mut rest = [Metres::ZERO; 3];
        for (rest, axis) in rest.iter_mut().zip(&self.axes) {
            if let Some(target) = asked.length(axis) {
                machine.check_soft_limits(axis, target)?;
            }
            *rest = machine
                .reading(axis)?
                .map_or(Metres::ZERO, |it| it.position);
        }
        let target = NamedPoint::of(&self.axes, asked).from(rest);
        Ok(check_in(&self.volume, self.reach, target)?)
    }
}

/// The greatest speed of the tool, where one is asked for.
fn tool_speed(asked: &GroupMove) -> Result<Option<MetresPerSecond>, Failure> {
    let speed = asked.speed.map(|speed| along(GEOMETRY, speed));
    speed.transpose()
}

fn judge(machine: &mut Machine, store: &Store) -> Result<Judge, Failure> {
    let volume = machine.volumetric()?;
    let config = volume.config();
    let course = VolumeCourse {
        axes: config.axes.clone(),
        volume: work_volume(config).map_err(VolumetricFailure::from)?,
        reach: Metres::from_um(config.compensation.size_limit_um),
        is_measured: store.active(GEOMETRY)?.current.is_some(),
    };
    Ok(Judge::new(move |machine, asked| {
        course.check(machine, asked)
    }))
}

/// What needs no device.
fn prepare(
    volume: &mut WorkVolume<'_>,
    store: &Store,
    asked: &GroupMove,
) -> Result<(Ready, Point), Failure> {
    let named = NamedPoint::of(&volume.config.axes, asked);
    let target = named.from(volume.stands()?);
    Ok((volume.ready(store, target)?, target))
}

fn perform(
    machine: &mut Machine,
    store: &Store,
    asked: &GroupMove,
    teller: Option<&Teller>,
) -> Result<GroupMoved, NotMoved> {
    let mut volume = machine.volumetric().map_err(NotMoved::Before)?;
    let axes = volume.config().axes.clone();
    volume.speed = tool_speed(asked).map_err(NotMoved::Before)?;
    let (ready, target) = prepare(&mut volume, store, asked).map_err(NotMoved::Before)?;
    let moved = volume.go_corrected(ready, target)?;
    let live = moved.live;
    let mut parts = Vec::new();
    for (k, axis) in axes.into_iter().enumerate() {
        let reading = volume.core.reading(&axis).map_err(Failure::from)?;
        let u = live.uncertainty[k];
        parts.push(PartMoved {
            target: Place::Length(live.nominal[k]),
            set_point: Some(Place::Length(live.nominal[k] + live.offset[k])),
            position: reading.map(|it| Place::Length(it.position - live.offset[k])),
            standard_uncertainty: u.value().is_finite().then_some(Place::Length(u)),
            name: axis,
        });
    }
    let words = teller.and_then(|it| it.of::<VolumetricTeller>());
    Ok(GroupMoved {
        parts,
        told: words.map(|it| (it.moved)(&moved)),
    })
}
