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
//! With nothing else on, it is the state itself, as in the patent. A state is displacements and, where it is
//! watched, the roll: of both a slide is displaced by what is kept, and rolled by it.
//!
//! Absent: storage.

use units::{Metres, Quantity, Radians};

use super::Displacement;
use super::reference::difference;
use crate::volumetric::function::{Function, FunctionError, Shape};
use crate::volumetric::{Axis, Volume};

/// Sideways displacements and rolls of all axes as functions of their positions.
#[derive(Clone, Debug, Default)]
pub struct StateMap {
    /// By axis; `None` where nothing is kept. The ends hold beyond the nodes.
    pub of: [Option<[Function<Metres>; 2]>; 3],
    /// Likewise the rolls.
    pub roll: [Option<Function<Radians>>; 3],
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

    /// The stored roll; zero where none is stored.
    pub fn roll_at(&self, axis: Axis, position: Metres) -> Radians {
        let roll = self.roll[axis.index()].as_ref();
        roll.map_or(Radians::ZERO, |it| it.at(position))
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

    /// The roll that is to be kept.
    pub fn kept_roll(&self, axis: Axis, position: Metres) -> Radians {
        let each = [&self.first, &self.second].into_iter().flatten();
        let each = each.map(|it| it.roll_at(axis, position));
        each.fold(Radians::ZERO, |sum, it| sum + it)
    }

    /// Likewise of a roll, as [`beyond_first`](Self::beyond_first).
    pub fn roll_beyond_first(&self, axis: Axis, position: Metres, left: Radians) -> Radians {
        let first = self.first.as_ref();
        left - first.map_or(Radians::ZERO, |it| it.roll_at(axis, position))
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
#[derive(Clone, Copy, Debug)]
struct Bin<const N: usize> {
    count: f64,
    position: f64,
    state: [f64; N],
}

impl<const N: usize> Bin<N> {
    const EMPTY: Self = Self {
        count: 0.0,
        position: 0.0,
        state: [0.0; N],
    };
}

/// What was recorded of N values along one axis, by stretches of equal length.
#[derive(Clone, Debug)]
struct Track<const N: usize> {
    low: f64,
    spacing: f64,
    bins: Vec<Bin<N>>,
}

/// Means of a track, and where they are.
struct Means<const N: usize> {
    nodes: Vec<Metres>,
    values: [Vec<f64>; N],
    /// From the first to the last place that was met.
    range: (Metres, Metres),
}

impl<const N: usize> Track<N> {
    fn new(low: f64, spacing: f64, stretches: usize) -> Self {
        Self {
            low,
            spacing,
            bins: vec![Bin::EMPTY; stretches],
        }
    }

    /// What is outside or no number is ignored.
    fn record(&mut self, position: Metres, state: [f64; N]) {
        let place = (position.value() - self.low) / self.spacing;
        let finite = place.is_finite() && state.iter().all(|it| it.is_finite());
        let last = self.bins.len();
        // The end of the axis belongs to its last stretch.
        if !finite || place < 0.0 || place > last as f64 {
            return;
        }
        let bin = &mut self.bins[(place as usize).min(last - 1)];
        bin.count += 1.0;
        bin.position += position.value();
        for (sum, value) in bin.state.iter_mut().zip(state) {
            *sum += value;
        }
    }

    /// `None` when nothing was recorded.
    fn means(&self, axis: Axis, limit: Metres) -> Result<Option<Means<N>>, MemoryError> {
        let met = || self.bins.iter().filter(|it| it.count > 0.0);
        let mut nodes: Vec<Metres> = met().map(|it| Metres(it.position / it.count)).collect();
        let mut values: [Vec<f64>; N] =
            core::array::from_fn(|k| met().map(|it| it.state[k] / it.count).collect());
        let Some((&from, &to)) = nodes.first().zip(nodes.last()) else {
            return Ok(None);
        };
        if let Some(gap) = nodes.windows(2).find(|it| it[1] - it[0] > limit) {
            let (from, to) = (gap[0], gap[1]);
            return Err(MemoryError::Gap {
                axis,
                from,
                to,
                limit,
            });
        }
        // An axis that stood still is kept with what it had there.
        if nodes.len() == 1 {
            nodes.push(from + Metres(self.spacing));
            values.iter_mut().for_each(|it| it.push(it[0]));
        }
        let range = (from, to);
        Ok(Some(Means {
            nodes,
            values,
            range,
        }))
    }
}

impl<const N: usize> Means<N> {
    fn function<Q: Quantity>(&self, k: usize) -> Result<Function<Q>, FunctionError> {
        let values: Vec<Q> = self.values[k].iter().copied().map(Q::from_value).collect();
        Function::new(&self.nodes, &values, Shape::Linear)
    }
}

/// Records the second memory; memory is taken when it is made, none while it records.
#[derive(Clone, Debug)]
pub struct StateRecorder {
    settings: RecorderSettings,
    sideways: [Track<2>; 3],
    roll: [Track<1>; 3],
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
        let low = volume.low().array();
        let of = |k: usize| (low[k], spacing.value(), counts[k] as usize);
        Ok(Self {
            settings,
            sideways: [0, 1, 2].map(|k| {
                let (low, spacing, stretches) = of(k);
                Track::new(low, spacing, stretches)
            }),
            roll: [0, 1, 2].map(|k| {
                let (low, spacing, stretches) = of(k);
                Track::new(low, spacing, stretches)
            }),
        })
    }

    /// Takes the displacement of `axis` at `position`: the current one less what of it is
    /// compensated now and less what the first memory keeps. What is outside or no number is
    /// ignored.
    pub fn record(&mut self, axis: Axis, position: Metres, left: Displacement) {
        self.sideways[axis.index()].record(position, left.map(Metres::value));
    }

    /// Likewise its roll.
    pub fn record_roll(&mut self, axis: Axis, position: Metres, left: Radians) {
        self.roll[axis.index()].record(position, [left.value()]);
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        let sideways = self.sideways.iter_mut().flat_map(|it| &mut it.bins);
        sideways.for_each(|it| *it = Bin::EMPTY);
        let roll = self.roll.iter_mut().flat_map(|it| &mut it.bins);
        roll.for_each(|it| *it = Bin::EMPTY);
    }

    /// Makes a memory of what was recorded, with what it covers. An axis that stood still is
    /// kept with what it had there.
    ///
    /// # Errors
    /// When nothing was recorded, or a stretch without states is too long.
    pub fn finish(&self) -> Result<(StateMap, Coverage), MemoryError> {
        let (mut map, mut coverage) = (StateMap::default(), Coverage::default());
        let limit = self.settings.gap_max;
        for axis in Axis::ALL {
            let k = axis.index();
            if let Some(roll) = self.roll[k].means(axis, limit)? {
                map.roll[k] = Some(roll.function(0)?);
                coverage[k] = Some(roll.range);
            }
            if let Some(sideways) = self.sideways[k].means(axis, limit)? {
                map.of[k] = Some([sideways.function(0)?, sideways.function(1)?]);
                coverage[k] = Some(sideways.range);
            }
        }
        if coverage.iter().all(Option::is_none) {
            return Err(MemoryError::Empty);
        }
        Ok((map, coverage))
    }
}
