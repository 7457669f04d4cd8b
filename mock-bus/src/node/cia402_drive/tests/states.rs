//! The power state machine.

use super::super::power::{Command, Power, Transition, transition};
use super::Bench;
use crate::node::cia402_drive::{Cia402DriveConfig, DriveQuirks};
use crate::plant::Servo;

#[test]
fn every_command_in_every_state_causes_the_standards_transition() {
    use Command::{DisableVoltage, EnableOperation, QuickStop, Shutdown, SwitchOn};
    use Transition::{T2, T3, T4, T5, T6, T7, T8, T9, T10, T11, T12, T16};
    let commands = [
        Shutdown,
        SwitchOn,
        EnableOperation,
        DisableVoltage,
        QuickStop,
    ];
    let table = [
        (Power::NotReady, [None; 5]),
        (Power::SwitchOnDisabled, [Some(T2), None, None, None, None]),
        (
            Power::ReadyToSwitchOn,
            [None, Some(T3), Some(T3), Some(T7), Some(T7)],
        ),
        (
            Power::SwitchedOn,
            [Some(T6), None, Some(T4), Some(T10), Some(T10)],
        ),
        (
            Power::OperationEnabled,
            [Some(T8), Some(T5), None, Some(T9), Some(T11)],
        ),
        (
            Power::QuickStopActive,
            [None, None, Some(T16), Some(T12), None],
        ),
        (Power::FaultReactionActive, [None; 5]),
        (Power::Fault, [None; 5]),
    ];
    for (state, expected) in table {
        let seen = commands.map(|command| transition(state, command, true));
        assert_eq!(seen, expected, "{state:?}");
    }
    assert_eq!(
        transition(Power::QuickStopActive, EnableOperation, false),
        None
    );
}

/// Kollmorgen AKD CANopen manual, p. 145: controlwords 06, 07, 0F, 1F; the statusword goes
/// from 0250 by 0237 to 1637.
#[test]
fn the_homing_trace_of_a_real_drive_is_reproduced() {
    let mut bench = Bench::new();
    bench.write(0x6060, &[6]);
    bench.write(0x6098, &[37]);
    let _ = bench.wait_ms(5);
    bench.check_status(0x0250);
    for (controlword, status) in [
        (0x06, 0x0231),
        (0x07, 0x0233),
        (0x0F, 0x0637),
        (0x1F, 0x1637),
    ] {
        bench.control(controlword);
        bench.check_status(status);
        let _ = bench.wait_ms(2);
    }
}

#[test]
fn told_to_enable_at_once_it_shows_the_states_in_between() {
    let mut bench = Bench::new();
    bench.control(0x06);
    let _ = bench.wait_ms(2);
    bench.control(0x0F);
    bench.check_status(0x0233);
    let _ = bench.wait_ms(1);
    assert_eq!(bench.status() & 0x6F, 0x27);
}

#[test]
fn from_switch_on_disabled_only_shutdown_leads_on() {
    let mut bench = Bench::new();
    for controlword in [0x0F, 0x07, 0x02, 0x00] {
        bench.control(controlword);
        let _ = bench.wait_ms(5);
        bench.check_status(0x0250);
    }
}

#[test]
fn the_statusword_comes_by_pdo_at_each_change() {
    let mut bench = Bench::new();
    bench.control(0x06);
    assert!(
        bench.send(0x201, &[0x07, 0x00]).is_empty(),
        "the transition takes its time"
    );
    let seen = bench.wait_ms(5);
    assert!(seen.contains(&"181#3302".to_owned()), "{seen:?}");
}

#[test]
fn disable_voltage_takes_the_torque_away_at_once() {
    let mut bench = Bench::new();
    bench.enable();
    bench.set_point(1_000_000, 0);
    let _ = bench.wait_ms(50);
    bench.control(0x00);
    bench.check_status(0x0250);
    assert_eq!(bench.axis.servo, Servo::Off);
}

#[test]
fn disable_operation_slows_down_first() {
    let mut bench = Bench::new();
    bench.enable();
    bench.set_point(10_000_000, 0);
    let _ = bench.wait_ms(200);
    bench.control(0x07);
    assert_eq!(bench.status() & 0x6F, 0x27);
    let _ = bench.wait_ms(99);
    assert_eq!(
        bench.status() & 0x6F,
        0x27,
        "20 mm/s at 200 mm/s² take 100 ms"
    );
    let _ = bench.wait_ms(3);
    assert_eq!(bench.status() & 0x6F, 0x23);
    assert_eq!(bench.axis.servo, Servo::Off);
}

#[test]
fn enabling_again_during_that_ramp_keeps_the_drive_enabled() {
    let mut bench = Bench::new();
    bench.enable();
    bench.set_point(10_000_000, 0);
    let _ = bench.wait_ms(200);
    bench.control(0x07);
    let _ = bench.wait_ms(50);
    bench.control(0x0F);
    let _ = bench.wait_ms(200);
    assert_eq!(bench.status() & 0x6F, 0x27);
}

fn braked() -> Bench {
    let mut bench = Bench::with(Cia402DriveConfig {
        brake_engage_ms: 30,
        ..Cia402DriveConfig::default()
    });
    bench.enable();
    bench
}

#[track_caller]
fn check_brake_first(controlword: u16, state: u16) {
    let mut bench = braked();
    bench.control(controlword);
    let _ = bench.wait_ms(29);
    assert!(matches!(bench.axis.servo, Servo::Brake { .. }));
    assert_eq!(bench.status() & 0x6F, 0x27);
    let _ = bench.wait_ms(2);
    assert_eq!(bench.axis.servo, Servo::Off);
    assert_eq!(bench.status() & 0x6F, state);
}

