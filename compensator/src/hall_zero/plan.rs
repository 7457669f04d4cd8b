//! Vc and the bands of the search, from measured curves.
//!
//! Source: CN101551226A, description and claim 15. Any Vc with 0 < Vc < V1max − V1min − δ1 gives a zero; a good one
//! only where sensor 2 is linear at P1 and P2 (they lie between its poles: otherwise the zero is far worse than that
//! of the older methods), and sensor 1 steep at G1 and G2.
//!
//! Which of those is best the curves tell themselves: for each Vc the zero is found in the very passes that were
//! made over them, cut where it would be cut, and its standard uncertainty is compared. That is the one of the
//! noise, the only part that depends on Vc.
//!
//! | symbol | name here |
//! |---|---|
//! | Vc, Vc0, δ1 … δ4 | of [`ZeroPlan::settings`] |
//! | V1max − V1min | [`ZeroPlan::depth`] |
//! | slope of sensor 1 at G1, G2 against its steepest | [`PlannedLevel::steepness`] |
//! | slope of sensor 2 at P1, P2 against that at the zero | [`PlannedLevel::linearity`] |
//!
//! Absent: what the stage repeats to, which no Vc changes; the shape of the curves after a drift.

use core::time::Duration;

use units::{Approach, Metres, Volts};

use super::profile::{Bin, profile, slopes};
use super::refine::crossing;
use super::{Pass, RefineError, RefineOptions, Settings, SettingsError, ZeroEstimate, refine};
use crate::uncertainty::rms;

/// Sensor 1 is steep where it climbs at least so fast, as a share of its steepest: at G1 and G2 …
const STEEP_MIN: f64 = 0.7;
/// … and where the flanks are cut, above them, where the slope still grows. (Passes that end a tenth beyond G1 and G2
/// show less of that growth than a sweep: what a plan allows, a zero does not blame.)
const STEEP_CUT_MIN: f64 = 0.8;
/// Sensor 2 is linear where it climbs at least so fast, as a share of its slope at the zero.
const LINEAR_MIN: f64 = 0.5;
/// Levels that are tried, from the peak to V1min.
const LEVELS: u32 = 40;
/// Levels whose zeros are no less certain than the best one's by more than this are as good: the highest of them
/// lies furthest from where the curves end.
const AS_GOOD: f64 = 1.05;
/// Bins of the curves whose slopes are looked at.
const BINS: usize = 64;
/// A stop lies so many samples behind the band that asked for it.
const LATE_SAMPLES: f64 = 3.0;
/// A band holds so many times the noise of a sample, or so many times what a stop is late.
const NOISES: f64 = 6.0;
const STOPS: f64 = 2.0;
/// Vc0 and δ4 as shares of Vc.
const TURN_SHARE: f64 = 0.3;
const CHECK_SHARE: f64 = 0.1;
/// At the rails this share of their distance is kept free.
const RAIL_SHARE: f64 = 0.02;

/// What one Vc would come to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlannedLevel {
    /// It.
    pub vc: Volts,
    /// Where G1 and G2 lie.
    pub flanks: [Metres; 2],
    /// The slope of sensor 1 at the flatter of G1 and G2, as a share of the steepest.
    pub steepness: f64,
    /// The slope of sensor 2 at the flatter of P1 and P2, as a share of that at the zero.
    pub linearity: f64,
    /// How far the voltages stay from the nearest rail.
    pub rail_margin: Volts,
    /// Standard uncertainty of the zero of one pass, from the noise.
    pub standard_uncertainty: Metres,
    /// Whether it is within what the patent asks for.
    pub fits: bool,
}

/// Constants of a search that fit the curves.
#[derive(Clone, Debug, PartialEq)]
pub struct ZeroPlan {
    /// The settings given, with Vc, Vc0, the bands and the noise that are proposed.
    pub settings: Settings,
    /// What the proposed Vc comes to.
    pub chosen: PlannedLevel,
    /// What the Vc of the settings given comes to; `None` where it gives no zero.
    pub given: Option<PlannedLevel>,
    /// Every Vc that was tried and could be judged, from the peak down.
    pub levels: Vec<PlannedLevel>,
    /// V1max − V1min, on the side where that is less.
    pub depth: Volts,
    /// The steepest slope of the flatter flank, V/m.
    pub steepest_v_per_m: f64,
    /// The slope of sensor 2 at the zero, V/m.
    pub centre_slope_v_per_m: f64,
}

