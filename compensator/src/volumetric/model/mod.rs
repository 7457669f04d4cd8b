//! Rigid-body model of three linear axes: 18 error functions, 3 squarenesses, tool offset,
//! temperatures, and what detectors see now.
//!
//! Source: the rigid-body model of G. Zhang, R. Veale, T. Charlton, B. Borchardt, R. Hocken,
//! "Error compensation of coordinate measuring machines", CIRP Annals 34 (1985), for any chain
//! (H. Schwenke et al., CIRP Annals 57 (2008)); names of the errors by ISO 230-1. CN1214003A's
//! displacements and roll enter as straightness and roll that come on top of the tables.
//!
//! From the tool to the workpiece, with p the place of the tool seen from the axis reached,
//!
//! - a slide that carries the tool makes of it   R(ε)·p + q·e + δ,
//! - a slide that carries the workpiece          R(ε)·(p + q·e + δ),
//!
//! with q its position along its unit vector e, δ its displacements (tables, squareness,
//! expansion, detectors) and R(ε) the rotation by its tilts, the rotation vector to second order:
//! what is left out is |ε|³/6 of the lever, 0.2 pm/m for 20 arcsec, and |ε|²/2 of the errors of the
//! axes nearer to the tool, 0.1 pm for 20 arcsec and 20 µm. All other products of different axes'
//! errors are in. The tilt of a slide acts about the point of its frame that meets the
//! machine's zero: on the tool offset and the axes nearer to the tool
//! ([`Chain::is_on_lever`]).
//!
//! | symbol | name here |
//! |---|---|
//! | E_XX, E_YX, E_AX … | [`AxisErrors`], [`ErrorName`] |
//! | E_C0Y, E_B0Z, E_A0Z | [`Squareness`] |
//! | α, growth | [`ThermalChannel`] |
//! | bow per kelvin of gradient | [`ThermalBend`] |
//! | D, α of the detectors | [`MovingState`] |
//!
//! Detectors add to the tables: their references must have been taken when the tables were, or
//! the tables they replace be left out.
//!
//! The command for a target is found by iteration; that it contracts, everywhere and for all
//! permitted tools, temperatures and detector values, is proven when the model is made.
//!
//! Absent: rotary axes, both approaches apart, elastic deformation.

mod bound;
mod chain;
mod check;
mod coefficients;
mod covariance;
mod errors;
mod extreme;
mod pack;
mod refusal;
mod thermal;
mod uncertainty;

use units::{Celsius, Metres, MetresPerSecond, Quantity, Radians};

pub use chain::{Chain, ChainError};
pub use coefficients::{Coefficient, CoefficientCovariance};
pub use covariance::{CovarianceError, ENTRIES as COVARIANCE_ENTRIES, ErrorCovariance};
pub use errors::{AxisErrors, ErrorName, Squareness};
pub use extreme::Extreme;
pub use refusal::{ConditionsError, ModelError};
pub(in crate::volumetric) use thermal::Arc;
pub use thermal::{Thermal, ThermalBend, ThermalChannel};
pub use uncertainty::Seen;

use super::inverse::deviation_at_target;
use super::online::MovingState;
use super::point::{V3, V4, check_size};
use super::{Axis, NoCorrection, Point, Volume};
use crate::error_table::Limits;
use bound::Bounds;
use check::{axis_bounds, check_functions, check_limits, check_numbers, pack};
use pack::PackedAxis;
use thermal::ThermalSums;

/// Everything that is known of a machine.
#[derive(Clone, Debug)]
pub struct Machine {
    /// Which axis stands on which.
    pub chain: Chain,
    /// The commands the functions were measured for.
    pub volume: Volume,
    /// The error functions of x, y, z.
    pub axes: [AxisErrors; 3],
    /// The squarenesses.
    pub squareness: Squareness,
    /// What temperatures do.
    pub thermal: Thermal,
    /// The longest component of a tool offset.
    pub tool_max: Metres,
    /// The largest displacement a detector may report.
    pub displacement_max: Metres,
    /// The largest roll detectors may report.
    pub roll_max: Radians,
}

/// Tool, temperatures and detectors of one moment, found to be what the model was proven for.
#[derive(Clone, Copy, Debug)]
pub struct Conditions {
    tool: V4,
    /// By axis, on top of the tables: displacements that are constant, per metre of its position
    /// and per its square.
    shift: [V4; 3],
    lean: [V4; 3],
    bend: [V4; 3],
    /// By axis, on top of the tables: tilts that are constant and per metre of its position.
    turn: [V4; 3],
    twist: [V4; 3],
    growth: V4,
    /// By axis and direction: the temperature difference that bends its guide.
    gradients: [V3; 3],
    /// By axis: what its expansion is off by when it is too large by its standard uncertainty; below zero where it is cold.
    u_expansion: V3,
}

