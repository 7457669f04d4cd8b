use nalgebra::{Matrix4, Rotation3, Translation3, Vector3, Vector4};
use proptest::prelude::*;

use super::*;
use crate::volumetric::function::{Function, Shape};

fn um(um: f64) -> Metres {
    Metres::from_um(um)
}

fn limits() -> Limits {
    Limits {
        size: um(500.0),
        slope: 0.1,
        rate: MetresPerSecond(0.1),
    }
}

/// 600 × 500 × 400 mm without any error.
fn machine(chain: &str) -> Machine {
    Machine {
        chain: chain.parse().unwrap(),
        volume: Volume::new(Point::ZERO, Point::from_mm(600.0, 500.0, 400.0)).unwrap(),
        axes: Default::default(),
        squareness: Squareness::default(),
        thermal: Thermal::default(),
        tool_max: Metres(0.3),
        displacement_max: um(100.0),
        roll_max: Radians::from_arcsec(60.0),
    }
}

fn constant<Q: Quantity>(value: Q) -> Option<Function<Q>> {
    Some(Function::constant(Metres(-1.0), Metres(1.0), value).unwrap())
}

fn still(model: &VolumetricModel, tool: Point) -> Conditions {
    let references: Vec<Celsius> = model
        .machine()
        .thermal
        .channels
        .iter()
        .map(|it| it.reference)
        .collect();
    model
        .conditions(tool, &references, &MovingState::default())
        .unwrap()
}

#[track_caller]
fn check_um(seen: Point, expected: [f64; 3]) {
    for (axis, expected) in Axis::ALL.into_iter().zip(expected) {
        let seen = seen.along(axis).um();
        assert!(
            (seen - expected).abs() < 2e-6,
            "{axis}: {seen} um, not {expected}"
        );
    }
}

/// x turns the rest by 10 µrad about z: y + tool = 0.3 + 0.2 m to the side make −5 µm along x.
/// A table under the tool (XFYZ) also turns its own 0.4 m: +4 µm along y.
#[test]
fn a_tilt_acts_on_the_tool_and_on_the_axes_nearer_to_it() {
    let at = Point::from_mm(400.0, 300.0, 100.0);
    for (chain, expected) in [
        ("FXYZ", [-5.0, 0.0, 0.0]),
        ("XFYZ", [-5.0, 4.0, 0.0]),
        ("FYZX", [-2.0, 0.0, 0.0]),
    ] {
        let mut machine = machine(chain);
        machine.axes[0].about[2] = constant(Radians(10e-6));
        let model = VolumetricModel::new(machine, limits()).unwrap();
        let now = still(&model, Point::from_mm(0.0, 200.0, 0.0));
        // The second order of 10 µrad on 0.5 m is 25 pm.
        let seen = model.deviation(at, &now).unwrap();
        for (axis, expected) in Axis::ALL.into_iter().zip(expected) {
            assert!(
                (seen.along(axis).um() - expected).abs() < 6e-5,
                "{chain}: {seen:?}"
            );
        }
    }
}

/// By the definitions of ISO 230-1: y leans to −x, z to +x, z to −y; 10, 20, 30 µrad.
#[test]
fn squarenesses_lean_the_axes_as_right_handed_rotations() {
    let mut machine = machine("FXYZ");
    machine.squareness.y_to_x = Radians(10e-6);
    machine.squareness.z_to_x = Radians(20e-6);
    machine.squareness.z_to_y = Radians(30e-6);
    let model = VolumetricModel::new(machine, limits()).unwrap();
    let now = still(&model, Point::ZERO);
    let along_y = model
        .deviation(Point::from_mm(0.0, 500.0, 0.0), &now)
        .unwrap();
    check_um(along_y, [-5.0, 0.0, 0.0]);
    let along_z = model
        .deviation(Point::from_mm(0.0, 0.0, 300.0), &now)
        .unwrap();
    check_um(along_z, [6.0, -9.0, 0.0]);
}

/// 5 arcsec are 24.241 µrad: on 200 mm 4.848 µm, which the command takes out.
#[test]
fn a_roll_seen_by_detectors_is_corrected_at_the_tool() {
    let model = VolumetricModel::new(machine("FXYZ"), limits()).unwrap();
    let mut live = MovingState::default();
    live.roll[0] = Radians::from_arcsec(5.0);
    let now = model
        .conditions(Point::from_mm(0.0, 200.0, 0.0), &[], &live)
        .unwrap();
    let target = Point::from_mm(300.0, 0.0, 0.0);
    let seen = model.deviation(target, &now).unwrap();
    assert!((seen.z.um() - 4.848_137).abs() < 1e-5, "{seen:?}");
    let command = model.command(target, &now).unwrap();
    assert!((command.z.um() + 4.848_137).abs() < 1e-5, "{command:?}");
}

