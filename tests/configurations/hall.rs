//! The Hall search for the zero of an axis.

use crate::axis::{Moves, write_watch};
use crate::draft::{Draft, Draw};

/// A search that is longer than this is none for a magnet.
const SEARCH_MAX_MM: f64 = 10.0;
/// The least that the configuration takes.
const SEARCH_MIN_MM: f64 = 0.01;
/// Of the way that a stage has behind its limit switch: a homing drive stops within it.
const BEHIND_SWITCH_MM: f64 = 2.0;

/// Gives `axis`, behind the module `analog`, a zero; SYNC comes every `sync_ms`.
pub fn write(
    draft: &mut Draft,
    (axis, analog): (&str, &str),
    moves: &Moves,
    (sync_ms, search_max_mm): (f64, f64),
    draw: &mut Draw,
) {
    let section = &format!("axis.{axis}.zero");
    write_volts(draft, section, analog, draw);
    write_switch(draft, section, moves, draw);
    let farthest = moves.soft_max_mm().max(-moves.soft_min_mm);
    let search = (farthest * draw.size((0.02, 0.3))).min(search_max_mm.min(SEARCH_MAX_MM));
    let search = search.max(SEARCH_MIN_MM);
    // A magnet is passed in some seconds, and at no more than an axis does.
    let speed = (search * draw.size((0.05, 1.0))).clamp(1e-3, moves.speed_max_mm_per_s);
    let samples = draw.whole(3, 100);
    let needed_s = 2.0 * search / speed + 3.0 * f64::from(samples) * sync_ms * 1e-3;
    let uncertain_um = (moves.noise_um * draw.size((1.0, 5.0))).min(search * 30.0);
    draft.set(section, "search_limit_mm", search);
    draft.set(section, "search_speed_mm_per_s", speed);
    draft.set(section, "samples", samples);
    let limit_s = draw.even(5.0, 60.0) + needed_s * draw.size((1.2, 8.0));
    draft.set(section, "time_limit_s", limit_s);
    draft.set(section, "standard_uncertainty_limit_um", uncertain_um);
}

/// Sensors of some volts or a volt only, on a converter for them or for ten volts.
fn write_volts(draft: &mut Draft, section: &str, analog: &str, draw: &mut Draw) {
    let full_scale = draw.of(&[1.0, 2.5, 5.0, 10.0]);
    let high = full_scale * draw.of(&[0.3, 0.5, 0.9, 0.98]);
    let low = draw.of(&[-high, 0.02 * high]);
    draft.set(&format!("analog.{analog}"), "full_scale_v", [full_scale; 2]);
    write_watch(draft, &format!("analog.{analog}"), draw);
    let peak = (high - low) * draw.even(0.3, 0.9);
    for (key, volts) in [
        ("rail_low_v", low),
        ("rail_high_v", high),
        ("level_below_peak_v", 0.2 * peak),
        ("turn_below_peak_v", 0.06 * peak),
        ("delta1_mv", 4.0 * peak),
        ("delta2_mv", 1.0 * peak),
        ("delta3_mv", 1.0 * peak),
        ("delta4_mv", 20.0 * peak),
        ("noise_mv", peak * draw.size((0.01, 0.3))),
    ] {
        draft.set(section, key, volts);
    }
}

/// A quick stop ends before the limit switch, and a homing drive soon behind it.
fn write_switch(draft: &mut Draft, section: &str, moves: &Moves, draw: &mut Draw) {
    let stops_mm = moves.speed_mm_per_s.powi(2) / (2.0 * moves.quick_stop_mm_per_s2);
    let room = (moves.travel_mm * draw.size((0.005, 0.1))).max(stops_mm * draw.even(1.05, 2.0));
    let slow = (0.2 * moves.quick_stop_mm_per_s2 * BEHIND_SWITCH_MM).sqrt();
    let speed = slow.min(moves.speed_mm_per_s) * draw.size((0.1, 1.0));
    draft.set(section, "negative_limit_mm", moves.soft_min_mm - room);
    draft.set(section, "reference_speed_mm_per_s", speed.max(1e-3));
}
