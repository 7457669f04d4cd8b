//! The command that brings the tool to a target, by bounded iteration.
//!
//! c ← target − deviation(c) contracts with the Lipschitz constant L of the deviation in the
//! largest-component norm; after a step of size s the distance to the one solution is at most
//! s·L/(1 − L) (Banach's fixed-point theorem). L is proven when a model is made.

use super::point::V3;

/// The iteration ends when what is left is proven smaller than this: ten picometres, a hundredth
/// of the finest counts of an encoder.
const EXACT_M: f64 = 1e-11;

/// With L ≤ 0.5, steps halve at least: more than enough from a millimetre.
const ROUNDS_MAX: usize = 64;

/// Above this the iteration would be slow and the model is hardly right.
pub(crate) const LIPSCHITZ_MAX: f64 = 0.5;

/// The deviation at the command for `target`: command = target − that. `lipschitz` ≤ 0.5.
#[inline]
pub(crate) fn deviation_at_target(
    target: V3,
    lipschitz: f64,
    mut deviation: impl FnMut(V3) -> V3,
) -> V3 {
    let mut seen = deviation(target);
    // The first step is the whole deviation; what is left after it is L times that at most.
    for _ in 0..ROUNDS_MAX {
        let command = [
            target[0] - seen[0],
            target[1] - seen[1],
            target[2] - seen[2],
        ];
        let next = deviation(command);
        let step = (next[0] - seen[0])
            .abs()
            .max((next[1] - seen[1]).abs())
            .max((next[2] - seen[2]).abs());
        seen = next;
        // What is no number ends it too.
        let is_open = step * lipschitz > EXACT_M * (1.0 - lipschitz);
        if !is_open {
            break;
        }
    }
    seen
}
