//! The analog module's driver against the fake node.

use core::time::Duration;
use units::{Time, Volts};
use wire::can::CanFrame;
use wire::canopen::NodeId;

use super::*;
use crate::device::fake_node::FakeNode;

struct Rig {
    module: Cia401Analog,
    fake: FakeNode,
    now: Time,
    alarms: Vec<Alarm>,
}

fn settings(full_scales: &[f64]) -> Cia401Settings {
    let node = NodeId::new(5).unwrap();
    let common = NodeSettings::new(node, NodeId::new(127).unwrap(), Duration::from_millis(2));
    let channels: Vec<_> = (1..)
        .zip(full_scales)
        .map(|(input, volts)| ChannelSettings {
            input,
            full_scale: Volts(*volts),
        })
        .collect();
    Cia401Settings::new(common, &channels).unwrap()
}

impl Rig {
    fn with(settings: Cia401Settings) -> Self {
        let mut fake = FakeNode::new(0x0004_0191);
        for input in 1..=4 {
            fake.set(0x6401, input, &[0, 0]);
        }
        fake.set(0x6423, 0, &[0]);
        fake.set_u32(0x6432, 1, 7);
        fake.set(0x6421, 1, &[0]);
        Self {
            module: Cia401Analog::new(settings),
            fake,
            now: Time::ZERO,
            alarms: Vec::new(),
        }
    }

    #[track_caller]
    fn started(full_scales: &[f64]) -> Self {
        let mut rig = Self::with(settings(full_scales));
        assert_eq!(rig.start(), Ok(()));
        rig
    }

    fn start(&mut self) -> Result<(), DeviceError> {
        self.module.start(self.now);
        for _ in 0..20_000 {
            if let Some(outcome) = self.module.poll_outcome() {
                return outcome;
            }
            self.passes_ms(1);
        }
        panic!("no outcome")
    }

    fn exchange(&mut self) {
        loop {
            let mut quiet = true;
            while let Some(Payload::Frame(frame)) = self.module.poll_transmit() {
                self.fake.hear(&frame);
                quiet = false;
            }
            while let Some(frame) = self.fake.sent.pop_front() {
                self.hear(frame);
                quiet = false;
            }
            if quiet {
                break;
            }
        }
        while let Some(alarm) = self.module.poll_alarm() {
            self.alarms.push(alarm);
        }
    }

    fn hear(&mut self, frame: CanFrame) {
        let input = Input::Payload(Payload::Frame(frame));
        self.module.handle(self.now, &input);
    }

    fn passes_ms(&mut self, ms: u64) {
        for _ in 0..ms {
            self.exchange();
            self.now += Duration::from_millis(1);
            let ms = self.now.nanos() / 1_000_000;
            // The standard's default: nothing is sent before 0x6423 allows it.
            if ms.is_multiple_of(2) && self.fake.get(0x6423, 0) == 1 {
                self.fake.sync();
            }
            self.fake.beat(ms);
            self.exchange();
            if self.module.poll_timeout() <= self.now {
                self.module.handle_timeout(self.now);
            }
        }
        self.exchange();
    }
}

#[track_caller]
fn check_channel(raw: i16, full_scale: f64, converter_bits: u8, volts: f64, saturated: bool) {
    let mut settings = settings(&[full_scale]);
    settings.converter_bits = converter_bits;
    let mut rig = Rig::with(settings);
    rig.start().unwrap();
    rig.fake.set(0x6401, 1, &raw.to_le_bytes());
    rig.passes_ms(4);
    let reading = rig.module.reading().unwrap();
    let seen = reading.volts[0].value();
    assert!((seen - volts).abs() < 1e-9, "{seen} V");
    assert_eq!(reading.saturated, [saturated]);
}

#[test]
fn a_start_enables_the_inputs_and_makes_the_scaling_neutral() {
    let rig = Rig::started(&[10.0, 10.0]);
    assert_eq!(rig.fake.get(0x6423, 0), 1);
    assert_eq!(rig.fake.get(0x6432, 1), 1);
    assert_eq!(rig.fake.get(0x1A00, 0), 2);
    assert_eq!(rig.fake.get(0x1A00, 2) as u32, 0x6401_0210);
    assert_eq!(rig.fake.get(0x1800, 2), 1);
    assert!(rig.alarms.is_empty());
}

