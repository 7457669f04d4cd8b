//! What is doubtful of what watches three axes.

use core::num::NonZeroU32;

use units::Short;

use crate::config::judge::{Finding, Judge};
use crate::config::least_time::span;
use crate::config::{AxisConfig, MachineConfig};
use crate::volumetric::check::detectors::brightest_v;
use crate::volumetric::{
    BeamConfig, BeamDetectorConfig, RollConfig, TemperatureConfig, VolumetricConfig,
};

/// Thresholds further apart let everything pass.
const INTENSITIES: f64 = 100.0;
/// A beam this many times as long as the travel is none of this machine.
const BEAM_LENGTHS: f64 = 10.0;
/// A sample may be some periods old,
const PERIODS: f64 = 500.0;
/// and so many seconds, however short they are: what a beam sees drifts slowly.
const AGE_MAX_S: f64 = 10.0;
/// A detector of light always has noise, so that one that is stuck is noticed within an hour. Thermometers may show the
/// same digits for a day, and be asked once in a minute.
const STUCK_MAX_S: f64 = 3600.0;
/// Of what differences of channels by their sum can be.
const RATIO_MAX: f64 = 1.0;

pub(super) fn check(found: &mut Vec<Finding>, config: &MachineConfig, volume: &VolumetricConfig) {
    let beams = volume.beam.each().into_iter().zip(&volume.axes);
    for ((beam, axis), name) in beams.zip(["x", "y", "z"]) {
        let Some(beam) = beam else {
            continue;
        };
        let at = format!("volumetric.beam.{name}");
        let judge = &mut Judge::at(at.clone(), found);
        check_uncertainty(judge, volume, beam);
        if let Some(axis) = config.axis.get(axis) {
            check_ends(judge, axis, beam);
        }
        for (key, detector) in [("slider", &beam.slider), ("end", &beam.end)] {
            if let Some(detector) = detector {
                let judge = &mut Judge::at(format!("{at}.{key}"), found);
                check_detector(judge, config, detector);
            }
        }
    }
    for (at, roll) in volume.roll.each().iter().enumerate() {
        let place = volume.roll.place("volumetric.roll", at);
        check_roll(&mut Judge::at(place, found), config, roll);
    }
    for (at, temperature) in volume.temperature.iter().enumerate() {
        let judge = &mut Judge::at(format!("volumetric.temperature.{at}"), found);
        check_temperature(judge, temperature);
    }
}

fn check_uncertainty(judge: &mut Judge<'_>, volume: &VolumetricConfig, beam: &BeamConfig) {
    let limit_um = volume.verify.as_ref().map(|it| it.limit_um);
    let (Some(limit_um), Some(uncertain_um)) = (limit_um, beam.standard_uncertainty_um) else {
        return;
    };
    if uncertain_um > limit_um {
        judge.say(
            "standard_uncertainty_um",
            format!(
                "a displacement is uncertain by {} µm, and the machine is to be within {} µm (limit_um)",
                Short(uncertain_um),
                Short(limit_um)
            ),
            "check both: they are in micrometres",
        );
    }
}

/// Source and end stand where the slide does not come.
fn check_ends(judge: &mut Judge<'_>, axis: &AxisConfig, beam: &BeamConfig) {
    let (soft_min, soft_max) = (axis.motion.soft_min_mm, axis.motion.soft_max_mm);
    for (key, what, place) in [
        ("source_mm", "the source", beam.source_mm),
        ("end_mm", "the end detector", beam.end_mm),
    ] {
        if let Some(place) = place.filter(|it| soft_min < *it && *it < soft_max) {
            judge.say(
                key,
                format!(
                    "{what} stands at {} mm, within the travel of the slide from {} to {} mm",
                    Short(place),
                    Short(soft_min),
                    Short(soft_max)
                ),
                "give its place by the axis's scale, beyond the travel",
            );
        }
    }
    let (Some(source), Some(end)) = (beam.source_mm, beam.end_mm) else {
        return;
    };
    let (length_mm, travel_mm) = ((end - source).abs(), soft_max - soft_min);
    if length_mm > BEAM_LENGTHS * travel_mm {
        judge.say(
            "end_mm",
            format!(
                "the beam is {} m long, and the travel {} m",
                Short(length_mm * 1e-3),
                Short(travel_mm * 1e-3)
            ),
            "check source_mm and end_mm: they are in millimetres",
        );
    }
}

