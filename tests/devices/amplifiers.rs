//! Three servo amplifiers behind one serial line, and the same three axes on CAN.

use core::time::Duration;
use std::cell::RefCell;
use std::rc::Rc;

use drivers::device::{Alarm, AmplifierTrouble, AxisCommand, DeviceError, DriveCommand};
use mock_bus::fault::{Fault, FaultConfig, FaultId};
use mock_bus::node::cia402_drive::Cia402DriveNode;
use mock_bus::node::copley_amp::CopleyAmpsNode;
use mock_bus::simulation::Simulation;
use tests::{Emulator, Group, Rig, Setup, Stand, rigs};
use machine::{Observer, Stage};
use units::{Metres, MetresPerSecond, MetresPerSecondSquared, Time};
use wire::cia402::PowerState;

const NODE: &str = "amplifiers";
const HERE_IS_ZERO: AxisCommand = AxisCommand::HomeHere {
    position: Metres::ZERO,
};

fn targets() -> [Metres; 3] {
    [1.0, -0.7, 0.4].map(Metres::from_mm)
}

fn over_serial() -> Setup {
    Setup::uvw_copley(41)
}

fn over_can() -> Setup {
    Setup::uvw(41)
}

fn group(rig: Rig, setup: &Setup) -> Group {
    Group::new(Emulator::new(rig, setup))
}

/// Runs `procedure` with the started axes of `setup`.
#[track_caller]
fn check_on(
    rigs: &[Rig],
    setup: &Setup,
    procedure: impl Fn(&mut Group) -> Result<(), DeviceError>,
) {
    for rig in rigs.iter().copied() {
        let mut group = group(rig, setup);
        if let Err(error) = group.start().and_then(|()| procedure(&mut group)) {
            let counters: Vec<_> = (0..3).map(|at| group.axis(at).counters()).collect();
            panic!("{rig:?}: {error}; {:?}\n{counters:?}", group.alarms);
        }
    }
}

#[track_caller]
fn check(setup: &Setup, procedure: impl Fn(&mut Group) -> Result<(), DeviceError>) {
    check_on(&rigs(), setup, procedure);
}

/// Where answers are waited for in vain: on a fast clock that takes very long
/// (docs/decisions/0004).
#[track_caller]
fn check_in_virtual_time(procedure: impl Fn(&mut Group) -> Result<(), DeviceError>) {
    check_on(&[Rig::InProcess], &over_serial(), procedure);
}

fn screws(group: &Group) -> [Metres; 3] {
    let positions = |it: &mut Simulation| {
        let truth = it.truth();
        let platform = truth.platform().expect("it is a platform");
        [0, 1, 2].map(|screw| platform.screw_position(screw))
    };
    group.emulator.simulation(positions)
}

fn ready(group: &mut Group) -> Result<(), DeviceError> {
    group.all(DriveCommand::Enable)?;
    group.live(Duration::from_millis(200));
    group.all(HERE_IS_ZERO)
}

fn with_amps(group: &Group, work: impl FnOnce(&mut CopleyAmpsNode) + Send + 'static) {
    group.emulator.simulation(|it| {
        work(it.node_mut(NODE).expect("the machine has them"));
    });
}

fn delivered(group: &Group, key: &'static str) -> u64 {
    let count = move |it: &mut Simulation| {
        let node: &mut CopleyAmpsNode = it.node_mut(NODE).expect("the machine has them");
        node.deliveries(key)
    };
    group.emulator.simulation(count)
}

fn inject(group: &Group, fault: FaultConfig) -> FaultId {
    let injected = group.emulator.simulation(|it| it.inject(fault));
    injected.expect("the machine has what it names")
}

/// Ends `fault`, which must have happened.
fn end(group: &Group, fault: FaultId) {
    let delivered = group.emulator.simulation(move |it| {
        it.end_fault(fault);
        it.fault_deliveries(fault)
    });
    assert!(delivered > 0, "the fault never happened");
}

