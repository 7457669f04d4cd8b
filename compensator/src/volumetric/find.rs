//! Finds the interval of increasing breaks that a position lies in, in a few instructions.
//!
//! Equal buckets, each with the first interval in it and where that ends. The search of
//! [`crate::error_table`] is exact to the last bit on both sides of a break, which its steps
//! need; what is searched here is continuous, and a bucket is one load.

/// Buckets spent per interval at most; narrower intervals are walked to.
const BUCKETS_PER_INTERVAL: usize = 32;

/// 2⁵²: a number below 2³² added to it leaves its nearest integer in the low bits.
const TO_INTEGER: f64 = 4_503_599_627_370_496.0;

#[derive(Clone, Copy, Debug)]
struct Bucket {
    /// Where the first interval in it ends.
    end: f64,
    first: u32,
    /// Whether more than one interval ends in it.
    crowded: bool,
}

#[derive(Clone, Debug)]
pub(super) struct Finder {
    low: f64,
    high: f64,
    per_width: f64,
    buckets: Vec<Bucket>,
    breaks: Vec<f64>,
}

impl Finder {
    /// For at least two increasing breaks.
    pub(super) fn new(breaks: Vec<f64>) -> Self {
        let intervals = breaks.len() - 1;
        let (low, high) = (breaks[0], breaks[intervals]);
        let widths = breaks.windows(2).map(|it| it[1] - it[0]);
        let narrowest = widths.fold(f64::INFINITY, f64::min);
        let wanted = ((high - low) / narrowest).ceil() as usize;
        let count = wanted.clamp(1, intervals * BUCKETS_PER_INTERVAL);
        let per_width = count as f64 / (high - low);
        // Bucket k is what rounds to k: from half a width before low + k widths to half after.
        let bucket = |k: usize| {
            let (from, to) = ((k as f64 - 0.5) / per_width, (k as f64 + 0.5) / per_width);
            let inner = &breaks[1..intervals];
            let first = inner.partition_point(|it| *it <= low + from);
            let after = inner.partition_point(|it| *it < low + to);
            Bucket {
                end: breaks[first + 1],
                first: first as u32,
                crowded: after > first + 1,
            }
        };
        Self {
            buckets: (0..=count).map(bucket).collect(),
            low,
            high,
            per_width,
            breaks,
        }
    }

    /// The position within the breaks, and the interval it lies in.
    #[inline(always)]
    pub(super) fn find(&self, position: f64) -> (f64, usize) {
        // Written out: f64::max and min treat a NaN, which callers have refused.
        let inside = if position > self.low {
            position
        } else {
            self.low
        };
        let inside = if inside < self.high {
            inside
        } else {
            self.high
        };
        let place = (inside - self.low) * self.per_width + TO_INTEGER;
        let bucket = &self.buckets[place.to_bits() as u32 as usize];
        let at = bucket.first as usize + usize::from(inside > bucket.end);
        if bucket.crowded {
            return (inside, self.walk(inside, bucket.first as usize));
        }
        (inside, at)
    }

    #[cold]
    fn walk(&self, inside: f64, first: usize) -> usize {
        let inner = &self.breaks[first + 1..self.breaks.len() - 1];
        first + inner.partition_point(|it| *it < inside)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn the_interval_found_holds_the_position(
            widths in prop::collection::vec(1e-6_f64..1.0, 1..40),
            offset in -3.0_f64..3.0,
            share in -0.1_f64..1.1,
        ) {
            let mut breaks = vec![offset];
            for width in &widths {
                // Cubed: some a million times narrower than others.
                breaks.push(breaks[breaks.len() - 1] + 1e-6 + width.powi(3));
            }
            let (low, high) = (breaks[0], breaks[widths.len()]);
            let finder = Finder::new(breaks.clone());
            let mut positions = vec![low + share * (high - low), f64::NAN, f64::INFINITY];
            positions.extend(&breaks);
            for position in positions {
                let (inside, at) = finder.find(position);
                prop_assert!(at < widths.len());
                // A rounding beside a break is the neighbour's, which continues it.
                let hair = 1e-12 * (high - low);
                let within = breaks[at] - hair <= inside && inside <= breaks[at + 1] + hair;
                prop_assert!(within, "{at}: {inside}");
                prop_assert!(position.is_nan() || inside == position.clamp(low, high));
            }
        }
    }
}
