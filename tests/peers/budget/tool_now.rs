//! The budget of what three axes state of their tool while they work, computed again: by GTC from its contributions, and
//! by GTC from the covariance of the errors and from what each input that is off moves the tool by.

use compensator::budget::COVERAGE_FACTOR;
use compensator::error_table::Limits;
use compensator::volumetric::function::{Function, Shape};
use compensator::volumetric::model::{
    Coefficient, CoefficientCovariance, Conditions, ErrorCovariance, Machine, Seen, Squareness,
    Thermal, ThermalBend, ThermalChannel, VolumetricModel,
};
use compensator::volumetric::online::MovingState;
use compensator::volumetric::{Axis, Point, Volume};
use serde_json::json;
use tests::random;
use units::{Celsius, Metres, MetresPerSecond, Radians};

use super::assert_close;
use super::places::check_record;

/// A tool that is off moves the rest by second order, which no budget counts.
const SECOND_ORDER: f64 = 100.0;
const U_DISPLACEMENT: Metres = Metres(0.13e-6);
const U_ROLL: Radians = Radians(0.2e-6);
const U_KELVIN: [f64; 2] = [0.02, 0.05];
/// Colder than it was calibrated: what an expansion is unsure by then is below zero.
const COLD: [Celsius; 2] = [Celsius(18.5), Celsius(17.0)];

/// A guide that bends, and a scale that grows by two thermometers.
fn machine(between: f64) -> Machine {
    let channel = |expansion: f64| ThermalChannel {
        reference: Celsius(20.0),
        low: Celsius(15.0),
        high: Celsius(30.0),
        expansion: [expansion, 0.0, 0.0],
        u_expansion: [0.3e-6, 0.0, 0.0],
        growth: Point::new(Metres::ZERO, Metres::ZERO, Metres(2e-6)),
        squareness: [Radians(1e-6), Radians::ZERO, Radians::ZERO],
        u: 0.5,
    };
    let bend = ThermalBend {
        axis: Axis::X,
        towards: Axis::Z,
        over: 0,
        under: Some(1),
        bow: Metres(4e-6),
        u: Metres(0.2e-6),
        low: Metres(0.0),
        high: Metres(0.5),
        gradient_max: 4.0,
        is_watched: true,
    };
    let nodes = [-0.1, 0.2, 0.6].map(Metres);
    let along = Function::new(&nodes, &[Metres(1e-6); 3], Shape::Linear);
    let along = along.and_then(|it| it.with_between(&[Metres(between); 2]));
    let mut axes: [compensator::volumetric::model::AxisErrors; 3] = Default::default();
    axes[1].along[2] = Some(along.expect("three nodes"));
    Machine {
        chain: "FXYZ".parse().expect("it is one"),
        volume: Volume::new(Point::ZERO, Point::from_mm(500.0, 400.0, 300.0)).expect("it is one"),
        axes,
        squareness: Squareness::default(),
        thermal: Thermal {
            channels: vec![channel(6e-6), channel(4e-6)],
            bends: vec![bend],
            fixed: Point::from_mm(50.0, 0.0, 0.0),
        },
        tool_max: Metres(0.3),
        displacement_max: Metres(50e-6),
        roll_max: Radians(1e-3),
    }
}

fn model(machine: Machine) -> VolumetricModel {
    let (size, rate) = (Metres::from_um(500.0), MetresPerSecond(0.1));
    let slope = 0.1;
    VolumetricModel::new(machine, Limits { size, slope, rate }).expect("it can be compensated")
}

/// Six errors, then an expansion and a bend in units of their standard uncertainties.
const TOGETHER: usize = 8;

/// Of errors and coefficients that depend on each other: A·Aᵀ of a drawn A.
fn covariance() -> [[f64; TOGETHER]; TOGETHER] {
    let state = &mut 5;
    let sizes = [2e-7, 2e-7, 2e-7, 5e-7, 5e-7, 5e-7, 1.0, 1.0];
    let drawn = sizes.map(|size| [(); TOGETHER].map(|()| size * (2.0 * random(state) - 1.0)));
    let mut a: [[f64; TOGETHER]; TOGETHER] = drawn;
    for row in &mut a[6..] {
        let size = row.iter().map(|it| it * it).sum::<f64>().sqrt();
        row.iter_mut().for_each(|it| *it /= size);
    }
    let one = |i: usize, k: usize| (0..TOGETHER).map(|j| a[i][j] * a[k][j]).sum();
    core::array::from_fn(|i| core::array::from_fn(|k| one(i, k)))
}

