//! Whether a platform can be held, reached and calibrated as it is described.

use compensator::platform::{Platform, Point, Pose};
use units::portable::hypot;
use units::{Metres, Radians, Short};

use crate::config::MachineConfig;
use crate::config::judge::{Finding, Judge};
use crate::hardware::drive::MotionConfig;
use crate::platform::config::{PARTS, PlatformCalibrateConfig, PlatformConfig, StrokesConfig};
use crate::platform::kinematics;

pub(crate) fn check(config: &MachineConfig, findings: &mut Vec<Finding>) {
    let Some(platform) = &config.platform else {
        return;
    };
    // How many screws there are, nobody knows while one stands there twice.
    let judge = &mut Judge::at("platform".into(), findings);
    if !names_an_axis_twice(judge, platform) {
        check_inconsistency(judge, platform);
    }
    check_references(findings, config, platform);
    check_names(findings, config);
    if let Some(run) = &platform.calibrate {
        let judge = &mut Judge::at("platform.calibrate".into(), findings);
        check_calibrate(judge, platform, run);
        check_travel(findings, config, platform, run);
    }
    if platform.calibrate.is_some() && platform.compensation.is_none() {
        Judge::at("platform".into(), findings).say(
            "calibrate",
            "a calibration cannot be used without limits for it",
            "add [platform.compensation]",
        );
    }
    // What is wrong with the arrangement can only be told of numbers that are sound.
    if findings.is_empty() {
        check_arrangement(
            &mut Judge::at("platform".into(), findings),
            config,
            platform,
        );
    }
}

/// Only a screw more than needed can contradict the others.
fn check_inconsistency(judge: &mut Judge<'_>, platform: &PlatformConfig) {
    let key = "inconsistency_limit_um";
    match (platform.inconsistency_limit_um, platform.actuator.len()) {
        (None, 4..) => judge.say(
            "",
            format!("four screws can contradict each other, and `{key}` is missing"),
            "give the contradiction that the platform bears without strain",
        ),
        (Some(_), ..4) => judge.say(
            key,
            "three screws cannot contradict each other",
            "leave it out",
        ),
        (Some(_), 4..) | (None, _) => {}
    }
    check_lone_homing(judge, platform);
}

/// A screw that looks for its index pushes the platform while the others stand. Nobody can tell
/// by how far four contradict each other then, since none has a coordinate yet.
fn check_lone_homing(judge: &mut Judge<'_>, platform: &PlatformConfig) {
    let key = "zero.lone_homing";
    match (platform.zero.lone_homing, platform.actuator.len()) {
        (false, 4..) => judge.say(
            "",
            "each of the four screws homes while the others stand still, and nothing says that the \
             platform bears it",
            format!(
                "give `{key} = true` if couplings or guides yield over the whole way to the \
                 index; otherwise build the platform with three screws"
            ),
        ),
        (true, ..4) => judge.say(key, "three screws never strain a platform", "leave it out"),
        _ => {}
    }
}

/// No screw goes faster than its own axis may, nor gathers speed faster.
fn check_speed(judge: &mut Judge<'_>, config: &MachineConfig, platform: &PlatformConfig) {
    let least = |of: fn(&MotionConfig) -> f64| {
        let axes = platform
            .actuator
            .iter()
            .filter_map(|it| config.axis.get(&it.axis));
        axes.map(|it| of(&it.motion)).fold(f64::INFINITY, f64::min)
    };
    let fastest = least(|it| it.speed_max_mm_per_s);
    judge.up_to(
        "speed_mm_per_s",
        platform.speed_mm_per_s,
        (fastest, "the least speed_max_mm_per_s of its axes"),
    );
    let steepest = least(|it| it.acceleration_mm_per_s2);
    judge.up_to(
        "acceleration_mm_per_s2",
        platform.acceleration_mm_per_s2,
        (steepest, "the least acceleration_mm_per_s2 of its axes"),
    );
}

