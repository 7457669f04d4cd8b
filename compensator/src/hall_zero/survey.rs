//! Where the magnets are, when they are not where the search looked for them, and what that says of
//! the axis: how far it goes for what it is commanded, and which way.
//!
//! A pass over the travel shows the pattern wherever it is. It is taken for the pattern only where both
//! curves have their shape: curve 1 falls by Vc on both sides of its largest maximum and is even about the
//! middle between the two places, curve 2 is odd about it and changes by Vc0 at least. A side lobe of a
//! curve that is upside down, a broken sensor, or each sensor on the other's input have no such place.
//!
//! A pass that ends within the pattern, as of an axis that goes a tenth of what it is commanded, shows the maximum of
//! curve 1 and what lies before it. The middle is then that maximum, and both curves must have their shape about it
//! as far as the pass went beyond it.
//!
//! Absent: patterns that lie within the search limit of the nominal zero. There the place of a limit
//! switch, which nobody knows better, explains as much as the axis does.

use units::{Metres, Volts};

use super::{HallPoint, Settings};
use crate::least_squares::polynomial;

/// By how much of its fall curve 1 may be uneven, and curve 2 of its change not odd: a plate that is not
/// parallel and samples that lie far apart leave less.
const ASYMMETRY_MAX: f64 = 0.2;

/// Places on either side at which symmetry is looked at.
const PLACES: u32 = 8;

/// The outermost of them, as a multiple of where curve 1 has fallen by Vc: the flank of a side lobe towards
/// the middle is a good deal lower there than the other.
const REACH: f64 = 1.6;

/// A pass that ends within the pattern must go beyond its middle by this share of the distance to where curve 1 has
/// fallen by Vc.
const COVERED_MIN: f64 = 0.25;

/// Voltages are known up to the last point of a pass, which is beyond the last place that is looked at.
const WITHIN: f64 = 0.99;

/// Over this share of that distance on either side the maximum of curve 1 is a parabola.
const PARABOLA: f64 = 0.25;

/// A pattern that was passed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pattern {
    /// Where its middle is.
    pub middle: Metres,
    /// Whether curve 2 rises with the position there.
    pub slope_rises: bool,
}

/// What the place of the pattern says of the axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mistake {
    /// It goes this many times as far as it is commanded.
    Scale {
        /// True over commanded.
        factor: f64,
    },
    /// It goes the other way, and began at its other end.
    Direction,
}

/// The pattern among `points`, which are those of a pass in one direction; `None` where nothing has its
/// shape.
#[must_use]
pub fn pattern(points: &[HallPoint], settings: &Settings) -> Option<Pattern> {
    let mut points = without_spikes(points);
    points.sort_by(|a, b| a.position.value().total_cmp(&b.position.value()));
    let top = (0..points.len()).max_by(|a, b| {
        let peak = |at: &usize| points[*at].peak.value();
        peak(a).total_cmp(&peak(b))
    })?;
    let level = points[top].peak - settings.vc;
    let (before, after) = points.split_at(top);
    let left = crossing(before.iter().rev().zip(before.iter().rev().skip(1)), level)?;
    match crossing(after.iter().zip(after.iter().skip(1)), level) {
        Some(right) => whole(&points, left, right, settings),
        None => begun(&points, top, left, settings),
    }
}

/// The pattern between two places at which curve 1 has fallen by Vc.
fn whole(
    points: &[HallPoint],
    left: Metres,
    right: Metres,
    settings: &Settings,
) -> Option<Pattern> {
    let (middle, half) = ((left + right) / 2.0, (right - left) / 2.0);
    let curves = Curves { points, middle };
    let covered = points.last()?.position - middle;
    let reach = (half * REACH).min(covered * WITHIN);
    let is_shaped = curves.is_even(reach, settings.vc) && curves.is_odd(reach);
    let change = curves.slope(half)? - curves.slope(-half)?;
    (is_shaped && change.abs() >= settings.vc0).then_some(Pattern {
        middle,
        slope_rises: change > Volts::ZERO,
    })
}

