//! Who else is on the bus (classes 8 and 9): somebody who fills it, and another client of our devices.

use std::time::Duration;

use mock_bus::fault::Fault;
use truestage::Failure;

use crate::scene::{PERIOD, Phase, STOPPING, Scene, Wanted, check, check_harmless};
use crate::witness::Slow;

const CAN: &str = "can0";

/// A virtual interface counts no bits: whatever is sent gets through, and the computer takes less
/// than that. It is a tenth of a second behind what it hears, and most of that is lost.
fn swamped(scene: Scene) -> Scene {
    let slow = Slow {
        cost: Duration::from_millis(2),
        room: 50,
    };
    let (from, to) = ("bitrate_kbit_per_s = 1000", "bitrate_kbit_per_s = 10000");
    scene.emulated(from, to).slow(slow)
}

fn babble(cob_id: u32) -> Fault {
    let port = CAN.into();
    Fault::Babble { port, cob_id }
}

fn check_named(scene: Scene, words: &[&str]) {
    let wanted = Wanted {
        cause: |failure| matches!(failure, Failure::Machine(machine::Failure::Babbling { .. })),
        words,
        within: Duration::from_secs(1),
        rest: Duration::from_millis(1500),
    };
    check(scene, &wanted);
}

#[test]
fn whoever_floods_an_interface_that_counts_no_bits_is_named_whatever_the_priority() {
    for phase in [Phase::Stand, Phase::Calibrate] {
        for (cob_id, name) in [
            (0x001, "0x001"),
            (0x7F0, "0x7F0"),
            (0x1234_5678, "0x12345678"),
        ] {
            let scene = Scene::during(phase).after_ms(1500).fault(babble(cob_id));
            check_named(swamped(scene), &[CAN, name]);
        }
    }
}

/// The loop takes what waits, but not for ever. Where the flood begins with a slot of the bus's account (1500 to 1503 ms
/// here), the pause of this computer is told in its place.
#[test]
fn whoever_floods_an_interface_that_counts_no_bits_is_named_while_axes_follow_a_path() {
    for after_ms in [1400, 1495, 1510, 1600] {
        for (cob_id, name) in [(0x001, "0x001"), (0x7F0, "0x7F0")] {
            let scene = Scene::during(Phase::Follow).after_ms(after_ms);
            check_named(swamped(scene.fault(babble(cob_id))), &[CAN, name]);
        }
    }
}

#[test]
fn a_29_bit_identifier_that_fills_the_bus_is_named() {
    let scene = Scene::during(Phase::Move).after_ms(100);
    let words = [CAN, "29-bit identifier 0x00001234"];
    check_named(scene.fault(babble(0x1234)), &words);
}

fn foreign_sdo(writes: bool) -> Fault {
    Fault::ForeignSdo {
        port: CAN.into(),
        node_id: 1,
        writes,
        period_ms: 20.0,
    }
}

#[test]
fn somebody_else_who_reads_from_a_drive_is_told_once_and_stops_nothing() {
    for phase in [Phase::Stand, Phase::Calibrate] {
        let played = check_harmless(Scene::during(phase).after_ms(500).fault(foreign_sdo(false)));
        let told = played.warnings();
        let told = told.iter().filter(|it| it.contains("SDO"));
        let told: Vec<_> = told.collect();
        assert_eq!(told.len(), 1, "{told:?}");
        for part in [CAN, "node 1", "did not send"] {
            assert!(told[0].contains(part), "{part}: {told:?}");
        }
    }
}

#[test]
fn somebody_else_who_writes_to_a_drive_is_another_master() {
    let wanted = Wanted {
        cause: |failure| {
            matches!(
                failure,
                Failure::Machine(machine::Failure::SecondMaster { .. })
            )
        },
        words: &[CAN, "SDO", "another master"],
        within: PERIOD,
        rest: PERIOD + STOPPING,
    };
    let scene = Scene::during(Phase::Move).after_ms(100);
    check(scene.fault(foreign_sdo(true)), &wanted);
    let wanted = Wanted {
        within: Duration::from_millis(20),
        rest: Duration::ZERO,
        ..wanted
    };
    let scene = Scene::during(Phase::Start);
    check(scene.fault(foreign_sdo(true)), &wanted);
}
