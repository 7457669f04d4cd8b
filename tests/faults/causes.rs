//! Causes of missing and false data, as the traffic of the stop shows them (classes 1, 8, 12 to 14, 32).

use std::time::Duration;

use machine::Finding;
use mock_bus::fault::{Fault, FaultConfig};
use truestage::Failure;

use crate::scene::{Phase, Played, Scene, WATCHED};

const CAN: &str = "can0";
const DRIVE: &str = "drive";
const MODULE: &str = "hall_adc";

/// Plays `scene`, in which the fault is delivered, and returns the failure's text.
#[track_caller]
fn failure_text(scene: Scene) -> (Played, String) {
    let played = scene.play();
    played.was_delivered();
    let text = match &played.result {
        Ok(()) => panic!("nothing was noticed until {}", played.ended),
        Err(failure) => failure.to_string(),
    };
    (played, text)
}

/// Every word is in the failure's text, at every moment within a SYNC period and in each of `phases`.
#[track_caller]
fn check_named(phases: &[(Phase, u64)], fault: &Fault, words: &[&str]) {
    for (phase, after_ms) in phases {
        for later_ms in 0..5 {
            let scene = Scene::during(*phase).after_ms(after_ms + later_ms);
            let (_, text) = failure_text(scene.fault(fault.clone()));
            for word in words {
                assert!(text.contains(word), "{phase:?}, `{word}` is not in: {text}");
            }
        }
    }
}

/// In which the drive moves or stands, enabled.
const ENABLED: [(Phase, u64); 3] = [
    (Phase::Move, 100),
    (Phase::Stand, 1_000),
    (Phase::Calibrate, 2_000),
];

#[test]
fn a_drive_without_power_is_told_from_a_silent_bus() {
    let node = || DRIVE.into();
    let words = [
        "x: no data from node 1 since",
        "while node 2 answers",
        "power or cable",
    ];
    check_named(&ENABLED, &Fault::Mute { node: node() }, &words);
    check_named(&ENABLED, &Fault::PowerLoss { node: node() }, &words);
    let all = Fault::Drop {
        port: CAN.into(),
        cob_id: None,
    };
    let words = [
        "no data from any device of can0 since",
        "cable or termination",
    ];
    check_named(&ENABLED, &all, &words);
}

#[test]
fn a_silent_module_is_told_from_a_silent_bus() {
    let words = [
        "hall: no data from node 2 since",
        "while node 1 answers",
        "power or cable",
    ];
    let node = MODULE.into();
    check_named(&[(Phase::Zero, 3_000)], &Fault::Mute { node }, &words);
}

#[test]
fn process_data_that_were_stopped_are_told_from_silence() {
    let node = DRIVE.into();
    let words = ["x: node 1 lives, but sends no process data since"];
    check_named(&ENABLED, &Fault::StopPdos { node }, &words);
    let sample = Fault::Drop {
        port: CAN.into(),
        cob_id: Some(0x181),
    };
    check_named(&ENABLED, &sample, &["TPDO 1 of node 1 stays away since"]);
}

#[test]
fn a_babbler_is_named_whenever_it_begins() {
    for cob_id in [0x010, 0x001] {
        let port = CAN.into();
        let id = format!("{cob_id:#05X}");
        let words = ["can0", "% of the bus", id.as_str()];
        check_named(&ENABLED, &Fault::Babble { port, cob_id }, &words);
    }
}

#[test]
fn a_babbler_under_the_drives_own_number_is_named() {
    for cob_id in [0x181, 0x281, 0x081, 0x701] {
        let port = CAN.into();
        let id = format!("{cob_id:#05X}");
        let words = ["can0", "% of the bus", id.as_str()];
        check_named(&ENABLED, &Fault::Babble { port, cob_id }, &words);
    }
}

#[test]
fn frozen_process_data_are_told_from_a_slow_drive() {
    let node = DRIVE.into();
    let phases = [
        (Phase::Move, 100),
        (Phase::Zero, 500),
        (Phase::Calibrate, 2_000),
        (Phase::Zero, 0),
    ];
    check_named(
        &phases,
        &Fault::StaleData { node },
        &["x: node 1 repeats the same process data since", "frozen"],
    );
}

#[test]
fn a_drive_that_boots_again_has_restarted() {
    for phase in [Phase::Move, Phase::Stand] {
        let fault = Fault::PowerLoss { node: DRIVE.into() };
        let short = FaultConfig::lasting(fault, Duration::from_millis(30));
        let (played, text) = failure_text(Scene::during(phase).after_ms(100).inject(short));
        assert!(text.contains("x: node 1 restarted at"), "{phase:?}: {text}");
        assert!(!played.bench.machine.is_zeroed("x"));
    }
}

#[test]
fn a_stop_that_is_not_confirmed_is_one_warning() {
    let fault = Fault::Mute { node: DRIVE.into() };
    let (played, _) = failure_text(Scene::during(Phase::Move).after_ms(100).fault(fault));
    let warnings = played.warnings();
    let [warning] = &warnings[..] else {
        panic!("not one warning: {warnings:#?}");
    };
    let parts = [
        "axis x did not confirm that it stopped: no data from node 1 since",
        "its drive watches our heartbeat",
        "make sure that it stands still",
    ];
    for part in parts {
        assert!(warning.contains(part), "`{part}` is not in: {warning}");
    }
}

/// Nothing was enabled: there is nothing to stop, and nothing to be said of it.
#[test]
fn a_refused_start_waits_for_no_stop() {
    let scene = Scene::during(Phase::Start)
        .machine("product_code = 0x00420001", "product_code = 0x00420009");
    let (played, text) = failure_text(scene);
    assert!(text.contains("product"), "{text}");
    assert!(played.warnings().is_empty(), "{:?}", played.warnings());
    let stopping = played.bench.machine.now().since(played.ended);
    assert!(
        stopping < WATCHED + Duration::from_millis(100),
        "{stopping:?}"
    );
}

#[test]
fn a_drive_never_heard_is_told_at_the_start() {
    let scene = Scene::during(Phase::Start).machine("node_id = 1\n", "node_id = 5\n");
    let played = scene.play();
    let explained = match &played.result {
        Err(Failure::Machine(machine::Failure::Explained { finding, .. })) => finding.clone(),
        other => panic!("{other:?}"),
    };
    let text = explained.to_string();
    let never = matches!(explained, Finding::Silent { since: None, .. });
    assert!(
        never && text.contains("node 5 was never heard while node 2 answers"),
        "{text}"
    );
}
