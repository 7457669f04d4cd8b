//! What is doubtful of rotary tables that are sound.

use units::Short;

use crate::config::MachineConfig;
use crate::config::judge::{Finding, Judge};
use crate::rotary::RotaryConfig;

const TURN_ARCSEC: f64 = 1_296_000.0;
/// Fewer counts than this within which a table must stand: it never does, when its last digit flickers.
const WINDOW_COUNTS: f64 = 2.0;

pub(crate) fn warnings(config: &MachineConfig, found: &mut Vec<Finding>) {
    for (name, table) in &config.rotary {
        let judge = &mut Judge::at(format!("rotary.{name}"), found);
        check_window(judge, table);
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
}
