//! One reference beam along an axis, and the two detectors of four quadrants that see it.
//!
//! The beam starts at a source, shifts there and swings about it, and passes through a splitter
//! on the slide to the end of the travel. Each detector tells where its spot is in its own frame:
//! spot = beam − detector. A slide that goes one way sees its spot go the other way; the end
//! detector stands still and sees the beam alone.
//!
//! Quadrants are numbered A (+, +), B (−, +), C (−, −), D (+, −) in the two directions across
//! the beam. Of a Gaussian spot of radius w (1/e²) at s, the share on the positive side is
//! (1 + erf(√2·s/w))/2, in each direction by itself, so that ((A + D) − (B + C))/ΣV and
//! ((A + B) − (C + D))/ΣV are erf(√2·s/w): nearly 1.596·s/w in the middle.
//!
//! A camera may stand in a detector's place ([`SpotCamera`]); it sees the same spot.
//!
//! A reflection is a second spot: quadrants add its light to that of the beam's own.
//!
//! Absent: dead zones between quadrants, stray light, clipping of the spot.

use core::f64::consts::{SQRT_2, TAU};

use units::Time;
use units::portable::sin;

use super::config::BeamConfig;
use super::guide::Motion;
use super::reflection::Reflection;
use super::rigid::{Rotation, Vector, add, minus};
use super::spot::SpotCamera;
use crate::plant::picture::{BeamPlace as Place, Mark};
use crate::random::Stream;

/// Something that drifts to and fro between −1 and 1: three periods, drawn from the seed.
#[derive(Clone, Debug)]
struct Wander([(f64, f64, f64); 3]);

impl Wander {
    fn new(period_min: f64, stream: &mut Stream) -> Self {
        Self(
            [(0.6, 1.0), (0.3, 0.41), (0.1, 0.13)].map(|(share, of_period)| {
                let period_s = 60.0 * period_min * of_period * stream.between(0.8, 1.0);
                (share, TAU / period_s, stream.between(0.0, TAU))
            }),
        )
    }

    fn at(&self, now: Time) -> f64 {
        let seconds = now.seconds();
        let waves = self.0.iter();
        waves
            .map(|(share, per_s, phase)| share * sin(per_s * seconds + phase))
            .sum()
    }
}

/// What is wrong with a beam.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct BeamTrouble {
    /// Something stands in its way before the slide: both detectors are dark.
    pub(crate) before_slide: bool,
    /// Something stands in its way behind the slide: the end detector is dark.
    pub(crate) behind_slide: bool,
    /// Stray light, or a lamp that came too near: twice as bright.
    pub(crate) bright: bool,
    /// Somebody has knocked the source sideways, in both directions across.
    pub(crate) knocked_m: f64,
    /// What the detector on the slide sees besides, and that at the end.
    reflections: [Option<Reflection>; 2],
}

impl BeamTrouble {
    const fn index(place: Place) -> usize {
        match place {
            Place::Slide => 0,
            Place::End => 1,
        }
    }

    /// What a detector sees besides the beam.
    pub(crate) const fn reflection_mut(&mut self, place: Place) -> &mut Option<Reflection> {
        &mut self.reflections[Self::index(place)]
    }
}

#[derive(Clone, Debug)]
struct Detector {
    mounting_m: [f64; 2],
    radius_m: f64,
    turbulence: Stream,
    seen: Seen,
    camera: SpotCamera,
}

/// What a detector saw last: all channels read at one moment are of one spot.
#[derive(Clone, Copy, Debug)]
struct Seen {
    at: Time,
    volts: [f64; 4],
}

#[derive(Clone, Debug)]
pub(super) struct Beam {
    config: BeamConfig,
    travel_m: f64,
    translation: [Wander; 2],
    pivot: [Wander; 2],
    intensity: Wander,
    slide: Detector,
    end: Detector,
    pub(super) trouble: BeamTrouble,
}

impl Beam {
    pub(super) fn new(config: &BeamConfig, travel_mm: f64, axis: usize, seed: u64) -> Self {
        let mut stream = Stream::new(seed, &format!("beam {axis}"));
        let period = config.wander_period_min;
        let detector = |whose: &str| Detector::new(config, seed, &format!("beam {axis} {whose}"));
        Self {
            travel_m: travel_mm * 1e-3,
            translation: [(); 2].map(|()| Wander::new(period, &mut stream)),
            pivot: [(); 2].map(|()| Wander::new(period, &mut stream)),
            intensity: Wander::new(period, &mut stream),
            slide: detector("slide"),
            end: detector("end"),
            trouble: BeamTrouble::default(),
            config: config.clone(),
        }
    }

