//! Lines that a laser interferometer measures on three axes, against the plant's truth.

use core::time::Duration;

use compensator::volumetric::identify::Reading;
use compensator::volumetric::{Axis, Point};
use drivers::device::Alarm;
use mock_bus::fault::{Fault, FaultConfig};
use mock_bus::node::cia402_drive::Cia402DriveNode;
use mock_bus::plant::LineTruth;
use tests::{Bench, Edit, VOLUMETRIC};
use truestage::Failure;
use truestage::emulated::Emulated;
use truestage::for_tests::{Line, LineReading, LineReadout};
use truestage::volumetric::{LineOperator, LineOptics, LineTask, VolumetricFailure};
use units::{Metres, Radians};
use wire::cia402::PowerState;

const TOOL: Point = Point::from_mm(0.0, 0.0, -100.0);
const ORIGIN: Point = Point::from_mm(0.0, 0.0, 0.0);

fn zeroed(seed: u64, machine: impl Fn(String) -> String) -> Bench {
    let mut bench = Bench::shaped(&VOLUMETRIC, seed, machine, |text| text);
    bench.machine.start().unwrap_or_else(|it| panic!("{it}"));
    let zeroed = bench.machine.volumetric().unwrap().zero();
    zeroed.unwrap_or_else(|it| panic!("{it}"));
    bench
}

fn readout() -> LineReadout {
    LineReadout {
        instrument: "laser".into(),
        settle: Duration::from_millis(50),
        samples: 24,
    }
}

fn task(optics: LineOptics, start: Point, end: Point, tool: Point) -> LineTask {
    LineTask {
        optics,
        start,
        end,
        tool,
        step: (1, 1),
    }
}

/// Set up by the machine's own hand.
fn set_up(bench: &mut Bench, task: &LineTask) -> Result<Line, Failure> {
    let mut hand = bench.emulated.clone();
    bench
        .machine
        .volumetric()?
        .set_up_line(task, &readout(), &mut hand)
}

fn metres(point: Point) -> [Metres; 3] {
    [point.x, point.y, point.z]
}

/// Where a target truly is now when the machine is sent to `at`.
fn target(bench: &Bench, tool: Point, at: Point) -> Point {
    let simulation = bench.emulated.simulation();
    let truth = simulation.truth().volumetric().expect("three axes");
    let [x, y, z] = truth.point_for(metres(tool), metres(at));
    Point::new(x, y, z)
}

/// The turn about `about` of x's slide now.
fn tilt_of_x(bench: &Bench, about: Axis, at: Point) -> Radians {
    let simulation = bench.emulated.simulation();
    let truth = simulation.truth().volumetric().expect("three axes");
    truth.error_motion(0, at.x).turn[about.index()]
}

fn hand_left(bench: &Bench) -> LineTruth {
    let simulation = bench.emulated.simulation();
    let truth = simulation.truth().volumetric().expect("three axes");
    truth.laser_line().expect("a line is set up")
}

/// Reads a line at its quarters, there and back. For each reading: what was read, and by how much
/// the tool is truly off along what was read, against the start when that was set up.
fn measured(bench: &mut Bench, task: &LineTask) -> Vec<(LineReading, Metres)> {
    let line = set_up(bench, task).unwrap_or_else(|it| panic!("{it}"));
    let begun = target(bench, task.tool, task.start);
    let way = task.end - task.start;
    let mut readings = Vec::new();
    for quarter in [1.0, 2.0, 3.0, 4.0, 3.0, 2.0, 1.0, 0.0] {
        let part = |it: Metres| it * (quarter / 4.0);
        let here = task.start + Point::new(part(way.x), part(way.y), part(way.z));
        let read = bench.machine.volumetric().unwrap().read_line(&line, here);
        let read = read.unwrap_or_else(|it| panic!("{it}"));
        assert_eq!((read.at, read.tool), (here, task.tool));
        let off = target(bench, task.tool, here) - begun - (here - task.start);
        let seen = match read.reading {
            Reading::Length { along, .. } => off.x * along[0] + off.y * along[1] + off.z * along[2],
            Reading::Angle { .. } => Metres::ZERO,
        };
        readings.push((read, seen));
    }
    readings
}

