//! What is doubtful of speeds, accelerations and ways against each other: mostly a unit that was mistaken for another.

use units::Short;

use super::AxisConfig;
use super::judge::{Finding, Judge};
use super::least_time::span;
use super::model::MachineConfig;
use crate::rotary::RotaryConfig;

/// A piezo at a slow speed reaches it in a hundredth of a millisecond, a heavy table in half a minute.
const RAMP_S: (f64, f64) = (1e-5, 60.0);
/// A slow scan is reached in no time by what any drive does, in mm/s² or °/s²: that is as sound.
const USUAL: f64 = 1e5;
/// A lag of more than this share of the travel is no error any more: the axis stands.
const LAG_SHARE: f64 = 0.1;
/// What any drive may lag behind, in millimetres: it is more than that of a piezo's travel.
const LAG_MM: f64 = 1.0;
/// An axis that may stand this far off has no place.
const WINDOW_SHARE: f64 = 0.01;
/// What any axis may stand beside its target, in millimetres, however short it is.
const WINDOW_MM: f64 = 0.05;
const TRAVEL_MM: (f64, f64) = (0.005, 10_000.0);
const TURN_DEG: f64 = 360.0;

/// Keys and units of linear axes or of tables.
struct Words {
    speed: (&'static str, &'static str),
    acceleration: (&'static str, &'static str),
    lag: &'static str,
    /// The unit of lag and window, and how many are one of the way.
    fine: (&'static str, f64),
    way: &'static str,
}

const LINEAR: Words = Words {
    speed: ("speed_mm_per_s", "mm/s"),
    acceleration: ("acceleration_mm_per_s2", "mm/s²"),
    lag: "following_error_limit_um",
    fine: ("µm", 1e3),
    way: "mm",
};

const ROTARY: Words = Words {
    speed: ("speed_deg_per_s", "°/s"),
    acceleration: ("acceleration_deg_per_s2", "°/s²"),
    lag: "following_error_limit_arcsec",
    fine: ("″", 3600.0),
    way: "°",
};

/// What is judged of any drive, in its own units.
struct Motion {
    words: &'static Words,
    way: f64,
    speed: f64,
    acceleration: f64,
    lag: f64,
    window: f64,
    /// A larger lag is doubted, in the unit of the way.
    lag_max: f64,
}

impl Motion {
    fn axis(axis: &AxisConfig) -> Self {
        let motion = &axis.motion;
        Self {
            words: &LINEAR,
            way: motion.soft_max_mm - motion.soft_min_mm,
            speed: motion.speed_mm_per_s,
            acceleration: motion.acceleration_mm_per_s2,
            lag: motion.following_error_limit_um,
            window: motion.position_window_um,
            lag_max: (LAG_SHARE * (motion.soft_max_mm - motion.soft_min_mm)).max(LAG_MM),
        }
    }

    const fn table(table: &RotaryConfig) -> Self {
        Self {
            words: &ROTARY,
            way: TURN_DEG,
            speed: table.speed_deg_per_s,
            acceleration: table.acceleration_deg_per_s2,
            lag: table.following_error_limit_arcsec,
            window: table.position_window_arcsec,
            lag_max: LAG_SHARE * TURN_DEG,
        }
    }

    fn judge(&self, judge: &mut Judge<'_>) {
        self.ramp(judge);
        self.lag(judge);
    }

    fn ramp(&self, judge: &mut Judge<'_>) {
        let ramp_s = self.speed / self.acceleration;
        let is_sudden = ramp_s < RAMP_S.0 && self.acceleration > USUAL;
        if !is_sudden && ramp_s <= RAMP_S.1 {
            return;
        }
        let [(_, of_speed), (key, unit)] = [self.words.speed, self.words.acceleration];
        let cause = format!(
            "{} {of_speed} and {} {unit}: a ramp of {}",
            Short(self.speed),
            Short(self.acceleration),
            span(ramp_s)
        );
        judge.say(
            key,
            cause,
            format!("check it and {}, and their units", self.words.speed.0),
        );
    }

