//! The driver against a small amplifier, line by line, in virtual time.

mod fake;

use core::time::Duration;

use proptest::prelude::*;
use units::{Metres, MetresPerSecond, MetresPerSecondSquared, Scale};
use wire::LineControl;
use wire::copley::{Address, CR, Faults};

use super::*;
use crate::device::AmplifierTrouble;
use fake::{Fake, Spoil};

const MS: Duration = Duration::from_millis(1);

fn settings() -> CopleySettings {
    let address = Address::node(2).unwrap();
    let scale = Scale::new(Metres(10e-9)).unwrap();
    let (speed, acceleration) = (MetresPerSecond(0.1), MetresPerSecondSquared(5.0));
    CopleySettings {
        soft_limits: Some((Metres::from_mm(-10.0), Metres::from_mm(10.0))),
        following_error: Some(Metres::from_um(50.0)),
        read_following_error: false,
        ..CopleySettings::new(address, scale, speed, acceleration)
    }
}

struct Rig {
    axis: CopleyAxis,
    fake: Fake,
    now: Time,
    /// Everything that was sent, lines without their ends.
    sent: Vec<String>,
    alarms: Vec<Alarm>,
}

impl Rig {
    fn with(settings: CopleySettings) -> Self {
        Self {
            axis: CopleyAxis::new(settings),
            fake: Fake::new(),
            now: Time(1_000_000),
            sent: Vec::new(),
            alarms: Vec::new(),
        }
    }

    fn new() -> Self {
        Self::with(settings())
    }

    #[track_caller]
    fn enabled() -> Self {
        let mut rig = Self::new();
        rig.start().unwrap();
        rig.does(DriveCommand::Enable).unwrap();
        rig.live(MS * 100);
        rig.sent.clear();
        rig
    }

    fn transmit(&mut self) {
        while self.axis.line_use().may_speak([]) {
            let Some(payload) = self.axis.poll_transmit() else {
                break;
            };
            self.sent.push(match &payload {
                Payload::Bytes(bytes) => {
                    assert_eq!(bytes.last(), Some(&CR));
                    String::from_utf8_lossy(&bytes[..bytes.len() - 1]).into_owned()
                }
                Payload::Control(LineControl::Baud(rate)) => format!("<{rate}>"),
                Payload::Control(LineControl::Break(true)) => "<break>".to_owned(),
                Payload::Control(LineControl::Break(false)) => "</break>".to_owned(),
                Payload::Frame(frame) => panic!("{frame}"),
            });
            self.fake.hear(self.now, &payload);
        }
    }

    fn tick(&mut self, until: Time) {
        self.transmit();
        let next = self.axis.poll_timeout().min(self.fake.next_event());
        self.now = next.max(self.now).min(until);
        if let Some(reply) = self.fake.poll(self.now) {
            // However they are cut.
            let (head, tail) = reply.split_at(reply.len() / 2);
            for part in [head, tail] {
                let input = Input::Payload(Payload::Bytes(part.to_vec()));
                self.axis.handle(self.now, &input);
            }
        }
        if self.axis.poll_timeout() <= self.now {
            self.axis.handle_timeout(self.now);
        }
        self.transmit();
        while let Some(alarm) = self.axis.poll_alarm() {
            self.alarms.push(alarm);
        }
    }

    fn live(&mut self, span: Duration) {
        let until = self.now + span;
        while self.now < until {
            self.tick(until);
        }
    }

    #[track_caller]
    fn outcome(&mut self) -> Result<(), DeviceError> {
        let until = self.now + Duration::from_secs(60);
        loop {
            if let Some(outcome) = self.axis.poll_outcome() {
                return outcome;
            }
            assert!(self.now < until, "no outcome; sent {:?}", self.sent);
            self.tick(until);
        }
    }

    #[track_caller]
    fn start(&mut self) -> Result<(), DeviceError> {
        self.axis.start(self.now);
        self.outcome()
    }

    fn begin(&mut self, command: impl Into<AxisCommand>) {
        self.axis.command(self.now, command.into());
    }

    #[track_caller]
    fn does(&mut self, command: impl Into<AxisCommand>) -> Result<(), DeviceError> {
        self.begin(command);
        self.outcome()
    }

    fn count(&self, line: &str) -> usize {
        self.sent.iter().filter(|sent| *sent == line).count()
    }

