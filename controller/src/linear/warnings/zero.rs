//! What is doubtful of how an axis gets its origin.

use units::Short;

use crate::config::judge::Judge;
use crate::config::least_time::{hangs, span};
use crate::config::{AxisConfig, MachineConfig};
use crate::linear::ZeroConfig;

/// Samples are taken standing at so many places.
const PLACES: f64 = 3.0;
/// A converter that reaches so many times the rails of its sensors is another one: one for 10 V reads half a volt well.
const FULL_SCALES: f64 = 50.0;
/// An origin that is uncertain by this share of the search is none.
const UNCERTAIN_SHARE: f64 = 0.1;
/// A coarse axis may have a fine zero; a window this many times its uncertainty has another unit.
const WINDOWS: f64 = 100.0;
/// What a heavy axis with a scale of its own stands within, however well its zero is known.
const WINDOW_UM: f64 = 20.0;

pub(super) fn check(judge: &mut Judge<'_>, config: &MachineConfig, axis: &AxisConfig) {
    let Some(zero) = &axis.zero else {
        return;
    };
    check_switch(judge, axis, zero);
    check_search(judge, axis, zero);
    check_time(judge, config, zero);
    check_full_scale(judge, config, zero);
    check_uncertainty(judge, axis, zero);
}

/// The drive gives up before it has come to a switch that is too far away.
fn check_switch(judge: &mut Judge<'_>, axis: &AxisConfig, zero: &ZeroConfig) {
    let room_mm = axis.motion.soft_min_mm - zero.negative_limit_mm;
    let needed_s = room_mm / zero.reference_speed_mm_per_s;
    let Some(limit) = axis
        .reference_limit()
        .filter(|it| needed_s > it.as_secs_f64())
    else {
        return;
    };
    judge.say(
        "zero.negative_limit_mm",
        format!(
            "the limit switch is {} mm beyond soft_min_mm, {} at {} mm/s, and the drive looks for it for {}",
            Short(room_mm),
            span(needed_s),
            Short(zero.reference_speed_mm_per_s),
            span(limit.as_secs_f64())
        ),
        "give its place in millimetres, seen from the zero: usually some beyond soft_min_mm",
    );
}

fn check_search(judge: &mut Judge<'_>, axis: &AxisConfig, zero: &ZeroConfig) {
    let motion = &axis.motion;
    let farthest_mm = motion.soft_max_mm.max(-motion.soft_min_mm);
    if zero.search_limit_mm > farthest_mm {
        judge.say(
            "zero.search_limit_mm",
            format!(
                "{} mm on either side of the zero are more than the soft limits leave, {} and {} mm",
                Short(zero.search_limit_mm),
                Short(motion.soft_min_mm),
                Short(motion.soft_max_mm)
            ),
            "give what the limit switch and the magnets' place are uncertain by, some millimetres",
        );
    }
}

/// How long the search takes over its whole way, there and at the places where it stands.
fn check_time(judge: &mut Judge<'_>, config: &MachineConfig, zero: &ZeroConfig) {
    let period_s = config.sample_period_s(&zero.analog);
    let standing_s = PLACES * zero.samples as f64 * period_s;
    if standing_s > zero.time_limit_s {
        return judge.say(
            "zero.samples",
            format!(
                "{} samples at each of three places take {}, and the search ends after {} (time_limit_s)",
                zero.samples,
                span(standing_s),
                span(zero.time_limit_s)
            ),
            "take fewer samples, or raise time_limit_s",
        );
    }
    let way_mm = 2.0 * zero.search_limit_mm;
    let needed_s = way_mm / zero.search_speed_mm_per_s + standing_s;
    let cause = |end: &str| {
        format!(
            "the search goes over {} mm at {} mm/s and stands at three places, {} altogether, and {end} after {}",
            Short(way_mm),
            Short(zero.search_speed_mm_per_s),
            span(needed_s),
            span(zero.time_limit_s)
        )
    };
    if needed_s > zero.time_limit_s {
        let help = "raise it, or search faster or less far";
        judge.say("zero.time_limit_s", cause("is given up"), help);
    } else if hangs(zero.time_limit_s, needed_s) {
        let help = "give some times what the search takes";
        judge.say(
            "zero.time_limit_s",
            cause("one that hangs is noticed"),
            help,
        );
    }
}

