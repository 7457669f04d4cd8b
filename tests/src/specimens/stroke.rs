//! An error table along a stroke, and targets on the stroke.

use compensator::error_table::{Compensation, EndPolicy, ErrorTable, Interpolation, Limits, Node};
use units::{Metres, MetresPerSecond};

use crate::random;

const STROKE_M: f64 = 0.06;

/// ±10 µm in two waves and some noise, reverse 1 µm beside forward, at even distances.
///
/// # Panics
/// When there are fewer than two nodes.
pub fn compensation(interpolation: Interpolation, nodes: u32) -> Compensation {
    let mut state = u64::from(nodes);
    let step_m = STROKE_M / f64::from(nodes - 1);
    let noise_m = 0.2e-6_f64.min(step_m * 1e-3);
    let node = |at: u32| {
        let phase = f64::from(at) * step_m / STROKE_M * 4.0 * core::f64::consts::PI;
        let forward = Metres(10e-6 * phase.sin() + noise_m * random(&mut state));
        Node {
            position: Metres(f64::from(at) * step_m),
            forward: Some(forward),
            reverse: Some(forward + Metres::from_um(1.0)),
            u_forward: Some(Metres::from_um(0.1)),
            u_reverse: Some(Metres::from_um(0.1)),
        }
    };
    let table = ErrorTable::new((0..nodes).map(node).collect()).unwrap();
    let limits = Limits {
        size: Metres::from_um(50.0),
        slope: 0.1,
        rate: MetresPerSecond(1.0),
    };
    Compensation::new(table, interpolation, limits, EndPolicy::Hold).unwrap()
}

/// Places along the stroke by chance.
pub fn targets(count: usize) -> Vec<Metres> {
    let mut state = 1;
    (0..count)
        .map(|_| Metres(STROKE_M * random(&mut state)))
        .collect()
}
