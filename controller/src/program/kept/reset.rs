//! Faults of a machine that a service keeps.

use serde_json::{Value, json};

use super::{Service, refuse};
use crate::program::AxisArgs;
use crate::program::exchange::{ask_on, plain};
use crate::program::output::{Ended, Output};
use crate::program::session::choose_axis;

impl Service {
    /// Has the service start the machine anew, which acknowledges the fault of every drive; what is told is the axis
    /// that was named. Nothing moves.
    pub(crate) fn reset(&self, args: &AxisArgs, output: Output) -> Ended {
        refuse(args.machine.record.is_some(), "--record")?;
        let axes = ask_on(&self.at, "GET", "/v1/axes", "")?;
        let names = axes.as_array().into_iter().flatten();
        let names = names.map(|it| plain(it["name"].as_str().unwrap_or_default()));
        let axis = choose_axis(names.collect(), args)?;
        let state = || -> Result<String, crate::Failure> {
            let seen = ask_on(&self.at, "GET", &format!("/v1/axes/{axis}"), "")?;
            Ok(word(&seen["state"]))
        };
        let before = state()?;
        ask_on(&self.at, "POST", "/v1/reset", "{}")?;
        let after = state()?;
        let text = format!(
            "axis {axis}: was in {before}, is now in {after}; the service has acknowledged every drive's fault: zero each axis \
             before it moves"
        );
        let value = json!({"axis": axis, "before": before, "after": after});
        output.result(&text, &value)
    }
}

fn word(state: &Value) -> String {
    plain(state.as_str().unwrap_or("unknown")).replace('_', " ")
}
