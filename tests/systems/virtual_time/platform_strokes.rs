//! Screws of a platform that are calibrated at strokes of their own.

use tests::{Bench, Edit, PoseJudge, UVW};
use units::Metres;

/// W pushes along the second direction; its strokes are shorter and further apart.
fn own_strokes(text: String) -> String {
    let w = "point_mm = [0.0, -80.0]\ndirection = [0.0, 1.0]\nlead_mm = 2.0\nindex_mm = -4.0\n";
    let own = "[platform.actuator.strokes]\nfirst_mm = -2.0\nlast_mm = 1.8\nstep_mm = 0.2\n";
    text.edit(w, &format!("{w}\n{own}"))
}

#[test]
fn each_screw_is_measured_at_its_own_strokes_and_the_platform_is_right() {
    let mut bench = Bench::of(&UVW, 11, own_strokes);
    let store = bench.store.clone();
    bench.machine.start().unwrap();
    let mut platform = bench.machine.platform().unwrap();
    platform.zero(&store).unwrap();
    let judge = PoseJudge::here(&bench.emulated.simulation());
    let mut platform = bench.machine.platform().unwrap();
    let calibrated = platform.calibrate(&store).unwrap();
    let seen: Vec<_> = calibrated
        .screws
        .iter()
        .map(|it| {
            let ends = [it.model.first, it.model.last].map(|end| (end.um()).round() as i64);
            (it.axis.as_str(), ends, it.strokes)
        })
        .collect();
    // 21 and 20 strokes, twice each from both sides.
    let expected = [
        ("u", [-2500, 2500], 84),
        ("v", [-2500, 2500], 84),
        ("w", [-2000, 1800], 80),
    ];
    assert_eq!(seen, expected);
    let poses = platform.verification_poses(30, 3).unwrap();
    for pose in poses {
        bench.machine.platform().unwrap().move_to(pose).unwrap();
        let error = judge.error(&bench.emulated.simulation(), pose);
        assert!(error < Metres::from_um(1.0), "{} µm", error.um());
    }
}
