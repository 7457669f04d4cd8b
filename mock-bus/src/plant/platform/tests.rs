use core::time::Duration;
use proptest::prelude::*;
use units::Approach;

use super::config::{ActuatorConfig, ScrewConfig};
use super::screw::Play;
use super::*;
use crate::plant::config::PlantConfig;
use crate::plant::{HallDrift, Plant, Scene, Servo, Target};

const AXES: usize = 3;

fn config() -> PlantConfig {
    PlantConfig {
        platform: Some(PlatformConfig::default()),
        ..PlantConfig::default()
    }
}

fn plant(seed: u64) -> Plant {
    Plant::new(&config(), seed)
}

fn look(plant: &Plant) -> PlatformTruth<'_> {
    let truth = plant.truth();
    // The truth borrows the plant, not itself.
    truth.platform().expect("it is a platform")
}

/// All screws go to their goals (metres of screw travel) in `ms`, smoothly, then rest.
fn go(plant: &mut Plant, start: Time, goals_m: [f64; AXES], step: Duration) -> Time {
    let zero: Vec<f64> = (0..AXES)
        .map(|axis| look(plant).count_zero(axis).value())
        .collect();
    let from: Vec<f64> = (0..AXES)
        .map(|axis| look(plant).screw_position(axis).value())
        .collect();
    let mut now = start;
    for ms in 1..=400_u32 {
        let share = f64::from(ms) / 400.0;
        let share = share * share * share * (10.0 - share * (15.0 - 6.0 * share));
        plant.advance(now);
        for axis in 0..AXES {
            let demand_m = from[axis] + share * (goals_m[axis] - from[axis]) - zero[axis];
            plant.set_servo(axis, Servo::Follow { demand: demand_m });
        }
        let next = now + Duration::from_millis(1);
        while now + step < next {
            now += step;
            plant.advance(now);
        }
        now = next;
    }
    now += Duration::from_millis(100);
    plant.advance(now);
    now
}

const MS: Duration = Duration::from_millis(1);

fn arrangement(actuators: &[([f64; 2], [f64; 2])]) -> Option<Kinematics> {
    Kinematics::new(&actuator_configs(actuators))
}

fn actuator_configs(actuators: &[([f64; 2], [f64; 2])]) -> Vec<ActuatorConfig> {
    actuators
        .iter()
        .map(|(point_mm, direction)| ActuatorConfig {
            point_mm: *point_mm,
            direction: *direction,
        })
        .collect()
}

/// How far along its direction an actuator's point has come: by the point's place before and
/// after, with no complex number in it.
fn stroke_of(pose: &Pose, actuator: &ActuatorConfig) -> f64 {
    let point = actuator.point_mm.map(|mm| mm * 1e-3);
    let place = pose.place_of(point);
    let length = actuator.direction[0].hypot(actuator.direction[1]);
    let along = |i: usize| (place[i] - point[i]) * actuator.direction[i] / length;
    along(0) + along(1)
}

fn any_pose() -> impl Strategy<Value = Pose> {
    (-5e-3..5e-3, -5e-3..5e-3, -0.05..0.05).prop_map(|(x, y, angle)| Pose {
        x: Metres(x),
        y: Metres(y),
        angle: Radians(angle),
    })
}

/// An angle of a full turn as a direction.
fn any_actuator() -> impl Strategy<Value = ([f64; 2], [f64; 2])> {
    let place = -150.0..150.0_f64;
    (place.clone(), place, 0.0..core::f64::consts::TAU)
        .prop_map(|(x, y, angle)| ([x, y], [angle.cos(), angle.sin()]))
}

fn distance(a: &Pose, b: &Pose) -> f64 {
    let turn = (a.angle - b.angle).value() * 0.1;
    (a.x - b.x).value().hypot((a.y - b.y).value()).hypot(turn)
}

