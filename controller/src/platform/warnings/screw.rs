//! What is doubtful of how the screws of a platform get their origin and are calibrated.

use std::collections::BTreeSet;

use compensator::platform::Pose;
use units::{Metres, Radians, Short};

use crate::config::judge::{Finding, Judge};
use crate::config::least_time;
use crate::config::{AxisConfig, MachineConfig};
use crate::platform::config::{ActuatorConfig, PlatformCalibrateConfig};
use crate::platform::{PlatformConfig, kinematics};

pub(super) fn check(found: &mut Vec<Finding>, config: &MachineConfig, platform: &PlatformConfig) {
    let mut longest_mm = 0.0_f64;
    for (at, screw) in platform.actuator.iter().enumerate() {
        let Some(axis) = config.axis.get(&screw.axis) else {
            continue;
        };
        let judge = &mut Judge::at(format!("platform.actuator.{at}"), found);
        check_index(judge, screw, axis);
        check_lead(judge, platform, screw);
        longest_mm = longest_mm.max(axis.motion.soft_max_mm - axis.motion.soft_min_mm);
    }
    check_search(
        &mut Judge::at("platform.zero".into(), found),
        platform,
        longest_mm,
    );
    if let Some(run) = &platform.calibrate {
        check_strokes(found, config, platform, run);
    }
}

/// The index is the first one off the switch, and the switch lies beyond the soft limit.
fn check_index(judge: &mut Judge<'_>, screw: &ActuatorConfig, axis: &AxisConfig) {
    let (soft_min, soft_max) = (axis.motion.soft_min_mm, axis.motion.soft_max_mm);
    let (index, lead) = (screw.index_mm, screw.lead_mm);
    if index - lead > soft_min {
        judge.say(
            "index_mm",
            format!(
                "the first index pulse off the limit switch lies at {} mm, so with {} mm to a turn the switch lies above \
                 {} mm, and the axis may move down to {} mm (soft_min_mm)",
                Short(index),
                Short(lead),
                Short(index - lead),
                Short(soft_min)
            ),
            "check index_mm and lead_mm, or raise soft_min_mm: the axis would run into its limit switch",
        );
    }
    if soft_min - index > soft_max - soft_min {
        judge.say(
            "index_mm",
            format!(
                "the index lies {} mm beyond soft_min_mm, and the whole travel is {} mm",
                Short(soft_min - index),
                Short(soft_max - soft_min)
            ),
            "check it: it is in millimetres, seen from the zero",
        );
    }
}

/// Fewer places within a turn show nothing of what repeats with it.
const PLACES_MIN: usize = 3;
/// Nobody knows, so many turns on, at which place of its turn a screw is.
const TURNS_MAX: f64 = 50.0;

/// What is periodic in a turn is not seen by strokes that are always at the same place of it. Those that are further
/// apart than a turn see it where they come to other places.
fn check_lead(judge: &mut Judge<'_>, platform: &PlatformConfig, screw: &ActuatorConfig) {
    let Some(run) = platform
        .calibrate
        .as_ref()
        .filter(|it| it.harmonics_max > 0)
    else {
        return;
    };
    let strokes = run.strokes_of(screw);
    let (turns, step_mm) = (strokes.step_mm / screw.lead_mm, strokes.step_mm);
    let count = ((strokes.last_mm - strokes.first_mm) / step_mm).floor() as usize + 1;
    if turns >= 0.5 && (turns > TURNS_MAX || places(turns, count) < PLACES_MIN) {
        judge.say(
            "lead_mm",
            format!(
                "a turn is {} mm, and the screw is measured every {} mm: what repeats with each turn is hardly seen",
                Short(screw.lead_mm),
                Short(step_mm)
            ),
            "check both: they are in millimetres",
        );
    }
}

/// At how many places of a turn, a twentieth apart, a screw is when it is measured `count` times, `turns` apart.
fn places(turns: f64, count: usize) -> usize {
    const TWENTIETHS: f64 = 20.0;
    let of_turn =
        (0..count).map(|at| ((at as f64 * turns).fract() * TWENTIETHS).round() as usize % 20);
    of_turn.collect::<BTreeSet<_>>().len()
}

fn check_search(judge: &mut Judge<'_>, platform: &PlatformConfig, longest_mm: f64) {
    let zero = &platform.zero;
    let way = format!("a travel of {} mm", Short(longest_mm));
    let limit = ("time_limit_s", zero.time_limit_s);
    least_time::check_search(judge, (&way, longest_mm), zero.search_speed_mm_per_s, limit);
}