/// How often axis `at` was told to begin a move since `from`.
fn starts(group: &Group, at: usize, from: Time) -> usize {
    let line = ["t 1", "1 t 1", "2 t 1"][at];
    let said = group.said.iter();
    said.filter(|(when, said)| *when >= from && said == line)
        .count()
}

#[track_caller]
fn check_there(group: &Group, begin: [Metres; 3], targets: &[Metres]) {
    let screws = screws(group);
    for (at, target) in targets.iter().enumerate() {
        let off = (group.reading(at).position - *target).abs();
        assert!(off < Metres::from_um(1.0), "axis {at}: {} um", off.um());
        let truly = screws[at] - begin[at];
        let off = (truly - *target).abs();
        assert!(off < Metres::from_um(1.0), "axis {at}: {} um", off.um());
    }
}

#[test]
fn a_change_of_the_configuration_alone_swaps_amplifiers_for_drives() {
    for setup in [over_serial(), over_can()] {
        check(&setup, |group| {
            ready(group)?;
            let begin = screws(group);
            group.prepare(&targets())?;
            group.live(Duration::from_millis(300));
            check_there(group, begin, &[Metres::ZERO; 3]);
            group.start_together()?;
            check_there(group, begin, &targets());
            group.all(DriveCommand::Disable)?;
            for at in 0..3 {
                let state = group.axis(at).power_state();
                assert_ne!(state, Some(PowerState::OperationEnabled));
                assert!(group.axis(at).is_homed());
            }
            assert_eq!(group.alarms, []);
            Ok(())
        });
    }
}

#[test]
fn screws_home_on_their_index_over_either_bus() {
    for setup in [over_serial(), over_can()] {
        check_on(&[Rig::InProcess], &setup, |group| {
            group.all(DriveCommand::Enable)?;
            let position = Metres::from_mm(-4.0);
            let speed = MetresPerSecond(0.004);
            let index = AxisCommand::HomeIndex { position, speed };
            group.all(index)?;
            let first = screws(group);
            group.all(AxisCommand::MoveTo {
                target: Metres::from_mm(1.0),
                speed: MetresPerSecond(0.01),
                acceleration: MetresPerSecondSquared(0.05),
            })?;
            group.all(index)?;
            let again = screws(group);
            for at in 0..3 {
                let apart = (again[at] - first[at]).abs();
                assert!(apart < Metres::from_um(0.5), "{} um", apart.um());
            }
            assert_eq!(group.alarms, []);
            Ok(())
        });
    }
}

#[test]
fn three_amplifiers_on_one_line_never_talk_at_once() {
    check(&over_serial(), |group| {
        ready(group)?;
        group.prepare(&targets())?;
        group.start_together()?;
        group.live(Duration::from_secs(1));
        assert_eq!(group.alarms, []);
        // Once the rate is settled, each command is answered before the next is said.
        let settled = group.said.iter().rposition(|(_, line)| line == "g r0x90");
        let said = &group.said[settled.expect("it was asked")..];
        let mut answered = group.heard.iter();
        for pair in said.windows(2) {
            let ((from, line), (until, next)) = (&pair[0], &pair[1]);
            let mut answer = String::new();
            for (at, part) in answered.by_ref() {
                assert!(at <= until, "{next:?} came before the answer to {line:?}");
                if at >= from {
                    answer.push_str(part);
                }
                if answer.ends_with('\r') {
                    break;
                }
            }
        }
        assert!(said.len() > 100, "{}", said.len());
        Ok(())
    });
}

/// The mean time from a command to the end of its reply over a second of looking at three axes.
fn exchange_time(baud: u32) -> Duration {
    let from = "baud_bit_per_s = 115200        # amplifiers";
    let to = format!("baud_bit_per_s = {baud} # amplifiers");
    let mut group = group(Rig::InProcess, &over_serial().machine(from, &to));
    group.start().unwrap();
    let begin = group.now();
    group.live(Duration::from_secs(1));
    assert_eq!(group.alarms, []);
    let mut spans = Vec::new();
    for (at, _) in group.said.iter().filter(|(at, _)| *at >= begin) {
        let answer = group.heard.iter().find(|(heard, _)| heard > at);
        spans.extend(answer.map(|(heard, _)| heard.since(*at)));
    }
    let mean = spans.iter().sum::<Duration>() / spans.len() as u32;
    println!(
        "{baud} bit/s: {} exchanges in a second, {mean:?} each",
        spans.len()
    );
    mean
}