fn check_full_scale(judge: &mut Judge<'_>, config: &MachineConfig, zero: &ZeroConfig) {
    let analog = config.analog.get(&zero.analog);
    let reach = analog.into_iter().flat_map(|it| &it.full_scale_v);
    let reach = reach.copied().fold(f64::INFINITY, f64::min);
    let rail = zero.rail_high_v.abs().max(zero.rail_low_v.abs());
    if reach.is_finite() && reach > FULL_SCALES * rail {
        judge.say(
            "zero.rail_high_v",
            format!(
                "the sensors are saturated at {} and {} V, and their converter reaches to {} V (full_scale_v of analog.{})",
                Short(zero.rail_low_v),
                Short(zero.rail_high_v),
                Short(reach),
                zero.analog
            ),
            "check both: they are in volts",
        );
    }
}

fn check_uncertainty(judge: &mut Judge<'_>, axis: &AxisConfig, zero: &ZeroConfig) {
    let limit_um = zero.standard_uncertainty_limit_um;
    if limit_um >= UNCERTAIN_SHARE * zero.search_limit_mm * 1e3 {
        judge.say(
            "zero.standard_uncertainty_limit_um",
            format!(
                "a zero may be uncertain by {} mm, and it is sought within {} mm: any is taken",
                Short(limit_um * 1e-3),
                Short(zero.search_limit_mm)
            ),
            "check it: it is in micrometres",
        );
    }
    let motion = &axis.motion;
    let window_um = motion.position_window_um;
    let is_wide = window_um > WINDOW_UM.max(WINDOWS * limit_um);
    // Where it is verified, the tolerance says what is too wide.
    if axis.verify.is_none() && is_wide {
        judge.say(
            "position_window_um",
            format!(
                "the axis counts as there {} µm beside its target, and its zero is to be certain to {} µm",
                Short(window_um),
                Short(limit_um)
            ),
            "give some counts of the encoder",
        );
    }
}

#[cfg(test)]
mod tests {
    use crate::config::warnings::told::check;

    const LINEAR: &str = include_str!("../../../../configs/machines/linear.toml");
    const GANTRY: &str = include_str!("../../../../configs/machines/gantry.toml");

    #[test]
    fn a_limit_switch_that_no_drive_reaches_is_told() {
        let key = "axis.x.zero.negative_limit_mm";
        let edit = ("negative_limit_mm = -6.0", "negative_limit_mm = -6000.0");
        let says =
            "5997 mm beyond soft_min_mm, 299.9s at 20 mm/s, and the drive looks for it for 21.6s";
        check(LINEAR, &[edit], &[key], says);
    }

    #[test]
    fn a_search_that_has_no_bound_or_no_time_is_told() {
        let way = ("search_limit_mm = 2.0", "search_limit_mm = 900.0");
        let time = ("time_limit_s = 60.0", "time_limit_s = 4000.0");
        let key = "axis.x.zero.search_limit_mm";
        let says =
            "900 mm on either side of the zero are more than the soft limits leave, -3 and 63 mm";
        check(LINEAR, &[way, time], &[key], says);
        let key = "axis.x.zero.time_limit_s";
        let edit = ("time_limit_s = 60.0", "time_limit_s = 6.0");
        let says = "over 4 mm at 0.5 mm/s and stands at three places, 8.15s altogether, and is given up after 6s";
        check(LINEAR, &[edit], &[key], says);
        let edit = ("time_limit_s = 60.0", "time_limit_s = 60000.0");
        check(
            LINEAR,
            &[edit],
            &[key],
            "one that hangs is noticed after 60000s",
        );
        let edit = ("samples = 10\n", "samples = 10000\n");
        let says = "10000 samples at each of three places take 150s, and the search ends after 60s";
        check(LINEAR, &[edit], &["axis.x.zero.samples"], says);
    }

    #[test]
    fn rails_far_below_what_the_converter_reaches_are_told() {
        let edit = ("full_scale_v = [5.0, 5.0]", "full_scale_v = [500.0, 500.0]");
        let says = "saturated at -4.9 and 4.9 V, and their converter reaches to 500 V";
        check(LINEAR, &[edit], &["axis.x.zero.rail_high_v"], says);
    }

    #[test]
    fn an_origin_that_may_be_anywhere_is_told() {
        let edit = ("limit_um = 0.2", "limit_um = 200.0");
        let key = "axis.x.zero.standard_uncertainty_limit_um";
        let says = "uncertain by 0.2 mm, and it is sought within 2 mm";
        check(LINEAR, &[edit], &[key], says);
        let edit = ("position_window_um = 0.05", "position_window_um = 50.0");
        let says = "50 µm beside its target, and its zero is to be certain to 0.2 µm";
        check(GANTRY, &[edit], &["axis.x1.position_window_um"], says);
    }
}
