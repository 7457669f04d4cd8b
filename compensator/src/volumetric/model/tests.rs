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
        u_expansion: [0.0; 3],
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
        .standard_uncertainty(at, &now, &Seen::default())
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

/// Coefficients of zero, 15 to 30 °C.
fn channel(u: f64) -> ThermalChannel {
    ThermalChannel {
        reference: Celsius(20.0),
        low: Celsius(15.0),
        high: Celsius(30.0),
        expansion: [0.0; 3],
        u_expansion: [0.0; 3],
        growth: Point::ZERO,
        squareness: [Radians::ZERO; 3],
        u,
    }
}

/// x's guide bows by 4 µm/K up, over 500 mm.
fn bend(is_watched: bool) -> ThermalBend {
    ThermalBend {
        axis: Axis::X,
        towards: Axis::Z,
        over: 0,
        under: Some(1),
        bow: um(4.0),
        u: um(0.1),
        low: Metres(0.0),
        high: Metres(0.5),
        gradient_max: 3.0,
        is_watched,
    }
}

fn bending(chain: &str, is_watched: bool) -> VolumetricModel {
    let mut machine = machine(chain);
    machine.thermal.channels = vec![channel(0.05); 2];
    machine.thermal.bends = vec![bend(is_watched)];
    VolumetricModel::new(machine, limits()).unwrap()
}

/// 2 K make 8 µm in the middle and 4·8 µm/0.5 m = 64 µrad at the ends, x towards z: at its low end
/// the nose is up and a tool 100 mm below goes forward by 6.4 µm; a metre further up on y nothing.
#[test]
fn a_bent_guide_lifts_in_the_middle_and_pitches_at_its_ends() {
    let warm = [Celsius(23.0), Celsius(21.0)];
    let live = MovingState::default();
    let tool = Point::from_mm(0.0, 0.0, -100.0);
    for (chain, is_watched, x, expected) in [
        ("FXYZ", false, 0.0, [6.4, 0.0, 0.0]),
        ("FXYZ", false, 250.0, [0.0, 0.0, 8.0]),
        ("FXYZ", false, 500.0, [-6.4, 0.0, 0.0]),
        ("FXYZ", true, 0.0, [6.4, 0.0, 0.0]),
        ("FXYZ", true, 250.0, [0.0, 0.0, 0.0]),
        // A table from which the tool is seen 8 µm too high in the middle sags there itself, and
        // its top rises towards +x before it is there: by 32 µrad 125 mm from the middle. The tool
        // then stands 125 mm up that slope, which takes 4 of the arc's 6 µm.
        ("XFYZ", false, 0.0, [-6.4, 0.0, 0.0]),
        ("XFYZ", false, 125.0, [-3.2, 0.0, 6.0 - 4.0]),
    ] {
        let model = bending(chain, is_watched);
        let now = model.conditions(tool, &warm, &live).unwrap();
        let at = Point::from_mm(x, 300.0, 0.0);
        let seen = model.deviation(at, &now).unwrap();
        // The second order of 64 µrad on 0.1 m is 0.2 nm.
        let off = seen - Point::of(expected.map(|um| um * 1e-6));
        assert!(off.distance().um() < 1e-3, "{chain} {x}: {seen:?}");
    }
}

/// At the low end of x, 100 mm over the tool: 6.4 µm for 2 K and 4 µm/K. 0.1 µm/K of the bow are
/// 0.16 µm; 0.05 K each of two thermometers 0.16·√2 µm. Without a gradient the bow is of no account.
#[test]
fn a_bends_uncertainty_is_that_of_its_bow_and_of_both_thermometers() {
    let model = bending("FXYZ", true);
    let tool = Point::from_mm(0.0, 0.0, -100.0);
    for (over, expected) in [(22.0, 0.16 * 3.0_f64.sqrt()), (20.0, 0.16 * 2.0_f64.sqrt())] {
        let temperatures = [Celsius(over), Celsius(20.0)];
        let now = model
            .conditions(tool, &temperatures, &MovingState::default())
            .unwrap();
        let u = model
            .standard_uncertainty(Point::ZERO, &now, &Seen::default())
            .unwrap();
        check_um(u, [expected, 0.0, 0.0]);
    }
}