fn check_references(
    findings: &mut Vec<Finding>,
    config: &MachineConfig,
    platform: &PlatformConfig,
) {
    Judge::at("platform".into(), findings).known(
        "camera",
        &platform.camera,
        &config.camera,
        "camera",
    );
    check_speed(
        &mut Judge::at("platform".into(), findings),
        config,
        platform,
    );
    for (at, actuator) in platform.actuator.iter().enumerate() {
        let judge = &mut Judge::at(format!("platform.actuator.{at}"), findings);
        judge.known("axis", &actuator.axis, &config.axis, "axis");
        if config
            .axis
            .get(&actuator.axis)
            .is_some_and(|it| it.drive.kept_zero().is_some())
        {
            let axis = &actuator.axis;
            judge.say(
                "axis",
                format!("`{axis}` has a `kept_zero`, and the origin of a platform is what its camera saw"),
                format!("remove axis.{axis}.kept_zero: a platform is zeroed after each start"),
            );
        }
        let [x, y] = actuator.direction;
        if !(1e-6..=1e6).contains(&hypot(x, y)) {
            judge.say(
                "direction",
                format!("[{}, {}] shows nowhere", Short(x), Short(y)),
                "give where the stroke moves the platform, such as [1.0, 0.0] for x; its length does not matter",
            );
        }
        let axis = config.axis.get(&actuator.axis);
        if axis.is_some_and(|it| actuator.index_mm >= it.motion.soft_max_mm) {
            judge.say(
                "index_mm",
                "the index lies beyond the upper soft limit",
                "give the position of the first index pulse off the negative limit switch",
            );
        }
    }
}

fn names_an_axis_twice(judge: &mut Judge<'_>, platform: &PlatformConfig) -> bool {
    let axes = || platform.actuator.iter().map(|it| &it.axis);
    let mut each = axes().enumerate();
    let twice = each.find(|(at, axis)| axes().take(*at).any(|it| it == *axis));
    if let Some((at, axis)) = twice {
        let cause = format!("another screw has the axis `{axis}` already");
        judge.say(
            &format!("actuator.{at}.axis"),
            cause,
            "give each screw its own",
        );
    }
    twice.is_some()
}

/// Targets go by name: whoever asks for a part of the pose would be given the axis that is called like it.
fn check_names(findings: &mut Vec<Finding>, config: &MachineConfig) {
    let axes = config.axis.keys().map(|it| ("axis", it));
    let tables = config.rotary.keys().map(|it| ("rotary", it));
    let taken = axes
        .chain(tables)
        .filter(|it| PARTS.contains(&it.1.as_str()));
    for (section, name) in taken {
        Judge::at(section.into(), findings).say(
            name,
            format!("`{name}` is a part of the platform's pose, and an axis is called so, too"),
            format!(
                "call the axis otherwise; {} are the platform's",
                PARTS.join(", ")
            ),
        );
    }
}

fn check_calibrate(
    judge: &mut Judge<'_>,
    platform: &PlatformConfig,
    run: &PlatformCalibrateConfig,
) {
    check_strokes(judge, run.strokes_of_all());
    let lost_motion_um = platform
        .compensation
        .as_ref()
        .map_or(0.0, |it| it.lost_motion_max_um);
    judge.within(
        "overrun_mm",
        run.overrun_mm,
        (lost_motion_um * 1e-3).max(1e-6),
        1e3,
    );
}

fn check_strokes(judge: &mut Judge<'_>, strokes: StrokesConfig) {
    let StrokesConfig {
        first_mm,
        last_mm,
        step_mm,
    } = strokes;
    judge.below(("first_mm", first_mm), ("last_mm", last_mm));
    judge.within("step_mm", step_mm, 1e-6, (last_mm - first_mm).max(1e-6));
}

