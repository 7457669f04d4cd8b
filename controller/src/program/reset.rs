//! `truestage reset`: a fault of a drive is acknowledged.

use serde_json::json;
use wire::cia402::PowerState;

use crate::ports::Use;
use crate::program::AxisArgs;
use crate::program::json as to_json;
use crate::program::output::{Ended, Output};
use crate::program::session::{Session, choose_axis};

/// Acknowledges a drive's fault; nothing moves.
pub(crate) fn run(args: &AxisArgs, output: Output) -> Ended {
    let mut session = Session::open(&args.machine, "reset", Use::Motion, output)?;
    let mut names = session.machine.devices().axis_names();
    names.extend(session.machine.devices().rotary_names());
    let axis = choose_axis(names, args)?;
    let (before, after, counters) = session.machine.guarded(|machine| {
        // Whatever is marked in its file: nothing moves, and it has nothing to forget.
        machine.core.start()?;
        let before = machine.power_state(&axis)?;
        machine.reset_fault(&axis)?;
        let after = machine.power_state(&axis)?;
        machine.shut_down()?;
        Ok((
            before,
            after,
            to_json::counters(&machine.devices().counters()),
        ))
    })?;
    let word = |state: Option<PowerState>| state.map_or("unknown".into(), |it| it.to_string());
    let text = format!(
        "axis {axis}: was in {}, is now in {}; zero it before it moves",
        word(before),
        word(after)
    );
    let value = json!({"axis": axis, "before": word(before), "after": word(after),
                       "counters": counters});
    output.result(&text, &value)
}