    /// What was sent that is no look at how things are.
    fn commands(&self) -> Vec<&str> {
        const LOOKS: [&str; 5] = ["0xa0", "0x17", "0xc9", "0x35", "0xb7"];
        let is_look =
            |line: &str| line.contains(" g ") && LOOKS.iter().any(|it| line.ends_with(it));
        let lines = self.sent.iter().map(String::as_str);
        lines.filter(|line| !is_look(line)).collect()
    }
}

fn to(mm: f64) -> AxisCommand {
    AxisCommand::MoveTo {
        target: Metres::from_mm(mm),
        speed: MetresPerSecond(0.02),
        acceleration: MetresPerSecondSquared(0.2),
    }
}

fn prepare(mm: f64) -> AxisCommand {
    AxisCommand::Prepare {
        target: Metres::from_mm(mm),
        speed: MetresPerSecond(0.02),
        acceleration: MetresPerSecondSquared(0.2),
    }
}

#[test]
fn an_amplifier_at_the_lines_rate_is_not_disturbed() {
    let mut rig = Rig::new();
    rig.fake.rate = 115_200;
    rig.start().unwrap();
    assert_eq!(
        rig.commands()[..7],
        [
            "<115200>",
            "g r0x90",
            "2 g f0x81",
            "2 g f0x80",
            "2 g r0x94",
            "2 s r0x24 0",
            "2 s r0xc8 0",
        ]
    );
    let identity = rig.axis.identity().unwrap();
    assert_eq!((identity.serial, &*identity.name), (4002, "MOCK-055-18"));
    assert_eq!(identity.revision, 0x050C);
    assert_eq!(rig.axis.power_state(), Some(PowerState::SwitchOnDisabled));
}

#[test]
fn an_amplifier_after_power_on_is_broken_in_and_brought_to_the_lines_rate() {
    let mut rig = Rig::new();
    rig.start().unwrap();
    assert_eq!(
        rig.commands()[..12],
        [
            "<115200>",
            "g r0x90",
            "g r0x90",
            "g r0x90",
            "<break>",
            "</break>",
            "<9600>",
            "g r0x90",
            "s r0x90 115200",
            "<115200>",
            "g r0x90",
            "2 g f0x81",
        ]
    );
    assert_eq!(rig.fake.rate, 115_200);
}

#[test]
fn an_amplifier_that_is_only_asked_who_it_is_stays_as_it_is() {
    let mut rig = Rig::new();
    rig.fake.rate = 115_200;
    rig.axis.identify(rig.now);
    rig.outcome().unwrap();
    rig.live(MS * 1000);
    assert_eq!(
        rig.sent,
        ["<115200>", "g r0x90", "2 g f0x81", "2 g f0x80", "2 g r0x94"]
    );
    assert_eq!(rig.axis.identity().unwrap().serial, 4002);
    assert_eq!(rig.axis.power_state(), None);
    rig.start().unwrap();
    assert!(rig.axis.power_state().is_some());
}

#[test]
fn what_the_start_sets_is_read_back() {
    let mut rig = Rig::new();
    rig.start().unwrap();
    let ram = |parameter: Parameter| rig.fake.ram[&parameter.0];
    // 5 m/s² of 10 nm in 10 counts/s²; 50 µm; 1 µm; 10 ms.
    assert_eq!(ram(Parameter::ABORT_DECELERATION), 50_000_000);
    assert_eq!(ram(Parameter::FOLLOWING_ERROR_LIMIT), 5000);
    assert_eq!(ram(Parameter::TRACKING_WINDOW), 100);
    assert_eq!(ram(Parameter::TRACKING_WINDOW_TIME), 10);
    assert_eq!(rig.count("2 g r0xcf"), 1);
    let mut rig = Rig::new();
    let wrong = ("g r0xcf", Spoil::Replace("v 5\r"));
    rig.fake.spoils.extend([wrong.clone(), wrong]);
    let refused = rig.start();
    let Err(DeviceError::ParameterReadBack { seen, .. }) = &refused else {
        panic!("{refused:?}")
    };
    assert_eq!(seen, "5");
}

#[test]
fn another_amplifier_is_refused_before_anything_is_written() {
    let mut rig = Rig::with(CopleySettings {
        serial: Some(4003),
        ..settings()
    });
    let refused = rig.start().unwrap_err();
    assert!(matches!(refused, DeviceError::WrongAmplifier { .. }));
    assert_eq!(
        refused.to_string(),
        "amplifier 2: serial number is 4002, the configuration says 4003; fit the right device or \
         correct the configuration"
    );
    assert!(rig.sent.iter().all(|line| !line.starts_with("2 s")));
}

