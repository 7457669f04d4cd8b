//! The image controller over the platform.

use core::time::Duration;

use drivers::device::in_sight::InSight;
use drivers::device::{Device, DeviceError, PoseInstrument, PoseReading};
use machine::Failure;
use mock_bus::fault::{Fault, FaultConfig, FaultId};
use mock_bus::node::in_sight_controller::InSightControllerNode;
use mock_bus::plant::Pose;
use units::{Metres, Radians};
use tests::{Desk, Emulator, Rig, Setup, on_every_rig, rigs};
use truestage::for_tests::CameraDevice;

type Eye = Desk<InSight>;

const NODE: &str = "image_controller";

fn desk(rig: Rig, setup: &Setup) -> Eye {
    let emulator = Emulator::new(rig, setup);
    let loaded = &emulator.loaded;
    let camera = &loaded.config.camera["eye"];
    let CameraDevice::InSight(in_sight) = &camera.device;
    let settings = in_sight.settings(camera, loaded.patience);
    Desk::new(emulator, "vision", InSight::new(settings))
}

/// Runs `procedure` with the started image controller of `setup` on these rigs.
#[track_caller]
fn check_on(rigs: &[Rig], setup: &Setup, procedure: impl Fn(&mut Eye)) {
    for rig in rigs.iter().copied() {
        let mut eye = desk(rig, setup);
        if let Err(error) = eye.start() {
            panic!("{rig:?}: {error}; {:?}", eye.alarms);
        }
        procedure(&mut eye);
        assert_eq!(eye.alarms, [], "{rig:?}");
    }
}

#[track_caller]
fn check(procedure: impl Fn(&mut Eye)) {
    check_on(&rigs(), &Setup::uvw(31), procedure);
}

/// Where answers are waited for in vain: on a fast clock that takes very long
/// (docs/decisions/0004).
#[track_caller]
fn check_in_virtual_time(procedure: impl Fn(&mut Eye)) {
    check_on(&[Rig::InProcess], &Setup::uvw(31), procedure);
}

fn look(eye: &mut Eye, exposures: u32) -> Result<PoseReading, DeviceError> {
    let now = eye.now();
    eye.device.begin_pose(now, exposures);
    let outcome = eye.outcome();
    let pose = eye.device.pose();
    assert_eq!(pose.is_some(), outcome.is_ok(), "a failure is no number");
    outcome.map(|()| pose.expect("it ended well"))
}

#[track_caller]
fn refused(eye: &mut Eye, says: &str) {
    let told = match look(eye, 1) {
        Ok(pose) => panic!("{pose:?}"),
        Err(error) => error.to_string(),
    };
    assert!(told.contains(says), "{told}");
}

fn inject(eye: &Eye, fault: FaultConfig) -> FaultId {
    let injected = eye.emulator.simulation(|it| it.inject(fault));
    injected.expect("the machine has what it names")
}

/// Ends `fault`, which must have happened.
fn end(eye: &Eye, fault: FaultId) {
    let delivered = eye.emulator.simulation(move |it| {
        it.end_fault(fault);
        it.fault_deliveries(fault)
    });
    assert!(delivered > 0, "the fault never happened");
}

fn with_node(eye: &Eye, work: impl FnOnce(&mut InSightControllerNode) + Send + 'static) {
    eye.emulator.simulation(|it| {
        work(it.node_mut(NODE).expect("the machine has it"));
    });
}

fn truth(eye: &Eye) -> Pose {
    let pose = |it: &mut mock_bus::simulation::Simulation| {
        it.truth().platform().expect("it is a platform").pose()
    };
    eye.emulator.simulation(pose)
}

