//! What is doubtful of three axes that are sound.

mod detectors;
mod volume;

use compensator::volumetric::Axis;
use units::{Metres, Short};

use super::config::{VolumetricCalibrateConfig, VolumetricConfig};
use crate::config::MachineConfig;
use crate::config::judge::{Finding, Judge};

/// Fewer nodes of a function say hardly anything of what it does between them (docs/reliability.md).
const NODES_MIN: u32 = 6;

pub(crate) fn warnings(config: &MachineConfig, found: &mut Vec<Finding>) {
    let Some(volume) = &config.volumetric else {
        return;
    };
    volume::check(found, config, volume);
    detectors::check(found, config, volume);
    let Some(own) = &volume.calibrate else {
        return;
    };
    check_nodes(
        &mut Judge::at("volumetric.calibrate".into(), found),
        volume,
        own,
    );
    let lengths = volume.high_mm.iter().zip(&volume.low_mm);
    let longest = lengths.map(|(high, low)| high - low).fold(0.0, f64::max);
    let length = Metres::from_mm(longest);
    let instrument = config.instrument.get(&own.instrument);
    let off = instrument
        .into_iter()
        .flat_map(|it| it.switched_off_of_lines());
    found.extend(off.map(|it| it.warned(&own.instrument, "x, y and z", length)));
}

fn check_nodes(judge: &mut Judge<'_>, volume: &VolumetricConfig, own: &VolumetricCalibrateConfig) {
    let of_axis = |axis: Axis| (axis, volume.stretches(axis, own.step_mm) + 1);
    let few = Axis::ALL.map(of_axis).into_iter();
    let few: Vec<(Axis, u32)> = few.filter(|it| it.1 < NODES_MIN).collect();
    let length = |at: &(Axis, u32)| volume.high_mm[at.0.index()] - volume.low_mm[at.0.index()];
    let shortest = few.iter().map(length).fold(f64::INFINITY, f64::min);
    let Some(told) = few
        .iter()
        .map(|(axis, nodes)| format!("{nodes} of {axis}"))
        .reduce(|all, it| all + ", " + &it)
    else {
        return;
    };
    judge.say(
        "step_mm",
        format!(
            "the errors are told at {told} places only: what they do between them hardly shows there, and the tool is \
             less certain than is stated"
        ),
        format!(
            "give at most {} for {NODES_MIN} places of each",
            Short(shortest / f64::from(NODES_MIN - 1))
        ),
    );
}

#[cfg(test)]
mod tests {
    use crate::config::warnings::told::check;

    const VOLUMETRIC: &str = include_str!("../../../configs/machines/volumetric.toml");

    #[test]
    fn a_correction_that_is_missing_is_told_with_what_it_comes_to() {
        let edits = [
            ("correct_air = true", "correct_air = false"),
            ("correct_dead_path = true", "correct_dead_path = false"),
        ];
        let key = |name: &str| format!("instrument.laser.{name}");
        let (air, path) = (key("correct_air"), key("correct_dead_path"));
        check(
            VOLUMETRIC,
            &edits[1..],
            &[path.as_str()],
            "drift by 0.048 µm",
        );
        check(VOLUMETRIC, &edits, &[air.as_str()], "NOT CORRECTED for air");
    }

    #[test]
    fn functions_of_few_nodes_are_told_with_the_step_that_would_do() {
        let own = "[volumetric.calibrate]\ninstrument = \"laser\"\nstep_mm = ";
        let from = format!("{own}50.0");
        let key = "volumetric.calibrate.step_mm";
        let says = "at 5 of y, 4 of z places only";
        check(VOLUMETRIC, &[(&from, &format!("{own}100.0"))], &[key], says);
        check(
            VOLUMETRIC,
            &[(&from, &format!("{own}80.0"))],
            &[key],
            "at 5 of z places",
        );
        let edit = format!("{own}60.0");
        let none: [&str; 0] = [];
        check(VOLUMETRIC, &[(&from, &edit)], &none, "");
    }
}