/// Displacements of the sliders act on the tool as they are: E of the patent.
#[test]
fn displacements_seen_by_detectors_are_the_patents_errors() {
    let model = VolumetricModel::new(machine("FXYZ"), limits()).unwrap();
    let live = MovingState {
        sideways: [[um(16.0), um(32.0)], [um(1.0), um(2.0)], [um(4.0), um(8.0)]],
        roll: [Radians::ZERO; 3],
    };
    let now = model
        .conditions(Point::from_mm(10.0, 20.0, 30.0), &[], &live)
        .unwrap();
    let at = Point::from_mm(300.0, 200.0, 100.0);
    let seen = model.deviation(at, &now).unwrap();
    check_um(seen, [5.0, 24.0, 34.0]);
    let errors = crate::volumetric::online::Influences::default().errors(at, &live);
    check_um(seen - errors, [0.0; 3]);
}

/// 10 µm/(m·K) along x from 0.1 m on, 2 K: 8 µm at 0.5 m; growth 3 µm/K along z; z leans to +x
/// by 1 µrad/K: 0.8 µm at z = 0.4 m.
#[test]
fn temperatures_expand_grow_and_lean() {
    let mut machine = machine("FXYZ");
    machine.thermal.fixed = Point::from_mm(100.0, 0.0, 0.0);
    machine.thermal.channels.push(ThermalChannel {
        reference: Celsius(20.0),
        low: Celsius(15.0),
        high: Celsius(30.0),
        expansion: [10e-6, 0.0, 0.0],
        growth: Point::new(Metres(0.0), Metres(0.0), um(3.0)),
        squareness: [Radians(0.0), Radians(1e-6), Radians(0.0)],
        u: 0.1,
    });
    let model = VolumetricModel::new(machine, limits()).unwrap();
    let live = MovingState::default();
    let now = model
        .conditions(Point::ZERO, &[Celsius(22.0)], &live)
        .unwrap();
    let at = Point::from_mm(500.0, 0.0, 400.0);
    check_um(model.deviation(at, &now).unwrap(), [8.0 + 0.8, 0.0, 6.0]);
    // 0.1 K: 4 µm/K + 0.4 µm/K along x at once, 3 µm/K along z.
    let u = model
        .standard_uncertainty(at, &now, Metres::ZERO, Radians::ZERO)
        .unwrap();
    check_um(u, [0.44, 0.0, 0.3]);
    let hot = model.conditions(Point::ZERO, &[Celsius(31.0)], &live);
    assert!(
        matches!(hot, Err(ConditionsError::Temperature { channel: 0, .. })),
        "{hot:?}"
    );
    let none = model.conditions(Point::ZERO, &[], &live);
    assert!(
        matches!(none, Err(ConditionsError::Temperatures { .. })),
        "{none:?}"
    );
}

/// Along y: 0.3 µm of e_yx and 1 µrad of e_cx on x levers of a table, 0.4 m: root of squares.
#[test]
fn uncertainties_combine_with_their_levers() {
    let mut machine = machine("XFYZ");
    let nodes = [Metres(0.0), Metres(1.0)];
    let straightness = Function::new(&nodes, &[um(0.0); 2], Shape::Linear).unwrap();
    machine.axes[0].along[1] = Some(straightness.with_uncertainties(&[um(0.3); 2]).unwrap());
    let tilt = Function::new(&nodes, &[Radians(0.0); 2], Shape::Linear).unwrap();
    machine.axes[0].about[2] = Some(tilt.with_uncertainties(&[Radians(1e-6); 2]).unwrap());
    let model = VolumetricModel::new(machine, limits()).unwrap();
    let now = still(&model, Point::ZERO);
    let at = Point::from_mm(400.0, 0.0, 0.0);
    let u = model
        .standard_uncertainty(at, &now, Metres::ZERO, Radians::ZERO)
        .unwrap();
    check_um(u, [0.0, 0.5, 0.0]);
    // Detectors: each sideways direction is displaced by two sliders.
    let u = model
        .standard_uncertainty(at, &now, um(0.1), Radians::ZERO)
        .unwrap();
    check_um(u, [0.02_f64.sqrt(), 0.27_f64.sqrt(), 0.02_f64.sqrt()]);
}