    /// From the source to where a detector meets the beam.
    fn distance_m(&self, place: Place, position_m: f64) -> f64 {
        let source_m = self.config.source_before_zero_mm * 1e-3;
        match place {
            Place::Slide => source_m + position_m,
            Place::End => source_m + self.travel_m + self.config.end_behind_travel_mm * 1e-3,
        }
    }

    /// How far the beam is off its place, across, so far from its source.
    pub(super) fn offset_m(&self, distance_m: f64, now: Time) -> [f64; 2] {
        [0, 1].map(|across| {
            let shift = self.config.translation_um * 1e-6 * self.translation[across].at(now);
            let swing = self.config.pivot_urad * 1e-6 * self.pivot[across].at(now);
            shift + swing * distance_m + self.trouble.knocked_m
        })
    }

    /// Where the slide's detector is off its nominal place, across.
    pub(super) fn detector_m(&self, motion: &Motion, [first, second]: [usize; 2]) -> [f64; 2] {
        let place: Vector = self.config.detector_place_mm.map(|mm| mm * 1e-3);
        let turned = Rotation::about_x_y_z(motion.turn).turn(place);
        let moved = add(motion.shift, minus(turned, place));
        [moved[first], moved[second]]
    }

    /// The spot in the detector's own frame.
    fn spot_m(
        &self,
        place: Place,
        position_m: f64,
        (motion, across): (&Motion, [usize; 2]),
        now: Time,
    ) -> [f64; 2] {
        let beam = self.offset_m(self.distance_m(place, position_m), now);
        if place == Place::End {
            return beam;
        }
        let slide = self.detector_m(motion, across);
        let mut spot = [0.0; 3];
        for (along, (beam, slide)) in across.into_iter().zip(beam.into_iter().zip(slide)) {
            spot[along] = beam - slide;
        }
        let seen = Rotation::about_x_y_z(motion.turn).inverse().turn(spot);
        across.map(|along| seen[along])
    }

    fn light(&self, place: Place, now: Time) -> f64 {
        let dark = match place {
            Place::Slide => self.trouble.before_slide,
            Place::End => self.trouble.before_slide || self.trouble.behind_slide,
        };
        if dark {
            return 0.0;
        }
        let drift = self.config.intensity_drift_percent * 1e-2 * self.intensity.at(now);
        (1.0 + drift) * if self.trouble.bright { 2.0 } else { 1.0 }
    }

    /// The voltages of the quadrants, without the noise of their channels, where the detector has
    /// been looked at before at this moment.
    pub(super) fn seen(&self, place: Place, now: Time) -> Option<[f64; 4]> {
        let detector = match place {
            Place::Slide => &self.slide,
            Place::End => &self.end,
        };
        (detector.seen.at == now).then_some(detector.seen.volts)
    }

    /// What turbulent air does to the spot there.
    fn turbulence_m(&self, place: Place, position_m: f64) -> f64 {
        let share = self.distance_m(place, position_m) / self.distance_m(Place::End, 0.0);
        self.config.turbulence_um * 1e-6 * share
    }

    const fn reflection(&self, place: Place) -> Option<Reflection> {
        self.trouble.reflections[BeamTrouble::index(place)]
    }

    const fn detector_mut(&mut self, place: Place) -> &mut Detector {
        match place {
            Place::Slide => &mut self.slide,
            Place::End => &mut self.end,
        }
    }

    /// The camera in a detector's place opens its shutter.
    pub(super) fn open_shutter(
        &mut self,
        place: Place,
        position_m: f64,
        motion: (&Motion, [usize; 2]),
        now: Time,
    ) {
        let spot = self.spot_m(place, position_m, motion, now);
        let detector = self.detector_mut(place);
        detector.camera.open(detector.off_middle(spot));
    }

    /// It closes its shutter: what its picture shows.
    pub(super) fn close_shutter(
        &mut self,
        place: Place,
        position_m: f64,
        motion: (&Motion, [usize; 2]),
        now: Time,
    ) -> Vec<Mark> {
        let spot = self.spot_m(place, position_m, motion, now);
        let (light, turbulence_m) = (self.light(place, now), self.turbulence_m(place, position_m));
        let reflection = self.reflection(place);
        let detector = self.detector_mut(place);
        let spot = detector.off_middle(spot);
        detector.camera.close(spot, light, turbulence_m, reflection)
    }

