use core::f64::consts::PI;

use proptest::prelude::*;

use super::*;

fn mm(value: f64) -> Metres {
    Metres::from_mm(value)
}

fn degrees(value: f64) -> Radians {
    Radians(value.to_radians())
}

fn pose(x_mm: f64, y_mm: f64, angle_degrees: f64) -> Pose {
    Pose {
        x: mm(x_mm),
        y: mm(y_mm),
        angle: degrees(angle_degrees),
    }
}

fn uvw() -> Platform {
    Platform::uvw(mm(200.0), mm(120.0), mm(10.0)).unwrap()
}

/// Directions in degrees, travel ±5 mm.
fn actuators(places: &[(f64, f64, f64)]) -> Vec<Actuator> {
    let make = |(i, &(x, y, direction)): (usize, &(f64, f64, f64))| {
        let (sin, cos) = direction.to_radians().sin_cos();
        Actuator {
            name: format!("a{i}"),
            point: Point { x: mm(x), y: mm(y) },
            direction: [cos, sin],
            stroke_min: mm(-5.0),
            stroke_max: mm(5.0),
        }
    };
    places.iter().enumerate().map(make).collect()
}

fn made(places: &[(f64, f64, f64)]) -> Result<Platform, PlatformError> {
    Platform::new(actuators(places), Platform::CONDITION_MAX)
}

#[track_caller]
fn check_message(result: Result<Platform, PlatformError>, says: &str) {
    let message = result.unwrap_err().to_string();
    assert!(message.contains(says), "{message}");
}

/// U at (0, 100), V at (0, −100), W at (120, 0), turned by 90°: U's point goes to (−100, 0), V's
/// to (100, 0), W's to (0, 120).
#[test]
fn a_quarter_turn_gives_the_strokes_of_plain_geometry() {
    let seen = uvw().strokes(pose(1.0, 2.0, 90.0));
    let expected = [-100.0 + 1.0, 100.0 + 1.0, 120.0 + 2.0];
    for (seen, expected) in seen.iter().zip(expected) {
        assert!((seen.mm() - expected).abs() < 1e-12, "{} mm", seen.mm());
    }
}

#[test]
fn a_shift_moves_only_the_actuators_along_it() {
    let strokes = uvw().strokes(pose(0.0, 0.25, 0.0));
    assert_eq!(strokes, [Metres::ZERO, Metres::ZERO, mm(0.25)]);
}

#[test]
fn a_tiny_turn_loses_no_digits() {
    // b sin θ − 2 a sin²(θ/2) of W: 0.12·1e-9; the radial part of x1 at the corner of the XXY
    // platform is of second order, 1e-18 of its radius, and must not appear as rounding of 1.
    let xxy = Platform::xxy(mm(100.0), mm(10.0)).unwrap();
    let turned = Pose {
        angle: Radians(1e-9),
        ..Pose::default()
    };
    let side = 0.1 / core::f64::consts::SQRT_2;
    for (stroke, expected) in xxy.strokes(turned).iter().zip([side, -side, -side]) {
        let relative = stroke.value() / (expected * 1e-9) - 1.0;
        assert!(relative.abs() < 1.1e-9, "{relative:e}");
    }
}

#[test]
fn every_preset_goes_there_and_back() {
    let presets = [
        uvw(),
        Platform::uvw(mm(200.0), mm(0.0), mm(10.0)).unwrap(),
        Platform::xxy(mm(150.0), mm(10.0)).unwrap(),
        Platform::xy_theta(mm(150.0), mm(10.0), mm(30.0)).unwrap(),
    ];
    for platform in presets {
        assert!(platform.condition() < 5.0, "{}", platform.condition());
        for angle in [-30.0, -1.0, 0.0, 1e-6, 0.3, 25.0] {
            let wanted = pose(3.0, -4.0, angle);
            let found = platform.forward(&platform.strokes(wanted)).unwrap();
            check_pose(found.pose, wanted, 1e-16, 1e-15);
            assert!(found.inconsistency.value() < 1e-15 && found.iterations <= 10);
        }
    }
}