#[test]
fn a_line_without_an_amplifier_is_given_up_in_time() {
    let mut rig = Rig::new();
    rig.fake.on = false;
    let begun = rig.now;
    let failed = rig.start();
    assert!(
        matches!(failed, Err(DeviceError::Timeout { .. })),
        "{failed:?}"
    );
    let took = rig.now.since(begun);
    assert!(
        took >= Duration::from_secs(10) && took < Duration::from_secs(12),
        "{took:?}"
    );
    assert_eq!(rig.axis.line_use(), LineUse::Idle);
}

/// Another axis has looked for the same amplifier meanwhile.
#[test]
fn an_axis_that_waited_for_the_line_asks_at_each_rate_once_and_gives_up() {
    let mut rig = Rig::new();
    rig.fake.on = false;
    rig.axis.start(rig.now);
    rig.now += MS * 11_000;
    let begun = rig.now;
    let failed = rig.outcome();
    assert!(
        matches!(failed, Err(DeviceError::Timeout { .. })),
        "{failed:?}"
    );
    let took = rig.now.since(begun);
    assert!(took < MS * 1500, "{took:?}");
    assert_eq!(rig.sent.iter().filter(|it| *it == "<9600>").count(), 1);
}

#[test]
fn an_axis_says_what_it_looks_for_as_long_as_it_does() {
    let mut rig = Rig::new();
    assert_eq!(rig.axis.looks_for(), None);
    rig.axis.start(rig.now);
    let said = rig.axis.looks_for().expect("it looks for something");
    assert!(said.contains("115200") && said.contains("9600"), "{said}");
    rig.outcome().unwrap();
    assert_eq!(rig.axis.looks_for(), None);
}

/// 3 mm of 10 nm; 20 mm/s in 0.1 counts/s; 0.2 m/s² in 10 counts/s².
#[test]
fn a_move_is_loaded_read_back_and_started() {
    let mut rig = Rig::enabled();
    rig.does(to(3.0)).unwrap();
    assert_eq!(
        rig.commands(),
        [
            "2 s r0xca 300000",
            "2 g r0xca",
            "2 s r0xcb 20000000",
            "2 g r0xcb",
            "2 s r0xcc 2000000",
            "2 g r0xcc",
            "2 s r0xcd 2000000",
            "2 g r0xcd",
            "2 g r0x3d",
            "2 t 1",
        ]
    );
    assert!(rig.axis.started_at().is_some());
    let reading = rig.axis.reading().unwrap();
    assert_eq!(reading.position, Metres::from_mm(3.0));
    assert!(reading.standing);
    rig.sent.clear();
    // The profile is known.
    rig.does(to(-1.0)).unwrap();
    let expected = ["2 s r0xca -100000", "2 g r0xca", "2 g r0x3d", "2 t 1"];
    assert_eq!(rig.commands(), expected);
}

#[test]
fn a_prepared_move_moves_nothing_until_it_is_started() {
    let mut rig = Rig::enabled();
    rig.does(prepare(3.0)).unwrap();
    assert_eq!(rig.count("2 t 1"), 0);
    assert_eq!(rig.axis.started_at(), None);
    rig.live(Duration::from_secs(1));
    assert_eq!(rig.fake.position, 0);
    rig.sent.clear();
    rig.does(AxisCommand::Start).unwrap();
    assert_eq!(rig.commands(), ["2 t 1"]);
    assert_eq!(rig.fake.position, 300_000);
}

#[track_caller]
fn check_nothing_prepared(rig: &mut Rig) {
    rig.sent.clear();
    let refused = rig.does(AxisCommand::Start);
    assert!(
        matches!(
            refused,
            Err(DeviceError::NotPossible {
                step: "starting",
                ..
            })
        ),
        "{refused:?}"
    );
    assert_eq!(rig.count("2 t 1"), 0);
}

#[test]
fn a_start_with_nothing_prepared_is_refused() {
    let mut rig = Rig::enabled();
    check_nothing_prepared(&mut rig);
    rig.does(prepare(3.0)).unwrap();
    rig.does(DriveCommand::Halt).unwrap();
    check_nothing_prepared(&mut rig);
    rig.does(prepare(3.0)).unwrap();
    rig.does(AxisCommand::Start).unwrap();
    check_nothing_prepared(&mut rig);
    rig.does(prepare(1.0)).unwrap();
    rig.fake.events.insert(EventStatus::AMPLIFIER_HOT);
    rig.live(MS * 100);
    check_nothing_prepared(&mut rig);
}

