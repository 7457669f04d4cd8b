//! Alignment platforms on three screws, seen by a camera.

use crate::axis::{Build, Moves};
use crate::bus;
use crate::draft::{Draft, Draw};

/// A short screw of a platform; a linear motor or a piezo's screw is no slower.
const ACTUATOR: Build = Build {
    travel_mm: (1.0, 60.0),
    speed_mm_per_s: (0.1, 100.0),
    acceleration_mm_per_s2: (5.0, 3000.0),
    resolution_nm: (5.0, 500.0),
    noise_um: (0.02, 2.0),
    error_ppm: (50.0, 1000.0),
};

/// What of a platform follows from how large it is.
struct Shape {
    radius_mm: f64,
    /// Along x and y, from the middle.
    way_mm: f64,
    turn_deg: f64,
    /// What its screws go, from the middle.
    stroke_mm: f64,
}

impl Shape {
    fn drawn(draw: &mut Draw) -> Self {
        let radius_mm = draw.size((40.0, 500.0));
        let way_mm = draw.size((0.2, 15.0)).min(0.1 * radius_mm);
        let turn = way_mm / radius_mm * draw.even(0.3, 1.0);
        // In a corner: the way, the turn of its point, and what both do together.
        let stroke_mm = way_mm + radius_mm * turn + (2.0 * way_mm + radius_mm * turn) * turn;
        Self {
            radius_mm,
            way_mm,
            turn_deg: turn.to_degrees(),
            stroke_mm: stroke_mm * 1.05,
        }
    }

    fn write(&self, draft: &mut Draft) {
        let far = self.radius_mm;
        for (from, to) in [
            ([-80.0, 80.0], [-far, far]),
            ([-80.0, -80.0], [-far, -far]),
            ([0.0, -80.0], [0.0, -far]),
        ] {
            draft.exchange(
                &format!("point_mm = {from:?}"),
                &format!("point_mm = {to:?}"),
            );
        }
        draft.set("platform", "x_max_mm", self.way_mm);
        draft.set("platform", "y_max_mm", self.way_mm);
        draft.set("platform", "theta_max_deg", self.turn_deg);
        draft.set("platform", "edge_mm", far);
    }
}

pub fn platform(text: &str, draw: &mut Draw) -> String {
    let draft = &mut Draft::of(text);
    let shape = Shape::drawn(draw);
    shape.write(draft);
    let overrun_mm = shape.stroke_mm * draw.size((0.01, 0.1));
    let travel_mm = 2.0 * (shape.stroke_mm + overrun_mm) * draw.even(1.02, 1.5);
    let moves = Moves::of_travel(&ACTUATOR, travel_mm, draw);
    for screw in ["u", "v", "w"] {
        moves.write(draft, screw, draw);
        draft.set_if_there(
            &format!("axis.{screw}"),
            "poll_period_ms",
            draw.even(5.0, 100.0),
        );
    }
    if text.contains("[can.can0]") {
        bus::write(draft, &[2.0, 4.0, 5.0, 10.0, 20.0], draw);
    }
    bus::write_rate(draft, "vision", draw);
    let lead_mm = write_screws(draft, &moves, draw);
    write_run(draft, (&shape, lead_mm), overrun_mm, draw);
    write_limits(draft, &moves, shape.radius_mm, overrun_mm, draw);
    draft.text()
}

/// From a fine thread to a screw that is long for a turn; its switch lies beyond the soft limit.
fn write_screws(draft: &mut Draft, moves: &Moves, draw: &mut Draw) -> f64 {
    let screw = "platform.actuator";
    let lead_mm = draw.of(&[0.5, 1.0, 2.0, 4.0, 5.0, 10.0, 20.0, 40.0]);
    let switch_mm = moves.soft_min_mm - moves.travel_mm * draw.size((0.005, 0.1));
    let off_mm = (lead_mm * draw.even(0.05, 0.95)).min(moves.travel_mm * 0.3);
    draft.set(screw, "lead_mm", lead_mm);
    draft.set(screw, "index_mm", switch_mm + off_mm);
    let speed = (moves.speed_max_mm_per_s * draw.size((0.1, 1.0))).max(1e-3);
    draft.set("platform.zero", "search_speed_mm_per_s", speed);
    let limit_s = draw.even(5.0, 60.0) + moves.travel_mm / speed * draw.size((1.5, 10.0));
    draft.set("platform.zero", "time_limit_s", limit_s);
    draft.set("platform", "speed_mm_per_s", moves.speed_mm_per_s);
    let acceleration = moves.acceleration_mm_per_s2;
    draft.set("platform", "acceleration_mm_per_s2", acceleration);
    lead_mm
}

fn write_run(draft: &mut Draft, (shape, lead_mm): (&Shape, f64), overrun_mm: f64, draw: &mut Draw) {
    let run = "platform.calibrate";
    let step_mm = 2.0 * shape.stroke_mm / f64::from(draw.whole(10, 80));
    // Whoever measures a fine thread in long steps takes care that they come to all places of its turn.
    let step_mm = match step_mm > lead_mm / 2.0 {
        true => lead_mm * ((step_mm / lead_mm).floor() + 0.38),
        false => step_mm,
    };
    draft.set(run, "first_mm", -shape.stroke_mm);
    draft.set(run, "last_mm", shape.stroke_mm);
    draft.set(run, "step_mm", step_mm);
    draft.set(run, "overrun_mm", overrun_mm);
    draft.set(run, "runs", draw.whole(1, 6));
    draft.set(run, "harmonics_max", draw.whole(0, 4));
    draft.set("platform", "exposures", draw.whole(1, 16));
    draft.set("platform", "settle_ms", draw.size((5.0, 5000.0)) as u32);
}

fn write_limits(draft: &mut Draft, moves: &Moves, edge_mm: f64, overrun_mm: f64, draw: &mut Draw) {
    let tolerance_um = (4.0 * moves.noise_um).max(2.0 * moves.window_um) * draw.size((1.0, 10.0));
    draft.set("platform.verify", "tolerance_um", tolerance_um);
    draft.set("platform.verify", "poses", draw.whole(5, 200));
    let aligned_um = tolerance_um * draw.even(0.2, 1.0);
    draft.set("platform.align", "tolerance_um", aligned_um);
    let closure_um = tolerance_um * draw.size((0.1, 1.0));
    draft.set("platform.calibrate", "closure_limit_um", closure_um);
    let limits = "platform.compensation";
    // More than its errors before, and more than the platform is to reach.
    let size_um = moves.error_um.max(tolerance_um) * draw.size((1.1, 10.0));
    draft.set(limits, "size_limit_um", size_um);
    let lost_um = (overrun_mm * 1e3 * draw.size((0.05, 0.9))).clamp(1e-3, 20.0);
    draft.set(limits, "lost_motion_max_um", lost_um);
    // What sees the pose sees it better than it is to be.
    let camera = "camera.eye";
    let seen_um = tolerance_um * draw.size((0.02, 0.4));
    draft.set(camera, "standard_uncertainty_um", seen_um);
    let arcsec = tolerance_um * draw.size((0.02, 0.4)) / (edge_mm * 1e3) * 206_265.0;
    draft.set(camera, "standard_uncertainty_arcsec", arcsec);
    draft.set(camera, "score_min_percent", draw.even(20.0, 95.0));
    draft.set(
        camera,
        "inspection_timeout_ms",
        draw.size((200.0, 10_000.0)),
    );
}