/// One of two thermometers says nothing, 3.2 µm per kelvin. Alone it would leave 8 K open; but a bend is
/// refused beyond 3 K, 3/√3 K at most are left open then.
#[test]
fn a_thermometer_that_says_nothing_leaves_what_a_bend_is_known_for() {
    let model = bending("FXYZ", true);
    let limit = model.machine().thermal.bends[0].gradient_max;
    let tool = Point::from_mm(0.0, 0.0, -100.0);
    let now = model
        .conditions(tool, &[Celsius(20.0); 2], &MovingState::default())
        .unwrap();
    for (u_kelvin, expected) in [
        ([0.05, 0.2], 0.2_f64.hypot(0.05)),
        ([0.05, 8.0], limit / 3.0_f64.sqrt()),
        ([8.0, 8.0], limit / 3.0_f64.sqrt()),
    ] {
        let seen = Seen {
            temperatures: &u_kelvin,
            ..Seen::default()
        };
        let u = model.standard_uncertainty(Point::ZERO, &now, &seen);
        check_um(u.unwrap(), [3.2 * expected, 0.0, 0.0]);
    }
}

/// 3 K and 1 ppm/K of uncertainty shared by two thermometers of half a coefficient each: 0.4 m · 3 ppm.
#[test]
fn an_uncertain_expansion_makes_a_warm_machine_uncertain() {
    let mut machine = machine("FXYZ");
    let mut half = channel(0.0);
    (half.expansion[0], half.u_expansion[0]) = (5e-6, 0.5e-6);
    machine.thermal.channels = vec![half; 2];
    let model = VolumetricModel::new(machine, limits()).unwrap();
    let at = Point::from_mm(400.0, 0.0, 0.0);
    for (warm, expected) in [([22.0, 24.0], 1.2), ([22.0, 18.0], 0.0)] {
        let now = model.conditions(Point::ZERO, &warm.map(Celsius), &MovingState::default());
        let u = model
            .standard_uncertainty(at, &now.unwrap(), &Seen::default())
            .unwrap();
        check_um(u, [expected, 0.0, 0.0]);
    }
}

#[test]
fn a_gradient_that_nobody_measured_and_a_guide_that_cannot_bend_so_are_refused() {
    let model = bending("FXYZ", false);
    let temperatures = [Celsius(24.0), Celsius(20.5)];
    let now = model.conditions(Point::ZERO, &temperatures, &MovingState::default());
    let limit = 3.0;
    assert!(
        matches!(now, Err(ConditionsError::Gradient { axis: Axis::X, limit: it, .. }) if it == limit),
        "{now:?}"
    );
    let refused = |change: &dyn Fn(&mut ThermalBend)| {
        refusal(|it| {
            it.thermal.channels = vec![channel(0.05); 2];
            let mut bend = bend(false);
            change(&mut bend);
            it.thermal.bends = vec![bend];
        })
    };
    for (change, text) in [
        (
            (&|it: &mut ThermalBend| it.over = 2) as &dyn Fn(&mut ThermalBend),
            "a bending guide whose channels",
        ),
        (&|it| it.under = Some(0), "a bending guide whose channels"),
        (
            &|it| it.towards = Axis::X,
            "the direction or the range of a bending",
        ),
        (
            &|it| it.high = it.low,
            "the direction or the range of a bending",
        ),
        (&|it| it.bow = Metres(f64::NAN), "the bow of a bending"),
        (&|it| it.gradient_max = -1.0, "the bow of a bending"),
    ] {
        let seen = refused(change).to_string();
        assert!(seen.contains(text), "{seen}");
    }
    let twice = refusal(|it| {
        it.thermal.channels = vec![channel(0.05); 2];
        it.thermal.bends = vec![bend(false); 2];
    });
    assert!(twice.to_string().contains("two bends"), "{twice}");
    // 1 mm per kelvin, 3 K: 3 mm in the middle of half a metre, a slope of 2.4 %.
    let steep = refused(&|it| it.bow = Metres(1e-3));
    assert!(matches!(steep, ModelError::TooSteep { .. }), "{steep}");
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
        .standard_uncertainty(at, &now, &Seen::default())
        .unwrap();
    check_um(u, [0.0, 0.5, 0.0]);
    // Detectors: each sideways direction is displaced by two sliders.
    let by = |displacement: [f64; 3]| {
        let seen = Seen {
            displacement: displacement.map(um),
            ..Seen::default()
        };
        model.standard_uncertainty(at, &now, &seen).unwrap()
    };
    let all = by([0.1; 3]);
    check_um(all, [0.02_f64.sqrt(), 0.27_f64.sqrt(), 0.02_f64.sqrt()]);
    // That of x displaces along y and z alone.
    check_um(by([0.1, 0.0, 0.0]), [0.0, 0.26_f64.sqrt(), 0.1]);
}