/// Within `limit` of the truth everywhere, of which there is something to see.
#[track_caller]
fn check_displacements(task: &LineTask, limit_um: f64, least_um: f64) {
    let mut bench = zeroed(2, |text| text);
    let readings = measured(&mut bench, task);
    let slope = match task.optics {
        LineOptics::Straightness { .. } => hand_left(&bench).slope.value(),
        LineOptics::Linear | LineOptics::Angular { .. } => 0.0,
    };
    let mut largest = 0.0_f64;
    for (read, truly) in readings {
        let Reading::Length { deviation, u, .. } = read.reading else {
            panic!("{read:?}")
        };
        let laid = (read.at - task.start).distance() * slope;
        let off_um = (deviation + laid - truly).um();
        let at = metres(read.at).map(Metres::mm);
        assert!(
            off_um.abs() < limit_um,
            "{at:?}: {off_um} um beside {truly}"
        );
        assert!(off_um.abs() < 4.0 * u.um(), "{at:?}: {off_um} um, u {u}");
        largest = largest.max(truly.um().abs());
    }
    assert!(largest > least_um, "{largest} um are nothing to see");
}

#[test]
fn linear_optics_read_the_positioning_of_an_axis() {
    let (start, end) = (
        Point::from_mm(0.0, 100.0, 50.0),
        Point::from_mm(500.0, 100.0, 50.0),
    );
    check_displacements(&task(LineOptics::Linear, start, end, TOOL), 0.1, 2.0);
}

#[test]
fn linear_optics_read_the_diagonals_of_a_face_and_of_the_body() {
    let face = Point::from_mm(500.0, 400.0, 0.0);
    let body = Point::from_mm(500.0, 400.0, 300.0);
    let falling = Point::from_mm(0.0, 400.0, 300.0);
    for (start, end) in [
        (ORIGIN, face),
        (ORIGIN, body),
        (falling, Point::from_mm(500.0, 0.0, 0.0)),
    ] {
        check_displacements(&task(LineOptics::Linear, start, end, TOOL), 0.1, 2.0);
    }
}

/// Two of them at tool offsets that differ across tell the roll.
#[test]
fn straightness_optics_read_what_is_across_at_any_tool_offset() {
    let (start, end) = (ORIGIN, Point::from_mm(500.0, 0.0, 0.0));
    let upwards = LineOptics::Straightness { across: Axis::Z };
    let sideways = LineOptics::Straightness { across: Axis::Y };
    for (optics, tool) in [
        (upwards, Point::from_mm(0.0, 150.0, -100.0)),
        (upwards, Point::from_mm(0.0, -150.0, -100.0)),
        (sideways, TOOL),
    ] {
        check_displacements(&task(optics, start, end, tool), 0.25, 1.0);
    }
}

#[test]
fn angular_optics_read_pitch_and_yaw() {
    let mut bench = zeroed(2, |text| text);
    let (start, end) = (ORIGIN, Point::from_mm(500.0, 0.0, 0.0));
    for about in [Axis::Y, Axis::Z] {
        let task = task(LineOptics::Angular { about }, start, end, TOOL);
        let readings = measured(&mut bench, &task);
        let begun = tilt_of_x(&bench, about, start);
        let mut largest = 0.0_f64;
        for (read, _) in readings {
            let Reading::Angle {
                about: seen_about,
                deviation,
                u,
            } = read.reading
            else {
                panic!("{read:?}")
            };
            assert_eq!(seen_about, about);
            let truly = tilt_of_x(&bench, about, read.at) - begun;
            let off = (deviation - truly).arcsec().abs();
            assert!(off < 0.06 && off < 4.0 * u.arcsec(), "{off}, u {u}");
            largest = largest.max(truly.arcsec().abs());
        }
        assert!(largest > 1.0, "{largest} arcsec are nothing to see");
    }
}

#[track_caller]
fn check_beam_lost(failure: &Failure) {
    let lost = matches!(
        failure,
        Failure::Machine(machine::Failure::Alarm { device, alarm: Alarm::BeamLost }) if device == "laser"
    );
    assert!(lost, "{failure}");
}

