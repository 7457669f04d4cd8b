use super::rig::as_drawn;
use super::*;
use crate::volumetric::Volume;
use crate::volumetric::function::{Function, Shape};
use crate::volumetric::model::{AxisErrors, Machine, Squareness, VolumetricModel};
use crate::volumetric::online::MovingState;

const SPAN: [f64; 3] = [0.6, 0.5, 0.4];

pub(super) fn um(um: f64) -> Metres {
    Metres::from_um(um)
}

/// −1 to 1, from a seed.
pub(super) struct Chance(pub(super) u64);

impl Chance {
    pub(super) fn even(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    /// Near enough to a normal distribution of standard deviation 1: twelve even ones.
    pub(super) fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.even()).sum::<f64>() / 2.0
    }
}

pub(super) fn volume() -> Volume {
    Volume::new(Point::ZERO, Point::of(SPAN)).unwrap()
}

pub(super) fn nodes(axis: Axis, count: usize) -> Vec<Metres> {
    let last = (count - 1) as f64;
    (0..count)
        .map(|n| Metres(SPAN[axis.index()] * n as f64 / last))
        .collect()
}

fn all_names() -> Vec<ErrorName> {
    let of = |axis: Axis| {
        let along = Axis::ALL.map(|k| ErrorName::Along(axis, k));
        along
            .into_iter()
            .chain(Axis::ALL.map(|k| ErrorName::About(axis, k)))
    };
    Axis::ALL.into_iter().flat_map(of).collect()
}

/// A machine with 18 functions of 4 nodes that keep the conventions, and 3 squarenesses.
pub(super) fn machine(chain: &str, chance: &mut Chance) -> Machine {
    let mut axes: [AxisErrors; 3] = Default::default();
    for axis in Axis::ALL {
        let at = nodes(axis, 4);
        for k in Axis::ALL {
            let mut values: Vec<Metres> = at.iter().map(|_| um(5.0 * chance.even())).collect();
            if k == axis {
                values[0] = Metres::ZERO;
            } else {
                values = straightness(&at, &values, ReferenceLine::LeastSquares)
                    .unwrap()
                    .deviations;
            }
            let mut tilts: Vec<Radians> =
                at.iter().map(|_| Radians(20e-6 * chance.even())).collect();
            tilts[0] = Radians::ZERO;
            let errors = &mut axes[axis.index()];
            errors.along[k.index()] = Some(Function::new(&at, &values, Shape::Linear).unwrap());
            errors.about[k.index()] = Some(Function::new(&at, &tilts, Shape::Linear).unwrap());
        }
    }
    Machine {
        tool_max: Metres(0.3),
        ..rig::machine(chain, volume(), axes, || Radians(30e-6 * chance.even()))
    }
}

pub(super) fn model(machine: Machine) -> VolumetricModel {
    rig::model(machine, um(500.0))
}

pub(super) fn plan(chain: &str, names: &[ErrorName], count: usize, runs: Vec<RunSetup>) -> Plan {
    let function = |name: &ErrorName| {
        let (ErrorName::Along(axis, _) | ErrorName::About(axis, _)) = *name;
        FunctionPlan {
            name: *name,
            nodes: nodes(axis, count),
        }
    };
    Plan {
        chain: chain.parse().unwrap(),
        functions: names.iter().map(function).collect(),
        shape: Shape::Linear,
        squarenesses: SquarenessName::ALL.to_vec(),
        runs,
        zero: Point::ZERO,
        thermal: ThermalPlan::default(),
    }
}

pub(super) const OFFSET: RunSetup = RunSetup {
    offset: true,
    alignment: None,
};

/// Displacements along the line of `points`, with one zero, of standard uncertainty 0.1 µm.
fn along_line(
    points: &[Point],
    tool: Point,
    run: usize,
    of: impl Fn(Point) -> Point,
) -> Vec<Observation> {
    let along = direction(points).unwrap();
    let dot = |p: Point| {
        let deviation = of(p).array();
        along[0] * deviation[0] + along[1] * deviation[1] + along[2] * deviation[2]
    };
    let first = dot(points[0]);
    let reading = |p: Point| Reading::Length {
        along,
        deviation: Metres(dot(p) - first),
        u: um(0.1),
    };
    points
        .iter()
        .map(|at| Observation {
            at: *at,
            tool,
            run,
            reading: reading(*at),
            common: 0.0,
            common_of_run: 0.0,
        })
        .collect()
}