proptest! {
    /// Whatever the arrangement, strokes worked out from a pose lead back to it.
    #[test]
    fn strokes_lead_to_the_pose_that_makes_them(
        actuators in prop::collection::vec(any_actuator(), 3..=4),
        pose in any_pose(),
    ) {
        let configs = actuator_configs(&actuators);
        let Some(kinematics) = Kinematics::new(&configs) else {
            return Ok(());
        };
        // Arrangements that hardly hold the platform have a second pose near by.
        prop_assume!(kinematics.grip_m() > 0.02);
        let strokes: Vec<f64> = configs.iter().map(|it| stroke_of(&pose, it)).collect();
        let found = kinematics.pose(&strokes);
        prop_assert!(distance(&found, &pose) < 1e-12, "{found:?}");
    }

    /// Four screws that disagree: no pose near by explains their strokes better.
    #[test]
    fn four_screws_that_disagree_meet_in_the_middle(
        errors in prop::array::uniform4(-5e-6..5e-6),
        pose in any_pose(),
        way in prop::array::uniform3(-1.0..1.0),
    ) {
        let configs = actuator_configs(&[
            ([80.0, 0.0], [0.0, 1.0]),
            ([0.0, 80.0], [1.0, 0.0]),
            ([-80.0, 0.0], [0.0, 1.0]),
            ([0.0, -80.0], [1.0, 0.0]),
        ]);
        let strokes: Vec<f64> = configs
            .iter()
            .zip(errors)
            .map(|(it, error)| stroke_of(&pose, it) + error)
            .collect();
        let found = Kinematics::new(&configs).unwrap().pose(&strokes);
        let left = |pose: &Pose| -> f64 {
            let squares = configs.iter().zip(&strokes);
            squares.map(|(it, stroke)| (stroke_of(pose, it) - stroke).powi(2)).sum()
        };
        let [x, y, angle] = way.map(|part: f64| part * 1e-6);
        let aside = Pose {
            x: found.x + Metres(x),
            y: found.y + Metres(y),
            angle: found.angle + Radians(10.0 * angle),
        };
        prop_assert!(left(&found) <= left(&aside) + 1e-22);
    }

    /// The table stays between the flanks, only a flank moves it, and it does not matter in
    /// how many pieces the nut makes its way.
    #[test]
    fn the_play_operator_keeps_its_laws(
        nuts in prop::collection::vec(-10.0..10.0_f64, 1..30),
        width in 0.1..5.0_f64,
        pieces in 1..7_u32,
    ) {
        let (mut whole, mut cut) = (Play::new(width), Play::new(width));
        let mut at = 0.0;
        for nut in nuts {
            let before = whole.pushed_m(at);
            whole.push(nut);
            for piece in 1..=pieces {
                cut.push(at + (nut - at) * f64::from(piece) / f64::from(pieces));
            }
            let after = whole.pushed_m(nut);
            prop_assert!((after - cut.pushed_m(nut)).abs() < 1e-12);
            prop_assert!((after - nut).abs() <= width / 2.0 + 1e-12);
            prop_assert!((after - before) * (nut - at) >= 0.0, "pulled back");
            if (nut - at).abs() >= width {
                let behind = after - nut + (nut - at).signum() * width / 2.0;
                prop_assert!(behind.abs() < 1e-12, "not taken along");
            }
            at = nut;
        }
    }
}

#[test]
fn arrangements_that_do_not_hold_the_platform_are_refused() {
    let parallel = [([0.0, 80.0], [1.0, 0.0]), ([0.0, -80.0], [1.0, 0.0])];
    assert!(arrangement(&[parallel[0], parallel[1], ([0.0, 0.0], [1.0, 0.0])]).is_none());
    // Three lines through one point: nothing holds the turn about it.
    let through_the_middle = [
        ([80.0, 0.0], [1.0, 0.0]),
        ([0.0, 80.0], [0.0, 1.0]),
        ([60.0, 60.0], [1.0, 1.0]),
    ];
    assert!(arrangement(&through_the_middle).is_none());
    assert!(arrangement(&[([0.0, 0.0], [0.0, 0.0]); 3]).is_none());
    assert!(PlatformConfig::default().holds_the_platform());
    let mut two = PlatformConfig::default();
    two.actuators.pop();
    assert!(!two.holds_the_platform());
}