#[test]
fn a_target_beyond_the_soft_limits_or_a_speed_beyond_the_axis_is_refused_unsent() {
    let mut rig = Rig::enabled();
    let refused = rig.does(to(10.001)).unwrap_err().to_string();
    assert_eq!(
        refused,
        "amplifier 2: target 0.010001 m does not fit parameter 0xca (limit 0.01 m)"
    );
    let refused = rig.does(AxisCommand::MoveTo {
        target: Metres::ZERO,
        speed: MetresPerSecond(0.11),
        acceleration: MetresPerSecondSquared(0.2),
    });
    assert!(matches!(
        refused,
        Err(DeviceError::ParameterOutOfRange { .. })
    ));
    assert_eq!(rig.commands(), [""; 0]);
}

#[test]
fn a_lost_ok_to_a_move_that_has_begun_is_never_answered_by_another_start() {
    let mut rig = Rig::enabled();
    rig.fake.spoils.push_back(("t 1", Spoil::Lose));
    rig.does(to(3.0)).unwrap();
    assert_eq!(rig.count("2 t 1"), 1);
    // The fence, then what has become of it.
    assert_eq!(rig.count("2 g f0x81"), 1);
    assert_eq!(rig.fake.position, 300_000);
}

#[test]
fn a_start_that_was_lost_is_sent_again_only_when_nothing_has_begun() {
    let mut rig = Rig::enabled();
    rig.fake.spoils.push_back(("t 1", Spoil::LoseCommand));
    rig.does(to(3.0)).unwrap();
    assert_eq!(rig.count("2 t 1"), 2);
    let mut rig = Rig::enabled();
    let lost = ("t 1", Spoil::LoseCommand);
    rig.fake.spoils.extend([lost.clone(), lost]);
    let failed = rig.does(to(3.0));
    assert!(
        matches!(failed, Err(DeviceError::Unanswered { .. })),
        "{failed:?}"
    );
    assert_eq!(rig.count("2 t 1"), 2);
}

#[test]
fn a_start_in_company_that_was_lost_fails_and_does_not_come_late() {
    let mut rig = Rig::enabled();
    rig.does(prepare(3.0)).unwrap();
    rig.fake.spoils.push_back(("t 1", Spoil::LoseCommand));
    let failed = rig.does(AxisCommand::Start);
    assert!(
        matches!(failed, Err(DeviceError::Unanswered { .. })),
        "{failed:?}"
    );
    rig.live(Duration::from_secs(1));
    assert_eq!(rig.count("2 t 1"), 1);
    assert_eq!(rig.fake.position, 0);
}

#[test]
fn a_target_that_reads_back_otherwise_is_never_started() {
    let mut rig = Rig::enabled();
    let wrong = ("g r0xca", Spoil::Replace("v 700000\r"));
    rig.fake.spoils.extend([wrong.clone(), wrong]);
    let failed = rig.does(to(3.0));
    assert!(
        matches!(failed, Err(DeviceError::ParameterReadBack { .. })),
        "{failed:?}"
    );
    assert_eq!(rig.count("2 t 1"), 0);
    // One wrong digit on the way back is not the amplifier's.
    let mut rig = Rig::enabled();
    rig.fake
        .spoils
        .push_back(("g r0xca", Spoil::Replace("v 700000\r")));
    rig.does(to(3.0)).unwrap();
}

#[test]
fn a_late_reply_is_never_taken_for_the_present_one() {
    let mut rig = Rig::enabled();
    // It comes in the middle of what is asked after it was given up.
    rig.fake
        .spoils
        .push_back(("g r0x3d", Spoil::Delay(MS * 180)));
    rig.does(to(3.0)).unwrap();
    let counters = rig.axis.counters();
    let late = counters
        .iter()
        .find(|(name, _)| *name == "late lines dropped");
    assert!(late.is_some_and(|(_, count)| *count >= 1), "{counters:?}");
    assert_eq!(rig.fake.position, 300_000);
    assert_eq!(rig.alarms, []);
}

#[test]
fn a_command_that_was_not_understood_is_sent_again_and_a_refused_one_is_named() {
    let mut rig = Rig::enabled();
    let garbled = ("s r0xca", Spoil::Replace("e 33\r"));
    rig.fake.spoils.extend([garbled.clone(), garbled]);
    rig.does(to(3.0)).unwrap();
    assert_eq!(rig.count("2 s r0xca 300000"), 3);
    rig.fake
        .spoils
        .push_back(("s r0xca", Spoil::Replace("e 10\r")));
    let refused = rig.does(to(2.0)).unwrap_err().to_string();
    assert_eq!(
        refused,
        "amplifier 2, parameter 0xca: error 10 (value out of range) while loading the move"
    );
}

