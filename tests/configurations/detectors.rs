//! Beams, roll detectors and thermometers that watch three axes.

use crate::draft::{Draft, Draw};
use crate::volumetric::Volume;

pub fn write(draft: &mut Draft, volume: &Volume, sync_ms: f64, draw: &mut Draw) {
    let every = draw.of(&[5, 10, 20, 50, 100]);
    let full_scale_v = draw.of(&[3.2, 5.0, 10.0]);
    for name in ["beams_x", "beams_y", "beams_z"] {
        let analog = format!("analog.{name}");
        draft.set(&analog, "every_syncs", every);
        draft.set(&analog, "full_scale_v", [full_scale_v; 8]);
    }
    draft.set("analog.roll_and_heat", "every_syncs", every);
    let period_ms = f64::from(every) * sync_ms;
    for (at, axis) in ["x", "y", "z"].into_iter().enumerate() {
        write_beam(draft, (axis, volume.edges_mm[at]), volume, draw);
        for place in ["slider", "end"] {
            let section = &format!("volumetric.beam.{axis}.{place}");
            write_detector(draft, section, full_scale_v, draw);
            write_times(draft, section, period_ms, draw);
        }
    }
    let roll = "volumetric.roll";
    write_times(draft, roll, period_ms, draw);
    let most = draw.size((20.0, 300.0));
    draft.set(roll, "roll_max_arcsec", most);
    draft.set(roll, "noise_max_arcsec", most * draw.size((0.003, 0.2)));
    let uncertain = most * draw.size((3e-4, 0.05));
    draft.set(roll, "standard_uncertainty_arcsec", uncertain);
    write_temperature(draft, period_ms, draw);
}

/// Source and end stand beyond where the slide comes.
fn write_beam(draft: &mut Draft, (axis, edge): (&str, f64), volume: &Volume, draw: &mut Draw) {
    let section = &format!("volumetric.beam.{axis}");
    let source = -volume.margin_mm - draw.size((10.0, 200.0));
    let end = edge + volume.margin_mm + draw.size((10.0, 200.0));
    draft.set(section, "source_mm", source);
    draft.set(section, "end_mm", end);
    let uncertain = volume.limit_um * draw.size((0.01, 0.3));
    draft.set(section, "standard_uncertainty_um", uncertain);
}

/// Some light on four quadrants, and a spot of a tenth of a millimetre to some.
fn write_detector(draft: &mut Draft, section: &str, saturation_v: f64, draw: &mut Draw) {
    let light_v = 4.0 * saturation_v * draw.even(0.1, 0.75);
    let um_per_one = draw.size((60.0, 3000.0)) * draw.of(&[-1.0, 1.0]);
    draft.set(section, "saturation_v", saturation_v);
    draft.set(section, "intensity_min_v", light_v * draw.even(0.1, 0.7));
    draft.set(section, "intensity_max_v", light_v * draw.even(1.1, 1.3));
    draft.set(section, "um_per_one", [um_per_one; 2]);
    draft.set(section, "ratio_max", draw.even(0.1, 0.6));
    let noise = um_per_one.abs() * draw.size((5e-4, 0.05));
    draft.set(section, "noise_max_um", noise);
}

fn write_times(draft: &mut Draft, section: &str, period_ms: f64, draw: &mut Draw) {
    let age_ms = period_ms * draw.size((2.5, 50.0));
    draft.set(section, "age_max_ms", age_ms);
    draft.set(section, "stuck_samples", draw.size((30.0, 3000.0)) as u32);
}

/// Temperatures change over minutes, so that old ones are good, and some sensors show the same digits for hours.
fn write_temperature(draft: &mut Draft, period_ms: f64, draw: &mut Draw) {
    let section = "volumetric.temperature";
    let age_ms = (period_ms * 2.5).max(draw.size((500.0, 600_000.0)));
    draft.set(section, "age_max_ms", age_ms);
    let stuck = draw.size((100.0, 200_000.0)) as u32;
    draft.set(section, "stuck_samples", stuck);
    draft.set(section, "low_c", draw.even(5.0, 18.0));
    draft.set(section, "high_c", draw.even(22.0, 45.0));
    draft.set(section, "noise_max_k", draw.size((0.01, 1.0)));
    let uncertain = draw.size((0.002, 0.2));
    draft.set(section, "standard_uncertainty_k", uncertain);
}
