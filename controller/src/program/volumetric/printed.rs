//! What the verbs of three axes print with `--json`.

use crate::program::schema::form::{Form, Printed};
use crate::program::schema::parts::{budget, correlation};
use crate::program::schema::shape::{
    Member, Shape, and, constant, list, number, object, part, several, text, truth, whole, word,
};

pub(crate) fn printed() -> Printed {
    let forms = [cycle(), moves(), references(), vec![align(), fit(), demo()]];
    Printed {
        forms: forms.into_iter().flatten().chain(diffs()).collect(),
        parts: vec![
            ("volume-verified", object(verified())),
            ("volume-calibrated", object(calibrated())),
            ("departure", departure()),
            ("memory", object(memory())),
        ],
    }
}

fn maybe() -> Shape {
    number().or_null()
}

/// How well the readings agree, what warmth does, and what nobody knows.
fn found() -> Vec<Member> {
    let expansion = object([
        ("axis", text()),
        ("ppm_per_k", number()),
        ("u_ppm_per_k", number()),
    ]);
    let bend = object([
        ("axis", text()),
        ("towards", text()),
        ("um_per_k", number()),
        ("u_um_per_k", number()),
    ]);
    let unknown = object([("axis", text()), ("towards", text())]);
    vec![
        ("degrees_of_freedom", whole()),
        ("birge_ratio", maybe()),
        ("birge_ratio_limit", maybe()),
        ("expansions", list(expansion)),
        ("bends", list(bend)),
        ("unknown_bends", list(unknown)),
        (
            "taken_as_zero",
            list(text()).about("Error functions that nothing shows."),
        ),
        ("lines", whole()),
        ("u_tool_max_um", number()),
        (
            "uncertainty",
            budget([
                ("position_mm", several(3, number())),
                ("expanded_um", number()),
            ]),
        ),
    ]
}

fn calibrated() -> Vec<Member> {
    and(
        found(),
        [
            ("geometry", text()),
            ("references", text()),
            ("in_use", truth()),
            ("journal", text()),
        ],
    )
}

fn verified() -> Vec<Member> {
    let point = object([
        ("at_mm", several(3, number())),
        ("deviation_um", number()),
        ("u_um", maybe()),
    ]);
    vec![
        ("range_um", number()),
        ("limit_um", number()),
        ("within_tolerance", truth()),
        ("journal", text()),
        ("points", list(point)),
    ]
}

fn cycle() -> Vec<Form> {
    let axes = several(3, word(&["x", "y", "z"]));
    let tried = [("verified?", part("volume-verified").about("With --verify."))];
    vec![
        Form::new("zero", "of three axes", [("axes", axes)]).counted(),
        Form::new("calibrate", "of three axes", and(calibrated(), tried))
            .counted()
            .tried()
            .judged(),
        Form::new("verify", "of three axes", verified())
            .counted()
            .judged(),
    ]
}

/// Of a move: what contributes along x, y and z.
fn along() -> Shape {
    let along = object([
        ("axis", text()),
        ("standard_um", number()),
        ("expanded_um", number()),
        ("degrees_of_freedom", maybe()),
    ]);
    let contribution = object([
        ("name", text()),
        ("evaluation", word(&["A", "B"])),
        ("value", number()),
        ("unit", text()),
        (
            "sensitivities",
            several(3, number()).about("Along x, y and z."),
        ),
        ("degrees_of_freedom", maybe()),
        ("correlation", correlation()),
    ]);
    object([
        ("coverage_factor", number()),
        ("along", list(along)),
        ("contributions", list(contribution)),
    ])
}

fn departure() -> Shape {
    object([
        ("mm", number()),
        ("at_s", number()),
        ("lines", several(2, whole()).about("Of the file.")),
        ("place_mm", several(3, number())),
    ])
}

/// A state that is kept.
fn memory() -> Vec<Member> {
    let covered = object([("axis", text()), ("from_mm", number()), ("to_mm", number())]);
    vec![
        ("memory", text()),
        ("axes", list(covered)),
        ("rolls", list(text()).about("Axes whose rolls are kept.")),
        ("foreign_second", foreign()),
    ]
}

fn foreign() -> Shape {
    let foreign = text().or_null();
    foreign.about("A second memory that counts from another first one.")
}

