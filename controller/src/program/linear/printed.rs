//! What the verbs of linear axes print with `--json`.

use crate::program::schema::form::{Form, Printed};
use crate::program::schema::parts::{
    approach, budget, figure_members, figures, means_members, one_way_members,
};
use crate::program::schema::shape::{
    Member, Shape, and, constant, list, number, object, part, several, text, truth, whole, word,
};

pub(crate) fn printed() -> Printed {
    let forms = [cycle(), moves(), jobs(), data(), vec![demo()]];
    Printed {
        forms: forms.into_iter().flatten().collect(),
        parts: vec![
            ("combined", combined()),
            ("linear-zero", object(zero())),
            ("hall-zero", object(hall_zero())),
            ("linear-verified", object(verified())),
            ("linear-moved", object(moved())),
        ],
    }
}

fn maybe() -> Shape {
    number().or_null()
}

/// An uncertainty of a place.
fn combined() -> Shape {
    object([
        ("standard_um", number()),
        ("expanded_um", number()),
        ("coverage_factor", number()),
        (
            "degrees_of_freedom",
            maybe().about("null: infinitely many."),
        ),
    ])
}

/// A zero from the Hall sensors.
fn hall_zero() -> Vec<Member> {
    vec![
        ("origin_um", number()),
        ("origin_um_u", number()),
        ("patent_p0_um", maybe()),
        ("left_flank_um", number()),
        ("right_flank_um", number()),
        ("peak_max_v", number()),
        ("mid_voltage_v", number()),
        ("residual_rms_peak_mv", number()),
        ("residual_rms_slope_mv", number()),
        ("points", whole()),
        ("lost_motion_um", maybe()),
        ("pass_scatter_um", maybe()),
        ("degrees_of_freedom", maybe()),
    ]
}

fn zero() -> Vec<Member> {
    let held = || {
        object([
            ("position_um", number()),
            ("peak_v", number()),
            ("slope_v", number()),
        ])
    };
    let search = object([
        (
            "g7",
            object([("position_um", number()), ("peak_v", number())]),
        ),
        ("g1_p1", held()),
        ("g2_p2", held()),
        ("g8_p0", held()),
    ]);
    let flat = object([("steepness", number()), ("linearity", number())]);
    let drift = object([("peak_mv", number()), ("slope_mv", number())]);
    vec![
        ("axis", text()),
        ("zero", part("hall-zero")),
        ("uncertainty", budget([("expanded_um", number())])),
        ("flat_level", flat.or_null()),
        (
            "search",
            search.about("In the drive's coordinates before the origin became zero."),
        ),
        ("drift_since_last", drift.or_null()),
        ("journal", text()),
    ]
}

fn gantry() -> Vec<Member> {
    let rotation = object([
        ("angle_urad", number()),
        ("standard_uncertainty_urad", number()),
        ("degrees_of_freedom", maybe()),
        ("ahead_when_positive", text()),
        ("distance_mm", number()),
        ("distance_standard_uncertainty_mm", number()),
        ("scale_standard_uncertainty_ppm", number()),
        ("angle_at_acceptance_urad", maybe()),
        ("change_since_acceptance_urad", maybe()),
        ("angle_limit_urad", maybe()),
        ("within_limit", truth()),
        ("change_since_last_urad", maybe()),
        ("zero_standard_uncertainty_urad", number()),
    ]);
    vec![
        ("gantry", text()),
        ("rotation", rotation),
        ("sides", list(part("linear-zero"))),
        ("journal", text()),
    ]
}

/// An error table: deviations, actual − target.
fn table() -> Vec<Member> {
    let sides = || object([("forward", maybe()), ("reverse", maybe())]);
    let node = object([
        ("position_mm", number()),
        ("deviation_um", sides().about("actual - target")),
        ("standard_uncertainty_um", sides()),
    ]);
    let outlier = object([
        ("run", whole()),
        ("approach", approach()),
        ("target_mm", number()),
        ("residual_um", number()),
    ]);
    vec![
        ("lost_motion_um", maybe()),
        ("lost_motion_um_u", maybe()),
        ("largest_deviation_um", number()),
        ("nodes", list(node)),
        ("outliers", list(outlier)),
        ("outlier_share", number()),
    ]
}

fn table_budget() -> Shape {
    budget([
        ("position_mm", number()),
        ("approach", approach()),
        ("expanded_um", number()),
    ])
}

fn calibrated() -> Vec<Member> {
    let drift = [("drift_um", maybe()), ("drift_um_u", maybe())];
    vec![
        ("calibration", text()),
        ("active", truth()),
        ("path", text()),
        ("journal", text()),
        ("closure_um", maybe()),
        ("fit", object(and(table(), drift))),
        ("wrong_position_noticed_um", maybe()),
        ("uncertainty", table_budget()),
        ("verified?", part("linear-verified").about("With --verify.")),
    ]
}

fn verified() -> Vec<Member> {
    let uncertain = || part("combined").or_null();
    let target = object([
        ("target_mm", number()),
        ("forward", uncertain()),
        ("reverse", uncertain()),
    ]);
    vec![
        ("axis", text()),
        ("as_left?", figures().about("Corrected.")),
        ("as_found?", figures().about("Not corrected.")),
        ("closure_um", maybe()),
        ("tolerance_um", number()),
        ("within_tolerance", truth()),
        (
            "warning",
            text()
                .or_null()
                .about("That it is within its tolerance, and too uncertain to show it."),
        ),
        (
            "uncertainty",
            list(target).about("Of the corrected position; null where it is not stated."),
        ),
        ("journal", text()),
    ]
}