/// In every one of four tools: 60 places, read along x, y and z.
fn everywhere(
    model: &VolumetricModel,
    chance: &mut Chance,
    noise: f64,
) -> (Vec<RunSetup>, Vec<Observation>) {
    let tools = [
        [0.0; 3],
        [0.2, 0.0, -0.1],
        [0.0, 0.2, -0.1],
        [-0.1, 0.1, -0.25],
    ];
    let (mut runs, mut observations) = (Vec::new(), Vec::new());
    for tool in tools.map(Point::of) {
        let now = model
            .conditions(tool, &[], &MovingState::default())
            .unwrap();
        for axis in Axis::ALL {
            let mut along = [0.0; 3];
            along[axis.index()] = 1.0;
            for _ in 0..60 {
                let at = Point::of(core::array::from_fn(|k| {
                    SPAN[k] * (chance.even() + 1.0) / 2.0
                }));
                let deviation = model.deviation(at, &now).unwrap().along(axis);
                let deviation = deviation + um(7.0) + um(noise * chance.normal());
                let reading = Reading::Length {
                    along,
                    deviation,
                    u: um(0.1),
                };
                observations.push(Observation {
                    at,
                    tool,
                    run: runs.len(),
                    reading,
                    common: 0.0,
                    common_of_run: 0.0,
                });
            }
            runs.push(OFFSET);
        }
    }
    (runs, observations)
}

#[test]
fn all_twenty_one_errors_are_found_again_in_every_kind_of_chain() {
    for (seed, chain) in ["FXYZ", "XFYZ", "YXFZ"].into_iter().enumerate() {
        let mut chance = Chance(seed as u64);
        let truth = model(machine(chain, &mut chance));
        let (runs, observations) = everywhere(&truth, &mut chance, 0.0);
        let found = plan(chain, &all_names(), 4, runs)
            .identify(&observations)
            .unwrap();
        let squareness = truth.machine().squareness;
        // The model is exact, the design of first order: a few nanometres and nanoradians.
        let close = |seen: Radians, expected: Radians| (seen - expected).abs().value() < 5e-8;
        assert!(close(found.squareness.y_to_x, squareness.y_to_x), "{chain}");
        assert!(close(found.squareness.z_to_x, squareness.z_to_x), "{chain}");
        assert!(close(found.squareness.z_to_y, squareness.z_to_y), "{chain}");
        for function in &found.functions {
            for (node, seen) in function.nodes.iter().zip(&function.values) {
                let expected = match function.name {
                    ErrorName::Along(axis, k) => truth.machine().axes[axis.index()].along
                        [k.index()]
                    .as_ref()
                    .unwrap()
                    .at(*node)
                    .value(),
                    ErrorName::About(axis, k) => truth.machine().axes[axis.index()].about
                        [k.index()]
                    .as_ref()
                    .unwrap()
                    .at(*node)
                    .value(),
                };
                let within = if matches!(function.name, ErrorName::Along(..)) {
                    1e-8
                } else {
                    5e-8
                };
                assert!(
                    (seen - expected).abs() < within,
                    "{chain}, {}: {seen:e}, {expected:e}",
                    function.name
                );
            }
        }
        assert!(found.birge_ratio.unwrap() < 0.1);
    }
}

/// With noise as stated: what is found is off by its uncertainties, and so is the deviation.
#[test]
fn uncertainties_say_how_far_off_the_errors_found_are() {
    let (mut squares, mut count) = (0.0, 0.0);
    let (mut at_tool, mut places) = (0.0, 0.0);
    for seed in 0..6 {
        let mut chance = Chance(100 + seed);
        let truth = model(machine("XFYZ", &mut chance));
        let (runs, observations) = everywhere(&truth, &mut chance, 0.1);
        let found = as_drawn(&plan("XFYZ", &all_names(), 4, runs), &observations);
        let birge = found.birge_ratio.unwrap();
        assert!((0.85..1.15).contains(&birge), "{birge}");
        let mut own = truth.machine().clone();
        own.axes = found.axis_errors(Shape::Linear).unwrap();
        own.squareness = found.squareness;
        for function in &found.functions {
            let errors = &truth.machine().axes;
            for (node, (seen, u)) in function
                .nodes
                .iter()
                .zip(function.values.iter().zip(&function.u))
            {
                let expected = match function.name {
                    ErrorName::Along(axis, k) => errors[axis.index()].along[k.index()]
                        .as_ref()
                        .unwrap()
                        .at(*node)
                        .value(),
                    ErrorName::About(axis, k) => errors[axis.index()].about[k.index()]
                        .as_ref()
                        .unwrap()
                        .at(*node)
                        .value(),
                };
                if *u > 1e-15 {
                    squares += ((seen - expected) / u).powi(2);
                    count += 1.0;
                }
            }
        }
        let own = model(own);
        let tool = Point::of([0.05, 0.0, -0.15]);
        let now = truth
            .conditions(tool, &[], &MovingState::default())
            .unwrap();
        for _ in 0..50 {
            let at = Point::of(core::array::from_fn(|k| {
                SPAN[k] * (chance.even() + 1.0) / 2.0
            }));
            let deviation = |model: &VolumetricModel| model.deviation(at, &now).unwrap();
            let off = deviation(&own) - deviation(&truth);
            let u = found
                .standard_uncertainty(at, tool, &[])
                .unwrap()
                .distance();
            at_tool += (off.distance() / u).powi(2);
            places += 1.0;
        }
    }
    let rms = f64::sqrt(squares / count);
    assert!((0.85..1.15).contains(&rms), "{rms}");
    let rms = f64::sqrt(at_tool / places);
    assert!((0.8..1.2).contains(&rms), "{rms}");
}

