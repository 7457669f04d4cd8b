//! Turbo PMAC's leadscrew and backlash compensation, `DEFINE COMP` and `DEFINE BLCOMP`.
//!
//! Source: Delta Tau, Turbo PMAC/PMAC2 Software Reference, on-line commands `DEFINE COMP` (one-dimensional) and
//! `DEFINE BLCOMP`, I-variables I51, Ixx85, Ixx86; Turbo PMAC User Manual, "Setting Up the Servo Loop", position and
//! backlash compensation tables.
//!
//! Entries are whole sixteenths of a count. Entry k belongs to k spacings from the motor's zero; the last one belongs to
//! the zero, too, as the table begins again after its length, and must be 0. Negative positions stand at its end.
//! Between entries straight lines. COMP is added to the desired position, looked up at the position without it; while
//! the motor comes in the negative direction, Ixx86 and BLCOMP are taken away.

use core::f64::consts::TAU;

use serde_json::{Map, json};

use super::correction::{Measure, Side};
use super::exported::{Exported, Written};
use super::lines::{Lines, Wanted, steps};
use crate::Failure;

/// Entries of a table at most: what fits into the memory of any of them.
const ENTRIES_MAX: usize = 4000;
/// An entry counts sixteenths of a count.
const PER_COUNT: f64 = 16.0;
/// The largest entry, and the longest table, in counts. The Software Reference calls them integers and states no range: these
/// are ours. An entry is within one 24-bit word of the control, a length within 32 bits.
const ENTRY_MAX: f64 = 8_388_607.0;
const LENGTH_MAX: f64 = 2_147_483_647.0;

const COUNTS_HELP: &str = "say the counts of the motor's encoder for a millimetre, or for a turn of a rotary axis, with --counts";

/// The places of a table, in counts.
struct Places {
    /// Counts between two entries.
    spacing: f64,
    /// Where each entry stands, in spacings from the motor's zero.
    at: Vec<i64>,
    /// Counts after which it begins again.
    length: i64,
}

pub(super) fn written(exported: &Exported<'_>) -> Result<Written, Failure> {
    let correction = exported.correction;
    let motor = motor(exported.name)?;
    let counts = counts(exported)?;
    let is_two_sided = correction.has_two_sides() && exported.side.is_none();
    let (side, told) = match is_two_sided {
        true => (Side::Forward, None),
        false => correction.one_side(exported.format, exported.side)?,
    };
    let mut told: Vec<String> = told.into_iter().collect();
    let curve = |it: f64| correction.compensation(it, side);
    let (places, lines) = places(exported, counts, curve, &correction.corners(side))?;
    let at_zero = curve(0.0);
    let entries = places.entries(counts, |it| curve(it) - at_zero);
    let mut figures = Map::new();
    let rounding = 0.5 / (PER_COUNT * counts);
    let mut off = lines.off(curve, &correction.corners(side)) + rounding;
    if is_two_sided {
        let curve = |it: f64| correction.compensation(it, Side::Reverse);
        let lines = Lines::new(lines.places, curve);
        off = off.max(lines.off(curve, &correction.corners(Side::Reverse)) + 2.0 * rounding);
    }
    told.push(exported.lines_told(off, entries.len(), &mut figures));
    told.extend(around(exported, at_zero, &places, counts));
    figures.insert("counts_for_unit".into(), json!(counts));
    let backlash = match is_two_sided {
        true => Some(backlash(exported, &places, counts)?),
        false => None,
    };
    require_better_than_none(exported, off)?;
    require_held(&entries, backlash.as_ref())?;
    if backlash.is_some() {
        told.push(format!(
            "I{motor}85 must not be 0: it is the rate at which backlash is taken up"
        ));
    }
    let text = text(exported, motor, &places, &entries, backlash.as_ref(), &told);
    Ok(Written {
        text,
        told,
        figures,
    })
}

fn motor(name: Option<&str>) -> Result<u8, Failure> {
    let name = name.unwrap_or("1");
    let number = name.parse().ok().filter(|it| (1..=32).contains(it));
    number.ok_or_else(|| Failure::Usage {
        what: format!("--name {name}: motors of a Turbo PMAC have the numbers 1 to 32"),
        help: "write --name 1 for motor 1".into(),
    })
}

/// Counts of the motor's encoder for a metre or a radian.
fn counts(exported: &Exported<'_>) -> Result<f64, Failure> {
    let one = exported.head.resolution_m.or(exported.head.resolution_rad);
    let own = exported.counts.or(one.map(f64::recip));
    own.filter(|it| it.is_finite() && *it > 0.0)
        .ok_or_else(|| Failure::Usage {
            what: "--format pmac: how many counts the motor's encoder has is not known".into(),
            help: "say it with --counts: for a millimetre, or for a turn of a rotary axis".into(),
        })
}

