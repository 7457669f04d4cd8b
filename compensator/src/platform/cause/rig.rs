//! A platform of the tests' own, with a camera over it, calibrated as it is or as it is mistaken for.

use units::{Metres, Radians};

use super::super::{Platform, Pose};
use super::{Sighting, Tolerance};
pub(super) use crate::noise::Noise;

/// As the shipped platform permits.
pub(super) const TOLERANCE: Tolerance = Tolerance {
    size: Metres(20e-6),
    slope: 0.02,
};

/// What happens to it that no configuration explains, at most one of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Trouble {
    None,
    /// From this stop on the screw is off by so much, metres.
    Step(usize, f64),
    /// The screw stops at so much of its longest stroke.
    Stuck(f64),
    /// The camera's x moves by so much over the run, metres.
    Drift(f64),
    /// So many readings are off by up to so much, metres.
    Bad(usize, f64),
    /// The screw is off by so much at its ends, to the same side.
    Bent(f64),
    /// Every stop is off by such a standard deviation.
    Scatter(f64),
}

/// A platform whose screws have errors.
pub(super) struct Machine {
    pub(super) platform: Platform,
    pub(super) noise: Noise,
    /// Of each screw: slope, lost motion in metres.
    pub(super) screws: Vec<(f64, f64)>,
    pub(super) longest: f64,
    pub(super) steps: i32,
    /// Standard deviation of one reading, metres.
    pub(super) reading: f64,
    /// Where its camera's origin is in the body.
    pub(super) datum: Pose,
    /// Where each screw's index is.
    pub(super) homed: [Metres; 3],
    pub(super) trouble: Trouble,
    /// The screw in trouble.
    pub(super) troubled: usize,
}

impl Machine {
    /// One of any size, kind and noise within what a sound one may have.
    pub(super) fn drawn(seed: u64) -> Self {
        let mut noise = Noise(seed.wrapping_mul(0x9E37_79B9).wrapping_add(17));
        let mut between = |low: f64, high: f64| low + (high - low) * noise.uniform();
        let mm = Metres::from_mm;
        let travel = mm(20.0);
        let (a, b) = (mm(between(80.0, 400.0)), mm(between(-80.0, 80.0)));
        let kind = between(0.0, 3.0);
        let platform = if kind < 1.0 {
            Platform::uvw(a, b, travel)
        } else if kind < 2.0 {
            Platform::xxy(a, travel)
        } else {
            Platform::xy_theta(a, travel, travel)
        };
        // Long strokes of a short arm are turns that no such platform makes.
        let longest = between(0.5, 4.0) * 1e-3;
        // The slope moves a stroke's end by no more than a good half of what is permitted.
        let slope = (12e-6 / longest).min(0.6 * TOLERANCE.slope);
        let screws = (0..3).map(|_| (between(-slope, slope), between(0.0, 5e-6)));
        let screws = screws.collect();
        let steps = between(3.0, 10.99) as i32;
        let reading = 1e-6 * between(0.02_f64.ln(), 1.0_f64.ln()).exp();
        let datum = Pose {
            x: mm(between(-3.0, 3.0)),
            y: mm(between(-3.0, 3.0)),
            angle: Radians(between(-0.02, 0.02)),
        };
        let homed = [(); 3].map(|()| mm(between(-6.0, -2.0)));
        let troubled = (between(0.0, 3.0) as usize).min(2);
        Self {
            platform: platform.unwrap(),
            screws,
            longest,
            steps,
            reading,
            datum,
            homed,
            trouble: Trouble::None,
            troubled,
            noise,
        }
    }

    /// The strokes commanded: up and down again, one screw after the other; with the direction.
    fn plan(&self) -> Vec<(usize, f64, bool)> {
        let step = self.longest / f64::from(self.steps);
        let places = || (-self.steps..=self.steps).map(|it| f64::from(it) * step);
        let round = |screw| {
            let up = places().map(move |it| (screw, it, true));
            up.chain(places().rev().map(move |it| (screw, it, false)))
        };
        (0..3).flat_map(round).collect()
    }

    /// What is seen when `order[i]` does, `factors[i]` times as far, what screw i is commanded;
    /// poses go through `camera`.
    pub(super) fn calibrated(
        &mut self,
        order: [usize; 3],
        factors: [f64; 3],
        camera: impl Fn([f64; 3]) -> [f64; 3],
    ) -> (Pose, Vec<Sighting>) {
        let plan = self.plan();
        let last = plan.len() as f64;
        // Counted from where they were homed; at the other end where they go the other way. A coupling
        // came loose after that.
        let zeros = [0, 1, 2].map(|screw: usize| match factors[screw] {
            0.0 => 0.0,
            factor => self.homed[screw].value() * (factor.signum() - factor),
        });
        let reading = core::mem::take(&mut self.reading);
        let datum = self.seen(&zeros);
        self.reading = reading;
        let mut sightings = Vec::new();
        for (at, (screw, commanded, forward)) in plan.into_iter().enumerate() {
            let mut strokes = zeros;
            strokes[order[screw]] += self.stroke(order[screw], factors[screw] * commanded, forward);
            self.disturb(&mut strokes, at);
            let mut seen = self.seen(&strokes);
            if let Trouble::Drift(metres) = self.trouble {
                seen[0] += metres * at as f64 / last;
            }
            if let Trouble::Bad(count, most) = self.trouble
                && self.noise.uniform() < count as f64 / last
            {
                seen = seen.map(|it| it + self.noise.within(most));
            }
            let mut all = vec![Metres::ZERO; 3];
            all[screw] = Metres(commanded);
            let seen = Pose::of_raw(camera(seen));
            sightings.push(Sighting {
                commanded: all,
                seen,
            });
        }
        (Pose::of_raw(camera(datum)), sightings)
    }

    fn stroke(&mut self, screw: usize, turned: f64, forward: bool) -> f64 {
        let (slope, play) = self.screws[screw];
        let play = if forward { 0.0 } else { play };
        turned * (1.0 + slope) + play + 0.1e-6 * self.noise.normal()
    }

    fn disturb(&mut self, strokes: &mut [f64; 3], at: usize) {
        let stroke = &mut strokes[self.troubled];
        match self.trouble {
            Trouble::None | Trouble::Drift(_) | Trouble::Bad(..) => {}
            Trouble::Step(from, metres) if at >= from => *stroke += metres,
            Trouble::Step(..) => {}
            Trouble::Stuck(share) => *stroke = stroke.min(share * self.longest),
            Trouble::Bent(metres) => *stroke += metres * (*stroke / self.longest).powi(2),
            Trouble::Scatter(metres) => *stroke += metres * self.noise.normal(),
        }
    }

    /// Where the camera sees a platform whose screws have made these strokes.
    fn seen(&mut self, strokes: &[f64; 3]) -> [f64; 3] {
        let pose = self.platform.forward(&strokes.map(Metres)).unwrap().pose;
        let [x, y, angle] = pose.raw();
        let [datum_x, datum_y, datum_angle] = self.datum.raw();
        let (sin, cos) = angle.sin_cos();
        let mut noise = || self.reading * self.noise.normal();
        [
            x + cos * datum_x - sin * datum_y + noise(),
            y + sin * datum_x + cos * datum_y + noise(),
            // Marks 60 mm to either side of the middle.
            angle + datum_angle + noise() / 0.06,
        ]
    }
}

/// As it is configured.
pub(super) const OWN: [usize; 3] = [0, 1, 2];
pub(super) const ONCE: [f64; 3] = [1.0; 3];
pub(super) const fn as_is(pose: [f64; 3]) -> [f64; 3] {
    pose
}