#[track_caller]
fn check_pose(seen: Pose, wanted: Pose, metres: f64, radians: f64) {
    let far = (seen.x - wanted.x).abs().max((seen.y - wanted.y).abs());
    let turned = (seen.angle - wanted.angle).abs().value();
    assert!(
        far.value() <= metres && turned <= radians,
        "{seen:?} instead of {wanted:?}: {far}, {turned} rad"
    );
}

#[test]
fn a_fourth_actuator_that_contradicts_the_others_is_told_by_how_much() {
    let square = [
        (100.0, 0.0, 90.0),
        (-100.0, 0.0, -90.0),
        (0.0, 100.0, 0.0),
        (0.0, -100.0, 180.0),
    ];
    let platform = made(&square).unwrap();
    let wanted = pose(0.4, -0.3, 2.0);
    let mut strokes = platform.strokes(wanted);
    let agreed = platform.forward(&strokes).unwrap();
    check_pose(agreed.pose, wanted, 1e-15, 1e-14);
    assert!(agreed.inconsistency.value() < 1e-15);
    // One stroke off by 8 µm: what no pose explains of it is spread over all four.
    strokes[2] += Metres::from_um(8.0);
    let found = platform.forward(&strokes).unwrap();
    let inconsistency = found.inconsistency.um();
    assert!((inconsistency - 2.0).abs() < 0.02, "{inconsistency} um");
}

/// From a start 27° and 58 mm away Newton's steps end where these four contradict each other by
/// millimetres; the pose on which they agree is another one.
#[test]
fn four_that_agree_somewhere_are_found_there_also_from_afar() {
    let platform = made(&[
        (-179.453, 52.537, 338.560),
        (184.043, 43.006, 134.653),
        (28.589, 199.479, 226.869),
        (-50.112, 159.648, 113.277),
    ]);
    let platform = platform.unwrap();
    let wanted = pose(-118.872, -113.231, -17.630_4);
    let near = pose(-88.872, -163.231, -44.269_8);
    let found = platform
        .forward_near(&platform.strokes(wanted), near)
        .unwrap();
    check_pose(found.pose, wanted, 1e-13, 1e-12);
    assert!(found.inconsistency.value() < 1e-13);
}

#[test]
fn strokes_that_no_pose_has_are_an_error_not_a_number() {
    // U and V 300 mm apart from each other, on points 200 mm apart.
    let strokes = [mm(-150.0), mm(150.0), mm(0.0)];
    let error = uvw().forward(&strokes).unwrap_err();
    assert!(
        matches!(error, ForwardError::NoConvergence { .. }),
        "{error}"
    );
    assert!(error.to_string().contains("no pose"), "{error}");
    assert_eq!(
        uvw().forward(&strokes[..2]),
        Err(ForwardError::Count {
            seen: 2,
            expected: 3
        })
    );
    let nan = [mm(0.0), Metres(f64::NAN), mm(0.0)];
    let error = uvw().forward(&nan).unwrap_err();
    assert!(error.to_string().contains("`v`"), "{error}");
}

