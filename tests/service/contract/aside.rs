//! Calibrations that are kept aside, and those that are verified at once.

use core::time::Duration;
use std::path::Path;

use service::{Code, RunKind, RunRequest, RunState, StopMode};
use tests::LINEAR;

use super::runs::short;
use super::{SEED, anna, bert, each_here, zeroed};
use crate::client::PATIENCE;
use crate::stage::Stage;

/// A calibration of the only axis.
fn calibration(aside: bool, verify: bool) -> RunRequest {
    RunRequest {
        aside,
        verify,
        ..RunRequest::of(RunKind::Calibrate, None)
    }
}

#[test]
fn a_calibration_is_kept_aside_or_verified_at_once_and_not_both() {
    let new = |rig, folder: &Path| Stage::new(rig, (LINEAR, SEED), folder, short);
    let body = zeroed(|bed| {
        let in_use = || bed.client.axis("x").unwrap().calibration;
        let done = |request: &RunRequest| {
            let id = bed.client.plan(&anna(), request).unwrap();
            let run = bed.client.run(&id, PATIENCE).unwrap();
            assert_eq!(run.state, RunState::Done, "{run:?}");
            run
        };
        let aside = done(&calibration(true, false));
        assert!(aside.result["calibration"].is_string(), "{aside:?}");
        assert_eq!(in_use(), None, "it is stored, and not used");

        let verified = done(&calibration(false, true));
        let figures = &verified.result;
        assert_eq!(figures["verified"]["within_tolerance"], true, "{figures}");
        assert_eq!(figures["calibration"], in_use().unwrap());

        let refused = |request: &RunRequest| {
            let problem = bed.client.plan(&anna(), request).unwrap_err();
            // As of a command line: nothing of it was unsafe.
            assert_eq!((problem.code, problem.exit_code), (Code::Configuration, 2));
            problem.to_string()
        };
        let both = refused(&calibration(true, true));
        assert!(both.contains("`aside` together with `verify`"), "{both}");
        for (aside, verify, name) in [(true, false, "aside"), (false, true, "verify")] {
            let other = RunRequest {
                kind: RunKind::Verify,
                ..calibration(aside, verify)
            };
            let said = refused(&other);
            assert!(said.contains(&format!("`{name}` is for")), "{said}");
        }
    });
    each_here(new, body);
}

#[test]
fn what_is_stored_is_told_and_used_where_its_verification_is_stopped() {
    let new = |rig, folder: &Path| Stage::new(rig, (LINEAR, SEED), folder, short);
    let body = zeroed(|bed| {
        let now = |id: &str| bed.client.run(id, Duration::ZERO).unwrap();
        for is_paused in [false, true] {
            let id = bed.client.plan(&anna(), &calibration(false, true)).unwrap();
            // The calibration has 28 points, its verification has fewer.
            while !matches!(now(&id), it if it.steps_done > 0 && it.steps < 28) {
                assert_eq!(now(&id).state, RunState::Running);
                bed.let_time_pass(0.01);
            }
            match is_paused {
                true => bed.client.pause(&bert(), &id).unwrap(),
                false => bed.client.stop(&bert(), StopMode::Controlled).unwrap(),
            }
            let run = bed.client.run(&id, PATIENCE).unwrap();
            assert_eq!(run.state, RunState::Stopped, "{run:?}");
            let in_use = bed.client.axis("x").unwrap().calibration;
            assert_eq!(run.result["calibration"], in_use.unwrap(), "{run:?}");
            assert!(run.out_of_tolerance.is_some(), "{run:?}");
        }
        bed.client.zero(&anna(), None);
    });
    each_here(new, body);
}

#[test]
fn what_cannot_be_verified_is_refused_before_anything_is_measured() {
    let without = |text: String| {
        let text = short(text);
        let (before, rest) = text.split_once("[axis.x.verify]").expect("it is there");
        let after = rest.find("\n[").map_or("", |at| &rest[at..]);
        format!("{before}{after}")
    };
    let new = |rig, folder: &Path| Stage::new(rig, (LINEAR, SEED), folder, without);
    let body = zeroed(|bed| {
        let verified = bed.client.plan(&anna(), &calibration(false, true));
        let problem = verified.unwrap_err();
        let alone = RunRequest::of(RunKind::Verify, None);
        let said = bed.client.plan(&anna(), &alone).unwrap_err();
        assert_eq!(problem.to_string(), said.to_string());
        assert!(said.to_string().contains("verify"), "{said}");
    });
    each_here(new, body);
}