#[test]
fn a_pose_is_the_true_one_but_for_the_cameras_noise() {
    check(|eye| {
        let seen = look(eye, 40).expect("the marks are in view");
        let is = truth(eye);
        // 0.12 µm and 0.41 arcsec for one picture.
        let error = 4.0 / f64::sqrt(40.0);
        assert!((seen.x - is.x).abs().um() < 0.12 * error, "{seen:?} {is:?}");
        assert!((seen.y - is.y).abs().um() < 0.12 * error, "{seen:?} {is:?}");
        let turn = (seen.angle - is.angle).abs().arcsec();
        assert!(turn < 0.41 * error, "{seen:?} {is:?}");
        let [s_x, s_y, s_angle] = [0, 1, 2].map(|at| seen.covariance[at][at].sqrt());
        for um in [s_x, s_y].map(|it| Metres(it).um()) {
            assert!((0.07..0.18).contains(&um), "{um} um");
        }
        let s_angle = Radians(s_angle).arcsec();
        assert!((0.25..0.6).contains(&s_angle), "{seen:?}");
        assert_eq!((seen.samples, seen.rejected), (40, 0));
        assert!((0.9..=1.0).contains(&seen.score), "{seen:?}");
        let name = eye.device.identity().expect("it was started").name;
        assert!(name.contains("In-Sight") && name.contains("platform.job"));
    });
}

#[test]
fn cameras_that_are_turned_and_mirrored_are_turned_back() {
    let setup = Setup::uvw(32)
        .emulated(
            "rotation_deg = 0.0\nmirrored = false",
            "rotation_deg = 90.0\nmirrored = true",
        )
        .machine(
            "rotation_deg = 0.0\nmirrored = false",
            "rotation_deg = 90.0\nmirrored = true",
        );
    check_on(&rigs(), &setup, |eye| {
        let seen = look(eye, 20).expect("the marks are in view");
        let is = truth(eye);
        assert!((seen.x - is.x).abs().um() < 0.15, "{seen:?} {is:?}");
        assert!((seen.y - is.y).abs().um() < 0.15, "{seen:?} {is:?}");
        let turn = (seen.angle - is.angle).abs().arcsec();
        assert!(turn < 0.5, "{seen:?} {is:?}");
        assert!(is.x.abs().um() > 10.0 && is.angle.abs().arcsec() > 10.0);
    });
}

#[test]
fn no_target_and_a_covered_one_are_told_apart_and_neither_is_a_pose() {
    check(|eye| {
        for (fault, says) in [
            (Fault::TargetAbsent, "4 showed no target"),
            (Fault::TargetCovered, "4 were judged bad"),
        ] {
            let fault = inject(eye, FaultConfig::permanent(fault));
            refused(eye, says);
            end(eye, fault);
            look(eye, 1).expect("the target is back");
        }
    });
}

/// An old picture would show a target that is not there any more.
#[test]
fn a_late_answer_never_brings_back_an_old_picture() {
    check_in_virtual_time(|eye| {
        let mut late = FaultConfig::permanent(Fault::LateAnswer {
            port: "vision".into(),
            delay_ms: 700.0,
        });
        late.probability = 0.15;
        let late = inject(eye, late);
        let mut seen = 0;
        for _ in 0..30 {
            if look(eye, 2).is_ok() {
                seen += 1;
            }
            let absent = inject(eye, FaultConfig::permanent(Fault::TargetAbsent));
            let shown = look(eye, 2);
            assert!(shown.is_err(), "{shown:?}");
            end(eye, absent);
        }
        end(eye, late);
        assert!(seen > 10, "{seen} of 30");
        look(eye, 2).expect("the line is quiet again");
    });
}

#[test]
fn a_line_that_garbles_splits_and_echoes_delays_a_pose_and_spoils_none() {
    check_in_virtual_time(|eye| {
        let port = || "vision".to_owned();
        for (fault, probability) in [
            (Fault::Garbage { port: port() }, 0.1),
            (Fault::Split { port: port() }, 0.5),
            (Fault::Echo { port: port() }, 1.0),
        ] {
            let mut fault = FaultConfig::permanent(fault);
            fault.probability = probability;
            let fault = inject(eye, fault);
            let is = truth(eye);
            let mut seen = 0;
            for _ in 0..5 {
                if let Ok(pose) = look(eye, 2) {
                    assert!((pose.x - is.x).abs().um() < 0.6, "{pose:?}");
                    seen += 1;
                }
            }
            assert!(seen >= 3, "{seen} of 5");
            end(eye, fault);
        }
    });
}

#[test]
fn a_silent_line_is_a_time_out_and_forgotten_when_it_speaks_again() {
    check_in_virtual_time(|eye| {
        let port = "vision".to_owned();
        let silence = inject(eye, FaultConfig::permanent(Fault::Silence { port }));
        refused(eye, "GF");
        end(eye, silence);
        look(eye, 1).expect("it speaks again");
    });
}

