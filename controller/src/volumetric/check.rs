//! Whether three axes that are corrected throughout their volume make sense as described.

pub(crate) mod detectors;

use units::Short;

use crate::config::MachineConfig;
use crate::config::judge::{Finding, Judge};
use crate::volumetric::check::detectors::check_detectors;
use crate::volumetric::settings;
use crate::volumetric::{InfluenceConfig, ReactionName, VolumetricConfig};
use machine::engine::{CHANNELS_MAX, SPOTS_MAX, THERMOMETERS_MAX};

pub(crate) fn check(config: &MachineConfig, findings: &mut Vec<Finding>) {
    let Some(volumetric) = &config.volumetric else {
        return;
    };
    let judge = &mut Judge::at("volumetric".into(), findings);
    let own_tables = check_axes(judge, config, volumetric);
    check_volume(judge, config, volumetric);
    check_zero(judge, config, volumetric);
    check_compensation(judge, config, volumetric);
    check_feed(judge, volumetric);
    check_influences(judge, volumetric);
    check_calibrate(judge, config, volumetric);
    check_bends(judge, volumetric);
    check_room(judge, config);
    findings.extend(own_tables);
    check_detectors(findings, config, volumetric);
}

/// Gives what is wrong elsewhere: axes that have error tables of their own.
fn check_axes(
    judge: &mut Judge<'_>,
    config: &MachineConfig,
    volumetric: &VolumetricConfig,
) -> Vec<Finding> {
    let mut own_tables = Vec::new();
    if config.platform.is_some() {
        judge.say(
            "",
            "the axes cannot move a platform as well",
            "keep either [platform] or [volumetric]",
        );
    }
    let [x, y, z] = &volumetric.axes;
    if x == y || y == z || x == z {
        judge.say(
            "axes",
            "an axis is named twice",
            "give the three axes that move along x, y and z",
        );
    }
    for name in &volumetric.axes {
        judge.known("axes", name, &config.axis, "axis");
        let Some(axis) = config.axis.get(name) else {
            continue;
        };
        if axis.cyclic().is_none() {
            judge.say(
                "axes",
                format!("axis {name} does not follow cyclic set-points"),
                format!("add [axis.{name}.cyclic]: the correction is part of each set-point"),
            );
        }
        if axis.compensation.is_some() || axis.calibrate.is_some() {
            let own = match axis.compensation.is_some() {
                true => "compensation",
                false => "calibrate",
            };
            own_tables.push(Finding {
                key: format!("axis.{name}.{own}"),
                cause: format!("axis {name} is corrected in the volume, and has an error table of its own"),
                help: format!(
                    "remove [axis.{name}.compensation] and [axis.{name}.calibrate]: its errors are part of the volume's"
                ),
            });
        }
    }
    check_clock(judge, config, volumetric);
    if let Err(error) = settings::volumetric_chain(volumetric) {
        let help = "name the foundation F, and X, Y and Z once each, from the workpiece to the tool, such as \"FXYZ\"";
        judge.say("chain", error.to_string(), help);
    }
    own_tables
}

/// One clock gives the set-points of all three (docs/engine.md).
fn check_clock(judge: &mut Judge<'_>, config: &MachineConfig, volumetric: &VolumetricConfig) {
    let axes = volumetric.axes.iter();
    let axes = axes.filter_map(|name| Some((name, config.axis.get(name)?)));
    let periods = axes.filter_map(|(name, axis)| {
        let bus = axis.port();
        Some((name, bus, config.can.get(bus)?.sync_period_ms))
    });
    let periods: Vec<_> = periods.collect();
    let Some((first, bus, period_ms)) = periods.first() else {
        return;
    };
    let other = periods.iter().find(|it| (it.2 - period_ms).abs() > 1e-9);
    if let Some((name, other_bus, other_ms)) = other {
        judge.say(
            "axes",
            format!(
                "axis {first} hears SYNC each {} ms ({bus}), axis {name} each {} ms ({other_bus})",
                Short(*period_ms),
                Short(*other_ms)
            ),
            format!("give can.{other_bus} and can.{bus} one sync_period_ms: axes that are corrected together take their set-points together"),
        );
    }
}

