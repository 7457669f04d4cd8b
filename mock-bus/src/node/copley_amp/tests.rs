//! The amplifiers as a host meets them, byte by byte.

use super::*;
use crate::plant::config::PlantConfig;
use wire::copley::EventStatus;

const MS: Duration = Duration::from_millis(1);

/// Two amplifiers on axis 0 and on one that is not there, powered long ago.
struct Rig {
    node: CopleyAmpsNode,
    plant: Plant,
    now: Time,
}

impl Rig {
    fn new() -> Self {
        Self::with(|_| {})
    }

    fn with(change: impl FnOnce(&mut CopleyAmpsConfig)) -> Self {
        let amp = |address, axis| CopleyAmpConfig {
            address,
            axis,
            serial_number: 4000 + u32::from(address),
            ..CopleyAmpConfig::default()
        };
        let mut config = CopleyAmpsConfig {
            amps: vec![amp(0, 0), amp(2, 1)],
            ..CopleyAmpsConfig::default()
        };
        change(&mut config);
        assert!(addresses_fit(&config));
        let mut rig = Self {
            node: CopleyAmpsNode::new(&config, 1, "amps"),
            plant: Plant::new(&PlantConfig::default(), 1),
            now: Time::ZERO,
        };
        rig.node.power_on(Time::ZERO, &mut rig.plant);
        rig.host_rate(BAUD_AT_RESET);
        rig.live(Duration::from_secs(1));
        rig
    }

    fn host_rate(&mut self, rate: u32) {
        let control = Payload::Control(LineControl::Baud(rate));
        self.node.handle(self.now, &control, &mut self.plant);
    }

    fn live(&mut self, span: Duration) -> Vec<u8> {
        let until = self.now + span;
        let mut heard = Vec::new();
        while self.now < until {
            self.now = self.node.next_event().min(until).max(Time(self.now.0 + 1));
            self.plant.advance(self.now);
            self.node.advance(self.now, &mut self.plant);
            while let Some(Payload::Bytes(bytes)) = self.node.poll_transmit() {
                heard.extend(bytes);
            }
        }
        heard
    }

    /// What comes back within 50 ms.
    fn ask(&mut self, line: &str) -> String {
        let bytes = Payload::Bytes(format!("{line}\r").into_bytes());
        self.node.handle(self.now, &bytes, &mut self.plant);
        let heard = self.live(MS * 50);
        String::from_utf8_lossy(&heard).trim_end().to_owned()
    }

    #[track_caller]
    fn check(&mut self, line: &str, reply: &str) {
        assert_eq!(self.ask(line), reply, "{line}");
    }

    #[track_caller]
    fn number(&mut self, line: &str) -> i64 {
        let reply = self.ask(line);
        let value = reply.strip_prefix("v ").expect("a value");
        value.parse().expect("a number")
    }

    fn events(&mut self) -> EventStatus {
        let raw = self.number("g r0xa0") as u32;
        EventStatus::from_bits_retain(raw)
    }

    fn enabled() -> Self {
        let mut rig = Self::new();
        rig.check("s r0xc8 0", "ok");
        rig.check("s r0x24 21", "ok");
        rig.live(MS * 50);
        rig
    }
}

#[test]
fn it_answers_as_the_guide_says() {
    let mut rig = Rig::new();
    rig.check("s r0xca 40000", "ok");
    rig.check("g r0xca", "v 40000");
    rig.check("2 g r0xca", "v 0");
    rig.check("2 s f0xba 1200", "ok");
    rig.check("2 g f0xba", "v 1200");
    rig.check("g f0x17", "e 15");
    rig.check("g r0x80", "e 15");
    rig.check("g f0x80", "v MOCK-055-18");
    rig.check("2 g f0x81", "v 4002");
    rig.check("s r0xa0 1", "e 11");
    rig.check("s r0x7ff 1", "e 9");
    rig.check("s r0xcb -1", "e 10");
    rig.check("s r0xc8 1", "e 10");
    rig.check("s r 0xca 1", "e 33");
    rig.check("3 g r0xa0", "e 32");
    rig.check(".b g r0xa0", "e 36");
    rig.check("", "");
}

#[test]
fn it_is_off_after_power_on_and_says_so() {
    let mut rig = Rig::new();
    let off = EventStatus::DISABLED_BY_SOFTWARE | EventStatus::OUTPUTS_OFF;
    assert_eq!(rig.events(), off);
    rig.check("s r0x24 21", "ok");
    rig.live(MS * 50);
    assert_eq!(rig.events(), EventStatus::empty());
}

