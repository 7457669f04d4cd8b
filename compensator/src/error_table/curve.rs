//! One approach's deviation as a function of the command, and the inverse of command + deviation.
//!
//! Both directions find their piece in a table of equal buckets, so that a call costs the same
//! for ten nodes as for ten thousand: a bucket is at most as wide as the narrowest piece, hence
//! at most one comparison follows. Only where the node distances differ by more than
//! [`BUCKETS_PER_PIECE`] on average does a bucket hold more pieces, which are then bisected.

use crate::interpolation::Segment;

/// Buckets spent per piece at most.
const BUCKETS_PER_PIECE: usize = 64;

/// Newton steps tried before bisection; two do for slopes below 1e-3.
const NEWTON_STEPS: usize = 8;

/// A step below this share of the piece is the last: the error after it is its square.
const LAST_STEP: f64 = 1e-8;

/// Finds the interval of strictly increasing `breaks` that a value lies in.
#[derive(Clone, Debug)]
struct Grid {
    low: f64,
    per_width: f64,
    /// For each bucket edge the interval it lies in; one more than there are buckets.
    first: Vec<u32>,
    breaks: Vec<f64>,
}

impl Grid {
    fn new(breaks: Vec<f64>) -> Self {
        let pieces = breaks.len() - 1;
        let low = breaks[0];
        let span = breaks[pieces] - low;
        let narrowest = breaks
            .windows(2)
            .map(|w| w[1] - w[0])
            .fold(f64::INFINITY, f64::min);
        let wanted = (span / narrowest).ceil() as usize;
        let buckets = wanted.clamp(1, pieces * BUCKETS_PER_PIECE);
        let width = span / buckets as f64;
        let mut piece = 0;
        let first = (0..=buckets)
            .map(|k| {
                let edge = low + k as f64 * width;
                while piece + 1 < pieces && breaks[piece + 1] < edge {
                    piece += 1;
                }
                piece as u32
            })
            .collect();
        Self {
            low,
            per_width: 1.0 / width,
            first,
            breaks,
        }
    }

    /// The i with breaks[i] < value <= breaks[i + 1]; the first or last piece outside.
    #[inline]
    fn find(&self, value: f64) -> usize {
        // The cast saturates: below the grid it is bucket 0.
        let bucket = ((value - self.low) * self.per_width) as usize;
        let bucket = bucket.min(self.first.len() - 2);
        let (low, high) = (self.first[bucket] as usize, self.first[bucket + 1] as usize);
        // Without branches where it matters: targets come in any order.
        let piece = if high - low <= 1 {
            low + usize::from(self.breaks[low + 1] < value)
        } else {
            low + self.breaks[low + 1..=high].partition_point(|b| *b < value)
        };
        let piece = piece.min(self.breaks.len() - 2);
        // Rounding of the bucket number may put a value on an edge one bucket too far: so
        // seldom that a branch, which is not waited for, is the cheaper.
        if value <= self.breaks[piece] {
            return piece.saturating_sub(1);
        }
        piece
    }
}

/// One line of the processor's cache.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
struct Piece {
    deviation: Segment,
    /// actual at the start of the piece: start + deviation there.
    actual_start: f64,
    /// Mean of d command / d actual over the piece: Newton's first guess.
    mean_inverse_slope: f64,
}

/// Continuous pieces with a constant continuation on both sides.
#[derive(Clone, Debug)]
pub(crate) struct Curve {
    by_command: Grid,
    by_actual: Grid,
    pieces: Vec<Piece>,
    first: f64,
    last: f64,
    before: f64,
    after: f64,
    /// Step functions have no inverse at their steps: the interval is judged by the target.
    stepped: bool,
}

impl Curve {
    /// `segments` join each other; `before` and `after` are the deviations outside them. For
    /// `stepped` ones the caller has checked only that they keep the order of the intervals;
    /// for the others that every slope is above −1.
    pub(crate) fn new(segments: &[Segment], before: f64, after: f64, stepped: bool) -> Self {
        let mut commands: Vec<f64> = segments.iter().map(|s| s.start).collect();
        let last = segments[segments.len() - 1].end();
        commands.push(last);
        let pieces: Vec<Piece> = segments
            .iter()
            .map(|s| {
                let rise = s.value(s.width) - s.value(0.0);
                Piece {
                    deviation: *s,
                    actual_start: s.start + s.constant,
                    mean_inverse_slope: s.width / (s.width + rise),
                }
            })
            .collect();
        let actuals = if stepped {
            commands.clone()
        } else {
            pieces
                .iter()
                .map(|p| p.actual_start)
                .chain([last + after])
                .collect()
        };
        Self {
            first: commands[0],
            last,
            by_command: Grid::new(commands),
            by_actual: Grid::new(actuals),
            pieces,
            before,
            after,
            stepped,
        }
    }

    #[inline]
    pub(crate) fn deviation(&self, command: f64) -> f64 {
        if command <= self.first {
            return self.before;
        }
        if command > self.last {
            return self.after;
        }
        let piece = &self.pieces[self.by_command.find(command)].deviation;
        piece.value(command - piece.start)
    }

    /// The command whose actual is `target`; for steps, target − deviation(target).
    #[inline]
    pub(crate) fn command(&self, target: f64) -> f64 {
        if self.stepped {
            return target - self.deviation(target);
        }
        if target <= self.first + self.before {
            return target - self.before;
        }
        if target >= self.last + self.after {
            return target - self.after;
        }
        let piece = &self.pieces[self.by_actual.find(target)];
        piece.deviation.start + piece.solve(target - piece.actual_start)
    }
}

impl Piece {
    /// The t with t + deviation(t) − deviation(0) = `rise`.
    #[inline]
    fn solve(&self, rise: f64) -> f64 {
        let Segment {
            width,
            linear,
            quadratic,
            cubic,
            ..
        } = self.deviation;
        let mut t = rise * self.mean_inverse_slope;
        if quadratic == 0.0 && cubic == 0.0 {
            return t;
        }
        for _ in 0..NEWTON_STEPS {
            let excess = t * (1.0 + linear + t * (quadratic + t * cubic)) - rise;
            let slope = 1.0 + linear + t * (2.0 * quadratic + t * 3.0 * cubic);
            let step = excess / slope;
            t -= step;
            if step.abs() <= LAST_STEP * width {
                return t;
            }
        }
        self.bisect(rise)
    }

    /// For slopes so near 1 that Newton's steps wander; the map is monotone, so this ends.
    #[cold]
    fn bisect(&self, rise: f64) -> f64 {
        let (mut low, mut high) = (0.0, self.deviation.width);
        for _ in 0..80 {
            let middle = low + (high - low) / 2.0;
            let value = middle + self.deviation.value(middle) - self.deviation.constant;
            if value < rise {
                low = middle;
            } else {
                high = middle;
            }
        }
        low + (high - low) / 2.0
    }
}