/// How far the screws go within the work range, against what of them is measured.
fn check_strokes(
    found: &mut Vec<Finding>,
    config: &MachineConfig,
    platform: &PlatformConfig,
    run: &PlatformCalibrateConfig,
) {
    let Ok(held) = kinematics(platform, config) else {
        return;
    };
    let corners: Vec<Vec<Metres>> = corners(platform).map(|it| held.strokes(it)).collect();
    let beyond = platform
        .compensation
        .as_ref()
        .map_or(0.0, |it| it.extrapolation_mm);
    for (at, screw) in platform.actuator.iter().enumerate() {
        let own = corners.iter().filter_map(|it| it.get(at)).map(|it| it.mm());
        let (low, high) = own.fold((0.0_f64, 0.0_f64), |(low, high), it| {
            (low.min(it), high.max(it))
        });
        let strokes = run.strokes_of(screw);
        if strokes.first_mm - beyond <= low && high <= strokes.last_mm + beyond {
            continue;
        }
        let place = match &screw.strokes {
            None => "platform.calibrate".to_owned(),
            Some(_) => format!("platform.actuator.{at}.strokes"),
        };
        Judge::at(place, found).say(
            "last_mm",
            format!(
                "screw {} is measured from {} to {} mm, and in the work range it goes from {low:.3} to {high:.3} mm",
                screw.axis,
                Short(strokes.first_mm),
                Short(strokes.last_mm)
            ),
            "measure all of it: raise last_mm and lower first_mm, or make the work range smaller",
        );
    }
}

fn corners(platform: &PlatformConfig) -> impl Iterator<Item = Pose> {
    (0..8).map(|corner| {
        let side = |bit: u8, most: f64| if corner & bit == 0 { most } else { -most };
        Pose {
            x: Metres::from_mm(side(1, platform.x_max_mm)),
            y: Metres::from_mm(side(2, platform.y_max_mm)),
            angle: Radians(side(4, platform.theta_max_deg.to_radians())),
        }
    })
}

#[cfg(test)]
mod tests {
    use crate::config::warnings::told::check;

    const UVW: &str = include_str!("../../../../configs/machines/uvw.toml");

    #[test]
    fn an_index_that_no_switch_has_is_told() {
        let key = "platform.actuator.0.index_mm";
        let edit = ("index_mm = -4.0", "index_mm = -1.0");
        let says = "with 2 mm to a turn the switch lies above -3 mm, and the axis may move down to -4.5 mm";
        check(UVW, &[edit], &[key], says);
        let edit = ("index_mm = -4.0", "index_mm = -4000.0");
        let says = "3995.5 mm beyond soft_min_mm, and the whole travel is 9 mm";
        check(UVW, &[edit], &[key], says);
    }

    #[test]
    fn a_screw_that_is_measured_at_one_place_of_its_turn_is_told() {
        let key = "platform.actuator.0.lead_mm";
        let edits = [
            ("lead_mm = 2.0", "lead_mm = 0.002"),
            ("index_mm = -4.0", "index_mm = -4.6"),
        ];
        check(
            UVW,
            &edits,
            &[key],
            "a turn is 0.002 mm, and the screw is measured every 0.25 mm",
        );
        // Always at the same place of its turn, and at eight of them.
        let says = "a turn is 2 mm, and the screw is measured every 2 mm";
        let keys = [0, 1, 2].map(|at| format!("platform.actuator.{at}.lead_mm"));
        let keys = keys.each_ref().map(String::as_str);
        check(UVW, &[("step_mm = 0.25", "step_mm = 2.0")], &keys, says);
        let none: [&str; 0] = [];
        check(UVW, &[("step_mm = 0.25", "step_mm = 0.75")], &none, "");
    }

    #[test]
    fn a_search_that_has_no_time_or_too_much_is_told() {
        let key = "platform.zero.time_limit_s";
        let edit = ("time_limit_s = 30.0", "time_limit_s = 3.0");
        let says = "a travel of 9 mm takes 4.5s at 2 mm/s, and the search is given up after 3s";
        check(UVW, &[edit], &[key], says);
        let edit = ("time_limit_s = 30.0", "time_limit_s = 30000.0");
        check(
            UVW,
            &[edit],
            &[key],
            "one that hangs is noticed after 30000s",
        );
    }

    #[test]
    fn strokes_that_leave_out_a_part_of_the_work_range_are_told() {
        let key = "platform.calibrate.last_mm";
        let edit = ("last_mm = 2.5", "last_mm = 1.5");
        let says = "is measured from -2.5 to 1.5 mm, and in the work range it goes from -";
        check(UVW, &[edit], &[key, key], says);
    }
}
