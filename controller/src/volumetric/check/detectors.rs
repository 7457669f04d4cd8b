//! Whether the detectors of three axes make sense: wiring, curves, limits.

use std::collections::BTreeSet;

use compensator::volumetric::online::SettingsError;
use units::Short;

use crate::config::judge::{Finding, Judge};
use crate::config::{AnalogConfig, MachineConfig};
use crate::hardware::camera::CameraConfig;
use crate::volumetric::PICTURE_PERIODS_MAX;
use crate::volumetric::settings::{self, BeamDetectorError, volume_axis};
use crate::volumetric::{
    BeamConfig, BeamDetectorConfig, BeamDriftName, RollConfig, SpotCameraConfig, TemperatureConfig,
    VolumetricConfig,
};

/// An analog input, by the names of module and quantity and its channel.
type Input<'a> = (&'a str, &'static str, u8);

const AXES: [&str; 3] = ["x", "y", "z"];
/// How the inputs of a module are called in findings.
const VOLTAGE: &str = "channels";
const TEMPERATURE: &str = "temperature_channels";

pub(crate) fn check_detectors(
    findings: &mut Vec<Finding>,
    config: &MachineConfig,
    volumetric: &VolumetricConfig,
) {
    let mut taken = BTreeSet::new();
    check_beams(findings, config, volumetric, &mut taken);
    let rolls = volumetric.roll.each();
    for (at, roll) in rolls.iter().enumerate() {
        let place = volumetric.roll.place("volumetric.roll", at);
        let judge = &mut Judge::at(place, findings);
        if rolls[..at].iter().any(|before| before.axis == roll.axis) {
            judge.say(
                "axis",
                format!("the roll of {} is read twice", volume_axis(roll.axis)),
                "give each slide two detectors at most",
            );
        }
        check_roll(judge, config, roll, &mut taken);
    }
    for (at, temperature) in volumetric.temperature.iter().enumerate() {
        let judge = &mut Judge::at(format!("volumetric.temperature.{at}"), findings);
        check_temperature(judge, config, temperature, &mut taken);
    }
}

fn check_beams<'a>(
    findings: &mut Vec<Finding>,
    config: &'a MachineConfig,
    volumetric: &'a VolumetricConfig,
    taken: &mut BTreeSet<Input<'a>>,
) {
    for (axis, beam) in AXES.iter().zip(volumetric.beam.each()) {
        let Some(beam) = beam else {
            continue;
        };
        let at = format!("volumetric.beam.{axis}");
        check_drift(&mut Judge::at(at.clone(), findings), beam);
        check_places(&mut Judge::at(at.clone(), findings), beam);
        for (key, detector) in [("slider", &beam.slider), ("end", &beam.end)] {
            let judge = &mut Judge::at(format!("{at}.{key}"), findings);
            if let Some(detector) = detector {
                check_detector(judge, config, detector, taken);
            }
        }
        let cameras = [
            ("slider_camera", &beam.slider_camera),
            ("end_camera", &beam.end_camera),
        ];
        for (key, camera) in cameras {
            let judge = &mut Judge::at(format!("{at}.{key}"), findings);
            if let Some(camera) = camera {
                check_camera(judge, config, volumetric, camera);
            }
        }
    }
}

/// One detector on the slide, one at the end at most.
fn check_places(judge: &mut Judge<'_>, beam: &BeamConfig) {
    let help = "keep one of them";
    match (&beam.slider, &beam.slider_camera) {
        (None, None) => judge.say(
            "slider",
            "nothing on the slide sees this beam",
            "add `slider`, a detector of four channels, or `slider_camera`",
        ),
        (Some(_), Some(_)) => judge.say("slider_camera", "the slide has two detectors", help),
        (Some(_), None) | (None, Some(_)) => {}
    }
    if beam.end.is_some() && beam.end_camera.is_some() {
        judge.say("end_camera", "the end has two detectors", help);
    }
}

