//! What the correction takes away all over the volume: vectors in slices through it.

use compensator::error_table::Limits;
use compensator::volumetric::model::{Conditions, Machine, Thermal, VolumetricModel};
use compensator::volumetric::online::MovingState;
use compensator::volumetric::{Point, Volume};
use units::{Metres, MetresPerSecond, Radians};

use crate::program::page::map::{Arrow, Map, longest, map};
use crate::volumetric::{GeometryContent, VolumePlanEntry, point};

/// What any error that was stored is within.
const LARGEST: Limits = Limits {
    size: Metres(0.01),
    slope: 0.5,
    rate: MetresPerSecond(1.0),
};
/// Vectors along each side of a slice.
const ALONG: u32 = 7;

/// A slice: its title, the two directions in it, and where along the third one it lies.
struct Slice {
    title: String,
    labels: (&'static str, &'static str),
    directions: [usize; 2],
    third: (usize, f64),
}

/// The volume of `plan` with the errors of `content`, as warm as when they were measured and with nothing seen by
/// detectors; nothing where that makes no model.
pub(super) fn html(content: &GeometryContent, plan: &VolumePlanEntry) -> String {
    let Some((model, now)) = model(content, plan) else {
        return String::new();
    };
    let drawn: Vec<_> = slices(plan)
        .into_iter()
        .map(|it| (arrows(&it, plan, (&model, &now)), it))
        .collect();
    let most = drawn.iter().map(|(arrows, _)| longest(arrows));
    let most = most.fold(0.0, f64::max);
    let maps = drawn.iter().map(|(arrows, slice)| {
        let svg = map(&Map {
            title: &slice.title,
            labels: slice.labels,
            unit: "µm",
            arrows,
            longest: most,
        });
        format!(
            "<figure><figcaption>{}</figcaption>{svg}</figure>",
            slice.title
        )
    });
    format!(
        "<h2>The corrected volume</h2><p>What the correction takes away (actual − target of the tool without it), as \
         warm as when the errors were measured; all slices at one scale.</p>{}",
        maps.collect::<String>()
    )
}

fn model(
    content: &GeometryContent,
    plan: &VolumePlanEntry,
) -> Option<(VolumetricModel, Conditions)> {
    let tool = point(plan.tool_m);
    let longest = plan
        .tool_m
        .iter()
        .fold(0.0_f64, |most, it| most.max(it.abs()));
    let machine = Machine {
        chain: plan.chain.parse().ok()?,
        volume: Volume::new(point(plan.low_m), point(plan.high_m)).ok()?,
        axes: content.errors("the page").ok()?,
        squareness: content.squareness(),
        thermal: Thermal::default(),
        tool_max: Metres(longest),
        displacement_max: Metres::ZERO,
        roll_max: Radians::ZERO,
    };
    let model = VolumetricModel::new(machine, LARGEST).ok()?;
    let now = model.conditions(tool, &[], &MovingState::default()).ok()?;
    Some((model, now))
}

/// Three levels from below to above, and one through the middle from the side.
fn slices(plan: &VolumePlanEntry) -> Vec<Slice> {
    let between = |k: usize, share: f64| plan.low_m[k] + (plan.high_m[k] - plan.low_m[k]) * share;
    let level = |share: f64| {
        let z = between(2, share);
        Slice {
            title: format!("x and y at z = {:.1} mm", Metres(z).mm()),
            labels: ("x (mm)", "y (mm)"),
            directions: [0, 1],
            third: (2, z),
        }
    };
    let y = between(1, 0.5);
    let side = Slice {
        title: format!("x and z at y = {:.1} mm", Metres(y).mm()),
        labels: ("x (mm)", "z (mm)"),
        directions: [0, 2],
        third: (1, y),
    };
    [0.0, 0.5, 1.0]
        .map(level)
        .into_iter()
        .chain([side])
        .collect()
}

fn arrows(
    slice: &Slice,
    plan: &VolumePlanEntry,
    (model, now): (&VolumetricModel, &Conditions),
) -> Vec<Arrow> {
    let [a, b] = slice.directions;
    let place = |k: usize, number: u32| {
        let share = f64::from(number) / f64::from(ALONG - 1);
        // Rounding must not put the last one outside.
        (plan.low_m[k] + (plan.high_m[k] - plan.low_m[k]) * share).min(plan.high_m[k])
    };
    let numbers = (0..ALONG).flat_map(|u| (0..ALONG).map(move |v| (u, v)));
    let each = numbers.filter_map(|(u, v)| {
        let mut at = [0.0; 3];
        (at[a], at[b]) = (place(a, u), place(b, v));
        at[slice.third.0] = slice.third.1;
        let deviation: Point = model.deviation(point(at), now).ok()?;
        let shown = [deviation.x, deviation.y, deviation.z];
        Some(Arrow {
            at: (Metres(at[a]).mm(), Metres(at[b]).mm()),
            shows: (shown[a].um(), shown[b].um()),
        })
    });
    each.collect()
}
