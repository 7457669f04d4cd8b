//! `truestage doctor`: what stands between this computer and a machine, a line for each check, with what to do.
//!
//! Nothing is sent to any device: files of the kernel are read, and the buses are listened to.

mod checked;
mod host;
mod listen;
mod ports;
mod records;
mod wall_clock;

use serde_json::json;

use crate::Failure;
use crate::config;
use crate::ports::{Overrides, Use, endpoints};
use crate::program::MachineArgs;
use crate::program::output::{Ended, Output};
use checked::{Checked, Verdict};
use host::Host;
use wall_clock::Moment;

pub(crate) fn run(args: &MachineArgs, output: Output) -> Ended {
    let loaded = config::load(&args.config)?;
    let overrides = Overrides::parse(&args.ports, &loaded.config)?;
    let before = Moment::now();
    let host = Host::this();
    let store = loaded.config.machine.store();
    let endpoints = endpoints(&loaded.config, &overrides, Use::Measurement);
    let mut checks = host.checks();
    checks.extend(records::folder(store.root()));
    checks.extend(ports::checks(&host, &loaded.config, &endpoints));
    checks.extend(records::calibrations(&loaded.config, &store));
    let is_reachable = checks.iter().all(|it| it.verdict != Verdict::Bad);
    let owner = records::owner(&store);
    let not_heard = |why: &str| {
        vec![Checked::not_told(
            "buses",
            format!("not listened to: {why}"),
        )]
    };
    let heard = match (is_reachable, &owner) {
        (true, None) => listen::checks(args, &loaded, &overrides)?,
        (true, Some(_)) => not_heard("another program uses the machine"),
        (false, _) => not_heard("what is wrong above comes first"),
    };
    checks.extend(owner.into_iter().chain(heard));
    checks.push(wall_clock::check(&host, &loaded.config, &store, before));
    told(&checks, output)
}

fn told(checks: &[Checked], output: Output) -> Ended {
    let lines: Vec<String> = checks.iter().map(Checked::line).collect();
    let values: Vec<_> = checks.iter().map(Checked::value).collect();
    let wrong = checks.iter().filter(|it| it.verdict == Verdict::Bad);
    let wrong = wrong.count();
    let value = json!({"checks": values, "sound": wrong == 0});
    match wrong {
        0 => output.result(&lines.join("\n"), &value),
        wrong => output.bad_result(&lines.join("\n"), value, Failure::Unfit { wrong }),
    }
}