/// The pattern in which a pass ended, beyond its maximum at the point `top`.
fn begun(points: &[HallPoint], top: usize, left: Metres, settings: &Settings) -> Option<Pattern> {
    let half = points[top].position - left;
    let middle = vertex(points, points[top].position, half * PARABOLA)?;
    let covered = points.last()?.position - middle;
    // One that was passed as far as whole ones are judged has no end that is missing.
    let is_within = covered >= half * COVERED_MIN && covered < half * REACH;
    if !is_within {
        return None;
    }
    let curves = Curves { points, middle };
    let reach = covered * WITHIN;
    let fall = curves.peak(Metres::ZERO)? - curves.peak(-reach)?;
    let is_shaped = fall > settings.delta1 && curves.is_even(reach, fall) && curves.is_odd(reach);
    let change = curves.slope(reach)? - curves.slope(-reach)?;
    (is_shaped && change.abs() >= settings.vc0).then_some(Pattern {
        middle,
        slope_rises: change > Volts::ZERO,
    })
}

/// Where curve 1 is highest, by a parabola through the points that far around `place`.
fn vertex(points: &[HallPoint], place: Metres, around: Metres) -> Option<Metres> {
    let near = points
        .iter()
        .filter(|it| (it.position - place).abs() <= around);
    let (x, y): (Vec<f64>, Vec<f64>) = near
        .map(|it| ((it.position - place) / around, it.peak.value()))
        .unzip();
    let fit = polynomial(&x, &y, 2).ok()?;
    let [_, slope, bend] = fit.coefficients[..] else {
        return None;
    };
    let at = -slope / (2.0 * bend);
    (bend < 0.0 && at.abs() <= 1.0).then_some(place + around * at)
}

/// What a pattern found by a pass from the limit switch at `limit`, the nominal zero being at `nominal`,
/// says of the axis; `None` where it lies as near to the nominal zero as the search looks for it.
#[must_use]
pub fn mistake(
    pattern: &Pattern,
    limit: Metres,
    nominal: Metres,
    settings: &Settings,
) -> Option<Mistake> {
    let (configured, seen) = (nominal - limit, pattern.middle - limit);
    let is_elsewhere = (configured - seen).abs() > settings.search_limit;
    if !is_elsewhere || seen <= Metres::ZERO {
        return None;
    }
    if pattern.slope_rises != settings.slope_rising {
        return Some(Mistake::Direction);
    }
    let factor = configured / seen;
    Some(Mistake::Scale { factor })
}

/// Each voltage the middle one of three neighbours.
fn without_spikes(points: &[HallPoint]) -> Vec<HallPoint> {
    let middle = |a: Volts, b: Volts, c: Volts| a.max(b).min(a.min(b).max(c));
    let of = |three: &[HallPoint]| HallPoint {
        position: three[1].position,
        peak: middle(three[0].peak, three[1].peak, three[2].peak),
        slope: middle(three[0].slope, three[1].slope, three[2].slope),
    };
    points.windows(3).map(of).collect()
}

/// Where curve 1 first falls below `level` from one point to the next.
fn crossing<'a>(
    mut pairs: impl Iterator<Item = (&'a HallPoint, &'a HallPoint)>,
    level: Volts,
) -> Option<Metres> {
    let (from, to) = pairs.find(|(_, to)| to.peak < level)?;
    let share = ((from.peak - level) / (from.peak - to.peak)).clamp(0.0, 1.0);
    Some(from.position + (to.position - from.position) * share)
}

/// Both curves about a middle.
struct Curves<'a> {
    points: &'a [HallPoint],
    middle: Metres,
}

