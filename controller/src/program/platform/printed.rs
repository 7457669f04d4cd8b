//! What the verbs of alignment platforms print with `--json`.

use crate::program::schema::form::{Form, Printed};
use crate::program::schema::parts::{approach, budget};
use crate::program::schema::shape::{
    Member, Shape, and, by_name, list, number, object, one_of, part, several, text, truth, whole,
};

pub(crate) fn printed() -> Printed {
    Printed {
        forms: vec![
            Form::new(
                "zero",
                "of a platform",
                [("datum", part("pose")), ("journal", text())],
            )
            .counted(),
            calibrate(),
            Form::new("verify", "of a platform", verified_as())
                .counted()
                .judged(),
            moved(),
            jog("of a platform", "encoder_mm"),
            jog("that turns a platform", "encoder_deg"),
            fit(),
            plan(),
            diff(),
            demo(),
        ],
        parts: vec![
            ("pose", pose()),
            ("stroke-outlier", outlier()),
            ("platform-verified", verified()),
            ("platform-calibrated", object(calibrated())),
            ("alignment", alignment()),
            ("harmonic-shift", leak()),
        ],
    }
}

fn jog(what: &'static str, encoders: &'static str) -> Form {
    let members = [
        ("axis", text()),
        (encoders, number()),
        ("at_end_of_reach", truth()),
    ];
    Form::new("jog", what, members).counted()
}

fn maybe() -> Shape {
    number().or_null()
}

fn pose() -> Shape {
    object([
        ("x_mm", number()),
        ("y_mm", number()),
        ("theta_arcsec", number()),
    ])
}

/// A stroke that was left out of a fit.
fn outlier() -> Shape {
    object([
        ("line", whole().or_null().about("In its file.")),
        ("approach", approach()),
        ("stroke_um", number()),
        ("deviation_um", number()),
        ("residual_um", number()),
    ])
}

fn calibrated() -> Vec<Member> {
    let largest = [
        ("stroke_mm", number()),
        ("approach", approach().or_null()),
        ("expanded_um", number()),
    ];
    let screw = object([
        ("axis", text()),
        ("calibration", text()),
        ("strokes", whole()),
        ("slope_um_per_mm", number()),
        ("lost_motion_um", number()),
        ("lost_motion_um_u", maybe()),
        ("scatter_um", maybe()),
        ("uncertainty", budget(largest)),
        ("outliers", list(part("stroke-outlier"))),
        ("harmonics", list(whole())),
    ]);
    vec![
        ("screws", list(screw)),
        ("in_use", truth()),
        ("closure_um", number()),
        ("journal", text()),
    ]
}

fn calibrate() -> Form {
    let verified = object(verified_as()).about("With --verify.");
    let more = [("verified?", verified)];
    Form::new("calibrate", "of a platform", and(calibrated(), more))
        .counted()
        .tried()
        .judged()
}

fn verified_as() -> Vec<Member> {
    vec![
        ("as_left?", part("platform-verified").about("Corrected.")),
        (
            "as_found?",
            part("platform-verified").about("Not corrected."),
        ),
    ]
}

fn verified() -> Shape {
    let visited = object([
        ("target", part("pose")),
        ("seen", part("pose")),
        ("error_um", number()),
        ("skew_ms", maybe()),
    ]);
    object([
        ("largest_um", number()),
        ("rms_um", number()),
        ("tolerance_um", number()),
        ("within_tolerance", truth()),
        ("skew_max_ms", maybe()),
        ("poses", list(visited)),
        ("journal", text()),
    ])
}

fn alignment() -> Shape {
    object([
        ("moves", whole()),
        ("open_loop_um", number().about("Off after the first move.")),
        ("left_um", number()),
    ])
}

fn moved() -> Form {
    let screw = object([("axis", text()), ("set_point_mm", number())]);
    let taken_up = object([("axis", text()), ("standard_uncertainty_um", maybe())]);
    let screws = object([
        ("screws", list(screw)),
        ("skew_ms", maybe()),
        ("standard_uncertainty_um", maybe()),
        (
            "taken_up",
            list(taken_up).about("Play that was taken up first."),
        ),
    ]);
    Form::new(
        "move",
        "of a platform",
        [
            ("target", part("pose")),
            (
                "unnamed",
                list(text()).about("Where the camera saw the platform before."),
            ),
            ("seen", part("pose")),
            (
                "calibrations",
                list(several(2, text())).about("Each screw, and what corrected it."),
            ),
            ("corrected", truth()),
            ("move", screws.or_null()),
            ("alignment", part("alignment").or_null()),
        ],
    )
    .counted()
}