/// One axis in its place of the chain.
#[derive(Clone, Debug)]
struct Stage {
    axis: usize,
    unit: V4,
    on_workpiece: bool,
    errors: PackedAxis,
}

/// A machine's errors made ready to be applied: no allocation and a constant time per call.
///
/// # Example
///
/// x turns the rest by 10 µrad about z: y and tool, 0.3 m and 0.2 m to the side, make −5 µm along x of it.
///
/// ```
/// use compensator::error_table::Limits;
/// use compensator::volumetric::function::Function;
/// use compensator::volumetric::model::{Machine, Squareness, Thermal, VolumetricModel};
/// use compensator::volumetric::{Point, Volume, online::MovingState};
/// use units::{Metres, MetresPerSecond, Radians};
///
/// let mut machine = Machine {
///     chain: "FXYZ".parse()?,
///     volume: Volume::new(Point::ZERO, Point::from_mm(600.0, 500.0, 400.0))?,
///     axes: Default::default(),
///     squareness: Squareness::default(),
///     thermal: Thermal::default(),
///     tool_max: Metres(0.3),
///     displacement_max: Metres::ZERO,
///     roll_max: Radians::ZERO,
/// };
/// let tilt = Function::constant(Metres(-1.0), Metres(1.0), Radians(10e-6))?;
/// machine.axes[0].about[2] = Some(tilt);
/// let (size, rate) = (Metres::from_um(500.0), MetresPerSecond(0.1));
/// let model = VolumetricModel::new(machine, Limits { size, slope: 0.1, rate })?;
/// let tool = Point::from_mm(0.0, 200.0, 0.0);
/// let now = model.conditions(tool, &[], &MovingState::default())?;
/// let target = Point::from_mm(400.0, 300.0, 100.0);
/// assert!((model.deviation(target, &now)?.x.um() + 5.0).abs() < 1e-3);
/// assert!(((model.command(target, &now)? - target).x.um() - 5.0).abs() < 1e-3);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct VolumetricModel {
    machine: Machine,
    limits: Limits,
    /// From the tool to the workpiece.
    stages: Vec<Stage>,
    /// Commands that targets within the volume can have.
    commands: Volume,
    bounds: Bounds,
    /// How sure functions and squarenesses are together; without it each is taken to be independent of the others.
    covariance: Option<ErrorCovariance>,
}

impl VolumetricModel {
    /// Proves that `machine` can be compensated within `limits` and prepares it. The slope limit
    /// is for the bound of |Δ deviation| per |Δ command|, 0.5 at most.
    ///
    /// # Errors
    /// When a limit is none, a function does not cover the volume, is too large or too steep, or
    /// the inverse cannot be proven unique.
    pub fn new(machine: Machine, limits: Limits) -> Result<Self, ModelError> {
        check_limits(&limits)?;
        check_numbers(&machine)?;
        let axes = pack(&machine)?;
        let mut order = machine.chain.axes();
        order.reverse();
        let reach = limits.size;
        let grown = Point::new(reach, reach, reach);
        let (low, high) = (machine.volume.low() - grown, machine.volume.high() + grown);
        let commands = Volume::new(low, high).expect("a volume that grows stays one");
        let each = axis_bounds(&machine, &axes, &commands);
        let bounds = bound::bounds(&each, order, [machine.tool_max.value(); 3]);
        check_functions(&axes, &bounds, limits.size)?;
        let (seen, function, limit) = (bounds.lipschitz, bounds.steepest, limits.slope);
        if seen.is_nan() || seen >= 1.0 {
            return Err(ModelError::NotContracting { seen, function });
        }
        if seen > limit {
            return Err(ModelError::TooSteep {
                seen,
                limit,
                function,
            });
        }
        let stage = |it: Axis| Stage {
            axis: it.index(),
            unit: core::array::from_fn(|k| f64::from(u8::from(k == it.index()))),
            on_workpiece: machine.chain.carries_workpiece(it),
            errors: axes[it.index()].clone(),
        };
        let stages = order.into_iter().map(stage).collect();
        Ok(Self {
            machine,
            limits,
            stages,
            commands,
            bounds,
            covariance: None,
        })
    }

    /// The same, with how sure its functions and squarenesses are together.
    #[must_use]
    pub fn with_covariance(self, covariance: Option<ErrorCovariance>) -> Self {
        Self { covariance, ..self }
    }