#[test]
fn an_exchange_takes_what_its_bytes_take_and_the_amplifier_s_time() {
    let fast = exchange_time(115_200);
    assert!(fast < Duration::from_millis(5), "{fast:?}");
    let slow = exchange_time(9_600);
    assert!(slow < Duration::from_millis(30), "{slow:?}");
    assert!(slow > fast * 3);
}

fn moved_at(group: &Group) -> Vec<Time> {
    group.emulator.simulation(|it| {
        let node: &mut CopleyAmpsNode = it.node_mut(NODE).expect("the machine has them");
        let moved = (0..3).map(|address| node.moved_at(address));
        moved.map(|at| at.expect("it has moved")).collect()
    })
}

fn spread(times: &[Time]) -> Duration {
    let first = times.iter().copied().fold(Time::NEVER, Time::min);
    let last = times.iter().copied().fold(Time::ZERO, Time::max);
    last.since(first)
}

/// Told and true skew of the start of three axes on a line, the largest of ten.
fn serial_skew(baud: u32) -> (Duration, Duration) {
    let from = "baud_bit_per_s = 115200        # amplifiers";
    let to = format!("baud_bit_per_s = {baud} # amplifiers");
    let mut group = group(Rig::InProcess, &over_serial().machine(from, &to));
    group.start().unwrap();
    ready(&mut group).unwrap();
    let (mut told, mut truly) = (Duration::ZERO, Duration::ZERO);
    for turn in 0..10_u32 {
        let sign = if turn % 2 == 0 { 1.0 } else { -1.0 };
        let targets = targets().map(|target| target * sign);
        group.prepare(&targets).unwrap();
        group.live(Duration::from_micros(3100) * turn);
        let start = group.start_together().unwrap();
        told = told.max(start.skew);
        truly = truly.max(spread(&moved_at(&group)));
    }
    println!("{baud} bit/s: skew told {told:?}, true {truly:?}");
    (told, truly)
}

#[test]
fn on_a_line_the_starts_follow_each_other_without_anything_between() {
    let (told, truly) = serial_skew(115_200);
    assert!(truly < Duration::from_millis(9), "{truly:?}");
    // What is told differs by the replies' own times.
    assert!(
        told.abs_diff(truly) < Duration::from_millis(2),
        "{told:?} {truly:?}"
    );
    let (_, truly) = serial_skew(9_600);
    assert!(truly < Duration::from_millis(40), "{truly:?}");
}

/// When each drive's demand truly began to move.
fn can_skew(setup: &Setup) -> (Duration, Duration) {
    let mut group = group(Rig::InProcess, setup);
    group.start().unwrap();
    ready(&mut group).unwrap();
    let (mut told, mut truly) = (Duration::ZERO, Duration::ZERO);
    for turn in 0..10_u32 {
        let sign = if turn % 2 == 0 { 1.0 } else { -1.0 };
        let targets = targets().map(|target| target * sign);
        group.prepare(&targets).unwrap();
        group.live(Duration::from_micros(730) * turn);
        let start = group.start_together().unwrap();
        told = told.max(start.skew);
        let moved = group.emulator.simulation(|it| {
            ["drive_u", "drive_v", "drive_w"].map(|name| {
                let node: &mut Cia402DriveNode = it.node_mut(name).expect("it has it");
                node.moved_at().expect("it has moved")
            })
        });
        truly = truly.max(spread(&moved));
    }
    println!("CAN: skew told {told:?}, true {truly:?}");
    (told, truly)
}

#[test]
fn on_can_synchronous_drives_start_at_the_same_sync() {
    let (told, truly) = can_skew(&over_can());
    // One SYNC is one moment for all; their answers follow each other on the bus.
    assert_eq!(truly, Duration::ZERO);
    assert!(told < Duration::from_micros(1500), "{told:?}");
    let setting = "synchronous_start = true";
    let (_, truly) = can_skew(&over_can().machine(setting, "synchronous_start = false"));
    assert!(
        truly > Duration::ZERO && truly < Duration::from_millis(1),
        "{truly:?}"
    );
}

