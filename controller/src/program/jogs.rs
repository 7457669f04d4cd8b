//! What a jog is asked for, and what is said of it, whatever kind of axis it is.

use std::time::Duration;

use machine::records::Store;
use serde_json::{Value, json};
use units::{AxisSpeed, LengthOrAngle, Metres, Radians, ShortSpan};

use crate::jogging::{Jogged, along};
use crate::ports::Use;
use crate::program::intended::Step;
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

fn of_linear_axis(machine: &mut Machine, store: &Store, jog: &Jog) -> Result<Jogged, Failure> {
    let speed = along(&jog.axis, jog.speed)?;
    machine.start()?;
    machine.linear(&jog.axis)?.zero(store)?;
    machine.linear(&jog.axis)?.jog(speed, jog.duration)
}

fn check_of_linear_axis(machine: &mut Machine, jog: &Jog) -> Result<(), Failure> {
    let speed = along(&jog.axis, jog.speed)?;
    machine.linear(&jog.axis)?.check_jog(speed)
}

/// How a kind jogs.
pub(crate) struct Jogs {
    /// Refuses what makes no sense; the machine is not asked.
    pub(crate) check: fn(&mut Machine, &Jog) -> Result<(), Failure>,
    /// Starts the machine, finds the zero, and jogs.
    pub(crate) run: fn(&mut Machine, &Store, &Jog) -> Result<Jogged, Failure>,
    /// What the machine is opened for: what the zero needs.
    pub(crate) purpose: Use,
    /// What has to have its zero, where that is not the axis by itself.
    pub(crate) zeroed: Option<&'static str>,
    /// What says where it stands.
    pub(crate) by: &'static str,
    /// Where a jog ends by itself, and how that is called in what is printed for programs.
    pub(crate) end: (&'static str, &'static str),
}

impl Jogs {
    /// Of a linear axis, whatever else its machine is.
    pub(crate) const OF_A_LINEAR_AXIS: Self = Self {
        check: check_of_linear_axis,
        run: of_linear_axis,
        purpose: Use::Motion,
        zeroed: None,
        by: "its encoder",
        end: ("at its soft limit", "at_soft_limit"),
    };

    /// The jog itself, as it is said beforehand.
    pub(crate) fn step(&self, jog: &Jog) -> Step {
        let (speed, unit) = match jog.speed {
            AxisSpeed::Linear(it) => (it.value() * 1e3, "mm/s"),
            AxisSpeed::Angular(it) => (it.value().to_degrees(), "°/s"),
        };
        let speed = format!("{speed:.6}");
        let speed = speed.trim_end_matches('0').trim_end_matches('.');
        let until = match jog.duration {
            Some(span) => format!("for {}", ShortSpan(span)),
            None => "until Ctrl-C".to_owned(),
        };
        let text = format!(
            "at {speed} {unit} {until} or until it is {}, whichever comes first; NOT CORRECTED: by {} alone",
            self.end.0, self.by
        );
        Step::new("jog", &jog.axis, text)
    }

    pub(crate) fn text(&self, axis: &str, jogged: &Jogged) -> String {
        let end = match jogged.is_at_end {
            true => format!(", {}", self.end.0),
            false => String::new(),
        };
        let (at, by) = (jogged.position, self.by);
        format!("axis {axis} stands at {at:.6} by {by}{end}")
    }

    pub(crate) fn value(&self, axis: &str, jogged: &Jogged) -> Value {
        let (unit, at) = match jogged.position {
            LengthOrAngle::Length(it) => ("encoder_mm", it.mm()),
            LengthOrAngle::Angle(it) => ("encoder_deg", it.degrees()),
        };
        json!({"axis": axis, unit: at, self.end.1: jogged.is_at_end})
    }

    /// What is said of a jog that a service did; `motion` is its end.
    pub(crate) fn told(&self, axis: &str, motion: &Value) -> Option<(String, Value)> {
        let encoder = &motion["axes"][axis]["encoder"];
        let stands = encoder["value"].as_f64()?;
        let jogged = Jogged {
            position: match encoder["unit"].as_str()? {
                "deg" => Radians::from_degrees(stands).into(),
                _ => Metres::from_mm(stands).into(),
            },
            is_at_end: motion["state"] == "done",
        };
        Some((self.text(axis, &jogged), self.value(axis, &jogged)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_service_that_jogged_a_table_is_told_of_in_degrees() {
        let motion =
            json!({"state": "done", "axes": {"c": {"encoder": {"value": 370.5, "unit": "deg"}}}});
        let table = Jogs {
            end: ("at its end", "at_last_count"),
            ..Jogs::OF_A_LINEAR_AXIS
        };
        let (text, value) = table.told("c", &motion).unwrap();
        assert!(text.contains("370.5000000°"), "{text}");
        assert_eq!(value["at_last_count"], true, "{value}");
        assert!((value["encoder_deg"].as_f64().unwrap() - 370.5).abs() < 1e-9);
    }
}
