//! What is doubtful of how drives are watched: each by itself is sound, and by all of them nothing would be noticed.

use units::Short;

use super::AxisConfig;
use super::DriveConfig;
use super::judge::{Finding, Judge};
use super::least_time::{hangs, least_time, span};
use super::model::MachineConfig;
use crate::rotary::RotaryConfig;

/// A shorter time within the window, or with a following error, is somebody's wish, however short the moves are: a piezo
/// goes all its way in a hundredth of a second.
const WISHED_MAX_S: f64 = 1.0;

/// Without its controller a drive goes on for so long at most, unless somebody wants it otherwise.
const ALONE_MAX_MS: u16 = 2000;

/// What is judged of any drive: in millimetres or degrees.
struct Watched {
    /// The longest way, in words.
    way: String,
    /// How long that takes at least, in seconds.
    least_s: f64,
    /// At this speed, with its unit.
    speed: String,
    unit: &'static str,
    acceleration: f64,
    /// The key of how a quick stop slows down, and its value.
    quick_stop: (&'static str, f64),
    following_error_timeout_ms: Option<u16>,
    position_window_time_ms: u16,
    move_timeout_s: f64,
    /// After so long without the controller's heartbeat it stops, on CAN.
    watch_master_ms: Option<u16>,
}

impl Watched {
    fn axis(axis: &AxisConfig) -> Self {
        let motion = &axis.motion;
        let travel = motion.soft_max_mm - motion.soft_min_mm;
        let acceleration = motion.acceleration_mm_per_s2;
        Self {
            way: format!("the whole travel of {} mm", Short(travel)),
            least_s: least_time(travel, motion.speed_mm_per_s, acceleration),
            speed: format!("{} mm/s", Short(motion.speed_mm_per_s)),
            unit: "mm/s²",
            acceleration,
            quick_stop: (
                "quick_stop_deceleration_mm_per_s2",
                motion.quick_stop_deceleration_mm_per_s2,
            ),
            following_error_timeout_ms: match &axis.drive {
                DriveConfig::Cia402(it) => Some(it.following_error_timeout_ms),
                DriveConfig::Copley(_) => None,
            },
            position_window_time_ms: motion.position_window_time_ms,
            move_timeout_s: motion.move_timeout_s,
            watch_master_ms: axis.node().map(|it| it.watch_master_ms),
        }
    }

    fn table(table: &RotaryConfig) -> Self {
        let acceleration = table.acceleration_deg_per_s2;
        Self {
            way: "a whole turn".into(),
            least_s: least_time(360.0, table.speed_deg_per_s, acceleration),
            speed: format!("{}°/s", Short(table.speed_deg_per_s)),
            unit: "°/s²",
            acceleration,
            quick_stop: (
                "quick_stop_deceleration_deg_per_s2",
                table.quick_stop_deceleration_deg_per_s2,
            ),
            following_error_timeout_ms: Some(table.following_error_timeout_ms),
            position_window_time_ms: table.position_window_time_ms,
            move_timeout_s: table.move_timeout_s,
            watch_master_ms: Some(table.node.watch_master_ms),
        }
    }

    fn judge(&self, judge: &mut Judge<'_>) {
        self.quick_stop(judge);
        self.following_error(judge);
        self.standing(judge);
        self.hurried(judge);
        self.hanging(judge);
        self.alone(judge);
    }

    fn quick_stop(&self, judge: &mut Judge<'_>) {
        let (key, deceleration) = self.quick_stop;
        if deceleration >= self.acceleration {
            return;
        }
        let cause = format!(
            "a quick stop slows down by {} {}, and an ordinary move by {}",
            Short(deceleration),
            self.unit,
            Short(self.acceleration)
        );
        judge.say(
            key,
            cause,
            "give at least what a move ends with: a quick stop must not take longer",
        );
    }

    fn alone(&self, judge: &mut Judge<'_>) {
        let Some(alone) = self.watch_master_ms.filter(|it| *it > ALONE_MAX_MS) else {
            return;
        };
        let cause = format!(
            "when its controller is gone, the drive notices it after {} and goes on at {} until then",
            span(f64::from(alone) * 1e-3),
            self.speed
        );
        judge.say(
            "watch_master_ms",
            cause,
            "give some heartbeats of the controller (master_heartbeat_ms of its bus), 200 to 1000 ms",
        );
    }

    fn following_error(&self, judge: &mut Judge<'_>) {
        let Some(timeout) = self.following_error_timeout_ms else {
            return;
        };
        let timeout_s = f64::from(timeout) * 1e-3;
        if timeout_s > self.least_s.max(WISHED_MAX_S) {
            let cause = format!(
                "the following error may be too large for {} before the drive says so, and {} takes {}: no move lasts so long",
                span(timeout_s),
                self.way,
                span(self.least_s)
            );
            judge.say(
                "following_error_timeout_ms",
                cause,
                "give what a servo needs to settle, 20 to 100 ms",
            );
        }
    }

