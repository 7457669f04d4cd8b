//! What is doubtful of what an axis is to reach, and of what measures it.

use machine::Stage;
use units::Short;

use crate::config::judge::{ANY_REACHES, COVERED_SHARE, Finding, Judge};
use crate::config::least_time::{RUN_MAX_S, span};
use crate::config::{AxisConfig, InstrumentDevice, MachineConfig};
use crate::linear::run_plan::{RunPlan, plan_of};
use crate::linear::{CompensationConfig, VerifyConfig};

/// Errors of this share of the travel are no errors of a stage, unless it is as short as that of a piezo.
const ERROR_SHARE: f64 = 0.05;
const ERROR_MM: f64 = 0.1;
/// Its acceleration is reached sooner or later than any stage needs, in seconds.
const JERK_S: (f64, f64) = (1e-4, 10.0);
/// Nobody feels how soon a smaller acceleration is reached, in mm/s²: that of a heavy or slow machine.
const FELT: f64 = 100.0;
const UNPROVEN: &str = "check both: nothing can be shown to be within the tolerance";

pub(super) fn check(judge: &mut Judge<'_>, config: &MachineConfig, axis: &AxisConfig) {
    for stage in [Stage::Calibrate, Stage::Verify] {
        if let Some(plan) = plan_of(axis, stage) {
            check_coverage(judge, axis, (stage, &plan));
            check_readings(judge, config, (stage, &plan));
            check_speed(judge, config, axis, (stage, &plan));
        }
    }
    if let Some(limits) = &axis.compensation {
        check_size(judge, axis, limits);
    }
    if let Some(run) = &axis.verify {
        check_tolerance(judge, axis, run);
    }
    check_cyclic(judge, axis);
}

const fn section(stage: Stage) -> &'static str {
    match stage {
        Stage::Calibrate => "calibrate",
        _ => "verify",
    }
}

fn check_coverage(judge: &mut Judge<'_>, axis: &AxisConfig, (stage, plan): (Stage, &RunPlan)) {
    let (soft_min, soft_max) = (axis.motion.soft_min_mm, axis.motion.soft_max_mm);
    let [first, .., last] = plan.targets.as_slice() else {
        return;
    };
    let covered_mm = (*last - *first).mm();
    if covered_mm >= COVERED_SHARE * (soft_max - soft_min) {
        return;
    }
    let is_listed = axis
        .calibrate
        .as_ref()
        .is_some_and(|it| it.positions_mm.is_some());
    let key = match stage {
        Stage::Calibrate if is_listed => "calibrate.positions_mm".to_owned(),
        _ => format!("{}.end_mm", section(stage)),
    };
    judge.say(
        &key,
        format!(
            "{} to {} mm are {:.0} % of the travel from {} to {} mm",
            Short(first.mm()),
            Short(last.mm()),
            100.0 * covered_mm / (soft_max - soft_min),
            Short(soft_min),
            Short(soft_max)
        ),
        "measure wherever the axis works, or narrow its soft limits to that",
    );
}

/// How long all samples of a run take, beside the ways.
fn check_readings(judge: &mut Judge<'_>, config: &MachineConfig, (stage, plan): (Stage, &RunPlan)) {
    let Some(instrument) = config.instrument.get(&plan.instrument) else {
        return;
    };
    let one_s = f64::from(plan.average_samples) / instrument.readings_per_s();
    let points = 2 * u64::from(plan.runs) * plan.targets.len() as u64;
    let all_s = one_s * points as f64;
    if all_s > RUN_MAX_S {
        judge.say(
            &format!("{}.average_samples", section(stage)),
            format!(
                "{} samples take {}, and those of {points} points {}",
                plan.average_samples,
                span(one_s),
                span(all_s)
            ),
            "check average_samples, runs and the number of positions",
        );
    }
}

/// A comparator does not believe a stage that is faster than it knows.
fn check_speed(
    judge: &mut Judge<'_>,
    config: &MachineConfig,
    axis: &AxisConfig,
    (stage, plan): (Stage, &RunPlan),
) {
    let instrument = config.instrument.get(&plan.instrument);
    let Some(InstrumentDevice::Nd287(display)) = instrument.map(|it| &it.device) else {
        return;
    };
    let (speed, most) = (axis.motion.speed_mm_per_s, display.speed_max_mm_per_s);
    if speed > most {
        judge.say(
            &format!("{}.instrument", section(stage)),
            format!(
                "the axis moves at {} mm/s, and `{}` believes {} mm/s at most (speed_max_mm_per_s)",
                Short(speed),
                plan.instrument,
                Short(most)
            ),
            "raise that, or lower speed_mm_per_s of the axis",
        );
    }
}