/// Readings at the tool's zero never see how the last axis before the tool tilts.
#[test]
fn tilts_that_act_on_no_lever_are_named_and_refused() {
    let mut chance = Chance(7);
    let truth = model(machine("FXYZ", &mut chance));
    let (runs, observations) = everywhere(&truth, &mut chance, 0.0);
    let without: Vec<Observation> = observations.into_iter().filter(|it| it.run < 3).collect();
    let plan = plan("FXYZ", &all_names(), 4, runs[..3].to_vec());
    let seen = plan.observability(&without).unwrap();
    for name in all_names() {
        // About z, x turns its lever along y and y turns z's alone: nothing at a tool of zero.
        let hidden = matches!(
            name,
            ErrorName::About(Axis::Z, _) | ErrorName::About(Axis::Y, Axis::Z)
        );
        assert_eq!(
            !seen.sees(Unknown::Function(name)),
            hidden,
            "{name}: {seen}"
        );
    }
    assert_eq!(seen.unseen.len(), 4 * 3);
    let refused = plan.identify(&without).unwrap_err();
    assert!(matches!(refused, IdentifyError::Unobservable { .. }));
    let text = refused.to_string();
    assert!(
        text.contains("e_az (3 combinations)") && text.contains("tool offset"),
        "{text}"
    );
}

/// Lengths of body diagonals tell the squarenesses, but only one combination of the scales of
/// x, y and z: two are open.
#[test]
fn body_diagonals_alone_tell_squarenesses_but_not_scales() {
    let scales = Axis::ALL.map(|axis| ErrorName::Along(axis, axis));
    let plan = plan("FXYZ", &scales, 2, vec![OFFSET; 4]);
    let squareness = Squareness {
        y_to_x: Radians(10e-6),
        z_to_x: Radians(-20e-6),
        z_to_y: Radians(5e-6),
        u: [Radians::ZERO; 3],
    };
    let mut plain = machine("FXYZ", &mut Chance(1));
    plain.axes = Default::default();
    plain.squareness = squareness;
    let truth = model(plain);
    let now = truth
        .conditions(Point::ZERO, &[], &MovingState::default())
        .unwrap();
    let of = |at: Point| truth.deviation(at, &now).unwrap();
    let diagonals = body_diagonals(&volume(), 5);
    let lines = diagonals.iter().enumerate();
    let observations: Vec<Observation> = lines
        .flat_map(|(run, points)| along_line(points, Point::ZERO, run, of))
        .collect();
    let seen = plan.observability(&observations).unwrap();
    assert_eq!(seen.unseen.len(), 2, "{seen}");
    for name in scales {
        assert!(!seen.sees(Unknown::Function(name)), "{name}: {seen}");
    }
    for name in SquarenessName::ALL {
        assert!(seen.sees(Unknown::Squareness(name)), "{name}: {seen}");
    }
    let without = Plan {
        functions: vec![],
        ..plan
    };
    let found = without.identify(&observations).unwrap().squareness;
    assert!((found.y_to_x.value() - 10e-6).abs() < 1e-12, "{found:?}");
    assert!((found.z_to_x.value() + 20e-6).abs() < 1e-12, "{found:?}");
    assert!((found.z_to_y.value() - 5e-6).abs() < 1e-12, "{found:?}");
}