/// A beam that is broken on the way, be it for an instant: an alarm, the axes stopped, and nothing
/// read until a line is set up again.
#[test]
fn a_beam_that_breaks_on_the_way_is_told_and_no_reading_jumps() {
    let mut bench = zeroed(3, |text| text);
    let end = Point::from_mm(400.0, 0.0, 0.0);
    let task = task(LineOptics::Linear, ORIGIN, end, TOOL);
    let line = set_up(&mut bench, &task).unwrap_or_else(|it| panic!("{it}"));
    let read = bench.machine.volumetric().unwrap().read_line(&line, ORIGIN);
    read.unwrap_or_else(|it| panic!("{it}"));
    let mut fault = FaultConfig::lasting(Fault::BeamBlocked, Duration::from_millis(20));
    fault.from_s = 1.0;
    let fault = bench.emulated.simulation_mut().inject(fault).unwrap();
    let refused = bench
        .machine
        .guarded(|machine| machine.volumetric()?.read_line(&line, end));
    check_beam_lost(&refused.unwrap_err());
    assert_eq!(bench.emulated.simulation().fault_deliveries(fault), 1);
    let stopped = {
        let simulation = bench.emulated.simulation();
        simulation
            .truth()
            .volumetric()
            .expect("three axes")
            .scales()
    };
    assert!(stopped[0] < Metres::from_mm(300.0), "it went on");
    bench.machine.start().unwrap_or_else(|it| panic!("{it}"));
    let zeroed = bench.machine.volumetric().unwrap().zero();
    zeroed.unwrap_or_else(|it| panic!("{it}"));
    let refused = bench.machine.volumetric().unwrap().read_line(&line, ORIGIN);
    let text = refused.unwrap_err().to_string();
    assert!(text.contains("new datum"), "{text}");
    let line = set_up(&mut bench, &task).unwrap_or_else(|it| panic!("{it}"));
    let read = bench.machine.volumetric().unwrap().read_line(&line, ORIGIN);
    read.unwrap_or_else(|it| panic!("{it}"));
}

#[test]
fn a_tool_that_leaves_the_line_loses_the_beam() {
    let mut bench = zeroed(3, |text| text);
    let end = Point::from_mm(400.0, 0.0, 0.0);
    let task = task(LineOptics::Linear, ORIGIN, end, TOOL);
    let line = set_up(&mut bench, &task).unwrap_or_else(|it| panic!("{it}"));
    let aside = Point::from_mm(200.0, 5.0, 0.0);
    let refused = bench
        .machine
        .guarded(|machine| machine.volumetric()?.read_line(&line, aside));
    check_beam_lost(&refused.unwrap_err());
}

#[test]
fn a_line_that_cannot_be_measured_is_refused_before_anything_moves() {
    let mut bench = zeroed(1, |text| text.edit("straightness_factor = 36.0", ""));
    let before = target(&bench, TOOL, ORIGIN);
    let end = Point::from_mm(500.0, 0.0, 0.0);
    let across = |across| LineOptics::Straightness { across };
    let refused = set_up(&mut bench, &task(across(Axis::Z), ORIGIN, end, TOOL)).unwrap_err();
    let text = refused.to_string();
    assert!(text.contains("straightness_factor"), "{text}");
    let about = LineOptics::Angular { about: Axis::X };
    let refused = set_up(&mut bench, &task(about, ORIGIN, end, TOOL)).unwrap_err();
    assert!(matches!(
        refused.of_kind(),
        Some(VolumetricFailure::NotALine)
    ));
    let moved = target(&bench, TOOL, ORIGIN) - before;
    assert!(moved.distance() < Metres::from_um(0.1));
}