fn check_size(judge: &mut Judge<'_>, axis: &AxisConfig, limits: &CompensationConfig) {
    let travel_mm = axis.motion.soft_max_mm - axis.motion.soft_min_mm;
    let size_mm = limits.size_limit_um * 1e-3;
    if size_mm > (ERROR_SHARE * travel_mm).max(ERROR_MM) {
        judge.say(
            "compensation.size_limit_um",
            format!(
                "errors of {} mm would be corrected on a travel of {} mm",
                Short(size_mm),
                Short(travel_mm)
            ),
            "check it: it is in micrometres",
        );
    }
    let closure_um = axis.calibrate.as_ref().map(|it| it.closure_limit_um);
    if let Some(closure_um) = closure_um.filter(|it| *it > limits.size_limit_um) {
        judge.say(
            "calibrate.closure_limit_um",
            format!(
                "the zero may be {} µm off after a run, and errors are corrected up to {} µm (size_limit_um)",
                Short(closure_um),
                Short(limits.size_limit_um)
            ),
            "give a fraction of what the axis is to reach",
        );
    }
}

fn check_tolerance(judge: &mut Judge<'_>, axis: &AxisConfig, run: &VerifyConfig) {
    let (key, tolerance_um) = ("verify.accuracy_tolerance_um", run.accuracy_tolerance_um);
    let count_um = axis.motion.resolution_nm.abs() * 1e-3;
    let tolerance = Short(tolerance_um);
    if tolerance_um < count_um {
        judge.say(
            key,
            format!(
                "{tolerance} µm are less than one count of {} µm",
                Short(count_um)
            ),
            "check it: it is in micrometres",
        );
    }
    let size_um = axis.compensation.as_ref().map(|it| it.size_limit_um);
    if let Some(size_um) = size_um.filter(|it| tolerance_um > ANY_REACHES * it) {
        judge.say(
            key,
            format!(
                "{tolerance} µm are far more than the errors that are corrected, {} µm (size_limit_um): any axis reaches that",
                Short(size_um)
            ),
            "check it: it is in micrometres",
        );
    }
    let short_um = axis
        .calibrate
        .as_ref()
        .map_or(0.0, |it| it.short_period_standard_uncertainty_nm * 1e-3);
    if short_um > tolerance_um {
        judge.say(
            "calibrate.short_period_standard_uncertainty_nm",
            format!(
                "what the steps do not show is uncertain by {} µm, and accuracy_tolerance_um is {tolerance}",
                Short(short_um)
            ),
            UNPROVEN,
        );
    }
}

/// What measures must be more certain than what is to be shown by it.
pub(super) fn check_instrument(
    found: &mut Vec<Finding>,
    config: &MachineConfig,
    (name, axis): (&str, &AxisConfig),
) {
    let Some(run) = &axis.verify else {
        return;
    };
    let Some(instrument) = config.instrument.get(&run.instrument) else {
        return;
    };
    let judge = &mut Judge::at(format!("instrument.{}", run.instrument), found);
    let mut uncertain = |key: &str, of: &str, uncertain_um: f64| {
        if uncertain_um > run.accuracy_tolerance_um {
            let cause = format!(
                "{of} is uncertain by {} µm, and axis {name} is to be within {} µm (accuracy_tolerance_um)",
                Short(uncertain_um),
                Short(run.accuracy_tolerance_um)
            );
            judge.say(key, cause, UNPROVEN);
        }
    };
    let reading_um = instrument.instrument_standard_uncertainty_nm * 1e-3;
    let key = "instrument_standard_uncertainty_nm";
    uncertain(key, "a reading", reading_um);
    if let InstrumentDevice::Nd287(display) = &instrument.device {
        let way_mm = run.end_mm - run.start_mm;
        let scale_um = display.scale_standard_uncertainty_ppm * way_mm * 1e-3;
        let of = format!("a way of {} mm", Short(way_mm));
        uncertain("scale_standard_uncertainty_ppm", &of, scale_um);
    }
}

fn check_cyclic(judge: &mut Judge<'_>, axis: &AxisConfig) {
    let Some(cyclic) = axis.cyclic() else {
        return;
    };
    let motion = &axis.motion;
    let acceleration = motion.acceleration_mm_per_s2;
    let reached_s = acceleration / cyclic.jerk_mm_per_s3;
    let is_felt = reached_s < JERK_S.0 && acceleration > FELT;
    if is_felt || reached_s > JERK_S.1 {
        judge.say(
            "cyclic.jerk_mm_per_s3",
            format!(
                "with {} mm/s³ an acceleration of {} mm/s² is reached in {}",
                Short(cyclic.jerk_mm_per_s3),
                Short(acceleration),
                span(reached_s)
            ),
            "check both: 0.01 to 1 s are usual",
        );
    }
    let deviation = Short(cyclic.deviation_limit_um);
    if cyclic.deviation_limit_um < motion.position_window_um {
        judge.say(
            "cyclic.deviation_limit_um",
            format!(
                "an axis counts as astray {deviation} µm off, and as there within {} µm (position_window_um)",
                Short(motion.position_window_um)
            ),
            "give what a move may lag behind, as following_error_limit_um",
        );
    }
}