/// The same everywhere.
fn known(of: &[[f64; TOGETHER]; TOGETHER]) -> ErrorCovariance {
    let mut upper = (0..6).flat_map(|i| of[i][i..6].to_vec());
    let place = core::array::from_fn(|_| upper.next().expect("21 entries"));
    let ends = [Metres(0.0), Metres(0.5)];
    let positions = core::array::from_fn(|_| ends.to_vec());
    let errors = ErrorCovariance::new(positions, vec![place; 8]).expect("it is one");
    let with = |it: usize| core::array::from_fn(|k| of[it][k]);
    let warmth = CoefficientCovariance {
        coefficients: vec![
            Coefficient::Expansion(Axis::X),
            Coefficient::Bend(Axis::X, Axis::Z),
        ],
        correlations: vec![1.0, of[6][7], of[7][6], 1.0],
        with_errors: vec![vec![with(6), with(7)]; 8],
    };
    errors
        .with_coefficients(warmth)
        .expect("they are of these errors")
}

const TOOL: Point = Point::from_mm(120.0, -40.0, -150.0);
const AT: Point = Point::from_mm(310.0, 260.0, 110.0);

fn array(it: Point) -> [f64; 3] {
    Axis::ALL.map(|axis| it.along(axis).value())
}

fn state() -> MovingState {
    MovingState::default()
}

fn now(model: &VolumetricModel, temperatures: [Celsius; 2], live: &MovingState) -> Conditions {
    let now = model.conditions(TOOL, &temperatures, live);
    now.expect("it is what the model was proven for")
}

/// By how much the tool goes along x, y and z with each independent input that is off by its standard uncertainty; the last
/// two are the expansion and the bend.
fn pulls() -> [Vec<f64>; 3] {
    let usual = model(machine(0.0));
    let of = |model: &VolumetricModel, warm, live: &MovingState| {
        let seen = model.deviation(AT, &now(model, warm, live));
        array(seen.expect("it is within"))
    };
    let before = of(&usual, COLD, &state());
    let mut pulls: [Vec<f64>; 3] = Default::default();
    let mut add = |after: [f64; 3]| {
        for (k, pulls) in pulls.iter_mut().enumerate() {
            pulls.push(after[k] - before[k]);
        }
    };
    for axis in 0..3 {
        for across in 0..2 {
            let mut off = state();
            off.sideways[axis][across] = U_DISPLACEMENT;
            add(of(&usual, COLD, &off));
        }
        let mut off = state();
        off.roll[axis] = U_ROLL;
        add(of(&usual, COLD, &off));
    }
    for (at, u) in U_KELVIN.into_iter().enumerate() {
        let mut warmer = COLD;
        warmer[at] = Celsius(warmer[at].value() + u);
        add(of(&usual, warmer, &state()));
    }
    let mut grows = machine(0.0);
    for it in &mut grows.thermal.channels {
        it.expansion[0] += it.u_expansion[0];
    }
    add(of(&model(grows), COLD, &state()));
    let mut bends = machine(0.0);
    let bend = &mut bends.thermal.bends[0];
    bend.bow += bend.u;
    add(of(&model(bends), COLD, &state()));
    pulls
}

#[test]
fn gtc_comes_to_the_budget_of_three_axes_that_work_from_its_lines_and_from_what_is_off() {
    let (between, covariance) = (0.4e-6, covariance());
    let model = model(machine(between)).with_covariance(Some(known(&covariance)));
    let now = now(&model, COLD, &state());
    let seen = Seen {
        displacement: [U_DISPLACEMENT; 3],
        roll: [U_ROLL; 3],
        temperatures: &U_KELVIN,
    };
    let stated = model.standard_uncertainty(AT, &now, &seen);
    let stated = array(stated.expect("it is within"));
    let budget = model.uncertainty_budget(AT, &now, &seen);
    let budget = budget.expect("much is uncertain");
    let combined = |k: usize| {
        let it = budget.at(k);
        assert_close(
            "u",
            it.standard_uncertainty.value(),
            &json!(stated[k]),
            stated[k],
        );
        json!({
            "sensitivities": budget.sensitivities()[k],
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
        "places": (0..3).map(combined).collect::<Vec<_>>(),
    }});
    let mut pulls = pulls();
    let warm = pulls.each_mut().map(|it| it.split_off(it.len() - 2));
    // At y = 0.26 m, 0.15 of the interval from 0.2 to 0.6 m.
    pulls[2].push(between * 4.0 * 0.15 * 0.85);
    let tool = array(TOOL);
    let task = json!({
        "of": "now", "covariance": covariance, "tool": tool, "pulls": pulls, "warm": warm,
    });
    let again = check_record(&kept, task);
    for (k, u) in stated.into_iter().enumerate() {
        assert_close("u of the tool", u, &again[k], u * SECOND_ORDER);
    }
}
