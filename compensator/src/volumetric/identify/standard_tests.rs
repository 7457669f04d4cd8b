use super::rig::{Measured, Rig, TOOL, as_drawn, machine, still};
use super::tests::{Chance, model, um};
use super::*;
use crate::volumetric::Volume;
use crate::volumetric::function::{Function, Shape};
use crate::volumetric::model::{AxisErrors, VolumetricModel};

/// The machine of three axes that is shipped: its volume, a node every 50 mm.
const SPAN_M: [f64; 3] = [0.5, 0.4, 0.3];
pub(super) const NODES: [usize; 3] = [11, 9, 7];
const READINGS: usize = 21;
const ARCSEC: f64 = 4.848_137e-6;

fn volume() -> Volume {
    Volume::new(Point::ZERO, Point::of(SPAN_M)).unwrap()
}

pub(super) fn working_tool() -> Point {
    Point::from_mm(0.0, 0.0, -100.0)
}

/// The reflector on an arm.
pub(super) fn arm() -> Point {
    Point::from_mm(250.0, 0.0, -100.0)
}

/// ±5 µm and ±3″ that keep the conventions, from one node to the next: worse than any real one.
pub(super) fn truth(
    chain: &str,
    without: &[ErrorName],
    shape: Shape,
    chance: &mut Chance,
) -> VolumetricModel {
    let mut axes: [AxisErrors; 3] = Default::default();
    for axis in Axis::ALL {
        let i = axis.index();
        let last = NODES[i] - 1;
        let at: Vec<Metres> = (0..=last)
            .map(|n| Metres(SPAN_M[i] * n as f64 / last as f64))
            .collect();
        for k in Axis::ALL {
            let mut values: Vec<Metres> = at.iter().map(|_| um(5.0 * chance.even())).collect();
            if k == axis {
                values[0] = Metres::ZERO;
            } else {
                let line = straightness(&at, &values, ReferenceLine::LeastSquares);
                values = line.unwrap().deviations;
            }
            let mut tilts: Vec<Radians> = at
                .iter()
                .map(|_| Radians(3.0 * ARCSEC * chance.even()))
                .collect();
            tilts[0] = Radians::ZERO;
            let own = &mut axes[i];
            own.along[k.index()] = Some(Function::new(&at, &values, shape).unwrap());
            if !without.contains(&ErrorName::About(axis, k)) {
                own.about[k.index()] = Some(Function::new(&at, &tilts, shape).unwrap());
            }
        }
    }
    let lean = || Radians(15.0 * ARCSEC * chance.even());
    model(machine(chain, volume(), axes, lean))
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// 0.1 µm and 0.1″ of noise, an unknown zero, and a straight edge that leans by up to 100 µrad.
pub(super) fn measure(
    truth: &VolumetricModel,
    design: &StandardDesign,
    chance: &mut Chance,
) -> Vec<Observation> {
    let mut observations = Vec::new();
    for (run, line) in design.lines.iter().enumerate() {
        let (zero, lean) = (chance.even() * 1e-5, chance.even() * 1e-4);
        for at in line.points(READINGS) {
            let way = (at - line.from).distance().value();
            let moved = |tool: Point| {
                let now = still(truth, line.tool + tool);
                truth.deviation(at, &now).unwrap().array()
            };
            let (value, u) = match line.reading(0.0, 1.0) {
                Reading::Length { along, .. } => {
                    let leaning = if line.optics == Optics::Linear {
                        0.0
                    } else {
                        lean
                    };
                    (dot(along, moved(Point::ZERO)) + leaning * way, 1e-7)
                }
                Reading::Angle { about, .. } => {
                    // By the right hand, how a point 0.1 m along the next direction moves on.
                    let (next, last) = ((about.index() + 1) % 3, (about.index() + 2) % 3);
                    let mut aside = [0.0; 3];
                    aside[next] = 0.1;
                    let turned = moved(Point::of(aside))[last] - moved(Point::ZERO)[last];
                    (turned / 0.1, 0.1 * ARCSEC)
                }
            };
            observations.push(Observation {
                at,
                tool: line.tool,
                run,
                reading: line.reading(value + zero + u * chance.normal(), u),
                common: 0.0,
                common_of_run: 0.0,
            });
        }
    }
    observations
}

fn corners_and_middles() -> Vec<Point> {
    let place = |n: usize| {
        let share = |k: usize| (n / 3_usize.pow(k as u32) % 3) as f64 / 2.0;
        Point::of(core::array::from_fn(|k| SPAN_M[k] * share(k)))
    };
    (0..27).map(place).collect()
}

pub(super) fn design(chain: &str, tools: &[Point], rolls: [bool; 3]) -> StandardDesign {
    standard_design(chain.parse().unwrap(), &volume(), tools, rolls)
}

#[test]
fn the_standard_lines_see_all_of_every_kind_of_chain() {
    let other_arm = Point::from_mm(0.0, 200.0, -100.0);
    let tools = [working_tool(), arm(), other_arm];
    for chain in ["FXYZ", "XFYZ", "YXFZ", "FZYX", "ZFXY"] {
        for rolls in [[true, false, false], [false; 3], [true; 3]] {
            let design = design(chain, &tools, rolls);
            assert!(design.without_effect.is_empty(), "{chain}");
            let mut chance = Chance(1);
            let observations = measure(
                &truth(chain, &[], Shape::Linear, &mut chance),
                &design,
                &mut chance,
            );
            let plan = design.plan([5, 4, 4], Point::ZERO, Shape::Linear);
            assert_eq!(plan.functions.len(), 18);
            let seen = plan.observability(&observations).unwrap();
            assert!(seen.is_complete(), "{chain} {rolls:?}: {seen}");
            assert!(
                seen.condition < 200.0,
                "{chain} {rolls:?}: {}",
                seen.condition
            );
        }
    }
}

/// With the roll detectors of the shipped machine on x: the reflector where the tool is and once on
/// an arm. With the tool alone the roll of z, which moves nothing then, is left out.
#[test]
fn the_shipped_machines_tool_is_known_to_half_a_micrometre_and_no_better_than_stated() {
    let only = design("FXYZ", &[working_tool()], [true, false, false]);
    assert_eq!(only.lines.len(), 21);
    let roll_of_z = ErrorName::About(Axis::Z, Axis::Z);
    assert_eq!(only.without_effect, [roll_of_z]);
    let with_arm = design("FXYZ", &[working_tool(), arm()], [true, false, false]);
    assert_eq!(with_arm.lines.len(), 24);
    // Splines make a little more of the noise between their nodes.
    for (shape, most_um) in [(Shape::Linear, 0.5), (Shape::Spline, 0.55)] {
        expect_as_sure_as_stated(&only, &[working_tool()], shape, most_um);
        expect_as_sure_as_stated(&with_arm, &[working_tool(), arm()], shape, most_um);
    }
}

/// Identified and used by the shape that the machine has.
fn expect_as_sure_as_stated(design: &StandardDesign, tools: &[Point], shape: Shape, most_um: f64) {
    const SEEDS: u32 = 8;
    let (mut squares, mut count, mut readings, mut spare) = (0.0, 0.0, 0.0, 0);
    for seed in 0..SEEDS {
        let mut chance = Chance(1000 + u64::from(seed));
        let truth = truth("FXYZ", &design.without_effect, shape, &mut chance);
        let observations = measure(&truth, design, &mut chance);
        let plan = design.plan(NODES, Point::ZERO, shape);
        let found = as_drawn(&plan, &observations);
        readings += found.residuals.iter().map(|it| it * it).sum::<f64>();
        spare += found.degrees_of_freedom;
        let mut own = truth.machine().clone();
        own.axes = found.axis_errors(shape).unwrap();
        own.squareness = found.squareness;
        let own = model(own);
        for tool in tools {
            let enlarged = found.birge_ratio.unwrap().max(1.0);
            for at in corners_and_middles() {
                let of =
                    |it: &VolumetricModel| it.deviation(at, &still(it, *tool)).unwrap().array();
                let (seen, expected) = (of(&own), of(&truth));
                let u = found.standard_uncertainty(at, *tool, &[]).unwrap();
                assert!(u.distance().um() / enlarged < most_um, "{at:?}: {u:?}");
                for (k, u) in u.array().into_iter().enumerate() {
                    // At the origin of the axes with everything zero little is uncertain.
                    if u > 1e-9 {
                        squares += ((seen[k] - expected[k]) / u).powi(2);
                        count += 1.0;
                    }
                }
            }
        }
    }
    // Some 2500 spare readings: 1 ± 0.03 in χ².
    let birge = readings / f64::from(u32::try_from(spare).unwrap());
    assert!((0.9..1.1).contains(&birge), "{shape:?}: {birge}");
    // Errors at 27 places depend on each other: some twenty independent ones a seed.
    let rms = f64::sqrt(squares / count);
    assert!((0.8..1.2).contains(&rms), "{shape:?}: {rms}");
}

/// Diagonals are read between the nodes too: what straight lines leave there of a smooth machine is no fault
/// of the readings, and part of what is stated.
#[test]
fn a_smooth_machine_drawn_by_straight_lines_is_less_certain_between_its_nodes() {
    let Measured {
        plan, observations, ..
    } = Rig::default().measured(3);
    let between = Point::from_mm(225.0, 175.0, 125.0);
    let of = |shape: Shape| {
        let plan = Plan {
            shape,
            ..plan.clone()
        };
        let found = plan.identify(&observations).unwrap();
        let birge = found.birge_ratio.unwrap();
        assert!((0.6..1.4).contains(&birge), "{shape:?}: {birge}");
        let u = found.standard_uncertainty(between, TOOL, &[]).unwrap();
        (
            u.distance(),
            as_drawn(&plan, &observations).birge_ratio.unwrap(),
        )
    };
    let ((straight, unexplained), (smooth, _)) = (of(Shape::Linear), of(Shape::Spline));
    assert!(unexplained > 2.0, "{unexplained}");
    assert!(straight > smooth * 1.5, "{straight:?} {smooth:?}");
}

/// What each group of lines is there for is unseen without it.
#[test]
fn without_the_lines_for_it_an_error_stays_unseen() {
    let mut chance = Chance(2);
    let whole = design("FXYZ", &[working_tool(), arm()], [false; 3]);
    let truth = truth("FXYZ", &[], Shape::Linear, &mut chance);
    let about = |axis| Unknown::Function(ErrorName::About(axis, axis));
    for (purposes, unseen) in [
        (
            vec![Purpose::Squarenesses],
            Unknown::Squareness(SquarenessName::ZToX),
        ),
        (
            vec![Purpose::Tilt(Axis::Z, Axis::X)],
            Unknown::Function(ErrorName::About(Axis::Z, Axis::X)),
        ),
        (
            vec![
                Purpose::RollOnLever(Axis::X),
                Purpose::EvenRollOnLever(Axis::X),
            ],
            about(Axis::X),
        ),
        (vec![Purpose::EvenRollOnLever(Axis::Z)], about(Axis::Z)),
    ] {
        let mut fewer = whole.clone();
        fewer.lines.retain(|it| !purposes.contains(&it.purpose));
        assert!(fewer.lines.len() < whole.lines.len());
        let observations = measure(&truth, &fewer, &mut chance);
        let plan = fewer.plan([5, 4, 4], Point::ZERO, Shape::Linear);
        let seen = plan.observability(&observations).unwrap();
        assert!(!seen.sees(unseen), "{purposes:?}: {seen}");
    }
}

#[test]
fn a_line_says_what_is_set_up_where_and_what_for() {
    let design = design("FXYZ", &[working_tool()], [true, false, false]);
    let words: Vec<String> = design
        .lines
        .iter()
        .map(|it| it.purpose.to_string())
        .collect();
    assert_eq!(words[0], "positioning of x; warm: expansion of its scale");
    assert_eq!(words[9], "tilt of x about y; warm: bending of its guide");
    assert_eq!(
        words[20],
        "roll of y, by its straightness at the end of a lever"
    );
    let warm = design.lines.iter().filter(|it| it.is_for_warmth()).count();
    assert_eq!(warm, 3 + 6);
    let roll = design.lines[20];
    assert_eq!(roll.optics, Optics::Straightness(Axis::X));
    assert_eq!(
        roll.points(2),
        [
            Point::from_mm(0.0, 0.0, 300.0),
            Point::from_mm(0.0, 400.0, 300.0)
        ]
    );
    let diagonal = &design.lines[16];
    assert_eq!(
        (diagonal.optics, diagonal.purpose),
        (Optics::Linear, Purpose::Squarenesses)
    );
    let Reading::Length { along, .. } = diagonal.reading(1e-6, 1e-7) else {
        panic!("{diagonal:?}");
    };
    assert!((dot(along, along) - 1.0).abs() < 1e-12);
}
