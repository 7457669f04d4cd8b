//! The measuring module's driver against the fake node.

use super::*;
use crate::device::fake_node::FakeNode;
use wire::can::CanFrame;
use wire::canopen::NodeId;

struct Rig {
    module: Cia404Analog,
    fake: FakeNode,
    now: Time,
    alarms: Vec<Alarm>,
}

fn settings(inputs: &[InputSettings], every_syncs: u8) -> Cia404Settings {
    let node = NodeId::new(5).unwrap();
    let common = NodeSettings::new(node, NodeId::new(127).unwrap(), Duration::from_millis(2));
    Cia404Settings::new(common, inputs, every_syncs).unwrap()
}

/// Six voltages and two thermometers.
fn eight() -> Vec<InputSettings> {
    let voltages = (1..=6).map(InputSettings::voltage);
    voltages
        .chain([InputSettings::pt100(7), InputSettings::pt100(8)])
        .collect()
}

impl Rig {
    fn with(inputs: &[InputSettings]) -> Self {
        let mut fake = FakeNode::new(cia404::DEVICE_TYPE_ANALOG_INPUT);
        for input in 1..=8 {
            fake.set(cia404::SENSOR_TYPE, input, &[0, 0]);
            fake.set(cia404::OPERATION_MODE, input, &[0]);
            fake.set_u32(cia404::PHYSICAL_UNIT, input, 0x002D_0000);
            fake.set(cia404::DECIMAL_DIGITS, input, &[1]);
            fake.set_u32(cia404::SCALING_FACTOR, input, 0x4000_0000);
            fake.set_u32(cia404::SCALING_OFFSET, input, 7);
            fake.set(cia404::PROCESS_VALUE, input, &[0, 0]);
        }
        Self {
            module: Cia404Analog::new(settings(inputs, 1)),
            fake,
            now: Time::ZERO,
            alarms: Vec::new(),
        }
    }