/// By trying places all over the volume: none is beyond the one found, and it is one of them.
#[test]
fn the_largest_deviation_of_the_volume_is_found_with_its_place() {
    for chain in ["FXYZ", "XFYZ", "ZYXF"] {
        let model = VolumetricModel::new(full(chain, 5), limits()).unwrap();
        let now = warm(&model, Point::from_mm(100.0, 0.0, -50.0));
        let found = model.largest_deviation(&now);
        let there = model.deviation(found.at, &now).unwrap();
        assert_eq!(there.along(found.along), found.deviation);
        let mut most = 0.0_f64;
        for n in 0..21_usize.pow(3) {
            let share = |k: usize| (n / 21_usize.pow(k as u32) % 21) as f64 / 20.0;
            let high = model.machine().volume.high().array();
            let low = model.machine().volume.low().array();
            let at = core::array::from_fn(|k| low[k] + (high[k] - low[k]) * share(k));
            let deviation = model.deviation(Point::of(at), &now).unwrap().array();
            most = deviation.into_iter().map(f64::abs).fold(most, f64::max);
        }
        let found = found.deviation.abs().value();
        assert!(found >= most * 0.97, "{chain}: {found}, not {most}");
        assert!(model.largest_alone().value() > 0.0);
    }
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
    machine.thermal.channels = vec![channel(0.05); 2];
    let mut warm = |axis: Axis, towards: usize| ThermalBend {
        axis,
        towards: axis.others()[towards],
        bow: um(5.0 * random()),
        high: Metres(0.6),
        ..bend(false)
    };
    machine.thermal.bends = vec![
        warm(Axis::X, 0),
        warm(Axis::X, 1),
        warm(Axis::Y, 0),
        warm(Axis::Z, 1),
    ];
    machine
}

/// A gradient of −2.2 K.
const WARM: [Celsius; 2] = [Celsius(21.5), Celsius(23.7)];

fn warm(model: &VolumetricModel, tool: Point) -> Conditions {
    let live = MovingState::default();
    model.conditions(tool, &WARM, &live).unwrap()
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
        let carries_workpiece = machine.chain.carries_workpiece(axis);
        for bend in machine.thermal.bends.iter().filter(|it| it.axis == axis) {
            let bow = bend.bow.value() * (WARM[0] - WARM[1]).value();
            let share = q.value() / 0.6;
            shift[bend.towards.index()] += 4.0 * bow * share * (1.0 - share);
            let slope = 4.0 * bow * (1.0 - 2.0 * share) / 0.6;
            let (mut ahead, mut aside) = (Vector3::zeros(), Vector3::zeros());
            (ahead[i], aside[bend.towards.index()]) = (1.0, 1.0);
            // The tool's frame from the table's is turned against the table's own turn, and runs
            // against it: the sign is that of ahead-to-aside for a slide of the tool only.
            let turn: Vector3<f64> = ahead.cross(&aside) * slope;
            tilt += if carries_workpiece { -turn } else { turn };
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
        let joint = if carries_workpiece {
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
        let seen = model.deviation(at, &warm(&model, tool)).unwrap();
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
        let now = warm(&model, Point::of([tool.0, tool.1, tool.2]));
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
