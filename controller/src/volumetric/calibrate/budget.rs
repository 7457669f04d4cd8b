//! What makes the tool of three axes uncertain, all over the volume.

use compensator::volumetric::Point;
use compensator::volumetric::identify::{Identified, IdentifyError, Observation, Plan};
use units::Celsius;

use crate::store::budget::PlacesBudgetRecord;
use crate::volumetric::{LineEntry, OpticsName, VolumePlanEntry, metres, point};

/// Places between which the uncertainty of the tool is looked for, along each axis.
const PLACES: u32 = 4;

/// The budget of the errors `found` from `observations`, for the tool in use; `lines` are those of the runs.
/// `None` where nothing is stated anywhere.
pub(super) fn budget(
    entry: &VolumePlanEntry,
    lines: &[&LineEntry],
    (plan, observations, found): (&Plan, &[Observation], &Identified),
    shown: &[Celsius],
) -> Result<Option<PlacesBudgetRecord>, IdentifyError> {
    let tool = point(entry.tool_m);
    let is_stated = |at: &Point| found.standard_uncertainty(*at, tool, shown).is_some();
    let places: Vec<_> = grid(entry).filter(is_stated).map(|at| (at, tool)).collect();
    if places.is_empty() {
        return Ok(None);
    }
    let source = |at: usize| {
        let line = lines.get(observations[at].run);
        line.map_or("readings", |it| source(it)).to_owned()
    };
    let budget = plan.budget(observations, source, shown, &places)?;
    let places = places
        .into_iter()
        .map(|(at, _)| (metres(at).to_vec(), None));
    Ok(Some(PlacesBudgetRecord::new(&budget, places.collect())))
}

/// Where the readings of a line come from, as a budget calls it.
const fn source(line: &LineEntry) -> &'static str {
    match (line.by_detectors, line.optics) {
        (true, OpticsName::Straightness) => "beam detectors, with their air",
        (true, OpticsName::Linear | OpticsName::Angular) => "roll detectors",
        (false, OpticsName::Linear) => "lengths, as stated when read",
        (false, OpticsName::Straightness) => "straightnesses, as stated when read",
        (false, OpticsName::Angular) => "angles, as stated when read",
    }
}

/// Places all over the volume.
pub(super) fn grid(entry: &VolumePlanEntry) -> impl Iterator<Item = Point> {
    let along = |k: usize| places(entry.low_m[k], entry.high_m[k]).collect::<Vec<f64>>();
    let [x, y, z] = [along(0), along(1), along(2)];
    let rows = z.into_iter().flat_map(move |z| {
        let row = y.clone().into_iter();
        row.map(move |y| (y, z)).collect::<Vec<_>>()
    });
    rows.flat_map(move |(y, z)| {
        let row = x.clone().into_iter();
        row.map(move |x| point([x, y, z])).collect::<Vec<_>>()
    })
}

/// Places along one axis. Rounding must not put the last one outside the nodes, where nothing is known.
pub(super) fn places(low: f64, high: f64) -> impl Iterator<Item = f64> {
    let inner = move |n: u32| low + (high - low) * f64::from(n) / f64::from(PLACES);
    (0..PLACES).map(inner).chain([high])
}