    #[track_caller]
    fn started(inputs: &[InputSettings]) -> Self {
        let mut rig = Self::with(inputs);
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
            if ms.is_multiple_of(2) {
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

    fn set(&mut self, input: u8, raw: i16) {
        self.fake
            .set(cia404::PROCESS_VALUE, input, &raw.to_le_bytes());
    }
}

#[test]
fn a_start_tells_the_module_what_is_wired_and_switches_it_on() {
    let rig = Rig::started(&eight());
    for input in 1..=8 {
        let (sensor, unit, digits) = if input > 6 {
            (30, 0x002D_0000, 2)
        } else {
            (40, 0xFD26_0000_u32, 1)
        };
        assert_eq!(rig.fake.get(cia404::SENSOR_TYPE, input), sensor);
        assert_eq!(rig.fake.get(cia404::PHYSICAL_UNIT, input) as u32, unit);
        assert_eq!(rig.fake.get(cia404::DECIMAL_DIGITS, input), digits);
        assert_eq!(rig.fake.get(cia404::OPERATION_MODE, input), 1);
        assert_eq!(rig.fake.get(cia404::SCALING_FACTOR, input), 0x3F80_0000);
        assert_eq!(rig.fake.get(cia404::SCALING_OFFSET, input), 0);
    }
    assert!(rig.alarms.is_empty());
}

/// 0x380 and 0x480 come behind every drive's RPDO 1 (0x200) and TPDOs 1 and 2.
#[test]
fn samples_travel_behind_the_set_points() {
    let rig = Rig::started(&eight());
    let off = |pdo: u16| rig.fake.get(0x1800 + pdo, 1) & 0x8000_0000 != 0;
    assert_eq!([0, 1, 2, 3].map(off), [true, true, false, false]);
    assert_eq!(rig.fake.get(0x1802, 1) & 0x7FF, 0x385);
    assert_eq!(rig.fake.get(0x1802, 2), 1);
    assert_eq!(rig.fake.get(0x1A02, 4) as u32, 0x7130_0410);
    assert_eq!(rig.fake.get(0x1A03, 4) as u32, 0x7130_0810);
    assert_eq!(rig.module.settings().pdo_bytes(), [8, 8]);
}

#[test]
fn inputs_that_are_not_used_stay_as_they_are() {
    let rig = Rig::started(&[InputSettings::voltage(2)]);
    assert_eq!(rig.fake.get(cia404::OPERATION_MODE, 1), 0);
    assert_eq!(rig.fake.get(cia404::OPERATION_MODE, 2), 1);
    assert_eq!(rig.fake.get(0x1A02, 0), 1);
    let written = &rig.fake.written;
    assert!(
        written
            .iter()
            .all(|(index, sub, _)| *index < 0x2000 || *sub == 2)
    );
}

#[test]
fn counts_become_volts_and_degrees() {
    let mut rig = Rig::started(&eight());
    rig.set(1, 20_000);
    rig.set(6, -5);
    rig.set(7, 2134);
    rig.set(8, -1050);
    rig.passes_ms(4);
    let reading = rig.module.reading().unwrap();
    assert_eq!((rig.module.channels(), reading.volts.len()), (6, 6));
    assert!((reading.volts[0].value() - 2.0).abs() < 1e-12);
    assert!((reading.volts[5].value() + 0.0005).abs() < 1e-12);
    assert_eq!(reading.saturated, [false; 6]);
    let temperatures = rig.module.temperatures().unwrap();
    assert_eq!(rig.module.sensors(), 2);
    let [first, second] = [0, 1].map(|it| temperatures.celsius[it].unwrap().value());
    assert!((first - 21.34).abs() < 1e-12 && (second + 10.5).abs() < 1e-12);
}

#[test]
fn an_end_of_the_range_is_saturation_or_no_sensor() {
    let mut rig = Rig::started(&eight());
    rig.set(2, i16::MAX);
    rig.set(3, i16::MIN);
    rig.set(7, i16::MIN);
    rig.passes_ms(4);
    let saturated = &rig.module.reading().unwrap().saturated;
    assert_eq!(saturated[..4], [false, true, true, false]);
    assert_eq!(rig.module.temperatures().unwrap().celsius[0], None);
}

#[test]
fn a_sample_whose_second_half_is_lost_is_dropped_and_counted() {
    let mut rig = Rig::started(&eight());
    rig.set(1, 100);
    rig.passes_ms(2);
    let before = rig.module.reading().cloned();
    let frame = |id, first: i16| {
        let mut data = [0; 8];
        data[..2].copy_from_slice(&first.to_le_bytes());
        CanFrame::standard(id, &data)
    };
    rig.hear(frame(0x385, 777));
    assert_eq!(rig.module.reading().cloned(), before, "half a sample");
    rig.now += Duration::from_millis(2);
    rig.hear(frame(0x385, 888));
    rig.hear(frame(0x485, 5));
    let reading = rig.module.reading().unwrap();
    assert!((reading.volts[0].value() - 0.0888).abs() < 1e-12);
    assert!(rig.module.counters().contains(&("samples incomplete", 1)));
    // A second half alone is never joined to the next first half.
    rig.now += Duration::from_millis(2);
    rig.hear(frame(0x485, 6));
    rig.now += Duration::from_millis(2);
    rig.hear(frame(0x385, 999));
    assert!((rig.module.reading().unwrap().volts[0].value() - 0.0888).abs() < 1e-12);
}

#[test]
fn a_module_that_falls_silent_is_told() {
    let mut rig = Rig::started(&eight());
    rig.fake.manners.no_pdos = true;
    rig.passes_ms(20);
    assert!(
        matches!(rig.alarms[..], [Alarm::StaleSample { .. }]),
        "{:?}",
        rig.alarms
    );
}

#[test]
fn a_module_that_speaks_seldom_is_given_the_time() {
    let mut rig = Rig::with(&eight());
    rig.module = Cia404Analog::new(settings(&eight(), 10));
    rig.module.start(rig.now);
    let mut syncs = 0;
    let mut outcome = None;
    // The fake node answers transmission type 1 only: here it is made to.
    for _ in 0..3000 {
        rig.exchange();
        rig.now += Duration::from_millis(1);
        let ms = rig.now.nanos() / 1_000_000;
        rig.fake.beat(ms);
        syncs += u32::from(ms.is_multiple_of(2));
        if ms.is_multiple_of(20) && rig.fake.operational() {
            for id in [0x385, 0x485] {
                rig.hear(CanFrame::standard(id, &[0; 8]));
            }
        }
        rig.exchange();
        if rig.module.poll_timeout() <= rig.now {
            rig.module.handle_timeout(rig.now);
        }
        outcome = outcome.or(rig.module.poll_outcome());
    }
    assert_eq!(outcome, Some(Ok(())));
    assert_eq!(rig.fake.get(0x1802, 2), 10);
    assert!(syncs > 1000 && rig.alarms.is_empty(), "{:?}", rig.alarms);
}

#[test]
fn short_pdos_are_told_once_and_read_nothing() {
    let mut rig = Rig::started(&eight());
    let before = rig.module.reading().cloned().map(|it| it.volts);
    rig.fake.manners.short_pdos = true;
    rig.set(1, 500);
    rig.passes_ms(4);
    let seen = Alarm::PdoTooShort {
        node: NodeId::new(5).unwrap(),
        expected: 8,
        seen: 7,
    };
    assert_eq!(rig.alarms, [seen]);
    assert_eq!(rig.module.reading().cloned().map(|it| it.volts), before);
}

#[test]
fn a_unit_that_the_module_does_not_take_ends_the_start() {
    let mut rig = Rig::with(&eight());
    rig.fake
        .manners
        .refuses
        .push((cia404::PHYSICAL_UNIT, 3, 0x0609_0030));
    let error = rig.start().unwrap_err().to_string();
    assert!(
        error.contains("0x6131:03") && error.contains("unit"),
        "{error}"
    );
}

#[test]
fn another_profile_is_refused_before_anything_is_written() {
    let mut rig = Rig::with(&eight());
    rig.fake.set_u32(0x1000, 0, 0x0004_0191);
    assert!(rig.start().is_err());
    assert!(rig.fake.written.is_empty());
}

#[test]
fn settings_that_make_no_module_are_refused() {
    let node = NodeId::new(5).unwrap();
    let common = NodeSettings::new(node, node, Duration::from_millis(2));
    let one = [InputSettings::voltage(1)];
    let nine: Vec<_> = (1..=9).map(InputSettings::voltage).collect();
    let twice = [InputSettings::voltage(1), InputSettings::pt100(1)];
    assert!(Cia404Settings::new(common, &one, 240).is_some());
    for (inputs, every) in [
        (&one[..], 0),
        (&one, 241),
        (&[], 1),
        (&nine, 1),
        (&twice, 1),
    ] {
        assert_eq!(Cia404Settings::new(common, inputs, every), None);
    }
}