/// The patent's means.
fn means() -> Vec<Member> {
    vec![
        ("rows", whole()),
        ("at_m_um", number()),
        ("at_n_um", number()),
        ("mean_at_m_um", number()),
        ("mean_at_m_um_u", maybe()),
        ("mean_at_n_um", number()),
        ("mean_at_n_um_u", maybe()),
        ("slope_um_per_mm", number()),
        ("slope_um_per_mm_u", maybe()),
        ("mean_lost_motion_um", number()),
        ("mean_lost_motion_um_u", maybe()),
        ("harmonics", list(whole())),
        ("residual_um", number()),
        ("scatter_um", maybe()),
        ("degrees_of_freedom", whole().or_null()),
    ]
}

fn leak() -> Shape {
    object([("harmonic", whole()), ("slope_um_per_mm_per_um", number())])
}

fn harmonic() -> Shape {
    object([
        ("harmonic", whole()),
        ("amplitude_um", number()),
        ("amplitude_um_u", maybe()),
        ("phase_deg", number()),
        ("sine_um", number()),
        ("sine_um_u", maybe()),
        ("cosine_um", number()),
        ("cosine_um_u", maybe()),
    ])
}

/// Least squares.
fn fitted() -> Vec<Member> {
    let tested = object([
        ("harmonic", whole()),
        ("p_value", number()),
        ("level", number()),
        ("kept", truth()),
    ]);
    let lack_of_fit = object([
        ("p_value", number()),
        ("significant", truth()),
        ("repeatability_um", number()),
    ]);
    vec![
        ("rows", whole()),
        ("first_stroke_um", number()),
        ("last_stroke_um", number()),
        ("lead_mm", maybe()),
        ("offset_um", number()),
        ("offset_um_u", maybe()),
        ("slope_um_per_mm", number()),
        ("slope_um_per_mm_u", maybe()),
        ("lost_motion_um", number()),
        ("lost_motion_um_u", maybe()),
        ("harmonics", list(harmonic())),
        ("harmonics_tested", list(tested)),
        ("harmonics_not_observable", list(whole())),
        (
            "harmonics_left_out_shift_slope",
            list(part("harmonic-shift")),
        ),
        ("residual_um", number()),
        ("stroke_error_um", number()),
        ("side_error_um", number()),
        ("repeatability_um", number()),
        ("degrees_of_freedom", whole()),
        ("degrees_of_freedom_within", whole()),
        ("lack_of_fit", lack_of_fit.or_null()),
        ("outliers", list(part("stroke-outlier"))),
    ]
}

fn fit() -> Form {
    let saved = || [("calibration?", text().about("With --save."))];
    let screw = one_of([
        object(and(means(), saved())),
        object(and(fitted(), saved())),
    ]);
    Form::new(
        "fit screw",
        "ball screws",
        [("method", text()), ("axes", by_name(screw))],
    )
}

fn plan() -> Form {
    Form::new(
        "plan screw",
        "strokes",
        [
            ("lead_mm", number()),
            ("first_mm", number()),
            ("last_mm", number()),
            ("step_mm", number()),
            ("runs", whole()),
            ("strokes_mm", list(number())),
            ("degrees_of_freedom", whole()),
            ("slope_um_per_mm_per_um_stroke_error", number()),
            ("harmonics_observable", list(whole())),
            ("harmonics_not_observable", list(whole())),
            (
                "harmonics_left_out_shift_slope",
                list(part("harmonic-shift")),
            ),
        ],
    )
}

fn diff() -> Form {
    let change = object([("term", text()), ("unit", text()), ("change", number())]);
    Form::new(
        "cal diff",
        "of screws",
        [("changes", list(change)), ("page?", text())],
    )
}

fn demo() -> Form {
    Form::new(
        "demo",
        "a platform",
        [
            ("as_found", part("platform-verified")),
            ("calibration", part("platform-calibrated")),
            ("as_left", part("platform-verified")),
            ("as_left_after_power_cycle", part("platform-verified")),
            ("alignment", part("alignment")),
            ("report", text()),
            ("wall_s", number()),
        ],
    )
    .judged()
}
