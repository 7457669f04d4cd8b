//! The budgets that calibrations keep place by place, computed again: by GTC from their contributions, and by GTC
//! from the readings, for which `budget_of_places.py` does its own least squares.

use compensator::rotary::{
    PeriodicInterpolation, Placement, RotarySeries, Solution, SolveOptions, solve,
};
use compensator::screw::{self, FitOptions, Stroke};
use core::f64::consts::TAU;
use serde_json::{Value, json};
use tests::normal;
use truestage::platform::ScrewContent;
use truestage::rotary::RotaryContent;
use units::{Approach, Metres, Radians};

use super::assert_close;
use crate::peer::Peer;

/// Whether GTC comes to the places of the budget in `content` by its contributions; what it says of `task` by itself.
#[track_caller]
fn check_record(content: &Value, mut task: Value) -> Value {
    task["budget"] = content["budget"].clone();
    let mut peer = Peer::start("budget_of_places.py", &[]);
    peer.feed(&task.to_string());
    let report = peer.finish();
    let places = content["budget"]["places"].as_array().expect("it has one");
    for (at, place) in places.iter().enumerate() {
        let theirs = &report["record"][at];
        for (key, number) in [("u_si", 0), ("expanded_u_si", 1)] {
            let ours = place[key].as_f64().expect("a number");
            assert_close(key, ours, &theirs[number], ours);
        }
        check_freedom(&place["degrees_of_freedom"], &theirs[2]);
    }
    report["again"].clone()
}

#[track_caller]
fn check_freedom(ours: &Value, theirs: &Value) {
    match ours.as_f64() {
        Some(ours) => assert_close("degrees of freedom", ours, theirs, ours),
        None => assert_eq!(*theirs, Value::Null),
    }
}

const LINES: usize = 18;
const OFFSETS: [usize; 3] = [0, 1, 5];
/// A reading that was not made: placement and line.
const MISSING: (usize, usize) = (1, 7);

fn table() -> Solution {
    let state = &mut 7;
    let error = |at: usize| 2e-5 * (TAU * (at % LINES) as f64 / LINES as f64).sin();
    let placements = (0..).zip(OFFSETS).map(|(placement, offset)| Placement {
        offset,
        readings: (0..LINES)
            .map(|line| Radians(error(line + offset) + 1e-7 * normal(state)))
            .enumerate()
            .map(|(line, it)| ((placement, line) != MISSING).then_some(it))
            .collect(),
    });
    let series = RotarySeries::new(LINES, placements.collect()).expect("it is whole");
    solve(&series, &SolveOptions::default()).expect("three placements tell it")
}

#[test]
fn gtc_comes_to_the_budget_of_a_rotary_table_from_its_record_and_from_its_readings() {
    let solution = table();
    let content = RotaryContent::new(&solution);
    let content = content.with_budget(&solution, PeriodicInterpolation::Linear);
    let content = json!(content.expect("its figures are finite"));
    let readings = &content["budget"]["contributions"][0];
    let task = json!({
        "of": "table",
        "lines": LINES,
        "offsets": OFFSETS,
        "missing": [MISSING.0 * LINES + MISSING.1],
        "scatter": readings["value"],
        "freedom": readings["degrees_of_freedom"],
    });
    let again = check_record(&content, task);
    for line in 0..LINES {
        let ours = &content["budget"]["places"][2 * line];
        let u = ours["u_si"].as_f64().expect("a number");
        assert_close("u of a line", u, &again[line][0], u);
        check_freedom(&ours["degrees_of_freedom"], &again[line][1]);
    }
}

/// So often each of nine strokes is made from either side.
const REPEATED: usize = 3;

fn strokes() -> Vec<Stroke> {
    let state = &mut 23;
    let mut strokes = Vec::new();
    for at in -4..=4 {
        let stroke = Metres(f64::from(at) * 5e-4);
        let own = 2e-7 * normal(state);
        for (approach, lost_motion) in [(Approach::Forward, 0.0), (Approach::Reverse, 2e-6)] {
            for _ in 0..REPEATED {
                let off = own + lost_motion + 1e-7 * normal(state);
                let deviation = stroke * 1e-3 + Metres(off);
                strokes.push(Stroke {
                    approach,
                    stroke,
                    deviation,
                });
            }
        }
    }
    strokes
}

#[test]
fn gtc_comes_to_the_budget_of_a_screw_from_its_record_and_from_its_strokes() {
    let strokes = strokes();
    let fitted = screw::fit(&strokes, &FitOptions::default()).expect("they tell it");
    let rows = u32::try_from(strokes.len()).expect("a few");
    let content = ScrewContent::new(&fitted.model, Default::default(), rows);
    let content = content.with_budget(fitted.parts.as_ref(), &strokes);
    let content = json!(content.expect("its figures are finite"));
    let mut made: Vec<f64> = strokes.iter().map(|it| it.stroke.value()).collect();
    made.dedup();
    let task = json!({"of": "screw", "strokes": made, "repeated": REPEATED});
    let again = check_record(&content, task);
    let places = content["budget"]["places"].as_array().expect("it has them");
    assert_eq!(
        places.len(),
        2 * (2 * made.len() - 1),
        "both sides, and between"
    );
    for (place, theirs) in places.iter().zip(again.as_array().expect("a list")) {
        let u = place["u_si"].as_f64().expect("a number");
        assert_close("u of a stop", u, &theirs[0], u);
        check_freedom(&place["degrees_of_freedom"], &theirs[1]);
    }
}
