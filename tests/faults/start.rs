//! The start: who is there, and do they do as they are told (classes 16 to 20)?
//! Nothing may move before all of it is right.

use std::time::Duration;

use drivers::device::DeviceError;
use machine::Finding;
use mock_bus::node::canopen_server::Manners;
use truestage::Failure;

use crate::scene::{Phase, Played, Scene, Wanted, check, check_harmless, with_drive};

/// The longest that a start may take to fail; nothing waits for it.
const AT_ONCE: Duration = Duration::from_secs(2);

macro_rules! device {
    ($pattern:pat) => {
        |failure: &Failure| {
            matches!(
                failure,
                Failure::Machine(machine::Failure::Device {
                    source: $pattern,
                    ..
                })
            )
        }
    };
}

fn is_found(failure: &Failure, is_wanted: fn(&Finding) -> bool) -> bool {
    match failure {
        Failure::Machine(machine::Failure::Explained { finding, .. }) => is_wanted(finding),
        _ => false,
    }
}

#[track_caller]
fn check_refused(scene: Scene, cause: fn(&Failure) -> bool, words: &[&str]) -> Played {
    let wanted = Wanted {
        cause,
        words,
        within: AT_ONCE,
        rest: Duration::ZERO,
    };
    check(scene, &wanted)
}

fn start() -> Scene {
    Scene::during(Phase::Start)
}

const DRIVE_IDENTITY: &str =
    "{ vendor_id = 0x7FF, product_code = 0x42_0001, revision = 0x1_0000, serial_number = 1001 }";

#[test]
fn a_drive_of_another_vendor_is_refused_before_anything_moves() {
    let scene = start().emulated(
        DRIVE_IDENTITY,
        "{ vendor_id = 0x123, product_code = 0x42_0001 }",
    );
    check_refused(
        scene,
        device!(DeviceError::WrongIdentity { what: "vendor", .. }),
        &["x:", "node 1", "vendor", "0x00000123"],
    );
}

#[test]
fn a_drive_of_another_type_is_refused_before_anything_moves() {
    let scene = start().emulated(
        DRIVE_IDENTITY,
        "{ vendor_id = 0x7FF, product_code = 0x43_0001 }",
    );
    check_refused(
        scene,
        device!(DeviceError::WrongIdentity { .. }),
        &["x:", "product", "0x00430001"],
    );
}

#[test]
fn another_specimen_of_the_right_drive_is_refused_before_anything_moves() {
    let scene = start().machine(
        "product_code = 0x00420001",
        "product_code = 0x00420001\nserial_number = 999",
    );
    check_refused(
        scene,
        device!(DeviceError::WrongIdentity { .. }),
        &["x:", "serial", "0x000003E7", "0x000003E9"],
    );
}

#[test]
fn an_analog_module_in_the_place_of_another_is_refused() {
    let scene = start().machine("product_code = 0x00400001", "product_code = 0x00400002");
    check_refused(
        scene,
        device!(DeviceError::WrongIdentity { .. }),
        &["hall:", "node 2", "product"],
    );
}

fn with_manners(manners: Manners, delivered: &'static str) -> Scene {
    start().deed(
        move |emulated| with_drive(emulated, |drive| *drive.manners_mut() = manners),
        move |emulated| with_drive(emulated, |drive| drive.deliveries().contains_key(delivered)),
    )
}

#[test]
fn a_mapping_that_is_confirmed_and_not_done_is_refused() {
    let manners = Manners {
        mapping_ignored_writes: 100,
        ..Manners::default()
    };
    check_refused(
        with_manners(manners, "mapping_ignored_writes"),
        |failure| {
            matches!(
                failure,
                Failure::Machine(machine::Failure::Device {
                    source: DeviceError::ReadBack { .. } | DeviceError::SdoAbort { .. },
                    ..
                })
            )
        },
        &["x:", "node 1", "1A00"],
    );
}

#[test]
fn process_data_that_carry_something_else_than_mapped_are_refused() {
    let manners = Manners {
        mapping_lies: true,
        ..Manners::default()
    };
    check_refused(
        with_manners(manners, "mapping_lies"),
        device!(DeviceError::ReadBack { .. }),
        &["x:", "6064", "comparing process data"],
    );
}

#[track_caller]
fn check_tolerated(manners: Manners, delivered: &'static str) {
    check_harmless(with_manners(manners, delivered));
}

#[test]
fn answers_that_are_slow_late_doubled_or_about_something_else_are_lived_with() {
    let polite = Manners::default;
    let slow = Manners {
        sdo_response_delay_us: 20_000,
        ..polite()
    };
    check_tolerated(slow, "sdo_response_delay_us");
    let doubled = Manners {
        sdo_duplicate_responses: 1000,
        ..polite()
    };
    check_tolerated(doubled, "sdo_duplicate_responses");
    let stray = Manners {
        sdo_stray_replies: 1000,
        ..polite()
    };
    check_tolerated(stray, "sdo_stray_replies");
    let late = Manners {
        sdo_late_replies: 2,
        sdo_late_reply_ms: 2000,
        ..polite()
    };
    check_tolerated(late, "sdo_late_replies");
    let short = Manners {
        sdo_short_replies: 2,
        ..polite()
    };
    check_tolerated(short, "sdo_short_replies");
    let lost = Manners {
        sdo_lost_replies: 2,
        ..polite()
    };
    check_tolerated(lost, "sdo_lost_replies");
}

#[test]
fn a_drive_that_is_always_busy_is_refused_with_its_own_words() {
    let manners = Manners {
        sdo_busy: 1000,
        ..Manners::default()
    };
    check_refused(
        with_manners(manners, "sdo_busy"),
        device!(DeviceError::SdoAbort { .. }),
        &["x:", "0x08000022", "device state"],
    );
}

#[test]
fn a_drive_that_answers_no_question_is_refused_after_a_bounded_time() {
    let manners = Manners {
        sdo_ignored_requests: 100_000,
        ..Manners::default()
    };
    let wanted = Wanted {
        cause: |failure| {
            is_found(failure, |finding| {
                matches!(finding, Finding::NoAnswer { .. })
            })
        },
        words: &["x: node 1 answers nothing since", "boot-up or an answer"],
        within: Duration::from_secs(15),
        rest: Duration::ZERO,
    };
    check(with_manners(manners, "sdo_ignored_requests"), &wanted);
}

#[test]
fn a_drive_that_stops_answering_in_the_middle_of_its_setup_is_named_with_the_object() {
    let manners = Manners {
        sdo_only_index: Some(0x1016),
        sdo_ignored_requests: 100_000,
        ..Manners::default()
    };
    let wanted = Wanted {
        cause: device!(DeviceError::SdoTimeout { .. }),
        words: &["x:", "node 1", "1016", "watch our heartbeat"],
        within: Duration::from_secs(15),
        rest: Duration::ZERO,
    };
    check(with_manners(manners, "sdo_ignored_requests"), &wanted);
}

#[test]
fn a_drive_that_is_not_there_is_named() {
    let scene = start().machine("node_id = 1\n", "node_id = 5\n");
    let wanted = Wanted {
        cause: |failure| is_found(failure, |finding| matches!(finding, Finding::Silent { .. })),
        words: &["x: node 5 was never heard", "boot-up or an answer"],
        within: Duration::from_secs(15),
        rest: Duration::ZERO,
    };
    check(scene, &wanted);
}
