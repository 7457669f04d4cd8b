//! Whether the limits of `[volumetric.compensation]` let a correction pass, and which would.
//!
//! All of it is judged when the correction is made: by `calibrate` and `fit volumetric --save` before
//! anything is stored, by whatever moves before anything moves. A deviation beyond `size_limit_um`
//! would else stop the machine wherever a path meets it first.

use core::fmt;

use compensator::error_table::Limits;
use compensator::volumetric::model::{
    ConditionsError, Extreme, Machine as Model, ModelError, VolumetricModel,
};
use compensator::volumetric::online::MovingState;
use units::{Celsius, Metres, MetresPerSecond};

use crate::config::MachineConfig;
use crate::failure::advice::{enough, rounded_up};
use crate::volumetric::VolumetricConfig;
use crate::volumetric::settings::{model_limits, point_of_mm};

/// The largest that `size_limit_um` and `slope_limit` take.
const LARGEST: Limits = Limits {
    size: Metres(0.01),
    slope: 0.5,
    rate: MetresPerSecond(1.0),
};

/// What is beyond a limit.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Beyond {
    /// Size of one function, or slope.
    Model(ModelError),
    /// The deviation of the tool in use, all functions together.
    Size { found: Extreme, limit: Metres },
    /// How fast the correction has to change.
    Rate {
        seen: MetresPerSecond,
        axes: MetresPerSecond,
    },
}

/// A correction that is beyond the limits of the configuration, with the limits that would do.
#[derive(Clone, Debug, PartialEq)]
pub struct BeyondLimits {
    beyond: Beyond,
    /// Keys and numbers; empty where none would do.
    enough: Vec<(&'static str, String)>,
}

/// Why there is no model within the limits.
#[derive(Debug)]
pub(super) enum NotWithin {
    /// They do not let it pass.
    Limits(BeyondLimits),
    /// There is none within any.
    Model(ModelError),
    /// The tool in use is longer than permitted, or thermometers are missing.
    Conditions(ConditionsError),
}

impl From<ConditionsError> for NotWithin {
    fn from(source: ConditionsError) -> Self {
        Self::Conditions(source)
    }
}

/// The model of `machine` within the limits of the configuration, at the axes' full speed and with
/// the tool in use.
///
/// # Errors
/// With the limits that would do, where these do not.
pub(super) fn within(
    machine: Model,
    config: &MachineConfig,
    own: &VolumetricConfig,
    temperatures: &[Celsius],
) -> Result<VolumetricModel, NotWithin> {
    let limits = model_limits(&own.compensation);
    let found = match VolumetricModel::new(machine.clone(), limits) {
        Ok(model) => match beyond(&model, config, own, temperatures)? {
            None => return Ok(model),
            Some(beyond) => beyond,
        },
        Err(
            source @ (ModelError::TooLarge { .. }
            | ModelError::TooSteep { .. }
            | ModelError::NotContracting { .. }),
        ) => Beyond::Model(source),
        Err(source) => return Err(NotWithin::Model(source)),
    };
    Err(NotWithin::Limits(BeyondLimits {
        beyond: found,
        enough: needed(machine, config, own, temperatures),
    }))
}

fn beyond(
    model: &VolumetricModel,
    config: &MachineConfig,
    own: &VolumetricConfig,
    temperatures: &[Celsius],
) -> Result<Option<Beyond>, ConditionsError> {
    let (axes, seen) = (speed_of(config, own), model.speed_max());
    if seen < axes {
        return Ok(Some(Beyond::Rate { seen, axes }));
    }
    let limit = model.limits().size;
    let found = largest(model, own, temperatures)?;
    let is_within = found.deviation.abs() <= limit;
    Ok((!is_within).then_some(Beyond::Size { found, limit }))
}

/// As warm as when the errors were measured, and with nothing seen by detectors.
fn largest(
    model: &VolumetricModel,
    own: &VolumetricConfig,
    temperatures: &[Celsius],
) -> Result<Extreme, ConditionsError> {
    let tool = point_of_mm(own.tool_offset_mm);
    let now = model.conditions(tool, temperatures, &MovingState::default())?;
    Ok(model.largest_deviation(&now))
}

fn speed_of(config: &MachineConfig, own: &VolumetricConfig) -> MetresPerSecond {
    let each = own.axes.iter();
    let each = each.map(|it| config.axis[it].motion.speed_max_mm_per_s);
    MetresPerSecond(each.fold(0.0, f64::max) * 1e-3)
}

/// The keys that have to be raised, and to what; with room for what the beams may see.
fn needed(
    machine: Model,
    config: &MachineConfig,
    own: &VolumetricConfig,
    temperatures: &[Celsius],
) -> Vec<(&'static str, String)> {
    let compensation = &own.compensation;
    let Ok(model) = VolumetricModel::new(machine, LARGEST) else {
        return Vec::new();
    };
    let Ok(found) = largest(&model, own, temperatures) else {
        return Vec::new();
    };
    let watched = own.beam.each().into_iter().flatten().count().min(2);
    let room = Metres::from_um(compensation.displacement_max_um) * watched as f64;
    let size = (found.deviation.abs() + room).max(model.largest_alone());
    let slope = model.lipschitz();
    let rate_um = slope * speed_of(config, own).value() * 1e6;
    let mut keys = Vec::new();
    if size.um() > compensation.size_limit_um {
        keys.push(("size_limit_um", enough(size)));
    }
    if slope > compensation.slope_limit {
        keys.push(("slope_limit", rounded_up(slope)));
    }
    if rate_um > compensation.rate_limit_um_per_s {
        keys.push(("rate_limit_um_per_s", rounded_up(rate_um)));
    }
    keys
}

impl fmt::Display for BeyondLimits {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.beyond {
            Beyond::Model(source) => source.fmt(f),
            Beyond::Size { found, limit } => {
                let [x, y, z] = [found.at.x, found.at.y, found.at.z].map(Metres::mm);
                write!(
                    f,
                    "the deviation along {} is {:+.1} um at ({x:.3}, {y:.3}, {z:.3}) mm with the tool in \
                     use, the limit is {:.1} um (size_limit_um): a path there would be stopped",
                    found.along,
                    found.deviation.um(),
                    limit.um()
                )
            }
            Beyond::Rate { seen, axes } => write!(
                f,
                "the correction may have to change faster than rate_limit_um_per_s above {:.1} mm/s, but \
                 the axes together reach {:.1} mm/s (speed_max_mm_per_s)",
                seen.value() * 1e3,
                axes.value() * 1e3
            ),
        }?;
        if self.enough.is_empty() {
            return f.write_str(
                "; no limit that can be set would accept it: look for a reading in a wrong unit, the \
                 factor of other optics, or lines of another machine, and measure again",
            );
        }
        f.write_str("; ")?;
        for (at, (key, number)) in self.enough.iter().enumerate() {
            let and = if at == 0 { "" } else { " and " };
            write!(f, "{and}`{key} = {number}`")?;
        }
        f.write_str(
            " in [volumetric.compensation] would accept it (and as much in [axis.NAME.cyclic], with soft \
             limits as much wider), which is wise only where errors of this size are expected of this \
             machine: a wrong unit, the factor of other optics and a prism mounted the other way round \
             look the same",
        )
    }
}
