//! Where a machine's own frame lies in that of its truth.

use units::Metres;

use super::Off;

/// Where a machine's own frame lies in that of its truth: a shift and small turns. No calibration
/// can know it; whoever mounts a workpiece sets it up in the machine's frame.
#[derive(Clone, Copy, Debug, Default)]
pub struct Frame {
    shift: [f64; 3],
    turn: [f64; 3],
}

impl Frame {
    /// The frame that explains most of `errors` at `places`, by least squares.
    ///
    /// # Panics
    /// When the places do not span a volume.
    pub fn of(places: &[[f64; 3]], errors: &[Off]) -> Self {
        // Normal equations of error = shift + turn × place.
        let (mut normal, mut right) = ([[0.0; 6]; 6], [0.0; 6]);
        for (mm, error) in places.iter().zip(errors) {
            for (row, value) in rows(*mm).iter().zip(error) {
                for i in 0..6 {
                    right[i] += row[i] * value.value();
                    for k in 0..6 {
                        normal[i][k] += row[i] * row[k];
                    }
                }
            }
        }
        let [a, b, c, d, e, f] = solved(normal, right);
        Self {
            shift: [a, b, c],
            turn: [d, e, f],
        }
    }

    /// The error at a place as seen in this frame.
    pub fn seen(&self, mm: [f64; 3], error: Off) -> Off {
        let own = [self.shift, self.turn].concat();
        let rows = rows(mm);
        core::array::from_fn(|k| {
            let part: f64 = rows[k].iter().zip(&own).map(|(a, b)| a * b).sum();
            error[k] - Metres(part)
        })
    }

    /// All of them.
    pub fn all_seen(&self, places: &[[f64; 3]], errors: &[Off]) -> Vec<Off> {
        let pairs = places.iter().zip(errors);
        pairs.map(|(mm, error)| self.seen(*mm, *error)).collect()
    }
}

/// Along x, y and z, by shift and turn.
fn rows(mm: [f64; 3]) -> [[f64; 6]; 3] {
    let [x, y, z] = mm.map(|it| it * 1e-3);
    [
        [1.0, 0.0, 0.0, 0.0, z, -y],
        [0.0, 1.0, 0.0, -z, 0.0, x],
        [0.0, 0.0, 1.0, y, -x, 0.0],
    ]
}

/// By elimination with pivots.
fn solved(mut matrix: [[f64; 6]; 6], mut right: [f64; 6]) -> [f64; 6] {
    for i in 0..6 {
        let size = |row: &usize| matrix[*row][i].abs();
        let pivot = (i..6).max_by(|a, b| size(a).total_cmp(&size(b)));
        let pivot = pivot.expect("there are rows left");
        matrix.swap(i, pivot);
        right.swap(i, pivot);
        assert!(matrix[i][i].abs() > 1e-12, "the places span no volume");
        for row in i + 1..6 {
            let factor = matrix[row][i] / matrix[i][i];
            let own = matrix[i];
            for (value, own) in matrix[row].iter_mut().zip(own) {
                *value -= factor * own;
            }
            right[row] -= factor * right[i];
        }
    }
    let mut solution = [0.0; 6];
    for i in (0..6).rev() {
        let known: f64 = (i + 1..6).map(|k| matrix[i][k] * solution[k]).sum();
        solution[i] = (right[i] - known) / matrix[i][i];
    }
    solution
}
