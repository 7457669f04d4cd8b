//! What is doubtful of the volume, of how its axes get their origin, and of what they are to reach.

use compensator::volumetric::Axis;
use units::Short;

use crate::config::judge::{ANY_REACHES, COVERED_SHARE, Finding, Judge};
use crate::config::least_time::{self, LONG_RUN_MAX_S, span};
use crate::config::{AxisConfig, InstrumentConfig, MachineConfig};
use crate::volumetric::VolumetricConfig;
use crate::volumetric::config::VolumetricCalibrateConfig;

pub(super) fn check(found: &mut Vec<Finding>, config: &MachineConfig, volume: &VolumetricConfig) {
    let judge = &mut Judge::at("volumetric".into(), found);
    let axes = volume.axes.iter().map(|it| config.axis.get(it));
    for (at, axis) in axes.enumerate() {
        if let Some(axis) = axis {
            check_axis(judge, volume, (at, axis));
        }
    }
    if let Some(own) = &volume.calibrate
        && let Some(instrument) = config.instrument.get(&own.instrument)
    {
        check_duration(judge, volume, own, instrument);
        check_instrument(found, volume, own, instrument);
    }
    check_limit(&mut Judge::at("volumetric.verify".into(), found), volume);
}

fn check_axis(judge: &mut Judge<'_>, volume: &VolumetricConfig, (at, axis): (usize, &AxisConfig)) {
    let (name, motion) = (&volume.axes[at], &axis.motion);
    let (soft_min, soft_max) = (motion.soft_min_mm, motion.soft_max_mm);
    let travel_mm = soft_max - soft_min;
    let (low, high) = (volume.low_mm[at], volume.high_mm[at]);
    if high - low < COVERED_SHARE * travel_mm {
        judge.say(
            "high_mm",
            format!(
                "{} to {} mm are {:.0} % of the travel of axis {name}, from {} to {} mm: outside nothing is corrected",
                Short(low),
                Short(high),
                100.0 * (high - low) / travel_mm,
                Short(soft_min),
                Short(soft_max)
            ),
            "give the volume that the machine works in, or narrow the soft limits to it",
        );
    }
    let index = volume.zero.index_mm[at];
    if index - soft_min > travel_mm / 2.0 {
        judge.say(
            "zero.index_mm",
            format!(
                "the first index pulse off the negative limit switch of axis {name} lies at {} mm, beyond the middle of \
                 {} to {} mm",
                Short(index),
                Short(soft_min),
                Short(soft_max)
            ),
            "give its place seen from the zero: usually near soft_min_mm",
        );
    }
    check_search(judge, volume, (name, travel_mm));
    let limit_um = volume.verify.as_ref().map(|it| it.limit_um);
    if let Some(limit_um) = limit_um.filter(|it| motion.position_window_um > *it) {
        judge.say(
            "verify.limit_um",
            format!(
                "axis {name} counts as there {} µm beside its target (position_window_um), and the limit is {} µm",
                Short(motion.position_window_um),
                Short(limit_um)
            ),
            "give the window a fraction of the limit",
        );
    }
}

fn check_search(judge: &mut Judge<'_>, volume: &VolumetricConfig, (name, travel_mm): (&str, f64)) {
    let zero = &volume.zero;
    let way = format!("the travel of axis {name}, {} mm,", Short(travel_mm));
    let limit = ("zero.time_limit_s", zero.time_limit_s);
    least_time::check_search(judge, (&way, travel_mm), zero.search_speed_mm_per_s, limit);
}

/// One line along each axis is the least that is read.
fn check_duration(
    judge: &mut Judge<'_>,
    volume: &VolumetricConfig,
    own: &VolumetricCalibrateConfig,
    instrument: &InstrumentConfig,
) {
    let nodes = Axis::ALL.map(|axis| u64::from(volume.stretches(axis, own.step_mm)) + 1);
    let places: u64 = nodes.iter().sum();
    let samples_s = f64::from(own.average_samples) / instrument.readings_per_s();
    let settle_s = own.settle_ms * 1e-3;
    let all_s = (samples_s + settle_s) * places as f64;
    if all_s > LONG_RUN_MAX_S {
        let key = match settle_s > samples_s {
            true => "calibrate.settle_ms",
            false => "calibrate.average_samples",
        };
        judge.say(
            key,
            format!(
                "one line along each axis has {places} places, at which the machine stands for {} altogether",
                span(all_s)
            ),
            "check settle_ms, average_samples and step_mm",
        );
    }
}

fn check_instrument(
    found: &mut Vec<Finding>,
    volume: &VolumetricConfig,
    own: &VolumetricCalibrateConfig,
    instrument: &InstrumentConfig,
) {
    let uncertain_um = instrument.instrument_standard_uncertainty_nm * 1e-3;
    let limit_um = volume.verify.as_ref().map(|it| it.limit_um);
    if let Some(limit_um) = limit_um.filter(|it| uncertain_um > *it) {
        Judge::at(format!("instrument.{}", own.instrument), found).say(
            "instrument_standard_uncertainty_nm",
            format!(
                "a path counted is uncertain by {} µm, and the machine is to be within {} µm (volumetric.verify.limit_um)",
                Short(uncertain_um),
                Short(limit_um)
            ),
            "check both: nothing can be shown to be within the limit",
        );
    }
}

