//! `truestage status` and `truestage stop`: questions to a service that keeps a machine.

use std::fmt::Write as _;

use machine::records::short;
use serde_json::{Value, json};

use crate::Failure;
use crate::program::exchange::{ask, plain, urgently};
use crate::program::output::{Ended, Output};
use crate::program::{PowerArgs, ServiceArgs};

/// What the machine and its axes are.
pub(crate) fn status(args: &ServiceArgs, output: Output) -> Ended {
    let (machine, axes) = urgently(&args.place()?, |at| {
        let machine = ask(at, "GET", "/v1/machine", "")?;
        Ok((machine, ask(at, "GET", "/v1/axes", "")?))
    })?;
    let text = text_of(&machine, &axes);
    output.result(&text, &json!({"machine": machine, "axes": axes}))
}

/// Everything stops.
pub(crate) fn stop(args: &ServiceArgs, quick: bool, output: Output) -> Ended {
    let mode = if quick { "quick" } else { "controlled" };
    let body = json!({"mode": mode}).to_string();
    let answer = urgently(&args.place()?, move |at| ask(at, "POST", "/v1/stop", &body))?;
    output.result(&format!("a {mode} stop is under way"), &answer)
}

/// Switches axes on or off: the one that is named, or all of them.
pub(crate) fn power(args: &PowerArgs, on: bool, output: Output) -> Ended {
    let at = args.service.place()?;
    let axes = ask(&at, "GET", "/v1/axes", "")?;
    let there: Vec<&str> = axes
        .as_array()
        .into_iter()
        .flatten()
        .filter_map(|it| it["name"].as_str())
        .collect();
    let names = match args.axis.as_deref() {
        None => there,
        Some(axis) if there.contains(&axis) => vec![axis],
        Some(axis) => {
            return Err(Failure::Usage {
                what: format!("there is no axis `{axis}`"),
                help: format!("this machine has {}", there.join(", ")),
            });
        }
    };
    let (verb, is) = if on {
        ("enable", "on")
    } else {
        ("disable", "off")
    };
    // One that is in use keeps nobody from the others: whoever asks wants his hands in the machine.
    let (mut switched, mut refused) = (Vec::new(), None);
    for name in &names {
        match ask(&at, "POST", &format!("/v1/axes/{name}/{verb}"), "{}") {
            Ok(axis) => switched.push((*name, axis)),
            Err(failure) => {
                refused.get_or_insert(failure);
            }
        }
    }
    let lines = switched
        .iter()
        .map(|(name, _)| format!("axis {} is {is}", plain(name)));
    let text = lines.collect::<Vec<_>>().join("\n");
    match refused {
        None => {
            let axes: Vec<&Value> = switched.iter().map(|it| &it.1).collect();
            output.result(&text, &json!({"axes": axes}))
        }
        Some(failure) => {
            output.note(&text);
            Err(failure)
        }
    }
}

fn text_of(machine: &Value, axes: &Value) -> String {
    let word = |value: &Value| plain(value.as_str().unwrap_or("unknown"));
    let mut text = format!(
        "machine {} ({}): {}",
        word(&machine["name"]),
        word(&machine["stage_serial"]),
        word(&machine["state"])
    );
    if let Some(cause) = machine["cause"]["cause"].as_str() {
        text += &format!(", {}", plain(cause));
    }
    if let Some(name) = machine["lease"]["name"].as_str() {
        text += &format!("\nlease: {}", plain(name));
    }
    for axis in axes.as_array().into_iter().flatten() {
        // To write into a text cannot fail.
        let _ = write!(
            text,
            "\naxis {}: {}",
            word(&axis["name"]),
            word(&axis["state"])
        );
        text += &place_of(axis);
        if let Some(id) = axis["calibration"].as_str() {
            text += &format!(", calibration {}", plain(&short(id)));
            if let Some(created) = axis["calibration_created"].as_str() {
                text += &format!(" of {}", plain(created));
            }
        }
        if let Some(id) = axis["used_by"].as_str() {
            text += &format!(", in use by {}", plain(id));
        }
    }
    text
}

fn place_of(axis: &Value) -> String {
    let Some(place) = axis["position"]["value"].as_f64() else {
        return String::new();
    };
    let unit = |name: &str, usual: &str| match axis[name]["unit"].as_str() {
        Some("um") | None => usual.to_owned(),
        Some(unit) => plain(unit),
    };
    let homed = if axis["homed"] == true {
        ""
    } else {
        ", NOT ZEROED"
    };
    let by = match (
        axis["corrected"] == true,
        axis["standard_uncertainty"]["value"].as_f64(),
    ) {
        (true, Some(u)) => {
            let unit = unit("standard_uncertainty", "µm");
            format!(" (corrected, U = {:.3} {unit}, k = 2)", 2.0 * u)
        }
        (true, None) => " (corrected)".into(),
        (false, _) => " (by its encoder)".into(),
    };
    format!(" at {place:.6} {}{by}{homed}", unit("position", "mm"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_status_says_what_an_operator_needs_and_nothing_that_a_terminal_obeys() {
        let machine = json!({"name": "linear", "stage_serial": "TS\u{1b}[31m", "state": "error_stop",
                             "cause": {"cause": "x: \u{7}fault"}, "lease": {"name": "anna"}});
        let axes = json!([
            {"name": "x", "state": "Standstill", "position": {"value": 12.5}, "homed": true, "corrected": true,
             "standard_uncertainty": {"value": 0.1234}, "calibration": "0123456789abcdef",
             "calibration_created": "2026-03-01T08:00:00Z", "used_by": "m1-2"},
            {"name": "y", "state": "Disabled", "position": {"value": -1.0}, "homed": false, "corrected": false},
        ]);
        let text = text_of(&machine, &axes);
        assert_eq!(
            text,
            "machine linear (TS[31m): error_stop, x: fault\nlease: anna\naxis x: Standstill at 12.500000 mm \
             (corrected, U = 0.247 µm, k = 2), calibration 0123456789ab of 2026-03-01T08:00:00Z, in use by m1-2\n\
             axis y: Disabled at -1.000000 mm (by its encoder), NOT ZEROED"
        );
    }
}