#[test]
fn a_node_that_the_one_at_the_cable_cannot_reach_is_asked_three_times() {
    let mut rig = Rig::enabled();
    let away = ("s r0xca", Spoil::Replace("e 32\r"));
    rig.fake.spoils.extend([away.clone(), away.clone(), away]);
    let failed = rig.does(to(3.0));
    let Err(DeviceError::Unanswered { attempts, .. }) = failed else {
        panic!("{failed:?}")
    };
    assert_eq!(attempts, 3);
    assert_eq!(rig.count("2 s r0xca 300000"), 3);
}

#[test]
fn a_position_that_cannot_be_is_doubted_once_and_an_alarm_the_second_time() {
    let mut rig = Rig::enabled();
    rig.does(AxisCommand::HomeHere {
        position: Metres::ZERO,
    })
    .unwrap();
    let foreign = ("g r0x17", Spoil::Replace("v 9000000\r"));
    rig.fake.spoils.push_back(foreign.clone());
    rig.live(MS * 200);
    assert_eq!(rig.alarms, []);
    assert_eq!(rig.axis.reading().unwrap().position, Metres::ZERO);
    rig.fake.spoils.extend([foreign.clone(), foreign]);
    rig.live(MS * 200);
    assert!(
        rig.alarms
            .iter()
            .any(|it| matches!(it, Alarm::AmplifierJumped { .. })),
        "{:?}",
        rig.alarms
    );
    assert!(!rig.axis.is_homed());
}

#[test]
fn homing_here_keeps_the_amplifiers_zero_and_remembers_the_coordinate() {
    let mut rig = Rig::enabled();
    rig.does(to(3.0)).unwrap();
    rig.does(AxisCommand::HomeHere {
        position: Metres::from_mm(-2.0),
    })
    .unwrap();
    assert!(rig.axis.is_homed());
    rig.live(MS * 50);
    assert_eq!(rig.axis.reading().unwrap().position, Metres::from_mm(-2.0));
    // -10 to 10 mm, seen from -2 mm.
    assert_eq!(rig.fake.ram[&Parameter::SOFT_LIMIT_POSITIVE.0], 1_200_000);
    assert_eq!(rig.fake.ram[&Parameter::SOFT_LIMIT_NEGATIVE.0], -800_000);
    rig.does(to(1.0)).unwrap();
    assert_eq!(rig.fake.position, 300_000);
    assert_eq!(rig.axis.reading().unwrap().position, Metres::from_mm(1.0));
}

#[test]
fn homing_on_the_switch_searches_in_the_axiss_own_direction() {
    let position = Metres::from_mm(-9.0);
    let speed = MetresPerSecond(0.005);
    let on_switch = AxisCommand::HomeNegativeLimit { position, speed };
    let on_index = AxisCommand::HomeIndex { position, speed };
    for (command, resolution, method) in [
        (on_switch, 10e-9, 529),
        (on_switch, -10e-9, 513),
        (on_index, 10e-9, 561),
        (on_index, -10e-9, 545),
    ] {
        let mut rig = Rig::with(CopleySettings {
            scale: Scale::new(Metres(resolution)).unwrap(),
            ..settings()
        });
        rig.start().unwrap();
        rig.does(DriveCommand::Enable).unwrap();
        rig.does(command).unwrap();
        assert_eq!(rig.fake.ram[&Parameter::HOMING_METHOD.0], method);
        // 5 mm/s in 0.1 counts/s, and a fifth of it off the switch.
        assert_eq!(rig.fake.ram[&Parameter::HOMING_SPEED_FAST.0], 5_000_000);
        assert_eq!(rig.fake.ram[&Parameter::HOMING_SPEED_SLOW.0], 1_000_000);
        assert_eq!(rig.axis.reading().unwrap().position, position);
    }
}

#[test]
fn a_quick_stop_aborts_waits_for_rest_and_disables() {
    let mut rig = Rig::enabled();
    rig.begin(to(3.0));
    rig.live(MS * 100);
    rig.sent.clear();
    rig.does(DriveCommand::QuickStop).unwrap();
    assert_eq!(rig.commands(), ["2 t 0", "2 s r0x24 0"]);
    assert_eq!(rig.axis.power_state(), Some(PowerState::SwitchOnDisabled));
    // That is no alarm: it was told to.
    rig.live(MS * 100);
    assert_eq!(rig.alarms, []);
}