fn go(mm: f64) -> AxisCommand {
    AxisCommand::MoveTo {
        target: Metres::from_mm(mm),
        speed: MetresPerSecond(0.005),
        acceleration: MetresPerSecondSquared(0.05),
    }
}

#[test]
fn a_lost_ok_to_a_start_is_resolved_by_asking_and_never_by_starting_again() {
    check_in_virtual_time(|group| {
        ready(group)?;
        let begin = screws(group);
        group.prepare(&targets())?;
        let from = group.now();
        with_amps(group, |amps| amps.quirks_mut().lose_trajectory_replies = 1);
        let start = group.start_together()?;
        assert_eq!(delivered(group, "lose_trajectory_replies"), 1);
        check_there(group, begin, &targets());
        for at in 0..3 {
            assert_eq!(starts(group, at, from), 1, "axis {at}");
        }
        // The line was being cleaned before the others were told: the skew says so.
        assert!(start.skew > Duration::from_millis(100), "{start:?}");
        Ok(())
    });
}

#[test]
fn a_lost_start_in_company_fails_and_the_others_can_be_stopped() {
    check_in_virtual_time(|group| {
        ready(group)?;
        group.prepare(&targets())?;
        let from = group.now();
        with_amps(group, |amps| amps.quirks_mut().lose_trajectory_commands = 1);
        for at in 0..3 {
            group.begin(at, AxisCommand::Start);
        }
        let failed = group.outcome(0);
        assert!(
            matches!(failed, Err(DeviceError::Unanswered { .. })),
            "{failed:?}"
        );
        assert_eq!(delivered(group, "lose_trajectory_commands"), 1);
        group.all(DriveCommand::QuickStop)?;
        let stopped = screws(group);
        group.live(Duration::from_secs(1));
        let after = screws(group);
        for at in 0..3 {
            assert!((after[at] - stopped[at]).abs() < Metres::from_um(50.0));
            assert_eq!(starts(group, at, from), 1, "axis {at}");
        }
        Ok(())
    });
}

#[test]
fn another_amplifiers_reply_and_a_wrong_digit_are_not_believed() {
    check_in_virtual_time(|group| {
        ready(group)?;
        group.prepare(&targets())?;
        group.start_together()?;
        for _ in 0..20 {
            with_amps(group, |amps| amps.quirks_mut().foreign_replies = 1);
            group.live(Duration::from_millis(310));
            with_amps(group, |amps| amps.quirks_mut().wrong_digits = 1);
            group.live(Duration::from_millis(290));
            for (at, target) in targets().iter().enumerate() {
                let off = (group.reading(at).position - *target).abs();
                assert!(off < Metres::from_um(200.0), "axis {at}: {} um", off.um());
            }
        }
        assert_eq!(delivered(group, "foreign_replies"), 20);
        assert_eq!(delivered(group, "wrong_digits"), 20);
        Ok(())
    });
}

#[test]
fn a_bad_line_delays_moves_and_sends_no_axis_elsewhere() {
    check_in_virtual_time(|group| {
        ready(group)?;
        let begin = screws(group);
        let port = || "amps".to_owned();
        for (fault, probability) in [
            (Fault::Garbage { port: port() }, 0.02),
            (Fault::Split { port: port() }, 0.3),
            (
                Fault::LateAnswer {
                    port: port(),
                    delay_ms: 180.0,
                },
                0.01,
            ),
            (Fault::Silence { port: port() }, 0.01),
            (Fault::Echo { port: port() }, 1.0),
        ] {
            let mut config = FaultConfig::permanent(fault.clone());
            config.probability = probability;
            let id = inject(group, config);
            let mut arrived = 0;
            for turn in 0..12 {
                let mm = 0.25 * f64::from(turn % 4);
                let axis = turn as usize % 3;
                let from = group.now();
                let outcome = group.command(axis, go(mm));
                assert!(starts(group, axis, from) <= 2, "{fault:?}");
                if outcome.is_ok() {
                    arrived += 1;
                    let truly = screws(group)[axis] - begin[axis];
                    let off = (truly - Metres::from_mm(mm)).abs();
                    assert!(off < Metres::from_um(1.0), "{fault:?}: {} um", off.um());
                } else {
                    group.all(DriveCommand::Halt)?;
                }
            }
            end(group, id);
            assert!(arrived >= 8, "{fault:?}: {arrived} of 12");
        }
        Ok(())
    });
}

