//! What the steps of the cycle are asked to do.

use super::judge::{Finding, Judge};
use crate::config::model::{
    AxisConfig, CalibrateConfig, EndPolicyName, MachineConfig, VerifyConfig, ZeroConfig,
};

pub(super) fn check_cycle(
    findings: &mut Vec<Finding>,
    config: &MachineConfig,
    name: &str,
    axis: &AxisConfig,
) {
    if let Some(zero) = &axis.zero {
        check_zero(
            &mut Judge::at(format!("axis.{name}.zero"), findings),
            config,
            zero,
        );
    }
    if let Some(run) = &axis.calibrate {
        check_calibrate(
            &mut Judge::at(format!("axis.{name}.calibrate"), findings),
            config,
            axis,
            run,
        );
    }
    if let Some(run) = &axis.verify {
        check_verify(
            &mut Judge::at(format!("axis.{name}.verify"), findings),
            config,
            axis,
            run,
        );
    }
    if let Some(compensation) = &axis.compensation {
        let judge = &mut Judge::at(format!("axis.{name}.compensation"), findings);
        judge.within("size_limit_um", compensation.size_limit_um, 1e-3, 1e5);
        judge.within("slope_limit", compensation.slope_limit, 1e-9, 0.5);
        judge.within(
            "rate_limit_um_per_s",
            compensation.rate_limit_um_per_s,
            1e-3,
            1e9,
        );
        judge.within("jump_limit_um", compensation.jump_limit_um, 1e-3, 1e5);
        let fades = compensation.end_policy == EndPolicyName::FadeOut;
        if fades != compensation.fade_out_mm.is_some() {
            judge.say(
                "end_policy",
                "fade_out and `fade_out_mm` go together",
                "give both or neither",
            );
        }
    }
}

fn check_zero(judge: &mut Judge<'_>, config: &MachineConfig, zero: &ZeroConfig) {
    judge.known("analog", &zero.analog, &config.analog, "analog module");
    if let Some(analog) = config.analog.get(&zero.analog)
        && analog.channels.len() != 2
    {
        judge.say(
            "analog",
            "zeroing needs two channels, peak and slope",
            "list both in `channels`",
        );
    }
    judge.within(
        "reference_speed_mm_per_s",
        zero.reference_speed_mm_per_s,
        1e-3,
        1e3,
    );
    judge.within(
        "search_speed_mm_per_s",
        zero.search_speed_mm_per_s,
        1e-3,
        100.0,
    );
    judge.within("search_limit_mm", zero.search_limit_mm, 0.01, 1000.0);
    judge.within("time_limit_s", zero.time_limit_s, 0.1, 1e5);
    judge.within("samples", zero.samples as f64, 2.0, 100_000.0);
    for (key, value) in [
        ("delta1_mv", zero.delta1_mv),
        ("delta2_mv", zero.delta2_mv),
        ("delta3_mv", zero.delta3_mv),
        ("delta4_mv", zero.delta4_mv),
    ] {
        judge.within(key, value, 1e-3, 1e4);
    }
    judge.below(
        ("rail_low_v", zero.rail_low_v),
        ("rail_high_v", zero.rail_high_v),
    );
    if zero.level_below_peak_v * 1e3 <= zero.delta1_mv {
        judge.say(
            "level_below_peak_v",
            "is not above delta1",
            "the flanks lie well below the peak",
        );
    }
}

fn check_range(judge: &mut Judge<'_>, axis: &AxisConfig, start: f64, end: f64, overrun: f64) {
    judge.below(("start_mm", start), ("end_mm", end));
    judge.within("overrun_mm", overrun, 0.0, 1e4);
    for (key, value) in [("start_mm", start - overrun), ("end_mm", end + overrun)] {
        if value < axis.soft_min_mm || value > axis.soft_max_mm {
            judge.say(
                key,
                format!("with its overrun reaches {value} mm"),
                format!(
                    "stay within {} to {} mm",
                    axis.soft_min_mm, axis.soft_max_mm
                ),
            );
        }
    }
}

fn check_calibrate(
    judge: &mut Judge<'_>,
    config: &MachineConfig,
    axis: &AxisConfig,
    run: &CalibrateConfig,
) {
    judge.known(
        "instrument",
        &run.instrument,
        &config.instrument,
        "instrument",
    );
    check_range(judge, axis, run.start_mm, run.end_mm, run.overrun_mm);
    judge.within(
        "step_mm",
        run.step_mm,
        1e-3,
        (run.end_mm - run.start_mm).max(1e-3),
    );
    judge.within("runs", run.runs.into(), 2.0, 1000.0);
    judge.within("average_samples", run.average_samples.into(), 1.0, 1e6);
    judge.within("closure_limit_um", run.closure_limit_um, 1e-3, 1e5);
    judge.within("scale_limit_ppm", run.scale_limit_ppm, 1.0, 1e5);
}

fn check_verify(
    judge: &mut Judge<'_>,
    config: &MachineConfig,
    axis: &AxisConfig,
    run: &VerifyConfig,
) {
    judge.known(
        "instrument",
        &run.instrument,
        &config.instrument,
        "instrument",
    );
    check_range(judge, axis, run.start_mm, run.end_mm, run.overrun_mm);
    judge.within("targets", run.targets.into(), 2.0, 10_000.0);
    judge.within("runs", run.runs.into(), 2.0, 1000.0);
    judge.within("average_samples", run.average_samples.into(), 1.0, 1e6);
    judge.within(
        "accuracy_tolerance_um",
        run.accuracy_tolerance_um,
        1e-3,
        1e6,
    );
}