/// A reflector that comes towards the head is counted the other way, and seen at once.
#[test]
fn a_count_of_the_wrong_sign_is_no_error_of_the_machine() {
    let mut bench = zeroed(1, |text| text.edit("reverse = false", "reverse = true"));
    let end = Point::from_mm(500.0, 0.0, 0.0);
    let task = task(LineOptics::Linear, ORIGIN, end, TOOL);
    let line = set_up(&mut bench, &task).unwrap_or_else(|it| panic!("{it}"));
    let near = Point::from_mm(10.0, 0.0, 0.0);
    let refused = bench
        .machine
        .volumetric()
        .unwrap()
        .read_line(&line, near)
        .unwrap_err();
    let Some(VolumetricFailure::ImpossibleReading { seen, .. }) = refused.of_kind() else {
        panic!("{refused}")
    };
    assert!((seen.mm() + 20.0).abs() < 0.1, "{} mm", seen.mm());
}

/// A laser whose beam nobody lets through: the person is told, and nothing is measured.
#[test]
fn a_line_without_light_is_refused() {
    let mut bench = zeroed(1, |text| text);
    let end = Point::from_mm(500.0, 0.0, 0.0);
    let task = task(LineOptics::Linear, ORIGIN, end, TOOL);
    let line = set_up(&mut bench, &task);
    line.unwrap_or_else(|it| panic!("{it}"));
    let blocked = FaultConfig::permanent(Fault::BeamBlocked);
    bench.emulated.simulation_mut().inject(blocked).unwrap();
    let refused = set_up(&mut bench, &task).unwrap_err();
    assert!(matches!(
        refused.of_kind(),
        Some(VolumetricFailure::NoLight { .. })
    ));
}

/// Looks whether any drive is on while it is asked for a line, and while it works.
struct Looks {
    emulated: Emulated,
    seen: Vec<[bool; 3]>,
    is_late: bool,
}

impl Looks {
    fn look(&mut self) {
        let mut simulation = self.emulated.simulation_mut();
        self.seen
            .push(["drive_x", "drive_y", "drive_z"].map(|name| {
                let drive: &mut Cia402DriveNode = simulation.node_mut(name).expect("it is there");
                drive.power_state() == PowerState::OperationEnabled
            }));
    }
}

impl LineOperator for Looks {
    fn ask_line(&mut self, task: &LineTask) -> Result<(), Failure> {
        self.look();
        self.emulated.ask_line(task)
    }

    fn is_set_up(&mut self) -> Result<bool, Failure> {
        self.look();
        Ok(!core::mem::replace(&mut self.is_late, false))
    }

    fn pack_up(&mut self) -> Result<(), Failure> {
        self.emulated.pack_up()
    }
}

#[test]
fn the_axes_are_off_while_a_line_is_set_up() {
    let mut bench = zeroed(1, |text| text);
    let mut looks = Looks {
        emulated: bench.emulated.clone(),
        seen: Vec::new(),
        is_late: true,
    };
    looks.look();
    assert_eq!(looks.seen, [[true; 3]]);
    let end = Point::from_mm(500.0, 0.0, 0.0);
    let task = task(LineOptics::Linear, ORIGIN, end, TOOL);
    let line = bench
        .machine
        .volumetric()
        .unwrap()
        .set_up_line(&task, &readout(), &mut looks);
    assert_eq!(*line.unwrap_or_else(|it| panic!("{it}")).task(), task);
    assert_eq!(looks.seen[1..], [[false; 3]; 3]);
    looks.look();
    assert_eq!(looks.seen.last(), Some(&[true; 3]));
    bench
        .machine
        .volumetric()
        .unwrap()
        .end_lines(&mut looks)
        .unwrap();
    let refused = bench
        .machine
        .volumetric()
        .unwrap()
        .set_up_line(&task, &readout(), &mut Absent);
    assert!(matches!(
        refused,
        Err(Failure::Machine(machine::Failure::Interrupted))
    ));
}

/// Nobody is there.
struct Absent;

impl LineOperator for Absent {
    fn ask_line(&mut self, _task: &LineTask) -> Result<(), Failure> {
        Err(Failure::Machine(machine::Failure::Interrupted))
    }

    fn is_set_up(&mut self) -> Result<bool, Failure> {
        Err(Failure::Machine(machine::Failure::Interrupted))
    }

    fn pack_up(&mut self) -> Result<(), Failure> {
        Err(Failure::Machine(machine::Failure::Interrupted))
    }
}