#[test]
fn a_move_runs_settles_and_ends_where_it_was_sent() {
    let mut rig = Rig::enabled();
    rig.check("s r0xca 50000", "ok");
    rig.check("t 1", "ok");
    assert!(rig.events().contains(EventStatus::IN_MOTION));
    assert_eq!(rig.number("g r0xc9"), 1 << 15);
    rig.live(Duration::from_secs(2));
    assert!(!rig.events().contains(EventStatus::IN_MOTION));
    assert_eq!(rig.number("g r0xc9"), 0);
    assert_eq!(rig.number("g r0x3d"), 50_000);
    let there = rig.number("g r0x17");
    assert!((there - 50_000).abs() <= 100, "{there}");
}

#[test]
fn an_abort_stops_short_and_a_disabled_amplifier_begins_no_move() {
    let mut rig = Rig::enabled();
    rig.check("s r0xca 5000000", "ok");
    rig.check("t 1", "ok");
    rig.live(MS * 300);
    rig.check("t 0", "ok");
    rig.live(MS * 300);
    assert_eq!(rig.number("g r0xc9"), 1 << 14);
    let stopped = rig.number("g r0x17");
    assert!(stopped > 10_000 && stopped < 1_000_000, "{stopped}");
    rig.check("s r0x24 0", "ok");
    rig.check("t 1", "ok");
    rig.live(MS * 300);
    assert_eq!(rig.number("g r0x17"), stopped);
}

#[test]
fn disabling_a_moving_axis_slows_it_down_first() {
    let mut rig = Rig::enabled();
    rig.check("s r0xca 5000000", "ok");
    rig.check("s r0xcf 400000", "ok");
    rig.check("t 1", "ok");
    rig.live(MS * 300);
    rig.check("s r0x24 0", "ok");
    assert!(rig.events().contains(EventStatus::STOPPING));
    rig.live(Duration::from_secs(2));
    let events = rig.events();
    assert!(!events.contains(EventStatus::STOPPING) && events.contains(EventStatus::OUTPUTS_OFF));
}

#[test]
fn home_here_is_zero_and_the_switch_is_found_from_outside() {
    let mut rig = Rig::enabled();
    rig.check("s r0xca 30000", "ok");
    rig.check("t 1", "ok");
    rig.live(Duration::from_secs(2));
    rig.check("s r0xc2 512", "ok");
    rig.check("t 2", "ok");
    assert_eq!(rig.number("g r0xc9"), 1 << 12);
    assert!(rig.number("g r0x17").abs() <= 100);
    rig.check("s r0xc2 529", "ok");
    rig.check("t 2", "ok");
    assert_eq!(rig.number("g r0xc9") & (1 << 12 | 1 << 13), 1 << 13);
    rig.live(Duration::from_secs(20));
    assert_eq!(rig.number("g r0xc9"), 1 << 12);
    assert!(rig.number("g r0x17").abs() <= 100);
    rig.check("s r0xb8 1000", "ok");
    rig.check("s r0xb9 -1000", "ok");
    rig.check("s r0xca 500000", "ok");
    rig.check("t 1", "ok");
    rig.live(Duration::from_secs(2));
    assert!(rig.events().contains(EventStatus::POSITIVE_SOFT_LIMIT));
    assert!(rig.number("g r0x17") < 500_000);
}

#[test]
fn a_blocked_axis_is_a_following_error_until_it_is_cleared() {
    let mut rig = Rig::enabled();
    rig.plant.set_blocked(0, true);
    rig.check("s r0xca 5000000", "ok");
    rig.check("t 1", "ok");
    rig.live(Duration::from_secs(1));
    let fault = EventStatus::FAULT | EventStatus::TRACKING_ERROR | EventStatus::OUTPUTS_OFF;
    assert!(rig.events().contains(fault), "{:?}", rig.events());
    rig.check("g r0xa4", "v 512");
    rig.check("s r0xa4 512", "ok");
    rig.check("g r0xa4", "v 0");
}

#[test]
fn a_fault_stays_as_long_as_its_cause() {
    let mut rig = Rig::enabled();
    rig.node.set_faults(0, Faults::AMPLIFIER_HOT);
    rig.live(MS * 20);
    assert!(
        rig.events()
            .contains(EventStatus::AMPLIFIER_HOT | EventStatus::FAULT)
    );
    rig.check("s r0xa4 8", "ok");
    rig.check("g r0xa4", "v 8");
    rig.node.set_faults(0, Faults::empty());
    rig.check("s r0xa4 8", "ok");
    rig.check("g r0xa4", "v 0");
}