fn check_volume(judge: &mut Judge<'_>, config: &MachineConfig, volumetric: &VolumetricConfig) {
    if let Err(error) = settings::work_volume(volumetric) {
        judge.say(
            "high_mm",
            error.to_string(),
            "raise high_mm or lower low_mm",
        );
    }
    let tool = volumetric.tool_offset_mm;
    let fits = tool.iter().all(|mm| mm.abs() <= volumetric.tool_max_mm);
    if !fits {
        judge.say(
            "tool_offset_mm",
            format!("{tool:?} is longer than tool_max_mm"),
            "raise tool_max_mm: the correction is proven for tools up to it",
        );
    }
    // The corrected command may lie outside the volume by the size of the correction.
    let room_mm = volumetric.compensation.size_limit_um * 1e-3;
    for (at, name) in volumetric.axes.iter().enumerate() {
        let Some(axis) = config.axis.get(name) else {
            continue;
        };
        let (low, high) = (volumetric.low_mm[at], volumetric.high_mm[at]);
        let fits =
            low - room_mm >= axis.motion.soft_min_mm && high + room_mm <= axis.motion.soft_max_mm;
        if !fits && axis.motion.has_travel() {
            let is_low = low - room_mm < axis.motion.soft_min_mm;
            judge.say_once(
                if is_low { "low_mm" } else { "high_mm" },
                format!(
                    "{low} to {high} mm with corrections of {} mm leave the soft limits \
                     of axis {name}, {} to {} mm",
                    Short(room_mm),
                    axis.motion.soft_min_mm,
                    axis.motion.soft_max_mm
                ),
                "make the volume smaller, or the soft limits wider",
            );
        }
    }
}

fn check_zero(judge: &mut Judge<'_>, config: &MachineConfig, volumetric: &VolumetricConfig) {
    let zero = &volumetric.zero;
    let [first, second, third] = zero.order;
    if first == second || second == third || first == third {
        judge.say(
            "zero.order",
            "an axis is named twice",
            "give all three, beginning with the axis that clears the workpiece",
        );
    }
    for (name, index_mm) in volumetric.axes.iter().zip(zero.index_mm) {
        let Some(axis) = config.axis.get(name) else {
            continue;
        };
        let limit = format!("axis.{name}.speed_max_mm_per_s");
        judge.up_to(
            "zero.search_speed_mm_per_s",
            zero.search_speed_mm_per_s,
            (axis.motion.speed_max_mm_per_s, &limit),
        );
        let inside = index_mm >= axis.motion.soft_min_mm && index_mm < axis.motion.soft_max_mm;
        if !inside && axis.motion.has_travel() {
            judge.say(
                "zero.index_mm",
                format!("the index of axis {name} lies outside its soft limits"),
                "give the position of the first index pulse off the negative limit switch",
            );
        }
    }
}

fn check_compensation(
    judge: &mut Judge<'_>,
    config: &MachineConfig,
    volumetric: &VolumetricConfig,
) {
    let own = &volumetric.compensation;
    judge.within(
        "compensation.displacement_max_um",
        own.displacement_max_um,
        0.0,
        own.size_limit_um.max(0.0),
    );
    for name in &volumetric.axes {
        let Some(cyclic) = config.axis.get(name).and_then(|it| it.cyclic()) else {
            continue;
        };
        let (size, rate) = (cyclic.correction_limit_um, cyclic.correction_rate_um_per_s);
        for (key, wanted, seen, of_axis) in [
            (
                "compensation.size_limit_um",
                own.size_limit_um,
                size,
                "correction_limit_um",
            ),
            (
                "compensation.rate_limit_um_per_s",
                own.rate_limit_um_per_s,
                rate,
                "correction_rate_um_per_s",
            ),
        ] {
            let enough = seen >= wanted;
            if !enough {
                judge.say(
                    key,
                    format!("axis {name} takes corrections only up to {seen} ({of_axis})"),
                    format!("raise axis.{name}.cyclic.{of_axis} to at least {wanted}"),
                );
            }
        }
    }
}

