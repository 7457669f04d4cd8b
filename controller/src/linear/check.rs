//! What the steps of the cycle are asked to do.

mod gantry;

use units::Short;

use compensator::hall_zero::SettingsError;

use crate::assemble;
use crate::config::judge::{Finding, Judge};
use crate::config::{AxisConfig, MachineConfig};
use crate::hardware::kept_zero::KeptZeroConfig;
use crate::linear::check::gantry::check_gantries;
use crate::linear::positions::spaced;
use crate::linear::{CalibrateConfig, CompensationConfig, EndPolicyName, VerifyConfig, ZeroConfig};

#[cfg(feature = "program")]
pub(crate) use gantry::notes as gantry_notes;

/// Positions closer than this are one.
const STEP_MIN_MM: f64 = 1e-3;
const POSITIONS_MAX: usize = 10_000;

pub(crate) fn check(config: &MachineConfig, findings: &mut Vec<Finding>) {
    for (name, axis) in &config.axis {
        check_cycle(findings, config, name, axis);
    }
    check_gantries(config, findings);
}

fn check_cycle(findings: &mut Vec<Finding>, config: &MachineConfig, name: &str, axis: &AxisConfig) {
    if axis.zero.is_none()
        && axis
            .drive
            .kept_zero()
            .is_some_and(KeptZeroConfig::is_absolute)
    {
        Judge::at(format!("axis.{name}"), findings).say(
            "kept_zero.by",
            "is for an axis that is homed where it stands, and this one has no zero of its own",
            format!("add [axis.{name}.zero], take another proof, or remove it"),
        );
    }
    if let Some(zero) = &axis.zero {
        check_zero(
            &mut Judge::at(format!("axis.{name}.zero"), findings),
            config,
            axis,
            zero,
        );
    }
    if axis.calibrate.is_some() && axis.compensation.is_none() {
        findings.push(Finding {
            key: format!("axis.{name}.calibrate"),
            cause: "a calibration cannot be used without limits for it".into(),
            help: format!("add [axis.{name}.compensation]"),
        });
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
        check_jump_limit(judge, axis, compensation);
        check_approach(judge, axis, compensation);
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

/// From one side at least there must be room for it everywhere.
fn check_approach(judge: &mut Judge<'_>, axis: &AxisConfig, limits: &CompensationConfig) {
    if !axis.motion.has_travel() {
        return;
    }
    let half = (axis.motion.soft_max_mm - axis.motion.soft_min_mm) / 2.0;
    if let Some(length) = limits.approach_mm.filter(|it| *it > half) {
        judge.say(
            "approach_mm",
            format!(
                "{} mm is more than half of what the soft limits leave",
                Short(length)
            ),
            format!("shorten it to at most {} mm", Short(half)),
        );
    }
}

/// A position that stands off by more than the slope allows is refused for its slope.
fn check_jump_limit(judge: &mut Judge<'_>, axis: &AxisConfig, limits: &CompensationConfig) {
    let Some(jump_limit_um) = limits.jump_limit_um else {
        return;
    };
    let Some(step_mm) = axis.calibrate.as_ref().and_then(largest_step) else {
        return;
    };
    let steepest_um = limits.slope_limit * step_mm * 1e3;
    if jump_limit_um > steepest_um {
        judge.say(
            "jump_limit_um",
            format!(
                "{} um has no effect: `slope_limit` refuses changes above {} um over the {} mm \
                 from one position to the next",
                Short(jump_limit_um),
                Short(steepest_um),
                Short(step_mm)
            ),
            "leave it out: the limit for each position then follows from the other positions of \
             the table",
        );
    }
}

/// The largest distance of two neighbouring positions, millimetres.
fn largest_step(run: &CalibrateConfig) -> Option<f64> {
    let listed = run.positions_mm.iter();
    let listed = listed.flat_map(|it| it.windows(2).map(|pair| pair[1] - pair[0]));
    run.step_mm.into_iter().chain(listed).reduce(f64::max)
}

fn check_zero(judge: &mut Judge<'_>, config: &MachineConfig, axis: &AxisConfig, zero: &ZeroConfig) {
    check_zero_place(judge, axis, zero);
    check_zero_search(judge, axis, zero);
    check_rails(judge, config, zero);
    judge.known("analog", &zero.analog, &config.analog, "analog");
    if let Some(analog) = config.analog.get(&zero.analog)
        && analog.channels.len() != 2
    {
        judge.say(
            "analog",
            "zeroing needs two channels, peak and slope",
            "list both in `channels`",
        );
    }
}

/// Wrong signs here send an axis into its limit switch, or beyond it.
fn check_zero_place(judge: &mut Judge<'_>, axis: &AxisConfig, zero: &ZeroConfig) {
    let is_beyond = zero.negative_limit_mm < axis.motion.soft_min_mm;
    if !is_beyond || zero.negative_limit_mm.is_infinite() {
        judge.say(
            "negative_limit_mm",
            format!(
                "the limit switch at {} mm is not beyond the soft limit of {} mm",
                zero.negative_limit_mm, axis.motion.soft_min_mm
            ),
            "give the switch's position relative to the zero, below soft_min_mm: usually negative",
        );
    }
    let has_zero = (axis.motion.soft_min_mm..=axis.motion.soft_max_mm).contains(&0.0);
    if axis.motion.has_travel() && !has_zero {
        judge.say(
            "",
            format!(
                "the zero lies outside the soft limits {} to {} mm: the axis cannot go there",
                axis.motion.soft_min_mm, axis.motion.soft_max_mm
            ),
            "soft limits are relative to the zero",
        );
    }
}

fn check_zero_search(judge: &mut Judge<'_>, axis: &AxisConfig, zero: &ZeroConfig) {
    let speed_max = axis.motion.speed_max_mm_per_s;
    for (key, value) in [
        ("reference_speed_mm_per_s", zero.reference_speed_mm_per_s),
        ("search_speed_mm_per_s", zero.search_speed_mm_per_s),
    ] {
        judge.up_to(key, value, (speed_max, "speed_max_mm_per_s"));
    }
    if zero.level_below_peak_v * 1e3 <= zero.delta1_mv {
        judge.say(
            "level_below_peak_v",
            format!(
                "the flanks lie {} V below the peak, and `delta1_mv` takes {} mV for the same",
                Short(zero.level_below_peak_v),
                Short(zero.delta1_mv)
            ),
            "give level_below_peak_v more than delta1_mv, or lower that one: the flanks lie well below the peak",
        );
    } else if axis.motion.has_travel()
        && zero.rail_low_v < zero.rail_high_v
        && (0.1..=1e5).contains(&zero.time_limit_s)
        && let Err(error) = assemble::hall_settings(zero, &axis.motion).validate()
    {
        let cause = in_keys(&error.to_string());
        let help = match &error {
            SettingsError::Order { small, large, .. } => {
                in_keys(&format!("lower {small}, or raise {large}"))
            }
            SettingsError::BandTooNarrow { noise, .. } => format!(
                "give at least {}, or lower noise_mv",
                Short(noise.value() * 3e3)
            ),
            _ => "change one of them".to_owned(),
        };
        judge.say(key_of(&error), cause, help);
    }
}

/// An error with the keys of a file in place of the method's own names.
fn in_keys(error: &str) -> String {
    let said = error.strip_prefix("hall zero: ").unwrap_or(error);
    let words = said.split_inclusive([' ', ',']).map(|word| {
        let bare = word.trim_end_matches([' ', ',']);
        match key_of_setting(bare) {
            "" => word.to_owned(),
            key => format!("`{key}`{}", &word[bare.len()..]),
        }
    });
    words.collect()
}

/// The key of the one setting that an error is about, if it is about one.
fn key_of(error: &SettingsError) -> &'static str {
    let setting = match error {
        SettingsError::NotPositive { setting, .. } => setting,
        SettingsError::BandTooNarrow { band, .. } => band,
        SettingsError::Order { small, .. } => small.split(' ').next().unwrap_or_default(),
        SettingsError::NominalOutside { .. } => "",
    };
    key_of_setting(setting)
}

fn key_of_setting(setting: &str) -> &'static str {
    match setting {
        "noise" => "noise_mv",
        "vc" => "level_below_peak_v",
        "vc0" => "turn_below_peak_v",
        "delta1" => "delta1_mv",
        "delta2" => "delta2_mv",
        "delta3" => "delta3_mv",
        "delta4" => "delta4_mv",
        _ => "",
    }
}

