//! What is doubtful of linear axes that are sound.

mod accuracy;
mod gantry;
mod zero;

use machine::Stage;
use units::{Metres, Short, ShortSpan};

use crate::config::judge::{Finding, Judge};
use crate::config::least_time::RUN_MAX_S;
use crate::config::{AxisConfig, MachineConfig};
use crate::linear::run_plan::{RunPlan, plan_of, speed_of};

/// Fewer counts than this within which an axis must stand: it never does, when its last digit flickers.
const WINDOW_COUNTS: f64 = 2.0;
/// A target that is nearer to a calibrated position than this share of the step shows nothing between.
const SAME_PLACE: f64 = 0.02;

/// Of the acceleration of the drivers' homing.
const HOMING_SHARE: f64 = 0.1;

pub(crate) fn warnings(config: &MachineConfig, found: &mut Vec<Finding>) {
    for (name, axis) in &config.axis {
        let judge = &mut Judge::at(format!("axis.{name}"), found);
        check_window(judge, axis);
        check_stopping(judge, axis);
        check_reference(judge, axis);
        check_units(judge, axis);
        for stage in [Stage::Calibrate, Stage::Verify] {
            check_duration(judge, axis, stage);
        }
        check_between(judge, axis);
        zero::check(judge, config, axis);
        accuracy::check(judge, config, axis);
        check_corrections(found, config, (name, axis));
        accuracy::check_instrument(found, config, (name, axis));
    }
    gantry::check(config, found);
}

fn check_window(judge: &mut Judge<'_>, axis: &AxisConfig) {
    let motion = &axis.motion;
    let counts = motion.position_window_um * 1e3 / motion.resolution_nm.abs();
    if counts < WINDOW_COUNTS {
        judge.say(
            "position_window_um",
            format!(
                "{} µm are {:.1} counts of {} nm: an axis whose last digit flickers never stands",
                Short(motion.position_window_um),
                counts,
                Short(motion.resolution_nm.abs())
            ),
            format!(
                "give {} µm or more",
                Short(WINDOW_COUNTS * motion.resolution_nm.abs() * 1e-3)
            ),
        );
    }
    let tolerance = axis.verify.as_ref().map(|it| it.accuracy_tolerance_um);
    if let Some(tolerance) = tolerance.filter(|it| motion.position_window_um > *it) {
        judge.say(
            "position_window_um",
            format!(
                "the axis counts as there {} µm beside its target, and accuracy_tolerance_um is {}",
                Short(motion.position_window_um),
                Short(tolerance)
            ),
            "give a fraction of the tolerance",
        );
    }
}

/// Registers are whole numbers: a driver asks for one unit at least.
fn check_units(judge: &mut Judge<'_>, axis: &AxisConfig) {
    let [speed_counts, acceleration_counts] = axis.drive.family().register_units();
    let motion = &axis.motion;
    let count_mm = motion.resolution_nm.abs() * 1e-6;
    for (key, value, counts, unit) in [
        (
            "speed_mm_per_s",
            motion.speed_mm_per_s,
            speed_counts,
            "mm/s",
        ),
        (
            "acceleration_mm_per_s2",
            motion.acceleration_mm_per_s2,
            acceleration_counts,
            "mm/s²",
        ),
        (
            "quick_stop_deceleration_mm_per_s2",
            motion.quick_stop_deceleration_mm_per_s2,
            acceleration_counts,
            "mm/s²",
        ),
    ] {
        let least = count_mm * counts;
        if value < least {
            judge.say(
                key,
                format!(
                    "{} {unit} are less than one unit of the drive with a resolution of {} nm, and it takes {} {unit}",
                    Short(value),
                    Short(motion.resolution_nm),
                    Short(least)
                ),
                "raise it, or look at resolution_nm",
            );
        }
    }
}

/// Behind a limit switch there is so much way to the end of a stage, seldom more.
const BEHIND_SWITCH_MM: f64 = 3.0;

