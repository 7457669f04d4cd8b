//! Faults of a machine that a service keeps.

use serde_json::Value;

use super::{Service, refuse};
use crate::Failure;
use crate::program::AxisArgs;
use crate::program::exchange::{ask_on, plain};
use crate::program::output::{Ended, Output};
use crate::program::reset::{AxisReset, meant, told};

/// The state of an axis that a failure stopped.
const STOPPED: &str = "ErrorStop";

impl Service {
    /// Has the service start the machine anew, which acknowledges the fault of every drive; what is told is the axis
    /// that was named, or each that was stopped. Nothing moves.
    pub(crate) fn reset(&self, args: &AxisArgs, output: Output) -> Ended {
        refuse(args.machine.record.is_some(), "--record")?;
        let before = self.axis_states()?;
        let names = before.iter().map(|(name, _)| name.clone()).collect();
        let meant = meant(names, args)?;
        let answer = ask_on(&self.at, "POST", "/v1/reset", "{}")?;
        if answer["warning"].is_string() {
            output.note(&format!("warning: {}", text(&answer["warning"])));
        }
        let both = before.into_iter().zip(self.axis_states()?);
        let resets = both.map(|((axis, before), (_, after))| AxisReset {
            axis,
            before,
            after,
        });
        let is_told = |reset: &AxisReset| match &meant {
            Some(meant) => *meant == reset.axis,
            None => reset.before == STOPPED,
        };
        let resets: Vec<_> = resets.filter(is_told).collect();
        let zero =
            "the service has acknowledged every drive's fault: zero each axis before it moves";
        let (text, value) = told(meant.as_deref(), &resets, zero);
        output.result(&text, &value)
    }

    /// The name of each axis, and what it does.
    fn axis_states(&self) -> Result<Vec<(String, String)>, Failure> {
        let axes = ask_on(&self.at, "GET", "/v1/axes", "")?;
        let axes = axes.as_array().into_iter().flatten();
        let states = axes.map(|axis| (text(&axis["name"]), text(&axis["state"])));
        Ok(states.collect())
    }
}

fn text(value: &Value) -> String {
    plain(value.as_str().unwrap_or_default())
}
