//! Calibrations of a machine that a service keeps: what was stored is told, whatever becomes of its verification.

use machine::Stage;
use serde_json::{Value, json};

use super::{Seen, Service, Waiting, bad_result_of, refuse, told_of, words_of};
use crate::program::CalibrateArgs;
use crate::program::answering::Asked;
use crate::program::exchange::plain;
use crate::program::output::{Ended, Output};
use crate::program::rotary::readings::only_for_driven;
use crate::program::tried::{Cut, Made};
use crate::runs::Told;
use crate::{Failure, config};

impl Service {
    pub(crate) fn calibrate(
        &self,
        args: &CalibrateArgs,
        asked: Vec<&'static Asked>,
        output: Output,
    ) -> Ended {
        if !args.readings.is_empty() {
            only_for_driven(args.verify)?;
            let request = json!({"accept_drift": args.accept_drift, "aside": args.no_activate});
            let resume = args.resume.as_ref();
            return self.by_readings(
                (Stage::Calibrate, request),
                &args.axis,
                (&args.readings, resume),
                output,
            );
        }
        if args.resume.is_some() {
            // The run goes on as it was asked for.
            refuse(args.no_activate, "--no-activate with --resume")?;
            refuse(args.verify, "--verify with --resume")?;
            refuse(args.accept_drift, "--accept-drift with --resume")?;
            refuse(args.warm_up_min.is_some(), "--warm-up-min with --resume")?;
        }
        let stop = self.prepare(&args.axis, output)?;
        let request = json!({
            "axis": args.axis.axis,
            "accept_drift": args.accept_drift,
            "warm_up_min": args.warm_up_min,
            "aside": args.no_activate,
            "verify": args.verify,
        });
        let resume = args.resume.as_deref();
        let waiting = Waiting::of(&args.axis, &args.ask, &stop, output);
        let waiting = waiting.who_asks(asked);
        let seen = self.seen(Stage::Calibrate, request, resume, waiting)?;
        match not_verified(args, &seen.last)? {
            Some(told) => bad_result(told, seen, output),
            None => told_of(&seen.good()?, output),
        }
    }
}

/// What is told of a calibration whose verification did not come to figures; `None` of one that ended in another way.
fn not_verified(args: &CalibrateArgs, run: &Value) -> Result<Option<Told>, Failure> {
    let text = |value: &Value| plain(value.as_str().unwrap_or_default());
    let stored = run["stored"].as_array().into_iter().flatten();
    let stored = stored.map(|it| (text(&it["of"]), text(&it["calibration"])));
    let stored: Vec<_> = stored.collect();
    let (said, value) = words_of(run);
    let is_good = run["state"] == "done" && run["out_of_tolerance"].is_null();
    if stored.is_empty() || is_good || value["verified"].is_object() {
        return Ok(None);
    }
    let machine = &args.axis.machine;
    let made = Made {
        told: Told { text: said, value },
        // The service's own: its lease was found there.
        store: config::load(&machine.config)?.config.machine.store(),
        group: text(&run["of"]),
        stored,
    };
    let of = (&*machine.config, args.axis.axis.as_deref());
    Ok(Some(made.standing(&cut_of(run), of)))
}

/// A service does not go on with a verification that was stopped: it is made anew.
fn cut_of(run: &Value) -> Cut {
    let is_stopped = run["state"] == "stopped" || run["out_of_tolerance"]["code"] == "stopped";
    match (is_stopped, run["made_worse"] == true) {
        (true, _) => Cut::Stopped(None),
        (false, true) => Cut::Worse,
        (false, false) => Cut::Failed,
    }
}

fn bad_result(told: Told, seen: Seen, output: Output) -> Ended {
    match seen.bad.or_else(|| bad_result_of(&seen.last)) {
        Some(failure) => output.bad_result(&told.text, told.value, failure),
        None => output.result(&told.text, &told.value),
    }
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use clap::Parser as _;

    use super::*;
    use crate::program::{Cli, Command};

    const ID: &str = "0123456789abcdef0123456789abcdef";

    fn told(run: &Value) -> Option<Told> {
        let config =
            PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../configs/machines/linear.toml");
        let config = config.display().to_string();
        let words = ["truestage", "calibrate", &config, "--verify"];
        let Command::Calibrate(args) = Cli::parse_from(words).command else {
            panic!("another verb");
        };
        not_verified(&args, run).unwrap_or_else(|failure| panic!("{failure}"))
    }

    /// A run that has stored something and ended so.
    fn run(ended: &Value) -> Value {
        let mut run = json!({
            "of": "x",
            "stored": [{"of": "x", "calibration": ID}],
            "told": {"text": "made", "value": {"in_use": true}},
        });
        for (name, value) in ended.as_object().expect("an object") {
            run[name] = value.clone();
        }
        run
    }

    #[track_caller]
    fn check(ended: &Value, says: &str, word: &str) {
        let told = told(&run(ended)).expect("it was not verified");
        assert!(
            told.text.starts_with(&format!("made\n{says}")),
            "{}",
            told.text
        );
        // It was stored elsewhere.
        let stored = "x: 0123456789ab is NOT IN USE, stored in ";
        assert!(told.text.contains(stored), "{}", told.text);
        assert_eq!(told.value["verification"]["ended"], word);
        assert_eq!(told.value["in_use"], false);
    }

    #[test]
    fn what_a_service_stored_and_did_not_verify_is_told_as_without_one() {
        let stopped = json!({"state": "stopped"});
        check(
            &stopped,
            "NOT VERIFIED: its verification was stopped",
            "stopped",
        );
        let failed = json!({"state": "failed", "cause": {"code": "beam"}});
        check(&failed, "NOT VERIFIED: its verification failed", "failed");
        let refused = json!({"state": "done", "out_of_tolerance": {"code": "refused"}});
        check(&refused, "NOT VERIFIED: its verification failed", "failed");
        let worse = json!({"state": "done", "made_worse": true, "out_of_tolerance": {}});
        check(&worse, "NOT GOOD", "worse");
    }

    #[test]
    fn what_was_verified_or_never_stored_is_told_as_it_is() {
        assert_eq!(told(&run(&json!({"state": "done"}))), None);
        let stopped = json!({"state": "stopped", "stored": []});
        assert_eq!(told(&run(&stopped)), None);
        let judged = json!({
            "state": "done",
            "out_of_tolerance": {"code": "out_of_tolerance"},
            "told": {"text": "made", "value": {"verified": {}}},
        });
        assert_eq!(told(&run(&judged)), None);
    }
}
