//! python-canopen is the master of our emulated drive.

use mock_bus::runner::Running;
use serde_json::{Value, json};
use units::Metres;

use crate::emulated::Emulated;

/// The drive's position window, in counts of 10 nm: "target reached" means no more.
const NEAR_COUNTS: i64 = 100;
/// What the stage deviates by and loses when it turns round (configs/emulated/linear.toml).
const DEVIATION_MAX_UM: f64 = 25.0;

fn position(machine: &Running) -> Metres {
    machine
        .with(|machine| machine.truth().position())
        .expect("the machine runs")
}

#[test]
fn python_canopen_moves_homes_and_upsets_the_emulated_drive() {
    for rig in crate::rigs() {
        let emulated = Emulated::spawn(rig);
        let before = position(&emulated.machine);
        let seen = emulated.master("drive_master.py").finish();
        let travelled = position(&emulated.machine) - before;
        check_transfers(&seen);
        check_mapping(&seen["pdos"]);
        check_motion(&seen, travelled);
        check_failure(&seen["failure"]);
        emulated.stop();
    }
}

fn check_transfers(seen: &Value) {
    let sdo = &seen["sdo"];
    assert_eq!(sdo["device_name"], "truestage mock servo drive");
    assert_eq!(sdo["device_type"], 0x0002_0192);
    assert_eq!(sdo["identity"], json!([0x7FF, 0x42_0001, 0x1_0000, 1001]));
    let big: String = (0..889)
        .map(|at| format!("{:02x}", (at * 7 + at / 256) % 256))
        .collect();
    assert_eq!(sdo["big"], big);
    assert_eq!(sdo["big_announced"], 889);
    for told in [
        "big_crc",
        "big_in_segments_too",
        "segments_came_back",
        "blocks_came_back",
    ] {
        assert_eq!(sdo[told], true, "{told}");
    }
    assert_eq!(sdo["expedited_came_back"], true);
    let aborts = json!({
        "no_object": 0x0602_0000,
        "no_sub_index": 0x0609_0011,
        "read_only": 0x0601_0002,
        "too_long": 0x0607_0012,
        "value": 0x0609_0030,
    });
    assert_eq!(seen["aborts"], aborts);
}

/// One PDO each way is left of the drive's default eight.
fn check_mapping(pdos: &Value) {
    let only_the_first = [true, false, false, false].repeat(2);
    assert_eq!(pdos["enabled"], json!(only_the_first));
    assert_eq!(pdos["command"], json!([0x6040, 0x6060, 0x607A]));
    assert_eq!(pdos["status"], json!([0x6041, 0x6061, 0x6064]));
    assert_eq!(pdos["event_timer_ms"], 20);
}

fn check_motion(seen: &Value, travelled: Metres) {
    assert_eq!(seen["enabled"], "OPERATION ENABLED");
    let counts = |at: &Value| at.as_i64().unwrap_or_else(|| panic!("no position: {seen}"));
    let near = |at: &Value, wanted: i64| {
        let off = counts(at) - wanted;
        assert!(off.abs() <= NEAR_COUNTS, "{off} counts from {wanted}");
    };
    let start = counts(&seen["started_at"]);
    near(&seen["absolute"], start + 300_000);
    near(&seen["relative"], start + 200_000);
    let off_um = travelled.um() - 2_000.0;
    assert!(
        off_um.abs() <= DEVIATION_MAX_UM,
        "the stage truly is {off_um} µm from 2 mm"
    );
    assert_eq!(seen["homing"]["status"], 0x1400);
    assert_eq!(seen["homing"]["homed"], true);
    near(&seen["homing"]["position"], 12_345);
}

fn check_failure(failure: &Value) {
    assert_eq!(failure["emergencies"], json!([0x8611]));
    assert_eq!(failure["state"], "FAULT");
    assert_eq!(failure["state_after"], "SWITCH ON DISABLED");
    assert_eq!(failure["emergencies_after"], 0);
}
