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
        let all = || axes.as_array().into_iter().flatten();
        let axis = choose_axis(all().map(|it| text(&it["name"])).collect(), args)?;
        let seen = all().find(|it| text(&it["name"]) == axis);
        let before = seen.map_or_else(String::new, |it| text(&it["state"]));
        ask_on(&self.at, "POST", "/v1/reset", "{}")?;
        let seen = ask_on(&self.at, "GET", &format!("/v1/axes/{axis}"), "")?;
        let after = text(&seen["state"]);
        let told = format!(
            "axis {axis}: was in {before}, is now in {after}; the service has acknowledged every drive's fault: zero each axis \
             before it moves"
        );
        let value = json!({"axis": axis, "before": before, "after": after});
        output.result(&told, &value)
    }
}

fn text(value: &Value) -> String {
    plain(value.as_str().unwrap_or_default())
}