fn cycle() -> Vec<Form> {
    vec![
        Form::new("zero", "of a linear axis", zero()).counted(),
        Form::new("zero", "of a gantry", gantry())
            .counted()
            .judged(),
        Form::new("calibrate", "of a linear axis", calibrated())
            .counted()
            .tried()
            .judged(),
        Form::new("verify", "of a linear axis", verified())
            .counted()
            .judged(),
    ]
}

fn moved() -> Vec<Member> {
    let corrected = word(&["no", "yes", "held", "fading"]);
    vec![
        ("axis", text()),
        ("target_mm", number()),
        ("set_point_mm", number()),
        ("encoder_mm", number()),
        (
            "place_mm",
            maybe().about("Where the point stands, corrected."),
        ),
        ("uncertainty", part("combined").or_null()),
        ("calibration", text().or_null()),
        (
            "corrected",
            corrected.about("held, fading: beyond the calibrated range."),
        ),
        ("beyond_calibrated_mm", several(2, number()).or_null()),
        ("warning", text().or_null()),
    ]
}

fn moves() -> Vec<Form> {
    vec![
        Form::new(
            "move",
            "of linear axes",
            [("moves", list(part("linear-moved")))],
        ),
        Form::new(
            "jog",
            "of a linear axis",
            [
                ("axis", text()),
                ("encoder_mm", number()),
                ("at_soft_limit", truth()),
            ],
        )
        .counted(),
    ]
}

/// Between two calibrated positions.
fn interval() -> Shape {
    let interval = several(2, number()).or_null();
    interval.about("null beyond the calibrated range.")
}

fn jobs() -> Vec<Form> {
    let of_point = [
        ("repetition", whole()),
        ("number", whole()),
        ("name", text()),
        ("approach", approach()),
        ("interval_mm", interval()),
    ];
    let planned = object([
        ("name", text()),
        ("target_mm", number()),
        ("interval_mm", interval()),
        ("approach", approach()),
        ("set_point_mm", number()),
        ("uncertainty", part("combined").or_null()),
        ("warning", text().or_null()),
    ]);
    let goes_on = object([
        ("repetition", whole()),
        ("number", whole()),
        ("journal", text()),
    ]);
    let judged = [
        ("axis", text()),
        ("dry_run", constant(true)),
        ("calibration", text()),
        ("repetitions", whole()),
        ("points", list(planned)),
        ("goes_on", goes_on.or_null()),
    ];
    vec![
        Form::new(
            "run",
            "a job",
            [
                ("axis", text()),
                ("calibration", text()),
                ("repetitions", whole()),
                (
                    "points_before",
                    whole().about("Reached before an interruption."),
                ),
                ("points", list(object(and(moved(), of_point)))),
                ("journal", text()),
            ],
        )
        .counted(),
        Form::new("run", "a job with --dry-run", judged.clone()),
        Form::new("plan path", "a job", judged),
    ]
}

fn data() -> Vec<Form> {
    let fitted = [
        ("closure_um", maybe()),
        ("closure_um_u", maybe()),
        ("wrong_position_noticed_um", maybe()),
        ("stands_off", text().or_null()),
        ("calibration?", text().about("With --save.")),
        ("uncertainty?", table_budget()),
    ];
    let change = object([
        ("position_mm", number()),
        ("forward_um", maybe()),
        ("reverse_um", maybe()),
    ]);
    vec![
        Form::new("fit linear", "an error table", and(table(), fitted)),
        Form::new("fit hall", "a zero", hall_zero()),
        plan_zero(),
        Form::new("iso230", "of both directions", figure_members()),
        Form::new("iso230", "of one direction", one_way_members()),
        Form::new("iso230", "of single measurements", means_members()),
        Form::new(
            "cal diff",
            "of linear axes",
            [("changes", list(change)), ("page?", text())],
        ),
    ]
}

fn plan_zero() -> Form {
    let level = || {
        object([
            ("level_below_peak_v", number()),
            ("flanks_mm", several(2, number())),
            ("steepness", number()),
            ("linearity", number()),
            ("rail_margin_v", number()),
            ("standard_uncertainty_um", number()),
            ("fits", truth()),
        ])
    };
    let zero = object([
        ("level_below_peak_v", number()),
        ("turn_below_peak_v", number()),
        ("delta1_mv", number()),
        ("delta2_mv", number()),
        ("delta3_mv", number()),
        ("delta4_mv", number()),
        ("noise_mv", number()),
    ]);
    Form::new(
        "plan zero",
        "a zero search",
        [
            ("axis", text()),
            ("sweep", text()),
            ("passes", whole()),
            ("zero", zero.about("For [axis.NAME.zero].")),
            ("depth_v", number()),
            ("steepest_v_per_mm", number()),
            ("centre_slope_v_per_mm", number()),
            ("proposed", level()),
            ("configured", level().or_null()),
            ("levels", list(level())),
        ],
    )
    .counted()
}

fn demo() -> Form {
    let cycle = object([
        ("shift_nm", number()),
        ("standard_uncertainty_nm", number()),
        ("single_threshold_shift_um", maybe()),
    ]);
    Form::new(
        "demo",
        "a linear axis",
        [
            ("as_found", figures()),
            ("as_left", figures()),
            ("as_left_after_power_cycles", figures()),
            ("as_found_largest_deviation_um", number()),
            ("zero", part("hall-zero")),
            ("power_cycles", list(cycle)),
            ("calibration", object([("id", text()), ("path", text())])),
            ("report", text()),
            ("wall_s", number()),
        ],
    )
    .judged()
}
