//! Paths of three axes: judged whole before anything moves, on whatever thread, and followed.

use core::time::Duration;
use std::path::Path;

use compensator::volumetric::{Point, Volume};
use machine::Stage;
use machine::engine::{CsvPath, Join, Lack, Live, PathFault, PushError, Validity, read_path};
use units::Metres;

use crate::failure::Failure;
use crate::volumetric::failure::PathRefusal;
use crate::volumetric::handle::WorkVolume;
use crate::volumetric::moves::check_in;
use crate::volumetric::settings::work_volume;
use crate::volumetric::{Mover, VolumetricFailure};

/// Judges paths by what the axes can follow and by the calibrated volume.
pub(crate) struct VolumePathJudge {
    mover: Mover,
    volume: Volume,
    reach: Metres,
}

impl VolumePathJudge {
    /// From point to point.
    pub(super) const fn period(&self) -> Duration {
        self.mover.engine().period()
    }

    /// Reads and judges all of the path in `text`, which is called `file`, point by point as it will be driven: what
    /// cannot be made to its end is not begun. `join` joins its rows, or what the text says.
    ///
    /// # Errors
    /// What cannot be read, or the first point that cannot be driven.
    pub(crate) fn judge(
        &self,
        (file, text): (&Path, &str),
        join: Option<Join>,
        is_corrected: bool,
    ) -> Result<CsvPath, Failure> {
        let refused = |source| VolumetricFailure::RefusedPath {
            path: file.to_owned(),
            source,
        };
        let engine = self.mover.engine();
        let path = read_path(text, &engine.path_form(join));
        let path = path.map_err(|source| Failure::Usage {
            what: format!("{}: {source}", file.display()),
            help: "nothing was moved; the columns are time_s,x_mm,y_mm,z_mm; see README.md".into(),
        })?;
        let checked = self.mover.check_path(&path.points);
        checked.map_err(|source| refused(at_corner(source, &path, engine.period())))?;
        if is_corrected {
            for (point, period) in path.points.iter().zip(0..) {
                let place = Point::new(point[0], point[1], point[2]);
                let at_s = f64::from(period) * engine.period().as_secs_f64();
                let checked = check_in(&self.volume, self.reach, place).map_err(Box::new);
                let lines = path.lines_at(at_s);
                checked.map_err(|source| {
                    refused(PathRefusal::Volume {
                        lines,
                        at_s,
                        source,
                    })
                })?;
            }
        }
        Ok(path)
    }
}

/// A jerk is told by so many periods.
const JERK_OVER: f64 = 3.0;

/// Why `path` is refused: where it is at a corner that the axes cannot follow, what they could.
fn at_corner(source: PushError, path: &CsvPath, period: Duration) -> PathRefusal {
    let PushError::Refused(point) = &source else {
        return PathRefusal::Point {
            source,
            lines: None,
        };
    };
    let lines = path.lines_at(point.at_s);
    // Along a line nothing speeds up.
    if !matches!(
        point.fault,
        PathFault::Acceleration { .. } | PathFault::Jerk { .. }
    ) {
        return PathRefusal::Point { source, lines };
    }
    let off = |at_s: f64| (at_s - point.at_s).abs();
    // What is refused elsewhere is not about a corner; a jerk shows with the points after it.
    let shows = JERK_OVER * period.as_secs_f64();
    let corners = path.tight.iter();
    let corners = corners.filter(|it| off(it.at_s) <= it.half_s + shows);
    let nearest = corners.min_by(|one, other| off(one.at_s).total_cmp(&off(other.at_s)));
    match nearest {
        Some(corner) => PathRefusal::Corner {
            source,
            line: corner.line,
            wants: corner.wants,
        },
        None => PathRefusal::Point { source, lines },
    }
}

/// A path that was followed.
#[derive(Clone, Debug)]
pub struct PathFollowed {
    /// How many points it had.
    pub count: usize,
    /// What the correction said; `None`: by the encoders alone.
    pub corrected: Option<CorrectedPath>,
    /// How punctual the loop was.
    pub timing: String,
    /// How the loop's thread was scheduled.
    pub thread: String,
    /// Its last period.
    pub(super) last: Option<Live>,
}

/// What the correction said along a path.
#[derive(Clone, Debug, Default)]
pub struct CorrectedPath {
    /// The largest, by axis.
    pub largest: [Metres; 3],
    /// Its largest standard uncertainty.
    pub u: [Metres; 3],
    /// So many periods.
    pub periods: u64,
    /// The worst that it had to do without.
    pub without: Option<Lack>,
    /// For so many periods.
    pub degraded: u64,
    /// In so many it was limited.
    pub limited: u64,
}

impl CorrectedPath {
    fn note(&mut self, live: &Live) {
        self.periods += 1;
        for axis in 0..3 {
            self.largest[axis] = self.largest[axis].max(live.offset[axis].abs());
            self.u[axis] = self.u[axis].max(live.uncertainty[axis]);
        }
        if let Validity::Without(lack) = live.validity {
            self.without = Some(lack.worse_of(self.without));
        }
        self.degraded += u64::from(live.validity != Validity::Valid);
        let is_limited = live.alarms.iter().any(Option::is_some) || live.clamped.contains(&true);
        self.limited += u64::from(is_limited);
    }
}

impl WorkVolume<'_> {
    /// Who judges paths of the three axes.
    ///
    /// # Errors
    /// When an axis is not made for it.
    pub(crate) fn path_judge(&self) -> Result<VolumePathJudge, Failure> {
        let config = self.config;
        Ok(VolumePathJudge {
            mover: self.uncorrected_mover()?,
            volume: work_volume(config).map_err(VolumetricFailure::from)?,
            reach: Metres::from_um(config.compensation.size_limit_um),
        })
    }

    /// Follows `points`, corrected or not; `begun` is called when the correction is there and the path begins.
    ///
    /// # Errors
    /// Those of [`Self::correct`] and [`Self::drive_along`].
    pub(crate) fn follow(
        &mut self,
        mover: &mut Mover,
        points: Vec<Vec<Metres>>,
        is_corrected: bool,
        begun: impl FnOnce(),
    ) -> Result<PathFollowed, Failure> {
        self.correct(mover, is_corrected)?;
        begun();
        let takes = mover.engine().period().mul_f64(points.len() as f64);
        let observer = self.core.observer();
        observer.begins(Stage::Job, "volume", takes);
        let mut corrected = CorrectedPath::default();
        let mut last = None;
        let count = points.len();
        self.drive_along(mover, points, &mut |live| {
            corrected.note(live);
            last = Some(*live);
        })?;
        let timing = mover.engine().timing();
        Ok(PathFollowed {
            count,
            corrected: is_corrected.then_some(corrected),
            timing: timing.to_string(),
            thread: timing.scheduling.clone(),
            last,
        })
    }
}