fn check_detector(judge: &mut Judge<'_>, config: &MachineConfig, detector: &BeamDetectorConfig) {
    check_intensity(judge, detector);
    check_range(judge, detector);
    let period_s = config.sample_period_s(&detector.analog);
    check_age(judge, period_s, detector.age_max_ms);
    check_stuck(judge, period_s, detector.stuck_samples);
}

fn check_intensity(judge: &mut Judge<'_>, detector: &BeamDetectorConfig) {
    let (low, high) = (detector.intensity_min_v, detector.intensity_max_v);
    let brightest_v = brightest_v(detector);
    if high > INTENSITIES * low {
        judge.say(
            "intensity_min_v",
            format!(
                "{} to {} V are a factor of {:.0}: a beam that is nearly dark is believed",
                Short(low),
                Short(high),
                high / low
            ),
            "give half of the sum that the beam gives, in volts",
        );
    } else if high > brightest_v {
        judge.say(
            "intensity_max_v",
            format!(
                "four channels below saturation_v give {} V at most: {} V are never exceeded, and other light is not noticed",
                Short(brightest_v),
                Short(high)
            ),
            "give somewhat more than the sum that the beam gives, in volts",
        );
    }
}

fn check_range(judge: &mut Judge<'_>, detector: &BeamDetectorConfig) {
    let (Some(per_one), Some(ratio_max)) = (detector.um_per_one, detector.ratio_max) else {
        return;
    };
    if ratio_max > RATIO_MAX {
        judge.say(
            "ratio_max",
            format!(
                "a difference of channels by their sum is 1 at most, and never {}",
                Short(ratio_max)
            ),
            "give the ratio up to which um_per_one holds, such as 0.3",
        );
        return;
    }
    let range_um = per_one
        .iter()
        .map(|it| it.abs())
        .fold(f64::INFINITY, f64::min)
        * 2.0
        * ratio_max;
    if detector.noise_max_um > range_um {
        judge.say(
            "noise_max_um",
            format!(
                "two samples may be {} µm apart, and the detector sees places within {} µm: any are believed",
                Short(detector.noise_max_um),
                Short((range_um * 1e3).round() * 1e-3)
            ),
            "check it: it is in micrometres",
        );
    }
}

fn check_roll(judge: &mut Judge<'_>, config: &MachineConfig, roll: &RollConfig) {
    let (most, noise) = (roll.roll_max_arcsec, roll.noise_max_arcsec);
    if noise > 2.0 * most {
        judge.say(
            "noise_max_arcsec",
            format!(
                "two samples may be {}″ apart, and rolls are believed up to {}″ either way: any are",
                Short(noise),
                Short(most)
            ),
            "check both: they are in seconds of arc",
        );
    }
    if let Some(uncertain) = roll.standard_uncertainty_arcsec.filter(|it| *it > most) {
        judge.say(
            "standard_uncertainty_arcsec",
            format!(
                "a roll is uncertain by {}″, and none larger than {}″ is believed (roll_max_arcsec)",
                Short(uncertain),
                Short(most)
            ),
            "check both: they are in seconds of arc",
        );
    }
    let period_s = config.sample_period_s(&roll.analog);
    check_age(judge, period_s, roll.age_max_ms);
    check_stuck(judge, period_s, roll.stuck_samples);
}

fn check_temperature(judge: &mut Judge<'_>, own: &TemperatureConfig) {
    let range_k = own.high_c - own.low_c;
    for (key, what, value_k) in [
        (
            "noise_max_k",
            "two samples may be apart by",
            own.noise_max_k,
        ),
        (
            "standard_uncertainty_k",
            "a change is uncertain by",
            own.standard_uncertainty_k,
        ),
    ] {
        if value_k > range_k {
            judge.say(
                key,
                format!(
                    "{what} {} K, and temperatures are believed from {} to {} °C",
                    Short(value_k),
                    Short(own.low_c),
                    Short(own.high_c)
                ),
                "check it: it is in kelvin",
            );
        }
    }
}

