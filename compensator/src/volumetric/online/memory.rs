//! States a machine is to keep: built in on purpose (first), or met with the first part (second).
//!
//! Source: CN1214003A, second and third part. The error is the current state less the stored
//! one, so that what is stored is not compensated away. The patent lets both work together
//! without saying how: here the second memory stores what the state was *beyond* the first
//! one's and beyond what was compensated while the first part was made, so that
//!
//! kept = first(x) + second(x)
//!
//! is the state the first part was really made in, whichever of the two was on at that time.
//! With nothing else on, it is the state itself, as in the patent.
//!
//! Absent: the roll as a state to be kept; storage.

use units::Metres;

use super::Displacement;
use super::reference::difference;
use crate::volumetric::function::{Function, FunctionError, Shape};
use crate::volumetric::{Axis, Volume};

/// Sideways displacements of all axes as functions of their positions.
#[derive(Clone, Debug, Default)]
pub struct StateMap {
    /// By axis; `None` where nothing is kept. The ends hold beyond the nodes.
    pub of: [Option<[Function<Metres>; 2]>; 3],
}

impl StateMap {
    /// The stored displacement of `axis` at `position`; zero where nothing is stored.
    pub fn at(&self, axis: Axis, position: Metres) -> Displacement {
        self.of[axis.index()]
            .as_ref()
            .map_or([Metres::ZERO; 2], |it| {
                [it[0].at(position), it[1].at(position)]
            })
    }
}

/// Both memories, each as far as there is one and it is on.
#[derive(Clone, Debug, Default)]
pub struct Memories {
    /// What the machine was built with.
    pub first: Option<StateMap>,
    /// What the first part was made with.
    pub second: Option<StateMap>,
}

impl Memories {
    /// The displacement that is to be kept.
    pub fn kept(&self, axis: Axis, position: Metres) -> Displacement {
        let at = |map: &Option<StateMap>| {
            map.as_ref()
                .map_or([Metres::ZERO; 2], |it| it.at(axis, position))
        };
        let (first, second) = (at(&self.first), at(&self.second));
        [first[0] + second[0], first[1] + second[1]]
    }

    /// What is `left` of a displacement less what the first memory keeps: what the second is to
    /// store.
    pub fn beyond_first(&self, axis: Axis, position: Metres, left: Displacement) -> Displacement {
        let first = self.first.as_ref();
        let first = first.map_or([Metres::ZERO; 2], |it| it.at(axis, position));
        difference(left, first)
    }

    /// The current displacement less what is to be kept.
    pub fn error(&self, axis: Axis, position: Metres, current: Displacement) -> Displacement {
        difference(current, self.kept(axis, position))
    }
}

/// How a state is recorded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RecorderSettings {
    /// States closer together than this are averaged.
    pub spacing: Metres,
    /// A stretch of an axis longer than this without a state, between two with one, is refused.
    pub gap_max: Metres,
}

/// Why a recorded state cannot be kept.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum MemoryError {
    /// A spacing or gap that is not positive, or so small that memory would not do.
    #[error("state memory: a spacing of {} mm and gaps of {} mm cannot be used",
        units::Short(spacing.mm()), units::Short(gap_max.mm()))]
    Settings {
        /// The spacing.
        spacing: Metres,
        /// The longest gap.
        gap_max: Metres,
    },
    /// No axis had two states.
    #[error("state memory: nothing was recorded; run the first part while recording")]
    Empty,
    /// A long stretch was not met.
    #[error("state memory, axis {axis}: nothing was recorded from {} to {} mm, at most {} mm may \
        be bridged", units::Short(from.mm()), units::Short(to.mm()), units::Short(limit.mm()))]
    Gap {
        /// Which axis.
        axis: Axis,
        /// Its beginning.
        from: Metres,
        /// Its end.
        to: Metres,
        /// The longest accepted.
        limit: Metres,
    },
    /// Means that form no function.
    #[error(transparent)]
    Function(#[from] FunctionError),
}

/// Which part of each axis a recorded state covers; beyond, its ends hold.
pub type Coverage = [Option<(Metres, Metres)>; 3];

/// Sums of one stretch of an axis.
#[derive(Clone, Copy, Debug, Default)]
struct Bin {
    count: f64,
    position: f64,
    state: [f64; 2],
}