#[test]
fn an_amplifier_that_loses_its_power_in_motion_is_an_alarm_and_its_reference_is_gone() {
    for address in [0_u8, 2] {
        check_in_virtual_time(|group| {
            ready(group)?;
            let at = usize::from(address);
            group.begin(at, go(2.0));
            group.live(Duration::from_millis(150));
            with_amps(group, move |amps| amps.set_power(address, false));
            group.live(Duration::from_millis(300));
            with_amps(group, move |amps| amps.set_power(address, true));
            let failed = group.outcome(at);
            assert!(failed.is_err());
            group.live(Duration::from_secs(6));
            let restarted = |(who, alarm): &(usize, Alarm)| {
                *who == at && matches!(alarm, Alarm::AmplifierRestarted { .. })
            };
            assert!(group.alarms.iter().any(restarted), "{:?}", group.alarms);
            assert!(!group.axis(at).is_homed());
            // The others have kept theirs.
            assert!(group.axis(1).is_homed());
            Ok(())
        });
    }
}

#[test]
fn a_blocked_screw_is_a_tracking_error_and_one_reset_clears_it_when_the_cause_is_gone() {
    check(&over_serial(), |group| {
        ready(group)?;
        group.begin(1, go(2.0));
        group.live(Duration::from_millis(100));
        let blocked = inject(
            group,
            FaultConfig::permanent(Fault::BlockedAxis { axis: 1 }),
        );
        assert!(group.outcome(1).is_err());
        group.live(Duration::from_millis(500));
        let tracking = |(at, alarm): &(usize, Alarm)| {
            let trouble = AmplifierTrouble::TrackingError;
            *at == 1 && matches!(alarm, Alarm::Amplifier { trouble: it, .. } if *it == trouble)
        };
        assert!(group.alarms.iter().any(tracking), "{:?}", group.alarms);
        assert!(
            group.alarms.iter().all(|(at, _)| *at == 1),
            "{:?}",
            group.alarms
        );
        assert_eq!(group.axis(1).power_state(), Some(PowerState::Fault));
        end(group, blocked);
        group.command(1, DriveCommand::ResetFault)?;
        group.command(1, DriveCommand::Enable)?;
        group.command(1, go(0.5))
    });
}

#[test]
fn an_amplifier_that_is_another_one_is_refused_before_anything_is_set() {
    for rig in rigs() {
        let setup = over_serial().emulated("serial_number = 4002", "serial_number = 4012");
        let mut group = group(rig, &setup);
        let refused = group.start();
        assert!(
            matches!(&refused, Err(DeviceError::WrongAmplifier { seen, .. }) if seen == "4012"),
            "{rig:?}: {refused:?}"
        );
        assert!(group.said.iter().all(|(_, line)| !line.starts_with("1 s")));
    }
}

#[test]
fn a_scan_says_who_is_on_the_line_and_who_should_be() {
    let setup = over_serial()
        .emulated("serial_number = 4002", "serial_number = 4012")
        .machine("address = 2", "address = 5");
    for rig in rigs() {
        let found = Stand::new(rig, &setup).machine.scan().expect("lines work");
        let of = |name: &str| {
            let it = found.iter().find(|it| it.name.as_deref() == Some(name));
            it.unwrap_or_else(|| panic!("{rig:?}: {name} is not in {found:?}"))
        };
        assert_eq!(of("u").identity.as_ref().map(|it| it.serial), Some(4001));
        assert!(of("u").mismatches.is_empty(), "{rig:?}: {found:?}");
        assert!(of("v").mismatches[0].contains("4012"), "{rig:?}: {found:?}");
        // Nobody is there.
        assert!(of("w").identity.is_none());
        assert!(
            of("w").mismatches[0].contains("amplifier 5"),
            "{rig:?}: {found:?}"
        );
    }
}

