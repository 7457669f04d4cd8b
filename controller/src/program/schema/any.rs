//! What verbs print that are the same for every machine.

use super::form::{Form, Printed};
use super::parts;
use super::shape::{
    Shape, by_name, constant, described_elsewhere, list, number, object, one_of, part, text, truth,
    whole, word,
};

/// Of results that are told in a service's figures.
const UNTOLD: &str = "of a service that has no words of its own";

/// Each form, by what they are about.
pub(super) fn printed() -> Printed {
    let forms = [
        configurations(),
        machines(),
        calibrations(),
        services(),
        files(),
    ];
    Printed {
        forms: forms.into_iter().flatten().collect(),
        parts: parts::all(),
    }
}

fn configurations() -> Vec<Form> {
    let certified = object([
        ("key", text()),
        ("file", text()),
        ("quantity", text()),
        ("certificate", part("certificate").or_null()),
        ("figures", certified_figures().or_null()),
    ]);
    vec![
        Form::new(
            "check",
            "a sound configuration",
            [
                ("ok", constant(true)),
                ("machine", text()),
                ("hash", text().about("What calibrations of it carry.")),
                ("notes", list(text())),
                ("certificates", list(certified)),
                ("warnings", list(part("finding"))),
                (
                    "unfilled",
                    list(part("finding")).about("What is still an example's."),
                ),
            ],
        ),
        Form::new(
            "new",
            "a file that was written",
            [
                ("config", text()),
                ("to_fill_in", list(text()).about("Keys.")),
                ("notes", list(text())),
            ],
        ),
    ]
}

fn certified_figures() -> Shape {
    let row = object([
        ("reading", number()),
        ("correction", number()),
        ("standard_uncertainty", number()),
    ]);
    one_of([
        object([("value", number()), ("standard_uncertainty", number())]),
        object([("points", list(row))]),
    ])
    .about("In SI units, temperatures in degrees Celsius.")
}

fn machines() -> Vec<Form> {
    let checked = object([
        (
            "verdict",
            word(&["ok", "warning", "bad", "-"]).about("-: nobody can tell here."),
        ),
        ("subject", text()),
        ("seen", text()),
        ("fix", text().or_null().about("What to do.")),
    ]);
    let identity = object([
        ("device_type", whole()),
        ("vendor", whole()),
        ("product", whole()),
        ("revision", whole()),
        ("serial", whole()),
        ("name", text()),
    ]);
    let device = object([
        ("port", text()),
        ("node", whole().or_null().about("null on a serial line.")),
        ("name", text().or_null().about("In the configuration.")),
        (
            "identity",
            identity.or_null().about("null where nobody answered."),
        ),
        ("mismatches", list(text())),
    ]);
    let mut forms = vec![
        Form::new(
            "doctor",
            "what stands between this computer and the machine",
            [("checks", list(checked)), ("sound", truth())],
        )
        .judged(),
        Form::new(
            "scan",
            "who is on the buses",
            [("devices", list(device)), ("matches", truth())],
        )
        .judged(),
    ];
    forms.extend(resets());
    forms.extend(["zero", "calibrate", "verify", "move", "jog"].map(dry_run));
    let untold = [
        "zero",
        "calibrate",
        "verify",
        "move",
        "jog",
        "run",
        "reference",
    ];
    forms.extend(untold.map(|verb| Form::new(verb, UNTOLD, [parts::untold()])));
    let each = list(object([parts::untold()]));
    forms.push(Form::new("move", UNTOLD, [("moves", each)]));
    forms
}

/// Of the axis that is named, or of each that had a fault.
fn resets() -> [Form; 2] {
    let state = "The drive's state; where a service keeps the machine, the axis's.";
    let reset = || {
        [
            ("axis", text()),
            ("before", text().about(state)),
            ("after", text()),
        ]
    };
    let each = list(object(reset()));
    [
        Form::new("reset", "a fault that was acknowledged", reset()).counted(),
        Form::new(
            "reset",
            "all faults that were acknowledged",
            [("resets", each)],
        )
        .counted(),
    ]
}

fn dry_run(verb: &'static str) -> Form {
    let what = word(&["zero", "calibration", "calibrate", "verify", "move", "jog"]);
    let step = object([
        ("what", what),
        (
            "whose",
            text().about("An axis, or all of them by what they are."),
        ),
        ("text", text()),
    ]);
    Form::new(
        verb,
        "with --dry-run",
        [
            ("dry_run", constant(true)),
            ("machine", text()),
            ("stage_serial", text()),
            ("hash", text().about("Of the configuration.")),
            ("steps", list(step)),
        ],
    )
}