#[test]
fn an_arrangement_without_a_hold_names_the_motion_that_nobody_makes() {
    // All along x: nothing pushes along y.
    check_message(
        made(&[(0.0, 50.0, 0.0), (0.0, -50.0, 0.0), (30.0, 10.0, 180.0)]),
        "no actuator can shift the platform along 90.0° from x",
    );
    // Three lines through one point.
    check_message(
        made(&[(10.0, 0.0, 0.0), (0.0, 20.0, 90.0), (5.0, 5.0, 45.0)]),
        "no actuator can turn the platform about (0.000, 0.000) mm",
    );
    // The same, away from the origin: lines y = 20, x = 10, and the diagonal through (10, 20).
    check_message(
        made(&[(50.0, 20.0, 0.0), (10.0, -70.0, 90.0), (0.0, 10.0, 45.0)]),
        "no actuator can turn the platform about (10.000, 20.000) mm",
    );
    check_message(
        made(&[(7.0, 7.0, 0.0), (7.0, 7.0, 90.0), (7.0, 7.0, 45.0)]),
        "about (7.000, 7.000) mm",
    );
    // Four actuators do not help when all are parallel.
    let four = [
        (0.0, 9.0, 30.0),
        (0.0, -9.0, 30.0),
        (9.0, 0.0, 30.0),
        (-9.0, 0.0, 210.0),
    ];
    check_message(made(&four), "along 120.0° from x");
    check_message(
        Platform::uvw(mm(0.0), mm(0.0), mm(5.0)),
        "turn the platform about (0.000, 0.000) mm",
    );
}

#[test]
fn a_weak_arrangement_is_refused_with_its_condition_number() {
    // Three lines that miss a common point by half a millimetre.
    let result = made(&[(100.0, 0.0, 0.0), (0.0, 100.0, 90.0), (80.0, 80.5, 45.0)]);
    let Err(PlatformError::IllConditioned {
        condition, motion, ..
    }) = &result
    else {
        panic!("{result:?}")
    };
    assert!(*condition > 100.0 && *condition < 1000.0, "{condition}");
    assert!(matches!(motion, Motion::Turn { .. }));
    check_message(result, "hardly turn the platform about");
}

#[test]
fn the_condition_does_not_depend_on_units_place_or_heading() {
    let places = [(0.0, 100.0, 0.0), (0.0, -100.0, 0.0), (120.0, 0.0, 90.0)];
    let condition = made(&places).unwrap().condition();
    let far: Vec<_> = places
        .iter()
        .map(|&(x, y, d)| (x + 5e3, y - 3e3, d))
        .collect();
    let large: Vec<_> = places
        .iter()
        .map(|&(x, y, d)| (1e3 * x, 1e3 * y, d))
        .collect();
    let turned: Vec<_> = places.iter().map(|&(x, y, d)| (-y, x, d + 90.0)).collect();
    for other in [far, large, turned] {
        let seen = made(&other).unwrap().condition();
        assert!((seen / condition - 1.0).abs() < 1e-9, "{seen} {condition}");
    }
}

#[test]
fn wrong_values_are_refused_by_name() {
    let good = actuators(&[(0.0, 9.0, 0.0), (0.0, -9.0, 0.0), (9.0, 0.0, 90.0)]);
    let with = |change: fn(&mut Vec<Actuator>)| {
        let mut changed = good.clone();
        change(&mut changed);
        Platform::new(changed, Platform::CONDITION_MAX)
    };
    check_message(with(|a| drop(a.pop())), "2 actuator(s)");
    check_message(
        with(|a| a[1].name = "a0".into()),
        "two actuators are called `a0`",
    );
    check_message(
        with(|a| a[2].point.x = Metres(f64::NAN)),
        "`a2` has a value",
    );
    check_message(with(|a| a[0].direction = [2.0, 0.0]), "has the length 2");
    check_message(
        with(|a| a[0].stroke_min = mm(1.0)),
        "travels from 1 to 5 mm",
    );
    check_message(
        Platform::new(good.clone(), f64::NAN),
        "condition limit is NaN",
    );
}

