//! `truestage jog`: an axis runs as long as this program says so, or for a time.

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use serde_json::{Value, json};
use units::MetresPerSecond;
use units::text::speed;

use crate::linear::jog::Jogged;
use crate::ports::Use;
use crate::program::MachineArgs;
use crate::program::json::counters;
use crate::program::output::{Ended, Output, with_counters};
use crate::program::session::Session;
use crate::program::span::span_of;
use crate::{Failure, Machine};

/// Which axis, which way, how fast and for how long.
#[derive(Clone, Debug, Args)]
pub(crate) struct JogArgs {
    #[command(flatten)]
    pub(crate) machine: MachineArgs,
    /// How fast, and with its sign which way: `x=2mm/s`, `x=-500um/s`; at most the usual speed of the axis.
    #[arg(value_name = "AXIS=SPEED")]
    target: Option<String>,
    /// End after so long: `2s`, `1.5min`; without it, at the soft limit or with Ctrl-C.
    #[arg(long = "for", value_name = "TIME", value_parser = span_of)]
    span: Option<Duration>,
}

/// What was asked for.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Jog {
    pub(crate) axis: String,
    pub(crate) speed: MetresPerSecond,
    pub(crate) duration: Option<Duration>,
}

impl JogArgs {
    /// `truestage jog x=2mm/s` means `./machine.toml`, as with every verb.
    pub(crate) fn settle(mut self) -> Self {
        let first = self.machine.config.to_string_lossy();
        if self.target.is_none() && first.contains('=') && !self.machine.config.exists() {
            self.target = Some(first.into_owned());
            self.machine.config = PathBuf::from("machine.toml");
        }
        self
    }

    /// # Errors
    /// When it is not said which axis and how fast.
    pub(crate) fn jog(&self) -> Result<Jog, Failure> {
        let text = self.target.as_deref().unwrap_or_default();
        let (axis, speed) = axis_speed(text)?;
        Ok(Jog {
            axis,
            speed,
            duration: self.span,
        })
    }
}

/// `x=-2mm/s`: the unit is never guessed.
fn axis_speed(text: &str) -> Result<(String, MetresPerSecond), Failure> {
    let parts = text.split_once('=').filter(|(axis, _)| !axis.is_empty());
    let read = parts.and_then(|(axis, value)| Some((axis.to_owned(), speed(value)?)));
    let read = read.filter(|(_, speed)| speed.value() != 0.0);
    read.ok_or_else(|| Failure::Usage {
        what: format!("`{text}` is no speed of an axis"),
        help: "write AXIS=SPEED with a sign and a unit: x=2mm/s, x=-500um/s".into(),
    })
}

/// Zeroes the axis and jogs it, on a machine that nobody else has.
pub(crate) fn run(args: &JogArgs, output: Output) -> Ended {
    let jog = args.jog()?;
    let mut session = Session::open(&args.machine, "jog", Use::Motion, output)?;
    let store = session.store.clone();
    let (jogged, counters) = session.machine.guarded(|machine: &mut Machine| {
        machine.start()?;
        machine.linear(&jog.axis)?.check_jog(jog.speed)?;
        machine.linear(&jog.axis)?.zero(&store)?;
        let jogged = machine.linear(&jog.axis)?.jog(jog.speed, jog.duration)?;
        machine.shut_down()?;
        Ok((jogged, counters(&machine.devices().counters())))
    })?;
    let value = with_counters(value(&jog.axis, &jogged), counters);
    output.result(&text(&jog.axis, &jogged), &value)
}

fn text(axis: &str, jogged: &Jogged) -> String {
    let end = match jogged.is_at_limit {
        true => ", at its soft limit",
        false => "",
    };
    let at = jogged.position.mm();
    format!("axis {axis} stands at {at:.6} mm by its encoder{end}")
}

fn value(axis: &str, jogged: &Jogged) -> Value {
    json!({
        "axis": axis,
        "encoder_mm": jogged.position.mm(),
        "at_soft_limit": jogged.is_at_limit,
    })
}

/// What is said of a jog that a service did; `motion` is its end.
pub(crate) fn told(axis: &str, motion: &Value) -> Option<(String, Value)> {
    let stands = motion["axes"][axis]["encoder"]["value"].as_f64()?;
    let jogged = Jogged {
        position: units::Metres::from_mm(stands),
        is_at_limit: motion["state"] == "done",
    };
    Some((text(axis, &jogged), value(axis, &jogged)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_jog_needs_an_axis_a_way_and_a_unit() {
        let (axis, speed) = axis_speed("x=-500um/s").unwrap();
        assert_eq!((axis.as_str(), speed.value()), ("x", -500.0 * 1e-6));
        for text in ["x=2", "x", "=2mm/s", "x=0mm/s", "x=2mm", "x=nanmm/s", ""] {
            let said = axis_speed(text).unwrap_err().to_string();
            assert!(said.contains("x=2mm/s"), "{text}: {said}");
        }
    }
}
