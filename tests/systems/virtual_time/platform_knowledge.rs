//! What a platform does with what it knows and does not know: play after an interruption, images
//! that never agree, a fourth screw that contradicts the others.

use machine::StopRequest;
use tests::{Bench, Edit, PoseJudge, UVW, with_fourth_drive, with_fourth_screw};
use truestage::platform::Pose;
use truestage::{Failure, config};
use units::{Metres, Radians};

fn pose(x_mm: f64, y_mm: f64, arcsec: f64) -> Pose {
    Pose {
        x: Metres::from_mm(x_mm),
        y: Metres::from_mm(y_mm),
        angle: Radians::from_arcsec(arcsec),
    }
}

/// Fewer strokes than it ships with: these are about other things.
fn shortened(text: String) -> String {
    text.edit("step_mm = 0.25", "step_mm = 0.625")
        .edit("runs = 2", "runs = 1")
}

/// A platform that was zeroed, with a judge of its poses.
fn zeroed(bench: &mut Bench) -> PoseJudge {
    bench.machine.start().unwrap();
    bench
        .machine
        .platform()
        .unwrap()
        .zero(&bench.store)
        .unwrap();
    PoseJudge::here(&bench.emulated.simulation())
}

#[test]
fn after_an_interruption_play_that_nobody_knows_is_taken_up_first_and_told() {
    let mut bench = Bench::of(&UVW, 5, shortened);
    let judge = zeroed(&mut bench);
    bench
        .machine
        .platform()
        .unwrap()
        .calibrate(&bench.store)
        .unwrap();
    let machine = &mut bench.machine;
    let known = machine
        .platform()
        .unwrap()
        .move_to(pose(0.5, 0.3, 200.0))
        .unwrap();
    assert_eq!(known.taken_up, []);

    machine.stop_request().stop();
    let stopped = machine.platform().unwrap().move_to(pose(0.4, 0.35, -100.0));
    assert!(
        matches!(
            stopped,
            Err(Failure::Machine(machine::Failure::Interrupted))
        ),
        "{stopped:?}"
    );
    machine.share_stop_request(&StopRequest::default());

    let target = pose(0.45, 0.2, 0.0);
    let moved = machine.platform().unwrap().move_to(target).unwrap();
    let axes: Vec<&str> = moved.taken_up.iter().map(|it| it.axis.as_str()).collect();
    assert_eq!(axes, ["u", "v", "w"]);
    for (it, after) in moved.taken_up.iter().zip(&moved.uncertainties) {
        let after = after.expect("it is calibrated");
        // What a single move does not repeat is in both; half the play over √3 only in the first: plays are 1.6 to 2.6 µm.
        let before = it.standard_uncertainty.expect("it is calibrated");
        let doubt_um = (before.um().powi(2) - after.um().powi(2)).sqrt();
        assert!((0.45..0.8).contains(&doubt_um), "{doubt_um} µm");
    }
    let error = judge.error(&bench.emulated.simulation(), target);
    assert!(error < Metres::from_um(1.0), "{} µm", error.um());
    let next = bench
        .machine
        .platform()
        .unwrap()
        .move_to(pose(0.1, 0.1, 0.0))
        .unwrap();
    assert_eq!(next.taken_up, []);
}

#[test]
fn where_the_soft_limits_leave_no_room_forward_play_is_taken_up_in_reverse() {
    let narrow = |text: String| {
        shortened(text)
            .edit("soft_max_mm = 4.5", "soft_max_mm = 1.5")
            .edit("theta_max_deg = 0.5", "theta_max_deg = 0.0")
            .edit("x_max_mm = 1.5", "x_max_mm = 1.4995")
            .edit("y_max_mm = 1.5", "y_max_mm = 1.0")
            .edit("first_mm = -2.5", "first_mm = -1.25")
            .edit("last_mm = 2.5", "last_mm = 1.25")
            .edit("step_mm = 0.625", "step_mm = 0.25")
            .edit("extrapolation_mm = 0.2", "extrapolation_mm = 0.3")
    };
    let mut bench = Bench::of(&UVW, 5, narrow);
    let judge = zeroed(&mut bench);
    bench
        .machine
        .platform()
        .unwrap()
        .calibrate(&bench.store)
        .unwrap();
    let machine = &mut bench.machine;
    machine
        .platform()
        .unwrap()
        .move_to(pose(1.4965, 0.3, 0.0))
        .unwrap();
    let soft_max = Metres::from_mm(1.5);
    let here = machine.reading("u").unwrap().unwrap().position;
    let play = Metres::from_um(1.6);
    assert!(here + play > soft_max, "{} mm: there is room", here.mm());

    machine.stop_request().stop();
    machine
        .platform()
        .unwrap()
        .move_to(pose(1.2, 0.3, 0.0))
        .unwrap_err();
    machine.share_stop_request(&StopRequest::default());
    let target = pose(1.4, 0.2, 0.0);
    let moved = machine.platform().unwrap().move_to(target).unwrap();
    assert_eq!(moved.taken_up.len(), 3, "{moved:?}");
    let error = judge.error(&bench.emulated.simulation(), target);
    assert!(error < Metres::from_um(1.0), "{} µm", error.um());
}

