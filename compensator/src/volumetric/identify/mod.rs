//! Which error functions made the deviations that were measured, and how sure is that?
//!
//! Source: the rigid-body model of [`super::model`] to first order in the errors (what is left
//! out is a few nanometres), linear in the nodes of its functions; ISO 230-6 for displacements
//! along body and face diagonals, ISO 230-1 for straightness and squareness. Weighted least
//! squares, every reading with its own standard uncertainty.
//!
//! | symbol | name here |
//! |---|---|
//! | E_XX, E_YX, E_AX … at nodes, drawn between them as they are when they are used | [`FunctionPlan`], [`Plan::shape`] |
//! | E_C0Y, E_B0Z, E_A0Z | [`SquarenessName`] |
//! | what one setting of the instrument leaves open | [`RunSetup`] |
//! | expansion and bending per kelvin | [`ThermalPlan`] |
//!
//! Conventions, without which the errors are not defined:
//!
//! - positioning errors and tilts are zero at the plan's `zero`;
//! - a straightness has its least-squares line over its nodes taken out. The slopes taken out of
//!   y and z are in the squarenesses and those of x define the machine's directions, together
//!   with that of z's leaning in the remaining plane;
//! - a reading counts from wherever its run began: every run may have an offset of its own, and
//!   a slope, where the instrument was aligned to the axis by hand.
//!
//! What readings cannot tell is found by singular values of the scaled design, and said by the
//! names of the errors concerned ([`Observability`]); it is never guessed.
//!
//! Runs at two or more temperatures determine the thermal coefficients, together with all errors: a
//! guide that bends while the tool is on a lever looks like a scale that grows. Runs at too similar
//! temperatures are refused, and the uncertainties of the coefficients include those of the
//! thermometers.
//!
//! What one error of the instrument does to all readings ([`Observation::common`]) is shared by them: what stretches every
//! length alike makes the size of the volume uncertain, and no squareness. What the detector of one run does to all that
//! it reads ([`Observation::common_of_run`]) is shared by these alone.
//!
//! Readings that scatter more than their stated uncertainties are reported
//! ([`Identified::scattered`]), with those that fit least.
//!
//! Gross errors are looked for by [`Plan::snoop`], and named by reading and run; none is left out. What else
//! than was stated would explain all readings is looked for by [`Plan::causes`].
//!
//! Absent: hysteresis, laser tracker lengths from unknown stations, the instrument's own
//! temperature and air (correct the readings first: [`crate::length_correction`]), temperatures
//! that change within a run.

mod between;
mod block;
mod budget;
mod cause;
mod design;
mod diagonals;
mod effect;
mod heat;
mod observe;
mod scatter;
mod snoop;
mod solve;
mod standard;
mod straightness;
mod thermal;
mod whiten;

use core::fmt;

use units::{Metres, Quantity, Radians};

use between::Extent;
pub use budget::ToolAt;
pub use cause::{Cause, Causes, Circumstance, Doubt, Explanation, Suspect, Trial, suspects};
pub use diagonals::{body_diagonals, direction, face_diagonals, squareness_of_face_diagonals};
pub use observe::Observability;
pub use scatter::{Conspicuous, SCATTER_RATIO_MAX, Scattered, scatter_limit};
pub use snoop::{GROSS_FALSE_ALARMS, Gross, GrossKind, Rival, Snooped};
pub use solve::{Identified, IdentifiedFunction};
pub use standard::{Optics, Purpose, StandardDesign, StandardLine, standard_design};
pub use straightness::{ReferenceLine, Straightness, straightness};
pub use thermal::{BendPlan, ExpansionPlan, IdentifiedBend, IdentifiedExpansion, ThermalPlan};

use super::function::Shape;
use super::model::{Chain, ErrorName};
use super::{Axis, Point};
use crate::budget::BudgetError;
use crate::least_squares::LeastSquaresError;

