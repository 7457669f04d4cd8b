//! What is checked when a model is made.

use units::{Metres, MetresPerSecond};

use super::bound::{AxisBound, Bounds};
use super::errors::{ErrorName, Squareness};
use super::pack::{PackedAxis, SAME_NODE_M};
use super::thermal::{Thermal, ThermalBend, ThermalSums};
use super::{Machine, ModelError};
use crate::error_table::Limits;
use crate::volumetric::function::Pieces;
use crate::volumetric::inverse::LIPSCHITZ_MAX;
use crate::volumetric::{Axis, Volume};

pub(super) fn check_limits(limits: &Limits) -> Result<(), ModelError> {
    let Limits { size, slope, rate } = *limits;
    let sound = size > Metres::ZERO
        && size.is_finite()
        && slope > 0.0
        && slope <= LIPSCHITZ_MAX
        && rate > MetresPerSecond::ZERO
        && rate.is_finite();
    if sound {
        Ok(())
    } else {
        Err(ModelError::Limits { size, slope, rate })
    }
}

pub(super) fn check_numbers(machine: &Machine) -> Result<(), ModelError> {
    let sizes = [
        ("the longest tool", machine.tool_max.value()),
        ("the largest displacement", machine.displacement_max.value()),
        ("the largest roll", machine.roll_max.value()),
    ];
    for (what, seen) in sizes {
        if !(seen >= 0.0 && seen.is_finite()) {
            return Err(ModelError::NotUsable { what });
        }
    }
    let squareness = &machine.squareness;
    let values = squareness.values().into_iter();
    if !values
        .chain(squareness.u.map(|it| it.value()))
        .all(f64::is_finite)
    {
        let what = "a squareness";
        return Err(ModelError::NotUsable { what });
    }
    check_thermal(&machine.thermal)
}

fn check_thermal(thermal: &Thermal) -> Result<(), ModelError> {
    let refuse = |what| Err(ModelError::NotUsable { what });
    if !thermal.fixed.array().into_iter().all(f64::is_finite) {
        return refuse("the fixed point of the scales");
    }
    for channel in &thermal.channels {
        if !(channel.low <= channel.reference && channel.reference <= channel.high) {
            return refuse("a temperature range that does not contain its reference");
        }
        let mut sums = ThermalSums::default();
        sums.add(channel, 1.0, true);
        let coefficients = sums.expansion.into_iter().chain(sums.growth);
        let coefficients = coefficients.chain(sums.squareness).chain(sums.u_expansion);
        let mut coefficients = coefficients.chain([channel.u]);
        let range = (channel.high - channel.low).is_finite();
        if !(range && coefficients.all(f64::is_finite)) {
            return refuse("a thermal coefficient or temperature");
        }
    }
    for (at, bend) in thermal.bends.iter().enumerate() {
        if let Some(what) = bend.trouble(thermal.channels.len()) {
            return refuse(what);
        }
        let mut before = thermal.bends[..at].iter();
        if before.any(|it| (it.axis, it.towards) == (bend.axis, bend.towards)) {
            return refuse("a guide with two bends in the same direction");
        }
    }
    Ok(())
}

/// The functions of each axis over the volume, all of which they must cover.
pub(super) fn pack(machine: &Machine) -> Result<[PackedAxis; 3], ModelError> {
    let mut packed = Vec::with_capacity(3);
    for axis in Axis::ALL {
        let (low, high) = (
            machine.volume.low().along(axis),
            machine.volume.high().along(axis),
        );
        let errors = &machine.axes[axis.index()];
        let mut functions: [Option<&Pieces>; 6] = [None; 6];
        for k in Axis::ALL {
            let along = errors.along[k.index()].as_ref().map(|it| it.pieces());
            let about = errors.about[k.index()].as_ref().map(|it| it.pieces());
            functions[k.index()] = along;
            functions[3 + k.index()] = about;
            for (function, pieces) in [
                (ErrorName::Along(axis, k), along),
                (ErrorName::About(axis, k), about),
            ] {
                let Some((first, last)) = pieces.map(Pieces::range) else {
                    continue;
                };
                if first > low.value() + SAME_NODE_M || last < high.value() - SAME_NODE_M {
                    return Err(ModelError::NotCovered {
                        function,
                        first: Metres(first),
                        last: Metres(last),
                        low,
                        high,
                    });
                }
            }
        }
        packed.push(PackedAxis::new(functions, low.value(), high.value()));
    }
    Ok(packed.try_into().expect("there are three axes"))
}