/// The seed's headline: a platform of ±4 µm. Poses at random within the work range, reached in
/// random directions of each screw, without the errors of single stops.
#[test]
fn as_found_the_platform_is_within_about_4_um() {
    let mut worst = Vec::new();
    for seed in 0..20 {
        let plant = plant(seed);
        let truth = look(&plant);
        let mut chance = crate::random::Stream::new(seed, "poses");
        let (mut most, mut turn): (f64, f64) = (0.0, 0.0);
        for _ in 0..500 {
            let target = Pose {
                x: Metres::from_mm(chance.between(-2.25, 2.25)),
                y: Metres::from_mm(chance.between(-2.25, 2.25)),
                angle: Radians(chance.between(-3e-3, 3e-3)),
            };
            let screws: Vec<_> = PlatformConfig::default()
                .actuators
                .iter()
                .map(|it| (Metres(stroke_of(&target, it)), any_approach(&mut chance)))
                .collect();
            let actual = truth.systematic_pose(&screws);
            most = most.max((actual.x - target.x).abs().um());
            most = most.max((actual.y - target.y).abs().um());
            turn = turn.max((actual.angle - target.angle).abs().arcsec());
        }
        println!("seed {seed}: {most:.2} um, {turn:.2} arcsec");
        assert!((3.2..4.9).contains(&most), "seed {seed}: {most} um");
        assert!((2.0..13.0).contains(&turn), "seed {seed}: {turn} arcsec");
        worst.push(most);
    }
    let mean = worst.iter().sum::<f64>() / 20.0;
    assert!((mean - 4.0).abs() < 0.25, "{mean} um");
}

fn any_approach(chance: &mut crate::random::Stream) -> Approach {
    if chance.chance(0.5) {
        Approach::Forward
    } else {
        Approach::Reverse
    }
}

#[test]
fn each_screw_has_its_peak_and_its_own_slope_and_lost_motion() {
    let mut slopes = Vec::new();
    for seed in 0..20 {
        let plant = plant(seed);
        let truth = look(&plant);
        for screw in 0..AXES {
            let mean_um = |mm: f64| truth.mean_deviation(screw, Metres::from_mm(mm)).um();
            let half_um = truth.lost_motion(screw).um() / 2.0;
            let peak = (-250..=250)
                .map(|i| mean_um(f64::from(i) * 0.01).abs() + half_um)
                .fold(0.0, f64::max);
            assert!((3.9..4.9).contains(&peak), "seed {seed}: {peak}");
            assert!((1.6..2.6).contains(&(2.0 * half_um)), "seed {seed}");
            assert_eq!(mean_um(0.0), 0.0);
            let slope = (mean_um(2.0) - mean_um(-2.0)) / 4.0;
            assert!(slope.abs() < 2.0, "seed {seed}: {slope} um/mm");
            slopes.push(slope);
        }
    }
    let up = slopes.iter().filter(|slope| **slope > 0.0).count();
    assert!((15..=45).contains(&up), "{up} of 60 rise");
}

#[test]
fn the_pose_is_the_same_however_often_anybody_looks() {
    let run = |seed, step| {
        let mut plant = plant(seed);
        let mut now = Time(1_234_567);
        for goals in [[1e-3, -0.5e-3, 2e-3], [0.2e-3, 0.3e-3, 0.1e-3]] {
            now = go(&mut plant, now, goals, step);
        }
        let pose = look(&plant).pose();
        [pose.x.value(), pose.y.value(), pose.angle.value()].map(f64::to_bits)
    };
    assert_eq!(run(3, MS), run(3, Duration::from_micros(77)));
    assert_ne!(run(3, MS), run(4, MS));
}

#[test]
fn a_move_ends_where_the_systematic_errors_say_but_for_the_error_of_the_stop() {
    let mut squares = 0.0;
    let mut count = 0.0;
    for seed in 0..10 {
        let mut plant = plant(seed);
        let mut now = Time(1_000_000);
        for (goal, approach) in [
            (1e-3, Approach::Forward),
            (-1e-3, Approach::Reverse),
            (-0.4e-3, Approach::Forward),
            (-0.9e-3, Approach::Reverse),
        ] {
            now = go(&mut plant, now, [goal; AXES], MS);
            let truth = look(&plant);
            for screw in 0..AXES {
                let at = truth.screw_position(screw);
                let seen = truth.stroke(screw) - at;
                let off = (seen - truth.deviation(screw, at, approach)).nm();
                assert!(off.abs() < 350.0, "seed {seed}: {off} nm");
                squares += off * off;
                count += 1.0;
            }
        }
    }
    let deviation = f64::sqrt(squares / count);
    assert!((45.0..80.0).contains(&deviation), "{deviation} nm");
}

