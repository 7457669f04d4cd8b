//! What is doubtful of three axes that are sound.

use units::Metres;

use crate::config::MachineConfig;
use crate::config::judge::Finding;

pub(crate) fn warnings(config: &MachineConfig, found: &mut Vec<Finding>) {
    let Some(volume) = &config.volumetric else {
        return;
    };
    let Some(own) = &volume.calibrate else {
        return;
    };
    let lengths = volume.high_mm.iter().zip(&volume.low_mm);
    let longest = lengths.map(|(high, low)| high - low).fold(0.0, f64::max);
    let length = Metres::from_mm(longest);
    let instrument = config.instrument.get(&own.instrument);
    let off = instrument
        .into_iter()
        .flat_map(|it| it.switched_off_of_lines());
    found.extend(off.map(|it| it.warned(&own.instrument, "x, y and z", length)));
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
}
