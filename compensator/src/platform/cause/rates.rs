//! How often a cause is named that is none, counted over platforms, noise and troubles of many sorts.
//! Seeds come from the sources, so that nothing can be tuned to them.

use super::rig::{Machine, Noise, ONCE, OWN, TOLERANCE, Trouble, as_is};
use super::*;
use units::portable::{exp, ln, sin_cos};

/// Every one differs from all that a sound machine shows.
const FACTORS: [f64; 12] = [
    0.001, 0.04, 0.1, 0.4, 0.5, 0.8, 1.25, 2.0, 2.5, 10.0, 25.4, 1000.0,
];

/// Changes when any file of the folder does.
fn seed() -> u64 {
    let sources = concat!(
        include_str!("mod.rs"),
        include_str!("fit.rs"),
        include_str!("rig.rs"),
        include_str!("rates.rs")
    );
    let given = std::env::var("SEED").ok().and_then(|it| it.parse().ok());
    given.unwrap_or_else(|| {
        let step = |hash: u64, byte: u8| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01B3);
        sources.bytes().fold(0xCBF2_9CE4_8422_2325, step)
    })
}

fn verdict(machine: &mut Machine) -> Verdict {
    let (datum, sightings) = machine.calibrated(OWN, ONCE, as_is);
    judge(
        &machine.platform,
        &machine.homed,
        datum,
        &sightings,
        TOLERANCE,
    )
    .unwrap()
}

/// How many of `count` machines in such a trouble are said to have a cause.
fn named(count: u64, trouble: impl Fn(&Machine, &mut Noise) -> Trouble) -> usize {
    let one = |at: u64| {
        let mut machine = Machine::drawn(seed() ^ at);
        machine.trouble = trouble(&machine, &mut Noise(at));
        verdict(&mut machine)
    };
    let named = (0..count).map(one).filter(|it| !it.causes.is_empty());
    named.count()
}

/// A mistake drawn, with the cause that it is.
fn mistaken(at: u64) -> (Verdict, impl Fn(&Cause) -> bool) {
    let mut noise = Noise(seed().wrapping_add(at.wrapping_mul(77)));
    let mut machine = Machine::drawn(seed() ^ at);
    let which = (noise.uniform() * 3.0) as usize % 3;
    let k = FACTORS[(noise.uniform() * 12.0) as usize % 12];
    // Of a screw such a factor that its platform still turns by little.
    let small = [-1.0, 0.1, 0.25, 0.5, 0.8, 1.25, 2.0][(noise.uniform() * 7.0) as usize % 7];
    let turn = (noise.uniform() * 360.0).clamp(10.0, 350.0).to_radians();
    let (sin, cos) = sin_cos(turn);
    let orders = [[1, 0, 2], [2, 1, 0], [0, 2, 1], [1, 2, 0], [2, 0, 1]];
    let order = orders[(noise.uniform() * 5.0) as usize % 5];
    let sort = at % 7;
    let mut factors = ONCE;
    if sort == 4 {
        factors[which] = small;
    } else if sort == 5 {
        factors = [small; 3];
    }
    let camera = |[x, y, angle]: [f64; 3]| match sort {
        0 => [cos * x + sin * y, cos * y - sin * x, angle],
        1 => [cos * x + sin * y, -(cos * y - sin * x), -angle],
        2 => [k * x, k * y, angle],
        3 => [x, y, k * angle],
        _ => [x, y, angle],
    };
    let (datum, seen) = machine.calibrated(if sort == 6 { order } else { OWN }, factors, camera);
    let verdict = judge(&machine.platform, &machine.homed, datum, &seen, TOLERANCE).unwrap();
    let about = |seen: f64, expected: f64| (seen / expected - 1.0).abs() < 0.02;
    let is_it = move |cause: &Cause| match cause {
        Cause::CameraFrame { mirrored, .. } => sort == u64::from(*mirrored),
        Cause::CameraLength { factor } => sort == 2 && about(*factor, k),
        Cause::CameraAngle { factor } => sort == 3 && about(*factor, k),
        Cause::Screw { which: it, factor } => sort == 4 && *it == which && about(*factor, small),
        Cause::Screws { factor } => sort == 5 && about(*factor, small),
        Cause::Exchanged { order: it } => sort == 6 && *it == order,
        Cause::Still { .. } => false,
    };
    (verdict, is_it)
}

/// Sound machines, and those whose trouble no configuration explains.
fn count_named(count: u64) -> Vec<(&'static str, usize)> {
    let size = |noise: &mut Noise| 50e-6 * exp(noise.uniform() * ln(10.0));
    vec![
        ("sound", named(count, |_, _| Trouble::None)),
        (
            "a step of 50 to 500 µm",
            named(count, |machine, noise| {
                let stops = f64::from(3 * 2 * (2 * machine.steps + 1));
                Trouble::Step((noise.uniform() * stops) as usize, size(noise))
            }),
        ),
        (
            "a screw that is stopped on its way",
            named(count, |_, noise| {
                Trouble::Stuck(1.6 * noise.uniform() - 0.8)
            }),
        ),
        (
            "a camera that drifts by 50 to 500 µm",
            named(count, |_, noise| Trouble::Drift(size(noise))),
        ),
        (
            "one to three bad readings of up to 5 mm",
            named(count, |_, noise| {
                Trouble::Bad(1 + (noise.uniform() * 3.0) as usize, 100.0 * size(noise))
            }),
        ),
        (
            "a bent screw, 50 to 500 µm",
            named(count, |_, noise| Trouble::Bent(size(noise))),
        ),
        (
            "stops that scatter by 50 to 500 µm",
            named(count, |_, noise| Trouble::Scatter(size(noise))),
        ),
    ]
}

/// Of so many mistakes: named rightly, wrongly, not at all.
fn count_mistaken(count: u64) -> [usize; 3] {
    let mut counts = [0; 3];
    for at in 0..count {
        let (verdict, is_it) = mistaken(at);
        let mut causes = verdict.causes.iter().map(|it| &it.cause);
        let which = match (verdict.causes.is_empty(), causes.any(is_it)) {
            (true, _) => 2,
            (false, true) => 0,
            (false, false) => 1,
        };
        if which == 1 {
            println!("named wrongly: {:?}", verdict.causes);
        }
        counts[which] += 1;
    }
    counts
}

#[test]
fn a_cause_is_hardly_ever_named_that_is_none() {
    // With one wrong in a thousand, two of twenty are seen once in five thousand runs.
    for (what, named) in count_named(20) {
        assert!(named <= 1, "{what}: {named} of 20");
    }
    let [_, wrongly, not] = count_mistaken(70);
    assert!(wrongly <= 1, "{wrongly} of 70 named wrongly");
    assert!(not <= 1, "{not} of 70 not named");
}

#[test]
#[ignore = "a count over thousands of machines"]
fn causes_counted_over_many() {
    const COUNT: u64 = 2000;
    for (what, named) in count_named(COUNT) {
        println!("{what}: a cause named of {named} of {COUNT}");
        assert!(named as u64 <= COUNT / 500, "{what}");
    }
    let [right, wrongly, not] = count_mistaken(7 * COUNT / 2);
    println!("mistaken: {right} named rightly, {wrongly} wrongly, {not} not at all");
    assert!(wrongly as u64 <= COUNT / 200);
}