fn moves() -> Vec<Form> {
    let axis = object([
        ("axis", text()),
        ("target_mm", number()),
        ("correction_um", number()),
        ("u_um", maybe()),
    ]);
    let with_path = |more: Vec<Member>| {
        and(
            vec![
                ("points", whole()),
                ("join", text()),
                ("largest_departure", part("departure")),
            ],
            more,
        )
    };
    let followed = vec![
        ("corrected", truth()),
        ("thread", text().about("How the loop was scheduled.")),
        ("largest_correction_um?", several(3, number())),
        ("u_max_um?", several(3, maybe())),
        ("periods_degraded?", whole()),
        ("without?", text().or_null()),
        ("periods_limited?", whole()),
        ("memory?", part("memory").about("With --first-part.")),
    ];
    let judged = vec![("dry_run", constant(true)), ("longer_s", number())];
    vec![
        Form::new(
            "move",
            "of three axes",
            [
                ("corrected", truth()),
                ("axes", list(axis)),
                ("uncertainty", along().or_null()),
            ],
        )
        .counted(),
        Form::new(
            "move",
            "of three axes, by their encoders alone",
            [("corrected", constant(false))],
        )
        .counted(),
        Form::new("run", "a path", with_path(followed)).counted(),
        Form::new("run", "a path with --dry-run", with_path(judged.clone())),
        Form::new("plan path", "a path", with_path(judged)),
    ]
}

fn references() -> Vec<Form> {
    let changes = list(reference_change()).or_null();
    let memories = object([("which", text()), ("memory", text())]);
    vec![
        Form::new(
            "reference",
            "references that were taken",
            [
                ("references", text()),
                ("geometry", text()),
                ("temperatures_c", list(number())),
            ],
        )
        .counted(),
        Form::new(
            "reference import",
            "references that were given",
            [
                ("references", text()),
                ("geometry", text()),
                ("given", word(&["table", "functions"]).or_null()),
                ("source", text()),
                (
                    "changes",
                    changes.about("null where there were none before."),
                ),
                ("foreign_memories", list(memories)),
            ],
        ),
        Form::new("memory record", "the present state", memory()).counted(),
        Form::new("memory import", "a designed shape", memory()),
        Form::new(
            "memory clear",
            "what is forgotten",
            [("cleared", text().or_null()), ("foreign_second", foreign())],
        ),
    ]
}

fn reference_change() -> Shape {
    object([("reading", text()), ("unit", text()), ("change", maybe())])
}

fn diffs() -> [Form; 2] {
    let change = object([("error", text()), ("unit?", text()), ("change", maybe())]);
    [
        ("of the errors of three axes", change),
        ("of the references of three axes", reference_change()),
    ]
    .map(|(what, change)| {
        let members = [("changes", list(change)), ("page?", text())];
        Form::new("cal diff", what, members)
    })
}

fn align() -> Form {
    let reading = object([
        ("along", text().or_null()),
        ("unit", word(&["um", "arcsec"])),
        ("place", maybe()),
        ("from_middle", maybe()),
        ("reference", several(2, number()).or_null()),
        ("from_reference", maybe()),
        ("field", several(2, maybe())),
    ]);
    let detector = object([
        ("detector", text()),
        ("state", text()),
        ("trouble", text().or_null()),
        ("sum_v", maybe()),
        ("readings", list(reading)),
    ]);
    let signal = object([
        ("instrument", text()),
        ("state", text().or_null()),
        ("strength", maybe()),
        ("least", maybe()),
        ("age_s", maybe()),
    ]);
    Form::new(
        "align",
        "what is seen at a time, an object a line",
        [
            ("at_s", number()),
            ("detectors", list(detector)),
            ("signals", list(signal)),
        ],
    )
}

fn fit() -> Form {
    let function = object([
        ("name", text()),
        ("shape", word(&["linear", "monotone_cubic", "spline"])),
        ("positions_m", list(number())),
        ("values_si", list(number())),
        ("standard_uncertainties_si", list(number()).or_null()),
        ("between_standard_uncertainties_si?", list(number())),
    ]);
    let more = [
        ("readings", whole()),
        ("functions", list(function)),
        (
            "squareness_arcsec",
            several(3, number()).about("y to x, z to x, z to y"),
        ),
        ("squareness_u_arcsec", several(3, number())),
        ("calibration?", text().about("With --save.")),
        ("references?", text().or_null().about("With --save.")),
    ];
    Form::new("fit volumetric", "errors of three axes", and(found(), more))
}

fn demo() -> Form {
    let hour = object([
        ("hour", whole()),
        ("as_found_um", number()),
        ("by_tables_um", number()),
        ("corrected_um", number()),
    ]);
    Form::new(
        "demo",
        "three axes",
        [
            ("calibration", part("volume-calibrated")),
            ("hours", list(hour)),
            ("report", text()),
            ("wall_s", number()),
        ],
    )
}