#[test]
fn what_is_outside_or_beyond_the_limits_is_refused_by_name() {
    let mut tilted = machine("FXYZ");
    tilted.axes[0].along[0] = constant(um(400.0));
    tilted.axes[1].along[0] = constant(um(200.0));
    let model = VolumetricModel::new(tilted, limits()).unwrap();
    let now = still(&model, Point::ZERO);
    let outside = model.command(Point::from_mm(601.0, 0.0, 0.0), &now);
    assert!(matches!(
        outside,
        Err(NoCorrection::Outside { axis: Axis::X, .. })
    ));
    let nan = model.deviation(Point::new(Metres(0.0), Metres(f64::NAN), Metres(0.0)), &now);
    assert!(matches!(
        nan,
        Err(NoCorrection::Outside { axis: Axis::Y, .. })
    ));
    let large = model.command(Point::ZERO, &now);
    assert!(matches!(
        large,
        Err(NoCorrection::TooLarge { axis: Axis::X, .. })
    ));
    let tool = model.conditions(
        Point::from_mm(0.0, 0.0, -301.0),
        &[],
        &MovingState::default(),
    );
    assert!(matches!(
        tool,
        Err(ConditionsError::Tool { axis: Axis::Z, .. })
    ));
    let mut live = MovingState::default();
    live.sideways[1][0] = um(101.0);
    let displaced = model.conditions(Point::ZERO, &[], &live);
    assert!(matches!(
        displaced,
        Err(ConditionsError::Displacement { axis: Axis::Y, .. })
    ));
    live = MovingState::default();
    live.roll[2] = Radians(f64::NAN);
    let rolled = model.conditions(Point::ZERO, &[], &live);
    assert!(matches!(
        rolled,
        Err(ConditionsError::Roll { axis: Axis::Z, .. })
    ));
}

fn refusal(change: impl FnOnce(&mut Machine)) -> ModelError {
    let mut machine = machine("FXYZ");
    change(&mut machine);
    VolumetricModel::new(machine, limits())
        .map(|_| ())
        .unwrap_err()
}

#[test]
fn a_machine_that_cannot_be_compensated_is_refused_by_the_functions_name() {
    let seen = refusal(|it| it.axes[2].along[1] = constant(um(600.0)));
    let function = ErrorName::Along(Axis::Z, Axis::Y);
    assert!(matches!(seen, ModelError::TooLarge { function: it, .. } if it == function));
    assert!(seen.to_string().contains("e_yz"), "{seen}");
    // A tilt of 1 mrad on 0.8 m and more.
    let seen = refusal(|it| it.axes[0].about[2] = constant(Radians(1e-3)));
    assert!(seen.to_string().contains("e_cx"), "{seen}");
    let seen = refusal(|it| {
        let nodes = [Metres(0.0), Metres(0.5)];
        let short = Function::new(&nodes, &[um(0.0); 2], Shape::Linear);
        it.axes[0].along[0] = Some(short.unwrap());
    });
    assert!(matches!(seen, ModelError::NotCovered { .. }), "{seen}");
    let steep = |rise: f64| {
        refusal(move |it| {
            let nodes = [
                Metres(-1.0),
                Metres(0.2),
                Metres(0.2 + 400e-6 / rise),
                Metres(1.0),
            ];
            let values = [um(0.0), um(0.0), um(400.0), um(400.0)];
            it.axes[1].along[1] = Some(Function::new(&nodes, &values, Shape::Linear).unwrap());
        })
    };
    let function = ErrorName::Along(Axis::Y, Axis::Y);
    let seen = steep(0.3);
    assert!(
        matches!(seen, ModelError::TooSteep { function: it, .. } if it == function),
        "{seen}"
    );
    let seen = steep(1.2);
    assert!(
        matches!(seen, ModelError::NotContracting { function: it, .. } if it == function),
        "{seen}"
    );
    let seen = refusal(|it| it.roll_max = Radians(f64::NAN));
    assert!(matches!(seen, ModelError::NotUsable { .. }), "{seen}");
    let mut wide = limits();
    wide.slope = 0.9;
    let seen = VolumetricModel::new(machine("FXYZ"), wide).map(|_| ());
    assert!(matches!(seen, Err(ModelError::Limits { .. })));
}

/// Waves and ramps of ±`um` µm and ±`urad` µrad in all eighteen functions, in all shapes.
fn full(chain: &str, seed: u64) -> Machine {
    let mut state = seed;
    let mut random = move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    };
    let mut machine = machine(chain);
    for axis in Axis::ALL {
        let span = machine.volume.high().along(axis).value();
        for k in 0..3 {
            let count = 5 + (axis.index() * 3 + k) % 6;
            let nodes: Vec<Metres> = (0..=count)
                .map(|n| Metres(span * n as f64 / count as f64))
                .collect();
            let shape = [Shape::Linear, Shape::MonotoneCubic, Shape::Spline][k];
            let values: Vec<Metres> = nodes.iter().map(|_| um(5.0 * random())).collect();
            machine.axes[axis.index()].along[k] =
                Some(Function::new(&nodes, &values, shape).unwrap());
            let tilts: Vec<Radians> = nodes.iter().map(|_| Radians(30e-6 * random())).collect();
            machine.axes[axis.index()].about[k] =
                Some(Function::new(&nodes, &tilts, shape).unwrap());
        }
    }
    machine.squareness.y_to_x = Radians(40e-6 * random());
    machine.squareness.z_to_x = Radians(40e-6 * random());
    machine.squareness.z_to_y = Radians(40e-6 * random());
    machine
}

