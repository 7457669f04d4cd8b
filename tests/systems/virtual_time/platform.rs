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

/// The largest true errors over `poses` moves, before and after calibrating.
fn cycle(seed: u64, poses: u32, method: &str, rule: &str) -> (Metres, Metres) {
    let mut bench = Bench::of(&UVW, seed, |text| {
        text.replace(
            "method = \"least_squares\"",
            &format!("method = \"{method}\""),
        )
        .replace("rule = \"engagement\"", &format!("rule = \"{rule}\""))
    });
    let store = bench.store.clone();
    let result = run(&mut bench, &store, seed, poses);
    result.unwrap_or_else(|failure| panic!("seed {seed}: {failure}"))
}

fn run(
    bench: &mut Bench,
    store: &truestage::Store,
    seed: u64,
    poses: u32,
) -> Result<(Metres, Metres), Failure> {
    bench.machine.start()?;
    bench.machine.zero_platform(store)?;
    let judge = Judge::here(bench);
    let found = visit(bench, &judge, seed, poses)?;
    let zero = Pose::default();
    bench.machine.move_pose(zero)?;
    bench.machine.calibrate_platform(store)?;
    let left = visit(bench, &judge, seed + 1000, poses)?;
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

#[test]
fn least_squares_brings_the_platform_within_a_micrometre() {
    for seed in 1..=3 {
        let (found, left) = cycle(seed, 100, "least_squares", "engagement");
        println!(
            "seed {seed}: as found {:.3} µm, as left {:.3} µm",
            found.um(),
            left.um()
        );
        let (found, left) = cycle(seed, 100, "patent", "patent");
        println!(
            "seed {seed}: as found {:.3} µm, patent {:.3} µm",
            found.um(),
            left.um()
        );
    }
}