    /// Checks what holds at this moment: tool offset, temperatures in the order of the channels,
    /// and what the detectors see beyond the tables. Allocates nothing.
    ///
    /// # Errors
    /// When one of them is not what the model was proven for.
    pub fn conditions(
        &self,
        tool: Point,
        temperatures: &[Celsius],
        live: &MovingState,
    ) -> Result<Conditions, ConditionsError> {
        self.check_tool(tool)?;
        self.check_live(live)?;
        let sums = self.thermal_sums(temperatures)?;
        let own = self.machine.squareness.values();
        let squareness = core::array::from_fn(|k| own[k] + sums.squareness[k]);
        let fixed = self.machine.thermal.fixed.array();
        // Detectors say what slides do, the rest is of the tool as seen from the workpiece.
        let sense = |axis| self.machine.chain.sense(axis);
        let mut now = Conditions {
            tool: wide(tool.array()),
            shift: Axis::ALL.map(|axis| wide(live.sideways_of(axis).map(|it| it * sense(axis)))),
            lean: Squareness::lean(squareness).map(wide),
            bend: [[0.0; 4]; 3],
            turn: [[0.0; 4]; 3],
            twist: [[0.0; 4]; 3],
            growth: wide(sums.growth),
            gradients: [[0.0; 3]; 3],
            u_expansion: sums.u_expansion,
        };
        for (k, fixed) in fixed.into_iter().enumerate() {
            now.lean[k][k] += sums.expansion[k];
            now.shift[k][k] -= sums.expansion[k] * fixed;
            now.turn[k][k] = live.roll[k].value() * sense(Axis::ALL[k]);
        }
        self.bend(&mut now, temperatures)?;
        Ok(now)
    }

    /// The deviation (actual − command) of the tool at a command.
    ///
    /// # Errors
    /// When the command is outside the volume by more than the limit of size, or the deviation
    /// exceeds that limit.
    #[inline]
    pub fn deviation(&self, command: Point, now: &Conditions) -> Result<Point, NoCorrection> {
        self.commands.check(command)?;
        let deviation = self.evaluate(command.array(), now, &mut None);
        check_size(deviation, self.limits.size.value())?;
        Ok(Point::of(deviation))
    }

    /// The command that brings the tool to `target`: command + deviation(command) = target, to
    /// ten picometres.
    ///
    /// # Errors
    /// When the target is outside the volume or the deviation exceeds its limit.
    #[inline]
    pub fn command(&self, target: Point, now: &Conditions) -> Result<Point, NoCorrection> {
        self.machine.volume.check(target)?;
        let target = target.array();
        let lipschitz = self.bounds.lipschitz;
        let mut pieces = None;
        let deviation =
            deviation_at_target(target, lipschitz, |at| self.evaluate(at, now, &mut pieces));
        check_size(deviation, self.limits.size.value())?;
        Ok(Point::of(core::array::from_fn(|k| {
            target[k] - deviation[k]
        })))
    }

    /// The machine this was made from.
    pub fn machine(&self) -> &Machine {
        &self.machine
    }

    /// The limits it was checked against.
    pub fn limits(&self) -> Limits {
        self.limits
    }

    /// The proven bound of |Δ deviation| per |Δ command|, both by their largest component.
    pub fn lipschitz(&self) -> f64 {
        self.bounds.lipschitz
    }

    /// The speed above which the correction might have to change faster than the rate limit.
    pub fn speed_max(&self) -> MetresPerSecond {
        MetresPerSecond(self.limits.rate.value() / self.bounds.lipschitz)
    }

    /// `near`: the pieces of the functions to look at first, by axis; those used afterwards.
    #[inline(always)]
    fn evaluate(&self, command: V3, now: &Conditions, near: &mut Option<[usize; 3]>) -> V3 {
        let mut lever = now.tool;
        let mut off = [0.0; 4];
        let mut used = [0; 3];
        for stage in &self.stages {
            let i = stage.axis;
            let position = command[i];
            let (inside, at) = match near {
                Some(pieces) => stage.errors.find_near(position, pieces[i]),
                None => stage.errors.find(position),
            };
            used[i] = at;
            let (along, about) = stage.errors.at(inside, at);
            let (shift, lean, bend) = (&now.shift[i], &now.lean[i], &now.bend[i]);
            let (turn, twist) = (&now.turn[i], &now.twist[i]);
            let moved = core::array::from_fn(|k| {
                along[k] + (shift[k] + position * (lean[k] + position * bend[k]))
            });
            let tilt = core::array::from_fn(|k| about[k] + (turn[k] + position * twist[k]));
            // A product instead of one lane: what is stored by lane cannot be read at once.
            let further = core::array::from_fn(|k| lever[k] + stage.unit[k] * position);
            if stage.on_workpiece {
                lever = further;
                off = sum(off, moved);
                off = sum(off, cross(tilt, sum(halfway(tilt, lever), off)));
            } else {
                off = sum(off, cross(tilt, sum(halfway(tilt, lever), off)));
                off = sum(off, moved);
                lever = further;
            }
        }
        *near = Some(used);
        let [x, y, z, _] = sum(off, now.growth);
        [x, y, z]
    }