#[test]
fn a_small_reversal_moves_nothing_until_the_lost_motion_is_gone() {
    let mut plant = plant(5);
    let now = go(&mut plant, Time(1_000_000), [1e-3; AXES], MS);
    let lost = look(&plant).lost_motion(0).value();
    assert!((look(&plant).engagement(0).value() + lost / 2.0).abs() < 30e-9);
    let before = look(&plant).stroke(0);
    let now = go(&mut plant, now, [1e-3 - lost / 2.0, 1e-3, 1e-3], MS);
    let moved = look(&plant).stroke(0) - before;
    assert!(moved.abs().nm() < 200.0, "{} nm", moved.nm());
    go(&mut plant, now, [0.9e-3, 1e-3, 1e-3], MS);
    assert!((look(&plant).engagement(0).value() - lost / 2.0).abs() < 30e-9);
}

#[test]
fn a_power_cycle_takes_the_origin_and_the_engagement_and_an_index_pulse_brings_one_back() {
    for seed in 0..5 {
        let mut plant = plant(seed);
        let now = go(&mut plant, Time(1_000_000), [-1e-3; AXES], MS);
        for axis in 0..AXES {
            plant.set_servo(axis, Servo::Off);
            plant.encoder_power(axis, false);
            assert_eq!(plant.encoder_counts(axis), 0);
        }
        plant.power_cycle(HallDrift::default());
        for axis in 0..AXES {
            plant.encoder_power(axis, true);
            assert_eq!(plant.encoder_counts(axis), 0);
            assert_eq!(plant.index_pulse(axis), None);
            let half = look(&plant).lost_motion(axis) / 2.0;
            assert!(look(&plant).engagement(axis).abs() < half);
        }
        // Over the middle, where one of the marks is.
        go(&mut plant, now, [0.5e-3; AXES], MS);
        for axis in 0..AXES {
            let pulse = plant.index_pulse(axis).expect("the mark was passed");
            assert_eq!(pulse.number, 1);
            let mark_m = pulse.count as f64 * plant.encoder_resolution(axis)
                + look(&plant).count_zero(axis).value();
            assert!(mark_m.abs() < 90e-9, "seed {seed}: {mark_m}");
        }
    }
}

#[test]
fn limits_stops_and_faults_act_on_their_own_axis() {
    let mut plant = plant(6);
    plant.set_blocked(1, true);
    let stood = look(&plant).screw_position(1);
    let now = go(&mut plant, Time(1_000_000), [5.2e-3, 1e-3, -20e-3], MS);
    assert_eq!(plant.limit_switches(0), (false, true));
    assert_eq!(plant.limit_switches(1), (false, false));
    assert_eq!(plant.limit_switches(2), (true, false));
    let moved = look(&plant).screw_position(1) - stood;
    assert!(moved.abs().nm() < 30.0, "{} nm", moved.nm());
    assert!((look(&plant).screw_position(2).mm() + 6.0).abs() < 1e-9);
    plant.force_limit_switch(1, false, Some(true));
    assert_eq!(plant.limit_switches(1), (true, false));
    plant.set_safe_torque_off(true);
    assert!((0..AXES).all(|axis| plant.safe_torque_off(axis)));
    assert!(!plant.safe_torque_off(AXES));
    assert_eq!(plant.encoder_counts(AXES), 0);
    let before = look(&plant).screw_position(0);
    go(&mut plant, now, [0.0; AXES], MS);
    assert_eq!(look(&plant).screw_position(0), before);
}

