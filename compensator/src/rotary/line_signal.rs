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
//! | gap | a stretch of the turn of which samples were lost; a line whose window reaches into it is not told |

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
/// A pulse whose width at the level is off by more than this factor is no line: narrower where dirt covers it, wider
/// where a scratch lies beside it.
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

/// What the samples of a turn show.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LinesSeen {
    /// Where the table was when each line lay in the detector's middle, in the order of growing angles.
    pub lines: Vec<Radians>,
    /// Where a pulse is too wide for a line, or not alike on both sides: something lies beside the line.
    pub wide: Vec<Radians>,
    /// Lines here lack samples of their windows.
    gaps: Vec<(Radians, Radians)>,
    /// Lines between these have whole windows; `None` without samples.
    sampled: Option<(Radians, Radians)>,
}

impl LinesSeen {
    /// Whether so many samples are lacking about `at` that a line there is not told, be it in sight or not.
    pub fn lacks(&self, at: Radians) -> bool {
        let is_in = |(from, to): &(Radians, Radians)| at >= *from && at <= *to;
        !self.sampled.as_ref().is_some_and(is_in) || self.gaps.iter().any(is_in)
    }

    /// Whether samples between the first and the last were lost.
    pub const fn has_gaps(&self) -> bool {
        !self.gaps.is_empty()
    }
}

/// The lines in `samples`, which are in the order in which they were taken, while the table turned in one direction.
/// What is too wide or too narrow for a line, and what lacks samples, is no line.
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
/// let seen = lines_in(&samples, &shape);
/// assert_eq!(seen.lines.len(), 1);
/// assert!((seen.lines[0].value() - 0.5003).abs() < 1e-8);
/// assert!(!seen.lacks(Radians(0.7)), "no line is there");
///
/// // Without what was sampled about the line, nobody knows whether there is one.
/// let (before, after) = (&samples[..990], &samples[1010..]);
/// let seen = lines_in(&[before, after].concat(), &shape);
/// assert!(seen.lines.is_empty() && seen.lacks(Radians(0.5003)));
/// ```
pub fn lines_in(samples: &[SignalSample], shape: &LineShape) -> LinesSeen {
    let points = ascending(samples, shape);
    let width = shape.width.value();
    let mut seen = LinesSeen {
        gaps: gaps(samples, shape),
        sampled: whole_windows(&points, shape),
        ..LinesSeen::default()
    };
    for (begin, end) in pulses(&points, width) {
        let (middle, wide) = ((begin + end) / 2.0, end - begin);
        if wide * WIDTH_FACTOR <= width || seen.lacks(Radians(middle)) {
            continue;
        }
        let is_line = wide < width * WIDTH_FACTOR;
        match line_at(&points, middle, shape).filter(|_| is_line) {
            Some(line) if seen.lacks(line) => {}
            Some(line) => seen.lines.push(line),
            None => seen.wide.push(Radians(middle)),
        }
    }
    seen
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
    at: f64,
    over: f64,
}

fn ascending(samples: &[SignalSample], shape: &LineShape) -> Vec<Point> {
    let sign = if shape.is_above { 1.0 } else { -1.0 };
    let point = |it: &SignalSample| Point {
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

/// Where lines lie whose windows reach into a stretch of which samples were lost.
fn gaps(samples: &[SignalSample], shape: &LineShape) -> Vec<(Radians, Radians)> {
    let longest = shape.sampling.mul_f64(GAP);
    let reach = shape.width * REACH;
    let pairs = samples.windows(2);
    let lost = pairs.filter(|pair| pair[1].at.since(pair[0].at) > longest);
    let wide = lost.map(|pair| {
        let [a, b] = [pair[0].position, pair[1].position];
        (a.min(b) - reach, a.max(b) + reach)
    });
    wide.collect()
}

/// Where lines lie whose windows are between the first and the last sample.
fn whole_windows(points: &[Point], shape: &LineShape) -> Option<(Radians, Radians)> {
    let (first, last) = (points.first()?, points.last()?);
    let reach = shape.width * REACH;
    Some((Radians(first.at) + reach, Radians(last.at) - reach))
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
fn line_at(points: &[Point], middle: f64, shape: &LineShape) -> Option<Radians> {
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
    ((centre - middle).abs() <= width / 2.0).then_some(Radians(centre))
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
        let lines = lines_in(samples, shape).lines;
        assert_eq!(lines.len(), 1, "{lines:?}");
        (lines[0].value() - true_at).abs() / WIDTH
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
        turn_back(&mut samples);
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
        turn_back(&mut samples);
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

    /// The same places, passed the other way.
    fn turn_back(samples: &mut [SignalSample]) {
        samples.reverse();
        for (number, it) in (0_u32..).zip(samples) {
            it.at = Time::ZERO + number * SAMPLING;
        }
    }

    #[test]
    fn what_is_no_line_is_left_out_and_what_is_beside_one_is_told() {
        let wide = |off: f64| gaussian(off / 2.0);
        let seen_wide = lines_in(&seen(0.25, 0.0, &[0.1], wide), &SHAPE);
        assert!(seen_wide.lines.is_empty() && seen_wide.wide.len() == 1);
        let speck = |off: f64| gaussian(off * 3.0);
        let specks = lines_in(&seen(0.1, 0.0, &[0.1], speck), &SHAPE);
        assert!(specks.lines.is_empty() && specks.wide.is_empty());
        let scratched = seen(0.25, 0.0, &[0.1, 0.1 + 0.6 * WIDTH], gaussian);
        let scratched = lines_in(&scratched, &SHAPE);
        assert!(scratched.lines.is_empty());
        let [wide] = scratched.wide[..] else {
            panic!("{scratched:?}")
        };
        assert!((wide.value() - 0.1 - 0.3 * WIDTH).abs() < 0.01 * WIDTH);
        assert_eq!(lines_in(&[], &SHAPE), LinesSeen::default());
    }

    /// Of a line in the middle, one at each end: where it is, and whether it is told.
    #[test]
    fn a_line_that_lacks_samples_is_not_told_and_one_that_is_hidden_wholly_is_not_called_absent() {
        let all = seen(0.25, 0.0, &[0.1], gaussian);
        let beyond = |reach: f64| {
            let far = move |it: &&SignalSample| (it.position.value() - 0.1).abs() > reach * WIDTH;
            lines_in(&all.iter().filter(far).copied().collect::<Vec<_>>(), &SHAPE)
        };
        let mut one = all.clone();
        one.remove(all.iter().position(|it| it.position.value() > 0.1).unwrap());
        // One sample, the line's middle, all of its window and more.
        for seen in [
            lines_in(&one, &SHAPE),
            beyond(0.4),
            beyond(1.0),
            beyond(5.0),
        ] {
            assert!(seen.lines.is_empty() && seen.wide.is_empty(), "{seen:?}");
            assert!(seen.has_gaps() && seen.lacks(Radians(0.1)), "{seen:?}");
            assert!(!seen.lacks(Radians(0.05)), "{seen:?}");
        }
        let mut back = all.clone();
        turn_back(&mut back);
        back.drain(..back.len() / 4);
        let seen_back = lines_in(&back, &SHAPE);
        assert!(!seen_back.has_gaps() && seen_back.lacks(Radians(0.16)));
        assert_eq!(seen_back.lines.len(), 1);
        let at_the_end = lines_in(&seen(0.25, 0.0, &[0.0005], gaussian), &SHAPE);
        assert!(at_the_end.lines.is_empty() && at_the_end.lacks(Radians(0.0005)));
        assert!(LinesSeen::default().lacks(Radians(0.1)));
    }
}
