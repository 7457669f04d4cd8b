//! Deviations and uncertainties in columns: what people and other programs read, and `cal import` reads back.

use compensator::error_table::ErrorTable;
use compensator::rotary::PeriodicTable;

/// The columns of a linear axis, to the last bit.
pub(super) fn linear(table: &ErrorTable) -> String {
    table.to_csv()
}

/// The columns of a rotary axis: a row for each line of the plate.
pub(super) fn rotary(table: &PeriodicTable) -> String {
    let u = table.uncertainties();
    let mut text = match u {
        Some(_) => "angle_deg,deviation_arcsec,u_arcsec\n".to_owned(),
        None => "angle_deg,deviation_arcsec\n".to_owned(),
    };
    let lines = table.deviations().len();
    for (line, deviation) in table.deviations().iter().enumerate() {
        let angle = 360.0 * line as f64 / lines as f64;
        text += &format!("{angle},{}", deviation.arcsec());
        if let Some(u) = u {
            text += &format!(",{}", u[line].arcsec());
        }
        text += "\n";
    }
    text
}
