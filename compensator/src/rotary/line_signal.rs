//! Where the lines of a plate are in the sampled signal of a detector that they pass.
//!
//! A detector beside the table gives a pulse of voltage for each line; position and voltage are sampled together, at
//! a rate that has nothing to do with the lines. A line's place is the centroid of its pulse under a smooth window
//! about that place. For smooth pulses that are alike on both sides this has no error of its own as long as the samples
//! lie nearer to each other than about half of the pulse's width (what is left falls with e to the power of
//! −2π²σ²/d², d being the distance of samples and σ the pulse's standard deviation; Poisson's sum), while a level that
//! is crossed between two samples would be known to a tenth of their distance only. Pulses with corners, of a slit over
//! a line, are off by up to 2e-4 of their width with [`SAMPLES_MIN`] samples in it, and by 6e-3 with five.
//!
//! | word | meaning |
//! |---|---|
//! | level | a voltage that only lines reach, about half of their height |
//! | width | how far the table turns while a line is beyond the level |
//! | window | cos² over four widths |

use core::f64::consts::PI;

use core::time::Duration;

use units::portable::cos;
use units::{Radians, Time, Volts};

/// So many samples must fall into a line's width.
pub const SAMPLES_MIN: f64 = 8.0;
/// Lines must be apart by so many widths: the window of one ends where the next one may begin.
pub const WIDTHS_APART: f64 = 4.0;
/// The window reaches so many widths to both sides, and nothing is told of a line that lacks a part of it.
const REACH: f64 = WIDTHS_APART / 2.0;
/// A pulse whose width at the level is off by more than this factor is no line: dirt, a scratch, an end of the turn.
const WIDTH_FACTOR: f64 = 1.5;
/// Pulses nearer to each other than this share of the width are one.
const SAME_SHARE: f64 = 0.125;
/// Beyond this multiple of the time between two samples, one in between was lost.
const GAP: f64 = 1.5;
/// Each round leaves about 0.4 of what the place is off by.
const ROUNDS: usize = 40;
/// Nearer than this share of the width nothing changes any more.
const SETTLED: f64 = 1e-9;

/// Position and voltage of one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SignalSample {
    /// When.
    pub at: Time,
    /// Where the table was.
    pub position: Radians,
    /// What the detector gave.
    pub signal: Volts,
}

/// What a line looks like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineShape {
    /// Only lines reach it.
    pub level: Volts,
    /// Lines are above it; dark ones below.
    pub is_above: bool,
    /// How far the table turns meanwhile.
    pub width: Radians,
    /// From one sample to the next.
    pub sampling: Duration,
}

/// A line that was seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SignalLine {
    /// Where the table was when it lay in the detector's middle.
    pub position: Radians,
    /// No sample of it was lost.
    pub is_whole: bool,
}

/// The lines in `samples`, which were taken while the table turned in one direction, in the order of growing angles.
/// What is too wide or too narrow for a line, and what lies at an end of the samples, is left out.
///
/// # Example
///
/// ```
/// use core::time::Duration;
/// use compensator::rotary::{LineShape, SignalSample, lines_in};
/// use units::{Radians, Time, Volts};
///
/// // A line at 0.5003 rad, 2 mrad wide, seen every half milliradian.
/// let pulse = |at: f64| 5.0 * (-((at - 0.5003) / 0.85e-3).powi(2) / 2.0).exp();
/// let samples: Vec<_> = (0..2000)
///     .map(|step| (step, f64::from(step) * 0.5e-3))
///     .map(|(step, at)| SignalSample {
///         at: Time::ZERO + step * Duration::from_millis(5),
///         position: Radians(at),
///         signal: Volts(0.1 + pulse(at)),
///     })
///     .collect();
/// let shape = LineShape {
///     level: Volts(2.5),
///     is_above: true,
///     width: Radians(2e-3),
///     sampling: Duration::from_millis(5),
/// };
/// let lines = lines_in(&samples, &shape);
/// assert_eq!(lines.len(), 1);
/// assert!((lines[0].position.value() - 0.5003).abs() < 1e-8);
/// ```
pub fn lines_in(samples: &[SignalSample], shape: &LineShape) -> Vec<SignalLine> {
    let points = ascending(samples, shape);
    let width = shape.width.value();
    let is_line = |(begin, end): &(f64, f64)| {
        let seen = end - begin;
        seen < width * WIDTH_FACTOR && seen * WIDTH_FACTOR > width
    };
    let pulses = pulses(&points, width).into_iter().filter(is_line);
    let lines = pulses.filter_map(|(a, b)| line_at(&points, (a + b) / 2.0, shape));
    lines.collect()
}

/// How wide what is beyond the level is, in the middle of all that is; `None` when nothing is. For a person who has
/// to set `width`.
pub fn width_seen(samples: &[SignalSample], shape: &LineShape) -> Option<Radians> {
    let pulses = pulses(&ascending(samples, shape), shape.width.value());
    let mut widths: Vec<f64> = pulses.into_iter().map(|(a, b)| b - a).collect();
    widths.sort_by(f64::total_cmp);
    widths.get(widths.len() / 2).copied().map(Radians)
}

