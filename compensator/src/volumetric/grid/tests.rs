use proptest::prelude::*;

use super::*;

fn limits() -> Limits {
    Limits {
        size: Metres::from_um(200.0),
        slope: 0.1,
        rate: MetresPerSecond(0.1),
    }
}

fn metres(values: &[f64]) -> Vec<Metres> {
    values.iter().copied().map(Metres).collect()
}

/// The map of a field sampled at uneven nodes.
fn sampled(
    nodes: [&[f64]; 3],
    shape: GridShape,
    field: impl Fn(V3) -> V3,
) -> Result<GridMap, GridError> {
    let mut deviations = Vec::new();
    for x in nodes[0] {
        for y in nodes[1] {
            for z in nodes[2] {
                deviations.push(Point::of(field([*x, *y, *z])));
            }
        }
    }
    let nodes = nodes.map(metres);
    GridMap::new(
        [&nodes[0], &nodes[1], &nodes[2]],
        &deviations,
        shape,
        limits(),
    )
}

const X: &[f64] = &[0.0, 0.1, 0.15, 0.3, 0.42, 0.6];
const Y: &[f64] = &[-0.2, -0.05, 0.0, 0.1, 0.3];
const Z: &[f64] = &[0.0, 0.1, 0.25, 0.4];

/// Products of straight lines, which a trilinear map reproduces.
fn bilinear([x, y, z]: V3) -> V3 {
    [1e-5 + 2e-5 * x * y * z, 3e-5 * y - 1e-5 * z * x, 4e-5 * z]
}

/// Products of cubics, which splines reproduce.
fn cubic([x, y, z]: V3) -> V3 {
    let (p, q) = (x * x * x - 0.3 * x, 0.5 * y * y * y - y * y + 0.1);
    let r = z * z * z - 0.2 * z * z + 0.3;
    [1e-4 * p * q * r, 1e-4 * (p + q * r), 1e-4 * (r - q)]
}

#[track_caller]
fn check_same(seen: Point, expected: V3, within: f64) {
    for (seen, expected) in seen.array().into_iter().zip(expected) {
        assert!(
            (seen - expected).abs() < within,
            "{seen:e}, not {expected:e}"
        );
    }
}

/// Nodes 0 and 1 m in each direction, 8 µm at (1, 1, 1) and nothing elsewhere: 8·0.5·0.25·0.75
/// at (0.5, 0.25, 0.75).
#[test]
fn a_hand_worked_cell_is_met() {
    let mut deviations = [Point::ZERO; 8];
    deviations[7] = Point::new(Metres::from_um(8.0), Metres(0.0), Metres::from_um(-8.0));
    let ends = metres(&[0.0, 1.0]);
    for shape in [GridShape::Trilinear, GridShape::Tricubic] {
        let map = GridMap::new([&ends, &ends, &ends], &deviations, shape, limits()).unwrap();
        let seen = map.deviation(Point::from_mm(500.0, 250.0, 750.0)).unwrap();
        check_same(seen, [0.75e-6, 0.0, -0.75e-6], 1e-18);
    }
}

/// Along x alone the values of 0, 1, 8, 27 of x³: 3.375 at 1.5; of parabolas 0, 1, 4: 2.25.
#[test]
fn splines_through_few_nodes_are_the_polynomials_they_determine() {
    for (nodes, power, expected) in [
        (&[0.0, 1.0, 2.0, 3.0][..], 3, 3.375),
        (&[0.0, 1.0, 2.0], 2, 2.25),
    ] {
        let field = |p: V3| [1e-6 * p[0].powi(power), 0.0, 0.0];
        let map = sampled(
            [nodes, &[0.0, 1.0], &[0.0, 1.0]],
            GridShape::Tricubic,
            field,
        )
        .unwrap();
        let seen = map.deviation(Point::of([1.5, 0.3, 0.9])).unwrap();
        check_same(seen, [expected * 1e-6, 0.0, 0.0], 1e-18);
    }
}

#[test]
fn beyond_its_ends_a_map_is_held_for_commands_and_refused_for_targets() {
    for shape in [GridShape::Trilinear, GridShape::Tricubic] {
        let map = sampled([X, Y, Z], shape, bilinear).unwrap();
        let near = Point::of([0.6001, 0.1, 0.1]);
        check_same(
            map.deviation(near).unwrap(),
            bilinear([0.6, 0.1, 0.1]),
            1e-17,
        );
        assert!(matches!(
            map.command(near),
            Err(NoCorrection::Outside { axis: Axis::X, .. })
        ));
        let far = map.deviation(Point::of([0.0, 0.0, -0.01]));
        assert!(matches!(
            far,
            Err(NoCorrection::Outside { axis: Axis::Z, .. })
        ));
        assert!(map.command(Point::of([f64::NAN, 0.0, 0.0])).is_err());
        // The edge itself is inside, though its command lies beyond.
        let edge = map.command(Point::of([0.6, 0.3, 0.4])).unwrap();
        assert!(edge.z < Metres(0.4) && map.deviation(edge).is_ok());
    }
}