impl Curves<'_> {
    /// A voltage at a distance from the middle, between points in proportion.
    fn at(&self, distance: Metres, of: impl Fn(&HallPoint) -> Volts) -> Option<Volts> {
        let place = self.middle + distance;
        let next = self.points.partition_point(|it| it.position < place);
        let (a, b) = (
            self.points.get(next.checked_sub(1)?)?,
            self.points.get(next)?,
        );
        let share = (place - a.position) / (b.position - a.position);
        Some(of(a) + (of(b) - of(a)) * share)
    }

    fn peak(&self, distance: Metres) -> Option<Volts> {
        self.at(distance, |it| it.peak)
    }

    fn slope(&self, distance: Metres) -> Option<Volts> {
        self.at(distance, |it| it.slope)
    }

    /// Whether curve 1 is the same on both sides, as far as that; it falls by so much.
    fn is_even(&self, reach: Metres, fall: Volts) -> bool {
        places(reach).all(|at| {
            let apart = self
                .peak(at)
                .zip(self.peak(-at))
                .map(|(a, b)| (a - b).abs());
            apart.is_some_and(|it| it <= fall * ASYMMETRY_MAX)
        })
    }

    /// Whether curve 2 is as far above its value in the middle on one side as below it on the other, as far as
    /// that.
    fn is_odd(&self, reach: Metres) -> bool {
        let Some(middle) = self.slope(Metres::ZERO) else {
            return false;
        };
        let both = |at: Metres| self.slope(at).zip(self.slope(-at));
        let largest = places(reach).filter_map(both).map(|(a, b)| (a - b).abs());
        let largest = largest.fold(Volts::ZERO, Volts::max);
        places(reach).all(|at| {
            let off = both(at).map(|(a, b)| ((a + b) / 2.0 - middle).abs());
            off.is_some_and(|it| it <= largest * ASYMMETRY_MAX)
        })
    }
}

