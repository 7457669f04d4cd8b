//! The six error motions of one slide on its guide, at a position and a warmth.
//!
//! Displacements are those of the slide's reference point, which is in the machine's zero when
//! the axis is at 0; rotations are about x, y and z. Cold they are smooth functions of position
//! (polynomials up to the third degree and three harmonics), each drawn by itself. Warmth adds
//! three things: the scale grows, the guide bends to an arc along which the slide pitches, and
//! the films under the slide grow and shift it without turning it.

use core::cell::Cell;
use core::f64::consts::{PI, TAU};

use units::portable::{atan, sin};
use units::{Radians, Time};

use super::config::{ErrorsConfig, VolumetricConfig};
use super::heat::AxisHeat;
use super::rigid::Vector;
use crate::random::Stream;

/// Scales are true at this temperature (ISO 1).
const REFERENCE_C: f64 = 20.0;
const SCAN_POINTS: usize = 201;

/// The error motions at one position.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Motion {
    /// Displacements along x, y, z.
    pub(super) shift: Vector,
    /// Rotations about x, y, z.
    pub(super) turn: Vector,
}

/// A smooth function of the position's share of the travel, 0 at 0.
#[derive(Clone, Debug)]
struct Curve {
    powers: [f64; 3],
    waves: [Wave; 3],
    size: f64,
}

#[derive(Clone, Copy, Debug)]
struct Wave {
    amplitude: f64,
    phase: f64,
    /// Its sine at the start, where the function is 0.
    at_start: f64,
}

impl Curve {
    /// Half as wide as `half_band`, over the travel.
    fn new(half_band: f64, straight: bool, stream: &mut Stream) -> Self {
        let mut power = |most: f64| stream.between(-most, most);
        let powers = [
            if straight { 0.0 } else { power(1.0) },
            power(2.0),
            power(4.0),
        ];
        let waves = [1.0, 2.0, 3.0].map(|order: f64| {
            let amplitude = stream.between(0.3, 1.0) / (order * order);
            let phase = stream.between(0.0, TAU);
            Wave {
                amplitude,
                phase,
                at_start: sin(phase),
            }
        });
        let mut curve = Self {
            powers,
            waves,
            size: 1.0,
        };
        let places = (0..SCAN_POINTS).map(|i| i as f64 / (SCAN_POINTS - 1) as f64);
        let values: Vec<f64> = places.map(|u| curve.at(u)).collect();
        let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let least = values.iter().copied().fold(f64::INFINITY, f64::min);
        curve.size = 2.0 * half_band / (most - least);
        curve
    }

    fn at(&self, u: f64) -> f64 {
        let [first, second, third] = self.powers;
        let bends = second * u * (u - 1.0) + third * u * (u - 0.5) * (u - 1.0);
        let waves = (1..).zip(&self.waves).map(|(order, wave)| {
            wave.amplitude * (sin(PI * f64::from(order) * u + wave.phase) - wave.at_start)
        });
        self.size * (first * u + bends + waves.sum::<f64>())
    }
}

/// How far warmth goes, with sign.
#[derive(Clone, Debug)]
struct Growth {
    expansion_per_k: f64,
    bow_m_per_k: f64,
    film_m: [f64; 2],
    film_roll: f64,
}

/// One guide with its slide.
#[derive(Clone, Debug)]
pub(super) struct Guide {
    axis: usize,
    /// Which way the slide goes as its coordinate grows: one with the workpiece goes back.
    way: f64,
    travel_m: f64,
    shifts: [Curve; 3],
    turns: [Curve; 3],
    /// Where the cold motions were asked for last, and what they were: a slide that stands is
    /// asked again and again.
    asked: Cell<(f64, Motion)>,
    growth: Growth,
    deliberate: Deliberate,
}

/// What the machine was built or has settled to on purpose.
#[derive(Clone, Copy, Debug)]
struct Deliberate {
    bow_m: f64,
    roll: f64,
    from_s: f64,
}