/// # Errors
/// When an axis without any table would be nearer to its targets: the counts are not those of its encoder.
fn require_better_than_none(exported: &Exported<'_>, off: f64) -> Result<(), Failure> {
    let (measure, largest) = (exported.measure(), exported.correction.largest());
    if off <= largest.max(measure.harmless()) {
        return Ok(());
    }
    Err(Failure::Usage {
        what: format!(
            "--format pmac: this table would be up to {} off, and the largest deviation of the calibration is {}: the axis \
             is better without it",
            measure.small(off),
            measure.small(largest)
        ),
        help: format!("{COUNTS_HELP}, or a smaller distance with --step"),
    })
}

/// # Errors
/// When a number is larger than the control holds.
fn require_held(entries: &[i64], backlash: Option<&(i64, Vec<i64>)>) -> Result<(), Failure> {
    let more = backlash.map(|(constant, entries)| entries.iter().chain([constant]));
    let all = entries.iter().chain(more.into_iter().flatten());
    let largest = all.map(|it| it.unsigned_abs()).max().unwrap_or(0);
    match largest as f64 <= ENTRY_MAX {
        true => Ok(()),
        false => Err(too_large(format!(
            "an entry of {largest} sixteenths of a count, and {ENTRY_MAX} is the most that is written"
        ))),
    }
}

fn too_large(what: String) -> Failure {
    Failure::Usage {
        what: format!("--format pmac: this table would have {what}"),
        help: COUNTS_HELP.into(),
    }
}

fn places(
    exported: &Exported<'_>,
    counts: f64,
    curve: impl Fn(f64) -> f64 + Copy,
    corners: &[f64],
) -> Result<(Places, Lines), Failure> {
    let calibrated = exported.correction.places();
    let wanted = Wanted {
        step: exported.step,
        max: ENTRIES_MAX,
        measure: exported.measure(),
    };
    let step = wanted.step(&calibrated)?;
    require_room(exported, &wanted, step, counts)?;
    let of = |parts: usize| match exported.measure() {
        Measure::Length => along(exported, step / parts as f64, counts),
        Measure::Angle => around_the_circle((TAU / step).round() as usize * parts, counts),
    };
    let within = |parts: usize| {
        let mut all: Vec<f64> = of(parts).si(counts);
        all.sort_by(f64::total_cmp);
        // What the first entry says holds after a turn, too.
        all.extend((exported.measure() == Measure::Angle).then_some(TAU));
        all
    };
    let (lines, parts) = wanted.lines(within, curve, corners)?;
    Ok((of(parts), lines))
}

/// Before any place is made.
///
/// # Errors
/// When there is no room for so many entries, or the table is longer than the control counts.
fn require_room(
    exported: &Exported<'_>,
    wanted: &Wanted,
    step: f64,
    counts: f64,
) -> Result<(), Failure> {
    let (low, high) = match exported.measure() {
        Measure::Length => reach(exported),
        Measure::Angle => (0.0, TAU),
    };
    let length = (high - low + step) * counts;
    if length > LENGTH_MAX {
        return Err(too_large(format!(
            "a length of {length:.3e} counts, and {LENGTH_MAX} is the most that is written"
        )));
    }
    // Both ends are whole steps from the zero, and a step is a whole number of counts.
    let spacing = spacing(step, counts) / counts;
    let (values, least) = match exported.measure() {
        Measure::Length => (
            [steps(low, 0.0, spacing), steps(0.0, high, spacing)]
                .into_iter()
                .fold(1, usize::saturating_add),
            (high - low) / (ENTRIES_MAX - 4) as f64 + 0.5 / counts,
        ),
        Measure::Angle => (
            steps(low, high, step).saturating_add(1),
            TAU / (ENTRIES_MAX - 1) as f64,
        ),
    };
    wanted.require_room(values, least)
}

/// Whole counts.
fn spacing(step: f64, counts: f64) -> f64 {
    (step * counts).round().max(1.0)
}

/// The calibrated range, the soft limits and the zero.
fn reach(exported: &Exported<'_>) -> (f64, f64) {
    let calibrated = exported.correction.places();
    let (first, last) = (calibrated[0], calibrated[calibrated.len() - 1]);
    let (low, high) = exported.soft_limits.unwrap_or((first, last));
    (low.min(first).min(0.0), high.max(last).max(0.0))
}

