//! What is printed for machines of several kinds.

use super::form::{counters, of_failures};
use super::shape::{
    Member, Shape, and, anything, list, number, object, one_of, part, text, truth, whole, word,
};

/// Figures of ISO 230-2, in micrometres.
pub(crate) fn figures() -> Shape {
    part("figures")
}

/// What contributes to an uncertainty, and what it comes to where that is `largest`; `null` where there is no budget.
pub(crate) fn budget(largest: impl IntoIterator<Item = Member>) -> Shape {
    object([
        (
            "coverage_factor",
            number().about("k of the expanded uncertainty."),
        ),
        (
            "largest",
            object(largest).or_null().about("The largest uncertainty."),
        ),
        ("contributions", list(part("contribution"))),
    ])
    .or_null()
}

/// The way to a target: `+` with growing coordinates, `-` with falling ones.
pub(crate) fn approach() -> Shape {
    word(&["+", "-"])
}

/// What a service gave that has no words of its own for a result.
pub(crate) fn untold() -> Member {
    ("result", anything().about("The service's own figures."))
}

/// What several verbs print, by name.
pub(super) fn all() -> Vec<(&'static str, Shape)> {
    let mut all = Vec::from(of_failures());
    all.extend([
        ("counters", counters()),
        ("finding", finding()),
        ("figures", all_figures()),
        ("contribution", contribution()),
        ("certificate", certificate()),
        ("verification", verification()),
    ]);
    all
}

/// A verification that did not come to figures of a good calibration, and what is stored all the same.
fn verification() -> Shape {
    let stored = object([
        ("of", text().about("The axis, or what else has one in use.")),
        ("calibration", text()),
        ("path", text()),
        ("in_use", truth()),
    ]);
    object([
        ("ended", word(&["stopped", "failed", "worse"])),
        (
            "journal",
            text()
                .or_null()
                .about("With which it goes on; null where there is none."),
        ),
        ("stored", list(stored)),
        ("next", list(text()).about("Commands.")),
    ])
    .about(
        "A verification that was cut short, or shows that the calibration makes the machine worse.",
    )
}

/// One finding of a configuration.
fn finding() -> Shape {
    object([
        ("file", text().about("As it was named.")),
        ("line", whole().about("Counted from 1.")),
        ("column", whole().about("Counted from 1, in characters.")),
        (
            "key",
            text().about("The key's path; empty where none can be told."),
        ),
        ("cause", text()),
        ("help", text()),
    ])
}

fn contribution() -> Shape {
    object([
        ("name", text()),
        ("evaluation", word(&["A", "B"]).about("GUM 4.2 or 4.3.")),
        (
            "value",
            number().about("Standard uncertainty of the input."),
        ),
        ("unit", text().about("Of the value.")),
        (
            "sensitivity",
            number().about("SI units of the result per unit."),
        ),
        (
            "degrees_of_freedom",
            number().or_null().about("null: infinitely many."),
        ),
        ("correlation", correlation()),
        ("approach?", approach()),
    ])
}

/// What one input does at two places.
pub(crate) fn correlation() -> Shape {
    word(&[
        "common_scale",
        "common_offset",
        "independent",
        "between_positions",
        "shared_readings",
    ])
}

/// Of a certificate, as records have it.
fn certificate() -> Shape {
    object([
        ("of", text()),
        ("identifier", text()),
        ("laboratory", text()),
        ("serial_number", text()),
        ("calibrated", text()),
        ("valid_until", text()),
        ("blake3", text().about("Of the file.")),
    ])
}

/// A figure of both sides and of each.
fn directional(of: fn() -> Shape) -> Shape {
    object([
        ("bidirectional", of()),
        ("forward", of()),
        ("reverse", of()),
    ])
}

/// A figure of each side.
fn sides(of: fn() -> Shape) -> Shape {
    object([("forward", of()), ("reverse", of())])
}

/// A figure of the only side that was measured.
fn side() -> Shape {
    one_of([
        object([("forward", number())]),
        object([("reverse", number())]),
    ])
}

fn maybe() -> Shape {
    number().or_null()
}

/// How well the data serve the standard.
fn conformity() -> Vec<Member> {
    vec![
        ("unit", word(&["um"])),
        ("runs", whole()),
        ("conforms_to_iso_230_2", truth()),
        (
            "iso_230_2_asks_for",
            object([("runs", whole()), ("targets", whole())]),
        ),
    ]
}

/// The members of figures of both directions, in micrometres.
pub(crate) fn figure_members() -> Vec<Member> {
    let target = object([
        ("target_mm", number()),
        ("mean_deviation", sides(number)),
        ("standard_deviation", sides(number)),
        ("reversal_value", number()),
        ("repeatability", directional(number)),
    ]);
    and(
        conformity(),
        [
            ("reversal_value", number()),
            ("mean_reversal_value", number()),
            ("mean_bidirectional_deviation_range", number()),
            ("systematic_deviation", directional(number)),
            ("repeatability", directional(number)),
            ("accuracy", directional(number)),
            ("targets", list(target)),
        ],
    )
}

fn all_figures() -> Shape {
    object(figure_members())
        .about("Figures of ISO 230-2 in micrometres; a deviation is actual - target.")
}

/// The members of figures of one direction.
pub(crate) fn one_way_members() -> Vec<Member> {
    let target = object([
        ("target_mm", number()),
        ("mean_deviation", side()),
        ("standard_deviation", side()),
        ("repeatability", side()),
    ]);
    and(
        conformity(),
        [
            ("approach", word(&["forward", "reverse"])),
            ("systematic_deviation", side()),
            ("repeatability", side()),
            ("accuracy", side()),
            ("targets", list(target)),
        ],
    )
}

/// The members of what single measurements can tell.
pub(crate) fn means_members() -> Vec<Member> {
    let target = object([("target_mm", number()), ("mean_deviation", sides(maybe))]);
    and(
        conformity(),
        [
            ("systematic_deviation", directional(maybe)),
            ("mean_bidirectional_deviation_range", maybe()),
            ("reversal_value", maybe()),
            ("mean_reversal_value", maybe()),
            ("not_stated", text()),
            ("targets", list(target)),
        ],
    )
}