/// A camera must be there, belong to one place, and find one spot.
fn check_camera(
    judge: &mut Judge<'_>,
    config: &MachineConfig,
    volumetric: &VolumetricConfig,
    spot: &SpotCameraConfig,
) {
    judge.known("camera", &spot.camera, &config.camera, "camera");
    let Some(camera) = config.camera.get(&spot.camera) else {
        return;
    };
    let same = volumetric.cameras().filter(|it| it.camera == spot.camera);
    if same.count() > 1 {
        judge.say(
            "camera",
            format!("camera {} sees another beam already", spot.camera),
            "each place needs a camera of its own",
        );
    }
    let targets = camera.keys().targets;
    if targets != 1 {
        judge.say(
            "camera",
            format!("camera.{}.targets is {}", spot.camera, targets),
            "a beam has one spot: give `targets = 1`",
        );
    }
    check_picture(judge, config, volumetric, (spot, camera));
    if let Err(error) = settings::spot_camera(spot) {
        judge.say("", error.to_string(), "");
    }
}

/// A picture must be believed for as long as it may take, and no longer than it is known where the axes were; and one
/// that is bad must not count as trouble that lasts.
fn check_picture(
    judge: &mut Judge<'_>,
    config: &MachineConfig,
    volumetric: &VolumetricConfig,
    (spot, camera): (&SpotCameraConfig, &CameraConfig),
) {
    let picture_ms = camera.inspection_timeout_ms;
    let named = format!("camera.{}.inspection_timeout_ms", spot.camera);
    if spot.age_max_ms < picture_ms {
        judge.say(
            "age_max_ms",
            format!("{} ms, but {named} is {picture_ms} ms", spot.age_max_ms),
            format!("give at least {picture_ms}, or lower {named}"),
        );
    }
    let periods = config.can.values().map(|it| it.sync_period_ms);
    let known_ms = periods.fold(f64::INFINITY, f64::min) * PICTURE_PERIODS_MAX as f64;
    if spot.age_max_ms > known_ms {
        judge.say(
            "age_max_ms",
            format!(
                "{} ms, but where the axes were is known for {known_ms} ms",
                spot.age_max_ms
            ),
            format!("give at most {known_ms}"),
        );
    }
    let feed = volumetric.feed.as_ref();
    if let Some(feed) = feed.filter(|it| it.patience_ms < picture_ms) {
        judge.say(
            "camera",
            format!(
                "{named} is {picture_ms} ms, and [volumetric.feed] has a patience of {} ms: one bad picture would count as \
                 trouble that lasts",
                feed.patience_ms
            ),
            format!("lower {named}, or raise patience_ms"),
        );
    }
}

fn check_drift(judge: &mut Judge<'_>, beam: &BeamConfig) {
    let is_turning = beam.drift != BeamDriftName::Translating;
    // A beam that does not turn needs no ends; with both of them it can be told that it does.
    let has_ends = beam.source_mm.is_some() || beam.end_mm.is_some();
    let ends = is_turning || has_ends;
    let share = beam.drift == BeamDriftName::Mixed;
    for (key, is_there, needed) in [
        ("source_mm", beam.source_mm.is_some(), ends),
        ("end_mm", beam.end_mm.is_some(), ends),
        ("translation_share", beam.translation_share.is_some(), share),
    ] {
        match (is_there, needed) {
            (false, true) if is_turning => judge.say(
                "drift",
                format!("a beam that drifts like this needs `{key}`"),
                "add it",
            ),
            (false, true) => judge.say(
                "drift",
                format!("one end of the beam is given, `{key}` is not"),
                "give both or none",
            ),
            (true, false) => judge.say(
                key,
                "a beam that drifts like this does not take this key",
                "remove it",
            ),
            (true, true) | (false, false) => {}
        }
    }
    if let (Some(source), Some(end)) = (beam.source_mm, beam.end_mm) {
        let apart = (end - source).abs();
        if !(1e-3..=1e6).contains(&apart) {
            judge.say(
                "end_mm",
                format!(
                    "the beam begins at {} mm (source_mm) and ends there",
                    Short(source)
                ),
                "give where it leaves the source, and where it is seen at its end",
            );
        }
    }
}