    fn lag(&self, judge: &mut Judge<'_>) {
        let (unit, per_way) = self.words.fine;
        let lag = Short(self.lag);
        if self.lag < self.window {
            let cause = format!(
                "an error is raised {lag} {unit} off, and the position window is {} {unit}: a move may end with one",
                Short(self.window)
            );
            let help = "give more than the position window, what a move may lag behind";
            judge.say(self.words.lag, cause, help);
        }
        if self.lag > per_way * self.lag_max {
            let (way, of_way) = (Short(self.way), self.words.way);
            let cause = format!(
                "{lag} {unit} are {} {of_way} of a way of {way} {of_way}: a drive that is stuck is hardly noticed",
                Short(self.lag / per_way)
            );
            let help = format!("check it: it is in {unit}");
            judge.say(self.words.lag, cause, help);
        }
    }
}

fn check_travel(judge: &mut Judge<'_>, axis: &AxisConfig) {
    let motion = &axis.motion;
    let travel = motion.soft_max_mm - motion.soft_min_mm;
    if !(TRAVEL_MM.0..=TRAVEL_MM.1).contains(&travel) {
        let cause = format!(
            "the soft limits {} and {} mm leave a travel of {} m",
            Short(motion.soft_min_mm),
            Short(motion.soft_max_mm),
            Short(travel * 1e-3)
        );
        judge.say("soft_max_mm", cause, "check both: they are in millimetres");
    }
    let window_mm = motion.position_window_um * 1e-3;
    if window_mm > (WINDOW_SHARE * travel).max(WINDOW_MM) {
        let cause = format!(
            "the axis counts as there {} mm beside its target, of a travel of {} mm",
            Short(window_mm),
            Short(travel)
        );
        judge.say(
            "position_window_um",
            cause,
            "check it: it is in micrometres",
        );
    }
}

pub(super) fn check(config: &MachineConfig, found: &mut Vec<Finding>) {
    for (name, axis) in &config.axis {
        let judge = &mut Judge::at(format!("axis.{name}"), found);
        check_travel(judge, axis);
        Motion::axis(axis).judge(judge);
    }
    for (name, table) in &config.rotary {
        Motion::table(table).judge(&mut Judge::at(format!("rotary.{name}"), found));
    }
}

#[cfg(test)]
mod tests {
    use crate::config::warnings::told::check;

    const LINEAR: &str = include_str!("../../../configs/machines/linear.toml");
    const ROTARY: &str = include_str!("../../../configs/machines/rotary.toml");
    const UVW: &str = include_str!("../../../configs/machines/uvw.toml");

    #[test]
    fn a_ramp_that_no_drive_has_is_told() {
        let edits = [
            (
                "acceleration_deg_per_s2 = 180.0",
                "acceleration_deg_per_s2 = 0.4",
            ),
            ("move_timeout_s = 60.0", "move_timeout_s = 900.0"),
        ];
        let says = "30 °/s and 0.4 °/s²: a ramp of 75s";
        check(ROTARY, &edits, &["rotary.c.acceleration_deg_per_s2"], says);
    }

    #[test]
    fn following_errors_that_are_never_or_always_there_are_told() {
        let key = "axis.u.following_error_limit_um";
        let from = "following_error_limit_um = 200.0";
        let edit = (from, "following_error_limit_um = 0.05");
        check(
            UVW,
            &[edit],
            &[key],
            "0.05 µm off, and the position window is 0.1 µm",
        );
        let edit = (from, "following_error_limit_um = 2000.0");
        check(UVW, &[edit], &[key], "2000 µm are 2 mm of a way of 9 mm");
        let from = "following_error_limit_arcsec = 600.0";
        let edit = (from, "following_error_limit_arcsec = 600000.0");
        let key = "rotary.c.following_error_limit_arcsec";
        check(ROTARY, &[edit], &[key], "of a way of 360 °");
    }

    #[test]
    fn travels_of_metres_and_windows_of_millimetres_are_told() {
        let edits = [
            ("soft_max_mm = 63.0", "soft_max_mm = 19000.0"),
            ("move_timeout_s = 10.0", "move_timeout_s = 200.0"),
            ("end_mm = 60.0", "end_mm = 18000.0"),
            ("step_mm = 3.0", "step_mm = 900.0"),
            ("start_mm = 1.7 ", "start_mm = 451.7 "),
            ("end_mm = 58.7", "end_mm = 17450.0"),
            ("targets = 8", "targets = 18"),
        ];
        let says = "-3 and 19000 mm leave a travel of 19.003 m";
        check(LINEAR, &edits, &["axis.x.soft_max_mm"], says);
        let edit = ("position_window_um = 0.1", "position_window_um = 100.0");
        let keys = ["axis.u.position_window_um", "platform.verify.tolerance_um"];
        check(UVW, &[edit], &keys, "screw u counts as there 100 µm");
    }
}