/// A rail that the converter never shows is a saturation that nobody sees.
fn check_rails(judge: &mut Judge<'_>, config: &MachineConfig, zero: &ZeroConfig) {
    judge.below(
        ("rail_low_v", zero.rail_low_v),
        ("rail_high_v", zero.rail_high_v),
    );
    let analog = config.analog.get(&zero.analog);
    for full_scale in analog.into_iter().flat_map(|it| &it.full_scale_v) {
        let reach = full_scale.abs();
        for (key, rail) in [
            ("rail_low_v", zero.rail_low_v),
            ("rail_high_v", zero.rail_high_v),
        ] {
            if !(-reach..=reach).contains(&rail) {
                judge.say(
                    key,
                    format!("a converter of ±{reach} V never reads {rail} V"),
                    "give the voltage from which on the sensor or the converter is saturated",
                );
            }
        }
    }
}

/// How far an approach begins from its target at most: what its correction is, it begins further away.
fn longest_approach_mm(axis: &AxisConfig, overrun_mm: f64) -> f64 {
    let own = axis.compensation.as_ref();
    let own = own.and_then(|it| Some(it.approach_mm? + it.size_limit_um * 1e-3));
    own.unwrap_or(0.0).max(overrun_mm)
}

/// The first and the last position, each with the key that says it.
fn check_range(
    judge: &mut Judge<'_>,
    axis: &AxisConfig,
    (start, start_key): (f64, &str),
    (end, end_key): (f64, &str),
    overrun: f64,
) {
    let overrun = longest_approach_mm(axis, overrun);
    judge.below((start_key, start), (end_key, end));
    if !axis.motion.has_travel() {
        return;
    }
    // Without it the first and the last target have no approach of their own.
    let reachable = axis.motion.soft_min_mm..=axis.motion.soft_max_mm;
    if !reachable.contains(&-overrun) {
        judge.say(
            "overrun_mm",
            format!(
                "the datum at 0 mm is approached from {} mm, outside the soft limits",
                Short(-overrun)
            ),
            "shorten it (or `approach_mm` of the compensation), or lower soft_min_mm",
        );
    }
    for (key, value) in [(start_key, start - overrun), (end_key, end + overrun)] {
        if !reachable.contains(&value) {
            judge.say(
                key,
                format!("with its overrun or approach reaches {} mm", Short(value)),
                format!(
                    "stay within {} to {} mm",
                    Short(axis.motion.soft_min_mm),
                    Short(axis.motion.soft_max_mm)
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
    check_positions(judge, axis, run);
}

fn check_positions(judge: &mut Judge<'_>, axis: &AxisConfig, run: &CalibrateConfig) {
    let by_steps = [run.start_mm, run.end_mm, run.step_mm];
    match (&run.positions_mm, spaced(run)) {
        (None, Some([start, end, step])) => {
            check_range(
                judge,
                axis,
                (start, "start_mm"),
                (end, "end_mm"),
                run.overrun_mm,
            );
            judge.within("step_mm", step, STEP_MIN_MM, (end - start).max(STEP_MIN_MM));
        }
        (None, None) => judge.say(
            "",
            "it is not said where to measure",
            "give `start_mm`, `end_mm` and `step_mm`, or a list `positions_mm`",
        ),
        (Some(_), _) if by_steps.iter().any(Option::is_some) => judge.say(
            "positions_mm",
            "a list of positions leaves nothing to `start_mm`, `end_mm` and `step_mm`",
            "give either the list or these three",
        ),
        (Some(listed), _) => check_listed(judge, axis, listed, run.overrun_mm),
    }
}

fn check_listed(judge: &mut Judge<'_>, axis: &AxisConfig, listed: &[f64], overrun: f64) {
    let (2..=POSITIONS_MAX, [first, .., last]) = (listed.len(), listed) else {
        return judge.say(
            "positions_mm",
            format!("{} positions are impossible", listed.len()),
            format!("give 2 to {POSITIONS_MAX}"),
        );
    };
    // A NaN, which TOML can write, is not in order, either.
    let in_order = |pair: &&[f64]| pair[1] - pair[0] >= STEP_MIN_MM;
    if let Some(pair) = listed.windows(2).find(|it| !in_order(it)) {
        return judge.say(
            "positions_mm",
            format!("{} mm follows {} mm", Short(pair[1]), Short(pair[0])),
            format!(
                "list them increasing, {} mm apart or more",
                Short(STEP_MIN_MM)
            ),
        );
    }
    let key = "positions_mm";
    check_range(judge, axis, (*first, key), (*last, key), overrun);
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
    check_range(
        judge,
        axis,
        (run.start_mm, "start_mm"),
        (run.end_mm, "end_mm"),
        run.overrun_mm,
    );
}

#[cfg(test)]
mod tests {
    use crate::Edit;
    use crate::config::parse;

    const LINEAR: &str = include_str!("../../../configs/machines/linear.toml");
    const STEPS: &str = "start_mm = 0.0\nend_mm = 60.0\nstep_mm = 3.0";

    #[track_caller]
    fn check(instead: &str, key: &str, parts: [&str; 2]) {
        let said = parse(&LINEAR.edit(STEPS, instead), "m.toml")
            .unwrap_err()
            .to_string();
        let named = format!("axis.x.calibrate{key}: ");
        let found = said.contains(&named) && parts.iter().all(|it| said.contains(it));
        assert!(found, "{named} {parts:?} in: {said}");
    }

    #[test]
    fn positions_are_listed_or_follow_from_steps_and_lie_where_the_axis_can_go() {
        let listed = |list: &str| parse(&LINEAR.edit(STEPS, list), "m.toml");
        listed("positions_mm = [0.0, 1.5, 1.75, 20.0, 61.9]").unwrap_or_else(|it| panic!("{it}"));
        let key = ".positions_mm";
        check("", "", ["not said where to measure", "positions_mm"]);
        check(
            "start_mm = 0.0\nstep_mm = 3.0",
            "",
            ["not said where to measure", "end_mm"],
        );
        let both = "positions_mm = [0.0, 1.0]\nstep_mm = 3.0";
        check(both, key, ["leaves nothing to", "either the list"]);
        check("positions_mm = [0.0]", key, ["1 positions", "2 to 10000"]);
        check(
            "positions_mm = [0.0, 3.0, 2.0]",
            key,
            ["2 mm follows 3 mm", "increasing"],
        );
        check(
            "positions_mm = [0.0, nan, 2.0]",
            key,
            ["NaN is impossible", "give a number"],
        );
        check(
            "positions_mm = [0.0, 62.6]",
            key,
            ["reaches 63.65 mm", "-3 to 63 mm"],
        );
        let jump = "positions_mm = [0.0, 1.0, 5.0]";
        let text = LINEAR.edit(STEPS, jump).edit(
            "slope_limit = 0.01",
            "slope_limit = 0.01\njump_limit_um = 41.0",
        );
        let said = parse(&text, "m.toml").unwrap_err().to_string();
        assert!(said.contains("40 um over the 4 mm"), "{said}");
    }
}