fn check_detector<'a>(
    judge: &mut Judge<'_>,
    config: &'a MachineConfig,
    detector: &'a BeamDetectorConfig,
    taken: &mut BTreeSet<Input<'a>>,
) {
    let channels = &detector.channels;
    if let Some(analog) = module(judge, config, &detector.analog) {
        for channel in channels {
            claim(judge, (&detector.analog, VOLTAGE, *channel), analog, taken);
            check_saturation(judge, detector, analog, *channel);
        }
        check_age(judge, config, analog, detector.age_max_ms);
    }
    check_light(judge, detector);
    judge.below(
        ("intensity_min_v", detector.intensity_min_v),
        ("intensity_max_v", detector.intensity_max_v),
    );
    check_curve(judge, detector);
    match settings::beam_detector(detector) {
        // Told of its own key.
        Err(BeamDetectorError::Settings(SettingsError::Intensity { .. })) | Ok(_) => {}
        Err(BeamDetectorError::Curve(_)) if !detector.curve.is_empty() => {}
        Err(error) => {
            let help = "configs/README.md describes every key of a beam detector";
            judge.say("", error.to_string(), help);
        }
    }
}

/// A curve goes through two points at least, from one ratio to the next.
fn check_curve(judge: &mut Judge<'_>, detector: &BeamDetectorConfig) {
    let ratios: Vec<f64> = detector.curve.iter().map(|it| it.ratio).collect();
    let rises = ratios.windows(2).all(|pair| pair[0] < pair[1]);
    if !ratios.is_empty() && (ratios.len() < 2 || !rises) {
        let seen: Vec<String> = ratios.iter().map(|it| Short(*it).to_string()).collect();
        judge.say(
            "curve",
            format!("its ratios are {}", seen.join(", ")),
            "give two points or more, each with a larger `ratio` than the one before",
        );
    }
}

/// Four channels short of saturation must be able to show a beam.
fn check_light(judge: &mut Judge<'_>, detector: &BeamDetectorConfig) {
    let saturation_v = detector.saturation_v;
    let dark_mv = detector.dark_mv.iter().copied().fold(0.0, f64::max);
    if saturation_v > 0.0 && dark_mv * 1e-3 >= saturation_v {
        return judge.say(
            "dark_mv",
            format!(
                "a channel gives {} mV in the dark, and is saturated at {} V",
                Short(dark_mv),
                Short(saturation_v)
            ),
            "give what it shows with the beam covered, in millivolts",
        );
    }
    let brightest_v = brightest_v(detector);
    if brightest_v > 0.0 && detector.intensity_min_v >= brightest_v {
        judge.say(
            "intensity_min_v",
            format!(
                "four channels below saturation_v never come to {} V together: {} V at most, and the beam would always \
                 count as blocked",
                Short(detector.intensity_min_v),
                Short(brightest_v)
            ),
            "give half of the sum that the beam gives, in volts",
        );
    }
}

/// The largest sum of the four channels, none of them saturated.
pub(crate) fn brightest_v(detector: &BeamDetectorConfig) -> f64 {
    let channels = detector.dark_mv.iter().zip(detector.gain);
    let channels = channels.map(|(dark, gain)| (detector.saturation_v - dark * 1e-3) * gain);
    channels.sum()
}

/// A converter at its end must count as saturated.
fn check_saturation(
    judge: &mut Judge<'_>,
    detector: &BeamDetectorConfig,
    analog: &AnalogConfig,
    channel: u8,
) {
    let place = analog.channels.iter().position(|it| *it == channel);
    let range_v = place.and_then(|it| analog.full_scale_v.get(it));
    let Some(range_v) = range_v.filter(|it| detector.saturation_v > **it) else {
        return;
    };
    judge.say(
        "saturation_v",
        format!(
            "channel {channel} of {} reads only up to {range_v} V",
            detector.analog
        ),
        format!("give at most {range_v}"),
    );
}