#[test]
fn a_pose_out_of_reach_names_every_actuator_in_the_way() {
    let platform = uvw();
    assert_eq!(platform.check(pose(10.0, -10.0, 0.0)).unwrap().len(), 3);
    let error = platform.check(pose(9.0, 0.0, -1.0)).unwrap_err();
    let [Beyond::Stroke { name, stroke, .. }] = error.limits.as_slice() else {
        panic!("{error}")
    };
    assert_eq!(name, "u");
    assert!((stroke.mm() - (9.0 + 100.0 * 1.0_f64.to_radians().sin())).abs() < 1e-9);
    let both = platform
        .check(pose(11.0, 0.0, 0.0))
        .unwrap_err()
        .to_string();
    assert!(both.contains("`u`") && both.contains("`v`"), "{both}");
    let over = platform
        .check(pose(0.0, 0.0, 100.0))
        .unwrap_err()
        .to_string();
    assert!(
        over.contains("100.0000°") && over.contains("hold"),
        "{over}"
    );
    let nan = platform.check(pose(f64::NAN, 0.0, 0.0)).unwrap_err();
    assert_eq!(nan.limits, [Beyond::NotFinite]);
}

#[test]
fn the_reachable_area_of_an_unturned_uvw_platform_is_its_square_of_travel() {
    let area = uvw().reachable_area(Radians::ZERO);
    assert_eq!(area.len(), 4, "{area:?}");
    for corner in &area {
        assert!((corner.x.mm().abs() - 10.0).abs() < 1e-9);
        assert!((corner.y.mm().abs() - 10.0).abs() < 1e-9);
    }
    assert!((area_mm2(&area) - 400.0).abs() < 1e-6);
    // Turned by θ, U and V differ by 2·100 sin θ: that much narrower; past 10 = 100 sin θ none.
    let turned = uvw().reachable_area(degrees(2.0));
    let narrow = 20.0 - 200.0 * 2.0_f64.to_radians().sin();
    assert!((area_mm2(&turned) - narrow * 20.0).abs() < 1e-6);
    assert!(uvw().reachable_area(degrees(6.0)).is_empty());
}

/// The shoelace formula: positive when counter-clockwise.
fn area_mm2(corners: &[Point]) -> f64 {
    let next = corners.iter().cycle().skip(1);
    let cross = |(a, b): (&Point, &Point)| a.x.mm() * b.y.mm() - b.x.mm() * a.y.mm();
    corners.iter().zip(next).map(cross).sum::<f64>() / 2.0
}

#[test]
fn the_largest_turn_is_where_the_first_actuator_ends() {
    // W: 120 sin θ = 10 comes before U and V: 100 sin θ = 10.
    let expected = (10.0_f64 / 120.0).asin();
    assert!((uvw().angle_max().value() - expected).abs() < 1e-12);
    // 9 mm aside only U is in the way of negative turns (its stroke grows by 100 sin|θ|), and V
    // of positive ones.
    let aside = Point {
        x: mm(9.0),
        y: mm(0.0),
    };
    let (min, max) = uvw().reachable_angles(aside).unwrap();
    assert!((min.value() + 0.01_f64.asin()).abs() < 1e-12);
    assert!((max.value() - 0.01_f64.asin()).abs() < 1e-12);
    let away = Point {
        x: mm(10.1),
        y: mm(0.0),
    };
    assert_eq!(uvw().reachable_angles(away), None);
}

#[test]
fn without_travel_limits_in_the_way_the_loss_of_hold_ends_the_turn() {
    let mut free = uvw().actuators().to_vec();
    for actuator in &mut free {
        (actuator.stroke_min, actuator.stroke_max) = (mm(-1e6), mm(1e6));
    }
    let platform = Platform::new(free, 20.0).unwrap();
    // U and V lose their lever at ±90°; the condition limit is met a little earlier.
    let (min, max) = platform.angles();
    assert!(max.value() > 1.4 && max.value() < PI / 2.0, "{max}");
    assert!((min.value() + max.value()).abs() < 1e-6);
    assert_eq!(platform.angle_max(), max.min(-min));
    assert!(platform.check(pose(0.0, 0.0, 89.9)).is_err());
}