fn places(reach: Metres) -> impl Iterator<Item = Metres> {
    (1..=PLACES).map(move |at| reach * (f64::from(at) / f64::from(PLACES)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hall_zero::rig::{Magnets, Noise};

    /// A stage whose axis goes `factor` times as far as it is commanded.
    struct Stage {
        magnets: Magnets,
        factor: f64,
        /// True distance from the limit switch to the magnets, millimetres.
        distance_mm: f64,
        noise_v: f64,
        repeatability_mm: f64,
        lost_motion_mm: f64,
    }

    impl Stage {
        /// Sound, of any kind.
        fn drawn(noise: &mut Noise) -> Self {
            let mut log = |low: f64, high: f64| low * (high / low).powf(noise.uniform());
            let (noise_v, repeatability_mm) = (log(0.02e-3, 0.5e-3), log(5e-6, 1e-3));
            Self {
                magnets: Magnets::drifted(noise, 0.01),
                factor: 1.0,
                distance_mm: 6.0 + noise.within(1.8),
                noise_v,
                repeatability_mm,
                lost_motion_mm: 0.02 * noise.uniform(),
            }
        }

        /// A pass from the switch at −6 mm to `end_mm`, as commanded; voltages go through `wires`.
        fn pass(
            &self,
            end_mm: f64,
            noise: &mut Noise,
            wires: impl Fn([f64; 2]) -> [f64; 2],
        ) -> Vec<HallPoint> {
            // A tenth of the search limit at most, however far that is in truth.
            let step_mm = 0.2 * (0.2 + 0.8 * noise.uniform()) / self.factor.abs().max(2.0);
            let count = ((end_mm + 6.0) / step_mm) as u32;
            let at = |number: u32| {
                let mm = f64::from(number) * step_mm;
                let off = self.repeatability_mm * noise.normal() + self.lost_motion_mm;
                let volts = self
                    .magnets
                    .volts(mm * self.factor + off - self.distance_mm);
                let [peak, slope] = wires(volts);
                HallPoint {
                    position: Metres::from_mm(mm - 6.0),
                    peak: Volts(peak + self.noise_v * noise.normal()),
                    slope: Volts(slope + self.noise_v * noise.normal()),
                }
            };
            (0..count).map(at).collect()
        }
    }

    fn seen(points: &[HallPoint]) -> Option<Mistake> {
        let settings = Settings::default();
        let pattern = pattern(points, &settings)?;
        mistake(&pattern, Metres::from_mm(-6.0), Metres::ZERO, &settings)
    }

    /// How many of `count` sound stages, whose search failed for whatever reason, are blamed.
    fn blamed(count: u64, seed: u64) -> usize {
        let one = |at: u64| {
            let mut noise = Noise(seed.wrapping_add(at.wrapping_mul(0x9E37_79B9_7F4A_7C15)));
            let stage = Stage::drawn(&mut noise);
            // Some passes end short of the magnets, or among them.
            let end = if at % 12 < 6 { 63.0 } else { noise.within(4.0) };
            let points = match at % 6 {
                0 | 1 => stage.pass(end, &mut noise, |it| it),
                2 => stage.pass(end, &mut noise, |[v1, v2]| [5.0 - v1, v2]),
                3 => stage.pass(end, &mut noise, |[v1, v2]| [v2, v1]),
                4 => stage.pass(end, &mut noise, |[_, v2]| [2.5, v2]),
                _ => stage.pass(end, &mut noise, |[v1, _]| [v1, 2.5]),
            };
            seen(&points)
        };
        (0..count).filter_map(one).count()
    }

    /// Changes with this file.
    fn seed() -> u64 {
        let given = std::env::var("SEED").ok().and_then(|it| it.parse().ok());
        let step = |hash: u64, byte: u8| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01B3);
        let of_source = || {
            include_str!("survey.rs")
                .bytes()
                .fold(0xCBF2_9CE4_8422_2325, step)
        };
        given.unwrap_or_else(of_source)
    }

    #[test]
    fn a_sound_stage_is_never_blamed_whatever_failed() {
        assert_eq!(blamed(120, seed()), 0);
    }

    #[test]
    #[ignore = "a count over thousands of stages"]
    fn sound_stages_counted_over_many() {
        const COUNT: u64 = 6000;
        let blamed = blamed(COUNT, seed());
        println!("a wrong scale or direction named of {blamed} of {COUNT} sound stages");
        assert!(blamed as u64 <= COUNT / 1000);
    }

    #[test]
    fn a_wrong_scale_is_seen_by_where_the_pattern_is_passed() {
        for factor in [0.125, 0.25, 0.5, 2.0, 4.0, 10.0] {
            for seed in 0..10 {
                let mut noise = Noise(seed);
                let sound = Stage::drawn(&mut noise);
                let stage = Stage {
                    factor,
                    distance_mm: 6.0,
                    ..sound
                };
                let seen = seen(&stage.pass(63.0, &mut noise, |it| it));
                let Some(Mistake::Scale { factor: it }) = seen else {
                    panic!("{factor}: {seen:?}");
                };
                assert!((it / factor - 1.0).abs() < 0.02, "{factor}: {it}");
            }
        }
    }

    #[test]
    fn a_pass_that_ends_within_the_pattern_tells_it_once_it_is_beyond_its_middle() {
        for (end_mm, is_told) in [(52.0, false), (56.0, true), (58.0, true), (60.0, true)] {
            for seed in 0..10 {
                let mut noise = Noise(seed);
                let sound = Stage::drawn(&mut noise);
                let stage = Stage {
                    factor: 0.1,
                    distance_mm: 6.0,
                    lost_motion_mm: 0.0,
                    ..sound
                };
                let seen = seen(&stage.pass(end_mm, &mut noise, |it| it));
                match (seen, is_told) {
                    (Some(Mistake::Scale { factor: it }), true) => {
                        assert!((it / 0.1 - 1.0).abs() < 0.04, "{end_mm}: {it}");
                    }
                    (None, false) => {}
                    _ => panic!("{end_mm} mm, {seed}: {seen:?}"),
                }
            }
        }
    }

    #[test]
    fn another_direction_is_seen_by_the_odd_curve() {
        for seed in 0..10 {
            let mut noise = Noise(seed);
            let sound = Stage::drawn(&mut noise);
            let stage = Stage {
                factor: -1.0,
                distance_mm: -60.0,
                ..sound
            };
            let seen = seen(&stage.pass(63.0, &mut noise, |it| it));
            assert_eq!(seen, Some(Mistake::Direction));
        }
    }

    #[test]
    fn a_pass_that_met_no_pattern_says_nothing() {
        let mut noise = Noise(1);
        let stage = Stage::drawn(&mut noise);
        let far = stage.pass(63.0, &mut noise, |_| [2.0, 2.5]);
        assert_eq!(pattern(&far, &Settings::default()), None);
        assert_eq!(pattern(&[], &Settings::default()), None);
        let short = stage.pass(-5.0, &mut noise, |it| it);
        assert_eq!(pattern(&short, &Settings::default()), None);
    }
}
