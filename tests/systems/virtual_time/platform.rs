//! The alignment platform: calibrate → zero → compensate → verify, judged by the plant's truth.

use tests::{Bench, UVW};
use truestage::Failure;
use truestage::cycle::platform::Pose;
use units::Metres;

/// Where errors of the angle count as lengths, as in the shipped configuration.
const EDGE: Metres = Metres(80e-3);

/// The true pose, from the true pose at the datum.
struct Judge {
    datum: Pose,
}

fn true_pose(bench: &Bench) -> Pose {
    let simulation = bench.emulated.simulation();
    let pose = simulation.truth().platform().expect("it is one").pose();
    Pose {
        x: pose.x,
        y: pose.y,
        angle: pose.angle,
    }
}

impl Judge {
    fn here(bench: &Bench) -> Self {
        Self {
            datum: true_pose(bench),
        }
    }

    /// The largest of the errors in x, y, and of the angle at the edge.
    fn error(&self, bench: &Bench, target: Pose) -> Metres {
        let seen = true_pose(bench);
        let angle = seen.angle.value() - self.datum.angle.value();
        let (sin, cos) = angle.sin_cos();
        let (x0, y0) = (self.datum.x.value(), self.datum.y.value());
        let x = seen.x.value() - (cos * x0 - sin * y0) - target.x.value();
        let y = seen.y.value() - (sin * x0 + cos * y0) - target.y.value();
        let turned = (angle - target.angle.value()) * EDGE.value();
        Metres(x.abs().max(y.abs()).max(turned.abs()))
    }
}

/// How many poses are visited as found, and as left.
const FOUND: u32 = 60;
const LEFT: u32 = 500;

/// The largest true errors of one platform as found and as left.
fn cycle(seed: u64, method: &str, rule: &str) -> (Metres, Metres) {
    let mut bench = Bench::of(&UVW, seed, |text| {
        let method = format!("method = \"{method}\"");
        let rule = format!("rule = \"{rule}\"");
        text.replace("method = \"least_squares\"", &method)
            .replace("rule = \"engagement\"", &rule)
    });
    run(&mut bench, seed).unwrap_or_else(|failure| panic!("seed {seed}: {failure}"))
}

fn run(bench: &mut Bench, seed: u64) -> Result<(Metres, Metres), Failure> {
    let store = bench.store.clone();
    bench.machine.start()?;
    bench.machine.zero_platform(&store)?;
    let judge = Judge::here(bench);
    let found = visit(bench, &judge, seed, FOUND)?;
    bench.machine.move_pose(Pose::default())?;
    bench.machine.calibrate_platform(&store)?;
    let left = visit(bench, &judge, seed + 1000, LEFT)?;
    bench.machine.shut_down()?;
    Ok((found, left))
}

fn visit(bench: &mut Bench, judge: &Judge, seed: u64, poses: u32) -> Result<Metres, Failure> {
    let mut worst = Metres::ZERO;
    for pose in bench.machine.verification_poses(poses, seed)? {
        bench.machine.move_pose(pose)?;
        worst = worst.max(judge.error(bench, pose));
    }
    Ok(worst)
}

/// 20 platforms on both cores, each as found within `found` and as left within `limit`.
fn check_all(method: &str, rule: &str, limit: Metres) {
    let of_share = |share: u64| {
        let seeds = (1..=20).filter(move |seed| seed % 2 == share);
        seeds
            .map(|seed| (seed, cycle(seed, method, rule)))
            .collect::<Vec<_>>()
    };
    let results = std::thread::scope(|scope| {
        let odd = scope.spawn(|| of_share(1));
        let mut results = of_share(0);
        results.extend(odd.join().expect("a failure is told where it happens"));
        results
    });
    let worst = |of: fn(&(Metres, Metres)) -> Metres| {
        let values = results.iter().map(|(_, it)| of(it));
        values.fold(Metres::ZERO, Metres::max).um()
    };
    println!(
        "{method}: 20 platforms, as found up to {:.3} µm, as left in {LEFT} moves up to {:.3} µm",
        worst(|it| it.0),
        worst(|it| it.1)
    );
    for (seed, (found, left)) in &results {
        assert!(*left <= limit, "seed {seed}: as left {} µm", left.um());
        assert!(left < found, "seed {seed}: as found {} µm", found.um());
    }
    assert!(worst(|it| it.0) >= 3.5, "as found hardly worse than wanted");
}

#[test]
fn the_patents_method_brings_twenty_platforms_within_two_micrometres() {
    check_all("patent", "patent", Metres::from_um(2.0));
}

#[test]
fn least_squares_and_engagement_bring_twenty_platforms_within_one_micrometre() {
    check_all("least_squares", "engagement", Metres::from_um(1.0));
}

#[test]
fn what_cannot_be_reached_is_refused_before_anything_moves() {
    let mut bench = Bench::of(&UVW, 1, |text| text);
    let store = bench.store.clone();
    let machine = &mut bench.machine;
    machine.start().unwrap();
    let far = Pose {
        x: Metres::from_mm(9.0),
        ..Pose::default()
    };
    let error = machine.move_pose(far).unwrap_err().to_string();
    assert!(error.contains("not zeroed"), "{error}");
    machine.zero_platform(&store).unwrap();
    let before = true_pose(&bench);
    let error = bench.machine.move_pose(far).unwrap_err();
    assert_eq!(error.exit_code(), 3);
    assert!(error.to_string().contains("nothing was moved"), "{error}");
    assert!((true_pose(&bench).x - before.x).abs() < Metres::from_um(0.2));
}
