//! A model of three axes with all that a model can have, and targets in its volume.

use compensator::error_table::Limits;
use compensator::volumetric::function::{Function, Shape};
use compensator::volumetric::model::{
    AxisErrors, Conditions, Machine, Squareness, Thermal, ThermalBend, ThermalChannel,
    VolumetricModel,
};
use compensator::volumetric::online::MovingState;
use compensator::volumetric::{Axis, Point, Volume};
use units::{Celsius, Metres, MetresPerSecond, Radians};

use crate::random;

const SPAN_M: [f64; 3] = [0.6, 0.5, 0.4];
const NODES: usize = 25;

fn limits() -> Limits {
    Limits {
        size: Metres::from_um(500.0),
        slope: 0.1,
        rate: MetresPerSecond(0.1),
    }
}

fn volume() -> Volume {
    Volume::new(Point::ZERO, point(SPAN_M)).unwrap()
}

fn point(v: [f64; 3]) -> Point {
    Point::new(Metres(v[0]), Metres(v[1]), Metres(v[2]))
}

/// Points of the volume by chance.
pub fn targets(count: usize) -> Vec<Point> {
    let mut state = 1;
    let mut target = || point(SPAN_M.map(|span| span * random(&mut state)));
    (0..count).map(|_| target()).collect()
}

/// Eighteen functions of ±5 µm and ±5″ with a node every 25 mm or less, squarenesses, a tool, two
/// temperatures and live detectors.
///
/// # Panics
/// Never: the model is one.
pub fn model(shape: Shape) -> (VolumetricModel, Conditions) {
    let mut state = 7;
    let mut axes: [AxisErrors; 3] = Default::default();
    for axis in Axis::ALL {
        let span = SPAN_M[axis.index()];
        let step = span / (NODES - 1) as f64;
        let nodes: Vec<Metres> = (0..NODES).map(|n| Metres(step * n as f64)).collect();
        let mut even = || 2.0 * random(&mut state) - 1.0;
        for k in 0..3 {
            let along: Vec<Metres> = nodes
                .iter()
                .map(|_| Metres::from_um(5.0 * even()))
                .collect();
            axes[axis.index()].along[k] = Some(Function::new(&nodes, &along, shape).unwrap());
            let about: Vec<Radians> = nodes
                .iter()
                .map(|_| Radians::from_arcsec(5.0 * even()))
                .collect();
            axes[axis.index()].about[k] = Some(Function::new(&nodes, &about, shape).unwrap());
        }
    }
    let channel = ThermalChannel {
        reference: Celsius(20.0),
        low: Celsius(15.0),
        high: Celsius(35.0),
        expansion: [8e-6, 8e-6, 11e-6],
        u_expansion: [1e-7; 3],
        growth: point([0.0, 1e-6, 3e-6]),
        squareness: [Radians(1e-6), Radians(0.0), Radians(0.0)],
        u: 0.1,
    };
    let bend = |axis: Axis| ThermalBend {
        axis,
        towards: axis.others()[1],
        over: 0,
        under: Some(1),
        bow: Metres::from_um(4.0),
        u: Metres::from_um(0.1),
        low: Metres(0.0),
        high: Metres(SPAN_M[axis.index()]),
        gradient_max: 5.0,
        is_watched: axis == Axis::X,
    };
    let machine = Machine {
        chain: "XFYZ".parse().unwrap(),
        volume: volume(),
        axes,
        squareness: Squareness {
            y_to_x: Radians(20e-6),
            z_to_x: Radians(-30e-6),
            z_to_y: Radians(10e-6),
            u: [Radians(1e-6); 3],
        },
        thermal: Thermal {
            channels: vec![channel; 2],
            bends: Axis::ALL.map(bend).to_vec(),
            fixed: Point::ZERO,
        },
        tool_max: Metres(0.3),
        displacement_max: Metres::from_um(50.0),
        roll_max: Radians::from_arcsec(30.0),
    };
    let model = VolumetricModel::new(machine, limits()).unwrap();
    let now = conditions(&model, 22.0);
    (model, now)
}

/// What the machine is at, its first thermometer at `temperature` °C.
///
/// # Panics
/// When the temperature is beyond what the model knows.
pub fn conditions(model: &VolumetricModel, temperature: f64) -> Conditions {
    let live = MovingState {
        sideways: [[Metres::from_um(3.0); 2]; 3],
        roll: [Radians::from_arcsec(2.0); 3],
    };
    let temperatures = [Celsius(temperature), Celsius(21.0)];
    let tool = point([0.05, 0.0, -0.2]);
    model.conditions(tool, &temperatures, &live).unwrap()
}
