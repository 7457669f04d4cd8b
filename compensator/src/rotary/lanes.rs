//! Sums of many numbers, four side by side: one after the other each would wait for the last.

/// Σ a.
pub(super) fn sum(a: &[f64]) -> f64 {
    let fours = a.chunks_exact(4);
    let rest: f64 = fours.remainder().iter().sum();
    let mut sums = [0.0; 4];
    for a in fours {
        for lane in 0..4 {
            sums[lane] += a[lane];
        }
    }
    rest + (sums[0] + sums[1]) + (sums[2] + sums[3])
}

/// Σ a·b.
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let (a_fours, b_fours) = (a.chunks_exact(4), b.chunks_exact(4));
    let ends = a_fours.remainder().iter().zip(b_fours.remainder());
    let rest: f64 = ends.map(|(a, b)| a * b).sum();
    let mut sums = [0.0; 4];
    for (a, b) in a_fours.zip(b_fours) {
        for lane in 0..4 {
            sums[lane] += a[lane] * b[lane];
        }
    }
    rest + (sums[0] + sums[1]) + (sums[2] + sums[3])
}

/// max |a|; 0 for nothing.
pub(super) fn largest(a: &[f64]) -> f64 {
    let mut largest = [0.0_f64; 4];
    let fours = a.chunks_exact(4);
    let rest = fours
        .remainder()
        .iter()
        .fold(0.0, |largest, a| a.abs().max(largest));
    for a in fours {
        for lane in 0..4 {
            let size = a[lane].abs();
            largest[lane] = if size > largest[lane] {
                size
            } else {
                largest[lane]
            };
        }
    }
    largest.iter().copied().fold(rest, f64::max)
}