/// Why no Vc can be proposed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PlanError {
    /// At no level there is a zero; why at the one half-way down.
    #[error("no level of the peak sensor gives a zero in this sweep: {source}")]
    NoZero {
        /// Why.
        source: RefineError,
    },
    /// Nowhere both sensors are as they must be.
    #[error(
        "at no level the peak sensor is steep ({:.0} % of its steepest) where the slope sensor is linear ({:.0} % of its \
         slope at the zero) and both are off their rails; nearest is {} V below the peak, with {:.0} % and {:.0} %. \
         Both groups of magnets do not fit each other, or a sensor sits off its group",
        STEEP_MIN * 100.0, LINEAR_MIN * 100.0, units::Short(nearest.vc.value()), nearest.steepness * 100.0,
        nearest.linearity * 100.0
    )]
    NoLevel {
        /// The one that is nearest to it.
        nearest: Box<PlannedLevel>,
    },
    /// What follows for the bands cannot work.
    #[error(transparent)]
    Settings(#[from] SettingsError),
}

/// Proposes Vc and the bands for a search with `settings` otherwise, from `passes` over both flanks, of samples that
/// are taken every `sampling`.
///
/// # Errors
/// When no level gives a zero, or none is within what the patent asks for.
///
/// # Example
///
/// ```
/// use core::time::Duration;
/// use compensator::hall_zero::{HallPoint, Pass, Settings, plan_zero};
/// use units::{Approach, Metres, Volts};
///
/// // Curves that a person may draw, with 0.1 mV of something like noise.
/// let point = |step: i32| {
///     let mm = 0.005 * f64::from(step);
///     let (slope, peak) = ((1.2 * mm).sin(), (1.5 * mm).cos());
///     let noise = 1e-4 * f64::from((step * 7).rem_euclid(13) - 6) / 4.0;
///     let (peak, slope) = (Volts(2.0 + 0.9 * peak + noise), Volts(2.5 + 0.7 * slope - noise));
///     HallPoint { position: Metres::from_mm(mm), peak, slope }
/// };
/// let pass = |steps: Vec<i32>, approach| Pass { approach, points: steps.into_iter().map(point).collect() };
/// let there = pass((-380..=380).collect(), Approach::Forward);
/// let back = pass((-380..=380).rev().collect(), Approach::Reverse);
/// let plan = plan_zero(&[there, back], &Settings::default(), Duration::from_millis(5))?;
/// assert!(plan.chosen.fits && plan.settings.validate().is_ok());
/// # Ok::<(), compensator::hall_zero::PlanError>(())
/// ```
pub fn plan_zero(
    passes: &[Pass],
    settings: &Settings,
    sampling: Duration,
) -> Result<ZeroPlan, PlanError> {
    let mut levels = Vec::new();
    let mut middle = None;
    let mut refused = None;
    let curves = Curves::of(passes);
    let depth = curves.depth;
    for number in 1..LEVELS {
        let share = f64::from(number) / f64::from(LEVELS);
        // In whole millivolts, as it will stand in a configuration.
        let vc = Volts((depth.value() * share * 1e3).round() * 1e-3);
        match judged(passes, &curves, settings, vc) {
            Ok((level, estimate)) => {
                levels.push(level);
                middle = middle.or(Some(estimate));
            }
            Err(source) if number == LEVELS / 2 || refused.is_none() => refused = Some(source),
            Err(_) => {}
        }
    }
    let Some(estimate) = middle else {
        let source = refused.expect("each level was judged or refused");
        return Err(PlanError::NoZero { source });
    };
    let chosen = best(&levels)?;
    let curves = curves.about(estimate.origin);
    let noise = estimate.noise_peak.max(estimate.noise_slope);
    let bands = Bands {
        noise,
        sampling,
        steepest: curves.steepest(),
        centre: estimate.centre_slope_v_per_m.abs(),
        below_peak: (estimate.peak_max - curves.peak_at(estimate.origin)).max(Volts::ZERO),
    };
    let proposed = bands.proposed(settings, chosen.vc);
    proposed.validate()?;
    Ok(ZeroPlan {
        settings: proposed,
        chosen,
        given: judged(passes, &curves, settings, settings.vc)
            .ok()
            .map(|it| it.0),
        levels,
        depth,
        steepest_v_per_m: curves.steepest(),
        centre_slope_v_per_m: estimate.centre_slope_v_per_m,
    })
}