    /// What a tilt of `axis` acts on, without the errors.
    fn lever(&self, axis: Axis, command: Point, now: &Conditions) -> V3 {
        let [x, y, z, _] = now.tool;
        let tool = Point::of([x, y, z]);
        self.machine.chain.lever(axis, command, tool).array()
    }

    /// Adds what the guides' arcs do: their tilts, and where no detector sees it the rest.
    fn bend(&self, now: &mut Conditions, temperatures: &[Celsius]) -> Result<(), ConditionsError> {
        let Thermal {
            channels, bends, ..
        } = &self.machine.thermal;
        for it in bends {
            let kelvin = |at: usize| (temperatures[at] - channels[at].reference).value();
            let (seen, limit) = (it.gradient(kelvin), it.gradient_max);
            let (axis, i) = (it.axis, it.axis.index());
            if seen.abs() > limit {
                return Err(ConditionsError::Gradient { axis, seen, limit });
            }
            let arc = it.arc(self.machine.chain);
            let bow = it.bow.value() * seen;
            let [constant, linear, quadratic] = arc.powers.map(|power| power * bow);
            for k in 0..3 {
                now.turn[i][k] += arc.turn[k] * linear;
                now.twist[i][k] += arc.turn[k] * 2.0 * quadratic;
                if !it.is_watched {
                    now.shift[i][k] += arc.towards[k] * constant;
                    now.lean[i][k] += arc.towards[k] * linear;
                    now.bend[i][k] += arc.towards[k] * quadratic;
                }
            }
            now.gradients[i][it.towards.index()] = seen;
        }
        Ok(())
    }

    fn check_tool(&self, tool: Point) -> Result<(), ConditionsError> {
        let limit = self.machine.tool_max;
        for axis in Axis::ALL {
            let seen = tool.along(axis);
            if beyond(seen, limit) {
                return Err(ConditionsError::Tool { axis, seen, limit });
            }
        }
        Ok(())
    }

    fn check_live(&self, live: &MovingState) -> Result<(), ConditionsError> {
        let (limit, roll_max) = (self.machine.displacement_max, self.machine.roll_max);
        for axis in Axis::ALL {
            for seen in live.sideways[axis.index()] {
                if beyond(seen, limit) {
                    return Err(ConditionsError::Displacement { axis, seen, limit });
                }
            }
            let (seen, limit) = (live.roll[axis.index()], roll_max);
            if beyond(seen, limit) {
                return Err(ConditionsError::Roll { axis, seen, limit });
            }
        }
        Ok(())
    }

    fn thermal_sums(&self, temperatures: &[Celsius]) -> Result<ThermalSums, ConditionsError> {
        let channels = &self.machine.thermal.channels;
        let (seen, expected) = (temperatures.len(), channels.len());
        if seen != expected {
            return Err(ConditionsError::Temperatures { seen, expected });
        }
        let mut sums = ThermalSums::default();
        for (channel, (it, seen)) in channels.iter().zip(temperatures).enumerate() {
            let (seen, low, high) = (*seen, it.low, it.high);
            if !(seen >= low && seen <= high) {
                return Err(ConditionsError::Temperature {
                    channel,
                    seen,
                    low,
                    high,
                });
            }
            sums.add(it, (seen - it.reference).value(), false);
        }
        Ok(sums)
    }
}

#[inline(always)]
fn cross(a: V4, b: V4) -> V4 {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
        0.0,
    ]
}

/// Where the lever is when half of the tilt is made: the tilt's cross product with it is the
/// rotation vector to second order. It waits for no other axis's errors, whose second order with
/// the own one is left to them.
#[inline(always)]
fn halfway(tilt: V4, lever: V4) -> V4 {
    let whole = cross(tilt, lever);
    core::array::from_fn(|k| lever[k] + 0.5 * whole[k])
}

#[inline(always)]
fn sum(a: V4, b: V4) -> V4 {
    core::array::from_fn(|k| a[k] + b[k])
}

fn wide([x, y, z]: V3) -> V4 {
    [x, y, z, 0.0]
}

/// Whether a magnitude is larger than its limit, or no number.
fn beyond<Q: Quantity>(seen: Q, limit: Q) -> bool {
    seen.value().is_nan() || seen.abs() > limit
}

#[cfg(test)]
mod tests;
