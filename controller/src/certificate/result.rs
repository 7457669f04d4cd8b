//! Which result of a certificate is meant, and what it says.

use roxmltree::Node;

use super::measurand::Measurand;
use super::table::{Figures, Point};
use super::unit::Dimension;
use super::values::{Values, of_quantity, quantities};
use super::xml::{DCC, child, name_of};
use super::{Unfit, unfit};

/// Speed of light in vacuum (exact, SI).
const LIGHT_M_PER_S: f64 = 299_792_458.0;
/// Of a helium-neon laser at 633 nm (BIPM, mise en pratique of the metre).
const HELIUM_NEON_M: f64 = 632.991_212e-9;
/// One that nothing stabilises is within some 1.5 ppm; the wavelength in air is 270 ppm shorter.
const HELIUM_NEON_RELATIVE: f64 = 5e-6;
/// Two columns that say the same may differ by their last digits: so much of the uncertainty, or of the largest.
const ROUNDED: f64 = 0.5;
const ALIKE: f64 = 1e-3;

/// What a column is by the refTypes of good practice.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Column {
    Reference,
    /// What was set: it counts as the reference where none is stated.
    Nominal,
    Measured,
    Error,
    Correction,
}

const COLUMNS: [(&str, Column); 7] = [
    ("basic_referenceValue", Column::Reference),
    ("basic_nominalValue", Column::Nominal),
    ("basic_measuredValue", Column::Measured),
    ("basic_measurementError", Column::Error),
    ("basic_measurementError_error", Column::Error),
    ("basic_measurementError_correction", Column::Correction),
    ("basic_correction", Column::Correction),
];

/// What the results say of `measurand`; of several the one that is called `wanted`.
///
/// # Errors
/// When none does, several do and none is wanted, or what it says cannot be.
pub(super) fn figures(
    results: &[Node<'_, '_>],
    measurand: Measurand,
    wanted: Option<&str>,
) -> Result<Figures, Unfit> {
    let called =
        |it: &Node<'_, '_>, name: &str| name_of(*it) == name || it.attribute("id") == Some(name);
    let meant = results
        .iter()
        .filter(|it| wanted.is_none_or(|name| called(it, name)));
    let mut found = Vec::new();
    for it in meant {
        if let Some(figures) = of_result(*it, measurand)? {
            found.push((name_of(*it), figures));
        }
    }
    let names = || {
        let names: Vec<_> = results.iter().map(|it| name_of(*it)).collect();
        names.join(", ")
    };
    match found.len() {
        1 => Ok(found.remove(0).1),
        0 => unfit(
            format!(
                "no result of it is a {}; its results: {}",
                sought(measurand),
                names()
            ),
            "which quantities are read says docs/exchange.md (refType and unit)",
        ),
        _ => {
            let names: Vec<_> = found.into_iter().map(|it| it.0).collect();
            unfit(
                format!(
                    "{} of its results could be meant: {}",
                    names.len(),
                    names.join(", ")
                ),
                "say which by `result`",
            )
        }
    }
}

fn sought(measurand: Measurand) -> String {
    match measurand {
        Measurand::Wavelength => "vacuum wavelength (or frequency) of a laser".into(),
        other => format!(
            "calibration of {}: readings, and their errors or references",
            other.name()
        ),
    }
}

/// Columns that stand together.
type Columns = Vec<(Option<Column>, Values)>;

/// `None` where the result is of something else.
fn of_result(result: Node<'_, '_>, measurand: Measurand) -> Result<Option<Figures>, Unfit> {
    let Some(data) = child(result, DCC, "data") else {
        return Ok(None);
    };
    let lists = lists(data, measurand)?;
    match measurand {
        Measurand::Wavelength => {
            let all: Columns = lists.into_iter().flat_map(|it| it.columns).collect();
            wavelength(&all)
        }
        _ => match the_table(joined_rows(lists)?) {
            Ok(columns) => table(&columns, measurand),
            Err(count) => unfit(
                format!(
                    "its result `{}` says {count} tables; which is meant?",
                    name_of(result)
                ),
                "ask the laboratory for a result of its own for each of them",
            ),
        },
    }
}

