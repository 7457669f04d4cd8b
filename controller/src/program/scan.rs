//! `truestage scan`.

use machine::Found;
use serde_json::json;

use crate::Failure;
use crate::ports::Use;
use crate::program::MachineArgs;
use crate::program::output::{Ended, Output};
use crate::program::session::Session;

pub(crate) fn run(args: &MachineArgs, output: Output) -> Ended {
    let mut session = Session::open(args, "scan", Use::Measurement, output)?;
    let found = session.machine.scan()?;
    let lines: Vec<_> = found.iter().map(line).collect();
    let values: Vec<_> = found.iter().map(value).collect();
    let wrong = found.iter().filter(|it| !it.mismatches.is_empty()).count();
    let value = json!({"devices": values, "matches": wrong == 0});
    if wrong == 0 {
        return output.result(&lines.join("\n"), &value);
    }
    output.bad_result(&lines.join("\n"), value, Failure::ScanMismatch { wrong })
}

fn line(found: &Found) -> String {
    let node = found
        .node
        .map_or(String::new(), |node| format!(" node {node}"));
    let name = found.name.as_deref().unwrap_or("?");
    let identity = match &found.identity {
        None => String::new(),
        Some(it) if found.node.is_none() => it.name.clone(),
        Some(it) => format!(
            "type {:#010X} vendor {:#X} product {:#X} revision {:#X} serial {}",
            it.device_type, it.vendor, it.product, it.revision, it.serial
        ),
    };
    let verdict = if found.mismatches.is_empty() {
        "ok"
    } else {
        "!!"
    };
    let mut text = format!("{verdict} {}{node:<9} {name:<8} {identity}", found.port);
    for mismatch in &found.mismatches {
        text += &format!("\n     {mismatch}");
    }
    text
}

fn value(found: &Found) -> serde_json::Value {
    let identity = found.identity.as_ref().map(|it| {
        json!({"device_type": it.device_type, "vendor": it.vendor, "product": it.product,
               "revision": it.revision, "serial": it.serial, "name": it.name})
    });
    json!({"port": found.port, "node": found.node, "name": found.name, "identity": identity,
           "mismatches": found.mismatches})
}
