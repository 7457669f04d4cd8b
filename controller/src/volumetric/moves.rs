//! Moves of the tool: all three axes in one straight line, each set-point corrected.

use core::time::Duration;
use std::collections::VecDeque;

use compensator::volumetric::{Axis, Point, Volume};
use units::Metres;

use crate::config::MachineConfig;
use crate::failure::Failure;
use crate::volumetric::VolumetricConfig;
use crate::volumetric::VolumetricFailure;
use crate::volumetric::handle::WorkVolume;
use crate::volumetric::settings::work_volume;
use machine::engine::{
    Cause, Correction, Desk, Engine, Live, NoCorrection, PushError, State, Validity,
};

/// So many time constants of its smoothing after it came, a value is there.
const SMOOTHINGS: f64 = 3.0;

/// Three axes that are moved together, and what is added to their set-points.
pub struct Mover {
    engine: Engine,
    desk: Desk,
}

impl Mover {
    /// The loop, for what it counted.
    pub const fn engine(&self) -> &Engine {
        &self.engine
    }

    /// Its newest period.
    pub(super) fn newest(&mut self) -> Option<Live> {
        self.desk.live()
    }

    /// Whether the tool can be moved to `target`, before anything moves.
    ///
    /// # Errors
    /// When an axis cannot.
    pub fn check_target(&mut self, target: Point) -> Result<(), Failure> {
        self.desk.check_target(&per_axis(target))?;
        Ok(())
    }

    /// Whether [`WorkVolume::drive_along`] can drive `points` to their end, before anything moves.
    ///
    /// # Errors
    /// The first that cannot be driven.
    pub fn check_path(&self, points: &[Vec<Metres>]) -> Result<(), PushError> {
        self.desk.path.check(points)
    }
}

fn per_axis(point: Point) -> [Metres; 3] {
    Axis::ALL.map(|axis| point.along(axis))
}

