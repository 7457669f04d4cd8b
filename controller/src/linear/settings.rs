//! Tables of linear axes: which positions of a table are accepted, and how it is applied.

use compensator::error_table::{Compensation, EndPolicy, ErrorTable, Interpolation, Limits};
use units::{Metres, MetresPerSecond};

use crate::config::{AxisConfig, MachineConfig};
use crate::failure::Failure;
use crate::hardware::CHECKED;
use crate::hardware::instrument::umd2::half_wavelength;
use crate::linear::{CompensationConfig, EndPolicyName, InterpolationName};

/// Half of what a coarse encoder counts is much: so far off its neighbours a position is told, whatever reads it.
const HARMLESS_MAX: Metres = Metres(1e-6);

/// How far a position of `axis` may stand off its neighbours whatever the others do: what the
/// configuration says, and half of what the instrument counts. Less than that is no lost count.
pub fn harmless(config: &MachineConfig, axis: &str) -> Metres {
    let of_axis = config.axis.get(axis);
    let configured = of_axis
        .and_then(|it| it.compensation.as_ref()?.jump_limit_um)
        .map_or(Metres::ZERO, Metres::from_um);
    let instrument =
        of_axis.and_then(|it| config.instrument.get(&it.calibrate.as_ref()?.instrument));
    let count = instrument.map_or_else(half_wavelength, |it| it.count().length);
    configured.max((count / 2.0).min(HARMLESS_MAX))
}

/// Whether the soft limits of `axis` allow for `target`.
///
/// # Errors
/// They do not, or there is no such axis.
pub(crate) fn require_within(
    config: &MachineConfig,
    axis: &str,
    target: Metres,
) -> Result<(), Failure> {
    let own = config.axis.get(axis).ok_or_else(|| no_such(config, axis))?;
    let min = Metres::from_mm(own.motion.soft_min_mm);
    let max = Metres::from_mm(own.motion.soft_max_mm);
    if target >= min && target <= max {
        return Ok(());
    }
    Err(Failure::Machine(machine::Failure::SoftLimit {
        axis: axis.to_owned(),
        target,
        min,
        max,
    }))
}

fn no_such(config: &MachineConfig, axis: &str) -> Failure {
    let known: Vec<&str> = config.axis.keys().map(String::as_str).collect();
    Failure::Machine(machine::Failure::NoSuchAxis {
        axis: axis.to_owned(),
        known: known.join(", "),
    })
}

/// A table made ready to be applied to `axis` within the limits of the configuration.
///
/// # Errors
/// When the axis has no limits, a position stands off its neighbours, or the table breaks a limit
/// of size or slope.
pub fn compensation(
    config: &MachineConfig,
    axis: &str,
    table: ErrorTable,
) -> Result<Compensation, Failure> {
    let own = config
        .axis
        .get(axis)
        .and_then(|it| it.compensation.as_ref());
    let own = own.ok_or_else(|| Failure::NotConfigured {
        axis: axis.to_owned(),
        section: "compensation",
    })?;
    let axis = axis.to_owned();
    if let Err(source) = table.judge_neighbours(harmless(config, &axis)) {
        return Err(Failure::StandsOff { axis, source });
    }
    let limits = Limits {
        size: Metres::from_um(own.size_limit_um),
        slope: own.slope_limit,
        rate: MetresPerSecond(own.rate_limit_um_per_s * 1e-6),
    };
    Compensation::new(table, interpolation(own), limits, ends(own))
        .map_err(|source| Failure::Compensation { axis, source })
}

/// The curve that is drawn between the positions of an axis.
pub(crate) fn interpolation_of(axis: &AxisConfig) -> Interpolation {
    let own = axis.compensation.as_ref();
    own.map_or(Interpolation::Linear, interpolation)
}

fn interpolation(config: &CompensationConfig) -> Interpolation {
    match config.interpolation {
        InterpolationName::PiecewiseConstant => Interpolation::PiecewiseConstant,
        InterpolationName::Linear => Interpolation::Linear,
        InterpolationName::MonotoneCubic => Interpolation::MonotoneCubic,
    }
}

fn ends(config: &CompensationConfig) -> EndPolicy {
    match config.end_policy {
        EndPolicyName::Refuse => EndPolicy::Refuse,
        EndPolicyName::Hold => EndPolicy::Hold,
        EndPolicyName::FadeOut => {
            EndPolicy::FadeOut(Metres::from_mm(config.fade_out_mm.expect(CHECKED)))
        }
    }
}