fn check_limit(judge: &mut Judge<'_>, volume: &VolumetricConfig) {
    let Some(own) = &volume.verify else {
        return;
    };
    let size_um = volume.compensation.size_limit_um;
    if own.limit_um > ANY_REACHES * size_um {
        judge.say(
            "limit_um",
            format!(
                "{} µm are far more than the errors that are corrected, {} µm (size_limit_um): any machine reaches that",
                Short(own.limit_um),
                Short(size_um)
            ),
            "check it: it is in micrometres",
        );
    }
    let length = |from: &[f64; 3], to: &[f64; 3]| {
        let squares = from
            .iter()
            .zip(to)
            .map(|(from, to)| (to - from) * (to - from));
        squares.sum::<f64>().sqrt()
    };
    let edges = volume.high_mm.iter().zip(&volume.low_mm);
    // A line along the shortest axis is one that machines are accepted by.
    let shortest_mm = edges
        .map(|(high, low)| high - low)
        .fold(f64::INFINITY, f64::min);
    let line_mm = length(&own.from_mm, &own.to_mm);
    if line_mm < COVERED_SHARE * shortest_mm {
        judge.say(
            "to_mm",
            format!(
                "the line that is verified is {line_mm:.3} mm long, and the volume {} mm at least",
                Short(shortest_mm)
            ),
            "take one through all of the volume",
        );
    }
}

#[cfg(test)]
mod tests {
    use crate::config::warnings::told::check;

    const VOLUMETRIC: &str = include_str!("../../../../configs/machines/volumetric.toml");

    #[test]
    fn a_volume_and_a_line_that_leave_most_out_are_told() {
        let edits = [
            (
                "high_mm = [500.0, 400.0, 300.0]",
                "high_mm = [500.0, 400.0, 30.0]",
            ),
            ("from_mm = [0.0, 0.0, 150.0]", "from_mm = [0.0, 0.0, 15.0]"),
            (
                "to_mm = [500.0, 400.0, 150.0]",
                "to_mm = [500.0, 400.0, 15.0]",
            ),
            ("step_mm = 50.0", "step_mm = 6.0"),
        ];
        let says = "0 to 30 mm are 10 % of the travel of axis z, from -3 to 303 mm";
        check(VOLUMETRIC, &edits, &["volumetric.high_mm"], says);
        let edit = ("to_mm = [500.0, 400.0, 150.0]", "to_mm = [0.5, 0.4, 150.0]");
        let says = "is 0.640 mm long, and the volume 300 mm at least";
        check(VOLUMETRIC, &[edit], &["volumetric.verify.to_mm"], says);
    }

    #[test]
    fn an_origin_at_the_wrong_end_and_times_that_do_not_fit_are_told() {
        let edit = ("index_mm = [0.0, 0.0, 0.0]", "index_mm = [500.0, 0.0, 0.0]");
        let says = "of axis x lies at 500 mm, beyond the middle of -3 to 503 mm";
        check(VOLUMETRIC, &[edit], &["volumetric.zero.index_mm"], says);
        let edit = ("time_limit_s = 60.0", "time_limit_s = 24.0");
        let says = "the travel of axis x, 506 mm, takes 25.3s at 20 mm/s, and the search is given up after 24s";
        check(VOLUMETRIC, &[edit], &["volumetric.zero.time_limit_s"], says);
        let edit = ("settle_ms = 100.0", "settle_ms = 100000.0");
        let key = "volumetric.calibrate.average_samples";
        let many = ("average_samples = 60\n", "average_samples = 100000\n");
        let says = "has 27 places, at which the machine stands for";
        let rate = ("sample_rate_hz = 610.35", "sample_rate_hz = 6.1035");
        check(VOLUMETRIC, &[edit, many, rate], &[key], says);
    }

    #[test]
    fn what_a_machine_is_to_reach_is_judged_by_what_is_corrected_and_measured() {
        let key = "volumetric.verify.limit_um";
        let edit = ("limit_um = 3.0", "limit_um = 3000.0");
        let says = "3000 µm are far more than the errors that are corrected, 250 µm";
        check(VOLUMETRIC, &[edit], &[key], says);
        let edit = ("position_window_um = 0.1", "position_window_um = 4.0");
        check(VOLUMETRIC, &[edit], &[key], "axis x counts as there 4 µm");
        let edit = ("uncertainty_nm = 20.0", "uncertainty_nm = 20000.0");
        let key = "instrument.laser.instrument_standard_uncertainty_nm";
        check(
            VOLUMETRIC,
            &[edit],
            &[key],
            "a path counted is uncertain by 20 µm",
        );
    }
}