fn calibrations() -> Vec<Form> {
    let stored = object([
        ("id", text()),
        ("active", truth()),
        ("axis", text()),
        ("kind", text()),
        ("created", text()),
        ("source", text()),
    ]);
    let unread = object([("id", text()), ("error", text())]);
    let record = "The record as it is stored, which has a version of its own.";
    let chosen = |verb| {
        let one = text().or_null();
        let several = by_name(text().or_null());
        let active = one_of([one, several]);
        let active = active.about("What is in use now; by name where that is several.");
        Form::new(
            verb,
            "what is in use from now on",
            [("axis", text().or_null()), ("active", active)],
        )
    };
    vec![
        Form::new(
            "cal list",
            "all calibrations",
            [("calibrations", list(one_of([stored, unread])))],
        ),
        Form::new(
            "cal show",
            "one calibration",
            [("id", text()), ("record", described_elsewhere(record))],
        ),
        chosen("cal activate"),
        chosen("cal rollback"),
        exported(),
        Form::new(
            "cal import",
            "a table that was stored",
            [
                ("calibration", text()),
                ("axis", text()),
                ("positions", whole()),
                ("first_mm", number()),
                ("last_mm", number()),
                ("largest_deviation_um", number()),
                ("active", truth()),
            ],
        )
        .judged(),
    ]
}

fn exported() -> Form {
    let figures = object([
        ("straight_lines_off_um?", number()),
        ("straight_lines_off_arcsec?", number()),
        ("values?", whole()),
        ("counts_for_unit?", number()),
        ("points_min?", whole()),
    ]);
    Form::new(
        "cal export",
        "a table for another control",
        [
            ("calibration", text()),
            ("format", text()),
            ("told", list(text()).about("What its user must know.")),
            ("figures", figures),
            ("text?", text().about("Without --out: the table.")),
            ("out?", text().about("The file.")),
        ],
    )
}

fn services() -> Vec<Form> {
    let of = |resource: &str| {
        described_elsewhere(&format!("`{resource}` of the service's /openapi.json."))
    };
    let event = [
        ("id", whole()),
        ("at", text().about("UTC, RFC 3339.")),
        ("clock_s", number().about("By the machine's clock.")),
        ("kind", text()),
        (
            "of",
            text().about("Which axis, motion or run; empty for the machine."),
        ),
        ("data", described_elsewhere("docs/service.md")),
    ];
    vec![
        Form::new(
            "status",
            "a machine that a service keeps",
            [
                ("machine", of("GET /v1/machine")),
                ("axes", list(of("GET /v1/axes"))),
            ],
        ),
        Form::new("monitor", "an event, an object a line", event),
        Form::new(
            "monitor",
            "events that were missed, by their numbers",
            [("from", whole()), ("to", whole())],
        ),
        Form::new(
            "enable",
            "axes that were switched on",
            [("axes", list(of("POST /v1/axes/{axis}/enable")))],
        ),
        Form::new(
            "disable",
            "axes that were switched off",
            [("axes", list(of("POST /v1/axes/{axis}/disable")))],
        ),
        Form::new("stop", "a stop is under way", [("done", constant(true))]),
        Form::new(
            "token",
            "a token, which is shown only now",
            [
                ("name", text()),
                ("role", word(&["viewer", "operator", "commissioner"])),
                ("token", text()),
                ("file", text().about("What has its hash.")),
            ],
        ),
    ]
}

fn files() -> Vec<Form> {
    let code = object([
        ("kind", text()),
        ("meaning", text()),
        ("cause", text()),
        ("next", text()),
    ]);
    let table = object([
        ("table", text()),
        ("rows", whole()),
        ("columns", list(text())),
        ("file", text()),
    ]);
    let maybe = || number().or_null();
    let compared = object([
        ("name", text()),
        ("unit", text()),
        ("first", maybe()),
        ("second", maybe()),
        ("difference", maybe().about("second - first.")),
    ]);
    let document = || described_elsewhere("JSON Schema, draft 2020-12.");
    vec![
        Form::new("explain", "codes", [("codes", list(code))]),
        Form::new(
            "journal export",
            "a file for each table",
            [("journal", text()), ("tables", list(table))],
        ),
        Form::new(
            "journal export",
            "one file",
            [("journal", text()), ("entries", whole()), ("file", text())],
        ),
        Form::new(
            "report",
            "a page that was written",
            [
                ("report", text().about("The page.")),
                ("figures?", list(compared).about("With --compare.")),
                ("pictures?", list(text()).about("With --svg.")),
            ],
        ),
        Form::new("man", "manual pages", [("folder", text())]),
        Form::new("schema output", "this schema", [("document", document())]),
        Form::new(
            "schema machine",
            "that of a machine's file",
            [("document", document())],
        ),
    ]
}