/// Over the calibrated range, the soft limits and the zero; one spacing lies between both ends, where nothing goes.
fn along(exported: &Exported<'_>, step: f64, counts: f64) -> Places {
    let (low, high) = reach(exported);
    let spacing = spacing(step, counts);
    let in_spacings = |place: f64| steps(0.0, place, spacing / counts) as i64;
    let below = if low < 0.0 { in_spacings(-low) } else { 0 };
    let above = in_spacings(high);
    let length = ((below + above + 1) as f64 * spacing) as i64;
    let at = (1..=above).chain(-below..=0).collect();
    Places {
        spacing,
        at,
        length,
    }
}

fn around_the_circle(count: usize, counts: f64) -> Places {
    let length = (TAU * counts).round() as i64;
    Places {
        spacing: length as f64 / count as f64,
        at: (1..count as i64).chain([0]).collect(),
        length,
    }
}

impl Places {
    /// Where the entries stand, in metres or radians.
    fn si(&self, counts: f64) -> Vec<f64> {
        self.at
            .iter()
            .map(|it| *it as f64 * self.spacing / counts)
            .collect()
    }

    /// `value` at each, in sixteenths of a count.
    fn entries(&self, counts: f64, value: impl Fn(f64) -> f64) -> Vec<i64> {
        let all = self.si(counts).into_iter();
        all.map(|it| (value(it) * counts * PER_COUNT).round() as i64)
            .collect()
    }
}

/// Ixx86 and the entries of BLCOMP.
fn backlash(
    exported: &Exported<'_>,
    places: &Places,
    counts: f64,
) -> Result<(i64, Vec<i64>), Failure> {
    let correction = exported.correction;
    let of = |it: f64| {
        correction.compensation(it, Side::Forward) - correction.compensation(it, Side::Reverse)
    };
    let constant = (of(0.0) * counts * PER_COUNT).round() as i64;
    if constant < 0 {
        return Err(Failure::Usage {
            what: format!(
                "--format pmac: at the motor's zero the axis is {} farther when it comes forward than in reverse, and \
                 Ixx86 cannot be negative",
                exported.measure().small(-of(0.0))
            ),
            help: "write one table for both directions with --approach forward, reverse or mean"
                .into(),
        });
    }
    let entries = places.entries(counts, of).into_iter();
    Ok((constant, entries.map(|it| it - constant).collect()))
}

/// What is to be known of the places of the table.
fn around(exported: &Exported<'_>, at_zero: f64, places: &Places, counts: f64) -> Vec<String> {
    let measure = exported.measure();
    let mut told = Vec::new();
    if (at_zero * counts * PER_COUNT).round() != 0.0 {
        told.push(format!(
            "at the motor's zero a table has no correction, this calibration has {}: all positions of the motor are \
             shifted by as much, distances are not",
            measure.small(at_zero)
        ));
    }
    if measure == Measure::Length {
        let ends = [places.at.iter().min(), places.at.iter().max()];
        let ends = ends.map(|it| it.copied().unwrap_or(0) as f64 * places.spacing / counts * 1e3);
        told.push(format!(
            "beyond the calibrated range its ends hold, from {} to {} mm; farther out the table begins again: the motor's \
             limits must be within",
            units::Short(ends[0]),
            units::Short(ends[1])
        ));
    }
    told
}

fn text(
    exported: &Exported<'_>,
    motor: u8,
    places: &Places,
    entries: &[i64],
    backlash: Option<&(i64, Vec<i64>)>,
    told: &[String],
) -> String {
    let (count, length) = (entries.len(), places.length);
    let what = [
        "entries: compensation = -(actual - target), 1/16 count; it is added to the desired position".to_owned(),
        "the motor's zero is the axis's zero, and its counts grow with the position".to_owned(),
        "COMP and BLCOMP buffers of motors with lower numbers are to be deleted before, and defined again after".to_owned(),
    ];
    let mut text = String::new();
    for line in exported.header(&[&what[..], told].concat()) {
        text += &format!("; {line}\n");
    }
    text += &format!("#{motor}\nDEFINE COMP {count},#{motor}D,#{motor},{length}\n");
    text += &rows(entries);
    if let Some((constant, entries)) = backlash {
        text += &format!("I{motor}86={constant}\nDEFINE BLCOMP {count},{length}\n");
        text += &rows(entries);
    }
    text + "I51=1\n"
}

fn rows(entries: &[i64]) -> String {
    const IN_A_ROW: usize = 10;
    let rows = entries.chunks(IN_A_ROW).map(|row| {
        let row: Vec<String> = row.iter().map(i64::to_string).collect();
        row.join(" ") + "\n"
    });
    rows.collect()
}
