//! What is doubtful of a platform that is sound.

mod reach;
mod screw;

use core::time::Duration;

use units::{Short, ShortSpan};

use crate::config::MachineConfig;
use crate::config::judge::{Finding, Judge};
use crate::config::least_time::RUN_MAX_S;
use crate::platform::PlatformConfig;

pub(crate) fn warnings(config: &MachineConfig, found: &mut Vec<Finding>) {
    let Some(platform) = &config.platform else {
        return;
    };
    reach::check(found, config, platform);
    screw::check(found, config, platform);
    let judge = &mut Judge::at("platform".into(), found);
    check_duration(judge, platform);
    let tolerance = platform.verify.as_ref().map(|it| it.tolerance_um);
    for screw in &platform.actuator {
        let Some(axis) = config.axis.get(&screw.axis) else {
            continue;
        };
        let window = axis.motion.position_window_um;
        if let Some(tolerance) = tolerance.filter(|it| window > *it) {
            judge.say(
                "verify.tolerance_um",
                format!(
                    "screw {} counts as there {} µm beside its target (position_window_um), and the tolerance is {} µm",
                    screw.axis,
                    Short(window),
                    Short(tolerance)
                ),
                "give the window a fraction of the tolerance",
            );
        }
    }
}

fn check_duration(judge: &mut Judge<'_>, platform: &PlatformConfig) {
    let Some(own) = &platform.calibrate else {
        return;
    };
    let strokes = platform.actuator.iter();
    let strokes = strokes.map(|it| own.strokes_of(it).targets().len());
    let pictures = strokes.sum::<usize>() * 2 * own.runs as usize;
    let least = Duration::from_millis(platform.settle_ms.into()).saturating_mul(pictures as u32);
    if least.as_secs_f64() > RUN_MAX_S {
        judge.say(
            "settle_ms",
            format!(
                "a calibration of {pictures} pictures takes {} at least",
                ShortSpan(least)
            ),
            "check settle_ms, runs and step_mm",
        );
    }
}

#[cfg(test)]
mod tests {
    use crate::config::warnings::told::check;

    const UVW: &str = include_str!("../../../configs/machines/uvw.toml");

    #[test]
    fn times_and_windows_that_do_not_fit_are_told() {
        let edit = [("settle_ms = 30", "settle_ms = 600000")];
        check(
            UVW,
            &edit,
            &["platform.settle_ms"],
            "252 pictures takes 151200s",
        );
        let edit = [("position_window_um = 0.1", "position_window_um = 30.0")];
        check(
            UVW,
            &edit,
            &["platform.verify.tolerance_um"],
            "screw u counts as there 30 µm",
        );
    }
}
