//! How the errors of three axes are found: which functions at which nodes, by which lines.

use compensator::volumetric::identify::{Optics, Purpose, StandardLine, standard_design};
use compensator::volumetric::model::ErrorName;
use compensator::volumetric::{Axis, Point};
use units::Metres;

use crate::store::IdentityRecord;
use crate::volumetric::VolumetricFailure;
use crate::volumetric::calibrate::known::expansion_plans;
use crate::volumetric::line::{LineOptics, LineTask};
use crate::volumetric::settings::{
    bend_plans, function_shape, point_of_mm, volumetric_chain, work_volume,
};
use crate::volumetric::{
    AXES, BendEntry, ExpansionEntry, LineEntry, OpticsName, VolumePlanEntry, metres,
};
use crate::volumetric::{TemperatureConfig, VolumetricCalibrateConfig, VolumetricConfig};

/// How the errors of the machine of `config` are found, and by which lines; `is_warm`: with lines
/// that are read again when it is warmer, which determine the thermal errors.
///
/// # Errors
/// When it is not configured, or the chain or the volume is invalid.
pub(crate) fn volume_plan(
    config: &VolumetricConfig,
    is_warm: bool,
    drives: Vec<IdentityRecord>,
) -> Result<(VolumePlanEntry, Vec<StandardLine>), VolumetricFailure> {
    let section = "calibrate";
    let own = config.calibrate.as_ref();
    let own = own.ok_or(VolumetricFailure::NotConfigured { section })?;
    let chain = volumetric_chain(config)?;
    let volume = work_volume(config)?;
    let tool = point_of_mm(config.tool_offset_mm);
    let mut tools = vec![tool];
    tools.extend(own.second_tool_offset_mm.map(point_of_mm));
    let rolls = config.rolls().map(|roll| roll.is_some());
    let design = standard_design(chain, &volume, &tools, rolls);
    let nodes = nodes(config, own);
    let zero = zero_of(config);
    let shape = function_shape(config.compensation.interpolation);
    let plan = design.plan(nodes, zero, shape);
    let angles = plan.runs.iter().map(|it| it.alignment.map(|it| it.angle));
    let cold = design.lines.iter().zip(angles);
    let cold = cold.map(|(line, angle)| entry(config, nodes, line, angle, false));
    let mut lines = design.lines.clone();
    let mut entries: Vec<LineEntry> = cold.collect();
    if is_warm {
        let warm: Vec<_> = lines
            .iter()
            .filter(|it| it.is_for_warmth())
            .copied()
            .collect();
        entries.extend(warm.iter().map(|it| entry(config, nodes, it, None, true)));
        lines.extend(warm);
    }
    let nodes_m = Axis::ALL.map(|axis| {
        let of_axis = plan.functions.iter().find(|it| axis_of(it.name) == axis);
        of_axis.map_or_else(Vec::new, |it| {
            it.nodes.iter().map(|it| it.value()).collect()
        })
    });
    Ok((
        VolumePlanEntry {
            chain: config.chain.clone(),
            low_m: metres(point_of_mm(config.low_mm)),
            high_m: metres(point_of_mm(config.high_mm)),
            tool_m: metres(tool),
            zero_m: metres(zero),
            nodes_m,
            functions: design.names().map(|it| it.to_string()).collect(),
            shape: Some(shape.into()),
            lines: entries,
            drives,
            fixed_m: metres(point_of_mm(config.expansion_fixed_mm)),
            ..if is_warm {
                of_warmth(config)
            } else {
                VolumePlanEntry::default()
            }
        },
        lines,
    ))
}

/// What a person is asked to set up for line `number` of all of them.
pub(crate) fn set_up_task(lines: &[StandardLine], number: usize) -> LineTask {
    let line = &lines[number];
    LineTask {
        optics: match line.optics {
            Optics::Linear => LineOptics::Linear,
            Optics::Straightness(across) => LineOptics::Straightness { across },
            Optics::Angle(about) => LineOptics::Angular { about },
        },
        start: line.from,
        end: line.to,
        tool: line.tool,
        step: (number + 1, lines.len()),
    }
}

/// Whose error it is.
pub(super) const fn axis_of(name: ErrorName) -> Axis {
    let (ErrorName::Along(axis, _) | ErrorName::About(axis, _)) = name;
    axis
}

/// How many nodes there are along each axis.
pub(super) fn nodes(config: &VolumetricConfig, own: &VolumetricCalibrateConfig) -> [usize; 3] {
    Axis::ALL.map(|axis| config.stretches(axis, own.step_mm) as usize + 1)
}

/// Tilts and positioning errors count from the machine's zero, where the volume has it.
fn zero_of(config: &VolumetricConfig) -> Point {
    let at = |k: usize| 0.0_f64.clamp(config.low_mm[k], config.high_mm[k]);
    point_of_mm([at(0), at(1), at(2)])
}

/// The line as a journal has it, with as many places as there are nodes along the axis of it that
/// goes farthest.
fn entry(
    config: &VolumetricConfig,
    nodes: [usize; 3],
    line: &StandardLine,
    angle: Option<usize>,
    warm: bool,
) -> LineEntry {
    let way = line.to - line.from;
    let moved = Axis::ALL.into_iter();
    let moved = moved.filter(|it| way.along(*it) != Metres::ZERO);
    let (optics, sees) = match line.optics {
        Optics::Linear => (OpticsName::Linear, None),
        Optics::Straightness(across) => (OpticsName::Straightness, Some(across)),
        Optics::Angle(about) => (OpticsName::Angular, Some(about)),
    };
    LineEntry {
        from_m: metres(line.from),
        to_m: metres(line.to),
        tool_m: metres(line.tool),
        optics,
        sees: sees.map(|it| AXES[it.index()]),
        purpose: line.purpose.to_string(),
        points: moved.map(|it| nodes[it.index()]).max().unwrap_or(2),
        warm,
        angle,
        by_detectors: match line.purpose {
            Purpose::Straightness(axis, _) => config.beam.each()[axis.index()].is_some(),
            Purpose::Roll(_) => true,
            Purpose::Positioning(_)
            | Purpose::Tilt(..)
            | Purpose::RollOnLever(_)
            | Purpose::EvenRollOnLever(_)
            | Purpose::Squarenesses => false,
        },
    }
}

/// What warmth does, as far as it is to be found.
fn of_warmth(config: &VolumetricConfig) -> VolumePlanEntry {
    let expansions = expansion_plans(config)
        .into_iter()
        .map(|it| ExpansionEntry {
            axis: AXES[it.axis.index()],
            thermometers: it.thermometers,
        });
    let bends = bend_plans(config).into_iter().map(|it| BendEntry {
        axis: AXES[it.axis.index()],
        towards: AXES[it.towards.index()],
        over: it.over,
        under: it.under,
        low_m: it.low.value(),
        high_m: it.high.value(),
        seen_from_m: it.seen_from.map(metres),
    });
    let u = config.temperature.iter();
    let u = u.map(TemperatureConfig::u_kelvin);
    VolumePlanEntry {
        thermometer_u_k: u.fold(0.0, f64::max),
        expansions: expansions.collect(),
        bends: bends.collect(),
        ..VolumePlanEntry::default()
    }
}