/// What one list of a result says.
struct List<'a, 'i> {
    node: Node<'a, 'i>,
    columns: Columns,
}

/// Each list with its columns that are stated in a unit of `measurand`.
fn lists<'a, 'i: 'a>(data: Node<'a, 'i>, measurand: Measurand) -> Result<Vec<List<'a, 'i>>, Unfit> {
    let mut found: Vec<List<'a, 'i>> = Vec::new();
    for quantity in quantities(data) {
        let words = quantity.attribute("refType").unwrap_or_default();
        let column = words
            .split_whitespace()
            .find_map(|word| Some(COLUMNS.iter().find(|it| it.0 == word)?.1));
        let own = of_quantity(quantity)?.into_iter();
        let own = own.filter(|it| measurand.is_stated_in(it.unit.dimension));
        // Of one that is stated in several units: a length before a frequency.
        let own = own.min_by_key(|it| it.unit.dimension == Dimension::Frequency);
        let (Some(own), Some(node)) = (own, quantity.parent()) else {
            continue;
        };
        match found.iter_mut().find(|it| it.node == node) {
            Some(list) => list.columns.push((column, own)),
            None => found.push(List {
                node,
                columns: vec![(column, own)],
            }),
        }
    }
    Ok(found)
}

/// The columns of each table: those whose lists have one value in each quantity are rows of one, where they stand in
/// one list.
fn joined_rows(lists: Vec<List<'_, '_>>) -> Result<Vec<Columns>, Unfit> {
    let mut tables: Vec<(Node<'_, '_>, bool, Columns)> = Vec::new();
    for List { node, columns } in lists {
        let is_row = columns.iter().all(|it| it.1.len() == 1);
        let place = node.parent().filter(|_| is_row).unwrap_or(node);
        let known = tables.iter_mut().find(|it| is_row && it.1 && it.0 == place);
        match known {
            Some((_, _, all)) => join(all, columns, true)?,
            None => {
                let mut all = Vec::new();
                join(&mut all, columns, is_row)?;
                tables.push((place, is_row, all));
            }
        }
    }
    Ok(tables.into_iter().map(|it| it.2).collect())
}

fn join(all: &mut Columns, more: Columns, is_row: bool) -> Result<(), Unfit> {
    for (column, own) in more {
        let before = all
            .iter_mut()
            .find(|it| is_row && it.0 == column && column.is_some());
        match before {
            Some(before) => before.1 = before.1.clone().joined(own)?,
            None => all.push((column, own)),
        }
    }
    Ok(())
}

/// The one table that `lists` make: one of them, or all together. Of several how many there are.
fn the_table(mut lists: Vec<Columns>) -> Result<Columns, usize> {
    let has = |list: &Columns, wanted: Column| list.iter().any(|it| it.0 == Some(wanted));
    let is_anywhere = lists.iter().any(|it| has(it, Column::Reference));
    for list in &mut lists {
        list.retain(|it| it.0.is_some());
        let is_here = has(list, Column::Reference);
        let is_alone = list.iter().all(|it| it.0 == Some(Column::Nominal));
        match is_here || (is_alone && is_anywhere) {
            true => list.retain(|it| it.0 != Some(Column::Nominal)),
            false => {
                let nominal = list.iter_mut().filter(|it| it.0 == Some(Column::Nominal));
                nominal.for_each(|it| it.0 = Some(Column::Reference));
            }
        }
    }
    let all: Columns = lists.iter().flatten().cloned().collect();
    if most_alike(&all) <= 1 {
        return Ok(all);
    }
    let is_whole = |it: &Columns| {
        let kinds = kinds(it);
        kinds.len() > 1
            && kinds
                .iter()
                .any(|it| matches!(it, Column::Reference | Column::Measured))
    };
    let mut whole: Vec<Columns> = lists.into_iter().filter(is_whole).collect();
    match (whole.as_slice(), is_whole(&all)) {
        ([one], _) if most_alike(one) == 1 => Ok(whole.remove(0)),
        ([], false) => Ok(Vec::new()),
        ([] | [_], _) => Err(most_alike(&all)),
        (several, _) => Err(several.len()),
    }
}

