//! How far a screw's nut is from where the screw's turns say.
//!
//! The parts of the travel deviation of a ball screw (ISO 3408-3 calls them the mean travel
//! deviation, the variation within one revolution, and the rest): a slope, one and two cycles
//! a lead, and a smooth random walk. The nut's deviation is 0 in the middle of the screw.
//!
//! Absent: growth of the warm screw.

use crate::random::Stream;
use core::f64::consts::TAU;
use units::portable::sin;

use super::config::ScrewConfig;

/// The walk is drawn in steps of this length.
const STEP_M: f64 = 0.5e-3;
/// The peak is looked for at so many places of the work range.
const SCAN_POINTS: u32 = 401;

#[derive(Clone, Debug)]
pub(super) struct LeadError {
    slope: f64,
    /// Amplitude and phase at one and two cycles a lead.
    cycles: [(f64, f64); 2],
    per_m: f64,
    walk: Walk,
    at_zero_m: f64,
    lost_motion_m: f64,
}

impl LeadError {
    pub(super) fn new(config: &ScrewConfig, stream: &mut Stream) -> Self {
        let lost_um = stream.between(config.lost_motion_min_um, config.lost_motion_max_um);
        let amplitude_m = config.cyclic_amplitude_um * 1e-6;
        let cycles = [1.0, 0.25].map(|share| {
            let amplitude_m = share * amplitude_m * stream.between(0.6, 1.0);
            (amplitude_m, stream.between(0.0, TAU))
        });
        let sign = if stream.chance(0.5) { 1.0 } else { -1.0 };
        let peak_m = config.peak_um * 1e-6 * stream.between(0.9, 1.1);
        let mut error = Self {
            slope: 0.0,
            cycles,
            per_m: TAU / (config.lead_mm * 1e-3),
            walk: Walk::new(config, stream),
            at_zero_m: 0.0,
            lost_motion_m: lost_um * 1e-6,
        };
        error.at_zero_m = error.at(0.0);
        error.slope = sign * error.slope_for(peak_m, sign, config.work_range_mm * 1e-3);
        error
    }

    /// How steep the slope must be for the largest deviation to be `peak_m`; 0 when the other
    /// parts are larger than that already.
    fn slope_for(&self, peak_m: f64, sign: f64, range_m: f64) -> f64 {
        // Where it is looked for, and what the other parts are there.
        let others: Vec<_> = (0..SCAN_POINTS)
            .map(|i| {
                let share = 2.0 * f64::from(i) / f64::from(SCAN_POINTS - 1) - 1.0;
                let at_m = share * range_m;
                (at_m, self.at(at_m))
            })
            .collect();
        let peak_with = |slope: f64| {
            others
                .iter()
                .map(|(at_m, other_m)| (other_m + sign * slope * at_m).abs())
                .fold(0.0, f64::max)
                + self.lost_motion_m / 2.0
        };
        // The peak is a convex function of the slope, and below the goal without one.
        let (mut low, mut high) = (0.0, 2.0 * peak_m / range_m);
        for _ in 0..50 {
            let middle = f64::midpoint(low, high);
            if peak_with(middle) > peak_m {
                high = middle;
            } else {
                low = middle;
            }
        }
        low
    }

    /// Nut minus nominal position.
    pub(super) fn at(&self, nominal_m: f64) -> f64 {
        let [(first_m, first), (second_m, second)] = self.cycles;
        let turn = self.per_m * nominal_m;
        let cyclic_m = first_m * sin(turn + first) + second_m * sin(2.0 * turn + second);
        self.slope * nominal_m + cyclic_m + self.walk.at(nominal_m) - self.at_zero_m
    }

    /// It is not larger at `nominal_m` than this, which costs less to tell.
    pub(super) fn at_most(&self, nominal_m: f64) -> f64 {
        let [(first_m, _), (second_m, _)] = self.cycles;
        let cyclic_m = first_m.abs() + second_m.abs();
        (self.slope * nominal_m).abs() + cyclic_m + self.walk.at_most_m + self.at_zero_m.abs()
    }

    /// How far the nut turns back before it takes the table along.
    pub(super) const fn lost_motion_m(&self) -> f64 {
        self.lost_motion_m
    }
}

/// A random walk without slope over the work range, smooth between its steps.
#[derive(Clone, Debug)]
struct Walk {
    from_m: f64,
    knots: Vec<f64>,
    /// It is nowhere larger than this: between its knots a cubic of this kind overshoots the largest
    /// of them by a quarter at most.
    at_most_m: f64,
}

impl Walk {
    fn new(config: &ScrewConfig, stream: &mut Stream) -> Self {
        // Two more at each end, so that every place within the stops has four neighbours.
        let half = (config.hard_stop_mm * 1e-3 / STEP_M).ceil() as usize + 2;
        let mut at = 0.0;
        let mut knots: Vec<f64> = (0..=2 * half)
            .map(|_| {
                at += stream.gaussian();
                at
            })
            .collect();
        let work = (config.work_range_mm * 1e-3 / STEP_M).ceil() as usize;
        let work = half.saturating_sub(work)..(half + work + 1).min(knots.len());
        let (mean, slope) = line_through(&knots[work.clone()]);
        for (i, knot) in knots.iter_mut().enumerate() {
            *knot -= mean + slope * (i as f64 - half as f64);
        }
        let squares: f64 = knots[work.clone()].iter().map(|knot| knot * knot).sum();
        let scale = config.walk_um * 1e-6 / (squares / work.len() as f64).sqrt().max(1e-300);
        for knot in &mut knots {
            *knot *= scale;
        }
        let largest = knots.iter().fold(0.0, |most: f64, it| most.max(it.abs()));
        Self {
            from_m: -(half as f64) * STEP_M,
            at_most_m: 1.25 * largest,
            knots,
        }
    }

    /// Between the knots a cubic with the slopes of Catmull and Rom.
    fn at(&self, position_m: f64) -> f64 {
        let place = (position_m - self.from_m) / STEP_M;
        let last = self.knots.len() - 3;
        let left = (place.floor().max(1.0) as usize).min(last);
        let t = (place - left as f64).clamp(0.0, 1.0);
        let [a, b, c, d] = [0, 1, 2, 3].map(|i| self.knots[left - 1 + i]);
        let (rise_b, rise_c) = ((c - a) / 2.0, (d - b) / 2.0);
        let (square, cube) = (t * t, t * t * t);
        b * (2.0 * cube - 3.0 * square + 1.0)
            + rise_b * (cube - 2.0 * square + t)
            + c * (3.0 * square - 2.0 * cube)
            + rise_c * (cube - square)
    }
}

/// Mean and slope per place of values at places symmetrical about 0.
fn line_through(values: &[f64]) -> (f64, f64) {
    let centre = (values.len() as f64 - 1.0) / 2.0;
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let (mut product, mut square) = (0.0, 0.0);
    for (i, value) in values.iter().enumerate() {
        let place = i as f64 - centre;
        product += place * value;
        square += place * place;
    }
    (mean, product / square.max(1e-300))
}