#[test]
fn a_quick_stop_waits_for_no_more_than_the_exchange_under_way() {
    let mut rig = Rig::enabled();
    rig.begin(to(3.0));
    rig.live(MS * 100);
    rig.fake.spoils.push_back(("g", Spoil::Lose));
    rig.live(MS * 25);
    let told = rig.now;
    rig.sent.clear();
    rig.begin(DriveCommand::QuickStop);
    while rig.count("2 t 0") == 0 {
        rig.tick(told + Duration::from_secs(1));
    }
    let waited = rig.now.since(told);
    assert!(waited <= MS * 105, "{waited:?}");
    rig.outcome().unwrap();
    assert_eq!(rig.fake.arrives(), None);
}

#[test]
fn a_quick_stop_whose_oks_are_lost_still_disables() {
    let mut rig = Rig::enabled();
    rig.begin(to(3.0));
    rig.live(MS * 50);
    let lost = ("t 0", Spoil::Lose);
    rig.fake.spoils.extend([lost.clone(), lost.clone(), lost]);
    rig.does(DriveCommand::QuickStop).unwrap();
    assert_eq!(rig.axis.power_state(), Some(PowerState::SwitchOnDisabled));
}

#[test]
fn a_halt_stays_enabled_and_the_next_move_goes_on() {
    let mut rig = Rig::enabled();
    rig.begin(to(3.0));
    rig.live(MS * 100);
    rig.does(DriveCommand::Halt).unwrap();
    assert_eq!(rig.axis.power_state(), Some(PowerState::OperationEnabled));
    assert!(rig.fake.position < 300_000);
    rig.does(to(1.0)).unwrap();
}

#[test]
fn a_move_that_the_amplifier_aborts_is_told_as_aborted() {
    let mut rig = Rig::enabled();
    rig.begin(to(3.0));
    rig.live(MS * 100);
    // As a limit switch makes it do, without a bit that would be an alarm.
    let abort = Payload::Bytes(b"t 0\r".to_vec());
    rig.fake.hear(rig.now, &abort);
    let failed = rig.outcome();
    assert!(
        matches!(failed, Err(DeviceError::Aborted { .. })),
        "{failed:?}"
    );
}

#[test]
fn a_move_that_is_taken_and_not_begun_is_told() {
    let mut rig = Rig::enabled();
    rig.does(prepare(3.0)).unwrap();
    rig.fake.spoils.push_back(("t 1", Spoil::Replace("ok\r")));
    rig.fake.events.insert(EventStatus::OUTPUTS_OFF);
    rig.begin(AxisCommand::Start);
    let failed = rig.outcome();
    assert!(
        matches!(
            failed,
            Err(DeviceError::Alarmed { .. } | DeviceError::Timeout { .. })
        ),
        "{failed:?}"
    );
}

#[track_caller]
fn check_trouble(bits: EventStatus, expected: &[AmplifierTrouble]) {
    let mut rig = Rig::enabled();
    rig.fake.events.insert(bits);
    rig.live(MS * 200);
    let device = DeviceName::Amplifier(Address::node(2).unwrap());
    let expected: Vec<_> = expected
        .iter()
        .map(|trouble| Alarm::Amplifier {
            device,
            trouble: *trouble,
        })
        .collect();
    // Once, however long it lasts.
    assert_eq!(rig.alarms, expected, "{bits:?}");
}

#[test]
fn each_trouble_of_the_amplifier_is_an_alarm_by_its_name_once() {
    use AmplifierTrouble as Trouble;
    check_trouble(EventStatus::SHORT_CIRCUIT, &[Trouble::ShortCircuit]);
    check_trouble(EventStatus::AMPLIFIER_HOT, &[Trouble::AmplifierHot]);
    check_trouble(EventStatus::MOTOR_HOT, &[Trouble::MotorHot]);
    check_trouble(EventStatus::TRACKING_ERROR, &[Trouble::TrackingError]);
    check_trouble(EventStatus::FEEDBACK_ERROR, &[Trouble::EncoderError]);
    check_trouble(
        EventStatus::POSITIVE_LIMIT_SWITCH,
        &[Trouble::PositiveLimitSwitch],
    );
    check_trouble(EventStatus::OUTPUTS_OFF, &[Trouble::Disabled]);
    check_trouble(
        EventStatus::NOT_ENABLED_BY_INPUT | EventStatus::OUTPUTS_OFF,
        &[Trouble::EnableInputOff, Trouble::Disabled],
    );
    check_trouble(EventStatus::TRACKING_WARNING, &[]);
}