/// Writes down what is told while somebody waits.
struct Listener(Rc<RefCell<Vec<String>>>);

impl Observer for Listener {
    fn progress(&mut self, _: Stage, _: &str, _: u64, _: u64) {}

    fn waiting(&mut self, text: &str) {
        self.0.borrow_mut().push(text.to_owned());
    }
}

/// A stand whose line of amplifiers is dead, and what is told of it.
fn dead_line() -> (Stand, Rc<RefCell<Vec<String>>>) {
    let mut stand = Stand::new(Rig::InProcess, &over_serial());
    let port = "amps".to_owned();
    stand.simulation(|simulation| {
        let silence = FaultConfig::permanent(Fault::Silence { port });
        simulation.inject(silence).expect("there is such a line");
    });
    let told = Rc::new(RefCell::new(Vec::new()));
    stand.machine.observe(Box::new(Listener(Rc::clone(&told))));
    (stand, told)
}

#[test]
fn a_scan_of_a_dead_line_takes_hardly_longer_than_one_search_and_says_what_it_looks_for() {
    let (mut stand, told) = dead_line();
    let begun = stand.machine.now();
    let found = stand.machine.scan().expect("what is missing is no failure");
    let took = stand.machine.now().since(begun);
    assert!(took < Duration::from_secs(13), "{took:?}");
    for name in ["u", "v", "w"] {
        let it = found.iter().find(|it| it.name.as_deref() == Some(name));
        let it = it.unwrap_or_else(|| panic!("{name} is not in {found:?}"));
        assert!(it.identity.is_none());
        assert!(it.mismatches[0].contains("line"), "{found:?}");
    }
    let eye = found.iter().find(|it| it.name.as_deref() == Some("eye"));
    assert!(eye.is_some_and(|it| it.mismatches.is_empty()), "{found:?}");
    let told = told.borrow();
    assert!(told[0].contains("u, v, w"), "{told:?}");
    let searches = told.iter().filter(|it| it.contains("9600 bit/s"));
    assert!(searches.count() >= 4, "{told:?}");
}

#[test]
fn a_start_that_finds_no_amplifier_says_what_it_looks_for_meanwhile() {
    let (mut stand, told) = dead_line();
    assert!(stand.machine.start().is_err());
    let told = told.borrow();
    assert!(told.len() >= 4, "{told:?}");
    for it in told.iter() {
        assert!(
            it.contains("u: looking for the amplifier with address 0"),
            "{it}"
        );
    }
}

#[test]
fn a_second_session_finds_the_amplifiers_where_the_first_has_left_them() {
    check(&over_serial(), |group| {
        ready(group)?;
        let from = group.now();
        group.start()?;
        let set = group
            .said
            .iter()
            .filter(|(at, line)| *at > from && line.starts_with("s r0x90"));
        assert_eq!(set.count(), 0, "the rate was right already");
        ready(group)?;
        group.command(2, go(0.3))
    });
}

#[test]
fn a_quick_stop_reaches_all_axes_of_a_line_within_a_few_exchanges() {
    check_on(&[Rig::InProcess], &over_serial(), |group| {
        ready(group)?;
        group.prepare(&[2.0, 2.0, 2.0].map(Metres::from_mm))?;
        for at in 0..3 {
            group.begin(at, AxisCommand::Start);
        }
        group.live(Duration::from_millis(150));
        let told = group.now();
        group.all(DriveCommand::QuickStop)?;
        let stops: Vec<_> = group
            .said
            .iter()
            .filter(|(at, line)| *at >= told && line.ends_with("t 0"))
            .map(|(at, _)| at.since(told))
            .collect();
        println!("stops said after {stops:?}");
        assert_eq!(stops.len(), 3);
        assert!(
            stops.iter().all(|it| *it < Duration::from_millis(15)),
            "{stops:?}"
        );
        Ok(())
    });
}