/// The same by matrices: exact rotations, the whole chain multiplied out.
fn by_matrices(machine: &Machine, tool: Point, at: Point) -> Vector3<f64> {
    let mut place = Vector4::new(tool.x.value(), tool.y.value(), tool.z.value(), 1.0);
    let mut nominal = Vector3::new(tool.x.value(), tool.y.value(), tool.z.value());
    for axis in machine.chain.axes().into_iter().rev() {
        let (i, q) = (axis.index(), at.along(axis));
        let errors = &machine.axes[i];
        let mut shift = Vector3::zeros();
        shift[i] = q.value();
        nominal[i] += q.value();
        let mut tilt = Vector3::zeros();
        for k in 0..3 {
            shift[k] += errors.along[k].as_ref().unwrap().at(q).value();
            tilt[k] = errors.about[k].as_ref().unwrap().at(q).value();
        }
        let s = &machine.squareness;
        match axis {
            Axis::X => {}
            Axis::Y => shift[0] -= s.y_to_x.value() * q.value(),
            Axis::Z => {
                shift[0] += s.z_to_x.value() * q.value();
                shift[1] -= s.z_to_y.value() * q.value();
            }
        }
        let rotation: Matrix4<f64> = Rotation3::new(tilt).to_homogeneous();
        let translation = Translation3::from(shift).to_homogeneous();
        let joint = if machine.chain.carries_workpiece(axis) {
            rotation * translation
        } else {
            translation * rotation
        };
        place = joint * place;
    }
    place.xyz() - nominal
}

const CHAINS: [&str; 6] = ["FXYZ", "XFYZ", "YXFZ", "FZYX", "ZFXY", "XYZF"];

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn the_model_agrees_with_exact_matrices_to_a_picometre(
        seed in any::<u64>(), chain in 0_usize..6,
        x in 0.0_f64..0.6, y in 0.0_f64..0.5, z in 0.0_f64..0.4,
        tool in (-0.3_f64..0.3, -0.3_f64..0.3, -0.3_f64..0.3),
    ) {
        let machine = full(CHAINS[chain], seed);
        let tool = Point::of([tool.0, tool.1, tool.2]);
        let at = Point::of([x, y, z]);
        let expected = by_matrices(&machine, tool, at);
        let model = VolumetricModel::new(machine, limits()).unwrap();
        let seen = model.deviation(at, &still(&model, tool)).unwrap();
        for axis in Axis::ALL {
            let difference = seen.along(axis).value() - expected[axis.index()];
            prop_assert!(difference.abs() < 1e-12, "{axis}: {difference:e}");
        }
    }

    #[test]
    fn the_inverse_is_exact_and_the_bound_holds(
        seed in any::<u64>(), chain in 0_usize..6,
        a in (0.0_f64..0.6, 0.0_f64..0.5, 0.0_f64..0.4),
        b in (0.0_f64..0.6, 0.0_f64..0.5, 0.0_f64..0.4),
        near in 1e-6_f64..1.0,
        tool in (-0.3_f64..0.3, -0.3_f64..0.3, -0.3_f64..0.3),
    ) {
        let model = VolumetricModel::new(full(CHAINS[chain], seed), limits()).unwrap();
        let now = still(&model, Point::of([tool.0, tool.1, tool.2]));
        let a = Point::of([a.0, a.1, a.2]);
        let b = Point::of(core::array::from_fn(|k| {
            let (from, to) = (a.array()[k], [b.0, b.1, b.2][k]);
            from + near * (to - from)
        }));
        let command = model.command(a, &now).unwrap();
        let back = command + model.deviation(command, &now).unwrap() - a;
        prop_assert!(back.distance().value() < 1.1e-11, "{back:?}");
        let change = model.deviation(a, &now).unwrap() - model.deviation(b, &now).unwrap();
        let largest = |it: Point| it.array().into_iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        let bound = model.lipschitz() * largest(a - b);
        prop_assert!(largest(change) <= bound + 1e-15, "{} > {bound}", largest(change));
    }
}