/// One of the three squarenesses, as in [`Squareness`](super::model::Squareness).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum SquarenessName {
    /// Of y to x, about z.
    YToX,
    /// Of z to x, about y.
    ZToX,
    /// Of z to y, about x.
    ZToY,
}

impl SquarenessName {
    /// All three, in the order of [`Squareness`](super::model::Squareness).
    pub const ALL: [Self; 3] = [Self::YToX, Self::ZToX, Self::ZToY];
}

impl fmt::Display for SquarenessName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::YToX => "squareness of y to x",
            Self::ZToX => "squareness of z to x",
            Self::ZToY => "squareness of z to y",
        })
    }
}

/// One error function to be found.
#[derive(Clone, Debug, PartialEq)]
pub struct FunctionPlan {
    /// Which one.
    pub name: ErrorName,
    /// Where its values are wanted; readings must lie between the first and the last.
    pub nodes: Vec<Metres>,
}

/// What one setting of the instrument leaves open.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RunSetup {
    /// Readings count from an unknown zero.
    pub offset: bool,
    /// Readings contain an unknown angle times the distance from the run's first reading.
    pub alignment: Option<Alignment>,
}

/// An unknown angle between instrument and axis, which runs may share: both edges of a square
/// turn together, and the reading of the second then changes by the factor −1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Alignment {
    /// The number of the angle.
    pub angle: usize,
    /// What it is multiplied with in this run.
    pub factor: f64,
}

/// What is to be found, and in how many settings of the instrument.
///
/// # Example
///
/// The positioning error of x, read with an interferometer at three places.
///
/// ```
/// use compensator::volumetric::function::Shape;
/// use compensator::volumetric::identify::{FunctionPlan, Observation, Plan, Reading, RunSetup};
/// use compensator::volumetric::model::ErrorName;
/// use compensator::volumetric::{Axis, Point};
/// use units::Metres;
///
/// let places = [0.0, 100.0, 200.0];
/// let name = ErrorName::Along(Axis::X, Axis::X);
/// let plan = Plan {
///     chain: "FXYZ".parse()?,
///     functions: vec![FunctionPlan { name, nodes: places.map(Metres::from_mm).to_vec() }],
///     shape: Shape::Linear,
///     squarenesses: vec![],
///     runs: vec![RunSetup { offset: true, alignment: None }],
///     zero: Point::ZERO,
///     thermal: Default::default(),
/// };
/// let read = |(mm, um): (f64, f64)| Observation {
///     at: Point::from_mm(mm, 0.0, 0.0),
///     tool: Point::ZERO,
///     run: 0,
///     reading: Reading::Length {
///         along: [1.0, 0.0, 0.0],
///         deviation: Metres::from_um(um),
///         u: Metres::from_um(0.1),
///     },
///     common: 0.0,
///     common_of_run: 0.0,
/// };
/// let readings = places.into_iter().zip([7.0, 8.0, 10.0]).map(read);
/// let found = plan.identify(&readings.collect::<Vec<_>>())?;
/// let [positioning, ..] = &found.axis_errors(Shape::Linear)?[0].along;
/// let at_end = positioning.as_ref().map(|it| it.at(Metres(0.2)).um());
/// assert!(at_end.is_some_and(|it| (it - 3.0).abs() < 1e-6), "the zero of the run is 7 µm");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Which axis stands on which.
    pub chain: Chain,
    /// The functions to be found; the others are taken as zero.
    pub functions: Vec<FunctionPlan>,
    /// How they run between their nodes, where diagonals are read. Straight lines where a smooth
    /// machine is drawn by splines later leave readings that no errors explain.
    pub shape: Shape,
    /// The squarenesses to be found; the others are taken as zero.
    pub squarenesses: Vec<SquarenessName>,
    /// The settings, by their number.
    pub runs: Vec<RunSetup>,
    /// Where positioning errors and tilts are zero.
    pub zero: Point,
    /// What warmth adds.
    pub thermal: ThermalPlan,
}