/// The module called `name`, if it samples at SYNC: that alone tells when something was.
fn module<'a>(
    judge: &mut Judge<'_>,
    config: &'a MachineConfig,
    name: &str,
) -> Option<&'a AnalogConfig> {
    judge.known("analog", name, &config.analog, "analog");
    let analog = config.analog.get(name)?;
    if analog.every_syncs().is_some() {
        return Some(analog);
    }
    judge.say(
        "analog",
        "this module does not sample at SYNC",
        "use a module on CAN",
    );
    None
}

/// An input must be there, and belongs to one detector.
fn claim<'a>(
    judge: &mut Judge<'_>,
    input: Input<'a>,
    analog: &AnalogConfig,
    taken: &mut BTreeSet<Input<'a>>,
) {
    let (module, quantity, channel) = input;
    let (key, known) = if quantity == TEMPERATURE {
        ("channel", analog.temperature_channels())
    } else {
        ("channels", &*analog.channels)
    };
    if !known.contains(&channel) {
        judge.say(
            key,
            format!("analog.{module}.{quantity} has no {channel}"),
            format!("known: {known:?}"),
        );
    } else if !taken.insert(input) {
        judge.say(
            key,
            format!("channel {channel} of {module} already belongs to another detector"),
            "each input belongs to one detector only",
        );
    }
}

/// A sample must be accepted for at least as long as the next one takes.
fn check_age(judge: &mut Judge<'_>, config: &MachineConfig, analog: &AnalogConfig, age_ms: f64) {
    let bus = analog.node().and_then(|it| config.can.get(&it.bus));
    let Some(bus) = bus else {
        return;
    };
    let every = f64::from(analog.every_syncs().unwrap_or(1).max(1));
    let least = 2.0 * every * bus.sync_period_ms;
    let enough = age_ms >= least;
    if !enough {
        judge.say(
            "age_max_ms",
            format!(
                "{age_ms} ms, but the module samples every {} ms",
                every * bus.sync_period_ms
            ),
            format!("give at least {least}"),
        );
    }
}

fn check_roll<'a>(
    judge: &mut Judge<'_>,
    config: &'a MachineConfig,
    roll: &'a RollConfig,
    taken: &mut BTreeSet<Input<'a>>,
) {
    if let Some(analog) = module(judge, config, &roll.analog) {
        for channel in roll.channels {
            claim(judge, (&roll.analog, VOLTAGE, channel), analog, taken);
        }
        check_age(judge, config, analog, roll.age_max_ms);
    }
    if let Err(error) = settings::roll_optics(roll) {
        let help = "2 × height_mm must differ from base_mm × tan(inclination_deg)";
        judge.say("", error.to_string(), help);
    }
}

fn check_temperature<'a>(
    judge: &mut Judge<'_>,
    config: &'a MachineConfig,
    temperature: &'a TemperatureConfig,
    taken: &mut BTreeSet<Input<'a>>,
) {
    if let Some(analog) = module(judge, config, &temperature.analog) {
        let input = (&*temperature.analog, TEMPERATURE, temperature.channel);
        claim(judge, input, analog, taken);
        check_age(judge, config, analog, temperature.age_max_ms);
    }
    judge.below(("low_c", temperature.low_c), ("high_c", temperature.high_c));
}

#[cfg(test)]
mod tests {
    use crate::config::validate::told::check;

    #[test]
    fn light_that_no_channels_show_is_found_where_it_stands() {
        let volumetric = include_str!("../../../../configs/machines/volumetric.toml");
        let from = "intensity_min_v = 5.0\nintensity_max_v = 11.0";
        let to = "intensity_min_v = 5000.0\nintensity_max_v = 11000.0";
        let key = "volumetric.beam.x.slider.intensity_min_v";
        let says = "never come to 5000 V together: 12.8 V at most";
        check(volumetric, from, to, key, says);
        let to = &format!("{from}\ndark_mv = [0.0, 4000.0, 0.0, 0.0]");
        let key = "volumetric.beam.x.slider.dark_mv";
        let says = "4000 mV in the dark, and is saturated at 3.2 V";
        check(volumetric, from, to, key, says);
    }
}