#[cfg(test)]
mod tests {
    use crate::config::warnings::told::check;

    const LINEAR: &str = include_str!("../../../../configs/machines/linear.toml");
    const VOLUMETRIC: &str = include_str!("../../../../configs/machines/volumetric.toml");

    #[test]
    fn a_range_that_leaves_most_of_the_travel_out_is_told() {
        // What is verified would lie beyond so little, which is told, too.
        let verify = LINEAR.find("[axis.x.verify]").expect("it has one");
        let behind = LINEAR.find("[axis.x.compensation]").expect("it comes next");
        let calibrated = format!("{}{}", &LINEAR[..verify], &LINEAR[behind..]);
        let key = "axis.x.calibrate.end_mm";
        let edit = ("end_mm = 60.0", "end_mm = 6.0");
        let says = "0 to 6 mm are 9 % of the travel from -3 to 63 mm";
        check(&calibrated, &[edit], &[key], says);
        let steps = "start_mm = 0.0\nend_mm = 60.0\nstep_mm = 3.0";
        let edit = (steps, "positions_mm = [0.0, 2.0, 3.0]");
        let key = "axis.x.calibrate.positions_mm";
        check(&calibrated, &[edit], &[key], "0 to 3 mm are 5 %");
        let edit = ("end_mm = 58.7", "end_mm = 7.7");
        check(LINEAR, &[edit], &["axis.x.verify.end_mm"], "1.7 to 7.7 mm");
    }

    #[test]
    fn readings_that_take_days_are_told() {
        let edit = ("average_samples = 12", "average_samples = 1000000");
        let key = "axis.x.calibrate.average_samples";
        let says = "1000000 samples take 1638s, and those of 126 points 206400s";
        check(LINEAR, &[edit], &[key], says);
    }

    #[test]
    fn what_an_axis_is_to_reach_is_judged_by_what_is_corrected_and_measured() {
        let from = "accuracy_tolerance_um = 2.0";
        let key = "axis.x.verify.accuracy_tolerance_um";
        let edit = (from, "accuracy_tolerance_um = 2000.0");
        check(
            LINEAR,
            &[edit],
            &[key],
            "far more than the errors that are corrected, 50 µm",
        );
        let edit = ("uncertainty_nm = 20.0", "uncertainty_nm = 20000.0");
        let says = "a reading is uncertain by 20 µm, and axis x is to be within 2 µm";
        let reading = "instrument.laser.instrument_standard_uncertainty_nm";
        check(LINEAR, &[edit], &[reading], says);
        let edit = ("uncertainty_nm = 21.2", "uncertainty_nm = 21200.0");
        let key = "axis.x.calibrate.short_period_standard_uncertainty_nm";
        check(LINEAR, &[edit], &[key], "uncertain by 21.2 µm");
        let edits = [
            ("size_limit_um = 50.0", "size_limit_um = 50000.0"),
            // An approach begins as much further away.
            ("approach_mm = 1.0", "# approach_mm = 1.0"),
        ];
        let key = "axis.x.compensation.size_limit_um";
        check(
            LINEAR,
            &edits,
            &[key],
            "errors of 50 mm would be corrected on a travel of 66 mm",
        );
        let edit = ("closure_limit_um = 1.0", "closure_limit_um = 1000.0");
        let key = "axis.x.calibrate.closure_limit_um";
        check(LINEAR, &[edit], &[key], "1000 µm off after a run");
    }

    #[test]
    fn a_jerk_and_a_deviation_of_another_unit_are_told() {
        let edit = ("jerk_mm_per_s3 = 20000.0", "jerk_mm_per_s3 = 20.0");
        let says = "an acceleration of 1000 mm/s² is reached in 50s";
        check(VOLUMETRIC, &[edit], &["axis.x.cyclic.jerk_mm_per_s3"], says);
        let edit = ("deviation_limit_um = 500.0", "deviation_limit_um = 0.05");
        let says = "as astray 0.05 µm off, and as there within 0.1 µm";
        check(
            VOLUMETRIC,
            &[edit],
            &["axis.x.cyclic.deviation_limit_um"],
            says,
        );
    }
}