#[test]
fn after_a_power_cycle_nothing_moves_before_a_zero_which_settles_the_play() {
    let mut bench = Bench::of(&UVW, 6, shortened);
    zeroed(&mut bench);
    bench
        .machine
        .platform()
        .unwrap()
        .calibrate(&bench.store)
        .unwrap();
    bench.machine.shut_down().unwrap();
    bench.power_cycle(truestage::emulated::HallDrift::default());
    let back = bench.machine.now() + core::time::Duration::from_secs(1);
    bench.machine.run_until(back).unwrap();
    bench.machine.start().unwrap();
    let refused = bench
        .machine
        .platform()
        .unwrap()
        .move_to(pose(0.1, 0.0, 0.0))
        .unwrap_err();
    assert_eq!(refused.exit_code(), 3);
    assert!(refused.to_string().contains("not zeroed"), "{refused}");
    bench
        .machine
        .platform()
        .unwrap()
        .zero(&bench.store)
        .unwrap();
    let judge = PoseJudge::here(&bench.emulated.simulation());
    for target in [pose(-0.3, 0.2, 100.0), pose(-0.31, 0.19, 105.0)] {
        let moved = bench.machine.platform().unwrap().move_to(target).unwrap();
        assert_eq!(moved.taken_up, []);
        let error = judge.error(&bench.emulated.simulation(), target);
        assert!(error < Metres::from_um(1.0), "{} µm", error.um());
    }
}

#[test]
fn alignment_is_bounded_and_told_apart_from_the_open_loop() {
    let mut bench = Bench::of(&UVW, 3, |text| text);
    let judge = zeroed(&mut bench);
    let target = pose(1.3, -1.2, 900.0);
    let aligned = bench.machine.platform().unwrap().align(target).unwrap();
    // Nothing is calibrated: the first move is off by its screws' errors, the image mends them.
    assert!(aligned.open_loop > Metres::from_um(1.5), "{aligned:?}");
    assert!(aligned.left <= Metres::from_um(0.5), "{aligned:?}");
    assert!((2..=5).contains(&aligned.moves), "{aligned:?}");
    let truly = judge.error(&bench.emulated.simulation(), target);
    assert!(truly < Metres::from_um(1.0), "{} µm", truly.um());

    let never = |text: String| {
        text.edit("tolerance_um = 0.5", "tolerance_um = 0.001")
            .edit("iterations_max = 5", "iterations_max = 3")
    };
    let mut bench = Bench::of(&UVW, 3, never);
    zeroed(&mut bench);
    let failure = bench.machine.platform().unwrap().align(target).unwrap_err();
    assert_eq!(failure.exit_code(), 5);
    let text = failure.to_string();
    assert!(
        text.contains("after 3 moves the image still differs"),
        "{text}"
    );
}

fn four_screws(limit_um: f64) -> Bench {
    let machine = |text| with_fourth_screw(text, Some(limit_um));
    Bench::shaped(&UVW, 4, machine, with_fourth_drive)
}

#[test]
fn a_fourth_screw_must_agree_with_the_others_or_nothing_moves() {
    let mut bench = four_screws(1.0);
    zeroed(&mut bench);
    let machine = &mut bench.machine;
    let target = pose(0.8, -0.6, 700.0);
    let moved = machine.platform().unwrap().move_to(target).unwrap();
    assert_eq!(moved.set_points.len(), 4);
    let before = machine.reading("r").unwrap().unwrap().position;

    // A screw alone would pull against the others.
    let refused = machine
        .platform()
        .unwrap()
        .calibrate(&bench.store)
        .unwrap_err();
    assert_eq!(refused.exit_code(), 3);
    let text = refused.to_string();
    for part in ["contradict", "u ", "v ", "w ", "r ", "nothing was moved"] {
        assert!(text.contains(part), "`{part}` is not in {text}");
    }
    let after = machine.reading("r").unwrap().unwrap().position;
    assert!((after - before).abs() < Metres::from_um(0.1));
    machine
        .platform()
        .unwrap()
        .move_to(Pose::default())
        .unwrap();
}

#[test]
fn how_far_four_screws_may_contradict_each_other_must_be_said_and_three_cannot() {
    let judged = |text: &str| match config::parse(text, "machine.toml") {
        Ok(_) => String::new(),
        Err(failure) => failure.to_string(),
    };
    let text = UVW.machine.to_owned();
    let missing = judged(&with_fourth_screw(text.clone(), None));
    assert!(
        missing.contains("`inconsistency_limit_um` is missing"),
        "{missing}"
    );
    assert_eq!(judged(&with_fourth_screw(text.clone(), Some(5.0))), "");
    let unneeded = text.edit(
        "exposures = 4",
        "inconsistency_limit_um = 5.0\nexposures = 4",
    );
    let unneeded = judged(&unneeded);
    assert!(unneeded.contains("three screws cannot"), "{unneeded}");
    let strained = with_fourth_screw(text.clone(), Some(5.0)).edit("lone_homing = true", "");
    let strained = judged(&strained);
    assert!(
        strained.contains("homes while the others stand"),
        "{strained}"
    );
    let alone = text.edit("[platform.zero]", "[platform.zero]\nlone_homing = true");
    let alone = judged(&alone);
    assert!(alone.contains("never strain"), "{alone}");
    let impossible = judged(&with_fourth_screw(text, Some(-1.0)));
    assert!(impossible.contains("-1 is impossible"), "{impossible}");
}