#[test]
fn a_straight_path_between_reachable_poses_may_still_be_too_long_for_a_screw() {
    // A radial actuator at x = 100 mm: its stroke dips by 100 (1 − cos θ) between +θ and −θ's
    // equal ends when x follows; here the ends stand at the lower limit and the middle above.
    let mut places = actuators(&[(100.0, 0.0, 0.0), (0.0, 100.0, 0.0), (0.0, -80.0, 90.0)]);
    places[1].point = Point {
        x: mm(0.0),
        y: mm(-20.0),
    };
    (places[0].stroke_min, places[0].stroke_max) = (mm(-0.2), mm(0.05));
    let platform = Platform::new(places, 1e3).unwrap();
    let dip = 100.0 * (1.0 - 3.0_f64.to_radians().cos());
    let (from, to) = (pose(0.1, 0.0, -3.0), pose(0.1, 0.0, 3.0));
    assert!(platform.check(from).is_ok() && platform.check(to).is_ok());
    let error = platform.check_path(from, to).unwrap_err();
    assert!((error.fraction - 0.5).abs() < 1e-9, "{error}");
    let Beyond::Stroke { name, stroke, .. } = &error.beyond else {
        panic!("{error}")
    };
    assert_eq!(name, "a0");
    assert!((stroke.mm() - 0.1).abs() < 1e-9, "{error}");
    assert!(
        dip > 0.1 && dip < 0.3,
        "the ends must be reachable: {dip} mm"
    );
    let (low, lower) = (pose(0.0, 0.0, -3.0), pose(0.0, 0.0, 3.0));
    assert_eq!(platform.check_path(low, lower), Ok(()));
    let far = platform.check_path(low, pose(0.0, 0.0, 500.0)).unwrap_err();
    assert!((far.fraction - 1.0).abs() < 1e-12, "{far}");
}

/// Any three lines of push that hold the platform well.
fn arrangement(count: usize) -> impl Strategy<Value = Platform> {
    prop::collection::vec(
        (-200.0..200.0_f64, -200.0..200.0_f64, 0.0..360.0_f64),
        count,
    )
    .prop_filter_map("no hold", |places| {
        Platform::new(actuators(&places), 20.0).ok()
    })
}