fn check_age(judge: &mut Judge<'_>, period_s: f64, age_max_ms: f64) {
    let age_s = age_max_ms * 1e-3;
    if age_s > AGE_MAX_S.max(PERIODS * period_s) {
        judge.say(
            "age_max_ms",
            format!(
                "a sample of {} ago is believed, and one comes every {}",
                span(age_s),
                span(period_s)
            ),
            "give some periods, in milliseconds",
        );
    }
}

fn check_stuck(judge: &mut Judge<'_>, period_s: f64, samples: Option<NonZeroU32>) {
    let Some(samples) = samples else {
        return;
    };
    let stuck_s = f64::from(samples.get()) * period_s;
    if stuck_s > STUCK_MAX_S {
        judge.say(
            "stuck_samples",
            format!(
                "{samples} samples, one every {}, are {}: so long nobody notices that it is stuck",
                span(period_s),
                span(stuck_s)
            ),
            "give what its noise asks for, 100 to 1000",
        );
    }
}

#[cfg(test)]
mod tests {
    use crate::config::warnings::told::check;

    const VOLUMETRIC: &str = include_str!("../../../../configs/machines/volumetric.toml");

    #[track_caller]
    fn told(from: &str, to: &str, key: &str, says: &str) {
        let key = format!("volumetric.{key}");
        check(VOLUMETRIC, &[(from, to)], &[&key], says);
    }

    #[test]
    fn beams_that_end_within_the_travel_or_far_from_it_are_told() {
        let says =
            "the end detector stands at 400 mm, within the travel of the slide from -3 to 503 mm";
        told("end_mm = 600.0", "end_mm = 400.0", "beam.x.end_mm", says);
        let says = "the beam is 600.1 m long, and the travel 0.506 m";
        told("end_mm = 600.0", "end_mm = 600000.0", "beam.x.end_mm", says);
        let key = "beam.x.standard_uncertainty_um";
        let says = "a displacement is uncertain by 100 µm, and the machine is to be within 3 µm";
        told("uncertainty_um = 0.1", "uncertainty_um = 100.0", key, says);
    }

    #[test]
    fn light_and_noise_of_which_any_is_believed_are_told() {
        let key = "beam.x.slider.intensity_min_v";
        let says = "0.005 to 11 V are a factor of 2200";
        told("min_v = 5.0", "min_v = 0.005", key, says);
        let key = "beam.x.slider.intensity_max_v";
        told(
            "max_v = 11.0",
            "max_v = 110.0",
            key,
            "12.8 V at most: 110 V are never exceeded",
        );
        let key = "beam.x.slider.ratio_max";
        told(
            "ratio_max = 0.3",
            "ratio_max = 30.0",
            key,
            "1 at most, and never 30",
        );
        let key = "beam.x.slider.noise_max_um";
        let says = "3000 µm apart, and the detector sees places within 375.996 µm";
        told("noise_max_um = 3.0", "noise_max_um = 3000.0", key, says);
        let key = "roll.noise_max_arcsec";
        told(
            "max_arcsec = 1.0",
            "max_arcsec = 1000.0",
            key,
            "1000″ apart",
        );
        let key = "roll.standard_uncertainty_arcsec";
        told(
            "uncertainty_arcsec = 0.03",
            "uncertainty_arcsec = 300.0",
            key,
            "uncertain by 300″",
        );
        let key = "temperature.0.noise_max_k";
        told(
            "noise_max_k = 0.2",
            "noise_max_k = 200.0",
            key,
            "apart by 200 K",
        );
    }

    #[test]
    fn samples_that_are_believed_for_long_are_told() {
        let key = "beam.x.slider.age_max_ms";
        let says = "a sample of 100s ago is believed, and one comes every 20ms";
        told("age_max_ms = 100.0", "age_max_ms = 100000.0", key, says);
        let key = "beam.x.slider.stuck_samples";
        let says = "1000000 samples, one every 20ms, are 20000s";
        told(
            "stuck_samples = 100\n",
            "stuck_samples = 1000000\n",
            key,
            says,
        );
    }
}