/// Two marks, seen: the platform's pose by elementary geometry.
fn seen(plant: &mut Plant) -> Option<(f64, f64, f64)> {
    plant.open_shutter(Scene::Marks);
    let marks: Option<Vec<_>> = plant.close_shutter(Scene::Marks).into_iter().collect();
    let [a, b] = marks?.try_into().unwrap();
    let angle_of = |a: [f64; 2], b: [f64; 2]| (b[1] - a[1]).atan2(b[0] - a[0]);
    let middle = |i: usize| (a.place_m[i] + b.place_m[i]) / 2.0;
    let turn = angle_of(a.place_m, b.place_m) - angle_of(a.built_m, b.built_m);
    Some((middle(0), middle(1), turn))
}

#[test]
fn the_cameras_see_the_true_pose_and_their_own_noise() {
    let mut plant = plant(7);
    go(&mut plant, Time(1_000_000), [1e-3, -1e-3, 0.5e-3], MS);
    let pose = look(&plant).pose();
    let (mut mean, mut squares) = ([0.0; 3], [0.0; 3]);
    for _ in 0..2000 {
        let (x, y, turn) = seen(&mut plant).expect("both marks are in view");
        let off = [
            x - pose.x.value(),
            y - pose.y.value(),
            turn - pose.angle.value(),
        ];
        for i in 0..3 {
            mean[i] += off[i] / 2000.0;
            squares[i] += off[i] * off[i] / 2000.0;
        }
    }
    let deviation = squares.map(f64::sqrt);
    // 0.17 µm for a mark: 0.12 µm for the middle of two, 2 µrad for the line between them.
    assert!((deviation[0] - 0.12e-6).abs() < 0.01e-6, "{deviation:?}");
    assert!((deviation[1] - 0.12e-6).abs() < 0.01e-6, "{deviation:?}");
    assert!((deviation[2] - 2.0e-6).abs() < 0.15e-6, "{deviation:?}");
    assert!(
        mean[0].abs() < 0.015e-6 && mean[1].abs() < 0.015e-6,
        "{mean:?}"
    );
}

#[test]
fn a_camera_that_is_turned_and_mirrored_sees_it_so() {
    let mut config = config();
    config.camera.rotation_deg = 90.0;
    config.camera.mirrored = true;
    config.camera.noise_um = 0.0;
    let mut plant = Plant::new(&config, 7);
    go(&mut plant, Time(1_000_000), [1e-3, 0.6e-3, 0.5e-3], MS);
    let pose = look(&plant).pose();
    let (x, y, turn) = seen(&mut plant).unwrap();
    // Turned by 90°, the camera's x is the platform's y and its y minus the platform's x;
    // mirrored, its y is the platform's x.
    assert!((x - pose.y.value()).abs() < 1e-12);
    assert!((y - pose.x.value()).abs() < 1e-12);
    assert!((turn + pose.angle.value()).abs() < 1e-12);
}

#[test]
fn a_mark_that_is_absent_covered_smeared_or_out_of_the_field_shows() {
    let mut plant = plant(8);
    let likeness = |plant: &mut Plant| {
        let marks = plant.close_shutter(Scene::Marks);
        marks[0].map(|mark| mark.likeness)
    };
    plant.open_shutter(Scene::Marks);
    let good = likeness(&mut plant).unwrap();
    assert!(good > 0.9);
    plant.set_target(Target::Covered);
    assert!(likeness(&mut plant).unwrap() < 0.5);
    plant.set_target(Target::Absent);
    assert_eq!(likeness(&mut plant), None);
    plant.set_target(Target::Good);
    plant.open_shutter(Scene::Marks);
    let now = go(&mut plant, Time(1_000_000), [0.1e-3; AXES], MS);
    assert!(likeness(&mut plant).unwrap() < 0.5 * good, "smeared");
    go(&mut plant, now, [4.5e-3, 4.5e-3, 0.0], MS);
    assert_eq!(likeness(&mut plant), None, "out of the field");
}

#[test]
fn a_screw_whose_other_errors_are_larger_than_its_peak_gets_no_slope() {
    let config = ScrewConfig {
        peak_um: 1.0,
        ..ScrewConfig::default()
    };
    let mut stream = crate::random::Stream::new(1, "test");
    let error = super::lead_error::LeadError::new(&config, &mut stream);
    let cyclic_um = 1e6 * (error.at(2e-3) - error.at(-2e-3)).abs();
    assert!(cyclic_um < 0.5, "{cyclic_um}");
}