/// Sides 0.3 and 0.4 m: the diagonals are 0.5 m long. 10 µrad: −2.4 and +2.4 µm.
#[test]
fn face_diagonals_tell_the_squareness_in_closed_form_and_by_least_squares() {
    let closed = squareness_of_face_diagonals(um(-2.4), um(2.4), Metres(0.3), Metres(0.4));
    assert!((closed.value() - 10e-6).abs() < 1e-15);
    let face = Volume::new(Point::ZERO, Point::of([0.3, 0.4, 0.1])).unwrap();
    let lengths = [um(-2.4), um(2.4)];
    let mut observations = Vec::new();
    for (run, points) in face_diagonals(&face, Axis::Z, 2).iter().enumerate() {
        let along = direction(points).unwrap();
        for (at, deviation) in points.iter().zip([Metres::ZERO, lengths[run]]) {
            let reading = Reading::Length {
                along,
                deviation,
                u: um(0.1),
            };
            observations.push(Observation {
                at: *at,
                tool: Point::ZERO,
                run,
                reading,
                common: 0.0,
                common_of_run: 0.0,
            });
        }
    }
    let plan = Plan {
        squarenesses: vec![SquarenessName::YToX],
        ..plan("FXYZ", &[], 2, vec![OFFSET; 2])
    };
    let found = plan.identify(&observations).unwrap();
    assert!((found.squareness.y_to_x.value() - 10e-6).abs() < 1e-15);
    // Each length has √2·0.1 µm; c = (falling − rising)·0.5/0.24 over m.
    let u = 0.1e-6 * f64::sqrt(2.0) * f64::sqrt(2.0) * 0.5 / 0.24;
    assert!((found.squareness.u[0].value() / u - 1.0).abs() < 1e-9);
}

/// A square of unknown alignment: x along one edge, y along the other; what both slopes have in
/// common with opposite signs is the alignment, the rest the squareness (12 µrad).
#[test]
fn a_square_tells_squareness_and_two_straightnesses() {
    let run = |factor: f64| RunSetup {
        offset: true,
        alignment: Some(Alignment { angle: 0, factor }),
    };
    let names = [
        ErrorName::Along(Axis::X, Axis::Y),
        ErrorName::Along(Axis::Y, Axis::X),
    ];
    let plan = Plan {
        squarenesses: vec![SquarenessName::YToX],
        ..plan("FXYZ", &names, 5, vec![run(1.0), run(-1.0)])
    };
    let bow = |share: f64| um(4.0 * share * (1.0 - share));
    let mut observations = Vec::new();
    for n in 0..5 {
        let share = f64::from(n) / 4.0;
        let (x, y) = (0.6 * share, 0.5 * share);
        // The square is turned by 50 µrad: x's edge reads +50·x, y's −50·y.
        for (at, run, along, value) in [
            ([x, 0.0, 0.0], 0, [0.0, 1.0, 0.0], bow(share) + um(50.0 * x)),
            (
                [0.0, y, 0.0],
                1,
                [1.0, 0.0, 0.0],
                -bow(share) - um(12.0 * y) - um(50.0 * y),
            ),
        ] {
            let reading = Reading::Length {
                along,
                deviation: value + um(3.0),
                u: um(0.1),
            };
            observations.push(Observation {
                at: Point::of(at),
                tool: Point::ZERO,
                run,
                reading,
                common: 0.0,
                common_of_run: 0.0,
            });
        }
    }
    let found = plan.identify(&observations).unwrap();
    assert!(
        (found.squareness.y_to_x.value() - 12e-6).abs() < 1e-12,
        "{:?}",
        found.squareness
    );
    // The bow less its least-squares line, which is its mean: 0, 0.75, 1, 0.75, 0 less 0.5.
    for (seen, expected) in found.functions[0]
        .values
        .iter()
        .zip([-0.5, 0.25, 0.5, 0.25, -0.5])
    {
        assert!((seen * 1e6 - expected).abs() < 1e-6, "{seen:e}");
    }
    let alone = Plan {
        runs: vec![
            run(1.0),
            RunSetup {
                offset: true,
                alignment: Some(Alignment {
                    angle: 1,
                    factor: 1.0,
                }),
            },
        ],
        ..plan
    };
    let seen = alone.observability(&observations).unwrap();
    assert_eq!(seen.to_string(), "squareness of y to x / alignment angle 1");
}

