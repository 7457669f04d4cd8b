//! What is doubtful of rotary tables that are sound.

use units::Short;

use crate::config::MachineConfig;
use crate::config::judge::{ANY_REACHES, Finding, Judge};
use crate::config::least_time::{LONG_RUN_MAX_S, span};
use crate::rotary::{RotaryCalibrateConfig, RotaryConfig};

const TURN_ARCSEC: f64 = 1_296_000.0;
/// Fewer counts than this within which a table must stand: it never does, when its last digit flickers.
const WINDOW_COUNTS: f64 = 2.0;

pub(crate) fn warnings(config: &MachineConfig, found: &mut Vec<Finding>) {
    for (name, table) in &config.rotary {
        let judge = &mut Judge::at(format!("rotary.{name}"), found);
        check_window(judge, table);
        check_tolerance(judge, table);
        if let Some(run) = &table.calibrate {
            check_run(judge, table, run);
        }
    }
}

/// What a table is to reach, against what it counts, what is corrected and what is read.
fn check_tolerance(judge: &mut Judge<'_>, table: &RotaryConfig) {
    let Some(tolerance) = table.verify.as_ref().map(|it| it.tolerance_arcsec) else {
        return;
    };
    let count = TURN_ARCSEC / f64::from(table.counts_per_turn);
    if tolerance < count {
        judge.say(
            "verify.tolerance_arcsec",
            format!(
                "{}″ are less than one count of {}″",
                Short(tolerance),
                Short(count)
            ),
            "check it: it is in seconds of arc",
        );
    }
    let size = table.compensation.as_ref().map(|it| it.size_limit_arcsec);
    if let Some(size) = size.filter(|it| tolerance > ANY_REACHES * it) {
        judge.say(
            "verify.tolerance_arcsec",
            format!(
                "{}″ are far more than the errors that are corrected, {}″ (size_limit_arcsec): any table reaches that",
                Short(tolerance),
                Short(size)
            ),
            "check it: it is in seconds of arc",
        );
    }
    let noise = table.calibrate.as_ref().map(|it| it.reading_noise_arcsec);
    let passes = table.verify.as_ref().map_or(1, |it| it.passes);
    // Each line is the mean of its readings in both directions.
    let mean_of = (2.0 * f64::from(passes)).sqrt();
    if let Some(noise) = noise.filter(|it| it / mean_of > tolerance) {
        judge.say(
            "calibrate.reading_noise_arcsec",
            format!(
                "a line is read to {}″, the mean of its passes to {}″, and tolerance_arcsec is {}: the scatter of the \
                 readings is in what is verified",
                Short(noise),
                Short((noise / mean_of * 1e4).round() * 1e-4),
                Short(tolerance)
            ),
            "check both: they are in seconds of arc",
        );
    }
}

fn check_run(judge: &mut Judge<'_>, table: &RotaryConfig, run: &RotaryCalibrateConfig) {
    let size = table.compensation.as_ref().map(|it| it.size_limit_arcsec);
    if let Some(size) = size.filter(|it| run.closure_limit_arcsec > *it) {
        judge.say(
            "calibrate.closure_limit_arcsec",
            format!(
                "lines may move by {}″ while they are read, and errors are corrected up to {}″ (size_limit_arcsec)",
                Short(run.closure_limit_arcsec),
                Short(size)
            ),
            "give a fraction of what the table is to reach",
        );
    }
    if !table.is_driven() {
        return;
    }
    let placements = run.offsets.as_ref().map_or(0, Vec::len);
    let placements = run.placements.unwrap_or(placements as u32);
    let turns = 2.0 * f64::from(run.passes) * f64::from(placements);
    let all_s = turns * 360.0 / run.speed_deg_per_s.unwrap_or(table.speed_deg_per_s);
    if all_s > LONG_RUN_MAX_S {
        judge.say(
            "calibrate.passes",
            format!("{turns:.0} turns over the plate take {}", span(all_s)),
            "check passes, placements and speed_deg_per_s",
        );
    }
}

fn check_window(judge: &mut Judge<'_>, table: &RotaryConfig) {
    let window = table.position_window_arcsec;
    let count = TURN_ARCSEC / f64::from(table.counts_per_turn);
    if window < WINDOW_COUNTS * count {
        judge.say(
            "position_window_arcsec",
            format!(
                "{}″ are {:.1} counts of {}″: a table whose last digit flickers never stands",
                Short(window),
                window / count,
                Short(count)
            ),
            format!("give {}″ or more", Short(WINDOW_COUNTS * count)),
        );
    }
    let tolerance = table.verify.as_ref().map(|it| it.tolerance_arcsec);
    if let Some(tolerance) = tolerance.filter(|it| window > *it) {
        judge.say(
            "position_window_arcsec",
            format!(
                "the table counts as there {}″ beside its target, and tolerance_arcsec is {}",
                Short(window),
                Short(tolerance)
            ),
            "give a fraction of the tolerance",
        );
    }
}

#[cfg(test)]
mod tests {
    use crate::config::warnings::told::check;

    const ROTARY: &str = include_str!("../../../configs/machines/rotary.toml");

    #[test]
    fn windows_that_do_not_fit_are_told() {
        let (key, from) = (
            "rotary.c.position_window_arcsec",
            "position_window_arcsec = 0.1",
        );
        let says = "0.015″ are 1.5 counts of 0.01″";
        check(
            ROTARY,
            &[(from, "position_window_arcsec = 0.015")],
            &[key],
            says,
        );
        let says = "0.5″ beside its target, and tolerance_arcsec is 0.3";
        check(
            ROTARY,
            &[(from, "position_window_arcsec = 0.5")],
            &[key],
            says,
        );
    }

    #[test]
    fn what_a_table_is_to_reach_is_judged_by_what_is_corrected_and_read() {
        let from = "tolerance_arcsec = 0.3";
        let key = "rotary.c.verify.tolerance_arcsec";
        let edit = (from, "tolerance_arcsec = 3000.0");
        let says = "3000″ are far more than the errors that are corrected, 60″";
        check(ROTARY, &[edit], &[key], says);
        let edit = ("noise_arcsec = 0.06", "noise_arcsec = 60.0");
        let key = "rotary.c.calibrate.reading_noise_arcsec";
        let says = "a line is read to 60″, the mean of its passes to 42.4264″, and tolerance_arcsec is 0.3";
        check(ROTARY, &[edit], &[key], says);
        let edit = ("limit_arcsec = 0.1", "limit_arcsec = 100.0");
        let key = "rotary.c.calibrate.closure_limit_arcsec";
        check(ROTARY, &[edit], &[key], "may move by 100″");
        let passes = ("passes = 1  ", "passes = 1000  ");
        let speed = (
            "speed_deg_per_s = 60.0\nreading",
            "speed_deg_per_s = 6.0\nreading",
        );
        let says = "8000 turns over the plate take 480000s";
        check(
            ROTARY,
            &[passes, speed],
            &["rotary.c.calibrate.passes"],
            says,
        );
    }
}