#[test]
fn counts_become_volts_by_each_channels_full_scale() {
    check_channel(0, 10.0, 16, 0.0, false);
    check_channel(0x4000, 10.0, 16, 10.0 * 16384.0 / 32767.0, false);
    check_channel(-0x4000, 5.0, 16, -5.0 * 16384.0 / 32767.0, false);
    check_channel(0x4000, -5.0, 16, -5.0 * 16384.0 / 32767.0, false);
}

#[test]
fn the_ends_of_the_range_are_saturation() {
    check_channel(0x7FFF, 10.0, 16, 10.0, true);
    check_channel(0x7FFE, 10.0, 16, 10.0 * 32766.0 / 32767.0, false);
    check_channel(0x7FF0, 10.0, 12, 10.0 * 32752.0 / 32767.0, true);
    check_channel(0x7FE0, 10.0, 12, 10.0 * 32736.0 / 32767.0, false);
    check_channel(i16::MIN, 10.0, 16, -10.0 * 32768.0 / 32767.0, true);
}

#[test]
fn channels_keep_their_order() {
    let mut rig = Rig::started(&[32.767, 3.2767, 0.32767]);
    for (input, raw) in [(1, 1_i16), (2, 20), (3, 300)] {
        rig.fake.set(0x6401, input, &raw.to_le_bytes());
    }
    rig.passes_ms(4);
    let volts: Vec<_> = rig
        .module
        .reading()
        .unwrap()
        .volts
        .iter()
        .map(|volts| (volts.value() * 1e6).round())
        .collect();
    assert_eq!(volts, [1000.0, 2000.0, 3000.0]);
}

#[test]
fn samples_that_stay_away_are_stale_within_four_periods() {
    let mut rig = Rig::started(&[10.0]);
    rig.passes_ms(10);
    rig.fake.manners.no_pdos = true;
    rig.passes_ms(8);
    assert!(
        matches!(rig.alarms[..], [Alarm::StaleSample { .. }]),
        "{:?}",
        rig.alarms
    );
    rig.fake.manners.no_pdos = false;
    rig.passes_ms(10);
    rig.fake.manners.no_pdos = true;
    rig.passes_ms(8);
    assert_eq!(rig.alarms.len(), 2);
}

#[test]
fn a_short_sample_is_told_and_not_taken() {
    let mut rig = Rig::started(&[10.0, 10.0]);
    rig.passes_ms(4);
    let before = rig.module.reading().cloned();
    rig.hear(CanFrame::standard(0x185, &[1, 2, 3]));
    assert_eq!(rig.module.reading().cloned(), before);
    let expected = Alarm::PdoTooShort {
        node: NodeId::new(5).unwrap(),
        expected: 4,
        seen: 3,
    };
    assert_eq!(rig.module.poll_alarm(), Some(expected));
}

#[test]
fn a_drive_is_not_taken_for_an_analog_module() {
    let mut rig = Rig::with(settings(&[10.0]));
    rig.fake.set_u32(0x1000, 0, 0x0002_0192);
    assert!(matches!(
        rig.start(),
        Err(DeviceError::WrongIdentity { .. })
    ));
}

#[test]
fn a_module_without_the_global_enable_is_named() {
    let mut rig = Rig::with(settings(&[10.0]));
    rig.fake.objects.remove(&(0x6423, 0));
    let error = rig.start().unwrap_err();
    assert!(error.to_string().contains("0x6423:00"), "{error}");
}

#[test]
fn a_lost_module_and_a_boot_up_are_alarms() {
    let mut rig = Rig::started(&[10.0]);
    rig.passes_ms(60);
    rig.fake.boot();
    // Process data at the next SYNC would mean that a twin has booted.
    rig.passes_ms(15);
    assert!(matches!(rig.alarms[0], Alarm::UnexpectedBootUp { .. }));
    assert_eq!(rig.module.reading(), None);

    let mut rig = Rig::started(&[10.0]);
    rig.passes_ms(60);
    rig.fake.nmt = None;
    rig.passes_ms(160);
    let lost = |alarm: &Alarm| matches!(alarm, Alarm::HeartbeatLost { .. });
    assert!(rig.alarms.iter().any(lost), "{:?}", rig.alarms);
}

#[test]
fn one_to_four_channels_are_accepted() {
    let common = settings(&[1.0]).common;
    let channel = ChannelSettings {
        input: 1,
        full_scale: Volts(10.0),
    };
    assert_eq!(Cia401Settings::new(common, &[]), None);
    assert_eq!(Cia401Settings::new(common, &[channel; 5]), None);
}