impl WorkVolume<'_> {
    /// Moves the axes of the volume, with `correction` switched off to begin with.
    ///
    /// # Errors
    /// When an axis is not made for it.
    pub fn mover(&self, correction: Box<dyn Correction>) -> Result<Mover, Failure> {
        let config = self.config;
        let axes = config.axes.each_ref().map(String::as_str);
        let (engine, desk) = Engine::new(self.core.machine, &axes, correction)?;
        Ok(Mover { engine, desk })
    }

    /// Likewise, for set-points that nothing is added to.
    ///
    /// # Errors
    /// As [`Self::mover`].
    pub fn uncorrected_mover(&self) -> Result<Mover, Failure> {
        self.mover(Box::new(NoCorrection))
    }

    /// Switches the correction on or off at standstill, and waits until it is all there: each
    /// detector confirmed, blended in and smoothed. Says what it was in the last period. What the
    /// configuration lets it go on without (held, faded out) is told as a warning.
    ///
    /// Outside the volume no correction is known, and with one the machine would stop there: before
    /// it is switched on, axes that stand outside go straight to the nearest place inside.
    ///
    /// # Errors
    /// Whatever stops the machine, also a correction that must not be done without; a detector or
    /// thermometer that nothing makes up for, such as one that is to be held and never said
    /// anything.
    pub fn correct(&mut self, mover: &mut Mover, on: bool) -> Result<Live, Failure> {
        if on {
            self.enter_volume()?;
        }
        let rest = settling(self.config, self.core.config);
        mover.desk.correct(on)?;
        let live = self.hold(mover, None, rest, &mut |_| {})?;
        if on {
            self.require_whole(live.validity)?;
        }
        Ok(live)
    }

    fn require_whole(&mut self, validity: Validity) -> Result<(), Failure> {
        match validity {
            Validity::Valid => Ok(()),
            Validity::Without(lack) if lack.is_made_up_for() => {
                self.core
                    .observer()
                    .warning(&format!("corrected without {lack}"));
                Ok(())
            }
            Validity::Without(lack) | Validity::Lost(lack) => {
                Err(VolumetricFailure::Lacking { lack }.into())
            }
            Validity::Hold | Validity::FadeOut | Validity::Stop(_) => {
                Err(VolumetricFailure::NotProven.into())
            }
        }
    }

    /// Whether `point` can be corrected: in the calibrated volume, or so little beyond its end that
    /// it is at its end.
    ///
    /// # Errors
    /// When it is outside.
    pub fn check(&self, point: Point) -> Result<(), VolumetricFailure> {
        let config = self.core.config.volumetric.as_ref();
        let config = config.ok_or(VolumetricFailure::None)?;
        let reach = Metres::from_um(config.compensation.size_limit_um);
        check_in(&work_volume(config)?, reach, point)
    }

    fn enter_volume(&mut self) -> Result<(), Failure> {
        let config = self.config.clone();
        let mut here = [Metres::ZERO; 3];
        for (position, axis) in here.iter_mut().zip(&config.axes) {
            *position = self.core.reading(axis)?.map_or(*position, |it| it.position);
        }
        let here = Point::new(here[0], here[1], here[2]);
        if self.check(here).is_err() {
            let volume = work_volume(&config).map_err(VolumetricFailure::from)?;
            self.go_straight(volume.nearest(here))?;
        }
        Ok(())
    }

    /// Moves the tool so that all axes together go straight to `target`, and stays there for
    /// `rest`. Says what the last period was.
    ///
    /// # Errors
    /// When the target is outside the soft limits, before anything moves; whatever stops the
    /// machine.
    pub fn drive_to(
        &mut self,
        mover: &mut Mover,
        target: Point,
        rest: Duration,
    ) -> Result<Live, Failure> {
        self.hold(mover, Some(target), rest, &mut |_| {})
    }

    /// The same, with `watch` told every period.
    ///
    /// # Errors
    /// As [`Self::drive_to`].
    pub fn drive_watched(
        &mut self,
        mover: &mut Mover,
        target: Point,
        rest: Duration,
        watch: &mut dyn FnMut(&Live),
    ) -> Result<Live, Failure> {
        self.hold(mover, Some(target), rest, watch)
    }

    /// Follows `points`, one for each period, which are checked before they are driven.
    ///
    /// # Errors
    /// When a point cannot be driven; whatever stops the machine.
    pub fn drive_along(
        &mut self,
        mover: &mut Mover,
        points: Vec<Vec<Metres>>,
        watch: &mut dyn FnMut(&Live),
    ) -> Result<(), Failure> {
        let Mover { engine, desk } = mover;
        let begun = desk.path.begin();
        begun.map_err(|source| VolumetricFailure::Path { source })?;
        let mut left: VecDeque<_> = points.into();
        let mut refused = None;
        let mut finished = false;
        let mut feed = || {
            while let Some(live) = desk.next_live() {
                watch(&live);
            }
            while let Some(point) = left.front() {
                match desk.path.push(point) {
                    Ok(()) => drop(left.pop_front()),
                    Err(PushError::Full) => return,
                    Err(error) => {
                        refused.get_or_insert(error);
                        left.clear();
                        // What was written is driven to its end, or stopped where it runs dry.
                        let _ = desk.stop();
                        return;
                    }
                }
            }
            finished = finished || desk.path.finish().is_ok();
        };
        feed();
        let cause = self.core.follow_with(engine, &mut feed)?;
        match refused {
            Some(source) => Err(VolumetricFailure::Path { source }.into()),
            None => expect_cause(cause, Cause::PathDone),
        }
    }

    fn hold(
        &mut self,
        mover: &mut Mover,
        target: Option<Point>,
        rest: Duration,
        watch: &mut dyn FnMut(&Live),
    ) -> Result<Live, Failure> {
        let Mover { engine, desk } = mover;
        if let Some(target) = target {
            desk.move_within(&per_axis(target), self.speed)?;
        }
        let mut since = None;
        let mut last = None;
        let mut trouble = None;
        let cause = self.core.follow_with(engine, &mut || {
            let Some(live) = desk.live() else {
                return;
            };
            last = Some(live);
            watch(&live);
            if live.state != State::Holding {
                since = None;
                return;
            }
            let stood = live.at.since(*since.get_or_insert(live.at));
            if stood >= rest && trouble.is_none() {
                trouble = Some(desk.stop());
            }
        })?;
        if let Some(stopped) = trouble {
            stopped?;
        }
        expect_cause(cause, Cause::Asked)?;
        last.ok_or_else(|| VolumetricFailure::NotThere { cause }.into())
    }
}

fn expect_cause(cause: Cause, expected: Cause) -> Result<(), Failure> {
    if cause == expected {
        return Ok(());
    }
    Err(VolumetricFailure::NotThere { cause }.into())
}

/// Whether `point` is in `volume`, or so little beyond its end that it is at its end.
pub(super) fn check_in(
    volume: &Volume,
    reach: Metres,
    point: Point,
) -> Result<(), VolumetricFailure> {
    volume.nearest_within(point, reach)?;
    Ok(())
}

/// From the first sample until a detector's value is given out as it is.
fn settling(config: &VolumetricConfig, machine: &MachineConfig) -> Duration {
    let Some(feed) = &config.feed else {
        return Duration::ZERO;
    };
    let period_ms = machine.can.values().map(|it| it.sync_period_ms);
    let every = machine.analog.values();
    let every = every.filter_map(|it| it.every_syncs()).max().unwrap_or(1);
    let sample_s = period_ms.fold(0.0, f64::max) * 1e-3 * f64::from(every);
    let sample_s = sample_s.max(machine.longest_picture().as_secs_f64());
    let confirmed_s = f64::from(feed.confirm) * sample_s;
    Duration::from_secs_f64(confirmed_s + feed.blend_s + SMOOTHINGS * feed.smoothing_s)
}
