//! The positions of a calibration: at equal steps, or as they are listed.

use units::Metres;

use crate::hardware::CHECKED;
use crate::linear::CalibrateConfig;

/// The positions of a run, increasing, of a configuration that was judged. Equal steps run from start to end, the
/// last of them between half as long and one and a half times as long: a stage arrives otherwise after a move that
/// is much shorter than the others.
pub(crate) fn positions(config: &CalibrateConfig) -> Vec<Metres> {
    match (&config.positions_mm, spaced(config)) {
        (Some(listed), _) => listed.iter().map(|it| Metres::from_mm(*it)).collect(),
        (None, Some(spaced)) => by_steps(spaced),
        (None, None) => panic!("{CHECKED}"),
    }
}

/// Start, end and step, millimetres, where all three are given.
pub(crate) fn spaced(config: &CalibrateConfig) -> Option<[f64; 3]> {
    Some([config.start_mm?, config.end_mm?, config.step_mm?])
}

fn by_steps([start, end, step]: [f64; 3]) -> Vec<Metres> {
    let steps = ((end - start) / step + 0.5 + 1e-9).floor();
    let at = |number: u32| Metres::from_mm(start + f64::from(number) * step);
    // At least both ends; the last one to the digit that the file has.
    let before_the_end = (0..(steps as u32).max(1)).map(at);
    before_the_end.chain([Metres::from_mm(end)]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn config(which: &str) -> CalibrateConfig {
        let text = format!(
            "instrument = \"laser\"\n{which}\noverrun_mm = 0.5\nruns = 2\nsettle_ms = 1\naverage_samples = 1\n\
             scale_limit_ppm = 1.0\nclosure_limit_um = 1.0\n"
        );
        toml::from_str(&text).unwrap()
    }

    #[track_caller]
    fn check(which: &str, expected_mm: &[f64]) {
        let seen: Vec<f64> = positions(&config(which)).iter().map(|it| it.mm()).collect();
        let mut pairs = seen.iter().zip(expected_mm);
        let near = pairs.all(|(a, b)| (a - b).abs() < 1e-9);
        assert!(near && seen.len() == expected_mm.len(), "{seen:?}");
    }

    #[track_caller]
    fn check_steps(end_mm: f64, step_mm: f64, expected_mm: &[f64]) {
        let which = format!("start_mm = 1.0\nend_mm = {end_mm}\nstep_mm = {step_mm}");
        check(&which, expected_mm);
    }

    #[test]
    fn no_step_is_much_shorter_than_the_others() {
        check_steps(7.0, 3.0, &[1.0, 4.0, 7.0]);
        check_steps(7.2, 3.0, &[1.0, 4.0, 7.2]);
        check_steps(9.0, 3.0, &[1.0, 4.0, 7.0, 9.0]);
        check_steps(8.4, 3.0, &[1.0, 4.0, 8.4]);
        check_steps(2.0, 3.0, &[1.0, 2.0]);
        check_steps(1.3, 0.1, &[1.0, 1.1, 1.2, 1.3]);
    }

    #[test]
    fn listed_positions_are_taken_as_they_are() {
        check(
            "positions_mm = [-1, 0.5, 0.75, 20]",
            &[-1.0, 0.5, 0.75, 20.0],
        );
    }
}