fn platforms() -> impl Strategy<Value = Platform> {
    prop_oneof![arrangement(3), arrangement(4)]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// Anywhere within the turns at which the actuators hold, large ones included, from a start
    /// up to 30° and centimetres away on the same side.
    #[test]
    fn forward_undoes_strokes_for_any_arrangement_and_angle(
        platform in platforms(),
        x in -300.0..300.0_f64,
        y in -300.0..300.0_f64,
        share in 0.0..1.0_f64,
        off in -0.5..0.5_f64,
    ) {
        let (min, max) = platform.angles();
        let angle = min.value() + share * (max.value() - min.value());
        let wanted = Pose { x: mm(x), y: mm(y), angle: Radians(angle) };
        let near = Pose {
            x: mm(x + 30.0),
            y: mm(y - 50.0),
            angle: Radians((angle + off).clamp(min.value(), max.value())),
        };
        let found = platform.forward_near(&platform.strokes(wanted), near).unwrap();
        check_pose(found.pose, wanted, 1e-13, 1e-12);
        prop_assert!(found.inconsistency.value() < 1e-13);
    }

    /// Small poses need no start.
    #[test]
    fn forward_from_zero_finds_every_pose_of_an_alignment(
        platform in platforms(),
        x in -5.0..5.0_f64,
        y in -5.0..5.0_f64,
        angle in -10.0..10.0_f64,
    ) {
        let wanted = pose(x, y, angle);
        let (min, max) = platform.angles();
        prop_assume!(min < wanted.angle && wanted.angle < max);
        let found = platform.forward(&platform.strokes(wanted)).unwrap();
        check_pose(found.pose, wanted, 1e-14, 1e-13);
    }

    #[test]
    fn strokes_equal_the_matrix_formula(
        platform in platforms(), x in -9.0..9.0_f64, y in -9.0..9.0_f64, angle in -180.0..180.0_f64,
    ) {
        let wanted = pose(x, y, angle);
        let (sin, cos) = wanted.angle.value().sin_cos();
        for (stroke, a) in platform.strokes(wanted).iter().zip(platform.actuators()) {
            let (px, py) = (a.point.x.value(), a.point.y.value());
            let moved = [x * 1e-3 + cos * px - sin * py - px, y * 1e-3 + sin * px + cos * py - py];
            let expected = a.direction[0] * moved[0] + a.direction[1] * moved[1];
            prop_assert!((stroke.value() - expected).abs() < 1e-15);
        }
    }

    /// Inside the polygon every stroke fits, outside (a little beyond any side) one does not.
    #[test]
    fn the_reachable_area_is_exactly_where_the_strokes_fit(
        platform in platforms(), angle in -1.0..1.0_f64, u in 0.0..1.0_f64, v in 0.0..1.0_f64,
    ) {
        let angle = degrees(angle);
        let area = platform.reachable_area(angle);
        prop_assume!(area.len() >= 3);
        prop_assert!(area_mm2(&area) >= 0.0);
        let centre = |axis: fn(&Point) -> f64| {
            area.iter().map(axis).sum::<f64>() / area.len() as f64
        };
        let centre = [centre(|p| p.x.value()), centre(|p| p.y.value())];
        for (i, a) in area.iter().enumerate() {
            let b = &area[(i + 1) % area.len()];
            let side = [a.x.value() + u * (b.x - a.x).value(), a.y.value() + u * (b.y - a.y).value()];
            let at = |share: f64| Pose {
                x: Metres(centre[0] + share * (side[0] - centre[0])),
                y: Metres(centre[1] + share * (side[1] - centre[1])),
                angle,
            };
            prop_assert!(platform.check(at(v * (1.0 - 1e-9))).is_ok());
            let out = at(1.0 + 1e-3);
            let moved = (out.x.value() - side[0]).hypot(out.y.value() - side[1]);
            prop_assert!(moved < 1e-8 || platform.check(out).is_err());
        }
    }

    /// Against brute force: what the closed form allows has no bad pose on it, what it refuses
    /// has one where it says.
    #[test]
    fn a_path_is_allowed_when_every_pose_on_it_is(
        platform in platforms(),
        from in (-3.0..3.0_f64, -3.0..3.0_f64, -4.0..4.0_f64),
        to in (-3.0..3.0_f64, -3.0..3.0_f64, -4.0..4.0_f64),
    ) {
        let (from, to) = (pose(from.0, from.1, from.2), pose(to.0, to.1, to.2));
        let (a, b) = (from.raw(), to.raw());
        let at = |share: f64| Pose::of_raw([0, 1, 2].map(|i| a[i] + share * (b[i] - a[i])));
        match platform.check_path(from, to) {
            Ok(()) => for k in 0..=200 {
                prop_assert!(platform.check(at(f64::from(k) / 200.0)).is_ok());
            },
            Err(error) => prop_assert!(platform.check(at(error.fraction)).is_err()),
        }
    }

    #[test]
    fn the_reachable_turns_end_exactly_where_a_limit_is_met(
        platform in platforms(), x in -3.0..3.0_f64, y in -3.0..3.0_f64,
    ) {
        let at = Point { x: mm(x), y: mm(y) };
        let with = |angle: f64| platform.check(Pose { x: at.x, y: at.y, angle: Radians(angle) });
        prop_assume!(with(0.0).is_ok());
        let (min, max) = platform.reachable_angles(at).unwrap();
        for k in 0..=100 {
            let share = f64::from(k) / 100.0 * (1.0 - 1e-9);
            prop_assert!(with(min.value() * share).is_ok() && with(max.value() * share).is_ok());
        }
        prop_assert!(with(min.value() - 1e-6).is_err() || min.value() <= -PI);
        prop_assert!(with(max.value() + 1e-6).is_err() || max.value() >= PI);
    }
}