/// The strokes of each screw, its own or those of all, stay within its soft limits.
fn check_travel(
    findings: &mut Vec<Finding>,
    config: &MachineConfig,
    platform: &PlatformConfig,
    run: &PlatformCalibrateConfig,
) {
    for (at, actuator) in platform.actuator.iter().enumerate() {
        let place = match &actuator.strokes {
            None => "platform.calibrate".to_owned(),
            Some(_) => format!("platform.actuator.{at}.strokes"),
        };
        let judge = &mut Judge::at(place, findings);
        let strokes = run.strokes_of(actuator);
        if actuator.strokes.is_some() {
            check_strokes(judge, strokes);
        }
        let Some(axis) = config.axis.get(&actuator.axis) else {
            continue;
        };
        check_reach(
            judge,
            (&actuator.axis, &axis.motion),
            (strokes, run.overrun_mm),
        );
    }
}

/// The end that leaves the soft limits, or the overrun where only that does.
fn check_reach(
    judge: &mut Judge<'_>,
    (axis, motion): (&str, &MotionConfig),
    (strokes, overrun_mm): (StrokesConfig, f64),
) {
    let (low, high) = (motion.soft_min_mm, motion.soft_max_mm);
    let (first, last) = (strokes.first_mm, strokes.last_mm);
    let fits = first - overrun_mm >= low && last + overrun_mm <= high;
    if fits || !motion.has_travel() {
        return;
    }
    let (key, help) = match (first < low, last > high) {
        (true, _) => (
            "first_mm",
            format!("give at least {}", Short(low + overrun_mm)),
        ),
        (false, true) => (
            "last_mm",
            format!("give at most {}", Short(high - overrun_mm)),
        ),
        (false, false) => (
            "overrun_mm",
            "shorten the strokes or the overrun".to_owned(),
        ),
    };
    judge.say_once(
        key,
        format!(
            "strokes and overrun leave the soft limits of axis {axis} ({} to {} mm)",
            Short(low),
            Short(high)
        ),
        help,
    );
}

fn check_arrangement(judge: &mut Judge<'_>, config: &MachineConfig, platform: &PlatformConfig) {
    let held = match kinematics(platform, config) {
        Ok(held) => held,
        Err(error) => {
            let help = match platform.actuator.len() {
                ..3 => "add [[platform.actuator]] sections, until there are three",
                _ => "check point_mm and direction of each [[platform.actuator]]",
            };
            judge.say("actuator", error.to_string(), help);
            return;
        }
    };
    if let Some((pose, cause)) = unreachable_corner(&held, platform) {
        judge.say(
            "",
            format!(
                "the work range extends to x = {} mm, y = {} mm, theta = {}°, which the screws \
                 cannot reach: {cause}",
                Short(pose.x.mm()),
                Short(pose.y.mm()),
                Short(pose.angle.value().to_degrees()),
            ),
            "lower x_max_mm, y_max_mm or theta_max_deg, or widen the axes' soft limits",
        );
    }
}

/// Strokes are monotonic enough over small ranges that the corners decide.
fn unreachable_corner(held: &Platform, platform: &PlatformConfig) -> Option<(Pose, String)> {
    let signs = [-1.0, 1.0];
    let corners = signs.iter().flat_map(|x| {
        let with_y = signs.iter().map(move |y| (x, y));
        with_y.flat_map(|(x, y)| signs.iter().map(move |angle| (x, y, angle)))
    });
    corners
        .map(|(x, y, angle)| Pose {
            x: Metres::from_mm(x * platform.x_max_mm),
            y: Metres::from_mm(y * platform.y_max_mm),
            angle: Radians(angle * platform.theta_max_deg.to_radians()),
        })
        .find_map(|pose| Some((pose, held.check(pose).err()?.to_string())))
        .or_else(|| {
            let centre = Point::default();
            let angles = held.reachable_angles(centre);
            let pose = Pose::default();
            angles
                .is_none()
                .then(|| (pose, "no pose can be reached".into()))
        })
}