#[test]
fn the_reply_to_a_new_rate_comes_at_the_new_rate_and_then_it_is_deaf_for_a_while() {
    let mut rig = Rig::new();
    let heard = rig.ask("s r0x90 115200");
    assert_ne!(heard, "ok");
    assert!(!heard.is_empty());
    rig.host_rate(115_200);
    rig.check("g r0x90", "");
    rig.live(MS * 100);
    // The processor cannot make it exactly.
    rig.check("g r0x90", "v 115238");
    rig.check("2 g r0xca", "v 0");
}

#[test]
fn at_another_rate_it_hears_garbage_and_a_break_brings_it_back() {
    let mut rig = Rig::new();
    rig.host_rate(19_200);
    rig.check("g r0x90", "");
    rig.host_rate(BAUD_AT_RESET);
    // What it heard stands before the next command.
    rig.check("g r0x90", "e 33");
    rig.check("g r0x90", "v 9603");
    rig.ask("s r0x90 57600");
    assert_eq!(rig.node.rate(), 57_600);
    for level in [true, false] {
        let control = Payload::Control(LineControl::Break(level));
        rig.node.handle(rig.now, &control, &mut rig.plant);
    }
    rig.live(MS * 100);
    rig.check("g r0x90", "v 9603");
}

#[test]
fn the_bits_of_a_much_slower_host_are_a_break() {
    let mut rig = Rig::new();
    rig.ask("s r0x90 115200");
    rig.live(MS * 100);
    // The host has stayed at 9600: one of its low bits is longer than a byte. What follows the
    // first of them is heard at 9600 again.
    rig.check("g r0x90", "e 33");
    rig.check("g r0x90", "v 9603");
}

#[test]
fn a_power_cycle_forgets_everything_volatile() {
    let mut rig = Rig::enabled();
    rig.check("s r0xca 30000", "ok");
    rig.ask("s r0x90 115200");
    rig.node.set_power(0, false);
    rig.host_rate(115_200);
    rig.check("2 g r0xca", "");
    rig.node.set_power(0, true);
    rig.live(Duration::from_secs(1));
    rig.host_rate(BAUD_AT_RESET);
    rig.check("g r0xca", "v 0");
    rig.check("g r0x24", "v 0");
    assert!(rig.number("g r0xb7") < 1000);
    assert!(rig.number("2 g r0xb7") > 1000);
}

#[test]
fn a_node_without_power_is_error_32_and_the_others_go_on() {
    let mut rig = Rig::new();
    rig.node.set_power(2, false);
    rig.live(MS);
    rig.check("2 g r0xa0", "e 32");
    assert!(rig.number("g r0xa0") != 0);
    rig.check("2 r", "e 32");
}

#[test]
fn quirks_are_delivered_as_often_as_they_are_asked_for() {
    let mut rig = Rig::enabled();
    rig.node.quirks_mut().lose_replies = 1;
    rig.check("g r0xca", "");
    rig.check("g r0xca", "v 0");
    rig.node.quirks_mut().lose_trajectory_replies = 1;
    rig.check("s r0xca 1000", "ok");
    rig.check("t 1", "");
    assert!(rig.node.moved_at(0).is_some());
    rig.node.quirks_mut().lose_trajectory_commands = 1;
    rig.live(Duration::from_secs(1));
    rig.check("s r0xca 2000", "ok");
    rig.check("t 1", "");
    rig.check("g r0x3d", "v 1000");
    rig.node.quirks_mut().foreign_replies = 1;
    rig.check("2 g r0xca", "v 2000");
    rig.node.quirks_mut().wrong_digits = 1;
    rig.check("g r0xca", "v 6000");
    rig.node.quirks_mut().delay_ms = 160;
    rig.node.quirks_mut().delay_replies = 1;
    rig.check("g r0xca", "");
    rig.live(MS * 100);
    // In the order of the commands, the late one first.
    rig.check("g r0x24", "v 2000\rv 21");
    for key in [
        "lose_replies",
        "lose_trajectory_replies",
        "lose_trajectory_commands",
        "foreign_replies",
        "wrong_digits",
        "delay_replies",
    ] {
        assert_eq!(rig.node.deliveries(key), 1, "{key}");
    }
}

#[test]
fn addresses_must_be_apart_and_one_at_the_cable() {
    let with = |addresses: &[u8]| CopleyAmpsConfig {
        amps: addresses
            .iter()
            .map(|address| CopleyAmpConfig {
                address: *address,
                ..CopleyAmpConfig::default()
            })
            .collect(),
        ..CopleyAmpsConfig::default()
    };
    assert!(addresses_fit(&with(&[0, 2, 127])));
    for odd in [&[][..], &[1, 2], &[0, 0], &[0, 128]] {
        assert!(!addresses_fit(&with(odd)), "{odd:?}");
    }
}