/// Magnitudes of everything an axis can do within the commands, temperatures and detector
/// values permitted.
pub(super) fn axis_bounds(
    machine: &Machine,
    axes: &[PackedAxis; 3],
    commands: &Volume,
) -> [AxisBound; 3] {
    let mut thermal = ThermalSums::default();
    for channel in &machine.thermal.channels {
        let above = (channel.high - channel.reference).value();
        let below = (channel.reference - channel.low).value();
        thermal.add(channel, above.max(below), true);
    }
    let own = machine.squareness.values();
    let squareness = core::array::from_fn(|k| own[k].abs() + thermal.squareness[k]);
    let lean = Squareness::lean(squareness);
    let fixed = machine.thermal.fixed.array();
    Axis::ALL.map(|axis| {
        let i = axis.index();
        let (low, high) = (commands.low().along(axis), commands.high().along(axis));
        let position = low.abs().max(high.abs()).value();
        let packed = &axes[i];
        let mut bound = AxisBound {
            position,
            on_workpiece: machine.chain.carries_workpiece(axis),
            ..AxisBound::default()
        };
        for (k, lean) in lean[i].iter().enumerate() {
            let mut per_metre = lean.abs();
            let mut constant = machine.displacement_max.value();
            if k == i {
                per_metre += thermal.expansion[i];
                constant = thermal.expansion[i] * fixed[i].abs();
            }
            let roll = if k == i {
                machine.roll_max.value()
            } else {
                0.0
            };
            bound.along[k] = packed.largest[k] + per_metre * position + constant;
            bound.along_slope[k] = packed.steepest[k] + per_metre;
            bound.about[k] = packed.largest[3 + k] + roll;
            bound.about_slope[k] = packed.steepest[3 + k];
        }
        for bend in machine.thermal.bends.iter().filter(|it| it.axis == axis) {
            add_bend(&mut bound, machine, bend, (low.value(), high.value()));
        }
        bound
    })
}

/// What a bending guide adds at most, over positions from `low` to `high`.
fn add_bend(bound: &mut AxisBound, machine: &Machine, bend: &ThermalBend, (low, high): (f64, f64)) {
    let arc = bend.arc(machine.chain);
    let (height, slope) = arc.largest(low, high);
    let bow = bend.bow.abs().value() * bend.gradient_bound(&machine.thermal.channels);
    for k in 0..3 {
        bound.about[k] += arc.turn[k].abs() * slope * bow;
        bound.about_slope[k] += (arc.turn[k] * 2.0 * arc.powers[2]).abs() * bow;
        if !bend.is_watched {
            bound.along[k] += arc.towards[k] * height * bow;
            bound.along_slope[k] += arc.towards[k] * slope * bow;
        }
    }
}

/// No function may move the tool by more than the limit by itself: then it is in a wrong unit.
pub(super) fn check_functions(
    axes: &[PackedAxis; 3],
    bounds: &Bounds,
    limit: Metres,
) -> Result<(), ModelError> {
    for axis in Axis::ALL {
        let lever = bounds.levers[axis.index()];
        let effects = axes[axis.index()].largest_effects(lever).map(Metres);
        for k in Axis::ALL {
            for (function, seen) in [
                (ErrorName::Along(axis, k), effects[k.index()]),
                (ErrorName::About(axis, k), effects[3 + k.index()]),
            ] {
                if seen.value().is_nan() || seen > limit {
                    return Err(ModelError::TooLarge {
                        function,
                        seen,
                        limit,
                    });
                }
            }
        }
    }
    Ok(())
}
