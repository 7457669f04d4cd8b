//! Places of an emulated machine over time, by its plant: what its axes truly did.

use core::time::Duration;

use mock_bus::simulation::Simulation;
use units::Time;

/// The places of a machine's directions at one moment, in metres and radians.
type Places = Vec<f64>;

/// Two samples are so far apart at least.
const EVERY: Duration = Duration::from_millis(1);
/// A speed is judged over so long at least.
const JUDGED_OVER: Duration = Duration::from_millis(50);

/// What the plant of a machine did, sample by sample.
///
/// The directions are, in order: the scale of a linear axis; the angle of a table; the scales of three axes; the
/// strokes of a platform's screws, and x, y and the angle of its pose.
#[derive(Clone, Debug, Default)]
pub struct PlantTrace {
    samples: Vec<(Time, Places)>,
}

impl PlantTrace {
    /// Takes down where everything is `now`.
    pub fn note(&mut self, now: Time, simulation: &Simulation) {
        let last = self.samples.last();
        if last.is_none_or(|sample| now.since(sample.0) >= EVERY) {
            self.samples.push((now, places(simulation)));
        }
    }

    /// How many samples there are.
    pub const fn len(&self) -> usize {
        self.samples.len()
    }

    /// Whether there are none.
    pub const fn is_empty(&self) -> bool {
        self.samples.is_empty()
    }

    /// The greatest speed of direction `at`, judged over 50 ms or more.
    pub fn fastest(&self, at: usize) -> f64 {
        self.fastest_of(|from, to| to[at] - from[at])
    }

    /// The greatest speed along the directions `parts` together.
    pub fn fastest_along(&self, parts: &[usize]) -> f64 {
        self.fastest_of(|from, to| {
            let squares = parts.iter().map(|at| (to[*at] - from[*at]).powi(2));
            squares.sum::<f64>().sqrt()
        })
    }

    fn fastest_of(&self, way: impl Fn(&[f64], &[f64]) -> f64) -> f64 {
        let mut begin = 0;
        let mut fastest = 0.0_f64;
        for (now, to) in &self.samples {
            while now.since(self.samples[begin + usize::from(begin + 1 < self.samples.len())].0)
                >= JUDGED_OVER
            {
                begin += 1;
            }
            let (since, from) = &self.samples[begin];
            let took = now.since(*since);
            if took >= JUDGED_OVER {
                fastest = fastest.max(way(from, to).abs() / took.as_secs_f64());
            }
        }
        fastest
    }

    /// How far direction `at` was beyond where it was first, towards growing places.
    pub fn ahead(&self, at: usize) -> f64 {
        let first = self.samples.first().map_or(0.0, |sample| sample.1[at]);
        let places = self.samples.iter().map(|sample| sample.1[at]);
        places.fold(0.0, |most, place| f64::max(most, place - first))
    }

    /// Where direction `at` was last.
    pub fn last(&self, at: usize) -> Option<f64> {
        self.samples.last().map(|sample| sample.1[at])
    }
}

fn places(simulation: &Simulation) -> Places {
    let truth = simulation.truth();
    if let Some(volume) = truth.volumetric() {
        return volume.scales().map(|scale| scale.value()).to_vec();
    }
    if let Some(platform) = truth.platform() {
        let strokes = (0..platform.screws()).map(|screw| platform.stroke(screw).value());
        let pose = platform.nominal_pose();
        let pose = [pose.x.value(), pose.y.value(), pose.angle.value()];
        return strokes.chain(pose).collect();
    }
    if let Some(table) = truth.table() {
        return vec![table.angle().value()];
    }
    vec![truth.scale_position().value()]
}
