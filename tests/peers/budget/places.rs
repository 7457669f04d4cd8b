//! The budgets that calibrations keep place by place, computed again: by GTC from their contributions, and by GTC
//! from the readings, for which `budget_of_places.py` does its own least squares.

use compensator::budget::COVERAGE_FACTOR;
use compensator::rotary::{
    PeriodicInterpolation, Placement, RotarySeries, Solution, SolveOptions, solve,
};
use compensator::screw::{self, FitOptions, Stroke};
use compensator::volumetric::function::Shape;
use compensator::volumetric::identify::{
    FunctionPlan, Observation, Plan, Reading, RunSetup, ThermalPlan, ToolAt,
};
use compensator::volumetric::model::ErrorName;
use compensator::volumetric::{Axis, Point};
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
pub(super) fn check_record(content: &Value, mut task: Value) -> Value {
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
pub(super) fn check_freedom(ours: &Value, theirs: &Value) {
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

/// A reading of x at `mm`, on a tool so far below the slide.
fn reading(run: usize, mm: f64, below_mm: f64, reading: Reading) -> Observation {
    Observation {
        at: Point::from_mm(mm, 0.0, 0.0),
        tool: Point::from_mm(0.0, 0.0, -below_mm),
        run,
        reading,
        common: 0.0,
        common_of_run: 0.0,
    }
}

/// Positioning and pitch of x, by lengths in two heights and by angles.
fn lines() -> (Plan, Vec<Observation>) {
    let nodes = [0.0, 200.0].map(Metres::from_mm).to_vec();
    let function = |name| FunctionPlan {
        name,
        nodes: nodes.clone(),
    };
    let offset = RunSetup {
        offset: true,
        alignment: None,
    };
    let plan = Plan {
        chain: "FXYZ".parse().expect("it is one"),
        functions: vec![
            function(ErrorName::Along(Axis::X, Axis::X)),
            function(ErrorName::About(Axis::X, Axis::Y)),
        ],
        shape: Shape::Linear,
        squarenesses: Vec::new(),
        runs: vec![offset; 3],
        zero: Point::ZERO,
        thermal: ThermalPlan::default(),
    };
    let length = |um: f64| Reading::Length {
        along: [1.0, 0.0, 0.0],
        deviation: Metres::ZERO,
        u: Metres::from_um(um),
    };
    let angle = Reading::Angle {
        about: Axis::Y,
        deviation: Radians::ZERO,
        u: Radians(1e-6),
    };
    let stops = [0.0, 40.0, 90.0, 150.0, 200.0];
    let observations = stops.iter().flat_map(|mm| {
        [
            reading(0, *mm, 0.0, length(0.1 + 0.001 * mm)),
            reading(1, *mm, 120.0, length(0.2)),
            Observation {
                common_of_run: 4e-9 * mm,
                ..reading(2, *mm, 0.0, angle)
            },
        ]
    });
    (plan, observations.collect())
}

/// `it`, off by so much.
fn off(it: &Observation, by: f64) -> Observation {
    let reading = match it.reading {
        Reading::Length { along, u, .. } => Reading::Length {
            along,
            deviation: Metres(by),
            u,
        },
        Reading::Angle { about, u, .. } => Reading::Angle {
            about,
            deviation: Radians(by),
            u,
        },
    };
    Observation { reading, ..*it }
}

/// The standard uncertainty of a reading without what its run has in common.
fn by_itself(it: &Observation) -> f64 {
    let u = match it.reading {
        Reading::Length { u, .. } => u.value(),
        Reading::Angle { u, .. } => u.value(),
    };
    (u * u - it.common_of_run * it.common_of_run).sqrt()
}

/// How far the tool goes along x and z at a place, by the errors that `observations` tell.
fn moved(plan: &Plan, observations: &[Observation], (at, tool): ToolAt) -> [f64; 2] {
    let found = plan.identify(observations).expect("they tell all of it");
    let axes = found.axis_errors(plan.shape).expect("they are functions");
    let x = at.along(Axis::X);
    let along = axes[0].along[0].as_ref().map_or(0.0, |it| it.at(x).value());
    let pitch = axes[0].about[1].as_ref().map_or(0.0, |it| it.at(x).value());
    let lever = plan.chain.lever(Axis::X, at, tool);
    [
        along + pitch * lever.along(Axis::Z).value(),
        -pitch * lever.along(Axis::X).value(),
    ]
}

/// What each reading that is off by its standard uncertainty moves the tool by, along x and along z, and then what
/// each run does whose readings are all off by what they have in common.
fn pulls(plan: &Plan, observations: &[Observation], place: ToolAt) -> [Vec<f64>; 2] {
    let alone = (0..observations.len()).map(|at| {
        let mut all = observations.to_vec();
        all[at] = off(&all[at], by_itself(&all[at]));
        all
    });
    let together = (0..plan.runs.len()).map(|run| {
        let each = observations.iter().map(|it| match it.run == run {
            true => off(it, it.common_of_run),
            false => *it,
        });
        each.collect()
    });
    let each: Vec<[f64; 2]> = alone
        .chain(together)
        .map(|it: Vec<Observation>| moved(plan, &it, place))
        .collect();
    [0, 1].map(|k| each.iter().map(|it| it[k]).collect())
}

#[test]
fn gtc_comes_to_the_budget_of_three_axes_from_what_each_reading_moves() {
    let (plan, observations) = lines();
    let place = |mm: f64, below: f64| {
        (
            Point::from_mm(mm, 0.0, 0.0),
            Point::from_mm(30.0, 0.0, -below),
        )
    };
    let places = [place(0.0, 0.0), place(70.0, 50.0), place(200.0, 120.0)];
    let source = |at: usize| format!("line {}", observations[at].run);
    let budget = plan.budget(&observations, source, &[], &places);
    let budget = budget.expect("they tell all of it");
    let combined = |at: usize| {
        let it = budget.at(at);
        json!({
            "sensitivities": budget.sensitivities()[at],
            "u_si": it.standard_uncertainty.value(),
            "expanded_u_si": it.expanded().value(),
            "degrees_of_freedom": it.degrees_of_freedom,
        })
    };
    let lines = budget.contributions().iter();
    let lines =
        lines.map(|it| json!({"value": it.value, "degrees_of_freedom": it.degrees_of_freedom}));
    let kept = json!({"budget": {
        "coverage_factor": COVERAGE_FACTOR,
        "contributions": lines.collect::<Vec<_>>(),
        "places": (0..places.len()).map(combined).collect::<Vec<_>>(),
    }});
    let pulls: Vec<_> = places
        .iter()
        .map(|it| pulls(&plan, &observations, *it))
        .collect();
    let again = check_record(&kept, json!({"of": "tool", "pulls": pulls}));
    for at in 0..places.len() {
        let u = budget.at(at).standard_uncertainty.value();
        assert_close("u of the tool", u, &again[at], u);
    }
}