fn check_feed(judge: &mut Judge<'_>, volumetric: &VolumetricConfig) {
    let detectors = volumetric.beam.each().iter().any(Option::is_some)
        || !volumetric.roll.each().is_empty()
        || !volumetric.temperature.is_empty();
    let Some(feed) = &volumetric.feed else {
        if detectors {
            judge.say(
                "",
                "there are detectors, but no section `feed`",
                "add [volumetric.feed]: it says what is done when one of them fails",
            );
        }
        return;
    };
    match (feed.reaction, feed.fade_out_s) {
        (ReactionName::FadeOut, Some(_)) => {}
        (ReactionName::FadeOut, None) => judge.say(
            "feed.reaction",
            "fade_out needs `fade_out_s`",
            "give the time over which the value fades out",
        ),
        (ReactionName::Hold | ReactionName::Stop, Some(_)) => judge.say(
            "feed.fade_out_s",
            "nothing fades out with this reaction",
            "remove it, or set reaction = \"fade_out\"",
        ),
        (ReactionName::Hold | ReactionName::Stop, None) => {}
    }
}

fn check_calibrate(judge: &mut Judge<'_>, config: &MachineConfig, volumetric: &VolumetricConfig) {
    if let Some(own) = &volumetric.calibrate {
        let instruments = &config.instrument;
        judge.known(
            "calibrate.instrument",
            &own.instrument,
            instruments,
            "instrument",
        );
        let second = own.second_tool_offset_mm.unwrap_or_default();
        for mm in second {
            let most = volumetric.tool_max_mm;
            judge.within("calibrate.second_tool_offset_mm", mm, -most, most);
        }
        if volumetric.reference.is_none() {
            judge.say(
                "calibrate",
                "the references of the detectors are taken together with the errors, but nothing \
                 says how",
                "add [volumetric.reference]",
            );
        }
    }
    if let Some(own) = &volumetric.verify {
        for k in 0..3 {
            let (low, high) = (volumetric.low_mm[k], volumetric.high_mm[k]);
            judge.within("verify.from_mm", own.from_mm[k], low, high);
            judge.within("verify.to_mm", own.to_mm[k], low, high);
        }
        if volumetric.calibrate.is_none() {
            judge.say(
                "verify",
                "nothing says how lines are read",
                "add [volumetric.calibrate]",
            );
        }
    }
}

fn check_bends(judge: &mut Judge<'_>, volumetric: &VolumetricConfig) {
    let known = volumetric.temperature.len();
    for (at, bend) in volumetric.bend.iter().enumerate() {
        let key = |key: &str| format!("bend.{at}.{key}");
        let missing = |it: usize| it >= known;
        let places = [("over", Some(bend.over)), ("under", bend.under)];
        for (name, place) in places {
            if let Some(place) = place.filter(|it| missing(*it)) {
                judge.say(
                    &key(name),
                    format!("there is no thermometer {place}, only {known} of them"),
                    "count [[volumetric.temperature]] from 0",
                );
            }
        }
        if bend.under == Some(bend.over) {
            judge.say(
                &key("under"),
                format!("thermometer {} is above and below the guide", bend.over),
                "give the one on the other side of the guide, or leave `under` out",
            );
        }
        if bend.axis == bend.towards {
            judge.say(
                &key("towards"),
                "a guide bends across its axis",
                "name another axis",
            );
        }
        let mut before = volumetric.bend[..at].iter();
        if before.any(|it| (it.axis, it.towards) == (bend.axis, bend.towards)) {
            judge.say(
                &key("axis"),
                "this guide bends in this direction twice",
                "keep one",
            );
        }
        judge.below(
            (&key("low_mm"), bend.low_mm),
            (&key("high_mm"), bend.high_mm),
        );
    }
}

fn check_influences(judge: &mut Judge<'_>, volumetric: &VolumetricConfig) {
    let mut seen = Vec::new();
    for (at, it) in volumetric.influence.iter().enumerate() {
        let key = (it.axis, it.direction, it.along);
        check_influence(judge, at, it);
        if it.axis == it.direction {
            judge.say(
                "influence",
                "a detector sees displacements only across its axis",
                "give a `direction` other than `axis`",
            );
        }
        if seen.contains(&key) {
            judge.say("influence", "is given twice", "keep one of them");
        }
        seen.push(key);
    }
}

