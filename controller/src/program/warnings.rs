//! What is doubtful of a configuration that is sound.

use machine::Stage;
use units::Metres;

use crate::config::MachineConfig;
use crate::hardware::instrument::SwitchedOff;
use crate::linear::verify::plan_of;

/// What an operator should be told before a calibration is made with `config`.
pub(crate) fn of(config: &MachineConfig) -> Vec<String> {
    let axes = config.axis.iter().filter_map(|(name, axis)| {
        let own = axis.calibrate.as_ref()?;
        let plan = plan_of(axis, Stage::Calibrate)?;
        let length = *plan.targets.last()? - *plan.targets.first()?;
        let off = config.instrument.get(&own.instrument)?.switched_off();
        Some(of_axis(name, (&own.instrument, length), off))
    });
    axes.flatten().chain(of_volume(config)).collect()
}

fn of_axis(axis: &str, (instrument, length): (&str, Metres), off: Vec<SwitchedOff>) -> Vec<String> {
    let told = off.into_iter().map(|it| {
        format!(
            "axis {axis}: `{} = false` of instrument {instrument}: its readings are NOT CORRECTED for {}, {}; \
             calibrations say so, and count it as uncertainty",
            it.key,
            it.name,
            it.told(length)
        )
    });
    told.collect()
}

/// Three axes are measured as warm as they are, and thermometers do the rest.
fn of_volume(config: &MachineConfig) -> Vec<String> {
    let Some(volume) = &config.volumetric else {
        return Vec::new();
    };
    let Some(own) = &volume.calibrate else {
        return Vec::new();
    };
    let lengths = volume.high_mm.iter().zip(&volume.low_mm);
    let longest = lengths.map(|(high, low)| high - low).fold(0.0, f64::max);
    let instrument = config.instrument.get(&own.instrument);
    let mut off = instrument.map_or_else(Vec::new, |it| it.switched_off());
    off.retain(|it| it.key != "correct_material");
    of_axis("x, y, z", (&own.instrument, Metres::from_mm(longest)), off)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Edit;
    use crate::config::parse;

    const LINEAR: &str = include_str!("../../../configs/machines/linear.toml");
    const VOLUMETRIC: &str = include_str!("../../../configs/machines/volumetric.toml");

    #[track_caller]
    fn check(text: &str, expected: &[&str]) {
        let told = of(&parse(text, "m").unwrap().config);
        assert_eq!(told.len(), expected.len(), "{told:?}");
        for (told, expected) in told.iter().zip(expected) {
            assert!(told.starts_with(expected), "{told}");
        }
    }

    #[test]
    fn a_correction_that_is_missing_is_told_with_what_it_comes_to() {
        check(LINEAR, &[]);
        check(VOLUMETRIC, &[]);
        let off = "correct_dead_path = false";
        let linear = LINEAR
            .edit("correct_air = true", "correct_air = false")
            .edit("correct_dead_path = true", off);
        check(
            &linear,
            &[
                "axis x: `correct_air = false` of instrument laser: its readings are NOT CORRECTED for air, wrong \
                 by 16.284 µm over 60 mm; ",
                "axis x: `correct_dead_path = false` of instrument laser: its readings are NOT CORRECTED for dead \
                 path, they drift by 0.095 µm for each kelvin of the air; ",
            ],
        );
        let volumetric = VOLUMETRIC.edit("correct_dead_path = true", off);
        check(
            &volumetric,
            &["axis x, y, z: `correct_dead_path = false` of"],
        );
    }
}