#[test]
fn a_latched_fault_is_read_by_name_keeps_it_from_being_enabled_and_is_reset_once() {
    let mut rig = Rig::enabled();
    rig.fake.ram.insert(Parameter::FAULTS.0, 512);
    rig.fake.events.insert(EventStatus::FAULT);
    rig.live(MS * 200);
    let device = DeviceName::Amplifier(Address::node(2).unwrap());
    let faults = Faults::FOLLOWING_ERROR;
    let trouble = AmplifierTrouble::Faults(faults);
    assert_eq!(rig.alarms, [Alarm::Amplifier { device, trouble }]);
    assert_eq!(rig.axis.power_state(), Some(PowerState::Fault));
    let refused = rig.does(DriveCommand::Enable);
    let step = "enabling";
    assert_eq!(
        refused,
        Err(DeviceError::Faulted {
            device,
            step,
            faults
        })
    );
    rig.sent.clear();
    rig.fake.spoils.push_back(("s r0xa4", Spoil::Lose));
    rig.does(DriveCommand::ResetFault).unwrap();
    assert_eq!(rig.count("2 s r0xa4 512"), 1);
    rig.does(DriveCommand::Enable).unwrap();
}

#[test]
fn an_amplifier_that_restarts_is_found_out_and_has_lost_its_reference() {
    let mut rig = Rig::enabled();
    rig.does(AxisCommand::HomeHere {
        position: Metres::ZERO,
    })
    .unwrap();
    rig.live(Duration::from_secs(3));
    rig.fake.restart(rig.now);
    rig.live(Duration::from_secs(3));
    let device = DeviceName::Amplifier(Address::node(2).unwrap());
    assert!(
        rig.alarms.contains(&Alarm::AmplifierRestarted { device }),
        "{:?}",
        rig.alarms
    );
    assert!(!rig.axis.is_homed());
    // Found again behind a BREAK.
    assert_eq!(rig.fake.rate, 115_200);
}

#[test]
fn a_wrong_digit_in_its_uptime_is_no_restart() {
    let mut rig = Rig::enabled();
    rig.live(Duration::from_secs(3));
    for wrong in ["v 12\r", "v 99999999\r"] {
        rig.fake
            .spoils
            .push_back(("g r0xb7", Spoil::Replace(wrong)));
        rig.live(Duration::from_secs(3));
    }
    assert_eq!(rig.alarms, []);
}

#[test]
fn an_amplifier_that_falls_silent_is_an_alarm_in_time_and_once() {
    let mut rig = Rig::enabled();
    rig.fake.on = false;
    let since = rig.now;
    while rig.alarms.is_empty() {
        rig.tick(since + Duration::from_secs(2));
        assert!(rig.now < since + Duration::from_secs(2));
    }
    let took = rig.now.since(since);
    assert!(took <= MS * 750, "{took:?}");
    rig.live(Duration::from_secs(30));
    let silent = |alarm: &&Alarm| matches!(alarm, Alarm::AmplifierSilent { .. });
    assert_eq!(rig.alarms.iter().filter(silent).count(), 1);
}

#[test]
fn commands_before_the_start_are_refused_and_nothing_is_sent() {
    let mut rig = Rig::new();
    let commands = [
        DriveCommand::QuickStop.into(),
        DriveCommand::Enable.into(),
        to(1.0),
    ];
    for command in commands {
        let refused = rig.does(command);
        assert!(matches!(refused, Err(DeviceError::NotPossible { .. })));
    }
    assert_eq!(rig.sent, [""; 0]);
}

#[test]
fn a_disabled_axis_does_not_move() {
    let mut rig = Rig::new();
    rig.start().unwrap();
    rig.sent.clear();
    let refused = rig.does(to(1.0));
    assert!(matches!(refused, Err(DeviceError::NotPossible { .. })));
    assert_eq!(rig.commands(), [""; 0]);
}