/// What a Vc would come to, and a zero found with it.
fn judged(
    passes: &[Pass],
    curves: &Curves,
    settings: &Settings,
    vc: Volts,
) -> Result<(PlannedLevel, ZeroEstimate), RefineError> {
    let options = RefineOptions::for_search(&Settings { vc, ..*settings });
    let zeros: Vec<ZeroEstimate> = passes
        .iter()
        .map(|it| refine(&it.points, &options))
        .collect::<Result<_, _>>()?;
    let none = RefineError::TooFewPasses {
        approach: Approach::Forward,
        seen: 0,
    };
    let first = *zeros.first().ok_or(none)?;
    let of_noise: Vec<f64> = zeros
        .iter()
        .map(|it| it.standard_uncertainty.value())
        .collect();
    let curves = curves.about(first.origin);
    let shape = curves.at_level(vc);
    let span = settings.rail_high - settings.rail_low;
    let rail_margin = curves.rail_margin(settings, vc, &shape);
    let is_steep = shape.steepness >= STEEP_MIN && shape.steepness_of_cut >= STEEP_CUT_MIN;
    let level = PlannedLevel {
        vc,
        flanks: shape.flanks,
        steepness: shape.steepness,
        linearity: shape.linearity,
        rail_margin,
        standard_uncertainty: Metres(rms(&of_noise)),
        fits: is_steep && shape.linearity >= LINEAR_MIN && rail_margin >= span * RAIL_SHARE,
    };
    Ok((level, first))
}

/// The highest of those that fit and are as good as the best.
fn best(levels: &[PlannedLevel]) -> Result<PlannedLevel, PlanError> {
    let certain = |it: &&PlannedLevel| it.standard_uncertainty.value();
    let fitting = || levels.iter().filter(|it| it.fits);
    let least = fitting().min_by(|a, b| certain(a).total_cmp(&certain(b)));
    let as_good =
        |it: &&PlannedLevel| least.is_some_and(|best| certain(it) <= certain(&best) * AS_GOOD);
    match fitting().find(as_good) {
        Some(chosen) => Ok(*chosen),
        None => {
            let lacks = |it: &&PlannedLevel| {
                (it.steepness / STEEP_MIN)
                    .min(it.linearity / LINEAR_MIN)
                    .min(1.0)
            };
            let nearest = levels.iter().max_by(|a, b| lacks(a).total_cmp(&lacks(b)));
            let nearest = nearest.expect("a level was judged");
            Err(PlanError::NoLevel {
                nearest: Box::new(*nearest),
            })
        }
    }
}

/// Why a zero is less certain than it could be: Vc lies where the curves are flat.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlatLevel {
    /// The slope of sensor 1 where its flanks are cut or at G1 and G2, as a share of the steepest that was passed.
    pub steepness: f64,
    /// The slope of sensor 2 at the flatter of P1 and P2, as a share of that at the zero.
    pub linearity: f64,
}

/// Whether the Vc of a search lies where the curves that were passed are flat.
pub fn flat_level(passes: &[Pass], estimate: &ZeroEstimate, vc: Volts) -> Option<FlatLevel> {
    let shape = Curves::of(passes).about(estimate.origin).at_level(vc);
    let steepness = (shape.steepness / STEEP_MIN).min(shape.steepness_of_cut / STEEP_CUT_MIN);
    let is_flat = steepness < 1.0 || shape.linearity < LINEAR_MIN;
    is_flat.then_some(FlatLevel {
        steepness: shape.steepness.min(shape.steepness_of_cut),
        linearity: shape.linearity,
    })
}

/// Both curves as a plot shows them.
#[derive(Clone)]
struct Curves {
    bins: Vec<Bin>,
    /// Position, slope of V1, slope of V2 between bins.
    slopes: Vec<(f64, f64, f64)>,
    top: usize,
    origin: f64,
    depth: Volts,
}

/// What curves are at a level.
struct Shape {
    flanks: [Metres; 2],
    steepness: f64,
    steepness_of_cut: f64,
    linearity: f64,
}

impl Curves {
    /// About the maximum of curve 1.
    fn of(passes: &[Pass]) -> Self {
        let points: Vec<_> = passes
            .iter()
            .flat_map(|it| it.points.iter().copied())
            .collect();
        let bins = profile(&points, BINS);
        let top = (0..bins.len())
            .max_by(|&a, &b| bins[a].peak.total_cmp(&bins[b].peak))
            .unwrap_or(0);
        let lowest = |part: &[Bin]| part.iter().map(|it| it.peak).fold(f64::INFINITY, f64::min);
        let depth = bins.get(top).map_or(0.0, |it| {
            it.peak - lowest(&bins[..=top]).max(lowest(&bins[top..]))
        });
        Self {
            slopes: slopes(&bins).collect(),
            origin: bins.get(top).map_or(0.0, |it| it.x),
            depth: Volts(depth),
            top,
            bins,
        }
    }

    /// The same about an origin.
    fn about(&self, origin: Metres) -> Self {
        Self {
            origin: origin.value(),
            ..self.clone()
        }
    }

    fn peak_at(&self, place: Metres) -> Volts {
        let near = self.bins.iter().min_by(|a, b| {
            let off = |it: &Bin| (it.x - place.value()).abs();
            off(a).total_cmp(&off(b))
        });
        Volts(near.map_or(0.0, |it| it.peak))
    }

