//! What a jog is asked for, and what is said of it, whatever kind of axis it is.

use std::time::Duration;

use machine::records::Store;
use serde_json::{Value, json};
use units::{AxisSpeed, LengthOrAngle, Metres, Radians};

use crate::jogging::{Jogged, along};
use crate::{Failure, Machine};

/// What was asked for.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Jog {
    pub(crate) axis: String,
    pub(crate) speed: AxisSpeed,
    pub(crate) duration: Option<Duration>,
}

impl Jog {
    /// As a service is asked for it.
    pub(crate) fn request(&self) -> Value {
        let (value, unit) = match self.speed {
            AxisSpeed::Linear(it) => (it.value() * 1e3, "mm/s"),
            AxisSpeed::Angular(it) => (it.value(), "rad/s"),
        };
        json!({"axis": self.axis, "speed": {"value": value, "unit": unit}})
    }

    /// As a service is told that it is over.
    pub(crate) fn request_of_its_end(&self) -> Value {
        let mut request = self.request();
        request["speed"]["value"] = json!(0.0);
        request
    }
}

/// Jogs a linear axis, whatever else its machine is: starts the machine, finds the zero, and runs.
pub(crate) fn of_linear_axis(
    machine: &mut Machine,
    store: &Store,
    jog: &Jog,
) -> Result<Jogged, Failure> {
    let speed = along(&jog.axis, jog.speed)?;
    machine.linear(&jog.axis)?.check_jog(speed)?;
    machine.start()?;
    machine.linear(&jog.axis)?.zero(store)?;
    machine.linear(&jog.axis)?.jog(speed, jog.duration)
}

pub(crate) fn text(axis: &str, jogged: &Jogged) -> String {
    let end = match (jogged.is_at_end, jogged.position) {
        (false, _) => "",
        (true, LengthOrAngle::Length(_)) => ", at its soft limit",
        (true, LengthOrAngle::Angle(_)) => ", where its drive counts no further",
    };
    format!(
        "axis {axis} stands at {:.6} by its encoder{end}",
        jogged.position
    )
}

pub(crate) fn value(axis: &str, jogged: &Jogged) -> Value {
    match jogged.position {
        LengthOrAngle::Length(it) => json!({
            "axis": axis,
            "encoder_mm": it.mm(),
            "at_soft_limit": jogged.is_at_end,
        }),
        LengthOrAngle::Angle(it) => json!({
            "axis": axis,
            "encoder_deg": it.degrees(),
            "at_last_count": jogged.is_at_end,
        }),
    }
}

/// What is said of a jog that a service did; `motion` is its end.
pub(crate) fn told(axis: &str, motion: &Value) -> Option<(String, Value)> {
    let encoder = &motion["axes"][axis]["encoder"];
    let stands = encoder["value"].as_f64()?;
    let jogged = Jogged {
        position: match encoder["unit"].as_str()? {
            "deg" => Radians::from_degrees(stands).into(),
            _ => Metres::from_mm(stands).into(),
        },
        is_at_end: motion["state"] == "done",
    };
    Some((text(axis, &jogged), value(axis, &jogged)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_service_that_jogged_a_table_is_told_of_in_degrees() {
        let motion =
            json!({"state": "done", "axes": {"c": {"encoder": {"value": 370.5, "unit": "deg"}}}});
        let (text, value) = told("c", &motion).unwrap();
        assert!(text.contains("370.5000000°"), "{text}");
        assert_eq!(value["at_last_count"], true, "{value}");
        assert!((value["encoder_deg"].as_f64().unwrap() - 370.5).abs() < 1e-9);
    }
}