fn kinds(columns: &Columns) -> Vec<Column> {
    let mut kinds: Vec<Column> = Vec::new();
    for column in columns.iter().filter_map(|it| it.0) {
        if !kinds.contains(&column) {
            kinds.push(column);
        }
    }
    kinds
}

/// How many columns of one kind there are, of that which has the most.
fn most_alike(columns: &Columns) -> usize {
    let kinds = kinds(columns).into_iter();
    let counts = kinds.map(|kind| columns.iter().filter(|it| it.0 == Some(kind)).count());
    counts.max().unwrap_or_default()
}

/// The one value of light: what was measured of the laser.
fn wavelength(columns: &[(Option<Column>, Values)]) -> Result<Option<Figures>, Unfit> {
    let is_light = |it: f64| (300e-9..2e-6).contains(&it);
    let metres = |own: &Values, it: f64| match own.unit.dimension {
        Dimension::Frequency => LIGHT_M_PER_S / it,
        _ => it,
    };
    let of_light = columns.iter().filter(|(column, own)| {
        let is_measured = matches!(column, None | Some(Column::Measured));
        is_measured && own.values().iter().all(|it| is_light(metres(own, *it)))
    });
    let mut all: Vec<_> = of_light.map(|it| &it.1).collect();
    // The same light in hertz beside it says nothing more.
    if all.iter().any(|it| it.unit.dimension == Dimension::Length) {
        all.retain(|it| it.unit.dimension == Dimension::Length);
    }
    let [own] = all.as_slice() else {
        return match all.as_slice() {
            [] => Ok(None),
            _ => unfit(
                "a result states several wavelengths",
                "ask the laboratory for one with refType basic_measuredValue",
            ),
        };
    };
    let [stated] = own.values()[..] else {
        return unfit(
            "a laser has one wavelength, and the result has several",
            "is it the right certificate?",
        );
    };
    let value = metres(own, stated);
    let Some(u) = own.u() else {
        return without_uncertainty();
    };
    // Of c/f the relative uncertainty is that of f.
    let u = u[0] / stated * value;
    let off = value / HELIUM_NEON_M - 1.0;
    if off.abs() > HELIUM_NEON_RELATIVE {
        let help = match off {
            -3e-4..=-2.4e-4 => "that is the wavelength in air: ask for that in vacuum",
            _ => "is it the certificate of this laser?",
        };
        return unfit(
            format!(
                "{} nm is no vacuum wavelength of a helium-neon laser at 632.991 nm: {:.1} ppm off",
                value * 1e9,
                off * 1e6
            ),
            help,
        );
    }
    Ok(Some(Figures::Value { value, u }))
}

fn without_uncertainty<T>() -> Result<T, Unfit> {
    unfit(
        "it states no uncertainty of what it certifies",
        "ask the laboratory for it: a value without one says nothing",
    )
}