/// 0, 3, 3, 6 µm at 0, 1, 2, 3 m: slope 9/5 and offset 0.3 by least squares, slope 2 by the ends.
#[test]
fn straightness_is_what_its_reference_line_leaves() {
    let positions = [0.0, 1.0, 2.0, 3.0].map(Metres);
    let values = [0.0, 3.0, 3.0, 6.0].map(um);
    for (line, slope, expected, error) in [
        (
            ReferenceLine::LeastSquares,
            1.8,
            [-0.3, 0.9, -0.9, 0.3],
            1.8,
        ),
        (ReferenceLine::EndPoints, 2.0, [0.0, 1.0, -1.0, 0.0], 2.0),
    ] {
        let seen = straightness(&positions, &values, line).unwrap();
        assert!((seen.slope.value() * 1e6 - slope).abs() < 1e-9, "{seen:?}");
        assert!((seen.error.um() - error).abs() < 1e-9, "{seen:?}");
        for (seen, expected) in seen.deviations.iter().zip(expected) {
            assert!((seen.um() - expected).abs() < 1e-9);
        }
    }
    assert!(straightness(&positions[..1], &values[..1], ReferenceLine::EndPoints).is_err());
    assert!(straightness(&positions, &values[..3], ReferenceLine::EndPoints).is_err());
}

/// Angles read while x moves tell its tilts without any lever.
#[test]
fn an_autocollimator_tells_tilts() {
    let names = [ErrorName::About(Axis::X, Axis::Z)];
    let plan = Plan {
        squarenesses: vec![],
        ..plan("FXYZ", &names, 4, vec![OFFSET])
    };
    let observations: Vec<Observation> = (0..4)
        .map(|n| Observation {
            at: Point::of([0.2 * f64::from(n), 0.1, 0.1]),
            tool: Point::ZERO,
            run: 0,
            reading: Reading::Angle {
                about: Axis::Z,
                deviation: Radians(1e-6 * f64::from(n * n) + 7e-6),
                u: Radians(1e-7),
            },
            common: 0.0,
            common_of_run: 0.0,
        })
        .collect();
    let found = plan.identify(&observations).unwrap();
    for (n, seen) in found.functions[0].values.iter().enumerate() {
        assert!((seen - 1e-6 * (n * n) as f64).abs() < 1e-15);
    }
    assert_eq!(found.degrees_of_freedom, 0);
    assert_eq!(found.birge_ratio, None);
}

#[test]
fn plans_and_readings_that_do_not_fit_are_refused_by_number() {
    let good = plan(
        "FXYZ",
        &[ErrorName::Along(Axis::X, Axis::X)],
        3,
        vec![OFFSET],
    );
    let reading = Reading::Length {
        along: [1.0, 0.0, 0.0],
        deviation: um(1.0),
        u: um(0.1),
    };
    let at = |x: f64, run: usize, reading: Reading| {
        [Observation {
            at: Point::of([x, 0.0, 0.0]),
            tool: Point::ZERO,
            run,
            reading,
            common: 0.0,
            common_of_run: 0.0,
        }]
    };
    let (index, run, runs) = (0, 1, 1);
    let seen = good.observability(&at(0.1, 1, reading));
    assert_eq!(seen, Err(IdentifyError::Run { index, run, runs }));
    let seen = good.observability(&at(0.7, 0, reading));
    assert!(matches!(
        seen,
        Err(IdentifyError::Outside { axis: Axis::X, .. })
    ));
    for along in [[1.0, 1.0, 0.0], [f64::NAN, 0.0, 0.0]] {
        let skew = Reading::Length {
            along,
            deviation: um(1.0),
            u: um(0.1),
        };
        let seen = good.observability(&at(0.1, 0, skew));
        assert_eq!(seen, Err(IdentifyError::NotUsable { index }));
    }
    let certain = Reading::Length {
        along: [1.0, 0.0, 0.0],
        deviation: um(1.0),
        u: um(0.0),
    };
    assert_eq!(
        good.observability(&at(0.1, 0, certain)),
        Err(IdentifyError::NotUsable { index })
    );
    let mut twice = good.clone();
    twice.functions.push(twice.functions[0].clone());
    assert!(matches!(
        twice.observability(&[]),
        Err(IdentifyError::Nodes { .. })
    ));
    let mut short = good.clone();
    short.functions[0].name = ErrorName::Along(Axis::X, Axis::Y);
    short.functions[0].nodes.truncate(2);
    assert!(matches!(
        short.observability(&[]),
        Err(IdentifyError::Nodes { least: 3, .. })
    ));
    let mut far = good.clone();
    far.zero = Point::of([-0.1, 0.0, 0.0]);
    assert!(matches!(
        far.observability(&[]),
        Err(IdentifyError::Zero { .. })
    ));
    // Nothing measured tells nothing.
    let nothing = good.observability(&[]).unwrap();
    assert_eq!(nothing.unseen.len(), 2 + 3 + 1);
}