#[test]
fn a_light_barrier_that_triggers_too_is_named() {
    check(|eye| {
        with_node(eye, |node| node.quirks_mut().triggered_twice = true);
        refused(eye, "no other program triggers");
        with_node(eye, |node| node.quirks_mut().triggered_twice = false);
        look(eye, 1).expect("the light barrier is off");
    });
}

#[test]
fn triggers_without_effect_and_a_broken_cell_are_no_pose() {
    check_in_virtual_time(|eye| {
        with_node(eye, |node| node.quirks_mut().triggers_ignored = true);
        refused(eye, "a picture after the trigger");
        with_node(eye, |node| {
            node.quirks_mut().triggers_ignored = false;
            node.quirks_mut().cell_broken = true;
        });
        refused(eye, "GV");
        with_node(eye, |node| node.quirks_mut().cell_broken = false);
        look(eye, 1).expect("all is well again");
    });
}

#[test]
fn a_controller_set_offline_or_given_another_job_says_so() {
    check(|eye| {
        with_node(eye, |node| node.set_online(false));
        refused(eye, "status -2");
        let told = eye.start().expect_err("somebody works on it").to_string();
        assert!(told.contains("set offline by hand"), "{told}");
        with_node(eye, |node| node.set_online(true));
        eye.start().expect("it is online again");
        with_node(eye, |node| node.load_job("other.job"));
        refused(eye, "the active job that the configuration names");
        with_node(eye, |node| node.load_job("platform.job"));
        refused(eye, "a started image controller");
        eye.start().expect("the job is the right one again");
        look(eye, 1).expect("and is used");
    });
}

#[test]
fn a_loss_of_power_ends_the_pose_and_a_new_one_can_be_taken_after_it() {
    check_in_virtual_time(|eye| {
        let now = eye.now();
        eye.device.begin_pose(now, 1000);
        eye.live(Duration::from_millis(500));
        let node = NODE.to_owned();
        let lost = inject(eye, FaultConfig::permanent(Fault::PowerLoss { node }));
        assert!(eye.outcome().is_err());
        end(eye, lost);
        eye.live(Duration::from_secs(2));
        let seen = look(eye, 1).expect("it has booted");
        assert!((seen.x - truth(eye).x).abs().um() < 0.6, "{seen:?}");
    });
}

#[test]
fn a_controller_that_is_not_there_is_a_time_out() {
    let setup = Setup::uvw(34).emulated("boot_ms = 1500.0", "boot_ms = 60000.0");
    let mut eye = desk(Rig::InProcess, &setup);
    let told = eye.start().expect_err("it boots for ever").to_string();
    assert!(told.contains("GF"), "{told}");
}

#[test]
fn a_machine_looks_through_its_camera() {
    on_every_rig(&Setup::uvw(35), |stand| {
        assert_eq!(stand.machine.devices().camera_names(), ["eye"]);
        let seen = stand.machine.look("eye", 10)?;
        let is = stand.simulation(|it| it.truth().platform().expect("it is one").pose());
        assert!((seen.x - is.x).abs().um() < 0.2, "{seen:?} {is:?}");
        assert!((seen.y - is.y).abs().um() < 0.2, "{seen:?} {is:?}");
        let names = stand.machine.devices().names();
        assert_eq!(names, ["u", "v", "w", "eye"]);
        let identity = &stand.machine.devices().identities()["eye"];
        assert!(identity.name.contains("platform.job"), "{identity:?}");
        let counted = stand.machine.devices().counters();
        assert!(counted.contains(&("eye".to_owned(), "pictures", 10)));
        let absent = FaultConfig::permanent(Fault::TargetAbsent);
        stand
            .simulation(|it| it.inject(absent))
            .expect("marks can be taken away");
        let failure = stand.machine.look("eye", 1).expect_err("nothing is there");
        assert_eq!(failure.exit_code(), 4, "{failure}");
        assert!(failure.to_string().contains("no target"), "{failure}");
        let failure = stand.machine.look("ear", 1).expect_err("it is no camera");
        assert!(matches!(failure, Failure::NoSuchDevice { .. }), "{failure}");
        Ok(())
    });
}