#[test]
fn the_brake_falls_in_before_the_torque_goes() {
    check_brake_first(0x07, 0x23);
    check_brake_first(0x06, 0x21);
    let mut bench = braked();
    bench.control(0x00);
    assert_eq!(
        bench.axis.servo,
        Servo::Off,
        "disable voltage lets go at once"
    );
}

#[test]
fn enabling_while_the_brake_falls_in_opens_it() {
    let mut bench = braked();
    bench.control(0x06);
    let _ = bench.wait_ms(10);
    bench.control(0x0F);
    assert!(matches!(bench.axis.servo, Servo::Follow { .. }));
    let _ = bench.wait_ms(100);
    assert_eq!(bench.status() & 0x6F, 0x27);
    bench.set_point(100_000, 0);
    let _ = bench.wait_ms(1000);
    assert_eq!(bench.axis.counts, 100_000);
}

#[test]
fn quick_stop_option_6_stops_and_stays_until_told_otherwise() {
    let mut bench = Bench::new();
    bench.enable();
    bench.set_point(10_000_000, 0);
    let _ = bench.wait_ms(200);
    let before = bench.position();
    bench.control(0x02);
    bench.check_status(0x0217);
    let _ = bench.wait_ms(15);
    bench.check_status(0x0617);
    let travelled = bench.position() - before;
    assert!(
        (9_000..12_000).contains(&travelled),
        "v²/2a = 0.1 mm: {travelled}"
    );
    assert!(matches!(bench.axis.servo, Servo::Follow { .. }));
    bench.control(0x0F);
    let _ = bench.wait_ms(50);
    bench.check_status(0x0637);
    bench.control(0x02);
    let _ = bench.wait_ms(5);
    bench.control(0x00);
    bench.check_status(0x0250);
}

#[test]
fn quick_stop_option_2_ends_in_switch_on_disabled() {
    let mut bench = Bench::with(Cia402DriveConfig {
        quick_stop_option: 2,
        ..Cia402DriveConfig::default()
    });
    bench.enable();
    bench.set_point(10_000_000, 0);
    let _ = bench.wait_ms(200);
    bench.control(0x02);
    assert_eq!(bench.status() & 0x6F, 0x07);
    let _ = bench.wait_ms(15);
    bench.check_status(0x0250);
}

#[test]
fn under_local_control_the_remote_bit_is_off_and_nothing_is_obeyed() {
    let mut bench = Bench::new();
    bench.drive.local_control = true;
    bench.control(0x06);
    bench.check_status(0x0050);
}

#[test]
fn quirks_hold_the_drive_back() {
    let mut bench = Bench::with(Cia402DriveConfig {
        quirks: DriveQuirks {
            enable_refused: true,
            ..DriveQuirks::default()
        },
        ..Cia402DriveConfig::default()
    });
    for controlword in [0x06, 0x07, 0x0F] {
        bench.control(controlword);
        let _ = bench.wait_ms(20);
    }
    bench.check_status(0x0233);
    assert!(bench.delivered("enable_refused"));
    bench.drive.config.quirks.statusword_stuck = true;
    assert!(!bench.delivered("statusword_stuck"), "it is true as yet");
    bench.control(0x00);
    bench.check_status(0x0233);
    assert!(bench.delivered("statusword_stuck"));
}

#[test]
fn a_standing_drive_needs_few_events() {
    let mut bench = Bench::new();
    bench.enable();
    let commands = bench.axis.commands;
    let _ = bench.wait_ms(10_000);
    assert_eq!(
        bench.axis.commands, commands,
        "no demand while nothing moves"
    );
    let next = bench.drive.next_event() - bench.now;
    assert!(next.as_micros() > 1000, "supervised at leisure: {next:?}");
}

/// Identifiers that mean something to node 1.
const IDS: [u16; 7] = [0x000, 0x080, 0x601, 0x601, 0x601, 0x201, 0x77F];
/// Objects whose values steer the drive.
const STEERING: [u16; 12] = [
    0x6040, 0x6060, 0x607A, 0x6098, 0x607C, 0x60C2, 0x6081, 0x605A, 0x1A00, 0x1800, 0x1016, 0x2001,
];

proptest::proptest! {
    /// Whatever comes, the drive neither panics nor moves faster than it may.
    #[test]
    fn no_sequence_of_frames_breaks_the_drive(
        frames in proptest::collection::vec((0usize..7, 0usize..12, proptest::array::uniform8(0u8..), 0u64..40), 1..60),
    ) {
        let mut bench = Bench::new();
        bench.enable();
        for (id, object, mut data, wait_ms) in frames {
            if id == 4 {
                let [low, high] = STEERING[object].to_le_bytes();
                let command = 0x22 | data[0] & 0x0D;
                data[..3].copy_from_slice(&[command, low, high]);
                data[3] &= 1;
            }
            let length = if IDS[id] == 0x601 { 8 } else { usize::from(data[7] % 9) };
            let _ = bench.send(IDS[id], &data[..length]);
            let before = bench.axis.counts;
            let _ = bench.wait_ms(wait_ms);
            // 0x607F is 500 mm/s; a mirrored or re-homed counter does not move the axis.
            let travelled = (bench.axis.counts - before).unsigned_abs();
            let cyclic = bench.drive.mode() == 8;
            proptest::prop_assert!(cyclic || travelled <= 50_000 * (wait_ms + 2));
        }
    }
}