/// Position, and by how much the signal is beyond the level.
#[derive(Clone, Copy, Debug)]
struct Point {
    time: Time,
    at: f64,
    over: f64,
}

fn ascending(samples: &[SignalSample], shape: &LineShape) -> Vec<Point> {
    let sign = if shape.is_above { 1.0 } else { -1.0 };
    let point = |it: &SignalSample| Point {
        time: it.at,
        at: it.position.value(),
        over: sign * (it.signal - shape.level).value(),
    };
    let mut points: Vec<Point> = samples.iter().map(point).collect();
    // Equal positions keep their order, which must be that of the others.
    if let [first, .., last] = points.as_slice()
        && first.at > last.at
    {
        points.reverse();
    }
    points.sort_by(|a, b| a.at.total_cmp(&b.at));
    points
}

/// Where what is beyond the level begins and ends.
fn pulses(points: &[Point], width: f64) -> Vec<(f64, f64)> {
    let mut found: Vec<(f64, f64)> = Vec::new();
    let mut begin = None;
    for pair in points.windows(2) {
        let [before, after] = [pair[0], pair[1]];
        let crossing = || {
            let share = before.over / (before.over - after.over);
            before.at + share * (after.at - before.at)
        };
        match (before.over > 0.0, after.over > 0.0) {
            (false, true) => {
                let here = crossing();
                // Noise at the level, not another line.
                let same = found.pop_if(|it| here - it.1 < SAME_SHARE * width);
                begin = Some(same.map_or(here, |it| it.0));
            }
            (true, false) => {
                if let Some(begin) = begin.take() {
                    found.push((begin, crossing()));
                }
            }
            _ => {}
        }
    }
    found
}

/// The centroid under a window about itself.
fn line_at(points: &[Point], middle: f64, shape: &LineShape) -> Option<SignalLine> {
    let width = shape.width.value();
    let reach = REACH * width;
    let mut centre = middle;
    for _ in 0..ROUNDS {
        let window = within(points, centre, reach)?;
        let off = centroid(window, centre, reach)?;
        centre += off;
        if off.abs() < SETTLED * width {
            break;
        }
    }
    if (centre - middle).abs() > width / 2.0 {
        return None;
    }
    let window = within(points, centre, reach)?;
    let longest = shape.sampling.mul_f64(GAP);
    let apart = |pair: &[Point]| {
        let [a, b] = [pair[0].time, pair[1].time];
        a.since(b).max(b.since(a))
    };
    let is_whole = window.windows(2).all(|pair| apart(pair) <= longest);
    Some(SignalLine {
        position: Radians(centre),
        is_whole,
    })
}

/// The points of a window, and one more on each side; `None` at an end of all points.
fn within(points: &[Point], centre: f64, reach: f64) -> Option<&[Point]> {
    let from = points.partition_point(|it| it.at < centre - reach);
    let to = points.partition_point(|it| it.at <= centre + reach);
    (from > 0 && to < points.len()).then(|| &points[from - 1..=to])
}

/// How far from `centre` the centroid of what lies above the darkest point is.
fn centroid(window: &[Point], centre: f64, reach: f64) -> Option<f64> {
    let dark = window
        .iter()
        .map(|it| it.over)
        .fold(f64::INFINITY, f64::min);
    let (mut moment, mut sum) = (0.0, 0.0);
    for three in window.windows(3) {
        let off = three[1].at - centre;
        let taper = cos(PI / 2.0 * off / reach);
        let share = (three[2].at - three[0].at) / 2.0;
        let weight = taper * taper * share * (three[1].over - dark);
        moment += weight * off;
        sum += weight;
    }
    (sum > 0.0).then(|| moment / sum)
}

#[cfg(test)]
mod tests {
    use super::*;
    use units::portable::exp;

    const WIDTH: f64 = 3e-3;
    const SHAPE: LineShape = LineShape {
        level: Volts(2.5),
        is_above: true,
        width: Radians(WIDTH),
        sampling: SAMPLING,
    };
    const SAMPLING: Duration = Duration::from_millis(5);
    /// Full width at half of the height.
    const SIGMA: f64 = WIDTH / 2.354_820_045;

    fn gaussian(off: f64) -> f64 {
        let z = off / SIGMA;
        exp(-z * z / 2.0)
    }

    /// Samples `share` of a width apart, from `start` on, of lines at `lines`.
    fn seen(
        share: f64,
        start: f64,
        lines: &[f64],
        pulse: impl Fn(f64) -> f64,
    ) -> Vec<SignalSample> {
        let step = share * WIDTH;
        let count = (0.2 / step) as u32;
        (0..count)
            .map(|number| (number, start + f64::from(number) * step))
            .map(|(number, at)| SignalSample {
                at: Time::ZERO + number * SAMPLING,
                position: Radians(at),
                signal: Volts(0.2 + 5.0 * lines.iter().map(|it| pulse(at - it)).sum::<f64>()),
            })
            .collect()
    }