    /// Looks at a detector, the first time at this moment.
    pub(super) fn look(
        &mut self,
        place: Place,
        position_m: f64,
        motion: (&Motion, [usize; 2]),
        now: Time,
    ) -> [f64; 4] {
        let spot = self.spot_m(place, position_m, motion, now);
        let light_v = self.light(place, now) * self.config.sum_v;
        let turbulence_m = self.turbulence_m(place, position_m);
        let reflection = self.reflection(place);
        let detector = self.detector_mut(place);
        let volts = detector.quadrants(spot, turbulence_m, reflection);
        let volts = volts.map(|it| it * light_v);
        detector.seen = Seen { at: now, volts };
        volts
    }
}

impl Detector {
    fn new(config: &BeamConfig, seed: u64, whose: &str) -> Self {
        let mut stream = Stream::new(seed, whose);
        let mounting_m = config.mounting_um * 1e-6;
        let tolerance = config.radius_tolerance_percent * 1e-2;
        Self {
            mounting_m: [(); 2].map(|()| stream.between(-mounting_m, mounting_m)),
            radius_m: config.spot_radius_mm * 1e-3 * (1.0 + stream.between(-tolerance, tolerance)),
            turbulence: Stream::new(seed, &format!("{whose} turbulence")),
            seen: Seen {
                at: Time::NEVER,
                volts: [0.0; 4],
            },
            camera: SpotCamera::new(config, seed, whose),
        }
    }

    /// The spot, from the middle of the detector as it is mounted.
    fn off_middle(&self, spot_m: [f64; 2]) -> [f64; 2] {
        core::array::from_fn(|k| spot_m[k] - self.mounting_m[k])
    }

    /// The light on A, B, C and D, by that of the beam.
    fn quadrants(
        &mut self,
        spot_m: [f64; 2],
        turbulence_m: f64,
        reflection: Option<Reflection>,
    ) -> [f64; 4] {
        let own_m = self
            .off_middle(spot_m)
            .map(|off_m| off_m + turbulence_m * self.turbulence.gaussian());
        let mut light = self.shares(own_m);
        if let Some(Reflection { off_m, share }) = reflection {
            let beside = self.shares([0, 1].map(|k| own_m[k] + off_m[k]));
            for (light, beside) in light.iter_mut().zip(beside) {
                *light += share * beside;
            }
        }
        light
    }

    /// The shares of a spot's light on A, B, C and D.
    fn shares(&self, spot_m: [f64; 2]) -> [f64; 4] {
        let ratio = spot_m.map(|off_m| erf(SQRT_2 * off_m / self.radius_m));
        let share =
            |first: f64, second: f64| (1.0 + first * ratio[0]) * (1.0 + second * ratio[1]) / 4.0;
        [
            share(1.0, 1.0),
            share(-1.0, 1.0),
            share(-1.0, -1.0),
            share(1.0, -1.0),
        ]
    }
}

