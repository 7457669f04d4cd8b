//! Whether references that were given can be those of a machine: its detectors, its travel, what they can show.

use compensator::volumetric::function::{Function, FunctionError, Shape};
use compensator::volumetric::{Axis, GivenReference, ReferenceOf};
use units::{Metres, Radians, Short};

use crate::config::MachineConfig;
use crate::volumetric::settings::eye;
use crate::volumetric::{DetectorConfig, VolumetricConfig};

/// At how many places between two positions a reference is compared with what its detector can show.
const BETWEEN: usize = 8;

/// Why a reference cannot be, and what to do.
pub(super) struct Unfit {
    pub(super) cause: String,
    pub(super) help: String,
}

/// Every reading that needs a reference.
fn watched(config: &VolumetricConfig) -> Vec<(Axis, ReferenceOf)> {
    let mut watched = Vec::new();
    for (axis, roll) in Axis::ALL.into_iter().zip(config.rolls()) {
        watched.extend(roll.map(|_| (axis, ReferenceOf::Roll)));
    }
    for (axis, beam) in Axis::ALL.into_iter().zip(config.beam.each()) {
        let Some(beam) = beam else {
            continue;
        };
        let across = axis.others();
        watched.extend(across.map(|along| (axis, ReferenceOf::Slide(along))));
        if beam.at_the_end().is_some() {
            watched.extend(across.map(|along| (axis, ReferenceOf::End(along))));
        }
    }
    watched
}

/// What this machine reads, and nothing is given for.
pub(super) fn without(config: &VolumetricConfig, given: &[GivenReference]) -> Option<Unfit> {
    let is_given = |(axis, of): &(Axis, ReferenceOf)| {
        let mut given = given.iter();
        given.any(|it| (it.axis, it.of) == (*axis, *of))
    };
    let missing = watched(config).into_iter().filter(|it| !is_given(it));
    let missing: Vec<String> = missing.map(|(axis, of)| format!("{axis}, {of}")).collect();
    (!missing.is_empty()).then(|| Unfit {
        cause: format!("nothing is given for {}", missing.join("; ")),
        help: "give the reference of every reading of every detector that [volumetric] has".into(),
    })
}

/// Why `it` cannot be a reference of this machine.
pub(super) fn unfit(
    machine: &MachineConfig,
    config: &VolumetricConfig,
    it: &GivenReference,
) -> Option<Unfit> {
    let (axis, of) = (it.axis, it.of);
    if !watched(config).contains(&(axis, of)) {
        return Some(Unfit {
            cause: format!("{axis}, {of}: this machine has no such detector"),
            help: "leave it out, or describe the detector in [volumetric]".into(),
        });
    }
    beside_the_travel(machine, config, it).or_else(|| beyond_what_is_shown(config, it))
}

/// Positions that do not cover the work volume, or that the axis cannot have.
fn beside_the_travel(
    machine: &MachineConfig,
    config: &VolumetricConfig,
    it: &GivenReference,
) -> Option<Unfit> {
    let (first, last) = (it.positions.first()?, it.positions.last()?);
    let (axis, of, k) = (it.axis, it.of, it.axis.index());
    let (low_mm, high_mm) = (config.low_mm[k], config.high_mm[k]);
    let help = "are positions millimetres from the machine's zero?".to_owned();
    let (from, to) = (Short(first.mm()), Short(last.mm()));
    if *first > Metres::from_mm(low_mm) || *last < Metres::from_mm(high_mm) {
        let cause = format!(
            "{axis}, {of}: given from {from} to {to} mm, and the work volume is {} to {} mm",
            Short(low_mm),
            Short(high_mm)
        );
        return Some(Unfit { cause, help });
    }
    let motion = &machine.axis.get(&config.axes[k])?.motion;
    let (low_mm, high_mm) = (motion.soft_min_mm, motion.soft_max_mm);
    let is_within = *first >= Metres::from_mm(low_mm) && *last <= Metres::from_mm(high_mm);
    (!is_within).then(|| Unfit {
        cause: format!(
            "{axis}, {of}: given from {from} to {to} mm, and the soft limits of the axis are {} to {} mm",
            Short(low_mm),
            Short(high_mm)
        ),
        help,
    })
}

/// The detector that a reading is of; `None` for a roll.
fn detector(
    config: &VolumetricConfig,
    axis: Axis,
    of: ReferenceOf,
) -> Option<(DetectorConfig<'_>, Axis)> {
    let beam = config.beam.each()[axis.index()]?;
    match of {
        ReferenceOf::Slide(along) => Some((beam.on_the_slide()?, along)),
        ReferenceOf::End(along) => Some((beam.at_the_end()?, along)),
        ReferenceOf::Roll => None,
    }
}

/// The values that a reading can have, in SI units; `None` for a detector that cannot be.
fn shown(config: &VolumetricConfig, axis: Axis, of: ReferenceOf) -> Option<(f64, f64)> {
    if of == ReferenceOf::Roll {
        let largest = Radians::from_arcsec(config.rolls()[axis.index()]?.roll_max_arcsec).value();
        return Some((-largest, largest));
    }
    let (detector, along) = detector(config, axis, of)?;
    let place = axis.others().iter().position(|it| *it == along)?;
    let (low, high) = eye(detector).ok()?.field()[place];
    Some((low.value(), high.value()))
}

/// A value that the detector could never read, at a position or between two.
fn beyond_what_is_shown(config: &VolumetricConfig, it: &GivenReference) -> Option<Unfit> {
    let (axis, of) = (it.axis, it.of);
    let (low, high) = shown(config, axis, of)?;
    let is_shown = |value: f64| value >= low && value <= high;
    let places = match samples(it) {
        Ok(places) => places,
        Err(error) => {
            return Some(Unfit {
                cause: format!("{axis}, {of}: {error}"),
                help: String::new(),
            });
        }
    };
    let (at, value) = places.into_iter().find(|(_, value)| !is_shown(*value))?;
    let unit = |value: f64| match of {
        ReferenceOf::Roll => format!("{} arcsec", Short(Radians(value).arcsec())),
        ReferenceOf::Slide(_) | ReferenceOf::End(_) => format!("{} um", Short(Metres(value).um())),
    };
    let at = at.map_or_else(String::new, |at| {
        format!(" at {axis} = {} mm", Short(at.mm()))
    });
    Some(Unfit {
        cause: format!(
            "{axis}, {of}: {}{at} is outside what the detector can show, {} to {}",
            unit(value),
            unit(low),
            unit(high)
        ),
        help: "are values in the unit that is said? A beam is adjusted near the middle of its detector".into(),
    })
}

/// The values of a reference, those between its positions too.
fn samples(it: &GivenReference) -> Result<Vec<(Option<Metres>, f64)>, FunctionError> {
    if it.positions.is_empty() {
        return Ok(it.values.iter().map(|value| (None, *value)).collect());
    }
    let values: Vec<Metres> = it.values.iter().copied().map(Metres).collect();
    let function = Function::new(&it.positions, &values, Shape::Spline)?;
    let ends = it.positions.windows(2);
    let between = ends.flat_map(|ends| {
        let step = (ends[1] - ends[0]) * (1.0 / BETWEEN as f64);
        let (start, steps) = (ends[0], 0..=BETWEEN);
        steps.map(move |n| start + step * n as f64)
    });
    Ok(between
        .map(|at| (Some(at), function.at(at).value()))
        .collect())
}