/// A straight line goes through two nodes at least, from one position to the next, and each has a factor.
fn check_influence(judge: &mut Judge<'_>, at: usize, influence: &InfluenceConfig) {
    let (positions, factors) = (&influence.position_mm, &influence.factor);
    let rises = positions.windows(2).all(|pair| pair[0] < pair[1]);
    if positions.len() < 2 || !rises {
        judge.say(
            &format!("influence.{at}.position_mm"),
            format!("{positions:?} are no positions that follow each other"),
            "give two positions or more, each larger than the one before",
        );
    }
    if positions.len() != factors.len() {
        judge.say(
            &format!("influence.{at}.factor"),
            format!(
                "{} factors for {} positions",
                factors.len(),
                positions.len()
            ),
            "give one factor for each of `position_mm`",
        );
    }
}

/// The engine hands a limited number of channels to a correction.
fn check_room(judge: &mut Judge<'_>, config: &MachineConfig) {
    let modules = config.analog.values();
    let voltages: usize = modules.clone().map(|it| it.channels.len()).sum();
    let sensors: usize = modules.map(|it| it.temperature_channels().len()).sum();
    for (what, seen, limit) in [
        ("voltages", voltages, CHANNELS_MAX),
        ("thermometers", sensors, THERMOMETERS_MAX),
        ("cameras", config.camera.len(), SPOTS_MAX),
    ] {
        if seen > limit {
            judge.say(
                "",
                format!("there are {seen} {what} altogether, the correction reads at most {limit}"),
                "list only what is used",
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::Edit;
    use crate::config::parse;
    use crate::config::validate::told;
    use crate::edit::with_spot_cameras;

    const VOLUMETRIC: &str = include_str!("../../../configs/machines/volumetric.toml");

    /// The finding at `volumetric` and `key` after `from`, once, has become `to`.
    #[track_caller]
    fn check(from: &str, to: &str, key: &str, says: &str) {
        told::check(VOLUMETRIC, from, to, &format!("volumetric{key}"), says);
    }

    #[test]
    fn the_shipped_three_axes_are_sound() {
        parse(VOLUMETRIC, "volumetric.toml").unwrap_or_else(|error| panic!("{error}"));
    }

    #[test]
    fn axes_and_volume_that_cannot_be_are_found_where_they_stand() {
        let axes = "axes = [\"x\", \"y\", \"z\"]";
        check(axes, "axes = [\"x\", \"x\", \"z\"]", ".axes", "twice");
        check(
            axes,
            "axes = [\"x\", \"y\", \"w\"]",
            ".axes",
            "no linear axis `w`",
        );
        let cyclic = "[axis.x.cyclic]\njerk_mm_per_s3 = 20000.0\ndeviation_limit_um = 500.0\n\
                      correction_limit_um = 300.0\ncorrection_rate_um_per_s = 2000.0\n";
        check(cyclic, "", ".axes", "does not follow cyclic");
        check("\"FXYZ\"", "\"FXYX\"", ".chain", "`FXYX`");
        let high = "high_mm = [500.0,";
        check(high, "high_mm = [-1.0,", ".high_mm", "not a range");
        check(
            high,
            "high_mm = [502.9,",
            ".high_mm",
            "leave the soft limits",
        );
        let tool = "tool_offset_mm = [0.0, 0.0, -100.0]";
        check(
            tool,
            "tool_offset_mm = [0.0, 0.0, nan]",
            ".tool_offset_mm",
            "NaN is impossible",
        );
        let order = "order = [\"z\", \"y\", \"x\"]";
        check(
            order,
            "order = [\"z\", \"y\", \"z\"]",
            ".zero.order",
            "twice",
        );
        let speed = "search_speed_mm_per_s = 20.0";
        let key = ".zero.search_speed_mm_per_s";
        check(speed, "search_speed_mm_per_s = 900.0", key, "900");
        let key = ".compensation.size_limit_um";
        check(
            "size_limit_um = 250.0",
            "size_limit_um = 301.0",
            key,
            "axis x",
        );
        let key = ".compensation.rate_limit_um_per_s";
        let from = "\nrate_limit_um_per_s = 2000.0";
        check(from, "\nrate_limit_um_per_s = 2001.0", key, "axis x");
    }

    /// The finding in the section of x's slide's camera, or another place of its beam.
    #[track_caller]
    fn check_camera(from: &str, to: &str, key: &str, says: &str) {
        let text = with_spot_cameras(VOLUMETRIC, &["x"]);
        told::check(&text, from, to, &format!("volumetric.beam.x{key}"), says);
    }

    #[test]
    fn cameras_that_cannot_be_are_found_where_they_stand() {
        let text = with_spot_cameras(VOLUMETRIC, &["x", "y", "z"]);
        parse(&text, "volumetric.toml").unwrap_or_else(|error| panic!("{error}"));
        let slide = "\ncamera = \"slide_x\"";
        let key = ".slider_camera.camera";
        check_camera(slide, "\ncamera = \"side_x\"", key, "`side_x`");
        check_camera(slide, "\ncamera = \"end_x\"", key, "another beam");
        let end = "rotation_deg = 180.0\ntargets = 1";
        check_camera(end, "rotation_deg = 180.0\ntargets = 2", key, "targets");
        let both = "\n[volumetric.beam.y]\n";
        let (start, end) = (
            "\n[volumetric.beam.y.slider]\n",
            "\n[volumetric.beam.y.end]\n",
        );
        let own = &VOLUMETRIC[VOLUMETRIC.find(start).unwrap()..VOLUMETRIC.find(end).unwrap()];
        let second = own.edit("beam.y", "beam.x").edit("beams_y", "beams_x");
        let key = ".slider_camera";
        check_camera(both, &format!("{second}{both}"), key, "two detectors");
    }

    #[test]
    fn detectors_that_cannot_be_are_found_where_they_stand() {
        let (from, slider) = ("channels = [0, 1, 2, 3]\n", ".beam.x.slider");
        let key = format!("{slider}.channels");
        check(from, "channels = [0, 1, 2, 9]\n", &key, "has no 9");
        check(from, "channels = [0, 1, 2, 2]\n", &key, "another detector");
        let end = ".beam.x.end.channels";
        check(
            "channels = [4, 5, 6, 7]\n",
            "channels = [3, 5, 6, 7]\n",
            end,
            "another",
        );
        check(
            "ratio_max = 0.3\n",
            "",
            slider,
            "`um_per_one` with `ratio_max`",
        );
        check(
            "intensity_max_v = 11.0",
            "intensity_max_v = 4.0",
            &format!("{slider}.intensity_max_v"),
            "greater than intensity_min_v",
        );
        let key = format!("{slider}.age_max_ms");
        check(
            "age_max_ms = 100.0",
            "age_max_ms = 30.0",
            &key,
            "every 20 ms",
        );
        check("end_mm = 600.0\n", "", ".beam.x.drift", "`end_mm`");
        let (from, to) = (
            "end_mm = 600.0\n",
            "end_mm = 600.0\ntranslation_share = 0.5\n",
        );
        let key = ".beam.x.translation_share";
        check(from, to, key, "does not take this key");
        check(
            "drift = \"pivoting\"             # or \"translating\", \"mixed\"\nsource_mm = -100.0\n",
            "drift = \"translating\"\n",
            ".beam.x.drift",
            "`source_mm` is not",
        );
        let key = format!("{slider}.saturation_v");
        check(
            "saturation_v = 3.2",
            "saturation_v = 4.0",
            &key,
            "up to 3.2 V",
        );
        check(
            "base_mm = 300.0",
            "base_mm = 40.0",
            ".roll",
            "do not determine",
        );
        check(
            "channel = 3\n",
            "channel = 2\n",
            ".temperature.1.channel",
            "another",
        );
        check(
            "channel = 3\n",
            "channel = 1\n",
            ".temperature.1.channel",
            "has no 1",
        );
    }

    #[test]
    fn guides_bend_by_thermometers_that_there_are_and_across_their_axes() {
        check(
            "over = 0\n",
            "over = 6\n",
            ".bend.0.over",
            "there is no thermometer 6",
        );
        check(
            "under = 1\n",
            "under = 9\n",
            ".bend.0.under",
            "there is no thermometer 9",
        );
        let under = ".bend.0.under";
        check("under = 1\n", "under = 0\n", under, "above and below");
        check(
            "towards = \"z\"",
            "towards = \"x\"",
            ".bend.0.towards",
            "across",
        );
        check(
            "gradient_max_k = 4.0",
            "gradient_max_k = 0.0",
            ".bend.0.gradient_max_k",
            "0",
        );
    }

    #[test]
    fn a_beam_ends_elsewhere_than_it_begins() {
        let (from, to) = ("end_mm = 600.0\n", "end_mm = -100.0\n");
        check(from, to, ".beam.x.end_mm", "begins at -100 mm");
    }

    #[test]
    fn axes_that_are_corrected_together_hear_one_sync() {
        let second = "\n[can.can1]\ntransport = \"slcan\"\npath = \"/dev/ttyACM9\"\nbitrate_bit_per_s = 1000000\n\
                      sync_period_ms = 5.0\nmaster_node_id = 126\nmaster_heartbeat_ms = 250\n";
        let z = VOLUMETRIC.find("[axis.z]").expect("it has one");
        let (before, behind) = VOLUMETRIC.split_at(z);
        let text = format!(
            "{before}{}{second}",
            behind.edit_first("bus = \"can0\"", "bus = \"can1\"")
        );
        let refused = parse(&text, "machine.toml").unwrap_err().to_string();
        assert!(refused.contains("axis z each 5 ms (can1)"), "{refused}");
        let alike = text.edit("sync_period_ms = 5.0", "sync_period_ms = 2.0");
        parse(&alike, "machine.toml").unwrap_or_else(|error| panic!("{error}"));
    }

    #[test]
    fn what_a_detector_sees_of_others_is_given_from_place_to_place() {
        let influence = |positions: &str, factors: &str| {
            format!(
                "[[volumetric.influence]]\naxis = \"x\"\ndirection = \"y\"\nalong = \"z\"\n\
                 position_mm = {positions}\nfactor = {factors}\n[volumetric.zero]"
            )
        };
        let check = |positions: &str, factors: &str, key: &str, says: &str| {
            let to = influence(positions, factors);
            check(
                "[volumetric.zero]",
                &to,
                &format!(".influence.0.{key}"),
                says,
            );
        };
        check("[0.0, 1.0]", "[0.1]", "factor", "1 factors for 2");
        check(
            "[1.0, 0.0]",
            "[0.1, 0.2]",
            "position_mm",
            "follow each other",
        );
        check("[1.0]", "[0.1]", "position_mm", "follow each other");
    }

    #[test]
    fn lines_are_read_by_an_instrument_that_there_is_within_the_volume() {
        let key = ".calibrate.instrument";
        check(
            "instrument = \"laser\"",
            "instrument = \"ruler\"",
            key,
            "ruler",
        );
        check("step_mm = 50.0", "step_mm = 0.0", ".calibrate.step_mm", "0");
        check("to_mm = [500.0,", "to_mm = [501.0,", ".verify.to_mm", "501");
    }

    #[test]
    fn references_need_stops_and_samples() {
        let key = ".reference.step_mm";
        check("step_mm = 25.0", "step_mm = 0.0", key, "0");
        let key = ".reference.samples";
        check("samples = 50", "samples = 0", key, "0");
    }

    #[test]
    fn what_a_feed_does_must_be_said_and_nothing_else() {
        let from = "fade_out_s = 60.0\n";
        check(from, "", ".feed.reaction", "needs `fade_out_s`");
        let (from, to) = ("reaction = \"fade_out\"", "reaction = \"hold\"");
        check(from, to, ".feed.fade_out_s", "nothing fades");
        check(
            "confirm = 10",
            "confirm = 0",
            ".feed.confirm",
            "0 is impossible",
        );
        let begin = VOLUMETRIC.find("[volumetric.feed]").expect("it has a feed");
        let end = VOLUMETRIC
            .find("[volumetric.compensation]")
            .expect("it comes next");
        check(&VOLUMETRIC[begin..end], "", "", "no section `feed`");
    }
}