    fn off(samples: &[SignalSample], shape: &LineShape, true_at: f64) -> f64 {
        let lines = lines_in(samples, shape);
        assert_eq!(lines.len(), 1, "{lines:?}");
        assert!(lines[0].is_whole);
        (lines[0].position.value() - true_at).abs() / WIDTH
    }

    #[test]
    fn a_smooth_line_is_found_to_a_ten_millionth_of_its_width_wherever_samples_fall() {
        for phase in 0..20 {
            let start = f64::from(phase) / 20.0 * WIDTH / 4.0;
            let samples = seen(0.25, start, &[0.1], gaussian);
            assert!(off(&samples, &SHAPE, 0.1) < 1e-7, "{phase}");
        }
    }

    /// A line under a slit as wide as itself: a triangle, whose spectrum falls slowly.
    #[test]
    fn a_pulse_with_corners_is_found_to_a_five_thousandth_of_its_width() {
        let triangle = |off: f64| (1.0 - off.abs() / WIDTH).max(0.0);
        for phase in 0..20 {
            let start = f64::from(phase) / 20.0 * WIDTH / SAMPLES_MIN;
            let samples = seen(1.0 / SAMPLES_MIN, start, &[0.1], triangle);
            assert!(off(&samples, &SHAPE, 0.1) < 2e-4, "{phase}");
        }
    }

    #[test]
    fn dark_lines_and_a_turn_the_other_way_are_the_same() {
        let mut samples = seen(0.25, 0.0, &[0.1], gaussian);
        let bright = lines_in(&samples, &SHAPE);
        samples.reverse();
        assert_eq!(lines_in(&samples, &SHAPE), bright);
        for it in &mut samples {
            it.signal = Volts(5.0) - it.signal;
        }
        let dark = LineShape {
            is_above: false,
            ..SHAPE
        };
        assert!(off(&samples, &dark, 0.1) < 1e-6);
    }

    /// A slow turn, or a coarse encoder: some samples are at the same count.
    #[test]
    fn rounded_positions_are_no_lost_samples_either_way() {
        let mut samples = seen(0.1, 0.0, &[0.1], gaussian);
        let count = 0.08 * WIDTH;
        for it in &mut samples {
            it.position = Radians((it.position.value() / count).round() * count);
        }
        // Half a count.
        assert!(off(&samples, &SHAPE, 0.1) < 0.04);
        samples.reverse();
        assert!(off(&samples, &SHAPE, 0.1) < 0.04);
        let seen = width_seen(&samples, &SHAPE).unwrap().value() / WIDTH;
        assert!((seen - 1.0).abs() < 0.1, "{seen}");
    }

    #[test]
    fn noise_moves_a_line_as_much_as_theory_says() {
        // 1 mV at 5 V, a dozen samples: some 1e-4 of the width.
        let mut state = 1_u64;
        let mut noise = move || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 40) as f64 / f64::from(1_u32 << 24) - 0.5
        };
        let squares: f64 = (0..200)
            .map(|_| {
                let mut samples = seen(0.25, 0.0, &[0.1], gaussian);
                for it in &mut samples {
                    it.signal += Volts(1e-3 * 12.0_f64.sqrt() * noise());
                }
                let off = off(&samples, &SHAPE, 0.1);
                off * off
            })
            .sum();
        let rms = (squares / 200.0).sqrt();
        assert!((2e-5..3e-4).contains(&rms), "{rms:e}");
    }

    #[test]
    fn what_is_no_line_is_left_out_and_a_lost_sample_is_told() {
        let wide = |off: f64| gaussian(off / 2.0);
        assert!(lines_in(&seen(0.25, 0.0, &[0.1], wide), &SHAPE).is_empty());
        let speck = |off: f64| gaussian(off * 3.0);
        assert!(lines_in(&seen(0.1, 0.0, &[0.1], speck), &SHAPE).is_empty());
        // A scratch beside it.
        let both = seen(0.25, 0.0, &[0.1, 0.1 + 0.6 * WIDTH], gaussian);
        assert!(lines_in(&both, &SHAPE).is_empty());
        let mut samples = seen(0.25, 0.0, &[0.1], gaussian);
        let lost = samples.iter().position(|it| it.position.value() > 0.1);
        samples.remove(lost.unwrap());
        let lines = lines_in(&samples, &SHAPE);
        assert_eq!(lines.len(), 1);
        assert!(!lines[0].is_whole);
        assert!(lines_in(&seen(0.25, 0.0, &[0.0005], gaussian), &SHAPE).is_empty());
        assert!(lines_in(&[], &SHAPE).is_empty());
    }
}
