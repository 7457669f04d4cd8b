//! What is doubtful of two axes that move one stage.

use units::Short;

use crate::config::MachineConfig;
use crate::config::judge::{Finding, Judge};
use crate::linear::GantryConfig;

/// A length that is uncertain by this share was not measured.
const UNCERTAIN_SHARE: f64 = 0.1;

pub(super) fn check(config: &MachineConfig, found: &mut Vec<Finding>) {
    for (name, gantry) in &config.gantry {
        let judge = &mut Judge::at(format!("gantry.{name}"), found);
        check_distance(judge, gantry);
        check_reference(judge, config, gantry);
    }
}

fn check_distance(judge: &mut Judge<'_>, gantry: &GantryConfig) {
    let (distance, uncertain) = (gantry.distance_mm, gantry.distance_standard_uncertainty_mm);
    if uncertain > UNCERTAIN_SHARE * distance {
        judge.say(
            "distance_standard_uncertainty_mm",
            format!(
                "a distance of {} mm that is uncertain by {} mm says nothing of an angle",
                Short(distance),
                Short(uncertain)
            ),
            "check both: they are in millimetres",
        );
    }
}

/// What the switches miss by must be found by the search.
fn check_reference(judge: &mut Judge<'_>, config: &MachineConfig, gantry: &GantryConfig) {
    let sides = gantry.axes.iter().filter_map(|it| config.axis.get(it));
    let searched = sides.filter_map(|it| Some(it.zero.as_ref()?.search_limit_mm));
    let searched_mm = searched.fold(f64::INFINITY, f64::min);
    let uncertain_mm = gantry.reference_standard_uncertainty_um * 1e-3;
    if uncertain_mm > searched_mm {
        judge.say(
            "reference_standard_uncertainty_um",
            format!(
                "limit switches are uncertain by {} mm, and the zero is sought within {} mm (search_limit_mm)",
                Short(uncertain_mm),
                Short(searched_mm)
            ),
            "check it: it is in micrometres",
        );
    }
}

#[cfg(test)]
mod tests {
    use crate::config::warnings::told::check;

    const GANTRY: &str = include_str!("../../../../configs/machines/gantry.toml");

    #[test]
    fn uncertainties_larger_than_what_they_are_of_are_told() {
        let edit = ("uncertainty_mm = 0.1", "uncertainty_mm = 100.0");
        let key = "gantry.beam.distance_standard_uncertainty_mm";
        let says = "a distance of 400 mm that is uncertain by 100 mm";
        check(GANTRY, &[edit], &[key], says);
        let edit = ("uncertainty_um = 12.0", "uncertainty_um = 9000.0");
        let key = "gantry.beam.reference_standard_uncertainty_um";
        let says = "uncertain by 9 mm, and the zero is sought within 2 mm";
        check(GANTRY, &[edit], &[key], says);
    }
}