/// Corrections by readings.
fn table(
    columns: &[(Option<Column>, Values)],
    measurand: Measurand,
) -> Result<Option<Figures>, Unfit> {
    let column = |wanted: Column| {
        columns
            .iter()
            .find(|it| it.0 == Some(wanted))
            .map(|it| &it.1)
    };
    let (reference, measured) = (column(Column::Reference), column(Column::Measured));
    let (error, correction) = (column(Column::Error), column(Column::Correction));
    let known: Vec<&Values> = [reference, measured, error, correction]
        .into_iter()
        .flatten()
        .collect();
    if known.len() < 2 || (reference, measured) == (None, None) {
        return Ok(None);
    }
    let count = known[0].len();
    if count == 0 || known.iter().any(|it| it.len() != count) {
        return unfit(
            "its columns have different numbers of values",
            "ask the laboratory for whole rows",
        );
    }
    let stated = [
        correction.map(Values::differences),
        error.map(|it| it.differences().iter().map(|it| -it).collect()),
    ];
    let compared = reference.zip(measured).map(|(reference, measured)| {
        let pairs = reference.values().into_iter().zip(measured.values());
        pairs
            .map(|(reference, measured)| reference - measured)
            .collect::<Vec<_>>()
    });
    let of_correction = correction.and_then(Values::u);
    let u = match of_correction.or_else(|| error.and_then(Values::u)) {
        Some(u) => u,
        None => compared_u(reference, measured, count)?,
    };
    let corrections: Vec<Vec<f64>> = stated.into_iter().flatten().chain(compared).collect();
    for other in &corrections[1..] {
        agree(&corrections[0], other, &u)?;
    }
    let made = &corrections[0];
    let readings = match (measured, reference) {
        (Some(measured), _) => measured.values(),
        (None, Some(reference)) => reference
            .values()
            .iter()
            .zip(made)
            .map(|(it, correction)| it - correction)
            .collect(),
        (None, None) => Vec::new(),
    };
    let points = readings
        .iter()
        .zip(made)
        .zip(&u)
        .map(|((reading, correction), u)| Point {
            reading: *reading,
            correction: *correction,
            u: *u,
        });
    let points = in_order(points.collect())?;
    judge(&points, measurand)?;
    Ok(Some(Figures::Table(points)))
}

/// That of the difference of two columns; that of the reference alone is not what the instrument adds.
fn compared_u(
    reference: Option<&Values>,
    measured: Option<&Values>,
    count: usize,
) -> Result<Vec<f64>, Unfit> {
    let each: Vec<Vec<f64>> = [reference, measured]
        .into_iter()
        .flatten()
        .filter_map(Values::u)
        .collect();
    if measured.and_then(Values::u).is_none() {
        return without_uncertainty();
    }
    let squares = |at: usize| each.iter().map(|it| it[at] * it[at]).sum::<f64>();
    Ok((0..count).map(|at| squares(at).sqrt()).collect())
}

/// Two ways to say one thing: where they contradict each other nobody knows which is right.
fn agree(one: &[f64], other: &[f64], u: &[f64]) -> Result<(), Unfit> {
    let largest = one.iter().fold(0.0_f64, |most, it| most.max(it.abs()));
    let rows = one.iter().zip(other).zip(u).enumerate();
    for (at, ((one, other), u)) in rows {
        let limit = (ROUNDED * u).max(ALIKE * largest);
        if (one - other).abs() > limit {
            return unfit(
                format!(
                    "value {}: its error is not measured - reference (a correction of {one} is stated, the columns \
                     say {other})",
                    at + 1
                ),
                "ask the laboratory which sign is meant: an error is measured - reference, a correction its opposite",
            );
        }
    }
    Ok(())
}

fn in_order(mut points: Vec<Point>) -> Result<Vec<Point>, Unfit> {
    points.sort_by(|a, b| a.reading.total_cmp(&b.reading));
    let twice = points.windows(2).find(|it| it[1].reading <= it[0].reading);
    match twice {
        Some(it) => unfit(
            format!("the reading {} stands there twice", it[0].reading),
            "ask the laboratory for one correction for each reading",
        ),
        None => Ok(points),
    }
}

fn judge(points: &[Point], measurand: Measurand) -> Result<(), Unfit> {
    let Some(possible) = measurand.possible() else {
        return Ok(());
    };
    let (unit, per) = measurand.unit();
    let (low, high) = possible.readings;
    for it in points {
        if !(low..=high).contains(&it.reading) {
            return unfit(
                format!(
                    "a reading of {} {unit} is outside {} to {} {unit}",
                    it.reading * per,
                    low * per,
                    high * per
                ),
                "is its unit right, and is it the certificate of this sensor?",
            );
        }
        if it.correction.abs() > possible.correction || it.u > possible.correction {
            return unfit(
                format!(
                    "at {} {unit} a correction of {:e} with a standard uncertainty of {:e} (SI) is more than {:e}",
                    it.reading * per,
                    it.correction,
                    it.u,
                    possible.correction
                ),
                "are its columns what their refTypes say, and their units right?",
            );
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;