fn check_reference(judge: &mut Judge<'_>, axis: &AxisConfig) {
    let motion = &axis.motion;
    let Some(zero) = &axis.zero else {
        return;
    };
    let speed = zero.reference_speed_mm_per_s;
    // As its driver has it: a tenth of the hardest that it may do.
    let hardest = motion
        .acceleration_mm_per_s2
        .max(motion.quick_stop_deceleration_mm_per_s2);
    let way = speed * speed / (2.0 * HOMING_SHARE * hardest);
    if way > BEHIND_SWITCH_MM {
        judge.say(
            "zero.reference_speed_mm_per_s",
            format!(
                "the axis reaches its limit switch at {} mm/s and stops {way:.1} mm behind it, where the stage may end",
                Short(speed)
            ),
            format!(
                "give {} mm/s or less",
                Short((2.0 * HOMING_SHARE * hardest * BEHIND_SWITCH_MM * 1e4).sqrt().floor() * 1e-2)
            ),
        );
    }
}

fn check_stopping(judge: &mut Judge<'_>, axis: &AxisConfig) {
    let motion = &axis.motion;
    let Some(zero) = &axis.zero else {
        return;
    };
    let speed = motion.speed_mm_per_s;
    let way = speed * speed / (2.0 * motion.quick_stop_deceleration_mm_per_s2);
    let room = motion.soft_min_mm - zero.negative_limit_mm;
    if way > room {
        judge.say(
            "quick_stop_deceleration_mm_per_s2",
            format!(
                "a quick stop from {} mm/s takes {way:.3} mm, and from soft_min_mm to the limit switch there are {} mm",
                Short(speed),
                Short(room)
            ),
            "raise it, lower speed_mm_per_s, or raise soft_min_mm",
        );
    }
}

fn check_duration(judge: &mut Judge<'_>, axis: &AxisConfig, stage: Stage) {
    let Some(plan) = plan_of(axis, stage) else {
        return;
    };
    let planned = plan.planned(speed_of(axis));
    if planned.at_least.as_secs_f64() > RUN_MAX_S {
        judge.say(
            match stage {
                Stage::Calibrate => "calibrate.settle_ms",
                _ => "verify.settle_ms",
            },
            format!(
                "{} points take {} at least",
                planned.points,
                ShortSpan(planned.at_least)
            ),
            "check settle_ms, runs and the number of positions",
        );
    }
}

fn check_between(judge: &mut Judge<'_>, axis: &AxisConfig) {
    let plans = [Stage::Calibrate, Stage::Verify].map(|it| plan_of(axis, it));
    let [Some(calibrated), Some(verified)] = plans else {
        return;
    };
    check_beyond(judge, &calibrated.targets, &verified.targets);
    let same = verified.targets.iter();
    let same = same.filter(|it| is_calibrated(&calibrated, **it)).count();
    let all = verified.targets.len();
    if 2 * same > all {
        judge.say(
            "verify.start_mm",
            format!("{same} of {all} targets are calibrated positions: what is wrong between them does not show"),
            "begin half a step beside a calibrated position, or take another number of targets",
        );
    }
}

/// What is verified must have been calibrated.
fn check_beyond(judge: &mut Judge<'_>, calibrated: &[Metres], verified: &[Metres]) {
    let ends = |it: &[Metres]| Some((*it.first()?, *it.last()?));
    let (Some((first, last)), Some((start, end))) = (ends(calibrated), ends(verified)) else {
        return;
    };
    let beyond = verified.iter().filter(|it| !(first..=last).contains(*it));
    let beyond = beyond.count();
    if beyond > 0 {
        judge.say(
            if end > last { "verify.end_mm" } else { "verify.start_mm" },
            format!(
                "{beyond} of {} targets, {} to {} mm, lie beyond what is calibrated, {} to {} mm: nothing is known there",
                verified.len(),
                Short(start.mm()),
                Short(end.mm()),
                Short(first.mm()),
                Short(last.mm())
            ),
            "verify within what is calibrated, or calibrate as far",
        );
    }
}

fn is_calibrated(plan: &RunPlan, target: Metres) -> bool {
    let steps = plan.targets.windows(2).map(|it| it[1] - it[0]);
    let step = steps.fold(Metres(f64::INFINITY), Metres::min);
    let near = |it: &Metres| (*it - target).abs() < step * SAME_PLACE;
    plan.targets.iter().any(near)
}

/// Where a correction is switched off of what measures the axis.
fn check_corrections(
    found: &mut Vec<Finding>,
    config: &MachineConfig,
    (name, axis): (&str, &AxisConfig),
) {
    let mut told: Vec<String> = Vec::new();
    for plan in [Stage::Calibrate, Stage::Verify]
        .into_iter()
        .filter_map(|it| plan_of(axis, it))
    {
        if told.contains(&plan.instrument) {
            continue;
        }
        let length = match plan.targets.as_slice() {
            [first, .., last] => *last - *first,
            _ => Metres::ZERO,
        };
        let instrument = config.instrument.get(&plan.instrument);
        let off = instrument.into_iter().flat_map(|it| it.switched_off());
        found.extend(off.map(|it| it.warned(&plan.instrument, &format!("axis {name}"), length)));
        told.push(plan.instrument);
    }
}