    /// The slopes of both curves at a place.
    fn slopes_at(&self, x: f64) -> (f64, f64) {
        let near = self.slopes.iter().min_by(|a, b| {
            let off = |it: &(f64, f64, f64)| (it.0 - x).abs();
            off(a).total_cmp(&off(b))
        });
        near.map_or((0.0, 0.0), |it| (it.1, it.2))
    }

    /// The steepest slope of curve 1 on either side.
    fn steepest_of_sides(&self) -> [f64; 2] {
        let of = |is_left: bool| {
            let own = self
                .slopes
                .iter()
                .filter(|it| (it.0 < self.origin) == is_left);
            own.map(|it| it.1.abs()).fold(0.0, f64::max)
        };
        [of(true), of(false)]
    }

    fn steepest(&self) -> f64 {
        let [left, right] = self.steepest_of_sides();
        left.min(right)
    }

    /// Where curve 1 has fallen by `depth` on either side; its end where it has not.
    fn fallen(&self, depth: Volts) -> [f64; 2] {
        let level = self.bins.get(self.top).map_or(0.0, |it| it.peak) - depth.value();
        let (left, right) = (&self.bins[..=self.top], &self.bins[self.top..]);
        let outwards = |it: &Bin| (it.x, it.peak);
        let end = |part: Option<&Bin>| part.map_or(self.origin, |it| it.x);
        [
            crossing(left.iter().rev().map(outwards), level).unwrap_or_else(|| end(left.first())),
            crossing(right.iter().map(outwards), level).unwrap_or_else(|| end(right.last())),
        ]
    }

    fn at_level(&self, vc: Volts) -> Shape {
        let steepest = self.steepest_of_sides();
        let share_of = |places: [f64; 2]| {
            let share = |side: usize| self.slopes_at(places[side]).0.abs() / steepest[side];
            share(0).min(share(1))
        };
        let flanks = self.fallen(vc);
        let centre = self.slopes_at(self.origin).1;
        let linear = |x: f64| self.slopes_at(x).1 / centre;
        Shape {
            flanks: flanks.map(Metres),
            steepness: share_of(flanks),
            steepness_of_cut: share_of(self.fallen(vc * RefineOptions::CUT_SHARE)),
            linearity: linear(flanks[0]).min(linear(flanks[1])),
        }
    }

    /// How far both voltages stay from the rails between G1 and G2.
    fn rail_margin(&self, settings: &Settings, vc: Volts, shape: &Shape) -> Volts {
        let peak = self.bins.get(self.top).map_or(0.0, |it| it.peak);
        let between =
            |it: &&Bin| it.x >= shape.flanks[0].value() && it.x <= shape.flanks[1].value();
        let slope = self.bins.iter().filter(between).map(|it| it.slope);
        let voltages = [peak, peak - vc.value()].into_iter().chain(slope);
        let (low, high) = (settings.rail_low.value(), settings.rail_high.value());
        let free = voltages.map(|it| (it - low).min(high - it));
        Volts(free.fold(f64::INFINITY, f64::min))
    }
}

/// What the bands follow from.
struct Bands {
    noise: Volts,
    sampling: Duration,
    steepest: f64,
    centre: f64,
    /// How far below its maximum sensor 1 is at the zero.
    below_peak: Volts,
}

impl Bands {
    fn proposed(&self, settings: &Settings, vc: Volts) -> Settings {
        let late = |speed: units::MetresPerSecond| {
            speed.value() * self.sampling.as_secs_f64() * LATE_SAMPLES
        };
        let band = |slope: f64, way: f64| {
            let of_stop = Volts(STOPS * slope * way);
            rounded_up((self.noise * NOISES).max(of_stop))
        };
        let check = (self.below_peak * 3.0 + self.noise * NOISES).max(vc * CHECK_SHARE);
        Settings {
            vc,
            vc0: Volts((vc.value() * TURN_SHARE * 1e3).round() * 1e-3),
            delta1: band(self.steepest, late(settings.speed)),
            delta2: band(self.steepest, late(settings.creep_speed)),
            delta3: band(self.centre, late(settings.creep_speed)),
            delta4: rounded_up(check),
            noise: rounded_up(self.noise),
            ..*settings
        }
    }
}

/// Two digits of millivolts, never less.
fn rounded_up(volts: Volts) -> Volts {
    let mv = volts.value() * 1e3;
    let digit = units::portable::powi(
        10.0,
        units::portable::log10(mv.max(1e-3)).floor() as i32 - 1,
    );
    Volts((mv / digit - 1e-9).ceil() * digit * 1e-3)
}

#[cfg(test)]
#[path = "plan_tests.rs"]
mod tests;