/// Records the second memory; memory is taken when it is made, none while it records.
#[derive(Clone, Debug)]
pub struct StateRecorder {
    settings: RecorderSettings,
    low: [f64; 3],
    bins: [Vec<Bin>; 3],
}

/// So many stretches of one axis at most.
const BINS_MAX: f64 = 1e6;

impl StateRecorder {
    /// An empty recorder for positions within `volume`.
    ///
    /// # Errors
    /// When the spacing or the gap is not positive, or the spacing is far too small.
    pub fn new(volume: &Volume, settings: RecorderSettings) -> Result<Self, MemoryError> {
        let RecorderSettings { spacing, gap_max } = settings;
        let count = |axis: Axis| {
            let span = volume.high().along(axis) - volume.low().along(axis);
            (span / spacing).ceil()
        };
        let counts = Axis::ALL.map(count);
        let sound = |it: &f64| *it >= 1.0 && *it <= BINS_MAX;
        if !(spacing > Metres::ZERO && gap_max > Metres::ZERO && counts.iter().all(sound)) {
            return Err(MemoryError::Settings { spacing, gap_max });
        }
        Ok(Self {
            settings,
            low: volume.low().array(),
            bins: counts.map(|it| vec![Bin::default(); it as usize]),
        })
    }

    /// Takes the state of `axis` at `position`: the current displacement less what of it is
    /// compensated now and less what the first memory keeps. What is outside or no number is
    /// ignored.
    pub fn record(&mut self, axis: Axis, position: Metres, left: Displacement) {
        let k = axis.index();
        let place = (position.value() - self.low[k]) / self.settings.spacing.value();
        let finite = place.is_finite() && left.iter().all(|it| it.is_finite());
        let last = self.bins[k].len();
        // The end of the axis belongs to its last stretch.
        if !finite || place < 0.0 || place > last as f64 {
            return;
        }
        let bin = &mut self.bins[k][(place as usize).min(last - 1)];
        bin.count += 1.0;
        bin.position += position.value();
        bin.state[0] += left[0].value();
        bin.state[1] += left[1].value();
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        for bin in self.bins.iter_mut().flatten() {
            *bin = Bin::default();
        }
    }

    /// Makes a memory of what was recorded, with what it covers. An axis that stood still is
    /// kept with what it had there.
    ///
    /// # Errors
    /// When nothing was recorded, or a stretch without states is too long.
    pub fn finish(&self) -> Result<(StateMap, Coverage), MemoryError> {
        let (mut map, mut coverage) = (StateMap::default(), Coverage::default());
        for axis in Axis::ALL {
            if let Some((functions, range)) = self.axis(axis)? {
                map.of[axis.index()] = Some(functions);
                coverage[axis.index()] = Some(range);
            }
        }
        if coverage.iter().all(Option::is_none) {
            return Err(MemoryError::Empty);
        }
        Ok((map, coverage))
    }

    #[expect(
        clippy::type_complexity,
        reason = "two functions and the range they cover"
    )]
    fn axis(
        &self,
        axis: Axis,
    ) -> Result<Option<([Function<Metres>; 2], (Metres, Metres))>, MemoryError> {
        let bins = &self.bins[axis.index()];
        let met = || bins.iter().filter(|it| it.count > 0.0);
        let mut nodes: Vec<Metres> = met().map(|it| Metres(it.position / it.count)).collect();
        let values =
            |k: usize| -> Vec<Metres> { met().map(|it| Metres(it.state[k] / it.count)).collect() };
        let mut values = [values(0), values(1)];
        let Some((&from, &to)) = nodes.first().zip(nodes.last()) else {
            return Ok(None);
        };
        let limit = self.settings.gap_max;
        if let Some(gap) = nodes.windows(2).find(|it| it[1] - it[0] > limit) {
            let (from, to) = (gap[0], gap[1]);
            return Err(MemoryError::Gap {
                axis,
                from,
                to,
                limit,
            });
        }
        if nodes.len() == 1 {
            nodes.push(from + self.settings.spacing);
            values.iter_mut().for_each(|it| it.push(it[0]));
        }
        let function = |k: usize| Function::new(&nodes, &values[k], Shape::Linear);
        Ok(Some(([function(0)?, function(1)?], (from, to))))
    }
}