#[cfg(test)]
mod tests {
    use crate::Edit;
    use crate::config::parse;
    use crate::config::warnings::told::check;

    const LINEAR: &str = include_str!("../../../configs/machines/linear.toml");

    #[test]
    fn what_keeps_an_axis_from_standing_or_counts_anything_as_standing_is_told() {
        let (key, from) = ("axis.x.position_window_um", "position_window_um = 0.05");
        let says = "0.015 µm are 1.5 counts of 10 nm";
        check(
            LINEAR,
            &[(from, "position_window_um = 0.015")],
            &[key],
            says,
        );
        let says = "3 µm beside its target, and accuracy_tolerance_um is 2";
        check(LINEAR, &[(from, "position_window_um = 3.0")], &[key], says);
    }

    #[test]
    fn less_than_one_unit_of_the_drive_is_told() {
        let text = LINEAR
            .edit_first("resolution_nm = 10.0", "resolution_nm = 100000.0")
            .edit_first(
                "acceleration_mm_per_s2 = 5000.0",
                "acceleration_mm_per_s2 = 0.05",
            );
        let loaded = parse(&text, "m.toml").unwrap_or_else(|error| panic!("{error}"));
        let key = "axis.x.acceleration_mm_per_s2";
        let told = loaded.warnings.iter().find(|it| it.key == key);
        let told = told.unwrap_or_else(|| panic!("{:#?}", loaded.warnings));
        assert!(
            told.cause.contains("and it takes 0.1 mm/s²"),
            "{}",
            told.cause
        );
    }

    #[test]
    fn a_limit_switch_that_is_run_over_is_told() {
        let edit = (
            "reference_speed_mm_per_s = 20.0",
            "reference_speed_mm_per_s = 500.0",
        );
        let says = "stops 62.5 mm behind it";
        check(
            LINEAR,
            &[edit],
            &["axis.x.zero.reference_speed_mm_per_s"],
            says,
        );
    }

    #[test]
    fn ways_and_times_that_do_not_fit_are_told() {
        let edit = [(
            "quick_stop_deceleration_mm_per_s2 = 20000.0",
            "quick_stop_deceleration_mm_per_s2 = 5000.0",
        )];
        let key = "axis.x.quick_stop_deceleration_mm_per_s2";
        check(
            LINEAR,
            &edit,
            &[key],
            "takes 4.000 mm, and from soft_min_mm to the limit switch there are 3 mm",
        );
        let edit = [("settle_ms = 20", "settle_ms = 1200000")];
        check(
            LINEAR,
            &edit,
            &["axis.x.calibrate.settle_ms"],
            "126 points take 151200s at least",
        );
    }

    #[test]
    fn a_verification_at_calibrated_positions_is_told() {
        let edits = [
            ("start_mm = 1.7 ", "start_mm = 3.0 "),
            ("end_mm = 58.7", "end_mm = 45.0"),
        ];
        let says = "8 of 8 targets are calibrated positions";
        check(LINEAR, &edits, &["axis.x.verify.start_mm"], says);
    }

    #[test]
    fn a_verification_beyond_what_is_calibrated_is_told() {
        let edits = [("end_mm = 60.0", "end_mm = 30.0")];
        let says = "4 of 8 targets, 1.7 to 58.7 mm, lie beyond what is calibrated, 0 to 30 mm";
        check(LINEAR, &edits, &["axis.x.verify.end_mm"], says);
    }

    #[test]
    fn a_correction_that_is_missing_is_told_with_what_it_comes_to() {
        let edits = [
            ("correct_air = true", "correct_air = false"),
            ("correct_dead_path = true", "correct_dead_path = false"),
        ];
        let key = |name: &str| format!("instrument.laser.{name}");
        let (air, path) = (key("correct_air"), key("correct_dead_path"));
        check(
            LINEAR,
            &edits[1..],
            &[path.as_str()],
            "NOT CORRECTED for dead path, they drift by 0.095 µm for each kelvin",
        );
        check(LINEAR, &edits, &[air.as_str()], "NOT CORRECTED for air");
    }
}