/// What was read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reading {
    /// A deviation (actual − target) of the tool along a direction of length 1: displacement
    /// along an axis or a diagonal, or sideways.
    Length {
        /// The direction.
        along: [f64; 3],
        /// What was read.
        deviation: Metres,
        /// Its standard uncertainty.
        u: Metres,
    },
    /// A rotation of the tool, right-handed about a direction.
    Angle {
        /// The direction.
        about: Axis,
        /// What was read.
        deviation: Radians,
        /// Its standard uncertainty.
        u: Radians,
    },
}

/// One reading with where it was made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
    /// The commanded position.
    pub at: Point,
    /// The offset of the point that was measured.
    pub tool: Point,
    /// In which setting of the instrument, from 0.
    pub run: usize,
    /// What was read.
    pub reading: Reading,
    /// What all readings have in common of its standard uncertainty, with the sign that one error of the instrument has
    /// here, in its SI unit: as scale and air stretch every length of a laser. 0 where nothing is.
    pub common: f64,
    /// Likewise what all readings of its run have in common, and no others: as volts per millimetre stretch what a
    /// detector reads along a line. 0 where nothing is.
    pub common_of_run: f64,
}

/// What is unknown: the errors wanted, and what the instrument's settings leave open.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Unknown {
    /// An error function.
    Function(ErrorName),
    /// A squareness.
    Squareness(SquarenessName),
    /// The expansion along an axis, by its first thermometer.
    Expansion(Axis, usize),
    /// The bending of an axis's guide towards a direction.
    Bend(Axis, Axis),
    /// The zero of a run.
    Offset(usize),
    /// An angle of alignment.
    Angle(usize),
}

impl fmt::Display for Unknown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Function(name) => name.fmt(f),
            Self::Squareness(name) => name.fmt(f),
            Self::Expansion(axis, by) => write!(f, "expansion along {axis} by thermometer {by}"),
            Self::Bend(axis, towards) => {
                write!(f, "bending of the guide of {axis} along {towards}")
            }
            Self::Offset(run) => write!(f, "zero of run {run}"),
            Self::Angle(angle) => write!(f, "alignment angle {angle}"),
        }
    }
}