/// The error function, by its Maclaurin series; beyond 4 it is 1 to within 2·10⁻⁸.
fn erf(x: f64) -> f64 {
    const FAR: f64 = 4.0;
    const TERMS: i32 = 60;
    /// A quarter of what the last bit of a number is worth at least, as a share of the number.
    const NOTHING: f64 = f64::EPSILON / 8.0;
    if x.abs() > FAR {
        return x.signum();
    }
    let mut power = x;
    let mut sum = x;
    for n in 1..TERMS {
        power *= -x * x / f64::from(n);
        let term = power / f64::from(2 * n + 1);
        sum += term;
        // Terms that have become smaller than the one before stay so: no later one counts.
        if f64::from(n) > x * x && term.abs() < sum.abs() * NOTHING {
            break;
        }
    }
    core::f64::consts::FRAC_2_SQRT_PI * sum
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Abramowitz and Stegun, table 7.1.
    #[test]
    fn the_error_function_is_that_of_the_tables() {
        for (x, expected) in [
            (0.0, 0.0),
            (0.02, 0.022_564_574_7),
            (0.5, 0.520_499_877_8),
            (1.0, 0.842_700_792_9),
            (-2.0, -0.995_322_265_0),
            (5.0, 1.0),
        ] {
            assert!((erf(x) - expected).abs() < 1e-8, "erf({x})");
        }
    }

    fn still() -> BeamConfig {
        BeamConfig {
            turbulence_um: 0.0,
            translation_um: 0.0,
            pivot_urad: 0.0,
            intensity_drift_percent: 0.0,
            mounting_um: 0.0,
            radius_tolerance_percent: 0.0,
            detector_place_mm: [0.0; 3],
            ..BeamConfig::default()
        }
    }

    const ACROSS_X: [usize; 2] = [1, 2];

    fn quadrants(beam: &mut Beam, place: Place, motion: &Motion) -> [f64; 4] {
        let now = Time::from_seconds(1.0);
        beam.look(place, 0.2, (motion, ACROSS_X), now)
    }

    fn ratios([a, b, c, d]: [f64; 4]) -> [f64; 2] {
        let sum = a + b + c + d;
        [(a + d - b - c) / sum, (a + b - c - d) / sum]
    }

    /// 1.596 of ten thousandths of the radius.
    #[test]
    fn a_slide_that_goes_one_way_sees_its_spot_go_the_other_way() {
        let mut beam = Beam::new(&still(), 500.0, 0, 1);
        let motion = Motion {
            shift: [3e-6, 1e-7, -2e-7],
            turn: [0.0; 3],
        };
        let [y, z] = ratios(quadrants(&mut beam, Place::Slide, &motion));
        assert!((y + 1.595_769e-4).abs() < 1e-9 && (z - 3.191_538e-4).abs() < 1e-9);
        let end = quadrants(&mut beam, Place::End, &motion);
        assert_eq!(end, [2.0; 4], "the end sees the beam alone");
    }

    #[test]
    fn a_turn_moves_a_detector_that_is_off_the_middle() {
        let config = BeamConfig {
            detector_place_mm: [0.0, 0.0, 25.0],
            ..still()
        };
        let beam = Beam::new(&config, 500.0, 0, 1);
        let motion = Motion {
            shift: [0.0; 3],
            turn: [2e-5, 0.0, 0.0],
        };
        let [y, z] = beam.detector_m(&motion, ACROSS_X);
        assert!(
            (y + 25e-3 * 2e-5).abs() < 1e-12 && z.abs() < 1e-11,
            "{y} {z}"
        );
    }

    #[test]
    fn a_blocked_beam_is_dark_behind_the_obstacle_and_a_bright_one_twice_as_bright() {
        let mut beam = Beam::new(&still(), 500.0, 0, 1);
        let motion = Motion::default();
        beam.trouble.behind_slide = true;
        assert_eq!(quadrants(&mut beam, Place::Slide, &motion), [2.0; 4]);
        assert_eq!(quadrants(&mut beam, Place::End, &motion), [0.0; 4]);
        let mut beam = Beam::new(&still(), 500.0, 0, 1);
        beam.trouble.before_slide = true;
        assert_eq!(quadrants(&mut beam, Place::Slide, &motion), [0.0; 4]);
        let mut beam = Beam::new(&still(), 500.0, 0, 1);
        beam.trouble.bright = true;
        assert_eq!(quadrants(&mut beam, Place::Slide, &motion), [4.0; 4]);
    }

    /// A tenth of the light, a tenth of the radius beside: a hundredth less of eleven tenths.
    #[test]
    fn a_reflection_draws_a_detector_of_quadrants_towards_itself() {
        let mut beam = Beam::new(&still(), 500.0, 0, 1);
        let radius_m = beam.config.spot_radius_mm * 1e-3;
        *beam.trouble.reflection_mut(Place::Slide) = Some(Reflection {
            off_m: [0.1 * radius_m, 0.0],
            share: 0.1,
        });
        let motion = Motion::default();
        let [y, z] = ratios(quadrants(&mut beam, Place::Slide, &motion));
        let expected = erf(SQRT_2 * 0.1) * 0.1 / 1.1;
        assert!((y - expected).abs() < 1e-12 && z.abs() < 1e-12, "{y} {z}");
        let end = quadrants(&mut beam, Place::End, &motion);
        assert_eq!(end, [2.0; 4], "only the slide's splitter throws it back");
    }

    /// The beam that swings about its source is off by the share of the way.
    #[test]
    fn the_end_sees_more_of_a_swing_than_the_slide() {
        let config = BeamConfig {
            pivot_urad: 15.0,
            ..still()
        };
        let beam = Beam::new(&config, 500.0, 0, 1);
        let now = Time::from_seconds(1e4);
        let slide = beam.offset_m(beam.distance_m(Place::Slide, 0.2), now);
        let end = beam.offset_m(beam.distance_m(Place::End, 0.2), now);
        for (slide, end) in slide.into_iter().zip(end) {
            assert!((slide / end - 0.3 / 0.7).abs() < 1e-12);
        }
    }
}