#[test]
fn what_makes_no_map_is_refused_by_place() {
    let wrong = |nodes: [&[f64]; 3], field: fn(V3) -> V3| {
        let seen = sampled(nodes, GridShape::Trilinear, field).map(|_| ());
        seen.unwrap_err()
    };
    let zero: fn(V3) -> V3 = |_| [0.0; 3];
    let axis = Axis::Y;
    assert_eq!(
        wrong([X, &[0.0], Z], zero),
        GridError::TooFewNodes { axis, seen: 1 }
    );
    let twice = wrong([X, &[0.0, 0.1, 0.1], Z], zero);
    assert_eq!(twice, GridError::NotIncreasing { axis, index: 2 });
    let large = wrong([X, Y, Z], |p| {
        [0.0, if p[1] > 0.2 { 3e-4 } else { 0.0 }, 0.0]
    });
    let GridError::TooLarge { at, .. } = large else {
        panic!("{large}")
    };
    assert_eq!(at, Point::of([0.0, 0.3, 0.0]));
    let nan = wrong([X, Y, Z], |_| [0.0, f64::NAN, 0.0]);
    assert!(matches!(nan, GridError::TooLarge { .. }));
    let dense: &[f64] = &[0.0, 0.001, 0.002, 0.1];
    let steep = wrong([X, Y, dense], |p| {
        [if p[2] == 0.001 { 1.5e-4 } else { 0.0 }, 0.0, 0.0]
    });
    assert!(
        matches!(steep, GridError::TooSteep { axis: Axis::Z, .. }),
        "{steep}"
    );
    let dense: &[f64] = &[0.0, 1e-4, 0.1];
    let folded = wrong([X, Y, dense], |p| {
        [if p[2] == 1e-4 { 1.5e-4 } else { 0.0 }, 0.0, 0.0]
    });
    assert!(
        matches!(folded, GridError::NotContracting { axis: Axis::Z, .. }),
        "{folded}"
    );
    let nodes = metres(X);
    let length = GridMap::new(
        [&nodes, &nodes, &nodes],
        &[],
        GridShape::Trilinear,
        limits(),
    );
    let (seen, expected) = (0, 216);
    assert_eq!(
        length.map(|_| ()),
        Err(GridError::Length { seen, expected })
    );
}

proptest! {
    #[test]
    fn maps_reproduce_what_their_shape_can(
        x in 0.0_f64..=0.6, y in -0.2_f64..=0.3, z in 0.0_f64..=0.4,
    ) {
        let at = Point::of([x, y, z]);
        let map = sampled([X, Y, Z], GridShape::Trilinear, bilinear).unwrap();
        check_same(map.deviation(at).unwrap(), bilinear([x, y, z]), 1e-17);
        let map = sampled([X, Y, Z], GridShape::Tricubic, cubic).unwrap();
        check_same(map.deviation(at).unwrap(), cubic([x, y, z]), 1e-16);
    }

    /// A rough map: nodes are met, the inverse is exact, the bound of the slope holds, and the
    /// splines' second derivatives have no jump at the nodes.
    #[test]
    fn rough_maps_keep_their_promises(
        values in prop::collection::vec((-9.0_f64..9.0, -9.0_f64..9.0, -9.0_f64..9.0), 120),
        from in (0.0_f64..0.6, -0.2_f64..0.3, 0.0_f64..0.4),
        way in (-1.0_f64..1.0, -1.0_f64..1.0, -1.0_f64..1.0),
        near in 1e-5_f64..0.1,
        node in (1_usize..5, 1_usize..4, 1_usize..3),
    ) {
        let deviations: Vec<Point> = values.iter()
            .map(|v| Point::of([v.0 * 1e-6, v.1 * 1e-6, v.2 * 1e-6]))
            .collect();
        let nodes = [X, Y, Z].map(metres);
        for shape in [GridShape::Trilinear, GridShape::Tricubic] {
            let map = GridMap::new([&nodes[0], &nodes[1], &nodes[2]], &deviations, shape, limits()).unwrap();
            let (i, j, k) = node;
            let met = map.deviation(Point::of([X[i], Y[j], Z[k]])).unwrap();
            let own = deviations[(i * Y.len() + j) * Z.len() + k];
            prop_assert!((met - own).distance().value() < 1e-16);
            let target = Point::of([from.0, from.1, from.2]);
            let command = map.command(target).unwrap();
            let back = command + map.deviation(command).unwrap() - target;
            prop_assert!(back.distance().value() < 1.1e-11);
            let to = Point::of([
                (from.0 + near * way.0).clamp(0.0, 0.6),
                (from.1 + near * way.1).clamp(-0.2, 0.3),
                (from.2 + near * way.2).clamp(0.0, 0.4),
            ]);
            let largest = |it: Point| it.array().into_iter().fold(0.0, |m: f64, v| m.max(v.abs()));
            let change = largest(map.deviation(to).unwrap() - map.deviation(target).unwrap());
            prop_assert!(change <= map.lipschitz() * largest(to - target) + 1e-17);
        }
        let map = GridMap::new([&nodes[0], &nodes[1], &nodes[2]], &deviations, GridShape::Tricubic, limits()).unwrap();
        let h = 1e-4;
        let bend = |x: f64| {
            let at = |x: f64| map.deviation(Point::of([x, from.1, from.2])).unwrap().y.value();
            (at(x - h) - 2.0 * at(x) + at(x + h)) / (h * h)
        };
        // 9 µm over tens of millimetres bend by some 1e-2 per metre; h changes that by little.
        let jump = bend(X[3] + h) - bend(X[3] - h);
        prop_assert!(jump.abs() < 1e-3, "{jump:e}");
    }
}
