//! What the verbs of rotary axes print with `--json`.

use crate::program::schema::form::{Form, Printed};
use crate::program::schema::parts::budget;
use crate::program::schema::shape::{
    Member, Shape, and, constant, list, number, object, part, text, truth, whole, word,
};

pub(crate) fn printed() -> Printed {
    Printed {
        forms: vec![
            Form::new("zero", "of a rotary axis", [("axis", text())]).counted(),
            calibrate(),
            placements(),
            Form::new("verify", "of a rotary axis", verify())
                .counted()
                .judged(),
            Form::new(
                "move",
                "of rotary axes",
                [("moves", list(part("rotary-moved")))],
            ),
            Form::new("jog", "of a rotary axis", jog()).counted(),
            plan(),
            fit(),
            diff(),
            demo(),
        ],
        parts: vec![
            ("rotary-reading", object(reading())),
            ("rotary-figures", figures()),
            ("rotary-moved", object(moved())),
            ("rotary-verified", object(verify())),
        ],
    }
}

fn jog() -> Vec<Member> {
    vec![
        ("axis", text()),
        ("encoder_deg", number()),
        (
            "at_last_count",
            truth().about("Whether it ended where its drive counts no further."),
        ),
    ]
}

fn maybe() -> Shape {
    number().or_null()
}

fn reading() -> Vec<Member> {
    vec![
        ("placement", whole()),
        ("offset", whole().about("In lines.")),
        ("line", whole()),
    ]
}

/// What readings say about table and plate.
fn solution() -> Vec<Member> {
    let outlier = object(and(reading(), [("residual_arcsec", number())]));
    vec![
        ("lines", whole()),
        (
            "offsets",
            list(whole()).about("Of the placements, in lines."),
        ),
        (
            "table_error_arcsec",
            list(number()).about("reading - true angle, at each line"),
        ),
        ("standard_uncertainty_arcsec", list(maybe())),
        ("propagated_uncertainty_arcsec", list(number()).or_null()),
        ("plate_error_arcsec", list(maybe())),
        ("residual_rms_arcsec", number()),
        ("degrees_of_freedom", whole()),
        ("reading_noise_arcsec", maybe()),
        ("noise_amplification", number()),
        ("worst_amplification", number()),
        ("worst_harmonic", whole()),
        (
            "harmonic_max",
            whole().about("Up to which the result and its uncertainty hold."),
        ),
        ("outliers", list(outlier)),
        ("missing", list(part("rotary-reading"))),
    ]
}

fn calibrated() -> Vec<Member> {
    let harmonic = object([
        ("number", whole()),
        ("amplitude_arcsec", number()),
        ("standard_uncertainty_arcsec", maybe()),
        ("phase_deg", number()),
        ("significant", truth()),
    ]);
    and(
        solution(),
        [
            ("calibration", text()),
            ("in_use", truth()),
            ("path", text()),
            ("journal", text()),
            ("closure_arcsec", number()),
            ("pass_scatter_arcsec", maybe()),
            (
                "uncertainty",
                budget([("position_deg", number()), ("expanded_arcsec", number())]),
            ),
            ("harmonics", list(harmonic)),
            ("largest_deviation_arcsec", number()),
        ],
    )
}

fn calibrate() -> Form {
    let more = [
        ("axis", text()),
        (
            "complete?",
            constant(true).about("Where a person or a file has read the plate."),
        ),
        ("verified?", part("rotary-verified").about("With --verify.")),
    ];
    Form::new("calibrate", "of a rotary axis", and(calibrated(), more))
        .counted()
        .tried()
        .judged()
}

/// Between two files of readings.
fn placements() -> Form {
    let read = object([
        ("offset", number()),
        ("closure_arcsec", number()),
        ("pass_scatter_arcsec", maybe()),
    ]);
    let due = object([
        ("placement", whole()),
        ("of", whole()),
        ("offset", number()),
        ("task", text()),
    ]);
    Form::new(
        "calibrate",
        "of a rotary axis, when placements are still to be read",
        [
            ("axis", text()),
            ("complete", constant(false)),
            ("placements_read", list(read)),
            ("due", due),
            ("journal", text()),
        ],
    )
}

fn figures() -> Shape {
    object([
        ("largest_arcsec", number()),
        ("rms_arcsec", number()),
        (
            "deviation_arcsec",
            list(maybe()).about("actual - target, at each line"),
        ),
    ])
}

fn verified() -> Vec<Member> {
    let repeatability = object([("forward", maybe()), ("reverse", maybe())]);
    let bidirectional = object([
        ("reversal_arcsec", list(maybe()).about("forward - reverse")),
        ("mean_reversal_arcsec", number()),
        ("reversal_variation_arcsec", number()),
        ("repeatability_arcsec", repeatability),
    ]);
    vec![
        ("offset_lines", number()),
        ("plate_known", truth()),
        ("as_found", part("rotary-figures")),
        ("as_left", part("rotary-figures").or_null()),
        ("reading_noise_arcsec", maybe()),
        ("bidirectional", bidirectional.or_null()),
        ("closure_arcsec", number()),
        ("tolerance_arcsec", number()),
        ("within_tolerance", truth().or_null()),
        ("journal", text()),
    ]
}

fn verify() -> Vec<Member> {
    and(verified(), [("axis", text())])
}

fn moved() -> Vec<Member> {
    vec![
        ("axis", text()),
        ("target_deg", number()),
        ("set_point_deg", number()),
        ("expected_deg", number()),
        ("standard_uncertainty_arcsec", maybe()),
        ("calibration", text().or_null()),
        ("corrected", truth()),
    ]
}

/// What offsets make of noise; `null` for a harmonic that they do not show at all.
fn amplification() -> Vec<Member> {
    vec![
        ("offsets", list(whole())),
        ("rms_amplification", maybe()),
        ("worst_amplification", maybe()),
        ("worst_harmonic", whole()),
        (
            "amplification",
            list(maybe()).about("By harmonic, from the first."),
        ),
    ]
}

fn plan() -> Form {
    let theory = object([
        ("pair_one_line_apart_rms", number()),
        ("placement_at_every_line_rms", number()),
    ]);
    let more = [
        ("lines", whole()),
        ("placements", whole()),
        ("patent_pair", object(amplification())),
        ("theory", theory),
        ("criterion", word(&["worst", "rms"]).or_null()),
    ];
    Form::new("plan rotary", "offsets", and(amplification(), more))
}

fn fit() -> Form {
    let saved = [("calibration?", text().about("With --save."))];
    Form::new("fit rotary", "a table error", and(solution(), saved))
}

fn diff() -> Form {
    let change = object([("line", whole()), ("table_error_arcsec", number())]);
    Form::new(
        "cal diff",
        "of rotary axes",
        [("changes", list(change)), ("page?", text())],
    )
}

fn demo() -> Form {
    Form::new(
        "demo",
        "a rotary axis",
        [
            ("offsets", list(whole())),
            ("calibration", object(calibrated())),
            ("verified", object(verified())),
            ("verified_after_power_cycle", object(verified())),
            ("move", part("rotary-moved")),
            ("report", text()),
            ("wall_s", number()),
        ],
    )
    .judged()
}