    fn standing(&self, judge: &mut Judge<'_>) {
        let stands_s = f64::from(self.position_window_time_ms) * 1e-3;
        if stands_s > self.least_s.max(WISHED_MAX_S) {
            let cause = format!(
                "each move stands within its window for {} before it is there, and {} takes {}",
                span(stands_s),
                self.way,
                span(self.least_s)
            );
            judge.say(
                "position_window_time_ms",
                cause,
                "give some periods of the servo, 10 to 100 ms",
            );
        }
    }

    fn hurried(&self, judge: &mut Judge<'_>) {
        if self.least_s > self.move_timeout_s {
            let (least, speed) = (span(self.least_s), &self.speed);
            judge.say(
                "move_timeout_s",
                format!("{} takes {least} at {speed}", self.way),
                format!(
                    "give more than {:.1}, and time to settle",
                    (10.0 * self.least_s).ceil() / 10.0
                ),
            );
        }
    }

    fn hanging(&self, judge: &mut Judge<'_>) {
        let limit_s = self.move_timeout_s;
        if hangs(limit_s, self.least_s) {
            let cause = format!(
                "a move that hangs is noticed after {}, and {} takes {}",
                span(limit_s),
                self.way,
                span(self.least_s)
            );
            judge.say(
                "move_timeout_s",
                cause,
                "give some times what the longest move takes",
            );
        }
    }
}

pub(super) fn check(config: &MachineConfig, found: &mut Vec<Finding>) {
    for (name, axis) in &config.axis {
        Watched::axis(axis).judge(&mut Judge::at(format!("axis.{name}"), found));
    }
    for (name, table) in &config.rotary {
        Watched::table(table).judge(&mut Judge::at(format!("rotary.{name}"), found));
    }
}

#[cfg(test)]
mod tests {
    use crate::config::warnings::told::check;

    const LINEAR: &str = include_str!("../../../configs/machines/linear.toml");
    const ROTARY: &str = include_str!("../../../configs/machines/rotary.toml");
    const VOLUMETRIC: &str = include_str!("../../../configs/machines/volumetric.toml");

    #[test]
    fn milliseconds_that_were_taken_for_something_else_are_told() {
        let edit = (
            "following_error_timeout_ms = 50",
            "following_error_timeout_ms = 50000",
        );
        let says = "for 50s before the drive says so, and the whole travel of 66 mm takes 370ms";
        check(
            LINEAR,
            &[edit],
            &["axis.x.following_error_timeout_ms"],
            says,
        );
        let says = "and a whole turn takes 12.17s: no move lasts so long";
        check(
            ROTARY,
            &[edit],
            &["rotary.c.following_error_timeout_ms"],
            says,
        );
        let edit = (
            "position_window_time_ms = 10",
            "position_window_time_ms = 10000",
        );
        let says = "for 10s before it is there";
        check(LINEAR, &[edit], &["axis.x.position_window_time_ms"], says);
    }

    #[test]
    fn a_drive_that_would_go_on_without_its_controller_is_told() {
        let says = "after 20s and goes on at 200 mm/s until then";
        let edit = (
            "watch_master_ms = 500\n\n[axis.x.identity]",
            "watch_master_ms = 20000\n\n[axis.x.identity]",
        );
        check(LINEAR, &[edit], &["axis.x.watch_master_ms"], says);
    }

    #[test]
    fn a_time_that_no_long_move_can_keep_is_told() {
        let says = "the whole travel of 66 mm takes 370ms at 200 mm/s";
        let edit = ("move_timeout_s = 10.0", "move_timeout_s = 0.3");
        check(LINEAR, &[edit], &["axis.x.move_timeout_s"], says);
        let edit = ("move_timeout_s = 60.0", "move_timeout_s = 12.0");
        let says = "a whole turn takes 12.17s at 30°/s";
        check(ROTARY, &[edit], &["rotary.c.move_timeout_s"], says);
    }

    #[test]
    fn a_move_that_hangs_for_hours_is_told() {
        let edit = ("move_timeout_s = 30.0", "move_timeout_s = 30000.0");
        let says = "the whole travel of 506 mm takes 2.73s";
        check(VOLUMETRIC, &[edit], &["axis.x.move_timeout_s"], says);
    }

    #[test]
    fn a_quick_stop_that_is_slower_than_a_move_is_told() {
        let slow = (
            "quick_stop_deceleration_deg_per_s2 = 720.0",
            "quick_stop_deceleration_deg_per_s2 = 72.0",
        );
        let says = "slows down by 72 °/s², and an ordinary move by 180";
        check(
            ROTARY,
            &[slow],
            &["rotary.c.quick_stop_deceleration_deg_per_s2"],
            says,
        );
    }
}