/// Why nothing can be identified.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum IdentifyError {
    /// A function twice, with too few or unordered nodes.
    #[error(
        "identification: {name} is planned twice, or its nodes do not increase, or there are fewer \
         than {least}"
    )]
    Nodes {
        /// Which function.
        name: ErrorName,
        /// How many nodes it needs: a straightness one more than its line.
        least: usize,
    },
    /// A squareness twice.
    #[error("identification: {name} is planned twice")]
    Twice {
        /// Which squareness.
        name: SquarenessName,
    },
    /// The point where functions are zero is not within their nodes.
    #[error("identification: {name} is to be zero at {} mm, which is outside its nodes",
        units::Short(zero.mm()))]
    Zero {
        /// Which function.
        name: ErrorName,
        /// Where it is to be zero.
        zero: Metres,
    },
    /// A reading of a run that is not planned.
    #[error("identification, reading {index}: run {run} is not among the {runs} planned")]
    Run {
        /// Which reading, from 0.
        index: usize,
        /// Its run.
        run: usize,
        /// How many are planned.
        runs: usize,
    },
    /// A reading that is not a number, has no uncertainty, or no direction.
    #[error(
        "identification, reading {index}: a value is not finite, the uncertainty not positive, or \
         the direction's length not 1"
    )]
    NotUsable {
        /// Which reading.
        index: usize,
    },
    /// A reading outside a function's nodes.
    #[error("identification, reading {index}: {axis} = {} mm is not between the nodes of {name}",
        units::Short(seen.mm()))]
    Outside {
        /// Which reading.
        index: usize,
        /// Along which axis.
        axis: Axis,
        /// Its position.
        seen: Metres,
        /// Which function.
        name: ErrorName,
    },
    /// A thermal plan that does not fit.
    #[error("identification, thermal plan: {what}")]
    Thermal {
        /// What is wrong.
        what: &'static str,
    },
    /// Runs made at nearly the same temperature.
    #[error(
        "identification, {unknown}: the runs that determine it differ by {spread:.2} K, but at \
         least {least:.2} K is needed; let the machine warm up and measure again, or plan without \
         it"
    )]
    TooAlike {
        /// What would be found from them.
        unknown: Unknown,
        /// How far apart they are, in kelvin.
        spread: f64,
        /// How far apart they should be.
        least: f64,
    },
    /// Errors that these readings do not determine.
    #[error(
        "identification: these readings do not determine {unseen} (what `/` joins cannot be \
         distinguished from each other); measure with another tool offset or along other lines, or \
         plan without these errors"
    )]
    Unobservable {
        /// Which.
        unseen: Observability,
    },
    /// Least squares failed.
    #[error(transparent)]
    LeastSquares(#[from] LeastSquaresError),
    /// What makes the errors uncertain makes no budget.
    #[error(transparent)]
    Budget(#[from] BudgetError),
}

impl Plan {
    /// What `observations` tell of what is planned; their values do not matter.
    ///
    /// # Errors
    /// When plan and observations do not fit each other.
    pub fn observability(
        &self,
        observations: &[Observation],
    ) -> Result<Observability, IdentifyError> {
        let design = design::Design::new(self, observations)?;
        Ok(observe::observe(&design))
    }

    /// Finds the errors planned.
    ///
    /// # Errors
    /// When plan and observations do not fit each other, or do not tell all that is planned.
    pub fn identify(&self, observations: &[Observation]) -> Result<Identified, IdentifyError> {
        let design = design::Design::new(self, observations)?;
        thermal::check_apart(self, observations)?;
        let unseen = observe::observe(&design);
        if !unseen.is_complete() {
            return Err(IdentifyError::Unobservable { unseen });
        }
        let with = |extent| design.clone().with_between(self, observations, &[], extent);
        let mut found = solve::solve(self, &with(Extent::Likely)?, observations)?;
        if found.scattered(observations).is_some() {
            // A few nodes hardly tell how far a function can be from its curve: that must not explain it.
            let at_most = with(Extent::AtMost(GROSS_FALSE_ALARMS))?;
            found.ratio_at_least = solve::solve(self, &at_most, observations)?.birge_ratio;
        }
        Ok(found)
    }

    /// Looks for gross errors in `observations`, from which all that is planned can be identified.
    ///
    /// # Errors
    /// When plan and observations do not fit each other.
    pub fn snoop(&self, observations: &[Observation]) -> Result<Snooped, IdentifyError> {
        let design = design::Design::new(self, observations)?;
        let first = snoop::snoop(&design, observations, GROSS_FALSE_ALARMS);
        if first.found.is_empty() {
            return Ok(first);
        }
        // Judged as if no function left its curve, which what is wrong would make it seem to do: then
        // with what remains of that without it.
        let wrong: Vec<Vec<f64>> = first
            .found
            .iter()
            .map(|it| design.whitening.of_column(&it.column(observations)))
            .collect();
        let with = |extent| {
            design
                .clone()
                .with_between(self, observations, &wrong, extent)
        };
        // A few nodes hardly tell how far a function can be from its curve: it must be wrong whatever that is.
        let at_most = with(Extent::AtMost(GROSS_FALSE_ALARMS))?;
        let found = snoop::snoop(&at_most, observations, GROSS_FALSE_ALARMS).found;
        let likely = with(Extent::Likely)?;
        Ok(snoop::without(&likely, observations, found))
    }
}

#[cfg(test)]
mod between_tests;
#[cfg(test)]
mod cause_tests;
#[cfg(test)]
mod common_tests;
#[cfg(test)]
mod rig;

#[cfg(test)]
mod scatter_tests;
#[cfg(test)]
mod snoop_tests;
#[cfg(test)]
mod standard_tests;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod thermal_tests;