/// Bytes of others' exchanges and noise, in any state.
fn noise() -> impl Strategy<Value = Vec<Vec<u8>>> {
    let byte = prop_oneof![
        3 => prop::sample::select(b"okver 0123456789-x\r".to_vec()),
        1 => any::<u8>(),
    ];
    prop::collection::vec(prop::collection::vec(byte, 0..24), 0..12)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn no_bytes_make_it_panic_or_start_twice(noise in noise(), pause_ms in 1u32..40) {
        let mut rig = Rig::new();
        rig.fake.rate = 115_200;
        rig.start().unwrap();
        rig.does(DriveCommand::Enable).unwrap();
        rig.begin(to(3.0));
        for bytes in noise {
            rig.axis.handle(rig.now, &Input::Payload(Payload::Bytes(bytes)));
            rig.live(MS * pause_ms);
        }
        let _ = rig.outcome();
        prop_assert!(rig.count("2 t 1") <= 2);
    }

    #[test]
    fn what_is_said_while_it_does_not_hold_the_line_means_nothing(noise in noise()) {
        let mut rig = Rig::enabled();
        while rig.axis.line_use() == LineUse::Holds {
            rig.tick(rig.now + MS);
        }
        let before = rig.axis.reading();
        for bytes in noise {
            rig.axis.handle(rig.now, &Input::Payload(Payload::Bytes(bytes)));
        }
        prop_assert_eq!(rig.axis.reading(), before);
        prop_assert_eq!(rig.axis.poll_outcome(), None);
    }
}

const INDEX: AxisCommand = AxisCommand::HomeIndex {
    position: Metres(0.0),
    speed: MetresPerSecond(0.005),
};

#[test]
fn bits_of_a_homing_before_are_not_believed() {
    let mut rig = Rig::enabled();
    rig.does(INDEX).unwrap();
    rig.does(to(3.0)).unwrap();
    rig.fake.stale_until = Some(MS * 250);
    rig.does(INDEX).unwrap();
    assert!(rig.axis.is_homed());
    assert_eq!(rig.fake.position, 0, "it was homed again");
    assert_eq!(rig.alarms, []);
}

#[test]
fn a_homing_that_never_begins_is_not_believed() {
    let timeouts = CopleyTimeouts {
        homing: Duration::from_secs(5),
        ..CopleyTimeouts::default()
    };
    let mut rig = Rig::with(CopleySettings {
        timeouts,
        ..settings()
    });
    rig.start().unwrap();
    rig.does(DriveCommand::Enable).unwrap();
    rig.does(INDEX).unwrap();
    rig.does(to(3.0)).unwrap();
    rig.fake.stale_until = Some(Duration::from_secs(3600));
    let failed = rig.does(INDEX).unwrap_err();
    assert!(matches!(failed, DeviceError::Timeout { .. }), "{failed}");
    assert!(!rig.axis.is_homed());
}

#[test]
fn a_motion_in_another_unit_of_speed_is_stopped() {
    let mut rig = Rig::enabled();
    rig.fake.hurry = 5.0;
    let failed = rig.does(to(9.0)).unwrap_err();
    assert!(matches!(failed, DeviceError::Alarmed { .. }), "{failed}");
    let [Alarm::TooFast { seen, limit, .. }] = rig.alarms[..] else {
        panic!("{:?}", rig.alarms)
    };
    assert!(seen.value() > 1.5 * limit.value(), "{seen} of {limit}");
    rig.live(MS * 500);
    assert_eq!(rig.count("2 t 0"), 1);
    assert!(rig.fake.position < 500_000, "{}", rig.fake.position);
    assert!(rig.fake.events.contains(EventStatus::OUTPUTS_OFF));
    assert!(
        rig.axis.poll_outcome().is_none(),
        "nobody asked for the stop"
    );
}

#[test]
fn an_axis_that_leaves_its_place_is_stopped() {
    let mut rig = Rig::enabled();
    rig.does(to(3.0)).unwrap();
    rig.fake.position += 400;
    rig.live(MS * 100);
    assert_eq!(rig.alarms, [], "within the hold limit");
    rig.fake.position += 4_000;
    rig.live(MS * 500);
    let [Alarm::OutsideEnvelope { .. }] = rig.alarms[..] else {
        panic!("{:?}", rig.alarms)
    };
    assert!(rig.fake.events.contains(EventStatus::OUTPUTS_OFF));
}

#[test]
fn enabling_an_axis_that_moves_ends_its_move() {
    let mut rig = Rig::enabled();
    rig.axis.command(rig.now, to(9.0));
    rig.live(MS * 300);
    assert!(rig.fake.arrives().is_some(), "it moves");
    rig.does(DriveCommand::Enable).unwrap();
    assert!(rig.fake.arrives().is_none());
    let stands = rig.fake.position;
    rig.live(MS * 1000);
    assert_eq!(rig.fake.position, stands);
    assert_eq!(rig.alarms, []);
}