impl Guide {
    pub(super) fn new(config: &VolumetricConfig, axis: usize, seed: u64) -> Self {
        let mut stream = Stream::new(seed, &format!("volumetric guide {axis}"));
        let errors = &config.errors;
        let arcsec = |arcsec| Radians::from_arcsec(arcsec).value();
        let shift = |along: usize, stream: &mut Stream| match along == axis {
            true => Curve::new(errors.positioning_um * 1e-6, false, stream),
            false => Curve::new(errors.straightness_um * 1e-6, true, stream),
        };
        let turn = |about: usize, stream: &mut Stream| {
            let size = match about == axis {
                true => errors.roll_arcsec,
                false => errors.pitch_and_yaw_arcsec,
            };
            Curve::new(arcsec(size), true, stream)
        };
        let (workpiece_side, _) = config.chain.split_once('F').unwrap_or_default();
        let carries_workpiece = workpiece_side.contains(['X', 'Y', 'Z'][axis]);
        Self {
            axis,
            way: if carries_workpiece { -1.0 } else { 1.0 },
            travel_m: config.travel_mm[axis] * 1e-3,
            shifts: [0, 1, 2].map(|along| shift(along, &mut stream)),
            turns: [0, 1, 2].map(|about| turn(about, &mut stream)),
            asked: Cell::new((f64::NAN, Motion::default())),
            growth: Growth::new(config, axis, &mut stream),
            deliberate: Deliberate::of(errors, axis),
        }
    }

    /// Where the bow goes: up where that is sideways, along y for the z axis.
    const fn bow_direction(&self) -> usize {
        if self.axis == 2 { 1 } else { 2 }
    }

    /// At the share `u` of the travel.
    fn cold_motion(&self, u: f64) -> Motion {
        let (asked, known) = self.asked.get();
        if asked == u {
            return known;
        }
        let motion = Motion {
            shift: [0, 1, 2].map(|along| self.shifts[along].at(u)),
            turn: [0, 1, 2].map(|about| self.turns[about].at(u)),
        };
        self.asked.set((u, motion));
        motion
    }

    pub(super) fn motion(&self, position_m: f64, heat: &AxisHeat, now: Time) -> Motion {
        let u = position_m / self.travel_m;
        let mut motion = self.cold_motion(u);
        let growth = &self.growth;
        let warmer_k = heat.scale_c - REFERENCE_C;
        motion.shift[self.axis] += growth.expansion_per_k * warmer_k * position_m;
        self.bend(&mut motion, u, growth.bow_m_per_k * heat.gradient_k);
        let [first, second] = super::across(self.axis);
        motion.shift[first] += growth.film_m[0] * heat.film * sin(PI * u);
        motion.shift[second] += growth.film_m[1] * heat.film * u * u;
        motion.turn[self.axis] += growth.film_roll * heat.film * u;
        if now.seconds() >= self.deliberate.from_s {
            self.bend(&mut motion, u, self.deliberate.bow_m);
            motion.turn[self.axis] += self.deliberate.roll;
        }
        motion
    }

    /// An arc with its middle `bow_m` off; the slide turns with the slope.
    fn bend(&self, motion: &mut Motion, u: f64, bow_m: f64) {
        let direction = self.bow_direction();
        motion.shift[direction] += bow_m * 4.0 * u * (1.0 - u);
        let slope = self.way * bow_m * 4.0 * (1.0 - 2.0 * u) / self.travel_m;
        // The turn from the axis towards the direction: the third axis, by the right hand.
        let about = 3 - self.axis - direction;
        let sign = if (self.axis + 1) % 3 == direction {
            1.0
        } else {
            -1.0
        };
        motion.turn[about] += sign * atan(slope);
    }
}

impl Growth {
    fn new(config: &VolumetricConfig, axis: usize, stream: &mut Stream) -> Self {
        let heat = &config.heat;
        let mut signed = |size: f64| {
            let sign = if stream.chance(0.5) { 1.0 } else { -1.0 };
            sign * size * stream.between(0.7, 1.3)
        };
        let watched = config.roll.axis == axis || config.roll.further_axes.contains(&axis);
        let roll = Radians::from_arcsec(heat.film_roll_arcsec).value();
        Self {
            expansion_per_k: heat.scale_expansion_ppm_per_k * 1e-6,
            bow_m_per_k: signed(heat.bow_um_per_k * 1e-6),
            film_m: [(); 2].map(|()| signed(heat.film_um * 1e-6)),
            film_roll: signed(if watched { roll } else { 0.0 }),
        }
    }
}

impl Deliberate {
    fn of(errors: &ErrorsConfig, axis: usize) -> Self {
        let on = |slide: usize| if axis == slide { 1.0 } else { 0.0 };
        let roll = Radians::from_arcsec(errors.deliberate_roll_arcsec).value();
        Self {
            bow_m: on(0) * errors.deliberate_bow_um * 1e-6,
            roll: on(errors.deliberate_roll_axis) * roll,
            from_s: errors.deliberate_from_h * 3600.0,
        }
    }
}
